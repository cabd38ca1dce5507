//! Short self-test of a GPU before use: drivers and kernels have given wrong numbers without an error. The
//! network's layers, the sum of lamps and a pass are computed there and on the CPU, from the same numbers.

use burn::module::Param;
use burn::nn::conv::Conv2d;
use burn::nn::{BatchNormConfig, GroupNormConfig, PaddingConfig2d};
use burn::tensor::{Device, Tensor, TensorData};
use compositor::passes::PicturePasses;
use compositor::reference::{lit_lamps, relight, relight_half};
use compositor::viewed;
use imaging::Image;
use reflectance::kernels::{self, Activation, Precision};
use reflectance::{HalfField, ReflectanceField};
use scene::{Effects, Scene, ViewTransform};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Width and height of the layers' input.
const SIZE: usize = 16;
/// Number of lamps of the summed field.
const LAMPS: usize = 9;

/// Computation that runs on both devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Check {
    /// Every kind of layer of the network, in sequence.
    Layers,
    Sum,
    /// The sum of a field in f16.
    HalfSum,
    /// The pass `view` under its film curve: matrices, logarithms and a polynomial.
    View,
}

impl Check {
    const PICTURES: [Self; 3] = [Self::Sum, Self::HalfSum, Self::View];

    fn name(self) -> &'static str {
        match self {
            Self::Layers => "the network's layers",
            Self::Sum => "the sum of lamps",
            Self::HalfSum => "the sum of lamps in f16",
            Self::View => "the pass view",
        }
    }

    /// Largest error of a value, as a share of the largest. A different order of summation is off by 1e-5, products of shorter
    /// numbers, as in tensor cores, by 5e-4, and powers and logarithms of shaders by 2e-4. Wrong values are off by much more.
    fn tolerance(self) -> f32 {
        match self {
            Self::Layers | Self::View => 1e-3,
            Self::Sum | Self::HalfSum => 1e-5,
        }
    }

    fn on_cpu(self) -> Result<Vec<f32>, String> {
        let (field, weights) = (field(), weights());
        let lit = lit_lamps(&weights);
        let picture = match self {
            Self::Layers => return layers(&Device::flex()),
            Self::Sum => relight(&field, &weights, &lit),
            Self::HalfSum => relight_half(&HalfField::from(&field), &weights, &lit),
            Self::View => viewed(&ramp(), &filmic()).0,
        };
        Ok(values(picture))
    }

    /// All checks but the layers, by the passes of a GPU.
    fn on_gpu(self, passes: &PicturePasses) -> Result<Vec<f32>, String> {
        let (field, weights) = (field(), weights());
        let picture = match self {
            Self::Layers => return Err("the passes have no layers".to_owned()),
            Self::Sum => passes.relight.run(&field, &weights),
            Self::HalfSum => passes.relight.run_half(&HalfField::from(&field), &weights),
            Self::View => passes.upload_opaque(&ramp()).and_then(|ramp| {
                let mut recording = passes.begin();
                let shown = recording.viewed(&ramp, &filmic())?;
                let mut pictures = recording.finish(&[&shown])?.pictures;
                Ok(pictures.remove(0))
            }),
        };
        picture.map(values).map_err(|e| e.to_string())
    }
}

/// A scene shown through the film curve.
fn filmic() -> Scene {
    Scene { effects: Effects { view: ViewTransform::Filmic, ..Effects::default() }, ..Scene::default() }
}

/// Ok if a GPU makes pictures like the CPU; otherwise a message about the difference.
pub(super) fn pictures(adapter: &str, passes: &PicturePasses) -> Result<(), String> {
    compare(adapter, &Check::PICTURES, |check| check.on_gpu(passes))
}

/// The same for the network's layers on burn's device.
pub(super) fn network(adapter: &str, device: &Device) -> Result<(), String> {
    compare(adapter, &[Check::Layers], |_| layers(device))
}

