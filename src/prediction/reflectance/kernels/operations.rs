//! The kernels as operations of burn: their results, and their gradients derived by hand.

use super::adam::AdamStep;
use super::bf16;
use super::convolution::{self, GradientInputs};
use super::losses::{Losses, Settings};
use super::normalize::{GroupNorm, Moments};
use super::pointwise::Activation;
use super::precision::Precision;
use super::shape;
use super::{adam, resample};
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::{FlexTensor, Layout};
use burn::backend::ops::FloatTensorOps;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, AutodiffBackend, Backend, Flex, TensorMetadata, backend_extension};
use burn::tensor::{Bytes, DType, Shape};

/// Operations of the network and its losses, for burn's CPU backend.
#[backend_extension(Flex, Autodiff)]
pub trait Kernels: Backend {
    /// Convolution of the channels of `first` and then `second` (without channels if there is only
    /// one source), bias and activation. See [`convolution::forward`].
    fn convolution(
        first: FloatTensor<Self>,
        second: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
        precision: Precision,
    ) -> FloatTensor<Self>;

    /// See [`resample::blur_pool`].
    fn blur_pool(x: FloatTensor<Self>) -> FloatTensor<Self>;

    /// See [`resample::upsample`]; `second` may have no channels.
    fn upsample(first: FloatTensor<Self>, second: FloatTensor<Self>) -> FloatTensor<Self>;

    /// Group normalisation and leaky ReLU, see [`GroupNorm`]; also returns the mean and the variance of
    /// each group, `[2, n·groups]`, which carry no gradient.
    fn normalize(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        groups: usize,
        epsilon: f64,
        slope: f32,
    ) -> (FloatTensor<Self>, FloatTensor<Self>);

    /// λ1 · reconstruction + λ2 · rendering, `[1]`, and both separate losses, `[2]`, which carry no
    /// gradient, like all inputs but `output`. `olats` may be empty. See [`Losses`].
    fn losses(
        output: FloatTensor<Self>,
        light: FloatTensor<Self>,
        mask: FloatTensor<Self>,
        olats: FloatTensor<Self>,
        plate: FloatTensor<Self>,
        weights: FloatTensor<Self>,
        settings: Settings,
    ) -> (FloatTensor<Self>, FloatTensor<Self>);
}

/// Updates of parameters once their gradients are known.
#[backend_extension(Flex)]
pub trait Updates: Backend {
    /// The parameter and both moments after a step. See [`AdamStep`].
    fn adam(
        parameter: FloatTensor<Self>,
        gradient: FloatTensor<Self>,
        first_moment: FloatTensor<Self>,
        second_moment: FloatTensor<Self>,
        step: AdamStep,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);

    /// keep · average + (1 − keep) · parameter.
    fn follow(average: FloatTensor<Self>, parameter: FloatTensor<Self>, keep: f32) -> FloatTensor<Self>;

    /// Σ x², `[1]`.
    fn square_sum(x: FloatTensor<Self>) -> FloatTensor<Self>;
}

impl Updates for Flex {
    fn adam(
        parameter: FlexTensor,
        gradient: FlexTensor,
        first_moment: FlexTensor,
        second_moment: FlexTensor,
        step: AdamStep,
    ) -> (FlexTensor, FlexTensor, FlexTensor) {
        let gradient = Values::new(&gradient);
        // Written in place if there is no other owner, into a copy otherwise.
        let [mut p, mut m, mut v] = [parameter, first_moment, second_moment].map(whole);
        step.apply(p.storage_mut(), gradient.get(), m.storage_mut(), v.storage_mut());
        (p, m, v)
    }

    fn follow(average: FlexTensor, parameter: FlexTensor, keep: f32) -> FlexTensor {
        let mut average = whole(average);
        adam::follow(average.storage_mut(), Values::new(&parameter).get(), keep);
        average
    }

    fn square_sum(x: FlexTensor) -> FlexTensor {
        tensor(vec![adam::square_sum(Values::new(&x).get()) as f32], [1])
    }
}

