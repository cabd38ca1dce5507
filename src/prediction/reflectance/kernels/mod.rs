//! Operations of the network and its losses. On the CPU they are our own kernels,
//! on other devices compositions of burn's operations, behind the same functions.
//!
//! To add one: write it and its gradient as pure functions on slices in a file here, declare it in
//! `operations::Kernels`, implement it there for `Flex` and, with its gradient, for
//! `Autodiff<Flex, C>`, and give it a function here that falls back to burn's operations.

mod adam;
mod band;
mod bf16;
pub mod chunks;
pub mod convolution;
mod correlation;
mod feature_distance;
mod losses;
mod normalize;
mod operations;
pub mod peak;
mod pointwise;
mod precision;
mod resample;
pub mod shape;
mod sums;
#[cfg(test)]
mod tests;
mod tile;
mod unfolded;

pub use losses::Settings as LossSettings;
pub use pointwise::Activation;
pub use precision::Precision;

use self::adam::AdamStep;
use self::operations::{Kernels, Updates};
use super::resize;
use burn::backend::{Dispatch, DispatchDevice};
use burn::module::RunningState;
use burn::nn::conv::Conv2d;
use burn::nn::{BatchNorm, GroupNorm};
use burn::tensor::module::conv2d;
use burn::tensor::ops::ConvOptions;
use burn::tensor::{DType, Device, Int, Tensor, TensorData, activation};
use std::sync::atomic::{AtomicBool, Ordering};

/// True if the processor multiplies bf16, so that [`Precision`] makes a difference.
pub fn has_bf16() -> bool {
    bf16::available()
}

/// True if burn's operations stand in for our kernels.
static BURN: AtomicBool = AtomicBool::new(false);

/// Computes with burn's operations in this process from now on, or with our kernels again. For benchmarks.
pub fn keep_to_burn(on: bool) {
    BURN.store(on, Ordering::Relaxed);
}

/// True if our kernels can compute on `x`: f32 on burn's CPU backend.
pub fn serve<const D: usize>(x: &Tensor<D>) -> bool {
    if BURN.load(Ordering::Relaxed) {
        return false;
    }
    let device = x.device().without_autodiff();
    x.dtype() == DType::F32 && matches!(device.as_dispatch(), DispatchDevice::Flex(_))
}

/// Runs `work`, on the CPU in the thread pool: from outside, each parallel loop would wait for one of its threads to wake.
pub fn on_pool<T: Send>(device: &Device, work: impl FnOnce() -> T + Send) -> T {
    match device.clone().without_autodiff().as_dispatch() {
        DispatchDevice::Flex(_) => rayon::scope(|_| work()),
        _ => work(),
    }
}

/// A second source without channels.
fn nothing(x: &Tensor<4>) -> Tensor<4> {
    let [n, _, h, w] = x.dims();
    Tensor::empty([n, 0, h, w], &x.device().without_autodiff())
}

/// A convolution of stride 1 that keeps the picture's size, and its activation. The channels of `x`
/// are followed by those of `skip`: `[n, c1, h, w]`, `[n, c2, h, w]` → `[n, outputs, h, w]`.
pub fn convolution(
    x: Tensor<4>,
    skip: Option<Tensor<4>>,
    layer: &Conv2d,
    activation: Activation,
    precision: Precision,
) -> Tensor<4> {
    let bias = layer.bias.as_ref().map(|bias| bias.val());
    convolve(x, skip, layer.weight.val(), bias, activation, precision)
}

/// Only some outputs of a [`convolution()`], in the given order; the others are not
/// computed.
pub fn some_outputs(
    x: Tensor<4>,
    skip: Option<Tensor<4>>,
    layer: &Conv2d,
    outputs: &[usize],
    activation: Activation,
    precision: Precision,
) -> Tensor<4> {
    let named: Vec<i64> = outputs.iter().map(|o| *o as i64).collect();
    let named = Tensor::<1, Int>::from_data(TensorData::new(named, [outputs.len()]), &x.device().without_autodiff());
    let weight = layer.weight.val().select(0, named.clone());
    let bias = layer.bias.as_ref().map(|bias| bias.val().select(0, named));
    convolve(x, skip, weight, bias, activation, precision)
}

