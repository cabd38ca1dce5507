//! Dense optical flow between two grey pictures: patches are matched from coarse to fine, then all
//! offsets refined together.

use imaging::Raster;
use reflectance::kernels::chunks::vectorized;

/// Side of a patch in pixels: one vector of the processor.
const PATCH: usize = 8;
const AREA: f32 = (PATCH * PATCH) as f32;
/// Pixels by which pictures are continued beyond their borders, for patches there.
const BORDER: usize = PATCH;
/// Steps below this many pixels end a patch's descent.
const STILL: f32 = 0.01;
/// Offsets nearer than this to the best are not tried.
const ALIKE: f32 = 0.05;
/// Added to the squares of a patch's slopes: keeps even patches in place.
const DAMPING: f32 = 16.0;
/// Normalisation of the data term, and the robust norm's rounding near 0 (the values of `OpenCV`).
const ZETA: f32 = 0.1;
const EPSILON: f32 = 1e-3;
/// Over-relaxation of the refinement, and its sweeps for each linearisation.
const OMEGA: f32 = 1.6;
const SWEEPS: usize = 5;
/// Planes of the data term: for the codes and for both of their slopes, slope along x, slope along
/// y and miss; then the offsets.
const TERMS: usize = 11;
/// Coefficients of a pixel's equations: ties to the left, right, above, below; the coefficient that
/// they share; their right sides; the inverse of their own coefficients.
const COEFFICIENTS: usize = 9;

/// Settings of [`flow`]. The defaults find poses of one face in pictures of 256 to 384 pixels a
/// side.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowSettings {
    /// Halvings of the finest pictures that are matched; 0: full size.
    pub finest_scale: usize,
    /// Pixels from patch to patch, 1 to 8.
    pub stride: usize,
    /// Most steps of a patch at each scale: half of them in each direction of the search.
    pub descent_iterations: usize,
    /// Linearisations of the refinement at each scale; 0: none.
    pub refinement_iterations: usize,
    /// Weight of smoothness.
    pub alpha: f32,
    /// Weight of equal codes.
    pub delta: f32,
    /// Weight of equal slopes.
    pub gamma: f32,
}

impl Default for FlowSettings {
    fn default() -> Self {
        Self {
            finest_scale: 0,
            stride: 4,
            descent_iterations: 12,
            refinement_iterations: 5,
            alpha: 40.0,
            delta: 5.0,
            gamma: 10.0,
        }
    }
}

/// Offsets along x and along y in pixels.
type Field = [Raster<f32>; 2];

