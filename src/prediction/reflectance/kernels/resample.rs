//! The two changes of resolution in the network, with their gradients.
//!
//! Both filters are separable. A row of the result is combined from two or three rows of the source
//! in one scratch row, which stays in the nearest cache, and then filtered along the row.

use crate::kernels::chunks::{WORTH_A_THREAD, each_chunk};

/// Blur-pool ÷2 (Zhang, "Making convolutional networks shift-invariant again"): the binomial filter
/// [1 2 1]/4 on both axes, edges repeated, then every second pixel, starting with the first.
///
/// `x` is `[planes, h, w]`, `out` is `[planes, ⌈h/2⌉, ⌈w/2⌉]`.
pub fn blur_pool(x: &[f32], [h, w]: [usize; 2], out: &mut [f32]) {
    let [out_h, out_w] = [h.div_ceil(2), w.div_ceil(2)];
    assert_planes(x.len(), h * w, out.len(), out_h * out_w);
    each_row(
        out,
        out_w,
        2 * out_w + 2,
        #[inline(always)]
        |index, row, scratch| {
            let (plane, y) = (index / out_h * h, 2 * (index % out_h));
            let above = line(x, w, plane + y.saturating_sub(1));
            let here = line(x, w, plane + y);
            let below = line(x, w, plane + (y + 1).min(h - 1));
            // `scratch[i]` is column i - 1; one column is repeated before, and one after.
            for (((s, a), b), c) in scratch[1..].iter_mut().zip(above).zip(here).zip(below) {
                *s = 0.25 * (a + c) + 0.5 * b;
            }
            scratch[0] = scratch[1];
            scratch[w + 1] = scratch[w];
            let (pairs, _) = scratch.as_chunks::<2>();
            for ((out, [a, b]), [c, _]) in row.iter_mut().zip(pairs).zip(&pairs[1..]) {
                *out = 0.25 * (a + c) + 0.5 * b;
            }
        },
    );
}

/// The gradient of [`blur_pool`]: `dout` is `[planes, ⌈h/2⌉, ⌈w/2⌉]`, `dx` is `[planes, h, w]`.
///
/// An even pixel gave ½ to the one result above it, an odd one ¼ to each of its two neighbours; the
/// first pixel, and the last of an odd size, gave ¼ more, as they were repeated.
pub fn blur_pool_backward(dout: &[f32], [h, w]: [usize; 2], dx: &mut [f32]) {
    let [out_h, out_w] = [h.div_ceil(2), w.div_ceil(2)];
    assert_planes(dx.len(), h * w, dout.len(), out_h * out_w);
    each_row(
        dx,
        w,
        out_w + 1,
        #[inline(always)]
        |index, row, scratch| {
            let (plane, y) = (index / h * out_h, index % h);
            let here = line(dout, out_w, plane + y / 2);
            if y % 2 == 0 {
                let repeated = u8::from(y == 0) + u8::from(y == h - 1);
                let weight = 0.5 + 0.25 * f32::from(repeated);
                for (s, a) in scratch.iter_mut().zip(here) {
                    *s = weight * a;
                }
            } else if y + 1 < h {
                let below = line(dout, out_w, plane + y / 2 + 1);
                for ((s, a), b) in scratch.iter_mut().zip(here).zip(below) {
                    *s = 0.25 * (a + b);
                }
            } else {
                for (s, a) in scratch.iter_mut().zip(here) {
                    *s = 0.25 * a;
                }
            }
            scratch[out_w] = 0.0;
            let (pairs, rest) = row.as_chunks_mut::<2>();
            for (([even, odd], a), b) in pairs.iter_mut().zip(&*scratch).zip(&scratch[1..]) {
                *even = 0.5 * a;
                *odd = 0.25 * (a + b);
            }
            if let [last] = rest {
                *last = 0.5 * scratch[out_w - 1];
            }
            row[0] += 0.25 * scratch[0];
            if w % 2 == 1 {
                row[w - 1] += 0.25 * scratch[out_w - 1];
            }
        },
    );
}

