//! Calibration of a shoot without mirror balls: directions from its list of lamps, energies and the interview's light from
//! the subject.

use super::arc_cosine::kernel;
use super::calibration::Calibration;
use super::cholesky::inverse;
use super::code_values::{CLIPPED, CodeValues, PROVISIONAL, ResponseTable, STEPS};
use super::gamma::{Case, Comparison, Evidence, Interval, is_scene_linear, sample, sample_olat};
use super::least_squares::NormalEquations;
use super::median::median;
use super::settings::CalibrateSettings;
use super::stand_in::StandIn;
use super::{motion, rig_check};
use base::error::{Error, Result};
use base::progress::Progress;
use glam::{DMat3, DVec3, Vec3};
use imaging::color::luminance;
use imaging::resample::resize_area;
use imaging::{Image, Mask, Response};
use light::{Lamp, Rig};
use project::Project;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Side of the compared pictures in pixels: a subject that moved a little is still alike.
const SIDE: usize = 32;
/// Number of frames compared with the poses, spread over the clip.
const FRAMES: usize = 96;
/// Smallest coverage of a compared pixel.
const SOLID: f32 = 0.98;
/// Smallest shared part of a pose's and a frame's pixels, and their smallest number.
const SHARED: (f32, usize) = (0.7, 20);
/// Weight of the prior that near lamps have similar weights, relative to the pictures'. On a head scan the interview's light
/// is 4 % off on the subject, 7 % without it.
const SMOOTH: f64 = 0.01;
/// Median albedo of the subject. Without balls only the ratios of the lamps' energies are known.
const ALBEDO: f32 = 0.4;
/// Largest relative residual of a frame that shows its pose.
const SAME: f32 = 0.04;
/// Mean and deviation of an exponent that the pictures do not determine.
const ASSUMED: [f64; 2] = [2.2, 0.6];
/// Deviation of the curve's shape from a power.
const SHAPE: f64 = 0.1;
/// Independent pixels of a comparison: the errors of neighbours are alike.
const INDEPENDENT: f64 = 30.0;
/// Confidence of a listed direction, which nothing checks.
const LISTED: f32 = 0.6;
/// Angular radius of a lamp in degrees, which lists do not give.
const SPREAD_DEG: f32 = 3.0;

/// Calibrates a shoot without mirror balls.
///
/// # Errors
/// When a picture cannot be read, no frame shows the subject like a pose, or the job was stopped.
pub(super) fn calibrate(
    project: &Project,
    settings: &CalibrateSettings,
    progress: &Progress,
) -> Result<Calibration> {
    let shoot = &project.settings.shoot;
    let by_files = settings.trial.is_none() && is_scene_linear(project)?;
    let known = match &settings.trial {
        Some(trial) => Some(trial.response),
        None => by_files.then_some(Response::Srgb),
    };
    let mut pictures = Pictures::read(project, &known.unwrap_or(PROVISIONAL), progress)?;
    let mut light = pictures.interview_light(project)?;
    let mut found =
        Curve { response: known.unwrap_or(PROVISIONAL), deviation: 0.0, is_fitted: false };
    if known.is_none() {
        found = Curve::fit(project, &light)?;
        if found.response != PROVISIONAL {
            pictures = Pictures::read(project, &found.response, progress)?;
            light = pictures.interview_light(project)?;
        }
    }
    let evidence =
        Evidence { by_hand: settings.trial.is_some(), by_files, ..found.evidence(project, &light) };
    progress.say(format!(
        "No mirror balls: frame {} is a sum of the lamps of pose {} within {:.1} %",
        shoot.frames.name(light.frame),
        shoot.poses[light.pose],
        100.0 * light.residual
    ));
    let rig = pictures.rig(shoot.all_lamps(), &shoot.lamp_layout);
    let motion = motion::measure(project, settings, &found.response, &rig, progress)?;
    let (rig_faults, rig_findings) =
        rig_check::check_project(project, &rig, 0.0)?.into_iter().unzip();
    let learnt = shoot.lamps.len();
    let stand_in = (!shoot.other_lamps.is_empty()).then(|| pictures.stand_in(&light, learnt));
    let mut rig = rig;
    rig.lamps.truncate(learnt);
    Ok(Calibration {
        response: found.response,
        gamma_deviation: [found.deviation as f32; 2],
        exposure: settings.trial.map_or(1.0, |trial| trial.exposure),
        interview_weights: light.weights,
        stand_in,
        uncovered_energy: 0.0,
        probe_residual: light.residual,
        gamma_residual: light.residual,
        blind_share: 0.0,
        filled_energy: 0.0,
        clipped_pixels: 0,
        gamma_evidence: evidence,
        rig_findings,
        rig_faults,
        two_balls: None,
        motion,
        by_list: true,
        rig,
    })
}

