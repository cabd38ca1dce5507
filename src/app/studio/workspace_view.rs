//! Drawing of a workspace: each pane of the layout shows its panel.

use super::command::{Command, WindowCommand};
use super::layout::{BORDER, LIGHT, MARGIN, Pane, TABS_HEIGHT};
use super::panel_context::PanelContext;
use super::panels::{
    AccuracyPanel, ChecksPanel, EffectsPanel, EnvironmentsPanel, ExportPanel, FootagePanel,
    GammaPanel, LampSheetPanel, LightPanel, LooksPanel, PicturePanel, ProbePanel, ProjectPanel,
    ReviewPanel, ScopesPanel, TimelinePanel, TrainingPanel, ViewportPanel, log_ui,
};
use super::theme::{self, GAP};
use eframe::egui_wgpu::RenderState;
use egui::{Color32, Frame, Margin, Panel, ScrollArea, Stroke, Ui, Visuals};
use egui_tiles::{
    Behavior, EditAction, SimplificationOptions, TabState, TileId, Tiles, UiResponse,
};

/// The panels, with the state of their drawing.
#[derive(Default)]
pub struct Panels {
    project: ProjectPanel,
    footage: FootagePanel,
    viewport: ViewportPanel,
    timeline: TimelinePanel,
    environments: EnvironmentsPanel,
    looks: LooksPanel,
    light: LightPanel,
    picture: PicturePanel,
    effects: EffectsPanel,
    probe: ProbePanel,
    gamma: GammaPanel,
    lamps: LampSheetPanel,
    review: ReviewPanel,
    accuracy: AccuracyPanel,
    training: TrainingPanel,
    export: ExportPanel,
    checks: ChecksPanel,
    scopes: ScopesPanel,
}

impl Panels {
    /// Size of a pixel of the fitted picture in points; 0 before the first picture.
    pub fn fit(&self) -> f32 {
        self.viewport.fit()
    }

    /// Makes the viewport draw textures of this GPU.
    pub fn draw_with(&mut self, window: RenderState) {
        self.viewport = ViewportPanel::drawn_with(window);
    }

    /// The timeline panel.
    pub fn timeline(&mut self) -> &mut TimelinePanel {
        &mut self.timeline
    }

    /// Ends the choice of three points on the mirror ball's rim; returns false if there is none.
    pub fn leave_points(&mut self) -> bool {
        self.probe.leave_points()
    }

    /// Moves the focus to the first control of a pane in the order of the Tab key.
    pub fn focus(&mut self, pane: Pane) {
        match pane {
            Pane::Export => self.export.focus(),
            Pane::Environments => self.environments.focus(),
            _ => {}
        }
    }
}

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
    fn side_ui(&mut self, ui: &mut Ui, pane: Pane, width: f32) {
        let frame = Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, 0));
        Panel::right(pane.name()).exact_size(width).frame(frame).show(ui, |ui| match pane {
            Pane::Probe => self.panels.probe.side_ui(ui, &self.context, self.out),
            _ => self.panels.gamma.side_ui(ui, &self.context, self.out),
        });
    }

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
        self.contents_ui(ui, pane);
    }

    fn contents_ui(&mut self, ui: &mut Ui, pane: Pane) {
        let (panels, context) = (&mut *self.panels, &self.context);
        let out = &mut *self.out;
        match pane {
            Pane::Probe => {
                // Without a picture, the reason fills the pane.
                if !matches!(context.probe, Some(Err(_))) {
                    self.side_ui(ui, pane, 392.0);
                }
                self.panels.probe.ui(ui, &self.context, self.out);
            }
            Pane::Gamma => {
                if !matches!(context.gamma, Some(Err(_))) {
                    self.side_ui(ui, pane, 408.0);
                }
                self.panels.gamma.ui(ui, &self.context, self.out);
            }
            Pane::Training => panels.training.ui(ui, context, out),
            Pane::Project => panels.project.ui(ui, context, out),
            Pane::Footage => panels.footage.ui(ui, context, out),
            Pane::Picture => panels.viewport.ui(ui, context, out),
            Pane::Timeline => padded(ui, |ui| panels.timeline.ui(ui, context, out)),
            Pane::Environments => padded(ui, |ui| panels.environments.ui(ui, context, out)),
            Pane::Looks => padded(ui, |ui| panels.looks.ui(ui, context, out)),
            Pane::Light => padded(ui, |ui| {
                scrolled(ui, |ui| {
                    // The scroll bar must not cover the contents.
                    ui.set_max_width(ui.available_width() - GAP);
                    panels.light.ui(ui, context, out);
                    panels.picture.ui(ui, context, out);
                });
            }),
            Pane::Effects => padded(ui, |ui| {
                scrolled(ui, |ui| panels.effects.ui(ui, context, out));
            }),
            Pane::Scopes => padded(ui, |ui| {
                scrolled(ui, |ui| panels.scopes.ui(ui, context, out));
            }),
            Pane::Lamps => padded(ui, |ui| panels.lamps.ui(ui, context, out)),
            Pane::Review => padded(ui, |ui| panels.review.ui(ui, context, out)),
            Pane::Accuracy => padded(ui, |ui| panels.accuracy.ui(ui, context, out)),
            Pane::Export => padded(ui, |ui| panels.export.ui(ui, context, out)),
            Pane::Checks => padded(ui, |ui| panels.checks.ui(ui, context, out)),
            Pane::Log => padded(ui, |ui| log_ui(ui, context, out)),
        }
    }
}

/// A panel's contents with a margin.
fn padded(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    Frame::new().inner_margin(Margin::symmetric(MARGIN as i8, 4)).show(ui, contents);
}

fn scrolled(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.add_space(GAP);
        contents(ui);
        ui.add_space(GAP);
    });
}

impl Behavior<Pane> for WorkspaceView<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, theme::PANEL);
        ui.set_clip_rect(ui.clip_rect().intersect(rect));
        self.drawn.push(*pane);
        // Not for a click on something over the pane, such as a menu.
        let pressed = ui.input(|i| i.pointer.any_pressed()) && ui.rect_contains_pointer(rect);
        if pressed && self.context.state.active != *pane {
            self.out.push(Command::Window(WindowCommand::Activate(*pane)));
        }
        self.contents_ui(ui, *pane);
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
