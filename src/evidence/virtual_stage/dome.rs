//! The dome: small lamps spread evenly over the whole sphere, switched in banks of neighbours.

use glam::Vec3;
use rayon::prelude::*;

use imaging::Image;
use light::latlong::{texel_direction, texel_solid_angle};

/// Distance from the subject to every lamp in metres.
pub const RADIUS_M: f32 = 4.0;
/// Radius of a lamp's disc in metres.
pub const LAMP_RADIUS_M: f32 = 0.1;
/// Most lamps of the dome, as on the paper's stage. With this many banks, each lamp is a bank of its own.
pub(super) const MAX_LAMPS: usize = 931;
/// Lamps per bank, as in the paper: 931 lamps in 41 conditions.
const LAMPS_PER_BANK: f64 = 931.0 / 41.0;

/// Positions and banks of the lamps, sorted by bank.
#[derive(Clone, Debug)]
pub struct Dome {
    /// Unit directions of the lamps.
    pub lamps: Vec<Vec3>,
    /// Bank of every lamp.
    pub bank_of_lamp: Vec<usize>,
    /// Unit directions of the banks: the mean over their lamps.
    pub banks: Vec<Vec3>,
}

impl Dome {
    /// A dome whose lamps switch in `banks` banks, at least 1.
    pub fn new(banks: usize) -> Self {
        Self::with(banks, (banks as f64 * LAMPS_PER_BANK).round() as usize)
    }

    /// A dome of about `lamps` lamps, at least one for each of `banks` banks.
    pub(super) fn with(banks: usize, lamps: usize) -> Self {
        let total = lamps.min(MAX_LAMPS).max(banks);
        let centres = spiral(banks);
        let mut lamps: Vec<(usize, Vec3)> =
            spiral(total).into_iter().map(|lamp| (nearest(&centres, lamp), lamp)).collect();
        // A bank that got no lamp (few lamps per bank, an unlucky spiral) takes the nearest one.
        for (bank, &centre) in centres.iter().enumerate() {
            if lamps.iter().all(|&(b, _)| b != bank) {
                let count = |b: usize| lamps.iter().filter(|l| l.0 == b).count();
                let spare = (0..lamps.len())
                    .filter(|&i| count(lamps[i].0) > 1)
                    .max_by(|&a, &b| lamps[a].1.dot(centre).total_cmp(&lamps[b].1.dot(centre)));
                if let Some(spare) = spare {
                    lamps[spare].0 = bank;
                }
            }
        }
        lamps.sort_by_key(|&(bank, _)| bank);
        let banks = (0..banks)
            .map(|bank| lamps.iter().filter(|l| l.0 == bank).map(|l| l.1).sum::<Vec3>().normalize())
            .collect();
        let (bank_of_lamp, lamps) = lamps.into_iter().unzip();
        Self { lamps, bank_of_lamp, banks }
    }

    /// Solid angle per lamp, in steradians.
    pub fn lamp_solid_angle(&self) -> f32 {
        4.0 * std::f32::consts::PI / self.lamps.len() as f32
    }

    /// The number of lamps in every bank.
    pub fn bank_counts(&self) -> Vec<usize> {
        (0..self.banks.len()).map(|b| self.bank_of_lamp.iter().filter(|&&l| l == b).count()).collect()
    }

    /// Weights of the banks for the interview: soft, symmetric, from above and slightly in front, with a tenth of fill
    /// from everywhere. The strongest weight is 1.
    pub fn interview_bank_weights(&self) -> Vec<f32> {
        const FILL: f32 = 0.1;
        let raw: Vec<f32> = self
            .banks
            .iter()
            .map(|b| {
                let lift = (0.25 + 0.6 * b.y + 0.35 * b.z).max(0.0);
                FILL + lift.powf(1.2)
            })
            .collect();
        let strongest = raw.iter().copied().fold(FILL, f32::max);
        raw.into_iter().map(|w| w / strongest).collect()
    }

    /// Mean radiance of `environment` over the directions nearest to each lamp.
    pub fn lamp_weights(&self, environment: &Image) -> Vec<[f32; 3]> {
        let (width, height) = environment.size();
        let owners: Vec<usize> = (0..width * height)
            .into_par_iter()
            .map(|i| nearest(&self.lamps, texel_direction(i % width, i / width, width, height)))
            .collect();
        let mut sums = vec![[0.0f64; 4]; self.lamps.len()];
        for (i, &owner) in owners.iter().enumerate() {
            let solid_angle = texel_solid_angle(i / width, width, height);
            for (sum, radiance) in sums[owner].iter_mut().zip(environment.pixels[i]) {
                *sum += solid_angle * f64::from(radiance);
            }
            sums[owner][3] += solid_angle;
        }
        sums.iter()
            .map(|&[r, g, b, area]| [r, g, b].map(|c| if area > 0.0 { (c / area) as f32 } else { 0.0 }))
            .collect()
    }
}

/// `count` directions spread evenly over the sphere from +Y to −Y (a Fibonacci spiral).
pub(super) fn spiral(count: usize) -> Vec<Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    (0..count)
        .map(|i| {
            let y = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let radius = (1.0 - y * y).sqrt();
            let (sin, cos) = (golden_angle * i as f64).sin_cos();
            glam::DVec3::new(radius * cos, y, radius * sin).as_vec3()
        })
        .collect()
}

/// Index of the direction nearest to `direction`.
fn nearest(directions: &[Vec3], direction: Vec3) -> usize {
    let mut best = (0, f32::MIN);
    for (i, d) in directions.iter().enumerate() {
        let cosine = d.dot(direction);
        if cosine > best.1 {
            best = (i, cosine);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    #[test]
    fn every_bank_has_lamps_and_they_surround_it() {
        for banks in [4, 6, 12, 41, 146, 400, 931] {
            let dome = Dome::new(banks);
            let counts = dome.bank_counts();
            assert_eq!(counts.len(), banks);
            assert_eq!(counts.iter().sum::<usize>(), dome.lamps.len());
            assert!(dome.lamps.len() <= MAX_LAMPS);
            assert!(counts.iter().all(|&n| n >= 1), "{banks}: {counts:?}");
        }
        assert_eq!(Dome::new(41).lamps.len(), 931);
        assert_eq!(Dome::new(931).bank_counts(), [1; 931]);
    }

    #[test]
    fn lamps_keep_the_energy_of_an_environment() {
        let dome = Dome::new(12);
        let white = Raster::filled(64, 32, [1.0, 2.0, 0.0]);
        for weight in dome.lamp_weights(&white) {
            assert!((weight[0] - 1.0).abs() < 1e-5 && (weight[1] - 2.0).abs() < 1e-5 && weight[2] == 0.0);
        }
    }

    #[test]
    fn the_interview_light_is_the_same_from_left_and_right_and_from_above() {
        let dome = Dome::new(41);
        let weights = dome.interview_bank_weights();
        let sum = |f: &dyn Fn(Vec3) -> f32| -> f32 { dome.banks.iter().zip(&weights).map(|(&b, w)| w * f(b)).sum() };
        assert!(weights.iter().all(|&w| (0.0..=1.0).contains(&w)));
        assert!(sum(&|b| b.y) > 0.3 * sum(&|_| 1.0), "not from above");
        assert!(sum(&|b| b.x).abs() < 0.03 * sum(&|_| 1.0), "one-sided");
    }
}
