//! Training input of the rival methods: the poses of the OLAT session, as in the network's training.

use base::error::{Error, Result};
use base::progress::Progress;
use burn::tensor::{Device, Tensor};
use calibration::Calibration;
use footage::Exemplar;
use imaging::{Image, Mask};
use light::Rig;
use project::Project;
use reflectance::render::{encode, tensor_from_image, tensor_from_images, tensor_from_mask, tensor_from_weights};

/// Coverage above which a pixel counts as subject.
const SUBJECT: f32 = 0.9;

/// A pose under the interview's light and under each lamp alone, linear.
pub struct Pose {
    pub plate: Image,
    pub mask: Mask,
    pub olats: Vec<Image>,
}

/// The poses of a project.
pub struct Poses {
    pub(crate) poses: Vec<Pose>,
    pub(crate) rig: Rig,
    /// Weights of the lamps in the interview's light.
    pub(crate) interview: Vec<[f32; 3]>,
}

impl Poses {
    /// Reads the project's poses except `held_out`, and lights them like the interview.
    ///
    /// # Errors
    /// When a picture cannot be read, or no remaining pose has a matte with a subject.
    pub fn load(
        project: &Project,
        calibration: &Calibration,
        held_out: Option<usize>,
        progress: &Progress,
    ) -> Result<Self> {
        let light = calibration.interview_light();
        let count = project.settings.shoot.poses.len();
        let mut poses = Vec::with_capacity(count);
        for pose in (0..count).filter(|pose| held_out != Some(*pose)) {
            progress.check("nothing was learnt yet")?;
            progress.step("reading poses", pose as u64, count as u64, "");
            let exemplar = Exemplar::load(project, &calibration.response, pose)?;
            let plate = exemplar.relit_by_all(project, &calibration.response, &light)?;
            poses.push(Pose { plate, mask: exemplar.mask, olats: exemplar.olats });
        }
        progress.step("reading poses", count as u64, count as u64, "");
        poses.retain(|pose| subject(&pose.mask).next().is_some());
        if poses.is_empty() {
            return Err(Error::invalid(
                format!(
                    "no pose of {} has a matte that shows a subject, so there is nothing to learn from",
                    project.root.display()
                ),
                "Check the mattes of the poses: white where the subject is",
            ));
        }
        Ok(Self { poses, rig: calibration.rig.clone(), interview: calibration.learnt_light() })
    }

    /// Number of lamps.
    pub fn lamps(&self) -> usize {
        self.poses[0].olats.len()
    }

    /// Width and height of the pictures.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.poses[0].mask.size()
    }

    /// Mean over the subject's pixels of all poses under each lamp, per channel.
    pub(crate) fn levels(&self) -> Vec<[f32; 3]> {
        let mean = |lamp: usize| {
            let (mut sum, mut count) = ([0.0f64; 3], 0usize);
            for pose in &self.poses {
                for i in subject(&pose.mask) {
                    for (sum, &value) in sum.iter_mut().zip(&pose.olats[lamp].pixels[i]) {
                        *sum += f64::from(value.max(0.0));
                    }
                    count += 1;
                }
            }
            sum.map(|sum| (sum / count.max(1) as f64) as f32)
        };
        (0..self.lamps()).map(mean).collect()
    }
}

impl Pose {
    /// The pose under a light: Σ weights · OLATs.
    pub fn relit(&self, weights: &[[f32; 3]]) -> Image {
        let mut sum = Image::filled(self.mask.width, self.mask.height, [0.0; 3]);
        for (olat, weight) in self.olats.iter().zip(weights) {
            if *weight == [0.0; 3] {
                continue;
            }
            for (out, pixel) in sum.pixels.iter_mut().zip(&olat.pixels) {
                for c in 0..3 {
                    out[c] += weight[c] * pixel[c];
                }
            }
        }
        sum
    }

    /// The pose on a device.
    pub fn tensors(&self, device: &Device) -> PoseTensors {
        PoseTensors {
            plate: tensor_from_image(&self.plate, device),
            mask: tensor_from_mask(&self.mask, device),
            olats: tensor_from_images(&self.olats, device),
        }
    }
}

/// A pose on a device: plate `[1, 3, h, w]`, mask `[1, 1, h, w]` and OLATs `[lamps, 3, h, w]`, linear.
pub struct PoseTensors {
    pub plate: Tensor<4>,
    pub mask: Tensor<4>,
    pub olats: Tensor<4>,
}

impl PoseTensors {
    /// The pose under a light, `[1, 3, h, w]`.
    pub fn relit(&self, weights: &[[f32; 3]]) -> Tensor<4> {
        let mut lit = weights.iter().enumerate().filter(|(_, w)| **w != [0.0; 3]);
        if let (Some((lamp, weight)), None) = (lit.next(), lit.next()) {
            let weight = tensor_from_weights(&[*weight], &self.olats.device());
            return self.olats.clone().narrow(0, lamp, 1) * weight;
        }
        let weights = tensor_from_weights(weights, &self.olats.device());
        (self.olats.clone() * weights).sum_dim(0)
    }
}

/// Network input: the encoded plate, cut out.
pub fn input(plate: Tensor<4>, mask: &Tensor<4>) -> Tensor<4> {
    encode(plate) * mask.clone()
}

/// The pixels of the subject.
pub fn subject(mask: &Mask) -> impl Iterator<Item = usize> + '_ {
    let pixels = mask.pixels.iter().enumerate();
    pixels.filter(|(_, a)| **a > SUBJECT).map(|(i, _)| i)
}

/// The 99.9 % quantile of these pixels' values; None if they are all dark.
pub fn bright_level(values: &mut [f32]) -> Option<f32> {
    let rank = (values.len() as f64 * 0.999) as usize;
    if rank >= values.len() {
        return None;
    }
    let (_, &mut level, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (level > 0.0 && level.is_finite()).then_some(level)
}
