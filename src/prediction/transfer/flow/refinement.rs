//! All offsets refined together.

use super::patches::Field;
use super::settings::FlowSettings;
use super::vector::{PATCH, Vector};
use imaging::Raster;
use reflectance::kernels::chunks::vectorized;

/// Normalisation of the data term (the value of `OpenCV`).
const ZETA: f32 = 0.1;
/// Over-relaxation of the refinement, and its sweeps for each linearisation.
const OMEGA: f32 = 1.6;
const SWEEPS: usize = 5;
/// Planes of the data term: for the codes and for both of their slopes, slope along x, slope along
/// y and miss; then the offsets.
const TERMS: usize = 11;
/// Coefficients of a pixel's equations: ties to the left, right, above, below; the coefficient that
/// they share; their right sides; the inverse of their own coefficients.
const COEFFICIENTS: usize = 9;

/// Slope along x or along y, twice as steep as it is: half steps in the refinement are steadier.
/// Outermost pixels are repeated.
#[inline(always)]
fn slope(picture: &[f32], width: usize, along_x: bool) -> Vec<f32> {
    let height = picture.len() / width;
    let mut out = vec![0.0; picture.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        if along_x {
            let row = &picture[y * width..][..width];
            for ((out, a), b) in out[1..].iter_mut().zip(row).zip(&row[2..]) {
                *out = b - a;
            }
            out[0] = row[1] - row[0];
            out[width - 1] = row[width - 1] - row[width - 2];
        } else {
            let above = &picture[y.saturating_sub(1) * width..][..width];
            let below = &picture[(y + 1).min(height - 1) * width..][..width];
            for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
                *out = b - a;
            }
        }
    }
    out
}

/// `to` at the offsets of `field`, and where these lie in the picture (1) or leave it (0).
#[inline(always)]
fn pulled(to: &Raster<f32>, field: &Field) -> (Vec<f32>, Vec<f32>) {
    let (width, height) = to.size();
    let (mut codes, mut seen) = (vec![0.0; width * height], vec![0.0; width * height]);
    let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
    for (y, (codes, seen)) in codes.chunks_exact_mut(width).zip(seen.chunks_exact_mut(width)).enumerate() {
        let offsets = field[0].pixels[y * width..].iter().zip(&field[1].pixels[y * width..]);
        for (x, ((code, seen), (u, v))) in codes.iter_mut().zip(seen).zip(offsets).enumerate() {
            let (x, y) = (x as f32 + u, y as f32 + v);
            let inside = (x.clamp(0.0, right), y.clamp(0.0, bottom));
            *seen = if inside == (x, y) { 1.0 } else { 0.0 };
            let left = (inside.0 as usize).min(width - 2);
            let top = (inside.1 as usize).min(height - 2);
            let (x, y) = (inside.0 - left as f32, inside.1 - top as f32);
            let near = &to.pixels[top * width + left..][..width + 2];
            let [above, below] = [0, width].map(|row| near[row] + x * (near[row + 1] - near[row]));
            *code = above + y * (below - above);
        }
    }
    (codes, seen)
}

/// Rows of pixels with even columns first, then odd columns: half a row is one colour of a
/// chessboard, and the neighbours of its pixels are contiguous. Each half is filled up to whole
/// vectors, with a pixel more before and after.
#[derive(Clone, Copy)]
struct Halves {
    width: usize,
    /// Vectors in a half row.
    vectors: usize,
}

impl Halves {
    /// Length of half a row.
    #[inline(always)]
    fn length(self) -> usize {
        self.vectors * PATCH + 2
    }

    /// Length of a row.
    #[inline(always)]
    fn stride(self) -> usize {
        2 * self.length()
    }

    #[inline(always)]
    fn index(self, column: usize) -> usize {
        column % 2 * self.length() + 1 + column / 2
    }

    /// Half a row and the other one, from where the left neighbours of its pixels are.
    #[inline(always)]
    fn sides(self, row: &[f32], half: usize) -> (&[f32], &[f32]) {
        let (even, odd) = row.split_at(self.length());
        if half == 0 { (&even[1..], odd) } else { (&odd[1..], &even[1..]) }
    }

