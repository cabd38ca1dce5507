//! Accuracy: time and error of each quality setting, and the choice of one for the project.

mod chosen;
pub mod command;
mod handler;
mod plot;
pub mod query;
pub mod words;

use crate::command::{AccuracyCommand, Command};
use crate::panel_context::PanelContext;
use crate::panels::widgets::numbers::{computing, is_reset};
use crate::theme::{self, GAP};
use egui::{ComboBox, RichText, ScrollArea, Ui};
use footage::scan::counted;
use project::Project;
use std::path::PathBuf;
use tradeoff::{Ledger, Pick, TradeoffSettings, front, pick};

/// Least and most height of the plot in points.
const PLOT_HEIGHT: std::ops::RangeInclusive<f32> = 220.0..=460.0;

/// Holds the settings of the next measurement, the targets of the search, and the chosen rung.
pub struct AccuracyPanel {
    /// Settings of the next measurement; None before a person has changed them.
    wish: Option<Wish>,
    /// Targets of the search: most milliseconds for a frame, and least PSNR in decibels.
    within_ms: f64,
    least_db: f64,
    /// Index of the chosen rung.
    chosen: Option<usize>,
}

/// Settings of a measurement that a person can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wish {
    /// Minutes of training for all networks.
    budget: f64,
    against: Compared,
}

/// Reference of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Compared {
    /// The shoot's truth if it has one, otherwise the middle pose.
    #[default]
    Best,
    Pose(usize),
}

impl Default for AccuracyPanel {
    fn default() -> Self {
        Self { wish: None, within_ms: 40.0, least_db: 30.0, chosen: None }
    }
}

impl AccuracyPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.add_space(GAP);
            ui.set_max_width(ui.available_width() - GAP);
            let Some(project) = context.session.project else {
                quiet_ui(ui, "Open a project to measure speed against accuracy.");
                return;
            };
            self.measure_ui(ui, context, project, out);
            ui.add_space(GAP);
            match &context.readers.accuracy.ledger {
                None => quiet_ui(ui, "Reading the last measurement."),
                Some(Err(sentence)) => drop(ui.colored_label(theme::WARNING, sentence)),
                Some(Ok(None)) => nothing_ui(ui),
                Some(Ok(Some(ledger))) => self.ladder_ui(ui, context, ledger, out),
            }
            ui.add_space(GAP);
        });
    }

    /// Settings of the next measurement, and the button that starts it.
    fn measure_ui(&mut self, ui: &mut Ui, context: &PanelContext, project: &Project, out: &mut Vec<Command>) {
        let (truth, ledger) = (context.accuracy_truth(), context.readers.accuracy.measured());
        let before = ledger.map(|ledger| Wish::from_ledger(ledger));
        let mut wish = self.wish.or(before).unwrap_or(Wish { budget: 60.0, against: Compared::default() });
        ui.horizontal_wrapped(|ui| {
            wish.ui(ui, project, truth.is_some());
            let goes_on = before == Some(wish);
            let is_done = ledger.is_some_and(|ledger| ledger.left() == 0);
            let (able, why) = match (&context.status.job, context.session.read_only) {
                (Some(_), _) => (false, "Wait until the running job ends"),
                (_, Some(why)) => (false, why),
                _ => (true, ""),
            };
            let (text, hint) = match (goes_on, is_done) {
                (true, false) => ("Resume measuring", "Resumes where it was stopped"),
                (true, true) => (
                    "Measure again",
                    "Trains and measures all settings again. The old figures are set aside.",
                ),
                (false, _) if before.is_some() => (
                    "Measure again",
                    "Measures with these settings. The old figures are set aside.",
                ),
                (false, _) => (
                    "Measure",
                    "Trains networks of several shapes and measures time, memory and error of each. Stop at any time; it resumes.",
                ),
            };
            // With figures, the main button is the chosen setting's.
            let is_main = able && ledger.is_none_or(|ledger| ledger.rungs.is_empty());
            let button = ui.add_enabled(able, theme::main_button(is_main, text));
            if button.on_hover_text(hint).on_disabled_hover_text(why).clicked() {
                let kept = ledger.filter(|_| goes_on).map(|ledger| ledger.settings.clone());
                let settings = TradeoffSettings {
                    fresh: goes_on && is_done,
                    ..kept.unwrap_or_else(|| wish.settings(truth))
                };
                let command = AccuracyCommand::Measure(Box::new(settings));
                out.push(Command::Accuracy(command));
            }
        });
        self.wish = (before != Some(wish)).then_some(wish);
    }

    /// The rungs: the search by time or accuracy, the plot, and the chosen rung.
    fn ladder_ui(&mut self, ui: &mut Ui, context: &PanelContext, ledger: &Ledger, out: &mut Vec<Command>) {
        let rungs = &ledger.rungs;
        if rungs.is_empty() {
            return quiet_ui(ui, "Training and measuring the first setting.");
        }
        self.chosen = self.chosen.filter(|&rung| rung < rungs.len());
        let left = ledger.planned.saturating_sub(rungs.len() + ledger.failures.len());
        let mut said = format!("{} compared with {}.", counted(rungs.len(), "setting"), ledger.compared_with);
        if left > 0 {
            said += &format!(" {left} to go.");
        }
        quiet_ui(ui, &said);
        quiet_ui(ui, &ledger.machine.words());
        for failure in &ledger.failures {
            let text = format!("{}: {}", failure.rung, failure.sentence);
            ui.colored_label(theme::WARNING, text);
        }
        let mut asked = None;
        ui.horizontal_wrapped(|ui| {
            ui.label("I have");
            let ms = computing(&mut self.within_ms).range(0.1..=1e5).speed(0.5).suffix(" ms");
            let field = ui.add(ms);
            let mut changed = field.changed();
            if is_reset(ui, &field) {
                (self.within_ms, changed) = (Self::default().within_ms, true);
            }
            field.on_hover_text("Finds the smallest error in this time");
            ui.label("a frame");
            if changed || ui.button("Find").clicked() {
                asked = Some(Pick::Within(self.within_ms));
            }
            ui.separator();
            ui.label("I want at least");
            let db = computing(&mut self.least_db).range(5.0..=80.0).speed(0.1).suffix(" dB");
            let field = ui.add(db);
            let mut changed = field.changed();
            if is_reset(ui, &field) {
                (self.least_db, changed) = (Self::default().least_db, true);
            }
            field.on_hover_text("Finds the fastest setting with this accuracy");
            if changed || ui.button("Find the fastest").clicked() {
                asked = Some(Pick::AtLeast(self.least_db));
            }
        });
        if let Some(asked) = asked {
            self.chosen = pick(rungs, asked);
            if self.chosen.is_none() {
                ui.colored_label(theme::WARNING, words::none(rungs, asked));
            }
        }
        let on_front = front(rungs);
        let height = (ui.available_height() * 0.5).clamp(*PLOT_HEIGHT.start(), *PLOT_HEIGHT.end());
        let plot = plot::Ladder { rungs, on_front: &on_front, chosen: self.chosen, applied: ledger.applied.as_deref() };
        if let Some(pressed) = plot.ui(ui, height) {
            self.chosen = Some(pressed);
        }
        plot::legend_ui(ui, rungs);
        ui.add_space(GAP);
        let best = best(ledger);
        let chosen = self.chosen.or(best);
        if let Some(chosen) = chosen {
            let rung = chosen::Chosen { ledger, rung: &rungs[chosen], best: best.map(|best| &rungs[best]) };
            rung.ui(ui, context, out);
        }
    }
}

