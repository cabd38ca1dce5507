//! The two responses between which the calibration cannot decide: each with the exemplar relit under it, and a button
//! that picks it.

use crate::command::{CalibrationCommand, Command, LookCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use calibration::Trial;
use calibration::gamma::Case;
use egui::{Button, RichText, TextureHandle, Ui, vec2};
use worker::GammaView;

/// Responses and exposures of the open cases.
pub fn trials(view: &GammaView) -> Vec<Trial> {
    view.cases.iter().map(|(case, _)| case.trial()).collect()
}

/// Both cases side by side; nothing if only one is plausible.
pub fn ui(ui: &mut Ui, context: &PanelContext, view: &GammaView, pictures: &[TextureHandle], out: &mut Vec<Command>) {
    if view.cases.is_empty() {
        return;
    }
    let quiet = |text: String| RichText::new(text).size(13.0).color(theme::QUIET);
    ui.label("Two answers fit the pictures. Which one is true?");
    let width = 0.5 * (ui.available_width() - GAP);
    ui.horizontal_top(|ui| {
        for ((case, _), picture) in view.cases.iter().zip(pictures) {
            ui.vertical(|ui| {
                ui.set_width(width);
                let height = 120.0f32.min(width);
                let image = egui::Image::new((picture.id(), picture.size_vec2()));
                ui.add(image.max_size(vec2(width, height)));
                ui.label(sentence(case));
                ui.label(quiet(format!(
                    "γ1 {:.2} ± {:.2}, γ2 {:.2} ± {:.2}",
                    case.gamma1, case.deviation[0], case.gamma2, case.deviation[1]
                )));
                let idle = context.status.job.is_none();
                let name = if case.changed { "Exposure changed" } else { "Exposure unchanged" };
                let button = ui.add_enabled(idle, Button::new(name)).on_hover_text("Calibrates with this response");
                if button.clicked() {
                    out.push(Command::Look(LookCommand::Trial(Some(case.trial()))));
                    out.push(Command::Calibration(CalibrationCommand::Start));
                }
            });
        }
    });
    ui.add_space(GAP);
}

fn sentence(case: &Case) -> String {
    let percent = 100.0 * case.probability;
    if case.changed {
        let than = if case.exposure > 1.0 { "brighter" } else { "darker" };
        format!("{percent:.0} %: exposure changed after the balls, {:.0} % {than}", 100.0 * (case.exposure - 1.0).abs())
    } else {
        format!("{percent:.0} %: exposure unchanged")
    }
}
