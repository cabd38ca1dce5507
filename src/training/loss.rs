//! The two losses. Both compare pictures in feature space by ‖·‖₂, with the background masked out.
//!
//! The built-in features need no file: the encoded picture and its horizontal and vertical
//! differences, at three scales. Differences carry edges and shading, the coarse scales the overall
//! light; all are linear, so their gradients are cheap.

use super::augment;
use crate::reflectance::kernels::{self, Comparison};
use crate::reflectance::render::{encode, olats, relight};
use burn::tensor::Tensor;
use burn::tensor::module::avg_pool2d;
use burn::tensor::ops::AvgPoolOptions;

/// Added under the root: ‖x‖ becomes √(‖x‖² + ε²), whose gradient at zero error is 0 and not 0/0.
/// In units of encoded values: far below one 8-bit step.
pub const EPSILON: f32 = 1e-4;

/// Scales of the built-in features.
const SCALES: usize = 3;

/// λ1 · reconstruction + λ2 · rendering of the network's output `[1, 3·lamps, h, w]`, and both losses
/// by themselves, `[2]`, the first of them 0 where there are no OLATs to compare with.
pub fn losses(output: Tensor<4>, with: &Comparison) -> (Tensor<1>, Tensor<1>) {
    if kernels::serve(&output) {
        return kernels::losses(output, with);
    }
    composed(output, with)
}

/// The same in burn's operations, for devices that our kernels do not serve.
fn composed(output: Tensor<4>, with: &Comparison) -> (Tensor<1>, Tensor<1>) {
    let olats = olats(output, &with.light);
    let settings = with.settings;
    let relit = encode(relight(olats.clone(), with.weights));
    let rendering = feature_distance(relit, with.look.clone(), with.mask);
    let mut total = rendering.clone() * settings.rendering;
    let mut reconstruction = rendering.zeros_like();
    if let Some(truth) = with.olats {
        let truth = augment::shift(truth.clone(), settings.shift[0], settings.shift[1]);
        reconstruction = feature_distance(encode(olats * settings.gain), truth, with.mask);
        total = total + reconstruction.clone() * settings.reconstruction;
    }
    (
        total,
        Tensor::cat(vec![reconstruction, rendering], 0).detach(),
    )
}

/// Mean feature distance between encoded pictures `[n, 3, h, w]`, in units of encoded values (see
/// [`encode`](crate::reflectance::render::encode)).
/// `mask` is `[1, 1, h, w]`; where it is 0 nothing counts. Each picture's features are compared by a
/// norm that is not squared (the paper's), divided by the root of the subject's number of values, so
/// that the loss does not depend on the picture's size.
fn feature_distance(predicted: Tensor<4>, truth: Tensor<4>, mask: &Tensor<4>) -> Tensor<1> {
    let mut difference = (predicted - truth) * mask.clone();
    let mut values = mask.clone().sum().clamp_min(1.0) * 3.0;
    let mut sum: Option<Tensor<1>> = None;
    for scale in 0..SCALES {
        let [_, _, h, w] = difference.dims();
        let mut terms = norms(square_sum(difference.clone()), &values);
        if w > 1 && h > 1 {
            let across =
                difference.clone().narrow(3, 1, w - 1) - difference.clone().narrow(3, 0, w - 1);
            let down =
                difference.clone().narrow(2, 1, h - 1) - difference.clone().narrow(2, 0, h - 1);
            terms = terms + norms(square_sum(across) + square_sum(down), &values);
        }
        sum = Some(match sum {
            Some(sum) => sum + terms,
            None => terms,
        });
        if scale + 1 == SCALES || w < 2 || h < 2 {
            break;
        }
        difference = avg_pool2d(difference, AvgPoolOptions::new([2, 2]));
        values = values * 0.25;
    }
    sum.expect("there is at least one scale") / (SCALES as f32)
}

/// Σ x² of each picture: `[n, 3, h, w]` → `[n]`.
fn square_sum(x: Tensor<4>) -> Tensor<1> {
    let [n, c, h, w] = x.dims();
    (x.clone() * x)
        .reshape([n, c * h * w])
        .sum_dim(1)
        .reshape([n])
}

