//! Group normalisation, fused with a scale and a shift per channel and a leaky
//! ReLU. Batch normalisation of one picture is the case of one channel per group.

use crate::kernels::chunks::{each_chunk, each_index};
use crate::kernels::sums::{BLOCK, sum_of, sum_of_pairs};

/// y = leak(γ·(x − mean)/√(variance + ε) + β), with the mean and the variance over all pixels and
/// channels of a picture's group (Wu and He, "Group Normalization").
#[derive(Clone, Copy, Debug)]
pub struct GroupNorm<'a> {
    /// Groups of a picture, a divisor of the number of channels. With as many groups as channels
    /// every channel is normalised separately.
    pub groups: usize,
    /// h·w
    pub pixels: usize,
    /// γ, one per channel.
    pub gamma: &'a [f32],
    /// β, one per channel.
    pub beta: &'a [f32],
    /// ε; PyTorch's and burn's is 1e-5.
    pub epsilon: f64,
    /// The leaky ReLU's slope for negative values: 0 is a plain ReLU, 1 is the identity.
    pub slope: f32,
}

/// Mean and variance of a group, the variance with the number of values in its denominator. In f64,
/// since a mean of 1000 rounded to f32 would be off by 1/300 of a deviation of 0.01.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    pub mean: f64,
    pub variance: f64,
}

/// A mean as the sum of two f32: x − `high` is nearly exact where x is near the mean, and `low`
/// goes into the constants that are added after it.
#[derive(Clone, Copy)]
struct Centre {
    high: f32,
    low: f64,
}

