//! Recovery when the GPU that draws the window is lost.

use super::StudioApp;
use compositor::passes::is_lost;
use eframe::Frame;
use egui::ViewportCommand;
use project::Project;
use std::sync::Arc;
use worker::Latest;

/// The project that a closing window leaves for the next window.
pub type ProjectHandover = Arc<Latest<Option<Project>>>;

impl StudioApp {
    /// Makes the window close if the GPU that draws it is lost, and then pass its project to `next`. `message` appears
    /// in the message line.
    pub fn replaced_by(mut self, next: ProjectHandover, message: Option<&str>) -> Self {
        self.handover = Some(next);
        if let Some(message) = message {
            self.status.advise(message.to_owned());
        }
        self
    }

    /// True if the window can no longer be drawn. It then saves everything and closes: drawing would abort the program,
    /// since egui gets no memory from a lost GPU.
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
