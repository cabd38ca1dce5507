//! Canvas that collects a panorama's texels in any order while the file is read, and averages them by solid angle.

use crate::environment::{Environment, HALF_MAX, band};
use imaging::Image;

/// A panorama while it is read.
pub(super) struct Canvas {
    image: Image,
    /// Targets of columns and rows if the panorama is reduced. With `None` texels are stored unchanged and repaired
    /// by [`Environment::from_radiance`].
    shrink: Option<Shrink>,
    /// Painted part of each row, 0 to 1.
    painted: Vec<f32>,
    /// Fills empty rows with the mean colour of the nearest painted row, so that a strip around the horizon
    /// continues above and below. Otherwise they stay black.
    pub extend: bool,
}

struct Shrink {
    columns: Vec<Part>,
    rows: Vec<Part>,
    /// Infinite share per texel and channel; `None` until the first.
    infinite: Option<Image>,
    brightest: f32,
    repaired: usize,
}

/// Targets of a column or row: one, and the next for the remainder.
#[derive(Clone, Copy)]
struct Part {
    target: usize,
    share: f32,
    next: f32,
}

impl Canvas {
    /// A canvas at the picture's full size.
    pub fn whole((width, height): (usize, usize)) -> Self {
        Self { image: Image::filled(width, height, [0.0; 3]), shrink: None, painted: vec![0.0; height], extend: false }
    }

    /// Columns and rows after [`Self::lat_long`].
    pub fn kept((width, height): (usize, usize), most: usize) -> (usize, usize) {
        if width <= most {
            return (width, height);
        }
        let rows = (height as f64 * most as f64 / width as f64).round() as usize;
        (most, rows.max(1))
    }

    /// A canvas for a lat-long, reduced to at most `most` columns.
    pub fn lat_long((width, height): (usize, usize), most: usize) -> Self {
        if width <= most {
            return Self::whole((width, height));
        }
        let (_, rows) = Self::kept((width, height), most);
        let shrink = Shrink {
            columns: parts(width, most, |from, to| to - from),
            rows: parts(height, rows, |from, to| band(from, to, height)),
            infinite: None,
            brightest: 0.0,
            repaired: 0,
        };
        Self { shrink: Some(shrink), ..Self::whole((most, rows)) }
    }

    /// Paints a run of texels in row `y` from column `x`. Ignores texels outside the canvas.
    pub fn paint(&mut self, x: usize, y: usize, run: &[[f32; 3]]) {
        let Some(shrink) = &mut self.shrink else {
            let (width, height) = self.image.size();
            if y < height && x < width {
                let run = &run[..run.len().min(width - x)];
                self.image.pixels[y * width + x..][..run.len()].copy_from_slice(run);
                self.painted[y] += run.len() as f32 / width as f32;
            }
            return;
        };
        let Shrink { columns, rows, infinite, brightest, repaired } = shrink;
        let Some(&row) = rows.get(y) else { return };
        let (width, height) = self.image.size();
        let count = columns.len();
        let columns = columns.get(x..).unwrap_or(&[]);
        let shown = run.len().min(columns.len()) as f32 / count as f32;
        for (target, share) in row.targets() {
            self.painted[target] += share * shown;
        }
        for (i, (&texel, column)) in run.iter().zip(columns).enumerate() {
            let texel = if texel.iter().all(|v| v.is_finite() && *v >= 0.0) {
                texel
            } else {
                *repaired += 1;
                repair(texel, &run[i.saturating_sub(1)..(i + 2).min(run.len())])
            };
            for (y, down) in row.targets() {
                for (x, across) in column.targets() {
                    let (at, share) = (y * width + x, down * across);
                    for (c, value) in texel.into_iter().enumerate() {
                        if value < f32::INFINITY {
                            self.image.pixels[at][c] += share * value;
                            *brightest = brightest.max(value);
                        } else {
                            let shares = infinite.get_or_insert_with(|| Image::filled(width, height, [0.0; 3]));
                            shares.pixels[at][c] += share;
                        }
                    }
                }
            }
        }
    }

    /// The environment, repaired.
    pub fn finish(mut self, name: &str) -> Environment {
        let mut repaired = 0;
        if let Some(shrink) = self.shrink.take() {
            repaired = shrink.repaired;
            let brightest = match shrink.brightest {
                0.0 => HALF_MAX,
                value => value,
            };
            let shares = shrink.infinite.iter().flat_map(|shares| &shares.pixels);
            for (pixel, shares) in self.image.pixels.iter_mut().zip(shares) {
                for (value, share) in pixel.iter_mut().zip(shares) {
                    *value += share * brightest;
                }
            }
        }
        let mut environment = Environment::from_radiance(name, self.image);
        environment.repaired_texels += repaired;
        if self.extend {
            extend(&mut environment.radiance, &self.painted);
        }
        environment
    }
}

/// Fills the rows above and below the painted ones with the means of the first and the last painted row.
fn extend(image: &mut Image, painted: &[f32]) {
    let width = image.width;
    let is_painted = |share: &f32| *share > 1e-3;
    let first = painted.iter().position(is_painted).unwrap_or(0);
    let last = painted.iter().rposition(is_painted).unwrap_or(0);
    for y in [first, last] {
        let row = &mut image.pixels[y * width..][..width];
        // The strip's edge crosses this row.
        if painted[y] < 0.999 {
            row.iter_mut().flatten().for_each(|value| *value /= painted[y].max(1e-3));
        }
        let mean: [f32; 3] =
            std::array::from_fn(|c| (row.iter().map(|p| f64::from(p[c])).sum::<f64>() / width as f64) as f32);
        if y == first {
            image.pixels[..first * width].fill(mean);
        }
        if y == last {
            image.pixels[(last + 1) * width..].fill(mean);
        }
        if first == last {
            break;
        }
    }
}

/// Replaces NaN by the mean of the valid neighbours and negative values by 0. +∞ is handled at the end.
fn repair(texel: [f32; 3], around: &[[f32; 3]]) -> [f32; 3] {
    std::array::from_fn(|c| {
        if !texel[c].is_nan() {
            return texel[c].max(0.0);
        }
        let light = around.iter().map(|p| p[c]).filter(|v| v.is_finite() && *v >= 0.0);
        let (sum, count) = light.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        if count > 0.0 { sum / count } else { 0.0 }
    })
}

impl Part {
    /// Target indices with their shares.
    fn targets(self) -> impl Iterator<Item = (usize, f32)> {
        let both = [(self.target, self.share), (self.target + 1, self.next)];
        both.into_iter().filter(|(_, share)| *share > 0.0)
    }
}

/// Targets of each of `source` columns or rows among `target`, which must not exceed `source`. `measure` is the
/// extent between two places, in source units; the shares of a target add up to 1.
fn parts(source: usize, target: usize, measure: impl Fn(f64, f64) -> f64) -> Vec<Part> {
    let ratio = source as f64 / target as f64;
    (0..source)
        .map(|s| {
            let (from, to) = (s as f64, s as f64 + 1.0);
            let first = ((from / ratio) as usize).min(target - 1);
            let share = |t: usize| {
                let (start, end) = (t as f64 * ratio, (t + 1) as f64 * ratio);
                let (from, to) = (from.max(start), to.min(end));
                if t < target && to - from > 1e-9 { (measure(from, to) / measure(start, end)) as f32 } else { 0.0 }
            };
            Part { target: first, share: share(first), next: share(first + 1) }
        })
        .collect()
}
