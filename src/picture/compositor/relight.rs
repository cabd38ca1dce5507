//! Pass `relight` on the CPU: the sum of lamps, for each storage format of a field. Memory is read once,
//! by all threads, in wide loops over several lamps at a time. Unlit lamps are not read.

use super::descriptor::{Descriptor, decide, key_in};
use super::facts::key;
use imaging::Image;
use rayon::prelude::*;
use reflectance::half_field::{HalfField, TILE, widen};
use reflectance::kernels::chunks::vectorized;
use reflectance::{CompressedField, ReflectanceField, compressed};
use scene::Pass;

pub(crate) const RELIGHT: Descriptor = Descriptor {
    fixed: |_| Some("it makes the subject: every picture needs it"),
    reads: |_, planned| key([Pass::Smoothing, Pass::Weights].map(|pass| key_in(planned, pass))),
    ..Descriptor::new(Pass::Relight, |context| {
        let (lit, all) = (context.facts.lit_lamps, context.facts.lamps);
        decide(
            lit > 0,
            || format!("{lit} of {all} lamps are lit; the rest are skipped"),
            "no lamp is lit, so the subject is black",
        )
    })
};

/// Pixels summed by one task: three sums of this length (48 KiB) stay in a core's own cache, and every
/// plane is read in runs of 16 KiB. Measured best of 1024 to 8192.
const CHUNK: usize = 4096;

/// Planes added per visit of the sums, of f32 and of f16: measured best of 1 to 16.
const PLANES: usize = 4;
const HALF_PLANES: usize = 8;

/// The lamps with a non-zero weight in at least one channel.
pub fn lit_lamps(weights: &[[f32; 3]]) -> Vec<usize> {
    (0..weights.len()).filter(|&lamp| weights[lamp] != [0.0; 3]).collect()
}

/// Per channel, the lamps among `lamps` with energy there, and their weights.
fn shares(weights: &[[f32; 3]], lamps: &[usize]) -> Shares {
    [0, 1, 2].map(|channel| {
        let share = |&lamp: &usize| (lamp, weights[lamp][channel]);
        let has_energy = |&(_, weight): &(usize, f32)| weight != 0.0;
        lamps.iter().map(share).filter(has_energy).collect()
    })
}

/// Σ `weights[i]` · R_i over `lamps`, per channel, in f32 and in the order of `lamps`. Planes of zero
/// weight are not read, and NaN stays within its own pixel.
/// `weights` has one entry per lamp of `field`.
pub fn relight(field: &ReflectanceField, weights: &[[f32; 3]], lamps: &[usize]) -> Image {
    let shares = shares(weights, lamps);
    let mut relit = Image::filled(field.width, field.height, [0.0; 3]);
    let chunks = relit.pixels.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(chunk, out)| {
        vectorized(
            #[inline(always)]
            || sum_chunk(field, &shares, chunk, out),
        );
    });
    relit
}

/// [`relight`] for a field in f16, summed in f32. The error is that of [`HalfField`]: a sum
/// is off by up to 2⁻¹¹ of the sum of magnitudes.
pub fn relight_half(field: &HalfField, weights: &[[f32; 3]], lamps: &[usize]) -> Image {
    let shares = shares(weights, lamps);
    let mut relit = Image::filled(field.width, field.height, [0.0; 3]);
    let tiles = relit.pixels.par_chunks_mut(TILE).enumerate();
    tiles.with_min_len(CHUNK / TILE).for_each(|(tile, out)| {
        vectorized(
            #[inline(always)]
            || sum_tile(field, &shares, tile, out),
        );
    });
    relit
}

/// [`relight`] for a field of principal components; each plane is read once for all channels.
pub fn relight_compressed(field: &CompressedField, weights: &[[f32; 3]]) -> Image {
    let shares = compressed::shares(&field.basis, weights);
    let shares = shares.into_iter().enumerate();
    let shares: Vec<_> = shares.filter(|(_, share)| *share != [0.0; 3]).collect();
    let mut relit = Image::filled(field.width, field.height, [0.0; 3]);
    let chunks = relit.pixels.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(chunk, out)| {
        vectorized(
            #[inline(always)]
            || sum_components(field, &shares, chunk, out),
        );
    });
    relit
}

