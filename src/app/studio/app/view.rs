//! Contents of the window: the bars around the panes, the panes, and the lists of keys and commands over them.

use crate::command::{Command, TimelineCommand};
use crate::keys;
use crate::layout::{Layout, Pane};
use crate::palette::Palette;
use crate::panel_context::PanelContext;
use crate::panels::machine::query::Machine;
use crate::panels::{
    JobPanel, Panels, PathPanel, StatusPanel, TabsPanel, TimelinePanel, closing_ui, leaving_ui, machine_ui,
};
use crate::state::{PathEntry, State, WindowParts};
use crate::theme;
use crate::workspace_view::WorkspaceView;
use eframe::egui_wgpu::RenderState;
use egui::{CentralPanel, Frame, Margin, Panel, Ui};

/// State that only drawing needs.
#[derive(Default)]
pub struct WindowView {
    panels: Panels,
    palette: Palette,
    path: PathPanel,
}

/// Result of drawing the window.
pub struct Drawn {
    pub panes: Vec<Pane>,
    /// True if the layout was changed.
    pub layout_edited: bool,
}

impl WindowView {
    /// Draws the picture from this GPU if it was made there.
    pub fn draw_with(&mut self, window: RenderState) {
        self.panels.draw_with(window);
    }

    /// Size of a pixel of the fitted picture in points; 0 before the first picture.
    pub fn fit(&self) -> f32 {
        self.panels.fit()
    }

    /// Applies a command to the timeline. Returns the command that remains to be applied, if any.
    pub fn apply_to_timeline(&mut self, command: TimelineCommand, state: &State) -> Option<Command> {
        self.panels.timeline().apply(command, state)
    }

    /// Resets the timeline's selection and zoom, for another project.
    pub fn opened(&mut self) {
        *self.panels.timeline() = TimelinePanel::default();
    }

    /// True if the pointer was over the timeline in the last frame.
    pub fn is_over_timeline(&mut self) -> bool {
        self.panels.timeline().is_hovered()
    }

    /// Ends the choice of three points on the mirror ball's rim; returns false if there is none.
    pub fn leave_points(&mut self) -> bool {
        self.panels.leave_points()
    }

    /// Moves the focus to the first control of a pane.
    pub fn focus(&mut self, pane: Pane) {
        self.panels.focus(pane);
    }

    /// True if this entry's field contains typed text.
    pub fn path_is_typed(&self, entry: &PathEntry) -> bool {
        self.path.is_typed(entry)
    }

    /// Draws the window.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        machine: &Machine,
        layout: &mut Layout,
        out: &mut Vec<Command>,
    ) -> Drawn {
        let state = context.state;
        let is_open = context.session.project.is_some();
        let whole = is_open && state.panes.parts == WindowParts::All;
        if whole {
            bars_ui(ui, context, out);
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
                let has_no_keys = state.look.animation.is_empty();
                layout.ui((state.panes.workspace, has_no_keys), ui, &mut view);
            } else if is_open && state.panes.parts == WindowParts::PictureAndLight {
                view.picture_and_light_ui(ui);
            } else {
                let main = state.panes.workspace.main()[0];
                view.alone_ui(ui, if is_open { main } else { Pane::Project });
            }
            Drawn { panes: view.drawn, layout_edited: view.edited }
        });
        JobPanel.notices_ui(ui, context, whole, out);
        if state.covers.keys {
            keys::overlay_ui(ui, state.panes.active, out);
        }
        if state.covers.machine {
            machine_ui(ui, context, machine, out);
        }
        if state.covers.palette {
            self.palette.ui(ui, context, out);
        } else {
            self.palette = Palette::default();
        }
        if let Some(entry) = &state.covers.path {
            self.path.ui(ui, entry, out);
        }
        if !state.covers.closing.is_empty() {
            closing_ui(ui, &state.covers.closing, out);
        } else if let Some(leaving) = &state.covers.leaving {
            leaving_ui(ui, leaving, out);
        }
        shown.inner
    }
}

fn bar(margin: i8) -> Frame {
    Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, margin))
}

/// Draws the bars around the panes.
fn bars_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    Panel::top("workspaces").exact_size(34.0).frame(bar(2)).show(ui, |ui| TabsPanel.ui(ui, context, out));
    Panel::bottom("status").exact_size(30.0).frame(bar(2)).show(ui, |ui| StatusPanel.ui(ui, context, out));
}
