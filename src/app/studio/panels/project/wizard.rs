//! A new project on one page: the shoot, its contents, and the settings.

use super::parts::{forget, parts_ui};
use crate::command::{Command, Dialog, ProjectCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::project::plan::{Plan, cost};
use crate::panels::widgets::notice::quiet_ui;
use crate::panels::widgets::numbers::{computing, is_reset};
use crate::theme::{self, GAP};
use base::files::shown;
use egui::{Button, ComboBox, Grid, Id, RichText, TextEdit, Ui, vec2};
use footage::scan::{Line, Scan};

/// Offered working sizes.
const SIZES: [usize; 5] = [64, 128, 256, 512, 1024];
/// Width of a row's name in points.
const NAMES: f32 = 110.0;

/// The page.
pub fn plan_ui(ui: &mut Ui, context: &PanelContext, plan: &Plan, out: &mut Vec<Command>) {
    let mut changed = plan.clone();
    let gathered = plan.is_gathered().then(|| context.picker.wizard.gathered_scan()).flatten();
    let scan = context.picker.wizard.scan();
    ui.heading("New project");
    ui.add_space(GAP);
    row_ui(ui, "Shoot", |ui, name| {
        let hint = "The folder with manifest.json, interview, exemplars and probes; it can be dropped here";
        if path_ui(ui, name, &mut changed.shoot, hint, "Choose the shoot's folder") {
            out.push(Command::Dialog(Dialog::Shoot));
        }
    });
    ui.add_space(GAP);
    match scan {
        Some(scan) => found_ui(ui, scan),
        None if plan.shoot.trim().is_empty() => {
            quiet_ui(
                ui,
                "Choose, type or drop the shoot's folder (with its manifest.json), or bring the parts: the interview, each \
                 pose under each single lamp, and the mirror balls.",
            );
            ui.add_space(0.5 * GAP);
            parts_ui(ui, context, plan, &mut changed, out);
        }
        None => quiet_ui(ui, "Reading the folder"),
    }
    ui.add_space(GAP);
    layer_ui(ui, &context.picker.wizard.layers(), &mut changed);
    if let Some(scan) = scan.or(gathered.as_ref()) {
        choices_ui(ui, scan, plan, &mut changed, out);
        ui.add_space(GAP);
    }
    ui.horizontal(|ui| {
        let obstacle = match context.status.job {
            Some(_) => Some("Another job is running: wait until it ends, or stop it"),
            None => context.picker.wizard.job().err(),
        };
        let make = Button::new("Make project").min_size(vec2(120.0, 28.0));
        if ui.add_enabled(obstacle.is_none(), make).clicked() {
            forget(ui);
            out.push(Command::Project(ProjectCommand::Make));
        }
        if ui.add(Button::new("Cancel").min_size(vec2(84.0, 28.0))).clicked() {
            forget(ui);
            out.push(Command::Project(ProjectCommand::Plan(None)));
        }
        if let Some(obstacle) = obstacle {
            quiet_ui(ui, obstacle);
        }
    });
    if changed != *plan {
        out.push(Command::Project(ProjectCommand::Plan(Some(Box::new(changed)))));
    }
}

/// A row with a name; its contents get the name's id.
fn row_ui(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui, Id)) {
    ui.horizontal(|ui| {
        let left = egui::Layout::left_to_right(egui::Align::Center);
        let size = vec2(NAMES, 24.0);
        let label = ui.allocate_ui_with_layout(size, left, |ui| {
            ui.set_min_size(size);
            ui.label(name).id
        });
        contents(ui, label.inner);
    });
}

/// A path to type, with a button for a dialog; returns true if the button was clicked.
fn path_ui(ui: &mut Ui, name: Id, path: &mut String, hint: &str, choose: &str) -> bool {
    let width = ui.available_width() - 96.0;
    let field = TextEdit::singleline(path).desired_width(width).hint_text(hint);
    ui.add(field).labelled_by(name);
    let button = ui.button("Choose…");
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, choose));
    button.clicked()
}

