//! The light: the panorama with its handles, the lights placed by hand, and the environment's rotation and grade.

pub mod command;
mod front;
pub mod handle;
mod handler;
mod light_map;
pub mod lights;
mod panorama;
pub mod picture;

use crate::command::{Command, LookCommand};
use crate::environment_list::ListedEnvironment;
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::panels::environments::library::EnvironmentEntry;
use crate::panels::widgets::diamond::animated_ui;
use crate::panels::widgets::group::Heading;
use crate::panels::widgets::rows::{choice_ui, grid, settings_ui};
use crate::theme::{self, GAP};
use egui::{Align, Grid, Layout, RichText, Ui};
use light::Lighting;
use light::conventions::Tool;
use light::weights::Weighting;
use lights::relit;
use panorama::Preview;
use picture::PicturePanel;
use worker::Origin;

/// Width in points of a line with the choice of a map and the buttons that add lights.
const HEAD: f32 = 304.0;

/// The panorama's picture, the environment whose front is being picked again, and the settings of the picture.
#[derive(Default)]
pub struct LightPanel {
    preview: Preview,
    asked: Option<Origin>,
    picture: PicturePanel,
}

impl LightPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        // The scroll bar must not cover the contents.
        ui.set_max_width(ui.available_width() - GAP);
        self.light_ui(ui, context, out);
        self.picture.ui(ui, context, out);
    }

    fn light_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let listed = context.environment().map(|entry| &entry.listed);
        let again = listed.is_some_and(|listed| self.asked.as_ref() == Some(&listed.origin));
        let asked = again || listed.is_some_and(ListedEnvironment::asks);
        let before = out.len();
        if ui.available_width() < HEAD {
            self.preview.choice_ui(ui);
            ui.horizontal(|ui| lights::add_ui(ui, context, out));
        } else {
            ui.horizontal(|ui| {
                self.preview.choice_ui(ui);
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    lights::add_ui(ui, context, out);
                });
            });
        }
        self.preview.ui(ui, context, asked, out);
        if asked {
            front::question_ui(ui, context, out);
        }
        ui.add_space(GAP);
        Heading::new(Group::Lights, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                lights::lights_ui(ui, context, out);
                animated_ui(ui, context, Group::Lights);
            },
        );
        let mut picks = false;
        Heading::new(Group::Environment, context).ui(
            ui,
            out,
            |_, _| {},
            |ui, out| {
                picks = turn_ui(ui, context, out);
            },
        );
        if picks {
            self.asked = listed.map(|listed| listed.origin.clone());
        }
        Heading::new(Group::Grade, context).ui(ui, out, |_, _| {}, |ui, out| grade_ui(ui, context, out));
        if out[before..].iter().any(|c| matches!(c, Command::Look(LookCommand::Front(..)))) {
            self.asked = None;
        }
    }
}

/// Rotation of the environment, and its fit by the lamps. Returns true if the person chose to pick the front again.
fn turn_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> bool {
    let look = &context.state.look;
    let mut asks = false;
    grid("light").show(ui, |ui| {
        let is_file = |entry: &EnvironmentEntry| matches!(entry.listed.origin, Origin::File(_));
        if context.environment().is_some_and(is_file) {
            asks = front::answer_ui(ui, context, out);
            ui.end_row();
        }
        settings_ui(ui, context, Group::Environment, out);
        let kinds = [
            (Weighting::Fit, "Best"),
            (Weighting::Smooth, "Smooth"),
            (Weighting::Cells, "Cells"),
        ];
        let mut weighting = look.lighting.weighting;
        choice_ui(ui, "Fit", &kinds, &mut weighting).on_hover_text(
            "The lamps' fit to the environment. Best is closest; Cells can be sharper under a small sun, but jumps as it turns.",
        );
        if weighting != look.lighting.weighting {
            out.push(relit(Lighting {
                weighting,
                ..look.lighting.clone()
            }));
        }
        ui.end_row();
    });
    animated_ui(ui, context, Group::Environment);
    tools_ui(ui, look.front().turned(look.yaw_deg));
    asks
}

/// The environment's intensity and colour.
fn grade_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    grid("grade").show(ui, |ui| settings_ui(ui, context, Group::Grade, out));
    animated_ui(ui, context, Group::Grade);
}

/// The rotation in the notation of other tools.
fn tools_ui(ui: &mut Ui, yaw_deg: f32) {
    egui::CollapsingHeader::new("Rotation in other apps").id_salt("tools").show(ui, |ui| {
        Grid::new("tools").num_columns(2).show(ui, |ui| {
            for tool in Tool::ALL {
                ui.label(tool.title()).on_hover_text(tool.setting());
                let value = format!("{:.1}°", tool.value_of_yaw(yaw_deg));
                ui.label(RichText::new(value).color(theme::QUIET)).on_hover_text(tool.setting());
                ui.end_row();
            }
        });
    });
}
