//! Poses and frames compared at a small size: the interview's light as a sum of a pose's OLATs.

use crate::arc_cosine::kernel;
use crate::cholesky::inverse;
use crate::least_squares::NormalEquations;
use crate::stand_in::StandIn;
use base::error::{Error, Result};
use base::median::median;
use base::progress::Progress;
use glam::Vec3;
use imaging::color::luminance;
use imaging::resample::resize_area;
use imaging::{Image, Mask, Response};
use project::Project;
use rayon::prelude::*;

/// Side of the compared pictures in pixels: a subject that moved a little is still alike.
const SIDE: usize = 32;
/// Number of frames compared with the poses, spread over the clip.
const FRAMES: usize = 96;
/// Smallest coverage of a compared pixel.
pub const SOLID: f32 = 0.98;
/// Smallest shared part of a pose's and a frame's pixels, and their smallest number.
const SHARED: (f32, usize) = (0.7, 20);
/// Weight of the prior that near lamps have similar weights, relative to the pictures'. On a head scan the interview's light
/// is 4 % off on the subject, 7 % without it.
const SMOOTH: f64 = 0.01;

/// Poses and frames at [`SIDE`], linear.
pub struct Pictures {
    pub poses: Vec<Pose>,
    frames: Vec<FramePicture>,
    /// Inverse covariance of the lamps' weights about their mean, row by row.
    smooth: Vec<f64>,
}

pub struct Pose {
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
pub struct Light {
    pub pose: usize,
    pub frame: usize,
    pub weights: Vec<[f32; 3]>,
    /// Root-mean-square error of the frame as a sum of the pose's OLATs, relative to the frame.
    pub residual: f32,
}

impl Pictures {
    pub fn read(project: &Project, response: &Response, progress: &Progress) -> Result<Self> {
        let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
        let small = |picture: &_| -> Result<Image> {
            let light = footage::read_framed_light(picture, framing, response)?;
            Ok(resize_area(&light, SIDE, SIDE))
        };
        let small_mask =
            |matte: &_| -> Result<Mask> { Ok(resize_area(&footage::read_mask(matte, framing)?, SIDE, SIDE)) };
        let poses = (0..shoot.poses.len())
            .map(|pose| {
                progress.check("nothing was changed")?;
                progress.step("poses", pose as u64 + 1, shoot.poses.len() as u64, &shoot.poses[pose]);
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
                let plate = small(&project.frame_picture(read)).map_err(|e| footage::offer(project, frame, e))?;
                let mask = small_mask(&project.frame_matte(read))?;
                Ok(FramePicture { number: frame, plate, mask })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { poses, frames, smooth: smooth(&shoot.lamp_layout) })
    }

    /// The frame and the pose that are most alike, and the weights of the pose's OLATs whose sum is the frame: least squares,
    /// none negative, with a prior of similar weights for near lamps (kriging, Matheron 1963).
    pub fn interview_light(&self, project: &Project) -> Result<Light> {
        let pairs: Vec<(usize, usize)> =
            (0..self.poses.len()).flat_map(|pose| (0..self.frames.len()).map(move |frame| (pose, frame))).collect();
        let compared: Vec<Light> = pairs
            .into_par_iter()
            .filter_map(|(pose, frame)| {
                let places = self.shared(pose, frame)?;
                let target: Vec<[f32; 3]> = places.iter().map(|&at| self.frames[frame].plate.pixels[at]).collect();
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
        let shared: Vec<usize> = (0..pose.len()).filter(|&at| pose[at] > SOLID && frame[at] > SOLID).collect();
        let enough = shared.len() >= SHARED.1 && shared.len() as f32 >= SHARED.0 * solid as f32;
        enough.then_some(shared)
    }

    /// Weights of the first `learnt` lamps whose sum over the pixels of some poses is nearest to `target`, and the relative
    /// residual.
    fn weights(&self, places: &[(usize, Vec<usize>)], target: &[[f32; 3]], learnt: usize) -> (Vec<[f32; 3]>, f32) {
        let lamps = self.poses[0].olats.len().min(learnt);
        let pixels = || {
            let all = places.iter().flat_map(|(pose, places)| places.iter().map(move |at| (*pose, *at)));
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
    pub fn stand_in(&self, light: &Light, learnt: usize) -> StandIn {
        let places: Vec<(usize, Vec<usize>)> = self.poses.iter().map(Pose::solid).enumerate().collect();
        let pixels = places.iter().flat_map(|(pose, places)| places.iter().map(move |at| (pose, at)));
        let target: Vec<[f32; 3]> = pixels.map(|(pose, at)| self.poses[*pose].sum(*at, &light.weights)).collect();
        let (weights, residual) = self.weights(&places, &target, learnt);
        StandIn { weights, residual }
    }
}

impl Pose {
    /// Pixels that show only the subject.
    pub fn solid(&self) -> Vec<usize> {
        (0..self.mask.pixels.len()).filter(|&at| self.mask.pixels[at] > SOLID).collect()
    }

    /// A pixel under each lamp.
    pub fn under_each(&self, at: usize) -> Vec<[f32; 3]> {
        self.olats.iter().map(|olat| olat.pixels[at]).collect()
    }

    /// A pixel as a sum of lamps.
    fn sum(&self, at: usize, weights: &[[f32; 3]]) -> [f32; 3] {
        self.olats
            .iter()
            .zip(weights)
            .fold([0.0; 3], |sum, (olat, weight)| [0, 1, 2].map(|c| sum[c] + weight[c] * olat.pixels[at][c]))
    }
}

/// Inverse covariance of weights about their common mean, for lamps at these directions.
fn smooth(directions: &[Vec3]) -> Vec<f64> {
    let n = directions.len();
    let pairs = directions.iter().flat_map(|a| directions.iter().map(move |b| a.dot(*b)));
    let mut covariance: Vec<f64> = pairs.map(|cosine| f64::from(kernel(cosine))).collect();
    (0..n).for_each(|i| covariance[i * n + i] += 1e-3);
    let Some(mut precision) = inverse(&covariance, n) else { return vec![] };
    let rows: Vec<f64> = precision.chunks(n).map(|row| row.iter().sum()).collect();
    let all: f64 = rows.iter().sum();
    for (i, row) in rows.iter().enumerate() {
        for (j, column) in rows.iter().enumerate() {
            precision[i * n + j] -= row * column / all;
        }
    }
    precision
}
