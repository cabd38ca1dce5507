//! The panels: a folder for each pane, for the performance report and for the color views; a file for each bar and
//! question over the panes; `readers`: the queries of all; `widgets`: parts of several.

/// Table of the panels, a row for each pane in the order of the menu: the pane, the title of its tab, the field and
/// type of its panel, and the frame around it. Makes [`Pane`] and [`Panels`].
macro_rules! with_panels {
    ($make:ident) => {
        $make! {
            Project, "Project", project: ProjectPanel, bare;
            Footage, "Footage", footage: FootagePanel, bare;
            Probe, "Probe", probe: ProbePanel, bare;
            Gamma, "Gamma", gamma: GammaPanel, bare;
            Training, "Training", training: TrainingPanel, bare;
            Picture, "Picture", viewport: ViewportPanel, bare;
            Timeline, "Timeline", timeline: TimelinePanel, padded;
            Environments, "Environments", environments: EnvironmentsPanel, padded;
            Looks, "Looks", looks: LooksPanel, padded;
            Light, "Light", light: LightPanel, scrolled;
            Effects, "Render passes", effects: EffectsPanel, scrolled;
            Scopes, "Scopes", scopes: ScopesPanel, scrolled;
            Lamps, "Lamps", lamps: LampSheetPanel, padded;
            Review, "Measurements", review: ReviewPanel, padded;
            Accuracy, "Accuracy", accuracy: AccuracyPanel, padded;
            Export, "Export", export: ExportPanel, padded;
            Checks, "Checks", checks: ChecksPanel, padded;
            Log, "Log", log: LogPanel, padded;
        }
    };
}

pub mod accuracy;
pub mod checks;
mod closing;
pub mod color_views;
mod effects;
pub mod environments;
pub mod export;
pub mod footage;
mod gamma;
pub mod job;
pub mod light;
mod log;
pub mod looks;
pub mod machine;
mod pane;
mod path;
pub mod probe;
pub mod project;
mod read_only;
pub mod readers;
pub mod review;
pub mod scopes;
mod status;
mod tabs;
pub mod timeline;
pub mod training;
pub mod viewport;
mod widgets;

pub use closing::{closing_ui, leaving_ui};
pub use job::JobPanel;
pub use machine::machine_ui;
pub use pane::Pane;
pub use path::PathPanel;
pub use status::StatusPanel;
pub use tabs::TabsPanel;
pub use timeline::TimelinePanel;
pub use widgets::lamp_title::{lamp_title, with_lamp_titles};

use crate::command::Command;
use crate::panel_context::PanelContext;
use accuracy::AccuracyPanel;
use checks::ChecksPanel;
use effects::EffectsPanel;
use eframe::egui_wgpu::RenderState;
use egui::Ui;
use environments::EnvironmentsPanel;
use export::ExportPanel;
use footage::FootagePanel;
use gamma::GammaPanel;
use light::LightPanel;
use log::LogPanel;
use looks::LooksPanel;
use probe::ProbePanel;
use project::ProjectPanel;
use review::{LampSheetPanel, ReviewPanel};
use scopes::ScopesPanel;
use training::TrainingPanel;
use viewport::ViewportPanel;
use widgets::frame::{bare, padded, scrolled};

macro_rules! panels {
    ($($pane:ident, $title:literal, $field:ident: $panel:ty, $frame:ident;)*) => {
        /// The panels, with the state of their drawing.
        #[derive(Default)]
        pub struct Panels {
            $($field: $panel,)*
        }

        impl Panels {
            /// Draws the panel of a pane, in its frame.
            pub fn ui(
                &mut self,
                ui: &mut Ui,
                pane: Pane,
                context: &PanelContext,
                out: &mut Vec<Command>,
            ) {
                match pane {
                    $(Pane::$pane => $frame(ui, |ui| self.$field.ui(ui, context, out)),)*
                }
            }
        }
    };
}

with_panels!(panels);

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
