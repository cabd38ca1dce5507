//! Report on relighting an interview.

use crate::{Rebuild, Stages, handed_over};
use compositor::PassReport;
use serde::Serialize;
use std::path::PathBuf;

/// Report on the frames and files that were written.
#[derive(Clone, Debug, Serialize)]
pub struct RelightReport {
    /// Number of frames.
    pub frames: usize,
    /// Number of frames that were there already, from an export that was stopped.
    pub kept: usize,
    /// Mean time per frame in milliseconds: prediction, sum, picture and file.
    pub ms_per_frame: f64,
    /// Mean times of the stages, which run side by side.
    pub stages: Stages,
    /// The passes of the last frame, with their mean time over all frames.
    pub passes: Vec<PassReport>,
    /// Destination, with the number of frames as it was asked for.
    pub output: String,
    /// Accuracy with which the light layers gave back the relit subject, if they were asked for.
    pub layers: Option<Rebuild>,
    /// Share of the environment's energy that comes from where no lamp is.
    pub uncovered_energy: f32,
    /// Device that ran the network, and the reason for it.
    pub device: String,
    /// Files that were written beside it for other programs, in the order in which they were asked for.
    pub hand_over: Vec<PathBuf>,
}

impl RelightReport {
    /// Summary of the files, and of how well the light layers add up.
    pub fn sentence(&self) -> String {
        let frames = match self.frames {
            1 => "1 frame".to_owned(),
            frames => format!("{frames} frames"),
        };
        let kept = match self.kept {
            0 => String::new(),
            kept => format!(" ({kept} were there already)"),
        };
        let layers =
            self.layers.as_ref().map_or(String::new(), |check| format!(". {}", check.sentence()));
        let handed_over = handed_over(&self.hand_over);
        format!(
            "{frames}{kept} at {:.0} ms each: {}{layers}{handed_over}",
            self.ms_per_frame, self.output
        )
    }
}
