//! Both losses of a training step and their gradient, in two passes over the network's output, three with its sigmoid: the
//! encoded OLATs never leave the cache.

use super::chunks::{each_chunk, vectorized};
use super::feature_distance::FeatureDistance;
use super::pointwise::{encode, sigmoid};
use std::cell::Cell;

/// Meaning of the network's output, and the pictures for comparison.
#[derive(Clone, Copy, Debug)]
pub struct Losses<'a> {
    pub size: [usize; 2],
    /// Linear light of an output of 1, `[3, h, w]`.
    pub light: &'a [f32],
    /// Matte of the subject, `[h, w]`.
    pub mask: &'a [f32],
    /// Encoded OLATs, `[lamps, 3, h, w]`; None skips the reconstruction loss.
    pub olats: Option<&'a [f32]>,
    /// The encoded plate: the subject under the interview's light, `[3, h, w]`.
    pub plate: &'a [f32],
    /// Weights of the lamps in the interview's light, `[lamps, 3]`.
    pub weights: &'a [f32],
    pub settings: Settings,
}

/// The scalar settings of the losses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Factor on OLATs before encoding and comparison.
    pub gain: f32,
    /// Columns to the right and rows down by which the true OLATs are shifted; new pixels are black.
    pub shift: [i64; 2],
    /// λ1.
    pub reconstruction: f32,
    /// λ2.
    pub rendering: f32,
    /// The network's output is before its sigmoid, which the losses then apply.
    pub logits: bool,
}

/// The losses, unweighted; the reconstruction loss is 0 if skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Values {
    pub reconstruction: f32,
    pub rendering: f32,
}

thread_local! {
    /// Slopes of a lamp's encoding, whose memory the next lamp reuses.
    static SLOPES: Cell<Vec<f32>> = const { Cell::new(Vec::new()) };
}

impl Losses<'_> {
    /// Losses of the network's output `[lamps, 3, h, w]`. The gradient of λ1 · reconstruction + λ2 · rendering takes
    /// its place.
    pub fn replace_by_gradient(&self, output: &mut [f32]) -> Values {
        let picture = self.light.len();
        let lamps = output.len() / picture;
        assert_eq!(picture, 3 * self.size[0] * self.size[1]);
        assert_eq!(output.len(), lamps * picture);
        assert_eq!((self.plate.len(), self.weights.len()), (picture, lamps * 3));
        assert!(self.olats.is_none_or(|olats| olats.len() == output.len()));
        if self.settings.logits {
            each_chunk(
                output,
                picture,
                #[inline(always)]
                |_, output| output.iter_mut().for_each(|x| *x = sigmoid(*x)),
            );
        }
        let (rendering, relit_gradient) = self.rendering(output);
        let distance = FeatureDistance::new(self.mask, self.size, lamps);
        let distances = each_chunk(
            output,
            picture,
            #[inline(always)]
            |lamp, output| {
                let mut sigmoids = Vec::new();
                if self.settings.logits {
                    sigmoids.extend_from_slice(output);
                }
                let distance = match self.olats {
                    Some(olats) => {
                        let olat = self.shifted(&olats[lamp * picture..][..picture]);
                        self.reconstruction(&distance, &olat, output)
                    }
                    None => {
                        output.fill(0.0);
                        0.0
                    }
                };
                let planes = output.chunks_exact_mut(picture / 3);
                let relit = relit_gradient.chunks_exact(picture / 3);
                for ((plane, relit), weight) in planes.zip(relit).zip(&self.weights[lamp * 3..]) {
                    for (g, relit) in plane.iter_mut().zip(relit) {
                        *g += weight * relit;
                    }
                }
                for (g, s) in output.iter_mut().zip(&sigmoids) {
                    *g = *g * s * (1.0 - s);
                }
                distance
            },
        );
        Values { reconstruction: distances.iter().sum::<f64>() as f32, rendering: rendering as f32 }
    }

    /// Contribution of one lamp to the reconstruction loss. λ1 times its gradient takes the output's place.
    #[inline(always)]
    fn reconstruction(&self, distance: &FeatureDistance, olat: &[f32], output: &mut [f32]) -> f64 {
        let gain = self.settings.gain;
        let mut slopes = SLOPES.take();
        slopes.resize(output.len(), 0.0);
        for ((s, slope), light) in output.iter_mut().zip(&mut slopes).zip(self.light) {
            let factor = gain * light;
            let (value, steepness) = encode(factor * *s);
            *s = value;
            *slope = self.settings.reconstruction * factor * steepness;
        }
        let distance = distance.replace_by_gradient(output, olat);
        for (g, slope) in output.iter_mut().zip(&slopes) {
            *g *= slope;
        }
        SLOPES.set(slopes);
        distance
    }

    /// The rendering loss, and λ2 times its gradient by Σ weight · output of each pixel.
    fn rendering(&self, output: &[f32]) -> (f64, Vec<f32>) {
        const PIXELS: usize = 2048;
        let plane = self.mask.len();
        let picture = 3 * plane;
        let mut relit = vec![0.0; picture];
        for (channel, relit) in relit.chunks_exact_mut(plane).enumerate() {
            each_chunk(
                relit,
                PIXELS,
                #[inline(always)]
                |block, relit| {
                    let start = channel * plane + block * PIXELS;
                    let pictures = output.chunks_exact(picture);
                    for (olat, weights) in pictures.zip(self.weights.chunks_exact(3)) {
                        let weight = weights[channel];
                        for (sum, s) in relit.iter_mut().zip(&olat[start..]) {
                            *sum += weight * s;
                        }
                    }
                },
            );
        }
        let mut slopes = vec![0.0; picture];
        vectorized(
            #[inline(always)]
            || {
                for ((sum, slope), light) in relit.iter_mut().zip(&mut slopes).zip(self.light) {
                    let (value, steepness) = encode(light * *sum);
                    *sum = value;
                    *slope = self.settings.rendering * light * steepness;
                }
            },
        );
        let distance = FeatureDistance::new(self.mask, self.size, 1);
        let loss = distance.replace_by_gradient(&mut relit, self.plate);
        for (g, slope) in relit.iter_mut().zip(&slopes) {
            *g *= slope;
        }
        (loss, relit)
    }

    /// A true OLAT, shifted.
    fn shifted<'a>(&self, olat: &'a [f32]) -> std::borrow::Cow<'a, [f32]> {
        let ([h, w], [dx, dy]) = (self.size, self.settings.shift);
        if [dx, dy] == [0, 0] {
            return olat.into();
        }
        let mut moved = vec![0.0; olat.len()];
        let across = (dx.unsigned_abs() as usize).min(w);
        let (to, from) = if dx > 0 { (across, 0) } else { (0, across) };
        for (i, row) in moved.chunks_exact_mut(w).enumerate() {
            let (plane, y) = (i / h * h, (i % h) as i64 - dy);
            if let Some(source) = usize::try_from(y).ok().filter(|y| *y < h) {
                let source = &olat[(plane + source) * w..][..w];
                row[to..to + w - across].copy_from_slice(&source[from..from + w - across]);
            }
        }
        moved.into()
    }
}