/// Bilinear ×2 with half-pixel centres and repeated edges (PyTorch's `align_corners=False`) of one
/// or two sources, whose channels are concatenated in the result.
///
/// `first` is `[n, c1, h, w]`, `second` is `[n, c2, h, w]` or empty, `out` is `[n, c1 + c2, 2h, 2w]`.
/// An even pixel is ¾·x + ¼·previous, an odd one ¾·x + ¼·next.
pub fn upsample(batch: usize, [h, w]: [usize; 2], first: &[f32], second: &[f32], out: &mut [f32]) {
    let channels = [first, second].map(|source| channels(source.len(), batch, h * w));
    let both = channels[0] + channels[1];
    assert_eq!(out.len(), batch * both * 4 * h * w);
    each_row(
        out,
        2 * w,
        w + 2,
        #[inline(always)]
        |index, row, scratch| {
            let (plane, y) = (index / (2 * h), index % (2 * h));
            let (picture, channel) = (plane / both, plane % both);
            let (source, plane) = match channel.checked_sub(channels[0]) {
                None => (first, picture * channels[0] + channel),
                Some(channel) => (second, picture * channels[1] + channel),
            };
            let near = y / 2;
            let far = match y % 2 {
                0 => near.saturating_sub(1),
                _ => (near + 1).min(h - 1),
            };
            let near = line(source, w, plane * h + near);
            let far = line(source, w, plane * h + far);
            for ((s, a), b) in scratch[1..].iter_mut().zip(near).zip(far) {
                *s = 0.75 * a + 0.25 * b;
            }
            scratch[0] = scratch[1];
            scratch[w + 1] = scratch[w];
            let (pairs, _) = row.as_chunks_mut::<2>();
            let (here, after) = (&scratch[1..], &scratch[2..]);
            for ((([even, odd], a), b), c) in pairs.iter_mut().zip(&*scratch).zip(here).zip(after) {
                *even = 0.75 * b + 0.25 * a;
                *odd = 0.75 * b + 0.25 * c;
            }
        },
    );
}

/// The gradient of [`upsample`]: `dout` is `[n, c1 + c2, 2h, 2w]`, `dfirst` is `[n, c1, h, w]`,
/// `dsecond` is `[n, c2, h, w]` or empty.
pub fn upsample_backward(batch: usize, [h, w]: [usize; 2], dout: &[f32], dfirst: &mut [f32], dsecond: &mut [f32]) {
    let c1 = channels(dfirst.len(), batch, h * w);
    let c2 = channels(dsecond.len(), batch, h * w);
    assert_eq!(dout.len(), batch * (c1 + c2) * 4 * h * w);
    for (dx, channels, skipped) in [(dfirst, c1, 0), (dsecond, c2, c1)] {
        each_row(
            dx,
            w,
            2 * w + 2,
            #[inline(always)]
            |index, row, scratch| {
                let (plane, y) = (index / h, 2 * (index % h));
                let plane = plane / channels * (c1 + c2) + skipped + plane % channels;
                let read = |y: usize| line(dout, 2 * w, plane * 2 * h + y);
                // The four results that a pixel contributed to; at an edge the outermost gets it twice.
                let [a, b] = [read(y.saturating_sub(1)), read(y)];
                let [c, d] = [read(y + 1), read((y + 2).min(2 * h - 1))];
                let target = scratch[1..].iter_mut();
                for ((((s, a), b), c), d) in target.zip(a).zip(b).zip(c).zip(d) {
                    *s = 0.25 * (a + d) + 0.75 * (b + c);
                }
                scratch[0] = scratch[1];
                scratch[2 * w + 1] = scratch[2 * w];
                let (pairs, _) = scratch.as_chunks::<2>();
                for ((dx, [a, b]), [c, d]) in row.iter_mut().zip(pairs).zip(&pairs[1..]) {
                    *dx = 0.25 * (a + d) + 0.75 * (b + c);
                }
            },
        );
    }
}

