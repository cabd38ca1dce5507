//! Performance of this machine: the button that measures it and the report, in a window over the panels.

pub mod command;
mod handler;
pub mod query;

use crate::command::{Command, Dialog, MachineCommand, WindowCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Grid, Label, RichText, ScrollArea, Ui};
use query::Machine;

/// Default time limit of `afterlight device` in minutes.
const MINUTES: f64 = 8.0;

/// Purpose and duration of a measurement.
const OFFER: &str = "Times training, prediction and relighting on GPU and CPU, in less than eight minutes. Figures appear as they are \
     measured; Stop keeps them. Other jobs wait.";

/// Draws the window, and sends a command when it is closed.
pub fn machine_ui(ui: &Ui, context: &PanelContext, machine: &Machine, out: &mut Vec<Command>) {
    let mut open = true;
    egui::Window::new("Performance of this machine")
        .open(&mut open)
        .collapsible(false)
        .default_size([760.0, 520.0])
        .show(ui.ctx(), |ui| {
            ui.add(Label::new(quiet(OFFER)).wrap());
            ui.add_space(GAP);
            buttons_ui(ui, context, machine, out);
            if let Some(report) = &machine.report {
                ui.add_space(GAP);
                ScrollArea::both().auto_shrink(false).show(ui, |ui| markdown_ui(ui, &report.markdown()));
            }
        });
    if !open {
        out.push(Command::Window(WindowCommand::ToggleMachine));
    }
}

fn buttons_ui(ui: &mut Ui, context: &PanelContext, machine: &Machine, out: &mut Vec<Command>) {
    let report = machine.report.as_ref();
    ui.horizontal(|ui| {
        let idle = context.status.job.is_none() && context.session.project.is_some();
        let measure = ui.add_enabled(idle, egui::Button::new("Measure this machine"));
        let measure = measure.on_disabled_hover_text(if context.session.project.is_none() {
            "Open a project first"
        } else {
            "Another job is running: wait until it ends, or stop it"
        });
        if measure.clicked() {
            out.push(Command::Machine(MachineCommand::Measure(MINUTES)));
        }
        let passes = ui.button("Render passes").on_hover_text("Time of each pass, and its switch");
        if passes.clicked() {
            out.push(Command::Window(WindowCommand::ShowPane(Pane::Effects)));
            out.push(Command::Window(WindowCommand::ToggleMachine));
        }
        if ui.add_enabled(report.is_some(), egui::Button::new("Save…")).clicked() {
            out.push(Command::Dialog(Dialog::MachineReport));
        }
        if let Some(report) = report
            && ui.button("Copy").clicked()
        {
            ui.ctx().copy_text(report.markdown());
        }
    });
}

fn quiet(text: &str) -> RichText {
    RichText::new(text).size(12.0).color(theme::QUIET)
}

/// Draws the Markdown of the report: headings, tables, lists and paragraphs.
fn markdown_ui(ui: &mut Ui, text: &str) {
    let mut lines = text.lines().enumerate().peekable();
    while let Some((at, line)) = lines.next() {
        if let Some(title) = line.strip_prefix("## ") {
            ui.add_space(GAP);
            ui.label(RichText::new(title).strong());
        } else if line.starts_with('|') {
            Grid::new(("machine table", at)).striped(true).spacing([2.0 * GAP, 2.0]).show(ui, |ui| {
                row_ui(ui, line, true);
                while let Some((_, line)) = lines.next_if(|(_, line)| line.starts_with('|')) {
                    row_ui(ui, line, false);
                }
            });
            ui.add_space(GAP);
        } else if !line.is_empty() && !line.starts_with("# ") {
            ui.add(Label::new(quiet(&plain(line))).wrap());
        }
    }
}

/// A row of a table. Skips the alignment row under the head.
fn row_ui(ui: &mut Ui, line: &str, head: bool) {
    if line.starts_with("|---") {
        return;
    }
    for cell in line.trim_matches('|').split('|') {
        let cell = plain(cell.trim());
        ui.label(if head { quiet(&cell) } else { RichText::new(cell).size(13.0) });
    }
    ui.end_row();
}

/// Text without the marks of emphasis and code.
fn plain(text: &str) -> String {
    text.replace("**", "").replace('`', "")
}
