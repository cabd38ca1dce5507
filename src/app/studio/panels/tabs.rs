//! The workspaces, the panes that can be opened, and the layout.

use crate::command::{Command, Dialog, ExportCommand, LookCommand, ProjectCommand, WindowCommand};
use crate::icons;
use crate::layout::{Pane, Workspace};
use crate::panel_context::PanelContext;
use crate::panels::read_only::read_only_ui;
use crate::theme;
use base::files::shown;
use egui::{Button, Image, RichText, Role, Ui, Vec2, WidgetInfo, vec2};

/// Most width and height in points of a project's first frame in the menu.
const ENTRY: Vec2 = vec2(64.0, 36.0);

/// The panel has no state of its own.
#[derive(Default)]
pub struct TabsPanel;

/// The project menu: the project's name, and the commands for projects.
fn project_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let Some(project) = context.session.project else { return };
    let menu = ui.menu_button(RichText::new(&project.settings.name), |ui| {
        ui.label(RichText::new(shown(&project.root)).size(12.0).color(theme::QUIET));
        ui.separator();
        if ui.button("New project…").clicked() {
            out.push(Command::Project(ProjectCommand::New(None)));
        }
        if ui.button("Open project…").clicked() {
            out.push(Command::Dialog(Dialog::Project));
        }
        if ui.button("Show in the file manager").clicked() {
            let root = project.root.clone();
            out.push(Command::Export(ExportCommand::OpenFolder(root)));
        }
        let others = context.picker.recents.list().iter();
        let others = others.filter(|recent| recent.folder != project.root);
        for (place, recent) in others.enumerate() {
            if place == 0 {
                ui.separator();
            }
            let entry = match context.picker.recents.thumbnail(&recent.folder) {
                Some(first) => {
                    let size = first.size_vec2();
                    let size = size * (ENTRY / size.max(Vec2::splat(1.0))).min_elem();
                    Button::new((Image::new((first.id(), size)), recent.name.as_str()))
                }
                None => Button::new(&recent.name),
            };
            let entry = ui.add_enabled(recent.trouble.is_none(), entry);
            entry.widget_info(|| WidgetInfo::labeled(Role::Button, true, &recent.name));
            let hint = recent.trouble.clone().unwrap_or(shown(&recent.folder));
            let entry = entry.on_hover_text(&hint).on_disabled_hover_text(&hint);
            if entry.clicked() {
                let folder = recent.folder.clone();
                out.push(Command::Project(ProjectCommand::Open(folder)));
            }
        }
    });
    (menu.response).widget_info(|| WidgetInfo::labeled(Role::Button, true, "Project"));
}

/// Undo and redo of settings, from the right.
fn undo_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let (undo, redo) = (context.state.can_undo(), context.state.can_redo());
    for (icon, name, can, key, command) in [
        (icons::REDO, "Redo", redo, "Ctrl+Shift+Z", Command::Look(LookCommand::Redo)),
        (icons::UNDO, "Undo", undo, "Ctrl+Z", Command::Look(LookCommand::Undo)),
    ] {
        if icons::named_ui(ui, can, icons::alone(icon), name).on_hover_text(format!("{name}. Key: {key}")).clicked() {
            out.push(command);
        }
    }
}

impl TabsPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ui.horizontal_centered(|ui| {
            for (i, workspace) in Workspace::ALL.into_iter().enumerate() {
                let chosen = context.state.panes.workspace == workspace;
                let name = workspace.name();
                let icon = match workspace {
                    Workspace::Calibrate => icons::CALIBRATE,
                    Workspace::Train => icons::TRAIN,
                    Workspace::Relight => icons::RELIGHT,
                    Workspace::Review => icons::REVIEW,
                    Workspace::Export => icons::EXPORT,
                };
                let tab = Button::selectable(chosen, (icon, name)).min_size(vec2(96.0, 24.0));
                let response = ui.add(tab);
                // Distinguished from buttons in panels with the same names.
                response.widget_info(|| WidgetInfo::selected(Role::Tab, true, chosen, format!("Workspace {name}")));
                let hint = format!("Key: Ctrl+{}", i + 1);
                if response.on_hover_text(hint).clicked() {
                    out.push(Command::Window(WindowCommand::Workspace(workspace)));
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let menu = ui.menu_button((icons::PANELS, "Panels"), |ui| {
                    for pane in Pane::ALL {
                        let shown = context.shows(pane);
                        let main = context.state.panes.workspace.main().contains(&pane);
                        let entry = Button::selectable(shown, pane.name());
                        if ui.add_enabled(!(main && shown), entry).clicked() {
                            out.push(if shown {
                                Command::Window(WindowCommand::ClosePane(pane))
                            } else {
                                Command::Window(WindowCommand::ShowPane(pane))
                            });
                        }
                    }
                    ui.separator();
                    if ui.button("Reset layout").clicked() {
                        out.push(Command::Window(WindowCommand::ResetLayout));
                    }
                });
                (menu.response).widget_info(|| WidgetInfo::labeled(Role::Button, true, "Panels"));
                project_ui(ui, context, out);
                undo_ui(ui, context, out);
                if let Some(why) = context.session.read_only {
                    read_only_ui(ui, why, out);
                }
            });
        });
    }
}
