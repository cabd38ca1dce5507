//! Comparison with sums in f64.

use super::*;
use crate::kernels::chunks::tests::noise;
use crate::kernels::convolution::{self, GradientInputs};
use crate::kernels::pointwise::Activation;
use crate::kernels::shape::Shape;
use proptest::prelude::*;
use test_support::{Need, require};

struct Case {
    shape: Shape,
    x: Vec<f32>,
    weight: Vec<f32>,
    bias: Vec<f32>,
    gradient: Vec<f32>,
    /// Channels of the first source.
    first: usize,
}

/// Each with the sum of its terms' magnitudes.
#[derive(Clone, Copy, Default)]
struct Sum {
    value: f64,
    magnitude: f64,
}

impl Sum {
    fn add(&mut self, a: f32, b: f32) {
        self.value += f64::from(a) * f64::from(b);
        self.magnitude += (f64::from(a) * f64::from(b)).abs();
    }
}

impl Case {
    fn new(shape: Shape, seed: u64) -> Self {
        let pixels = shape.batch * shape.height * shape.width;
        let taps = shape.kernel * shape.kernel;
        Self {
            shape,
            x: noise(pixels * shape.inputs, seed),
            weight: noise(shape.inputs * shape.outputs * taps, seed + 1),
            bias: noise(shape.outputs, seed + 2),
            gradient: noise(pixels * shape.outputs, seed + 3),
            first: (seed as usize % (shape.inputs + 1)),
        }
    }

    fn sources(&self) -> [Vec<f32>; 2] {
        let plane = self.shape.height * self.shape.width;
        let [mut one, mut two] = [Vec::new(), Vec::new()];
        for picture in self.x.chunks(self.shape.inputs * plane) {
            let (first, second) = picture.split_at(self.first * plane);
            one.extend_from_slice(first);
            two.extend_from_slice(second);
        }
        [one, two]
    }

    /// Forward, by input, by weights and by biases.
    fn run(&self) -> [Vec<f32>; 4] {
        let shape = &Shape { bf16: true, ..self.shape };
        let [one, two] = self.sources();
        let mut out = vec![0.0; self.gradient.len()];
        let none = Activation::None;
        convolution::forward(shape, [&one, &two], &self.weight, &self.bias, none, &mut out);
        let back = convolution::backward(
            shape,
            GradientInputs::Exact([&one, &two], &out),
            &self.weight,
            none,
            &self.gradient,
            [true, true],
        );
        let (weight, bias) = back.parameters.unwrap();
        [out, back.input.unwrap(), weight, bias]
    }

    fn reference(&self) -> [Vec<Sum>; 4] {
        let s = &self.shape;
        let r = s.kernel / 2;
        let mut out = vec![Sum::default(); self.gradient.len()];
        let mut input = vec![Sum::default(); self.x.len()];
        let mut weight = vec![Sum::default(); self.weight.len()];
        let mut bias = vec![Sum::default(); s.outputs];
        let (h, w) = (s.height, s.width);
        for n in 0..s.batch {
            for (o, bias) in bias.iter_mut().enumerate() {
                for y in 0..h {
                    for x in 0..w {
                        let at = ((n * s.outputs + o) * h + y) * w + x;
                        out[at].add(self.bias[o], 1.0);
                        bias.add(self.gradient[at], 1.0);
                    }
                }
                for i in 0..s.inputs {
                    for ky in 0..s.kernel {
                        for kx in 0..s.kernel {
                            let k = ((o * s.inputs + i) * s.kernel + ky) * s.kernel + kx;
                            let rows = r.saturating_sub(ky)..h.min((h + r).saturating_sub(ky));
                            for y in rows {
                                let columns = r.saturating_sub(kx)..w.min((w + r).saturating_sub(kx));
                                for x in columns {
                                    let at = ((n * s.outputs + o) * h + y) * w + x;
                                    let from = ((n * s.inputs + i) * h + y + ky - r) * w + x + kx - r;
                                    out[at].add(self.weight[k], self.x[from]);
                                    input[from].add(self.weight[k], self.gradient[at]);
                                    weight[k].add(self.gradient[at], self.x[from]);
                                }
                            }
                        }
                    }
                }
            }
        }
        [out, input, weight, bias]
    }
}

/// Largest error relative to the largest value, and relative to each sum's terms.
fn errors(found: &[f32], expected: &[Sum]) -> [f64; 2] {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(0.0f64, |m, s| m.max(s.value.abs()));
    let mut worst = [0.0f64; 2];
    for (f, s) in found.iter().zip(expected) {
        assert!(f.is_finite());
        let error = (f64::from(*f) - s.value).abs();
        worst[0] = worst[0].max(error / largest.max(1e-300));
        worst[1] = worst[1].max(error / s.magnitude.max(1e-300));
    }
    worst
}

