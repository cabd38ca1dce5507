//! The two losses. Both compare pictures in feature space by ‖·‖₂, with the background masked out.
//!
//! The built-in features need no file: the encoded picture and its horizontal and vertical
//! differences, at three scales. Differences carry edges and shading, the coarse scales the overall
//! light; all are linear, so their gradients are cheap. With a file the features of its network are compared.

use super::augment;
use super::features::{EPSILON, Features, PictureId, PictureKind, rows};
use super::schedule::SampleSource;
use burn::tensor::Tensor;
use burn::tensor::module::avg_pool2d;
use burn::tensor::ops::AvgPoolOptions;
use reflectance::kernels::{self, LossInputs, LossSettings};
use reflectance::render::{encode, olats, relight};

/// Scales of the built-in features.
const SCALES: usize = 3;

/// Comparison of pictures.
pub struct Criterion {
    /// None means the built-in features.
    pub features: Option<Features>,
    /// Weight of the difference between features, in both losses.
    pub perceptual: f32,
    /// Weight of the mean absolute difference between encoded pixels, in both losses.
    pub pixel: f32,
}

impl Default for Criterion {
    /// Only the built-in features.
    fn default() -> Self {
        Self { features: None, perceptual: 1.0, pixel: 0.0 }
    }
}

impl Criterion {
    /// True if [`Self::losses`] also takes the network's output before its sigmoid (`logits` of the settings), on a
    /// CPU: the gradient then takes its place, in half the memory.
    pub fn takes_logits(&self) -> bool {
        self.features.is_none() && self.pixel <= 0.0
    }

    /// λ1 · reconstruction + λ2 · rendering of the network's output `[1, 3·lamps, h, w]`, and both separate losses,
    /// `[2]`; the first is 0 without OLATs to compare. The difference between pixels, if
    /// weighted, is in the sum only.
    ///
    /// The reconstruction loss covers the OLATs of `lamps`; None means all. `source` is given for samples
    /// without shift, whose pictures are the same each time.
    pub fn losses(
        &mut self,
        output: Tensor<4>,
        with: &LossInputs,
        lamps: Option<&[usize]>,
        source: Option<SampleSource>,
    ) -> (Tensor<1>, Tensor<1>) {
        let weights = with.settings;
        let with = &LossInputs {
            light: with.light.clone(),
            settings: LossSettings {
                reconstruction: weights.reconstruction * self.perceptual,
                rendering: weights.rendering * self.perceptual,
                ..weights
            },
            ..*with
        };
        let (mut total, parts) = match &mut self.features {
            Some(features) => composed(output.clone(), with, lamps, |predicted, truth, pictures| {
                let name = |&picture| source.map(|source| PictureId { source, picture });
                let names: Option<Vec<PictureId>> = pictures.iter().map(name).collect();
                features.distance(predicted, truth, with.mask, names.as_deref())
            }),
            None if kernels::serve(&output) && self.pixel <= 0.0 => {
                return fused(output, with, lamps);
            }
            None if kernels::serve(&output) => fused(output.clone(), with, lamps),
            None => composed(output.clone(), with, lamps, |predicted, truth, _| {
                feature_distance(predicted, truth, with.mask)
            }),
        };
        if self.pixel > 0.0 {
            let olats = olats(output, &with.light);
            if weights.rendering > 0.0 {
                let relit = encode(relight(olats.clone(), with.weights));
                let pixels = pixel_distance(relit, with.plate.clone(), with.mask);
                total = total + pixels * (weights.rendering * self.pixel);
            }
            if let Some(truth) = with.olats {
                let (predicted, truth) = compared_olats(olats, truth, with, lamps);
                let pixels = pixel_distance(predicted, truth, with.mask);
                total = total + pixels * (weights.reconstruction * self.pixel);
            }
        }
        (total, parts)
    }
}

/// `[1, 3·lamps, h, w]` → `[lamps, 3, h, w]`.
fn per_lamp(output: Tensor<4>) -> Tensor<4> {
    let [_, channels, h, w] = output.dims();
    output.reshape([channels / 3, 3, h, w])
}

