//! What training starts from: a network that has learnt from many virtual subjects, brought to another rig and size.
//!
//! Its lamps are not the user's. The last layer has a row for each lamp and colour, and what it computes changes smoothly
//! with a lamp's direction, so a row for another lamp is the mean of those around it.

use super::checkpoint::{self, Starter};
use super::unet::{UNet, UNetConfig};
use base::error::{Error, Result};
use base::files::write_beside;
use burn::tensor::{Device, Tensor, TensorData};
use glam::Vec3;
use light::Rig;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::Path;

/// How far around a lamp others count for its row, in degrees: half the way from one of 41 lamps to the next.
const AROUND_DEG: f32 = 15.0;
/// A lamp's energy may move its outputs by this factor at most.
const MOST_ENERGY: f32 = 8.0;

/// A network for others to start from, with its lamps.
#[derive(Clone, Copy)]
pub struct Start {
    starter: Starter,
    lamps: &'static str,
}

/// The one that comes with the program. `make start` trained it on virtual subjects alone.
pub const VIRTUAL_SUBJECTS: Start = Start {
    starter: Starter {
        table: include_str!("../../assets/start/checkpoint.toml"),
        weights: include_bytes!("../../assets/start/weights.bpk"),
    },
    lamps: include_str!("../../assets/start/lamps.toml"),
};

/// The lamps of a network that others start from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StartLamps {
    /// Unit directions from the subject.
    pub directions: Vec<Vec3>,
    /// Energy per channel, over the lamps' mean.
    pub energies: Vec<[f32; 3]>,
    /// The mean of what the outputs had to be.
    pub mean_output: f32,
}

impl StartLamps {
    const NAME: &str = "lamps.toml";

    /// Those of a rig.
    pub fn of(rig: &Rig, mean_output: f32) -> Self {
        Self {
            directions: rig.lamps.iter().map(|lamp| lamp.direction).collect(),
            energies: relative(rig),
            mean_output,
        }
    }

    /// Writes them beside the network in `folder`.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let text = toml::to_string(self)
            .map_err(|e| Error::bug(format!("the lamps cannot be written: {e}")))?;
        write_beside(&folder.join(Self::NAME), |out| {
            out.write_all(text.as_bytes())
        })
    }

    /// How much each of these lamps counts for one in `direction`; together 1. All alike if it has no direction.
    fn around(&self, direction: Vec3) -> Vec<f32> {
        let reach = 1.0 - AROUND_DEG.to_radians().cos();
        let unit = direction.normalize_or_zero();
        let nearest = self
            .directions
            .iter()
            .map(|d| d.dot(unit))
            .fold(-1.0, f32::max);
        let weights: Vec<f32> = (self.directions.iter())
            .map(|d| match unit == Vec3::ZERO {
                true => 1.0,
                // From the nearest, so that a lamp far from all has one too.
                false => ((d.dot(unit) - nearest) / reach).exp(),
            })
            .collect();
        let sum: f32 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect()
    }
}

/// Each lamp's energy over their mean, per channel; 1 for a lamp without light.
fn relative(rig: &Rig) -> Vec<[f32; 3]> {
    let usable = |energy: &f32| energy.is_finite() && *energy > 0.0;
    let mean: [f32; 3] = std::array::from_fn(|c| {
        let all: Vec<f32> = (rig.lamps.iter().map(|lamp| lamp.energy[c]))
            .filter(usable)
            .collect();
        all.iter().sum::<f32>() / all.len().max(1) as f32
    });
    let of = |energy: [f32; 3]| {
        std::array::from_fn(|c| {
            let share = energy[c] / mean[c];
            if usable(&share) {
                share.clamp(1.0 / MOST_ENERGY, MOST_ENERGY)
            } else {
                1.0
            }
        })
    };
    rig.lamps.iter().map(|lamp| of(lamp.energy)).collect()
}

