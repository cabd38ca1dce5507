//! Comparison of every operation with burn's own on the same backend: values and gradients.

use super::*;
use burn::module::Param;
use burn::nn::conv::Conv2dConfig;
use burn::nn::{BatchNormConfig, GroupNormConfig, PaddingConfig2d};
use burn::tensor::{Device, Distribution};
use proptest::prelude::*;
use rayon::prelude::*;

/// Bound on the largest difference over the largest value: f32 sums of some thousand terms in
/// another order differ by about 1e-6.
const CLOSE: f32 = 1e-5;

fn random<const D: usize>(shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::random(shape, Distribution::Uniform(-1.0, 1.0), device)
}

fn values<const D: usize>(x: Tensor<D>) -> Vec<f32> {
    x.into_data().try_into_vec().unwrap()
}

fn assert_close<const D: usize>(what: &str, ours: Tensor<D>, burns: Tensor<D>) {
    assert_within(CLOSE, what, ours, burns);
}

fn assert_within<const D: usize>(bound: f32, what: &str, ours: Tensor<D>, burns: Tensor<D>) {
    assert_sums(bound, 1e-3, what, ours, burns);
}

/// `bound` is relative to the largest value, and to at least `size`: a sum of random terms may happen to be near 0.
fn assert_sums<const D: usize>(bound: f32, size: f32, what: &str, ours: Tensor<D>, burns: Tensor<D>) {
    assert_eq!(ours.dims(), burns.dims(), "{what}");
    let (ours, burns) = (values(ours), values(burns));
    let largest = burns.iter().fold(size, |m, v| m.max(v.abs()));
    for (a, b) in ours.iter().zip(&burns) {
        assert!((a - b).abs() <= bound * largest, "{what}: {a} is not {b}");
    }
}

/// The same pixels in another memory order, seen through strides.
fn strided(x: &Tensor<4>) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let turned = x.clone().permute([3, 1, 0, 2]);
    let data = turned.into_data();
    Tensor::<4>::from_data(data, &x.device()).reshape([w, c, n, h]).permute([2, 1, 3, 0])
}

/// A layer with random weights and biases.
fn layer(inputs: usize, outputs: usize, kernel: usize, device: &Device) -> Conv2d {
    let pad = kernel / 2;
    let mut layer = Conv2dConfig::new([inputs, outputs], [kernel, kernel])
        .with_padding(PaddingConfig2d::Explicit(pad, pad, pad, pad))
        .init(device);
    layer.bias = Some(Param::from_tensor(random([outputs], device)));
    layer
}

/// A direction for gradients that leaves out pixels at the kink of an activation, where rounding decides
/// on the side.
fn random_away_from_kinks(before_activation: &Tensor<4>) -> Tensor<4> {
    let direction = random(before_activation.dims(), &before_activation.device());
    let kinks = before_activation.clone().abs().lower_elem(1e-3);
    direction.mask_fill(kinks, 0.0).detach()
}

#[derive(Clone, Copy, Debug)]
struct Case {
    batch: usize,
    /// Channels of both sources.
    inputs: [usize; 2],
    outputs: usize,
    size: [usize; 2],
    kernel: usize,
    strided: bool,
}

fn check_convolution(case: Case, activation: Activation) {
    check_within(CLOSE, case, activation, Precision::Full);
}

fn check_within(bound: f32, case: Case, activation: Activation, precision: Precision) {
    let device = Device::flex().autodiff();
    let [h, w] = case.size;
    let source = |channels: usize| {
        let x = random([case.batch, channels, h, w], &device);
        let x = if case.strided { strided(&x) } else { x };
        x.detach().require_grad()
    };
    let (x, skip) = (source(case.inputs[0]), source(case.inputs[1]));
    let skips = (case.inputs[1] > 0).then_some(skip.clone());
    let layer = layer(case.inputs.iter().sum(), case.outputs, case.kernel, &device);
    let pad = case.kernel / 2;
    let burns = conv2d(
        joined(x.clone(), skips.clone()),
        layer.weight.val(),
        layer.bias.as_ref().map(|b| b.val()),
        ConvOptions::new([1, 1], [pad, pad], [1, 1], 1),
    );
    let towards = random_away_from_kinks(&burns);
    let gradients = |y: Tensor<4>| {
        let gradients = (y * towards.clone()).sum().backward();
        (
            [x.grad(&gradients), skip.grad(&gradients)],
            layer.weight.val().grad(&gradients).unwrap(),
            layer.bias.as_ref().unwrap().val().grad(&gradients).unwrap(),
        )
    };
    let ours = convolution(x.clone(), skips, &layer, activation, precision);
    let burns = match activation {
        Activation::None => burns,
        Activation::LeakyRelu(slope) => activation::leaky_relu(burns, f64::from(slope)),
        Activation::Sigmoid => activation::sigmoid(burns),
    };
    let what = format!("{case:?}, {activation:?}");
    assert_within(bound, &what, ours.clone(), burns.clone());
    let (ours, burns) = (gradients(ours), gradients(burns));
    for ((ours, burns), channels) in ours.0.into_iter().zip(burns.0).zip(case.inputs) {
        if channels > 0 {
            assert_within(bound, &format!("{what}, by the input"), ours.unwrap(), burns.unwrap());
        }
    }
    // Each is a sum over all pixels.
    let terms = case.batch * case.size[0] * case.size[1];
    let size = 0.5 * (terms as f32).sqrt();
    assert_sums(bound, size, &format!("{what}, by the weights"), ours.1, burns.1);
    assert_sums(bound, size, &format!("{what}, by the biases"), ours.2, burns.2);
}

