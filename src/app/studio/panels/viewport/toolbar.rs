//! The bar above the picture: the comparison on the left; on the right the viewing settings, which exports ignore.

use super::look_list::{list, look_list_ui};
use super::viewing;
use crate::command::{Command, Dialog, ExportCommand, LookCommand, TrainingCommand, ViewCommand};
use crate::comparison::{CompareMode, CompareSettings, GAINS, Reference};
use crate::environment_list::Owner;
use crate::export_options::ExportOptions;
use crate::four_looks::FourSlot;
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::environments::library::EnvironmentEntry;
use crate::panels::training::checkpoints;
use crate::panels::widgets::names::{called, short};
use crate::theme::{self, GAP};
use egui::containers::menu::MenuButton;
use egui::{Align, Button, ComboBox, Layout, Margin, Rect, Response, RichText, Role, Ui, UiBuilder, WidgetInfo, vec2};

/// Keys that compare two pictures by hand.
const HINT: &str = "W wipes, Q switches between the two, holding Shift shows the other";
/// Height of a row in points.
const HEIGHT: f32 = 32.0;
/// Space above and below a row in points.
const MARGIN: f32 = 3.0;

/// Id of a side's width in the last draw, or of the rows of the left side.
fn side_id(side: &str) -> egui::Id {
    egui::Id::unique(("viewer bar", side))
}

fn rows_on_the_left(ui: &Ui) -> f32 {
    ui.data(|data| data.get_temp(side_id("rows"))).unwrap_or(1.0)
}

/// Height of the bar in points: further rows if it is too narrow for one.
pub fn height(ui: &Ui, width: f32) -> f32 {
    let took = |side| ui.data(|data| data.get_temp::<f32>(side_id(side)));
    let sides = ["left", "right"].map(|side| took(side).unwrap_or_default());
    let is_one = sides[0] + sides[1] + 4.0 * GAP <= width;
    if is_one { HEIGHT } else { (rows_on_the_left(ui) + 1.0) * HEIGHT }
}

/// The name of a compared picture.
pub fn name(with: &Reference, context: &PanelContext) -> String {
    match with {
        Reference::Plate => "interview frame".to_owned(),
        Reference::Environment(origin) => {
            let entry = context.environments().iter().find(|e| e.listed.origin == *origin);
            entry.map_or_else(|| origin.to_string(), |entry| entry.listed.name.clone())
        }
        Reference::Look(id, number) => FourSlot::Stored(id.clone(), *number).name(),
        Reference::Exemplar(pose) => {
            let poses = context.session.project.map(|p| &p.settings.shoot.poses);
            let name = poses.and_then(|poses| poses.get(*pose));
            format!("{}, photographed", name.map_or("pose", |name| name))
        }
        Reference::Truth(_) => "true OLATs".to_owned(),
        Reference::Checkpoint(folder) => {
            let name = folder.file_name().unwrap_or_default().to_string_lossy();
            let records = context.readers.training.records.as_ref();
            let mut kept = records.into_iter().flat_map(|records| &records.kept);
            let kept = kept.find(|kept| kept.name == name);
            kept.map_or_else(|| format!("network {name}"), checkpoints::short)
        }
        Reference::Transfer => "no network".to_owned(),
    }
}

pub fn toolbar_ui(ui: &mut Ui, rect: Rect, context: &PanelContext, out: &mut Vec<Command>) {
    let lighting = &context.state.look.lighting;
    ui.painter().rect_filled(rect, 0.0, theme::PANEL);
    let row = |rect: Rect| UiBuilder::new().max_rect(rect - Margin::symmetric(8, MARGIN as i8));
    let first = rect.with_max_y(rect.top() + rows_on_the_left(ui) * HEIGHT);
    let last = rect.with_min_y(rect.bottom() - HEIGHT);
    ui.scope_builder(row(first), |ui| {
        let wrapped = Layout::left_to_right(Align::Center).with_main_wrap(true);
        let left = ui.with_layout(wrapped, |ui| {
            ui.spacing_mut().item_spacing = vec2(GAP, 2.0 * MARGIN);
            ui.set_row_height(HEIGHT - 2.0 * MARGIN);
            compare_ui(ui, context, out);
            if let Some(&lamp) = context.state.solo.first() {
                let hint = "Back to the environment. Key: Esc. Page Up and Page Down go through the lamps.";
                if solo_ui(ui, &context.lamps_named(lamp), hint) {
                    out.push(Command::View(ViewCommand::Solo(None)));
                }
            } else if let Some((first, others)) = lighting.solo_titles().split_first() {
                let names = match others.len() {
                    0 => short(first),
                    more => format!("{} + {more}", short(first)),
                };
                let hint = "All lights and the environment again. Key: Esc";
                if solo_ui(ui, &names, hint) {
                    let mut lighting = lighting.clone();
                    lighting.clear_solo();
                    out.push(Command::Look(LookCommand::Lighting(Box::new(lighting))));
                }
            }
            table_ui(ui, context, out);
            if context.state.viewport.doubts {
                let back = Button::new(RichText::new("Errors ×").color(theme::ACCENT));
                let hint = "Hide the expected errors";
                if ui.add(back).on_hover_text(hint).clicked() {
                    out.push(Command::View(ViewCommand::ToggleDoubts));
                }
            }
            ui.min_rect().size()
        });
        ui.data_mut(|data| {
            data.insert_temp(side_id("left"), left.inner.x);
            data.insert_temp(side_id("rows"), (left.inner.y / HEIGHT).round().max(1.0));
        });
    });
    ui.scope_builder(row(last), |ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let width = viewing::viewing_ui(ui, context, out);
            ui.data_mut(|data| data.insert_temp(side_id("right"), width));
        });
    });
}

