//! Truth of a shoot, for judging results.

use super::manifest::{HDRI_NOTE, INTERVIEW_KIND, NOISE, OTHER_INTERVIEW_KIND, TroubleTruth, Truth, WEIGHTS_NOTE};
use super::session::Session;
use super::shoot::{Exposures, PROBE_AMBIENT};
use super::span::NearestSum;
use super::trouble::Trouble;

impl Session<'_> {
    /// The truth of the whole shoot.
    pub fn truth(&self, exposures: &Exposures, neutral_density: f32, nearest: Option<NearestSum>) -> Truth {
        let per_olat = exposures.interview / exposures.olat;
        let counts = self.dome.bank_counts();
        let bank_means = |weights: &[[f32; 3]]| {
            let mut means = vec![[0.0f32; 3]; counts.len()];
            for (weight, &bank) in weights.iter().zip(&self.dome.bank_of_lamp) {
                means[bank].iter_mut().zip(weight).for_each(|(m, w)| *m += w / counts[bank] as f32);
            }
            means
        };
        let (curve, distance) = self.sensor.response.nearest_dual_gamma();
        let weights = self.light.nearest_banks(&self.dome);
        let scaled =
            |weights: &[[f32; 3]]| -> Vec<[f32; 3]> { weights.iter().map(|w| w.map(|v| v * per_olat)).collect() };
        Truth {
            g1: curve.gamma1,
            g2: curve.gamma2,
            exposure_interview: exposures.interview,
            exposure_olat: exposures.olat,
            probe_neutral_density: neutral_density,
            probe_ambient_linear: PROBE_AMBIENT,
            noise: NOISE,
            interview_kind: if self.light.is_of_banks() { INTERVIEW_KIND } else { OTHER_INTERVIEW_KIND },
            weights_linear_interview_per_olat: scaled(&weights),
            weights_note: WEIGHTS_NOTE,
            bank_weights_unit_radiance: weights,
            interview_lamp_weights: self.light.weights[..self.dome.lamps.len()].to_vec(),
            hdri_bank_weights: self
                .environments
                .iter()
                .zip(&self.environment_weights)
                .map(|((name, _), weights)| ((*name).to_owned(), bank_means(weights)))
                .collect(),
            hdri_note: HDRI_NOTE,
            poses: self.poses.clone(),
            frames: self.frames.clone(),
            truth_frames: self.truth_frames.clone(),
            trouble: (self.trouble != Trouble::default()).then(|| TroubleTruth {
                trouble: self.trouble,
                response: self.sensor.response,
                response_distance: distance,
                panels: self.light.panels.clone(),
                off_span: nearest.as_ref().map_or(0.0, |n| n.residual),
                nearest_sum_linear_interview_per_olat: nearest.map_or(vec![], |n| scaled(&n.weights)),
                sway_px: self.sway_px(),
            }),
        }
    }
}
