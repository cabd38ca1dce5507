//! Single image portrait relighting (Sun et al. 2019), trained only on this subject's poses. Input: a picture in one light and
//! a target light. Output: the picture in the target light.
//!
//! The published network saw eighteen people but never the one it relights; this one sees only its subject, which favours it.

use super::learner::{Effort, Spent, draw, learn};
use super::lights::{Lights, Shares};
use super::patches::images;
use super::portrait_network::{Encoding, PortraitNetwork};
use super::poses::{PoseTensors, Poses, bright_level, input, subject};
use base::error::{Error, Result};
use base::progress::Progress;
use base::turn;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use footage::Frame;
use imaging::Image;
use rand::RngExt;
use reflectance::kernels::{LossInputs, LossSettings};
use reflectance::render::{encode, tensor_from_image, tensor_from_mask};
use training::augment::shift;
use training::loss::Criterion;

/// Target lights per step, of one pose.
const TARGETS: usize = 6;
/// Number of lights predicted at once.
const AT_ONCE: usize = 8;
/// Interval in steps of input pictures in a light other than the interview's.
const OTHER_SOURCE: u64 = 4;
/// Weight of the error in the estimated light of the input picture.
const SOURCE: f32 = 0.2;
/// Largest shift of a pose, as a share of its size, as in the network's own training.
const SHIFT: f32 = 0.05;
const RATE: f64 = 1e-3;
/// Number of lights by which the level of relit pictures is measured.
const MEASURED: u64 = 24;

/// A network that relights a frame by any light.
pub struct Portrait {
    network: PortraitNetwork,
    /// Means of the poses under each lamp.
    levels: Vec<[f32; 3]>,
    /// Value of an output of 1, in a light whose total is 1.
    scale: f32,
    device: Device,
    pub spent: Spent,
}

impl Portrait {
    /// Trains on the poses in random lights: single lamps, the built-in environments, lobes of light.
    ///
    /// # Errors
    /// When no pose has light on it, the user stops, or training fails.
    pub fn learn(poses: &Poses, effort: &Effort, device: &Device, progress: &Progress) -> Result<Self> {
        let autodiff = device.clone().autodiff();
        let levels = poses.levels();
        let lights = Lights::new(&poses.rig);
        let (scale, mean) = level(poses, &lights, &levels, effort.seed)?;
        let learner = Learner {
            interview: Shares::new(&poses.interview, &levels),
            poses: (poses.poses.iter()).map(|pose| pose.tensors(&autodiff)).collect(),
            brightness: poses.poses.iter().map(brightness).collect(),
            levels,
            lights,
            scale,
            seed: effort.seed,
            device: autodiff.clone(),
        };
        autodiff.seed(effort.seed);
        let network = PortraitNetwork::new(poses.size().0, poses.lamps(), mean / scale, &autodiff);
        let mut criterion = Criterion::default();
        let told = ("training portrait relighting", progress);
        let (network, spent) = learn(network.materialize(), effort, RATE, told, |network, step| {
            learner.loss(network, &mut criterion, step)
        })?;
        Ok(Self { network, levels: learner.levels, scale, device: device.clone(), spent })
    }

    /// Number of lamps of a light.
    pub fn lamps(&self) -> usize {
        self.levels.len()
    }

    /// A frame under each of `lights`, linear, zero outside the matte.
    ///
    /// # Errors
    /// When the device fails, or a light has a different number of lamps.
    pub fn relit(&self, frame: &Frame, lights: &[Vec<[f32; 3]>]) -> Result<Vec<Image>> {
        if let Some(light) = lights.iter().find(|l| l.len() != self.levels.len()) {
            return Err(Error::invalid(
                format!("the light has {} lamps, but the network learnt {}", light.len(), self.levels.len()),
                "Calibrate this project again",
            ));
        }
        let _turn = turn::DEVICE.lock();
        let encoding = self.encoding(frame);
        let inside = tensor_from_mask(&frame.mask, &self.device).greater_elem(0.0).float();
        let mut pictures = Vec::with_capacity(lights.len());
        for lights in lights.chunks(AT_ONCE) {
            let shares: Vec<Shares> = lights.iter().map(|l| Shares::new(l, &self.levels)).collect();
            let totals: Vec<f32> = shares.iter().flat_map(|s| s.total).collect();
            let totals = Tensor::<1>::from_floats(totals.as_slice(), &self.device).reshape([lights.len(), 3, 1, 1]);
            let output = self.network.decode(&encoding, roots(&shares, &self.device));
            pictures.extend(images(output * totals * inside.clone() * self.scale)?);
        }
        Ok(pictures)
    }

    /// Estimated lamp shares of a frame's light, per channel.
    ///
    /// # Errors
    /// When the device fails.
    pub fn source(&self, frame: &Frame) -> Result<Vec<[f32; 3]>> {
        let _turn = turn::DEVICE.lock();
        let roots = self.network.source(&self.encoding(frame));
        let roots = roots.into_data().try_into_vec::<f32>();
        let roots = roots.map_err(|e| Error::bug(format!("the device returned no light: {e}")))?;
        let share = |root: &[f32]| std::array::from_fn(|c| root[c].max(0.0).powi(2));
        Ok(roots.chunks_exact(3).map(share).collect())
    }

