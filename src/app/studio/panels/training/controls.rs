//! The training preset, its cost, and the buttons that start, pause and stop a run.

use crate::command::{Command, LookCommand, TrainingCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::job;
use crate::panels::training::query::{MORE_MINUTES, TrainChoice};
use crate::panels::widgets::numbers::{computing, is_reset};
use crate::theme;
use egui::{Button, RichText, Sense, Ui, WidgetInfo, vec2};
use project::Project;
use training::{Preset, RunCost};

/// Longest run in minutes: a week.
const MOST_MINUTES: f64 = 7.0 * 24.0 * 60.0;
const BUTTON: egui::Vec2 = vec2(84.0, 24.0);

/// The presets as a list, each with its cost.
pub fn presets_ui(ui: &mut Ui, context: &PanelContext, project: &Project, out: &mut Vec<Command>) {
    let choice = context.readers.training.choice(context.state.look.training, project);
    let pace = context.readers.training.pace();
    for preset in Preset::ALL {
        let chosen = preset == choice.preset;
        let wanted = TrainChoice { preset, ..choice };
        let config = wanted.config();
        let held_out = usize::from(choice.hold_out.is_some());
        let cost = config.cost(project, held_out, pace);
        let network = config.network(project).cost();
        let size = vec2(ui.available_width(), 38.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let enabled = !context.readers.training.running;
        response.widget_info(|| {
            let name = format!("Preset {}", preset.label());
            WidgetInfo::selected(egui::Role::RadioButton, enabled, chosen, name)
        });
        let fill = match (chosen, response.hovered() && enabled) {
            (true, _) => theme::ROW_CHOSEN,
            (false, true) => theme::ROW_HOVERED,
            (false, false) => theme::WELL,
        };
        let painter = ui.painter();
        painter.rect_filled(rect, 3.0, fill);
        if chosen {
            painter.rect_filled(rect.with_max_x(rect.left() + 3.0), 0.0, theme::ACCENT);
        }
        theme::focus_ui(ui, rect, &response);
        let limited = config.minutes.map(|minutes| 60.0 * minutes) == cost.seconds;
        let line = |x: f32, y: f32, align: egui::Align2, text: String, size: f32, color| {
            let at = egui::pos2(x, rect.top() + y);
            painter.text(at, align, text, egui::FontId::proportional(size), color);
        };
        let (left, right) = (rect.left() + 10.0, rect.right() - 10.0);
        let plain = if chosen { egui::Color32::WHITE } else { theme::TEXT };
        let name = preset.label().to_owned();
        line(left, 4.0, egui::Align2::LEFT_TOP, name, 14.0, plain);
        line(right, 4.0, egui::Align2::RIGHT_TOP, time(&cost, limited), 13.0, plain);
        let purpose = preset.purpose().to_owned();
        line(left, 21.0, egui::Align2::LEFT_TOP, purpose, 12.0, theme::QUIET);
        let known = match (pace, cost.timed) {
            (None, _) => "The time is known after the first steps.",
            (Some(_), true) => "Estimated from steps timed on this machine.",
            (Some(_), false) => "Estimated from another network's steps on this machine.",
        };
        let response = response.on_hover_text(format!("{network}, {}. {known}", steps(&cost, limited)));
        if response.clicked() && enabled && !chosen {
            out.push(Command::Look(LookCommand::Training(wanted)));
        }
    }
}

/// The duration of a run, exact if the run is `limited` by time.
fn time(cost: &RunCost, limited: bool) -> String {
    match cost.seconds {
        None => "known after the first steps".to_owned(),
        Some(seconds) if limited || cost.timed => duration(seconds),
        Some(seconds) => format!("about {}", duration(seconds)),
    }
}

fn steps(cost: &RunCost, limited: bool) -> String {
    match cost.steps {
        None => "limited by time".to_owned(),
        Some(steps) if limited && !cost.timed => format!("about {steps} steps"),
        Some(steps) => format!("{steps} steps"),
    }
}

/// A duration in seconds, minutes, hours or days.
pub fn duration(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    match minutes {
        0 => format!("{seconds:.0} s"),
        1..60 => format!("{minutes} min"),
        60..1440 => format!("{} h {:02} min", minutes / 60, minutes % 60),
        _ => format!("{} d {} h", minutes / 1440, minutes % 1440 / 60),
    }
}

/// The held-out pose, and the minutes.
pub fn settings_ui(ui: &mut Ui, context: &PanelContext, project: &Project, out: &mut Vec<Command>) {
    let choice = context.readers.training.choice(context.state.look.training, project);
    let poses = &project.settings.shoot.poses;
    ui.add_enabled_ui(!context.readers.training.running, |ui| {
        ui.horizontal(|ui| {
            let label = ui.label(RichText::new("Hold out").size(13.0));
            let name = |pose: Option<usize>| {
                let name = pose.and_then(|pose| poses.get(pose));
                name.map_or("None", String::as_str)
            };
            let list = egui::ComboBox::from_id_salt("hold out")
                .selected_text(name(choice.hold_out))
                .width(76.0)
                .show_ui(ui, |ui| {
                    // At least one pose is needed to train on.
                    let others = if poses.len() > 1 { poses.len() } else { 0 };
                    for pose in std::iter::once(None).chain((0..others).map(Some)) {
                        let chosen = pose == choice.hold_out;
                        if ui.selectable_label(chosen, name(pose)).clicked() {
                            out.push(Command::Look(LookCommand::Training(TrainChoice { hold_out: pose, ..choice })));
                        }
                    }
                });
            list.response
                .labelled_by(label.id)
                .on_hover_text("A pose held out of training. The network that does best on it is used.");
            if let Some(preset) = choice.preset.config().minutes {
                let label = ui.label(RichText::new("Minutes").size(13.0));
                let mut minutes = choice.minutes.unwrap_or(preset);
                let field = computing(&mut minutes).range(0.1..=MOST_MINUTES).speed(0.25).max_decimals(1);
                let response = ui.add_sized(vec2(52.0, 24.0), field).labelled_by(label.id);
                if is_reset(ui, &response) {
                    out.push(Command::Look(LookCommand::Training(TrainChoice { minutes: None, ..choice })));
                } else if response.changed() {
                    out.push(Command::Look(LookCommand::Training(TrainChoice { minutes: Some(minutes), ..choice })));
                }
                response.on_hover_text("Training time, including earlier runs. Double-click to reset.");
            }
        });
    });
}

/// The buttons that start a run, and pause and stop it while it runs.
#[derive(Default)]
pub struct Buttons {
    /// True while the confirmation to start over is shown.
    confirming: bool,
}

impl Buttons {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, project: &Project, out: &mut Vec<Command>) {
        if let Some(job) = context.status.job.as_ref() {
            self.confirming = false;
            if context.readers.training.running {
                ui.horizontal(|ui| job::buttons_ui(ui, job, out));
            } else {
                let text = format!("Wait for the running job: {}", job.what);
                ui.label(RichText::new(text).size(13.0).color(theme::QUIET));
            }
            return;
        }
        let records = context.readers.training.records.as_deref();
        let Some(present) = records.and_then(|records| records.present.as_ref()) else {
            // Starting over sets an unreadable checkpoint aside.
            let broken = records.is_some_and(|records| records.failure.is_some());
            ui.horizontal(|ui| start_ui(ui, broken, out));
            return;
        };
        if self.confirming {
            ui.label(
                RichText::new(format!(
                    "The network at step {} moves to the list below, with its curves. A new one starts.",
                    present.step
                ))
                .size(13.0),
            );
            ui.horizontal(|ui| {
                let yes = theme::main_button(true, "Start over");
                if ui.add(yes).clicked() {
                    out.push(Command::Training(TrainingCommand::Start { fresh: true }));
                    self.confirming = false;
                }
                self.confirming &= !ui.button("Cancel").clicked();
            });
            return;
        }
        let choice = context.readers.training.choice(context.state.look.training, project);
        let refusal = context.readers.training.refusal(&choice, project);
        let spent = context.readers.training.spent(&choice);
        ui.horizontal(|ui| {
            let name = match spent {
                Some(_) => format!("Resume, +{MORE_MINUTES} min"),
                None => "Resume".to_owned(),
            };
            let words = format!("{} {name}", icons::PLAY);
            let resume = theme::main_button(refusal.is_none(), words).min_size(BUTTON);
            let hint = match spent {
                Some(_) => format!("Continues from step {} with more time", present.step),
                None => format!("Continues from step {}. Key: Ctrl+Enter", present.step),
            };
            if icons::named_ui(ui, refusal.is_none(), resume, &name)
                .on_hover_text(hint)
                .on_disabled_hover_text(refusal.clone().unwrap_or_default())
                .clicked()
            {
                if let Some(spent) = spent {
                    // The field has one decimal.
                    let minutes = Some((10.0 * (spent + MORE_MINUTES)).ceil() / 10.0);
                    let longer = TrainChoice { minutes, ..choice };
                    out.push(Command::Look(LookCommand::Training(longer)));
                }
                out.push(Command::Training(TrainingCommand::Start { fresh: false }));
            }
            let over = Button::new((icons::OVER, "Start over…")).min_size(BUTTON);
            if icons::named_ui(ui, true, over, "Start over…").on_hover_text("Starts with a new network").clicked() {
                self.confirming = true;
            }
        });
        let complete = spent.map(|spent| format!("Time is up after {}.", duration(60.0 * spent)));
        for sentence in refusal.into_iter().chain(complete) {
            ui.label(RichText::new(sentence).size(12.0).color(theme::QUIET));
        }
    }
}

/// The button that starts the first run.
pub fn start_ui(ui: &mut Ui, fresh: bool, out: &mut Vec<Command>) {
    let start = theme::main_button(true, format!("{} Start", icons::PLAY)).min_size(BUTTON);
    let hint = "Trains the network with this preset. Key: Ctrl+Enter";
    if icons::named_ui(ui, true, start, "Start").on_hover_text(hint).clicked() {
        out.push(Command::Training(TrainingCommand::Start { fresh }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_at_a_glance() {
        let said = [20.0, 600.0, 7260.0, 200_000.0].map(duration);
        assert_eq!(said, ["20 s", "10 min", "2 h 01 min", "2 d 7 h"]);
    }

    #[test]
    fn a_preset_says_what_is_known_of_its_cost() {
        let cost = |seconds, steps, timed| RunCost { seconds, steps, timed };
        let said = |cost: RunCost, limited| [time(&cost, limited), steps(&cost, limited)];
        for (cost, limited, text) in [
            (cost(None, Some(9), false), false, ["known after the first steps", "9 steps"]),
            (cost(Some(600.0), None, false), true, ["10 min", "limited by time"]),
            (cost(Some(600.0), Some(9), false), true, ["10 min", "about 9 steps"]),
            (cost(Some(600.0), Some(9), true), true, ["10 min", "9 steps"]),
            (cost(Some(5400.0), Some(9), false), false, ["about 1 h 30 min", "9 steps"]),
            (cost(Some(5400.0), Some(9), true), false, ["1 h 30 min", "9 steps"]),
        ] {
            assert_eq!(said(cost, limited), text);
        }
    }
}
