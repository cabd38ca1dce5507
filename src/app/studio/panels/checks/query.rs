//! State of the project check, which runs in the background: reads the project once, and checks it under the current
//! light.

use crate::panels::environments::library::{EnvironmentEntry, PanoramaState};
use crate::state::State;
use base::error::Result;
use base::progress::{Control, Progress};
use check::{CheckReport, Evidence, Level, LitEnvironment};
use project::Project;
use std::path::PathBuf;
use worker::Query;

/// The newest report, and the query for it.
#[derive(Default)]
pub struct ProjectCheck {
    /// The newest report, or the reason for its absence. It stays until there is a newer one.
    pub report: Option<std::result::Result<CheckReport, String>>,
    query: Query<CheckRequest, CheckReport>,
    /// Number of times that the project may have changed.
    changes: u64,
}

/// A request for a check.
#[derive(Clone, PartialEq)]
struct CheckRequest {
    /// Number of possible changes of the project. The project is read again when it grows.
    changes: u64,
    /// The current light; None if there is none.
    environment: Option<LitEnvironment>,
}

/// Reads and checks the project.
struct Checking {
    root: PathBuf,
    stop: Control,
    /// The last evidence, and the number of changes before it.
    evidence: Option<(u64, Evidence)>,
}

impl Checking {
    fn report(&mut self, request: &CheckRequest) -> Result<CheckReport> {
        let known = self.evidence.take();
        let known = known.filter(|(changes, _)| *changes == request.changes);
        let (_, evidence) = match known {
            Some(known) => self.evidence.insert(known),
            None => {
                let progress = Progress::new(&|_| {}, self.stop.clone());
                let evidence = Evidence::read(&Project::open(&self.root)?, &progress)?;
                self.evidence.insert((request.changes, evidence))
            }
        };
        Ok(evidence.report(request.environment.as_slice()))
    }
}

impl ProjectCheck {
    /// Marks the project as possibly changed by a job.
    pub fn invalidate(&mut self) {
        self.changes += 1;
    }

    /// Takes in the newest report.
    pub fn receive(&mut self) {
        if let Some((_, report)) = self.query.answers().last() {
            self.report = Some(report);
        }
    }

    /// True if a report is on its way or still has to be requested.
    pub fn is_waiting(&self) -> bool {
        let newest = self.query.asked().map(|asked| asked.changes);
        self.query.is_waiting() || newest != Some(self.changes)
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
        wake: impl Fn() + Send + 'static,
    ) {
        let entry = environments.get(state.look.environment);
        let environment = match entry.map(|entry| (&entry.panorama, &entry.listed.name)) {
            Some((PanoramaState::Unread | PanoramaState::Waiting, _)) => return,
            Some((PanoramaState::Done { panorama, .. }, name)) => {
                let Some(light) = &panorama.environment else { return };
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
        self.query.ask(wanted, wake, |stop| {
            let mut checking = Checking { root: project.root.clone(), stop, evidence: None };
            move |request: &CheckRequest| checking.report(request)
        });
    }
}
