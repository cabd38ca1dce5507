//! Pixels that are NaN or infinite, filled from their neighbours.

use crate::raster::Image;

/// Largest distance of a filled pixel from a finite one; those beyond become black.
const REACH: usize = 16;

/// Fills the channels that are NaN or infinite, each with the mean of its finite neighbours, inwards from the edge of the
/// gap. Returns the number of pixels with such a channel.
pub(super) fn fill(light: &mut Image) -> usize {
    let (width, height) = light.size();
    let is_gap = |pixel: &[f32; 3]| pixel.iter().any(|v| !v.is_finite());
    let mut gaps: Vec<usize> = (0..light.pixels.len()).filter(|&at| is_gap(&light.pixels[at])).collect();
    let count = gaps.len();
    for _ in 0..REACH {
        if gaps.is_empty() {
            break;
        }
        let filled: Vec<[f32; 3]> = gaps
            .iter()
            .map(|&at| {
                let (x, y) = (at % width, at / width);
                let columns = x.saturating_sub(1)..(x + 2).min(width);
                let rows = y.saturating_sub(1)..(y + 2).min(height);
                let around = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
                let around: Vec<usize> = around.collect();
                let mean = |c: usize| {
                    let values = around.iter().map(|&at| light.pixels[at][c]);
                    let finite: Vec<f32> = values.filter(|v| v.is_finite()).collect();
                    // NaN if there are none.
                    finite.iter().sum::<f32>() / finite.len() as f32
                };
                let own = light.pixels[at];
                [0, 1, 2].map(|c| if own[c].is_finite() { own[c] } else { mean(c) })
            })
            .collect();
        gaps.iter().zip(filled).for_each(|(&at, pixel)| light.pixels[at] = pixel);
        gaps.retain(|&at| is_gap(&light.pixels[at]));
    }
    for at in gaps {
        light.pixels[at] = light.pixels[at].map(|v| if v.is_finite() { v } else { 0.0 });
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_from_their_edge_inwards() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        let mut light = Image::from_fn(5, 1, |x, _| [x as f32, 1.0, 2.0]);
        light.pixels[1] = [nan, inf, 2.0];
        light.pixels[2][0] = -inf;
        assert_eq!(fill(&mut light), 2);
        let red: Vec<f32> = light.pixels.iter().map(|p| p[0]).collect();
        assert_eq!(red, [0.0, 0.0, 3.0, 3.0, 4.0]);
        assert!(light.pixels.iter().all(|p| p[1..] == [1.0, 2.0]));

        // The middle takes part of the ring that was filled first.
        let mut light = Image::filled(5, 5, [0.5; 3]);
        (6..9).chain(11..14).chain(16..19).for_each(|at| light.pixels[at] = [nan; 3]);
        assert_eq!(fill(&mut light), 9);
        assert!(light.pixels.iter().flatten().all(|v| *v == 0.5), "{light:?}");
    }

    #[test]
    fn a_picture_without_finite_pixels_is_black() {
        let mut light = Image::filled(40, 1, [f32::NAN; 3]);
        light.pixels[0] = [1.0; 3];
        assert_eq!(fill(&mut light), 39);
        assert_eq!(light.pixels[REACH], [1.0; 3]);
        assert_eq!(light.pixels[REACH + 1], [0.0; 3]);
        let mut light = Image::filled(3, 3, [f32::NAN; 3]);
        assert_eq!(fill(&mut light), 9);
        assert!(light.pixels.iter().flatten().all(|v| *v == 0.0));
    }
}
