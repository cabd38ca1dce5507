//! One step of Adam in one pass over all data of a parameter, and the norm that
//! limits its gradient.

use crate::kernels::chunks::{WORTH_A_THREAD, each_chunk, each_index, vectorized};
use crate::kernels::sums::BLOCK;
use rayon::prelude::*;

const FIRST_DECAY: f64 = 0.9;
const SECOND_DECAY: f64 = 0.999;
const EPSILON: f32 = 1e-8;

/// Values shared by all parameters in one step of Adam (Kingma and Ba, "Adam: a method for stochastic optimization",
/// algorithm 1), with β₁ = 0.9, β₂ = 0.999, and ε = 1e-8 outside the root.
#[derive(Clone, Copy, Debug)]
pub struct AdamStep {
    pub learning_rate: f64,
    /// 1 at the first step.
    pub step: i32,
}

impl AdamStep {
    /// Updates `parameter` and its two moments. All slices have the same length.
    pub fn apply(self, parameter: &mut [f32], gradient: &[f32], first_moment: &mut [f32], second_moment: &mut [f32]) {
        let len = parameter.len();
        assert_eq!((gradient.len(), first_moment.len(), second_moment.len()), (len, len, len));
        let update = self.update();
        (parameter.par_chunks_mut(BLOCK))
            .zip(gradient.par_chunks(BLOCK))
            .zip(first_moment.par_chunks_mut(BLOCK))
            .zip(second_moment.par_chunks_mut(BLOCK))
            .with_min_len(WORTH_A_THREAD / BLOCK)
            .for_each(|(((parameter, gradient), first), second)| {
                vectorized(
                    #[inline(always)]
                    || update.apply(parameter, gradient, first, second),
                );
            });
    }

    /// The corrections of the moments, 1/(1 − βᵗ), moved into the factors of the update.
    fn update(self) -> Update {
        let correction = |decay: f64| 1.0 / (1.0 - decay.powi(self.step));
        Update {
            rate: (self.learning_rate * correction(FIRST_DECAY)) as f32,
            root_correction: correction(SECOND_DECAY).sqrt() as f32,
        }
    }
}

#[derive(Clone, Copy)]
struct Update {
    rate: f32,
    root_correction: f32,
}

impl Update {
    #[inline(always)]
    fn apply(self, parameter: &mut [f32], gradient: &[f32], first_moment: &mut [f32], second_moment: &mut [f32]) {
        let moments = first_moment.iter_mut().zip(second_moment);
        for ((parameter, &gradient), (first, second)) in parameter.iter_mut().zip(gradient).zip(moments) {
            *first = FIRST_DECAY as f32 * *first + (1.0 - FIRST_DECAY) as f32 * gradient;
            *second = SECOND_DECAY as f32 * *second + (1.0 - SECOND_DECAY) as f32 * (gradient * gradient);
            *parameter -= self.rate * *first / (second.sqrt() * self.root_correction + EPSILON);
        }
    }
}

/// A moving average: average ← keep·average + (1 − keep)·parameter, keep from 0 to 1.
pub fn follow(average: &mut [f32], parameter: &[f32], keep: f32) {
    assert_eq!(average.len(), parameter.len());
    each_chunk(
        average,
        BLOCK,
        #[inline(always)]
        |index, average| {
            for (average, &parameter) in average.iter_mut().zip(&parameter[index * BLOCK..]) {
                *average = keep * *average + (1.0 - keep) * parameter;
            }
        },
    );
}

