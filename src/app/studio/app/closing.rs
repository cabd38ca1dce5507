//! Work that closing the window or opening another project would end, and the question before it does.

use super::StudioApp;
use crate::panels::job::capitalized;
use egui::ViewportCommand;
use export::Container;
use std::path::Path;
use worker::ExportStatus;

impl StudioApp {
    /// Asks once before a close that would end work.
    pub(super) fn ask_before_closing(&mut self) {
        if !self.ctx.input(|input| input.viewport().close_requested()) {
            return;
        }
        if self.state.covers.closing.is_empty() {
            self.state.covers.closing = self.would_end();
            if !self.state.covers.closing.is_empty() {
                self.ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            }
        }
    }

    /// Work that closing or opening another project would end, one sentence each.
    pub(crate) fn would_end(&self) -> Vec<String> {
        // A job may have ended while its last report is still on the way.
        let job = self.status.job.as_ref();
        let job = job.filter(|_| self.session.idle().is_err());
        let share = job.map_or(0.0, |job| 100.0 * job.share);
        let mut running = None;
        let mut waiting = 0;
        for export in &self.exports.queue {
            match export.status {
                ExportStatus::Running => running = Some(&export.name),
                ExportStatus::Waiting => waiting += 1,
                _ => {}
            }
        }
        let begun = match (running, job) {
            (Some(name), _) if Container::from_path(Path::new(name)).is_none() => Some(format!(
                "{name} is {share:.0} % done. Finished stills stay. “Existing files: Resume” writes the others."
            )),
            (Some(name), _) => Some(format!("{name} is {share:.0} % done. An unfinished movie is lost.")),
            (None, Some(job)) => Some(format!(
                "{}: {} at {share:.0} %. It stops; what is saved stays.",
                capitalized(job.what),
                job.stage
            )),
            (None, None) => None,
        };
        let waiting = match waiting {
            0 => None,
            1 => Some("1 export in the queue is not written.".to_owned()),
            more => Some(format!("{more} exports in the queue are not written.")),
        };
        begun.into_iter().chain(waiting).collect()
    }
}
