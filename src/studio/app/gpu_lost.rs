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
    /// A window that closes when the GPU that draws it is lost, and then leaves its project to `next`. `said` is
    /// shown in its line of messages.
    pub fn replaced_by(mut self, next: ProjectHandover, said: Option<&str>) -> Self {
        self.next = Some(next);
        if let Some(said) = said {
            self.status.say(said.to_owned());
        }
        self
    }

    /// Whether the window cannot be drawn any more. Then it closes, with all that it knows kept on disk; anything
    /// drawn would end the program, for egui finds no memory for it on the GPU.
    pub(super) fn is_blind(&mut self, frame: &Frame) -> bool {
        let device = frame.wgpu_render_state().map(|state| &state.device);
        if !device.is_some_and(is_lost) {
            return false;
        }
        self.keep();
        self.preferences.save(&self.saver);
        if let Some(next) = &self.next {
            next.put(self.project.clone());
        }
        self.ctx.send_viewport_cmd(ViewportCommand::Close);
        true
    }
}
