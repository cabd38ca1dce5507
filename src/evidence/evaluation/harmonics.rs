//! Spherical harmonics: a recording with nine lights in place of all lamps.
//!
//! Fyffe et al. ("Comprehensive facial performance capture", CGF 2011) light a performance by spherical gradients,
//! which record the low-order harmonics of a pixel's response to light. Here each pixel's response to a lamp of unit
//! energy, as a function of the lamp's direction, is fitted by the nine real harmonics up to order 2, by least squares
//! over the lamps, and evaluated again at each lamp. Matte surfaces keep nearly everything (Ramamoorthi and Hanrahan
//! 2001: 99 % of the energy); highlights and cast shadows blur.

use imaging::Image;
use light::Rig;
use rayon::prelude::*;

/// Number of harmonics up to order 2.
const COUNT: usize = 9;
/// Ridge that keeps the fit of few or clustered lamps finite, as a share of the diagonal's mean.
const RIDGE: f64 = 1e-4;

/// The nine real harmonics in a direction, without constant factors: a fit does not need them.
fn harmonics([x, y, z]: [f64; 3]) -> [f64; COUNT] {
    [1.0, x, y, z, x * y, y * z, x * z, x * x - y * y, 3.0 * z * z - 1.0]
}

/// Share of each lamp in each fitted response: `[to][from]`, a projection.
fn projection(directions: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let rows: Vec<[f64; COUNT]> = directions.iter().copied().map(harmonics).collect();
    let mut normal = [[0.0; COUNT]; COUNT];
    for row in &rows {
        for (i, line) in normal.iter_mut().enumerate() {
            for (j, value) in line.iter_mut().enumerate() {
                *value += row[i] * row[j];
            }
        }
    }
    let trace: f64 = (0..COUNT).map(|i| normal[i][i]).sum();
    for (i, line) in normal.iter_mut().enumerate() {
        line[i] += RIDGE * trace / COUNT as f64;
    }
    let inverse = inverse(normal);
    let share = |to: &[f64; COUNT], from: &[f64; COUNT]| -> f64 {
        let pairs = (0..COUNT).flat_map(|i| (0..COUNT).map(move |j| (i, j)));
        pairs.map(|(i, j)| to[i] * inverse[i][j] * from[j]).sum()
    };
    rows.iter().map(|to| rows.iter().map(|from| share(to, from)).collect()).collect()
}

/// Inverse of a symmetric positive definite matrix by Gauss–Jordan elimination, which needs no pivots here.
fn inverse(mut matrix: [[f64; COUNT]; COUNT]) -> [[f64; COUNT]; COUNT] {
    let mut inverse = [[0.0; COUNT]; COUNT];
    for (i, line) in inverse.iter_mut().enumerate() {
        line[i] = 1.0;
    }
    for i in 0..COUNT {
        let pivot = matrix[i][i];
        for j in 0..COUNT {
            matrix[i][j] /= pivot;
            inverse[i][j] /= pivot;
        }
        for other in (0..COUNT).filter(|&other| other != i) {
            let factor = matrix[other][i];
            for j in 0..COUNT {
                matrix[other][j] -= factor * matrix[i][j];
                inverse[other][j] -= factor * inverse[i][j];
            }
        }
    }
    inverse
}

