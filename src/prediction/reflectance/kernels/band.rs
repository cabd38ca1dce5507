//! Bands: rows of a picture, copied so that a convolution becomes a matrix product.
//!
//! Nothing is unfolded. A band of rows is copied with zeroed borders; the zeros to the right of
//! one row are those to the left of the next. In that copy a tap of the kernel reads its pixel at a
//! constant distance from the output pixel: a convolution becomes a
//! matrix product whose right factor is read at shifted positions, over all pixels of the band at once.
//! Results between rows are discarded.

use super::chunks::arch;
use super::shape::{Rows, Shape};
use super::tile::{self, Factor, MAX_POSITIONS, Packed, ROWS, Tile};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::cell::RefCell;

/// Rows `from..from + rows` of one picture with the rows around them, borders zeroed.
pub struct Band {
    /// First row and number of rows of the result.
    pub from: usize,
    pub rows: usize,
    /// Distance between rows in `values`.
    pub stride: usize,
    /// Distance between channels.
    pub plane: usize,
    /// Distance of the pixel read by tap (ky, kx) from the output pixel.
    pub taps: Vec<usize>,
}

impl Band {
    pub fn new(shape: &Shape, from: usize, rows: usize) -> Self {
        let stride = shape.width + shape.radius();
        let used = rows * stride;
        // The last tile may read further, at any width.
        let plane = used + MAX_POSITIONS + 2 * shape.radius() * (stride + 1);
        // An odd number of cache lines between channels spreads them over the cache's sets.
        let plane = (plane.div_ceil(16) | 1) * 16;
        let taps = (0..shape.taps()).map(|t| (t / shape.kernel) * stride + t % shape.kernel).collect();
        Self { from, rows, stride, plane, taps }
    }

    /// Number of computed positions, including those between rows.
    pub fn positions(&self) -> usize {
        self.rows * self.stride
    }

    /// Copies `channels` planes into `values`; `row(channel, y, into)` fills one row of a plane.
    #[inline(always)]
    pub fn fill(
        &self,
        shape: &Shape,
        channels: usize,
        values: &mut Vec<f32>,
        mut row: impl FnMut(usize, usize, &mut [f32]),
    ) {
        let radius = shape.radius();
        values.resize(channels * self.plane, 0.0);
        for (channel, plane) in values.chunks_exact_mut(self.plane).enumerate() {
            let (body, rest) = plane.split_at_mut((self.rows + 2 * radius) * self.stride);
            rest.fill(0.0);
            for (i, line) in body.chunks_exact_mut(self.stride).enumerate() {
                line[..radius].fill(0.0);
                match (self.from + i).checked_sub(radius) {
                    Some(y) if y < shape.height => row(channel, y, &mut line[radius..]),
                    _ => line.fill(0.0),
                }
            }
        }
    }
}

thread_local! {
    /// Bands of a thread's last task, whose memory the next one reuses: taken, not borrowed, since a
    /// waiting thread may start another task.
    pub static SCRATCH: RefCell<(Vec<f32>, Vec<f32>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

/// Size in bytes above which weights do not stay in the second-level cache between tiles of positions. Then all positions
/// go through one block of weights after the other: the sums are the same, but narrow tiles no longer read all weights again
/// from farther away for every few positions.
const CACHED_WEIGHTS: usize = 1 << 20;
/// Largest number of bands that pack the weights for themselves.
const PACKED_IN_TURN: usize = 2;

/// Matrix product of a band for some output channels: left factor the weights, right factor the
/// band, each sum written to its pixel.
struct Product<'a, 'b> {
    band: &'a Band,
    values: &'a [f32],
    width: usize,
    bias: Option<&'a [f32]>,
    /// First output channel, a multiple of [`ROWS`].
    first: usize,
    /// Rows of the band in each output plane.
    out: &'a mut [&'b mut [f32]],
    weights: Left<'a>,
}

/// Weights in the order in which a product reads them, output channel by output channel.
enum Left<'a> {
    Packed(&'a Packed),
    /// Packed block by block into this memory, just before they are read.
    InTurn(&'a Weights<'a>, &'a mut [[f32; ROWS]]),
}

impl WithSimd for Product<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let step = tile::positions::<S>();
        let positions = self.band.positions();
        let mut sums = Sums {
            right: Factor { values: self.values, channel_stride: self.band.plane, taps: &self.band.taps },
            band: self.band,
            width: self.width,
            tile: [[0.0; MAX_POSITIONS]; ROWS],
        };
        let first = self.first / ROWS;
        let start = |i: usize, planes: usize| {
            let channel = |r: usize| self.first + i * ROWS + r.min(planes - 1);
            core::array::from_fn(|r| self.bias.map_or(0.0, |bias| bias[channel(r)]))
        };
        match self.weights {
            Left::Packed(packed) if packed.bytes() <= CACHED_WEIGHTS => {
                for position in (0..positions).step_by(step) {
                    for (i, planes) in self.out.chunks_mut(ROWS).enumerate() {
                        let (left, start) = (packed.block(first + i), start(i, planes.len()));
                        sums.fill(simd, left, start, position, planes);
                    }
                }
            }
            Left::Packed(packed) => {
                for (i, planes) in self.out.chunks_mut(ROWS).enumerate() {
                    let (left, start) = (packed.block(first + i), start(i, planes.len()));
                    for position in (0..positions).step_by(step) {
                        sums.fill(simd, left, start, position, planes);
                    }
                }
            }
            Left::InTurn(weights, left) => {
                for (i, planes) in self.out.chunks_mut(ROWS).enumerate() {
                    weights.pack(first + i, left);
                    let start = start(i, planes.len());
                    for position in (0..positions).step_by(step) {
                        sums.fill(simd, left, start, position, planes);
                    }
                }
            }
        }
    }
}

