//! The window when the GPU that draws it is lost.

use super::StudioApp;
use compositor::passes::is_lost;
use eframe::Frame;
use egui::ViewportCommand;
use project::Project;
use std::sync::Arc;
use worker::Latest;

/// The project that a window leaves open, for the next one.
pub type ProjectHandover = Arc<Latest<Option<Project>>>;

impl StudioApp {
    /// A window that closes when the GPU that draws it is lost, and then hands its project over to `next`.
    /// `message` is shown in its line of messages.
    pub fn replaced_by(mut self, next: ProjectHandover, message: Option<&str>) -> Self {
        self.handover = Some(next);
        if let Some(message) = message {
            self.status.say(message.to_owned());
        }
        self
    }

    /// True if the window cannot be drawn any more. Then it closes, with everything saved; drawing would end the
    /// program, for egui finds no memory on the GPU.
    pub(super) fn closes_without_gpu(&mut self, frame: &Frame) -> bool {
        let device = frame.wgpu_render_state().map(|state| &state.device);
        if !device.is_some_and(is_lost) {
            return false;
        }
        self.save_look();
        self.autosave.save_preferences();
        if let Some(next) = &self.handover {
            next.put(self.session.project.clone());
        }
        self.ctx.send_viewport_cmd(ViewportCommand::Close);
        true
    }
}
