//! Pixels of the subject in the poses and in the interview, as code values.

use super::super::code_values::{self, CLIPPED, CodeValues, ResponseTable, STEPS, codes, encoded};
use super::super::least_squares::NormalEquations;
use super::super::probe::Probes;
use super::super::stand_in::StandIn;
use super::frame_match::{FrameMatch, PoseSamples};
use super::matte::inside;
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::{Mask, Response};
use project::{Framings, Matte, Picture, Project};
use rayon::prelude::*;

/// Levels at which distributions are compared: the middles of twenty equal parts.
pub(super) const QUANTILES: usize = 20;
/// Pixels per pose and per frame: enough for stable quantiles.
const SAMPLES: usize = 3000;
/// Number of pooled interview frames, spread over the clip so that head movement averages out.
const FRAMES: usize = 8;
/// Exponents of the responses under which frames are matched to poses, before one is fitted.
const PROVISIONAL: [f32; 4] = [1.0, 1.5, 2.2, 3.0];
/// Number of interview frames searched for a pose: the first, and others spread over the clip.
const SEARCHED_FRAMES: usize = 96;

/// The code values of a picture's samples.
type Samples = Vec<CodeValues>;
/// Quantiles per channel.
pub(crate) type Quantiles = [[f32; QUANTILES]; 3];

/// A pose's pixels.
pub(crate) struct Pose {
    /// Code values of each pixel under each lamp: `codes[pixel · lamps + lamp]`.
    pub codes: Vec<CodeValues>,
    /// Interview frame that shows this pose best, if one is comparable.
    pub frame_match: Option<FrameMatch>,
}

/// A pose with its nearest frame.
pub(super) struct NearestFrame<'a> {
    pub pose: &'a Pose,
    pub frame_match: &'a FrameMatch,
    pub mismatch: f32,
}

/// Pixels of the poses and frames inside the subject, as code values.
pub(crate) struct Subject {
    /// Poses whose matte shows a subject.
    pub poses: Vec<Pose>,
    /// Pixels of some frames, spread over the clip.
    pub frames: Vec<Vec<CodeValues>>,
    /// Encoded quantiles of all frames together and of each.
    pub interview: Quantiles,
    pub frame_quantiles: Vec<Quantiles>,
    pub lamps: usize,
}

impl Subject {
    /// Reads every pose and some frames at full size, because averaging encoded pixels would be wrong. The probes'
    /// weights under plausible responses find the frame nearest to each pose.
    ///
    /// # Errors
    /// When a file cannot be read or differs in size from its matte, the job was stopped, the mattes show no
    /// subject, or the subject is black or clipped everywhere.
    pub fn load(project: &Project, probes: &Probes, progress: &Progress) -> Result<Self> {
        let provisional = PROVISIONAL.map(|gamma| ResponseTable::from_response(&Response::Power(gamma)));
        let weights = provisional.each_ref().map(|table| probes.weights(table));
        let scale = scale(project)?;
        let (mut poses, samples) = load_poses(project, (&provisional, &weights), scale, progress)?;
        let (frames, matched) = load_frames(project, &samples, (&provisional, scale), progress)?;
        check_light(project, &poses, &frames)?;
        for (pose, frame_match) in poses.iter_mut().zip(matched) {
            pose.frame_match = frame_match;
        }
        Ok(Self {
            interview: encoded_quantiles(&frames),
            frame_quantiles: frames.chunks(1).map(encoded_quantiles).collect(),
            poses,
            frames,
            lamps: project.settings.shoot.all_lamps().len(),
        })
    }

    /// Pixels of a pose as the sum of its OLATs.
    pub fn relit(&self, pose: &Pose, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        relit(&pose.codes, self.lamps, table, weights)
    }

    /// Light of one sample of a pose as the sum of its OLATs.
    pub fn relit_sample(&self, pose: &Pose, sample: usize, table: &ResponseTable, weights: &[[f32; 3]]) -> [f32; 3] {
        let codes = pose.codes.chunks_exact(self.lamps).nth(sample);
        sum(codes.unwrap_or_default(), table, weights)
    }

    /// Each pose with its nearest frame and their mismatch under a response, or under a provisional one if that is less:
    /// another pose differs under every response. Poses without a frame of the same outline are left out.
    pub(super) fn nearest(&self, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<NearestFrame<'_>> {
        let matched = self.poses.iter().filter_map(|pose| Some((pose, pose.frame_match.as_ref()?)));
        matched
            .map(|(pose, frame_match)| {
                let relit = self.relit(pose, table, weights);
                let mismatch = frame_match.mismatch_under(&relit, table);
                NearestFrame { pose, frame_match, mismatch: mismatch.min(frame_match.mismatch) }
            })
            .collect()
    }