impl Start {
    /// A network of the shape `config` for these lamps; None if networks of this shape cannot start from it. `mean_output` is
    /// the mean of what the outputs have to be.
    ///
    /// # Errors
    /// When what comes with the program is damaged.
    pub fn network(
        &self,
        config: &UNetConfig,
        rig: &Rig,
        mean_output: f32,
        device: &Device,
    ) -> Result<Option<UNet>> {
        let damaged =
            |e: toml::de::Error| Error::bug(format!("the starting point's lamps are damaged: {e}"));
        let lamps: StartLamps = toml::from_str(self.lamps).map_err(damaged)?;
        let (info, from) = checkpoint::open_starter(self.starter, device)?;
        if rig.lamps.len() != config.lamps || lamps.directions.len() != info.network.lamps {
            return Ok(None);
        }
        let logit = |share: f32| {
            let share = share.clamp(1e-4, 1.0 - 1e-4);
            (share / (1.0 - share)).ln()
        };
        let brighter = logit(mean_output) - logit(lamps.mean_output);
        let count = 3 * info.network.lamps;
        let mut mix = vec![0.0; 3 * config.lamps * count];
        let mut shift = Vec::with_capacity(3 * config.lamps);
        for (lamp, (of, energy)) in rig.lamps.iter().zip(relative(rig)).enumerate() {
            let around = lamps.around(of.direction);
            for c in 0..3 {
                let row = &mut mix[(3 * lamp + c) * count..][..count];
                let mut usual = 0.0;
                for (other, weight) in around.iter().enumerate() {
                    row[3 * other + c] = *weight;
                    usual += weight * lamps.energies[other][c];
                }
                shift.push(brighter + (energy[c] / usual).ln());
            }
        }
        let mix = Tensor::from_data(TensorData::new(mix, [3 * config.lamps, count]), device);
        let shift = Tensor::from_data(TensorData::new(shift, [3 * config.lamps]), device);
        Ok(config.grown((&info.network, &from), (mix, shift), mean_output, device))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Precision;
    use crate::{Formulation, Normalization, Statistics};
    use light::Lamp;

    fn rig(directions: &[Vec3], energy: impl Fn(usize) -> f32) -> Rig {
        let lamp = |(i, direction): (usize, &Vec3)| Lamp {
            name: format!("olat_{i:02}"),
            direction: *direction,
            energy: [energy(i); 3],
            spread_deg: 5.0,
            confidence: 1.0,
            clipped: 0.0,
        };
        Rig {
            lamps: directions.iter().enumerate().map(lamp).collect(),
        }
    }

    fn config(size: usize, lamps: usize) -> UNetConfig {
        UNetConfig {
            size,
            lamps,
            depth: None,
            width: 16,
            most_channels: 64,
            normalization: Normalization::Group,
            statistics: Statistics::Own,
            formulation: Formulation::Ratio,
            precision: Precision::Full,
        }
    }

    #[test]
    fn the_start_has_a_network_for_any_rig_and_size_of_its_shape() -> Result<()> {
        let device = Device::flex();
        let lamps: StartLamps = toml::from_str(VIRTUAL_SUBJECTS.lamps).unwrap();
        let mean = lamps.mean_output;
        let own = rig(&lamps.directions, |_| 1.0);
        for size in [16, 64, 128, 256] {
            let network =
                VIRTUAL_SUBJECTS.network(&config(size, own.lamps.len()), &own, mean, &device)?;
            let output = network
                .unwrap()
                .forward(Tensor::full([1, 3, size, size], 0.4, &device));
            let values = output.into_data().try_into_vec::<f32>().unwrap();
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)), "{size}");
        }
        // A lamp between two others answers between them, one of twice the energy about twice as much, and a lamp without
        // direction or light is no reason to fail.
        let (a, b) = (lamps.directions[3], lamps.directions[4]);
        let other = rig(&[a, b, (a + b).normalize(), a, Vec3::ZERO], |i| {
            if i == 3 { 2.0 } else { 1.0 }
        });
        let network = VIRTUAL_SUBJECTS
            .network(&config(64, 5), &other, mean, &device)?
            .unwrap();
        let output = network.forward(Tensor::full([1, 3, 64, 64], 0.4, &device));
        let means: Vec<f32> = output
            .mean_dims(&[2, 3])
            .into_data()
            .try_into_vec::<f32>()
            .unwrap();
        let green = |lamp: usize| means[3 * lamp + 1];
        let (low, high) = (green(0).min(green(1)), green(0).max(green(1)));
        assert!(green(2) > 0.8 * low && green(2) < 1.2 * high, "{means:?}");
        assert!((1.3..2.5).contains(&(green(3) / green(0))), "{means:?}");
        assert!(means.iter().all(|mean| mean.is_finite()));
        // Other shapes start from nothing.
        let wide = UNetConfig {
            width: 32,
            ..config(64, 5)
        };
        assert!(
            VIRTUAL_SUBJECTS
                .network(&wide, &other, mean, &device)?
                .is_none()
        );
        test_support::shown!(Network, "A start from virtual subjects for lamps without direction or light",
            danger: "a mean of no lamps, the logarithm of no energy: a network that is NaN from its first step",
            done: "all lamps' mean where a direction is missing, energies from an eighth to eight times the mean");
        Ok(())
    }

    #[test]
    fn rows_are_those_of_the_lamps_around() {
        let directions = vec![Vec3::X, Vec3::Y, Vec3::Z];
        let lamps = StartLamps {
            energies: vec![[1.0; 3]; 3],
            directions,
            mean_output: 0.1,
        };
        let at = lamps.around(Vec3::X);
        assert!(at[0] > 0.99);
        let between = lamps.around(Vec3::new(1.0, 1.0, 0.0));
        assert!((between[0] - between[1]).abs() < 1e-6 && between[2] < 1e-3);
        // Behind all lamps.
        let far = lamps.around(-Vec3::ONE);
        assert!(far.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-6));
        assert!(
            lamps
                .around(Vec3::ZERO)
                .iter()
                .all(|w| (w - 1.0 / 3.0).abs() < 1e-6)
        );
    }
}
