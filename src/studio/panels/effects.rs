//! The plan of passes: which ran, which did not and why, and what each took.

use crate::studio::panel::Sight;
use crate::studio::theme::{self, GAP};
use egui::{RichText, Ui};

/// The panel keeps nothing.
#[derive(Default)]
pub struct EffectsPanel;

impl EffectsPanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight) {
        let Some(relit) = sight.relit else {
            ui.label("No picture has been made yet");
            return;
        };
        // Rows of text alone need no room for buttons.
        ui.spacing_mut().interact_size.y = 0.0;
        for pass in &relit.passes {
            let color = if pass.ran { theme::TEXT } else { theme::QUIET };
            ui.horizontal(|ui| {
                ui.label(RichText::new(&pass.name).size(13.0).color(color));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let time = match pass.ms {
                        _ if !pass.ran => "skipped".to_owned(),
                        Some(ms) => format!("{ms:.2} ms"),
                        None => "not timed".to_owned(),
                    };
                    ui.label(RichText::new(time).size(13.0).color(color));
                });
            });
            ui.label(RichText::new(&pass.reason).size(12.0).color(theme::QUIET));
            ui.add_space(GAP / 2.0);
        }
    }
}