/// A tensor that is all of its buffer, in order.
fn whole(tensor: FlexTensor) -> FlexTensor {
    let elements = tensor.shape().num_elements();
    if tensor.is_contiguous() && tensor.storage::<f32>().len() == elements {
        return tensor;
    }
    let values = Values::new(&tensor).get().to_vec();
    self::tensor(values, tensor.shape())
}

/// A tensor's values in the order `[n, c, h, w]`, copied only if their order differs.
struct Values(FlexTensor);

impl Values {
    fn new(tensor: &FlexTensor) -> Self {
        Self(tensor.to_contiguous())
    }

    fn get(&self) -> &[f32] {
        self.0.as_slice().expect("a contiguous f32 tensor, as the network's operations require")
    }
}

fn tensor(values: Vec<f32>, shape: impl Into<Shape>) -> FlexTensor {
    FlexTensor::new(Bytes::from_elems(values), Layout::contiguous(shape.into()), DType::F32)
}

fn dims(tensor: &FlexTensor) -> [usize; 4] {
    tensor.shape().dims()
}

/// Gradient of both sources, without a copy if there is only one.
fn split(gradient: Vec<f32>, [n, c1, c2]: [usize; 3], [h, w]: [usize; 2]) -> [FlexTensor; 2] {
    if c2 == 0 {
        return [tensor(gradient, [n, c1, h, w]), tensor(Vec::new(), [n, 0, h, w])];
    }
    let both = tensor(gradient, [n, c1 + c2, h, w]);
    let strides = [(c1 + c2) * h * w, h * w, w, 1].map(|s| s as isize).to_vec();
    [(c1, 0), (c2, c1 * h * w)].map(|(c, offset)| {
        let layout = Layout::new(Shape::from([n, c, h, w]), strides.clone(), offset);
        FlexTensor::from_arc(both.data_arc(), layout, DType::F32)
    })
}

fn convolution_shape(
    first: &FlexTensor,
    second: &FlexTensor,
    weight: &FlexTensor,
    precision: Precision,
) -> shape::Shape {
    let ([batch, c1, height, width], [_, c2, ..]) = (dims(first), dims(second));
    let [outputs, inputs, kernel, _] = dims(weight);
    assert_eq!(inputs, c1 + c2, "the weights' input channels must match the sources");
    let shape = shape::Shape { batch, inputs, outputs, height, width, kernel, bf16: false };
    shape.with_precision(precision)
}

fn group_norm<'a>(
    x: &FlexTensor,
    [gamma, beta]: [&'a Values; 2],
    groups: usize,
    epsilon: f64,
    slope: f32,
) -> GroupNorm<'a> {
    let [_, _, h, w] = dims(x);
    GroupNorm { groups, pixels: h * w, gamma: gamma.get(), beta: beta.get(), epsilon, slope }
}

/// Means and then variances.
fn moments_tensor(moments: &[Moments]) -> FlexTensor {
    let means = moments.iter().map(|m| m.mean as f32);
    let variances = moments.iter().map(|m| m.variance as f32);
    tensor(means.chain(variances).collect(), [2, moments.len()])
}

impl Kernels for Flex {
    fn convolution(
        first: FlexTensor,
        second: FlexTensor,
        weight: FlexTensor,
        bias: FlexTensor,
        activation: Activation,
        precision: Precision,
    ) -> FlexTensor {
        let shape = convolution_shape(&first, &second, &weight, precision);
        let [first, second, weight, bias] = [&first, &second, &weight, &bias].map(Values::new);
        let mut out = vec![0.0; shape.batch * shape.outputs * shape.height * shape.width];
        let sources = [first.get(), second.get()];
        convolution::forward(&shape, sources, weight.get(), bias.get(), activation, &mut out);
        tensor(out, [shape.batch, shape.outputs, shape.height, shape.width])
    }

    fn blur_pool(x: FlexTensor) -> FlexTensor {
        let [n, c, h, w] = dims(&x);
        let out = [n, c, h.div_ceil(2), w.div_ceil(2)];
        let mut values = vec![0.0; out.iter().product()];
        resample::blur_pool(Values::new(&x).get(), [h, w], &mut values);
        tensor(values, out)
    }

