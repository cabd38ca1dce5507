//! Estimate for a project.

use super::cells::SIDE;
use super::lamps::LampShares;
use super::missing::{Squares, missing};
use super::poses::{Photographed, distance, errors, signs, squares};
use super::relation::{PoseErrors, Relation};
use super::report::{ConfidenceReport, Expected, FrameConfidence, Judged, SAID_SHARE};
use base::error::{Error, Result};
use base::numbers::within;
use base::progress::Progress;
use calibration::Calibration;
use evaluation::Truth;
use footage::{Frame, PictureSize};
use project::Project;
use std::path::{Path, PathBuf};
use transfer::{Carried, Transfer};

/// Most frames to examine by default.
const MOST_FRAMES: usize = 400;

/// Settings of [`confidence`].
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct ConfidenceSettings {
    /// Number of frames to suggest as further poses.
    #[arg(long, value_name = "COUNT", default_value_t = 3, value_parser = within(0usize..=100))]
    pub poses: usize,
    /// Examine every N-th frame [default: at most 400 of them].
    #[arg(long, value_name = "N", value_parser = within(1usize..=1_000_000))]
    pub every: Option<usize>,
    /// Folder with the truth of some frames: tests the expected errors against it.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
}

impl Default for ConfidenceSettings {
    fn default() -> Self {
        Self { poses: 3, every: None, truth: None }
    }
}

/// Estimates the confidence in predictions and writes it into the project.
///
/// # Errors
/// Those of [`estimate`], and when the file cannot be written.
pub fn confidence(project: &Project, settings: &ConfidenceSettings, progress: &Progress) -> Result<ConfidenceReport> {
    let report = estimate(project, settings, progress)?;
    report.save(project)?;
    Ok(report)
}

/// Estimates the confidence in predictions.
///
/// # Errors
/// When files cannot be read, the shoot has fewer than two poses, or the user stops it.
pub fn estimate(project: &Project, settings: &ConfidenceSettings, progress: &Progress) -> Result<ConfidenceReport> {
    project.check_shoot()?;
    let calibration = Calibration::load(project)?;
    let count = project.settings.shoot.poses.len();
    if count < 2 {
        return Err(Error::invalid(
            format!("{} has {count} pose; error estimates predict each pose from the others", project.root.display()),
            "Photograph at least two poses",
        ));
    }
    let transfer = Transfer::open(project, &calibration)?;
    let estimate = Estimate { project, calibration: &calibration, transfer: &transfer, progress };
    estimate.report(settings)
}

struct Estimate<'a> {
    project: &'a Project,
    calibration: &'a Calibration,
    transfer: &'a Transfer,
    progress: &'a Progress<'a>,
}

