//! Training distance between encoded pictures, and its gradient.

use crate::kernels::chunks::{each_index, vectorized};
use crate::kernels::sums::{BLOCK, Lanes, sum_of};

/// Added under the root: ‖x‖ becomes √(‖x‖² + ε²), whose gradient at zero error is 0 instead of 0/0.
/// In units of encoded values: far below one 8-bit step.
pub const EPSILON: f64 = 1e-4;

const SCALES: usize = 3;

/// Colours of a picture.
const COLOURS: usize = 3;

/// Share in a loss of the distance between encoded pictures `[3, h, w]`, where `mask`, `[h, w]`, is not 0.
///
/// The features of a picture are its values and their horizontal and vertical differences at three
/// scales, each scale the means of 2×2 pixels of the one before it (a last odd row or column is left
/// out). With d the masked difference of the two pictures, v = 3·max(Σ mask, 1)/4ˢ and n pictures:
///
/// loss = mean over pictures of ⅓·Σₛ √(Σ d²/v + ε²) + √((Σ across² + Σ down²)/v + ε²)
///
/// Scales of a single row or column have no differences, and no scale after them.
#[derive(Clone, Copy)]
pub struct FeatureDistance<'a> {
    mask: &'a [f32],
    size: [usize; 2],
    norms: Norms,
}

impl<'a> FeatureDistance<'a> {
    /// Settings for one of `pictures`.
    pub fn new(mask: &'a [f32], size: [usize; 2], pictures: usize) -> Self {
        assert_eq!(mask.len(), size[0] * size[1]);
        let norms = Norms { values: COLOURS as f64 * covered(mask).max(1.0), share: 1.0 / (SCALES * pictures) as f64 };
        Self { mask, size, norms }
    }

    /// Contribution of one picture to the loss. `x` is the prediction; the gradient by it takes its place.
    pub fn replace_by_gradient(&self, x: &mut [f32], truth: &[f32]) -> f64 {
        subtract(truth, self.mask, x);
        let distance = distance(x, self.size, self.norms, SCALES);
        multiply(x, self.mask);
        distance
    }
}

/// Part of the loss from the difference `x`, `[3, h, w]`, and the `scales` from there
/// on. The gradient takes the place of `x`.
fn distance(x: &mut [f32], [h, w]: [usize; 2], norms: Norms, scales: usize) -> f64 {
    let sums = SquareSums::new(x, [h, w]);
    let (mut distance, per_value) = norms.part(sums.values);
    if h < 2 || w < 2 {
        into_gradient(x, [h, w], [per_value, 0.0], &[]);
        return distance;
    }
    let (of_differences, per_difference) = norms.part(sums.differences);
    distance += of_differences;
    let mut coarser = Vec::new();
    if scales > 1 {
        coarser = halved(x, [h, w]);
        let norms = Norms { values: norms.values / 4.0, ..norms };
        distance += self::distance(&mut coarser, [h / 2, w / 2], norms, scales - 1);
    }
    into_gradient(x, [h, w], [per_value, per_difference], &coarser);
    distance
}

/// Factors that turn sums of squares into parts of the loss.
#[derive(Clone, Copy)]
struct Norms {
    /// v
    values: f64,
    /// Weight in the loss of one norm of one picture.
    share: f64,
}

impl Norms {
    /// Part of the loss for a Σ x², and the factor f that makes f·x its gradient.
    fn part(self, square_sum: f64) -> (f64, f32) {
        let norm = (square_sum / self.values + EPSILON * EPSILON).sqrt();
        (self.share * norm, (self.share / (norm * self.values)) as f32)
    }
}

/// Σ mask.
fn covered(mask: &[f32]) -> f64 {
    let blocks = each_index(
        mask.len().div_ceil(BLOCK),
        BLOCK,
        #[inline(always)]
        |index| sum_of(&mask[index * BLOCK..mask.len().min((index + 1) * BLOCK)], |x| x),
    );
    blocks.iter().sum()
}

/// x ← (x − truth)·mask for each colour.
fn subtract(truth: &[f32], mask: &[f32], x: &mut [f32]) {
    assert_eq!(x.len(), truth.len());
    vectorized(
        #[inline(always)]
        || {
            let planes = x.chunks_exact_mut(mask.len()).zip(truth.chunks_exact(mask.len()));
            for (x, truth) in planes {
                for ((x, truth), mask) in x.iter_mut().zip(truth).zip(mask) {
                    *x = (*x - truth) * mask;
                }
            }
        },
    );
}