    fn upsample(first: FlexTensor, second: FlexTensor) -> FlexTensor {
        let ([n, c1, h, w], [_, c2, ..]) = (dims(&first), dims(&second));
        let out = [n, c1 + c2, 2 * h, 2 * w];
        let mut values = vec![0.0; out.iter().product()];
        let [first, second] = [&first, &second].map(Values::new);
        resample::upsample(n, [h, w], first.get(), second.get(), &mut values);
        tensor(values, out)
    }

    fn normalize(
        x: FlexTensor,
        gamma: FlexTensor,
        beta: FlexTensor,
        groups: usize,
        epsilon: f64,
        slope: f32,
    ) -> (FlexTensor, FlexTensor) {
        let affine = [&gamma, &beta].map(Values::new);
        let norm = group_norm(&x, affine.each_ref(), groups, epsilon, slope);
        let values = Values::new(&x);
        let mut y = vec![0.0; values.get().len()];
        let moments = norm.forward(values.get(), &mut y);
        (tensor(y, dims(&x)), moments_tensor(&moments))
    }

    fn losses(
        output: FlexTensor,
        light: FlexTensor,
        mask: FlexTensor,
        olats: FlexTensor,
        plate: FlexTensor,
        weights: FlexTensor,
        settings: Settings,
    ) -> (FlexTensor, FlexTensor) {
        let (total, parts, _) = losses([output, light, mask, olats, plate, weights], settings);
        (total, parts)
    }
}

/// The weighted sum of the losses, both of them, and the gradient of the sum by the output.
fn losses(inputs: [FlexTensor; 6], settings: Settings) -> (FlexTensor, FlexTensor, FlexTensor) {
    let [output, inputs @ ..] = inputs;
    let shape = dims(&output);
    let [light, mask, olats, plate, weights] = inputs.each_ref().map(Values::new);
    let losses = Losses {
        size: [shape[2], shape[3]],
        light: light.get(),
        mask: mask.get(),
        olats: Some(olats.get()).filter(|olats| !olats.is_empty()),
        plate: plate.get(),
        weights: weights.get(),
        settings,
    };
    // In place if there is no other owner, in a copy otherwise.
    let mut gradient = whole(output);
    let parts = losses.replace_by_gradient(gradient.storage_mut());
    let total = settings.reconstruction * parts.reconstruction + settings.rendering * parts.rendering;
    (tensor(vec![total], [1]), tensor(vec![parts.reconstruction, parts.rendering], [2]), gradient)
}

/// State of a convolution for its gradients.
#[derive(Clone, Debug)]
struct ConvolutionState {
    shape: shape::Shape,
    /// Pictures, and channels of both sources.
    split: [usize; 3],
    weight: FlexTensor,
    activation: Activation,
    inputs: GradientTensors,
}

/// See [`GradientInputs`].
#[derive(Clone, Debug)]
enum GradientTensors {
    /// The output is None without activation.
    Exact(Box<[FlexTensor; 2]>, Option<Box<FlexTensor>>),
    Rounded([Vec<u16>; 2], Option<bf16::Signs>),
}

impl ConvolutionState {
    fn new(
        shape: shape::Shape,
        sources: [FlexTensor; 2],
        weight: FlexTensor,
        activation: Activation,
        output: &FlexTensor,
    ) -> Self {
        let split = [shape.batch, dims(&sources[0])[1], dims(&sources[1])[1]];
        let rounded = |signs| {
            let sources = sources.each_ref().map(|x| bf16::to_bf16(Values::new(x).get()));
            GradientTensors::Rounded(sources, signs)
        };
        let inputs = match activation {
            Activation::None if shape.bf16 => rounded(None),
            Activation::LeakyRelu(slope) if shape.bf16 => {
                rounded(Some(bf16::Signs::new(slope, Values::new(output).get())))
            }
            Activation::None => GradientTensors::Exact(sources.into(), None),
            _ => GradientTensors::Exact(sources.into(), Some(output.clone().into())),
        };
        Self { shape, split, weight, activation, inputs }
    }
}

/// Registers an operation: `state` is kept for `step` if a gradient is needed.
macro_rules! record {
    ($step:expr, $guards:expr, $state:expr, $output:expr) => {
        match $step.prepare::<C>($guards).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish($state, $output),
            OpsKind::UnTracked(prep) => prep.finish($output),
        }
    };
}

