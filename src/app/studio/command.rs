//! Commands of the user. Panels emit commands; the application applies them. The handler of each group matches it
//! exhaustively: a command without a handler does not compile.

pub use crate::panels::accuracy::command::AccuracyCommand;
pub use crate::panels::environments::command::EnvironmentsCommand;
pub use crate::panels::export::command::ExportCommand;
pub use crate::panels::footage::command::MatteCommand;
pub use crate::panels::light::command::LightsCommand;
pub use crate::panels::looks::command::LooksCommand;
pub use crate::panels::machine::command::MachineCommand;
pub use crate::panels::probe::command::CalibrationCommand;
pub use crate::panels::project::command::ProjectCommand;
pub use crate::panels::review::command::ReviewCommand;
pub use crate::panels::timeline::command::TimelineCommand;
pub use crate::panels::training::command::TrainingCommand;
pub use crate::panels::viewport::command::AimCommand;

use super::comparison::{CellPicture, CompareSettings};
use super::layout::{Pane, Workspace};
use super::look::{CopiedLight, Group};
use super::panels::footage::reader::FootageView;
use super::panels::training::query::TrainChoice;
use super::region::Region;
use super::stored_look::StoredLook;
use calibration::{Circle, Trial};
use color_config::ColorChoice;
use evaluation::review::Metric;
use farm::Engine;
use footage::candidate::Slot;
use glam::Vec3;
use light::Lighting;
use light::conventions::Front;
use light::keyframes::Keyframes;
use scene::{Background, Effects, Inspection, Setting, Viewing};
use std::path::PathBuf;
use std::sync::Arc;
use worker::Need;

/// A command, grouped by its handler.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    Look(LookCommand),
    View(ViewCommand),
    Aim(AimCommand),
    Window(WindowCommand),
    Calibration(CalibrationCommand),
    Training(TrainingCommand),
    Review(ReviewCommand),
    Accuracy(AccuracyCommand),
    Matte(MatteCommand),
    Export(ExportCommand),
    Project(ProjectCommand),
    Job(JobCommand),
    Machine(MachineCommand),
    Looks(LooksCommand),
    Timeline(TimelineCommand),
    Environments(EnvironmentsCommand),
    Lights(LightsCommand),
    Dialog(Dialog),
    /// Paths chosen in a dialog, or typed or dropped in its place.
    Chosen(Dialog, Vec<PathBuf>),
    /// A new file, typed instead of chosen in a dialog. A dialog would have asked before replacing an existing file.
    NewFile(Dialog, PathBuf),
}

/// Changes settings. Undoable.
#[derive(Clone, Debug, PartialEq)]
pub enum LookCommand {
    /// Light the subject with this entry of the list.
    Environment(usize),
    /// Add panoramas to the list and light with the first of them.
    AddEnvironments(Vec<PathBuf>),
    /// Add a panorama of a watched folder and light with it, in place of the one tried just before.
    TryEnvironment(PathBuf),
    /// Remove this entry from the list, if it was added by hand; its file stays.
    RemoveEnvironment(usize),
    /// Set the front direction in the file of this entry; None if unknown.
    Front(usize, Option<Front>),
    /// Apply a stored look; if its environment's file `exists`, it is added to the list where needed.
    Apply {
        look: Arc<StoredLook>,
        exists: bool,
    },
    /// Set a key at the current frame, or remove the existing one.
    ToggleKey(Setting),
    /// Replace the keys of these settings.
    Keys(Vec<(Setting, Keyframes)>),
    /// Set a setting to this value.
    Set(Setting, f32),
    /// Turn the environment by this many degrees.
    Turn(f32),
    /// Change the environment's rotation and grade, and the lights placed by hand.
    Lighting(Box<Lighting>),
    /// Add a light, with its keys.
    AddLight(Box<CopiedLight>),
    /// Place a light, or move the one placed by the same drag.
    Aim(AimedLight),
    /// Effects on the picture.
    Effects(Effects),
    /// Background behind the subject.
    Background(Background),
    /// Use this outline of the mirror ball; None for the project's.
    Circle(Option<Circle>),
    /// Try this camera response; None for the calibration's.
    Trial(Option<Trial>),
    /// Play and export this range of frames; None for all.
    Range(Option<(usize, usize)>),
    /// Use these settings for the next training from the start.
    Training(TrainChoice),
    /// Reset the settings of one group.
    Reset(Group),
    Undo,
    Redo,
}

/// A light whose direction follows from a point in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AimedLight {
    /// Number of the drag. One drag makes one light and one undo step.
    pub drag: u64,
    /// Frame of the picture, and the column and row on which the light falls.
    pub frame: usize,
    pub pixel: [usize; 2],
    /// Unit vector from the subject towards the light.
    pub direction: Vec3,
}

