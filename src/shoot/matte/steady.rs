//! Averaging of mattes over time.

use super::flow::{Flow, MOST_NOISE};
use super::{quantile, window};
use imaging::resample::resize;
use imaging::{Encoded, Mask, Raster};
use rayon::prelude::*;

/// Coverage of an edge pixel.
const EDGE: std::ops::Range<f32> = 0.02..0.98;
/// Smallest confidence of a motion used for measuring.
const TRUSTED: f32 = 0.5;
/// Variance of encoded values of a camera with little noise: one in a hundred.
const LEAST_NOISE: f32 = 1e-4;

/// Difference of a matte from the previous one, carried along the motion: the mean of |α(t) − α(t−1)|, in `[0, 1]`,
/// over edge pixels with known motion. The temporal error of Erofeev et al. 2015 ("Perceptually motivated benchmark
/// for video matting", MESSDdt), without ground truth and not squared. `flow` leads from this frame to the previous
/// one. None if nothing can be compared.
pub fn flicker(now: &Mask, before: &Mask, flow: &Flow) -> Option<f32> {
    if now.size() != before.size() {
        return None;
    }
    let before = flow.warped_mask(before);
    let trust = resize(flow.trust(), now.width, now.height);
    let (mut sum, mut count) = (0.0_f64, 0_usize);
    for ((now, before), trust) in now.pixels.iter().zip(&before.pixels).zip(&trust.pixels) {
        if (EDGE.contains(now) || EDGE.contains(before)) && *trust > TRUSTED {
            sum += f64::from((now - before).abs());
            count += 1;
        }
    }
    (count > 0).then(|| (sum / count as f64) as f32)
}

/// A frame near the one whose matte is averaged.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour<'a> {
    pub picture: &'a Encoded,
    pub matte: &'a Mask,
    /// Motion from the averaged frame to this one.
    pub flow: &'a Flow,
}