impl Wish {
    /// Settings of a stored measurement.
    fn from_ledger(ledger: &Ledger) -> Self {
        let against = match ledger.settings.hold_out {
            Some(pose) => Compared::Pose(pose),
            None => Compared::Best,
        };
        Self { budget: ledger.settings.budget, against }
    }

    fn settings(self, truth: Option<PathBuf>) -> TradeoffSettings {
        let (truth, hold_out) = match self.against {
            Compared::Best => (truth, None),
            Compared::Pose(pose) => (None, Some(pose)),
        };
        TradeoffSettings { truth, hold_out, budget: self.budget, ..TradeoffSettings::default() }
    }

    fn ui(&mut self, ui: &mut Ui, project: &Project, has_truth: bool) {
        let poses = &project.settings.shoot.poses;
        let name = |pose: usize| format!("pose {}", poses.get(pose).map_or("", |name| name));
        let best = if has_truth { "the shoot's truth".to_owned() } else { name(poses.len() / 2) };
        let text = match self.against {
            Compared::Best => best.clone(),
            Compared::Pose(pose) => name(pose),
        };
        let label = ui.label("Compare with");
        let list = ComboBox::from_id_salt("compared").selected_text(text);
        let list = list.show_ui(ui, |ui| {
            ui.selectable_value(&mut self.against, Compared::Best, best);
            for pose in 0..poses.len() {
                ui.selectable_value(&mut self.against, Compared::Pose(pose), name(pose));
            }
        });
        list.response.labelled_by(label.id).on_hover_text("The pose is kept out of training");
        let label = ui.label("Training");
        let minutes = computing(&mut self.budget).range(1.0..=1440.0).speed(1.0).suffix(" min");
        let field = ui.add(minutes).labelled_by(label.id);
        if is_reset(ui, &field) {
            self.budget = TradeoffSettings::default().budget;
        }
        field.on_hover_text("For all networks together");
    }
}

/// The rung with the smallest error.
fn best(ledger: &Ledger) -> Option<usize> {
    pick(&ledger.rungs, Pick::Within(f64::INFINITY))
}

/// Message shown before the first measurement.
fn nothing_ui(ui: &mut Ui) {
    ui.label("Not measured yet.");
    quiet_ui(
        ui,
        "Measure trains several networks on your footage and times each on this machine. Then choose the one that fits your \
         time.",
    );
}

fn quiet_ui(ui: &mut Ui, sentence: &str) {
    ui.label(RichText::new(sentence).color(theme::QUIET));
}