fn convolve(
    x: Tensor<4>,
    skip: Option<Tensor<4>>,
    weight: Tensor<4>,
    bias: Option<Tensor<1>>,
    activation: Activation,
    precision: Precision,
) -> Tensor<4> {
    let bias = match bias {
        Some(bias) if serve(&x) => {
            let skip = skip.unwrap_or_else(|| nothing(&x));
            return Tensor::from_dispatch(Dispatch::convolution(
                x.into_dispatch(),
                skip.into_dispatch(),
                weight.into_dispatch(),
                bias.into_dispatch(),
                activation,
                precision,
            ));
        }
        bias => bias,
    };
    let pad = weight.dims()[2] / 2;
    let options = ConvOptions::new([1, 1], [pad, pad], [1, 1], 1);
    let y = conv2d(joined(x, skip), weight, bias, options);
    match activation {
        Activation::None => y,
        Activation::LeakyRelu(slope) => activation::leaky_relu(y, f64::from(slope)),
        Activation::Sigmoid => activation::sigmoid(y),
    }
}

fn joined(x: Tensor<4>, skip: Option<Tensor<4>>) -> Tensor<4> {
    match skip {
        Some(skip) => Tensor::cat(vec![x, skip], 1),
        None => x,
    }
}

/// Blur-pool ÷2 (Zhang, "Making convolutional networks shift-invariant again"): the binomial filter
/// [1 2 1]/4 on both axes, edges repeated, then every second pixel. `[n, c, h, w]` → `[n, c, h/2, w/2]`;
/// h and w must be even.
pub fn blur_pool(x: Tensor<4>) -> Tensor<4> {
    if serve(&x) {
        return Tensor::from_dispatch(Dispatch::blur_pool(x.into_dispatch()));
    }
    resize::blur_pool(x)
}

/// Bilinear ×2 with half-pixel centres and repeated edges, as PyTorch's `align_corners=False`, of the
/// channels of `x` followed by those of `skip`: → `[n, c1 + c2, 2h, 2w]`.
pub fn upsample(x: Tensor<4>, skip: Option<Tensor<4>>) -> Tensor<4> {
    if serve(&x) {
        let skip = skip.unwrap_or_else(|| nothing(&x));
        let (x, skip) = (x.into_dispatch(), skip.into_dispatch());
        return Tensor::from_dispatch(Dispatch::upsample(x, skip));
    }
    resize::upsample(joined(x, skip))
}

/// Group normalisation followed by a leaky ReLU of this slope.
pub fn group_norm(x: Tensor<4>, norm: &GroupNorm, slope: f32) -> Tensor<4> {
    if serve(&x)
        && let (Some(gamma), Some(beta)) = (&norm.gamma, &norm.beta)
    {
        let [gamma, beta] = [gamma, beta].map(|p| p.val().into_dispatch());
        let x = x.into_dispatch();
        let (y, _) = Dispatch::normalize(x, gamma, beta, norm.num_groups, norm.epsilon, slope);
        return Tensor::from_dispatch(y);
    }
    activation::leaky_relu(norm.forward(x), f64::from(slope))
}

/// Batch normalisation followed by a leaky ReLU of this slope. In training, and in prediction if `own` is set,
/// a picture's own statistics count; otherwise the running ones.
pub fn batch_norm(x: Tensor<4>, norm: &BatchNorm, slope: f32, own: bool) -> Tensor<4> {
    let [n, c, ..] = x.dims();
    let training = x.device().is_autodiff() && norm.training.is_enabled();
    let running = [&norm.running_mean, &norm.running_var];
    // burn's own normalises over the batch, which is right in training however large it is.
    let one_by_one = if training { n == 1 && serve(&x) } else { own };
    if !one_by_one {
        let y = norm.forward(x);
        if training {
            running.iter().for_each(|running| sync(running));
        }
        return activation::leaky_relu(y, f64::from(slope));
    }
    if !serve(&x) {
        let y = instance_norm(x, norm);
        return activation::leaky_relu(y, f64::from(slope));
    }
    let [gamma, beta] = [&norm.gamma, &norm.beta].map(|p| p.val().into_dispatch());
    let (y, moments) = Dispatch::normalize(x.into_dispatch(), gamma, beta, c, norm.epsilon, slope);
    if training {
        let moments = Tensor::<2>::from_dispatch(moments).detach();
        for (row, running) in running.into_iter().enumerate() {
            let now = moments.clone().narrow(0, row, 1).reshape([c]);
            let before = running.value_sync().to_device(&now.device());
            running.update((before * (1.0 - norm.momentum) + now * norm.momentum).detach());
            sync(running);
        }
    }
    Tensor::from_dispatch(y)
}

