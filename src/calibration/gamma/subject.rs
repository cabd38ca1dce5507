//! The subject's pixels in the poses and in the interview, as codes.

use super::super::StandIn;
use super::super::code::{CLIPPED, Code, STEPS, Table, codes};
use super::super::least_squares::NormalEquations;
use super::super::probe::Probes;
use super::GAMMA_PRIOR;
use super::twin::{Candidate, Twin};
use base::error::{Error, Result};
use base::progress::Progress;
use footage;
use imaging::{DualGamma, Mask};
use project::{Framings, Project};
use rayon::prelude::*;
use std::path::Path;

/// Levels at which distributions are compared: the middles of twenty equal parts.
pub(super) const QUANTILES: usize = 20;
/// Pixels taken of each pose and of each frame: enough for steady quantiles.
const SAMPLES: usize = 3000;
/// Interview frames that are pooled, spread over the clip so that the head's turning averages out.
const FRAMES: usize = 8;
/// Interview frames among which a pose is looked for: the first, and others spread over the clip.
const SEARCHED_FRAMES: usize = 96;

/// Quantiles per channel.
pub(crate) type Quantiles = [[f32; QUANTILES]; 3];

/// A pose's pixels.
pub(crate) struct Pose {
    /// Per pixel, one code for each lamp: `codes[pixel · lamps + lamp]`.
    pub codes: Vec<Code>,
    /// The interview frame that shows this pose best, where one can be compared.
    pub twin: Option<Twin>,
}

/// The poses' and the frames' pixels inside the subject, as codes.
pub(crate) struct Subject {
    /// The poses that show anything.
    pub poses: Vec<Pose>,
    /// Pixels of some frames that are spread over the clip.
    pub frames: Vec<Vec<Code>>,
    /// The encoded quantiles of all frames together and of each.
    pub interview: Quantiles,
    pub frame_quantiles: Vec<Quantiles>,
    pub lamps: usize,
}

impl Subject {
    /// Reads every pose and some frames at their own size: averaging encoded pixels would be wrong.
    /// The probes' weights under a plausible response find the frame that is nearest to each pose.
    ///
    /// # Errors
    /// When a file cannot be read or does not fit its matte, a stop was asked for, or the mattes show no
    /// subject, or one that is black or clipped everywhere.
    pub fn load(project: &Project, probes: &Probes, progress: &Progress) -> Result<Self> {
        let provisional = &Table::new(&DualGamma {
            gamma1: GAMMA_PRIOR.0 as f32,
            gamma2: GAMMA_PRIOR.0 as f32,
        });
        let weights = &probes.fit(provisional).weights;
        let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
        let lamps = shoot.all_lamps().len();
        let mut poses = Vec::new();
        let mut candidates = Vec::new();
        for (pose, name) in shoot.poses.iter().enumerate() {
            progress.check("nothing was changed")?;
            progress.step(
                "poses",
                pose as u64 + 1,
                shoot.poses.len() as u64,
                name.clone(),
            );
            let mask_path = project.exemplar_mask_path(pose);
            let mask = footage::read_mask(&mask_path, framing)?;
            let inside = inside(&mask, SAMPLES);
            let olats = (0..lamps)
                .into_par_iter()
                .map(|lamp| {
                    let path = project.olat_path(pose, lamp);
                    sample(&path, framing, &mask, &mask_path, &inside)
                })
                .collect::<Result<Vec<_>>>()?;
            let codes: Vec<Code> = (0..inside.len())
                .flat_map(|i| olats.iter().map(move |olat| olat[i]))
                .collect();
            if !codes.is_empty() {
                let relit = relit(&codes, lamps, provisional, weights);
                candidates.push(Candidate::new(pose, mask.size(), inside, relit));
                poses.push(Pose { codes, twin: None });
            }
        }
        let step = shoot.frames.len().div_ceil(FRAMES).max(1);
        let search = shoot.frames.len().div_ceil(SEARCHED_FRAMES).max(1);
        let wanted: Vec<usize> = (0..shoot.frames.len())
            .filter(|frame| frame % step == 0 || frame % search == 0)
            .collect();
        let (mut frames, mut twins) = (Vec::new(), vec![None; poses.len()]);
        // A few pictures at a time are in memory.
        for (part, some) in wanted.chunks(8).enumerate() {
            progress.check("nothing was changed")?;
            progress.step("frames", (8 * part) as u64, wanted.len() as u64, "");
            let read = some
                .par_iter()
                .map(|&frame| {
                    let mask_path = project.frame_mask_path(frame);
                    let mask = footage::read_mask(&mask_path, framing)?;
                    let path = project.frame_path(frame);
                    let picture = read_codes(&path, framing, &mask, &mask_path)?;
                    let found: Vec<Option<Twin>> = candidates
                        .iter()
                        .map(|candidate| candidate.compare(frame, &mask, &picture, provisional))
                        .collect();
                    let places = inside(&mask, SAMPLES);
                    let sample = places.iter().map(|&place| picture[place]).collect();
                    Ok((frame, sample, found))
                })
                .collect::<Result<Vec<(usize, Vec<Code>, Vec<Option<Twin>>)>>>()?;
            for (frame, sample, found) in read {
                if frame % step == 0 && !sample.is_empty() {
                    frames.push(sample);
                }
                for (best, new) in twins.iter_mut().zip(found) {
                    *best = Twin::nearer(best.take(), new);
                }
            }
        }
        for (what, empty) in [
            ("exemplar_masks", poses.is_empty()),
            ("interview_masks", frames.is_empty()),
        ] {
            if empty {
                return Err(Error::unexpected(
                    project.shoot_path(what).display(),
                    "a subject: pixels of coverage above 0.98",
                    "none",
                    "Check the mattes; white is the subject",
                ));
            }
        }
        let subject_of = |pictures: &mut dyn Iterator<Item = &Code>| {
            let (mut all, mut lit, mut open) = (0, false, 0);
            for code in pictures {
                all += 1;
                lit |= *code != [0; 3];
                open += usize::from(code.iter().all(|&c| c < CLIPPED));
            }
            match (lit, 10 * open < all) {
                (false, _) => Some("a subject that is black everywhere"),
                (_, true) => Some("a subject that is clipped to white"),
                _ => None,
            }
        };
        for (what, found) in [
            (
                "exemplars",
                subject_of(&mut poses.iter().flat_map(|pose| &pose.codes)),
            ),
            ("interview", subject_of(&mut frames.iter().flatten())),
        ] {
            if let Some(found) = found {
                return Err(Error::unexpected(
                    project.shoot_path(what).display(),
                    "pictures with light on the subject, and short of clipping",
                    found,
                    "Check that the pictures and the mattes belong together, and their exposure",
                ));
            }
        }
        for (pose, twin) in poses.iter_mut().zip(twins) {
            pose.twin = twin;
        }
        Ok(Self {
            interview: encoded_quantiles(&frames),
            frame_quantiles: frames.chunks(1).map(encoded_quantiles).collect(),
            poses,
            frames,
            lamps,
        })
    }

