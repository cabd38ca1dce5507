//! Where the pixels of a frame lie in a pose.

use glam::Mat3;
use imaging::Raster;

/// A pose matched with a frame.
pub struct Match {
    /// Offsets in pixels: pixel (x, y) of the frame lies at (x + dx, y + dy) in the pose.
    pub offsets: Vec<[f32; 2]>,
    pub size: (usize, usize),
    /// Rotation of the head from the pose to the frame.
    pub turn: Mat3,
}

impl Match {
    /// Place in the pose of a pixel of the frame: the four pixels around it, inside the picture, with their shares.
    pub fn place(&self, (x, y): (usize, usize)) -> [(usize, f32); 4] {
        let (width, height) = self.size;
        let [dx, dy] = self.offsets[y * width + x];
        let at = |v: usize, d: f32, length: usize| {
            let v = (v as f32 + d).clamp(0.0, (length - 1) as f32);
            let low = v.floor() as usize;
            (low, (low + 1).min(length - 1), v - low as f32)
        };
        let (x0, x1, fx) = at(x, dx, width);
        let (y0, y1, fy) = at(y, dy, height);
        [
            (y0 * width + x0, (1.0 - fx) * (1.0 - fy)),
            (y0 * width + x1, fx * (1.0 - fy)),
            (y1 * width + x0, (1.0 - fx) * fy),
            (y1 * width + x1, fx * fy),
        ]
    }

    /// A picture of the pose, pulled over.
    pub fn pulled(&self, picture: &Raster<f32>) -> Raster<f32> {
        let (width, height) = self.size;
        Raster::from_fn(width, height, |x, y| {
            self.place((x, y))
                .iter()
                .map(|&(p, w)| w * picture.pixels[p])
                .sum()
        })
    }

    /// Offsets that go through `more` first: from the frame to where the pose was pulled to, and on.
    pub fn followed(&self, more: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
        let through = Self {
            offsets: more,
            ..*self
        };
        let (width, height) = self.size;
        let follow = |p: usize| {
            let places = through.place((p % width, p / width));
            std::array::from_fn(|c| {
                through.offsets[p][c]
                    + places
                        .iter()
                        .map(|&(q, w)| w * self.offsets[q][c])
                        .sum::<f32>()
            })
        };
        (0..width * height).map(follow).collect()
    }
}
