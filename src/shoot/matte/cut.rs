//! Cut of a large picture: made at a reduced size, with soft edges at full size.

use super::parts::drop_loose;
use super::refine::guided;
use super::{Matte, linear, window};
use imaging::color::srgb_from_linear;
use imaging::resample::{resize, resize_area};
use imaging::{Encoded, Mask, Raster};
use rayon::prelude::*;

/// Longer side of the reduced picture. Finer edges are found afterwards.
const CUT_SIDE: usize = 480;
/// Rounds of fitting colours and cutting.
pub const ROUNDS: usize = 8;

/// A picture reduced for the cut.
pub struct Reduced {
    /// Light of the picture at full size.
    pub light: Raster<[f32; 3]>,
    /// The reduced picture.
    pub small: Encoded,
}

impl Reduced {
    pub fn from_picture(picture: &Encoded) -> Self {
        let size = picture.0.size();
        let light = Raster { width: size.0, height: size.1, pixels: linear(picture) };
        let small = reduced_size(size);
        let small = if small == size {
            picture.clone()
        } else {
            Encoded(resize_area(&light, small.0, small.1).map(|p| p.map(srgb_from_linear)))
        };
        Self { light, small }
    }

    /// A cut at the reduced size, enlarged to the picture: true for each pixel inside.
    pub fn enlarged(&self, cut: &[bool]) -> Vec<bool> {
        let (width, height) = self.small.0.size();
        let cut = Mask { width, height, pixels: cut.iter().map(|&s| f32::from(u8::from(s))).collect() };
        let (width, height) = self.light.size();
        (resize(&cut, width, height).pixels.iter()).map(|&share| share >= 0.5).collect()
    }

    /// Matte of a cut at the reduced size. `behind` is the background's light, if known.
    pub fn matte(&self, cut: &[bool], behind: Option<&[[f32; 3]]>) -> Matte {
        let size = self.light.size();
        let inside = self.enlarged(cut);
        // Possible error of the reduced cut plus the width of a soft edge.
        let reach = 2 + size.0.max(size.1) / CUT_SIDE;
        soft(&self.light.pixels, &inside, size, reach, behind)
    }
}

/// Size of the reduced picture.
pub fn reduced_size(size: (usize, usize)) -> (usize, usize) {
    let longer = size.0.max(size.1).max(1);
    let side = |full: usize| (full * longer.min(CUT_SIDE)).div_ceil(longer);
    (side(size.0), side(size.1))
}

/// Soft edges of a hard cut. Within `reach` pixels of its border, coverage is the position of a pixel's colour
/// between the nearby background and subject colours. `behind_light` is the background's light, if known at every
/// pixel.
fn soft(
    light: &[[f32; 3]],
    inside: &[bool],
    size: (usize, usize),
    reach: usize,
    behind_light: Option<&[[f32; 3]]>,
) -> Matte {
    let binary: Vec<[f32; 1]> = inside.iter().map(|&i| [f32::from(u8::from(i))]).collect();
    let near = window::sums(&binary, size, reach);
    let count = window::counts(size, reach);
    let places = 0..light.len();
    let core: Vec<bool> = (places.clone().map(|i| near[i][0] > count(i) - 0.5)).collect();
    let behind: Vec<bool> = near.iter().map(|[n]| *n < 0.5).collect();
    let around = |certain: &[bool], side: bool| {
        // A subject thinner than the reach has no core, so all of its side is used.
        let some = certain.contains(&true);
        let known: Vec<bool> = if some { certain.to_vec() } else { inside.iter().map(|&i| i == side).collect() };
        let total = known.iter().filter(|k| **k).count().max(1) as f32;
        let mut mean = [0.0_f32; 3];
        for (_, p) in known.iter().zip(light).filter(|(known, _)| **known) {
            for (mean, v) in mean.iter_mut().zip(p) {
                *mean += v / total;
            }
        }
        window::means(|i| light[i], &known, size, 2 * reach, vec![mean; light.len()])
    };
    let subject = around(&core, true);
    let background = behind_light.map_or_else(|| around(&behind, false), <[[f32; 3]]>::to_vec);
    let mixed: Vec<f32> = (places.clone().into_par_iter())
        .map(|i| {
            if core[i] || behind[i] {
                return f32::from(u8::from(core[i]));
            }
            let (to, from, at) = (subject[i], background[i], light[i]);
            let along: f32 = (0..3).map(|c| (at[c] - from[c]) * (to[c] - from[c])).sum();
            let length: f32 = (0..3).map(|c| (to[c] - from[c]).powi(2)).sum();
            // Where both sides have the same colour, the cut decides.
            if length > 1e-4 { (along / length).clamp(0.0, 1.0) } else { f32::from(u8::from(inside[i])) }
        })
        .collect();
    let smooth = guided(light, &mixed, size, 2);
    let in_doubt = |i: usize| !core[i] && !behind[i];
    let mut alpha: Vec<f32> = (places.clone()).map(|i| if in_doubt(i) { smooth[i] } else { mixed[i] }).collect();
    drop_loose(&mut alpha, size, inside);
    let uncertain = places.filter(|&i| in_doubt(i)).count() as f32 / alpha.len().max(1) as f32;
    Matte { mask: Mask { width: size.0, height: size.1, pixels: alpha }, uncertain }
}
