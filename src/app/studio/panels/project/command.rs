//! Commands for projects.

use super::plan::Plan;
use crate::layout::Pane;
use crate::panels::footage::reader::Thumbnail;
use footage::LampSettings;
use footage::candidate::Slot;
use project::Framing;
use std::path::PathBuf;

/// Opens, creates and changes projects.
#[derive(Clone, Debug, PartialEq)]
pub enum ProjectCommand {
    /// Open the project in a folder. Asks first if work would end.
    Open(PathBuf),
    /// Open the project that the question was about; work ends.
    Leave,
    /// Reread the open project.
    Reopen,
    /// Remove a folder from the recent projects; the disk is unchanged.
    Forget(PathBuf),
    /// Plan a project, for the shoot in a folder if known.
    New(Option<PathBuf>),
    /// Change the plan for a project; None discards it.
    Plan(Option<Box<Plan>>),
    /// Add files or folders of a shoot to the plan, as parts of this kind, or guess the kind.
    Bring(Vec<PathBuf>, Option<Slot>),
    /// Make the planned project and open it.
    Make,
    /// Make the demo in this folder and open its project.
    MakeDemo(PathBuf),
    /// Set the new folder of the project's shoot.
    Locate(PathBuf),
    /// Change the crop to this square. Results with another crop are put aside.
    Reframe(Framing),
    /// Correct the shoot's lamps. Results with the lamps before are put aside.
    CorrectLamps(LampSettings),
    /// Read these thumbnails, which this pane has room for.
    Thumbnails(Pane, Vec<Thumbnail>),
}
