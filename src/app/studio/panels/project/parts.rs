//! The parts of a shoot, added one by one: a row for each kind, with its files.

use crate::command::{Command, Dialog};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::project::plan::{Brought, Plan};
use crate::panels::widgets::notice::quiet_ui;
use crate::theme::{self, GAP};
use base::files::shown;
use egui::{Button, ColorImage, ComboBox, Event, Id, Rect, RichText, Stroke, TextureHandle, Ui, vec2};
use footage::candidate::{Candidate, Slot};
use footage::gathered::Misfit;
use worker::SrgbPicture;

/// Height of a thumbnail in points.
const THUMBNAIL: f32 = 48.0;
/// Width of the column with the kinds' names, in points.
const NAMES: f32 = 120.0;

/// The rows. Changes of `plan` go into `changed`.
pub fn parts_ui(ui: &mut Ui, context: &PanelContext, plan: &Plan, changed: &mut Plan, out: &mut Vec<Command>) {
    let is_dragging = ui.input(|input| !input.raw.hovered_files.is_empty());
    let edge = if is_dragging { Stroke::new(2.0, theme::ACCENT) } else { Stroke::NONE };
    let well = egui::Frame::new().fill(theme::WELL).stroke(edge);
    well.corner_radius(4).inner_margin(1.5 * GAP).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let mut rows = Vec::new();
        for slot in Slot::ALL {
            let row = ui.scope(|ui| kind_ui(ui, context, slot, changed, out));
            rows.push((slot, row.response.rect));
            ui.add_space(0.5 * GAP);
            ui.separator();
        }
        unknown_ui(ui, context, changed);
        land(ui, plan, changed, &rows);
    });
}

/// Seconds after a drop in which the pointer's next move counts as the place of the drop.
const LANDING_S: f64 = 1.0;

/// Assigns dropped files to the row that the pointer is over next: window systems do not report the pointer's position
/// while files are dragged.
fn land(ui: &Ui, plan: &Plan, changed: &mut Plan, rows: &[(Slot, Rect)]) {
    if plan.parts.iter().all(|part| part.landed_s.is_none()) {
        return;
    }
    let moved = |event: &Event| match event {
        Event::PointerMoved(at) => Some(*at),
        _ => None,
    };
    let (now, at) = ui.input(|input| (input.time, input.events.iter().find_map(moved)));
    let row = at.and_then(|at| rows.iter().find(|(_, rect)| rect.contains(at)));
    for part in &mut changed.parts {
        let Some(landed) = part.landed_s else { continue };
        let is_over = now - landed > LANDING_S;
        if let (Some((slot, _)), false) = (row, is_over) {
            part.slot = Some(*slot);
        }
        if at.is_some() || is_over {
            part.landed_s = None;
        }
    }
}

/// One kind of part: its files, or a description of what belongs there.
fn kind_ui(ui: &mut Ui, context: &PanelContext, slot: Slot, changed: &mut Plan, out: &mut Vec<Command>) {
    ui.horizontal_top(|ui| {
        ui.allocate_ui(vec2(NAMES, 0.0), |ui| {
            ui.set_width(NAMES);
            ui.vertical(|ui| {
                ui.strong(slot.name());
                let button = ui.small_button("Add…");
                let words = format!("Add files to: {}", slot.name());
                button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &words));
                if button.clicked() {
                    out.push(Command::Dialog(Dialog::ShootPart(slot)));
                }
            });
        });
        ui.vertical(|ui| {
            ui.set_width(ui.available_width());
            let mut any = false;
            for one in context.picker.wizard.brought().filter(|one| one.slot() == Some(slot)) {
                any = true;
                brought_ui(ui, one, context.picker.wizard.misfit(one), changed);
            }
            if !any {
                quiet_ui(ui, slot.wants());
            }
        });
    });
}

/// Added files of unknown kind.
fn unknown_ui(ui: &mut Ui, context: &PanelContext, changed: &mut Plan) {
    let mut any = false;
    for one in context.picker.wizard.brought().filter(|one| one.slot().is_none()) {
        any = true;
        let reason = one.candidate.map(|candidate| match &candidate.failure {
            Some(failure) => failure.clone(),
            None => "Choose what this is, on the right".to_owned(),
        });
        let misfit = reason.map(|sentence| Misfit { sentence, is_guess: false });
        brought_ui(ui, one, misfit, changed);
    }
    if !any {
        quiet_ui(ui, "Drop movies and folders here, one by one or all at once");
    }
}

