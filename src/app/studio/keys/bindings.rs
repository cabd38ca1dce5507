//! The table of shortcuts.

use crate::command::Command::{
    Aim, Calibration, Environments, Export, Job, Lights, Look, Looks, Matte, Project, Review, Timeline, Training, View,
    Window,
};
use crate::command::{
    AimCommand, CalibrationCommand, Command, Dialog, EnvironmentsCommand, ExportCommand, JobCommand, LightsCommand,
    LookCommand, LooksCommand, MatteCommand, ProjectCommand, ReviewCommand, TimelineCommand, TrainingCommand,
    ViewCommand, WindowCommand,
};
use crate::layout::{Pane, Workspace};
use egui::{Key, KeyboardShortcut, Modifiers};
use evaluation::review::Mark;
use scene::{Channel, Inspection, Setting};

/// A shortcut, its command, and its label in the lists of keys and commands.
pub struct Binding {
    pub shortcut: KeyboardShortcut,
    pub command: Command,
    pub label: &'static str,
    /// The pane with this shortcut; None for all panes.
    pub only: Option<Pane>,
}

const fn on(modifiers: Modifiers, key: Key, command: Command, label: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(modifiers, key), command, label, only: None }
}

/// A shortcut of one pane.
const fn within(pane: Pane, modifiers: Modifiers, key: Key, command: Command, label: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(modifiers, key), command, label, only: Some(pane) }
}

const fn workspace(workspace: Workspace) -> Command {
    Window(WindowCommand::Workspace(workspace))
}

const fn nudge_circle(x: f64, y: f64, radius: f64) -> Command {
    Calibration(CalibrationCommand::NudgeCircle { by: [x, y], radius })
}

const fn nudge_trial(gamma1: f32, gamma2: f32, exposure: f32) -> Command {
    Calibration(CalibrationCommand::NudgeTrial([gamma1, gamma2, exposure]))
}

const fn channel(channel: Channel) -> Command {
    View(ViewCommand::Inspect(Inspection::Channel(channel)))
}

const fn toggle_key(of: Setting) -> Command {
    Look(LookCommand::ToggleKey(of))
}

const fn verdict(mark: Mark) -> Command {
    Review(ReviewCommand::Verdict(mark))
}

const FAVOURITE: Command = Environments(EnvironmentsCommand::ToggleFavourite(None));
const NEXT_ENVIRONMENT: Command = Environments(EnvironmentsCommand::Step(1));
const PREVIOUS_ENVIRONMENT: Command = Environments(EnvironmentsCommand::Step(-1));
const NEXT_WORST: Command = Review(ReviewCommand::NextWorst);
const TRAIN: Command = Training(TrainingCommand::Start { fresh: false });

pub const SHOW_ALL: Command = Timeline(TimelineCommand::ShowAll);
const SELECT_ALL: Command = Timeline(TimelineCommand::SelectAll);

const fn step_key(keys: isize) -> Command {
    Timeline(TimelineCommand::StepKey(keys))
}

const fn nudge(frames: isize) -> Command {
    Timeline(TimelineCommand::Nudge(frames))
}

const PROBE: Pane = Pane::Probe;
const GAMMA: Pane = Pane::Gamma;
const TRAINING: Pane = Pane::Training;
const FOOTAGE: Pane = Pane::Footage;
const REVIEW: Pane = Pane::Review;
const LAMPS: Pane = Pane::Lamps;
const ENVIRONMENTS: Pane = Pane::Environments;
const TIMELINE: Pane = Pane::Timeline;
pub const EXPORT: Pane = Pane::Export;

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

const NEW: Command = Project(ProjectCommand::New(None));
const OPEN: Command = Command::Dialog(Dialog::Project);
const SAVED: Command = Window(WindowCommand::TellSaved);

/// Commands that are available even while text is typed.
pub const OF_PROJECTS: [Command; 3] = [NEW, OPEN, SAVED];