const NAMES: [&str; 4] = ["forward", "by input", "by weights", "by biases"];

fn check(case: &Case) -> [[f64; 2]; 4] {
    let found = case.run();
    let expected = case.reference();
    core::array::from_fn(|i| {
        let worst = errors(&found[i], &expected[i]);
        // Of each product twice 2⁻⁸, for rounding a factor to 8 bits, and their product. Sums in f32 add a little.
        let bound = 2f64.powi(-7) + 2f64.powi(-16);
        assert!(worst[1] <= bound, "{} of {:?}: {worst:?}", NAMES[i], case.shape);
        worst
    })
}

fn shape(batch: usize, channels: [usize; 2], size: [usize; 2], kernel: usize) -> Shape {
    Shape { batch, inputs: channels[0], outputs: channels[1], height: size[0], width: size[1], kernel, bf16: false }
}

const SHAPES: [(usize, [usize; 2], [usize; 2], usize); 18] = [
    (1, [1, 1], [16, 16], 1),
    (1, [1, 1], [16, 16], 3),
    (1, [3, 2], [17, 33], 3),
    (2, [16, 16], [32, 32], 3),
    (1, [17, 17], [17, 33], 5),
    (1, [32, 123], [24, 128], 3),
    (1, [64, 16], [20, 50], 3),
    (1, [123, 32], [16, 127], 3),
    (1, [130, 130], [9, 20], 3),
    (3, [33, 31], [127, 9], 3),
    (1, [7, 40], [127, 9], 7),
    (1, [40, 7], [9, 127], 7),
    (2, [96, 15], [31, 64], 1),
    (1, [256, 64], [16, 16], 1),
    (1, [66, 49], [1, 300], 3),
    (1, [66, 49], [300, 1], 3),
    (1, [5, 33], [2, 2], 7),
    (1, [256, 64], [20, 20], 3),
];

/// True if the processor multiplies bf16; otherwise the test returns.
fn bf16() -> bool {
    require(Need::Bf16, available(), "the processor does not multiply bf16")
}

#[test]
fn sums_agree_with_f64() {
    if !bf16() {
        return;
    }
    let mut worst = [[0.0f64; 2]; 4];
    for (i, (batch, channels, size, kernel)) in SHAPES.into_iter().enumerate() {
        let case = Case::new(shape(batch, channels, size, kernel), i as u64 * 37 + 5);
        // Sums of a few products are as accurate as their terms, which `check` has tested.
        let terms = [channels[0], channels[1], size[0] * size[1], usize::MAX];
        let many = channels[0] * channels[1] * kernel >= 16;
        for ((w, f), terms) in worst.iter_mut().zip(check(&case)).zip(terms) {
            let largest = if terms < 16 || !many { 0.0 } else { f[0] };
            *w = [w[0].max(largest), w[1].max(f[1])];
        }
    }
    for (name, w) in NAMES.iter().zip(worst) {
        println!("{name}: {:.2e} of the largest, {:.2e} of the terms", w[0], w[1]);
        assert!(w[0] <= 5e-3, "{name}: {w:?}");
    }
}

/// Products of factors near the ends of f32's range, and of subnormal ones.
#[test]
fn tiny_and_huge_factors_agree_with_f64() {
    if !bf16() {
        return;
    }
    for (x, weight) in [(-120, 100), (100, -120), (-60, -60), (60, 60)] {
        let mut case = Case::new(shape(1, [32, 32], [16, 16], 3), 6);
        let [x, weight] = [x, weight].map(|power| 2f32.powi(power));
        case.x.iter_mut().for_each(|v| *v *= x);
        case.weight.iter_mut().for_each(|v| *v *= weight);
        case.bias.iter_mut().for_each(|v| *v *= x * weight);
        check(&case);
    }
    for tiny in [1e-39, f32::from_bits(1)] {
        let mut case = Case::new(shape(1, [32, 32], [16, 16], 3), 7);
        case.x.fill(tiny);
        let [out, _, weight, _] = case.run();
        let bias = case.bias.iter().flat_map(|bias| [bias; 256]);
        assert!(out.iter().zip(bias).all(|(found, bias)| (found - bias).abs() < 1e-30));
        assert!(weight.iter().all(|found| found.abs() < 1e-30));
    }
}