/// Input of one tile of sums after the other.
struct Sums<'a> {
    right: Factor<'a>,
    band: &'a Band,
    width: usize,
    tile: Tile,
}

impl Sums<'_> {
    /// Sums a block of channels from `position` on, and writes them to their pixels.
    #[inline(always)]
    fn fill<S: Simd>(
        &mut self,
        simd: S,
        left: &[[f32; ROWS]],
        start: [f32; ROWS],
        position: usize,
        planes: &mut [&mut [f32]],
    ) {
        let product = tile::Product { left, right: self.right, start };
        product.fill(simd, position, planes.len(), &mut self.tile);
        let step = tile::positions::<S>();
        for (plane, sums) in planes.iter_mut().zip(&self.tile) {
            scatter(&sums[..step], position, self.band, self.width, plane);
        }
    }
}

/// Writes a tile's sums from `position` on to the band's rows in a plane.
#[inline(always)]
fn scatter(sums: &[f32], position: usize, band: &Band, width: usize, plane: &mut [f32]) {
    let (mut y, mut x) = (position / band.stride, position % band.stride);
    let mut sums = sums;
    while !sums.is_empty() && y < band.rows {
        let run = (band.stride - x).min(sums.len());
        let valid = run.min(width.saturating_sub(x));
        plane[y * width + x.min(width)..][..valid].copy_from_slice(&sums[..valid]);
        sums = &sums[run..];
        (y, x) = (y + 1, 0);
    }
}

/// Splits planes of `plane` values into bands: for each picture and band its rows in every channel.
pub fn split_bands<'a>(out: &'a mut [f32], shape: &Shape, channels: usize, rows: usize) -> Vec<Vec<&'a mut [f32]>> {
    let bands = shape.height.div_ceil(rows);
    let mut split: Vec<Vec<&mut [f32]>> = Vec::new();
    split.resize_with(shape.batch * bands, || Vec::with_capacity(channels));
    for (i, plane) in out.chunks_exact_mut(shape.plane()).enumerate() {
        let picture = i / channels;
        for (band, rows) in plane.chunks_mut(rows * shape.width).enumerate() {
            split[picture * bands + band].push(rows);
        }
    }
    split
}

/// Some channels of a band, for one task.
pub struct Share<'a, 'b> {
    /// Number of the band over all pictures.
    pub band: usize,
    /// First channel.
    pub first: usize,
    /// Rows of the band in each channel.
    pub out: &'a mut [&'b mut [f32]],
}

/// Divides bands among tasks, `part` channels at a time.
pub fn shares<'a, 'b>(split: &'a mut [Vec<&'b mut [f32]>], part: usize) -> Vec<Share<'a, 'b>> {
    let bands = split.iter_mut().enumerate();
    let shares = bands.flat_map(|(band, planes)| {
        let parts = planes.chunks_mut(part).enumerate();
        parts.map(move |(p, out)| Share { band, first: p * part, out })
    });
    shares.collect()
}

/// Place of element (row, channel, tap) in the weights' factor.
pub struct Weights<'a> {
    pub values: &'a [f32],
    /// Output channels.
    pub rows: usize,
    pub row_stride: usize,
    pub channel_stride: usize,
    pub taps: Vec<usize>,
}

impl Weights<'_> {
    /// Packs a block of rows, in the layout of [`Packed`].
    #[inline(always)]
    fn pack(&self, block: usize, into: &mut [[f32; ROWS]]) {
        // Surplus rows of the last block repeat the last row: their sums are discarded.
        let rows: [&[f32]; ROWS] =
            core::array::from_fn(|r| &self.values[(block * ROWS + r).min(self.rows - 1) * self.row_stride..]);
        let taps = self.taps.len();
        let in_order = self.taps.iter().copied().eq(0..taps) && self.channel_stride == taps;
        if in_order {
            let length = into.len();
            let rows = rows.map(|row| &row[..length]);
            let (blocks, rest) = into.as_chunks_mut::<ROWS>();
            let done = blocks.len() * ROWS;
            for (i, into) in blocks.iter_mut().enumerate() {
                let square = rows.map(|row| row[i * ROWS..].first_chunk::<ROWS>().copied().expect("length checked"));
                *into = core::array::from_fn(|column| square.map(|row| row[column]));
            }
            for (i, into) in rest.iter_mut().enumerate() {
                *into = rows.map(|row| row[done + i]);
            }
            return;
        }
        for (channel, into) in into.chunks_exact_mut(taps).enumerate() {
            let rows = rows.map(|row| &row[channel * self.channel_stride..][..taps]);
            for (into, &tap) in into.iter_mut().zip(&self.taps) {
                *into = rows.map(|row| row[tap]);
            }
        }
    }
}

