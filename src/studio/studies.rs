//! What the window knows of the calibration: it asks the thread that looks at it, and keeps the answers.

use super::layout::Pane;
use super::state::State;
use calibration::{Circle, Trial};
use project::Project;
use std::sync::Arc;
use worker::{CalibrationRequest, CalibrationThread, GammaView, ProbeView};

/// The answers, and the thread once it was needed.
#[derive(Default)]
pub struct Studies {
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

impl Studies {
    /// The calibration may be another from now on.
    pub fn renew(&mut self) {
        self.calibrations += 1;
    }

    /// Takes in the newest answers.
    pub fn hear(&mut self) {
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

    /// The silhouette that is shown, set by hand or the project's.
    pub fn circle(&self, state: &State) -> Option<Circle> {
        let kept = || Some(self.probe.as_ref()?.as_ref().ok()?.kept);
        state.look.circle.or_else(kept)
    }

    /// The response that is shown, set by hand or the calibration's.
    pub fn trial(&self, state: &State) -> Option<Trial> {
        let calibrated = || Some(self.gamma.as_ref()?.as_ref().ok()?.calibrated);
        state.look.trial.or_else(calibrated)
    }

    /// The silhouette that the photographs show.
    pub fn found(&self) -> Option<Circle> {
        let study = self.probe.as_ref()?.as_ref().ok()?;
        Some(study.found.as_ref().ok()?.circle)
    }
}

impl Drop for Studies {
    /// The thread is joined beside the window: it may be amid a fit.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            std::thread::spawn(move || drop(thread));
        }
    }
}
