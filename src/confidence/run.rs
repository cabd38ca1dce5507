//! The whole of it, for a project.

use super::cells::{Cells, SIDE};
use super::earlier::Network;
use super::folds::{Photographed, errors, left_out};
use super::lamps::LampShares;
use super::poses::{Poses, missing};
use super::relation::{PoseErrors, Relation, Sign};
use super::report::{ConfidenceReport, Expected, FrameConfidence, Judged, SAID_SHARE};
use base::error::{Error, Result};
use base::numbers::within;
use base::progress::Progress;
use calibration::Calibration;
use evaluation::{Truth, excluded_check};
use footage::{Frame, PictureSize};
use gpu::{ComputeDevice, DeviceChoice};
use project::Project;
use std::path::{Path, PathBuf};

/// Frames that are looked at unless more are asked for.
const MOST_FRAMES: usize = 400;

/// What to find out.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct ConfidenceSettings {
    /// Also say how large errors are: minutes of training for networks that each leave out one pose, all together. The more
    /// the poses and the minutes, the surer.
    #[arg(long, value_name = "MINUTES", value_parser = within(0.01f64..=100_000.0))]
    pub errors: Option<f64>,
    /// Name so many frames that are worth photographing as poses.
    #[arg(long, value_name = "COUNT", default_value_t = 3, value_parser = within(0usize..=100))]
    pub poses: usize,
    /// Look at every so-manieth frame [default: at most 400 of them].
    #[arg(long, value_name = "N", value_parser = within(1usize..=1_000_000))]
    pub every: Option<usize>,
    /// A folder with the truth of some frames: counts how often what is said of errors holds there.
    #[arg(long, value_name = "DIR", requires = "errors")]
    pub truth: Option<PathBuf>,
    /// Where the network runs.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

impl Default for ConfidenceSettings {
    fn default() -> Self {
        Self {
            errors: None,
            poses: 3,
            every: None,
            truth: None,
            device: DeviceChoice::default(),
        }
    }
}

/// Finds out how far the network's predictions can be trusted, and writes it into the project.
///
/// # Errors
/// When there is no network, files cannot be read or written, or a stop was asked for; networks that were trained until then
/// are kept, and the next run goes on.
pub fn confidence(
    project: &Project,
    settings: &ConfidenceSettings,
    progress: &Progress,
) -> Result<ConfidenceReport> {
    project.check_shoot()?;
    let calibration = Calibration::load(project)?;
    let compute = ComputeDevice::choose(settings.device);
    progress.say(format!("The network runs on the {}", compute.description));
    let report = compute.guarded(|| find(project, &calibration, settings, &compute, progress))?;
    report.save(project)?;
    Ok(report)
}

