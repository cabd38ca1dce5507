//! Input of the panels. A panel is a struct with `ui(&mut self, ui, &PanelContext, &mut Vec<Command>)`: it keeps only
//! the state of its drawing, reads everything else here, and makes changes only by commands.

use super::accuracy::Accuracy;
use super::color_views::ColorViews;
use super::destination_check::ExistingFiles;
use super::environment_library::{EnvironmentEntry, Scan};
use super::footage_reader::FootageReader;
use super::layout::Pane;
use super::matte_painting::MattePainting;
use super::network_review::NetworkReview;
use super::panels::{lamp_title, with_lamp_titles};
use super::project_check::ProjectCheck;
use super::recents::Recents;
use super::state::State;
use super::status::{Phase, Status};
use super::stored_looks::StoredLooks;
use super::training::Training;
use super::wizard::Wizard;
use benchmark::MachineReport;
use export::Destination;
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
    /// The folded headings.
    pub folded: &'a BTreeSet<String>,
    /// Folders whose panoramas are listed in every project.
    pub watched: &'a BTreeSet<PathBuf>,
    /// Their newest scan; None before the first.
    pub scan: Option<&'a Scan>,
    pub status: &'a Status,
    pub environments: &'a [EnvironmentEntry],
    /// The visible panes.
    pub shown: &'a [Pane],
    /// The newest picture.
    pub relit: Option<&'a Arc<PreviewPicture>>,
    /// Frames shown per second during playback; None while nothing plays.
    pub played: Option<f64>,
    /// Light of the probed pixel under each lamp at full power.
    pub texel: Option<&'a [[f32; 3]]>,
    /// Reason that a click on the picture placed no light.
    pub no_aim: Option<NoAim>,
    /// Positions of the lights in the newest picture's frame, once known.
    pub highlights: Option<&'a Highlights>,
    /// Index of the lamp that falls on the point under the pointer, while placing lights by the face.
    pub proposed: Option<usize>,
    /// The export queue.
    pub exports: &'a [Export],
    /// Number of existing files of the next export.
    pub existing_files: Option<&'a ExistingFiles>,
    /// Destination of the next export if it replaces no files.
    pub export_to: &'a Destination,
    /// Analysis of the mirror balls, or the reason they cannot be read.
    pub probe: Option<&'a Result<Arc<ProbeView>, String>>,
    /// Fit of the trial response, or the reason it is unknown.
    pub gamma: Option<&'a Result<Arc<GammaView>, String>>,
    /// The current frame under every lamp, and the network's distance from the truth.
    pub review: &'a NetworkReview,
    /// Time and accuracy of each rung.
    pub accuracy: &'a Accuracy,
    /// Performance of this machine, as measured so far.
    pub machine: Option<&'a MachineReport>,
    /// State of the project check.
    pub check: &'a ProjectCheck,
    /// The network's training.
    pub training: &'a Training,
    /// Reason the project is read-only: another process holds its lock.
    pub read_only: Option<&'a str>,
    /// The recent projects.
    pub recents: &'a Recents,
    /// The plan for a new project.
    pub wizard: &'a Wizard,
    /// The footage as filmed.
    pub footage: &'a FootageReader,
    /// Strokes on mattes, and the resulting matte of the current frame.
    pub matte: &'a MattePainting,
    /// Stored looks of the project and of the person.
    pub looks: &'a StoredLooks,
    /// Views of the OpenColorIO configuration, for viewing and for exports.
    pub color_views: &'a ColorViews,
    /// Reason that a change is not on disk.
    pub unsaved: Option<&'a str>,
    /// True if a change is being written for a long time.
    pub saving: bool,
}

impl PanelContext<'_> {
    /// True while pictures can be made. Otherwise the viewport shows the reason, or the work in progress.
    pub fn is_live(&self) -> bool {
        matches!(self.status.phase, Phase::Ready { .. })
    }

    /// The truth for measurements: that of the last measurement, or the shoot's.
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

    /// True if a visible pane shows the refusal.
    pub fn refusal_has_pane(&self) -> bool {
        self.shown.contains(&Pane::Picture) || self.shown.contains(&Pane::Project)
    }

    /// Name of a lamp for people.
    pub fn lamp_title(&self, lamp: usize) -> String {
        let lamps = self.project.map(|project| &project.settings.shoot.lamps);
        let name = lamps.and_then(|lamps| lamps.get(lamp));
        name.map_or_else(|| format!("lamp {lamp}"), |name| lamp_title(name))
    }

    /// A sentence with the titles of the lamps in place of their names.
    pub fn with_lamp_titles(&self, sentence: &str) -> String {
        let lamps = self.project.map(|project| project.settings.shoot.lamps.as_slice());
        with_lamp_titles(sentence, lamps.unwrap_or_default())
    }

    /// Label of the solo lamps: `first`, and the number of the others.
    pub fn lamps_named(&self, first: usize) -> String {
        let name = self.lamp_title(first);
        match self.state.solo.len() {
            0 | 1 => name,
            all => format!("{name} and {} more", all - 1),
        }
    }

    /// The current environment of the list, if there is one.
    pub fn environment(&self) -> Option<&EnvironmentEntry> {
        self.environments.get(self.state.look.environment)
    }
}
