//! The lines around the panes, and the panes.

use super::StudioApp;
use crate::command::Command;
use crate::layout::Pane;
use crate::panel::Sight;
use crate::panels::JobPanel;
use crate::panes::Shown;
use crate::theme;
use egui::{Frame, Panel};

/// What panels see of the window. A function would borrow the panels along with it.
macro_rules! sight {
    ($app:ident) => {
        Sight {
            project: $app.project.as_ref(),
            state: &$app.state,
            news: &$app.news,
            environments: $app.shelf.entries(),
            shown: &$app.shown,
            relit: $app.relit.as_ref(),
            texel: $app.inspected.texel(),
            exports: &$app.exports,
            taken: $app.lookout.found(),
            probe: $app.studies.probe.as_ref(),
            gamma: $app.studies.gamma.as_ref(),
            reviews: &$app.reviews,
            training: &$app.training,
            read_only: $app.read_only.as_deref(),
            recents: $app.recents.list(),
            wizard: &$app.wizard,
            footages: &$app.footages,
        }
    };
}

impl StudioApp {
    /// The lines around the panes.
    pub(super) fn bars_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let sight = sight!(self);
        let bar = |margin: i8| {
            Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::symmetric(12, margin))
        };
        Panel::top("workspaces")
            .exact_size(34.0)
            .frame(bar(2))
            .show(ui, |ui| self.tabs.ui(ui, &sight, commands));
        if let Some(why) = &self.read_only {
            let line = Panel::top("read-only").frame(bar(4));
            line.show(ui, |ui| super::projects::read_only_ui(ui, why, commands));
        }
        Panel::bottom("status")
            .exact_size(30.0)
            .frame(bar(2))
            .show(ui, |ui| self.status.ui(ui, &sight, commands));
        if JobPanel::is_needed(&sight) {
            Panel::bottom("job")
                .frame(bar(5))
                .show(ui, |ui| self.job.ui(ui, &sight, commands));
        }
    }

    pub(super) fn panes_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let mut shown = Shown {
            panes: &mut self.panes,
            sight: sight!(self),
            out: commands,
            drawn: Vec::new(),
            edited: false,
        };
        let workspace = self.state.workspace;
        if self.state.panels && self.project.is_some() {
            self.preferences.layout().ui(workspace, ui, &mut shown);
        } else {
            let pane = match self.project {
                Some(_) => workspace.main()[0],
                None => Pane::Project,
            };
            shown.alone_ui(ui, pane);
        }
        self.edited |= shown.edited;
        let drawn = shown.drawn;
        if !drawn.contains(&self.state.active) {
            let main = workspace.main().iter().find(|&pane| drawn.contains(pane));
            if let Some(&active) = main.or(drawn.first()) {
                self.state.apply(&Command::Activate(active));
            }
        }
        self.shown = drawn;
    }
}
