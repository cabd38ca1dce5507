//! The list of shortcuts, over the picture.

use super::{Listed, listed};
use crate::command::{Command, JobCommand, LookCommand, ViewCommand, WindowCommand};
use crate::layout::Pane;
use crate::theme;

/// Tasks in the order of the list. The first has the keys of the active pane alone.
const TASKS: [&str; 6] = ["This panel", "Project", "Clip", "Light", "Picture", "Window"];
const COLUMNS: usize = 3;
/// Mouse actions.
const GESTURES: &[(&str, &str)] = &[
    ("Drag, Ctrl+drag", "Turn the light"),
    ("Shift+right-drag", "Turn the light"),
    ("Wheel", "Zoom about the cursor"),
    ("Middle-drag", "Move the picture"),
    ("Ctrl+Shift+drag", "Average a region; a click ends it"),
    ("Double-click a number", "Reset it"),
    ("Arrows on a light's dot", "Move it; Shift: by 10°"),
    ("Delete on a key or light", "Remove it"),
    ("Double-click a lane", "Set a key there"),
    ("Ctrl+wheel on the timeline", "Zoom; wheel, middle-drag: move"),
    ("F over the timeline", "Show all frames"),
    ("Shift", "Finer drags; peek at the other picture"),
];

/// The list of shortcuts, over the picture.
pub fn overlay_ui(ui: &egui::Ui, pane: Pane, out: &mut Vec<Command>) {
    let frame = egui::Frame::window(ui.style()).inner_margin(3.0 * theme::GAP);
    let area = egui::Modal::new(egui::Id::unique("keys")).frame(frame).show(ui.ctx(), |ui| {
        ui.heading("Keys");
        ui.add_space(theme::GAP);
        ui.horizontal_top(|ui| {
            // Rows without buttons may be lower.
            ui.spacing_mut().interact_size.y = 0.0;
            for column in columns(groups(listed(ui.ctx(), pane))) {
                ui.vertical(|ui| {
                    for (task, rows) in column {
                        ui.strong(task);
                        list_ui(ui, task, &rows);
                        ui.add_space(theme::GAP);
                    }
                });
                ui.add_space(2.0 * theme::GAP);
            }
        });
        ui.add_space(theme::GAP);
        ui.button("Close").clicked()
    });
    if area.inner || area.should_close() {
        out.push(Command::Window(WindowCommand::ToggleKeys));
    }
}

/// Keys, or mouse actions, and their labels.
type Rows = Vec<(String, &'static str)>;

/// Rows of each task, and of the mouse; tasks without keys are left out.
fn groups(listed: Vec<Listed>) -> Vec<(&'static str, Rows)> {
    let mut groups: Vec<(&str, Rows)> = TASKS.iter().map(|task| (*task, Vec::new())).collect();
    for one in listed.into_iter().filter(|one| !one.key.is_empty()) {
        let task = task(&one);
        if let Some((_, rows)) = groups.iter_mut().find(|(of, _)| *of == task) {
            rows.push((one.key, one.label));
        }
    }
    groups.push(("Mouse", GESTURES.iter().map(|&(how, label)| (how.to_owned(), label)).collect()));
    groups.retain(|(_, rows)| !rows.is_empty());
    groups
}

/// The task of a key: one of [`TASKS`].
fn task(listed: &Listed) -> &'static str {
    use ViewCommand as V;
    match &listed.command {
        _ if listed.is_of_pane => TASKS[0],
        Command::Project(_)
        | Command::Dialog(_)
        | Command::Look(LookCommand::Undo | LookCommand::Redo)
        | Command::Job(JobCommand::Pause)
        | Command::Window(WindowCommand::TellSaved | WindowCommand::TogglePalette) => "Project",
        Command::Timeline(_)
        | Command::Look(LookCommand::ToggleKey(_))
        | Command::View(
            V::TogglePlay | V::ToggleLoop | V::MarkIn | V::MarkOut | V::StepFrame(_) | V::Frame(_) | V::LastFrame,
        ) => "Clip",
        Command::Lights(_) | Command::Environments(_) | Command::Aim(_) | Command::View(V::StepSolo(_)) => "Light",
        Command::View(_) | Command::Looks(_) | Command::Window(WindowCommand::ActualSize) => "Picture",
        _ => "Window",
    }
}

/// Groups in columns of similar height, in their order.
fn columns(groups: Vec<(&'static str, Rows)>) -> Vec<Vec<(&'static str, Rows)>> {
    // A heading and its gap take about as much room as two rows.
    let height = |rows: &Rows| rows.len() + 2;
    let all: usize = groups.iter().map(|(_, rows)| height(rows)).sum();
    let mut columns: Vec<Vec<_>> = (0..COLUMNS).map(|_| Vec::new()).collect();
    let mut above = 0;
    for group in groups {
        let middle = above + height(&group.1) / 2;
        above += height(&group.1);
        columns[(middle * COLUMNS / all.max(1)).min(COLUMNS - 1)].push(group);
    }
    columns
}

fn list_ui(ui: &mut egui::Ui, id: &str, rows: &[(String, &str)]) {
    egui::Grid::new(id).num_columns(2).spacing([theme::GAP * 2.0, 4.0]).show(ui, |ui| {
        for (how, label) in rows {
            ui.label(how);
            ui.label(egui::RichText::new(*label).color(theme::QUIET));
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_stands_under_its_task_once() {
        let ctx = egui::Context::default();
        for pane in [Pane::Picture, Pane::Gamma, Pane::Timeline] {
            let keys = || listed(&ctx, pane).into_iter().filter(|one| !one.key.is_empty());
            let groups = groups(listed(&ctx, pane));
            assert_eq!(groups[0].0 == TASKS[0], keys().any(|one| one.is_of_pane), "{pane:?}");
            for task in &TASKS[1..] {
                assert!(groups.iter().any(|(of, rows)| of == task && rows.len() > 1), "{task}");
            }
            let rows: usize = groups.iter().map(|(_, rows)| rows.len()).sum();
            assert_eq!(rows, keys().count() + GESTURES.len());
            let columns = columns(groups);
            assert!(columns.iter().all(|column| !column.is_empty()));
        }
    }
}
