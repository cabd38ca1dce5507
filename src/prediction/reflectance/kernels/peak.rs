//! Peak rates of one core.

use super::bf16;
use super::chunks::arch;
use pulp::{Simd, WithSimd};
use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Independent sums, enough to hide the latency of two units.
pub(super) const SUMS: usize = 12;
/// Multiply-adds of each sum in a measurement of some ten microseconds.
pub(super) const ROUNDS: usize = 1 << 12;

/// FLOP/s of one core in multiply-adds on registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    pub f32: f64,
    /// None without such products.
    pub bf16: Option<f64>,
}

impl Peak {
    /// Best of `times` short measurements.
    pub fn measure(times: usize) -> Self {
        let best = |work: &dyn Fn() -> usize| {
            let rate = |_| {
                let start = Instant::now();
                let sums = work();
                (2 * sums * SUMS * ROUNDS) as f64 / start.elapsed().as_secs_f64()
            };
            (0..times).map(rate).fold(0.0, f64::max)
        };
        Self {
            f32: best(&|| arch().dispatch(MultiplyAdd)),
            // Two products for each of 16 sums.
            bf16: bf16::available().then(|| {
                best(&|| {
                    bf16::multiply_add();
                    32
                })
            }),
        }
    }
}

/// True if products of bf16 are much faster than those of f32: 2 times on AMD since Zen 4, 0.5 times on Intel's Sapphire
/// Rapids. Measured once in a process, in some milliseconds.
pub fn bf16_pays() -> bool {
    /// Between both kinds of processors; below, rounding factors costs as much as it saves.
    const LEAST: f64 = 1.3;
    static PAYS: OnceLock<bool> = OnceLock::new();
    *PAYS.get_or_init(|| {
        bf16::available() && {
            let peak = Peak::measure(100);
            peak.bf16.is_some_and(|bf16| bf16 > LEAST * peak.f32)
        }
    })
}

/// Multiply-adds on registers. Gives the number of sums in a vector.
struct MultiplyAdd;

impl WithSimd for MultiplyAdd {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let [factor, addend, start] = black_box([1.0, 1e-9, 0.5]).map(|x| simd.splat_f32s(x));
        let mut sums = black_box([start; SUMS]);
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = simd.mul_add_f32s(*sum, factor, addend);
            }
        }
        black_box(sums);
        S::F32_LANES
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Precision, has_bf16, shape::Shape};

    #[test]
    fn bf16_is_chosen_where_it_pays() {
        let shape = Shape {
            batch: 1,
            inputs: 32,
            outputs: 32,
            height: 64,
            width: 64,
            kernel: 3,
            bf16: false,
        };
        let bf16 = |precision| shape.with_precision(precision).bf16;
        assert!(!bf16(Precision::Full));
        assert_eq!(bf16(Precision::Mixed), has_bf16());
        assert_eq!(bf16(Precision::Auto), bf16_pays());
        let peak = Peak::measure(3);
        assert!(peak.f32 > 0.0 && peak.bf16.is_some() == has_bf16());
    }
}
