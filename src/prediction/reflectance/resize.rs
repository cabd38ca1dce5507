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
