//! Patches that are found one by one.

use super::pyramid::{BORDER, continued};
use super::settings::FlowSettings;
use super::vector::{Block, PATCH, Vector, sums};
use imaging::Raster;
use reflectance::kernels::chunks::vectorized;

/// Pixels of a patch.
const AREA: f32 = (PATCH * PATCH) as f32;
/// Steps below this many pixels end a patch's descent.
const STILL: f32 = 0.01;
/// Offsets nearer than this to the best are not tried.
const ALIKE: f32 = 0.05;
/// Added to the squares of a patch's slopes: keeps even patches in place.
const DAMPING: f32 = 16.0;

/// Offsets along x and along y in pixels.
pub type Field = [Raster<f32>; 2];

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
            slope_x[k] =
                scale * (falling + rising) + twice * (Vector::read(pixels, at + 1) - Vector::read(pixels, at - 1));
            slope_y[k] =
                scale * (falling - rising) + twice * (Vector::read(pixels, below) - Vector::read(pixels, above));
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
        Self { corner, codes, slope_x, slope_y, inverse: [scale * yy, -scale * xy, scale * xx] }
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
        for (miss, (x, y)) in misses.into_iter().zip(self.slope_x.into_iter().zip(self.slope_y)) {
            mean = mean + miss;
            squares = squares + miss * miss;
            dx = dx + miss * x;
            dy = dy + miss * y;
        }
        let [mean, squares, dx, dy] = sums(&[mean, squares, dx, dy]);
        let [xx, xy, yy] = self.inverse;
        let miss = squares - mean * mean / AREA;
        Trial { offset, miss, step: [-(xx * dx + xy * dy), -(xy * dx + yy * dy)] }
    }

    /// The better of `best` and an offset.
    #[inline(always)]
    fn better(&self, to: &Raster<f32>, best: Trial, offset: [f32; 2]) -> Trial {
        if (offset[0] - best.offset[0]).abs().max((offset[1] - best.offset[1]).abs()) < ALIKE {
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
        let (dx, dy) = (best.offset[0] - start.offset[0], best.offset[1] - start.offset[1]);
        // Farther than a patch is most likely another place alike.
        if dx * dx + dy * dy > AREA { start } else { best }
    }
}

/// Offsets of all pixels by patches: each begins from `field`, from `start` or from its neighbours,
/// and a pixel takes the mean of the patches around it, by how well they match there.
pub fn matched(
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
        (0..=last.div_ceil(stride)).map(|i| (i * stride).min(last)).collect()
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
fn spread(to: &Raster<f32>, patches: &[Patch], found: &[Trial], (width, height): (usize, usize)) -> Field {
    let mut x = Raster::filled(width, height, 0.0);
    let mut y = x.clone();
    let mut weights = vec![0.0; width * height];
    for (patch, trial) in patches.iter().zip(found) {
        let misses = patch.misses(to, trial.offset);
        for (k, miss) in misses.iter().enumerate() {
            let at = (patch.corner[1] + k) * width + patch.corner[0];
            let weight = Vector::all(1.0) / miss.magnitude();
            for (sum, value) in
                [(&mut x.pixels, trial.offset[0]), (&mut y.pixels, trial.offset[1]), (&mut weights, 1.0)]
            {
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
