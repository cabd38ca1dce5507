//! The keys: one table that the window obeys and shows.

use super::command::Command;
use super::layout::{Pane, Workspace};
use super::state::Keyed;
use super::theme;
use crate::scene::{Channel, Inspection};
use egui::{Key, KeyboardShortcut, Modifiers};

/// A key, what it does, and how the list of keys calls it.
struct Binding {
    shortcut: KeyboardShortcut,
    command: Command,
    says: &'static str,
    /// The pane that knows this key; none is all of them.
    only: Option<Pane>,
}

const fn on(modifiers: Modifiers, key: Key, command: Command, says: &'static str) -> Binding {
    Binding {
        shortcut: KeyboardShortcut::new(modifiers, key),
        command,
        says,
        only: None,
    }
}

/// A key that one pane knows.
const fn within(
    pane: Pane,
    modifiers: Modifiers,
    key: Key,
    command: Command,
    says: &'static str,
) -> Binding {
    Binding {
        shortcut: KeyboardShortcut::new(modifiers, key),
        command,
        says,
        only: Some(pane),
    }
}

const fn nudge_circle(x: f64, y: f64, radius: f64) -> Command {
    Command::NudgeCircle { by: [x, y], radius }
}

const PROBE: Pane = Pane::Probe;
const GAMMA: Pane = Pane::Gamma;
const TRAINING: Pane = Pane::Training;
const EXPORT: Pane = Pane::Export;