/// Losses with the built-in features, by our kernels.
fn fused(output: Tensor<4>, with: &LossInputs, lamps: Option<&[usize]>) -> (Tensor<1>, Tensor<1>) {
    let (Some(lamps), Some(truth)) = (lamps, with.olats) else { return kernels::losses(output, with) };
    let [_, _, h, w] = output.dims();
    let sampled = rows(per_lamp(output.clone()), lamps).reshape([1, 3 * lamps.len(), h, w]);
    let of_sampled = LossInputs {
        light: with.light.clone(),
        olats: Some(&rows(truth.clone(), lamps)),
        weights: &rows(with.weights.clone(), lamps),
        settings: LossSettings { rendering: 0.0, ..with.settings },
        ..*with
    };
    let of_all = LossInputs { light: with.light.clone(), olats: None, ..*with };
    let (reconstruction, sampled) = kernels::losses(sampled, &of_sampled);
    let (rendering, all) = kernels::losses(output, &of_all);
    (reconstruction + rendering, Tensor::cat(vec![sampled.narrow(0, 0, 1), all.narrow(0, 1, 1)], 0))
}

/// Losses in burn's operations, with `distance` between encoded pictures of the given kinds.
fn composed(
    output: Tensor<4>,
    with: &LossInputs,
    lamps: Option<&[usize]>,
    mut distance: impl FnMut(Tensor<4>, Tensor<4>, &[PictureKind]) -> Tensor<1>,
) -> (Tensor<1>, Tensor<1>) {
    let olats = olats(output, &with.light);
    let relit = encode(relight(olats.clone(), with.weights));
    let rendering = distance(relit, with.plate.clone(), &[PictureKind::Plate]);
    let mut total = rendering.clone() * with.settings.rendering;
    let mut reconstruction = rendering.zeros_like();
    if let Some(truth) = with.olats {
        let pictures: Vec<PictureKind> = match lamps {
            Some(lamps) => lamps.iter().copied().map(PictureKind::Olat).collect(),
            None => (0..truth.dims()[0]).map(PictureKind::Olat).collect(),
        };
        let (predicted, truth) = compared_olats(olats, truth, with, lamps);
        reconstruction = distance(predicted, truth, &pictures);
        total = total + reconstruction.clone() * with.settings.reconstruction;
    }
    (total, Tensor::cat(vec![reconstruction, rendering], 0).detach())
}

/// Predicted and true OLATs for comparison, encoded, of `lamps` or of all.
fn compared_olats(
    predicted: Tensor<4>,
    truth: &Tensor<4>,
    with: &LossInputs,
    lamps: Option<&[usize]>,
) -> (Tensor<4>, Tensor<4>) {
    let settings = with.settings;
    let [predicted, truth] = [predicted, truth.clone()].map(|olats| match lamps {
        Some(lamps) => rows(olats, lamps),
        None => olats,
    });
    let truth = augment::shift(truth, settings.shift[0], settings.shift[1]);
    (encode(predicted * settings.gain), truth)
}

/// Mean absolute difference of encoded pictures `[n, 3, h, w]` inside the mask.
fn pixel_distance(predicted: Tensor<4>, truth: Tensor<4>, mask: &Tensor<4>) -> Tensor<1> {
    let values = mask.clone().sum().clamp_min(1.0) * (3 * predicted.dims()[0]) as f32;
    ((predicted - truth) * mask.clone()).abs().sum() / values
}

