//! Networks that no training produces: collapsed, saturated, with extreme input.

use super::gpu;
use afterlight::compositor::{FieldEncoder, Ingredients, Storage, compose};
use afterlight::footage::Frame;
use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::imaging::{Image, Mask};
use afterlight::light::{Environment, LightWeights};
use afterlight::reflectance::checkpoint::CheckpointInfo;
use afterlight::reflectance::kernels::has_bf16;
use afterlight::reflectance::render::RATIO_FLOOR;
use afterlight::reflectance::{Formulation, Normalization, Precision, Predictor, Statistics, UNet, UNetConfig};
use afterlight::scene::{Output, Scene};
use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor};
use test_support::shown;

const SIZE: usize = 16;
const LAMPS: usize = 6;
const SCALE: f32 = 3.0;

fn config(normalization: Normalization, statistics: Statistics, precision: Precision) -> UNetConfig {
    UNetConfig {
        size: SIZE,
        lamps: LAMPS,
        depth: None,
        width: 16,
        most_channels: 16,
        normalization,
        statistics,
        formulation: Formulation::Ratio,
        precision,
    }
}

/// Transforms every weight: times `factor`, plus `shift`.
struct Changed {
    factor: f32,
    shift: f32,
}

impl ModuleMapper for Changed {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|value| value * self.factor + self.shift)
    }
}

fn predictor(network: &UNet, config: UNetConfig, device: &Device) -> Predictor {
    let info = CheckpointInfo {
        step: 0,
        seconds: 0.0,
        scale: SCALE,
        training_frames: Vec::new(),
        network: config,
        held_out: None,
    };
    Predictor::new(network.clone().to_device(device), info, device)
}

/// Difficult plates: noise, black, white, far beyond white.
fn frames() -> Vec<Frame> {
    let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 251) as f32 / 251.0;
    let plates = [
        Image::from_fn(SIZE, SIZE, |x, y| [noise(x, y), noise(y, x), 0.5]),
        Image::filled(SIZE, SIZE, [0.0; 3]),
        Image::filled(SIZE, SIZE, [1.0; 3]),
        Image::filled(SIZE, SIZE, [1e4; 3]),
    ];
    let masks = [
        Mask::filled(SIZE, SIZE, 1.0),
        Mask::from_fn(SIZE, SIZE, |x, y| f32::from(u8::from((x, y) == (5, 9)))),
        Mask::filled(SIZE, SIZE, 0.0),
    ];
    let pairs = plates.iter().flat_map(|plate| masks.iter().map(move |mask| (plate, mask)));
    pairs.map(|(plate, mask)| Frame { index: 0, plate: plate.clone(), mask: mask.clone() }).collect()
}

/// Predicts and lights all frames; counts pixels outside the range of a network output from 0 to 1.
fn wrong_pixels(predictor: &Predictor, compute: &ComputeDevice, storage: Storage) -> usize {
    let mut wrong = 0;
    for frame in frames() {
        let field = predictor.predict_on_device(&frame).unwrap();
        let field = FieldEncoder::new(storage).encode(field, compute.passes()).unwrap();
        let lit = field.relight(&[[1.0; 3]; LAMPS]).unwrap();
        let pixels = lit.pixels.iter().zip(&frame.plate.pixels).zip(&frame.mask.pixels);
        for ((pixel, plate), alpha) in pixels {
            let light = |c: usize| {
                let most = if *alpha > 0.0 { LAMPS as f32 * SCALE * (plate[c] + RATIO_FLOOR) } else { 0.0 };
                // Sum of all lamps, at most over components, each rounded.
                (-1e-2 * most..=1.01 * most).contains(&pixel[c])
            };
            wrong += usize::from(!(0..3).all(light));
        }
    }
    wrong
}

const KINDS: [(Normalization, Statistics); 4] = [
    (Normalization::Group, Statistics::Own),
    (Normalization::Batch, Statistics::Own),
    (Normalization::Batch, Statistics::Running),
    (Normalization::None, Statistics::Own),
];