/// Contents of the folder, one line for each part.
fn found_ui(ui: &mut Ui, scan: &Scan) {
    egui::Frame::new().fill(theme::WELL).corner_radius(4).inner_margin(1.5 * GAP).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.spacing_mut().interact_size.y = 18.0;
        Grid::new("found").num_columns(3).min_col_width(16.0).spacing([1.5 * GAP, 5.0]).show(ui, |ui| {
            for line in &scan.lines {
                line_ui(ui, line);
                ui.end_row();
            }
        });
    });
}

fn line_ui(ui: &mut Ui, line: &Line) {
    let (mark, color, says) = match (&line.lack, line.needed) {
        (None, _) => (icons::DONE, theme::QUIET, "complete"),
        (Some(_), false) => ("–", theme::QUIET, "not needed"),
        (Some(_), true) => (icons::WARNING, theme::WARNING, "missing"),
    };
    let tick = ui.colored_label(color, mark);
    tick.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, format!("{}: {says}", line.part)));
    ui.label(line.part);
    ui.vertical(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.label(RichText::new(&line.found).color(theme::QUIET));
        if let Some(lack) = &line.lack {
            ui.add(egui::Label::new(RichText::new(lack).color(color)).wrap());
        }
    });
}

/// Choice among the layers of EXR files that have several.
fn layer_ui(ui: &mut Ui, layers: &[String], plan: &mut Plan) {
    if layers.is_empty() && plan.layer.is_none() {
        return;
    }
    row_ui(ui, "EXR layer", |ui, name| {
        const FINISHED: &str = "Finished picture";
        let shown = plan.layer.clone().unwrap_or_else(|| FINISHED.to_owned());
        let list = ComboBox::from_id_salt("layer").selected_text(shown).show_ui(ui, |ui| {
            ui.selectable_value(&mut plan.layer, None, FINISHED);
            for layer in layers.iter().filter(|layer| !layer.is_empty()) {
                ui.selectable_value(&mut plan.layer, Some(layer.clone()), layer);
            }
        });
        list.response.labelled_by(name);
    });
}

fn choices_ui(ui: &mut Ui, scan: &Scan, plan: &Plan, changed: &mut Plan, out: &mut Vec<Command>) {
    row_ui(ui, "Working size", |ui, name| {
        let sizes = ComboBox::from_id_salt("size").selected_text(format!("{} pixels", plan.size));
        let list = sizes.show_ui(ui, |ui| {
            for size in SIZES {
                ui.selectable_value(&mut changed.size, size, format!("{size} pixels"));
            }
        });
        list.response.labelled_by(name);
        if let Some((width, height)) = scan.picture
            && width.min(height) < plan.size
        {
            quiet_ui(ui, &format!("The frames are {width} × {height}: a larger size adds no detail"));
        }
    });
    row_ui(ui, "", |ui, _| quiet_ui(ui, &cost(scan, plan)));
    if scan.lamps > 0 {
        row_ui(ui, "Lamps", |ui, name| {
            let half = scan.lamps.div_ceil(2).max(1);
            let mut all = plan.lamps.is_none();
            if ui.checkbox(&mut all, format!("All {}", scan.lamps)).changed() {
                changed.lamps = (!all).then_some(half);
            }
            if let Some(count) = &mut changed.lamps {
                let most = scan.lamps.saturating_sub(1).max(1);
                let field = ui.add(computing(count).range(1..=most)).labelled_by(name);
                if is_reset(ui, &field) {
                    *count = half;
                }
                quiet_ui(ui, "spread evenly; calibration still uses the others");
            }
        });
    }
    row_ui(ui, "Name", |ui, name| {
        let field = TextEdit::singleline(&mut changed.name).hint_text(&scan.name).desired_width(240.0);
        ui.add(field).labelled_by(name);
    });
    row_ui(ui, "Folder", |ui, name| {
        let beside = Plan { folder: String::new(), ..plan.clone() };
        let hint = shown(&beside.root().unwrap_or_default());
        if path_ui(ui, name, &mut changed.folder, &hint, "Choose the project's folder") {
            out.push(Command::Dialog(Dialog::ProjectFolder));
        }
    });
}