    #[inline(always)]
    fn split(self, row: &[f32], out: &mut [f32]) {
        let (even, odd) = out.split_at_mut(self.length());
        let (pairs, rest) = row.as_chunks();
        for (([a, b], even), odd) in pairs.iter().zip(&mut even[1..]).zip(&mut odd[1..]) {
            (*even, *odd) = (*a, *b);
        }
        if let [last] = rest {
            (even[1 + pairs.len()], odd[1 + pairs.len()]) = (*last, *last);
        }
    }

    #[inline(always)]
    fn join(self, row: &[f32], out: &mut [f32]) {
        let (even, odd) = row.split_at(self.length());
        let (pairs, rest) = out.as_chunks_mut();
        if let [last] = rest {
            *last = even[1 + pairs.len()];
        }
        for ((pair, even), odd) in pairs.iter_mut().zip(&even[1..]).zip(&odd[1..]) {
            *pair = [*even, *odd];
        }
    }
}

/// Data term of a refinement of `field`: vectors of both halves of each row. A miss is that of
/// offset 0, by linearisation at `field`; misses and slopes are divided by the slopes' length.
#[inline(always)]
fn data_terms(from: &Raster<f32>, to: &Raster<f32>, field: &Field, halves: Halves) -> Vec<[Vector; TERMS]> {
    let (width, height) = from.size();
    let (pulled, seen) = pulled(to, field);
    let mean: Vec<f32> = from.pixels.iter().zip(&pulled).map(|(a, b)| 0.5 * (a + b)).collect();
    let miss: Vec<f32> = from.pixels.iter().zip(&pulled).map(|(a, b)| b - a).collect();
    let (sx, sy) = (slope(&mean, width, true), slope(&mean, width, false));
    let sxy = slope(&sx, width, false);
    let sources = [
        [&sx, &sy, &miss],
        [&slope(&sx, width, true), &sxy, &slope(&miss, width, true)],
        [&sxy, &slope(&sy, width, false), &slope(&miss, width, false)],
    ];
    let mut terms = vec![[Vector::default(); TERMS]; height * 2 * halves.vectors];
    let mut row = vec![0.0; TERMS * width];
    let mut split = vec![0.0; TERMS * halves.stride()];
    for (y, out) in terms.chunks_exact_mut(2 * halves.vectors).enumerate() {
        let at = y * width..(y + 1) * width;
        let (u, v, seen) = (&field[0].pixels[at.clone()], &field[1].pixels[at.clone()], &seen[at.clone()]);
        for (sources, out) in sources.iter().zip(row.chunks_mut(3 * width)) {
            let (sx, sy, miss) = (&sources[0][at.clone()], &sources[1][at.clone()], &sources[2][at.clone()]);
            let (a, out) = out.split_at_mut(width);
            let (b, c) = out.split_at_mut(width);
            for x in 0..width {
                // Pixels that leave the picture follow their neighbours.
                let scale = seen[x] / (sx[x] * sx[x] + sy[x] * sy[x] + ZETA * ZETA).sqrt();
                a[x] = scale * sx[x];
                b[x] = scale * sy[x];
                c[x] = scale * (miss[x] - sx[x] * u[x] - sy[x] * v[x]);
            }
        }
        row[9 * width..10 * width].copy_from_slice(u);
        row[10 * width..].copy_from_slice(v);
        for (k, (row, split)) in row.chunks_exact(width).zip(split.chunks_exact_mut(halves.stride())).enumerate() {
            halves.split(row, split);
            for (n, out) in out.iter_mut().enumerate() {
                let (half, at) = (n / halves.vectors, n % halves.vectors * PATCH + 1);
                out[k] = Vector::read(split, half * halves.length() + at);
            }
        }
    }
    terms
}

