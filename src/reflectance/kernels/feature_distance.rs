//! The distance between encoded pictures that the network is trained on, and its gradient.

use super::chunks::{each_chunk, each_index};
use super::sums::{BLOCK, Lanes, sum_of};
use pulp::Arch;

/// Added under the root: ‖x‖ becomes √(‖x‖² + ε²), whose gradient at zero error is 0 and not 0/0.
/// In units of encoded values: far below one 8-bit step.
pub const EPSILON: f64 = 1e-4;

const SCALES: usize = 3;

/// Colours of a picture.
const COLOURS: usize = 3;

/// Mean feature distance between encoded pictures, in units of encoded values, and its gradient.
///
/// `predicted`, `truth` and `gradient` are `[n, 3, h, w]`, `mask` is `[h, w]`; where it is 0 nothing
/// counts. The features of a picture are its values and their horizontal and vertical differences
/// at three scales, each scale the means of 2×2 pixels of the one before it (a last odd row or
/// column is left out). With d the masked difference of the two pictures, v = 3·max(Σ mask, 1)/4ˢ:
///
/// loss = mean over pictures of ⅓·Σₛ √(Σ d²/v + ε²) + √((Σ across² + Σ down²)/v + ε²)
///
/// Scales of a single row or column have no differences, and no scale after them.
pub fn feature_distance(
    predicted: &[f32],
    truth: &[f32],
    mask: &[f32],
    [h, w]: [usize; 2],
    gradient: &mut [f32],
) -> f64 {
    let size = COLOURS * h * w;
    let pictures = predicted.len() / size;
    assert_eq!(
        (truth.len(), gradient.len()),
        (predicted.len(), predicted.len())
    );
    assert_eq!((mask.len(), predicted.len()), (h * w, pictures * size));
    let norms = Norms {
        values: COLOURS as f64 * covered(mask).max(1.0),
        share: 1.0 / (SCALES * pictures) as f64,
    };
    let distances = each_chunk(gradient, size, |index, gradient| {
        let start = index * size;
        subtract(&predicted[start..], &truth[start..], mask, gradient);
        let distance = distance(gradient, [h, w], norms, SCALES);
        multiply(gradient, mask);
        distance
    });
    distances.iter().sum()
}

/// The part of the loss that is due to the difference `x`, `[3, h, w]`, and the `scales` from there
/// on. Leaves its gradient in the place of `x`.
fn distance(x: &mut [f32], [h, w]: [usize; 2], norms: Norms, scales: usize) -> f64 {
    let sums = SquareSums::of(x, [h, w]);
    let (mut distance, per_value) = norms.of(sums.values);
    if h < 2 || w < 2 {
        into_gradient(x, [h, w], [per_value, 0.0], &[]);
        return distance;
    }
    let (of_differences, per_difference) = norms.of(sums.differences);
    distance += of_differences;
    let mut coarser = Vec::new();
    if scales > 1 {
        coarser = halved(x, [h, w]);
        let norms = Norms {
            values: norms.values / 4.0,
            ..norms
        };
        distance += self::distance(&mut coarser, [h / 2, w / 2], norms, scales - 1);
    }
    into_gradient(x, [h, w], [per_value, per_difference], &coarser);
    distance
}

/// What turns sums of squares into parts of the loss.
#[derive(Clone, Copy)]
struct Norms {
    /// v
    values: f64,
    /// What one norm of one picture counts in the loss.
    share: f64,
}

impl Norms {
    /// The part of the loss due to a Σ x², and the factor f that makes f·x its gradient.
    fn of(self, square_sum: f64) -> (f64, f32) {
        let norm = (square_sum / self.values + EPSILON * EPSILON).sqrt();
        (
            self.share * norm,
            (self.share / (norm * self.values)) as f32,
        )
    }
}

/// Σ mask.
fn covered(mask: &[f32]) -> f64 {
    let blocks = each_index(
        mask.len().div_ceil(BLOCK),
        BLOCK,
        #[inline(always)]
        |index| {
            sum_of(
                &mask[index * BLOCK..mask.len().min((index + 1) * BLOCK)],
                |x| x,
            )
        },
    );
    blocks.iter().sum()
}

/// (a − b)·mask for each colour.
fn subtract(a: &[f32], b: &[f32], mask: &[f32], difference: &mut [f32]) {
    let pixels = mask.len();
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (colour, plane) in difference.chunks_exact_mut(pixels).enumerate() {
                let pictures = a[colour * pixels..].iter().zip(&b[colour * pixels..]);
                for ((difference, (a, b)), mask) in plane.iter_mut().zip(pictures).zip(mask) {
                    *difference = (a - b) * mask;
                }
            }
        },
    );
}