/// Offsets (dx, dy) in pixels: pixel (x, y) of `from` lies at (x + dx, y + dy) in `to`. Codes are 0
/// to 255; NaN counts as 0. `start`: offsets to begin from, one for each pixel. Offsets are 0 if
/// the pictures differ in size or are smaller than a patch. One thread, and the same bits on any
/// processor.
///
/// Patches after Kroeger, Timofte, Dai and Van Gool 2016, "Fast optical flow using dense inverse
/// search"; refinement after Brox, Bruhn, Papenberg and Weickert 2004, "High accuracy optical flow
/// estimation based on a theory for warping", with the normalisation of Zimmer, Bruhn and Weickert
/// 2011.
pub fn flow(
    from: &Raster<f32>,
    to: &Raster<f32>,
    start: Option<&[[f32; 2]]>,
    settings: &FlowSettings,
) -> Vec<[f32; 2]> {
    let (width, height) = from.size();
    let count = width * height;
    let alike = to.size() == from.size()
        && [from, to]
            .iter()
            .all(|picture| picture.pixels.len() == count);
    if !alike || width.min(height) < PATCH {
        return vec![[0.0; 2]; count];
    }
    let coarsest = coarsest_scale(width, height);
    let finest = settings.finest_scale.min(coarsest);
    let code = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, 255.0) };
    let [from, to] = [from, to].map(|picture| pyramid(picture.map(code), coarsest, 1.0));
    let start = start.filter(|start| start.len() == count).map(|start| {
        let reach = width.max(height) as f32;
        let offset = |v: f32| {
            if v.is_nan() {
                0.0
            } else {
                v.clamp(-reach, reach)
            }
        };
        [0, 1].map(|c| {
            let pixels = start.iter().map(|o| offset(o[c])).collect();
            pyramid(
                Raster {
                    width,
                    height,
                    pixels,
                },
                coarsest,
                0.5,
            )
        })
    });
    let start = |scale: usize| start.as_ref().map(|[x, y]| [&x[scale], &y[scale]]);
    let (width, height) = from[coarsest].size();
    let mut field: Field = match start(coarsest) {
        Some(start) => start.map(Clone::clone),
        None => [0, 1].map(|_| Raster::filled(width, height, 0.0)),
    };
    for scale in (finest..=coarsest).rev() {
        let (from, to) = (&from[scale], &to[scale]);
        if scale < coarsest {
            field = field.map(|plane| doubled(&plane, from.size()));
        }
        field = matched(from, to, &field, start(scale), settings);
        refine(from, to, &mut field, settings);
    }
    for picture in from[..finest].iter().rev() {
        field = field.map(|plane| doubled(&plane, picture.size()));
    }
    field[0]
        .pixels
        .iter()
        .zip(&field[1].pixels)
        .map(|(x, y)| [*x, *y])
        .collect()
}

/// Halvings at which a patch is a quarter of the picture, and no more than the picture holds a
/// patch.
fn coarsest_scale(width: usize, height: usize) -> usize {
    let quarter = (width.max(height) as f32 / (4 * PATCH) as f32)
        .log2()
        .round()
        .max(0.0) as usize;
    quarter.min((width.min(height) / PATCH).ilog2() as usize)
}

/// A picture and its halvings, whose values are scaled each time.
fn pyramid(picture: Raster<f32>, halvings: usize, scale: f32) -> Vec<Raster<f32>> {
    let halved = |picture: &Raster<f32>| {
        let (width, height) = (picture.width / 2, picture.height / 2);
        let mut pixels = Vec::with_capacity(width * height);
        for rows in picture.pixels.chunks_exact(2 * picture.width) {
            let (a, b) = rows.split_at(picture.width);
            let pairs = a.chunks_exact(2).zip(b.chunks_exact(2));
            pixels.extend(pairs.map(|(a, b)| 0.25 * scale * (a[0] + a[1] + b[0] + b[1])));
        }
        Raster {
            width,
            height,
            pixels,
        }
    };
    std::iter::successors(Some(picture), |p| Some(halved(p)))
        .take(halvings + 1)
        .collect()
}

/// Offsets of a picture's halving at the picture's own size, linear between pixels.
fn doubled(plane: &Raster<f32>, (width, height): (usize, usize)) -> Raster<f32> {
    let beside = |i: usize, length: usize| {
        let near = (i / 2).min(length - 1);
        let far = if i.is_multiple_of(2) {
            near.saturating_sub(1)
        } else {
            (near + 1).min(length - 1)
        };
        (near, far)
    };
    let columns: Vec<_> = (0..width).map(|x| beside(x, plane.width)).collect();
    let mut row = vec![0.0; plane.width];
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let (near, far) = beside(y, plane.height);
        let [near, far] = [near, far].map(|y| &plane.pixels[y * plane.width..][..plane.width]);
        for ((row, near), far) in row.iter_mut().zip(near).zip(far) {
            *row = 1.5 * near + 0.5 * far;
        }
        pixels.extend(
            columns
                .iter()
                .map(|&(near, far)| 0.75 * row[near] + 0.25 * row[far]),
        );
    }
    Raster {
        width,
        height,
        pixels,
    }
}