/// Moves the offsets to the least of a robust energy: equal codes, equal slopes, smooth offsets.
pub fn refine(from: &Raster<f32>, to: &Raster<f32>, field: &mut Field, settings: &FlowSettings) {
    if settings.refinement_iterations == 0 {
        return;
    }
    let (width, height) = from.size();
    let halves = Halves { width, vectors: width.div_ceil(2 * PATCH) };
    let (stride, size) = (halves.stride(), 2 * halves.vectors);
    vectorized(
        #[inline(always)]
        || {
            let terms = data_terms(from, to, field, halves);
            let mut u = vec![0.0; (height + 2) * stride];
            let mut v = u.clone();
            for (plane, field) in [&mut u, &mut v].into_iter().zip(field.iter()) {
                for (out, row) in plane[stride..].chunks_exact_mut(stride).zip(field.pixels.chunks_exact(width)) {
                    halves.split(row, out);
                }
            }
            // Equations of the rows that the sweeps are at, and ties: of the row above, downwards,
            // to the right.
            let mut kept = vec![[Vector::default(); COEFFICIENTS]; 2 * SWEEPS * size];
            let mut ties = [0; 3].map(|_| vec![0.0; stride]);
            for _ in 0..settings.refinement_iterations {
                ties[0].fill(0.0);
                // Each sweep follows the one before by a row, so that rows stay in the cache until
                // all are done.
                for step in 0..height + 2 * SWEEPS {
                    if step < height {
                        let terms = &terms[step * size..][..size];
                        let (u, v) = (&mut u[(step + 1) * stride..], &mut v[(step + 1) * stride..]);
                        let last = step + 1 == height;
                        let kept = &mut kept[step % (2 * SWEEPS) * size..][..size];
                        linearize(
                            halves,
                            last,
                            terms,
                            [&mut u[..2 * stride], &mut v[..2 * stride]],
                            &mut ties,
                            kept,
                            settings,
                        );
                        ties.swap(0, 1);
                    }
                    for sweep in 0..2 * SWEEPS {
                        if step >= sweep && step - sweep < height {
                            let row = step - sweep;
                            let (half, at) = (step % 2, row % (2 * SWEEPS) * size + step % 2 * halves.vectors);
                            let rows = [&mut u[row * stride..][..3 * stride], &mut v[row * stride..][..3 * stride]];
                            relax(halves, half, &kept[at..][..halves.vectors], rows);
                        }
                    }
                }
            }
            for (plane, field) in [&u, &v].into_iter().zip(field.iter_mut()) {
                for (row, out) in plane[stride..].chunks_exact(stride).zip(field.pixels.chunks_exact_mut(width)) {
                    halves.join(row, out);
                }
            }
        },
    );
}