fn multiply(x: &mut [f32], mask: &[f32]) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for plane in x.chunks_exact_mut(mask.len()) {
                for (x, mask) in plane.iter_mut().zip(mask) {
                    *x *= mask;
                }
            }
        },
    );
}

/// Σ x² and Σ across² + Σ down² of a picture.
#[derive(Default)]
struct SquareSums {
    values: f64,
    differences: f64,
}

impl SquareSums {
    /// Of `x`, `[3, h, w]`.
    fn of(x: &[f32], [h, w]: [usize; 2]) -> Self {
        let mut sums = Self::default();
        let rows_in_band = (BLOCK / w).max(1);
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for plane in x.chunks_exact(h * w) {
                    for first in (0..h).step_by(rows_in_band) {
                        sums.add_band(plane, w, first..h.min(first + rows_in_band));
                    }
                }
            },
        );
        sums
    }

    #[inline(always)]
    fn add_band(&mut self, plane: &[f32], w: usize, rows: std::ops::Range<usize>) {
        let (mut values, mut differences) = (Lanes::ZERO, Lanes::ZERO);
        for y in rows {
            let row = &plane[y * w..][..w];
            values.add(row, row, |x, _| x * x);
            differences.add(&row[1..], &row[..w - 1], |a, b| (a - b) * (a - b));
            if let Some(below) = plane.get((y + 1) * w..(y + 2) * w) {
                differences.add(row, below, |a, b| (a - b) * (a - b));
            }
        }
        self.values += values.total();
        self.differences += differences.total();
    }
}

/// The means of 2×2 pixels: `[3, h, w]` → `[3, ⌊h/2⌋, ⌊w/2⌋]`.
fn halved(x: &[f32], [h, w]: [usize; 2]) -> Vec<f32> {
    let mut means = vec![0.0; COLOURS * (h / 2) * (w / 2)];
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (row, means) in means.chunks_exact_mut(w / 2).enumerate() {
                let first = row / (h / 2) * h + 2 * (row % (h / 2));
                let (upper, _) = x[first * w..][..w].as_chunks::<2>();
                let (lower, _) = x[(first + 1) * w..][..w].as_chunks::<2>();
                for ((mean, [a, b]), [c, d]) in means.iter_mut().zip(upper).zip(lower) {
                    *mean = 0.25 * ((a + b) + (c + d));
                }
            }
        },
    );
    means
}

/// Puts the gradient in the place of `x`, `[3, h, w]`: `per_value`·x, `per_difference` times what
/// x differs from its neighbours, and a quarter of the `coarser` gradient,
/// `[3, ⌊h/2⌋, ⌊w/2⌋]` or empty.
fn into_gradient(
    x: &mut [f32],
    [h, w]: [usize; 2],
    [per_value, per_difference]: [f32; 2],
    coarser: &[f32],
) {
    // Rows that were overwritten or are about to be, with their outermost columns repeated, as a
    // pixel does not differ from itself.
    let [mut above, mut here] = [vec![0.0; w + 2], vec![0.0; w + 2]];
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (plane_index, plane) in x.chunks_exact_mut(h * w).enumerate() {
                for y in 0..h {
                    let (row, below) = plane[y * w..].split_at_mut(w);
                    std::mem::swap(&mut above, &mut here);
                    here[1..=w].copy_from_slice(row);
                    (here[0], here[w + 1]) = (row[0], row[w - 1]);
                    let centre = &here[1..=w];
                    let above = if y == 0 { centre } else { &above[1..=w] };
                    let below = if y + 1 == h { centre } else { &below[..w] };
                    let across = here[..w].iter().zip(&here[2..]);
                    let down = above.iter().zip(below);
                    for (((g, x), (left, right)), (up, down)) in
                        row.iter_mut().zip(centre).zip(across).zip(down)
                    {
                        let differences = ((x - left) + (x - right)) + ((x - up) + (x - down));
                        *g = per_value * x + per_difference * differences;
                    }
                    if !coarser.is_empty() && y / 2 < h / 2 {
                        let coarser = &coarser[(plane_index * (h / 2) + y / 2) * (w / 2)..];
                        let (pairs, _) = row.as_chunks_mut::<2>();
                        for (pair, g) in pairs.iter_mut().zip(coarser) {
                            pair[0] += 0.25 * g;
                            pair[1] += 0.25 * g;
                        }
                    }
                }
            }
        },
    );
}