impl Estimate<'_> {
    fn report(&self, settings: &ConfidenceSettings) -> Result<ConfidenceReport> {
        let poses = self.each("predicting poses", self.project.settings.shoot.poses.len(), |pose| {
            let shown = Photographed::load(self.project, self.calibration, pose)?;
            let carried = self.transfer.without(pose).carry(&shown.frame);
            Ok((distance(&carried.unlike, &shown.frame.mask), errors(&carried, &shown)))
        })?;
        let (distances, poses): (Vec<f32>, Vec<PoseErrors>) = poses.into_iter().unzip();
        let frames = self.project.settings.shoot.frames.len();
        let every = settings.every.unwrap_or(frames.div_ceil(MOST_FRAMES)).max(1);
        let mut report = ConfidenceReport::new(self.project, self.calibration, distances, every)?;
        report.relation = Relation::learn(&poses, SAID_SHARE);
        let lamps: Vec<_> = poses.iter().map(|pose| &pose.lamps).collect();
        report.lamps = LampShares::learn(&lamps);
        report.left_out = poses;
        let wanted: Vec<usize> = (0..frames).step_by(every).collect();
        let looked = self.each("looking at frames", wanted.len(), |place| {
            let frame = self.frame(wanted[place])?;
            let carried = self.transfer.carry(&frame);
            let found = looked_at(&report, &frame, &carried);
            Ok((found, squares(&carried.unlike, &frame.mask)))
        })?;
        let (looked, unexplained): (Vec<_>, Vec<Squares>) = looked.into_iter().unzip();
        report.frames = looked;
        if let (Some(folder), Some(relation)) = (&settings.truth, &report.relation) {
            report.judged = self.judged(folder, relation, report.lamps.as_ref())?;
        }
        let mut chosen = None;
        let places = missing(unexplained, settings.poses, |place, farthest| {
            self.progress.check("Nothing was written yet")?;
            if chosen.as_ref().is_none_or(|(known, _)| *known != farthest) {
                chosen = Some((farthest, self.frame(wanted[farthest])?));
            }
            let frame = self.frame(wanted[place])?;
            let apart = chosen.iter().map(|(_, chosen)| self.transfer.apart(&frame, chosen));
            Ok::<_, Error>(apart.flat_map(|unlike| squares(&unlike, &frame.mask)).collect())
        })?;
        report.missing = places.into_iter().map(|place| wanted[place]).collect();
        Ok(report)
    }

    fn frame(&self, frame: usize) -> Result<Frame> {
        Frame::load(self.project, &self.calibration.response, frame)
    }

    /// Runs stoppable steps and collects their results in order.
    fn each<T>(&self, what: &'static str, count: usize, mut step: impl FnMut(usize) -> Result<T>) -> Result<Vec<T>> {
        let results = (0..count).map(|i| {
            self.progress.check("Nothing was written yet")?;
            self.progress.step(what, i as u64, count as u64, "");
            step(i)
        });
        let results = results.collect();
        self.progress.step(what, count as u64, count as u64, "");
        results
    }

    /// Tests a relation on the frames of a truth; None if the truth has no OLATs.
    fn judged(&self, folder: &Path, relation: &Relation, lamps: Option<&LampShares>) -> Result<Option<Judged>> {
        let truth = Truth::open(self.project, folder)?;
        let frames: Vec<usize> = (truth.frames.iter().copied()).filter(|&frame| truth.has_olats(frame)).collect();
        let found = self.each("comparing with the truth", frames.len(), |place| {
            let shown = Photographed {
                frame: self.frame(frames[place])?,
                olats: truth.olats_at(frames[place], PictureSize::Square)?,
            };
            Ok(errors(&self.transfer.carry(&shown.frame), &shown))
        })?;
        Ok(Judged::new(relation, lamps, &found))
    }
}

/// Estimate for one frame.
fn looked_at(report: &ConfidenceReport, frame: &Frame, carried: &Carried) -> FrameConfidence {
    let signs = signs(carried, &frame.mask);
    let mut found = FrameConfidence {
        frame: frame.index,
        distance: distance(&carried.unlike, &frame.mask),
        pose: carried.pose,
        expected: None,
        cells: vec![0.0; SIDE * SIDE],
        errors: Vec::new(),
        lamps: Vec::new(),
    };
    for (cell, sign) in &signs {
        found.cells[*cell] = sign.distance as f32;
    }
    let Some(relation) = &report.relation else { return found };
    let decibels = relation.decibels(signs.iter().map(|(_, sign)| *sign));
    found.expected = decibels.map(|[psnr_db, at_least_db]| Expected { psnr_db, at_least_db });
    found.errors = vec![0.0; SIDE * SIDE];
    for (cell, sign) in signs {
        found.errors[cell] = relation.cells(sign)[0] as f32;
    }
    if let (Some(lamps), Some(expected)) = (&report.lamps, found.expected) {
        let spreads: Vec<f64> = carried.lamp_spreads.iter().map(|v| f64::from(*v)).collect();
        let decibels = lamps.decibels(expected.psnr_db, Some(&spreads));
        found.lamps = decibels.into_iter().map(|db| db as f32).collect();
    }
    found
}