/// Equations of a row at its offsets and those of the row below.
#[inline(always)]
fn linearize(
    halves: Halves,
    last: bool,
    terms: &[[Vector; TERMS]],
    [u, v]: [&mut [f32]; 2],
    [above, below, right]: &mut [Vec<f32>; 3],
    kept: &mut [[Vector; COEFFICIENTS]],
    settings: &FlowSettings,
) {
    let stride = halves.stride();
    let (edge, beyond) = (halves.index(halves.width - 1), halves.index(halves.width));
    u[beyond] = u[edge];
    v[beyond] = v[edge];
    let (u, u_below) = u.split_at(stride);
    let (v, v_below) = v.split_at(stride);
    // The last row is its own neighbour below.
    let (u_below, v_below) = if last { (u, v) } else { (u_below, v_below) };
    for half in 0..2 {
        let ((a, a_side), (b, b_side)) = (halves.sides(u, half), halves.sides(v, half));
        let (a_below, b_below) = (halves.sides(u_below, half).0, halves.sides(v_below, half).0);
        for at in (0..halves.vectors).map(|k| k * PATCH) {
            let (a, b) = (Vector::read(a, at), Vector::read(b, at));
            let (ux, vx) = (Vector::read(a_side, at + 1) - a, Vector::read(b_side, at + 1) - b);
            let (uy, vy) = (Vector::read(a_below, at) - a, Vector::read(b_below, at) - b);
            let tie = (ux * ux + vx * vx + uy * uy + vy * vy).robust(0.5 * settings.alpha);
            tie.write(below, half * halves.length() + 1 + at);
        }
    }
    right.copy_from_slice(below);
    right[edge] = 0.0;
    if last {
        below.fill(0.0);
    }
    for (n, (terms, out)) in terms.iter().zip(kept).enumerate() {
        let (half, at) = (n / halves.vectors, n % halves.vectors * PATCH);
        let left = Vector::read(halves.sides(right, half).1, at);
        let at = half * halves.length() + 1 + at;
        let (right, above, below) = (Vector::read(right, at), Vector::read(above, at), Vector::read(below, at));
        let (u, v) = (Vector::read(u, at), Vector::read(v, at));
        let [sx, sy, miss, sxx, sxy, miss_x, syx, syy, miss_y, first_u, first_v] = *terms;
        let r = miss + sx * u + sy * v;
        let (rx, ry) = (miss_x + sxx * u + sxy * v, miss_y + syx * u + syy * v);
        let k = (r * r).robust(0.5 * settings.delta);
        let g = (rx * rx + ry * ry).robust(0.5 * settings.gamma);
        let still = Vector::all(ZETA * ZETA);
        let ties = left + right + above + below + still;
        let own_u = ties + k * (sx * sx) + g * (sxx * sxx + syx * syx);
        let own_v = ties + k * (sy * sy) + g * (sxy * sxy + syy * syy);
        let shared = k * (sx * sy) + g * (sxx * sxy + syx * syy);
        let b1 = still * first_u - k * (sx * miss) - g * (sxx * miss_x + syx * miss_y);
        let b2 = still * first_v - k * (sy * miss) - g * (sxy * miss_x + syy * miss_y);
        let scale = Vector::all(OMEGA) / (own_u * own_v);
        *out = [left, right, above, below, shared, b1, b2, scale * own_v, scale * own_u];
    }
}

/// Half of the middle row of three, and its pixels' neighbours to the left, to the right, above and
/// below.
#[inline(always)]
fn neighbours(halves: Halves, rows: &mut [f32], half: usize) -> (&mut [[f32; PATCH]], [&[[f32; PATCH]]; 4]) {
    let (above, rows) = rows.split_at_mut(halves.stride());
    let (here, below) = rows.split_at_mut(halves.stride());
    let (even, odd) = here.split_at_mut(halves.length());
    let (here, side) = if half == 0 { (even, &*odd) } else { (odd, &*even) };
    let first = half * halves.length() + 1;
    let around = [&side[half..], &side[half + 1..], &above[first..], &below[first..]];
    let around = around.map(|row| &row.as_chunks().0[..halves.vectors]);
    (&mut here[1..].as_chunks_mut().0[..halves.vectors], around)
}

/// Sum of a vector's neighbours, each by its tie.
#[inline(always)]
fn pull([a, b, c, d]: [&[[f32; PATCH]]; 4], k: usize, ties: [Vector; 4]) -> Vector {
    ties[0] * Vector(a[k]) + ties[1] * Vector(b[k]) + ties[2] * Vector(c[k]) + ties[3] * Vector(d[k])
}

/// A sweep over half of the middle row of three: each pixel moves towards the solution of its
/// equations.
#[inline(always)]
fn relax(halves: Halves, half: usize, kept: &[[Vector; COEFFICIENTS]], [u, v]: [&mut [f32]; 2]) {
    let (u, around_u) = neighbours(halves, u, half);
    let (v, around_v) = neighbours(halves, v, half);
    let slow = Vector::all(1.0 - OMEGA);
    for (k, equations) in kept[..halves.vectors].iter().enumerate() {
        let [left, right, above, below, shared, b1, b2, inverse1, inverse2] = *equations;
        let ties = [left, right, above, below];
        let (pull_u, pull_v) = (pull(around_u, k, ties), pull(around_v, k, ties));
        let (a, b) = (Vector(u[k]), Vector(v[k]));
        let a = slow * a + (pull_u + b1 - shared * b) * inverse1;
        let b = slow * b + (pull_v + b2 - shared * a) * inverse2;
        u[k] = a.0;
        v[k] = b.0;
    }
}