    /// Sum of the first `learnt` lamps nearest to the sum of all lamps under `weights`, in linear light over all
    /// poses' pixels, per channel.
    pub fn stand_in(&self, table: &ResponseTable, weights: &[[f32; 3]], learnt: usize) -> StandIn {
        let pixels = || (self.poses.iter()).flat_map(|pose| pose.codes.chunks_exact(self.lamps));
        let mut stand_in = StandIn { weights: vec![[0.0; 3]; learnt], residual: 0.0 };
        let solved: Vec<Vec<f64>> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let mut equations = NormalEquations::new(learnt);
                for codes in pixels() {
                    let light = |lamp: usize| f64::from(table.light(codes[lamp][c]));
                    let whole = (0..self.lamps).map(|lamp| f64::from(weights[lamp][c]) * light(lamp));
                    let terms: Vec<(usize, f64)> =
                        (0..learnt).map(|lamp| (lamp, light(lamp))).filter(|(_, light)| *light != 0.0).collect();
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
            let (whole, part) = (sum(codes, table, weights), sum(codes, table, &stand_in.weights));
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

    /// Relit pixels of all poses.
    pub fn all_relit(&self, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        self.poses.iter().flat_map(|pose| self.relit(pose, table, weights)).collect()
    }
}

/// True if the files of interview and OLATs hold scene-linear light.
///
/// # Errors
/// When only one of them does, or a file cannot be read.
pub(crate) fn is_scene_linear(project: &Project) -> Result<bool> {
    let (frame, olat) = (project.frame_picture(0), project.first_olat(0));
    let light = [&frame, &olat].map(footage::is_scene_linear);
    let [frame_light, olat_light] = light;
    match (frame_light?, olat_light?) {
        (true, true) => Ok(true),
        (false, false) => Ok(false),
        (frame_is_light, _) => {
            let (light, codes) = if frame_is_light { (frame, olat) } else { (olat, frame) };
            Err(Error::invalid(
                format!(
                    "{} is scene-linear, but {} has codes of an unknown curve, so they cannot be compared",
                    light.display(),
                    codes.display()
                ),
                (
                    "Develop interview and OLATs alike, or give the response of the coded pictures",
                    "afterlight calibrate PROJECT --gamma srgb",
                ),
            ))
        }
    }
}

/// Non-empty poses, with their samples relit under `weights` for the search of their frames.
fn load_poses(
    project: &Project,
    (provisional, weights): (&[ResponseTable], &[Vec<[f32; 3]>]),
    scale: f32,
    progress: &Progress,
) -> Result<(Vec<Pose>, Vec<PoseSamples>)> {
    let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
    let lamps = shoot.all_lamps().len();
    let (mut poses, mut samples) = (Vec::new(), Vec::new());
    // A pose that lacks an OLAT is no sum of all lamps.
    let whole = |pose: &usize| project.pose_lamps(*pose).len() == lamps;
    let all = 0..shoot.poses.len();
    let is_any_whole = all.clone().any(|pose| whole(&pose));
    for pose in all.filter(|pose| !is_any_whole || whole(pose)) {
        let name = &shoot.poses[pose];
        progress.check("nothing was changed")?;
        progress.step("poses", pose as u64 + 1, shoot.poses.len() as u64, name.clone());
        let matte = project.exemplar_matte(pose);
        let mask = footage::read_mask(&matte, framing)?;
        let inside = inside(&mask, SAMPLES);
        let olats = (0..lamps)
            .into_par_iter()
            .map(|lamp| sample_olat(project, (pose, lamp), (&mask, &matte), &inside, scale))
            .collect::<Result<Vec<_>>>()?;
        let codes: Vec<CodeValues> = (0..inside.len()).flat_map(|i| olats.iter().map(move |olat| olat[i])).collect();
        if !codes.is_empty() {
            let responses = provisional.iter().zip(weights);
            let relit = responses.map(|(table, weights)| relit(&codes, lamps, table, weights)).collect();
            samples.push(PoseSamples::new(pose, mask.size(), inside, relit));
            poses.push(Pose { codes, frame_match: None });
        }
    }
    Ok((poses, samples))
}

/// Pixels of some frames, and the best frame for each pose.
fn load_frames(
    project: &Project,
    poses: &[PoseSamples],
    (provisional, scale): (&[ResponseTable], f32),
    progress: &Progress,
) -> Result<(Vec<Samples>, Vec<Option<FrameMatch>>)> {
    type FrameSample = (usize, Samples, Vec<Option<FrameMatch>>);
    let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
    let step = shoot.frames.len().div_ceil(FRAMES).max(1);
    let search = shoot.frames.len().div_ceil(SEARCHED_FRAMES).max(1);
    let wanted: Vec<usize> = (0..shoot.frames.len()).filter(|frame| frame % step == 0 || frame % search == 0).collect();
    let (mut frames, mut matched) = (Vec::new(), vec![None; poses.len()]);
    // Only a few pictures are in memory at a time.
    for (part, some) in wanted.chunks(8).enumerate() {
        progress.check("nothing was changed")?;
        progress.step("frames", (8 * part) as u64, wanted.len() as u64, "");
        let read = some
            .par_iter()
            .map(|&frame| {
                let read = footage::readable_frame(project, frame)?;
                let matte = project.frame_matte(read);
                let mask = footage::read_mask(&matte, framing)?;
                let picture = project.frame_picture(read);
                let picture = read_codes(&picture, framing, (&mask, &matte), scale)
                    .map_err(|e| footage::offer(project, frame, e))?;
                let found = poses.iter().map(|pose| pose.compare(frame, &mask, &picture, provisional)).collect();
                let places = inside(&mask, SAMPLES);
                let sample = places.iter().map(|&place| picture[place]).collect();
                Ok((frame, sample, found))
            })
            .collect::<Result<Vec<FrameSample>>>()?;
        for (frame, sample, found) in read {
            if frame % step == 0 && !sample.is_empty() {
                frames.push(sample);
            }
            for (best, new) in matched.iter_mut().zip(found) {
                *best = FrameMatch::nearer(best.take(), new);
            }
        }
    }
    Ok((frames, matched))
}

/// Refuses mattes without a subject, and a subject that is black or clipped everywhere.
fn check_light(project: &Project, poses: &[Pose], frames: &[Vec<CodeValues>]) -> Result<()> {
    for (what, empty) in [("exemplar_masks", poses.is_empty()), ("interview_masks", frames.is_empty())] {
        if empty {
            return Err(Error::invalid(
                format!("{} shows no subject: no pixel has a coverage above 0.98", project.shoot_path(what).display()),
                "Check the mattes: the subject is white in them",
            ));
        }
    }
    let fault = |pictures: &mut dyn Iterator<Item = &CodeValues>| {
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
    for (what, fault) in [
        ("exemplars", fault(&mut poses.iter().flat_map(|pose| &pose.codes))),
        ("interview", fault(&mut frames.iter().flatten())),
    ] {
        if let Some(fault) = fault {
            return Err(Error::invalid(
                format!("{} shows {fault}", project.shoot_path(what).display()),
                "Check the exposure, and that the pictures and the mattes belong together",
            ));
        }
    }
    Ok(())
}

/// Pixels as sums of their OLATs.
fn relit(codes: &[CodeValues], lamps: usize, table: &ResponseTable, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
    codes.par_chunks_exact(lamps).with_min_len(256).map(|codes| sum(codes, table, weights)).collect()
}

/// One pixel's light: the sum of its OLATs.
fn sum(codes: &[CodeValues], table: &ResponseTable, weights: &[[f32; 3]]) -> [f32; 3] {
    codes
        .iter()
        .zip(weights)
        .fold([0.0; 3], |sum, (code, weight)| [0, 1, 2].map(|c| sum[c] + weight[c] * table.light(code[c])))
}

/// Quantiles of all pixels of several pictures together, encoded in `[0, 1]`.
fn encoded_quantiles(pictures: &[Vec<CodeValues>]) -> Quantiles {
    [0, 1, 2].map(|c| {
        let codes = pictures.iter().flatten();
        quantiles(codes.map(|code| f32::from(code[c]) / f32::from(STEPS)).collect())
    })
}

/// Code values of a picture at some places of its matte.
pub(crate) fn sample(
    picture: &Picture,
    framing: &Framings,
    mask: &Mask,
    matte: &Matte,
    places: &[usize],
    scale: f32,
) -> Result<Vec<CodeValues>> {
    let codes = read_codes(picture, framing, (mask, matte), scale)?;
    Ok(places.iter().map(|&place| codes[place]).collect())
}

/// Code values of an OLAT at some places of its pose's matte; 0 if the pose lacks it.
pub(crate) fn sample_olat(
    project: &Project,
    (pose, lamp): (usize, usize),
    (mask, matte): (&Mask, &Matte),
    places: &[usize],
    scale: f32,
) -> Result<Vec<CodeValues>> {
    if !project.has_olat(pose, lamp) {
        return Ok(vec![CodeValues::default(); places.len()]);
    }
    let picture = project.olat_picture(pose, lamp);
    sample(&picture, &project.settings.framing, mask, matte, places, scale)
}

/// Factor on the light of interview and OLATs: see [`code_values::scale`].
///
/// # Errors
/// When a picture cannot be read.
pub(super) fn scale(project: &Project) -> Result<f32> {
    let framing = &project.settings.framing;
    let lamps = project.pose_lamps(0).into_iter();
    let olats = lamps.map(|lamp| project.olat_picture(0, lamp));
    let pictures: Vec<Picture> = [project.frame_picture(0)].into_iter().chain(olats).collect();
    code_values::scale(&pictures, |picture| {
        let light = footage::read_framed_light(picture, framing, &Response::Srgb)?;
        Ok(light.pixels.iter().flatten().copied().fold(0.0, f32::max))
    })
}

/// Code values of a picture, which must have its matte's size; of `scale` times its light if that is scene-linear.
fn read_codes(
    picture: &Picture,
    framing: &Framings,
    (mask, matte): (&Mask, &Matte),
    scale: f32,
) -> Result<Vec<CodeValues>> {
    let read = if scale == 1.0 {
        footage::read_encoded(picture, framing)?
    } else {
        encoded(&footage::read_framed_light(picture, framing, &Response::Srgb)?, scale)
    };
    if read.0.size() != mask.size() {
        return Err(Error::other_size(
            (picture.display(), read.0.size()),
            (matte.display(), mask.size()),
            "Use the matte that belongs to the picture",
        ));
    }
    Ok(codes(&read))
}

/// The interpolated quantiles of one or more values.
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
}
