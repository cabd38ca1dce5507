//! The table of keys.

use crate::command::{
    CalibrationCommand, Command, ExportCommand, JobCommand, LookCommand, TrainingCommand,
    ViewCommand, WindowCommand,
};
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
    Command::Calibration(CalibrationCommand::NudgeCircle { by: [x, y], radius })
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
        Command::Window(WindowCommand::Workspace(Workspace::Calibrate)),
        "calibrate",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num2,
        Command::Window(WindowCommand::Workspace(Workspace::Train)),
        "train",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num3,
        Command::Window(WindowCommand::Workspace(Workspace::Relight)),
        "relight",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num4,
        Command::Window(WindowCommand::Workspace(Workspace::Review)),
        "review",
    ),
    on(
        Modifiers::COMMAND,
        Key::Num5,
        Command::Window(WindowCommand::Workspace(Workspace::Export)),
        "export",
    ),
    on(
        Modifiers::NONE,
        Key::Space,
        Command::View(ViewCommand::TogglePlay),
        "play and stop",
    ),
    on(
        Modifiers::ALT,
        Key::ArrowRight,
        Command::Look(LookCommand::StepEnvironment(1)),
        "next environment",
    ),
    on(
        Modifiers::ALT,
        Key::ArrowLeft,
        Command::Look(LookCommand::StepEnvironment(-1)),
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
        Command::Calibration(CalibrationCommand::FindCircle),
        "take the circle that was found",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::PageUp,
        Command::View(ViewCommand::StepPhotograph(-1)),
        "previous photograph",
    ),
    within(
        PROBE,
        Modifiers::NONE,
        Key::PageDown,
        Command::View(ViewCommand::StepPhotograph(1)),
        "next photograph",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowRight,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.001, 0.0, 0.0])),
        "γ1 up, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowLeft,
        Command::Calibration(CalibrationCommand::NudgeTrial([-0.001, 0.0, 0.0])),
        "γ1 down, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowUp,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.001, 0.0])),
        "γ2 up, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::ArrowDown,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, -0.001, 0.0])),
        "γ2 down, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::Plus,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.0, 0.001])),
        "interview brighter, finely",
    ),
    within(
        GAMMA,
        Modifiers::SHIFT,
        Key::Minus,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.0, -0.001])),
        "interview darker, finely",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowRight,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.02, 0.0, 0.0])),
        "γ1 up",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowLeft,
        Command::Calibration(CalibrationCommand::NudgeTrial([-0.02, 0.0, 0.0])),
        "γ1 down",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowUp,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.02, 0.0])),
        "γ2 up",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::ArrowDown,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, -0.02, 0.0])),
        "γ2 down",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::Plus,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.0, 0.02])),
        "interview brighter",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::Minus,
        Command::Calibration(CalibrationCommand::NudgeTrial([0.0, 0.0, -0.02])),
        "interview darker",
    ),
    within(
        GAMMA,
        Modifiers::NONE,
        Key::W,
        Command::View(ViewCommand::StepWipe),
        "wipe to the right, the left, the middle",
    ),
    within(
        PROBE,
        Modifiers::COMMAND,
        Key::R,
        Command::Look(LookCommand::Circle(None)),
        "go back to the calibration",
    ),
    within(
        PROBE,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Calibration(CalibrationCommand::Start),
        "keep it and calibrate",
    ),
    within(
        GAMMA,
        Modifiers::COMMAND,
        Key::R,
        Command::Look(LookCommand::Trial(None)),
        "go back to the calibration",
    ),
    within(
        GAMMA,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Calibration(CalibrationCommand::Start),
        "keep it and calibrate",
    ),
    within(
        EXPORT,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Export(ExportCommand::Add),
        "add the export to the queue",
    ),
    within(
        EXPORT,
        Modifiers::NONE,
        Key::Tab,
        Command::Window(WindowCommand::FocusPane),
        "go through the controls; Esc leaves them",
    ),
    on(
        Modifiers::NONE,
        Key::I,
        Command::View(ViewCommand::MarkIn),
        "play and export from this frame on",
    ),
    on(
        Modifiers::NONE,
        Key::O,
        Command::View(ViewCommand::MarkOut),
        "play and export up to this frame",
    ),
    on(
        Modifiers::NONE,
        Key::ArrowRight,
        Command::View(ViewCommand::StepFrame(1)),
        "next frame",
    ),
    on(
        Modifiers::NONE,
        Key::ArrowLeft,
        Command::View(ViewCommand::StepFrame(-1)),
        "previous frame",
    ),
    on(
        Modifiers::NONE,
        Key::Home,
        Command::View(ViewCommand::Frame(0)),
        "first frame",
    ),
    on(
        Modifiers::NONE,
        Key::End,
        Command::View(ViewCommand::LastFrame),
        "last frame",
    ),
    on(
        Modifiers::SHIFT,
        Key::E,
        Command::Look(LookCommand::StepExposure(-0.5)),
        "darker by half a stop",
    ),
    on(
        Modifiers::NONE,
        Key::E,
        Command::Look(LookCommand::StepExposure(0.5)),
        "brighter by half a stop",
    ),
    within(
        TRAINING,
        Modifiers::NONE,
        Key::PageUp,
        Command::View(ViewCommand::StepTrainedLamp(-1)),
        "previous lamp",
    ),
    within(
        TRAINING,
        Modifiers::NONE,
        Key::PageDown,
        Command::View(ViewCommand::StepTrainedLamp(1)),
        "next lamp",
    ),
    within(
        TRAINING,
        Modifiers::COMMAND,
        Key::Enter,
        Command::Training(TrainingCommand::Start { fresh: false }),
        "start training, or resume it",
    ),
    on(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::P,
        Command::Window(WindowCommand::TogglePalette),
        "find a command",
    ),
    on(
        Modifiers::SHIFT,
        Key::K,
        Command::Look(LookCommand::ToggleKey(Keyframed::Intensity)),
        "set or take the intensity's key",
    ),
    on(
        Modifiers::NONE,
        Key::K,
        Command::Look(LookCommand::ToggleKey(Keyframed::Yaw)),
        "set or take the yaw's key",
    ),
    on(
        Modifiers::NONE,
        Key::P,
        Command::Job(JobCommand::Pause),
        "pause or resume the job",
    ),
    on(
        Modifiers::NONE,
        Key::F,
        Command::View(ViewCommand::Fit),
        "fit the picture",
    ),
    on(
        Modifiers::COMMAND,
        Key::R,
        Command::Look(LookCommand::ResetView),
        "reset zoom and exposure",
    ),
    on(
        Modifiers::COMMAND.plus(Modifiers::SHIFT),
        Key::Z,
        Command::Look(LookCommand::Redo),
        "redo",
    ),
    on(
        Modifiers::COMMAND,
        Key::Z,
        Command::Look(LookCommand::Undo),
        "undo",
    ),
    on(
        Modifiers::NONE,
        Key::Tab,
        Command::Window(WindowCommand::TogglePanels),
        "hide and show the panels",
    ),
    on(
        Modifiers::NONE,
        Key::F11,
        Command::Window(WindowCommand::ToggleFullScreen),
        "full screen",
    ),
    on(
        Modifiers::NONE,
        Key::Questionmark,
        Command::Window(WindowCommand::ToggleKeys),
        "these keys",
    ),
    on(
        Modifiers::NONE,
        Key::Escape,
        Command::Window(WindowCommand::Dismiss),
        "close what covers the picture",
    ),
    on(
        Modifiers::NONE,
        Key::W,
        Command::View(ViewCommand::ToggleWipe),
        "wipe between two pictures",
    ),
    on(
        Modifiers::NONE,
        Key::Q,
        Command::View(ViewCommand::ToggleSecond),
        "the other picture",
    ),
    on(
        Modifiers::NONE,
        Key::R,
        Command::Look(LookCommand::Inspect(Inspection::Channel(Channel::Red))),
        "red alone",
    ),
    on(
        Modifiers::NONE,
        Key::G,
        Command::Look(LookCommand::Inspect(Inspection::Channel(Channel::Green))),
        "green alone",
    ),
    on(
        Modifiers::NONE,
        Key::B,
        Command::Look(LookCommand::Inspect(Inspection::Channel(Channel::Blue))),
        "blue alone",
    ),
    on(
        Modifiers::NONE,
        Key::A,
        Command::Look(LookCommand::Inspect(Inspection::Channel(Channel::Alpha))),
        "the matte alone",
    ),
    on(
        Modifiers::NONE,
        Key::L,
        Command::Look(LookCommand::Inspect(Inspection::Channel(
            Channel::Luminance,
        ))),
        "luminance alone",
    ),
    on(
        Modifiers::NONE,
        Key::C,
        Command::Look(LookCommand::Inspect(Inspection::Picture)),
        "all colours",
    ),
    on(
        Modifiers::NONE,
        Key::PageUp,
        Command::View(ViewCommand::StepSolo(-1)),
        "previous lamp alone",
    ),
    on(
        Modifiers::NONE,
        Key::PageDown,
        Command::View(ViewCommand::StepSolo(1)),
        "next lamp alone",
    ),
    on(
        Modifiers::NONE,
        Key::Num1,
        Command::Window(WindowCommand::ActualSize),
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
