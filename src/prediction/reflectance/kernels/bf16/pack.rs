//! Conversion from f32 to bf16, in the layouts of tiles.

#![allow(unsafe_code)]

use super::layout::SIDE;

/// The bf16 nearest to `x`, ties to even, as the upper half of a word. NaN stays NaN.
#[inline(always)]
fn rounded(x: f32) -> u32 {
    let bits = x.to_bits();
    let nearest = bits.wrapping_add(0x7FFF + (bits >> 16 & 1));
    let rounded = if x.is_nan() { bits | 0x0040_0000 } else { nearest };
    rounded & 0xFFFF_0000
}

/// Word with `first` and then `second`, each given as the upper half of a word.
#[inline(always)]
fn pair(first: u32, second: u32) -> u32 {
    first >> 16 | second
}

/// Pairs of values from two rows.
#[inline(always)]
pub fn pairs(rows: [&[f32]; 2], into: &mut [u32]) {
    for ((a, b), into) in rows[0].iter().zip(rows[1]).zip(into) {
        *into = pair(rounded(*a), rounded(*b));
    }
}

/// Pairs of neighbours in a row of even length.
#[inline(always)]
pub fn neighbours(row: &[f32], into: &mut [u32]) {
    for ([a, b], into) in row.as_chunks::<2>().0.iter().zip(into) {
        *into = pair(rounded(*a), rounded(*b));
    }
}

/// Values that become bf16.
pub trait Round: Copy + Sync {
    /// The bf16 of each value of a row.
    fn to_bf16(row: &[Self], into: &mut [u16]);
}

impl Round for f32 {
    #[inline(always)]
    fn to_bf16(row: &[Self], into: &mut [u16]) {
        for (x, into) in row.iter().zip(into) {
            *into = (rounded(*x) >> 16) as u16;
        }
    }
}

/// Rounded before.
impl Round for u16 {
    #[inline(always)]
    fn to_bf16(row: &[Self], into: &mut [u16]) {
        into[..row.len()].copy_from_slice(row);
    }
}

/// `into[i][j]` = `rows[j · stride + i]` for 16 rows: i over the rows' length, a multiple of 16.
pub fn turn(rows: &[u32], stride: usize, into: &mut [[u32; SIDE]]) {
    for (block, into) in into.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
        for (j, into) in into.iter_mut().enumerate() {
            into.copy_from_slice(&rows[j * stride + block * SIDE..][..SIDE]);
        }
        transpose(into);
    }
}

#[inline]
pub fn transpose(words: &mut [[u32; SIDE]; SIDE]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has the instructions.
        return unsafe { transpose_in_registers(words) };
    }
    let copy = *words;
    for (i, row) in words.iter_mut().enumerate() {
        *row = core::array::from_fn(|j| copy[j][i]);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn transpose_in_registers(words: &mut [[u32; SIDE]; SIDE]) {
    use std::arch::x86_64::*;
    // SAFETY: both are nothing but 1024 bytes, of which every pattern is a value.
    let rows: [__m512i; SIDE] = unsafe { core::mem::transmute::<[[u32; SIDE]; SIDE], [__m512i; SIDE]>(*words) };
    // Words of neighbouring rows side by side, then pairs of words, within quarters of a row: a
    // row's quarter q holds 4 rows' column 4q + r.
    let twos: [__m512i; SIDE] = core::array::from_fn(|i| {
        let (a, b) = (rows[i & !1], rows[i | 1]);
        if i & 1 == 0 { _mm512_unpacklo_epi32(a, b) } else { _mm512_unpackhi_epi32(a, b) }
    });
    let fours: [__m512i; SIDE] = core::array::from_fn(|i| {
        let (group, r) = (i & !3, i & 3);
        let (a, b) = (twos[group + r / 2], twos[group + 2 + r / 2]);
        if r & 1 == 0 { _mm512_unpacklo_epi64(a, b) } else { _mm512_unpackhi_epi64(a, b) }
    });
    // Then quarters: even or odd ones of two groups of 4 rows, and again.
    let eights: [__m512i; SIDE] = core::array::from_fn(|i| {
        let (half, odd, r) = (i & 8, i & 4, i & 3);
        let (a, b) = (fours[half + r], fours[half + 4 + r]);
        if odd == 0 { _mm512_shuffle_i32x4(a, b, 0x88) } else { _mm512_shuffle_i32x4(a, b, 0xDD) }
    });
    let columns: [__m512i; SIDE] = core::array::from_fn(|i| {
        // Column 4q + r, from the even quarters for q = 0 and 2.
        let (q, r) = (i / 4, i & 3);
        let from = (q & 1) * 4 + r;
        let (a, b) = (eights[from], eights[8 + from]);
        if q < 2 { _mm512_shuffle_i32x4(a, b, 0x88) } else { _mm512_shuffle_i32x4(a, b, 0xDD) }
    });
    // SAFETY: as above.
    *words = unsafe { core::mem::transmute::<[__m512i; SIDE], [[u32; SIDE]; SIDE]>(columns) };
}

/// Reusable memory, aligned to the processor's cache lines.
pub struct Buffer<T>(Vec<T>);

impl<T: Copy + Default> Buffer<T> {
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// `length` values with arbitrary content.
    pub fn get(&mut self, length: usize) -> &mut [T] {
        const LINE: usize = 64;
        let slack = LINE / size_of::<T>();
        if self.0.len() < length + slack {
            self.0.resize(length + slack, T::default());
        }
        let start = self.0.as_ptr().align_offset(LINE).min(slack);
        &mut self.0[start..start + length]
    }
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// Numbers without padding, for which every bit pattern is valid.
pub trait Word: Copy {}
impl Word for u16 {}
impl Word for u32 {}

pub fn bytes<T: Word>(words: &[T]) -> &[u8] {
    // SAFETY: a word is nothing but bytes, and any is a u8.
    let (before, bytes, after) = unsafe { words.align_to::<u8>() };
    assert!(before.is_empty() && after.is_empty(), "bytes fit anywhere");
    bytes
}
