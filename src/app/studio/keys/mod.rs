//! Keyboard shortcuts: one table that the window follows and displays.

mod bindings;
mod overlay;

pub use overlay::overlay_ui;

use super::command::{Command, WindowCommand};
use super::layout::Pane;
use bindings::{BINDINGS, Binding, EXPORT, OF_PROJECTS, SHOW_ALL};
use egui::{Key, KeyboardShortcut, Modifiers};

const ARROWS: [Key; 4] = [Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown];

/// Keys, besides the arrows, that a focused control uses itself.
const CONTROL_KEYS: [Key; 4] = [Key::Tab, Key::Space, Key::Home, Key::End];

/// Leaves the arrow keys to a widget while it has the focus. Call whenever the widget is drawn.
pub fn leave_arrows(ctx: &egui::Context, widget: egui::Id) {
    ctx.data_mut(|data| data.insert_temp(egui::Id::unique("arrow keys"), widget));
}

/// True if the focused widget uses the arrow keys itself.
fn are_arrows_left(ctx: &egui::Context) -> bool {
    let widget = ctx.data(|data| data.get_temp(egui::Id::unique("arrow keys")));
    widget.is_some() && widget == ctx.memory(|memory| memory.focused())
}

/// Emits the commands of the keys pressed since the last frame, for the active pane and the pane under the pointer. If
/// something covers the window, only the commands in `covered` are possible.
pub fn pressed(
    ctx: &egui::Context,
    (pane, hovered): (Pane, Option<Pane>),
    covered: Option<&[WindowCommand]>,
    out: &mut Vec<Command>,
) {
    let arrows_are_left = are_arrows_left(ctx);
    let typing = ctx.text_edit_focused();
    let focused = pane == EXPORT && ctx.memory(|memory| memory.focused().is_some());
    let menu = egui::Popup::is_any_open(ctx);
    let is_left = |binding: &Binding| {
        let KeyboardShortcut { modifiers, logical_key } = binding.shortcut;
        if let Some(covered) = covered {
            let goes = |command| binding.command == Command::Window(command);
            typing || !covered.iter().cloned().any(goes)
        } else if menu && logical_key == Key::Escape {
            // Escape closes the menu.
            true
        } else if typing {
            let of_project = OF_PROJECTS.contains(&binding.command);
            (binding.only != Some(EXPORT) || modifiers.is_none()) && !of_project
        } else {
            let own = CONTROL_KEYS.contains(&logical_key) || ARROWS.contains(&logical_key);
            focused && modifiers.is_none() && own
        }
    };
    ctx.input_mut(|input| {
        for Binding { shortcut, command, .. } in known(pane, hovered).filter(|binding| !is_left(binding)) {
            let is_arrow = ARROWS.contains(&shortcut.logical_key);
            if arrows_are_left && is_arrow && !shortcut.modifiers.alt {
                continue;
            }
            // On many keyboards a question mark is typed with Shift.
            let pressed = match shortcut.logical_key {
                Key::Questionmark => {
                    input.consume_key(Modifiers::SHIFT, Key::Questionmark) || input.consume_shortcut(shortcut)
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

/// Shortcuts of a pane, those of all panes, and the few that apply to the pane under the pointer.
fn known(pane: Pane, hovered: Option<Pane>) -> impl Iterator<Item = &'static Binding> {
    let fits = |binding: &Binding| binding.command == SHOW_ALL;
    BINDINGS.iter().filter(move |binding| {
        let is_of = |only| only == pane || hovered == Some(only) && fits(binding);
        binding.only.is_none_or(is_of)
    })
}

/// A command with a shortcut.
pub struct Listed {
    /// Its shortcut; empty if the active pane uses that for another command.
    pub key: String,
    pub label: &'static str,
    pub command: Command,
    /// True if only the active pane has it.
    pub is_of_pane: bool,
}

/// Commands with shortcuts in a pane, the pane's own first.
pub fn listed(ctx: &egui::Context, pane: Pane) -> Vec<Listed> {
    let mut all: Vec<Listed> = Vec::new();
    for binding in known(pane, None) {
        let key = name(ctx, binding);
        let free = all.iter().all(|before| before.key != key);
        all.push(Listed {
            key: if free { key } else { String::new() },
            label: binding.label,
            command: binding.command.clone(),
            is_of_pane: binding.only.is_some(),
        });
    }
    all
}

fn name(ctx: &egui::Context, binding: &Binding) -> String {
    match binding.shortcut.logical_key {
        Key::Questionmark => "?".to_owned(),
        _ => ctx.format_shortcut(&binding.shortcut),
    }
}