/// A pose's OLATs reproduced by their harmonics up to order 2. Behind a surface they ring below zero; sums of many
/// lamps average that out. Lamps without energy are unchanged.
pub fn low_order_olats(olats: &[Image], rig: &Rig) -> Vec<Image> {
    let energies: Vec<[f32; 3]> = rig.lamps.iter().map(|lamp| lamp.energy).collect();
    let lit: Vec<usize> = (0..olats.len().min(rig.lamps.len())).filter(|&lamp| rig.lamps[lamp].is_usable()).collect();
    let direction = |&lamp: &usize| rig.lamps[lamp].direction.to_array().map(f64::from);
    let directions: Vec<[f64; 3]> = lit.iter().map(direction).collect();
    let projection = projection(&directions);
    let mut fitted = olats.to_vec();
    let smooth: Vec<Image> = projection
        .par_iter()
        .zip(&lit)
        .map(|(shares, &to)| {
            let mut sum = Image::filled(olats[to].width, olats[to].height, [0.0; 3]);
            for (&share, &from) in shares.iter().zip(&lit) {
                let factor: [f32; 3] =
                    std::array::from_fn(|c| (share * f64::from(energies[to][c]) / f64::from(energies[from][c])) as f32);
                for (out, pixel) in sum.pixels.iter_mut().zip(&olats[from].pixels) {
                    for c in 0..3 {
                        out[c] += factor[c] * pixel[c];
                    }
                }
            }
            sum
        })
        .collect();
    for (&lamp, smooth) in lit.iter().zip(smooth) {
        fitted[lamp] = smooth;
    }
    fitted
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use imaging::Raster;
    use light::Lamp;

    /// Lamps spread evenly (a Fibonacci spiral), of different energies.
    fn rig(count: usize) -> Rig {
        let lamp = |i: usize| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let (radius, turn) = ((1.0 - y * y).sqrt(), 2.399_963_2 * i as f32);
            let direction = Vec3::new(radius * turn.cos(), y, radius * turn.sin());
            Lamp {
                energy: [1.0 + 0.3 * (i % 4) as f32, 1.0, 0.5],
                spread_deg: 3.0,
                ..Lamp::new(format!("olat_{i:02}"), direction)
            }
        };
        Rig { lamps: (0..count).map(lamp).collect() }
    }

    /// A ball under each lamp, matte or with a highlight.
    fn ball(rig: &Rig, shine: f32) -> Vec<Image> {
        const SIDE: usize = 24;
        let olat = |lamp: &Lamp| {
            Raster::from_fn(SIDE, SIDE, |x, y| {
                let at = |i: usize| (i as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
                let (x, y) = (at(x), -at(y));
                let z = 1.0 - x * x - y * y;
                if z < 0.05 {
                    return [0.0; 3];
                }
                let normal = Vec3::new(x, y, z.sqrt());
                let matte = normal.dot(lamp.direction).max(0.0);
                let half = (lamp.direction + Vec3::Z).normalize_or_zero();
                let glint = shine * normal.dot(half).max(0.0).powi(60);
                lamp.energy.map(|e| e * (matte + glint))
            })
        };
        rig.lamps.iter().map(olat).collect()
    }

    /// Relative error of the sum under light that changes slowly with direction.
    fn error(rig: &Rig, olats: &[Image]) -> f64 {
        let fitted = low_order_olats(olats, rig);
        let weight = |lamp: &Lamp| 1.0 + 0.5 * lamp.direction.x + 0.3 * lamp.direction.y;
        let (mut squares, mut all) = (0.0, 0.0);
        for i in 0..olats[0].pixels.len() {
            let sum = |olats: &[Image]| -> f32 {
                let pairs = olats.iter().zip(&rig.lamps);
                pairs.map(|(olat, lamp)| weight(lamp) * olat.pixels[i][1]).sum()
            };
            let (a, b) = (f64::from(sum(&fitted)), f64::from(sum(olats)));
            squares += (a - b).powi(2);
            all += b * b;
        }
        (squares / all).sqrt()
    }

    #[test]
    fn a_matte_ball_in_soft_light_keeps_its_look_and_a_highlight_blurs() {
        let rig = rig(41);
        let matte = error(&rig, &ball(&rig, 0.0));
        println!("matte ball: {:.3} %", 100.0 * matte);
        assert!(matte < 0.01, "{matte}");
        let (sharp, shiny) = (ball(&rig, 4.0), ball(&rig, 0.0));
        let off = |olats: &[Image]| {
            let fitted = low_order_olats(olats, &rig);
            let pairs = fitted.iter().zip(olats);
            let squares = pairs.flat_map(|(a, b)| a.pixels.iter().zip(&b.pixels));
            squares.map(|(a, b)| (a[1] - b[1]).powi(2)).sum::<f32>()
        };
        assert!(off(&sharp) > 3.0 * off(&shiny));
    }

    #[test]
    fn what_is_of_low_order_is_kept_and_few_or_dark_lamps_do_no_harm() {
        let mut rig = rig(41);
        let linear = |lamp: &Lamp| {
            let value = 2.0 + lamp.direction.x - 0.5 * lamp.direction.y * lamp.direction.z;
            Image::filled(2, 2, lamp.energy.map(|e| e * value))
        };
        let olats: Vec<Image> = rig.lamps.iter().map(linear).collect();
        for (a, b) in low_order_olats(&olats, &rig).iter().zip(&olats) {
            let (a, b) = (a.pixels[0][0], b.pixels[0][0]);
            assert!((a - b).abs() < 2e-3 * b, "{a}, not {b}");
        }
        rig.lamps[3].energy = [0.0; 3];
        assert_eq!(low_order_olats(&olats, &rig)[3], olats[3]);
        rig.lamps.truncate(3);
        let few = low_order_olats(&olats[..3], &rig);
        assert!(few.iter().all(|olat| olat.pixels[0][0].is_finite()));
    }
}
