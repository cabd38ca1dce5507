//! Places of a frame's pixels in a pose.

use glam::Mat3;
use imaging::Raster;

/// The four pixels around a place in a picture that is not empty, inside it, with their shares.
#[inline(always)]
pub fn around([x, y]: [f32; 2], (width, height): (usize, usize)) -> [(usize, f32); 4] {
    let axis = |v: f32, length: usize| {
        let v = v.clamp(0.0, (length - 1) as f32);
        let low = v as usize;
        (low, (low + 1).min(length - 1), v - low as f32)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (axis(x, width), axis(y, height));
    [
        (y0 * width + x0, (1.0 - fx) * (1.0 - fy)),
        (y0 * width + x1, fx * (1.0 - fy)),
        (y1 * width + x0, (1.0 - fx) * fy),
        (y1 * width + x1, fx * fy),
    ]
}

/// A pose matched with a frame.
pub struct Match {
    /// Offsets in pixels: pixel (x, y) of the frame lies at (x + dx, y + dy) in the pose.
    pub offsets: Vec<[f32; 2]>,
    pub size: (usize, usize),
    /// Rotation of the head from the pose to the frame.
    pub turn: Mat3,
    /// Rotation of the whole subject, for all but the head.
    pub body: Mat3,
}

impl Match {
    /// Place in the pose of a pixel of the frame: the four pixels around it, inside the picture, with their shares.
    #[inline(always)]
    pub fn place(&self, (x, y): (usize, usize)) -> [(usize, f32); 4] {
        let [dx, dy] = self.offsets[y * self.size.0 + x];
        around([x as f32 + dx, y as f32 + dy], self.size)
    }

    /// A picture of the pose, pulled over.
    pub fn pulled(&self, picture: &Raster<f32>) -> Raster<f32> {
        let (width, height) = self.size;
        Raster::from_fn(width, height, |x, y| self.place((x, y)).iter().map(|&(p, w)| w * picture.pixels[p]).sum())
    }

    /// Squared forward–backward error of each pixel, in pixels: there by the match and back by `back`, the offsets of the pose's
    /// pixels in the frame.
    pub fn forward_backward(&self, back: &[[f32; 2]]) -> Vec<f32> {
        let round = self.then(back);
        round.into_iter().map(|[x, y]| x * x + y * y).collect()
    }

    /// These offsets, and from there on by `more`.
    pub fn then(&self, more: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let (width, height) = self.size;
        let follow = |p: usize| {
            let places = self.place((p % width, p / width));
            std::array::from_fn(|c| {
                let further = places.iter().map(|&(q, w)| w * more[q][c]);
                self.offsets[p][c] + further.sum::<f32>()
            })
        };
        (0..width * height).map(follow).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_backward_errors_are_where_the_match_leads_elsewhere() {
        let mut offsets = vec![[2.0, -1.0]; 64];
        offsets[27] = [-1.0, 3.0];
        let found = Match { offsets, size: (8, 8), turn: Mat3::IDENTITY, body: Mat3::IDENTITY };
        let errors = found.forward_backward(&[[-2.0, 1.0]; 64]);
        for (p, square) in errors.into_iter().enumerate() {
            assert_eq!(square, if p == 27 { 25.0 } else { 0.0 });
        }
    }

    #[test]
    fn a_place_lies_between_four_pixels() {
        for (place, at) in [([1.25, 0.0], 1.25), ([-3.0, 2.0], 8.0), ([9.0, 9.0], 15.0)] {
            let sum: f32 = around(place, (4, 4)).iter().map(|&(q, w)| q as f32 * w).sum();
            assert_eq!(sum, at);
        }
    }
}
