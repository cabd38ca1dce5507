//! The project: the open one, recent ones, and the way to a new one.

mod parts;
mod wizard;

use super::TEXT_WIDTH;
use crate::command::{Command, Dialog, ProjectCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::recents::Recent;
use crate::theme::{self, GAP};
use crate::wizard::typed;
use base::files::shown;
use egui::{Button, Color32, Label, RichText, ScrollArea, Sense, TextEdit, Ui, vec2};
use footage::scan::counted;
use project::Project;

/// Holds the folder typed for the demo.
pub struct ProjectPanel {
    demo: String,
}

impl Default for ProjectPanel {
    fn default() -> Self {
        Self {
            demo: "~/afterlight-demo".to_owned(),
        }
    }
}

impl ProjectPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::PANEL);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let width = (1.4 * TEXT_WIDTH).min(ui.available_width() - 4.0 * GAP);
            let side = 0.5 * (ui.available_width() - width);
            ui.horizontal_top(|ui| {
                ui.add_space(side);
                ui.vertical(|ui| {
                    ui.set_width(width);
                    ui.add_space(3.0 * GAP);
                    self.column_ui(ui, context, out);
                    ui.add_space(2.0 * GAP);
                });
            });
        });
    }

    fn column_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        if let Some(refusal) = &context.status.refusal {
            super::refusal_ui(ui, refusal, out);
            ui.add_space(GAP);
        }
        // With a project open, the window shows the job in a line of its own.
        if let (Some(job), None) = (&context.status.job, context.project) {
            return super::job_ui(ui, job, out);
        }
        if let (Some(said), None) = (&context.status.message, context.project) {
            ui.label(said);
            ui.add_space(GAP);
        }
        if let Some(plan) = context.wizard.plan() {
            return wizard::plan_ui(ui, context, plan, out);
        }
        match context.project {
            Some(project) => open_ui(ui, context, project),
            None => {
                ui.heading("No project is open");
                quiet_ui(
                    ui,
                    "A project is a folder that refers to a shoot: the interview, a few poses under every lamp, \
                     and the mirror balls. The shoot itself is never changed or copied.",
                );
            }
        }
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            for (icon, words, command) in [
                (
                    icons::ADD,
                    "New project…",
                    Command::Project(ProjectCommand::New(None)),
                ),
                (
                    icons::FOLDER,
                    "Open project…",
                    Command::Dialog(Dialog::Project),
                ),
            ] {
                let button = Button::new((icon, words)).min_size(vec2(132.0, 28.0));
                if icons::named_ui(ui, true, button, words).clicked() {
                    out.push(command);
                }
            }
            quiet_ui(ui, "or drop a shoot's or a project's folder anywhere");
        });
        ui.add_space(2.0 * GAP);
        recent_ui(ui, context, out);
        if context.project.is_none() {
            ui.add_space(2.0 * GAP);
            self.demo_ui(ui, out);
        }
    }

    fn demo_ui(&mut self, ui: &mut Ui, out: &mut Vec<Command>) {
        ui.strong("Demo");
        quiet_ui(
            ui,
            "No shoot of your own? A virtual light stage makes one, and the project opens with a trained \
             network. This takes a few minutes and 20 MB.",
        );
        ui.horizontal(|ui| {
            let label = ui.label("Folder");
            let field = TextEdit::singleline(&mut self.demo).desired_width(360.0);
            ui.add(field).labelled_by(label.id);
            let folder = typed(&self.demo);
            let make = ui.add_enabled(folder.is_some(), Button::new("Make the demo"));
            if let (true, Some(folder)) = (make.clicked(), folder) {
                out.push(Command::Project(ProjectCommand::MakeDemo(folder)));
            }
        });
    }
}

fn quiet_ui(ui: &mut Ui, sentence: &str) {
    ui.label(RichText::new(sentence).color(theme::QUIET));
}

/// The open project.
fn open_ui(ui: &mut Ui, context: &PanelContext, project: &Project) {
    let (settings, shoot) = (&project.settings, &project.settings.shoot);
    ui.heading(&settings.name);
    quiet_ui(ui, &shown(&project.root));
    ui.label(format!(
        "{} at {} fps, {} × {}, working size {} pixels",
        counted(shoot.frames.len(), "frame"),
        shoot.frame_rate,
        counted(shoot.poses.len(), "pose"),
        counted(shoot.lamps.len(), "lamp"),
        settings.size
    ));
    quiet_ui(ui, &format!("Shoot: {}", shown(&project.shoot_path(""))));
    quiet_ui(
        ui,
        match context.read_only {
            Some(_) => "Nothing is saved: this project is open for writing elsewhere",
            None => "Everything is saved as you work",
        },
    );
}

fn recent_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    ui.strong("Recent");
    let open = context.project.map(|project| &project.root);
    let others = context.recents.iter();
    let mut others = others
        .filter(|recent| Some(&recent.folder) != open)
        .peekable();
    if others.peek().is_none() {
        quiet_ui(ui, "No other recent projects");
    }
    for recent in others {
        row_ui(ui, recent, out);
    }
}

fn row_ui(ui: &mut Ui, recent: &Recent, out: &mut Vec<Command>) {
    let frame = egui::Frame::new()
        .fill(Color32::from_gray(46))
        .corner_radius(3)
        .inner_margin(GAP);
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.horizontal(|ui| {
            let room = ui.available_width() - 160.0;
            ui.vertical(|ui| {
                ui.set_width(room);
                ui.strong(&recent.name);
                let folder = RichText::new(shown(&recent.folder));
                let folder = folder.color(theme::QUIET).size(12.0);
                ui.add(Label::new(folder).truncate().sense(Sense::hover()));
                if let Some(trouble) = &recent.trouble {
                    ui.colored_label(theme::WARNING, trouble);
                }
            });
            let name = &recent.name;
            let button = |ui: &mut Ui, text: &str, enabled: bool| {
                let response = ui.add_enabled(enabled, Button::new(text));
                response.widget_info(|| {
                    egui::WidgetInfo::labeled(egui::Role::Button, enabled, format!("{text} {name}"))
                });
                response
            };
            if button(ui, "Open", recent.trouble.is_none()).clicked() {
                out.push(Command::Project(ProjectCommand::Open(
                    recent.folder.clone(),
                )));
            }
            let hint = "Removes it from this list. Nothing on disk changes.";
            if button(ui, "Remove", true).on_hover_text(hint).clicked() {
                out.push(Command::Project(ProjectCommand::Forget(
                    recent.folder.clone(),
                )));
            }
        });
    });
}
