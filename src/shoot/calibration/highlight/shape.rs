//! Shapes on a grid: opening of parts, to cut off thin streaks.

use super::grid::Grid;

/// A part of the grid within its bounding box, with a margin.
struct Patch {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    inside: Vec<bool>,
}

impl Patch {
    /// The cells with a margin of `margin` cells, clipped to the grid plus one.
    fn new(cells: &[u32], grid: &Grid, margin: usize) -> Self {
        let xs = || cells.iter().map(|&c| c as usize % grid.width);
        let ys = || cells.iter().map(|&c| c as usize / grid.width);
        // Counted from one, so that the margin at the grid's border is not negative.
        let low = |v: Option<usize>| (v.unwrap_or(0) + 1).saturating_sub(margin);
        let high = |v: Option<usize>, size: usize| (v.unwrap_or(0) + 1 + margin).min(size + 1);
        let (left, top) = (low(xs().min()), low(ys().min()));
        let (right, bottom) = (high(xs().max(), grid.width), high(ys().max(), grid.height));
        let (width, height) = (right + 1 - left, bottom + 1 - top);
        let mut patch = Self { left, top, width, height, inside: vec![false; width * height] };
        for (x, y) in xs().zip(ys()) {
            patch.inside[(y + 1 - top) * width + x + 1 - left] = true;
        }
        patch
    }

    /// Grid cell at a place of the patch; `None` outside the grid.
    fn cell(&self, i: usize, grid: &Grid) -> Option<u32> {
        let (x, y) = ((self.left + i % self.width).checked_sub(1)?, (self.top + i / self.width).checked_sub(1)?);
        (x < grid.width && y < grid.height).then_some((y * grid.width + x) as u32)
    }

    /// Squared distance of each place to the nearest one for which `target` holds (Felzenszwalb and Huttenlocher
    /// 2012: lower envelopes of parabolas, along columns, then rows).
    fn squared_distances(&self, target: impl Fn(usize) -> bool) -> Vec<f32> {
        let far = (self.width * self.width + self.height * self.height) as f32;
        let mut field: Vec<f32> = (0..self.inside.len()).map(|i| if target(i) { 0.0 } else { far }).collect();
        let mut line = Vec::new();
        for x in 0..self.width {
            line.clear();
            line.extend((0..self.height).map(|y| field[y * self.width + x]));
            for (y, value) in envelope(&line).into_iter().enumerate() {
                field[y * self.width + x] = value;
            }
        }
        for row in field.chunks_mut(self.width) {
            let lowered = envelope(row);
            row.copy_from_slice(&lowered);
        }
        field
    }
}

/// min over j of (i − j)² + values_j, for each i.
fn envelope(values: &[f32]) -> Vec<f32> {
    let mut lowest: Vec<usize> = Vec::with_capacity(values.len());
    let mut from: Vec<f32> = Vec::with_capacity(values.len());
    let square = |i: usize| (i * i) as f32;
    for (i, value) in values.iter().enumerate() {
        let mut start = f32::NEG_INFINITY;
        while let Some(&j) = lowest.last() {
            start = ((value + square(i)) - (values[j] + square(j))) / (2.0 * (i - j) as f32);
            if start > from[lowest.len() - 1] {
                break;
            }
            lowest.pop();
            from.pop();
            start = f32::NEG_INFINITY;
        }
        lowest.push(i);
        from.push(start);
    }
    let mut k = 0;
    (0..values.len())
        .map(|i| {
            while k + 1 < lowest.len() && from[k + 1] < i as f32 {
                k += 1;
            }
            square(i.abs_diff(lowest[k])) + values[lowest[k]]
        })
        .collect()
}

/// Radius in cells of the largest disc inside a part.
pub(super) fn inner_radius(part: &[u32], grid: &Grid) -> f32 {
    let patch = Patch::new(part, grid, 1);
    let squares = patch.squared_distances(|i| !patch.inside[i]);
    squares.into_iter().fold(0.0, f32::max).sqrt()
}

/// Morphological opening of a part by discs of `share` of its largest disc's radius: streaks narrower than these
/// discs are cut off.
pub(super) fn opened(part: &[u32], grid: &Grid, share: f32) -> Vec<u32> {
    let patch = Patch::new(part, grid, 1);
    let depth = patch.squared_distances(|i| !patch.inside[i]);
    let radius = share * depth.iter().copied().fold(0.0, f32::max).sqrt();
    let centres = patch.squared_distances(|i| depth[i] >= radius * radius);
    (0..patch.inside.len())
        .filter(|&i| patch.inside[i] && centres[i] < radius * radius)
        .filter_map(|i| patch.cell(i, grid))
        .collect()
}

/// Cells of the ball within `reach` cells of the given ones, those included.
pub(super) fn widened(cells: &[u32], grid: &Grid, reach: f32) -> Vec<u32> {
    let patch = Patch::new(cells, grid, reach.ceil() as usize);
    let squares = patch.squared_distances(|i| patch.inside[i]);
    (0..squares.len())
        .filter(|&i| squares[i] <= reach * reach)
        .filter_map(|i| patch.cell(i, grid))
        .filter(|&cell| grid.is_ball(cell as usize))
        .collect()
}
