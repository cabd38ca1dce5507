//! Calibration as the window knows it. It is analysed in the background.

use crate::layout::Pane;
use crate::state::State;
use calibration::{Circle, Trial};
use project::Project;
use std::sync::Arc;
use worker::{CalibrationStudy, GammaView, ProbeView, Query};

/// The newest answers, and the queries for them.
#[derive(Default)]
pub struct CalibrationAnalysis {
    /// Analysis of the mirror balls, or the reason they cannot be read.
    pub probe: Option<Result<Arc<ProbeView>, String>>,
    /// Fit of the trial response, or the reason it is unknown.
    pub gamma: Option<Result<Arc<GammaView>, String>>,
    probes: Query<ProbeRequest, Arc<ProbeView>>,
    gammas: Query<GammaRequest, Arc<GammaView>>,
    /// Number of times that the calibration may have changed.
    calibrations: u64,
}

/// The mirror ball under a lamp or the interview's light; a `circle` of None is the project's own.
#[derive(Clone, PartialEq)]
struct ProbeRequest {
    calibrations: u64,
    photograph: Option<usize>,
    circle: Option<Circle>,
}

/// A pose relit as an interview frame; a `trial` of None is the calibration's own response and exposure.
#[derive(Clone, PartialEq)]
struct GammaRequest {
    calibrations: u64,
    frame: usize,
    pose: usize,
    trial: Option<Trial>,
}

impl CalibrationAnalysis {
    /// Marks the calibration as possibly changed by a job.
    pub fn invalidate(&mut self) {
        self.calibrations += 1;
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self) {
        let probe = self.probes.answers().last().map(|(_, probe)| probe);
        let gamma = self.gammas.answers().last().map(|(_, gamma)| gamma);
        self.probe = probe.or(self.probe.take());
        self.gamma = gamma.or(self.gamma.take());
    }

    /// Requests what the visible panes need, if that changed. If both panes are visible, the active one counts.
    pub fn ask(&mut self, project: &Project, state: &State, wake: impl Fn() + Send + 'static) {
        let calibrations = self.calibrations;
        let study = |stop| CalibrationStudy::new(project.root.clone(), stop);
        let mut studied = state.panes.drawn.iter().filter(|pane| matches!(pane, Pane::Probe | Pane::Gamma));
        let active = studied.clone().find(|&&pane| pane == state.panes.active);
        match active.or(studied.next()) {
            Some(Pane::Probe) => {
                let (photograph, circle) = (state.shoot.photograph, state.look.circle);
                self.probes.ask(ProbeRequest { calibrations, photograph, circle }, wake, |stop| {
                    let mut study = study(stop);
                    move |request: &ProbeRequest| {
                        let study = study.renewed(request.calibrations);
                        study.probe(request.photograph, request.circle).map(Arc::new)
                    }
                });
            }
            Some(Pane::Gamma) => {
                let (frame, pose, trial) = (state.frame, state.shoot.pose, state.look.trial);
                self.gammas.ask(GammaRequest { calibrations, frame, pose, trial }, wake, |stop| {
                    let mut study = study(stop);
                    move |request: &GammaRequest| {
                        let study = study.renewed(request.calibrations);
                        study.gamma(request.frame, request.pose, request.trial).map(Arc::new)
                    }
                });
            }
            _ => {}
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
            None => Ok(known(&self.gamma, "poses and the interview")?.calibrated),
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
