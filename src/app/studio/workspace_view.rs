//! Drawing of a workspace: each pane of the layout shows its panel.

use super::command::{Command, WindowCommand};
use super::layout::{BORDER, LIGHT, Pane, TABS_HEIGHT};
use super::panel_context::PanelContext;
use super::panels::Panels;
use super::theme;
use egui::{Color32, Frame, Panel, Stroke, Ui, Visuals};
use egui_tiles::{Behavior, EditAction, SimplificationOptions, TabState, TileId, Tiles, UiResponse};

/// A workspace during one frame of the window.
pub struct WorkspaceView<'a> {
    pub panels: &'a mut Panels,
    pub context: PanelContext<'a>,
    pub out: &'a mut Vec<Command>,
    /// The panes drawn so far.
    pub drawn: Vec<Pane>,
    /// True if the layout was changed.
    pub edited: bool,
}

impl WorkspaceView<'_> {
    /// The picture, and the light beside it.
    pub fn picture_and_light_ui(&mut self, ui: &mut Ui) {
        let frame = Frame::new().fill(theme::PANEL);
        let panel = Panel::right("light alone").exact_size(LIGHT).frame(frame);
        panel.show(ui, |ui| self.alone_ui(ui, Pane::Light));
        self.alone_ui(ui, Pane::Picture);
    }

    /// A single pane that fills the window.
    pub fn alone_ui(&mut self, ui: &mut Ui, pane: Pane) {
        self.drawn.push(pane);
        self.panels.ui(ui, pane, &self.context, self.out);
    }
}

impl Behavior<Pane> for WorkspaceView<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, theme::PANEL);
        ui.set_clip_rect(ui.clip_rect().intersect(rect));
        self.drawn.push(*pane);
        // Not for a click on something over the pane, such as a menu.
        let pressed = ui.input(|i| i.pointer.any_pressed()) && ui.rect_contains_pointer(rect);
        if pressed && self.context.state.panes.active != *pane {
            self.out.push(Command::Window(WindowCommand::Activate(*pane)));
        }
        self.panels.ui(ui, *pane, &self.context, self.out);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        egui::RichText::new(pane.name()).size(13.0).into()
    }

    fn tab_bar_height(&self, _: &egui::Style) -> f32 {
        TABS_HEIGHT
    }

    fn gap_width(&self, _: &egui::Style) -> f32 {
        BORDER
    }

    fn tab_bar_color(&self, _: &Visuals) -> Color32 {
        theme::WELL
    }

    fn tab_bg_color(&self, _: &Visuals, _: &Tiles<Pane>, _: TileId, tab: &TabState) -> Color32 {
        if tab.active { theme::PANEL } else { theme::WELL }
    }

    fn tab_text_color(&self, _: &Visuals, _: &Tiles<Pane>, _: TileId, tab: &TabState) -> Color32 {
        if tab.active { theme::TEXT } else { theme::QUIET }
    }

    fn tab_outline_stroke(&self, _: &Visuals, _: &Tiles<Pane>, _: TileId, _: &TabState) -> Stroke {
        Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, _: &Visuals) -> Stroke {
        Stroke::NONE
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn on_edit(&mut self, _: EditAction) {
        self.edited = true;
    }
}
