//! The question before a window closes on work that would be lost.

use super::StudioApp;
use crate::panels::job::capitalized;
use egui::ViewportCommand;
use worker::ExportStatus;

impl StudioApp {
    /// Asks once where a close would end work.
    pub(super) fn ask_before_closing(&mut self) {
        if !self.ctx.input(|input| input.viewport().close_requested()) {
            return;
        }
        if self.state.closing.is_empty() {
            self.state.closing = self.would_end();
            if !self.state.closing.is_empty() {
                self.ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            }
        }
    }

    /// What a close would end, a sentence each.
    fn would_end(&self) -> Vec<String> {
        let job = self.status.job.as_ref();
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
            (Some(name), _) if name.contains('%') => Some(format!(
                "{name} is being exported, {share:.0} % done. The stills that are finished stay; Resume it later with \
                 \u{201c}resume a stopped export\u{201d}."
            )),
            (Some(name), _) => Some(format!(
                "{name} is being exported, {share:.0} % done. A movie that is not finished is lost."
            )),
            (None, Some(job)) => Some(format!(
                "{}: {} at {share:.0} %. It stops; what it has saved stays.",
                capitalized(job.what),
                job.stage
            )),
            (None, None) => None,
        };
        let waiting = match waiting {
            0 => None,
            1 => Some("1 export waits in the queue. It is not written.".to_owned()),
            more => Some(format!(
                "{more} exports wait in the queue. They are not written."
            )),
        };
        begun.into_iter().chain(waiting).collect()
    }
}
