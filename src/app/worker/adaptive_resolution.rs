//! Picture size while something moves: the largest that can be made within one frame of the window.

use super::prediction::PredictedFrame;
use compositor::{Field, Plate, Reuse};
use imaging::Mask;
use std::sync::Arc;

/// One frame of a window at 60 Hz, in milliseconds.
pub const WINDOW_FRAME_MS: f64 = 1000.0 / 60.0;

/// Reduction factors: full-size pixels along each axis per reduced pixel.
const FACTORS: [usize; 3] = [1, 2, 4];

/// Chooses the reduction from the render times of past pictures.
pub struct AdaptiveResolution {
    budget_ms: f64,
    factor: usize,
    reduced: Option<ReducedFrame>,
}

/// A frame below its full size.
pub struct ReducedFrame {
    of: Arc<PredictedFrame>,
    factor: usize,
    /// The part with fewer pixels.
    pub reduced: Reduced,
    pub reuse: Reuse,
}

/// The reduced part of a frame.
pub enum Reduced {
    /// The plate that is multiplied by the light.
    Plate(Plate),
    /// The OLATs and their matte, if they have the picture's size.
    Field(Field, Mask),
}

impl AdaptiveResolution {
    /// Creates a controller with a time budget per picture of `budget_ms` milliseconds.
    pub fn within(budget_ms: f64) -> Self {
        Self { budget_ms, factor: 1, reduced: None }
    }

    /// Returns the factor for the next picture while something moves.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// Records the time, in milliseconds, of a picture made at this factor.
    pub fn took(&mut self, factor: usize, ms: f64) {
        // Time is proportional to the number of pixels.
        let full_ms = ms * (factor * factor) as f64;
        let within = |budget_ms: f64| {
            let fits = |factor: &usize| full_ms / (factor * factor) as f64 <= budget_ms;
            FACTORS.into_iter().find(fits).unwrap_or(FACTORS[2])
        };
        // Shrinks when it must; grows only with time to spare, so that it does not flicker between two sizes.
        self.factor = (self.factor).clamp(within(self.budget_ms), within(0.5 * self.budget_ms));
    }

    /// Returns the frame reduced by this factor, computed once. None if it is quick to light at full size.
    pub fn reduced(&mut self, of: &Arc<PredictedFrame>, factor: usize) -> Option<&mut ReducedFrame> {
        let known = |frame: &ReducedFrame| frame.factor == factor && Arc::ptr_eq(&frame.of, of);
        if !self.reduced.as_ref().is_some_and(known) {
            let reduced = match &of.plate {
                Some(_) if matches!(*of.field, Field::Gpu(..)) => return None,
                Some(plate) => Reduced::Plate(plate.shrunk(factor)),
                None => {
                    let (field, mask) = of.field.shrunk(&of.frame.mask, factor)?;
                    Reduced::Field(field, mask)
                }
            };
            self.reduced = Some(ReducedFrame { of: of.clone(), factor, reduced, reuse: Reuse::default() });
        }
        self.reduced.as_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_smaller_only_where_the_full_size_takes_longer_than_a_frame() {
        let mut resolution = AdaptiveResolution::within(WINDOW_FRAME_MS);
        // 128 pixels, and a few at 512.
        for ms in [3.0, 16.0, 3.0] {
            resolution.took(1, ms);
            assert_eq!(resolution.factor(), 1);
        }
        resolution.took(1, 45.0);
        assert_eq!(resolution.factor(), 2);
        // Half size takes as long as a quarter of the pixels, plus overhead.
        resolution.took(2, 12.5);
        assert_eq!(resolution.factor(), 2);
        resolution.took(2, 40.0);
        assert_eq!(resolution.factor(), 4);
        resolution.took(4, 900.0);
        assert_eq!(resolution.factor(), 4, "no smaller size exists");
        // The next picture makes up for one slow picture, such as the first.
        resolution.took(4, 0.2);
        assert_eq!(resolution.factor(), 1);
    }

    #[test]
    fn the_size_does_not_go_to_and_fro() {
        let mut resolution = AdaptiveResolution::within(10.0);
        resolution.took(1, 11.0);
        for _ in 0..9 {
            assert_eq!(resolution.factor(), 2);
            resolution.took(2, 9.0 / 4.0);
        }
        resolution.took(2, 4.0 / 4.0);
        assert_eq!(resolution.factor(), 1);
    }
}