fn multiply(x: &mut [f32], mask: &[f32]) {
    vectorized(
        #[inline(always)]
        || {
            for plane in x.chunks_exact_mut(mask.len()) {
                for (x, mask) in plane.iter_mut().zip(mask) {
                    *x *= mask;
                }
            }
        },
    );
}

/// Σ x² and Σ across² + Σ down² of a picture.
#[derive(Default)]
struct SquareSums {
    values: f64,
    differences: f64,
}

impl SquareSums {
    /// Of `x`, `[3, h, w]`.
    fn new(x: &[f32], [h, w]: [usize; 2]) -> Self {
        let mut sums = Self::default();
        let rows_in_band = (BLOCK / w).max(1);
        vectorized(
            #[inline(always)]
            || {
                for plane in x.chunks_exact(h * w) {
                    for first in (0..h).step_by(rows_in_band) {
                        sums.add_band(plane, w, first..h.min(first + rows_in_band));
                    }
                }
            },
        );
        sums
    }

    #[inline(always)]
    fn add_band(&mut self, plane: &[f32], w: usize, rows: std::ops::Range<usize>) {
        let (mut values, mut differences) = (Lanes::ZERO, Lanes::ZERO);
        for y in rows {
            let row = &plane[y * w..][..w];
            values.add(row, row, |x, _| x * x);
            differences.add(&row[1..], &row[..w - 1], |a, b| (a - b) * (a - b));
            if let Some(below) = plane.get((y + 1) * w..(y + 2) * w) {
                differences.add(row, below, |a, b| (a - b) * (a - b));
            }
        }
        self.values += values.total();
        self.differences += differences.total();
    }
}

/// The means of 2×2 pixels: `[3, h, w]` → `[3, ⌊h/2⌋, ⌊w/2⌋]`.
fn halved(x: &[f32], [h, w]: [usize; 2]) -> Vec<f32> {
    let mut means = vec![0.0; COLOURS * (h / 2) * (w / 2)];
    vectorized(
        #[inline(always)]
        || {
            for (row, means) in means.chunks_exact_mut(w / 2).enumerate() {
                let first = row / (h / 2) * h + 2 * (row % (h / 2));
                let (upper, _) = x[first * w..][..w].as_chunks::<2>();
                let (lower, _) = x[(first + 1) * w..][..w].as_chunks::<2>();
                for ((mean, [a, b]), [c, d]) in means.iter_mut().zip(upper).zip(lower) {
                    *mean = 0.25 * ((a + b) + (c + d));
                }
            }
        },
    );
    means
}

