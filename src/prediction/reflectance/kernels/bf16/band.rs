//! Bands of a picture as a convolution's right factor: its channels lie in pairs, so that a tile of up
//! to 16 pairs of channels × 16 pixels begins at any pixel.

use super::layout::{Blocking, SIDE};
use super::pack;
use crate::kernels::chunks::vectorized;
use crate::kernels::shape::{Rows, Shape};

/// Division of the input's channels into steps of a sum.
#[derive(Clone, Copy)]
pub struct Chunks {
    pub count: usize,
    /// Pairs of channels per step, at most 16; the last ones may be zeros.
    pub pairs: usize,
}

impl Chunks {
    pub fn new(channels: usize) -> Self {
        let pairs = channels.div_ceil(2);
        let count = pairs.div_ceil(SIDE);
        Self { count, pairs: pairs.div_ceil(count) }
    }

    pub fn total(&self) -> usize {
        self.count * self.pairs
    }
}

/// Consecutive pixels of a picture's row within a block of sums.
pub struct Run {
    /// Number of the tile in the block, and its first column.
    pub tile: usize,
    pub column: usize,
    /// First pixel in the band's row.
    pub pixel: usize,
    pub length: usize,
}

/// Places of the band that are summed together.
pub struct Block {
    pub start: usize,
    /// Distance between the first columns of two tiles.
    pub next: usize,
    pub runs: Vec<Run>,
}

/// Rows `from..from + rows` of a picture with the rows around them, borders zeroed.
pub struct Band {
    pub from: usize,
    pub rows: usize,
    /// Distance between rows.
    pub stride: usize,
    /// Distance between pairs of channels.
    pub plane: usize,
}

/// Cover of a convolution's bands with tiles.
#[derive(Clone, Copy)]
pub struct Cover {
    pub blocking: Blocking,
    pub stride: usize,
    /// True if tiles start at the left of each row, instead of continuing over its end.
    pub by_row: bool,
}

impl Cover {
    pub fn new(shape: &Shape) -> Self {
        let blocking = if shape.outputs <= SIDE { Blocking::Wide } else { Blocking::Square };
        let used = shape.width + shape.radius();
        let tiles = shape.width.div_ceil(SIDE);
        let even = blocking == Blocking::Square || tiles.is_multiple_of(4);
        let by_row = even && tiles * SIDE * 16 <= used * 17;
        let aligned = used.next_multiple_of(SIDE);
        let stride = if by_row && aligned * 7 <= used * 8 { aligned } else { used };
        Self { blocking, stride, by_row }
    }
}

impl Band {
    pub fn new(shape: &Shape, cover: &Cover, from: usize, rows: usize) -> Self {
        let stride = cover.stride;
        let plane = (rows * stride + SIDE).next_multiple_of(4 * SIDE) + 2 * shape.radius() * (stride + 1);
        // An odd number of cache lines between channels spreads them over the cache's sets.
        let plane = (plane.div_ceil(SIDE) | 1) * SIDE;
        Self { from, rows, stride, plane }
    }

    pub fn blocks(&self, cover: &Cover, width: usize) -> Vec<Block> {
        let [_, tiles] = cover.blocking.tiles();
        let starts: Vec<usize> = if cover.by_row {
            (0..self.rows).flat_map(|y| (0..width).step_by(SIDE).map(move |x| y * self.stride + x)).collect()
        } else {
            (0..self.rows * self.stride).step_by(SIDE).collect()
        };
        let block = |starts: &[usize]| Block {
            start: starts[0],
            next: starts.get(1).map_or(0, |second| second - starts[0]),
            runs: starts.iter().enumerate().flat_map(|(tile, start)| self.runs(tile, *start, width)).collect(),
        };
        starts.chunks(tiles).map(block).collect()
    }

    /// The pixels among the 16 places from `start` on.
    fn runs(&self, tile: usize, start: usize, width: usize) -> Vec<Run> {
        let mut runs = Vec::new();
        let mut column = 0;
        while column < SIDE {
            let (y, x) = ((start + column) / self.stride, (start + column) % self.stride);
            let places = (self.stride - x).min(SIDE - column);
            let length = places.min(width.saturating_sub(x));
            if y < self.rows && length > 0 {
                runs.push(Run { tile, column, pixel: y * width + x, length });
            }
            column += places;
        }
        runs
    }

    /// Copies a pair of channels of a picture.
    pub fn fill(
        &self,
        shape: &Shape,
        input: &impl Rows,
        (picture, pair): (usize, usize),
        scratch: &mut Vec<f32>,
        into: &mut [u32],
    ) {
        let (radius, width) = (shape.radius(), shape.width);
        if 2 * pair >= shape.inputs {
            into.fill(0);
            return;
        }
        let alone = 2 * pair + 1 == shape.inputs;
        scratch.resize(2 * width, 0.0);
        let (first, second) = scratch.split_at_mut(width);
        let rows = self.rows + 2 * radius;
        for i in 0..rows {
            let into = &mut into[i * self.stride..][..self.stride];
            match (self.from + i).checked_sub(radius) {
                Some(y) if y < shape.height => {
                    let first = input.get(picture, 2 * pair, y, first);
                    let second = if alone {
                        second.fill(0.0);
                        &*second
                    } else {
                        input.get(picture, 2 * pair + 1, y, second)
                    };
                    into[..radius].fill(0);
                    into[radius + width..].fill(0);
                    vectorized(
                        #[inline(always)]
                        || pack::pairs([first, second], &mut into[radius..]),
                    );
                }
                _ => into.fill(0),
            }
        }
        into[rows * self.stride..].fill(0);
    }
}
