//! A frame that exemplars are carried over to.

use crate::blur::blur;
use crate::contrast::local_contrast;
use crate::flow::{FlowSettings, flow};
use crate::lamps::{Lamps, TurnedLamps, falloff};
use crate::matching::Match;
use crate::places::Place;
use crate::shape::{inside, quantile};
use crate::transfer::{Carried, Matched, Pose, Transfer};
use crate::turn::{SeenPoint, head_turn, turn_degrees};
use footage::Frame;
use glam::{Mat3, Vec3};
use imaging::color::luminance;
use imaging::resample::resize;
use imaging::{Image, Mask, Raster};
use rayon::prelude::*;
use reflectance::ReflectanceField;
use reflectance::kernels::chunks::vectorized;
use std::sync::Arc;

/// Windows of the local contrast of plates, of pictures under one light, and of the likeness, as shares of the picture's side.
pub const CONTRAST: f32 = 20.0 / 160.0;
const SAME_LIGHT: f32 = 40.0 / 160.0;
const LIKENESS_BLUR: f32 = 4.0 / 160.0;
/// Width of the likeness, as a natural logarithm of light.
const LIKENESS: f32 = 0.08;
/// Width in degrees of the blend between poses.
const POSE: f32 = 12.0;
/// [`Carried::unlike`] between frames, matched, at which the one beside counts e^−½.
const BESIDE: f32 = 0.3;
/// The same of the median pixel.
const NEXT: f32 = 0.06;
/// Least likeness, coverage and weight of a pose: they keep a blend defined where no exemplar is like the frame.
const LEAST_LIKENESS: f32 = 1e-4;
const LEAST_COVERAGE: f32 = 0.01;
const LEAST_POSE: f32 = 1e-9;
/// Light below this share of the subject's bright level says nothing.
const DARK: f32 = 2e-3 / 0.7;
/// Quantile of the subject's light that counts as its bright level.
const BRIGHT: f32 = 0.95;
/// Pixels from one point to the next of those that decide the turn of the head.
const POINTS: usize = 2;
/// [`Carried::unlike`] at which the exemplars' fine light counts half.
const UNKNOWN: f32 = 0.4;
/// Pixels that a thread predicts at a time.
const PIXELS: usize = 128;
/// Pictures are matched at half as many pixels a side again as the working size has, but at no more than this many.
const MOST_SIDE: usize = 384;

/// A frame that exemplars are carried over to.
pub struct Target<'a> {
    pub frame: &'a Frame,
    transfer: &'a Transfer,
    inside: Raster<bool>,
    /// 1 inside, else 0.
    matte: Mask,
    /// Numbers of the pixels that the matte covers at all.
    pixels: Vec<usize>,
    /// Luminance of the plate.
    pub plate: Raster<f32>,
    /// Its local contrast, to be matched with plates of poses, and with predictions.
    pub contrast: Raster<f32>,
    same_light: Raster<f32>,
    /// Light that says nothing.
    dark: f32,
}

/// An exemplar's prediction of the frame.
pub struct Said {
    /// Roots of the OLATs, exact under the interview's light: `roots[(i · 3 + channel) · stride + lamp]` of the pixel
    /// `Target::pixels[i]`.
    roots: Vec<f32>,
    /// The lamps of the frame as those of the exemplar.
    turned: TurnedLamps,
    /// As [`Match::offsets`].
    offsets: Vec<[f32; 2]>,
    /// Number of the pose.
    number: usize,
    /// As [`Carried::unlike`], of this exemplar.
    unlike: Mask,
    /// Weight of the prediction in each pixel, by likeness and coverage.
    like: Mask,
    /// Weight of the pose by its turn.
    pose: f32,
}