/// Ok if the values `found` match the CPU's in each check.
fn compare(adapter: &str, checks: &[Check], found: impl Fn(Check) -> Result<Vec<f32>, String>) -> Result<(), String> {
    for &check in checks {
        let wanted = check.on_cpu()?;
        // A kernel that fails on burn's GPU backend panics when its values are read.
        let found = catch_unwind(AssertUnwindSafe(|| found(check)))
            .unwrap_or_else(|_| Err("it stopped with an error of its driver".to_owned()))
            .map_err(|e| format!("the GPU {adapter} failed in {}: {e}", check.name()))?;
        let largest = wanted.iter().fold(0f32, |m, v| m.max(v.abs()));
        let bound = check.tolerance() * largest;
        // NaN is within no bound.
        let right = |wanted: &f32, found: &f32| (wanted - found).abs() <= bound;
        let pairs = wanted.iter().zip(&found);
        let wrong = pairs.filter(|(wanted, found)| !right(wanted, found));
        let worst = wrong.max_by(|a, b| (a.0 - a.1).abs().total_cmp(&(b.0 - b.1).abs()));
        if let Some((wanted, found)) = worst {
            return Err(format!(
                "the GPU {adapter} computed {found} in {}, expected {wanted} within {bound:.1e}",
                check.name()
            ));
        }
        if found.len() != wanted.len() {
            return Err(format!(
                "the GPU {adapter} computed {} values in {}, expected {}",
                found.len(),
                check.name(),
                wanted.len()
            ));
        }
    }
    Ok(())
}

/// Pseudo-random numbers in [−1, 1].
fn noise(count: usize, seed: usize) -> impl Iterator<Item = f32> {
    let bits = move |i: usize| (i + 7919 * seed).wrapping_mul(2_654_435_761) >> 8 & 0xffff;
    (0..count).map(move |i| bits(i) as f32 / 32768.0 - 1.0)
}

fn values(picture: Image) -> Vec<f32> {
    picture.pixels.into_flattened()
}

fn field() -> ReflectanceField {
    // Not a multiple of a workgroup or of a tile.
    let (width, height) = (61, 13);
    let count = LAMPS * 3 * width * height;
    ReflectanceField { width, height, lamps: LAMPS, values: noise(count, 1).map(f32::abs).collect() }
}

fn weights() -> Vec<[f32; 3]> {
    let lamp = |l: usize| [0.1 + 0.1 * l as f32, 1.0, 3.0 / (1 + l) as f32];
    let mut weights: Vec<[f32; 3]> = (0..LAMPS).map(lamp).collect();
    weights[LAMPS / 2] = [0.0; 3];
    weights
}

/// From black to four stops above white.
fn ramp() -> Image {
    Image::from_fn(64, 3, |x, y| {
        let light = x as f32 / 16.0;
        [light * light, light, y as f32 * light]
    })
}

fn tensor<const D: usize>(shape: [usize; D], seed: usize, scale: f32, device: &Device) -> Tensor<D> {
    let count = shape.iter().product();
    let values: Vec<f32> = noise(count, seed).map(|v| scale * v).collect();
    Tensor::from_data(TensorData::new(values, shape), device)
}

fn convolution(inputs: usize, outputs: usize, kernel: usize, device: &Device) -> Conv2d {
    let spread = 1.0 / ((inputs * kernel * kernel) as f32).sqrt();
    let shape = [outputs, inputs, kernel, kernel];
    Conv2d {
        weight: Param::from_tensor(tensor(shape, inputs + kernel, 1.7 * spread, device)),
        bias: Some(Param::from_tensor(tensor([outputs], outputs, 0.1, device))),
        stride: [1, 1],
        kernel_size: [kernel, kernel],
        dilation: [1, 1],
        groups: 1,
        padding: PaddingConfig2d::Same,
    }
}

