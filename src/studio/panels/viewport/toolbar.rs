//! The line above the picture: what it is compared with, how it is scaled, and the pixel under the cursor.

use crate::studio::command::Command;
use crate::studio::compare::{Compare, How, With};
use crate::studio::panel::Sight;
use crate::studio::theme::{self, GAP};
use egui::{Align, Button, ComboBox, Layout, Margin, Rect, RichText, Ui, UiBuilder};

/// Its height in points.
pub const HEIGHT: f32 = 32.0;

/// What the second picture is called.
pub fn name(with: &With, sight: &Sight) -> String {
    match with {
        With::Plate => "interview frame".to_owned(),
        With::Environment(origin) => {
            let entry = sight
                .environments
                .iter()
                .find(|e| e.listed.origin == *origin);
            entry.map_or_else(|| origin.to_string(), |entry| entry.listed.name.clone())
        }
        With::Exemplar(pose) => {
            let poses = sight.project.map(|p| &p.settings.shoot.poses);
            let name = poses.and_then(|poses| poses.get(*pose));
            format!("{}, photographed", name.map_or("pose", |name| name))
        }
        With::Truth(_) => "true OLATs".to_owned(),
        With::Checkpoint(folder) => {
            let name = folder.file_name().unwrap_or_default();
            format!("network {}", name.to_string_lossy())
        }
    }
}

pub fn toolbar_ui(ui: &mut Ui, rect: Rect, sight: &Sight, out: &mut Vec<Command>) {
    ui.painter().rect_filled(rect, 0.0, theme::PANEL);
    let inner = rect - Margin::symmetric(8, 3);
    ui.scope_builder(UiBuilder::new().max_rect(inner), |ui| {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            compare_ui(ui, sight, out);
            if let Some(&lamp) = sight.state.solo.first() {
                solo_ui(ui, lamp, sight, out);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("1:1").on_hover_text("Key: 1").clicked() {
                    out.push(Command::ActualSize);
                }
                if ui.button("Fit").on_hover_text("Key: F").clicked() {
                    out.push(Command::Fit);
                }
                if let Some(text) = pixel(sight) {
                    let text = RichText::new(text).monospace().size(12.0);
                    ui.add(egui::Label::new(text.color(theme::QUIET)).truncate());
                }
            });
        });
    });
}

fn compare_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let compare = &sight.state.compare;
    let against = |with: With| {
        Command::Compare(Compare {
            on: true,
            with,
            ..compare.clone()
        })
    };
    let text = if compare.on {
        format!("Against {}", name(&compare.with, sight))
    } else {
        "Compare".to_owned()
    };
    ui.menu_button(text, |ui| {
        if ui.selectable_label(!compare.on, "Nothing").clicked() {
            out.push(Command::Compare(Compare {
                on: false,
                ..compare.clone()
            }));
        }
        let plate = compare.on && compare.with == With::Plate;
        if ui.selectable_label(plate, "Interview frame").clicked() {
            out.push(against(With::Plate));
        }
        ui.menu_button("Environment", |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                for entry in sight.environments.iter().filter(|e| e.panorama.is_done()) {
                    if ui.button(&entry.listed.name).clicked() {
                        out.push(against(With::Environment(entry.listed.origin.clone())));
                    }
                }
            });
        });
        ui.menu_button("Photographed pose", |ui| {
            let poses = sight.project.map(|project| &project.settings.shoot.poses);
            for (pose, name) in poses.into_iter().flatten().enumerate() {
                if ui.button(name).clicked() {
                    out.push(against(With::Exemplar(pose)));
                }
            }
        });
        if ui.button("True OLATs in a folder…").clicked() {
            out.push(Command::CompareTruth);
        }
    })
    .response
    .on_hover_text("W wipes, Q changes sides, Shift peeks at the other picture");
    if !compare.on {
        return;
    }
    let ways = [
        (How::Wipe, "wipe"),
        (How::Side, "side by side"),
        (How::Toggle, "one at a time"),
        (How::Difference, "difference"),
    ];
    let now = ways.iter().find(|(how, _)| *how == compare.how);
    let list = ComboBox::from_id_salt("how to compare")
        .selected_text(now.map_or("", |(_, name)| name))
        .width(110.0);
    let response = list.show_ui(ui, |ui| {
        for (how, name) in ways {
            if ui.selectable_label(how == compare.how, name).clicked() {
                out.push(Command::Compare(Compare {
                    how,
                    ..compare.clone()
                }));
            }
        }
    });
    (response.response)
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "How to compare"));
}

/// The lamp that is shown alone, and the way back.
fn solo_ui(ui: &mut Ui, lamp: usize, sight: &Sight, out: &mut Vec<Command>) {
    let lamps = sight.project.map(|project| &project.settings.shoot.lamps);
    let name = lamps.and_then(|lamps| lamps.get(lamp));
    let mut text = name.map_or_else(|| format!("lamp {lamp}"), Clone::clone);
    let more = sight.state.solo.len() - 1;
    if more > 0 {
        text += &format!(" and {more} more");
    }
    let back = Button::new(RichText::new(format!("{text} alone ×")).color(theme::ACCENT));
    let hint = "Back to the environment. Keys: Page up and Page down go through the lamps";
    if ui.add(back).on_hover_text(hint).clicked() {
        out.push(Command::Solo(None));
    }
}

/// The pixel that is looked at: its place and its codes.
fn pixel(sight: &Sight) -> Option<String> {
    let ([x, y], relit) = (sight.state.probed?, sight.relit?);
    let at = 3 * (y * relit.width + x);
    let [r, g, b] = *relit.rgb.get(at..at + 3)?.as_array()?;
    Some(format!("{x:4},{y:4}  {r:3} {g:3} {b:3}"))
}