/// Mean feature distance between encoded pictures `[n, 3, h, w]`, in units of encoded values (see
/// [`encode`](reflectance::render::encode)).
/// `mask` is `[1, 1, h, w]`; pixels where it is 0 do not count. Each picture's features are compared by the
/// plain norm (the paper's, not squared), divided by the root of the subject's number of values, so
/// that the loss does not depend on the picture's size.
fn feature_distance(predicted: Tensor<4>, truth: Tensor<4>, mask: &Tensor<4>) -> Tensor<1> {
    let mut difference = (predicted - truth) * mask.clone();
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

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Device, Distribution, activation};
    use reflectance::render::encode;

    /// Losses without our kernels.
    fn by_operations(output: Tensor<4>, with: &LossInputs, lamps: Option<&[usize]>) -> (Tensor<1>, Tensor<1>) {
        composed(output, with, lamps, |predicted, truth, _| feature_distance(predicted, truth, with.mask))
    }

    /// Fused and composed losses of one output, with their gradients.
    fn both_ways(lamps: usize, [h, w]: [usize; 2], shift: [i64; 2], with_olats: bool, sampled: Option<&[usize]>) {
        let device = Device::flex().autodiff();
        let random = |shape: [usize; 4]| Tensor::<4>::random(shape, Distribution::Uniform(0.0, 1.0), &device);
        let olats = random([lamps, 3, h, w]);
        let mask = augment::shift(random([1, 1, h, w]).round(), shift[0], shift[1]);
        let (plate, weights) = (random([1, 3, h, w]), random([lamps, 3, 1, 1]));
        let comparison = LossInputs {
            light: random([1, 3, h, w]) * 3.0,
            mask: &mask,
            olats: with_olats.then_some(&olats),
            plate: &plate,
            weights: &weights,
            settings: kernels::LossSettings { gain: 0.7, shift, reconstruction: 1.5, rendering: 0.5, logits: false },
        };
        let output = random([1, 3 * lamps, h, w]).require_grad();
        let values = |losses: (Tensor<1>, Tensor<1>)| {
            let gradient = output.grad(&losses.0.backward()).unwrap();
            let parts = Tensor::cat(vec![losses.0.inner(), losses.1.inner()], 0);
            [parts.into_data(), gradient.into_data()].map(|d| d.try_into_vec::<f32>().unwrap())
        };
        let agree = |fused: [Vec<f32>; 2], composed: [Vec<f32>; 2]| {
            for (fused, composed) in fused.iter().zip(&composed) {
                let largest = composed.iter().fold(0.0f32, |m, v| m.max(v.abs()));
                for (a, b) in fused.iter().zip(composed) {
                    assert!((a - b).abs() <= 2e-5 * largest, "{a} is not {b}");
                }
            }
        };
        let found = values(fused(output.clone(), &comparison, sampled));
        agree(found, values(by_operations(output.clone(), &comparison, sampled)));
        let settings = kernels::LossSettings { logits: true, ..comparison.settings };
        let logits = LossInputs { light: comparison.light.clone(), settings, ..comparison };
        let found = values(fused(output.clone(), &logits, sampled));
        let sigmoid = activation::sigmoid(output.clone());
        agree(found, values(by_operations(sigmoid, &logits, sampled)));
    }

    #[test]
    fn the_fused_losses_are_the_composed_ones() {
        both_ways(1, [1, 1], [0, 0], true, None);
        both_ways(3, [3, 5], [1, -1], true, None);
        both_ways(5, [64, 64], [-3, 2], true, None);
        both_ways(2, [31, 47], [0, 5], false, None);
        both_ways(4, [8, 8], [9, 0], true, None);
        both_ways(5, [16, 8], [-3, 2], true, Some(&[1, 4]));
        both_ways(2, [16, 8], [0, 0], false, Some(&[1]));
    }

    /// Losses and the gradient of their sum, for the given lamps.
    fn losses_of(criterion: &mut Criterion, lamps: Option<&[usize]>, seed: u64) -> [Vec<f32>; 2] {
        let device = Device::flex().autodiff();
        let noise = |shape: [usize; 4], from: u64| {
            let count: usize = shape.iter().product();
            let value = |i: usize| ((i as u64 * 7919 + from * 104_729) % 1009) as f32 / 1009.0;
            let values: Vec<f32> = (0..count).map(value).collect();
            Tensor::<1>::from_floats(values.as_slice(), &device).reshape(shape)
        };
        let comparison = LossInputs {
            light: noise([1, 3, 16, 16], seed + 1),
            mask: &noise([1, 1, 16, 16], seed + 2).round(),
            olats: Some(&noise([6, 3, 16, 16], seed + 3)),
            plate: &noise([1, 3, 16, 16], seed + 4),
            weights: &noise([6, 3, 1, 1], seed + 5),
            settings: kernels::LossSettings {
                gain: 0.7,
                shift: [1, 2],
                reconstruction: 1.5,
                rendering: 0.5,
                logits: false,
            },
        };
        let output = noise([1, 18, 16, 16], seed).require_grad();
        let (total, parts) = criterion.losses(output.clone(), &comparison, lamps, None);
        let gradient = output.grad(&total.backward()).unwrap();
        let parts = Tensor::cat(vec![total.inner(), parts.inner()], 0);
        [parts.into_data(), gradient.into_data()].map(|d| d.try_into_vec().unwrap())
    }

    #[test]
    fn sampled_lamps_have_the_loss_and_the_gradient_of_all_on_average() {
        let mut criterion = Criterion { features: None, pixel: 0.3, perceptual: 1.0 };
        let all = losses_of(&mut criterion, None, 1);
        let mut means = all.each_ref().map(|part| vec![0.0; part.len()]);
        let mut samples = 0;
        // The mean over all pairs equals the mean of many draws.
        for first in 0..6 {
            for second in first + 1..6 {
                let sampled = losses_of(&mut criterion, Some(&[first, second]), 1);
                assert_eq!(sampled[0][2], all[0][2], "the rendering loss is that of all lamps");
                for (mean, sampled) in means.iter_mut().zip(sampled) {
                    for (mean, value) in mean.iter_mut().zip(sampled) {
                        *mean += value;
                    }
                }
                samples += 1;
            }
        }
        for (mean, all) in means.iter().zip(&all) {
            let largest = all.iter().fold(0.0f32, |m, v| m.max(v.abs()));
            for (mean, all) in mean.iter().zip(all) {
                assert!((mean / samples as f32 - all).abs() <= 1e-5 * largest);
            }
        }
    }

    #[test]
    fn pixels_and_features_count_by_their_weights() {
        let losses = |pixel| {
            let mut criterion = Criterion { pixel, ..Criterion::default() };
            losses_of(&mut criterion, None, 2)[0][0]
        };
        let [none, half, whole] = [0.0, 0.5, 1.0].map(losses);
        assert!(half > none && ((whole - none) / (half - none) - 2.0).abs() < 1e-3);
        let mut alone = Criterion { perceptual: 0.0, pixel: 1.0, ..Criterion::default() };
        let pixels = losses_of(&mut alone, None, 2)[0][0];
        assert!((pixels / (whole - none) - 1.0).abs() < 1e-3);
    }

    fn distance(predicted: f32, truth: f32) -> (f32, Vec<f32>) {
        let device = Device::flex().autodiff();
        let predicted = Tensor::full([2, 3, 8, 8], predicted, &device).require_grad();
        let mask = Tensor::ones([1, 1, 8, 8], &device);
        let truth = Tensor::full([2, 3, 8, 8], truth, &device);
        let loss = feature_distance(encode(predicted.clone()), encode(truth), &mask);
        let gradients = loss.backward();
        let gradient = predicted.grad(&gradients).unwrap().into_data().try_to_vec().unwrap();
        (loss.into_scalar(), gradient)
    }

    #[test]
    fn zero_error_black_and_saturated_pictures_have_finite_gradients() {
        for (predicted, truth) in [(0.0, 0.0), (0.3, 0.3), (0.0, 1.0), (1.0, 0.0), (1e4, 1e4), (1e4, 0.0), (-0.1, 0.0)]
        {
            let (loss, gradient) = distance(predicted, truth);
            assert!(loss.is_finite(), "{predicted} against {truth}");
            assert!(gradient.iter().all(|g| g.is_finite()), "{predicted} against {truth}");
        }
        let (loss, gradient) = distance(0.3, 0.3);
        assert!(loss < 3.0 * EPSILON && gradient.iter().all(|g| *g == 0.0));
        test_support::shown!(Network, "‖·‖₂ at zero error, black, saturated, 10⁴ and below 0",
 bound: "finite; exactly 0 at zero error", measured: "holds");
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
        assert_eq!(feature_distance(outside, truth.clone(), &mask).into_scalar::<f32>(), at_zero);
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
        test_support::shown!(Network, "A loss inside an empty matte and of one pixel", bound: "finite", measured: "holds");
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
        let gradient: Vec<f32> = x.grad(&gradients).unwrap().into_data().try_to_vec().unwrap();
        // Along the gradient the difference is largest relative to the rounding of f32.
        let direction = x.grad(&gradients).unwrap();
        let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
        let h = 2e-2 / norm;
        let step = Tensor::from_inner(direction) * h;
        let slope = (value(start.clone() + step.clone()) - value(start - step)) / (2.0 * h);
        assert!((slope / (norm * norm) - 1.0).abs() < 0.02, "{slope} against {}", norm * norm);
    }
}