/// A picture continued by its outermost pixels, [`BORDER`] of them on each side.
fn continued(picture: &Raster<f32>) -> Raster<f32> {
    let (width, height) = (picture.width + 2 * BORDER, picture.height + 2 * BORDER);
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let y = y.saturating_sub(BORDER).min(picture.height - 1);
        let row = &picture.pixels[y * picture.width..][..picture.width];
        pixels.extend(std::iter::repeat_n(row[0], BORDER));
        pixels.extend_from_slice(row);
        pixels.extend(std::iter::repeat_n(row[row.len() - 1], BORDER));
    }
    Raster {
        width,
        height,
        pixels,
    }
}

/// Values of neighbouring pixels. Its loops become the processor's vectors.
#[derive(Clone, Copy, Default)]
struct Vector([f32; PATCH]);

type Block = [Vector; PATCH];

macro_rules! by_element {
    ($($operator:ident $name:ident $symbol:tt),*) => {$(
        impl std::ops::$operator for Vector {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(other.0) {
                    *a $symbol b;
                }
                self
            }
        }
    )*};
}

by_element!(Add add +=, Sub sub -=, Mul mul *=, Div div /=);

impl Vector {
    #[inline(always)]
    fn all(value: f32) -> Self {
        Self([value; PATCH])
    }

    #[inline(always)]
    fn read(row: &[f32], at: usize) -> Self {
        let mut out = Self::default();
        out.0.copy_from_slice(&row[at..][..PATCH]);
        out
    }

    #[inline(always)]
    fn write(self, row: &mut [f32], at: usize) {
        row[at..][..PATCH].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn square_root(mut self) -> Self {
        for a in &mut self.0 {
            *a = a.sqrt();
        }
        self
    }

    /// Magnitudes of at least 1.
    #[inline(always)]
    fn magnitude(mut self) -> Self {
        for a in &mut self.0 {
            *a = a.abs().max(1.0);
        }
        self
    }

    /// `weight` divided by a vector's length, rounded near 0.
    #[inline(always)]
    fn robust(self, weight: f32) -> Self {
        Self::all(weight) / (self + Self::all(EPSILON * EPSILON)).square_root()
    }
}

/// Sums of the vectors' elements. Inlined, it would keep the compiler from using whole vectors
/// before it.
#[inline(never)]
fn sums<const N: usize>(vectors: &[Vector; N]) -> [f32; N] {
    vectors.map(|Vector(v)| ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])))
}

/// A patch's place along one axis of a continued picture: its first pixel, and how far it lies
/// towards the next.
#[inline(always)]
fn place(corner: usize, offset: f32, length: usize) -> (usize, Vector) {
    let last = length - PATCH - 2;
    let at = (corner as f32 + offset + BORDER as f32).clamp(1.0, (last + 1) as f32);
    let pixel = (at as usize).min(last);
    (pixel, Vector::all(at - pixel as f32))
}

/// Codes of a row between its columns.
#[inline(always)]
fn between(picture: &Raster<f32>, row: usize, left: usize, x: Vector) -> Vector {
    let row = &picture.pixels[row * picture.width + left..][..PATCH + 1];
    let (a, b) = (Vector::read(row, 0), Vector::read(row, 1));
    a + x * (b - a)
}

/// A patch of `from`, to be found in `to`.
struct Patch {
    corner: [usize; 2],
    codes: Block,
    /// Slopes less their mean, which makes the match blind to an offset of all codes.
    slope_x: Block,
    slope_y: Block,
    /// Inverse of the slopes' products: xx, xy, yy.
    inverse: [f32; 3],
}

/// A place tried for a patch.
#[derive(Clone, Copy)]
struct Trial {
    offset: [f32; 2],
    /// Squared differences of the codes, less their mean's.
    miss: f32,
    /// Step that would reduce the miss most.
    step: [f32; 2],
}

