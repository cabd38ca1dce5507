//! The networks against PyTorch, the distance against its definition, and invalid files.

use super::*;
use burn::optim::GradientsParams;
use burn::tensor::Distribution;
use std::path::PathBuf;
use std::process::Command;

fn values<const D: usize>(x: Tensor<D>) -> Vec<f32> {
    x.into_data().try_into_vec().unwrap()
}

fn random(shape: [usize; 4], device: &Device) -> Tensor<4> {
    Tensor::random(shape, Distribution::Uniform(0.0, 1.0), device)
}

/// The largest difference over the largest value.
fn difference<const D: usize>(a: Tensor<D>, b: Tensor<D>) -> f32 {
    assert_eq!(a.dims(), b.dims());
    let (a, b) = (values(a), values(b));
    let largest = b.iter().fold(1e-9f32, |m, v| m.max(v.abs()));
    let differences = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f32::max) / largest
}

/// Names and shapes of SqueezeNet's tensors.
fn squeezenet_shapes() -> Vec<(String, Vec<usize>)> {
    let mut layers = vec![("features.0".to_owned(), [3, 64, 3])];
    for (index, [inputs, squeezed, expanded]) in [
        (3, [64, 16, 64]),
        (4, [128, 16, 64]),
        (6, [128, 32, 128]),
        (7, [256, 32, 128]),
        (9, [256, 48, 192]),
        (10, [384, 48, 192]),
        (11, [384, 64, 256]),
        (12, [512, 64, 256]),
    ] {
        layers.push((format!("features.{index}.squeeze"), [inputs, squeezed, 1]));
        for kernel in [1, 3] {
            let name = format!("features.{index}.expand{kernel}x{kernel}");
            layers.push((name, [squeezed, expanded, kernel]));
        }
    }
    layers
        .into_iter()
        .flat_map(|(name, [inputs, outputs, kernel])| {
            [(format!("{name}.weight"), vec![outputs, inputs, kernel, kernel]), (format!("{name}.bias"), vec![outputs])]
        })
        .collect()
}

/// A safetensors file of these tensors with deterministic values, like a fresh network's.
fn safetensors(tensors: &[(String, Vec<usize>)]) -> Vec<u8> {
    let (mut header, mut data) = (serde_json::Map::new(), Vec::new());
    let mut state = 1u32;
    for (name, shape) in tensors {
        let first = data.len();
        let inputs: usize = shape[1..].iter().product();
        for _ in 0..shape.iter().product::<usize>() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let value = (state >> 8) as f32 / (1 << 23) as f32 - 1.0;
            data.extend((value * (6.0 / inputs as f32).sqrt().min(0.1)).to_le_bytes());
        }
        let entry = serde_json::json!({
            "dtype": "F32", "shape": shape, "data_offsets": [first, data.len()]
        });
        header.insert(name.clone(), entry);
    }
    let header = serde_json::Value::Object(header).to_string();
    let length = (header.len() as u64).to_le_bytes();
    [&length, header.as_bytes(), &data].concat()
}

/// A file in its own folder.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

fn squeezenet(device: &Device) -> Features {
    let (_folder, path) = file("squeezenet.safetensors", &safetensors(&squeezenet_shapes()));
    Features::open(&path, device).unwrap()
}

/// The message with which a file is refused.
fn refusal(name: &str, bytes: &[u8]) -> String {
    let (_folder, path) = file(name, bytes);
    let refused = Features::open(&path, &Device::flex()).err();
    let sentence = refused.expect("such a file is refused").for_terminal();
    assert!(sentence.contains(name) && sentence.contains("--features"), "{sentence}");
    sentence
}