fn find(
    project: &Project,
    calibration: &Calibration,
    settings: &ConfidenceSettings,
    compute: &ComputeDevice,
    progress: &Progress,
) -> Result<ConfidenceReport> {
    let network = Network::open(project, compute)?;
    let predictor = &network.predictor;
    let count = project.settings.shoot.poses.len();
    if count < 2 {
        return Err(Error::invalid(
            format!(
                "{} has {count} pose, but how far is far can only be told from two or more",
                project.root.display()
            ),
            "Photograph more poses",
        ));
    }
    // Their OLATs are read again where they are needed: all of them may be gigabytes.
    let mut shown = Vec::with_capacity(count);
    for pose in 0..count {
        progress.check("Nothing was found out yet")?;
        progress.step("reading poses", pose as u64, count as u64, "");
        shown.push(Photographed::load(project, calibration, pose)?.frame);
    }
    progress.step("reading poses", count as u64, count as u64, "");
    let mut poses = Poses::of(predictor, &shown)?;
    let among = poses.among_themselves();
    let frames = project.settings.shoot.frames.len();
    let every = settings
        .every
        .unwrap_or(frames.div_ceil(MOST_FRAMES))
        .max(1);
    let info = predictor.info();
    let distances = among.iter().map(|nearest| nearest.distance).collect();
    let mut report = ConfidenceReport::new(info.step, info.seconds, distances, every);
    if let Some(minutes) = settings.errors {
        let minutes = minutes / count as f64;
        report.minutes = Some(minutes);
        for pose in 0..count {
            progress.say(format!(
                "Pose {} of {count} is left out: {minutes:.1} minutes of training",
                pose + 1
            ));
            report.left_out.push(left_out(
                (project, calibration),
                &shown,
                pose,
                info,
                minutes,
                (compute, settings.device),
                progress,
            )?);
        }
        if !network.has_past() {
            // What is not known of frames must not explain the poses.
            report
                .left_out
                .iter_mut()
                .for_each(PoseErrors::forget_changes);
        }
        report.relation = Relation::learn(&report.left_out, SAID_SHARE);
        let lamps: Vec<_> = report.left_out.iter().map(|pose| &pose.lamps).collect();
        report.lamps = LampShares::learn(&lamps);
    }
    let wanted: Vec<usize> = (0..frames).step_by(every).collect();
    let mut all = Vec::with_capacity(wanted.len());
    for (done, &frame) in wanted.iter().enumerate() {
        progress.check("Networks that were trained are kept")?;
        progress.step("looking at frames", done as u64, wanted.len() as u64, "");
        let frame = Frame::load(project, &calibration.response, frame)?;
        let cells = Cells::of(predictor, &frame)?;
        let nearest = poses.nearest(&cells, None);
        let mut map = vec![0.0; SIDE * SIDE];
        for &(cell, distance) in &nearest.cells {
            map[cell] = distance;
        }
        let mut found = FrameConfidence {
            frame: frame.index,
            distance: nearest.distance,
            pose: nearest.pose,
            expected: None,
            cells: map,
            errors: Vec::new(),
            lamps: Vec::new(),
        };
        if let Some(relation) = &report.relation {
            let (_, changed) = network.predict(&frame)?;
            let signs = (nearest.cells.iter())
                .map(|&(cell, distance)| (cell, Sign::of(cell, distance, changed.as_ref())));
            let decibels = relation.decibels(signs.clone().map(|(_, sign)| sign));
            found.expected = decibels.map(|[psnr_db, at_least_db]| Expected {
                psnr_db,
                at_least_db,
            });
            found.errors = vec![0.0; SIDE * SIDE];
            for (cell, sign) in signs {
                found.errors[cell] = relation.cells(sign)[0] as f32;
            }
            if let (Some(lamps), Some(expected)) = (&report.lamps, found.expected) {
                let changes = changed.as_ref().map(|changed| &changed.lamps[..]);
                let decibels = lamps.decibels(expected.psnr_db, changes);
                found.lamps = decibels.into_iter().map(|db| db as f32).collect();
            }
        }
        report.frames.push(found);
        all.push(cells);
    }
    progress.step(
        "looking at frames",
        wanted.len() as u64,
        wanted.len() as u64,
        "",
    );
    if let (Some(folder), Some(relation)) = (&settings.truth, &report.relation) {
        let judge = (&network, &poses, relation, report.lamps.as_ref());
        report.judged = judged(project, calibration, folder, judge, progress)?;
    }
    let chosen = missing(&mut poses, &all, settings.poses);
    // What is as near as poses are to each other is not missing.
    let chosen = chosen.into_iter().filter(|(_, distance)| *distance > 0.0);
    report.missing = chosen.map(|(place, _)| wanted[place]).collect();
    Ok(report)
}

/// How often what a relation says holds on the frames of a truth; None if it has no OLATs.
fn judged(
    project: &Project,
    calibration: &Calibration,
    folder: &Path,
    (network, poses, relation, lamps): (&Network, &Poses, &Relation, Option<&LampShares>),
    progress: &Progress,
) -> Result<Option<Judged>> {
    let truth = Truth::open(project, folder)?;
    excluded_check(&network.predictor.info().training_frames, &truth.frames)?;
    let frames: Vec<usize> = (truth.frames.iter().copied())
        .filter(|&frame| truth.has_olats(frame))
        .collect();
    let mut found = Vec::with_capacity(frames.len());
    for (done, &frame) in frames.iter().enumerate() {
        progress.check("Networks that were trained are kept")?;
        progress.step(
            "comparing with the truth",
            done as u64,
            frames.len() as u64,
            "",
        );
        let shown = Photographed {
            frame: Frame::load(project, &calibration.response, frame)?,
            olats: truth.olats_at(frame, PictureSize::Square)?,
        };
        found.push(errors(network, poses, &shown)?);
    }
    Ok(Judged::of(relation, lamps, &found))
}
