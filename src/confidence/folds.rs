//! A network for each pose, trained without it: what it is off by there is what a network is off by on new pictures.

use super::cells::{Cells, Differences, covered};
use super::earlier::Network;
use super::lamps::LampErrors;
use super::poses::Poses;
use super::relation::{PoseErrors, Sign};
use base::error::Result;
use base::progress::Progress;
use calibration::Calibration;
use footage::{Exemplar, Frame};
use gpu::{ComputeDevice, DeviceChoice};
use imaging::Image;
use project::Project;
use reflectance::checkpoint::{self, CheckpointInfo};
use std::path::PathBuf;
use training::{Preset, TrainSettings, TrainingConfig, train};

/// How often a network is kept while it is trained.
const KEPT: f64 = 8.0;

/// A pose as a frame of the interview would show it, and as it was photographed.
pub struct Photographed {
    pub frame: Frame,
    pub olats: Vec<Image>,
}

impl Photographed {
    /// Reads pose `pose` and lights it as the interview was lit.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn load(project: &Project, calibration: &Calibration, pose: usize) -> Result<Self> {
        let response = &calibration.response;
        let exemplar = Exemplar::load(project, response, pose)?;
        let light = calibration.interview_light();
        Ok(Self {
            frame: Frame {
                index: 0,
                plate: exemplar.relit_by_all(project, response, &light)?,
                mask: exemplar.mask,
            },
            olats: exemplar.olats,
        })
    }
}

/// Where the networks of left-out poses are.
pub fn folder(project: &Project) -> PathBuf {
    project.result_path("confidence")
}

/// Trains, as far as it is not trained, a network of `like`'s shape for `minutes` without pose `pose`, and compares it with
/// that pose.
///
/// # Errors
/// When files cannot be read or written, training fails, or a stop was asked for.
pub fn left_out(
    (project, calibration): (&Project, &Calibration),
    poses: &[Frame],
    pose: usize,
    like: &CheckpointInfo,
    minutes: f64,
    (compute, choice): (&ComputeDevice, DeviceChoice),
    progress: &Progress,
) -> Result<PoseErrors> {
    let name = format!(
        "without-{pose}-for-{minutes:.3}-minutes-as-{:08x}",
        shape(like)
    );
    let mut variant = project.variant(folder(project).join("networks").join(name));
    variant.settings.shoot.poses.remove(pose);
    if !variant.calibration_path().exists() {
        calibration.save(&variant)?;
    }
    let settings = TrainSettings {
        config: TrainingConfig {
            minutes: Some(minutes),
            depth: like.network.depth,
            width: like.network.width,
            most_channels: like.network.most_channels,
            normalization: like.network.normalization,
            statistics: like.network.statistics,
            formulation: like.network.formulation,
            precision: like.network.precision,
            // Some are kept, so that one is from about the middle.
            checkpoint_seconds: (60.0 * minutes / KEPT).max(1.0),
            ..Preset::Quick.config()
        },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: false,
        device: choice,
    };
    let trained = checkpoint::info(&variant.checkpoint_path());
    if !trained.is_ok_and(|info| info.seconds >= 60.0 * minutes) {
        train(&variant, calibration, &settings, progress)?;
        progress.check("The networks that were trained are kept, and so is the one in training")?;
    }
    let network = Network::open(&variant, compute)?;
    let others = poses.iter().enumerate();
    let others = others.filter(|(other, _)| *other != pose);
    let others: Vec<Frame> = others.map(|(_, other)| other.clone()).collect();
    let known = Poses::of(&network.predictor, &others)?;
    errors(
        &network,
        &known,
        &Photographed::load(project, calibration, pose)?,
    )
}

/// What tells networks of different shapes and lights apart.
fn shape(like: &CheckpointInfo) -> u32 {
    let text = serde_json::to_string(&like.network).unwrap_or_default();
    text.bytes().fold(2_166_136_261, |hash: u32, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(16_777_619)
    })
}

/// What a network is off by on a picture whose OLATs are known, cell by cell.
///
/// # Errors
/// When the device fails, or the matte shows no subject.
pub fn errors(network: &Network, poses: &Poses, of: &Photographed) -> Result<PoseErrors> {
    let (pictures, changed) = network.predict(&of.frame)?;
    let off = Differences::of(&pictures, &of.olats, &of.frame.mask);
    let nearest = poses.nearest(&Cells::of(&network.predictor, &of.frame)?, None);
    let shown = covered(&of.frame.mask);
    let cells: Vec<_> = (nearest.cells.iter())
        .filter(|(cell, _)| shown[*cell])
        .collect();
    Ok(PoseErrors {
        signs: (cells.iter())
            .map(|(cell, distance)| Sign::of(*cell, *distance, changed.as_ref()))
            .collect(),
        squared_errors: cells.iter().map(|(cell, _)| off.cells[*cell]).collect(),
        lamps: LampErrors {
            squared_errors: off.lamps,
            squared_changes: changed.map(|changed| changed.lamps).unwrap_or_default(),
        },
    })
}