#[inline(always)]
fn sum_components(field: &CompressedField, shares: &[(usize, [f32; 3])], chunk: usize, out: &mut [[f32; 3]]) {
    let mut sums = [[0f32; CHUNK]; 3];
    let (groups, rest) = shares.as_chunks::<PLANES>();
    for group in groups {
        add_components(field, group, chunk, &mut sums, out.len());
    }
    for share in rest {
        add_components(field, &[*share], chunk, &mut sums, out.len());
    }
    interleave(&sums, out);
}

/// Adds components to the first `count` sums of all channels.
#[inline(always)]
fn add_components<const N: usize>(
    field: &CompressedField,
    shares: &[(usize, [f32; 3]); N],
    chunk: usize,
    sums: &mut [[f32; CHUNK]; 3],
    count: usize,
) {
    let mut planes = [&[][..]; N];
    for (plane, (component, _)) in planes.iter_mut().zip(shares) {
        *plane = &field.plane(*component)[chunk * CHUNK..][..count];
    }
    // The planes come from memory for the first channel, and from the first-level cache for the others.
    for (channel, sums) in sums.iter_mut().enumerate() {
        for (i, sum) in sums[..count].iter_mut().enumerate() {
            for n in 0..N {
                *sum += shares[n].1[channel] * planes[n][i];
            }
        }
    }
}

/// Lamps and their weights in each channel.
type Shares = [Vec<(usize, f32)>; 3];

#[inline(always)]
fn sum_chunk(field: &ReflectanceField, shares: &Shares, chunk: usize, out: &mut [[f32; 3]]) {
    let mut sums = [[0f32; CHUNK]; 3];
    for channel in 0..3 {
        let sum = &mut sums[channel][..out.len()];
        let (groups, rest) = shares[channel].as_chunks::<PLANES>();
        for group in groups {
            let mut planes = [&[][..]; PLANES];
            for (plane, (lamp, _)) in planes.iter_mut().zip(group) {
                *plane = &field.plane(*lamp, channel)[chunk * CHUNK..];
            }
            add(sum, planes, group);
        }
        for share in rest {
            let plane = &field.plane(share.0, channel)[chunk * CHUNK..];
            add(sum, [plane], &[*share]);
        }
    }
    interleave(&sums, out);
}

#[inline(always)]
fn sum_tile(field: &HalfField, shares: &Shares, tile: usize, out: &mut [[f32; 3]]) {
    let mut sums = [[0f32; TILE]; 3];
    let planes = field.tile(tile);
    for channel in 0..3 {
        let planes = &planes[channel * field.lamps..];
        let (groups, rest) = shares[channel].as_chunks::<HALF_PLANES>();
        for group in groups {
            add_halves(&mut sums[channel], planes, group);
        }
        for share in rest {
            add_halves(&mut sums[channel], planes, &[*share]);
        }
        // Kept out of the weights, which it could push out of f32's range.
        for sum in &mut sums[channel] {
            *sum *= field.scale();
        }
    }
    interleave(&sums, out);
}

/// Adds planes times their weights, in order. Every plane is at least as long as the
/// sums.
#[inline(always)]
fn add<const N: usize>(sums: &mut [f32], mut planes: [&[f32]; N], shares: &[(usize, f32); N]) {
    for plane in &mut planes {
        *plane = &plane[..sums.len()];
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        for n in 0..N {
            *sum += shares[n].1 * planes[n][i];
        }
    }
}

/// [`add`] for the planes of a channel's tile in f16.
#[inline(always)]
fn add_halves<const N: usize>(sums: &mut [f32; TILE], planes: &[[u16; TILE]], shares: &[(usize, f32); N]) {
    let mut halves = [&[0u16; TILE]; N];
    for (halves, (lamp, _)) in halves.iter_mut().zip(shares) {
        *halves = &planes[*lamp];
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        for n in 0..N {
            *sum += shares[n].1 * widen(halves[n][i]);
        }
    }
}

/// Interleaves three planes into pixels.
#[inline(always)]
fn interleave<const N: usize>(planes: &[[f32; N]; 3], out: &mut [[f32; 3]]) {
    for (i, pixel) in out.iter_mut().enumerate() {
        *pixel = [planes[0][i], planes[1][i], planes[2][i]];
    }
}

#[cfg(test)]
#[path = "relight_tests.rs"]
pub(super) mod tests;
