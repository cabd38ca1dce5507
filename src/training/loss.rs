//! The two losses. Both compare pictures in feature space by ‖·‖₂, with the background masked out.
//!
//! The built-in features need no file: the encoded picture and its horizontal and vertical
//! differences, at three scales. Differences carry edges and shading, the coarse scales the overall
//! light; all are linear, so their gradients are cheap.

use crate::reflectance::render::encode;
use burn::tensor::Tensor;
use burn::tensor::module::avg_pool2d;
use burn::tensor::ops::AvgPoolOptions;

/// Added under the root: ‖x‖ becomes √(‖x‖² + ε²), whose gradient at zero error is 0 and not 0/0.
/// In units of encoded values: far below one 8-bit step.
pub const EPSILON: f32 = 1e-4;

/// Scales of the built-in features.
const SCALES: usize = 3;

/// Mean feature distance between `[n, 3, h, w]` pictures of linear light, in units of encoded values.
/// `mask` is `[1, 1, h, w]`; where it is 0 nothing counts. Each picture's features are compared by a
/// norm that is not squared (the paper's), divided by the root of the subject's number of values, so
/// that the loss does not depend on the picture's size.
pub fn feature_distance(predicted: Tensor<4>, truth: Tensor<4>, mask: &Tensor<4>) -> Tensor<1> {
    let mut difference = (encode(predicted) - encode(truth)) * mask.clone();
    let mut values = mask.clone().sum().clamp_min(1.0) * 3.0;
    let mut sum: Option<Tensor<1>> = None;
    for scale in 0..SCALES {
        let [_, _, h, w] = difference.dims();
        let mut terms = norms(square_sum(difference.clone()), &values);
        if w > 1 && h > 1 {
            let across = difference.clone().narrow(3, 1, w - 1) - difference.clone().narrow(3, 0, w - 1);
            let down = difference.clone().narrow(2, 1, h - 1) - difference.clone().narrow(2, 0, h - 1);
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
    (x.clone() * x).reshape([n, c * h * w]).sum_dim(1).reshape([n])
}

/// Mean over pictures of √(Σ x² / values + ε²).
fn norms(square_sums: Tensor<1>, values: &Tensor<1>) -> Tensor<1> {
    (square_sums / values.clone() + EPSILON * EPSILON).sqrt().mean()
}