/// A small network with every kind of layer of the real one, and its skip connections.
fn layers(device: &Device) -> Result<Vec<f32>, String> {
    let scale = |channels, seed| Param::from_tensor(tensor([channels], seed, 1.0, device));
    let mut group = GroupNormConfig::new(8, 16).init(device);
    group.gamma = Some(scale(16, 2));
    group.beta = Some(scale(16, 3));
    let mut batch = BatchNormConfig::new(16).init(device);
    batch.gamma = scale(16, 4);
    batch.beta = scale(16, 5);
    let convolve =
        |x, skip, layer: &Conv2d, activation| kernels::convolution(x, skip, layer, activation, Precision::Full);
    let layer = |inputs, outputs, kernel| convolution(inputs, outputs, kernel, device);
    let leaky = Activation::LeakyRelu(0.2);
    let x = tensor([1, 3, SIZE, SIZE], 6, 1.0, device);
    let first = convolve(x, None, &layer(3, 8, 7), leaky);
    let second = kernels::blur_pool(first.clone());
    let second = convolve(second, None, &layer(8, 16, 3), Activation::None);
    let second = kernels::group_norm(second, &group, 0.2);
    let third = kernels::blur_pool(second.clone());
    let third = convolve(third, None, &layer(16, 16, 3), Activation::None);
    let third = kernels::batch_norm(third, &batch, 0.2, true);
    let up = kernels::upsample(third, None);
    let up = convolve(up, Some(second), &layer(32, 8, 3), leaky);
    let up = kernels::upsample(up, None);
    let out = convolve(up, Some(first), &layer(16, 6, 3), Activation::Sigmoid);
    let data = out.try_into_data().map_err(|e| format!("{e:?}"))?;
    data.try_into_vec().map_err(|e| format!("{e:?}"))
}

#[cfg(test)]
mod tests {
    use super::super::{ComputeDevice, DeviceChoice};
    use super::*;

    const ALL: [Check; 4] = [Check::Layers, Check::Sum, Check::HalfSum, Check::View];

    /// Comparison with a correct GPU, except for the values of one check.
    fn spoilt(which: Check, spoil: impl Fn(Vec<f32>) -> Vec<f32>) -> Result<(), String> {
        compare("Broken 9000", &ALL, |check| {
            let right = check.on_cpu()?;
            Ok(if check == which { spoil(right) } else { right })
        })
    }

    #[test]
    fn one_wrong_value_is_found_wherever_it_is_and_said() {
        assert_eq!(spoilt(Check::Sum, |right| right), Ok(()));
        for check in ALL {
            let last = check.on_cpu().unwrap().len() - 1;
            for place in [0, last] {
                let wrong = |mut values: Vec<f32>| {
                    values[place] += 0.25;
                    values
                };
                let said = spoilt(check, wrong).unwrap_err();
                assert!(said.starts_with("the GPU Broken 9000 computed "), "{said}");
                assert!(said.contains(check.name()) && said.contains("expected"), "{said}");
            }
            let nan = |values: Vec<f32>| vec![f32::NAN; values.len()];
            assert!(spoilt(check, nan).unwrap_err().contains("NaN"));
            let short = |values: Vec<f32>| values[1..].to_vec();
            assert!(spoilt(check, short).is_err());
        }
    }

    #[test]
    fn a_gpu_that_fails_or_stops_is_not_trusted() {
        let failed = compare("Broken", &ALL, |_| Err("out of memory".into()));
        assert!(failed.unwrap_err().contains("failed in the network's layers: out of memory"));
        let stopped = compare("Broken", &ALL, |check| match check {
            Check::Sum => panic!("work writing it was skipped"),
            check => check.on_cpu(),
        });
        assert!(stopped.unwrap_err().contains("stopped"));
    }

    #[test]
    fn the_program_falls_back_to_the_cpu_and_says_why() {
        let right = ComputeDevice::choose(DeviceChoice::Gpu);
        let gpu = right.gpu.ok_or(right.description);
        let Some(gpu) = test_support::found(test_support::Need::Gpu, gpu) else { return };
        // This adapter, software or not, is right.
        assert_eq!(gpu.self_test(), Ok(()));
        let half = |v: Vec<f32>| vec![0.5; v.len()];
        let pictures =
            ComputeDevice::trusted(Ok(gpu.clone()), |_| Ok(())).with_network(|_| spoilt(Check::Layers, half));
        assert!(pictures.passes().is_some() && pictures.device == Device::flex());
        let said = &pictures.description;
        assert!(
            said.starts_with("CPU (flex): the GPU Broken 9000 computed 0.5 in the network's layers")
                && said.contains("; pictures: GPU "),
            "{said}"
        );
        let fallen = ComputeDevice::trusted(Ok(gpu), |_| spoilt(Check::View, half));
        assert!(fallen.gpu.is_none() && fallen.passes().is_none());
        let said = &fallen.description;
        assert!(said.starts_with("CPU (flex): the GPU Broken 9000 computed 0.5 in the pass view, expected "));
        assert_eq!(fallen.device, Device::flex());
    }
}