/// Applies the last update, which burn defers until the next one: a checkpoint between them would lack it.
fn sync(running: &RunningState<Tensor<1>>) {
    running.value_sync();
}

/// Each channel of each picture normalised to mean 0 and variance 1, then scaled and shifted by `norm`.
fn instance_norm(x: Tensor<4>, norm: &BatchNorm) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let planes = x.reshape([n, c, h * w]);
    let centred = planes.clone() - planes.mean_dim(2);
    let variance = centred.clone().square().mean_dim(2);
    let [gamma, beta] = [&norm.gamma, &norm.beta].map(|p| p.val().reshape([1, c, 1]));
    let y = centred / (variance + norm.epsilon).sqrt() * gamma + beta;
    y.reshape([n, c, h, w])
}

/// Inputs of the losses besides the network's output, `[1, 3, h, w]` unless noted.
pub struct LossInputs<'a> {
    /// Linear light of an output of 1.
    pub light: Tensor<4>,
    /// Matte of the subject, `[1, 1, h, w]`.
    pub mask: &'a Tensor<4>,
    /// Encoded OLATs, `[lamps, 3, h, w]`; None skips the reconstruction loss.
    pub olats: Option<&'a Tensor<4>>,
    /// The encoded plate: the subject under the interview's light.
    pub plate: &'a Tensor<4>,
    /// Weights of the lamps in the interview's light, `[lamps, 3, 1, 1]`.
    pub weights: &'a Tensor<4>,
    pub settings: LossSettings,
}

/// λ1 · reconstruction + λ2 · rendering of the network's output `[1, 3·lamps, h, w]`, and both separate
/// losses, `[2]`; for tensors accepted by [`serve`].
pub fn losses(output: Tensor<4>, with: &LossInputs) -> (Tensor<1>, Tensor<1>) {
    let olats = with.olats.cloned().unwrap_or_else(|| nothing(&output));
    let tensors = [&with.light, with.mask, &olats, with.plate, with.weights];
    let [light, mask, olats, plate, weights] = tensors.map(|t| t.clone().into_dispatch());
    let output = output.into_dispatch();
    let (total, parts) = Dispatch::losses(output, light, mask, olats, plate, weights, with.settings);
    (Tensor::from_dispatch(total), Tensor::from_dispatch(parts))
}

/// A parameter and both its moments after step number `step` (from 1) of Adam, with β₁ = 0.9,
/// β₂ = 0.999 and ε = 1e-8; for tensors accepted by [`serve`].
pub fn adam<const D: usize>(
    parameter: Tensor<D>,
    gradient: Tensor<D>,
    moments: [Tensor<D>; 2],
    learning_rate: f64,
    step: usize,
) -> (Tensor<D>, [Tensor<D>; 2]) {
    let [first, second] = moments.map(Tensor::into_dispatch);
    let step = AdamStep { learning_rate, step: step as i32 };
    let (parameter, gradient) = (parameter.into_dispatch(), gradient.into_dispatch());
    let (parameter, first, second) = Dispatch::adam(parameter, gradient, first, second, step);
    (Tensor::from_dispatch(parameter), [first, second].map(Tensor::from_dispatch))
}

/// keep · average + (1 − keep) · parameter.
pub fn follow<const D: usize>(average: Tensor<D>, parameter: Tensor<D>, keep: f32) -> Tensor<D> {
    if serve(&average) {
        let (average, parameter) = (average.into_dispatch(), parameter.into_dispatch());
        return Tensor::from_dispatch(Dispatch::follow(average, parameter, keep));
    }
    average * keep + parameter * (1.0 - keep)
}

/// Σ x².
pub fn square_sum<const D: usize>(x: Tensor<D>) -> Tensor<1> {
    if serve(&x) {
        return Tensor::from_dispatch(Dispatch::square_sum(x.into_dispatch()));
    }
    (x.clone() * x).sum()
}
