//! Division of work among threads, and access to the processor's widest vectors.

use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Fewest elements worth a thread: with fewer, waking it costs more than it gains. Work of less than two
/// such shares stays on the calling thread.
pub const WORTH_A_THREAD: usize = 1 << 14;

/// True if vectors stay as narrow as without AVX-512.
static AVX2_ALONE: AtomicBool = AtomicBool::new(false);

/// Limits f32 kernels to AVX2 in this process, the level of most processors. For benchmarks.
pub fn keep_to_avx2() {
    AVX2_ALONE.store(true, Ordering::Relaxed);
}

/// True after [`keep_to_avx2`].
pub(super) fn only_avx2() -> bool {
    AVX2_ALONE.load(Ordering::Relaxed)
}

/// The processor's widest vectors.
pub(super) fn arch() -> Arch {
    #[cfg(target_arch = "x86_64")]
    if only_avx2()
        && let Some(avx2) = pulp::x86::V3::try_new()
    {
        return Arch::V3(avx2);
    }
    Arch::new()
}

/// Runs `work` with the processor's widest vectors.
///
/// Its loops are compiled once for each width, as far as they are inlined into this function: write
/// `#[inline(always)]` before the closure and the functions that it calls, or they stay as narrow as
/// the build's target.
#[inline(always)]
pub fn vectorized<T>(work: impl FnMut() -> T) -> T {
    // pulp takes closures directly, but by `FnOnce`, and the compiler does not inline the step
    // from there to a closure that could be called twice.
    struct Vectorized<F>(F);

    impl<T, F: FnMut() -> T> NullaryFnOnce for Vectorized<F> {
        type Output = T;

        #[inline(always)]
        fn call(mut self) -> T {
            (self.0)()
        }
    }

    arch().dispatch(Vectorized(work))
}

/// Calls `work(index, chunk)` for each chunk of `size` elements of `out` (the last may be shorter)
/// and returns the results in order.
///
/// `work` runs [`vectorized`], so it should be `#[inline(always)]`.
pub fn each_chunk<T: Send>(out: &mut [f32], size: usize, work: impl Fn(usize, &mut [f32]) -> T + Sync) -> Vec<T> {
    let work = |(index, chunk): (usize, &mut [f32])| {
        vectorized(
            #[inline(always)]
            || work(index, chunk),
        )
    };
    out.par_chunks_mut(size).enumerate().with_min_len(WORTH_A_THREAD.div_ceil(size)).map(work).collect()
}

/// Calls `work(index)` for `count` pieces of work on `size` elements each and returns the results
/// in order. Like that of [`each_chunk`], `work` should be `#[inline(always)]`.
pub fn each_index<T: Send>(count: usize, size: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let work = |index: usize| {
        vectorized(
            #[inline(always)]
            || work(index),
        )
    };
    (0..count).into_par_iter().with_min_len(WORTH_A_THREAD.div_ceil(size)).map(work).collect()
}

/// Helpers of the kernels' tests.
#[cfg(test)]
pub mod tests {
    use super::*;

    /// Asserts that `work` gives the same bits on one, two and seven threads.
    pub fn assert_independent_of_threads(work: impl Fn() -> Vec<f32> + Sync) {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let values = pool.build().unwrap().install(&work);
            values.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let alone = on(1);
        assert!(alone == on(2), "two threads change the result");
        assert!(alone == on(7), "seven threads change the result");
    }

    /// All widths of vectors that this processor has.
    pub fn every_arch() -> Vec<Arch> {
        let mut all = vec![Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(pulp::x86::V3::try_new().map(Arch::V3));
            all.extend(pulp::x86::V4::try_new().map(Arch::V4));
        }
        all
    }

    /// `count` values in [-1, 1), the same at every call with the same `seed`.
    pub fn noise(count: usize, seed: u64) -> Vec<f32> {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u32 << 23) as f32 - 1.0
        };
        // The first values of neighbouring seeds resemble each other.
        for _ in 0..8 {
            next();
        }
        (0..count).map(|_| next()).collect()
    }

    /// Σ a·b in f64.
    pub fn dot(a: &[f32], b: &[f32]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
    }

    #[test]
    fn answers_come_in_order_and_every_element_once() {
        for (len, size) in [(0, 3), (10, 3), (100_000, 7), (100_000, 50_000)] {
            let mut out = vec![0.0; len];
            let indices = each_chunk(&mut out, size, |index, chunk| {
                chunk.iter_mut().for_each(|x| *x += 1.0);
                index
            });
            assert!(out.iter().all(|x| *x == 1.0));
            assert_eq!(indices, (0..len.div_ceil(size)).collect::<Vec<_>>());
            assert_eq!(each_index(len, size, |index| index), (0..len).collect::<Vec<_>>());
        }
    }
}
