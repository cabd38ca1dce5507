//! The workspaces, the panes that can be opened, and the layout.

use crate::command::{Command, WindowCommand};
use crate::icons;
use crate::layout::{Pane, Workspace};
use crate::panel_context::PanelContext;
use crate::theme;
use egui::{Button, RichText, Role, Ui, WidgetInfo, vec2};

/// The panel has no state of its own.
#[derive(Default)]
pub struct TabsPanel;

impl TabsPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ui.horizontal_centered(|ui| {
            for (i, workspace) in Workspace::ALL.into_iter().enumerate() {
                let chosen = context.state.workspace == workspace;
                let name = workspace.name();
                let tab = Button::selectable(chosen, name).min_size(vec2(84.0, 24.0));
                let response = ui.add(tab);
                // Panels have buttons of the same names.
                response.widget_info(|| {
                    WidgetInfo::selected(Role::Tab, true, chosen, format!("Workspace {name}"))
                });
                let hint = format!("Key: Ctrl+{}", i + 1);
                if response.on_hover_text(hint).clicked() {
                    out.push(Command::Window(WindowCommand::Workspace(workspace)));
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let menu = ui.menu_button((icons::PANELS, "Panels"), |ui| {
                    for pane in Pane::ALL {
                        let shown = context.shown.contains(&pane);
                        let main = context.state.workspace.main().contains(&pane);
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
                if let Some(project) = context.project {
                    let name = RichText::new(&project.settings.name).color(theme::QUIET);
                    ui.label(name)
                        .on_hover_text(project.root.display().to_string());
                }
            });
        });
    }
}
