//! A pose under one lamp: predicted, true, and their difference.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use base::progress::TrainingPictures;
use egui::{Align2, Color32, FontId, Pos2, Rect, RichText, Sense, TextureHandle, Ui, WidgetInfo, vec2};
use std::sync::Arc;

/// Gain of the difference.
const GAIN: u32 = 4;
const CAPTION: f32 = 18.0;

/// Holds the textures of the shown lamp.
#[derive(Default)]
pub struct Pictures {
    shown: Option<LampTextures>,
}

struct LampTextures {
    pictures: Arc<TrainingPictures>,
    lamp: usize,
    textures: [TextureHandle; 3],
}

impl Pictures {
    /// Three pictures side by side, as large as fits.
    pub fn ui(&mut self, ui: &mut Ui, height: f32, context: &PanelContext) {
        let pictures = context.readers.training.pictures.as_ref();
        self.upload(ui, pictures, context.state.shoot.trained_lamp);
        let side = ((ui.available_width() - 2.0 * GAP) / 3.0).min(height - CAPTION);
        let names = ["Predicted", "True", "Difference ×4"];
        let width = 3.0 * side + 2.0 * GAP;
        let (rect, _) = ui.allocate_exact_size(vec2(width, side + CAPTION), Sense::hover());
        for (i, name) in names.into_iter().enumerate() {
            let corner = rect.left_top() + vec2(i as f32 * (side + GAP), 0.0);
            let place = Rect::from_min_size(corner, vec2(side, side));
            let painter = ui.painter();
            match &self.shown {
                Some(shown) => {
                    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
                    painter.image(shown.textures[i].id(), place, whole, Color32::WHITE);
                }
                None => {
                    painter.rect_filled(place, 0.0, theme::WELL);
                }
            }
            let below = place.center_bottom() + vec2(0.0, 3.0);
            let font = FontId::proportional(12.0);
            painter.text(below, Align2::CENTER_TOP, name, font, theme::QUIET);
            let response = ui.interact(place, ui.scope_id().with(name), Sense::hover());
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, name));
        }
        if self.shown.is_none() {
            let text = "Pictures appear here during training";
            let font = FontId::proportional(13.0);
            let middle = rect.center() - vec2(0.0, CAPTION / 2.0);
            ui.painter().text(middle, Align2::CENTER_CENTER, text, font, theme::QUIET);
        }
    }

    fn upload(&mut self, ui: &Ui, pictures: Option<&Arc<TrainingPictures>>, lamp: usize) {
        let Some(pictures) = pictures else {
            self.shown = None;
            return;
        };
        let lamp = lamp.min(pictures.lamps().saturating_sub(1));
        if let Some(shown) = &self.shown
            && Arc::ptr_eq(&shown.pictures, pictures)
            && shown.lamp == lamp
        {
            return;
        }
        let Some(bytes) = pictures.of_lamp(lamp, GAIN) else {
            self.shown = None;
            return;
        };
        let mut names = ["predicted", "true", "difference"].into_iter();
        let textures = bytes.map(|rgb| {
            let picture = egui::ColorImage::from_rgb(pictures.size, &rgb);
            let name = names.next().unwrap_or_default();
            ui.ctx().load_texture(name, picture, egui::TextureOptions::LINEAR)
        });
        self.shown = Some(LampTextures { pictures: pictures.clone(), lamp, textures });
    }
}

/// The list of lamps, and the pose.
pub fn lamp_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let lamps = context.session.project.map_or(0, |project| project.settings.shoot.lamps.len());
    let shown = context.state.shoot.trained_lamp.min(lamps.saturating_sub(1));
    let label = ui.label(RichText::new("Lamp").size(13.0));
    let list = egui::ComboBox::from_id_salt("trained lamp")
        .selected_text(context.lamp_title(shown))
        .width(96.0)
        .show_ui(ui, |ui| {
            for lamp in 0..lamps {
                if ui.selectable_label(lamp == shown, context.lamp_title(lamp)).clicked() {
                    out.push(Command::View(ViewCommand::TrainedLamp(lamp)));
                }
            }
        });
    list.response.labelled_by(label.id).on_hover_text("Keys: Page Up, Page Down");
    if let Some(pictures) = &context.readers.training.pictures {
        let poses = context.session.project.map_or(&[][..], |p| &p.settings.shoot.poses);
        let pose = poses.get(pictures.pose).map_or("", String::as_str);
        let seen = if pictures.held_out { ", held out" } else { "" };
        let text = format!("{pose}{seen}, after step {}", pictures.step);
        ui.label(RichText::new(text).size(12.0).color(theme::QUIET));
    }
}
