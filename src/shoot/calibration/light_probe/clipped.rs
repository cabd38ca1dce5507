//! Clipped lamps, estimated from their unclipped flanks.
//!
//! A lamp's image, blurred by the lens, is modelled as an elliptic Gaussian lobe over a uniform background: the
//! logarithm of the light above the background is a quadratic polynomial of the position, fitted to the lobe's
//! unclipped flank. Clipped pixels are at least as bright as the clipping level. A lobe that leaves many of them
//! darker does not fit, and the lamp stays unchanged. The brightness of a uniform disc with a sharp edge cannot be
//! estimated: it needs a shorter exposure ([`super::merge`]).

use imaging::color::luminance;
use imaging::{Image, Raster};

/// Result of the estimate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    /// Number of clipped pixels without a usable flank, left unchanged.
    pub unestimated_pixels: usize,
    /// Added share of the ball's luminous energy.
    pub energy_share: f32,
}

/// Largest trusted ratio of a lobe's peak to the clipping level. Beyond it the flank is too short to determine the
/// height.
const MAX_PEAK: f64 = 100.0;
/// Largest share of a lamp's clipped pixels that its lobe may leave below the clipping level.
const MAX_DARKER_SHARE: f64 = 0.2;
/// Largest root-mean-square residual of the lobe, relative to its flank's light. Above it the lamp has another
/// shape.
const MAX_RESIDUAL: f64 = 0.1;
/// Start of flanks above the background, relative to the clipping level.
const FAINTEST: f64 = 0.02;

/// Raises the clipped lamps of a ball's photograph. `usable` is above 0 for pixels of the ball; `angles` are the
/// pixels' solid angles.
pub(super) fn estimate(light: &mut Image, clipped: &Raster<[bool; 3]>, usable: &[f32], angles: &[f64]) -> Estimate {
    let before = light.clone();
    let mut unestimated = vec![false; light.pixels.len()];
    for lamp in lamps(clipped, usable) {
        let hot = |c: usize| -> Vec<usize> {
            let pixels = lamp.iter().copied();
            pixels.filter(|&i| clipped.pixels[i][c]).collect()
        };
        let channels = [0, 1, 2].map(hot);
        let lobes: Option<Vec<Vec<f32>>> = (0..3)
            .map(|c| {
                if channels[c].is_empty() {
                    Some(vec![])
                } else {
                    lobe(&before, clipped, usable, &lamp, &channels[c], c)
                }
            })
            .collect();
        // Raising only some channels would change the lamp's colour.
        let Some(lobes) = lobes else {
            lamp.iter().for_each(|&i| unestimated[i] = true);
            continue;
        };
        for (c, values) in lobes.iter().enumerate() {
            for (&i, value) in channels[c].iter().zip(values) {
                light.pixels[i][c] = *value;
            }
        }
    }
    let energy = |image: &Image| -> f64 {
        (0..angles.len()).filter(|&i| usable[i] > 0.0).map(|i| angles[i] * f64::from(luminance(image.pixels[i]))).sum()
    };
    let after = energy(light);
    Estimate {
        unestimated_pixels: unestimated.iter().filter(|u| **u).count(),
        energy_share: if after > 0.0 { (1.0 - energy(&before) / after) as f32 } else { 0.0 },
    }
}

/// Connected groups of the ball's pixels with a clipped channel.
fn lamps(clipped: &Raster<[bool; 3]>, usable: &[f32]) -> Vec<Vec<usize>> {
    let is_hot = |i: usize| usable[i] > 0.0 && clipped.pixels[i].contains(&true);
    matte::parts(clipped.size(), is_hot)
}