impl Patch {
    /// A patch by its corner. `from` is continued by [`BORDER`].
    #[inline(always)]
    fn new(from: &Raster<f32>, corner: [usize; 2]) -> Self {
        let [mut codes, mut slope_x, mut slope_y] = [Block::default(); 3];
        let [mut sum_x, mut sum_y] = [Vector::default(); 2];
        for k in 0..PATCH {
            let at = (corner[1] + BORDER + k) * from.width + corner[0] + BORDER;
            let (above, below) = (at - from.width, at + from.width);
            let pixels = &from.pixels;
            codes[k] = Vector::read(pixels, at);
            // Sobel.
            let falling = Vector::read(pixels, below + 1) - Vector::read(pixels, above - 1);
            let rising = Vector::read(pixels, above + 1) - Vector::read(pixels, below - 1);
            let scale = Vector::all(0.125);
            let twice = Vector::all(0.25);
            slope_x[k] = scale * (falling + rising)
                + twice * (Vector::read(pixels, at + 1) - Vector::read(pixels, at - 1));
            slope_y[k] = scale * (falling - rising)
                + twice * (Vector::read(pixels, below) - Vector::read(pixels, above));
            sum_x = sum_x + slope_x[k];
            sum_y = sum_y + slope_y[k];
        }
        let [mean_x, mean_y] = sums(&[sum_x, sum_y]).map(|sum| Vector::all(sum / AREA));
        let [mut xx, mut xy, mut yy] = [Vector::default(); 3];
        for (x, y) in slope_x.iter_mut().zip(&mut slope_y) {
            *x = *x - mean_x;
            *y = *y - mean_y;
            xx = xx + *x * *x;
            xy = xy + *x * *y;
            yy = yy + *y * *y;
        }
        let [xx, xy, yy] = sums(&[xx, xy, yy]);
        let (xx, yy) = (xx + DAMPING, yy + DAMPING);
        let scale = 1.0 / (xx * yy - xy * xy);
        Self {
            corner,
            codes,
            slope_x,
            slope_y,
            inverse: [scale * yy, -scale * xy, scale * xx],
        }
    }

    /// Codes of `to` (continued by [`BORDER`]) at an offset, less the patch's.
    #[inline(always)]
    fn misses(&self, to: &Raster<f32>, offset: [f32; 2]) -> Block {
        let (left, x) = place(self.corner[0], offset[0], to.width);
        let (top, y) = place(self.corner[1], offset[1], to.height);
        let mut out = Block::default();
        let mut above = between(to, top, left, x);
        for (k, (out, codes)) in out.iter_mut().zip(self.codes).enumerate() {
            let below = between(to, top + k + 1, left, x);
            *out = above + y * (below - above) - codes;
            above = below;
        }
        out
    }

    /// The patch compared with `to` (continued by [`BORDER`]) at an offset.
    #[inline(always)]
    fn at(&self, to: &Raster<f32>, offset: [f32; 2]) -> Trial {
        let misses = self.misses(to, offset);
        let [mut mean, mut squares, mut dx, mut dy] = [Vector::default(); 4];
        for (miss, (x, y)) in misses
            .into_iter()
            .zip(self.slope_x.into_iter().zip(self.slope_y))
        {
            mean = mean + miss;
            squares = squares + miss * miss;
            dx = dx + miss * x;
            dy = dy + miss * y;
        }
        let [mean, squares, dx, dy] = sums(&[mean, squares, dx, dy]);
        let [xx, xy, yy] = self.inverse;
        let miss = squares - mean * mean / AREA;
        Trial {
            offset,
            miss,
            step: [-(xx * dx + xy * dy), -(xy * dx + yy * dy)],
        }
    }

    /// The better of `best` and an offset.
    #[inline(always)]
    fn better(&self, to: &Raster<f32>, best: Trial, offset: [f32; 2]) -> Trial {
        if (offset[0] - best.offset[0])
            .abs()
            .max((offset[1] - best.offset[1]).abs())
            < ALIKE
        {
            return best;
        }
        let trial = self.at(to, offset);
        if trial.miss < best.miss { trial } else { best }
    }

