//! Reports of an import and of a project's environments.

use footage::Understood;
use light::subset::Subset;
use project::{KnownEnvironment, Project};
use serde::Serialize;
use std::path::PathBuf;

/// Current environments of a project.
#[derive(Clone, Debug, Serialize)]
pub struct EnvironmentsReport {
    pub environments: Vec<KnownEnvironment>,
}

/// Result of an import.
#[derive(Clone, Debug, Serialize)]
pub struct ImportReport {
    pub project: PathBuf,
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    /// Contents of the shoot, counted.
    pub poses: usize,
    pub lamps: usize,
    pub frames: usize,
    pub environments: usize,
    /// Format, depth and colour of each kind of picture.
    pub pictures: Vec<Understood>,
    /// Evenness of a subset of the lamps, in degrees: the largest distance from a direction that the whole rig
    /// covers to a lamp, and the smallest distance of two lamps. None if all lamps are used.
    pub covering_deg: Option<f32>,
    pub separation_deg: Option<f32>,
}

impl ImportReport {
    pub(crate) fn new(project: &Project, subset: Option<&Subset>) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            project: project.root.clone(),
            name: project.settings.name.clone(),
            size: project.settings.size,
            poses: shoot.poses.len(),
            lamps: shoot.lamps.len(),
            frames: shoot.frames.len(),
            environments: shoot.environments.len(),
            pictures: footage::understood(project),
            covering_deg: subset.map(|s| s.covering_deg),
            separation_deg: subset.map(|s| s.separation_deg),
        }
    }
}
