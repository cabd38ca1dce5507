//! A typed path, beside the system's file dialog or in place of it.

use crate::command::{Command, WindowCommand};
use crate::panels::project::plan::typed;
use crate::state::{PathEntry, Wanted};
use crate::theme::{self, GAP};
use base::error::Result;
use base::files;
use egui::text::{CCursor, CCursorRange};
use egui::{Frame, Id, Key, Modal, Role, ScrollArea, TextEdit, Ui, WidgetInfo, text_edit::TextEditState};
use std::path::Path;
use worker::Query;

/// Most names offered.
const MOST: usize = 200;

/// A lookup in a folder: the typed text, and whether files are offered too.
#[derive(Clone, Debug, PartialEq)]
struct Begun {
    text: String,
    files: bool,
}

/// The field, and the names that can complete it.
#[derive(Default)]
pub struct PathPanel {
    text: String,
    /// Entry for which the text was started; each dialog starts its own.
    of: Option<PathEntry>,
    query: Query<Begun, Vec<String>>,
    found: Vec<String>,
}

impl PathPanel {
    /// True if the text was started for this entry.
    fn is_of(&self, entry: &PathEntry) -> bool {
        let same = |of: &PathEntry| (of.number, of.fills) == (entry.number, entry.fills);
        self.of.as_ref().is_some_and(same)
    }

    /// True if something was typed or dropped into the field of this entry.
    pub fn is_typed(&self, entry: &PathEntry) -> bool {
        entry.fills > 0 || self.is_of(entry) && self.text != entry.begun
    }

    pub fn ui(&mut self, ui: &Ui, entry: &PathEntry, out: &mut Vec<Command>) {
        if !self.is_of(entry) {
            (self.text, self.of) = (entry.begun.clone(), Some(entry.clone()));
        }
        self.ask(ui.ctx(), entry.wanted != Wanted::Folder);
        let frame = Frame::window(ui.style()).inner_margin(1.5 * GAP);
        let modal = Modal::new(Id::unique("path")).frame(frame);
        let shown = modal.show(ui.ctx(), |ui| {
            ui.set_width(520.0);
            ui.strong(entry.title);
            match &entry.missing {
                Some(why) => {
                    ui.colored_label(theme::WARNING, why);
                    ui.label("Type a path, or drop it onto the window.");
                }
                None => {
                    ui.label("Choose it in the system's dialog, type a path, or drop it here.");
                }
            }
            ui.add_space(GAP);
            self.field_ui(ui, entry)
        });
        let dismissed = shown.should_close();
        let (path, closed) = shown.inner;
        if let Some(path) = path {
            out.push(match entry.wanted {
                // The window asks before it replaces a file.
                Wanted::NewFile => Command::NewFile(entry.dialog, path),
                _ => Command::Chosen(entry.dialog, vec![path]),
            });
        } else if closed || dismissed {
            out.push(Command::Window(WindowCommand::ClosePath));
        }
        if let Some(file) = &entry.existing {
            replace_ui(ui, file, entry, out);
        }
    }

    /// The field and its buttons. Returns the path once confirmed, and whether the entry was cancelled.
    fn field_ui(&mut self, ui: &mut Ui, entry: &PathEntry) -> (Option<std::path::PathBuf>, bool) {
        let id = Id::unique("typed path");
        let complete = ui.memory(|memory| memory.has_focus(id)) && ui.input(|input| input.key_pressed(Key::Tab));
        if complete {
            self.text = completed(&self.text, &self.found);
            to_the_end(ui, id, &self.text);
        }
        let field = TextEdit::singleline(&mut self.text)
            .id(id)
            .hint_text("/path/to/it, or ~/…; Tab completes")
            .lock_focus(true)
            .desired_width(f32::INFINITY);
        let response = ui.add(field);
        response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Path"));
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if entry.existing.is_some() {
            // The confirmation takes the keys.
            response.surrender_focus();
        } else if ui.memory(|memory| memory.focused().is_none()) {
            response.request_focus();
        }
        ScrollArea::vertical().max_height(160.0).min_scrolled_height(160.0).auto_shrink(false).show(ui, |ui| {
            for name in &self.found {
                if ui.selectable_label(false, name).clicked() {
                    self.text = format!("{}{name}", folder_of(&self.text));
                    to_the_end(ui, id, &self.text);
                    ui.memory_mut(|memory| memory.request_focus(id));
                    break;
                }
            }
        });
        let path = typed(&self.text);
        let does = match entry.wanted {
            Wanted::Folder | Wanted::Files => "Use this path",
            Wanted::NewFile => "Write here",
        };
        ui.horizontal(|ui| {
            let use_it = theme::main_button(path.is_some(), does);
            let used = ui.add_enabled(path.is_some(), use_it).clicked() || entered;
            let closed = ui.button("Cancel").clicked();
            (path.filter(|_| used), closed)
        })
        .inner
    }