    /// The best offset from `start` on.
    #[inline(always)]
    fn descend(&self, to: &Raster<f32>, start: Trial, steps: usize) -> Trial {
        let mut best = start;
        for _ in 0..steps {
            let [dx, dy] = best.step;
            if dx * dx + dy * dy < STILL * STILL {
                break;
            }
            let next = self.at(to, [best.offset[0] + dx, best.offset[1] + dy]);
            if next.miss >= best.miss {
                break;
            }
            best = next;
        }
        let (dx, dy) = (
            best.offset[0] - start.offset[0],
            best.offset[1] - start.offset[1],
        );
        // Farther than a patch is most likely another place alike.
        if dx * dx + dy * dy > AREA {
            start
        } else {
            best
        }
    }
}

/// Offsets of all pixels by patches: each begins from `field`, from `start` or from its neighbours,
/// and a pixel takes the mean of the patches around it, by how well they match there.
fn matched(
    from: &Raster<f32>,
    to: &Raster<f32>,
    field: &Field,
    start: Option<[&Raster<f32>; 2]>,
    settings: &FlowSettings,
) -> Field {
    let size = from.size();
    let stride = settings.stride.clamp(1, PATCH);
    let corners = |length: usize| -> Vec<usize> {
        let last = length - PATCH;
        (0..=last.div_ceil(stride))
            .map(|i| (i * stride).min(last))
            .collect()
    };
    let (columns, rows) = (corners(size.0), corners(size.1));
    let (from, to) = (&continued(from), &continued(to));
    let steps = settings.descent_iterations.div_ceil(2);
    vectorized(
        #[inline(always)]
        || {
            let across = columns.len();
            let mut patches = Vec::with_capacity(across * rows.len());
            let mut found: Vec<Trial> = Vec::with_capacity(across * rows.len());
            for n in 0..across * rows.len() {
                let [x, y] = [columns[n % across], rows[n / across]];
                let patch = Patch::new(from, [x, y]);
                let middle = (y + PATCH / 2) * size.0 + x + PATCH / 2;
                let mut best = patch.at(to, [field[0].pixels[middle], field[1].pixels[middle]]);
                if let Some([x, y]) = start {
                    best = patch.better(to, best, [x.pixels[middle], y.pixels[middle]]);
                }
                if n % across > 0 {
                    best = patch.better(to, best, found[n - 1].offset);
                }
                if n >= across {
                    best = patch.better(to, best, found[n - across].offset);
                }
                found.push(patch.descend(to, best, steps));
                patches.push(patch);
            }
            for n in (0..found.len()).rev() {
                let mut best = found[n];
                if (n + 1) % across > 0 {
                    best = patches[n].better(to, best, found[n + 1].offset);
                }
                if n + across < found.len() {
                    best = patches[n].better(to, best, found[n + across].offset);
                }
                if best.miss < found[n].miss {
                    found[n] = patches[n].descend(to, best, steps);
                }
            }
            spread(to, &patches, &found, size)
        },
    )
}