    /// A pose's pixels as the sum of its OLATs.
    pub fn relit(&self, pose: &Pose, table: &Table, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        relit(&pose.codes, self.lamps, table, weights)
    }

    /// The light of one of a pose's samples as the sum of its OLATs.
    pub fn relit_sample(
        &self,
        pose: &Pose,
        sample: usize,
        table: &Table,
        weights: &[[f32; 3]],
    ) -> [f32; 3] {
        let codes = pose.codes.chunks_exact(self.lamps).nth(sample);
        sum(codes.unwrap_or_default(), table, weights)
    }

    /// The poses beside the mismatch with their nearest frame under a response, where one has their
    /// outline.
    pub fn nearest(&self, table: &Table, weights: &[[f32; 3]]) -> Vec<(&Pose, &Twin, f32)> {
        let twins = self
            .poses
            .iter()
            .filter_map(|pose| Some((pose, pose.twin.as_ref()?)));
        twins
            .map(|(pose, twin)| {
                let relit = self.relit(pose, table, weights);
                (pose, twin, twin.mismatch_under(&relit, table))
            })
            .collect()
    }

    /// The sum of the first `learnt` lamps that is nearest to the sum of all under `weights`, in linear
    /// light over all poses' pixels, per channel.
    pub fn stand_in(&self, table: &Table, weights: &[[f32; 3]], learnt: usize) -> StandIn {
        let pixels = || (self.poses.iter()).flat_map(|pose| pose.codes.chunks_exact(self.lamps));
        let mut stand_in = StandIn {
            weights: vec![[0.0; 3]; learnt],
            residual: 0.0,
        };
        let solved: Vec<Vec<f64>> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let mut equations = NormalEquations::new(learnt);
                for codes in pixels() {
                    let light = |lamp: usize| f64::from(table.light(codes[lamp][c]));
                    let whole =
                        (0..self.lamps).map(|lamp| f64::from(weights[lamp][c]) * light(lamp));
                    let terms: Vec<(usize, f64)> = (0..learnt)
                        .map(|lamp| (lamp, light(lamp)))
                        .filter(|(_, light)| *light != 0.0)
                        .collect();
                    equations.add(&terms, whole.sum());
                }
                equations.solve()
            })
            .collect();
        for (lamp, weight) in stand_in.weights.iter_mut().enumerate() {
            *weight = [0, 1, 2].map(|c| solved[c][lamp] as f32);
        }
        let (mut off, mut all) = (0.0, 0.0);
        for codes in pixels() {
            let (whole, part) = (
                sum(codes, table, weights),
                sum(codes, table, &stand_in.weights),
            );
            for (whole, part) in whole.into_iter().zip(part) {
                off += f64::from(whole - part).powi(2);
                all += f64::from(whole).powi(2);
            }
        }
        if all > 0.0 {
            stand_in.residual = (off / all).sqrt() as f32;
        }
        stand_in
    }

    /// The relit pixels of all poses.
    pub fn all_relit(&self, table: &Table, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        self.poses
            .iter()
            .flat_map(|pose| self.relit(pose, table, weights))
            .collect()
    }
}

