//! The sums of a block, in vector registers.

#![allow(unsafe_code)]

use super::layout::{Blocking, Blocks, Factor, SIDE, Steps, TILE};

/// True if the processor multiplies pairs of bf16.
pub fn available() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bf16");
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

/// into = Σ over steps of left tile · right tile, for the blocks of sums in `blocking`, in the order of the steps.
///
/// # Panics
/// When the processor has no such products, or a tile lies outside of its factor.
pub fn sum(blocking: Blocking, left: &Factor, right: &Factor, steps: &Steps, into: &mut Blocks) {
    let [down, across] = blocking.tiles();
    let fits = |factor: &Factor, tiles, rows, farthest| {
        factor.end(tiles, rows, farthest).is_some_and(|end| end <= factor.bytes.len())
    };
    assert!((1..=SIDE).contains(&steps.pairs), "{} pairs do not fit a tile", steps.pairs);
    let rows = [SIDE, 4 * steps.pairs];
    assert!(fits(left, down, rows, steps.farthest[0]), "a tile outside of the left factor");
    let rows = [steps.pairs, 4 * SIDE];
    assert!(fits(right, across, rows, steps.farthest[1]), "a tile outside of the right factor");
    assert!(available(), "the processor has no products of bf16");
    // SAFETY: the processor has the instructions, and the assertions have tried the largest offsets of all steps, in
    // which each factor's tiles reach farthest.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        registers::sum(blocking, left, right, steps, into);
    }
}

/// Multiply-adds on registers alone: `ROUNDS` of each of `SUMS` vectors. Nothing without such products.
pub fn multiply_add() {
    #[cfg(target_arch = "x86_64")]
    if available() {
        // SAFETY: the processor has the instructions.
        unsafe { registers::multiply_add() };
    }
}

#[cfg(target_arch = "x86_64")]
mod registers {
    use super::*;
    use crate::kernels::peak::{ROUNDS, SUMS};
    use std::arch::x86_64::*;
    use std::hint::black_box;

    #[expect(clippy::needless_range_loop, reason = "iterators keep checks, as in `rows`")]
    #[target_feature(enable = "avx512f,avx512bf16")]
    pub fn multiply_add() {
        // SAFETY: 64 bytes are 32 bf16, each 1.
        let ones: __m512bh = unsafe { std::mem::transmute(black_box([0x3F80_u16; 32])) };
        let mut sums = black_box([_mm512_setzero_ps(); SUMS]);
        for _ in 0..ROUNDS {
            for i in 0..SUMS {
                sums[i] = _mm512_dpbf16_ps(sums[i], ones, ones);
            }
        }
        black_box(sums);
    }

    /// # Safety
    /// The processor has the instructions, and every tile that the steps name lies within its factor.
    #[target_feature(enable = "avx512f,avx512bf16")]
    pub unsafe fn sum(blocking: Blocking, left: &Factor, right: &Factor, steps: &Steps, into: &mut Blocks) {
        let [down, across] = blocking.tiles();
        for (i, sums) in into.chunks_exact_mut(across).enumerate().take(down) {
            let left = Factor { start: left.start + i * left.next, ..*left };
            // SAFETY: as for this function. Rows and tiles at a time are parts of those asserted.
            unsafe {
                match sums {
                    [sums] => rows::<SIDE, 1>(&left, right, steps, 0, [sums]),
                    [a, b] => halves(&left, right, steps, [a, b]),
                    [a, b, c, d] => {
                        halves(&left, right, steps, [a, b]);
                        let right = Factor { start: right.start + 2 * right.next, ..*right };
                        halves(&left, &right, steps, [c, d]);
                    }
                    _ => unreachable!("a block has one, two or four tiles across"),
                }
            }
        }
    }

    /// Two tiles, eight of their rows at a time: 16 sums stay in registers, and each value read serves two or eight.
    ///
    /// # Safety
    /// As [`sum`].
    #[target_feature(enable = "avx512f,avx512bf16")]
    unsafe fn halves(left: &Factor, right: &Factor, steps: &Steps, [a, b]: [&mut [f32; TILE]; 2]) {
        // SAFETY: as for this function.
        unsafe {
            rows::<8, 2>(left, right, steps, 0, [&mut *a, &mut *b]);
            rows::<8, 2>(left, right, steps, 8, [a, b]);
        }
    }

    /// `ROWS` rows of `TILES` tiles, from row `first` on.
    ///
    /// # Safety
    /// As [`sum`], and the rows are a tile's.
    #[expect(clippy::needless_range_loop, reason = "iterators keep checks: see below")]
    #[target_feature(enable = "avx512f,avx512bf16")]
    #[inline]
    unsafe fn rows<const ROWS: usize, const TILES: usize>(
        left: &Factor,
        right: &Factor,
        steps: &Steps,
        first: usize,
        into: [&mut [f32; TILE]; TILES],
    ) {
        // Plain loops and loads: builds with debug assertions check others, and sums then leave the registers.
        let mut sums = [[_mm512_setzero_ps(); TILES]; ROWS];
        for &[one, other] in &steps.offsets {
            let mut a = left.bytes.as_ptr().wrapping_add(left.start + first * left.row + one);
            let mut b = right.bytes.as_ptr().wrapping_add(right.start + other);
            for _ in 0..steps.pairs {
                let mut columns = [_mm512_setzero_si512(); TILES];
                for tile in 0..TILES {
                    let b = b.wrapping_add(tile * right.next).cast();
                    // SAFETY: 64 bytes of a tile's row.
                    columns[tile] = unsafe { _mm512_maskz_loadu_epi32(!0, b) };
                }
                for row in 0..ROWS {
                    let a = a.wrapping_add(row * left.row).cast::<[u8; 4]>();
                    // SAFETY: 4 bytes of a tile's row, at any address.
                    let a = _mm512_set1_epi32(i32::from_ne_bytes(unsafe { *a }));
                    for tile in 0..TILES {
                        // SAFETY: 64 bytes are 32 bf16.
                        let [a, b]: [__m512bh; 2] = unsafe { std::mem::transmute([a, columns[tile]]) };
                        sums[row][tile] = _mm512_dpbf16_ps(sums[row][tile], a, b);
                    }
                }
                a = a.wrapping_add(4);
                b = b.wrapping_add(right.row);
            }
        }
        for (tile, into) in into.into_iter().enumerate() {
            for (into, sums) in into.chunks_exact_mut(SIDE).skip(first).zip(&sums) {
                // SAFETY: `into` has 16 values.
                unsafe { _mm512_storeu_ps(into.as_mut_ptr(), sums[tile]) };
            }
        }
    }
}