#[test]
fn layers_and_gradients_are_those_of_pytorch() {
    let Some(python) = test_support::python(&["torch", "safetensors"]) else { return };
    let script = test_support::repository("tests/peers/features.py");
    let device = Device::flex().autodiff();
    for (name, architecture) in
        [("squeezenet", Architecture::SqueezeNet), ("vgg16", Architecture::Vgg16), ("vgg19", Architecture::Vgg19)]
    {
        let folder = tempfile::tempdir().unwrap();
        let mut peer = Command::new(&python);
        peer.arg(&script).args(["--network", name, "--out"]);
        assert!(peer.arg(folder.path()).status().unwrap().success());
        let slices = WeightFile::open(&folder.path().join("slices.safetensors")).unwrap();
        let read = |name: &str, shape| slices.parameter(name, shape, &device).unwrap().val();
        for weights in ["weights.safetensors", "weights.pth"] {
            let path = folder.path().join(weights);
            let features = Features::open(&path, &device).unwrap();
            assert_eq!(features.architecture(), architecture);
            let x = read("input", [2, 3, 32, 32]).require_grad();
            let layers = features.network.forward(x.clone());
            let mut sum = Tensor::zeros([1], &device);
            for (i, layer) in layers.into_iter().enumerate() {
                let theirs = read(&format!("slice.{i}"), layer.dims());
                let far = difference(layer.clone(), theirs);
                assert!(far <= 1e-5, "{name}, layer {i}: {far}");
                sum = sum + layer.square().mean().sqrt();
            }
            let gradient = x.grad(&sum.backward()).unwrap();
            let far = difference(gradient, read("gradient", [2, 3, 32, 32]).inner());
            assert!(far <= 1e-4, "{name}, gradient: {far}");
        }
        let whole = std::fs::read(folder.path().join("weights.pth")).unwrap();
        refusal("cut.pth", &whole[..whole.len() / 2]);
    }
}

#[test]
fn the_published_squeezenet_loads_and_sees_more_in_a_larger_change() {
    let weights = "data/weights/squeezenet1_1_lpips_v0_1.safetensors";
    let Some(path) = test_support::shared(weights) else { return };
    let device = Device::flex();
    let mut features = Features::open(&path, &device).unwrap();
    assert_eq!(features.architecture().name(), "SqueezeNet 1.1");
    let picture = reference(&device) * encoded_white();
    let mask = Tensor::ones([1, 1, 64, 64], &device);
    let mut distance = |to: f32| {
        let other = picture.clone() * to;
        let distance = features.distance(other, picture.clone(), &mask, None);
        distance.into_scalar::<f32>()
    };
    let [none, small, large] = [1.0, 0.9, 0.3].map(&mut distance);
    assert!(none < 1.1 * EPSILON);
    assert!(small > 0.01 && small < large && large < 2.0, "{small} and {large}");
}

#[test]
fn files_that_are_no_such_network_are_refused_with_sentences() {
    let missing = Features::open(Path::new("nowhere.pth"), &Device::flex()).err().unwrap();
    assert!(missing.to_string().starts_with("cannot open nowhere.pth"), "{missing}");
    let shapes = squeezenet_shapes();
    let whole = safetensors(&shapes);
    for part in [0, 5, 100, whole.len() / 2, whole.len() - 1] {
        refusal("cut.safetensors", &whole[..part]);
    }
    for name in ["letter.safetensors", "letter.pth"] {
        refusal(name, b"Dear reader, this is no network at all.");
    }
    // A pickle that would run a command when Python unpickles it.
    refusal("program.pth", b"cos\nsystem\n(S'true'\ntR.");
    assert!(refusal("letter.txt", b"Dear reader").contains("not in .safetensors or .pth"));

    let other = refusal("other.safetensors", &safetensors(&[("layer.0".to_owned(), vec![3, 3])]));
    assert!(other.contains("VGG-16") && other.contains("layer.0"), "{other}");
    let mut wrong = shapes.clone();
    wrong[0].1 = vec![96, 3, 7, 7];
    let wrong = refusal("wrong.safetensors", &safetensors(&wrong));
    assert!(wrong.contains("features.0.weight of shape [64, 3, 3, 3]"), "{wrong}");
    assert!(wrong.contains("found shape [96, 3, 7, 7]"), "{wrong}");
    let short = refusal("short.safetensors", &safetensors(&shapes[..40]));
    assert!(short.contains("no tensor of that name"), "{short}");
    let mut whole = whole;
    let last = whole.len() - 4;
    whole[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refusal("nan.safetensors", &whole).contains("NaN or infinite"));
}

