//! The network, or its predictions, and the pass `relight` on one GPU, a software one if there is no other.

mod mapped;

use afterlight::compositor::{Field, FieldEncoder, Storage};
use afterlight::footage::Frame;
use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::imaging::{Image, Raster};
use afterlight::reflectance::checkpoint::CheckpointInfo;
use afterlight::reflectance::predictor::predicts_in_half;
use afterlight::reflectance::{Formulation, Normalization, Precision, Predictor, Statistics, UNet, UNetConfig};
use burn::module::Module;
use burn::tensor::Device;
use mapped::{gpu, mapped_during};
use test_support::{Need, require};

const SIZE: usize = 16;
const LAMPS: usize = 4;

fn config(precision: Precision) -> UNetConfig {
    UNetConfig {
        size: SIZE,
        lamps: LAMPS,
        depth: None,
        width: 8,
        most_channels: 16,
        normalization: Normalization::Group,
        statistics: Statistics::Own,
        formulation: Formulation::Ratio,
        precision,
    }
}

fn predictor(network: &UNet, precision: Precision, device: &Device) -> Predictor {
    let info = CheckpointInfo {
        step: 0,
        seconds: 0.0,
        scale: 3.0,
        training_frames: Vec::new(),
        network: config(precision),
        held_out: None,
    };
    Predictor::new(network.clone().to_device(device), info, device)
}

/// A network and its predictors on the CPU and on a GPU.
fn both(gpu: &ComputeDevice, precision: Precision) -> [Predictor; 2] {
    let cpu = Device::flex();
    cpu.seed(7);
    let network = config(Precision::Full).init(0.3, &cpu).materialize();
    [predictor(&network, Precision::Full, &cpu), predictor(&network, precision, &gpu.device)]
}

/// A colour ramp with a matte that is empty in its left column.
fn frame() -> Frame {
    let ramp = |x: usize, y: usize| {
        let [x, y] = [x, y].map(|v| v as f32 / SIZE as f32);
        [x, y, 0.5 + 0.4 * (7.0 * x * y).sin()]
    };
    Frame {
        index: 0,
        plate: Image::from_fn(SIZE, SIZE, ramp),
        mask: Raster::from_fn(SIZE, SIZE, |x, _| f32::from(u8::from(x > 0))),
    }
}

fn weights() -> Vec<[f32; 3]> {
    vec![[0.2, 0.5, 1.0], [0.0; 3], [2.0, 1.0, 0.1], [0.3; 3]]
}

/// A prediction of [`frame`] in the program's storage on this device.
fn kept(predictor: &Predictor, storage: Storage, compute: &ComputeDevice) -> Field {
    let field = predictor.predict_on_device(&frame()).unwrap();
    FieldEncoder::new(storage).encode(field, compute.passes()).unwrap()
}

/// The largest difference as a share of the largest value.
fn difference(a: &Image, b: &Image) -> f32 {
    let values = |image: &Image| image.pixels.as_flattened().to_vec();
    let largest = |values: Vec<f32>| values.into_iter().fold(0.0, |m: f32, v| m.max(v.abs()));
    let apart = values(a).iter().zip(values(b)).map(|(a, b)| a - b).collect();
    largest(apart) / largest(values(b))
}

#[test]
fn a_field_lit_where_the_network_left_it_is_the_cpu_s() {
    let Some((compute, _turn)) = gpu() else { return };
    let [here, there] = both(&compute, Precision::Full);
    let there = kept(&there, Storage::F32, &compute);
    let here = kept(&here, Storage::F32, &ComputeDevice::choose(DeviceChoice::Cpu));
    assert_eq!((there.size(), there.lamps()), ((SIZE, SIZE), LAMPS));
    assert_eq!((here.size(), here.lamps()), ((SIZE, SIZE), LAMPS));
    let [there_lit, here_lit] = [&there, &here].map(|field| field.relight(&weights()).unwrap());
    let apart = difference(&there_lit, &here_lit);
    println!("apart by {apart:e} of the largest value");
    // Sums of at most 9 · 32 products in each of nine layers, rounded to f32 in another order.
    assert!(apart < 1e-5, "{apart}");
    assert!((0..SIZE).all(|y| there_lit.at(0, y) == [0.0; 3]));
    assert!(there.relight(&weights()[1..]).is_err());
}

#[test]
fn of_a_prediction_that_is_lit_nothing_but_the_picture_is_read_back() {
    let Some((compute, _turn)) = gpu() else { return };
    let [_, predictor] = both(&compute, Precision::Full);
    for storage in [Storage::F32, Storage::F16] {
        let lit = || {
            let field = kept(&predictor, storage, &compute);
            field.relight(&weights()).unwrap()
        };
        // The first time, kernels are timed against each other, which reads clocks.
        let first = lit();
        let (second, mapped) = mapped_during(lit);
        assert_eq!(first, second);
        let picture = (SIZE * SIZE * 4 * size_of::<f32>()) as u64;
        assert_eq!(mapped, [picture], "{storage:?}");
    }
    // The log does show the network's own reads.
    let (field, mapped) = mapped_during(|| predictor.predict(&frame()).unwrap());
    let field = (field.values.len() * size_of::<f32>()) as u64;
    // Its reads land in pages, which may be larger.
    assert!(mapped.iter().any(|&bytes| bytes >= field), "{mapped:?}");
}

#[test]
fn a_prediction_is_the_same_however_it_is_kept_and_wherever() {
    let Some((compute, _turn)) = gpu() else { return };
    let [here, there] = both(&compute, Precision::Full);
    let cpu = ComputeDevice::choose(DeviceChoice::Cpu);
    let exact = kept(&here, Storage::F32, &cpu);
    let lit = exact.relight(&weights()).unwrap();
    for (storage, off) in [(Storage::F32, 1e-5), (Storage::F16, 6e-4), (Storage::Compressed, 0.02)] {
        for (predictor, keeper) in [(&here, &cpu), (&here, &compute), (&there, &compute)] {
            let field = kept(predictor, storage, keeper);
            assert_eq!(matches!(field, Field::Gpu(..)), keeper.gpu.is_some());
            assert!(storage != Storage::F16 || 2 * field.bytes() <= exact.bytes());
            let apart = difference(&field.relight(&weights()).unwrap(), &lit);
            println!("{storage:?}: apart by {apart:e} of the largest value");
            assert!(apart <= off, "{storage:?} {apart}");
        }
    }
}

#[test]
fn half_precision_on_a_gpu_is_as_close_as_f16_allows() {
    let Some((compute, _turn)) = gpu() else { return };
    let f16 = predicts_in_half(&compute.device);
    if !require(Need::GpuF16, f16, &compute.description) {
        return;
    }
    let [full, half] = both(&compute, Precision::Mixed);
    let [full, half] = [full, half].map(|p| p.predict(&frame()).unwrap().values);
    let largest = full.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    let apart = full.iter().zip(&half).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f32::max) / largest;
    println!("apart by {apart:e} of the largest value");
    // Each of nine layers rounds its input and output to eleven bits: half a unit of 2⁻¹⁰ at most.
    let epsilon = 2f32.powi(-10);
    assert!(apart > 0.0 && apart < 9.0 * epsilon, "{apart}");
}