impl GroupNorm<'_> {
    /// `x` and `y` are `[n, c, h, w]`. Returns the moments of the `[n, groups]`, which
    /// [`backward`](Self::backward) needs again.
    pub fn forward(&self, x: &[f32], y: &mut [f32]) -> Vec<Moments> {
        let size = self.group_size(x.len());
        assert_eq!(x.len(), y.len());
        each_chunk(
            y,
            size,
            #[inline(always)]
            |index, y| {
                let x = &x[index * size..][..size];
                let moments = Moments::from_values(x);
                let channels = self.channels_of(index);
                each_chunk(
                    y,
                    self.pixels,
                    #[inline(always)]
                    |channel, y| {
                        let x = &x[channel * self.pixels..][..self.pixels];
                        let affine = self.affine(moments, channels.start + channel);
                        for (y, &x) in y.iter_mut().zip(x) {
                            let value = affine.apply(x);
                            *y = if value > 0.0 { value } else { self.slope * value };
                        }
                    },
                );
                moments
            },
        )
    }

    /// The gradients of `x`, γ and β from that of `y`. `dy`, `x` and `dx` are `[n, c, h, w]`,
    /// `moments` are the result of [`forward`](Self::forward), `dgamma` and `dbeta` are `[c]`.
    ///
    /// With g = dy·leak′ and x̂ the normalised x: dβ = Σ g and dγ = Σ g·x̂ over pictures and pixels,
    /// and dx = (γ·g − mean(γ·g) − x̂·mean(γ·g·x̂))/√(variance + ε), the means over the group. The
    /// leaky ReLU's slope at exactly 0 is that of negative values.
    pub fn backward(
        &self,
        dy: &[f32],
        x: &[f32],
        moments: &[Moments],
        dx: &mut [f32],
        dgamma: &mut [f32],
        dbeta: &mut [f32],
    ) {
        let size = self.group_size(x.len());
        assert_eq!((dy.len(), dx.len()), (x.len(), x.len()));
        assert_eq!(moments.len() * size, x.len());
        assert_eq!((dgamma.len(), dbeta.len()), (self.gamma.len(), self.gamma.len()));
        let sums = each_chunk(
            dx,
            size,
            #[inline(always)]
            |index, dx| {
                let moments = moments[index];
                let (x, dy) = (&x[index * size..][..size], &dy[index * size..][..size]);
                let channels = self.channels_of(index);
                let sums = each_index(
                    channels.len(),
                    self.pixels,
                    #[inline(always)]
                    |channel| {
                        let plane = channel * self.pixels..(channel + 1) * self.pixels;
                        let affine = self.affine(moments, channels.start + channel);
                        self.sums(&dy[plane.clone()], &x[plane], moments, affine)
                    },
                );
                self.input_gradient(dy, x, moments, channels, &sums, dx);
                sums
            },
        );
        let channels = self.gamma.len();
        let mut totals = vec![GradientSums::default(); channels];
        for (index, sums) in sums.into_iter().flatten().enumerate() {
            let total = &mut totals[index % channels];
            total.plain += sums.plain;
            total.normalized += sums.normalized;
        }
        for ((dgamma, dbeta), total) in dgamma.iter_mut().zip(dbeta).zip(totals) {
            *dgamma = total.normalized as f32;
            *dbeta = total.plain as f32;
        }
    }

    /// Sums over one channel of one picture.
    #[inline(always)]
    fn sums(&self, dy: &[f32], x: &[f32], moments: Moments, affine: Affine) -> GradientSums {
        let (mut plain, mut centred) = (0.0, 0.0);
        for (dy, x) in dy.chunks(BLOCK).zip(x.chunks(BLOCK)) {
            plain += sum_of_pairs(
                dy,
                x,
                #[inline(always)]
                |dy, x| self.through_leak(dy, affine.apply(x)),
            );
            centred += sum_of_pairs(
                dy,
                x,
                #[inline(always)]
                |dy, x| self.through_leak(dy, affine.apply(x)) * (x - affine.centre),
            );
        }
        let low = moments.centre().low;
        let normalized = (centred - low * plain) * moments.inverse_deviation(self.epsilon);
        GradientSums { plain, normalized }
    }

    /// dx of one group, from the sums over its channels.
    #[inline(always)]
    fn input_gradient(
        &self,
        dy: &[f32],
        x: &[f32],
        moments: Moments,
        channels: std::ops::Range<usize>,
        sums: &[GradientSums],
        dx: &mut [f32],
    ) {
        let weighted = |of: fn(&GradientSums) -> f64| {
            let gamma = self.gamma[channels.clone()].iter();
            let sum: f64 = gamma.zip(sums).map(|(&gamma, sums)| f64::from(gamma) * of(sums)).sum();
            sum / x.len() as f64
        };
        let mean_plain = weighted(|sums| sums.plain);
        let mean_normalized = weighted(|sums| sums.normalized);
        let inverse = moments.inverse_deviation(self.epsilon);
        let per_x = -inverse * inverse * mean_normalized;
        let constant = (-inverse * mean_plain - per_x * moments.centre().low) as f32;
        let per_x = per_x as f32;
        each_chunk(
            dx,
            self.pixels,
            #[inline(always)]
            |channel, dx| {
                let plane = channel * self.pixels..(channel + 1) * self.pixels;
                let affine = self.affine(moments, channels.start + channel);
                for ((dx, &dy), &x) in dx.iter_mut().zip(&dy[plane.clone()]).zip(&x[plane]) {
                    let gradient = self.through_leak(dy, affine.apply(x));
                    *dx = affine.scale * gradient + (per_x * (x - affine.centre) + constant);
                }
            },
        );
    }

    #[inline(always)]
    fn through_leak(&self, dy: f32, value: f32) -> f32 {
        if value > 0.0 { dy } else { self.slope * dy }
    }

    /// Change of a channel before the leaky ReLU.
    #[inline(always)]
    fn affine(&self, moments: Moments, channel: usize) -> Affine {
        let Centre { high, low } = moments.centre();
        let scale = f64::from(self.gamma[channel]) * moments.inverse_deviation(self.epsilon);
        Affine { centre: high, scale: scale as f32, shift: (f64::from(self.beta[channel]) - low * scale) as f32 }
    }

    /// The channels of the group with this index in `[n, groups]`.
    fn channels_of(&self, index: usize) -> std::ops::Range<usize> {
        let channels = self.gamma.len() / self.groups;
        let first = index % self.groups * channels;
        first..first + channels
    }

    /// Elements of one group of one picture.
    fn group_size(&self, len: usize) -> usize {
        let channels = self.gamma.len();
        assert_eq!(self.beta.len(), channels);
        assert_eq!(channels % self.groups, 0, "{channels} channels in {} groups", self.groups);
        let size = channels / self.groups * self.pixels;
        assert_eq!(len % (size * self.groups), 0, "{len} values are not whole pictures");
        size
    }
}

