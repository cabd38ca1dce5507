//! State of the project check. A background thread runs it.

use super::environment_library::{EnvironmentEntry, PanoramaState};
use super::state::State;
use check::{CheckReport, Level, LitEnvironment};
use project::Project;
use std::sync::Arc;
use worker::background::drop_later;
use worker::{CheckRequest, CheckThread};

/// Answers of the thread, which starts on first use.
#[derive(Default)]
pub struct ProjectCheck {
    /// The newest report, or the reason for its absence. It stays until there is a newer one.
    pub report: Option<Result<Arc<CheckReport>, String>>,
    thread: Option<CheckThread>,
    /// The last request.
    asked: Option<CheckRequest>,
    /// True if the report is older than the last request.
    waiting: bool,
    /// Number of times that the project may have changed.
    changes: u64,
}

impl ProjectCheck {
    /// Marks the project as possibly changed by a job.
    pub fn invalidate(&mut self) {
        self.changes += 1;
    }

    /// Takes in the newest report.
    pub fn receive(&mut self) {
        if let Some(report) = self.thread.as_ref().and_then(CheckThread::report) {
            self.report = Some(report);
            self.waiting = false;
        }
    }

    /// True if a report is on its way or still has to be requested.
    pub fn is_waiting(&self) -> bool {
        let newest = self.asked.as_ref().map(|asked| asked.changes);
        self.waiting || newest != Some(self.changes)
    }

    /// The level of the whole project; None before any measurement.
    pub fn level(&self) -> Option<Level> {
        let report = self.report.as_ref()?.as_ref().ok()?;
        let unmeasured = report.count(Level::Unknown) == report.checks.len();
        (!unmeasured).then_some(report.level)
    }

    /// Requests a report if the project or the light changed. Called while no drag and no playback is in progress.
    pub fn ask(
        &mut self,
        project: &Project,
        state: &State,
        environments: &[EnvironmentEntry],
        wake: impl Fn() + Send + Sync + 'static,
    ) {
        let entry = environments.get(state.look.environment);
        let environment = match entry.map(|entry| (&entry.panorama, &entry.listed.name)) {
            Some((PanoramaState::Waiting, _)) => return,
            Some((PanoramaState::Done { panorama, .. }, name)) => {
                let Some(light) = &panorama.environment else {
                    return;
                };
                let scene = state.scene();
                Some(LitEnvironment {
                    name: name.clone(),
                    environment: light.clone(),
                    lighting: scene.lighting,
                    yaw_deg: scene.yaw_deg,
                })
            }
            Some((PanoramaState::Failed(_), _)) | None => None,
        };
        let wanted = CheckRequest { changes: self.changes, environment };
        if self.asked.as_ref() != Some(&wanted) {
            self.thread
                .get_or_insert_with(|| CheckThread::start(project.root.clone(), wake))
                .ask(wanted.clone());
            self.asked = Some(wanted);
            self.waiting = true;
        }
    }
}

impl Drop for ProjectCheck {
    /// Joins the thread in the background, since it may be reading pictures.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop_later(thread);
        }
    }
}