impl<'a> Target<'a> {
    pub fn new(frame: &'a Frame, transfer: &'a Transfer) -> Self {
        let plate = frame.plate.map(luminance);
        let bright = bright_level(&plate, &frame.mask);
        let inside = inside(&frame.mask);
        let matte = inside.map(|inside| f32::from(u8::from(inside)));
        Self {
            contrast: matched_contrast(&plate, &matte, CONTRAST),
            same_light: matched_contrast(&plate, &matte, SAME_LIGHT),
            pixels: (0..plate.pixels.len())
                .filter(|&p| frame.mask.pixels[p] > 0.0)
                .collect(),
            dark: (DARK * bright).max(f32::MIN_POSITIVE),
            matte,
            frame,
            transfer,
            inside,
            plate,
        }
    }

    /// Offsets of the frame in one exemplar. It is matched twice: under the interview's light, and by its first prediction,
    /// which has the light of the frame itself.
    pub fn found(&self, pose: &Pose) -> Vec<[f32; 2]> {
        let first = self.matched(pose, self.offsets(&self.contrast, &pose.contrast));
        let coverage = first.pulled(&pose.mask);
        let lamps = &self.transfer.lamps;
        let (_, lit) = self.predicted(pose, &lamps.turned(&first.turn), &first);
        let relit = self.spread(&lit).map(luminance);
        let covered = inside(&coverage).map(|inside| f32::from(u8::from(inside)));
        let more = self.offsets(
            &self.same_light,
            &matched_contrast(&relit, &covered, SAME_LIGHT),
        );
        self.moved(more).then(&first.offsets)
    }

    /// Offsets of the frame in the exemplars, the mean with those of frames beside it, which are followed along the motion
    /// between both and count by how well it explains them.
    pub fn steadied(&self, own: &Matched, beside: &[Arc<Matched>]) -> Vec<Vec<[f32; 2]>> {
        let mut sums = own.offsets.clone();
        let mut weights = vec![1.0; self.plate.pixels.len()];
        let same_size = |other: &&Arc<Matched>| other.frame.plate.size() == self.plate.size();
        for other in beside.iter().filter(same_size) {
            let there = Target::new(&other.frame, self.transfer);
            let motion = self.moved(self.offsets(&self.contrast, &there.contrast));
            let unlike = self.unlike(
                &motion.pulled(&there.plate),
                &motion.pulled(&other.frame.mask),
            );
            let mut sorted: Vec<f32> = (self.pixels.iter()).map(|&p| unlike.pixels[p]).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            // A pose that jumps says nothing of the pose before.
            let whole = gaussian(quantile(&sorted, 0.5), NEXT);
            let shares: Vec<f32> = (unlike.pixels.iter())
                .map(|unlike| whole * gaussian(*unlike, BESIDE))
                .collect();
            sums.par_iter_mut()
                .zip(&other.offsets)
                .for_each(|(sums, offsets)| {
                    let through = motion.then(offsets);
                    for ((sum, offset), share) in sums.iter_mut().zip(through).zip(&shares) {
                        *sum = [sum[0] + share * offset[0], sum[1] + share * offset[1]];
                    }
                });
            (weights.iter_mut().zip(&shares)).for_each(|(weight, share)| *weight += share);
        }
        for sums in &mut sums {
            for (sum, weight) in sums.iter_mut().zip(&weights) {
                *sum = sum.map(|sum| sum / weight);
            }
        }
        sums
    }