/// Puts the gradient in the place of `x`, `[3, h, w]`: `per_value`·x, `per_difference` times the
/// differences of x from its neighbours, and a quarter of the `coarser` gradient,
/// `[3, ⌊h/2⌋, ⌊w/2⌋]` or empty.
fn into_gradient(x: &mut [f32], [h, w]: [usize; 2], [per_value, per_difference]: [f32; 2], coarser: &[f32]) {
    // Rows that were overwritten or are about to be, with their outermost columns repeated: a
    // pixel does not differ from itself.
    let [mut above, mut here] = [vec![0.0; w + 2], vec![0.0; w + 2]];
    vectorized(
        #[inline(always)]
        || {
            for (plane_index, plane) in x.chunks_exact_mut(h * w).enumerate() {
                for y in 0..h {
                    let (row, below) = plane[y * w..].split_at_mut(w);
                    std::mem::swap(&mut above, &mut here);
                    here[1..=w].copy_from_slice(row);
                    (here[0], here[w + 1]) = (row[0], row[w - 1]);
                    let centre = &here[1..=w];
                    let above = if y == 0 { centre } else { &above[1..=w] };
                    let below = if y + 1 == h { centre } else { &below[..w] };
                    let across = here[..w].iter().zip(&here[2..]);
                    let down = above.iter().zip(below);
                    for (((g, x), (left, right)), (up, down)) in row.iter_mut().zip(centre).zip(across).zip(down) {
                        let differences = ((x - left) + (x - right)) + ((x - up) + (x - down));
                        *g = per_value * x + per_difference * differences;
                    }
                    if !coarser.is_empty() && y / 2 < h / 2 {
                        let coarser = &coarser[(plane_index * (h / 2) + y / 2) * (w / 2)..];
                        let (pairs, _) = row.as_chunks_mut::<2>();
                        for (pair, g) in pairs.iter_mut().zip(coarser) {
                            pair[0] += 0.25 * g;
                            pair[1] += 0.25 * g;
                        }
                    }
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{assert_independent_of_threads, noise};
    use proptest::prelude::*;

    /// Loss and gradient.
    fn distance_of(predicted: &[f32], truth: &[f32], mask: &[f32], size: [usize; 2]) -> (f64, Vec<f32>) {
        let mut gradient = predicted.to_vec();
        let pictures = predicted.len() / (3 * mask.len());
        let distance = FeatureDistance::new(mask, size, pictures);
        let pairs = gradient.chunks_exact_mut(3 * mask.len()).zip(truth.chunks_exact(3 * mask.len()));
        let loss = pairs.map(|(x, truth)| distance.replace_by_gradient(x, truth)).sum();
        (loss, gradient)
    }

    /// The loss by its definition, in f64.
    fn reference(predicted: &[f64], truth: &[f32], mask: &[f32], [h, w]: [usize; 2]) -> f64 {
        let covered: f64 = mask.iter().copied().map(f64::from).sum();
        let pictures = predicted.len() / (3 * h * w);
        let mut loss = 0.0;
        for picture in 0..pictures {
            let mut x: Vec<f64> = (0..3 * h * w)
                .map(|i| {
                    let at = picture * 3 * h * w + i;
                    (predicted[at] - f64::from(truth[at])) * f64::from(mask[i % (h * w)])
                })
                .collect();
            let ([mut h, mut w], mut values) = ([h, w], 3.0 * covered.max(1.0));
            for _ in 0..3 {
                let at = |c: usize, y: usize, i: usize| x[(c * h + y) * w + i];
                let norm = |sum: f64| (sum / values + 1e-8).sqrt();
                loss += norm(x.iter().map(|x| x * x).sum());
                if h < 2 || w < 2 {
                    break;
                }
                let (mut differences, mut means) = (0.0, Vec::new());
                for c in 0..3 {
                    for y in 0..h {
                        for i in 0..w {
                            if i > 0 {
                                differences += (at(c, y, i) - at(c, y, i - 1)).powi(2);
                            }
                            if y > 0 {
                                differences += (at(c, y, i) - at(c, y - 1, i)).powi(2);
                            }
                        }
                    }
                    for y in 0..h / 2 {
                        for i in 0..w / 2 {
                            let corners = [(0, 0), (0, 1), (1, 0), (1, 1)];
                            let sum: f64 = corners.iter().map(|(a, b)| at(c, 2 * y + a, 2 * i + b)).sum();
                            means.push(sum / 4.0);
                        }
                    }
                }
                loss += norm(differences);
                (x, h, w, values) = (means, h / 2, w / 2, values / 4.0);
            }
        }
        loss / 3.0 / pictures as f64
    }

    fn wide(values: &[f32]) -> Vec<f64> {
        values.iter().copied().map(f64::from).collect()
    }

    /// Soft values with whole rows of 0 and 1.
    fn soft_mask([h, w]: [usize; 2]) -> Vec<f32> {
        let noise = noise(h * w, 7);
        let soft = noise.iter().map(|x| (1.5 * x + 0.5).clamp(0.0, 1.0));
        soft.enumerate().map(|(i, x)| if i / w == 1 { 0.0 } else { x }).collect()
    }

    #[test]
    fn it_is_the_definition_in_every_size() {
        let sizes = [[1, 1], [1, 9], [2, 2], [3, 5], [7, 4], [33, 65], [127, 127], [128, 128]];
        for [h, w] in sizes {
            for pictures in 1..=4 {
                let (predicted, truth) = (noise(pictures * 3 * h * w, 1), noise(pictures * 3 * h * w, 2));
                let mask = soft_mask([h, w]);
                let (loss, _) = distance_of(&predicted, &truth, &mask, [h, w]);
                let expected = reference(&wide(&predicted), &truth, &mask, [h, w]);
                assert!((loss / expected - 1.0).abs() < 1e-6, "{loss} is not {expected}");
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        for [h, w] in [[1, 1], [1, 9], [5, 1], [2, 2], [3, 5], [7, 4], [9, 11]] {
            let (predicted, truth) = (noise(2 * 3 * h * w, 1), noise(2 * 3 * h * w, 2));
            let mask = soft_mask([h, w]);
            let (_, gradient) = distance_of(&predicted, &truth, &mask, [h, w]);
            for (i, gradient) in gradient.iter().enumerate() {
                let moved = |step: f64| {
                    let mut predicted = wide(&predicted);
                    predicted[i] += step;
                    reference(&predicted, &truth, &mask, [h, w])
                };
                let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                let difference = (f64::from(*gradient) - slope).abs();
                assert!(difference < 1e-6, "{gradient} is not {slope} at {i} of {h}×{w}");
            }
        }
    }

    #[test]
    fn in_a_large_picture_the_gradient_is_the_slope_along_itself() {
        let size = [127, 128];
        let count = 3 * 127 * 128;
        let (predicted, truth, mask) = (noise(count, 1), noise(count, 2), soft_mask(size));
        let (_, gradient) = distance_of(&predicted, &truth, &mask, size);
        let square: f64 = wide(&gradient).iter().map(|g| g * g).sum();
        let moved = |step: f64| {
            let predicted = predicted.iter().zip(&gradient);
            let moved: Vec<f64> = predicted.map(|(&x, &g)| f64::from(x) + step * f64::from(g)).collect();
            reference(&moved, &truth, &mask, size)
        };
        let slope = (moved(1e-2) - moved(-1e-2)) / 2e-2;
        assert!((slope / square - 1.0).abs() < 1e-5, "{slope} is not {square}");
    }

    #[test]
    fn without_an_error_there_is_no_gradient() {
        let x = noise(2 * 3 * 64, 1);
        let (loss, gradient) = distance_of(&x, &x, &[1.0; 64], [8, 8]);
        assert!((loss - 2.0 * EPSILON).abs() < 1e-12);
        assert!(gradient.iter().all(|g| *g == 0.0));
    }

    #[test]
    fn an_empty_mask_is_finite_and_nothing_pulls() {
        let (loss, gradient) = distance_of(&noise(48, 1), &noise(48, 2), &[0.0; 16], [4, 4]);
        assert!(loss.is_finite());
        assert!(gradient.iter().all(|g| *g == 0.0));
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let count = 9 * 3 * 127 * 127;
        let (predicted, truth, mask) = (noise(count, 1), noise(count, 2), soft_mask([127, 127]));
        assert_independent_of_threads(|| {
            let (loss, mut values) = distance_of(&predicted, &truth, &mask, [127, 127]);
            let bits = loss.to_bits();
            values.extend([f32::from_bits(bits as u32), f32::from_bits((bits >> 32) as u32)]);
            values
        });
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn what_lies_outside_the_mask_does_not_count(
            h in 1..12usize, w in 1..12usize, seed: u64,
        ) {
            let (mut predicted, truth) = (noise(3 * h * w, seed), noise(3 * h * w, seed ^ 1));
            let mut mask = vec![1.0; h * w];
            mask[..h * w / 2].fill(0.0);
            let before = distance_of(&predicted, &truth, &mask, [h, w]);
            for (i, x) in predicted.iter_mut().enumerate() {
                *x += 5.0 * (1.0 - mask[i % (h * w)]);
            }
            prop_assert_eq!(before, distance_of(&predicted, &truth, &mask, [h, w]));
        }

        #[test]
        fn it_grows_with_the_error(h in 1..12usize, w in 1..12usize, error in 0.1f32..10.0) {
            let truth = noise(3 * h * w, 1);
            let at = |error: f32| {
                let moved = truth.iter().zip(noise(3 * h * w, 2));
                let predicted: Vec<f32> = moved.map(|(x, d)| x + error * d).collect();
                distance_of(&predicted, &truth, &vec![1.0; h * w], [h, w]).0
            };
            let (near, far) = (at(0.5 * error), at(error));
            // Twice, except for the part of ε.
            prop_assert!(far > 1.5 * near && far < 2.001 * near);
        }
    }
}