/// Means of the patches' offsets around each pixel.
#[inline(always)]
fn spread(
    to: &Raster<f32>,
    patches: &[Patch],
    found: &[Trial],
    (width, height): (usize, usize),
) -> Field {
    let mut x = Raster::filled(width, height, 0.0);
    let mut y = x.clone();
    let mut weights = vec![0.0; width * height];
    for (patch, trial) in patches.iter().zip(found) {
        let misses = patch.misses(to, trial.offset);
        for (k, miss) in misses.iter().enumerate() {
            let at = (patch.corner[1] + k) * width + patch.corner[0];
            let weight = Vector::all(1.0) / miss.magnitude();
            for (sum, value) in [
                (&mut x.pixels, trial.offset[0]),
                (&mut y.pixels, trial.offset[1]),
                (&mut weights, 1.0),
            ] {
                (Vector::read(sum, at) + weight * Vector::all(value)).write(sum, at);
            }
        }
    }
    for ((x, y), weight) in x.pixels.iter_mut().zip(&mut y.pixels).zip(&weights) {
        *x /= weight;
        *y /= weight;
    }
    [x, y]
}

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
    for p in 0..width * height {
        let (x, y) = (
            (p % width) as f32 + field[0].pixels[p],
            (p / width) as f32 + field[1].pixels[p],
        );
        let inside = (
            x.clamp(0.0, (width - 1) as f32),
            y.clamp(0.0, (height - 1) as f32),
        );
        seen[p] = if inside == (x, y) { 1.0 } else { 0.0 };
        let (left, top) = (
            (inside.0 as usize).min(width - 2),
            (inside.1 as usize).min(height - 2),
        );
        let (x, y) = (inside.0 - left as f32, inside.1 - top as f32);
        let (above, below) = (
            &to.pixels[top * width + left..][..2],
            &to.pixels[(top + 1) * width + left..][..2],
        );
        let (a, b) = (
            above[0] + x * (above[1] - above[0]),
            below[0] + x * (below[1] - below[0]),
        );
        codes[p] = a + y * (b - a);
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
        if half == 0 {
            (&even[1..], odd)
        } else {
            (&odd[1..], &even[1..])
        }
    }

    #[inline(always)]
    fn split(self, row: &[f32], out: &mut [f32]) {
        let (even, odd) = out.split_at_mut(self.length());
        for ((pair, even), odd) in row.chunks(2).zip(&mut even[1..]).zip(&mut odd[1..]) {
            *even = pair[0];
            *odd = pair[pair.len() - 1];
        }
    }
}

