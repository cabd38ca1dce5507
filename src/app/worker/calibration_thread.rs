//! The thread that reads a calibration for the window. Only the newest request is answered.

use super::background::{Background, Handler};
use super::calibration_study::{CalibrationStudy, GammaView, ProbeView};
use super::latest::Latest;
use super::mailbox::Request;
use base::error::Result;
use calibration::Trial;
use calibration::silhouette::Circle;
use std::path::PathBuf;
use std::sync::Arc;

/// A request. `calibrations` counts possible changes of the project since it was opened.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationRequest {
    /// The mirror ball under a lamp or the interview's light; a `circle` of None is the project's own.
    Probe { calibrations: u64, photograph: Option<usize>, circle: Option<Circle> },
    /// A pose relit as an interview frame; a `trial` of None is the calibration's own response and exposure.
    Gamma { calibrations: u64, frame: usize, pose: usize, trial: Option<Trial> },
}

/// An answer, or the reason that there is none.
type Answer<T> = std::result::Result<Arc<T>, String>;

/// The thread. Dropping it stops it after the current answer.
pub struct CalibrationThread {
    thread: Background<CalibrationRequest>,
    probe: Arc<Latest<Answer<ProbeView>>>,
    gamma: Arc<Latest<Answer<GammaView>>>,
}

struct Answering {
    study: CalibrationStudy,
    probe: Arc<Latest<Answer<ProbeView>>>,
    gamma: Arc<Latest<Answer<GammaView>>>,
}

enum View {
    Probe(Arc<ProbeView>),
    Gamma(Arc<GammaView>),
}

impl CalibrationThread {
    /// Starts the thread on the project in `root`; `wake` is called after each answer.
    pub fn start(root: PathBuf, wake: impl Fn() + Clone + Send + Sync + 'static) -> Self {
        let probe = Arc::new(Latest::new(wake.clone()));
        let gamma = Arc::new(Latest::new(wake));
        let (to_probe, to_gamma) = (probe.clone(), gamma.clone());
        let thread = Background::spawn("calibration", move |stop| Answering {
            study: CalibrationStudy::new(root, stop),
            probe: to_probe,
            gamma: to_gamma,
        });
        Self { thread, probe, gamma }
    }

    /// Sends a request; replaces an earlier one that has not begun.
    pub fn ask(&self, request: CalibrationRequest) {
        self.thread.put(request);
    }

    /// The newest answers, once.
    pub fn probe(&self) -> Option<Answer<ProbeView>> {
        self.probe.take()
    }

    pub fn gamma(&self) -> Option<Answer<GammaView>> {
        self.gamma.take()
    }
}

impl Request for CalibrationRequest {}

impl Handler for Answering {
    type Request = CalibrationRequest;
    type Answer = View;

    fn work(&mut self, request: &mut CalibrationRequest) -> Result<View> {
        match *request {
            CalibrationRequest::Probe { calibrations, photograph, circle } => {
                self.study.renew(calibrations);
                let view = self.study.probe(photograph, circle)?;
                Ok(View::Probe(Arc::new(view)))
            }
            CalibrationRequest::Gamma { calibrations, frame, pose, trial } => {
                self.study.renew(calibrations);
                let view = self.study.gamma(frame, pose, trial)?;
                Ok(View::Gamma(Arc::new(view)))
            }
        }
    }

    fn deliver(&mut self, request: CalibrationRequest, answer: Result<View>) {
        match (request, answer) {
            (_, Ok(View::Probe(view))) => self.probe.put(Ok(view)),
            (_, Ok(View::Gamma(view))) => self.gamma.put(Ok(view)),
            (CalibrationRequest::Probe { .. }, Err(e)) => self.probe.put(Err(e.to_string())),
            (CalibrationRequest::Gamma { .. }, Err(e)) => self.gamma.put(Err(e.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_panic_is_said_in_the_pane_that_asked() {
        let folder = tempfile::tempdir().unwrap();
        let (wake, woken) = channel();
        let thread = CalibrationThread::start(folder.path().to_path_buf(), move || {
            let _ = wake.send(());
        });
        let probe = CalibrationRequest::Probe { calibrations: 0, photograph: None, circle: None };
        let gamma = CalibrationRequest::Gamma { calibrations: 0, frame: 0, pose: 0, trial: None };
        thread.thread.panic_next();
        thread.ask(probe.clone());
        woken.recv().unwrap();
        let sentence = thread.probe().unwrap().unwrap_err();
        assert!(sentence.contains("on purpose"), "{sentence}");
        assert!(thread.gamma().is_none());
        thread.thread.panic_next();
        thread.ask(gamma);
        woken.recv().unwrap();
        let sentence = thread.gamma().unwrap().unwrap_err();
        assert!(sentence.contains("on purpose"), "{sentence}");
        // The thread goes on, and names what is missing.
        thread.ask(probe);
        woken.recv().unwrap();
        let sentence = thread.probe().unwrap().unwrap_err();
        assert!(sentence.contains("project.toml"), "{sentence}");
    }
}