/// Calls `fill(index, row, scratch)` for each row of `width` elements of `out`, with `scratch`
/// elements of working memory.
#[inline(always)]
fn each_row(out: &mut [f32], width: usize, scratch: usize, fill: impl Fn(usize, &mut [f32], &mut [f32]) + Sync) {
    let rows = (WORTH_A_THREAD / width).max(1);
    each_chunk(
        out,
        rows * width,
        #[inline(always)]
        |chunk_index, chunk| {
            let mut scratch = vec![0.0; scratch];
            for (index, row) in chunk.chunks_exact_mut(width).enumerate() {
                fill(chunk_index * rows + index, row, &mut scratch);
            }
        },
    );
}

/// Row `index` of all rows of `x`.
#[inline(always)]
fn line(x: &[f32], width: usize, index: usize) -> &[f32] {
    &x[index * width..][..width]
}

/// Channels of a source `[batch, channels, pixels]` of `len` elements.
fn channels(len: usize, batch: usize, pixels: usize) -> usize {
    assert_eq!(len % (batch * pixels), 0, "{len} is not a multiple of {batch}·{pixels}");
    len / (batch * pixels)
}

fn assert_planes(large: usize, large_plane: usize, small: usize, small_plane: usize) {
    assert_eq!(large % large_plane, 0, "{large} is not a multiple of {large_plane}");
    assert_eq!(small, large / large_plane * small_plane);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::chunks::tests::{assert_independent_of_threads, dot, noise};
    use proptest::prelude::*;

    const SIZES: [[usize; 2]; 8] = [[1, 1], [1, 2], [3, 5], [4, 1], [6, 4], [17, 64], [127, 127], [128, 128]];

    /// For each result of an axis, its sources and their weights before edges are repeated.
    type Taps = fn(isize) -> Vec<(isize, f64)>;

    const BINOMIAL: Taps = |i| vec![(2 * i - 1, 0.25), (2 * i, 0.5), (2 * i + 1, 0.25)];
    const BILINEAR: Taps = |i| {
        let other = if i % 2 == 0 { i / 2 - 1 } else { i / 2 + 1 };
        vec![(i / 2, 0.75), (other, 0.25)]
    };

    /// One plane, pixel by pixel in f64.
    fn filtered(x: &[f32], [h, w]: [usize; 2], taps: Taps, to: [usize; 2]) -> Vec<f64> {
        let clamp = |i: isize, size: usize| i.clamp(0, size as isize - 1) as usize;
        let mut out = Vec::new();
        for y in 0..to[0] as isize {
            for column in 0..to[1] as isize {
                let mut sum = 0.0;
                for (row, a) in taps(y) {
                    for (column, b) in taps(column) {
                        sum += a * b * f64::from(x[clamp(row, h) * w + clamp(column, w)]);
                    }
                }
                out.push(sum);
            }
        }
        out
    }

    fn assert_close(values: &[f32], expected: &[f64], what: &str) {
        assert_eq!(values.len(), expected.len());
        for (a, b) in values.iter().zip(expected) {
            // Values up to 1; a handful of roundings.
            assert!((f64::from(*a) - b).abs() < 5e-7, "{what}: {a} is not {b}");
        }
    }

    fn pooled(x: &[f32], planes: usize, [h, w]: [usize; 2]) -> Vec<f32> {
        let mut out = vec![f32::NAN; planes * h.div_ceil(2) * w.div_ceil(2)];
        blur_pool(x, [h, w], &mut out);
        out
    }

    fn doubled(batch: usize, size: [usize; 2], first: &[f32], second: &[f32]) -> Vec<f32> {
        let mut out = vec![f32::NAN; 4 * (first.len() + second.len())];
        upsample(batch, size, first, second, &mut out);
        out
    }

    #[test]
    fn blur_pool_is_the_binomial_filter_on_every_second_pixel() {
        for [h, w] in SIZES {
            let x = noise(3 * h * w, 1);
            let expected = x.chunks(h * w);
            let to = [h.div_ceil(2), w.div_ceil(2)];
            let expected: Vec<f64> = expected.flat_map(|plane| filtered(plane, [h, w], BINOMIAL, to)).collect();
            assert_close(&pooled(&x, 3, [h, w]), &expected, &format!("{h}×{w}"));
        }
    }

    #[test]
    fn upsampling_is_bilinear_with_half_pixel_centres() {
        for [h, w] in SIZES {
            let x = noise(3 * h * w, 2);
            let expected: Vec<f64> =
                x.chunks(h * w).flat_map(|plane| filtered(plane, [h, w], BILINEAR, [2 * h, 2 * w])).collect();
            assert_close(&doubled(1, [h, w], &x, &[]), &expected, &format!("{h}×{w}"));
        }
    }

    #[test]
    fn two_sources_stand_one_after_the_other_in_each_picture() {
        let (batch, [c1, c2], [h, w]) = (3, [2, 5], [3, 4]);
        let (first, second) = (noise(batch * c1 * h * w, 3), noise(batch * c2 * h * w, 4));
        let pictures = first.chunks(c1 * h * w).zip(second.chunks(c2 * h * w));
        let joined: Vec<f32> = pictures.flat_map(|(a, b)| [a, b].concat()).collect();
        assert_eq!(doubled(batch, [h, w], &first, &second), doubled(batch, [h, w], &joined, &[]));
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let (x, size) = (noise(8 * 127 * 127, 5), [127, 127]);
        assert_independent_of_threads(|| pooled(&x, 8, size));
        assert_independent_of_threads(|| doubled(2, size, &x, &x));
        assert_independent_of_threads(|| {
            let mut dx = vec![0.0; 8 * 127 * 127];
            blur_pool_backward(&x[..8 * 64 * 64], size, &mut dx);
            dx
        });
        assert_independent_of_threads(|| {
            let mut dx = vec![0.0; 8 * 63 * 63];
            let (first, second) = dx.split_at_mut(2 * 63 * 63);
            upsample_backward(1, [63, 63], &x[..8 * 126 * 126], first, second);
            dx
        });
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// ⟨A·x, y⟩ = ⟨x, Aᵀ·y⟩.
        #[test]
        fn the_gradient_of_blur_pool_is_its_transpose(
            planes in 1..65usize, h in 1..20usize, w in 1..40usize, seed: u64,
        ) {
            let x = noise(planes * h * w, seed);
            let out = pooled(&x, planes, [h, w]);
            let dout = noise(out.len(), seed ^ 1);
            let mut dx = vec![f32::NAN; x.len()];
            blur_pool_backward(&dout, [h, w], &mut dx);
            let (forward, backward) = (dot(&out, &dout), dot(&x, &dx));
            prop_assert!((forward - backward).abs() < 1e-6 * x.len() as f64);
        }

        #[test]
        fn the_gradient_of_upsampling_is_its_transpose(
            batch in 1..5usize, c1 in 0..4usize, c2 in 1..4usize, h in 1..20usize,
            w in 1..40usize, seed: u64,
        ) {
            let (first, second) =
                (noise(batch * c1 * h * w, seed), noise(batch * c2 * h * w, seed ^ 1));
            let out = doubled(batch, [h, w], &first, &second);
            let dout = noise(out.len(), seed ^ 2);
            let mut dfirst = vec![f32::NAN; first.len()];
            let mut dsecond = vec![f32::NAN; second.len()];
            upsample_backward(batch, [h, w], &dout, &mut dfirst, &mut dsecond);
            let backward = dot(&first, &dfirst) + dot(&second, &dsecond);
            prop_assert!((dot(&out, &dout) - backward).abs() < 1e-6 * out.len() as f64);
        }

        /// Both filters only take means.
        #[test]
        fn a_constant_stays_constant(h in 1..40usize, w in 1..40usize, value in -9f32..9.0) {
            let x = vec![value; h * w];
            for y in pooled(&x, 1, [h, w]).into_iter().chain(doubled(1, [h, w], &x, &[])) {
                prop_assert!((y - value).abs() <= 1e-6 * value.abs());
            }
        }
    }
}
