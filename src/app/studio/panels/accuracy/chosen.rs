//! The chosen rung: predicted and measured cost, its picture beside the best rung's and the truth, and the button that
//! applies it.

use super::words;
use crate::command::{AccuracyCommand, Command};
use crate::panel_context::PanelContext;
use crate::panels::accuracy::query::TRUTH;
use crate::theme::{self, GAP};
use egui::{Grid, RichText, Ui, vec2};
use tradeoff::{Knob, Ledger, Measured};

/// A rung, with the ledger and the best rung to compare it with.
pub struct Chosen<'a> {
    pub ledger: &'a Ledger,
    pub rung: &'a Measured,
    pub best: Option<&'a Measured>,
}

impl Chosen<'_> {
    pub fn ui(&self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let measured = self.rung;
        ui.horizontal_wrapped(|ui| {
            ui.heading(words::title(measured));
            self.apply_ui(ui, context, out);
        });
        ui.label(RichText::new(self.clip(context)).color(theme::QUIET));
        ui.add_space(GAP);
        ui.horizontal_top(|ui| {
            self.figures_ui(ui);
            ui.add_space(GAP);
            self.pictures_ui(ui, context, out);
        });
    }

    /// The button that applies the rung; "In use" if it is applied.
    fn apply_ui(&self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let measured = self.rung;
        if self.ledger.applied.as_deref() == Some(measured.rung.name.as_str()) {
            ui.label(RichText::new("In use").color(theme::GOOD));
            return;
        }
        let (able, why) = match (&context.status.job, context.session.read_only) {
            (Some(_), _) => (false, "Wait until the running job ends"),
            (_, Some(why)) => (false, why),
            _ => (true, ""),
        };
        let hint = "Applies this network, size, lamps and effects to the project. The current ones are set aside.";
        let button = ui.add_enabled(able, theme::main_button(able, "Use this"));
        if button.on_hover_text(hint).on_disabled_hover_text(why).clicked() {
            out.push(Command::Accuracy(AccuracyCommand::Apply(measured.rung.name.clone())));
        }
        let alone = match measured.rung.knob {
            Some(Knob::Field) => Some("For comparison: the window keeps OLATs as 16-bit floats."),
            Some(Knob::Environment) => Some("For comparison: the window uses the whole panorama."),
            _ => None,
        };
        if let Some(alone) = alone {
            ui.label(RichText::new(alone).color(theme::QUIET));
        }
    }

    /// Relighting time for the whole interview, in words.
    fn clip(&self, context: &PanelContext) -> String {
        let frames = context.state.playback.frames;
        format!(
            "The interview's {frames} frames take about {} to relight.",
            words::duration(self.rung.frame.median * frames as f64 / 1e3)
        )
    }

    /// Predicted and measured figures, side by side.
    fn figures_ui(&self, ui: &mut Ui) {
        let measured = self.rung;
        let before = measured.predicted;
        let known = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
        let figure = |value: Option<f64>, digits: usize| known(value.map(|v| format!("{v:.digits$}")));
        let found = &measured.fidelity;
        let mut rows = vec![
            ("Time for a frame", known(before.map(|cost| words::ms(cost.frame_ms))), words::ms(measured.frame.median)),
            (
                "Memory",
                known(before.map(|cost| words::bytes(cost.memory_bytes))),
                words::bytes(measured.cost.memory_bytes),
            ),
            ("Disk", known(before.map(|cost| words::bytes(cost.disk_bytes))), words::bytes(measured.cost.disk_bytes)),
            ("Training", words::duration(60.0 * measured.rung.minutes), words::duration(measured.training_seconds)),
            ("PSNR", String::new(), format!("{:.1} dB", found.psnr_db)),
            ("OLATs", String::new(), figure(measured.olat_psnr_db, 1) + " dB"),
            ("SSIM", String::new(), format!("{:.3}", found.ssim)),
            ("FLIP", String::new(), format!("{:.3}", found.flip)),
        ];
        if found.lpips.is_some() {
            rows.push(("LPIPS", String::new(), figure(found.lpips, 3)));
        }
        if measured.flicker.is_some() {
            rows.push(("Flicker", String::new(), figure(measured.flicker, 2) + " %"));
        }
        if measured.changes_db.is_some() {
            rows.push(("Changes the picture by", String::new(), figure(measured.changes_db, 1) + " dB"));
        }
        Grid::new("figures").num_columns(3).spacing(vec2(2.0 * GAP, 4.0)).show(ui, |ui| {
            ui.label("");
            ui.label(RichText::new("Predicted").color(theme::QUIET));
            ui.label(RichText::new("Measured").color(theme::QUIET));
            ui.end_row();
            for (name, predicted, measured) in rows {
                ui.label(name);
                ui.label(RichText::new(predicted).color(theme::QUIET));
                ui.label(measured);
                ui.end_row();
            }
        });
    }

    /// The rung's picture beside the best rung's and the truth.
    fn pictures_ui(&self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let mut shown = vec![("This", self.rung.picture.clone())];
        if let Some(best) = self.best.filter(|best| best.picture != self.rung.picture) {
            shown.push(("Best", best.picture.clone()));
        }
        let files: Vec<String> = shown.iter().map(|(_, file)| file.clone()).collect();
        out.push(Command::Accuracy(AccuracyCommand::Draw(files)));
        if let Some(failure) = &context.readers.accuracy.failure {
            ui.colored_label(theme::WARNING, failure);
            return;
        }
        shown.push(("Truth", TRUTH.to_owned()));
        let side = (ui.available_width() / shown.len() as f32 - GAP).clamp(60.0, 260.0);
        for (name, file) in shown {
            ui.vertical(|ui| {
                ui.label(RichText::new(name).color(theme::QUIET));
                if let Some(texture) = context.readers.accuracy.pictures.get(&file) {
                    let size = texture.size_vec2();
                    let size = size * (side / size.max_elem());
                    let picture = egui::Image::new((texture.id(), size)).alt_text(name);
                    ui.add(picture);
                }
            });
        }
    }
}
