//! One exemplar's prediction of a frame.

use crate::blur::blur;
use crate::lamps::{LANES, Lamps, TurnedLamps};
use crate::matching::Match;
use crate::pose::Pose;
use crate::target::Target;
use crate::turn::turn_degrees;
use imaging::color::luminance;
use imaging::resample::resize_area;
use imaging::{Mask, Raster};
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;

/// Width of the likeness, as a natural logarithm of light.
const LIKENESS: f32 = 0.08;
/// Width of the consistency, as a forward–backward error: a share of the longer side.
const CONSISTENCY: f32 = 1.0 / 128.0;
/// Window of that error, and the largest error that counts, as shares of the longer side.
const CONSISTENCY_BLUR: f32 = 0.02;
const LARGEST_ERROR: f32 = 10.0 / 128.0;
/// Width in degrees of the blend between poses.
const POSE: f32 = 12.0;
/// Least likeness, consistency, coverage and weight of a pose: they keep a blend defined where no exemplar is like the frame.
const LEAST_LIKENESS: f32 = 1e-4;
const LEAST_CONSISTENCY: f32 = 0.1;
const LEAST_COVERAGE: f32 = 0.01;
const LEAST_POSE: f32 = 1e-9;
/// Coverage from which an exemplar shows a pixel's light. Below, noise takes its place, and the pixel is lit as the whole
/// subject is.
const KNOWN_COVERAGE: f32 = 0.02;
/// Pixels that a thread predicts at a time.
pub const PIXELS: usize = 128;

/// An exemplar's prediction of the frame.
pub struct Said {
    /// Roots of the OLATs, exact under the interview's light: `roots[(i · 3 + channel) · stride + lamp]` of the pixel
    /// `Target::pixels[i]`.
    pub roots: Vec<f32>,
    /// The lamps of the frame as those of the exemplar, by the turn of the head.
    pub turned: TurnedLamps,
    /// As [`Match::offsets`].
    pub offsets: Vec<[f32; 2]>,
    /// Number of the pose.
    pub number: usize,
    /// As [`Carried::unlike`], of this exemplar.
    pub unlike: Mask,
    /// Weight of the prediction in each pixel, by likeness and coverage.
    pub like: Mask,
    /// Weight of the pose by the turn of the head.
    pub pose: f32,
}

