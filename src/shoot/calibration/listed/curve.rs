//! The camera's response of a shoot without mirror balls.

use super::pictures::{Light, SOLID};
use crate::code_values::{CLIPPED, CodeValues, PROVISIONAL, ResponseTable, STEPS};
use crate::gamma::{Case, Comparison, Evidence, Interval, sample, sample_olat};
use crate::least_squares::NormalEquations;
use base::error::Result;
use imaging::Response;
use project::Project;
use rayon::prelude::*;

/// Largest relative residual of a frame that shows its pose.
const SAME: f32 = 0.04;
/// Mean and deviation of an exponent that the pictures do not determine.
const ASSUMED: [f64; 2] = [2.2, 0.6];
/// Deviation of the curve's shape from a power.
const SHAPE: f64 = 0.1;
/// Independent pixels of a comparison: the errors of neighbours are alike.
const INDEPENDENT: f64 = 30.0;
/// Smallest difference of costs at which a standard curve takes the place of a power.
const STANDARD: f64 = 3.0;

/// The camera's response, known, fitted or assumed.
pub struct Curve {
    pub response: Response,
    /// Standard deviation of its exponent; 0 if it is known.
    pub deviation: f64,
    /// True if a frame shows a pose, and its pixels were compared.
    pub is_fitted: bool,
}

impl Curve {
    /// Compares a pose and a frame, pixel by pixel at full size, under powers and standard curves, each with its own best
    /// light. A frame that does not show the pose says nothing: the curve is assumed.
    pub fn fit(project: &Project, light: &Light) -> Result<Self> {
        let assumed = Self { response: PROVISIONAL, deviation: ASSUMED[1], is_fitted: false };
        if light.residual > SAME {
            return Ok(assumed);
        }
        let samples = Samples::read(project, light)?;
        if samples.frame.len() < 4 * samples.lamps {
            return Ok(assumed);
        }
        let cost = |response: &Response| {
            INDEPENDENT * samples.distance(&ResponseTable::from_response(response)).max(1e-5).ln()
        };
        let powers: Vec<(f64, f64)> = (0..=60)
            .into_par_iter()
            .map(|i| {
                let gamma = 1.0 + 0.05 * f64::from(i);
                let prior = 0.5 * ((gamma - ASSUMED[0]) / ASSUMED[1]).powi(2);
                (gamma, cost(&Response::Power(gamma as f32)) + prior)
            })
            .collect();
        let best = powers.iter().fold(powers[0], |best, one| if one.1 < best.1 { *one } else { best });
        let odds = |cost: f64| (best.1 - cost).exp();
        let total: f64 = powers.iter().map(|(_, cost)| odds(*cost)).sum();
        let mean = powers.iter().map(|(gamma, cost)| gamma * odds(*cost)).sum::<f64>() / total;
        let square = powers.iter().map(|(gamma, cost)| (gamma - mean).powi(2) * odds(*cost)).sum::<f64>() / total;
        let standards = [Response::Srgb, Response::Rec709].map(|curve| (curve, cost(&curve)));
        let standard = standards.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let response = match standard {
            Some((curve, cost)) if cost < best.1 - STANDARD => curve,
            _ => Response::Power(mean as f32),
        };
        Ok(Self { response, deviation: square.sqrt().hypot(SHAPE), is_fitted: true })
    }

    pub fn evidence(&self, project: &Project, light: &Light) -> Evidence {
        let shoot = &project.settings.shoot;
        if self.deviation == 0.0 {
            return Evidence::default();
        }
        let (near, _) = self.response.nearest_dual_gamma();
        let [gamma1, gamma2] = self.response.exponents().unwrap_or([near.gamma1, near.gamma2]);
        let deviation = self.deviation as f32;
        let case = Case {
            changed: false,
            probability: 1.0,
            gamma1,
            gamma2,
            exposure: 1.0,
            mean: [gamma1, gamma2, 0.0],
            deviation: [deviation, deviation, 0.0],
        };
        let comparison = if self.is_fitted { Comparison::Pixels } else { Comparison::Distribution };
        let names = [shoot.poses[light.pose].clone(), shoot.frames.name(light.frame).into_owned()];
        Evidence {
            comparison,
            same_poses: if self.is_fitted { vec![names] } else { vec![] },
            intervals: Interval::from_cases(&[case]),
            ..Evidence::default()
        }
    }
}

/// Code values of a pose's pixels and a frame's at full size.
struct Samples {
    lamps: usize,
    /// Code values of each pixel under each lamp: `olats[pixel · lamps + lamp]`.
    olats: Vec<CodeValues>,
    frame: Vec<CodeValues>,
}

impl Samples {
    /// Up to about `MOST` pixels that show the subject in both, not clipped.
    fn read(project: &Project, light: &Light) -> Result<Self> {
        const MOST: usize = 1000;
        let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
        let mattes = [project.exemplar_matte(light.pose), project.frame_matte(light.frame)];
        let read = |matte| footage::read_mask(matte, framing);
        let masks = [read(&mattes[0])?, read(&mattes[1])?];
        let [pose, frame] = &masks;
        let lamps = shoot.all_lamps().len();
        let is_shared = |at: &usize| pose.pixels[*at] > SOLID && frame.pixels[*at] > SOLID;
        let same_size = pose.size() == frame.size();
        let shared: Vec<usize> = (0..pose.pixels.len()).filter(|at| same_size && is_shared(at)).collect();
        let step = shared.len().div_ceil(MOST).max(1);
        let places: Vec<usize> = shared.into_iter().step_by(step).collect();
        let picture = project.frame_picture(light.frame);
        let plate = sample(&picture, framing, frame, &mattes[1], &places, 1.0)?;
        let is_open = |code: &CodeValues| code.iter().all(|c| *c < CLIPPED);
        let (places, frame): (Vec<usize>, Vec<CodeValues>) =
            places.into_iter().zip(plate).filter(|(_, code)| is_open(code)).unzip();
        let olats = (0..lamps)
            .into_par_iter()
            .map(|lamp| sample_olat(project, (light.pose, lamp), (pose, &mattes[0]), &places, 1.0))
            .collect::<Result<Vec<_>>>()?;
        let olats = (0..frame.len()).flat_map(|i| olats.iter().map(move |olat| olat[i])).collect();
        Ok(Self { lamps, olats, frame })
    }

    /// Mean squared encoded distance of the frame from the nearest sum of the lamps under a response.
    fn distance(&self, table: &ResponseTable) -> f64 {
        let mut square = 0.0;
        for c in 0..3 {
            let mut equations = NormalEquations::new(self.lamps);
            let rows = || self.olats.chunks_exact(self.lamps).zip(&self.frame);
            for (olats, frame) in rows() {
                // Distances of encoded values.
                let slope = f64::from(table.slope(frame[c]));
                let terms: Vec<(usize, f64)> = (olats.iter().enumerate())
                    .map(|(lamp, code)| (lamp, f64::from(table.light(code[c])) / slope))
                    .filter(|(_, light)| *light != 0.0)
                    .collect();
                equations.add(&terms, f64::from(table.light(frame[c])) / slope);
            }
            let weights = equations.solve();
            for (olats, frame) in rows() {
                let sum: f64 =
                    (olats.iter().zip(&weights)).map(|(code, weight)| weight * f64::from(table.light(code[c]))).sum();
                let found = f64::from(table.encode(sum as f32));
                square += (found - f64::from(frame[c]) / f64::from(STEPS)).powi(2);
            }
        }
        square / (3 * self.frame.len()).max(1) as f64
    }
}
