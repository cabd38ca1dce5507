//! Calibration as the window knows it. A background thread analyses it.

use super::layout::Pane;
use super::state::State;
use calibration::{Circle, Trial};
use project::Project;
use std::sync::Arc;
use worker::background::drop_later;
use worker::{CalibrationRequest, CalibrationThread, GammaView, ProbeView};

/// Answers of the thread, which starts on first use.
#[derive(Default)]
pub struct CalibrationAnalysis {
    /// Analysis of the mirror balls, or the reason they cannot be read.
    pub probe: Option<Result<Arc<ProbeView>, String>>,
    /// Fit of the trial response, or the reason it is unknown.
    pub gamma: Option<Result<Arc<GammaView>, String>>,
    thread: Option<CalibrationThread>,
    /// The last request.
    asked: Option<CalibrationRequest>,
    /// Number of times that the calibration may have changed.
    calibrations: u64,
}

impl CalibrationAnalysis {
    /// Marks the calibration as possibly changed by a job.
    pub fn invalidate(&mut self) {
        self.calibrations += 1;
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self) {
        if let Some(thread) = &self.thread {
            self.probe = thread.probe().or(self.probe.take());
            self.gamma = thread.gamma().or(self.gamma.take());
        }
    }

    /// Requests what the panes `shown` need, if that changed. If both panes are visible, the active one counts.
    pub fn ask(
        &mut self,
        project: &Project,
        state: &State,
        shown: &[Pane],
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) {
        let calibrations = self.calibrations;
        let mut studied = shown.iter().filter(|pane| matches!(pane, Pane::Probe | Pane::Gamma));
        let active = studied.clone().find(|&&pane| pane == state.active);
        let wanted = match active.or(studied.next()) {
            Some(Pane::Probe) => CalibrationRequest::Probe {
                calibrations,
                photograph: state.photograph,
                circle: state.look.circle,
            },
            Some(Pane::Gamma) => CalibrationRequest::Gamma {
                calibrations,
                frame: state.frame,
                pose: state.pose,
                trial: state.look.trial,
            },
            _ => return,
        };
        if self.asked.as_ref() != Some(&wanted) {
            self.thread
                .get_or_insert_with(|| CalibrationThread::start(project.root.clone(), wake))
                .ask(wanted.clone());
            self.asked = Some(wanted);
        }
    }

    /// The outline of the mirror ball in use: set by hand, or the project's.
    ///
    /// # Errors
    /// The reason it is unknown.
    pub fn circle(&self, state: &State) -> Result<Circle, String> {
        match state.look.circle {
            Some(circle) => Ok(circle),
            None => Ok(known(&self.probe, "mirror balls")?.kept),
        }
    }

    /// The response in use: set by hand, or the calibration's.
    ///
    /// # Errors
    /// The reason it is unknown.
    pub fn trial(&self, state: &State) -> Result<Trial, String> {
        match state.look.trial {
            Some(trial) => Ok(trial),
            None => Ok(known(&self.gamma, "exemplars and the interview")?.calibrated),
        }
    }

    /// The outline detected in the photographs.
    ///
    /// # Errors
    /// The reason for its absence.
    pub fn found(&self) -> Result<Circle, String> {
        let found = &known(&self.probe, "mirror balls")?.found;
        found.as_ref().map(|found| found.circle).map_err(Clone::clone)
    }
}

/// The answer, or the reason for its absence.
fn known<'a, T>(answer: &'a Option<Result<Arc<T>, String>>, what: &str) -> Result<&'a T, String> {
    match answer {
        Some(Ok(answer)) => Ok(answer),
        Some(Err(sentence)) => Err(sentence.clone()),
        None => Err(format!("The {what} are still being read")),
    }
}

impl Drop for CalibrationAnalysis {
    /// Joins the thread in the background, since it may be busy with a fit.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop_later(thread);
        }
    }
}
