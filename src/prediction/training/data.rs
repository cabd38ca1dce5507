//! Training data on the device: the exemplars and the interview's frames.

use super::config::TrainingConfig;
use base::error::{Error, Result};
use base::progress::Progress;
use burn::tensor::{Device, Distribution, Tensor};
use calibration::Calibration;
use footage::{Exemplar, Frame};
use imaging::{Image, Mask};
use project::Project;
use rayon::prelude::*;
use reflectance::render::{
    RATIO_FLOOR, encode, tensor_from_image, tensor_from_images, tensor_from_mask, tensor_from_weights,
};
use reflectance::{Formulation, UNetConfig};

/// The subject under the interview's light: linear and encoded `[1, 3, h, w]`, and its mask `[1, 1, h, w]`.
#[derive(Clone)]
pub struct Plate {
    pub linear: Tensor<4>,
    pub encoded: Tensor<4>,
    pub mask: Tensor<4>,
}

/// A pose: its plate, relit by the interview's light, and its OLATs `[lamps, 3, h, w]` at the interview's
/// exposure, encoded.
#[derive(Clone)]
pub struct TrainingSample {
    pub plate: Plate,
    pub encoded_olats: Tensor<4>,
}

/// All training data.
pub struct TrainingData {
    pub exemplars: Vec<Vec<TrainingSample>>,
    /// Pose held out of training.
    pub held_out: Option<TrainingSample>,
    pub frames: Vec<Plate>,
    /// Project frame numbers of `frames`.
    pub frame_numbers: Vec<usize>,
    /// Weights of the lamps in the interview's light, exposure included, `[lamps, 3, 1, 1]`:
    /// [`Calibration::learnt_light`].
    pub weights: Tensor<4>,
    /// Value of an output of 1, in linear units (of the ratio, if the network learns ratios).
    pub scale: f32,
    /// Factor that brings OLATs to about the exposure of the interview before comparison.
    pub olat_gain: f32,
    /// Mean of the sigmoid's target.
    pub mean_output: f32,
}

impl TrainingData {
    /// Reads the project's pictures, without the interview frames in `exclude` and with the pose
    /// `held_out` set apart.
    ///
    /// # Errors
    /// When a file cannot be read, no pose shows the subject, or the held-out pose does not exist or is the only one.
    pub fn load(
        project: &Project,
        calibration: &Calibration,
        config: &TrainingConfig,
        exclude: &[usize],
        held_out: Option<usize>,
        device: &Device,
        progress: &Progress,
    ) -> Result<Self> {
        let interview_light = calibration.interview_light();
        let poses = project.settings.shoot.poses.len();
        if let Some(pose) = held_out
            && (pose >= poses || poses < 2)
        {
            return Err(Error::invalid(
                format!(
                    "cannot hold out pose {pose}: {} has {poses} poses, counted from 0, and one must be left to learn \
                     from",
                    project.root.display()
                ),
                "Hold out another pose",
            ));
        }
        let mut exemplars = Vec::with_capacity(poses);
        let (mut levels, mut targets) = (Vec::new(), Vec::new());
        for pose in 0..poses {
            progress.check("nothing was trained yet")?;
            progress.step("reading poses", pose as u64, poses as u64, "");
            let exemplar = Exemplar::load(project, &calibration.response, pose)?;
            let plate = exemplar.relit_by_all(project, &calibration.response, &interview_light)?;
            // The held-out pose affects nothing.
            let samples = (held_out != Some(pose)).then(|| sample_subject(&exemplar, &plate));
            for (level, interview) in samples.into_iter().flatten() {
                levels.push(level);
                targets.push(match config.formulation {
                    Formulation::Direct => level,
                    Formulation::Ratio => level / (interview.max(0.0) + RATIO_FLOOR),
                });
            }
            exemplars.push((exemplar, plate));
        }
        progress.step("reading poses", poses as u64, poses as u64, "");
        let frame_numbers: Vec<usize> =
            (0..project.settings.shoot.frames.len()).filter(|f| !exclude.contains(f)).collect();
        let frames = frame_numbers
            .par_iter()
            .map(|&f| Frame::load(project, &calibration.response, f))
            .collect::<Result<Vec<_>>>()?;
        let empty = || {
            Error::invalid(
                format!(
                    "no pixel inside any matte of {} has light on it",
                    project.shoot_path("exemplar_masks").display()
                ),
                "Check the mattes: white where the subject is",
            )
        };
        let mean = targets.iter().map(|&v| f64::from(v)).sum::<f64>() / targets.len().max(1) as f64;
        let scale = bright_level(&mut targets).ok_or_else(empty)?;
        let olat_gain = 1.0 / bright_level(&mut levels).ok_or_else(empty)?;
        let sample = |(exemplar, plate): (Exemplar, Image)| TrainingSample {
            encoded_olats: encode(tensor_from_images(&exemplar.olats, device) * olat_gain),
            plate: Plate::new(&plate, &exemplar.mask, device),
        };
        let held_out = held_out.map(|pose| sample(exemplars.remove(pose)));
        let exemplars = exemplars.into_iter().map(|(exemplar, plate)| {
            let mut distances = Vec::new();
            for factor in [1.0, 1.0 + config.zoom, 1.0 / (1.0 + config.zoom)] {
                if factor == 1.0 && !distances.is_empty() {
                    break;
                }
                distances.push(sample((zoomed_exemplar(&exemplar, factor), zoomed(&plate, factor))));
            }
            distances
        });
        let exemplars: Vec<Vec<TrainingSample>> = exemplars.collect();
        Ok(Self {
            held_out,
            exemplars,
            frames: frames.iter().map(|f| Plate::new(&f.plate, &f.mask, device)).collect(),
            frame_numbers,
            weights: tensor_from_weights(&calibration.learnt_light(), device),
            scale,
            olat_gain,
            mean_output: mean as f32 / scale,
        })
    }
}