/// Data term of a refinement of `field`: vectors of both halves of each row. A miss is that of
/// offset 0, by linearisation at `field`; misses and slopes are divided by the slopes' length.
#[inline(always)]
fn data_terms(
    from: &Raster<f32>,
    to: &Raster<f32>,
    field: &Field,
    halves: Halves,
) -> Vec<[Vector; TERMS]> {
    let (width, height) = from.size();
    let (pulled, seen) = pulled(to, field);
    let mean: Vec<f32> = from
        .pixels
        .iter()
        .zip(&pulled)
        .map(|(a, b)| 0.5 * (a + b))
        .collect();
    let miss: Vec<f32> = from
        .pixels
        .iter()
        .zip(&pulled)
        .map(|(a, b)| b - a)
        .collect();
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
        let (u, v, seen) = (
            &field[0].pixels[at.clone()],
            &field[1].pixels[at.clone()],
            &seen[at.clone()],
        );
        for (sources, out) in sources.iter().zip(row.chunks_mut(3 * width)) {
            let (sx, sy, miss) = (
                &sources[0][at.clone()],
                &sources[1][at.clone()],
                &sources[2][at.clone()],
            );
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
        for (k, (row, split)) in row
            .chunks_exact(width)
            .zip(split.chunks_exact_mut(halves.stride()))
            .enumerate()
        {
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
fn refine(from: &Raster<f32>, to: &Raster<f32>, field: &mut Field, settings: &FlowSettings) {
    if settings.refinement_iterations == 0 {
        return;
    }
    let (width, height) = from.size();
    let halves = Halves {
        width,
        vectors: width.div_ceil(2 * PATCH),
    };
    let (stride, size) = (halves.stride(), 2 * halves.vectors);
    vectorized(
        #[inline(always)]
        || {
            let terms = data_terms(from, to, field, halves);
            let mut u = vec![0.0; (height + 2) * stride];
            let mut v = u.clone();
            for (plane, field) in [&mut u, &mut v].into_iter().zip(field.iter()) {
                for (out, row) in plane[stride..]
                    .chunks_exact_mut(stride)
                    .zip(field.pixels.chunks_exact(width))
                {
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
                            let (half, at) = (
                                step % 2,
                                row % (2 * SWEEPS) * size + step % 2 * halves.vectors,
                            );
                            let rows = [
                                &mut u[row * stride..][..3 * stride],
                                &mut v[row * stride..][..3 * stride],
                            ];
                            relax(halves, half, &kept[at..][..halves.vectors], rows);
                        }
                    }
                }
            }
            for (plane, field) in [&u, &v].into_iter().zip(field.iter_mut()) {
                for (p, out) in field.pixels.iter_mut().enumerate() {
                    *out = plane[(p / width + 1) * stride + halves.index(p % width)];
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
            let (ux, vx) = (
                Vector::read(a_side, at + 1) - a,
                Vector::read(b_side, at + 1) - b,
            );
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
        let (right, above, below) = (
            Vector::read(right, at),
            Vector::read(above, at),
            Vector::read(below, at),
        );
        let (u, v) = (Vector::read(u, at), Vector::read(v, at));
        let [
            sx,
            sy,
            miss,
            sxx,
            sxy,
            miss_x,
            syx,
            syy,
            miss_y,
            first_u,
            first_v,
        ] = *terms;
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
        *out = [
            left,
            right,
            above,
            below,
            shared,
            b1,
            b2,
            scale * own_v,
            scale * own_u,
        ];
    }
}

/// Half of the middle row of three, and its pixels' neighbours to the left, to the right, above and
/// below.
#[inline(always)]
fn neighbours(
    halves: Halves,
    rows: &mut [f32],
    half: usize,
) -> (&mut [[f32; PATCH]], [&[[f32; PATCH]]; 4]) {
    let (above, rows) = rows.split_at_mut(halves.stride());
    let (here, below) = rows.split_at_mut(halves.stride());
    let (even, odd) = here.split_at_mut(halves.length());
    let (here, side) = if half == 0 {
        (even, &*odd)
    } else {
        (odd, &*even)
    };
    let first = half * halves.length() + 1;
    let around = [
        &side[half..],
        &side[half + 1..],
        &above[first..],
        &below[first..],
    ];
    let around = around.map(|row| &row.as_chunks().0[..halves.vectors]);
    (&mut here[1..].as_chunks_mut().0[..halves.vectors], around)
}

/// Sum of a vector's neighbours, each by its tie.
#[inline(always)]
fn pull([a, b, c, d]: [&[[f32; PATCH]]; 4], k: usize, ties: [Vector; 4]) -> Vector {
    ties[0] * Vector(a[k])
        + ties[1] * Vector(b[k])
        + ties[2] * Vector(c[k])
        + ties[3] * Vector(d[k])
}

/// A sweep over half of the middle row of three: each pixel moves towards the solution of its
/// equations.
#[inline(always)]
fn relax(halves: Halves, half: usize, kept: &[[Vector; COEFFICIENTS]], [u, v]: [&mut [f32]; 2]) {
    let (u, around_u) = neighbours(halves, u, half);
    let (v, around_v) = neighbours(halves, v, half);
    let slow = Vector::all(1.0 - OMEGA);
    for (k, equations) in kept[..halves.vectors].iter().enumerate() {
        let [
            left,
            right,
            above,
            below,
            shared,
            b1,
            b2,
            inverse1,
            inverse2,
        ] = *equations;
        let ties = [left, right, above, below];
        let (pull_u, pull_v) = (pull(around_u, k, ties), pull(around_v, k, ties));
        let (a, b) = (Vector(u[k]), Vector(v[k]));
        let a = slow * a + (pull_u + b1 - shared * b) * inverse1;
        let b = slow * b + (pull_v + b2 - shared * a) * inverse2;
        u[k] = a.0;
        v[k] = b.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of 9 to 60 pixels.
    fn texture(x: f32, y: f32) -> f32 {
        let coarse = 30.0 * (0.09 * x + 0.05 * y).sin() + 30.0 * (0.06 * x - 0.11 * y).cos();
        128.0 + coarse + 20.0 * (0.31 * x + 0.42 * y).sin() + 20.0 * (0.52 * x - 0.37 * y).cos()
    }

    /// Mean error of a known warp's offsets in pixels, 5 pixels and more from the borders of both
    /// pictures.
    fn error(
        (width, height): (usize, usize),
        guess: Option<[f32; 2]>,
        warp: impl Fn(f32, f32) -> [f32; 2],
    ) -> f32 {
        let to = Raster::from_fn(width, height, |x, y| texture(x as f32, y as f32));
        let from = Raster::from_fn(width, height, |x, y| {
            let [dx, dy] = warp(x as f32, y as f32);
            texture(x as f32 + dx, y as f32 + dy)
        });
        let start = guess.map(|offset| vec![offset; width * height]);
        let found = flow(&from, &to, start.as_deref(), &FlowSettings::default());
        let near = |at: f32, length: usize| at > 4.0 && at < length as f32 - 5.0;
        let misses: Vec<f32> = (0..width * height)
            .filter_map(|p| {
                let (x, y) = ((p % width) as f32, (p / width) as f32);
                let [dx, dy] = warp(x, y);
                let inside = near(x, width)
                    && near(y, height)
                    && near(x + dx, width)
                    && near(y + dy, height);
                inside.then(|| (found[p][0] - dx).hypot(found[p][1] - dy))
            })
            .collect();
        misses.iter().sum::<f32>() / misses.len() as f32
    }

    #[test]
    fn a_shift_is_found_at_any_size() {
        for size in [(96, 80), (97, 81), (40, 61)] {
            let error = error(size, None, |_, _| [3.3, -2.6]);
            assert!(error < 0.1, "{size:?}: {error}");
        }
    }

    #[test]
    fn a_smooth_warp_is_found() {
        let warp = |x: f32, y: f32| {
            [
                4.0 * (0.03 * y).sin() + 1.0,
                3.0 * (0.025 * x + 0.01 * y).cos(),
            ]
        };
        let error = error((160, 128), None, warp);
        assert!(error < 0.15, "{error}");
    }

    #[test]
    fn a_start_is_followed() {
        let shift = [12.0, -12.0];
        let [without, with] = [None, Some(shift)].map(|start| error((48, 48), start, |_, _| shift));
        assert!(with < 0.1 && without > 1.0, "{with} {without}");
    }

    #[test]
    fn even_pictures_stay_in_place() {
        let picture = Raster::filled(50, 33, 77.0);
        assert!(
            flow(&picture, &picture, None, &FlowSettings::default())
                .iter()
                .all(|o| *o == [0.0; 2])
        );
    }

    #[test]
    fn offsets_are_finite_for_any_pictures() {
        let settings = FlowSettings {
            finest_scale: 1,
            stride: 0,
            ..FlowSettings::default()
        };
        for size in [(0, 0), (1, 1), (3, 200), (8, 8), (9, 21), (33, 70)] {
            let from = Raster::from_fn(size.0, size.1, |x, y| {
                if (x + y) % 5 == 0 {
                    f32::NAN
                } else {
                    (x * y) as f32
                }
            });
            let to = Raster::from_fn(size.0, size.1, |x, _| {
                if x % 3 == 0 { f32::INFINITY } else { -9.0 }
            });
            let start = vec![[f32::NAN, f32::NEG_INFINITY]; size.0 * size.1];
            for settings in [&settings, &FlowSettings::default()] {
                let offsets = flow(&from, &to, Some(&start), settings);
                assert_eq!(offsets.len(), size.0 * size.1);
                assert!(offsets.iter().flatten().all(|v| v.is_finite()), "{size:?}");
            }
        }
        assert_eq!(
            flow(
                &Raster::filled(9, 9, 1.0),
                &Raster::filled(8, 9, 1.0),
                None,
                &settings
            ),
            [[0.0; 2]; 81]
        );
    }
}