fn compare_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let compare = &context.state.compare;
    first_ui(ui, context, out);
    let against = |reference| {
        let compare = compare.clone();
        Command::View(ViewCommand::Compare(CompareSettings { on: true, reference, ..compare }))
    };
    let b = RichText::new("B").color(theme::QUIET);
    let (text, button) = if compare.on {
        let name = name(&compare.reference, context);
        let button = Button::new((b, short(&name)));
        (format!("Against {name}"), button)
    } else {
        ("Compare".to_owned(), Button::new((b, icons::COMPARE, "Compare")))
    };
    let menu = MenuButton::from_button(button).ui(ui, |ui| {
        if ui.selectable_label(!compare.on, "Nothing").clicked() {
            out.push(Command::View(ViewCommand::Compare(CompareSettings { on: false, ..compare.clone() })));
        }
        let now = compare.on.then_some(&compare.reference);
        pictures_ui(ui, context, now, out, against);
        if ui.button("Truth in a folder…").clicked() {
            out.push(Command::Dialog(Dialog::ComparisonTruth));
        }
    });
    called(menu.0.on_hover_text(HINT), text);
    ui.add_enabled_ui(compare.on, |ui| mode_ui(ui, context, out));
    if compare.on && compare.mode == CompareMode::Difference {
        gain_ui(ui, context, out);
    }
}

/// Choice of the first picture: the relit one, or another in its place.
fn first_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let compare = &context.state.compare;
    let first = compare.first.as_ref().filter(|_| compare.on);
    let text = first.map_or("relit".to_owned(), |first| name(first, context));
    let set = |first: Option<Reference>| {
        let compare = compare.clone();
        let on = compare.on || first.is_some();
        Command::View(ViewCommand::Compare(CompareSettings { on, first, ..compare }))
    };
    let shown = short(&text);
    let button = Button::new((RichText::new("A").color(theme::QUIET), shown.as_str()));
    let menu = MenuButton::from_button(button).ui(ui, |ui| {
        if ui.selectable_label(first.is_none(), "Relit picture").clicked() {
            out.push(set(None));
        }
        pictures_ui(ui, context, first, out, |with| set(Some(with)));
    });
    called(menu.0.on_hover_text(HINT), format!("First: {text}"));
}

/// Choice of the way to show the two pictures.
fn mode_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let compare = &context.state.compare;
    let ways = [
        (CompareMode::Wipe, "Wipe"),
        (CompareMode::Side, "Side by side"),
        (CompareMode::Toggle, "One at a time"),
        (CompareMode::Difference, "Difference"),
    ];
    let now = ways.iter().find(|(mode, _)| *mode == compare.mode);
    let list = ComboBox::from_id_salt("how to compare").selected_text(now.map_or("", |(_, name)| name)).width(100.0);
    let response = list.show_ui(ui, |ui| {
        for (mode, name) in ways {
            if ui.selectable_label(mode == compare.mode, name).clicked() {
                out.push(Command::View(ViewCommand::Compare(CompareSettings { mode, ..compare.clone() })));
            }
        }
    });
    (response.response).widget_info(|| WidgetInfo::labeled(Role::ComboBox, compare.on, "How to compare"));
}