#[test]
fn zero_error_black_and_saturated_pictures_have_finite_gradients() {
    let device = Device::flex().autodiff();
    let mut features = squeezenet(&device);
    let mask = Tensor::ones([1, 1, 16, 16], &device);
    for (predicted, truth) in [(0.0, 0.0), (0.4, 0.4), (0.0, 0.88), (0.88, 0.0), (65.0, 65.0), (65.0, 0.0)] {
        let picture = |level: f32| Tensor::<4>::full([2, 3, 16, 16], level, &device);
        let predicted = picture(predicted).require_grad();
        let loss = features.distance(predicted.clone(), picture(truth), &mask, None);
        let gradient = values(predicted.grad(&loss.backward()).unwrap());
        assert!(loss.into_scalar::<f32>().is_finite());
        assert!(gradient.iter().all(|g| g.is_finite()));
        let same = values(predicted)[0] == truth;
        assert_eq!(gradient.iter().all(|g| *g == 0.0), same);
    }
}

#[test]
fn what_lies_outside_the_mask_does_not_count() {
    let device = Device::flex();
    let mut features = squeezenet(&device);
    let truth = random([2, 3, 32, 32], &device);
    let mask = Tensor::<1>::from_floats([1.0, 0.0], &device).reshape([1, 1, 2, 1]);
    let mask = mask.repeat_dim(3, 32).repeat_dim(2, 16).sort(2);
    let mut distance = |change: Tensor<4>| {
        let predicted = truth.clone() + change;
        let distance = features.distance(predicted, truth.clone(), &mask, None);
        distance.into_scalar::<f32>()
    };
    let none = distance(truth.zeros_like());
    assert_eq!(distance((mask.clone().neg() + 1.0) * random([2, 3, 32, 32], &device)), none);
    assert!(distance(mask.clone() * 0.1) > 10.0 * none);
    let empty = mask.zeros_like();
    let other = random([2, 3, 32, 32], &device);
    assert!(features.distance(other, truth, &empty, None).into_scalar::<f32>().is_finite());
}

#[test]
fn the_gradient_is_that_of_finite_differences() {
    let device = Device::flex().autodiff();
    let mut features = squeezenet(&device);
    let (truth, start) = (random([1, 3, 32, 32], &device), random([1, 3, 32, 32], &device));
    let mask = random([1, 1, 32, 32], &device);
    let network = features.network.clone();
    let mut distance = |x: Tensor<4>| features.distance(x, truth.clone(), &mask, None);
    let layers = network.forward(start.clone().require_grad());
    let by_weights = GradientsParams::from_grads(layers[2].clone().sum().backward(), &network);
    assert!(by_weights.is_empty(), "the weights are frozen");
    let x = start.clone().require_grad();
    let gradient = x.grad(&distance(x.clone()).backward()).unwrap();
    let square = values(gradient.clone()).iter().map(|g| g * g).sum::<f32>();
    let h = 2e-2 / square.sqrt();
    let step = Tensor::from_inner(gradient) * h;
    let mut value = |x: Tensor<4>| distance(x).into_scalar::<f32>();
    let slope = (value(start.clone() + step.clone()) - value(start - step)) / (2.0 * h);
    // Differences step over the kinks of ReLU and maximum.
    assert!((slope / square - 1.0).abs() < 0.03, "{slope} against {square}");
}

/// Pictures in a batch have the same layers as alone, bit for bit, so that the cache cannot change a run.
#[test]
fn remembered_pictures_have_the_layers_of_new_ones() {
    use crate::schedule::SampleSource;
    let device = Device::flex();
    let mut features = squeezenet(&device);
    let source = SampleSource::Exemplar { pose: 1 };
    let name = |lamp| PictureId { source, picture: PictureKind::Olat(lamp) };
    let pictures = random([5, 3, 64, 64], &device);
    let fresh = features.network.forward(pictures.clone());
    for lamps in [vec![2], vec![1, 2, 4], vec![0, 1, 2, 3, 4], vec![4, 0]] {
        let names: Vec<PictureId> = lamps.iter().copied().map(name).collect();
        let some = rows(pictures.clone(), &lamps);
        let layers = features.known.layers(&features.network, some, &names);
        for (layer, fresh) in layers.into_iter().zip(&fresh) {
            assert_eq!(values(layer), values(rows(fresh.clone(), &lamps)));
        }
    }
}
