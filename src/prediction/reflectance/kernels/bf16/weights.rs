//! Weights as the left factor of a convolution.

use super::band::Chunks;
use super::layout::{SIDE, TILE};
use super::pack;
use crate::kernels::band::Weights;
use crate::kernels::chunks::vectorized;
use crate::kernels::shape::Shape;
use rayon::prelude::*;

/// The weights as tiles: for each block of output channels and each step of its sums, its tiles.
pub fn pack(shape: &Shape, weights: &Weights, chunks: Chunks, tiles: usize, into: &mut [u32]) {
    let step = tiles * TILE;
    let taps = &weights.taps[..shape.taps()];
    let work = |(block, into): (usize, &mut [u32])| {
        vectorized(
            #[inline(always)]
            || {
                let mut words = [[0; SIDE]; SIDE];
                for (i, chunk) in into.chunks_exact_mut(taps.len() * step).enumerate() {
                    let first = 2 * i * chunks.pairs;
                    let channels = first..shape.inputs.min(first + 2 * chunks.pairs);
                    for r in 0..tiles * SIDE {
                        let row = block * tiles * SIDE + r;
                        if row >= shape.outputs {
                            for step in chunk.chunks_exact_mut(step) {
                                step[r * SIDE..][..SIDE].fill(0);
                            }
                            continue;
                        }
                        // The taps of a channel are contiguous, though perhaps reversed: up to 16 of them
                        // are read at once for each pair of channels, then moved to their tiles.
                        for from in (0..taps.len()).step_by(SIDE) {
                            for (p, words) in words.iter_mut().enumerate() {
                                let channel = first + 2 * p;
                                let start = row * weights.row_stride + from;
                                let place = |channel| start + channel * weights.channel_stride;
                                if channels.contains(&(channel + 1))
                                    && let Some(one) = taps_at(weights.values, place(channel))
                                    && let Some(two) = taps_at(weights.values, place(channel + 1))
                                {
                                    pack::pairs([one, two], words);
                                } else {
                                    let pair = [channel, channel + 1].map(|channel| {
                                        let used = channels.contains(&channel);
                                        last_taps(weights.values, used.then(|| place(channel)))
                                    });
                                    pack::pairs([&pair[0], &pair[1]], words);
                                }
                            }
                            pack::transpose(&mut words);
                            for (step, tap) in chunk.chunks_exact_mut(step).zip(taps) {
                                let Some(tap) = tap.checked_sub(from).filter(|t| *t < SIDE) else { continue };
                                step[r * SIDE..][..SIDE].copy_from_slice(&words[tap]);
                            }
                        }
                    }
                }
            },
        );
    };
    into.par_chunks_exact_mut(chunks.count * taps.len() * step).enumerate().for_each(work);
}

/// The taps at a position, and the values after them.
#[inline(always)]
fn taps_at(weights: &[f32], start: usize) -> Option<&[f32; SIDE]> {
    weights.get(start..)?.first_chunk()
}

/// The same at the end of the weights; zeros without a position.
#[inline(never)]
fn last_taps(weights: &[f32], start: Option<usize>) -> [f32; SIDE] {
    let mut taps = [0.0; SIDE];
    let source = start.map_or(&[][..], |start| &weights[start..]);
    for (tap, source) in taps.iter_mut().zip(source) {
        *tap = *source;
    }
    taps
}
