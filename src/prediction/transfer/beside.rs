//! Frames before and after the one that is predicted, for light that is steady in time.

use crate::said::gaussian;
use crate::shape::quantile;
use crate::target::Target;
use crate::transfer::{Carried, Transfer};

use footage::Frame;
use imaging::Raster;
use imaging::Response;
use project::Project;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// [`Carried::unlike`] between frames, matched, at which the one beside counts e^−½.
const BESIDE: f32 = 0.3;
/// The same of the median pixel.
const NEXT: f32 = 0.06;
/// Matched frames that are kept: those that frames in order, of two threads, ask for again.
const KEPT: usize = 6;

/// A frame and its places in the exemplars.
#[derive(Clone, Debug)]
pub struct Matched {
    frame: Frame,
    /// As [`Target::plate`].
    plate: Raster<f32>,
    /// As [`Target::contrast`].
    contrast: Raster<f32>,
    /// Of each exemplar, as [`crate::Place::offsets`].
    offsets: Vec<Vec<[f32; 2]>>,
}

/// The interview of a project, matched with its exemplars frame by frame.
#[derive(Debug)]
pub struct Beside {
    project: Project,
    response: Response,
    kept: Mutex<VecDeque<Arc<Matched>>>,
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

    fn kept(&self, index: usize) -> Option<Arc<Matched>> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|kept| kept.frame.index == index).cloned()
    }

    fn keep(&self, transfer: &Transfer, frame: &Frame) -> Arc<Matched> {
        let matched = Arc::new(transfer.matched(frame));
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|kept| kept.frame.index != frame.index);
        if kept.len() >= KEPT {
            kept.pop_front();
        }
        kept.push_back(matched.clone());
        matched
    }
}

impl Transfer {
    /// Finds a frame in the exemplars.
    pub fn matched(&self, frame: &Frame) -> Matched {
        let target = Target::new(frame, self);
        let offsets = self.poses.par_iter().map(|pose| target.found(pose));
        Matched {
            offsets: offsets.collect(),
            frame: frame.clone(),
            contrast: target.contrast,
            plate: target.plate,
        }
    }

    /// [`Self::carry`], with what frames before and after the frame say of its places in the exemplars.
    pub fn carry_beside(&self, frame: &Matched, beside: &[Arc<Matched>]) -> Carried {
        let target = Target::new(&frame.frame, self);
        let offsets = target.steadied(frame, beside);
        let poses = self.poses.par_iter().zip(offsets);
        target.blended(poses.map(|(pose, offsets)| target.said(pose, offsets)).collect())
    }
}

impl Target<'_> {
    /// Offsets of the frame in the exemplars, the mean with those of frames beside it, which are followed along the motion
    /// between both and count by how well it explains them.
    pub fn steadied(&self, own: &Matched, beside: &[Arc<Matched>]) -> Vec<Vec<[f32; 2]>> {
        let mut sums = own.offsets.clone();
        let mut weights = vec![1.0; self.plate.pixels.len()];
        let same_size = |other: &&Arc<Matched>| other.frame.plate.size() == self.plate.size();
        for other in beside.iter().filter(same_size) {
            let motion = self.moved(self.offsets(&self.contrast, &other.contrast));
            let unlike =
                self.unlike(&motion.pulled(&other.plate), &motion.pulled(&other.frame.mask));
            let mut sorted: Vec<f32> = (self.pixels.iter()).map(|&p| unlike.pixels[p]).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            // A pose that jumps says nothing of the pose before.
            let whole = gaussian(quantile(&sorted, 0.5), NEXT);
            let shares: Vec<f32> =
                (unlike.pixels.iter()).map(|unlike| whole * gaussian(*unlike, BESIDE)).collect();
            sums.par_iter_mut().zip(&other.offsets).for_each(|(sums, offsets)| {
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
}