/// On processors without products of bf16 this is the f32 path again.
#[test]
fn mixed_precision_is_as_close_as_it_says() {
    for (inputs, outputs, size) in [([64, 0], 123, [40, 40]), ([96, 32], 32, [17, 33])] {
        let case = Case { batch: 2, inputs, outputs, size, kernel: 3, strided: false };
        check_within(1e-2, case, Activation::None, Precision::Mixed);
    }
}

#[test]
fn convolution_and_its_gradients_are_those_of_burn() {
    let case = |batch, inputs, outputs, size, kernel| Case { batch, inputs, outputs, size, kernel, strided: false };
    for case in [
        case(1, [1, 0], 1, [1, 1], 3),
        case(2, [3, 0], 5, [3, 5], 3),
        case(1, [3, 0], 16, [128, 128], 7),
        case(1, [5, 3], 123, [127, 33], 3),
        case(4, [16, 16], 9, [9, 70], 3),
        case(1, [512, 0], 130, [4, 4], 3),
        case(1, [130, 0], 512, [2, 2], 3),
        case(3, [64, 64], 32, [32, 32], 3),
        // Weights that one band packs for itself, and weights that stay far away from many bands.
        case(1, [90, 0], 70, [9, 11], 3),
        case(1, [256, 0], 130, [24, 20], 3),
        case(2, [7, 0], 6, [65, 66], 1),
        case(1, [3, 0], 2, [5, 3], 7),
        case(2, [6, 2], 3, [2, 2], 7),
        case(1, [2, 0], 3, [1, 300], 5),
    ] {
        check_convolution(case, Activation::None);
        check_convolution(case, Activation::LeakyRelu(0.2));
    }
    check_convolution(case(1, [4, 0], 8, [20, 20], 3), Activation::Sigmoid);
    check_convolution(case(1, [4, 2], 8, [20, 20], 3), Activation::LeakyRelu(0.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn convolution_holds_for_any_shape(
        batch in 1usize..5,
        first in 1usize..20,
        second in 0usize..9,
        outputs in 1usize..20,
        h in 1usize..40,
        w in 1usize..40,
        kernel in prop::sample::select(vec![1usize, 3, 5, 7]),
        strided: bool,
    ) {
        check_convolution(
            Case { batch, inputs: [first, second], outputs, size: [h, w], kernel, strided },
            Activation::LeakyRelu(0.2),
        );
    }

    #[test]
    fn resampling_holds_for_any_shape(
        batch in 1usize..5,
        first in 1usize..9,
        second in 0usize..9,
        h in 1usize..20,
        w in 1usize..20,
        strided_input: bool,
    ) {
        check_upsampling(batch, [first, second], [h, w], strided_input);
        check_blur_pool(batch, first, [2 * h, 2 * w], strided_input);
    }
}

fn check_upsampling(batch: usize, channels: [usize; 2], [h, w]: [usize; 2], is_strided: bool) {
    let device = Device::flex().autodiff();
    let [x, skip] = channels.map(|c| {
        let x = random([batch, c, h, w], &device);
        let x = if is_strided { strided(&x) } else { x };
        x.detach().require_grad()
    });
    let skips = (channels[1] > 0).then_some(skip.clone());
    let towards = random([batch, channels[0] + channels[1], 2 * h, 2 * w], &device);
    let ours = upsample(x.clone(), skips.clone());
    let burns = resize::upsample(joined(x.clone(), skips));
    assert_close("upsampled", ours.clone(), burns.clone());
    let ours = (ours * towards.clone()).sum().backward();
    let burns = (burns * towards).sum().backward();
    assert_close("by x", x.grad(&ours).unwrap(), x.grad(&burns).unwrap());
    if channels[1] > 0 {
        let (ours, burns) = (skip.grad(&ours).unwrap(), skip.grad(&burns).unwrap());
        assert_close("by the skip connection", ours, burns);
    }
}

fn check_blur_pool(batch: usize, channels: usize, [h, w]: [usize; 2], is_strided: bool) {
    let device = Device::flex().autodiff();
    let x = random([batch, channels, h, w], &device);
    let x = if is_strided { strided(&x) } else { x };
    let x = x.detach().require_grad();
    let towards = random([batch, channels, h / 2, w / 2], &device);
    let (ours, burns) = (blur_pool(x.clone()), resize::blur_pool(x.clone()));
    assert_close("pooled", ours.clone(), burns.clone());
    let ours = (ours * towards.clone()).sum().backward();
    let burns = (burns * towards).sum().backward();
    assert_close("by x", x.grad(&ours).unwrap(), x.grad(&burns).unwrap());
}

#[test]
fn resampling_of_large_and_small_pictures_is_that_of_burn() {
    check_upsampling(1, [64, 3], [64, 64], false);
    check_upsampling(2, [5, 0], [127, 3], true);
    check_upsampling(1, [1, 0], [1, 1], false);
    check_upsampling(1, [1, 0], [1, 3], false);
    check_blur_pool(1, 64, [128, 128], false);
    check_blur_pool(1, 1, [2, 2], false);
    check_blur_pool(4, 3, [254, 2], true);
}

#[test]
fn normalization_and_its_gradients_are_those_of_burn() {
    let device = Device::flex().autodiff();
    for (batch, channels, groups, [h, w]) in
        [(1, 8, 8, [5, 3]), (2, 16, 8, [64, 64]), (4, 64, 8, [9, 127]), (1, 512, 8, [4, 4]), (3, 6, 1, [2, 2])]
    {
        let mut norm = GroupNormConfig::new(groups, channels).init(&device);
        norm.gamma = Some(Param::from_tensor(random([channels], &device)));
        norm.beta = Some(Param::from_tensor(random([channels], &device)));
        let x = (random([batch, channels, h, w], &device) * 3.0 + 1.0).detach().require_grad();
        let ours = group_norm(x.clone(), &norm, 0.2);
        let burns = norm.forward(x.clone());
        let towards = random_away_from_kinks(&burns);
        let burns = activation::leaky_relu(burns, 0.2);
        let what = format!("{batch}×{channels}×{h}×{w}");
        assert_close(&what, ours.clone(), burns.clone());
        let ours = (ours * towards.clone()).sum().backward();
        let burns = (burns * towards).sum().backward();
        assert_close(&what, x.grad(&ours).unwrap(), x.grad(&burns).unwrap());
        for parameter in [&norm.gamma, &norm.beta] {
            let parameter = parameter.as_ref().unwrap().val();
            let gradient = |gradients| parameter.grad(gradients).unwrap();
            assert_close(&format!("{what}, affine"), gradient(&ours), gradient(&burns));
        }
    }
}

/// One picture has no variance if it has one pixel, or equal pixels.
#[test]
fn batch_normalisation_of_a_batch_of_one_is_finite_where_nothing_varies() {
    let device = Device::flex().autodiff();
    for [h, w] in [[1, 1], [2, 2], [7, 16]] {
        let mut norm = BatchNormConfig::new(5).init(&device);
        norm.gamma = Param::from_tensor(random([5], &device));
        norm.beta = Param::from_tensor(random([5], &device));
        let level = random([1, 5, 1, 1], &device) * 10.0;
        let x = level.repeat(&[1, 1, h, w]).detach().require_grad();
        let y = batch_norm(x.clone(), &norm, 0.2, true);
        let beta = activation::leaky_relu(norm.beta.val().reshape([1, 5, 1, 1]), 0.2);
        assert_within(1e-3, "its shift", y.clone(), beta.repeat(&[1, 1, h, w]));
        let gradients = (y * random([1, 5, h, w], &device)).sum().backward();
        let finite = |values: Vec<f32>| values.iter().all(|v| v.is_finite());
        assert!(finite(values(x.grad(&gradients).unwrap())));
        for parameter in [&norm.gamma, &norm.beta] {
            assert!(finite(values(parameter.val().grad(&gradients).unwrap())));
        }
        // A tenth of the way from 0 and 1 to this picture's statistics.
        let mean = norm.running_mean.value();
        assert_within(1e-4, "mean", mean * 10.0, x.inner().narrow(2, 0, 1).narrow(3, 0, 1).reshape([5]));
        let variances = values(norm.running_var.value());
        assert!(variances.iter().all(|v| (v - 0.9).abs() < 1e-4), "{variances:?}");
    }
    test_support::shown!(Network, "Batch normalisation of one picture, of one value, and of pictures of one colour",
 bound: "outputs are the shift to 1e-3; all gradients finite", measured: "holds");
}

#[test]
fn a_gradient_is_the_slope_of_the_loss() {
    // Along a random direction, by central differences: independent of burn's own gradients.
    let device = Device::flex().autodiff();
    let layer = layer(6, 10, 3, &device);
    let norm = GroupNormConfig::new(2, 10).init(&device);
    let towards = random([1, 20, 14, 10], &device);
    let loss = |x: Tensor<4>| {
        let y = convolution(x, None, &layer, Activation::None, Precision::Full);
        let y = group_norm(y, &norm, 1.0);
        let pooled = blur_pool(y.clone());
        let y = upsample(pooled.clone(), Some(pooled));
        (y * towards.clone()).sum()
    };
    let x = random([1, 6, 14, 10], &device).detach().require_grad();
    let direction = random([1, 6, 14, 10], &device).detach();
    let gradients = loss(x.clone()).backward();
    let slope = Tensor::<4>::from_inner(x.grad(&gradients).unwrap()) * direction.clone();
    let slope = slope.sum().into_scalar::<f32>();
    let h = 1e-2;
    let at = |t: f32| loss(x.clone() + direction.clone() * t).into_scalar::<f32>();
    let difference = (at(h) - at(-h)) / (2.0 * h);
    assert!((slope - difference).abs() < 2e-3 * slope.abs().max(1.0), "{slope} against {difference}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let device = Device::flex().autodiff();
    let layer = layer(24, 40, 3, &device);
    let small = random([1, 24, 7, 9], &device).require_grad();
    let large = random([2, 24, 130, 70], &device).require_grad();
    let run = |threads: usize| -> Vec<u32> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut bits = Vec::new();
            for x in [&small, &large] {
                let y = convolution(x.clone(), None, &layer, Activation::LeakyRelu(0.2), Precision::Full);
                let gradients = (y.clone() * y.clone()).sum().backward();
                bits.extend(values(y));
                bits.extend(values(x.grad(&gradients).unwrap()));
                bits.extend(values(layer.weight.val().grad(&gradients).unwrap()));
            }
            bits.into_iter().map(f32::to_bits).collect()
        })
    };
    let alone = run(1);
    for threads in [2, 3, 16] {
        assert!(alone == run(threads), "{threads} threads change the result");
    }
}

