//! What the window knows of the calibration: it asks the thread that looks at it, and keeps the answers.

use super::layout::Pane;
use super::state::State;
use calibration::{Circle, Trial};
use project::Project;
use std::sync::Arc;
use worker::{CalibrationRequest, CalibrationThread, GammaView, ProbeView};

/// The answers, and the thread once it was needed.
#[derive(Default)]
pub struct CalibrationAnalysis {
    /// What the mirror balls show, or why they cannot be read.
    pub probe: Option<Result<Arc<ProbeView>, String>>,
    /// How the tried response does, or why that cannot be told.
    pub gamma: Option<Result<Arc<GammaView>, String>>,
    thread: Option<CalibrationThread>,
    /// What was asked last.
    asked: Option<CalibrationRequest>,
    /// How often the calibration may have changed.
    calibrations: u64,
}

impl CalibrationAnalysis {
    /// The calibration may be another from now on.
    pub fn renew(&mut self) {
        self.calibrations += 1;
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self) {
        if let Some(thread) = &self.thread {
            self.probe = thread.probe().or(self.probe.take());
            self.gamma = thread.gamma().or(self.gamma.take());
        }
    }

    /// Asks for what the panes `shown` show, where that is another than before; where there are two, for
    /// the one in hand.
    pub fn ask(
        &mut self,
        project: &Project,
        state: &State,
        shown: &[Pane],
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) {
        let calibrations = self.calibrations;
        let mut studied = shown
            .iter()
            .filter(|pane| matches!(pane, Pane::Probe | Pane::Gamma));
        let in_hand = studied.clone().find(|&&pane| pane == state.active);
        let wanted = match in_hand.or(studied.next()) {
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

    /// The mirror ball's outline that is shown, set by hand or the project's.
    ///
    /// # Errors
    /// Why it is not known.
    pub fn circle(&self, state: &State) -> Result<Circle, String> {
        match state.look.circle {
            Some(circle) => Ok(circle),
            None => Ok(known(&self.probe, "mirror balls")?.kept),
        }
    }

    /// The response that is shown, set by hand or the calibration's.
    ///
    /// # Errors
    /// Why it is not known.
    pub fn trial(&self, state: &State) -> Result<Trial, String> {
        match state.look.trial {
            Some(trial) => Ok(trial),
            None => Ok(known(&self.gamma, "exemplars and the interview")?.calibrated),
        }
    }

    /// The outline that was found in the photographs.
    ///
    /// # Errors
    /// Why there is none.
    pub fn found(&self) -> Result<Circle, String> {
        let found = &known(&self.probe, "mirror balls")?.found;
        found
            .as_ref()
            .map(|found| found.circle)
            .map_err(Clone::clone)
    }
}

/// An answer, or why there is none.
fn known<'a, T>(answer: &'a Option<Result<Arc<T>, String>>, what: &str) -> Result<&'a T, String> {
    match answer {
        Some(Ok(answer)) => Ok(answer),
        Some(Err(sentence)) => Err(sentence.clone()),
        None => Err(format!("The {what} are still being read")),
    }
}

impl Drop for CalibrationAnalysis {
    /// The thread is joined beside the window: it may be amid a fit.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            std::thread::spawn(move || drop(thread));
        }
    }
}