/// True if all pictures of the frames are finite.
fn pictures_are_finite(predictor: &Predictor, compute: &ComputeDevice) -> bool {
    let weights = LightWeights { per_lamp: vec![[1.0; 3]; LAMPS], uncovered: 0.0 };
    let scene = Scene { output: Output::Linear, ..Scene::default() };
    frames().iter().all(|frame| {
        let field = predictor.predict_on_device(frame).unwrap();
        let mut encoder = FieldEncoder::new(Storage::F16);
        let field = encoder.encode(field, compute.passes()).unwrap();
        let environment = Environment::from_radiance("even", Image::filled(2, 1, [1.0; 3]));
        let ingredients = Ingredients::new(&field, &frame.mask, &weights, &environment);
        let linear = compose(&scene, &ingredients).unwrap().linear.unwrap();
        linear.pixels.iter().flatten().all(|v| v.is_finite())
    })
}

/// Factor and offset of weights.
const CHANGES: [(f32, f32); 4] = [(0.0, 0.0), (1e3, 0.0), (0.0, 1e3), (0.0, -1e3)];

/// Milder changes for networks that a picture's own variance does not normalise: ten layers multiply by the factor.
/// Running variances change too, and none is below 0.
const UNNORMALIZED: [(f32, f32); 3] = [(0.0, 0.0), (10.0, 0.0), (0.0, 1.0)];

fn collapsed_and_saturated(compute: &ComputeDevice, kinds: &[(Normalization, Statistics)], storages: &[Storage]) {
    let cpu = Device::flex();
    for precision in [Precision::Full, Precision::Mixed] {
        for &(normalization, statistics) in kinds {
            let config = config(normalization, statistics, precision);
            assert_eq!(config.multiplies_bf16(), precision == Precision::Mixed && has_bf16());
            let network = config.init(0.3, &cpu).materialize();
            let changed = |factor: f32, shift: f32| {
                let network = network.clone().map(&mut Changed { factor, shift });
                predictor(&network, config.clone(), &compute.device)
            };
            let normalized = normalization != Normalization::None && statistics == Statistics::Own;
            let changes = if normalized { &CHANGES[..] } else { &UNNORMALIZED[..] };
            for &(factor, shift) in changes {
                let predictor = changed(factor, shift);
                for &storage in storages {
                    let wrong = wrong_pixels(&predictor, compute, storage);
                    assert_eq!(
                        wrong, 0,
                        "{normalization:?} {statistics:?} {precision:?} {storage:?}: weights · {factor} + {shift}"
                    );
                }
            }
            // Beyond what layers without normalisation can multiply within f32.
            for factor in [1e6, 1e18] {
                assert!(
                    pictures_are_finite(&changed(factor, 0.0), compute),
                    "{normalization:?} {statistics:?} {precision:?}: weights · {factor}"
                );
            }
        }
    }
}

const BOUND: &str = "every pixel finite, from 0 to the value of an output of 1, 0 outside the matte; 10⁶ and 10¹⁸ times too \
                     large: pictures finite";

#[test]
fn collapsed_and_saturated_networks_predict_light() {
    let cpu = ComputeDevice::choose(DeviceChoice::Cpu);
    let storages = [Storage::F32, Storage::F16, Storage::Compressed];
    collapsed_and_saturated(&cpu, &KINDS, &storages);
    shown!(Network, "Networks with weights of 0, of ±1000, or a thousand times too large (1 and ten times without normalisation by the picture's own variance), on noise, black, white and 10⁴",
        bound: BOUND,
        measured: "no pixel outside, with each normalisation, f32 and bf16, each storage format");
}

#[test]
fn collapsed_and_saturated_networks_predict_light_on_a_gpu() {
    let Some((compute, _turn)) = gpu() else { return };
    // One normalisation: compiling a network's kernels takes long on a software GPU.
    collapsed_and_saturated(&compute, &KINDS[..1], &[Storage::F16]);
    shown!(Network, "The same networks on a GPU, in f32 and, if supported, f16", bound: BOUND, measured: "no pixel outside");
}
