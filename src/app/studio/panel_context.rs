//! Input of the panels. A panel is a struct with `ui(&mut self, ui, &PanelContext, &mut Vec<Command>)`: it keeps only
//! the state of its drawing, reads everything else here, and makes changes only by commands.

use super::app::{Autosave, Preview};
use super::layout::Pane;
use super::panels::environments::library::{EnvironmentEntry, EnvironmentLibrary};
use super::panels::export::exports::Exports;
use super::panels::project::picker::ProjectPicker;
use super::panels::readers::Readers;
use super::panels::{lamp_title, with_lamp_titles};
use super::state::State;
use super::status::{Phase, Status};
use super::stored_looks::StoredLooks;
use light::highlight::Highlights;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use tradeoff::Against;
use worker::PreviewPicture;

/// The open project as panels see it.
#[derive(Clone, Copy)]
pub struct OpenProject<'a> {
    /// None on the start page.
    pub project: Option<&'a Project>,
    /// Reason the project is read-only: another process holds its lock.
    pub read_only: Option<&'a str>,
}

/// Everything that panels can show.
#[derive(Clone, Copy)]
pub struct PanelContext<'a> {
    pub session: OpenProject<'a>,
    pub state: &'a State,
    pub status: &'a Status,
    /// The environments, and their panoramas.
    pub library: &'a EnvironmentLibrary,
    /// Stored looks of the project and of the person.
    pub looks: &'a StoredLooks,
    /// The newest picture.
    pub preview: &'a Preview,
    /// Calibration, review, training, footage and other facts about the project.
    pub readers: &'a Readers,
    /// The export queue, and the existing files of the next export.
    pub exports: &'a Exports,
    /// The recent projects, and the plan for a new one.
    pub picker: &'a ProjectPicker,
    /// The person's preferences, and the pending saves.
    pub autosave: &'a Autosave,
}

impl<'a> PanelContext<'a> {
    /// The list of environments.
    pub fn environments(&self) -> &'a [EnvironmentEntry] {
        self.library.entries()
    }

    /// The newest picture.
    pub fn relit(&self) -> Option<&'a Arc<PreviewPicture>> {
        self.preview.relit.as_ref()
    }

    /// Positions of the lights in the newest picture's frame, once known.
    pub fn highlights(&self) -> Option<&'a Highlights> {
        self.readers.aim.highlights(&self.relit()?.predicted)
    }

    /// Reason a look, a verdict or a stroke is not on disk.
    pub fn unsaved(&self) -> Option<&'a str> {
        self.autosave.unsaved().or(self.readers.unsaved())
    }

    /// True if the pane is visible.
    pub fn shows(&self, pane: Pane) -> bool {
        self.state.panes.shows(pane)
    }

    /// True while pictures can be made. Otherwise the viewport shows the reason, or the work in progress.
    pub fn is_live(&self) -> bool {
        matches!(self.status.phase, Phase::Ready { .. })
    }

    /// The truth for measurements: that of the last measurement, or the shoot's.
    pub fn accuracy_truth(&self) -> Option<PathBuf> {
        let measured = self.readers.accuracy.measured().map(|ledger| &ledger.against);
        let used = measured.and_then(|against| match against {
            Against::Truth(folder) => Some(folder.clone()),
            Against::Pose(_) => None,
        });
        used.or_else(|| self.readers.review.truth())
    }

    /// True if a visible pane shows the running job with its buttons.
    pub fn job_has_pane(&self) -> bool {
        self.readers.training.running && self.shows(Pane::Training)
    }

    /// True if a visible pane shows the refusal.
    pub fn refusal_has_pane(&self) -> bool {
        self.shows(Pane::Picture) || self.shows(Pane::Project)
    }

    /// Name of a lamp for people.
    pub fn lamp_title(&self, lamp: usize) -> String {
        let lamps = self.session.project.map(|project| &project.settings.shoot.lamps);
        let name = lamps.and_then(|lamps| lamps.get(lamp));
        name.map_or_else(|| format!("lamp {lamp}"), |name| lamp_title(name))
    }

    /// A sentence with the titles of the lamps in place of their names.
    pub fn with_lamp_titles(&self, sentence: &str) -> String {
        let lamps = self.session.project.map(|project| project.settings.shoot.lamps.as_slice());
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
    pub fn environment(&self) -> Option<&'a EnvironmentEntry> {
        self.environments().get(self.state.look.environment)
    }
}
