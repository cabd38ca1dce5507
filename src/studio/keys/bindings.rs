//! The table of keys.

use crate::command::Command;
use crate::keyframed::Keyframed;
use crate::layout::{Pane, Workspace};
use egui::{Key, KeyboardShortcut, Modifiers};
use scene::{Channel, Inspection};

/// A key, what it does, and how the list of keys calls it.
pub struct Binding {
    pub shortcut: KeyboardShortcut,
    pub command: Command,
    pub says: &'static str,
    /// The pane that knows this key; none is all of them.
    pub only: Option<Pane>,
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
pub const EXPORT: Pane = Pane::Export;

/// Bindings that ask for more modifiers come first: egui takes Shift+E for E otherwise. Those of one
/// pane come before those of all.
pub const BINDINGS: &[Binding] = &[
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
        Command::ToggleKey(Keyframed::Intensity),
        "set or take the intensity's key",
    ),
    on(
        Modifiers::NONE,
        Key::K,
        Command::ToggleKey(Keyframed::Yaw),
        "set or take the yaw's key",
    ),
    on(
        Modifiers::NONE,
        Key::P,
        Command::PauseJob,
        "pause or resume the job",
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
