//! Detection of interview frames that show a pose, for a comparison pixel by pixel.

use super::super::code_values::{CodeValues, ResponseTable, STEPS};
use super::matte::{SOLID, margin};
use imaging::Mask;

/// A pose and a frame that may show it.
#[derive(Clone)]
pub(crate) struct FrameMatch {
    /// Indices of both in the project.
    pub pose: usize,
    pub frame: usize,
    /// Pixels of the pose that are also the subject in the frame.
    pub pixels: Vec<MatchedPixel>,
    /// Least mismatch under the provisional responses: the distance of the two pictures, divided by the distance of the pose
    /// from the frame shifted by the matte's margin. 0 is a perfect match; at 1 a shift makes no difference.
    pub mismatch: f32,
}

impl FrameMatch {
    /// Largest mismatch of a match. An offset by a third of the shift, less than a pixel in pictures of 256 pixels,
    /// already reaches it.
    pub const MAX_MISMATCH: f32 = 0.3;

    /// Mismatch under a response, given the pose's samples relit under it, in light.
    pub fn mismatch_under(&self, relit: &[[f32; 3]], table: &ResponseTable) -> f32 {
        let sum = |pixel: [f32; 3]| f64::from(pixel[0] + pixel[1] + pixel[2]);
        let light = |pixel: &MatchedPixel| relit.get(pixel.sample as usize).copied().unwrap_or([0.0; 3]);
        // One factor removes the exposure and most of the error of a provisional response.
        let seen: f64 = self.pixels.iter().map(|p| sum(table.rgb(p.here))).sum();
        let expected: f64 = self.pixels.iter().map(|p| sum(light(p))).sum();
        if !(seen > 0.0 && expected > 0.0) {
            return 1.0;
        }
        let exposure = (seen / expected) as f32;
        let (mut here, mut aside) = (0.0, 0.0);
        for pixel in &self.pixels {
            let expected = light(pixel).map(|l| table.encode(exposure * l));
            let square = |code: &CodeValues| -> f64 {
                let off = |c: usize| f32::from(code[c]) / f32::from(STEPS) - expected[c];
                (0..3).map(|c| f64::from(off(c)).powi(2)).sum()
            };
            here += square(&pixel.here);
            aside += pixel.aside.iter().map(square).sum::<f64>() / 4.0;
        }
        if aside > 0.0 { (here / aside).sqrt() as f32 } else { 1.0 }
    }

    /// The better of two.
    pub fn nearer(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.mismatch < a.mismatch { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// A pixel of a pose in the frame.
#[derive(Clone)]
pub(crate) struct MatchedPixel {
    /// Index among the pose's samples.
    pub sample: u32,
    /// Index in the picture, row by row.
    pub place: u32,
    /// Code values of the frame at the pixel, and on four sides at the distance of the matte's margin.
    pub here: CodeValues,
    aside: [CodeValues; 4],
}

/// Samples of a pose for the search of its frame.
pub(super) struct PoseSamples {
    pose: usize,
    size: (usize, usize),
    places: Vec<usize>,
    /// Pixels relit under each provisional response, in light.
    relit: Vec<Vec<[f32; 3]>>,
}

impl PoseSamples {
    pub fn new(pose: usize, size: (usize, usize), places: Vec<usize>, relit: Vec<Vec<[f32; 3]>>) -> Self {
        Self { pose, size, places, relit }
    }

    /// Compares the pose with a frame. `None` if their sizes differ, or if less than nine tenths of the pose's
    /// pixels are the subject in the frame too.
    pub fn compare(
        &self,
        frame: usize,
        mask: &Mask,
        picture: &[CodeValues],
        provisional: &[ResponseTable],
    ) -> Option<FrameMatch> {
        if mask.size() != self.size {
            return None;
        }
        let (width, step) = (mask.width, margin(mask.width));
        // The samples keep this margin from the picture's edge, so these places are inside.
        let around = |place: usize| [place - step, place + step, place - step * width, place + step * width];
        let is_solid = |place: usize| mask.pixels[place] > SOLID;
        let shared: Vec<usize> = (0..self.places.len())
            .filter(|&i| is_solid(self.places[i]) && around(self.places[i]).into_iter().all(is_solid))
            .collect();
        if shared.is_empty() || 10 * shared.len() < 9 * self.places.len() {
            return None;
        }
        let pixels = shared
            .iter()
            .map(|&i| MatchedPixel {
                sample: i as u32,
                place: self.places[i] as u32,
                here: picture[self.places[i]],
                aside: around(self.places[i]).map(|place| picture[place]),
            })
            .collect();
        let mut found = FrameMatch { pose: self.pose, frame, pixels, mismatch: 1.0 };
        let mismatches = self.relit.iter().zip(provisional);
        found.mismatch = mismatches.map(|(relit, table)| found.mismatch_under(relit, table)).fold(1.0, f32::min);
        Some(found)
    }
}
