//! Frames before and after the one that is predicted, for light that is steady in time.

use crate::blend::{Blend, Carried};
use crate::half_rows::HalfRows;
use crate::matching::Match;
use crate::places::Place;
use crate::said::{PIXELS, by_channel, gaussian};
use crate::shape::quantile;
use crate::target::Target;
use crate::transfer::Transfer;
use footage::Frame;
use imaging::{Raster, Response};
use project::Project;
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// [`Carried::unlike`] between frames, matched, at which the one beside counts e^−½.
const BESIDE: f32 = 0.3;
/// The same of the median pixel.
const NEXT: f32 = 0.06;
/// Motion of the median pixel between frames, as a share of the longer side, at which the one beside counts e^−½: OLATs change
/// with the head's turn.
const MOVED: f32 = 1.0 / 128.0;
/// Weight of a frame beside below which it is left out.
const LEAST_WHOLE: f32 = 1e-3;
/// Largest factor that makes OLATs sum to the frame: a pixel that no frame beside shows takes 9.
const MOST_SCALE: f32 = 16.0;
/// Frames that are kept: those that frames in order, of two threads, ask for again.
const KEPT: usize = 6;

/// A frame that is carried over alone.
#[derive(Debug)]
pub struct Alone {
    frame: Frame,
    /// As [`Target::plate`].
    plate: Raster<f32>,
    /// As [`Target::contrast`].
    contrast: Raster<f32>,
    /// Roots of its OLATs, `[3, stride]` a pixel.
    roots: HalfRows,
    /// All but its field, which is empty.
    rest: Carried,
}

/// The interview of a project, carried over frame by frame.
#[derive(Debug)]
pub struct Beside {
    project: Project,
    response: Response,
    kept: Mutex<VecDeque<Arc<Alone>>>,
}

impl Beside {
    pub fn new(project: &Project, response: Response) -> Self {
        Self { project: project.clone(), response, kept: Mutex::default() }
    }

    /// A frame carried over with what the frames before and after it say: the same alone and in a sequence. A frame that cannot
    /// be read says nothing.
    pub fn carry(&self, transfer: &Transfer, frame: &Frame) -> Carried {
        let own = self.kept(frame.index).filter(|kept| {
            let same = (&kept.frame.plate.pixels, &kept.frame.mask.pixels);
            same == (&frame.plate.pixels, &frame.mask.pixels)
        });
        let own = own.unwrap_or_else(|| self.keep(transfer, frame));
        let numbers = [frame.index.checked_sub(1), frame.index.checked_add(1)];
        let beside = numbers.into_iter().flatten().filter_map(|index| {
            self.kept(index).or_else(|| {
                let read = Frame::load(&self.project, &self.response, index).ok()?;
                Some(self.keep(transfer, &read))
            })
        });
        transfer.carry_beside(&own, &beside.collect::<Vec<_>>())
    }

    fn kept(&self, index: usize) -> Option<Arc<Alone>> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|kept| kept.frame.index == index).cloned()
    }

    fn keep(&self, transfer: &Transfer, frame: &Frame) -> Arc<Alone> {
        let alone = Arc::new(transfer.alone(frame));
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|kept| kept.frame.index != frame.index);
        if kept.len() >= KEPT {
            kept.pop_front();
        }
        kept.push_back(alone.clone());
        alone
    }
}

impl Transfer {
    /// Carries the exemplars over to a frame alone.
    pub fn alone(&self, frame: &Frame) -> Alone {
        let target = self.target(frame);
        let Blend { olats, rest } = self.blend(&target);
        let values = 3 * self.lamps.stride;
        let mut numbers = vec![None; frame.mask.pixels.len()];
        target.pixels.iter().enumerate().for_each(|(i, &p)| numbers[p] = Some(i));
        let roots = HalfRows::new(&frame.mask, values, |p, roots| {
            if let Some(i) = numbers[p] {
                let olats = &olats[i * values..][..values];
                roots.iter_mut().zip(olats).for_each(|(root, olat)| *root = olat.sqrt());
            }
        });
        Alone { roots, rest, contrast: target.contrast, plate: target.plate, frame: frame.clone() }
    }