#[test]
fn nan_stays_in_its_neighbourhood() {
    if !bf16() {
        return;
    }
    for (batch, channels, size, kernel) in SHAPES {
        let s = shape(batch, channels, size, kernel);
        let (r, [h, w]) = (kernel / 2, size);
        for (y, x) in [(0, 0), (h - 1, w - 1), (h / 2, w - 1), (h / 3, 0), (h / 2, w / 2)] {
            let mut case = Case::new(s, 3);
            let (n, c) = (batch - 1, channels[0] / 2);
            case.x[((n * s.inputs + c) * h + y) * w + x] = f32::NAN;
            let o = channels[1] / 2;
            let [out, _, weight, bias] = case.run();
            for (i, v) in out.iter().enumerate() {
                let (px, py, pn) = (i % w, i / w % h, i / (w * h) / s.outputs);
                let near = pn == n && px.abs_diff(x) <= r && py.abs_diff(y) <= r;
                assert_eq!(v.is_nan(), near, "{s:?} {y} {x} at {py} {px}");
            }
            for (i, v) in weight.iter().enumerate() {
                let channel = i / (kernel * kernel) % s.inputs;
                assert!(channel == c || v.is_finite());
            }
            assert!(bias.iter().all(|v| v.is_finite()));
            let mut case = Case::new(s, 3);
            case.gradient[((n * s.outputs + o) * h + y) * w + x] = f32::NAN;
            let [_, input, weight, bias] = case.run();
            for (i, v) in input.iter().enumerate() {
                let (px, py, pn) = (i % w, i / w % h, i / (w * h) / s.inputs);
                let near = pn == n && px.abs_diff(x) <= r && py.abs_diff(y) <= r;
                assert_eq!(v.is_nan(), near, "{s:?} {y} {x} at {py} {px}");
            }
            for (i, v) in weight.iter().enumerate() {
                let channel = i / (kernel * kernel * s.inputs);
                assert_eq!(channel == o, v.is_nan());
            }
            for (i, v) in bias.iter().enumerate() {
                assert_eq!(i == o, v.is_nan());
            }
        }
    }
}

fn same_bits(case: &Case) {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let values = pool.build().unwrap().install(|| case.run());
        values.map(|v| v.into_iter().map(f32::to_bits).collect::<Vec<_>>())
    };
    let alone = on(1);
    for threads in [2, 3, 7] {
        assert!(alone == on(threads), "{threads} threads change {:?}", case.shape);
    }
}

#[test]
fn threads_change_no_bit() {
    if !bf16() {
        return;
    }
    for (batch, channels, size, kernel) in SHAPES {
        let case = Case::new(shape(batch, channels, size, kernel), 8);
        same_bits(&case);
    }
}

#[test]
fn inputs_kept_as_bf16_and_signs_change_no_bit() {
    if !bf16() {
        return;
    }
    for (batch, channels, size, kernel) in SHAPES {
        let case = Case::new(shape(batch, channels, size, kernel), 5);
        let [one, two] = case.sources();
        for activation in [Activation::None, Activation::LeakyRelu(0.1)] {
            let mut out = vec![0.0; case.gradient.len()];
            let s = &Shape { bf16: true, ..case.shape };
            let sources = [&one[..], &two];
            convolution::forward(s, sources, &case.weight, &case.bias, activation, &mut out);
            let back = |inputs| {
                let (weight, gradient) = (&case.weight, &case.gradient);
                let back = convolution::backward(s, inputs, weight, activation, gradient, [true, true]);
                let (weight, bias) = back.parameters.unwrap();
                let all = [back.input.unwrap(), weight, bias].concat();
                all.into_iter().map(f32::to_bits).collect::<Vec<_>>()
            };
            let signs = match activation {
                Activation::LeakyRelu(slope) => Some(Signs::new(slope, &out)),
                _ => None,
            };
            let halves = [&one, &two].map(|x| to_bf16(x));
            let rounded = GradientInputs::Rounded([&halves[0], &halves[1]], signs.as_ref());
            assert!(back(rounded) == back(GradientInputs::Exact(sources, &out)), "{s:?} {activation:?}");
        }
    }
}

#[test]
fn infinities_stay_infinite_or_nan_and_large_numbers_do_not_overflow() {
    if !bf16() {
        return;
    }
    let s = shape(1, [1, 16], [16, 16], 1);
    let mut case = Case::new(s, 4);
    case.weight.fill(1.0);
    case.bias.fill(0.0);
    case.x[5] = f32::INFINITY;
    case.x[6] = f32::NEG_INFINITY;
    case.x[7] = 3e38;
    let [out, ..] = case.run();
    assert_eq!([out[5], out[6]], [f32::INFINITY, f32::NEG_INFINITY]);
    assert!(out[4].is_finite() && out[8].is_finite());
    assert!((out[7] / 3e38 - 1.0).abs() < 1e-2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_shape_agrees(
        batch in 1usize..=3,
        channels in (1usize..=130, 1usize..=130),
        size in (1usize..=24, 1usize..=40),
        kernel in prop::sample::select(vec![1usize, 3, 5, 7]),
        seed in 0u64..1000,
    ) {
        if bf16() {
            let case = Case::new(shape(batch, [channels.0, channels.1], [size.0, size.1], kernel), seed);
            check(&case);
            same_bits(&case);
        }
    }
}
