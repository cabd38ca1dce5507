//! The read-only notice beside the workspaces, with its reason.

use crate::command::{Command, ProjectCommand};
use crate::icons;
use crate::theme::{self, GAP};
use egui::{Align, Label, Layout, Ui};

/// Short message if another process holds the project's lock; otherwise `why` unchanged.
fn banner(why: &str) -> String {
    let process = why.rsplit_once(", process ").map(|(_, rest)| rest);
    let digits = process.and_then(|rest| rest.split(|c: char| !c.is_ascii_digit()).next());
    match digits.filter(|digits| !digits.is_empty()) {
        Some(process) if why.contains("the studio, process") => {
            format!("Open in another window (process {process}).")
        }
        Some(process) => format!("A job is writing to it (process {process})."),
        None => why.to_owned(),
    }
}

/// Draws the notice from right to left, cut to the room.
pub fn read_only_ui(ui: &mut Ui, why: &str, out: &mut Vec<Command>) {
    let hint = "Reopen the project with write access";
    if ui.button("Try again").on_hover_text(hint).clicked() {
        out.push(Command::Project(ProjectCommand::Reopen));
    }
    // Left to right, so that the text is cut at its end.
    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
        ui.add_space(GAP);
        ui.colored_label(theme::WARNING, icons::LOCK);
        ui.colored_label(theme::WARNING, "Read-only").on_hover_text(why);
        let banner = Label::new(banner(why)).truncate();
        ui.add(banner).on_hover_text(why);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use project::Lock;

    #[test]
    fn the_banner_names_the_process_and_keeps_what_it_cannot_shorten() {
        let folder = tempfile::tempdir().unwrap();
        let _lock = Lock::take(folder.path(), "the studio").unwrap();
        let why = Lock::take(folder.path(), "another").unwrap_err().to_string();
        let expected = format!("Open in another window (process {}).", std::process::id());
        assert_eq!(banner(&why), expected);
        let job = "/film is in use by training, process 7 on desk. Close the project there";
        assert_eq!(banner(job), "A job is writing to it (process 7).");
        let other = "cannot write .lock: Permission denied";
        assert_eq!(banner(other), other);
    }
}