    /// [`Self::carry`], the mean with frames before and after it.
    pub fn carry_beside(&self, own: &Alone, beside: &[Arc<Alone>]) -> Carried {
        let target = self.target(&own.frame);
        let same_size = |other: &&Arc<Alone>| other.plate.size() == own.plate.size();
        let beside: Vec<Followed> = beside
            .iter()
            .filter(same_size)
            .map(|other| target.followed(other))
            .filter(|followed| followed.whole > LEAST_WHOLE)
            .collect();
        Carried {
            field: target.field(&target.mean_olats(own, &beside)),
            places: steadied(&own.rest.places, &beside),
            ..own.rest.clone()
        }
    }
}

/// A frame beside another, followed along the motion between both.
struct Followed<'a> {
    alone: &'a Alone,
    motion: Match,
    /// Weight of each pixel beside 1 of the other frame.
    shares: Vec<f32>,
    /// The largest weight possible.
    whole: f32,
}

impl Target<'_> {
    fn followed<'a>(&self, alone: &'a Alone) -> Followed<'a> {
        let motion = self.moved(self.offsets(&self.contrast, &alone.contrast));
        let unlike = self.unlike(&motion.pulled(&alone.plate), &motion.pulled(&alone.frame.mask));
        let median = |value: &dyn Fn(usize) -> f32| quantile(self.pixels.iter().map(|&p| value(p)).collect(), 0.5);
        let length = median(&|p| motion.offsets[p][0].hypot(motion.offsets[p][1]));
        let side = self.plate.width.max(self.plate.height) as f32;
        // A pose that jumps says nothing of the pose before.
        let whole = gaussian(median(&|p| unlike.pixels[p]), NEXT) * gaussian(length / side, MOVED);
        let shares = unlike.pixels.iter().map(|unlike| whole * gaussian(*unlike, BESIDE)).collect();
        Followed { alone, motion, shares, whole }
    }

    /// OLATs as in a [`Blend`]: squares of the mean of roots, summing to the frame under the interview's light.
    fn mean_olats(&self, own: &Alone, beside: &[Followed]) -> Vec<f32> {
        let stride = self.lamps.stride;
        let (width, values) = (self.plate.width, 3 * stride);
        let weights = by_channel(self.lamps, self.weights);
        let mut olats = vec![0.0; self.pixels.len() * values];
        olats.par_chunks_mut((PIXELS * values).max(1)).zip(self.pixels.par_chunks(PIXELS)).for_each(
            |(olats, pixels)| {
                let mut pulled = vec![0.0; values];
                vectorized(
                    #[inline(always)]
                    || {
                        for (out, &p) in olats.chunks_exact_mut(values).zip(pixels) {
                            own.roots.pull([(p, 1.0), (p, 0.0), (p, 0.0), (p, 0.0)], out);
                            for other in beside {
                                let places = other.motion.place((p % width, p / width));
                                other.alone.roots.pull(places, &mut pulled);
                                let share = other.shares[p];
                                let pairs = out.iter_mut().zip(&pulled);
                                pairs.for_each(|(out, pulled)| *out += share * pulled);
                            }
                            for (c, out) in out.chunks_exact_mut(stride).enumerate() {
                                let mut sum = 0.0;
                                for (out, weight) in out.iter_mut().zip(&weights[c]) {
                                    *out *= *out;
                                    sum += weight * *out;
                                }
                                let light = self.frame.plate.pixels[p][c].max(0.0);
                                let scale = (light / sum.max(f32::MIN_POSITIVE)).min(MOST_SCALE);
                                out.iter_mut().for_each(|out| *out *= scale);
                            }
                        }
                    },
                );
            },
        );
        olats
    }
}

/// Places whose offsets are the mean with those of frames beside.
fn steadied(own: &[Place], beside: &[Followed]) -> Arc<[Place]> {
    let steadied = |(e, place): (usize, &Place)| {
        let mut offsets = place.offsets.clone();
        let mut weights = vec![1.0; offsets.len()];
        for other in beside {
            let through = other.motion.then(&other.alone.rest.places[e].offsets);
            for (p, share) in other.shares.iter().enumerate() {
                (0..2).for_each(|c| offsets[p][c] += share * through[p][c]);
                weights[p] += share;
            }
        }
        for (offset, weight) in offsets.iter_mut().zip(&weights) {
            *offset = offset.map(|sum| sum / weight);
        }
        Place { offsets, ..place.clone() }
    };
    own.iter().enumerate().map(steadied).collect()
}
