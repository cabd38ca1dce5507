//! The inner loops in which convolutions spend their time. Each keeps a block of sums in registers.

use pulp::Simd;

/// Rows of a tile of a [`Product`] and of a [`correlation`].
pub const ROWS: usize = 4;
/// Most positions that a tile of a [`Product`] covers, whatever the processor.
pub const MAX_POSITIONS: usize = 5 * 16;

/// One factor of a product: element (channel, tap) of row or position `i` lies at
/// `channel · channel_stride + taps[tap] + i`.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    pub values: &'a [f32],
    pub channel_stride: usize,
    pub taps: &'a [usize],
}

/// A tile of sums, row by row, `MAX_POSITIONS` places for each.
pub type Tile = [[f32; MAX_POSITIONS]; ROWS];

/// Positions that a tile of a [`Product`] covers on this processor.
#[inline(always)]
pub fn positions<S: Simd>() -> usize {
    vectors::<S>() * S::F32_LANES
}

/// Vectors side by side in a tile: with sums, right factors and broadcasts the tile fills 32
/// registers, or the 16 of AVX2.
#[inline(always)]
fn vectors<S: Simd>() -> usize {
    if S::F32_LANES == 8 { 2 } else { 5 }
}

/// A product of two factors: start(row) + Σ over channels and taps of left(channel, tap, row) ·
/// right(channel, tap, position).
#[derive(Clone, Copy)]
pub struct Product<'a> {
    pub left: Factor<'a>,
    /// Where the rows of a tile begin in the left factor.
    pub rows: [usize; ROWS],
    pub right: Factor<'a>,
    pub channels: usize,
    pub start: [f32; ROWS],
}

impl Product<'_> {
    /// Fills `tile` with the sums of the [`positions`] from `position` on.
    #[inline(always)]
    pub fn fill<S: Simd>(&self, simd: S, position: usize, tile: &mut Tile) {
        if S::F32_LANES == 8 {
            self.fill_with::<S, 2>(simd, position, tile);
        } else {
            self.fill_with::<S, 5>(simd, position, tile);
        }
    }

    #[inline(always)]
    fn fill_with<S: Simd, const V: usize>(&self, simd: S, position: usize, tile: &mut Tile) {
        let Self {
            left, rows, right, ..
        } = *self;
        let mut sums = [[simd.splat_f32s(0.0); V]; ROWS];
        for (sums, start) in sums.iter_mut().zip(self.start) {
            *sums = [simd.splat_f32s(start); V];
        }
        let taps = left.taps.len().min(right.taps.len());
        for channel in 0..self.channels {
            let a = &left.values[channel * left.channel_stride..];
            let b = &right.values[channel * right.channel_stride + position..];
            for tap in 0..taps {
                let b = &b[right.taps[tap]..][..V * S::F32_LANES];
                let (b, _) = S::as_simd_f32s(b);
                let b: &[S::f32s; V] = b.first_chunk().expect("V vectors were taken");
                let a_tap = left.taps[tap];
                for (sums, row) in sums.iter_mut().zip(rows) {
                    let weight = simd.splat_f32s(a[row + a_tap]);
                    for (sum, b) in sums.iter_mut().zip(b) {
                        *sum = simd.mul_add_e_f32s(weight, *b, *sum);
                    }
                }
            }
        }
        for (row, sums) in tile.iter_mut().zip(sums) {
            let (row, _) = S::as_mut_simd_f32s(row);
            for (into, sum) in row.iter_mut().zip(&sums) {
                *into = *sum;
            }
        }
    }
}

/// Σ over `length` positions of left[rows[r] + p] · right[taps[t] + p], for all r and t of a tile.
#[inline(always)]
pub fn correlation<S: Simd, const T: usize>(
    simd: S,
    left: &[f32],
    rows: [usize; ROWS],
    right: &[f32],
    taps: [usize; T],
    length: usize,
) -> [[f32; T]; ROWS] {
    let zero = simd.splat_f32s(0.0);
    let mut sums = [[zero; T]; ROWS];
    let left = rows.map(|row| &left[row..][..length]);
    let right = taps.map(|tap| &right[tap..][..length]);
    let whole = length / S::F32_LANES;
    {
        let left = left.map(|a| &S::as_simd_f32s(a).0[..whole]);
        let right = right.map(|b| &S::as_simd_f32s(b).0[..whole]);
        for p in 0..whole {
            let mut b = [zero; T];
            for (b, right) in b.iter_mut().zip(right) {
                *b = right[p];
            }
            for (sums, a) in sums.iter_mut().zip(left) {
                for (sum, b) in sums.iter_mut().zip(b) {
                    *sum = simd.mul_add_e_f32s(a[p], b, *sum);
                }
            }
        }
    }
    let mut result = [[0.0; T]; ROWS];
    for (r, sums) in sums.iter().enumerate() {
        for (t, sum) in sums.iter().enumerate() {
            result[r][t] = simd.reduce_sum_f32s(*sum);
        }
    }
    for p in whole * S::F32_LANES..length {
        for (result, a) in result.iter_mut().zip(left) {
            for (result, b) in result.iter_mut().zip(right) {
                *result += a[p] * b[p];
            }
        }
    }
    result
}
