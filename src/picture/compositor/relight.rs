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
fn sum_components(
    field: &CompressedField,
    shares: &[(usize, [f32; 3])],
    chunk: usize,
    out: &mut [[f32; 3]],
) {
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
fn add_halves<const N: usize>(
    sums: &mut [f32; TILE],
    planes: &[[u16; TILE]],
    shares: &[(usize, f32); N],
) {
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
pub(super) mod tests {
    use super::*;

    /// A field of `lamps` lamps with pseudo-random values in [0, 1).
    pub fn noise_field(width: usize, height: usize, lamps: usize) -> ReflectanceField {
        let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
        let values = (0..lamps * 3 * width * height).map(value).collect();
        ReflectanceField { width, height, lamps, values }
    }

    fn all(weights: &[[f32; 3]]) -> Vec<usize> {
        (0..weights.len()).collect()
    }

    /// The largest difference relative to the sum of magnitudes, which bounds the error of f32.
    fn relative(a: &Image, b: &Image, largest: f32) -> f32 {
        let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f32::max) / largest
    }

    #[test]
    fn the_sum_agrees_with_one_in_double_precision() {
        let field = noise_field(61, 47, 41);
        let mut weights: Vec<_> =
            (0..41).map(|i| [0.01 * i as f32, 0.3, 1.0 / (1 + i) as f32]).collect();
        weights[17] = [1e6, 2e6, 3e6];
        let relit = relight(&field, &weights, &all(&weights));
        for (i, pixel) in relit.pixels.iter().enumerate() {
            for c in 0..3 {
                let exact: f64 = (0..41)
                    .map(|l| f64::from(weights[l][c]) * f64::from(field.plane(l, c)[i]))
                    .sum();
                // 41 additions, each rounded to half a unit of 2⁻²³.
                assert!((f64::from(pixel[c]) - exact).abs() <= 41.0 * 6e-8 * exact);
            }
        }
        test_support::shown!(Pictures, "41 lamps, one of weight 2·10⁶",
 bound: "beside f64: 41·2⁻²⁴ of the sum", measured: "holds");
    }

    #[test]
    fn relighting_is_linear_in_the_light() {
        let field = noise_field(33, 65, 7);
        let (a, b) = (vec![[0.5, 0.25, 2.0]; 7], vec![[3.0, 0.0, 0.125]; 7]);
        let both: Vec<[f32; 3]> =
            a.iter().zip(&b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect();
        let mut sum = relight(&field, &a, &all(&a));
        for (s, p) in sum.pixels.iter_mut().zip(relight(&field, &b, &all(&b)).pixels) {
            (0..3).for_each(|c| s[c] += p[c]);
        }
        assert!(relative(&sum, &relight(&field, &both, &all(&both)), 7.0 * 3.5) < 1e-6);
    }

    #[test]
    fn lamps_without_energy_may_be_skipped() {
        let mut field = noise_field(16, 16, 5);
        let weights = [[1.0; 3], [0.0; 3], [0.0, 0.5, 0.0], [0.0; 3], [2.0; 3]];
        let lit = lit_lamps(&weights);
        assert_eq!(lit, [0, 2, 4]);
        assert_eq!(relight(&field, &weights, &lit), relight(&field, &weights, &all(&weights)));
        field.values[3 * 256..6 * 256].fill(f32::NAN);
        assert!(relight(&field, &weights, &lit).pixels.iter().flatten().all(|v| v.is_finite()));
        assert!(relight(&field, &[[0.0; 3]; 5], &[]).pixels.iter().all(|&p| p == [0.0; 3]));
    }

    /// The weights of a sun among weak lamps and dark ones.
    fn sunny(lamps: usize) -> Vec<[f32; 3]> {
        let mut weights: Vec<_> =
            (0..lamps).map(|i| [0.01 * i as f32, 0.3, 1.0 / (1 + i) as f32]).collect();
        weights[lamps / 2] = [1e6, 2e6, 0.0];
        weights
    }

    #[test]
    fn halves_are_summed_exactly_as_f32_would_be() {
        for (width, height, lamps) in [(1, 1, 1), (61, 47, 41), (64, 3, 9)] {
            let half = HalfField::from(&noise_field(width, height, lamps));
            let weights = sunny(lamps);
            let (here, there) = (
                relight_half(&half, &weights, &all(&weights)),
                relight(&half.widened(), &weights, &all(&weights)),
            );
            // Both add in one order, and the scale is a power of two.
            assert_eq!(here, there);
        }
    }

    #[test]
    fn half_a_field_gives_the_picture_within_half_a_unit_of_eleven_bits() {
        let field = noise_field(61, 47, 41);
        let weights = sunny(41);
        let half = relight_half(&HalfField::from(&field), &weights, &all(&weights));
        let full = relight(&field, &weights, &all(&weights));
        let pairs = half.pixels.iter().flatten().zip(full.pixels.iter().flatten());
        for (half, full) in pairs {
            // 2⁻¹¹ from the format; values and weights are positive. Plus the rounding of 41 additions.
            assert!((half - full).abs() <= (0.5f32.powi(11) + 41.0 * 1.2e-7) * full);
        }
    }

    #[test]
    fn halves_keep_black_lamps_bad_values_and_nothing_apart() {
        let mut field = noise_field(9, 9, 3);
        field.values[40] = f32::NAN;
        field.values[7] = f32::INFINITY;
        // The second lamp is invalid throughout, and dark.
        field.values[3 * 81..6 * 81].fill(f32::NAN);
        let half = HalfField::from(&field);
        let weights = [[1.0; 3], [0.0; 3], [1e6; 3]];
        let relit = relight_half(&half, &weights, &lit_lamps(&weights));
        let bad = |i: &usize| relit.pixels[*i].iter().any(|v| !v.is_finite());
        assert_eq!((0..81).filter(bad).collect::<Vec<_>>(), [7, 40]);
        let dark = relight_half(&half, &[[0.0; 3]; 3], &[]);
        assert!(dark.pixels.iter().all(|&p| p == [0.0; 3]));
        let nothing = HalfField::from(&noise_field(0, 0, 3));
        assert!(relight_half(&nothing, &weights, &all(&weights)).pixels.is_empty());
    }

    #[test]
    fn the_light_of_a_halved_field_is_linear() {
        let half = HalfField::from(&noise_field(33, 5, 7));
        let sum = |weight: f32| {
            let weights = vec![[weight, 2.0 * weight, 0.25]; 7];
            relight_half(&half, &weights, &all(&weights))
        };
        for ((a, b), both) in (sum(0.5).pixels.iter()).zip(&sum(1.5).pixels).zip(&sum(2.0).pixels) {
            (0..2).for_each(|c| assert!((a[c] + b[c] - both[c]).abs() <= 1e-6 * both[c]));
        }
    }

    #[test]
    fn all_components_of_a_field_give_its_pictures() {
        let field = noise_field(71, 61, 5);
        let compressed = CompressedField::new(&field, 0.0);
        let weights = [[1e4, 0.0, 2.0], [0.0; 3], [1.0; 3], [0.5; 3], [0.0, 3.0, 0.0]];
        let here = relight_compressed(&compressed, &weights);
        let full = relight(&field, &weights, &all(&weights));
        // Per channel, relative to the brightest pixel.
        for c in 0..3 {
            let largest = full.pixels.iter().map(|p| p[c]).fold(0.0, f32::max);
            for (here, full) in here.pixels.iter().zip(&full.pixels) {
                assert!((here[c] - full[c]).abs() <= 1e-5 * largest, "{here:?} {full:?}");
            }
        }
        let dark = relight_compressed(&compressed, &[[0.0; 3]; 5]);
        assert!(dark.pixels.iter().all(|&p| p == [0.0; 3]));
    }
}
