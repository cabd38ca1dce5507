//! The newest measurement of this machine.

use benchmark::MachineReport;
use std::sync::Arc;
use worker::Latest;

/// State of the machine's measurement.
pub struct Machine {
    /// Slot that the job fills.
    pub(super) known: Arc<Latest<MachineReport>>,
    pub report: Option<MachineReport>,
}

impl Machine {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { known: Arc::new(Latest::new(wake)), report: None }
    }

    /// Takes in new measurements since the last call.
    pub fn receive(&mut self) {
        if let Some(report) = self.known.take() {
            self.report = Some(report);
        }
    }
}
