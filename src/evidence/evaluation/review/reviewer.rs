//! Measures the prediction: every case against its truth, under every lamp.

use super::super::flicker::{self, ClipFlicker};
use super::super::metrics::{Compared, check, encoded, mean_inside, psnr, scale};
use super::super::{Truth, flip::PIXELS_PER_DEGREE, flip::flip, ssim};
use super::{Case, CaseScores, FORMAT, Fingerprint, OlatScore, Review};
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use footage::{Exemplar, Frame};
use gpu::{ComputeDevice, DeviceChoice};
use imaging::{Image, Mask};
use project::Project;
use rayon::prelude::*;
use reflectance::{ReflectanceField, checkpoint::CheckpointInfo};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use transfer::OlatPredictor;

/// Message after a stop by the user.
const KEPT: &str = "the figures measured before are kept";

/// PSNR in dB of a pose's OLATs, predicted from the other poses: by the exemplars alone, and with the project's
/// network. If training did not see the pose, the difference is the benefit of training.
///
/// # Errors
/// When there is no calibration, a file cannot be read, or the device fails.
pub fn with_and_without_network(project: &Project, pose: usize, device: DeviceChoice) -> Result<[f64; 2]> {
    let mut reviewer = Reviewer::open(project, None, device)?;
    let with = reviewer.decibels(pose)?;
    reviewer.predictor = reviewer.predictor.corrected_by(None);
    Ok([reviewer.decibels(pose)?, with])
}

/// A case under every lamp, predicted and true.
pub(super) struct CasePictures {
    pub mask: Mask,
    pub predicted: Vec<Image>,
    pub truths: Vec<Image>,
}

impl CasePictures {
    pub fn compared(&self) -> Compared<'_> {
        Compared { pictures: &self.predicted, truths: &self.truths, mask: &self.mask }
    }
}

/// The prediction and its test cases.
pub(super) struct Reviewer<'a> {
    pub project: &'a Project,
    pub calibration: Calibration,
    pub predictor: OlatPredictor,
    truth: Option<Truth>,
}

impl<'a> Reviewer<'a> {
    /// Opens the project's exemplars and network, and the truth if given.
    pub fn open(project: &'a Project, truth: Option<&Path>, device: DeviceChoice) -> Result<Self> {
        let compute = ComputeDevice::choose(device);
        let calibration = Calibration::load(project)?;
        Ok(Self {
            project,
            predictor: OlatPredictor::open(project, &calibration, &compute.device)?.steady(project, &calibration),
            calibration,
            truth: truth.map(|folder| Truth::open(project, folder)).transpose()?,
        })
    }

    /// Available cases: frames with true OLATs, then all poses.
    fn cases(&self) -> Vec<Case> {
        let frames = self.truth.iter().flat_map(|truth| {
            let known = truth.frames.iter().copied().filter(|&f| truth.has_olats(f));
            known.map(Case::Frame)
        });
        let poses = 0..self.project.settings.shoot.poses.len();
        frames.chain(poses.map(Case::Pose)).collect()
    }

    /// Predicts a case and reads its truth. A pose is carried over from the other poses only.
    pub fn predict(&self, case: Case) -> Result<CasePictures> {
        let response = &self.calibration.response;
        let (frame, truths) = match (case, &self.truth) {
            (Case::Frame(index), Some(truth)) => (Frame::load(self.project, response, index)?, truth.olats(index)?),
            (Case::Frame(index), None) => {
                return Err(Error::missing(
                    format!("there is no truth to compare frame {index} with"),
                    ("Give the folder with the truth", "--truth DIR"),
                ));
            }
            (Case::Pose(pose), _) => {
                let exemplar = Exemplar::load(self.project, response, pose)?;
                let light = self.calibration.interview_light();
                let frame = Frame {
                    index: pose,
                    plate: exemplar.relit_by_all(self.project, response, &light)?,
                    mask: exemplar.mask,
                };
                (frame, exemplar.olats)
            }
        };
        let field: ReflectanceField = match case {
            Case::Frame(_) => self.predictor.predict(&frame)?,
            Case::Pose(pose) => self.predictor.predict_without(&frame, pose)?,
        };
        let pictures = CasePictures {
            predicted: (0..field.lamps).map(|lamp| field.olat(lamp)).collect(),
            truths,
            mask: frame.mask,
        };
        check(&pictures.compared())?;
        Ok(pictures)
    }

    /// PSNR in dB of a pose's OLATs.
    fn decibels(&self, pose: usize) -> Result<f64> {
        Ok(psnr(&[self.predict(Case::Pose(pose))?.compared()])?.mean_db)
    }

    /// Flicker of the interview under the project's first environment, or a built-in one.
    fn flicker(&self, progress: &Progress) -> Result<Option<ClipFlicker>> {
        let mut there = (self.project.environments().into_iter()).filter(|known| !known.missing);
        let (environment, yaw_deg) = match there.next() {
            Some(known) => (Arc::new(light::panorama::load(&known.file)?), known.front.unwrap_or_default().turned(0.0)),
            None => match light::built_in::named("nave") {
                Some(nave) => (nave.environment(), 0.0),
                None => return Ok(None),
            },
        };
        flicker::clip_flicker(
            self.project,
            &self.calibration,
            (&environment, yaw_deg),
            flicker::middle(self.project),
            &mut |frame| self.predictor.predict(frame),
            progress,
        )
    }