/// Bindings that ask for more modifiers come first: egui takes Shift+E for E otherwise. Those of one
/// pane come before those of all.
const BINDINGS: &[Binding] = &[
    on(
        Modifiers::COMMAND,
        Key::Num1,
        Command::Workspace(Workspace::Calibrate),
        "calibrate",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num2,
        Command::Workspace(Workspace::Train),
        "train",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num3,
        Command::Workspace(Workspace::Relight),
        "relight",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num4,
        Command::Workspace(Workspace::Review),
        "review",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num5,
        Command::Workspace(Workspace::Export),
        "export",
    ),
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
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::ArrowRight,
        nudge_circle(0.1, 0.0, 0.0),
        "circle a tenth of a pixel right",
    ),
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::ArrowLeft,
        nudge_circle(-0.1, 0.0, 0.0),
        "circle a tenth of a pixel left",
    ),
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::ArrowUp,
        nudge_circle(0.0, -0.1, 0.0),
        "circle a tenth of a pixel up",
    ),
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::ArrowDown,
        nudge_circle(0.0, 0.1, 0.0),
        "circle a tenth of a pixel down",
    ),
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::Plus,
        nudge_circle(0.0, 0.0, 0.1),
        "circle a tenth of a pixel larger",
    ),
    within(
        PROBE,
        Modifiers::SHIFT,
        Key::Minus,
        nudge_circle(0.0, 0.0, -0.1),
        "circle a tenth of a pixel smaller",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::ArrowRight,
        nudge_circle(1.0, 0.0, 0.0),
        "circle a pixel right",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::ArrowLeft,
        nudge_circle(-1.0, 0.0, 0.0),
        "circle a pixel left",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::ArrowUp,
        nudge_circle(0.0, -1.0, 0.0),
        "circle a pixel up",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::ArrowDown,
        nudge_circle(0.0, 1.0, 0.0),
        "circle a pixel down",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::Plus,
        nudge_circle(0.0, 0.0, 1.0),
        "circle a pixel larger",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::Minus,
        nudge_circle(0.0, 0.0, -1.0),
        "circle a pixel smaller",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::C,
        Command::FindCircle,
        "take the circle that was found",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::PageUp,
        Command::StepPhotograph(-1),
        "previous photograph",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::PageDown,
        Command::StepPhotograph(1),
        "next photograph",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowRight,
        Command::NudgeTrial([0.001, 0.0, 0.0]),
        "γ1 up, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowLeft,
        Command::NudgeTrial([-0.001, 0.0, 0.0]),
        "γ1 down, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowUp,
        Command::NudgeTrial([0.0, 0.001, 0.0]),
        "γ2 up, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowDown,
        Command::NudgeTrial([0.0, -0.001, 0.0]),
        "γ2 down, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::Plus,
        Command::NudgeTrial([0.0, 0.0, 0.001]),
        "interview brighter, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::Minus,
        Command::NudgeTrial([0.0, 0.0, -0.001]),
        "interview darker, finely",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowRight,
        Command::NudgeTrial([0.02, 0.0, 0.0]),
        "γ1 up",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowLeft,
        Command::NudgeTrial([-0.02, 0.0, 0.0]),
        "γ1 down",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowUp,
        Command::NudgeTrial([0.0, 0.02, 0.0]),
        "γ2 up",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowDown,
        Command::NudgeTrial([0.0, -0.02, 0.0]),
        "γ2 down",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::Plus,
        Command::NudgeTrial([0.0, 0.0, 0.02]),
        "interview brighter",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::Minus,
        Command::NudgeTrial([0.0, 0.0, -0.02]),
        "interview darker",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::W,
        Command::StepWipe,
        "wipe to the right, the left, the middle",
    ),
    within(
        PROBE,
        Modifiers::COMMAND,
        Key::R,
        Command::Circle(None),
        "go back to the calibration",
    ),
    within(
        PROBE,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Calibrate,
        "keep it and calibrate",
    ),
    within(
        GAMMA,
        Modifiers::COMMAND,
        Key::R,
        Command::Try(None),
        "go back to the calibration",
    ),
    within(
        GAMMA,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Calibrate,
        "keep it and calibrate",
    ),
    within(
        EXPORT,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Export,
        "add the export to the queue",
    ),
    within(
        EXPORT,
        Modifiers::NONE,
        Key::Tab,
        Command::FocusPane,
        "go through the controls; Esc leaves them",
    ),
    on(
        Modifiers::NONE,
        Key::I,
        Command::MarkIn,
        "play and export from this frame on",
    ),
    on(
        Modifiers::NONE,
        Key::O,
        Command::MarkOut,
        "play and export up to this frame",
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
    within(
        TRAINING,
        Modifiers::NONE,
        Key::PageUp,
        Command::StepTrainedLamp(-1),
        "previous lamp",
    ),
    within(
        TRAINING,
        Modifiers::NONE,
        Key::PageDown,
        Command::StepTrainedLamp(1),
        "next lamp",
    ),
    within(
        TRAINING,
        Modifiers::COMMAND,
        Key::Enter,
        Command::StartTraining { fresh: false },
        "start training, or resume it",
    ),
    on(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::P,
        Command::TogglePalette,
        "find a command",
    ),
    on(
        Modifiers::SHIFT,
        Key::K,
        Command::ToggleKey(Keyed::Intensity),
        "set or take the intensity's key",
    ),
    on(
        Modifiers::NONE,
        Key::K,
        Command::ToggleKey(Keyed::Yaw),
        "set or take the yaw's key",
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
    on(
        Modifiers::NONE,
        Key::W,
        Command::ToggleWipe,
        "wipe between two pictures",
    ),
    on(
        Modifiers::NONE,
        Key::Q,
        Command::ToggleSecond,
        "the other picture",
    ),
    on(
        Modifiers::NONE,
        Key::R,
        Command::Inspect(Inspection::Channel(Channel::Red)),
        "red alone",
    ),
    on(
        Modifiers::NONE,
        Key::G,
        Command::Inspect(Inspection::Channel(Channel::Green)),
        "green alone",
    ),
    on(
        Modifiers::NONE,
        Key::B,
        Command::Inspect(Inspection::Channel(Channel::Blue)),
        "blue alone",
    ),
    on(
        Modifiers::NONE,
        Key::A,
        Command::Inspect(Inspection::Channel(Channel::Alpha)),
        "the matte alone",
    ),
    on(
        Modifiers::NONE,
        Key::L,
        Command::Inspect(Inspection::Channel(Channel::Luminance)),
        "luminance alone",
    ),
    on(
        Modifiers::NONE,
        Key::C,
        Command::Inspect(Inspection::Picture),
        "all colours",
    ),
    on(
        Modifiers::NONE,
        Key::PageUp,
        Command::StepSolo(-1),
        "previous lamp alone",
    ),
    on(
        Modifiers::NONE,
        Key::PageDown,
        Command::StepSolo(1),
        "next lamp alone",
    ),
    on(
        Modifiers::NONE,
        Key::Num1,
        Command::ActualSize,
        "a pixel of the picture on one of the screen",
    ),
];

const ARROWS: [Key; 4] = [
    Key::ArrowLeft,
    Key::ArrowRight,
    Key::ArrowUp,
    Key::ArrowDown,
];

/// Keys besides the arrows that a control which has the focus takes.
const CONTROL_KEYS: [Key; 4] = [Key::Tab, Key::Space, Key::Home, Key::End];

/// What the mouse does in the viewport.
const GESTURES: &[(&str, &str)] = &[
    ("Drag, Ctrl+drag", "turn the light"),
    ("Shift+right-drag", "turn the light"),
    ("Wheel", "zoom about the cursor"),
    ("Middle-drag", "move the picture"),
    ("Double-click a number", "reset it"),
    ("Arrows on a light's dot", "move it, with Shift by 10°"),
    ("Delete on a key", "take it away"),
    ("Shift", "finer drags; peek at the other picture"),
];

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
    if out.contains(&Command::TogglePanels) || out.contains(&Command::FocusPane) {
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

/// The list of keys, over the picture.
pub fn overlay_ui(ui: &egui::Ui, pane: Pane, out: &mut Vec<Command>) {
    let frame = egui::Frame::window(ui.style()).inner_margin(3.0 * theme::GAP);
    let area = egui::Modal::new(egui::Id::unique("keys"))
        .frame(frame)
        .show(ui.ctx(), |ui| {
            ui.heading("Keys");
            ui.add_space(theme::GAP);
            ui.horizontal_top(|ui| {
                // Rows of text alone need no room for buttons.
                ui.spacing_mut().interact_size.y = 0.0;
                // A key that a pane uses for something of its own means only that there.
                let mut keys: Vec<(String, &str)> = Vec::new();
                for binding in known(pane) {
                    let name = name(ui.ctx(), binding);
                    if keys.iter().all(|(known, _)| *known != name) {
                        keys.push((name, binding.says));
                    }
                }
                for (i, column) in keys.chunks(keys.len().div_ceil(2).max(1)).enumerate() {
                    list_ui(ui, &format!("keyboard {i}"), column);
                    ui.add_space(theme::GAP * 3.0);
                }
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

    /// Whether a key of `a` may be meant for `b`, which stands before it.
    fn meet(a: &Binding, b: &Binding) -> bool {
        b.only.is_none() || a.only == b.only
    }

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in BINDINGS.iter().enumerate() {
            let twice = BINDINGS[..i]
                .iter()
                .any(|b| meet(a, b) && b.shortcut == a.shortcut);
            assert!(!twice, "{}", a.says);
        }
    }

    #[test]
    fn a_key_with_more_modifiers_is_asked_first() {
        for (i, a) in BINDINGS.iter().enumerate() {
            let (key, modifiers) = (a.shortcut.logical_key, a.shortcut.modifiers);
            let shadowed = BINDINGS[..i].iter().any(|b| {
                meet(a, b)
                    && b.shortcut.logical_key == key
                    && modifiers.contains(b.shortcut.modifiers)
            });
            assert!(!shadowed, "{} is never reached", a.says);
        }
    }
}