/// Light of the `hot` pixels of a lamp in channel `c`; `None` if no lobe fits.
fn lobe(
    light: &Image,
    clipped: &Raster<[bool; 3]>,
    usable: &[f32],
    lamp: &[usize],
    hot: &[usize],
    c: usize,
) -> Option<Vec<f32>> {
    let width = light.width;
    let value = |i: usize| f64::from(light.pixels[i][c]);
    let white = hot.iter().map(|&i| value(i)).fold(f64::INFINITY, f64::min);
    // A flank as wide as the clipped part, and a border beyond for the background.
    let radius = (lamp.len() as f64 / std::f64::consts::PI).sqrt();
    let reach = (radius.ceil() as usize + 2).min(64);
    let mut near: Vec<usize> = (lamp.iter())
        .flat_map(|&i| matte::around(i, light.size(), reach))
        .filter(|&i| usable[i] > 0.0 && !clipped.pixels[i][c])
        .collect();
    near.sort_unstable();
    near.dedup();
    let mut levels: Vec<f64> = near.iter().map(|&i| value(i)).collect();
    levels.sort_by(f64::total_cmp);
    let background = *levels.get(levels.len() / 10)?;
    let range = white - background;
    // Positions are relative to the lamp's middle, in its radii, so that the equations are well scaled.
    let middle = |place: &dyn Fn(usize) -> f64| lamp.iter().map(|&i| place(i)).sum::<f64>() / lamp.len() as f64;
    let (cx, cy) = (middle(&|i| (i % width) as f64), middle(&|i| (i / width) as f64));
    let scale = 1.0 / (radius + 1.0);
    let place = |i: usize| {
        let (x, y) = (scale * ((i % width) as f64 - cx), scale * ((i / width) as f64 - cy));
        [1.0, x, y, x * x, x * y, y * y]
    };
    let flank: Vec<([f64; 6], f64)> = (near.iter())
        .map(|&i| (place(i), value(i) - background))
        .filter(|(_, excess)| *excess > FAINTEST * range && range > 0.0)
        .collect();
    if flank.len() < 12 {
        return None;
    }
    let fit = solve(&flank)?;
    let [_, _, _, xx, xy, yy] = fit;
    let (error, power) = flank.iter().fold((0.0, 0.0), |sum, (place, value)| {
        let off = polynomial(&fit, place).exp() - value;
        (sum.0 + off * off, sum.1 + value * value)
    });
    if error > MAX_RESIDUAL * MAX_RESIDUAL * power {
        return None;
    }
    // A lobe falls off in every direction.
    if !(xx < 0.0 && 4.0 * xx * yy > xy * xy) {
        return None;
    }
    let values: Vec<f64> = (hot.iter()).map(|&i| polynomial(&fit, &place(i)).exp() / range).collect();
    let highest = values.iter().copied().fold(0.0, f64::max);
    let darker = values.iter().filter(|v| **v < 1.0).count();
    let fits = darker as f64 <= MAX_DARKER_SHARE * values.len() as f64;
    (fits && highest <= MAX_PEAK).then(|| {
        let lit = values.iter().map(|v| (background + range * v.max(1.0)) as f32);
        lit.collect()
    })
}

fn polynomial(fit: &[f64; 6], place: &[f64; 6]) -> f64 {
    fit.iter().zip(place).map(|(a, b)| a * b).sum()
}

/// Quadratic polynomial with the least squared error to the logarithms of positive values, weighted by the values'
/// squares so that errors count in linear light. `None` if the solution is not unique.
fn solve(flank: &[([f64; 6], f64)]) -> Option<[f64; 6]> {
    let mut rows = [[0.0f64; 7]; 6];
    for (place, value) in flank {
        let weight = value * value;
        for i in 0..6 {
            for j in 0..6 {
                rows[i][j] += weight * place[i] * place[j];
            }
            rows[i][6] += weight * place[i] * value.ln();
        }
    }
    // Gaussian elimination with column pivoting.
    let largest = rows.iter().flatten().fold(0.0f64, |a, b| a.max(b.abs()));
    for column in 0..6 {
        let pivot = (column..6).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        rows.swap(column, pivot);
        let head = rows[column];
        let size = head[column].abs();
        if size.is_nan() || size <= 1e-12 * largest {
            return None;
        }
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let factor = row[column] / head[column];
            for (value, above) in row.iter_mut().zip(head) {
                *value -= factor * above;
            }
        }
    }
    Some(std::array::from_fn(|i| rows[i][6] / rows[i][i]))
}
