//! A rectangle of the picture for measurements.

/// The columns `left..right` and rows `top..bottom` of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    pub left: usize,
    pub top: usize,
    pub right: usize,
    pub bottom: usize,
}

impl Region {
    /// A single pixel, by column and row.
    pub fn pixel([x, y]: [usize; 2]) -> Self {
        Self { left: x, top: y, right: x.saturating_add(1), bottom: y.saturating_add(1) }
    }

    /// The region between two corners, given as shares of width and height, including pixels that it only touches.
    /// `size`: columns and rows of the picture. None if no part of the picture is inside.
    pub fn between(one: [f32; 2], other: [f32; 2], size: [usize; 2]) -> Option<Self> {
        let along = |axis: usize| {
            let length = size[axis] as f32;
            if one[axis].is_nan() || other[axis].is_nan() {
                return None;
            }
            let (low, high) = (one[axis].min(other[axis]), one[axis].max(other[axis]));
            let low = (low.max(0.0) * length).floor();
            let high = (high.min(1.0) * length).ceil();
            (low < high).then_some((low as usize, high as usize))
        };
        let ((left, right), (top, bottom)) = (along(0)?, along(1)?);
        Some(Self { left, top, right, bottom })
    }

    /// The part inside a picture of this many columns and rows; None if there is none.
    pub fn inside(self, [columns, rows]: [usize; 2]) -> Option<Self> {
        let inside = Self { right: self.right.min(columns), bottom: self.bottom.min(rows), ..self };
        (inside.left < inside.right && inside.top < inside.bottom).then_some(inside)
    }

    /// The same region at another picture size, including pixels that it only touches. Sizes are columns and rows.
    pub fn scaled(self, from: [usize; 2], to: [usize; 2]) -> Self {
        let low = |at: usize, axis: usize| at * to[axis] / from[axis].max(1);
        let high = |at: usize, axis: usize| (at * to[axis]).div_ceil(from[axis].max(1));
        Self {
            left: low(self.left, 0),
            top: low(self.top, 1),
            right: high(self.right, 0),
            bottom: high(self.bottom, 1),
        }
    }

    /// Columns and rows.
    pub fn size(self) -> [usize; 2] {
        [self.right.saturating_sub(self.left), self.bottom.saturating_sub(self.top)]
    }

    /// The pixels of the region, row by row, in a picture with this many columns. Pixels outside the picture are
    /// skipped.
    pub fn pixels<T>(self, pixels: &[T], columns: usize) -> impl Iterator<Item = &T> {
        self.every(1, pixels, columns)
    }

    /// The same for every `step`-th row.
    pub fn every<T>(self, step: usize, pixels: &[T], columns: usize) -> impl Iterator<Item = &T> {
        let (left, right) = (self.left.min(columns), self.right.min(columns));
        let rows = (self.top..self.bottom).step_by(step.max(1));
        rows.flat_map(move |row| {
            let row = row * columns;
            pixels.get(row + left..row + right).unwrap_or_default()
        })
    }
}

/// Most pixels counted of a moving picture; a still picture is counted in full.
const MOST: usize = 1 << 18;

/// Step between the counted rows of a picture with this many columns and rows. `moves`: the picture changes.
pub fn counted_rows([columns, rows]: [usize; 2], moves: bool) -> usize {
    if moves { columns.saturating_mul(rows).div_ceil(MOST).max(1) } else { 1 }
}

/// The mean of RGB values; None without values.
pub fn mean(values: impl Iterator<Item = [f32; 3]>) -> Option<[f32; 3]> {
    let (mut sum, mut count) = ([0f64; 3], 0usize);
    for value in values {
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += f64::from(value);
        }
        count += 1;
    }
    (count > 0).then(|| sum.map(|sum| (sum / count as f64) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_in_any_order_enclose_the_pixels_that_they_touch() {
        let size = [10, 20];
        let wanted = Region { left: 2, top: 5, right: 6, bottom: 11 };
        assert_eq!(Region::between([0.25, 0.52], [0.55, 0.25], size), Some(wanted));
        assert_eq!(wanted.size(), [4, 6]);
        let all = Region::between([-3.0, 2.0], [9.0, -1.0], size);
        assert_eq!(all.map(Region::size), Some(size));
        for beside in [[1.2, 0.5], [-0.1, 0.5], [f32::NAN, 0.5]] {
            let [x, y] = beside;
            assert_eq!(Region::between([x, 0.1], [x, y], size), None);
        }
    }

    #[test]
    fn a_region_counts_its_own_pixels_in_pictures_of_any_size() {
        let pixels: Vec<usize> = (0..12).collect();
        let region = Region { left: 1, top: 1, right: 3, bottom: 3 };
        let found: Vec<usize> = region.pixels(&pixels, 4).copied().collect();
        assert_eq!(found, [5, 6, 9, 10]);
        let found: Vec<usize> = region.every(2, &pixels, 4).copied().collect();
        assert_eq!(found, [5, 6]);
        assert_eq!(region.pixels(&pixels[..6], 4).count(), 0, "incomplete rows");
        assert_eq!(region.inside([2, 9]).map(Region::size), Some([1, 2]));
        assert_eq!(region.inside([1, 9]), None);
        assert_eq!(region.scaled([4, 4], [2, 2]).size(), [2, 2]);
        assert_eq!(Region::pixel([3, 2]).scaled([4, 4], [2, 2]).size(), [1, 1]);
        for (size, moves, rows) in
            [([64, 64], true, 1), ([1080, 1920], true, 8), ([1080, 1920], false, 1), ([0, 0], true, 1)]
        {
            assert_eq!(counted_rows(size, moves), rows, "{size:?}");
        }
        assert_eq!(mean(std::iter::empty()), None);
        let two = [[0.0, 1.0, 2.0], [1.0, 2.0, 4.0]];
        assert_eq!(mean(two.into_iter()), Some([0.5, 1.5, 3.0]));
    }
}
