//! Guide image: position of a pixel on the subject as a colour, by a mixture of Gaussians of random colours, as in Texler et
//! al. In the paper a deformation from the keyframe moves them; here they are laid over the matte's
//! centre and extent, in keyframe and frame alike.

use super::learner::draw;
use imaging::{Image, Mask};
use rand::RngExt;
use rayon::prelude::*;

/// Gaussians on each side of the grid.
const SIDE: usize = 6;
/// Half the grid's side, in units of the root of the matte's area.
const REACH: f32 = 1.25;
/// Standard deviation, in the grid's steps.
const WIDTH: f32 = 0.6;

/// The guide of a matte, each channel from 0 to 1; zero outside the matte.
pub fn guide(mask: &Mask, seed: u64) -> Image {
    let (w, h) = mask.size();
    let (mut area, mut middle) = (0.0f32, [0.0f32; 2]);
    for y in 0..h {
        for x in 0..w {
            let alpha = mask.at(x, y);
            area += alpha;
            middle[0] += alpha * (x as f32 + 0.5);
            middle[1] += alpha * (y as f32 + 0.5);
        }
    }
    let middle = middle.map(|m| m / area.max(1.0));
    let unit = area.max(1.0).sqrt();
    let step = 2.0 * REACH / (SIDE - 1) as f32;
    let mut rng = draw(seed, 0, 17);
    let mut blobs = Vec::with_capacity(SIDE * SIDE);
    for row in 0..SIDE {
        for column in 0..SIDE {
            let mut place = |i: usize| {
                let jitter: f32 = rng.random_range(-0.3..0.3);
                (i as f32 + jitter) * step - REACH
            };
            let place = [place(column), place(row)];
            let colour: [f32; 3] = std::array::from_fn(|_| rng.random_range(0.0..1.0));
            blobs.push((place, colour));
        }
    }
    let pixels = (0..w * h).into_par_iter().map(|i| {
        let at = [i % w, i / w];
        let at: [f32; 2] = std::array::from_fn(|a| (at[a] as f32 + 0.5 - middle[a]) / unit);
        let (mut sum, mut weights) = ([0.0; 3], 1e-12);
        for (place, colour) in &blobs {
            let square: f32 = (0..2).map(|a| (at[a] - place[a]).powi(2)).sum();
            let weight = (-0.5 * square / (WIDTH * step).powi(2)).exp();
            weights += weight;
            for c in 0..3 {
                sum[c] += weight * colour[c];
            }
        }
        sum.map(|v| mask.pixels[i] * v / weights)
    });
    Image { width: w, height: h, pixels: pixels.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_moves_with_the_subject_and_tells_places_apart() {
        let block = |left: usize, top: usize| {
            Mask::from_fn(48, 48, |x, y| {
                let inside = (left..left + 20).contains(&x) && (top..top + 20).contains(&y);
                f32::from(u8::from(inside))
            })
        };
        let (here, there) = (guide(&block(4, 6), 3), guide(&block(21, 17), 3));
        let mut differ = 0.0f32;
        for y in 0..20 {
            for x in 0..20 {
                let (a, b) = (here.at(4 + x, 6 + y), there.at(21 + x, 17 + y));
                let off = |a: [f32; 3], b: [f32; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
                assert!(off(a, b) < 1e-4, "{a:?} {b:?}");
                differ = differ.max(off(a, here.at(4, 6)));
            }
        }
        assert!(differ > 0.2, "{differ}");
        assert_eq!(here.at(0, 0), [0.0; 3]);
        // No matte to lay it over.
        let empty = guide(&Mask::filled(8, 8, 0.0), 3);
        assert!(empty.pixels.iter().flatten().all(|v| *v == 0.0));
    }
}
