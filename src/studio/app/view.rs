//! What is drawn: the lines around the panes, the panes, and the lists of keys and commands over them.

use crate::command::{Command, ProjectCommand};
use crate::icons;
use crate::keys;
use crate::layout::{Layout, Pane};
use crate::palette::Palette;
use crate::panel_context::PanelContext;
use crate::panels::{
    JobPanel, PathPanel, StatusPanel, TabsPanel, closing_ui, machine_ui, refusal_ui,
};
use crate::theme;
use crate::workspace_view::{Panels, WorkspaceView};
use eframe::egui_wgpu::RenderState;
use egui::{CentralPanel, Frame, Margin, Panel, Ui};

/// What only the drawing needs.
#[derive(Default)]
pub struct WindowView {
    panels: Panels,
    palette: Palette,
    path: PathPanel,
}

/// What was drawn.
pub struct Drawn {
    pub panes: Vec<Pane>,
    /// Whether the arrangement was changed.
    pub layout_edited: bool,
}

impl WindowView {
    /// Has the picture drawn from this GPU if it was made there.
    pub fn draw_with(&mut self, window: RenderState) {
        self.panels.draw_with(window);
    }

    /// Points that a pixel of the fitted picture takes; 0 before there was one.
    pub fn fit(&self) -> f32 {
        self.panels.fit()
    }

    /// Gives the focus to the first control of a pane.
    pub fn focus(&mut self, pane: Pane) {
        self.panels.focus(pane);
    }

    /// Draws the window.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        layout: &mut Layout,
        out: &mut Vec<Command>,
    ) -> Drawn {
        let state = context.state;
        let whole = state.panels && context.project.is_some();
        if whole {
            bars_ui(ui, context, out);
        }
        if let (Some(refusal), false) = (&context.status.refusal, context.refusal_has_pane()) {
            Panel::bottom("refusal")
                .frame(bar(5))
                .show(ui, |ui| refusal_ui(ui, refusal, out));
        }
        let shown = CentralPanel::no_frame().show(ui, |ui| {
            let mut view = WorkspaceView {
                panels: &mut self.panels,
                context: *context,
                out: &mut *out,
                drawn: Vec::new(),
                edited: false,
            };
            if whole {
                layout.ui(state.workspace, ui, &mut view);
            } else {
                let main = state.workspace.main()[0];
                let offer = context.project.is_none().then_some(Pane::Project);
                view.alone_ui(ui, offer.unwrap_or(main));
            }
            Drawn {
                panes: view.drawn,
                layout_edited: view.edited,
            }
        });
        if whole {
            JobPanel.message_ui(ui, context, out);
        }
        if state.keys {
            keys::overlay_ui(ui, state.active, out);
        }
        if state.machine {
            machine_ui(ui, context, out);
        }
        if state.palette {
            self.palette.ui(ui, context, out);
        }
        if let Some(entry) = &state.path {
            self.path.ui(ui, entry, out);
        }
        if !state.closing.is_empty() {
            closing_ui(ui, &state.closing, out);
        }
        shown.inner
    }
}

fn bar(margin: i8) -> Frame {
    Frame::new()
        .fill(theme::PANEL)
        .inner_margin(Margin::symmetric(12, margin))
}

/// The lines around the panes.
fn bars_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    Panel::top("workspaces")
        .exact_size(34.0)
        .frame(bar(2))
        .show(ui, |ui| TabsPanel.ui(ui, context, out));
    if let Some(why) = context.read_only {
        let line = Panel::top("read-only").frame(bar(4));
        line.show(ui, |ui| read_only_ui(ui, why, out));
    }
    Panel::bottom("status")
        .exact_size(30.0)
        .frame(bar(2))
        .show(ui, |ui| StatusPanel.ui(ui, context, out));
    if JobPanel::is_held(context) {
        Panel::bottom("job")
            .frame(bar(5))
            .show(ui, |ui| JobPanel.ui(ui, context, out));
    }
}

/// What the window says where another process holds the project's lock; `why` itself if it is about something else.
fn banner(why: &str) -> String {
    let process = why.rsplit_once(", process ").map(|(_, rest)| rest);
    let digits = process.and_then(|rest| rest.split(|c: char| !c.is_ascii_digit()).next());
    match digits.filter(|digits| !digits.is_empty()) {
        Some(process) if why.contains("the studio, process") => {
            format!("Open in another window (process {process}).")
        }
        Some(process) => format!("A job is writing to it (process {process})."),
        None => why.to_owned(),
    }
}

/// The line that says why nothing can be written.
fn read_only_ui(ui: &mut Ui, why: &str, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.colored_label(theme::WARNING, icons::LOCK);
        ui.colored_label(theme::WARNING, "Read-only");
        ui.label(banner(why)).on_hover_text(why);
        let hint = "Reopen the project with write access";
        if ui.button("Try again").on_hover_text(hint).clicked() {
            out.push(Command::Project(ProjectCommand::Reopen));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use project::Lock;

    #[test]
    fn the_banner_names_the_process_and_keeps_what_it_cannot_shorten() {
        let folder = tempfile::tempdir().unwrap();
        let _lock = Lock::take(folder.path(), "the studio").unwrap();
        let why = Lock::take(folder.path(), "another")
            .unwrap_err()
            .to_string();
        let expected = format!("Open in another window (process {}).", std::process::id());
        assert_eq!(banner(&why), expected);
        let job = "/film is in use by training, process 7 on desk. Close the project there";
        assert_eq!(banner(job), "A job is writing to it (process 7).");
        let other = "cannot write .lock: Permission denied";
        assert_eq!(banner(other), other);
    }
}