    fn encoding(&self, frame: &Frame) -> Encoding {
        let mask = tensor_from_mask(&frame.mask, &self.device);
        let plate = tensor_from_image(&frame.plate, &self.device);
        self.network.encode(input(plate, &mask))
    }
}

/// Input of a training step.
struct Learner {
    poses: Vec<PoseTensors>,
    /// Sum of each pose's plate over the subject.
    brightness: Vec<f32>,
    levels: Vec<[f32; 3]>,
    lights: Lights,
    interview: Shares,
    scale: f32,
    seed: u64,
    device: Device,
}

impl Learner {
    fn loss(&self, network: &PortraitNetwork, criterion: &mut Criterion, step: u64) -> Tensor<1> {
        let mut rng = draw(self.seed, step, 12);
        let number = rng.random_range(0..self.poses.len());
        let pose = &self.poses[number];
        let [_, _, h, w] = pose.plate.dims();
        let most = (SHIFT * w as f32).round() as i64;
        let by = [0, 1].map(|_| rng.random_range(-most..=most));
        let moved = |x: Tensor<4>| shift(x, by[0], by[1]);
        let other = step % OTHER_SOURCE == OTHER_SOURCE - 1;
        let source = other.then(|| {
            let weights = self.lights.draw_surrounding(&mut rng);
            (pose.relit(&weights), Shares::new(&weights, &self.levels))
        });
        let (plate, source) = match &source {
            Some((plate, shares)) => (self.exposed(plate.clone(), number), shares),
            None => (pose.plate.clone(), &self.interview),
        };
        let mask = moved(pose.mask.clone());
        let encoded = input(moved(plate), &mask);
        let (mut truths, mut wanted) = (Vec::new(), Vec::new());
        for _ in 0..TARGETS {
            let weights = self.lights.draw(&mut rng);
            let shares = Shares::new(&weights, &self.levels);
            truths.push(pose.relit(&shares.normal(&weights)));
            wanted.push(shares);
        }
        let gain = 1.0 / self.scale;
        let encoding = network.encode(encoded.clone());
        let output = network.decode(&encoding, roots(&wanted, &self.device));
        let (total, _) = criterion.losses(
            output.reshape([1, 3 * TARGETS, h, w]),
            &LossInputs {
                light: encoded.ones_like() * self.scale,
                mask: &mask,
                olats: Some(&encode(Tensor::cat(truths, 0) * gain)),
                plate: &encoded,
                weights: &Tensor::zeros([TARGETS, 3, 1, 1], &self.device),
                settings: LossSettings { gain, shift: by, reconstruction: 1.0, rendering: 0.0, logits: false },
            },
            None,
            None,
        );
        let seen = network.source(&encoding);
        let off = seen - roots(std::slice::from_ref(source), &self.device);
        total + off.abs().mean() * SOURCE
    }

    /// Scales a picture to the brightness of the pose's plate.
    fn exposed(&self, picture: Tensor<4>, pose: usize) -> Tensor<4> {
        let sum = (picture.clone() * self.poses[pose].mask.clone()).sum();
        let factor = sum.clamp_min(1e-6).recip() * self.brightness[pose];
        picture * factor.reshape([1, 1, 1, 1])
    }
}

/// Sum of a pose's plate over its matte.
fn brightness(pose: &super::poses::Pose) -> f32 {
    let pairs = pose.plate.pixels.iter().zip(&pose.mask.pixels);
    pairs.map(|(p, alpha)| alpha * p.iter().sum::<f32>()).sum()
}

/// Lights as network input, `[n, 3·lamps]`.
fn roots(shares: &[Shares], device: &Device) -> Tensor<2> {
    let values: Vec<f32> = shares.iter().flat_map(|s| s.roots.clone()).collect();
    let shape = [shares.len(), values.len() / shares.len().max(1)];
    Tensor::from_data(TensorData::new(values, shape), device)
}

/// Bright level and mean of the poses in lights whose total is 1.
fn level(poses: &Poses, lights: &Lights, levels: &[[f32; 3]], seed: u64) -> Result<(f32, f32)> {
    let mut values = Vec::new();
    for light in 0..MEASURED {
        let weights = lights.draw(&mut draw(seed, light, 13));
        let pose = &poses.poses[light as usize % poses.poses.len()];
        let picture = pose.relit(&Shares::new(&weights, levels).normal(&weights));
        values.extend(subject(&pose.mask).step_by(4).flat_map(|i| picture.pixels[i]));
    }
    let mean = values.iter().sum::<f32>() / values.len().max(1) as f32;
    let level = bright_level(&mut values).ok_or_else(|| {
        Error::invalid(
            "no pixel inside any pose's matte has light on it",
            "Check the mattes: white where the subject is",
        )
    })?;
    Ok((level, mean))
}
