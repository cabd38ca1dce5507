//! The blend of all exemplars' predictions of a frame.

use crate::lamps::falloff;
use crate::places::Place;
use crate::said::{PIXELS, Said, by_channel};
use crate::target::Target;
use imaging::{Mask, Raster};
use rayon::prelude::*;
use reflectance::ReflectanceField;
use reflectance::kernels::chunks::vectorized;
use std::sync::Arc;

/// [`Carried::unlike`] at which the exemplars' fine light counts half.
const UNKNOWN: f32 = 0.4;

/// A frame's OLATs, carried over.
#[derive(Clone, Debug)]
pub struct Carried {
    /// Linear OLATs, 0 outside the matte.
    pub field: ReflectanceField,
    /// Distance of each pixel from the best exemplar's prediction under the interview's light: root mean square of the
    /// natural logarithm of their ratio in a small window, more where that exemplar shows no subject.
    pub unlike: Mask,
    /// The pose that is most like the frame, by its number; None without poses.
    pub pose: Option<usize>,
    /// Places of the frame in the exemplars.
    pub places: Arc<[Place]>,
    /// Variance of the exemplars' predictions about their blend: squares of roots of light, the mean over lamps and channels.
    pub spread: Mask,
    /// The same of each lamp, the mean over the matte.
    pub lamp_spreads: Vec<f32>,
}

/// Blend of all predictions of a frame.
pub struct Blend {
    /// Linear OLATs, `olats[(i · 3 + channel) · stride + lamp]` of the pixel `Target::pixels[i]`.
    pub olats: Vec<f32>,
    /// All but the field, which is empty.
    pub rest: Carried,
}

impl Target<'_> {
    /// OLATs of a [`Blend`] as a field.
    pub fn field(&self, olats: &[f32]) -> ReflectanceField {
        let (width, height) = self.plate.size();
        let (lamps, stride) = (self.lamps.len(), self.lamps.stride);
        let mut values = vec![0.0; 3 * lamps * width * height];
        values.par_chunks_exact_mut((width * height).max(1)).enumerate().for_each(|(plane, out)| {
            let at = plane % 3 * stride + plane / 3;
            for (i, &p) in self.pixels.iter().enumerate() {
                out[p] = olats[i * 3 * stride + at];
            }
        });
        ReflectanceField { width, height, lamps, values }
    }

    /// Blend of all predictions, summing to the frame under the interview's light.
    pub fn blend(&self, said: Vec<Said>) -> Blend {
        let (width, height) = self.plate.size();
        let lamps = self.lamps;
        let (count, stride) = (lamps.len(), lamps.stride);
        let weights = by_channel(lamps, self.weights);
        let values = 3 * stride;
        let nearest: Vec<f32> =
            (0..count).map(|l| said.iter().map(|one| one.turned.nearest[l]).fold(f32::INFINITY, f32::min)).collect();
        let near: Vec<Vec<f32>> = (said.iter())
            .map(|one| {
                let angles = one.turned.nearest.iter().zip(&nearest);
                lamps.padded(angles.map(|(angle, nearest)| one.pose * falloff(*angle, *nearest)))
            })
            .collect();
        let mut olats = vec![0.0; self.pixels.len() * values];
        let mut spreads = vec![0.0; self.pixels.len()];
        let lamp_spreads: Vec<Vec<f32>> = olats
            .par_chunks_mut((PIXELS * values).max(1))
            .zip(spreads.par_chunks_mut(PIXELS))
            .zip(self.pixels.par_chunks(PIXELS))
            .enumerate()
            .map(|(first, ((olats, spreads), pixels))| {
                let (mut below, mut squares) = (vec![0.0; stride], vec![0.0; values]);
                let mut lamp_spreads = vec![0.0; stride];
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
                                let sums = out.chunks_exact_mut(stride).zip(squares.chunks_exact_mut(stride));
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
                            for (c, (out, squares)) in
                                out.chunks_exact_mut(stride).zip(squares.chunks_exact_mut(stride)).enumerate()
                            {
                                let mut sum = 0.0;
                                for (((out, square), below), weight) in
                                    out.iter_mut().zip(squares.iter_mut()).zip(&below).zip(&weights[c])
                                {
                                    let below = below.max(f32::MIN_POSITIVE);
                                    let root = *out / below;
                                    *out = root * root;
                                    *square = (*square / below - *out).max(0.0);
                                    sum += weight * *out;
                                }
                                let scale = self.frame.plate.pixels[p][c].max(0.0) / sum.max(self.dark);
                                for ((out, square), lamp) in out.iter_mut().zip(squares).zip(&mut lamp_spreads) {
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
                lamp_spreads
            })
            .collect();
        let mean = |lamp: usize| {
            let sum: f32 = lamp_spreads.iter().map(|block| block[lamp]).sum();
            sum / (3 * self.pixels.len()).max(1) as f32
        };
        let mut spread = Raster::filled(width, height, 0.0);
        for (&p, value) in self.pixels.iter().zip(&spreads) {
            spread.pixels[p] = *value;
        }
        let least = |x, y| {
            let distances = said.iter().map(|one| one.unlike.at(x, y));
            distances.reduce(f32::min).unwrap_or(1.0)
        };
        let miss = |one: &Said| -> f32 {
            let pairs = one.unlike.pixels.iter().zip(&self.matte.pixels);
            pairs.map(|(unlike, inside)| inside * unlike * unlike).sum()
        };
        let pose = said.iter().min_by(|a, b| miss(a).total_cmp(&miss(b))).map(|one| one.number);
        let unlike = Raster::from_fn(width, height, least);
        let rest = Carried {
            field: ReflectanceField { width, height, lamps: count, values: Vec::new() },
            places: self.places(said, near, &unlike),
            unlike,
            pose,
            spread,
            lamp_spreads: (0..count).map(mean).collect(),
        };
        Blend { olats, rest }
    }

    /// The exemplars' shares in the frame's fine light. `near`: weight of each exemplar under each lamp.
    fn places(&self, said: Vec<Said>, mut near: Vec<Vec<f32>>, unlike: &Mask) -> Arc<[Place]> {
        let (count, stride) = (self.lamps.len(), self.lamps.stride);
        for lamp in 0..count {
            let sum: f32 = near.iter().map(|near| near[lamp]).sum();
            near.iter_mut().for_each(|near| near[lamp] /= sum.max(f32::MIN_POSITIVE));
        }
        // Light is summed before it is pulled over, so an exemplar has one share in all lamps of a pixel.
        let means: Vec<f32> = near.iter().map(|near| near[..count].iter().sum::<f32>() / count.max(1) as f32).collect();
        let sum = |p: usize| -> f32 { said.iter().zip(&means).map(|(one, mean)| mean * one.like.pixels[p]).sum() };
        let mut scale = vec![0.0; unlike.pixels.len()];
        for &p in &self.pixels {
            let known = 1.0 / (1.0 + (unlike.pixels[p] / UNKNOWN).powi(2));
            scale[p] = known / sum(p).max(f32::MIN_POSITIVE);
        }
        let place = |(one, near): (Said, Vec<f32>)| {
            let mut share = one.like;
            share.pixels.iter_mut().zip(&scale).for_each(|(share, scale)| *share *= scale);
            let mut lamps = one.turned.weights;
            for lamps in lamps.chunks_exact_mut(stride.max(1)) {
                lamps.iter_mut().zip(&near).for_each(|(lamp, near)| *lamp *= near);
            }
            Place { pose: one.number, offsets: one.offsets, share, lamps, stride }
        };
        said.into_iter().zip(near).map(place).collect()
    }
}
