//! OLATs at shadow edges: a lamp's cast and attached shadows, which are not visible in the picture of all lamps.

use super::metrics::{Compared, SUBJECT, code, decibels};
use imaging::color::luminance;
use imaging::{Mask, Raster};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Least slope of the code across the picture's longer side that counts as an edge in a lamp's truth.
const STEEP: f32 = 8.4;
/// Least ratio of an edge's slope to that of the mean over the lamps.
const OWN: f32 = 2.0;
/// Margin from the matte's edge without shadow edges, as a share of the picture's longer side.
const INNER: f64 = 1.0 / 40.0;

/// Accuracy of OLATs at shadow edges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShadowEdges {
    /// Share of the pixels that are edges, over all lamps, away from the subject's outline.
    pub share: f64,
    /// Share of the squared error at the edges, away from the outline.
    pub error_share: f64,
    /// PSNR at the edges.
    pub psnr_db: f64,
}

/// Measures frames' OLATs at shadow edges, with predictions multiplied by `scale`; None if the truth has no such edge.
pub fn shadow_edges(frames: &[Compared], scale: f64) -> Option<ShadowEdges> {
    // Pixels and squared errors, at edges and in total.
    let mut sums = [[0.0f64; 2]; 2];
    for frame in frames {
        let exposure = frame.exposure();
        let inner = inner(frame.mask);
        let coded = |value: &dyn Fn(usize) -> f64| Raster {
            width: frame.mask.width,
            height: frame.mask.height,
            pixels: (0..inner.len()).map(|p| code(exposure * value(p)) as f32).collect(),
        };
        let lamps = frame.truths.len().max(1) as f64;
        let mean = coded(&|p| {
            let lit = frame.truths.iter().map(|truth| f64::from(luminance(truth.pixels[p])));
            lit.sum::<f64>() / lamps
        });
        let common: Vec<f32> = (0..inner.len()).map(|p| slope(&mean, p, inner[p])).collect();
        let steep = STEEP / frame.mask.width.max(frame.mask.height) as f32;
        let lamp_sums: Vec<[[f64; 2]; 2]> = (frame.pictures.par_iter().zip(frame.truths))
            .map(|(picture, truth)| {
                let codes = coded(&|p| f64::from(luminance(truth.pixels[p])));
                let mut sums = [[0.0; 2]; 2];
                for p in (0..inner.len()).filter(|&p| inner[p]) {
                    let pair = picture.pixels[p].iter().zip(&truth.pixels[p]);
                    let squares = pair.map(|(&picture, &truth)| {
                        let [picture, truth] =
                            [f64::from(picture) * scale, f64::from(truth)].map(|v| code(exposure * v));
                        (picture - truth).powi(2)
                    });
                    let square = squares.sum::<f64>() / 3.0;
                    let is_edge = slope(&codes, p, true) > steep.max(OWN * common[p]);
                    for (sum, counts) in sums.iter_mut().zip([is_edge, true]) {
                        if counts {
                            *sum = [sum[0] + 1.0, sum[1] + square];
                        }
                    }
                }
                sums
            })
            .collect();
        for lamp_sum in lamp_sums {
            for (sum, lamp_sum) in sums.iter_mut().zip(lamp_sum) {
                *sum = [sum[0] + lamp_sum[0], sum[1] + lamp_sum[1]];
            }
        }
    }
    let [[edges, error], [pixels, errors]] = sums;
    (edges > 0.0).then(|| ShadowEdges {
        share: edges / pixels,
        error_share: if errors > 0.0 { error / errors } else { 0.0 },
        psnr_db: decibels(error / edges),
    })
}

/// Pixels of the subject away from its outline and from the picture's borders.
fn inner(mask: &Mask) -> Vec<bool> {
    let (width, height) = mask.size();
    let reach = ((width.max(height) as f64 * INNER) as usize).max(1);
    let solid: Vec<bool> = mask.pixels.iter().map(|&alpha| alpha > SUBJECT).collect();
    // A square is solid if its columns are, and columns are if their pixels are.
    let shrunk = |solid: &[bool], length: usize, step: usize, at: &dyn Fn(usize) -> usize| {
        let within = |p: usize| {
            let place = at(p);
            place >= reach && place + reach < length && (0..=2 * reach).all(|i| solid[p + i * step - reach * step])
        };
        (0..solid.len()).map(within).collect::<Vec<bool>>()
    };
    let columns = shrunk(&solid, height, width.max(1), &|p| p / width.max(1));
    shrunk(&columns, width, 1, &|p| p % width.max(1))
}

/// Slope of the codes per pixel, by Sobel's operator; 0 at the borders.
fn slope(codes: &Raster<f32>, p: usize, inner: bool) -> f32 {
    if !inner {
        return 0.0;
    }
    let width = codes.width;
    let at = |dx: usize, dy: usize| codes.pixels[p + dy * width + dx - width - 1];
    let across = at(2, 0) + 2.0 * at(2, 1) + at(2, 2) - at(0, 0) - 2.0 * at(0, 1) - at(0, 2);
    let down = at(0, 2) + 2.0 * at(1, 2) + at(2, 2) - at(0, 0) - 2.0 * at(1, 0) - at(2, 0);
    across.hypot(down) / 8.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    /// Light that ends at column `end`, over a texture common to all lamps.
    fn lit_up_to(end: usize) -> Image {
        Raster::from_fn(80, 80, |x, y| {
            let texture = if y % 16 < 8 { 0.4 } else { 0.3 };
            [if x < end { texture } else { 0.004 }; 3]
        })
    }

    #[test]
    fn an_edge_is_one_lamp_s_own() {
        let mask = Mask::filled(80, 80, 1.0);
        let truths = [lit_up_to(30), lit_up_to(50), lit_up_to(80), lit_up_to(80)];
        let measured = |pictures: &[Image], truths: &[Image]| {
            let frame = Compared { pictures, truths, mask: &mask };
            shadow_edges(&[frame], 1.0)
        };
        let exact = measured(&truths, &truths).unwrap();
        // Two columns of 76 in two of four pictures.
        assert!((exact.share - 2.0 / 76.0 / 2.0).abs() < 0.003, "{exact:?}");
        assert_eq!((exact.error_share, exact.psnr_db), (0.0, 120.0));
        // Shadows that end five pixels off are wrong at the true edge too.
        let moved = [lit_up_to(35), lit_up_to(55), lit_up_to(80), lit_up_to(80)];
        let moved = measured(&moved, &truths).unwrap();
        assert!(moved.error_share > 0.1 && moved.psnr_db < 12.0, "{moved:?}");
        // Errors away from the edges do not count.
        let dark = truths
            .clone()
            .map(|olat| Raster::from_fn(80, 80, |x, y| olat.at(x, y).map(|v| if x < 20 { 0.5 * v } else { v })));
        let dark = measured(&dark, &truths).unwrap();
        assert_eq!((dark.error_share, dark.psnr_db), (0.0, 120.0));
        // Texture common to all lamps is not a shadow.
        let even = [lit_up_to(80), lit_up_to(80)];
        assert!(measured(&even, &even).is_none());
        let small = Mask::filled(80, 80, 0.0);
        let frame = Compared { pictures: &truths, truths: &truths, mask: &small };
        assert!(shadow_edges(&[frame], 1.0).is_none());
    }
}