/// Σ x², in f64 throughout, so that no gradient is too large for its own norm.
pub fn square_sum(x: &[f32]) -> f64 {
    const LANES: usize = 128;
    let blocks = each_index(
        x.len().div_ceil(BLOCK),
        BLOCK,
        #[inline(always)]
        |index| {
            let mut lanes = [0.0; LANES];
            for chunk in x[index * BLOCK..].chunks(LANES).take(BLOCK / LANES) {
                for (lane, &x) in lanes.iter_mut().zip(chunk) {
                    *lane += f64::from(x) * f64::from(x);
                }
            }
            lanes.iter().sum::<f64>()
        },
    );
    blocks.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{assert_independent_of_threads, dot, noise};
    use proptest::prelude::*;

    const STEPS: i32 = 20;
    const KEEP: f32 = 0.9;

    fn step(step: i32) -> AdamStep {
        AdamStep { learning_rate: 1e-2, step }
    }

    fn gradient(count: usize, step: i32) -> Vec<f32> {
        noise(count, step as u64 + 10)
    }

    /// The parameter and its average after all steps.
    fn trained(count: usize) -> (Vec<f32>, Vec<f32>) {
        let mut parameter = noise(count, 1);
        let mut average = parameter.clone();
        let [mut first, mut second] = [vec![0.0; count], vec![0.0; count]];
        for i in 1..=STEPS {
            let gradient = gradient(count, i);
            step(i).apply(&mut parameter, &gradient, &mut first, &mut second);
            follow(&mut average, &parameter, KEEP);
        }
        (parameter, average)
    }

    #[test]
    fn it_is_the_algorithm_of_the_paper() {
        for count in [1, 15, 4097] {
            let (parameters, averages) = trained(count);
            let gradients: Vec<_> = (1..=STEPS).map(|i| gradient(count, i)).collect();
            for (i, start) in noise(count, 1).into_iter().enumerate() {
                let mut parameter = f64::from(start);
                let (mut average, mut first, mut second) = (parameter, 0.0, 0.0);
                for (step, gradient) in (1..).zip(&gradients) {
                    let gradient = f64::from(gradient[i]);
                    first = 0.9 * first + 0.1 * gradient;
                    second = 0.999 * second + 0.001 * gradient * gradient;
                    let mean = first / (1.0 - 0.9f64.powi(step));
                    let square: f64 = second / (1.0 - 0.999f64.powi(step));
                    parameter -= 1e-2 * mean / (square.sqrt() + 1e-8);
                    average = 0.9 * average + 0.1 * parameter;
                }
                assert!((f64::from(parameters[i]) - parameter).abs() < 1e-6);
                assert!((f64::from(averages[i]) - average).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn without_a_gradient_nothing_moves() {
        let mut parameter = noise(100, 1);
        let [mut first, mut second] = [vec![0.0; 100], vec![0.0; 100]];
        step(1).apply(&mut parameter, &[0.0; 100], &mut first, &mut second);
        assert_eq!(parameter, noise(100, 1));
    }

    #[test]
    fn a_gradient_too_large_for_f32_squares_has_a_norm() {
        assert_eq!(square_sum(&[3e30, 4e30]).sqrt(), f64::from(3e30f32).hypot(f64::from(4e30f32)));
    }

    #[test]
    fn a_hundred_thousand_steps_leave_an_average_without_bias() {
        const KEEP: f32 = 0.99;
        let value = |step: usize, i: usize| {
            let noise = (step * 7 + i).wrapping_mul(2_654_435_761) >> 8 & 0xffff;
            1.0 + i as f32 + noise as f32 / 65536.0
        };
        let mut average: Vec<f32> = (0..8).map(|i| value(0, i)).collect();
        let mut exact: Vec<f64> = average.iter().map(|v| f64::from(*v)).collect();
        let mut worst = 0.0f64;
        for step in 1..=100_000 {
            let now: Vec<f32> = (0..8).map(|i| value(step, i)).collect();
            follow(&mut average, &now, KEEP);
            for ((exact, now), average) in exact.iter_mut().zip(&now).zip(&average) {
                *exact = f64::from(KEEP) * *exact + f64::from(1.0 - KEEP) * f64::from(*now);
                worst = worst.max((f64::from(*average) / *exact - 1.0).abs());
            }
        }
        // Two products and a sum are rounded in each step, and 1 / (1 − 0.99) steps count.
        let bound = 3.0 * 0.5 * f64::from(f32::EPSILON) * 100.0;
        assert!(worst <= bound, "{worst:e}");
        test_support::shown!(Network, "The running average of weights over 10⁵ steps",
            bound: "beside f64: three roundings of a hundred steps, 1.8e-5", measured: format!("{worst:.1e}"));
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        assert_independent_of_threads(|| trained(100_003).0);
        assert_independent_of_threads(|| trained(100_003).1);
        let x = noise(1_000_003, 1);
        assert_independent_of_threads(|| {
            let bits = square_sum(&x).to_bits();
            vec![f32::from_bits(bits as u32), f32::from_bits((bits >> 32) as u32)]
        });
    }

    proptest! {
        #[test]
        fn the_square_sum_counts_every_element_once(count in 0..20_000usize, seed: u64) {
            let x = noise(count, seed);
            let expected = dot(&x, &x);
            prop_assert!((square_sum(&x) - expected).abs() <= 1e-12 * expected);
        }
    }
}
