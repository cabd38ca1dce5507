//! Brush marks on pixels.

use base::error::{Error, Result};
use imaging::{Mask, Raster};

/// Knowledge of each pixel: 1 is subject, −1 is background, 0 is unknown, and values between are uncertain. A brush
/// gives 1 and −1; seeds carried from another frame are weaker.
#[derive(Clone, Debug, PartialEq)]
pub struct Seeds(Mask);

/// Side of a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Subject.
    Keep,
    /// Background.
    Remove,
}

impl Seeds {
    /// Seeds of an unpainted picture with these columns and rows.
    pub fn none((width, height): (usize, usize)) -> Self {
        Self(Mask::filled(width, height, 0.0))
    }

    /// Seeds from values, clamped to `[-1, 1]`; NaN becomes unknown.
    pub fn from_values(values: Mask) -> Self {
        Self(values.map(|v| if v.is_nan() { 0.0 } else { v.clamp(-1.0, 1.0) }))
    }

    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        self.0.size()
    }

    /// Values from −1 to 1.
    pub fn values(&self) -> &Mask {
        &self.0
    }

    /// True if nothing is painted.
    pub fn is_empty(&self) -> bool {
        self.0.pixels.iter().all(|v| *v == 0.0)
    }

    /// True if some pixels are certainly subject and some certainly background.
    pub fn hold_both(&self) -> bool {
        [1.0, -1.0].iter().all(|side| self.0.pixels.contains(side))
    }

    /// Paints a stroke: pixels within `radius` of a line through `points`, in pixels from the upper left corner of
    /// the upper left pixel. It overwrites earlier strokes. NaN points are skipped.
    pub fn paint(&mut self, side: Side, radius: f32, points: &[[f32; 2]]) {
        let value = match side {
            Side::Keep => 1.0,
            Side::Remove => -1.0,
        };
        let sound: Vec<[f32; 2]> = (points.iter().copied()).filter(|p| p.iter().all(|v| v.is_finite())).collect();
        if let [point] = sound[..] {
            self.segment(value, radius, point, point);
        }
        for pair in sound.windows(2) {
            self.segment(value, radius, pair[0], pair[1]);
        }
    }

    fn segment(&mut self, value: f32, radius: f32, from: [f32; 2], to: [f32; 2]) {
        // A brush finer than a pixel paints the pixel under it.
        let radius = if radius.is_nan() { 0.0 } else { radius }.max(0.71);
        let (width, height) = self.0.size();
        let range = |axis: usize, length: usize| {
            let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
            let first = (low - radius).floor().clamp(0.0, length as f32) as usize;
            let last = (high + radius).ceil().clamp(0.0, length as f32) as usize;
            first..last
        };
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0] * along[0] + along[1] * along[1];
        for y in range(1, height) {
            for x in range(0, width) {
                let at = [x as f32 + 0.5 - from[0], y as f32 + 0.5 - from[1]];
                let share =
                    if length > 0.0 { ((at[0] * along[0] + at[1] * along[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
                let off = [at[0] - share * along[0], at[1] - share * along[1]];
                if off[0] * off[0] + off[1] * off[1] <= radius * radius {
                    self.0.pixels[y * width + x] = value;
                }
            }
        }
    }

    /// Takes over the more certain values of `others`, which have the same size.
    pub fn join(&mut self, others: &Self) {
        for (own, other) in self.0.pixels.iter_mut().zip(&others.0.pixels) {
            if other.abs() > own.abs() {
                *own = *other;
            }
        }
    }

    /// Seeds at another size. A reduced pixel gets its most certain value, or 0 if both sides are equally certain.
    /// A larger size repeats pixels.
    pub fn resized(&self, (width, height): (usize, usize)) -> Self {
        let (w, h) = self.0.size();
        if (w, h) == (width, height) {
            return self.clone();
        }
        let range = |at: usize, count: usize, full: usize| {
            let first = at * full / count.max(1);
            first..((at + 1) * full).div_ceil(count.max(1)).max(first + 1).min(full)
        };
        Self(Raster::from_fn(width, height, |x, y| {
            let (mut most, mut least) = (0.0_f32, 0.0_f32);
            for row in range(y, height, h) {
                for column in range(x, width, w) {
                    let value = self.0.at(column, row);
                    (most, least) = (most.max(value), least.min(value));
                }
            }
            match most.partial_cmp(&-least) {
                Some(std::cmp::Ordering::Greater) => most,
                Some(std::cmp::Ordering::Less) => least,
                _ => 0.0,
            }
        }))
    }

    /// Sets painted pixels exactly in a matte of the same size.
    pub fn force(&self, alpha: &mut Mask) {
        for (alpha, told) in alpha.pixels.iter_mut().zip(&self.0.pixels) {
            if told.abs() >= 1.0 {
                *alpha = f32::from(u8::from(*told > 0.0));
            }
        }
    }

    /// Refuses seeds that differ in size from the picture.
    pub(super) fn check(&self, size: (usize, usize)) -> Result<()> {
        if self.size() == size {
            return Ok(());
        }
        Err(Error::other_size(("the strokes", self.size()), ("the picture", size), "Paint on this picture"))
    }
}
