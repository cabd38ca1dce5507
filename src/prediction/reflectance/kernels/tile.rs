//! Inner loops of convolutions. Each keeps a block of sums in registers.

use super::chunks::WORTH_A_THREAD;
use pulp::Simd;
use rayon::prelude::*;

/// Rows of a tile.
pub const ROWS: usize = 8;
/// Rows whose sums fit the registers of AVX2.
const HALF: usize = ROWS / 2;
/// Vectors side by side in a tile.
const VECTORS: usize = 3;
/// Most positions in a tile, on any processor.
pub const MAX_POSITIONS: usize = VECTORS * 16;

/// Left factor of products, block by block: for each element the values of a block's [`ROWS`] rows side by side, so
/// that a tile reads it from start to end. The last block is padded with its last row.
pub struct Packed {
    values: Vec<[f32; ROWS]>,
    /// Elements of a row.
    length: usize,
}

impl Packed {
    /// Packs rows of `channels` times `taps` elements, at least one; `value(row, channel, tap)` gives each.
    pub fn new(
        rows: usize,
        (channels, taps): (usize, usize),
        value: impl Fn(usize, usize, usize) -> f32 + Sync,
    ) -> Self {
        Self::of_blocks(rows, channels * taps, |block, values| {
            let first = block * ROWS;
            for (channel, values) in values.chunks_exact_mut(taps).enumerate() {
                for (tap, values) in values.iter_mut().enumerate() {
                    // Surplus rows of the last block repeat the last row: their sums are discarded.
                    *values = core::array::from_fn(|r| value((first + r).min(rows - 1), channel, tap));
                }
            }
        })
    }

    /// Packs rows of `length` elements, at least one; `pack(block, values)` fills each block.
    pub fn of_blocks(rows: usize, length: usize, pack: impl Fn(usize, &mut [[f32; ROWS]]) + Sync) -> Self {
        let mut values = vec![[0.0; ROWS]; rows.div_ceil(ROWS) * length];
        let blocks = values.par_chunks_mut(length).enumerate();
        let least = (WORTH_A_THREAD / (ROWS * length)).max(1);
        blocks.with_min_len(least).for_each(|(block, values)| pack(block, values));
        Self { values, length }
    }

    /// Bytes of all elements.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..])
    }

    /// The rows from `ROWS · block` on.
    #[inline(always)]
    pub fn block(&self, block: usize) -> &[[f32; ROWS]] {
        &self.values[block * self.length..][..self.length]
    }
}

/// Right factor of a product: element (channel, tap) of position `i` is at `channel · channel_stride + taps[tap] + i`.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    pub values: &'a [f32],
    pub channel_stride: usize,
    pub taps: &'a [usize],
}

/// A tile of sums, row by row, with room for `MAX_POSITIONS` per row.
pub type Tile = [[f32; MAX_POSITIONS]; ROWS];

/// Positions in a tile of a [`Product`] on this processor.
#[inline(always)]
pub fn positions<S: Simd>() -> usize {
    VECTORS * S::F32_LANES
}

/// A product of two factors: start(row) + Σ over channels and taps of left(row, channel · taps + tap) · right(channel,
/// tap, position).
#[derive(Clone, Copy)]
pub struct Product<'a> {
    /// A block of [`Packed`] rows, with as many elements as the right factor has channels times taps.
    pub left: &'a [[f32; ROWS]],
    pub right: Factor<'a>,
    pub start: [f32; ROWS],
}

impl Product<'_> {
    /// Fills `tile` with the sums of the [`positions`] from `position` on, for at least the first `rows` rows.
    #[inline(always)]
    pub fn fill<S: Simd>(&self, simd: S, position: usize, rows: usize, tile: &mut Tile) {
        // Sums, right factors and a broadcast take 28 of 32 registers, or all 16 of AVX2.
        if S::F32_LANES == 8 || rows <= HALF {
            self.fill_rows::<S, HALF>(simd, 0, position, tile);
            if rows > HALF {
                self.fill_rows::<S, HALF>(simd, HALF, position, tile);
            }
        } else {
            self.fill_rows::<S, ROWS>(simd, 0, position, tile);
        }
    }

    /// `R` rows from `first` on.
    #[inline(always)]
    fn fill_rows<S: Simd, const R: usize>(&self, simd: S, first: usize, position: usize, tile: &mut Tile) {
        // With AVX2 sums, right factors and the broadcast take all registers. The compiler keeps them there only with
        // this shape of the loops: check with `make bench`, since a spill costs half the speed.
        let Self { left, right, start } = *self;
        let Factor { values, channel_stride, taps } = right;
        let mut sums = [[simd.splat_f32s(0.0); VECTORS]; R];
        for (sums, start) in sums.iter_mut().zip(&start[first..]) {
            *sums = [simd.splat_f32s(*start); VECTORS];
        }
        for (channel, left) in left.chunks_exact(taps.len()).enumerate() {
            let values = &values[channel * channel_stride + position..];
            for (a, tap) in left.iter().zip(taps) {
                let b = &values[*tap..][..VECTORS * S::F32_LANES];
                let (b, _) = S::as_simd_f32s(b);
                let b: &[S::f32s; VECTORS] = b.first_chunk().expect("as many vectors were taken");
                let a: &[f32; R] = a[first..].first_chunk().expect("rows of a tile");
                for (sums, weight) in sums.iter_mut().zip(a) {
                    let weight = simd.splat_f32s(*weight);
                    for (sum, b) in sums.iter_mut().zip(b) {
                        *sum = simd.mul_add_e_f32s(weight, *b, *sum);
                    }
                }
            }
        }
        for (row, sums) in tile[first..].iter_mut().zip(sums) {
            let (row, _) = S::as_mut_simd_f32s(row);
            for (into, sum) in row.iter_mut().zip(&sums) {
                *into = *sum;
            }
        }
    }
}