/// Average of a matte with those of nearby frames, each carried along the motion and weighted by the confidence of
/// its motion and by the match of its picture with this one (a bilateral filter along the motion, as Bennett and
/// McMillan 2005 average pictures). Where motion or light differs, nothing is averaged, so nothing smears. Frames that
/// differ in size are skipped.
pub fn steadied(picture: &Encoded, matte: &Mask, others: &[Neighbour]) -> Mask {
    let size = picture.0.size();
    let mut sums: Vec<[f32; 2]> = matte.pixels.iter().map(|&a| [a, 1.0]).collect();
    for Neighbour { picture: other, matte: alpha, flow } in others {
        if other.0.size() != size || alpha.size() != size || matte.size() != size {
            continue;
        }
        let both: Raster<[f32; 4]> = Raster {
            width: size.0,
            height: size.1,
            pixels: (other.0.pixels.iter().zip(&alpha.pixels)).map(|(p, a)| [p[0], p[1], p[2], *a]).collect(),
        };
        let there = flow.warped(&both);
        let trust = resize(flow.trust(), size.0, size.1);
        let apart: Vec<[f32; 1]> = (there.pixels.par_iter().zip(&picture.0.pixels))
            .map(|(there, here)| {
                let squares = (0..3).map(|c| (there[c] - here[c]).powi(2));
                let mean = squares.sum::<f32>() / 3.0;
                // A NaN pixel matches nowhere.
                [if mean.is_finite() { mean } else { 1.0 }]
            })
            .collect();
        let near = window::sums(&apart, size, 1);
        let count = window::counts(size, 1);
        let mean: Vec<f32> = (near.par_iter().enumerate()).map(|(i, sum)| sum[0] / count(i)).collect();
        let noise = quantile(mean.iter().copied().step_by(7).collect(), 0.5);
        let noise = noise.unwrap_or(0.0).clamp(LEAST_NOISE, MOST_NOISE);
        (sums.par_iter_mut().enumerate()).for_each(|(i, [sum, weights])| {
            let weight = trust.pixels[i] * (-0.5 * mean[i] / noise).exp();
            *sum += weight * there.pixels[i][3];
            *weights += weight;
        });
    }
    Mask {
        width: matte.width,
        height: matte.height,
        pixels: (sums.iter()).map(|[sum, weights]| (sum / weights).clamp(0.0, 1.0)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow_picture;

    fn neighbour<'a>((picture, matte): (&'a Encoded, &'a Mask), flow: &'a Flow) -> Neighbour<'a> {
        Neighbour { picture, matte, flow }
    }

    /// A disc moving over a wall, and its mattes with wavering edges.
    fn moving(frame: usize, wavering: f32) -> (Encoded, Mask, Mask) {
        let at = 60.0 + 2.5 * frame as f32;
        let alpha = |grown: f32| {
            Mask::from_fn(140, 100, |x, y| {
                let off = (x as f32 + 0.5 - at).hypot(y as f32 + 0.5 - 50.0);
                ((28.0 + grown - off) / 2.0 + 0.5).clamp(0.0, 1.0)
            })
        };
        let truth = alpha(0.0);
        let picture = Raster::from_fn(140, 100, |x, y| {
            let a = truth.at(x, y);
            let skin = 0.6 + 0.1 * (0.5 * (x as f32 - at)).sin() * (0.4 * y as f32).cos();
            let wall = 0.25 + 0.05 * ((x / 6 + y / 8) % 2) as f32;
            [a * skin + (1.0 - a) * wall; 3]
        });
        let found = alpha(if frame.is_multiple_of(2) { wavering } else { -wavering });
        (Encoded(picture), found, truth)
    }

    #[test]
    fn edges_that_waver_are_steadied_and_edges_that_move_are_not_smeared() {
        let frames: Vec<_> = (0..6).map(|frame| moving(frame, 0.6)).collect();
        let flow = |from: usize, to: usize| {
            let small = |i: usize| flow_picture(&frames[i].0);
            Flow::between(&small(from), &small(to))
        };
        let steady = |i: usize| {
            let around = [i - 1, i + 1].map(|k| flow(i, k));
            let others = [(i - 1, &around[0]), (i + 1, &around[1])];
            let others = others.map(|(k, flow)| neighbour((&frames[k].0, &frames[k].1), flow));
            steadied(&frames[i].0, &frames[i].1, &others)
        };
        let off = |found: &Mask, truth: &Mask| {
            let pairs = found.pixels.iter().zip(&truth.pixels);
            pairs.map(|(a, b)| (a - b).abs()).sum::<f32>()
        };
        let (before, after) = (steady(2), steady(3));
        let back = flow(3, 2);
        let raw = flicker(&frames[3].1, &frames[2].1, &back).unwrap();
        let now = flicker(&after, &before, &back).unwrap();
        assert!(now < 0.6 * raw, "{raw} to {now}");
        assert!(off(&after, &frames[3].2) < off(&frames[3].1, &frames[3].2));
        // True mattes stay unchanged, up to interpolation losses.
        let true_flow = [flow(3, 2), flow(3, 4)];
        let others = [(2, &true_flow[0]), (4, &true_flow[1])];
        let others = others.map(|(k, flow)| neighbour((&frames[k].0, &frames[k].2), flow));
        let kept = steadied(&frames[3].0, &frames[3].2, &others);
        let mean = off(&kept, &frames[3].2) / kept.pixels.len() as f32;
        assert!(mean < 0.002, "{mean}");
    }

    #[test]
    fn a_cut_to_another_picture_averages_nothing() {
        let (picture, matte, _) = moving(0, 0.0);
        let other = Encoded(Raster::from_fn(140, 100, |x, _| [(x % 2) as f32; 3]));
        let flow = Flow::between(&flow_picture(&picture), &flow_picture(&other));
        let full = Mask::filled(140, 100, 1.0);
        let kept = steadied(&picture, &matte, &[neighbour((&other, &full), &flow)]);
        let most = (kept.pixels.iter().zip(&matte.pixels)).map(|(a, b)| (a - b).abs());
        let mean = most.sum::<f32>() / matte.pixels.len() as f32;
        assert!(mean < 0.005, "{mean}");
        let small = Mask::filled(3, 3, 1.0);
        assert_eq!(steadied(&picture, &matte, &[neighbour((&other, &small), &flow)]), matte);
        assert!(flicker(&matte, &small, &flow).is_none());
    }
}