/// Changes the view. Not undoable.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewCommand {
    /// Show the mirror ball under this lamp; None for the interview's light.
    Photograph(Option<usize>),
    /// Show the photograph this many places further. The interview's photograph comes before those of the lamps.
    StepPhotograph(isize),
    /// Show the training pose under this lamp.
    TrainedLamp(usize),
    /// Show the training pose under the lamp this many places further.
    StepTrainedLamp(isize),
    /// Relight this exemplar to match the interview.
    Pose(usize),
    /// Position of the wipe between two pictures: 0 left, 1 right.
    Wipe(f32),
    /// Step the wipe: right, left, middle.
    StepWipe,
    /// Change the comparison with another picture.
    Compare(CompareSettings),
    /// Start or stop the wipe between the two pictures.
    ToggleWipe,
    /// Switch to the other of the two pictures.
    ToggleSecond,
    /// Show or hide the map of expected errors over the picture.
    ToggleDoubts,
    /// Show a measured cell (frame or pose, and lamp) beside the truth; None to leave it.
    Cell(Option<(usize, usize)>),
    /// Show only this picture of the cell; None for all three.
    Enlarge(Option<CellPicture>),
    /// Show only the cell's prediction, or its truth if the prediction is shown.
    FlipCell,
    /// Sort measured cells by this metric.
    Metric(Metric),
    /// Multiply differences by one of [`super::comparison::GAINS`].
    Gain(f32),
    /// Show the frame under this lamp only; None for the environment.
    Solo(Option<usize>),
    /// Add this lamp to the solo lamps, or remove it.
    SoloAlso(usize),
    /// Show the frame under the lamp this many places further.
    StepSolo(isize),
    /// Select the placed light with this index.
    ChooseLight(Option<usize>),
    /// Fold or unfold the lights of the group with this id.
    FoldLights(u32, bool),
    /// Change the viewing settings of the picture, which are never exported.
    Viewing(Viewing),
    /// View through an OpenColorIO view instead of a tone curve; None to leave it.
    LookThrough(Option<ColorChoice>),
    /// Change the viewing exposure by this many stops.
    StepViewing(f32),
    /// Show this image instead of the picture; None for the picture.
    Inspect(Inspection),
    /// Reset the zoom and the viewing settings.
    ResetView,
    /// Read the values of the pixel in this column and row.
    Pixel(Option<[usize; 2]>),
    /// Read the averages of this region; None to read pixels.
    Region(Option<Region>),
    /// Show another part of the footage, or its mattes.
    Footage(FootageView),
    /// Go to this frame and stop playback.
    Frame(usize),
    /// Go this many frames further, within the clip, and stop playback.
    StepFrame(isize),
    LastFrame,
    TogglePlay,
    /// Loop between the in and out points, or stop playback at the out point.
    ToggleLoop,
    /// Set the in point to the current frame, or the out point.
    MarkIn,
    MarkOut,
    /// Scale the picture by a factor about a point, given in points from the viewport's centre.
    Zoom {
        factor: f32,
        about: [f32; 2],
    },
    /// Move the picture, in points.
    Pan([f32; 2]),
    /// Fit the picture into the viewport.
    Fit,
}

/// Changes the layout of the window and the lists over it.
#[derive(Clone, Debug, PartialEq)]
pub enum WindowCommand {
    /// Switch to a workspace.
    Workspace(Workspace),
    /// Show this pane: its tab comes to the front.
    ShowPane(Pane),
    /// Close this pane, unless it is a main pane.
    ClosePane(Pane),
    /// Send keys to this pane from now on.
    Activate(Pane),
    /// Restore the workspace's original layout.
    ResetLayout,
    /// Fold or unfold a heading.
    Fold(String, bool),
    /// Move the focus to the first control of the active pane.
    FocusPane,
    TogglePanels,
    /// Show only the picture and the light, or all panels.
    ToggleLightAlone,
    ToggleFullScreen,
    ToggleKeys,
    /// Open or close the list of all commands.
    TogglePalette,
    /// Open or close the performance report of this machine.
    ToggleMachine,
    /// Zoom to one picture pixel per screen pixel.
    ActualSize,
    /// Close or leave the first that applies: what covers the picture, full screen, the four looks, the three points of
    /// the rim, placing lights on the picture if nothing narrows the view, the refusal as in [`Self::DismissRefusal`],
    /// an enlarged picture of a cell, the cell, the region, solo lamps, solo lights, the light selection.
    Dismiss,
    /// Close the message about a refused command.
    DismissRefusal,
    /// Close the window, even if work is running.
    Close,
    /// Close the path field.
    ClosePath,
    /// Close the question about ending work: work continues.
    KeepOpen,
    /// Choose a different name than that of the existing file.
    KeepName,
    /// Report whether everything is saved.
    TellSaved,
    /// Close the last message of a job.
    DismissMessage,
    ClearLog,
}

/// Commands for jobs.
#[derive(Clone, Debug, PartialEq)]
pub enum JobCommand {
    /// Run the job that makes what is missing.
    Provide(Need),
    /// Pause or resume the running job.
    Pause,
    /// Stop the running job; finished work is kept.
    Stop,
}

/// Purpose of a file dialog. The choice returns as a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialog {
    /// Panoramas to add.
    Environments,
    /// A folder of panoramas to watch.
    EnvironmentFolder,
    /// True OLATs for a comparison with the picture.
    ComparisonTruth,
    /// A project to open.
    Project,
    /// The shoot of a new project.
    Shoot,
    /// A movie of a new project's shoot.
    ShootPart(Slot),
    /// The folder of a new project.
    ProjectFolder,
    /// New folder of the open project's shoot.
    ShootLocation,
    /// A still or movie behind the subject.
    Background,
    /// The next export's file.
    Destination,
    /// Folder for a farm job of this engine.
    FarmFolder(Engine),
    /// True OLATs to measure against.
    Truth,
    /// File for the review's page.
    ReportPage,
    /// File for the report on this machine.
    MachineReport,
    /// File for a look.
    SaveLook,
    /// A look to apply and store.
    LoadLook,
}
