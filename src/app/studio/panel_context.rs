//! Input of the panels. A panel is a struct with `ui(&mut self, ui, &PanelContext, &mut Vec<Command>)`: it keeps
//! the state that only the drawing needs, reads the rest here, and changes nothing but by commands.

use super::accuracy::Accuracy;
use super::color_views::ColorViews;
use super::destination_check::ExistingFiles;
use super::environment_library::EnvironmentEntry;
use super::environment_list::ListedEnvironment;
use super::footage_reader::FootageReader;
use super::layout::Pane;
use super::matte_painting::MattePainting;
use super::network_review::NetworkReview;
use super::project_check::ProjectCheck;
use super::recents::Recents;
use super::state::State;
use super::status::{Phase, Status};
use super::stored_looks::StoredLooks;
use super::training::Training;
use super::wizard::Wizard;
use benchmark::MachineReport;
use light::aim::NoAim;
use light::highlight::Highlights;
use project::Project;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use tradeoff::Against;
use worker::{Export, GammaView, PreviewPicture, ProbeView};

/// Everything that panels can show.
#[derive(Clone, Copy)]
pub struct PanelContext<'a> {
    pub project: Option<&'a Project>,
    pub state: &'a State,
    /// The headings that are folded.
    pub folded: &'a BTreeSet<String>,
    pub status: &'a Status,
    pub environments: &'a [EnvironmentEntry],
    /// The panes that are visible.
    pub shown: &'a [Pane],
    /// The newest picture.
    pub relit: Option<&'a Arc<PreviewPicture>>,
    /// The light of the probed pixel under each lamp at full power.
    pub texel: Option<&'a [[f32; 3]]>,
    /// Reason no light was placed where the picture was clicked.
    pub no_aim: Option<NoAim>,
    /// Positions of the lights in the newest picture's frame, once they are known.
    pub highlights: Option<&'a Highlights>,
    /// The lamp that falls where the pointer is, by its index, while lights are placed by the face.
    pub proposed: Option<usize>,
    /// The queue of exports.
    pub exports: &'a [Export],
    /// Files of the next export that exist already.
    pub existing_files: Option<&'a ExistingFiles>,
    /// Destination of the next export if it replaces nothing.
    pub export_to: &'a str,
    /// Study of the mirror balls, or the reason they cannot be read.
    pub probe: Option<&'a Result<Arc<ProbeView>, String>>,
    /// Fit of the tried response, or the reason it is unknown.
    pub gamma: Option<&'a Result<Arc<GammaView>, String>>,
    /// The current frame under every lamp, and how close the network is to the truth.
    pub review: &'a NetworkReview,
    /// Cost of each way to go, and its distance from the truth.
    pub accuracy: &'a Accuracy,
    /// Abilities of this machine, as far as they were measured.
    pub machine: Option<&'a MachineReport>,
    /// Degree of trust in the project.
    pub check: &'a ProjectCheck,
    /// The network's training.
    pub training: &'a Training,
    /// Reason nothing can be written into the project: another process holds its lock.
    pub read_only: Option<&'a str>,
    /// The recent projects.
    pub recents: &'a Recents,
    /// The project that is being planned.
    pub wizard: &'a Wizard,
    /// The pictures as they were filmed.
    pub footage: &'a FootageReader,
    /// Strokes on mattes, and the shown frame's matte by them.
    pub matte: &'a MattePainting,
    /// The stored looks of the project and of the person.
    pub looks: &'a StoredLooks,
    /// Views of the OpenColorIO configuration, to look through and to export by.
    pub color_views: &'a ColorViews,
    /// Reason a change is not on the disk.
    pub unsaved: Option<&'a str>,
    /// A change is being written, and that takes long.
    pub saving: bool,
}

impl PanelContext<'_> {
    /// True if pictures can be made. If not, the viewport names the reason, or the work in progress.
    pub fn is_live(&self) -> bool {
        matches!(self.status.phase, Phase::Ready { .. })
    }

    /// The truth that accuracy is measured against: the one that was used last, or the shoot's own.
    pub fn accuracy_truth(&self) -> Option<PathBuf> {
        let measured = self.accuracy.measured().map(|ledger| &ledger.against);
        let used = measured.and_then(|against| match against {
            Against::Truth(folder) => Some(folder.clone()),
            Against::Pose(_) => None,
        });
        used.or_else(|| self.review.truth())
    }

    /// True if a visible pane shows the running job with its buttons.
    pub fn job_has_pane(&self) -> bool {
        self.training.running && self.shown.contains(&Pane::Training)
    }

    /// True if a visible pane shows the reason something could not be done.
    pub fn refusal_has_pane(&self) -> bool {
        self.shown.contains(&Pane::Picture) || self.shown.contains(&Pane::Project)
    }

    /// The name of an environment, with its origin if another one has the same name.
    pub fn title(&self, entry: &EnvironmentEntry) -> String {
        let ListedEnvironment { name, owner, .. } = &entry.listed;
        match entry.listed.is_ambiguous(&self.state.look.environments) {
            true => format!("{name}, {}", owner.says()),
            false => name.clone(),
        }
    }

    /// The lamps that light the subject alone, `first` and how many more.
    pub fn lamps_named(&self, first: usize) -> String {
        let lamps = self.project.map(|project| &project.settings.shoot.lamps);
        let name = lamps.and_then(|lamps| lamps.get(first));
        let name = name.map_or_else(|| format!("lamp {first}"), Clone::clone);
        match self.state.solo.len() {
            0 | 1 => name,
            all => format!("{name} and {} more", all - 1),
        }
    }

    /// The entry that lights the subject, if there is any.
    pub fn environment(&self) -> Option<&EnvironmentEntry> {
        self.environments.get(self.state.look.environment)
    }
}
