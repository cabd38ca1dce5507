//! The panels in their places: hands each pane of the layout what it sees, and hears what was done.

use super::command::Command;
use super::layout::{BORDER, Pane, TABS_HEIGHT};
use super::panel::Sight;
use super::panels::{
    EffectsPanel, EnvironmentsPanel, ExportPanel, FootagePanel, GammaPanel, LampSheetPanel,
    LightPanel, LogPanel, PicturePanel, ProbePanel, ProjectPanel, ReviewPanel, ScopesPanel,
    TimelinePanel, TrainingPanel, ViewportPanel,
};
use super::theme::{self, GAP};
use egui::{Color32, Frame, Margin, Panel, ScrollArea, Stroke, Ui, Visuals};
use egui_tiles::{
    Behavior, EditAction, SimplificationOptions, TabState, TileId, Tiles, UiResponse,
};

/// The panels, which keep what only their drawing needs.
#[derive(Default)]
pub struct Panes {
    project: ProjectPanel,
    footage: FootagePanel,
    viewport: ViewportPanel,
    timeline: TimelinePanel,
    environments: EnvironmentsPanel,
    light: LightPanel,
    picture: PicturePanel,
    effects: EffectsPanel,
    probe: ProbePanel,
    gamma: GammaPanel,
    lamps: LampSheetPanel,
    review: ReviewPanel,
    training: TrainingPanel,
    export: ExportPanel,
    log: LogPanel,
    scopes: ScopesPanel,
}

impl Panes {
    /// Points that a pixel of the fitted picture takes; 0 before there was one.
    pub fn fit(&self) -> f32 {
        self.viewport.fit()
    }

    /// Gives the focus to the first control of a pane that goes by the tab key.
    pub fn focus(&mut self, pane: Pane) {
        if pane == Pane::Export {
            self.export.focus();
        }
    }
}

/// The panels while one frame of the window is drawn.
pub struct Shown<'a> {
    pub panes: &'a mut Panes,
    pub sight: Sight<'a>,
    pub out: &'a mut Vec<Command>,
    /// Those that were drawn.
    pub drawn: Vec<Pane>,
    /// Whether the arrangement was changed.
    pub edited: bool,
}

impl Shown<'_> {
    fn side_ui(&mut self, ui: &mut Ui, pane: Pane, width: f32) {
        let frame = Frame::new()
            .fill(theme::PANEL)
            .inner_margin(Margin::symmetric(12, 0));
        Panel::right(pane.name())
            .exact_size(width)
            .frame(frame)
            .show(ui, |ui| match pane {
                Pane::Probe => self.panes.probe.side_ui(ui, &self.sight, self.out),
                _ => self.panes.gamma.side_ui(ui, &self.sight, self.out),
            });
    }

    /// One pane in all of the room.
    pub fn alone_ui(&mut self, ui: &mut Ui, pane: Pane) {
        self.drawn.push(pane);
        self.contents_ui(ui, pane);
    }

    fn contents_ui(&mut self, ui: &mut Ui, pane: Pane) {
        let (panes, sight) = (&mut *self.panes, &self.sight);
        let out = &mut *self.out;
        match pane {
            Pane::Probe => {
                // Where there is nothing to show, the reason has all of the room.
                if !matches!(sight.probe, Some(Err(_))) {
                    self.side_ui(ui, pane, 392.0);
                }
                self.panes.probe.ui(ui, &self.sight, self.out);
            }
            Pane::Gamma => {
                if !matches!(sight.gamma, Some(Err(_))) {
                    self.side_ui(ui, pane, 408.0);
                }
                self.panes.gamma.ui(ui, &self.sight, self.out);
            }
            Pane::Training => panes.training.ui(ui, sight, out),
            Pane::Project => panes.project.ui(ui, sight, out),
            Pane::Footage => panes.footage.ui(ui, sight, out),
            Pane::Picture => panes.viewport.ui(ui, sight, out),
            Pane::Timeline => padded(ui, |ui| panes.timeline.ui(ui, sight, out)),
            Pane::Environments => padded(ui, |ui| panes.environments.ui(ui, sight, out)),
            Pane::Light => padded(ui, |ui| {
                scrolled(ui, |ui| {
                    panes.light.ui(ui, sight, out);
                    panes.picture.ui(ui, sight, out);
                });
            }),
            Pane::Effects => padded(ui, |ui| {
                scrolled(ui, |ui| panes.effects.ui(ui, sight, out));
            }),
            Pane::Scopes => padded(ui, |ui| {
                scrolled(ui, |ui| panes.scopes.ui(ui, sight, out));
            }),
            Pane::Lamps => padded(ui, |ui| panes.lamps.ui(ui, sight, out)),
            Pane::Review => padded(ui, |ui| panes.review.ui(ui, sight, out)),
            Pane::Export => padded(ui, |ui| panes.export.ui(ui, sight, out)),
            Pane::Log => padded(ui, |ui| panes.log.ui(ui, sight, out)),
        }
    }
}

/// A panel's contents on its ground.
fn padded(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    Frame::new()
        .inner_margin(Margin::symmetric(12, 4))
        .show(ui, contents);
}

fn scrolled(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.add_space(GAP);
        contents(ui);
        ui.add_space(GAP);
    });
}

impl Behavior<Pane> for Shown<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, theme::PANEL);
        ui.set_clip_rect(ui.clip_rect().intersect(rect));
        self.drawn.push(*pane);
        // Not where something that lies over the pane is meant, as a menu.
        let pressed = ui.input(|i| i.pointer.any_pressed()) && ui.rect_contains_pointer(rect);
        if pressed && self.sight.state.active != *pane {
            self.out.push(Command::Activate(*pane));
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
        if tab.active {
            theme::PANEL
        } else {
            theme::WELL
        }
    }

    fn tab_text_color(&self, _: &Visuals, _: &Tiles<Pane>, _: TileId, tab: &TabState) -> Color32 {
        if tab.active {
            theme::TEXT
        } else {
            theme::QUIET
        }
    }

    fn tab_outline_stroke(&self, _: &Visuals, _: &Tiles<Pane>, _: TileId, _: &TabState) -> Stroke {
        Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, _: &Visuals) -> Stroke {
        Stroke::NONE
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions {
            all_panes_must_have_tabs: true,
            ..SimplificationOptions::default()
        }
    }

    fn on_edit(&mut self, _: EditAction) {
        self.edited = true;
    }
}