/// Poses and frames at [`SIDE`], linear.
struct Pictures {
    poses: Vec<Pose>,
    frames: Vec<FramePicture>,
    /// Inverse covariance of the lamps' weights about their mean, row by row.
    smooth: Vec<f64>,
}

struct Pose {
    /// One picture per lamp of the shoot.
    olats: Vec<Image>,
    mask: Mask,
}

struct FramePicture {
    /// Number in the shoot.
    number: usize,
    plate: Image,
    mask: Mask,
}

/// The interview's light, from the frame and the pose that are most alike.
struct Light {
    pose: usize,
    frame: usize,
    weights: Vec<[f32; 3]>,
    /// Root-mean-square error of the frame as a sum of the pose's OLATs, relative to the frame.
    residual: f32,
}

impl Pictures {
    fn read(project: &Project, response: &Response, progress: &Progress) -> Result<Self> {
        let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
        let small = |picture: &_| -> Result<Image> {
            let light = footage::read_framed_light(picture, framing, response)?;
            Ok(resize_area(&light, SIDE, SIDE))
        };
        let small_mask = |matte: &_| -> Result<Mask> {
            Ok(resize_area(&footage::read_mask(matte, framing)?, SIDE, SIDE))
        };
        let poses = (0..shoot.poses.len())
            .map(|pose| {
                progress.check("nothing was changed")?;
                progress.step(
                    "poses",
                    pose as u64 + 1,
                    shoot.poses.len() as u64,
                    &shoot.poses[pose],
                );
                let lamps = (0..shoot.all_lamps().len()).into_par_iter();
                let olats = lamps.map(|lamp| {
                    if project.has_olat(pose, lamp) {
                        small(&project.olat_picture(pose, lamp))
                    } else {
                        Ok(Image::filled(SIDE, SIDE, [0.0; 3]))
                    }
                });
                let mut olats = olats.collect::<Result<Vec<_>>>()?;
                footage::fill_missing(project, response, pose, &mut olats)?;
                let mask = small_mask(&project.exemplar_matte(pose))?;
                Ok(Pose { olats, mask })
            })
            .collect::<Result<Vec<_>>>()?;
        progress.check("nothing was changed")?;
        let step = shoot.frames.len().div_ceil(FRAMES).max(1);
        let frames: Vec<usize> = (0..shoot.frames.len()).step_by(step).collect();
        let frames = frames
            .into_par_iter()
            .map(|frame| {
                let read = footage::readable_frame(project, frame)?;
                let plate = small(&project.frame_picture(read))
                    .map_err(|e| footage::offer(project, frame, e))?;
                let mask = small_mask(&project.frame_matte(read))?;
                Ok(FramePicture { number: frame, plate, mask })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { poses, frames, smooth: smooth(&shoot.lamp_layout) })
    }

    /// The frame and the pose that are most alike, and the weights of the pose's OLATs whose sum is the frame: least squares,
    /// none negative, with a prior of similar weights for near lamps (kriging, Matheron 1963).
    fn interview_light(&self, project: &Project) -> Result<Light> {
        let pairs: Vec<(usize, usize)> = (0..self.poses.len())
            .flat_map(|pose| (0..self.frames.len()).map(move |frame| (pose, frame)))
            .collect();
        let compared: Vec<Light> = pairs
            .into_par_iter()
            .filter_map(|(pose, frame)| {
                let places = self.shared(pose, frame)?;
                let target: Vec<[f32; 3]> =
                    places.iter().map(|&at| self.frames[frame].plate.pixels[at]).collect();
                let (weights, residual) = self.weights(&[(pose, places)], &target, usize::MAX);
                Some(Light { pose, frame: self.frames[frame].number, weights, residual })
            })
            .collect();
        compared.into_iter().min_by(|a, b| a.residual.total_cmp(&b.residual)).ok_or_else(|| {
            Error::invalid(
                format!(
                    "no frame of {} shows the subject at the place of a pose, so the interview's light cannot be found \
                     without mirror balls",
                    project.root.display()
                ),
                "Check the mattes and the crop, add probes/ with the mirror balls, or film one of the poses",
            )
        })
    }

    /// Pixels that show the subject in a pose and in a frame; None if they are too few.
    fn shared(&self, pose: usize, frame: usize) -> Option<Vec<usize>> {
        let (pose, frame) = (&self.poses[pose].mask.pixels, &self.frames[frame].mask.pixels);
        let solid = pose.iter().filter(|v| **v > SOLID).count();
        let shared: Vec<usize> =
            (0..pose.len()).filter(|&at| pose[at] > SOLID && frame[at] > SOLID).collect();
        let enough = shared.len() >= SHARED.1 && shared.len() as f32 >= SHARED.0 * solid as f32;
        enough.then_some(shared)
    }

    /// Weights of the first `learnt` lamps whose sum over the pixels of some poses is nearest to `target`, and the relative
    /// residual.
    fn weights(
        &self,
        places: &[(usize, Vec<usize>)],
        target: &[[f32; 3]],
        learnt: usize,
    ) -> (Vec<[f32; 3]>, f32) {
        let lamps = self.poses[0].olats.len().min(learnt);
        let pixels = || {
            let all =
                places.iter().flat_map(|(pose, places)| places.iter().map(move |at| (*pose, *at)));
            all.zip(target)
        };
        let mean = median(target.iter().map(|light| luminance(*light))).max(f32::MIN_POSITIVE);
        let mut weights = vec![[0.0; 3]; lamps];
        for c in 0..3 {
            let mut gram = vec![0.0; lamps * lamps];
            let mut sums = vec![0.0; lamps];
            let mut terms = vec![0.0; lamps];
            for ((pose, at), light) in pixels() {
                // Noise and misfit grow with the light.
                let trust = f64::from(1.0 / (light[c].max(0.0) + 0.1 * mean));
                for (term, olat) in terms.iter_mut().zip(&self.poses[pose].olats) {
                    *term = f64::from(olat.pixels[at][c]);
                }
                for i in 0..lamps {
                    sums[i] += trust * terms[i] * f64::from(light[c]);
                    for j in 0..lamps {
                        gram[i * lamps + j] += trust * terms[i] * terms[j];
                    }
                }
            }
            if self.smooth.len() == gram.len() {
                let trace: f64 = (0..lamps).map(|i| gram[i * lamps + i]).sum();
                let size = SMOOTH * trace / lamps as f64;
                gram.iter_mut().zip(&self.smooth).for_each(|(g, s)| *g += size * s);
            }
            let solution = NormalEquations::from_gram(gram, sums).solve();
            weights.iter_mut().zip(solution).for_each(|(weight, x)| weight[c] = x as f32);
        }
        let (mut off, mut all) = (0.0, 0.0);
        for ((pose, at), light) in pixels() {
            let sum = self.poses[pose].sum(at, &weights);
            for c in 0..3 {
                off += f64::from(sum[c] - light[c]).powi(2);
                all += f64::from(light[c]).powi(2);
            }
        }
        (weights, if all > 0.0 { (off / all).sqrt() as f32 } else { 1.0 })
    }

    /// Weights of the learnt lamps nearest to the interview's light by all lamps.
    fn stand_in(&self, light: &Light, learnt: usize) -> StandIn {
        let places: Vec<(usize, Vec<usize>)> =
            self.poses.iter().map(Pose::solid).enumerate().collect();
        let pixels =
            places.iter().flat_map(|(pose, places)| places.iter().map(move |at| (pose, at)));
        let target: Vec<[f32; 3]> =
            pixels.map(|(pose, at)| self.poses[*pose].sum(*at, &light.weights)).collect();
        let (weights, residual) = self.weights(&places, &target, learnt);
        StandIn { weights, residual }
    }

    /// Lamps at the listed directions, with energies by photometric stereo (Woodham 1980): in turn the albedo times the normal
    /// of each pixel, and the energy of each lamp, without pixels in shadow or glint. The mean lamp is white. A lamp that
    /// lights too few pixels has the median energy.
    fn rig<'a>(&self, names: impl Iterator<Item = &'a String>, directions: &[Vec3]) -> Rig {
        let lights: Vec<Vec<[f32; 3]>> = (self.poses.iter())
            .flat_map(|pose| pose.solid().into_iter().map(move |at| pose.under_each(at)))
            .collect();
        let mut energies = vec![1.0f32; directions.len()];
        let mut surfaces: Vec<Option<Surface>> = vec![];
        for _ in 0..ROUNDS {
            surfaces = (lights.par_iter())
                .map(|light| Surface::new(light, &energies, directions))
                .collect();
            energies = energies_by(&lights, &surfaces, directions, |_, light| luminance(light));
        }
        let lengths = surfaces.iter().flatten().map(|surface| surface.normal.length() as f32);
        let scale = median(lengths) * PI / ALBEDO;
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len().max(1) as f32;
        let by_channel = [0, 1, 2].map(|c| {
            let shares: Vec<f32> = surfaces
                .iter()
                .zip(&lights)
                .map(|(surface, light)| {
                    let used = surface.iter().flat_map(|surface| surface.used.iter().copied());
                    median(used.map(|i| light[i][c] / luminance(light[i]).max(f32::MIN_POSITIVE)))
                })
                .collect();
            let energies = energies_by(&lights, &surfaces, directions, |pixel, light| {
                light[c] / shares[pixel].max(1e-3)
            });
            let white = mean(&energies).max(f32::MIN_POSITIVE);
            energies.iter().map(|energy| energy / white).collect::<Vec<_>>()
        });
        let scale = scale * mean(&energies);
        let lamp = |(i, (name, direction)): (usize, (&String, &Vec3))| Lamp {
            name: name.clone(),
            direction: *direction,
            energy: [0, 1, 2].map(|c| scale * by_channel[c][i]),
            spread_deg: SPREAD_DEG,
            confidence: LISTED,
            clipped: 0.0,
        };
        Rig { lamps: names.zip(directions).enumerate().map(lamp).collect() }
    }
}

