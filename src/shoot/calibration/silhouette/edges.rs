//! Edges of a picture: place and direction of the fastest change of brightness or colour.

use glam::{DVec2, Vec2};
use imaging::Raster;
use rayon::prelude::*;

/// A place of fastest change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// In pixels from the top left corner, located to a fraction of a pixel.
    pub place: Vec2,
    /// Unit vector across the edge; its sign is arbitrary.
    pub across: Vec2,
    /// Contrast relative to the rest of the picture, 0 to 1.
    pub weight: f32,
}

/// Edges of one picture, with their pixels.
pub(super) struct Edges {
    pub width: usize,
    pub height: usize,
    pub list: Vec<Edge>,
    /// Per pixel: index in `list`, or `u32::MAX`.
    at: Vec<u32>,
}

/// Steepness of a full-weight edge, relative to the picture's median pixel, which nearly always shows only noise.
const STANDS_OUT: f32 = 3.0;

/// Smallest change per pixel above rounding errors (16 bits: 1.5e-5).
const MIN_STEEPNESS: f32 = 1e-6;

impl Edges {
    /// Edges by Canny's rule (1986): local maxima of steepness across the edge, after a binomial blur of one pixel.
    /// Channels are combined by their structure tensor (Di Zenzo 1986), so that an edge between two colours of
    /// equal brightness counts too. No threshold: faint edges weigh less.
    pub fn find(picture: &Raster<[f32; 3]>) -> Self {
        let (width, height) = picture.size();
        let smooth = blurred(picture);
        let slopes: Vec<(f32, Vec2)> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| {
                let smooth = &smooth;
                (0..width).map(move |x| slope(smooth, x, y))
            })
            .collect();
        let mut sorted: Vec<f32> = slopes.iter().map(|s| s.0).collect();
        let middle = sorted.len() / 2;
        let median = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        let reference = (STANDS_OUT * median).powi(2);
        let found: Vec<Option<Edge>> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % width, i / width);
                // The border pixels are repeated outside, which would bend edges there.
                if x < 2 || y < 2 || x + 2 >= width || y + 2 >= height {
                    return None;
                }
                let (steepness, across) = slopes[i];
                if steepness < MIN_STEEPNESS {
                    return None;
                }
                let place = Vec2::new(x as f32, y as f32);
                let beside = |step: f32| {
                    let p = place + step * across;
                    let (x0, y0) = (p.x as usize, p.y as usize);
                    let (fx, fy) = (p.x.fract(), p.y.fract());
                    let s = |x: usize, y: usize| slopes[y * width + x].0;
                    let row = |y: usize| s(x0, y) * (1.0 - fx) + s(x0 + 1, y) * fx;
                    row(y0) * (1.0 - fy) + row(y0 + 1) * fy
                };
                let (before, after) = (beside(-1.0), beside(1.0));
                if steepness <= before || steepness < after {
                    return None;
                }
                // Peak of the parabola through the three.
                let shift = 0.5 * (before - after) / (before - 2.0 * steepness + after);
                let weight = steepness.powi(2) / (steepness.powi(2) + reference);
                Some(Edge { place: place + Vec2::splat(0.5) + shift.clamp(-0.5, 0.5) * across, across, weight })
            })
            .collect();
        let mut at = vec![u32::MAX; width * height];
        let mut list = Vec::new();
        for (slot, edge) in at.iter_mut().zip(found) {
            if let Some(edge) = edge {
                *slot = list.len() as u32;
                list.push(edge);
            }
        }
        Self { width, height, list, at }
    }

    /// Edge in the pixel that contains `place`.
    pub fn in_pixel(&self, place: DVec2) -> Option<&Edge> {
        let (x, y) = (place.x.floor(), place.y.floor());
        if x < 0.0 || y < 0.0 || x >= self.width as f64 || y >= self.height as f64 {
            return None;
        }
        self.list.get(self.at[y as usize * self.width + x as usize] as usize)
    }
}

/// Binomial blur (1 4 6 4 1)/16 along both axes; the border is repeated.
fn blurred(picture: &Raster<[f32; 3]>) -> Raster<[f32; 3]> {
    let (width, height) = picture.size();
    let along = |source: &Raster<[f32; 3]>, dx: isize, dy: isize| {
        let pixels = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| {
                (0..width).map(move |x| {
                    let mut sum = [0.0; 3];
                    for (step, weight) in [(-2, 1.0), (-1, 4.0), (0, 6.0), (1, 4.0), (2, 1.0)] {
                        let at =
                            |i: usize, d: isize, n: usize| (i as isize + step * d).clamp(0, n as isize - 1) as usize;
                        let pixel = source.at(at(x, dx, width), at(y, dy, height));
                        (sum.iter_mut().zip(pixel)).for_each(|(s, p)| *s += weight / 16.0 * p);
                    }
                    sum
                })
            })
            .collect();
        Raster { width, height, pixels }
    };
    along(&along(picture, 1, 0), 0, 1)
}

/// Steepness per pixel and its direction: the root of the larger eigenvalue of the channels' summed structure
/// tensor, and its eigenvector.
fn slope(picture: &Raster<[f32; 3]>, x: usize, y: usize) -> (f32, Vec2) {
    let (left, right) = (x.saturating_sub(1), (x + 1).min(picture.width - 1));
    let (above, below) = (y.saturating_sub(1), (y + 1).min(picture.height - 1));
    let [l, r, a, b] = [picture.at(left, y), picture.at(right, y), picture.at(x, above), picture.at(x, below)];
    let (mut xx, mut xy, mut yy) = (0.0f32, 0.0f32, 0.0f32);
    for c in 0..3 {
        let (gx, gy) = (0.5 * (r[c] - l[c]), 0.5 * (b[c] - a[c]));
        xx += gx * gx;
        xy += gx * gy;
        yy += gy * gy;
    }
    let spread = (xx - yy).hypot(2.0 * xy);
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    ((0.5 * (xx + yy + spread)).sqrt(), Vec2::from_angle(angle))
}