impl<C: CheckpointStrategy> Kernels for Autodiff<Flex, C> {
    fn convolution(
        first: FloatTensor<Self>,
        second: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
        precision: Precision,
    ) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct Convolution;
        impl Backward<Flex, 4> for Convolution {
            type State = ConvolutionState;
            fn backward(self, ops: Ops<Self::State, 4>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let ConvolutionState { shape, split: channels, weight, activation, inputs } = ops.state;
                let gradient = gradients.consume::<Flex>(&ops.node);
                let [first_node, second_node, weight_node, bias_node] = ops.parents;
                let wanted =
                    [first_node.is_some() || second_node.is_some(), weight_node.is_some() || bias_node.is_some()];
                let [weights, gradient] = [&weight, &gradient].map(Values::new);
                let (weights, gradient) = (weights.get(), gradient.get());
                let back = |inputs: GradientInputs| {
                    convolution::backward(&shape, inputs, weights, activation, gradient, wanted)
                };
                let back = match &inputs {
                    GradientTensors::Exact(sources, output) => {
                        let [x, y] = sources.each_ref().map(Values::new);
                        let output = output.as_deref().map(Values::new);
                        let output = output.as_ref().map_or(gradient, Values::get);
                        back(GradientInputs::Exact([x.get(), y.get()], output))
                    }
                    GradientTensors::Rounded([x, y], signs) => back(GradientInputs::Rounded([x, y], signs.as_ref())),
                };
                if let Some(input) = back.input {
                    let sources = split(input, channels, [shape.height, shape.width]);
                    for (node, gradient) in [first_node, second_node].into_iter().zip(sources) {
                        if let Some(node) = node {
                            gradients.register::<Flex>(node.id, gradient);
                        }
                    }
                }
                let (by_weight, by_bias) = back.parameters.unwrap_or_default();
                if let Some(node) = weight_node {
                    gradients.register::<Flex>(node.id, tensor(by_weight, dims(&weight)));
                }
                if let Some(node) = bias_node {
                    gradients.register::<Flex>(node.id, tensor(by_bias, [shape.outputs]));
                }
            }
        }
        let inputs = [first, second, weight, bias];
        let guards = inputs.each_ref().map(|t| t.node());
        let [first, second, weight, bias] = inputs.map(|t| t.into_primitive());
        let shape = convolution_shape(&first, &second, &weight, precision);
        let [x, y, w] = [&first, &second, &weight].map(Clone::clone);
        let output = Flex::convolution(first, second, weight, bias, activation, precision);
        record!(Convolution, guards, ConvolutionState::new(shape, [x, y], w, activation, &output), output)
    }

    fn blur_pool(x: FloatTensor<Self>) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct BlurPool;
        impl Backward<Flex, 1> for BlurPool {
            type State = [usize; 4];
            fn backward(self, ops: Ops<Self::State, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let gradient = gradients.consume::<Flex>(&ops.node);
                let [n, c, h, w] = ops.state;
                if let [Some(node)] = ops.parents {
                    let mut dx = vec![0.0; n * c * h * w];
                    resample::blur_pool_backward(Values::new(&gradient).get(), [h, w], &mut dx);
                    gradients.register::<Flex>(node.id, tensor(dx, [n, c, h, w]));
                }
            }
        }
        let guard = x.node();
        let x = x.into_primitive();
        let state = dims(&x);
        record!(BlurPool, [guard], state, Flex::blur_pool(x))
    }

    fn upsample(first: FloatTensor<Self>, second: FloatTensor<Self>) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct Upsample;
        impl Backward<Flex, 2> for Upsample {
            /// Pictures and channels of both sources; their height and width.
            type State = ([usize; 3], [usize; 2]);
            fn backward(self, ops: Ops<Self::State, 2>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let gradient = gradients.consume::<Flex>(&ops.node);
                let ([n, c1, c2], size) = ops.state;
                let [mut first, mut second] = [c1, c2].map(|c| vec![0.0; n * c * size[0] * size[1]]);
                let gradient = Values::new(&gradient);
                resample::upsample_backward(n, size, gradient.get(), &mut first, &mut second);
                let sources = [(first, c1), (second, c2)];
                for (node, (dx, channels)) in ops.parents.into_iter().zip(sources) {
                    if let Some(node) = node {
                        let dx = tensor(dx, [n, channels, size[0], size[1]]);
                        gradients.register::<Flex>(node.id, dx);
                    }
                }
            }
        }
        let guards = [first.node(), second.node()];
        let (first, second) = (first.into_primitive(), second.into_primitive());
        let ([n, c1, h, w], [_, c2, ..]) = (dims(&first), dims(&second));
        let output = Flex::upsample(first, second);
        record!(Upsample, guards, ([n, c1, c2], [h, w]), output)
    }

    fn normalize(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        groups: usize,
        epsilon: f64,
        slope: f32,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        #[derive(Debug)]
        struct Normalize;
        impl Backward<Flex, 3> for Normalize {
            /// x, γ and β; the mean and variance of each group; groups, ε and slope.
            type State = ([FlexTensor; 3], Vec<Moments>, (usize, f64, f32));
            fn backward(self, ops: Ops<Self::State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let gradient = gradients.consume::<Flex>(&ops.node);
                let ([x, gamma, beta], moments, (groups, epsilon, slope)) = ops.state;
                let shape = dims(&x);
                let affine = [&gamma, &beta].map(Values::new);
                let norm = group_norm(&x, affine.each_ref(), groups, epsilon, slope);
                let [dy, x] = [&gradient, &x].map(Values::new);
                let mut dx = vec![0.0; x.get().len()];
                let [mut dgamma, mut dbeta] = [vec![0.0; shape[1]], vec![0.0; shape[1]]];
                norm.backward(dy.get(), x.get(), &moments, &mut dx, &mut dgamma, &mut dbeta);
                let results = [tensor(dx, shape), tensor(dgamma, [shape[1]]), tensor(dbeta, [shape[1]])];
                for (node, gradient) in ops.parents.into_iter().zip(results) {
                    if let Some(node) = node {
                        gradients.register::<Flex>(node.id, gradient);
                    }
                }
            }
        }
        let inputs = [x, gamma, beta];
        let guards = inputs.each_ref().map(|t| t.node());
        let inputs = inputs.map(|t| t.into_primitive());
        let affine = [&inputs[1], &inputs[2]].map(Values::new);
        let norm = group_norm(&inputs[0], affine.each_ref(), groups, epsilon, slope);
        let x = Values::new(&inputs[0]);
        let mut y = vec![0.0; x.get().len()];
        let moments = norm.forward(x.get(), &mut y);
        let output = tensor(y, dims(&inputs[0]));
        let statistics = Self::from_inner(moments_tensor(&moments));
        let state = (inputs, moments, (groups, epsilon, slope));
        (record!(Normalize, guards, state, output), statistics)
    }

    fn losses(
        output: FloatTensor<Self>,
        light: FloatTensor<Self>,
        mask: FloatTensor<Self>,
        olats: FloatTensor<Self>,
        plate: FloatTensor<Self>,
        weights: FloatTensor<Self>,
        settings: Settings,
    ) -> (FloatTensor<Self>, FloatTensor<Self>) {
        #[derive(Debug)]
        struct Total;
        impl Backward<Flex, 1> for Total {
            /// The gradient, which came with the losses.
            type State = FlexTensor;
            fn backward(self, ops: Ops<Self::State, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let factor = gradients.consume::<Flex>(&ops.node);
                if let [Some(node)] = ops.parents {
                    let factor = Values::new(&factor).get()[0];
                    let mut gradient = ops.state;
                    if factor != 1.0 {
                        gradient = Flex::float_mul_scalar(gradient, factor.into());
                    }
                    gradients.register::<Flex>(node.id, gradient);
                }
            }
        }
        let guard = output.node();
        let inputs = [output, light, mask, olats, plate, weights].map(|t| t.into_primitive());
        let (total, parts, gradient) = losses(inputs, settings);
        (record!(Total, [guard], gradient, total), Self::from_inner(parts))
    }
}