#[test]
fn some_outputs_are_those_of_all() {
    let device = Device::flex().autodiff();
    let layer = layer(20, 9, 3, &device);
    let x = random([1, 20, 40, 24], &device);
    let named = [7, 0, 3];
    let some = some_outputs(x.clone(), None, &layer, &named, Activation::Sigmoid, Precision::Full);
    let all = convolution(x, None, &layer, Activation::Sigmoid, Precision::Full);
    let taken = named.map(|o| all.clone().narrow(1, o, 1)).to_vec();
    assert_close("some outputs", some.clone(), Tensor::cat(taken, 1));
    let gradients = some.square().sum().backward();
    let by_weights = layer.weight.val().grad(&gradients).unwrap();
    for output in 0..9 {
        let sum = by_weights.clone().narrow(0, output, 1).abs().sum();
        assert_eq!(named.contains(&output), sum.into_scalar::<f32>() > 0.0);
    }
}

#[test]
fn convolutions_at_once_do_not_disturb_each_other() {
    // A thread that waits for a part of one may start another, which must use other buffers.
    let device = Device::flex().autodiff();
    let layer = layer(48, 40, 3, &device);
    let inputs: Vec<_> = (0..24).map(|i| random([1, 48, 8 + i, 30], &device)).collect();
    let run = |x: &Tensor<4>, precision| {
        let x = x.clone().require_grad();
        let y = convolution(x.clone(), None, &layer, Activation::LeakyRelu(0.2), precision);
        let gradients = (y.clone() * y.clone()).sum().backward();
        [values(y), values(x.grad(&gradients).unwrap())]
    };
    for precision in [Precision::Full, Precision::Mixed] {
        let alone: Vec<_> = inputs.iter().map(|x| run(x, precision)).collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4);
        let together: Vec<_> = pool.build().unwrap().install(|| inputs.par_iter().map(|x| run(x, precision)).collect());
        assert!(alone == together, "{precision:?}");
    }
}

#[test]
fn steps_and_predictions_on_the_cpu_run_on_the_pool() {
    for device in [Device::flex(), Device::flex().autodiff()] {
        assert!(on_pool(&device, || rayon::current_thread_index().is_some()));
    }
}
