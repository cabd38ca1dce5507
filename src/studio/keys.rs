//! The keys: one table that the window obeys and shows.

use super::command::Command;
use super::theme;
use egui::{Key, KeyboardShortcut, Modifiers};

/// A key, what it does, and how the list of keys calls it.
struct Binding {
    shortcut: KeyboardShortcut,
    command: Command,
    says: &'static str,
}

const fn on(modifiers: Modifiers, key: Key, command: Command, says: &'static str) -> Binding {
    Binding {
        shortcut: KeyboardShortcut::new(modifiers, key),
        command,
        says,
    }
}

/// Bindings that ask for more modifiers come first: egui takes Shift+E for E otherwise.
const BINDINGS: &[Binding] = &[
    on(
        Modifiers::NONE,
        Key::Space,
        Command::TogglePlay,
        "play and stop",
    ),
    on(
        Modifiers::ALT,
        Key::ArrowRight,
        Command::StepEnvironment(1),
        "next environment",
    ),
    on(
        Modifiers::ALT,
        Key::ArrowLeft,
        Command::StepEnvironment(-1),
        "previous environment",
    ),
    on(
        Modifiers::NONE,
        Key::ArrowRight,
        Command::StepFrame(1),
        "next frame",
    ),
    on(
        Modifiers::NONE,
        Key::ArrowLeft,
        Command::StepFrame(-1),
        "previous frame",
    ),
    on(Modifiers::NONE, Key::Home, Command::Frame(0), "first frame"),
    on(Modifiers::NONE, Key::End, Command::LastFrame, "last frame"),
    on(
        Modifiers::SHIFT,
        Key::E,
        Command::StepExposure(-0.5),
        "darker by half a stop",
    ),
    on(
        Modifiers::NONE,
        Key::E,
        Command::StepExposure(0.5),
        "brighter by half a stop",
    ),
    on(
        Modifiers::NONE,
        Key::P,
        Command::PauseJob,
        "pause the job, go on",
    ),
    on(Modifiers::NONE, Key::F, Command::Fit, "fit the picture"),
    on(
        Modifiers::COMMAND,
        Key::R,
        Command::ResetView,
        "reset zoom and exposure",
    ),
    on(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::Z,
        Command::Redo,
        "redo",
    ),
    on(Modifiers::COMMAND, Key::Z, Command::Undo, "undo"),
    on(
        Modifiers::NONE,
        Key::Tab,
        Command::TogglePanels,
        "hide and show the panels",
    ),
    on(
        Modifiers::NONE,
        Key::F11,
        Command::ToggleFullScreen,
        "full screen",
    ),
    on(
        Modifiers::NONE,
        Key::Questionmark,
        Command::ToggleKeys,
        "these keys",
    ),
    on(
        Modifiers::NONE,
        Key::Escape,
        Command::Dismiss,
        "close what covers the picture",
    ),
];

/// What the mouse does in the viewport.
const GESTURES: &[(&str, &str)] = &[
    ("Drag, Ctrl+drag", "turn the light"),
    ("Shift+right-drag", "turn the light"),
    ("Wheel", "zoom about the cursor"),
    ("Middle-drag", "move the picture"),
    ("Double-click a number", "reset it"),
    ("Shift", "finer drags"),
];

/// The commands of the keys that were pressed since the last frame.
pub fn pressed(ctx: &egui::Context, out: &mut Vec<Command>) {
    if ctx.text_edit_focused() {
        return;
    }
    ctx.input_mut(|input| {
        for Binding {
            shortcut, command, ..
        } in BINDINGS
        {
            // A question mark is typed with Shift on many keyboards, and means the same on all.
            let pressed = match shortcut.logical_key {
                Key::Questionmark => {
                    input.consume_key(Modifiers::SHIFT, Key::Questionmark)
                        || input.consume_shortcut(shortcut)
                }
                _ => input.consume_shortcut(shortcut),
            };
            if pressed {
                out.push(command.clone());
            }
        }
    });
    if out.contains(&Command::TogglePanels) {
        // egui moves the focus with the same key.
        ctx.memory_mut(|memory| memory.move_focus(egui::FocusDirection::None));
    }
}

/// The list of keys, over the picture.
pub fn overlay_ui(ui: &egui::Ui, out: &mut Vec<Command>) {
    let frame = egui::Frame::window(ui.style()).inner_margin(3.0 * theme::GAP);
    let area = egui::Modal::new(egui::Id::unique("keys"))
        .frame(frame)
        .show(ui.ctx(), |ui| {
            ui.heading("Keys");
            ui.add_space(theme::GAP);
            ui.horizontal_top(|ui| {
                // Rows of text alone need no room for buttons.
                ui.spacing_mut().interact_size.y = 0.0;
                let name = |b: &Binding| match b.shortcut.logical_key {
                    Key::Questionmark => "?".to_owned(),
                    _ => ui.ctx().format_shortcut(&b.shortcut),
                };
                let keys: Vec<_> = BINDINGS.iter().map(|b| (name(b), b.says)).collect();
                list_ui(ui, "keyboard", &keys);
                ui.add_space(theme::GAP * 3.0);
                let gestures: Vec<_> = GESTURES
                    .iter()
                    .map(|&(how, says)| (how.to_owned(), says))
                    .collect();
                list_ui(ui, "mouse", &gestures);
            });
            ui.add_space(theme::GAP);
            ui.button("Close").clicked()
        });
    if area.inner || area.should_close() {
        out.push(Command::ToggleKeys);
    }
}

fn list_ui(ui: &mut egui::Ui, id: &str, rows: &[(String, &str)]) {
    egui::Grid::new(id)
        .num_columns(2)
        .spacing([theme::GAP * 2.0, 4.0])
        .show(ui, |ui| {
            for (how, says) in rows {
                ui.label(how);
                ui.label(egui::RichText::new(*says).color(theme::QUIET));
                ui.end_row();
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in BINDINGS.iter().enumerate() {
            assert!(
                BINDINGS[..i].iter().all(|b| b.shortcut != a.shortcut),
                "{}",
                a.says
            );
        }
    }

    #[test]
    fn a_key_with_more_modifiers_is_asked_first() {
        for (i, a) in BINDINGS.iter().enumerate() {
            let (key, modifiers) = (a.shortcut.logical_key, a.shortcut.modifiers);
            let shadowed = BINDINGS[..i]
                .iter()
                .any(|b| b.shortcut.logical_key == key && modifiers.contains(b.shortcut.modifiers));
            assert!(!shadowed, "{} is never reached", a.says);
        }
    }
}