impl Pose {
    /// Pixels that show only the subject.
    fn solid(&self) -> Vec<usize> {
        (0..self.mask.pixels.len()).filter(|&at| self.mask.pixels[at] > SOLID).collect()
    }

    /// A pixel under each lamp.
    fn under_each(&self, at: usize) -> Vec<[f32; 3]> {
        self.olats.iter().map(|olat| olat.pixels[at]).collect()
    }

    /// A pixel as a sum of lamps.
    fn sum(&self, at: usize, weights: &[[f32; 3]]) -> [f32; 3] {
        self.olats.iter().zip(weights).fold([0.0; 3], |sum, (olat, weight)| {
            [0, 1, 2].map(|c| sum[c] + weight[c] * olat.pixels[at][c])
        })
    }
}

/// A matte surface under the lamps.
struct Surface {
    /// Normal times albedo over π, in units of the lamps' energies.
    normal: DVec3,
    /// Lamps that light it without shadow or glint.
    used: Vec<usize>,
}

/// Rounds of normals and energies.
const ROUNDS: usize = 8;
/// Smallest cosine of light that counts: grazing light is often shadowed.
const GRAZING: f64 = 0.2;

impl Surface {
    /// Least squares over the lamps that light a pixel (Lambert), without outliers; None if fewer than four do.
    fn new(light: &[[f32; 3]], energies: &[f32], directions: &[Vec3]) -> Option<Self> {
        let values: Vec<f64> =
            light.iter().zip(energies).map(|(l, e)| f64::from(luminance(*l) / e)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        // Without the brightest tenth, which may be glints.
        let bright = sorted[9 * (sorted.len() - 1) / 10];
        let mut used: Vec<usize> =
            (0..values.len()).filter(|&i| values[i] > 0.3 * bright).collect();
        let mut normal = DVec3::ZERO;
        for _ in 0..4 {
            if used.len() < 4 {
                return None;
            }
            let (mut gram, mut sum) = (DMat3::ZERO, DVec3::ZERO);
            for &i in &used {
                let to = directions[i].as_dvec3();
                gram += DMat3::from_cols(to.x * to, to.y * to, to.z * to);
                sum += values[i] * to;
            }
            if gram.determinant().abs() < 1e-6 {
                return None;
            }
            normal = gram.inverse() * sum;
            let size = normal.length();
            let cosine = |i: usize| directions[i].as_dvec3().dot(normal) / size;
            let off = |i: usize| (values[i] / size - cosine(i)).abs();
            let facing = (0..values.len()).filter(|&i| cosine(i) > GRAZING);
            let typical = f64::from(median(facing.clone().map(|i| off(i) as f32)));
            let limit = 3.0 * typical.max(0.01);
            used = facing.filter(|&i| off(i) < limit).collect();
        }
        Some(Self { normal, used })
    }
}

/// Energy of each lamp relative to the median lamp's: the median over the pixels that face it of their light by their
/// cosine. Few pixels, as of a lamp behind the subject, count less than the likeness of the lamps.
fn energies_by(
    lights: &[Vec<[f32; 3]>],
    surfaces: &[Option<Surface>],
    directions: &[Vec3],
    light_of: impl Fn(usize, [f32; 3]) -> f32 + Sync,
) -> Vec<f32> {
    /// Share of all pixels that counts as much as the likeness of the lamps.
    const FEW: f32 = 0.05;
    let energy = |lamp: usize| {
        let to = directions[lamp].as_dvec3();
        let ratios: Vec<f32> = (surfaces.iter().zip(lights).enumerate())
            .filter_map(|(pixel, (surface, light))| {
                let normal = surface.as_ref()?.normal;
                let cosine = to.dot(normal);
                // Shadowed pixels count too: which they are depends on the energy.
                (cosine > 2.0 * GRAZING * normal.length())
                    .then(|| light_of(pixel, light[lamp]) / cosine as f32)
            })
            .collect();
        let count = ratios.len() as f32;
        (median(ratios.into_iter()), count / (count + FEW * lights.len() as f32).max(1.0))
    };
    let found: Vec<(f32, f32)> = (0..directions.len()).into_par_iter().map(energy).collect();
    let is_lit = |(energy, share): &&(f32, f32)| *energy > 0.0 && *share > 0.5;
    let typical = median(found.iter().filter(is_lit).map(|(energy, _)| *energy));
    let relative = |(energy, share): (f32, f32)| {
        if energy > 0.0 && typical > 0.0 { (energy / typical).powf(share) } else { 1.0 }
    };
    found.into_iter().map(relative).collect()
}

/// Inverse covariance of weights about their common mean, for lamps at these directions.
fn smooth(directions: &[Vec3]) -> Vec<f64> {
    let n = directions.len();
    let pairs = directions.iter().flat_map(|a| directions.iter().map(move |b| a.dot(*b)));
    let mut covariance: Vec<f64> = pairs.map(|cosine| f64::from(kernel(cosine))).collect();
    (0..n).for_each(|i| covariance[i * n + i] += 1e-3);
    let Some(mut precision) = inverse(&covariance, n) else {
        return vec![];
    };
    let rows: Vec<f64> = precision.chunks(n).map(|row| row.iter().sum()).collect();
    let all: f64 = rows.iter().sum();
    for (i, row) in rows.iter().enumerate() {
        for (j, column) in rows.iter().enumerate() {
            precision[i * n + j] -= row * column / all;
        }
    }
    precision
}

/// The camera's response, known, fitted or assumed.
struct Curve {
    response: Response,
    /// Standard deviation of its exponent; 0 if it is known.
    deviation: f64,
    /// True if a frame shows a pose, and its pixels were compared.
    is_fitted: bool,
}

impl Curve {
    /// Compares a pose and a frame, pixel by pixel at full size, under powers and standard curves, each with its own best
    /// light. A frame that does not show the pose says nothing: the curve is assumed.
    fn fit(project: &Project, light: &Light) -> Result<Self> {
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
        let best =
            powers.iter().fold(powers[0], |best, one| if one.1 < best.1 { *one } else { best });
        let odds = |cost: f64| (best.1 - cost).exp();
        let total: f64 = powers.iter().map(|(_, cost)| odds(*cost)).sum();
        let mean = powers.iter().map(|(gamma, cost)| gamma * odds(*cost)).sum::<f64>() / total;
        let square =
            powers.iter().map(|(gamma, cost)| (gamma - mean).powi(2) * odds(*cost)).sum::<f64>()
                / total;
        let standards = [Response::Srgb, Response::Rec709].map(|curve| (curve, cost(&curve)));
        let standard = standards.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let response = match standard {
            Some((curve, cost)) if cost < best.1 - STANDARD => curve,
            _ => Response::Power(mean as f32),
        };
        Ok(Self { response, deviation: square.sqrt().hypot(SHAPE), is_fitted: true })
    }

    fn evidence(&self, project: &Project, light: &Light) -> Evidence {
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

/// Smallest difference of costs at which a standard curve takes the place of a power.
const STANDARD: f64 = 3.0;

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
        let shared: Vec<usize> =
            (0..pose.pixels.len()).filter(|at| same_size && is_shared(at)).collect();
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
                let sum: f64 = (olats.iter().zip(&weights))
                    .map(|(code, weight)| weight * f64::from(table.light(code[c])))
                    .sum();
                let found = f64::from(table.encode(sum as f32));
                square += (found - f64::from(frame[c]) / f64::from(STEPS)).powi(2);
            }
        }
        square / (3 * self.frame.len()).max(1) as f64
    }
}