/// One file: thumbnails, contents, the reason for its kind, and the reason why it does not fit.
fn brought_ui(ui: &mut Ui, one: Brought, misfit: Option<Misfit>, changed: &mut Plan) {
    ui.horizontal_top(|ui| {
        if let Some(candidate) = one.candidate {
            thumbnails_ui(ui, candidate);
        }
        ui.vertical(|ui| {
            ui.set_width(ui.available_width());
            ui.spacing_mut().item_spacing.y = 1.0;
            head_ui(ui, one, changed);
            let Some(candidate) = one.candidate else {
                quiet_ui(ui, "Reading");
                return;
            };
            quiet_ui(ui, &candidate.found);
            let why = match (one.part.slot, candidate.guess) {
                (None, Some(_)) => Some("Guessed".to_owned()),
                (Some(said), Some(guess)) if said != guess => Some(format!("Looks like “{}”", guess.name())),
                (None, None) => Some("Unclear".to_owned()),
                _ => None,
            };
            if let Some(why) = why.filter(|_| !candidate.reason.is_empty()) {
                quiet_ui(ui, &format!("{why}: {}", candidate.reason));
            }
            if let Some(misfit) = misfit {
                let text = format!("{} {}", icons::WARNING, misfit.sentence);
                ui.add(egui::Label::new(RichText::new(text).color(theme::WARNING)).wrap());
                let name = one.part.path.file_name().unwrap_or_default().to_string_lossy();
                let words = format!("Use {name} anyway");
                if misfit.is_guess && icons::named_ui(ui, true, Button::new("Use it anyway"), &words).clicked() {
                    let part = changed.parts.iter_mut().find(|part| part.path == one.part.path);
                    part.into_iter().for_each(|part| part.anyway = true);
                }
            }
        });
    });
    ui.add_space(GAP);
}

/// A file's name, its kind, and a remove button.
fn head_ui(ui: &mut Ui, one: Brought, changed: &mut Plan) {
    let path = &one.part.path;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    ui.horizontal(|ui| {
        let room = (ui.available_width() - 190.0).max(80.0);
        ui.allocate_ui(vec2(room, 20.0), |ui| {
            ui.set_width(room);
            ui.add(egui::Label::new(RichText::new(&*name).strong()).truncate()).on_hover_text(shown(path));
        });
        let chosen = one.slot();
        let list = ComboBox::from_id_salt(("slot", path)).width(130.0);
        let list = list.selected_text(chosen.map_or("What is it?", Slot::name));
        let mut now = chosen;
        let list = list.show_ui(ui, |ui| {
            for slot in Slot::ALL {
                ui.selectable_value(&mut now, Some(slot), slot.name());
            }
        });
        let words = format!("Kind of {name}");
        (list.response).widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, &words));
        if now != chosen {
            let part = changed.parts.iter_mut().find(|part| part.path == *path);
            part.into_iter().for_each(|part| (part.slot, part.anyway) = (now, false));
        }
        let words = format!("Remove {name}");
        if icons::named_ui(ui, true, Button::new(icons::REMOVE), &words).clicked() {
            changed.parts.retain(|part| part.path != *path);
        }
    });
}

/// A thumbnail on the GPU, kept as long as the window.
#[derive(Clone)]
struct Thumbnail(TextureHandle);

fn thumbnails_ui(ui: &mut Ui, candidate: &Candidate) {
    for (i, picture) in candidate.thumbnails.iter().enumerate() {
        let id = Id::unique(("thumbnail", &candidate.path, i));
        let kept = ui.data(|data| data.get_temp::<Thumbnail>(id));
        let Thumbnail(texture) = kept.unwrap_or_else(|| {
            let picture = SrgbPicture::from_picture(picture);
            let pixels = ColorImage::from_rgb([picture.width, picture.height], &picture.rgb);
            let texture = (ui.ctx()).load_texture("thumbnail", pixels, egui::TextureOptions::LINEAR);
            let made = Thumbnail(texture);
            ui.data_mut(|data| data.insert_temp(id, made.clone()));
            made
        });
        let size = texture.size_vec2();
        ui.image((texture.id(), size * (THUMBNAIL / size.y.max(1.0))));
    }
}

/// Frees the thumbnails.
pub fn forget(ui: &Ui) {
    ui.data_mut(|data| data.remove_by_type::<Thumbnail>());
}