impl TrainingData {
    /// Noise in the shape of a shoot: six poses, eight frames and lamps of equal weight.
    pub fn noise(network: &UNetConfig, device: &Device) -> Self {
        const POSES: usize = 6;
        const FRAMES: usize = 8;
        let noise = |pictures, channels| {
            let shape = [pictures, channels, network.size, network.size];
            Tensor::random(shape, Distribution::Uniform(0.05, 0.9), device)
        };
        let linear = noise(1, 3);
        let plate = Plate { encoded: encode(linear.clone()), mask: noise(1, 1).ones_like(), linear };
        let sample = TrainingSample { plate: plate.clone(), encoded_olats: noise(network.lamps, 3) };
        Self {
            exemplars: vec![vec![sample]; POSES],
            held_out: None,
            frames: vec![plate; FRAMES],
            frame_numbers: (0..FRAMES).collect(),
            weights: tensor_from_weights(&vec![[1.0 / network.lamps as f32; 3]; network.lamps], device),
            scale: 1.0,
            olat_gain: 1.0,
            mean_output: 0.4,
        }
    }

    /// Total bytes of the pictures.
    pub fn bytes(&self) -> u64 {
        let plate = |plate: &Plate| {
            [&plate.linear, &plate.encoded, &plate.mask].iter().map(|x| x.shape().num_elements()).sum::<usize>()
        };
        let sample = |sample: &TrainingSample| plate(&sample.plate) + sample.encoded_olats.shape().num_elements();
        let samples = self.exemplars.iter().flatten().chain(&self.held_out);
        let values = samples.map(sample).sum::<usize>() + self.frames.iter().map(plate).sum::<usize>();
        4 * values as u64
    }
}

impl Plate {
    fn new(linear: &Image, mask: &Mask, device: &Device) -> Self {
        let linear = tensor_from_image(linear, device);
        Self { encoded: encode(linear.clone()), linear, mask: tensor_from_mask(mask, device) }
    }
}

fn zoomed(image: &Image, factor: f32) -> Image {
    super::augment::zoom(image, factor, [0.0; 3], |a, b, f| std::array::from_fn(|c| a[c] + f * (b[c] - a[c])))
}

fn zoomed_exemplar(exemplar: &Exemplar, factor: f32) -> Exemplar {
    Exemplar {
        pose: exemplar.pose,
        missing: exemplar.missing.clone(),
        olats: exemplar.olats.par_iter().map(|olat| zoomed(olat, factor)).collect(),
        mask: super::augment::zoom(&exemplar.mask, factor, 0.0, |a, b, f| a + f * (b - a)),
    }
}

/// Pairs of OLAT and plate at every fourth pixel of the subject, for all lamps and channels.
fn sample_subject<'a>(exemplar: &'a Exemplar, plate: &'a Image) -> impl Iterator<Item = (f32, f32)> + 'a {
    let mask = &exemplar.mask.pixels;
    let subject: Vec<usize> = (0..mask.len()).filter(|&i| mask[i] > 0.9).step_by(4).collect();
    exemplar.olats.iter().flat_map(move |olat| {
        subject.clone().into_iter().flat_map(move |i| (0..3).map(move |c| (olat.pixels[i][c], plate.pixels[i][c])))
    })
}

/// The 99.9 % quantile, if there is any light.
fn bright_level(values: &mut [f32]) -> Option<f32> {
    let rank = (values.len() as f64 * 0.999) as usize;
    if rank >= values.len() {
        return None;
    }
    let (_, &mut level, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (level > 0.0 && level.is_finite()).then_some(level)
}