    /// Looks up the names in the typed folder.
    fn ask(&mut self, ctx: &egui::Context, files: bool) {
        let begun = Begun { text: self.text.clone(), files };
        let ctx = ctx.clone();
        if self.query.ask(begun.clone(), move || ctx.request_repaint(), |_| names) {
            self.found.clear();
        }
        for (_, found) in self.query.answers().filter(|(key, _)| *key == begun) {
            // An unreadable folder offers no names.
            self.found = found.unwrap_or_default();
        }
    }
}

/// Asks whether to replace a file.
fn replace_ui(ui: &Ui, file: &Path, entry: &PathEntry, out: &mut Vec<Command>) {
    let frame = Frame::window(ui.style()).inner_margin(2.0 * GAP);
    let asked = Modal::new(Id::unique("replace")).frame(frame);
    let shown = asked.show(ui.ctx(), |ui| {
        ui.set_width(420.0);
        ui.heading("Replace the file?");
        ui.add_space(GAP);
        ui.label(format!("{} already exists.", files::shown(file)));
        ui.add_space(2.0 * GAP);
        ui.horizontal(|ui| {
            let keep = theme::main_button(true, "Keep it");
            let keep = ui.add(keep).clicked();
            if ui.button("Replace").clicked() {
                out.push(Command::Chosen(entry.dialog, vec![file.to_path_buf()]));
            }
            keep
        })
        .inner
    });
    if shown.inner || shown.should_close() {
        out.push(Command::Window(WindowCommand::KeepName));
    }
}

/// Moves the cursor to the end of the text.
fn to_the_end(ui: &Ui, id: Id, text: &str) {
    let mut state = TextEditState::load(ui.ctx(), id).unwrap_or_default();
    let end = CCursorRange::one(CCursor::new(text.chars().count()));
    state.cursor.set_char_range(Some(end));
    state.store(ui.ctx(), id);
}

/// The typed text up to the last folder, with its slash.
fn folder_of(text: &str) -> &str {
    text.rfind(std::path::is_separator).map_or("", |slash| &text[..=slash])
}

/// Sorted names in the typed folder that start with the typed part; folders end with a slash.
fn names(begun: &Begun) -> Result<Vec<String>> {
    let folder = folder_of(&begun.text);
    let part = &begun.text[folder.len()..];
    let Some(place) = typed(folder).filter(|place| place.is_absolute()) else { return Ok(Vec::new()) };
    let Ok(entries) = std::fs::read_dir(&place) else { return Ok(Vec::new()) };
    let mut found: Vec<String> = entries
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| name.starts_with(part) && (part.starts_with('.') || !name.starts_with('.')))
        .collect();
    found.sort_by(|a, b| base::files::natural_order(a, b));
    let mut shown = Vec::new();
    for name in found {
        match Path::new(&place).join(&name).is_dir() {
            true => shown.push(name + "/"),
            false if begun.files => shown.push(name),
            false => {}
        }
        if shown.len() == MOST {
            break;
        }
    }
    Ok(shown)
}

/// The text, completed with the prefix that all names share.
fn completed(text: &str, names: &[String]) -> String {
    let Some(first) = names.first() else { return text.to_owned() };
    let common = names.iter().skip(1).fold(first.as_str(), |common, name| {
        let same = common.chars().zip(name.chars()).take_while(|(a, b)| a == b);
        let length: usize = same.map(|(a, _)| a.len_utf8()).sum();
        &common[..length]
    });
    format!("{}{common}", folder_of(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_completed_as_far_as_it_is_clear() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["shoot one", "shoot two", ".hidden"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        std::fs::write(folder.path().join("sky.exr"), "").unwrap();
        let typed = |end: &str| format!("{}/{end}", folder.path().display());
        let found = |end: &str, files| names(&Begun { text: typed(end), files }).unwrap();
        assert_eq!(found("", true), ["shoot one/", "shoot two/", "sky.exr"]);
        assert_eq!(found("s", false), ["shoot one/", "shoot two/"]);
        assert_eq!(found(".", false), [".hidden/"]);
        assert_eq!(completed(&typed("s"), &found("s", false)), typed("shoot "));
        let clear = completed(&typed("shoot t"), &found("shoot t", false));
        assert_eq!(clear, typed("shoot two/"));
        assert_eq!(completed(&typed("no"), &found("no", true)), typed("no"));
        assert!(found("no/such/", true).is_empty());
        let relative = Begun { text: "no".to_owned(), files: true };
        assert!(names(&relative).unwrap().is_empty());
        assert_eq!(completed("ä", &["äö".to_owned(), "äü".to_owned()]), "ä");
    }
}
