//! The project page: the open project, recent ones, and the start of a new one.

mod cards;
pub mod command;
mod handler;
mod hero;
mod parts;
pub mod picker;
pub mod plan;
pub mod recents;
mod traced;
mod wizard;

use crate::command::{Command, Dialog, ProjectCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::job::whole_job_ui;
use crate::panels::project::plan::typed;
use crate::panels::widgets::notice::{TEXT_WIDTH, quiet_ui, refusal_ui};
use crate::theme::{self, GAP};
use base::files::shown;
use egui::{Button, ScrollArea, TextEdit, Ui, vec2};
use footage::scan::counted;
use hero::Hero;
use project::Project;
use traced::Traced;

/// Holds the folder typed for the demo, the picture of the start page, and that of a demo being made.
pub struct ProjectPanel {
    demo: String,
    hero: Hero,
    traced: Traced,
}

impl Default for ProjectPanel {
    fn default() -> Self {
        Self { demo: "~/afterlight-demo".to_owned(), hero: Hero::default(), traced: Traced::default() }
    }
}

impl ProjectPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::PANEL);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let is_start = is_start(context);
            let most = if is_start { 2.1 } else { 1.4 } * TEXT_WIDTH;
            let width = most.min(ui.available_width() - 4.0 * GAP);
            let side = 0.5 * (ui.available_width() - width);
            ui.horizontal_top(|ui| {
                ui.add_space(side);
                ui.vertical(|ui| {
                    ui.set_width(width);
                    ui.add_space(if is_start { 2.0 * GAP } else { 3.0 * GAP });
                    if is_start {
                        self.hero.ui(ui, 0.28 * rect.height());
                        ui.add_space(2.0 * GAP);
                    }
                    self.column_ui(ui, context, 0.6 * rect.height(), out);
                    ui.add_space(2.0 * GAP);
                });
            });
        });
    }

    /// Draws the page; the picture of a demo being made is at most `height` points high.
    fn column_ui(&mut self, ui: &mut Ui, context: &PanelContext, height: f32, out: &mut Vec<Command>) {
        if let Some(refusal) = &context.status.refusal {
            refusal_ui(ui, refusal, out);
            ui.add_space(GAP);
        }
        if context.session.project.is_some() || context.picker.wizard.plan().is_some() {
            self.traced = Traced::default();
        }
        // With a project open, the window shows the job in a line of its own.
        if let (Some(job), None) = (&context.status.job, context.session.project) {
            whole_job_ui(ui, job, out);
            ui.add_space(2.0 * GAP);
            return self.traced.ui(ui, height);
        }
        if let (Some(said), None) = (&context.status.message, context.session.project) {
            ui.label(said);
            ui.add_space(GAP);
        }
        if let Some(plan) = context.picker.wizard.plan() {
            return wizard::plan_ui(ui, context, plan, out);
        }
        match context.session.project {
            Some(project) => open_ui(ui, context, project),
            None => {
                ui.heading("No project is open");
                quiet_ui(
                    ui,
                    "A project refers to a shoot: the interview, a few poses under every lamp, and mirror balls. \
                     The shoot is never changed or copied.",
                );
            }
        }
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            for (icon, words, command) in [
                (icons::ADD, "New project…", Command::Project(ProjectCommand::New(None))),
                (icons::FOLDER, "Open project…", Command::Dialog(Dialog::Project)),
            ] {
                let main = icon == icons::ADD && context.session.project.is_none();
                let button =
                    if main { theme::main_button(true, format!("{icon} {words}")) } else { Button::new((icon, words)) }
                        .min_size(vec2(132.0, 28.0));
                if icons::named_ui(ui, true, button, words).clicked() {
                    out.push(command);
                }
            }
            quiet_ui(ui, "or drop a shoot's or a project's folder anywhere");
        });
        ui.add_space(2.0 * GAP);
        cards::recent_ui(ui, context, out);
        if context.session.project.is_none() {
            ui.add_space(2.0 * GAP);
            self.demo_ui(ui, out);
        }
    }

    fn demo_ui(&mut self, ui: &mut Ui, out: &mut Vec<Command>) {
        ui.strong("Demo");
        quiet_ui(ui, "No shoot of your own? The demo makes one in a few minutes and 20 MB, ready to be relit.");
        ui.horizontal(|ui| {
            let label = ui.label("Folder");
            let field = TextEdit::singleline(&mut self.demo).desired_width(360.0);
            ui.add(field).labelled_by(label.id);
            let folder = typed(&self.demo);
            let make = ui.add_enabled(folder.is_some(), Button::new("Make the demo"));
            if let (true, Some(folder)) = (make.clicked(), folder) {
                self.traced = Traced::from_folder(folder.clone());
                out.push(Command::Project(ProjectCommand::MakeDemo(folder)));
            }
        });
    }
}

/// True for the start page: no project, no plan for one, and no job that makes one.
fn is_start(context: &PanelContext) -> bool {
    context.session.project.is_none() && context.picker.wizard.plan().is_none() && context.status.job.is_none()
}

/// The open project.
fn open_ui(ui: &mut Ui, context: &PanelContext, project: &Project) {
    let (settings, shoot) = (&project.settings, &project.settings.shoot);
    ui.heading(&settings.name);
    quiet_ui(ui, &shown(&project.root));
    ui.label(format!(
        "{} at {} fps, {} × {}, working size {} pixels",
        counted(shoot.frames.len(), "frame"),
        (1e3 * shoot.frame_rate).round() / 1e3,
        counted(shoot.poses.len(), "pose"),
        counted(shoot.lamps.len(), "lamp"),
        settings.size
    ));
    quiet_ui(ui, &format!("Shoot: {}", shown(&project.shoot_path(""))));
    quiet_ui(
        ui,
        match context.session.read_only {
            Some(_) => "Read-only: nothing is saved",
            None => "Everything is saved as you work",
        },
    );
}
