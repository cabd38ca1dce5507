//! Layout of the window, and the dialogs and lists that cover it.

use super::StudioApp;
use crate::command::{AimCommand, LookCommand, ViewCommand, WindowCommand};
use crate::layout::Workspace;
use crate::state::{State, View, WindowParts};
use base::files::shown;
use egui::ViewportCommand;

impl StudioApp {
    pub(crate) fn apply_to_window(&mut self, command: WindowCommand) {
        let state = &mut self.state;
        let workspace = state.panes.workspace;
        match command {
            WindowCommand::Workspace(workspace) => {
                state.panes.workspace = workspace;
                state.panes.active = workspace.first();
                state.viewport.view = View::FITTED;
                if workspace != Workspace::Review {
                    state.show(ViewCommand::Cell(None));
                }
            }
            WindowCommand::ShowPane(pane) => {
                state.panes.active = pane;
                self.autosave.edit_layout(|layout| layout.open(workspace, pane));
            }
            WindowCommand::ClosePane(pane) => {
                self.autosave.edit_layout(|layout| layout.close(workspace, pane));
            }
            WindowCommand::Activate(pane) => state.panes.active = pane,
            WindowCommand::ResetLayout => {
                self.autosave.edit_layout(|layout| layout.reset(workspace));
            }
            WindowCommand::Fold(heading, folded) => self.autosave.fold(heading, folded),
            WindowCommand::FocusPane => self.view.focus(state.panes.active),
            WindowCommand::TogglePanels => state.panes.parts = state.panes.parts.toggled(WindowParts::Main),
            WindowCommand::ToggleLightAlone => {
                state.panes.parts = state.panes.parts.toggled(WindowParts::PictureAndLight);
            }
            WindowCommand::ToggleFullScreen => self.fill_screen(!self.state.panes.full_screen),
            WindowCommand::ToggleKeys => state.covers.keys = !state.covers.keys,
            WindowCommand::TogglePalette => state.covers.palette = !state.covers.palette,
            WindowCommand::ToggleMachine => state.covers.machine = !state.covers.machine,
            WindowCommand::ActualSize => self.show_actual_size(),
            WindowCommand::Dismiss => self.dismiss(),
            WindowCommand::DismissRefusal => self.status.refusal = None,
            WindowCommand::Close => self.ctx.send_viewport_cmd(ViewportCommand::Close),
            WindowCommand::ClosePath => state.covers.path = None,
            WindowCommand::KeepOpen => self.keep_open(),
            WindowCommand::KeepName => leave_path(state),
            WindowCommand::TellSaved => self.tell_saved(),
            WindowCommand::DismissMessage => self.status.message = None,
            WindowCommand::ClearLog => self.status.log.clear(),
        }
    }

    /// Closes or leaves the first that applies.
    fn dismiss(&mut self) {
        let state = &mut self.state;
        if !state.covers.closing.is_empty() || state.covers.leaving.is_some() {
            self.keep_open();
        } else if state.covers.path.is_some() {
            leave_path(state);
        } else if state.covers.palette {
            state.covers.palette = false;
        } else if state.covers.keys {
            state.covers.keys = false;
        } else if state.covers.machine {
            state.covers.machine = false;
        } else if state.panes.full_screen {
            self.fill_screen(false);
        } else if state.four.on {
            state.four.on = false;
        } else if self.view.leave_points() {
            // The mode was left.
        } else if state.viewport.aims && !looks_closely(state) {
            self.apply_to_aim(AimCommand::Toggle);
        } else if self.status.refusal.take().is_none() {
            leave(state);
        }
    }

    /// Closes the question before a close or before another project; work continues.
    fn keep_open(&mut self) {
        if !self.state.covers.closing.is_empty() {
            self.state.covers.closing.clear();
        } else if let Some(leaving) = self.state.covers.leaving.take() {
            let folder = shown(&leaving.folder);
            self.status.mention(format!("Not opened: {folder}"));
        }
    }

    /// Reports whether everything is saved, for people who press the save key.
    fn tell_saved(&mut self) {
        if self.session.project.is_none() {
            return self.status.refuse("Open a project first".to_owned());
        }
        let waits = self.autosave.saving().is_some() || !self.readers.matte.is_saved();
        let unsaved = self.autosave.unsaved().or(self.readers.unsaved());
        match (&self.session.read_only, unsaved) {
            (Some(why), _) => {
                let sentence = format!("Nothing is saved: {why}");
                self.status.refuse(sentence);
            }
            (None, Some(why)) => {
                let sentence = format!("Not saved: {why}");
                self.status.refuse(sentence);
            }
            (None, None) => self.status.mention(if waits {
                "Saving now. Everything is saved as you work, with undo".to_owned()
            } else {
                "Everything is saved as you work, with undo".to_owned()
            }),
        }
    }

    fn fill_screen(&mut self, fill: bool) {
        self.state.panes.full_screen = fill;
        (self.ctx).send_viewport_cmd(ViewportCommand::Fullscreen(fill));
    }

    fn show_actual_size(&mut self) {
        let fit = self.view.fit();
        if fit > 0.0 {
            self.state.show(ViewCommand::Fit);
            self.state.show(ViewCommand::Zoom { factor: 1.0 / (fit * self.ctx.pixels_per_point()), about: [0.0; 2] });
        }
    }
}

/// Closes the question before a file is replaced, or else the path field.
fn leave_path(state: &mut State) {
    let asked = (state.covers.path.as_mut()).and_then(|entry| entry.existing.take());
    if asked.is_none() {
        state.covers.path = None;
    }
}

/// True if the view is narrowed to a cell, a region, or solo lamps or lights.
fn looks_closely(state: &State) -> bool {
    let solo = !state.solo.is_empty() || state.look.lighting.is_solo();
    state.review.cell.is_some() || state.viewport.region.is_some() || solo
}

/// Leaves one narrowed view: an enlarged picture of a cell, the cell, a region, solo lamps, solo lights or the selected
/// light, whichever comes first.
fn leave(state: &mut State) {
    if state.review.cell.is_some() && state.review.enlarged.is_some() {
        state.review.enlarged = None;
    } else if state.review.cell.is_some() {
        state.review.cell = None;
    } else if state.viewport.region.is_some() {
        state.viewport.region = None;
    } else if !state.solo.is_empty() {
        state.solo.clear();
    } else if state.look.lighting.is_solo() {
        let mut lighting = state.look.lighting.clone();
        lighting.clear_solo();
        state.change(LookCommand::Lighting(Box::new(lighting)));
    } else {
        state.show(ViewCommand::ChooseLight(None));
    }
}