/// The sums of a convolution over all bands. `finish` is applied to the output of a task.
pub fn convolve(
    shape: &Shape,
    weights: &Weights,
    bias: Option<&[f32]>,
    out: &mut [f32],
    input: &impl Rows,
    finish: impl Fn(&mut [f32]) + Sync,
) {
    let rows = shape.band_rows();
    let bands = shape.height.div_ceil(rows);
    // Channels are divided too if there are fewer bands than threads.
    let wanted = 2 * rayon::current_num_threads();
    let parts = wanted.div_ceil(shape.batch * bands).min(shape.outputs.div_ceil(ROWS));
    let part = shape.outputs.div_ceil(parts).next_multiple_of(ROWS);
    let length = shape.inputs * weights.taps.len();
    // Weights that few bands read are packed by each band, while they are near.
    let packed = (shape.batch * bands > PACKED_IN_TURN)
        .then(|| Packed::of_blocks(shape.outputs, length, |block, into| weights.pack(block, into)));
    let mut split = split_bands(out, shape, shape.outputs, rows);
    let tasks = shares(&mut split, part);
    let threads = tasks.len() > 1;
    let task = |Share { band: i, first, out }: Share| {
        let (picture, from) = (i / bands, i % bands * rows);
        let band = Band::new(shape, from, rows.min(shape.height - from));
        let (mut values, mut block) = SCRATCH.take();
        band.fill(shape, shape.inputs, &mut values, |c, y, into| input.fill(picture, c, y, into));
        arch().dispatch(Product {
            band: &band,
            values: &values,
            weights: match &packed {
                Some(packed) => Left::Packed(packed),
                None => {
                    block.resize(ROWS * length, 0.0);
                    Left::InTurn(weights, block.as_chunks_mut().0)
                }
            },
            width: shape.width,
            bias,
            first,
            out,
        });
        SCRATCH.set((values, block));
        for plane in out {
            finish(plane);
        }
    };
    if threads {
        tasks.into_par_iter().for_each(task);
    } else {
        tasks.into_iter().for_each(task);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{every_arch, noise};

    #[test]
    fn sums_are_right_at_any_width_of_vectors() {
        // Blocks of all rows, of half and of a row more; weights in order and reversed.
        for (outputs, kernel) in [(8, 3), (4, 3), (9, 1), (13, 7)] {
            let shape = Shape { batch: 1, inputs: 2, outputs, height: 6, width: 11, kernel, bf16: false };
            let band = Band::new(&shape, 0, shape.height);
            let x = noise(2 * 6 * 11, 1);
            let mut values = Vec::new();
            band.fill(&shape, 2, &mut values, |c, y, into| {
                into.copy_from_slice(shape.row(&x, 2, 0, c, y));
            });
            let (w, bias) = (noise(outputs * shape.columns(), 2), noise(outputs, 3));
            for (arch, turned) in every_arch().into_iter().flat_map(|arch| [(arch, false), (arch, true)]) {
                let mut taps: Vec<usize> = (0..shape.taps()).collect();
                if turned {
                    taps.reverse();
                }
                let weights = Weights {
                    values: &w,
                    rows: outputs,
                    row_stride: shape.columns(),
                    channel_stride: shape.taps(),
                    taps,
                };
                let mut block = vec![[0.0; ROWS]; shape.columns()];
                let mut out = vec![0.0; outputs * shape.plane()];
                let mut planes: Vec<&mut [f32]> = out.chunks_exact_mut(shape.plane()).collect();
                arch.dispatch(Product {
                    band: &band,
                    values: &values,
                    width: shape.width,
                    bias: Some(&bias),
                    first: 0,
                    out: &mut planes,
                    weights: Left::InTurn(&weights, &mut block),
                });
                for (i, found) in out.iter().enumerate() {
                    let (output, pixel) = (i / shape.plane(), i % shape.plane());
                    let place = pixel / shape.width * band.stride + pixel % shape.width;
                    let terms = (0..shape.columns()).map(|column| {
                        let (channel, tap) = (column / shape.taps(), column % shape.taps());
                        let value = values[channel * band.plane + band.taps[tap] + place];
                        let own = output * shape.columns() + channel * shape.taps();
                        f64::from(value) * f64::from(w[own + weights.taps[tap]])
                    });
                    let wanted = f64::from(bias[output]) + terms.sum::<f64>();
                    assert!((f64::from(*found) - wanted).abs() < 1e-5, "{arch:?} {shape:?}: {found}, not {wanted}");
                }
            }
        }
    }
}