    /// The prediction of an exemplar in which the frame has these offsets.
    pub fn said(&self, pose: &Pose, offsets: Vec<[f32; 2]>) -> Said {
        let lamps = &self.transfer.lamps;
        let found = self.matched(pose, offsets);
        let turned = lamps.turned(&found.turn);
        let (mut roots, lit) = self.predicted(pose, &turned, &found);
        let stride = lamps.stride;
        for ((roots, lit), &p) in roots
            .chunks_exact_mut((3 * stride).max(1))
            .zip(&lit)
            .zip(&self.pixels)
        {
            for (c, roots) in roots.chunks_exact_mut(stride).enumerate() {
                let scale = (self.frame.plate.pixels[p][c].max(0.0) / lit[c].max(self.dark)).sqrt();
                roots.iter_mut().for_each(|root| *root *= scale);
            }
        }
        let coverage = found.pulled(&pose.mask);
        let unlike = self.unlike(&self.spread(&lit).map(luminance), &coverage);
        let like = |(unlike, coverage): (&f32, &f32)| {
            // Coverage has a part of its own.
            let miss = unlike - (1.0 - coverage);
            let likeness = gaussian(miss, LIKENESS) + LEAST_LIKENESS;
            likeness * (LEAST_COVERAGE + coverage)
        };
        let (width, height) = self.plate.size();
        let like = Raster {
            width,
            height,
            pixels: (unlike.pixels.iter().zip(&coverage.pixels))
                .map(like)
                .collect(),
        };
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

    /// Offsets between two pictures of local contrast, at the working size.
    pub fn offsets(&self, from: &Raster<f32>, to: &Raster<f32>) -> Vec<[f32; 2]> {
        let (width, height) = self.plate.size();
        let (w, h) = from.size();
        let large = flow(from, to, None, &FlowSettings::default());
        let scale = [width as f32 / w as f32, height as f32 / h as f32];
        let axis = |c: usize| {
            let plane = Raster {
                width: w,
                height: h,
                pixels: large.iter().map(|o| o[c] * scale[c]).collect(),
            };
            blur(&resize(&plane, width, height), 1.0)
        };
        axis(0)
            .pixels
            .into_iter()
            .zip(axis(1).pixels)
            .map(|(x, y)| [x, y])
            .collect()
    }

    /// Offsets without a turn of the head.
    pub fn moved(&self, offsets: Vec<[f32; 2]>) -> Match {
        Match {
            offsets,
            size: self.plate.size(),
            turn: Mat3::IDENTITY,
        }
    }

    /// A match with its turn of the head.
    fn matched(&self, pose: &Pose, offsets: Vec<[f32; 2]>) -> Match {
        let (width, height) = self.plate.size();
        let mut found = self.moved(offsets);
        let coverage = found.pulled(&pose.mask);
        let depth = found.pulled(&pose.depth);
        let middle = [width as f32 / 2.0, height as f32 / 2.0];
        let points: Vec<SeenPoint> = (0..width * height)
            .filter(|&p| (p % width).is_multiple_of(POINTS) && (p / width).is_multiple_of(POINTS))
            .filter(|&p| self.inside.pixels[p] && coverage.pixels[p] > 0.95)
            .map(|p| {
                let (x, y) = ((p % width) as f32, (p / width) as f32);
                let [dx, dy] = found.offsets[p];
                SeenPoint {
                    place: Vec3::new(x + dx - middle[0], middle[1] - y - dy, depth.pixels[p]),
                    seen: [x - middle[0], middle[1] - y],
                }
            })
            .collect();
        found.turn = head_turn(&points);
        found
    }

    /// Roots of the OLATs that the pose alone predicts, as [`Said::roots`], and their sums under the interview's light.
    fn predicted(
        &self,
        pose: &Pose,
        turned: &TurnedLamps,
        found: &Match,
    ) -> (Vec<f32>, Vec<[f32; 3]>) {
        let (lamps, weights) = (&self.transfer.lamps, &self.transfer.weights);
        let stride = lamps.stride;
        let (energies, weights) = (
            by_channel(lamps, &lamps.energies),
            by_channel(lamps, weights),
        );
        let mut roots = vec![0.0; self.pixels.len() * 3 * stride];
        let mut lit = vec![[0.0; 3]; self.pixels.len()];
        let width = found.size.0;
        roots
            .par_chunks_mut((PIXELS * 3 * stride).max(1))
            .zip(lit.par_chunks_mut(PIXELS))
            .zip(self.pixels.par_chunks(PIXELS))
            .for_each(|((roots, lit), pixels)| {
                let (mut wanted, mut pulled) = (vec![0.0; stride], vec![0.0; 3 * stride]);
                let (energies, weights) = (&energies, &weights);
                vectorized(
                    #[inline(always)]
                    || {
                        for (i, &p) in pixels.iter().enumerate() {
                            let places = found.place((p % width, p / width));
                            turned.shade(pose.normal(places), &mut wanted);
                            pose.bare.pull(places, &mut pulled);
                            for c in 0..3 {
                                let out = &mut roots[(3 * i + c) * stride..][..stride];
                                turned.blend(&pulled[c * stride..][..stride], out);
                                let mut sum = 0.0;
                                let lamps = wanted.iter().zip(&energies[c]).zip(&weights[c]);
                                for (root, ((wanted, energy), weight)) in out.iter_mut().zip(lamps)
                                {
                                    let scale = wanted * energy;
                                    sum += weight * scale * *root * *root;
                                    *root *= scale.sqrt();
                                }
                                lit[i][c] = sum;
                            }
                        }
                    },
                );
            });
        (roots, lit)
    }

    /// The exemplars' shares in the frame's fine light. `near`: weight of each exemplar under each lamp.
    fn places(&self, said: Vec<Said>, mut near: Vec<Vec<f32>>, unlike: &Mask) -> Arc<[Place]> {
        let (count, stride) = (self.transfer.lamps.len(), self.transfer.lamps.stride);
        for lamp in 0..count {
            let sum: f32 = near.iter().map(|near| near[lamp]).sum();
            near.iter_mut()
                .for_each(|near| near[lamp] /= sum.max(f32::MIN_POSITIVE));
        }
        // Light is summed before it is pulled over, so an exemplar has one share in all lamps of a pixel.
        let means: Vec<f32> = near
            .iter()
            .map(|near| near[..count].iter().sum::<f32>() / count.max(1) as f32)
            .collect();
        let sum = |p: usize| -> f32 {
            said.iter()
                .zip(&means)
                .map(|(one, mean)| mean * one.like.pixels[p])
                .sum()
        };
        let mut scale = vec![0.0; unlike.pixels.len()];
        for &p in &self.pixels {
            let known = 1.0 / (1.0 + (unlike.pixels[p] / UNKNOWN).powi(2));
            scale[p] = known / sum(p).max(f32::MIN_POSITIVE);
        }
        let place = |(one, near): (Said, Vec<f32>)| {
            let mut share = one.like;
            share
                .pixels
                .iter_mut()
                .zip(&scale)
                .for_each(|(share, scale)| *share *= scale);
            let mut lamps = one.turned.weights;
            for lamps in lamps.chunks_exact_mut(stride.max(1)) {
                lamps
                    .iter_mut()
                    .zip(&near)
                    .for_each(|(lamp, near)| *lamp *= near);
            }
            Place {
                pose: one.number,
                offsets: one.offsets,
                share,
                lamps,
                stride,
            }
        };
        said.into_iter().zip(near).map(place).collect()
    }

    /// A picture of values of [`Self::pixels`]; black elsewhere.
    fn spread(&self, values: &[[f32; 3]]) -> Image {
        let (width, height) = self.plate.size();
        let mut picture = Image::filled(width, height, [0.0; 3]);
        for (&p, value) in self.pixels.iter().zip(values) {
            picture.pixels[p] = *value;
        }
        picture
    }

    /// How far a picture under the interview's light is from the frame: root mean square of the ratio's logarithm, less its
    /// median, in a small window, and the share of a pixel that is not covered.
    pub fn unlike(&self, lit: &Raster<f32>, coverage: &Mask) -> Mask {
        let ratio = |(a, b): (&f32, &f32)| a.max(self.dark).ln() - b.max(self.dark).ln();
        let ratio: Vec<f32> = self
            .plate
            .pixels
            .iter()
            .zip(&lit.pixels)
            .map(ratio)
            .collect();
        let mut within: Vec<f32> = ratio
            .iter()
            .zip(&self.inside.pixels)
            .filter(|(_, inside)| **inside)
            .map(|(r, _)| *r)
            .collect();
        within.sort_unstable_by(f32::total_cmp);
        let median = quantile(&within, 0.5);
        let (width, height) = self.plate.size();
        let squares = ratio
            .iter()
            .zip(&self.matte.pixels)
            .map(|(r, inside)| ((r - median) * inside).powi(2))
            .collect();
        let radius = LIKENESS_BLUR * width.max(height) as f32;
        let squares = blur(
            &Raster {
                width,
                height,
                pixels: squares,
            },
            radius,
        );
        let share = blur(&self.matte, radius);
        let unlike = |((square, share), coverage): ((&f32, &f32), &f32)| {
            (square.max(0.0) / (share + 1e-3)).sqrt() + 1.0 - coverage
        };
        let pixels = squares
            .pixels
            .iter()
            .zip(&share.pixels)
            .zip(&coverage.pixels)
            .map(unlike)
            .collect();
        Raster {
            width,
            height,
            pixels,
        }
    }

    /// The blend of all predictions, summing to the frame under the interview's light.
    pub fn blended(&self, said: Vec<Said>) -> Carried {
        let (width, height) = self.plate.size();
        let lamps = &self.transfer.lamps;
        let (count, stride) = (lamps.len(), lamps.stride);
        let weights = by_channel(lamps, &self.transfer.weights);
        let values = 3 * stride;
        let nearest: Vec<f32> = (0..count)
            .map(|l| {
                said.iter()
                    .map(|one| one.turned.nearest[l])
                    .fold(f32::INFINITY, f32::min)
            })
            .collect();
        let near: Vec<Vec<f32>> = (said.iter())
            .map(|one| {
                let angles = one.turned.nearest.iter().zip(&nearest);
                lamps.padded(angles.map(|(angle, nearest)| one.pose * falloff(*angle, *nearest)))
            })
            .collect();
        let mut olats = vec![0.0; self.pixels.len() * values];
        let mut spreads = vec![0.0; self.pixels.len()];
        let of_lamps: Vec<Vec<f32>> = olats
            .par_chunks_mut((PIXELS * values).max(1))
            .zip(spreads.par_chunks_mut(PIXELS))
            .zip(self.pixels.par_chunks(PIXELS))
            .enumerate()
            .map(|(first, ((olats, spreads), pixels))| {
                let (mut below, mut squares) = (vec![0.0; stride], vec![0.0; values]);
                let mut of_lamps = vec![0.0; stride];
                vectorized(
                    #[inline(always)]
                    || {
                        let places = pixels.iter().zip(spreads.iter_mut()).enumerate();
                        for ((i, (&p, spread)), out) in places.zip(olats.chunks_exact_mut(values)) {
                            let i = first * PIXELS + i;
                            below.fill(0.0);
                            squares.fill(0.0);
                            for (one, near) in said.iter().zip(&near) {
                                let like = one.like.pixels[p];
                                for (below, near) in below.iter_mut().zip(near) {
                                    *below += like * near;
                                }
                                let roots = one.roots[i * values..][..values].chunks_exact(stride);
                                let sums = out
                                    .chunks_exact_mut(stride)
                                    .zip(squares.chunks_exact_mut(stride));
                                for ((out, squares), roots) in sums.zip(roots) {
                                    for (((out, square), root), near) in
                                        out.iter_mut().zip(squares).zip(roots).zip(near)
                                    {
                                        let weighted = like * near * root;
                                        *out += weighted;
                                        *square += weighted * root;
                                    }
                                }
                            }
                            let mut sum_of_spreads = 0.0;
                            for (c, (out, squares)) in out
                                .chunks_exact_mut(stride)
                                .zip(squares.chunks_exact_mut(stride))
                                .enumerate()
                            {
                                let mut sum = 0.0;
                                for (((out, square), below), weight) in out
                                    .iter_mut()
                                    .zip(squares.iter_mut())
                                    .zip(&below)
                                    .zip(&weights[c])
                                {
                                    let below = below.max(f32::MIN_POSITIVE);
                                    let root = *out / below;
                                    *out = root * root;
                                    *square = (*square / below - *out).max(0.0);
                                    sum += weight * *out;
                                }
                                let scale =
                                    self.frame.plate.pixels[p][c].max(0.0) / sum.max(self.dark);
                                for ((out, square), lamp) in
                                    out.iter_mut().zip(squares).zip(&mut of_lamps)
                                {
                                    *out *= scale;
                                    let spread = scale * *square;
                                    sum_of_spreads += spread;
                                    *lamp += spread;
                                }
                            }
                            *spread = sum_of_spreads / (3 * count.max(1)) as f32;
                        }
                    },
                );
                of_lamps
            })
            .collect();
        let mean = |lamp: usize| {
            let sum: f32 = of_lamps.iter().map(|of| of[lamp]).sum();
            sum / (3 * self.pixels.len()).max(1) as f32
        };
        let mut planes = vec![0.0; 3 * count * width * height];
        planes
            .par_chunks_exact_mut((width * height).max(1))
            .enumerate()
            .for_each(|(plane, out)| {
                let at = plane % 3 * stride + plane / 3;
                for (i, &p) in self.pixels.iter().enumerate() {
                    out[p] = olats[i * values + at];
                }
            });
        let mut spread = Raster::filled(width, height, 0.0);
        for (&p, value) in self.pixels.iter().zip(&spreads) {
            spread.pixels[p] = *value;
        }
        let least = |x, y| {
            let of = said.iter().map(|one| one.unlike.at(x, y));
            of.reduce(f32::min).unwrap_or(1.0)
        };
        let miss = |one: &Said| -> f32 {
            let of = one.unlike.pixels.iter().zip(&self.matte.pixels);
            of.map(|(unlike, inside)| inside * unlike * unlike).sum()
        };
        let pose = said
            .iter()
            .min_by(|a, b| miss(a).total_cmp(&miss(b)))
            .map(|one| one.number);
        let unlike = Raster::from_fn(width, height, least);
        Carried {
            field: ReflectanceField {
                width,
                height,
                lamps: count,
                values: planes,
            },
            places: self.places(said, near, &unlike),
            unlike,
            pose,
            spread,
            lamp_spreads: (0..count).map(mean).collect(),
        }
    }
}

/// 1 at 0, e^−½ at `width`.
fn gaussian(v: f32, width: f32) -> f32 {
    (-0.5 * (v / width).powi(2)).exp()
}

/// Values of lamps, channel by channel, padded.
fn by_channel(lamps: &Lamps, values: &[[f32; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|c| lamps.padded(values.iter().map(|value| value[c])))
}

/// Local contrast in a window of `radius` of the picture's side, at the size at which pictures are matched.
pub fn matched_contrast(light: &Raster<f32>, matte: &Mask, radius: f32) -> Raster<f32> {
    let (width, height) = light.size();
    let longer = width.max(height);
    let contrast = local_contrast(
        light,
        matte,
        bright_level(light, matte),
        radius * longer as f32,
    );
    if longer == 0 {
        return contrast;
    }
    let side = (longer + longer / 2).min(MOST_SIDE);
    resize(
        &contrast,
        (width * side).div_ceil(longer),
        (height * side).div_ceil(longer),
    )
}

/// The subject's bright level: a high quantile of its light.
fn bright_level(light: &Raster<f32>, mask: &Mask) -> f32 {
    let mut subject: Vec<f32> = light
        .pixels
        .iter()
        .zip(&mask.pixels)
        .filter(|(v, m)| **m > 0.5 && v.is_finite())
        .map(|(v, _)| *v)
        .collect();
    subject.sort_unstable_by(f32::total_cmp);
    quantile(&subject, BRIGHT)
}
