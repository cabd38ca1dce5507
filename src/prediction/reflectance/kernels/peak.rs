//! Peak rates of one core, which kernels are measured against.

use super::bf16;
use super::chunks::vectorized;
use std::hint::black_box;
use std::time::Instant;

/// Independent sums, enough to hide the latency of two units.
pub(super) const SUMS: usize = 12;
/// Multiply-adds of each lane in a measurement: some tenth of a millisecond.
pub(super) const ROUNDS: usize = 1 << 15;

/// FLOP/s of one core in multiply-adds on registers: of f32, and of bf16 where the processor has them. The best of many
/// short measurements.
pub fn peak() -> (f64, Option<f64>) {
    let best = |work: &dyn Fn(), flop: usize| {
        let rate = |_| {
            let start = Instant::now();
            work();
            flop as f64 / start.elapsed().as_secs_f64()
        };
        (0..500).map(rate).fold(0.0, f64::max)
    };
    let f32 = best(&multiply_add, 2 * LANES * SUMS * ROUNDS);
    let bf16 = bf16::available().then(|| best(&bf16::multiply_add, 2 * 32 * SUMS * ROUNDS));
    (f32, bf16)
}

/// Sums in a vector of AVX-512.
const LANES: usize = 16;

fn multiply_add() {
    let [factor, addend] = black_box([1.0f32, 1e-9]);
    let mut sums = [[0.0f32; LANES]; SUMS];
    vectorized(
        #[inline(always)]
        || {
            for _ in 0..ROUNDS {
                for sums in &mut sums {
                    for sum in sums {
                        *sum = sum.mul_add(factor, addend);
                    }
                }
            }
        },
    );
    black_box(sums);
}