/// scale·(x − centre) + shift.
#[derive(Clone, Copy)]
struct Affine {
    centre: f32,
    scale: f32,
    shift: f32,
}

impl Affine {
    #[inline(always)]
    fn apply(self, x: f32) -> f32 {
        self.scale * (x - self.centre) + self.shift
    }
}

/// Σ g and Σ g·x̂ over one channel, g being the gradient before the leaky ReLU.
#[derive(Clone, Copy, Default)]
struct GradientSums {
    plain: f64,
    normalized: f64,
}

impl Moments {
    /// 1/√(variance + ε).
    pub fn inverse_deviation(self, epsilon: f64) -> f64 {
        1.0 / (self.variance + epsilon).sqrt()
    }

    fn centre(self) -> Centre {
        let high = self.mean as f32;
        Centre { high, low: self.mean - f64::from(high) }
    }

    /// The moments of all of `x`, block by block: the mean first, then the squares about it while
    /// the block is still in the nearest cache. Blocks are combined as in Chan et al.,
    /// "Algorithms for computing the sample variance".
    #[inline(always)]
    fn from_values(x: &[f32]) -> Self {
        let blocks = each_index(
            x.len().div_ceil(BLOCK),
            BLOCK,
            #[inline(always)]
            |index| {
                let block = &x[index * BLOCK..x.len().min((index + 1) * BLOCK)];
                let count = block.len() as f64;
                // Differences from any of the values are small where the values are similar.
                let pivot = block[0];
                let near = (f64::from(pivot) + sum_of(block, |x| x - pivot) / count) as f32;
                let rest = sum_of(block, |x| x - near);
                let squares = sum_of(block, |x| (x - near) * (x - near));
                let mean = f64::from(near) + rest / count;
                (count, mean, squares - rest * rest / count)
            },
        );
        let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
        for (block_count, block_mean, block_squares) in blocks {
            let sum = count + block_count;
            let step = block_mean - mean;
            mean += step * block_count / sum;
            squares += block_squares + step * step * count * block_count / sum;
            count = sum;
        }
        Self { mean, variance: squares.max(0.0) / count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{assert_independent_of_threads, noise};
    use proptest::prelude::*;

    /// A normalisation with its input, owned.
    struct Case {
        batch: usize,
        groups: usize,
        pixels: usize,
        slope: f32,
        gamma: Vec<f32>,
        beta: Vec<f32>,
        x: Vec<f32>,
    }

    struct Gradients {
        dx: Vec<f32>,
        dgamma: Vec<f32>,
        dbeta: Vec<f32>,
    }

    impl Case {
        fn new(batch: usize, channels: usize, groups: usize, pixels: usize, slope: f32) -> Self {
            Self {
                batch,
                groups,
                pixels,
                slope,
                gamma: noise(channels, 1),
                beta: noise(channels, 2),
                x: noise(batch * channels * pixels, 3),
            }
        }

        fn norm(&self) -> GroupNorm<'_> {
            GroupNorm {
                groups: self.groups,
                pixels: self.pixels,
                gamma: &self.gamma,
                beta: &self.beta,
                epsilon: 1e-5,
                slope: self.slope,
            }
        }

        fn forward(&self) -> (Vec<f32>, Vec<Moments>) {
            let mut y = vec![f32::NAN; self.x.len()];
            let moments = self.norm().forward(&self.x, &mut y);
            assert_eq!(moments.len(), self.batch * self.groups);
            (y, moments)
        }

        fn backward(&self, dy: &[f32]) -> Gradients {
            let (_, moments) = self.forward();
            let mut gradients = Gradients {
                dx: vec![f32::NAN; self.x.len()],
                dgamma: vec![f32::NAN; self.gamma.len()],
                dbeta: vec![f32::NAN; self.gamma.len()],
            };
            let Gradients { dx, dgamma, dbeta } = &mut gradients;
            self.norm().backward(dy, &self.x, &moments, dx, dgamma, dbeta);
            gradients
        }

        /// The definition, in f64.
        fn reference(&self, x: &[f64], gamma: &[f64], beta: &[f64]) -> Vec<f64> {
            let size = gamma.len() / self.groups * self.pixels;
            let mut y = Vec::new();
            for (index, group) in x.chunks(size).enumerate() {
                let mean = group.iter().sum::<f64>() / size as f64;
                let variance = group.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / size as f64;
                for (i, x) in group.iter().enumerate() {
                    let channel = (index * size + i) / self.pixels % gamma.len();
                    let normalized = (x - mean) / (variance + 1e-5).sqrt();
                    let value = gamma[channel] * normalized + beta[channel];
                    y.push(if value > 0.0 { value } else { f64::from(self.slope) * value });
                }
            }
            y
        }
    }

    fn wide(values: &[f32]) -> Vec<f64> {
        values.iter().copied().map(f64::from).collect()
    }

    fn assert_close(values: &[f32], expected: &[f64], tolerance: f64) {
        assert_eq!(values.len(), expected.len());
        for (i, (a, b)) in values.iter().zip(expected).enumerate() {
            assert!((f64::from(*a) - b).abs() < tolerance, "{a} is not {b} at {i}");
        }
    }

    #[test]
    fn it_is_the_definition_in_every_shape() {
        for (batch, channels, groups) in [(1, 1, 1), (2, 6, 3), (3, 64, 8), (1, 8, 8), (4, 4, 1)] {
            for pixels in [1, 15, 127 * 127, 128 * 128] {
                if channels * batch * pixels > 1 << 20 {
                    continue;
                }
                let case = Case::new(batch, channels, groups, pixels, 0.2);
                let expected = case.reference(&wide(&case.x), &wide(&case.gamma), &wide(&case.beta));
                // Normalised values of up to 3.
                assert_close(&case.forward().0, &expected, 2e-6);
            }
        }
    }

    #[test]
    fn a_large_mean_does_not_hide_a_small_deviation() {
        for count in [64, 5000, 128 * 128] {
            let mut case = Case::new(1, 1, 1, count, 1.0);
            (case.gamma, case.beta) = (vec![1.0], vec![0.0]);
            // Uniform noise in ±1 deviates by 1/√3.
            let deviation = 0.01 * 3f32.sqrt();
            case.x.iter_mut().for_each(|x| *x = 1000.0 + deviation * *x);
            let x = wide(&case.x);
            let (y, moments) = case.forward();
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64;
            assert!((moments[0].mean - mean).abs() < 1e-8);
            assert!((moments[0].variance / variance - 1.0).abs() < 1e-5);
            assert_close(&y, &case.reference(&x, &[1.0], &[0.0]), 1e-5);
        }
    }

    #[test]
    fn an_outlier_in_the_first_place_does_not_disturb_the_variance() {
        let mut case = Case::new(1, 1, 1, 4096, 1.0);
        case.x[0] = 1e6;
        let x = wide(&case.x);
        let mean = x.iter().sum::<f64>() / 4096.0;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 4096.0;
        let moments = case.forward().1[0];
        assert!((moments.variance / variance - 1.0).abs() < 1e-5);
        assert!((moments.mean / mean - 1.0).abs() < 1e-5);
    }

    #[test]
    fn equal_values_become_the_shift() {
        let mut case = Case::new(2, 4, 2, 9, 1.0);
        case.x.fill(0.7);
        let (y, moments) = case.forward();
        assert!(moments.iter().all(|moments| moments.variance < 1e-12));
        for (plane, index) in y.chunks(9).zip(0..) {
            assert!(plane.iter().all(|y| (y - case.beta[index % 4]).abs() < 1e-6));
        }
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        for (batch, channels, groups, pixels) in [(1, 1, 1, 4), (2, 6, 3, 15), (3, 4, 4, 7), (4, 4, 1, 2)] {
            let case = Case::new(batch, channels, groups, pixels, 0.2);
            let dy = noise(case.x.len(), 9);
            let gradients = case.backward(&dy);
            let parameters = [wide(&case.x), wide(&case.gamma), wide(&case.beta)];
            let loss = |[x, gamma, beta]: &[Vec<f64>; 3]| -> f64 {
                let y = case.reference(x, gamma, beta);
                y.iter().zip(&dy).map(|(y, &dy)| y * f64::from(dy)).sum()
            };
            let computed = [gradients.dx, gradients.dgamma, gradients.dbeta];
            for (which, gradient) in computed.iter().enumerate() {
                for (i, gradient) in gradient.iter().enumerate() {
                    let moved = |step: f64| {
                        let mut parameters = parameters.clone();
                        parameters[which][i] += step;
                        loss(&parameters)
                    };
                    let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                    let difference = (f64::from(*gradient) - slope).abs();
                    assert!(difference < 1e-5 * (1.0 + slope.abs()), "{gradient} is not {slope}");
                }
            }
        }
    }

    #[test]
    fn at_zero_the_gradient_is_that_of_negative_values() {
        let mut case = Case::new(1, 1, 1, 4, 0.25);
        (case.gamma, case.beta) = (vec![0.0], vec![0.0]);
        assert_eq!(case.backward(&[1.0; 4]).dbeta, [1.0]);
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        for groups in [1, 8, 16] {
            let case = Case::new(2, 16, groups, 127 * 127, 0.2);
            let dy = noise(case.x.len(), 9);
            assert_independent_of_threads(|| case.forward().0);
            assert_independent_of_threads(|| {
                let gradients = case.backward(&dy);
                [gradients.dx, gradients.dgamma, gradients.dbeta].concat()
            });
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn neither_light_nor_contrast_of_the_input_matters(
            pixels in 8..200usize, scale in 0.5f32..50.0, offset in -50f32..50.0,
        ) {
            let case = Case::new(2, 6, 3, pixels, 0.2);
            let mut other = Case::new(2, 6, 3, pixels, 0.2);
            other.x.iter_mut().for_each(|x| *x = scale * *x + offset);
            for (a, b) in case.forward().0.iter().zip(other.forward().0) {
                // The noise deviates by 0.58: ε counts for 1e-5/0.58²/2, and for 4 times that
                // at half the contrast. Rounding to f32 at 100 adds as much.
                prop_assert!((a - b).abs() < 5e-4);
            }
        }

        /// Adding a constant to a whole group changes nothing, so the gradient sums to zero.
        #[test]
        fn the_gradient_of_a_group_has_no_mean(pixels in 1..300usize) {
            let case = Case::new(2, 6, 3, pixels, 0.2);
            let gradients = case.backward(&noise(case.x.len(), 9));
            for group in gradients.dx.chunks(2 * pixels) {
                let sum: f64 = group.iter().copied().map(f64::from).sum();
                let size: f64 = group.iter().map(|g| f64::from(g.abs())).sum();
                prop_assert!(sum.abs() <= 1e-5 * (1.0 + size));
            }
        }
    }
}