impl Target<'_> {
    /// The prediction of an exemplar in which the frame has these offsets.
    pub fn said(&self, pose: &Pose, offsets: Vec<[f32; 2]>) -> Said {
        let lamps = self.lamps;
        let found = self.matched(pose, offsets);
        let turned = [found.turn, found.body].map(|turn| lamps.turned(&turn, &pose.missing));
        let (mut roots, lit) = self.predicted(pose, &turned, &found);
        let [turned, _] = turned;
        let stride = lamps.stride;
        let coverage = found.pulled(&pose.mask);
        let usual = self.usual_roots(&roots);
        for ((roots, lit), &p) in roots.chunks_exact_mut((3 * stride).max(1)).zip(&lit).zip(&self.pixels) {
            let known = (coverage.pixels[p] / KNOWN_COVERAGE).min(1.0);
            for (c, roots) in roots.chunks_exact_mut(stride).enumerate() {
                let light = self.frame.plate.pixels[p][c].max(0.0);
                let scale = known * (light / lit[c].max(self.dark)).sqrt();
                let unknown = (1.0 - known) * light.sqrt();
                roots.iter_mut().zip(&usual[c]).for_each(|(root, usual)| *root = scale * *root + unknown * usual);
            }
        }
        let unlike = self.unlike(&self.spread(&lit).map(luminance), &coverage);
        let like = |((unlike, coverage), consistency): ((&f32, &f32), &f32)| {
            // Coverage has a part of its own.
            let miss = unlike - (1.0 - coverage);
            let likeness = gaussian(miss, LIKENESS) + LEAST_LIKENESS;
            likeness * (LEAST_CONSISTENCY + consistency) * (LEAST_COVERAGE + coverage)
        };
        let (width, height) = self.plate.size();
        let consistency = self.consistency(pose, &found);
        let pixels = unlike.pixels.iter().zip(&coverage.pixels).zip(&consistency.pixels);
        let like = Raster { width, height, pixels: pixels.map(like).collect() };
        Said {
            number: pose.number,
            unlike,
            roots,
            turned,
            offsets: found.offsets,
            like,
            pose: gaussian(turn_degrees(&found.turn), POSE) + LEAST_POSE,
        }
    }

    /// Roots of the whole subject's light, 1 under the interview's light, channel by channel.
    fn usual_roots(&self, roots: &[f32]) -> [Vec<f32>; 3] {
        let stride = self.lamps.stride;
        let mut sums = vec![0.0; 3 * stride];
        for roots in roots.chunks_exact((3 * stride).max(1)) {
            sums.iter_mut().zip(roots).for_each(|(sum, root)| *sum += root * root);
        }
        let weights = by_channel(self.lamps, self.weights);
        std::array::from_fn(|c| {
            let sums = &sums[c * stride..][..stride];
            let lit: f32 = sums.iter().zip(&weights[c]).map(|(sum, weight)| sum * weight).sum();
            sums.iter().map(|sum| (sum / lit.max(f32::MIN_POSITIVE)).sqrt()).collect()
        })
    }

    /// Forward–backward consistency of a match, 0 to 1. The match back has half the pixels a side of [`Self::found`].
    fn consistency(&self, pose: &Pose, found: &Match) -> Mask {
        let (width, height) = self.plate.size();
        let longer = width.max(height) as f32;
        let half =
            |picture: &Raster<f32>| resize_area(picture, (picture.width / 2).max(1), (picture.height / 2).max(1));
        let back = self.offsets(&half(&pose.contrast), &half(&self.contrast));
        let largest = (LARGEST_ERROR * longer).powi(2);
        let squares = found.forward_backward(&back).into_iter().zip(&self.matte.pixels);
        let pixels = squares.map(|(square, inside)| inside * square.min(largest)).collect();
        let squares = blur(&Raster { width, height, pixels }, CONSISTENCY_BLUR * longer);
        squares.map(|square| gaussian(square.max(0.0).sqrt(), CONSISTENCY * longer))
    }

    /// Roots of the OLATs that the pose alone predicts, as [`Said::roots`], and their sums under the interview's light. `turned`:
    /// lamps of the head, and of all else.
    pub fn predicted(&self, pose: &Pose, turned: &[TurnedLamps; 2], found: &Match) -> (Vec<f32>, Vec<[f32; 3]>) {
        let (lamps, weights) = (self.lamps, self.weights);
        let stride = lamps.stride;
        let weights = by_channel(lamps, weights);
        let energies = by_channel(lamps, &lamps.energies)
            .map(|energies| energies.into_iter().map(f32::sqrt).collect::<Vec<f32>>());
        let mut roots = vec![0.0; self.pixels.len() * 3 * stride];
        let mut lit = vec![[0.0; 3]; self.pixels.len()];
        let width = found.size.0;
        roots
            .par_chunks_mut((PIXELS * 3 * stride).max(1))
            .zip(lit.par_chunks_mut(PIXELS))
            .zip(self.pixels.par_chunks(PIXELS))
            .for_each(|((roots, lit), pixels)| {
                let (mut shades, mut pulled) = (vec![0.0; stride], vec![0.0; 3 * stride]);
                let mut blended = vec![0.0; 3 * stride];
                vectorized(
                    #[inline(always)]
                    || {
                        let rows = roots.chunks_exact_mut(3 * stride).zip(lit.iter_mut());
                        for ((roots, lit), &p) in rows.zip(pixels) {
                            let places = found.place((p % width, p / width));
                            pose.bare.pull(places, &mut pulled);
                            let normal = pose.normal(places);
                            let share = self.head.pixels[p];
                            for (turned, share) in turned.iter().zip([share, 1.0 - share]) {
                                if share <= 0.0 {
                                    continue;
                                }
                                turned.shade(normal, &mut shades);
                                shades.iter_mut().for_each(|shade| *shade = share * shade.sqrt());
                                turned.blend(&pulled, &mut blended);
                                let channels = roots.chunks_exact_mut(stride).zip(&energies);
                                for ((roots, energies), blended) in channels.zip(blended.chunks_exact(stride)) {
                                    let lamps = blended.iter().zip(&shades).zip(energies);
                                    for (root, ((blended, shade), energy)) in roots.iter_mut().zip(lamps) {
                                        *root += shade * energy * blended;
                                    }
                                }
                            }
                            let channels = roots.chunks_exact(stride).zip(&weights);
                            for (lit, (roots, weights)) in lit.iter_mut().zip(channels) {
                                *lit = weighted_squares(roots, weights);
                            }
                        }
                    },
                );
            });
        (roots, lit)
    }
}

/// Sum of squares of roots, each by its weight, for a whole number of vectors.
#[inline(always)]
fn weighted_squares(roots: &[f32], weights: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (roots, weights) in roots.as_chunks::<LANES>().0.iter().zip(weights.as_chunks::<LANES>().0) {
        for ((sum, root), weight) in sums.iter_mut().zip(roots).zip(weights) {
            *sum += weight * root * root;
        }
    }
    sums.iter().sum()
}

/// 1 at 0, e^−½ at `width`.
pub fn gaussian(v: f32, width: f32) -> f32 {
    (-0.5 * (v / width).powi(2)).exp()
}

/// Values of lamps, channel by channel, padded.
pub fn by_channel(lamps: &Lamps, values: &[[f32; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|c| lamps.padded(values.iter().map(|value| value[c])))
}
