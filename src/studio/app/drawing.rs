//! The lines around the panes, and the panes.

use super::StudioApp;
use crate::command::Command;
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::JobPanel;
use crate::theme;
use crate::workspace_view::WorkspaceView;
use egui::{Frame, Panel};

/// What panels see of the window. A function would borrow the panels along with it.
macro_rules! panel_context {
    ($app:ident) => {
        PanelContext {
            project: $app.project.as_ref(),
            state: &$app.state,
            status: &$app.status,
            environments: $app.library.entries(),
            shown: &$app.shown,
            relit: $app.relit.as_ref(),
            texel: $app.inspector.texel(),
            exports: &$app.exports,
            existing_files: $app.destination_check.found(),
            probe: $app.analysis.probe.as_ref(),
            gamma: $app.analysis.gamma.as_ref(),
            review: &$app.review,
            training: &$app.training,
            read_only: $app.read_only.as_deref(),
            recents: $app.recents.list(),
            wizard: &$app.wizard,
            footage: &$app.footage,
        }
    };
}

impl StudioApp {
    /// The lines around the panes.
    pub(super) fn bars_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let context = panel_context!(self);
        let bar = |margin: i8| {
            Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::symmetric(12, margin))
        };
        Panel::top("workspaces")
            .exact_size(34.0)
            .frame(bar(2))
            .show(ui, |ui| self.tabs.ui(ui, &context, commands));
        if let Some(why) = &self.read_only {
            let line = Panel::top("read-only").frame(bar(4));
            line.show(ui, |ui| super::projects::read_only_ui(ui, why, commands));
        }
        Panel::bottom("status")
            .exact_size(30.0)
            .frame(bar(2))
            .show(ui, |ui| self.status_panel.ui(ui, &context, commands));
        if JobPanel::is_needed(&context) {
            Panel::bottom("job")
                .frame(bar(5))
                .show(ui, |ui| self.job.ui(ui, &context, commands));
        }
    }

    pub(super) fn panes_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let mut view = WorkspaceView {
            panels: &mut self.panels,
            context: panel_context!(self),
            out: commands,
            drawn: Vec::new(),
            edited: false,
        };
        let workspace = self.state.workspace;
        if self.state.panels && self.project.is_some() {
            self.preferences.layout().ui(workspace, ui, &mut view);
        } else {
            let pane = match self.project {
                Some(_) => workspace.main()[0],
                None => Pane::Project,
            };
            view.alone_ui(ui, pane);
        }
        self.edited |= view.edited;
        let drawn = view.drawn;
        if !drawn.contains(&self.state.active) {
            let main = workspace.main().iter().find(|&pane| drawn.contains(pane));
            if let Some(&active) = main.or(drawn.first()) {
                self.state.apply(&Command::Activate(active));
            }
        }
        self.shown = drawn;
    }
}
