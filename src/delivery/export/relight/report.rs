//! Report on an export.

use crate::{Destination, Rebuild, Stages, handed_over};
use compositor::PassReport;
use serde::Serialize;
use std::path::PathBuf;

/// Report on the written frames and files.
#[derive(Clone, Debug, Serialize)]
pub struct RelightReport {
    /// Number of frames.
    pub frames: usize,
    /// Number of frames that existed already, from a stopped export.
    pub kept: usize,
    /// Mean time per frame in milliseconds: prediction, sum, picture and file.
    pub ms_per_frame: f64,
    /// Mean times of the stages, which overlap.
    pub stages: Stages,
    /// Passes of the last frame, with their mean time over all frames.
    pub passes: Vec<PassReport>,
    /// Destination, with the frame number as requested.
    pub output: Destination,
    /// Accuracy with which the light layers rebuild the relit subject; None without layers.
    pub layers: Option<Rebuild>,
    /// Share of the environment's energy from directions without a lamp.
    pub uncovered_energy: f32,
    /// Device of the network, and the reason for the choice.
    pub device: String,
    /// Files written for other programs, in the requested order.
    pub hand_over: Vec<PathBuf>,
}

impl RelightReport {
    /// Summary: files, and accuracy of the light layers.
    pub fn sentence(&self) -> String {
        let frames = match self.frames {
            1 => "1 frame".to_owned(),
            frames => format!("{frames} frames"),
        };
        let kept = match self.kept {
            0 => String::new(),
            kept => format!(" ({kept} existed already)"),
        };
        let layers = self.layers.as_ref().map_or(String::new(), |check| format!(". {}", check.sentence()));
        let handed_over = handed_over(&self.hand_over);
        format!("{frames}{kept} at {:.0} ms each: {}{layers}{handed_over}", self.ms_per_frame, self.output)
    }
}