/// The list of gains for the difference.
pub fn gain_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let now = context.state.display.gain;
    let list = ComboBox::from_id_salt("difference gain").selected_text(format!("× {now}")).width(56.0);
    let response = list.show_ui(ui, |ui| {
        for gain in GAINS {
            if ui.selectable_label(gain == now, format!("× {gain}")).clicked() {
                out.push(Command::View(ViewCommand::Gain(gain)));
            }
        }
    });
    let list = response.response;
    list.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "Difference gain"));
    list.on_hover_text(format!("The difference is shown × {now}"));
}

/// The pictures that can be compared, apart from the relit one.
fn pictures_ui(
    ui: &mut Ui,
    context: &PanelContext,
    now: Option<&Reference>,
    out: &mut Vec<Command>,
    choose: impl Fn(Reference) -> Command,
) {
    let entry = |ui: &mut Ui, out: &mut Vec<Command>, text: &str, with: Reference| {
        let response = ui.selectable_label(now == Some(&with), text);
        if response.clicked() {
            out.push(choose(with));
        }
        response
    };
    entry(ui, out, "Interview frame", Reference::Plate);
    ui.menu_button("Environment", |ui| {
        list().show(ui, |ui| {
            let listed = |e: &&EnvironmentEntry| e.listed.owner != Owner::Folder;
            let entries = context.environments().iter().filter(listed);
            for one in entries.filter(|e| e.panorama.is_done()) {
                let with = Reference::Environment(one.listed.origin.clone());
                entry(ui, out, &one.listed.name, with);
            }
        });
    });
    ui.menu_button("Look", |ui| {
        let now = match now {
            Some(Reference::Look(id, number)) => FourSlot::Stored(id.clone(), *number),
            _ => FourSlot::Empty,
        };
        if let Some((id, number)) = look_list_ui(ui, context, &now) {
            out.push(choose(Reference::Look(id, number)));
        }
    });
    ui.menu_button("Photographed pose", |ui| {
        let poses = context.session.project.map(|project| &project.settings.shoot.poses);
        for (pose, name) in poses.into_iter().flatten().enumerate() {
            entry(ui, out, name, Reference::Exemplar(pose));
        }
    });
    ui.menu_button("Checkpoint", |ui| checkpoints_ui(ui, context, out, entry));
    let compare = &context.state.compare;
    let truth = [compare.first.as_ref(), Some(&compare.reference)];
    let mut truth = truth.into_iter().flatten();
    if let Some(truth) = truth.find(|with| matches!(with, Reference::Truth(_))) {
        entry(ui, out, "True OLATs", truth.clone());
    }
}

/// The saved states of the network.
fn checkpoints_ui(
    ui: &mut Ui,
    context: &PanelContext,
    out: &mut Vec<Command>,
    entry: impl Fn(&mut Ui, &mut Vec<Command>, &str, Reference) -> Response,
) {
    if !context.readers.training.is_asked() {
        out.push(Command::Training(TrainingCommand::ListCheckpoints));
    }
    let (Some(project), Some(records)) = (context.session.project, &context.readers.training.records) else {
        ui.label(RichText::new("Reading the checkpoints").color(theme::QUIET));
        return;
    };
    if records.kept.is_empty() {
        let text = "None yet: training saves some as it goes";
        ui.label(RichText::new(text).color(theme::QUIET));
    }
    list().show(ui, |ui| {
        for kept in &records.kept {
            let mut text = checkpoints::title(kept);
            if kept.present {
                text += ", current";
            }
            let with = Reference::Checkpoint(kept.folder(project));
            entry(ui, out, &text, with).on_hover_text(checkpoints::details(kept));
        }
        if !records.kept.is_empty() {
            entry(ui, out, "No network", Reference::Transfer).on_hover_text("Poses carried over, without a network");
        }
    });
}

/// Names of the solo lamps or lights, as a button that ends the solo. Returns true if it was clicked.
fn solo_ui(ui: &mut Ui, names: &str, hint: &str) -> bool {
    let back = Button::new(RichText::new(format!("Solo: {names} ×")).color(theme::ACCENT));
    ui.add(back).on_hover_text(hint).clicked()
}

/// The look-up table that the picture is shown through, as a button that removes it.
fn table_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let options = &context.state.export_options;
    let root = context.session.project.map(|project| &project.root);
    let Some(table) = root.and_then(|root| options.shown_table(root)) else { return };
    let name = table.file_name().unwrap_or_default().to_string_lossy();
    let back = Button::new(RichText::new(format!("LUT {name} ×")).color(theme::ACCENT));
    let hint = "Shows the picture without the LUT. Export says whether one is baked in.";
    if ui.add(back).on_hover_text(hint).clicked() {
        let options = ExportOptions { show_table: false, ..options.clone() };
        out.push(Command::Export(ExportCommand::Options(Box::new(options))));
    }
}
