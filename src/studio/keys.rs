//! The keys: one table that the window obeys and shows.

mod bindings;
mod overlay;

pub use overlay::overlay_ui;

use super::command::{Command, WindowCommand};
use super::layout::Pane;
use bindings::{BINDINGS, Binding, EXPORT};
use egui::{Key, KeyboardShortcut, Modifiers};

const ARROWS: [Key; 4] = [
    Key::ArrowLeft,
    Key::ArrowRight,
    Key::ArrowUp,
    Key::ArrowDown,
];

/// Keys besides the arrows that a control which has the focus takes.
const CONTROL_KEYS: [Key; 4] = [Key::Tab, Key::Space, Key::Home, Key::End];

/// Leaves the arrow keys to a widget for as long as that has the focus; to be said whenever it is drawn.
pub fn leave_arrows(ctx: &egui::Context, widget: egui::Id) {
    ctx.data_mut(|data| data.insert_temp(egui::Id::unique("arrow keys"), widget));
}

/// Whether what has the focus takes the arrow keys.
fn are_arrows_left(ctx: &egui::Context) -> bool {
    let widget = ctx.data(|data| data.get_temp(egui::Id::unique("arrow keys")));
    widget.is_some() && widget == ctx.memory(|memory| memory.focused())
}

/// The commands of the keys that were pressed since the last frame, for a pane.
pub fn pressed(ctx: &egui::Context, pane: Pane, out: &mut Vec<Command>) {
    let arrows_are_left = are_arrows_left(ctx);
    let typing = ctx.text_edit_focused();
    let focused = pane == EXPORT && ctx.memory(|memory| memory.focused().is_some());
    let menu = egui::Popup::is_any_open(ctx);
    let is_left = |binding: &Binding| {
        let KeyboardShortcut {
            modifiers,
            logical_key,
        } = binding.shortcut;
        if menu && logical_key == Key::Escape {
            // An open menu is what it closes.
            true
        } else if typing {
            binding.only != Some(EXPORT) || modifiers.is_none()
        } else {
            let own = CONTROL_KEYS.contains(&logical_key) || ARROWS.contains(&logical_key);
            focused && modifiers.is_none() && own
        }
    };
    ctx.input_mut(|input| {
        for Binding {
            shortcut, command, ..
        } in known(pane).filter(|binding| !is_left(binding))
        {
            let is_arrow = ARROWS.contains(&shortcut.logical_key);
            if arrows_are_left && is_arrow && !shortcut.modifiers.alt {
                continue;
            }
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
    if out.contains(&Command::Window(WindowCommand::TogglePanels))
        || out.contains(&Command::Window(WindowCommand::FocusPane))
    {
        // egui moves the focus with the same key.
        ctx.memory_mut(|memory| memory.move_focus(egui::FocusDirection::None));
    }
}

fn known(pane: Pane) -> impl Iterator<Item = &'static Binding> {
    let all = BINDINGS.iter();
    all.filter(move |binding| binding.only.is_none_or(|only| only == pane))
}

/// Keys, what they do, and the commands, for a pane: what the list of commands shows.
pub fn listed(
    ctx: &egui::Context,
    pane: Pane,
) -> impl Iterator<Item = (String, &'static str, Command)> {
    known(pane).map(|binding| {
        let key = name(ctx, binding);
        (key, binding.says, binding.command.clone())
    })
}

fn name(ctx: &egui::Context, binding: &Binding) -> String {
    match binding.shortcut.logical_key {
        Key::Questionmark => "?".to_owned(),
        _ => ctx.format_shortcut(&binding.shortcut),
    }
}