    /// Measures every case under every lamp.
    ///
    /// # Errors
    /// When there is nothing to measure, a file cannot be read, or the user stops it.
    pub fn measure(&self, basis: Fingerprint, truth: Option<PathBuf>, progress: &Progress) -> Result<Review> {
        let cases = self.cases();
        if cases.is_empty() {
            return Err(Error::missing(
                "there is nothing to measure: no pose of the OLAT session and no frame with truth",
                ("Give a folder with truth", "--truth DIR"),
            ));
        }
        let shoot = &self.project.settings.shoot;
        let info = self.predictor.network().map(|network| network.info());
        let name = |case: Case| match case {
            Case::Frame(frame) => shoot.frames.name(frame).into_owned(),
            Case::Pose(pose) => shoot.poses[pose].clone(),
        };
        let total = 2 * cases.len() as u64;
        let step = |done: u64, case: Case| {
            progress.check(KEPT)?;
            progress.step("measuring", done, total, name(case));
            Ok(())
        };
        // Two rounds, so that only one case is in memory at a time. One scale applies to all frames, whose truth has
        // its own units, and one to all poses.
        let mut luminances = [[0f64; 2]; 2];
        for (done, &case) in cases.iter().enumerate() {
            step(done as u64, case)?;
            let [pictures, truths] = self.predict(case)?.compared().luminances();
            let sums = &mut luminances[usize::from(matches!(case, Case::Pose(_)))];
            *sums = [sums[0] + pictures, sums[1] + truths];
        }
        let scales = luminances.map(scale);
        let mut measured = Vec::with_capacity(cases.len());
        for (done, &case) in cases.iter().enumerate() {
            step((cases.len() + done) as u64, case)?;
            let scale = scales[usize::from(matches!(case, Case::Pose(_)))];
            measured.push(CaseScores {
                case,
                name: name(case),
                seen: info.is_some_and(|info| was_seen(info, case)),
                scale,
                cells: cells(&self.predict(case)?, scale, progress)?,
            });
        }
        progress.step("measuring", total, total, "");
        Ok(Review {
            format: FORMAT,
            basis,
            truth,
            training_steps: info.map_or(0, |info| info.step),
            training_seconds: info.map_or(0.0, |info| info.seconds),
            flicker: flicker::if_possible(self.flicker(progress), progress)?,
            lamps: shoot.lamps.clone(),
            cases: measured,
        })
    }
}

/// True if a network was trained on a case.
fn was_seen(info: &CheckpointInfo, case: Case) -> bool {
    match case {
        Case::Frame(frame) => info.training_frames.contains(&frame),
        Case::Pose(pose) => info.held_out.is_none_or(|held_out| held_out.pose != pose),
    }
}

/// Scores of each lamp, with the predictions multiplied by `scale`.
fn cells(pictures: &CasePictures, scale: f64, progress: &Progress) -> Result<Vec<OlatScore>> {
    let compared = pictures.compared();
    let exposure = compared.exposure();
    let decibels = compared.pictures_db(scale);
    let lamps = 0..pictures.truths.len();
    lamps
        .into_par_iter()
        .map(|lamp| {
            progress.check(KEPT)?;
            let mask = &pictures.mask;
            let truth = encoded(&pictures.truths[lamp], mask, exposure as f32);
            let predicted = encoded(&pictures.predicted[lamp], mask, (exposure * scale) as f32);
            Ok(OlatScore {
                psnr_db: decibels[lamp],
                ssim: mean_inside(&ssim(&truth, &predicted)?, mask)?,
                flip: mean_inside(&flip(&truth, &predicted, PIXELS_PER_DEGREE)?.error, mask)?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;
    use reflectance::checkpoint::HeldOut;
    use reflectance::{Formulation, Normalization, Precision, Statistics, UNetConfig};

    #[test]
    fn a_lamp_that_is_off_is_told_from_one_that_is_not() {
        let picture =
            |level: f32| Raster::from_fn(24, 24, |x, y| [level * (0.4 + 0.1 * ((x * 7 + y * 3) % 5) as f32); 3]);
        let pictures = CasePictures {
            mask: Mask::filled(24, 24, 1.0),
            // In its own units: twice as bright as the truth.
            predicted: vec![picture(2.0), picture(2.2), picture(0.0)],
            truths: vec![picture(1.0), picture(1.0), picture(1.0)],
        };
        let found = cells(&pictures, 0.5, &Progress::silent()).unwrap();
        assert!(found[0].psnr_db > 100.0 && found[0].flip < 1e-3 && found[0].ssim > 0.999, "{found:?}");
        assert!(found[1].psnr_db < 40.0 && found[1].flip > 0.01, "{found:?}");
        assert!(found[2].psnr_db < found[1].psnr_db && found[2].flip > 0.5 && found[2].ssim < 0.2, "{found:?}");
    }

    #[test]
    fn only_what_was_kept_out_of_training_is_unseen() {
        let mut info = CheckpointInfo {
            step: 9,
            seconds: 1.0,
            scale: 1.0,
            training_frames: vec![0, 2],
            network: UNetConfig {
                size: 16,
                lamps: 2,
                depth: None,
                width: 8,
                most_channels: 8,
                normalization: Normalization::None,
                statistics: Statistics::Own,
                formulation: Formulation::Ratio,
                precision: Precision::Full,
            },
            held_out: None,
        };
        assert!(was_seen(&info, Case::Frame(2)) && !was_seen(&info, Case::Frame(1)));
        assert!(was_seen(&info, Case::Pose(1)));
        info.held_out = Some(HeldOut { pose: 1, step: 9, decibels: 20.0 });
        assert!(was_seen(&info, Case::Pose(0)) && !was_seen(&info, Case::Pose(1)));
    }
}
