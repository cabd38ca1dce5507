//! Peak rates of one core.

use super::bf16;
use super::chunks::{arch, only_avx2};
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
    /// Best of `times` short measurements of each, in turn: a busy or slow core slows both.
    pub fn measure(times: usize) -> Self {
        let rate = |work: &dyn Fn() -> usize| {
            let start = Instant::now();
            let sums = work();
            (2 * sums * SUMS * ROUNDS) as f64 / start.elapsed().as_secs_f64()
        };
        let f32 = || arch().dispatch(MultiplyAdd);
        let bf16 = || {
            bf16::multiply_add();
            // Two products for each of 16 sums.
            32
        };
        let mut best = [0.0f64; 2];
        for _ in 0..times {
            best[0] = best[0].max(rate(&f32));
            if bf16::available() {
                best[1] = best[1].max(rate(&bf16));
            }
        }
        Self { f32: best[0], bf16: bf16::available().then_some(best[1]) }
    }

    /// True if products of bf16 are much faster than those of f32: 2 times on AMD since Zen 4, 0.5 times on Intel's
    /// Sapphire Rapids.
    fn bf16_pays(&self) -> bool {
        /// Between both kinds of processors; below, rounding factors costs as much as it saves.
        const LEAST: f64 = 1.3;
        self.bf16.is_some_and(|bf16| bf16 > LEAST * self.f32)
    }
}

/// True if this processor multiplies bf16 much faster than f32. Measured once in a process, in some milliseconds.
pub fn bf16_pays() -> bool {
    static PAYS: OnceLock<bool> = OnceLock::new();
    *PAYS.get_or_init(|| bf16::available() && !only_avx2() && Peak::measure(200).bf16_pays())
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
        let shape = Shape { batch: 1, inputs: 32, outputs: 32, height: 64, width: 64, kernel: 3, bf16: false };
        let bf16 = |precision| shape.with_precision(precision).bf16;
        assert!(!bf16(Precision::Full));
        assert_eq!(bf16(Precision::Mixed), has_bf16());
        assert_eq!(bf16(Precision::Auto), bf16_pays());
        for (ratio, pays) in [(Some(0.5), false), (Some(1.2), false), (Some(1.9), true), (None, false)] {
            let peak = Peak { f32: 2e11, bf16: ratio.map(|ratio| ratio * 2e11) };
            assert_eq!(peak.bf16_pays(), pays, "{ratio:?}");
        }
        // The same answer each time, also while other threads compute.
        let peaks = || (0..4).map(|_| Peak::measure(200).bf16_pays()).collect::<Vec<_>>();
        let busy = std::thread::spawn(peaks);
        assert_eq!(peaks(), [bf16_pays(); 4]);
        assert_eq!(busy.join().unwrap(), [bf16_pays(); 4]);
    }
}