/// Pixels as sums of their OLATs.
fn relit(codes: &[Code], lamps: usize, table: &Table, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
    codes
        .par_chunks_exact(lamps)
        .with_min_len(256)
        .map(|codes| sum(codes, table, weights))
        .collect()
}

/// One pixel's light: the sum of its OLATs.
fn sum(codes: &[Code], table: &Table, weights: &[[f32; 3]]) -> [f32; 3] {
    codes
        .iter()
        .zip(weights)
        .fold([0.0; 3], |sum, (code, weight)| {
            [0, 1, 2].map(|c| sum[c] + weight[c] * table.light(code[c]))
        })
}

/// The pooled quantiles of some pictures' codes, encoded in `[0, 1]`.
fn encoded_quantiles(pictures: &[Vec<Code>]) -> Quantiles {
    [0, 1, 2].map(|c| {
        let codes = pictures.iter().flatten();
        quantiles(
            codes
                .map(|code| f32::from(code[c]) / f32::from(STEPS))
                .collect(),
        )
    })
}

/// Up to about `count` places whose whole neighbourhood is the subject, spread over it.
fn inside(mask: &Mask, count: usize) -> Vec<usize> {
    let (width, height) = mask.size();
    let margin = margin(width);
    let solid = |x: usize, y: usize| mask.at(x, y) > SOLID;
    let places: Vec<usize> = (margin..height.saturating_sub(margin))
        .flat_map(|y| (margin..width.saturating_sub(margin)).map(move |x| (x, y)))
        .filter(|&(x, y)| {
            solid(x, y)
                && (y - margin..=y + margin)
                    .all(|row| (x - margin..=x + margin).all(|col| solid(col, row)))
        })
        .map(|(x, y)| y * width + x)
        .collect();
    // Two neighbours at a time: their difference tells noise from a misfit.
    let step = places.len().div_ceil(count).max(1);
    places
        .into_iter()
        .enumerate()
        .filter(|(i, _)| (i / 2) % step == 0)
        .map(|(_, place)| place)
        .collect()
}

/// Coverage from here on is the subject alone.
pub(super) const SOLID: f32 = 0.98;

/// How far a picture's samples keep from the matte's edge, in pixels.
pub(super) fn margin(width: usize) -> usize {
    width.div_ceil(128)
}

/// The codes of a picture at some places of its matte.
pub(super) fn sample(
    path: &Path,
    framing: &Framings,
    mask: &Mask,
    mask_path: &Path,
    places: &[usize],
) -> Result<Vec<Code>> {
    let codes = read_codes(path, framing, mask, mask_path)?;
    Ok(places.iter().map(|&place| codes[place]).collect())
}

/// The codes of a picture that has its matte's size.
fn read_codes(path: &Path, framing: &Framings, mask: &Mask, mask_path: &Path) -> Result<Vec<Code>> {
    let picture = footage::read_encoded(path, framing)?;
    if picture.0.size() != mask.size() {
        return Err(Error::unexpected(
            path.display(),
            format!(
                "{}×{} pixels as in {}",
                mask.width,
                mask.height,
                mask_path.display()
            ),
            format!("{}×{}", picture.0.width, picture.0.height),
            "Give the matte that belongs to the picture",
        ));
    }
    Ok(codes(&picture))
}

/// The quantiles of values, at least one; interpolated.
pub(super) fn quantiles(mut values: Vec<f32>) -> [f32; QUANTILES] {
    values.sort_unstable_by(f32::total_cmp);
    std::array::from_fn(|i| {
        let place = (i as f32 + 0.5) / QUANTILES as f32 * (values.len() - 1) as f32;
        let (low, part) = (place as usize, place.fract());
        values[low] + part * (values[(low + 1).min(values.len() - 1)] - values[low])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_middles_of_equal_parts() {
        let found = quantiles((0..=1000).rev().map(|i| i as f32 / 1000.0).collect());
        for (i, q) in found.iter().enumerate() {
            assert!((q - (i as f32 + 0.5) / QUANTILES as f32).abs() < 1e-4);
        }
        assert_eq!(quantiles(vec![0.3]), [0.3; QUANTILES]);
    }

    #[test]
    fn only_pixels_deep_inside_the_subject_count() {
        let mask = Mask::from_fn(20, 20, |x, y| {
            if (5..12).contains(&x) && (5..12).contains(&y) {
                1.0
            } else {
                0.5
            }
        });
        let places = inside(&mask, 100);
        assert_eq!(places.len(), 25);
        assert!(
            places
                .iter()
                .all(|p| (6..11).contains(&(p % 20)) && (6..11).contains(&(p / 20)))
        );
        assert!(inside(&Mask::filled(1, 1, 1.0), 10).is_empty());
    }
}