/// Mean over pictures of √(Σ x² / values + ε²).
fn norms(square_sums: Tensor<1>, values: &Tensor<1>) -> Tensor<1> {
    (square_sums / values.clone() + EPSILON * EPSILON)
        .sqrt()
        .mean()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::render::encode;
    use burn::tensor::{Device, Distribution};

    /// Fused and composed losses of one output, with the gradients by it.
    fn both_ways(lamps: usize, [h, w]: [usize; 2], shift: [i64; 2], with_olats: bool) {
        let device = Device::flex().autodiff();
        let random = |shape: [usize; 4]| {
            Tensor::<4>::random(shape, Distribution::Uniform(0.0, 1.0), &device)
        };
        let olats = random([lamps, 3, h, w]);
        let mask = augment::shift(random([1, 1, h, w]).round(), shift[0], shift[1]);
        let (look, weights) = (random([1, 3, h, w]), random([lamps, 3, 1, 1]));
        let comparison = Comparison {
            light: random([1, 3, h, w]) * 3.0,
            mask: &mask,
            olats: with_olats.then_some(&olats),
            look: &look,
            weights: &weights,
            settings: kernels::LossSettings {
                gain: 0.7,
                shift,
                reconstruction: 1.5,
                rendering: 0.5,
            },
        };
        let output = random([1, 3 * lamps, h, w]).require_grad();
        let values = |losses: (Tensor<1>, Tensor<1>)| {
            let gradient = output.grad(&losses.0.backward()).unwrap();
            let parts = Tensor::cat(vec![losses.0.inner(), losses.1.inner()], 0);
            [parts.into_data(), gradient.into_data()].map(|d| d.try_into_vec::<f32>().unwrap())
        };
        let fused = values(kernels::losses(output.clone(), &comparison));
        let composed = values(composed(output.clone(), &comparison));
        for (fused, composed) in fused.iter().zip(&composed) {
            let largest = composed.iter().fold(0.0f32, |m, v| m.max(v.abs()));
            for (a, b) in fused.iter().zip(composed) {
                assert!((a - b).abs() <= 2e-5 * largest, "{a} is not {b}");
            }
        }
    }

    #[test]
    fn the_fused_losses_are_the_composed_ones() {
        both_ways(1, [1, 1], [0, 0], true);
        both_ways(3, [3, 5], [1, -1], true);
        both_ways(5, [64, 64], [-3, 2], true);
        both_ways(2, [31, 47], [0, 5], false);
        both_ways(4, [8, 8], [9, 0], true);
    }

    fn distance(predicted: f32, truth: f32) -> (f32, Vec<f32>) {
        let device = Device::flex().autodiff();
        let predicted = Tensor::full([2, 3, 8, 8], predicted, &device).require_grad();
        let mask = Tensor::ones([1, 1, 8, 8], &device);
        let truth = Tensor::full([2, 3, 8, 8], truth, &device);
        let loss = feature_distance(encode(predicted.clone()), encode(truth), &mask);
        let gradients = loss.backward();
        let gradient = predicted
            .grad(&gradients)
            .unwrap()
            .into_data()
            .try_to_vec()
            .unwrap();
        (loss.into_scalar(), gradient)
    }

    #[test]
    fn zero_error_black_and_saturated_pictures_have_finite_gradients() {
        for (predicted, truth) in [
            (0.0, 0.0),
            (0.3, 0.3),
            (0.0, 1.0),
            (1.0, 0.0),
            (1e4, 1e4),
            (1e4, 0.0),
            (-0.1, 0.0),
        ] {
            let (loss, gradient) = distance(predicted, truth);
            assert!(loss.is_finite(), "{predicted} against {truth}");
            assert!(
                gradient.iter().all(|g| g.is_finite()),
                "{predicted} against {truth}"
            );
        }
        let (loss, gradient) = distance(0.3, 0.3);
        assert!(loss < 3.0 * EPSILON && gradient.iter().all(|g| *g == 0.0));
    }

    #[test]
    fn what_lies_outside_the_mask_does_not_count() {
        let device = Device::flex();
        let truth = Tensor::<4>::random([1, 3, 8, 8], Distribution::Uniform(0.0, 1.0), &device);
        let mut mask = vec![0.0f32; 64];
        mask[..32].fill(1.0);
        let mask = Tensor::<1>::from_floats(mask.as_slice(), &device).reshape([1, 1, 8, 8]);
        let outside = truth.clone() + (mask.clone().neg() + 1.0) * 5.0;
        let inside = truth.clone() + mask.clone() * 0.1;
        let at_zero = feature_distance(truth.clone(), truth.clone(), &mask).into_scalar::<f32>();
        assert_eq!(
            feature_distance(outside, truth.clone(), &mask).into_scalar::<f32>(),
            at_zero
        );
        assert!(feature_distance(inside, truth, &mask).into_scalar::<f32>() > 10.0 * at_zero);
    }

    #[test]
    fn an_empty_mask_and_a_single_pixel_are_finite() {
        let device = Device::flex();
        let one = Tensor::<4>::ones([1, 3, 1, 1], &device);
        for coverage in [0.0, 1.0] {
            let mask = Tensor::full([1, 1, 1, 1], coverage, &device);
            let loss = feature_distance(one.clone() * 0.5, one.clone(), &mask).into_scalar::<f32>();
            assert!(loss.is_finite());
        }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let device = Device::flex().autodiff();
        let truth = Tensor::<4>::random([1, 3, 4, 4], Distribution::Uniform(0.0, 1.0), &device);
        let start = Tensor::<4>::random([1, 3, 4, 4], Distribution::Uniform(0.1, 1.0), &device);
        let mask = Tensor::ones([1, 1, 4, 4], &device);
        let loss = |x: Tensor<4>| feature_distance(encode(x), encode(truth.clone()), &mask);
        let value = |x: Tensor<4>| loss(x).into_scalar::<f32>();
        let x = start.clone().require_grad();
        let gradients = loss(x.clone()).backward();
        let gradient: Vec<f32> = x
            .grad(&gradients)
            .unwrap()
            .into_data()
            .try_to_vec()
            .unwrap();
        // Along the gradient itself the difference is largest against rounding of f32.
        let direction = x.grad(&gradients).unwrap();
        let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        let h = 2e-2 / norm;
        let step = Tensor::from_inner(direction) * h;
        let slope = (value(start.clone() + step.clone()) - value(start - step)) / (2.0 * h);
        assert!(
            (slope / (norm * norm) - 1.0).abs() < 0.02,
            "{slope} against {}",
            norm * norm
        );
    }
}
