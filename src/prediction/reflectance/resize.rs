//! The two changes of resolution in the network, built from operations with gradients on
//! every backend (burn's own bilinear has none on wgpu).

use burn::tensor::{Tensor, s};

/// Blur-pool ÷2 (Zhang, "Making convolutional networks shift-invariant again"): the binomial filter
/// [1 2 1]/4 on both axes, edges repeated, then every second pixel. `[n, c, h, w]` → `[n, c, h/2, w/2]`;
/// h and w must be even.
pub fn blur_pool(x: Tensor<4>) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let halves = x.reshape([n, c, h, w / 2, 2]);
    let even = halves.clone().slice(s![.., .., .., .., 0..1]).reshape([n, c, h, w / 2]);
    let odd = halves.slice(s![.., .., .., .., 1..2]).reshape([n, c, h, w / 2]);
    let first = even.clone().slice(s![.., .., .., 0..1]);
    let previous = before(first, odd.clone(), 3);
    let x = (previous + odd) * 0.25 + even * 0.5;

    let halves = x.reshape([n, c, h / 2, 2, w / 2]);
    let even = halves.clone().slice(s![.., .., .., 0..1, ..]).reshape([n, c, h / 2, w / 2]);
    let odd = halves.slice(s![.., .., .., 1..2, ..]).reshape([n, c, h / 2, w / 2]);
    let first = even.clone().slice(s![.., .., 0..1, ..]);
    let previous = before(first, odd.clone(), 2);
    (previous + odd) * 0.25 + even * 0.5
}

/// Bilinear ×2 with half-pixel centres and repeated edges, as PyTorch's `align_corners=False`.
/// `[n, c, h, w]` → `[n, c, 2h, 2w]`.
pub fn upsample(x: Tensor<4>) -> Tensor<4> {
    double(double(x, 2), 3)
}

/// Doubles one axis: even pixels are ¾·x + ¼·previous, odd ones ¾·x + ¼·next.
fn double(x: Tensor<4>, axis: usize) -> Tensor<4> {
    let mut doubled = x.dims();
    let last = doubled[axis] - 1;
    doubled[axis] *= 2;
    let previous = before(x.clone().narrow(axis, 0, 1), x.clone(), axis);
    let next = after(x.clone(), x.clone().narrow(axis, last, 1), axis);
    let x = x * 0.75;
    let even = x.clone() + previous * 0.25;
    let odd = x + next * 0.25;
    Tensor::stack::<5>(vec![even, odd], axis + 1).reshape(doubled)
}

/// `first` followed by all of `x` but its last slice: the element before each.
fn before(first: Tensor<4>, x: Tensor<4>, axis: usize) -> Tensor<4> {
    match x.dims()[axis] {
        1 => first,
        n => Tensor::cat(vec![first, x.narrow(axis, 0, n - 1)], axis),
    }
}

/// All of `x` but its first slice, followed by `last`: the element after each.
fn after(x: Tensor<4>, last: Tensor<4>, axis: usize) -> Tensor<4> {
    match x.dims()[axis] {
        1 => last,
        n => Tensor::cat(vec![x.narrow(axis, 1, n - 1), last], axis),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Device, TensorData};

    fn ramp(h: usize, w: usize) -> Tensor<4> {
        let values: Vec<f32> = (0..h * w).map(|i| (i * i % 23) as f32).collect();
        Tensor::from_data(TensorData::new(values, [1, 1, h, w]), &Device::flex())
    }

    fn values(x: Tensor<4>) -> Vec<f32> {
        x.into_data().try_to_vec().unwrap()
    }

    /// The same filters, pixel by pixel, with clamped reads.
    fn direct(
        x: &[f32],
        h: usize,
        w: usize,
        taps: &dyn Fn(usize) -> Vec<(isize, f32)>,
        size: (usize, usize),
    ) -> Vec<f32> {
        let read = |y: isize, x_: isize| {
            x[y.clamp(0, h as isize - 1) as usize * w + x_.clamp(0, w as isize - 1) as usize]
        };
        let mut out = Vec::new();
        for y in 0..size.0 {
            for x in 0..size.1 {
                out.push(
                    taps(y)
                        .iter()
                        .map(|&(sy, wy)| {
                            taps(x).iter().map(|&(sx, wx)| wy * wx * read(sy, sx)).sum::<f32>()
                        })
                        .sum(),
                );
            }
        }
        out
    }

    #[test]
    fn blur_pool_is_the_binomial_filter_on_every_second_pixel() {
        for (h, w) in [(2, 2), (4, 8), (6, 2)] {
            let expected = direct(
                &values(ramp(h, w)),
                h,
                w,
                &|i| {
                    let i = 2 * i as isize;
                    vec![(i - 1, 0.25), (i, 0.5), (i + 1, 0.25)]
                },
                (h / 2, w / 2),
            );
            for (a, b) in values(blur_pool(ramp(h, w))).iter().zip(&expected) {
                assert!((a - b).abs() < 1e-5, "{a} is not {b} at {h}×{w}");
            }
        }
    }

    #[test]
    fn upsampling_is_bilinear_with_half_pixel_centres() {
        for (h, w) in [(1, 1), (1, 3), (4, 5)] {
            let expected = direct(
                &values(ramp(h, w)),
                h,
                w,
                &|i| {
                    let (whole, odd) = (i as isize / 2, i % 2 == 1);
                    vec![(whole, 0.75), (if odd { whole + 1 } else { whole - 1 }, 0.25)]
                },
                (2 * h, 2 * w),
            );
            for (a, b) in values(upsample(ramp(h, w))).iter().zip(&expected) {
                assert!((a - b).abs() < 1e-5, "{a} is not {b} at {h}×{w}");
            }
        }
    }
}