/// Bindings with more modifiers come first: egui takes Alt+→ for → otherwise. Then bindings of one pane come before
/// those of all panes.
#[rustfmt::skip]
pub const BINDINGS: &[Binding] = &[
    on(CTRL, Key::Num1, workspace(Workspace::Calibrate), "Calibrate workspace"),
    on(CTRL, Key::Num2, workspace(Workspace::Train), "Train workspace"),
    on(CTRL, Key::Num3, workspace(Workspace::Relight), "Relight workspace"),
    on(CTRL, Key::Num4, workspace(Workspace::Review), "Review workspace"),
    on(CTRL, Key::Num5, workspace(Workspace::Export), "Export workspace"),
    on(CTRL, Key::N, NEW, "New project…"),
    on(CTRL, Key::O, OPEN, "Open project…"),
    on(CTRL, Key::S, SAVED, "Save state"),
    on(Modifiers::ALT, Key::ArrowRight, NEXT_ENVIRONMENT, "Next environment"),
    on(Modifiers::ALT, Key::ArrowLeft, PREVIOUS_ENVIRONMENT, "Previous environment"),
    on(CTRL, Key::ArrowRight, step_key(1), "Next key"),
    on(CTRL, Key::ArrowLeft, step_key(-1), "Previous key"),
    on(SHIFT, Key::F, Window(WindowCommand::ToggleLightAlone), "Picture and light alone"),

    within(PROBE, SHIFT, Key::ArrowRight, nudge_circle(0.1, 0.0, 0.0), "Circle 0.1 px right"),
    within(PROBE, SHIFT, Key::ArrowLeft, nudge_circle(-0.1, 0.0, 0.0), "Circle 0.1 px left"),
    within(PROBE, SHIFT, Key::ArrowUp, nudge_circle(0.0, -0.1, 0.0), "Circle 0.1 px up"),
    within(PROBE, SHIFT, Key::ArrowDown, nudge_circle(0.0, 0.1, 0.0), "Circle 0.1 px down"),
    within(PROBE, SHIFT, Key::Plus, nudge_circle(0.0, 0.0, 0.1), "Circle 0.1 px larger"),
    within(PROBE, SHIFT, Key::Minus, nudge_circle(0.0, 0.0, -0.1), "Circle 0.1 px smaller"),
    within(PROBE, NONE, Key::ArrowRight, nudge_circle(1.0, 0.0, 0.0), "Circle 1 px right"),
    within(PROBE, NONE, Key::ArrowLeft, nudge_circle(-1.0, 0.0, 0.0), "Circle 1 px left"),
    within(PROBE, NONE, Key::ArrowUp, nudge_circle(0.0, -1.0, 0.0), "Circle 1 px up"),
    within(PROBE, NONE, Key::ArrowDown, nudge_circle(0.0, 1.0, 0.0), "Circle 1 px down"),
    within(PROBE, NONE, Key::Plus, nudge_circle(0.0, 0.0, 1.0), "Circle 1 px larger"),
    within(PROBE, NONE, Key::Minus, nudge_circle(0.0, 0.0, -1.0), "Circle 1 px smaller"),
    within(PROBE, NONE, Key::C, Calibration(CalibrationCommand::FindCircle), "Use the detected circle"),
    within(PROBE, NONE, Key::PageUp, View(ViewCommand::StepPhotograph(-1)), "Previous photograph"),
    within(PROBE, NONE, Key::PageDown, View(ViewCommand::StepPhotograph(1)), "Next photograph"),
    within(PROBE, CTRL, Key::R, Look(LookCommand::Circle(None)), "Reset the circle"),
    within(PROBE, CTRL, Key::Enter, Calibration(CalibrationCommand::Start), "Calibrate with this circle"),

    within(GAMMA, SHIFT, Key::ArrowRight, nudge_trial(0.001, 0.0, 0.0), "γ1 up, fine"),
    within(GAMMA, SHIFT, Key::ArrowLeft, nudge_trial(-0.001, 0.0, 0.0), "γ1 down, fine"),
    within(GAMMA, SHIFT, Key::ArrowUp, nudge_trial(0.0, 0.001, 0.0), "γ2 up, fine"),
    within(GAMMA, SHIFT, Key::ArrowDown, nudge_trial(0.0, -0.001, 0.0), "γ2 down, fine"),
    within(GAMMA, SHIFT, Key::Plus, nudge_trial(0.0, 0.0, 0.001), "Interview brighter, fine"),
    within(GAMMA, SHIFT, Key::Minus, nudge_trial(0.0, 0.0, -0.001), "Interview darker, fine"),
    within(GAMMA, NONE, Key::ArrowRight, nudge_trial(0.02, 0.0, 0.0), "γ1 up"),
    within(GAMMA, NONE, Key::ArrowLeft, nudge_trial(-0.02, 0.0, 0.0), "γ1 down"),
    within(GAMMA, NONE, Key::ArrowUp, nudge_trial(0.0, 0.02, 0.0), "γ2 up"),
    within(GAMMA, NONE, Key::ArrowDown, nudge_trial(0.0, -0.02, 0.0), "γ2 down"),
    within(GAMMA, NONE, Key::Plus, nudge_trial(0.0, 0.0, 0.02), "Interview brighter"),
    within(GAMMA, NONE, Key::Minus, nudge_trial(0.0, 0.0, -0.02), "Interview darker"),
    within(GAMMA, NONE, Key::W, View(ViewCommand::StepWipe), "Wipe right, left or middle"),
    within(GAMMA, CTRL, Key::R, Look(LookCommand::Trial(None)), "Reset the response"),
    within(GAMMA, CTRL, Key::Enter, Calibration(CalibrationCommand::Start), "Calibrate with this response"),

    within(TRAINING, NONE, Key::PageUp, View(ViewCommand::StepTrainedLamp(-1)), "Previous lamp"),
    within(TRAINING, NONE, Key::PageDown, View(ViewCommand::StepTrainedLamp(1)), "Next lamp"),
    within(TRAINING, CTRL, Key::Enter, TRAIN, "Start or resume training"),

    within(EXPORT, CTRL, Key::Enter, Export(ExportCommand::Add), "Add the export to the queue"),
    within(EXPORT, NONE, Key::Tab, Window(WindowCommand::FocusPane), "Step through the controls; Esc leaves them"),

    within(FOOTAGE, NONE, Key::M, Matte(MatteCommand::ToggleTool), "Paint the matte or frame it"),
    within(FOOTAGE, NONE, Key::X, Matte(MatteCommand::SwapSide), "Brush: keep or remove"),
    within(FOOTAGE, NONE, Key::OpenBracket, Matte(MatteCommand::StepRadius(-1)), "Smaller brush"),
    within(FOOTAGE, NONE, Key::CloseBracket, Matte(MatteCommand::StepRadius(1)), "Larger brush"),

    within(REVIEW, NONE, Key::Num1, verdict(Mark::Good), "Mark the cell as good"),
    within(REVIEW, NONE, Key::Num2, verdict(Mark::Doubtful), "Mark the cell as doubtful"),
    within(REVIEW, NONE, Key::Num3, verdict(Mark::Bad), "Mark the cell as bad"),
    within(REVIEW, NONE, Key::N, NEXT_WORST, "Next worst cell without a verdict"),
    // The pane of the pictures gets the keys after a click there.
    within(LAMPS, NONE, Key::Num1, verdict(Mark::Good), "Mark the cell as good"),
    within(LAMPS, NONE, Key::Num2, verdict(Mark::Doubtful), "Mark the cell as doubtful"),
    within(LAMPS, NONE, Key::Num3, verdict(Mark::Bad), "Mark the cell as bad"),
    within(LAMPS, NONE, Key::N, NEXT_WORST, "Next worst cell without a verdict"),

    within(ENVIRONMENTS, CTRL, Key::F, Window(WindowCommand::FocusPane), "Search the environments"),
    within(ENVIRONMENTS, NONE, Key::ArrowUp, PREVIOUS_ENVIRONMENT, "Previous environment"),
    within(ENVIRONMENTS, NONE, Key::ArrowDown, NEXT_ENVIRONMENT, "Next environment"),
    within(ENVIRONMENTS, NONE, Key::S, FAVOURITE, "Add to favourites or remove"),

    within(TIMELINE, SHIFT, Key::ArrowRight, nudge(1), "Move the selected keys a frame later"),
    within(TIMELINE, SHIFT, Key::ArrowLeft, nudge(-1), "Move the selected keys a frame earlier"),
    within(TIMELINE, CTRL, Key::A, SELECT_ALL, "Select all keys"),
    within(TIMELINE, NONE, Key::F, SHOW_ALL, "Show all frames"),

    on(NONE, Key::Space, View(ViewCommand::TogglePlay), "Play or stop"),
    on(CTRL, Key::L, View(ViewCommand::ToggleLoop), "Loop between in and out"),
    on(CTRL, Key::D, Lights(LightsCommand::Duplicate), "Duplicate light"),
    on(NONE, Key::I, View(ViewCommand::MarkIn), "Set the in point"),
    on(NONE, Key::O, View(ViewCommand::MarkOut), "Set the out point"),
    on(NONE, Key::ArrowRight, View(ViewCommand::StepFrame(1)), "Next frame"),
    on(NONE, Key::ArrowLeft, View(ViewCommand::StepFrame(-1)), "Previous frame"),
    on(NONE, Key::Home, View(ViewCommand::Frame(0)), "First frame"),
    on(NONE, Key::End, View(ViewCommand::LastFrame), "Last frame"),
    on(SHIFT, Key::E, View(ViewCommand::StepViewing(-0.5)), "View half a stop darker"),
    on(NONE, Key::E, View(ViewCommand::StepViewing(0.5)), "View half a stop brighter"),
    on(SHIFT, Key::K, toggle_key(Setting::Intensity), "Set or remove an intensity key"),
    on(NONE, Key::K, toggle_key(Setting::Yaw), "Set or remove a yaw key"),
    on(CTRL_SHIFT, Key::P, Window(WindowCommand::TogglePalette), "Find a command"),
    on(NONE, Key::P, Job(JobCommand::Pause), "Pause or resume the job"),
    on(NONE, Key::F, View(ViewCommand::Fit), "Fit the picture"),
    on(NONE, Key::Num1, Window(WindowCommand::ActualSize), "Zoom to 100 %"),
    on(NONE, Key::Num4, Looks(LooksCommand::ToggleFour), "Compare four looks"),
    on(CTRL, Key::R, View(ViewCommand::ResetView), "Reset zoom and view"),
    on(CTRL_SHIFT, Key::Z, Look(LookCommand::Redo), "Redo"),
    on(CTRL, Key::Z, Look(LookCommand::Undo), "Undo"),
    on(NONE, Key::Tab, Window(WindowCommand::TogglePanels), "Show or hide the panels"),
    on(NONE, Key::F11, Window(WindowCommand::ToggleFullScreen), "Full screen"),
    on(NONE, Key::Questionmark, Window(WindowCommand::ToggleKeys), "List of keys"),
    on(NONE, Key::Escape, Window(WindowCommand::Dismiss), "Close what covers the picture"),
    on(NONE, Key::W, View(ViewCommand::ToggleWipe), "Wipe between two pictures"),
    on(NONE, Key::Q, View(ViewCommand::ToggleSecond), "Switch between two pictures"),
    on(NONE, Key::H, Aim(AimCommand::Toggle), "Light by the face"),
    on(NONE, Key::D, View(ViewCommand::ToggleDoubts), "Show where errors are expected"),
    on(NONE, Key::R, channel(Channel::Red), "Red channel"),
    on(NONE, Key::G, channel(Channel::Green), "Green channel"),
    on(NONE, Key::B, channel(Channel::Blue), "Blue channel"),
    on(NONE, Key::A, channel(Channel::Alpha), "Matte"),
    on(NONE, Key::L, channel(Channel::Luminance), "Luminance"),
    on(NONE, Key::C, View(ViewCommand::Inspect(Inspection::Picture)), "All channels"),
    on(NONE, Key::PageUp, View(ViewCommand::StepSolo(-1)), "Solo the previous lamp"),
    on(NONE, Key::PageDown, View(ViewCommand::StepSolo(1)), "Solo the next lamp"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_bound_twice() {
        for (i, a) in BINDINGS.iter().enumerate() {
            let twice =
                BINDINGS[..i].iter().any(|b| (b.only.is_none() || a.only == b.only) && b.shortcut == a.shortcut);
            assert!(!twice, "{}", a.label);
        }
    }

    #[test]
    fn a_key_with_more_modifiers_is_asked_first() {
        for (i, a) in BINDINGS.iter().enumerate() {
            let (key, modifiers) = (a.shortcut.logical_key, a.shortcut.modifiers);
            let shadowed = BINDINGS[..i].iter().any(|b| {
                let meet = a.only.is_none() || b.only.is_none() || a.only == b.only;
                meet && b.shortcut != a.shortcut
                    && b.shortcut.logical_key == key
                    && modifiers.contains(b.shortcut.modifiers)
            });
            assert!(!shadowed, "{} is never reached", a.label);
        }
    }
}
