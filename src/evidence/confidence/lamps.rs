//! Expected error by lamp.
//!
//! Each left-out pose shows how far each lamp's error exceeds the picture's. The mean over the poses is the lamp's
//! usual share; an unusually wide spread of the exemplars raises it.

use serde::{Deserialize, Serialize};

/// Largest power of its spread with which a lamp's error may grow.
const MOST_SLOPE: f64 = 1.0;
const LEAST: f64 = 1e-12;

/// Errors of a left-out pose, by lamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LampErrors {
    /// Mean squared errors of encoded values.
    pub squared_errors: Vec<f64>,
    /// Variances of the exemplars' predictions about their blend; empty if unknown.
    pub squared_spreads: Vec<f64>,
}

/// Each lamp's share of a picture's error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LampShares {
    /// Logarithms of each lamp's usual error and usual spread, relative to the picture's.
    errors: Vec<f64>,
    spreads: Vec<f64>,
    /// Power of the unusual part of a spread.
    slope: f64,
}

impl LampShares {
    /// Learns the shares from poses; None without poses, or if their lamps differ.
    pub fn learn(poses: &[&LampErrors]) -> Option<Self> {
        let lamps = poses.first()?.squared_errors.len();
        if lamps == 0 || poses.iter().any(|pose| pose.squared_errors.len() != lamps) {
            return None;
        }
        let errors: Vec<Vec<f64>> = poses.iter().map(|pose| shares(&pose.squared_errors)).collect();
        let has_spreads = poses.iter().all(|pose| pose.squared_spreads.len() == lamps);
        let spreads: Vec<Vec<f64>> = if has_spreads {
            poses.iter().map(|pose| shares(&pose.squared_spreads)).collect()
        } else {
            vec![vec![0.0; lamps]; poses.len()]
        };
        let mean = |all: &[Vec<f64>]| -> Vec<f64> {
            let average = |lamp: usize| all.iter().map(|one| one[lamp]).sum::<f64>() / all.len() as f64;
            (0..lamps).map(average).collect()
        };
        let (usual_errors, usual_spreads) = (mean(&errors), mean(&spreads));
        let (mut together, mut square) = (0.0, 0.0);
        for (errors, spreads) in errors.iter().zip(&spreads) {
            for lamp in 0..lamps {
                let spread = spreads[lamp] - usual_spreads[lamp];
                together += spread * (errors[lamp] - usual_errors[lamp]);
                square += spread * spread;
            }
        }
        let slope = together / square;
        Some(Self {
            errors: usual_errors,
            spreads: usual_spreads,
            slope: if slope.is_finite() { slope.clamp(0.0, MOST_SLOPE) } else { 0.0 },
        })
    }

    /// PSNR of each lamp's OLAT in decibels, from the picture's PSNR and its squared spreads by lamp, if known.
    pub fn decibels(&self, picture_db: f64, squared_spreads: Option<&[f64]>) -> Vec<f64> {
        let spreads = squared_spreads.filter(|spreads| spreads.len() == self.errors.len()).map(shares);
        let logs: Vec<f64> = (0..self.errors.len())
            .map(|lamp| {
                let spread = spreads.as_ref().map_or(0.0, |spreads| spreads[lamp] - self.spreads[lamp]);
                self.errors[lamp] + self.slope * spread
            })
            .collect();
        // Averaged, the lamps give the picture's error.
        let mean = logs.iter().map(|log| (2.0 * log).exp()).sum::<f64>() / logs.len().max(1) as f64;
        let decibels = |log: &f64| picture_db - 10.0 * ((2.0 * log).exp() / mean).log10();
        logs.iter().map(decibels).collect()
    }
}

/// Logarithms of the root of each square over the root of their mean.
fn shares(squares: &[f64]) -> Vec<f64> {
    let usable = |square: &f64| {
        if square.is_finite() { square.max(LEAST) } else { LEAST }
    };
    let mean = squares.iter().map(usable).sum::<f64>() / squares.len().max(1) as f64;
    squares.iter().map(|square| 0.5 * (usable(square) / mean).ln()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poses whose lamps err by a pattern of their own, times their unusual spread to the power 0.5.
    fn pose(unusual: [f64; 3]) -> LampErrors {
        let (pattern, usual) = ([1.0, 4.0, 0.5], [0.2, 0.1, 0.4]);
        LampErrors {
            squared_errors: (0..3).map(|i| pattern[i] * f64::powf(unusual[i], 0.5)).collect(),
            squared_spreads: (0..3).map(|i| usual[i] * unusual[i]).collect(),
        }
    }

    #[test]
    fn lamps_that_err_most_are_found_and_what_a_lamp_spread_tells_more() {
        let poses = [pose([1.0, 1.0, 1.0]), pose([2.0, 0.5, 1.0]), pose([0.4, 1.3, 2.0])];
        let shares = LampShares::learn(&poses.iter().collect::<Vec<_>>()).unwrap();
        assert!((shares.slope - 0.5).abs() < 0.1, "{}", shares.slope);
        let usual = shares.decibels(30.0, None);
        assert!(usual[1] < usual[0] && usual[0] < usual[2], "{usual:?}");
        // All lamps together give the picture.
        let mean = usual.iter().map(|db| 10f64.powf(-db / 10.0)).sum::<f64>() / 3.0;
        assert!((-10.0 * mean.log10() - 30.0).abs() < 1e-9);
        let spread = shares.decibels(30.0, Some(&pose([50.0, 1.0, 1.0]).squared_spreads));
        assert!(spread[0] < usual[0] - 3.0, "{spread:?}");
        // Without spreads, only the pattern counts. No poses give nothing, and NaN is kept out.
        let plain: Vec<LampErrors> =
            (poses.iter()).map(|pose| LampErrors { squared_spreads: Vec::new(), ..pose.clone() }).collect();
        let plain = LampShares::learn(&plain.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(plain.slope, 0.0);
        assert!(LampShares::learn(&[]).is_none());
        let broken = LampErrors { squared_errors: vec![f64::NAN, 0.0, 1.0], squared_spreads: vec![0.0; 3] };
        let broken = LampShares::learn(&[&broken, &poses[0]]).unwrap();
        assert!(broken.decibels(30.0, Some(&[f64::NAN; 3])).iter().all(|db| db.is_finite()));
    }
}
