//! Commands of a person. Panels emit commands; the application applies them. Each group is matched
//! exhaustively by the code that handles it: a command without an effect does not compile.

use super::comparison::{CellPicture, CompareSettings};
use super::export_options::ExportOptions;
use super::footage_reader::{FootageView, Thumbnail};
use super::four_looks::FourSlot;
use super::layout::{Pane, Workspace};
use super::look::{AppliedLook, CopiedLight, Group};
use super::region::Region;
use super::stored_looks::LookId;
use super::training::TrainChoice;
use super::wizard::Plan;
use calibration::{Circle, Trial};
use color_config::ColorChoice;
use evaluation::review::{Mark, MarkedOlat, Metric};
use farm::Engine;
use footage::candidate::Slot;
use footage::{BrushSide, Stroke};
use glam::Vec3;
use light::Lighting;
use light::conventions::Front;
use light::keyframes::Keyframes;
use project::Framing;
use scene::{Background, Effects, Inspection, Setting, Viewing};
use std::path::PathBuf;
use tradeoff::TradeoffSettings;
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
    /// These paths were chosen in a dialog, or typed or dropped in its place.
    Chosen(Dialog, Vec<PathBuf>),
    /// This file to write was typed in place of a dialog, which would have asked before it replaces one.
    NewFile(Dialog, PathBuf),
}

/// Changes settings that can be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum LookCommand {
    /// Light the subject by this entry of the list.
    Environment(usize),
    /// Add panoramas to the list and show the first of them.
    AddEnvironments(Vec<PathBuf>),
    /// Take this entry out of the list, if a person added it; its file stays.
    RemoveEnvironment(usize),
    /// Front in the file of this entry; None if not known.
    Front(usize, Option<Front>),
    /// Show a stored look.
    Apply(Box<AppliedLook>),
    /// Set a key at the current frame, or remove the one that is there.
    ToggleKey(Setting),
    /// Give settings these keys in place of their own.
    Keys(Vec<(Setting, Keyframes)>),
    /// Turn the environment to this yaw in degrees.
    Yaw(f32),
    /// Turn the environment by this many degrees.
    Turn(f32),
    /// Set the exposure in stops.
    Exposure(f32),
    /// Turn and grade of the environment's light, and the lights placed by hand.
    Lighting(Box<Lighting>),
    /// Add a light with its keys.
    AddLight(Box<CopiedLight>),
    /// Place a light, or move the one that the same drag has placed.
    Aim(AimedLight),
    /// Effects on the picture.
    Effects(Effects),
    /// Background behind the subject.
    Background(Background),
    /// Use this outline of the mirror ball; None for the project's own.
    Circle(Option<Circle>),
    /// Try this camera response; None for the calibration's own.
    Trial(Option<Trial>),
    /// Play and export from this frame to that; None for all.
    Range(Option<(usize, usize)>),
    /// Train with these settings from the next start.
    Training(TrainChoice),
    /// Give the settings under one heading their defaults.
    Reset(Group),
    Undo,
    Redo,
}

/// A light whose direction follows from a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AimedLight {
    /// Number of the drag: all of a drag is one light and one step of undo.
    pub drag: u64,
    /// The frame, and its picture's column and row, on which the light falls.
    pub frame: usize,
    pub pixel: [usize; 2],
    /// From the subject towards the light; a unit vector.
    pub direction: Vec3,
}

/// Lights the subject by where the light should fall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AimCommand {
    /// Have a press on the picture place a light, or turn the environment again.
    Toggle,
    /// The pointer was pressed: what follows moves the light of this index, or places another.
    Begin(Option<usize>),
    /// The pointer is over this column and row of the picture, or beside it.
    At(Option<[usize; 2]>),
}

/// Changes what is shown. It cannot be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewCommand {
    /// Show the mirror ball under this lamp; None for the interview's light.
    Photograph(Option<usize>),
    /// Show the photograph this many places further; the interview's comes before the lamps'.
    StepPhotograph(isize),
    /// Show the pose in training under this lamp.
    TrainedLamp(usize),
    /// Show it under the lamp this many places further.
    StepTrainedLamp(isize),
    /// Relight this exemplar as the interview.
    Pose(usize),
    /// Position of the wipe between two pictures: 0 left, 1 right.
    Wipe(f32),
    /// Move the wipe to the right, to the left or to the middle, in turn.
    StepWipe,
    /// Compare the picture with another.
    Compare(CompareSettings),
    /// Wipe between the two pictures, or stop that.
    ToggleWipe,
    /// Show the other of the two pictures alone.
    ToggleSecond,
    /// Show over the picture where errors are expected, or stop that.
    ToggleDoubts,
    /// Show a measured frame or pose and lamp beside the truth; None to end that.
    Cell(Option<(usize, usize)>),
    /// Show this picture of the cell alone; None for all three.
    Enlarge(Option<CellPicture>),
    /// Show the cell's prediction alone, or its truth in place of that.
    FlipCell,
    /// Order measured cells by this metric.
    Metric(Metric),
    /// Multiply differences by one of [`super::comparison::GAINS`].
    Gain(f32),
    /// Show the frame under this lamp alone; None for the environment.
    Solo(Option<usize>),
    /// Add this lamp to those that are shown, or remove it.
    SoloAlso(usize),
    /// Show the frame under the lamp this many places further.
    StepSolo(isize),
    /// Choose the light placed by hand that has this index.
    ChooseLight(Option<usize>),
    /// Hide the lights of the group with this id, or show them again.
    FoldLights(u32, bool),
    /// Viewing settings of the picture; none of them is exported.
    Viewing(Viewing),
    /// Look through a view of the OpenColorIO configuration in place of a tone curve; None to end that.
    LookThrough(Option<ColorChoice>),
    /// Change the viewing exposure by this many stops.
    StepViewing(f32),
    /// Look at this in place of the picture, or at the picture again.
    Inspect(Inspection),
    /// Fit the picture, and show it as it is exported.
    ResetView,
    /// Read the values of the pixel in this column and row.
    Pixel(Option<[usize; 2]>),
    /// Read the means of this part of the picture; None for pixels alone.
    Region(Option<Region>),
    /// Show another part of the footage, or its mattes.
    Footage(FootageView),
    /// Go to this frame; playing stops.
    Frame(usize),
    /// Go this many frames on, as far as there are any; playing stops.
    StepFrame(isize),
    LastFrame,
    TogglePlay,
    /// Go around the range between in and out while playing, or stop at its end.
    ToggleLoop,
    /// Play and export from the current frame on, or up to it.
    MarkIn,
    MarkOut,
    /// Scale the picture by a factor about a point, in points from the viewport's centre.
    Zoom {
        factor: f32,
        about: [f32; 2],
    },
    /// Move the picture by points.
    Pan([f32; 2]),
    /// Fit the picture into the viewport.
    Fit,
}

/// Changes how the window is arranged and what covers it.
#[derive(Clone, Debug, PartialEq)]
pub enum WindowCommand {
    /// Show another arrangement of the window.
    Workspace(Workspace),
    /// Show this pane: its tab comes to the front.
    ShowPane(Pane),
    /// Close this pane, unless it is a main one.
    ClosePane(Pane),
    /// Keys go to this pane from now on.
    Activate(Pane),
    /// Give the workspace its original arrangement.
    ResetLayout,
    /// Hide what stands under a heading, or show it again.
    Fold(String, bool),
    /// Give the focus to the first control of the active pane.
    FocusPane,
    TogglePanels,
    ToggleFullScreen,
    ToggleKeys,
    /// Open the list of all commands, or close it.
    TogglePalette,
    /// Open what this machine can do, or close it.
    ToggleMachine,
    /// Zoom until a pixel of the picture is one of the screen.
    ActualSize,
    /// Close what covers the picture, leave full screen, do as [`Self::DismissRefusal`], leave the four looks, show all
    /// pictures of a cell, leave the cell, read pixels instead of a region, light by all lamps and lights again, stop placing
    /// lights on the picture, or choose no light: the first of these that applies.
    Dismiss,
    /// Close the message that says why something could not be done.
    DismissRefusal,
    /// Close the window, whatever is running.
    Close,
    /// Close the field for a path.
    ClosePath,
    /// Close the question whether work may end: it goes on.
    KeepOpen,
    /// Type another name than that of the file which would be replaced.
    KeepName,
    /// Say whether all is saved.
    TellSaved,
    /// Close the last message of a job.
    DismissMessage,
    ClearLog,
}

/// Measures what this machine can do.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineCommand {
    /// Measure for at most so many minutes.
    Measure(f64),
    /// Write what was found into this file.
    Save(PathBuf),
}

/// Stores looks, shows stored ones, and shows them side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum LooksCommand {
    /// Store the present look under this name; a new version, if there is a look of this name.
    Store(String),
    /// Store the present look as a new version of this one.
    Update(LookId),
    /// Show a version of a look, by its number; None for the newest.
    Apply(LookId, Option<u32>),
    Rename(LookId, String),
    Duplicate(LookId),
    /// Take a look off its shelf; it can be brought back.
    Remove(LookId),
    /// Bring back a look that was removed.
    BringBack(LookId),
    /// Keep a look for all projects, or take one of those into this project.
    Copy(LookId),
    /// Ask for a file to write a look into.
    SaveAs(LookId),
    /// Write the look that was asked for into this file.
    Write(PathBuf),
    /// Show the look in a file, and store it under the file's name.
    Load(PathBuf),
    /// Show four looks side by side, or the picture again.
    ToggleFour,
    /// Show this in a place of the four: 0 to 3 from the upper left.
    Place(usize, FourSlot),
    /// Make what is in a place of the four the present look.
    Pick(usize),
}

/// Goes along the timeline, and changes its keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimelineCommand {
    /// Show all frames.
    ShowAll,
    /// Go to the next key of the chosen lane, or of any if none is chosen; to the one before if negative.
    StepKey(isize),
    /// Select all keys of the curve or of the lanes.
    SelectAll,
    /// Move the selected keys by so many frames.
    Nudge(isize),
}

/// Changes how environments are listed.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentsCommand {
    /// Light the subject by the entry this many places further in the list as it is shown, around its end.
    Step(isize),
    /// Read the panorama of this entry again, which could not be read.
    ReadAgain(usize),
    /// Make an entry of the list a favourite, or no longer; None for the one that is shown.
    ToggleFavourite(Option<usize>),
    /// List those alone that have each of these words.
    Search(String),
}

/// Adds, copies and removes lights placed by hand: each is one step of undo. The chosen one is that of
/// [`super::State::chosen_light`].
#[derive(Clone, Debug, PartialEq)]
pub enum LightsCommand {
    /// Add a softbox, and choose it.
    Add,
    /// Add another light like the chosen one, with its keys, and choose it.
    Duplicate,
    /// Put the chosen light with its keys on the clipboard.
    Copy,
    /// Add the light that a text from the clipboard holds, and choose it.
    Paste(String),
    /// Remove the chosen light, with its keys.
    Remove,
    /// Give the group of this index another name.
    RenameGroup(usize, String),
    /// Remove the group of this index; its lights stay.
    RemoveGroup(usize),
}

/// Calibrates, by hand or by fitting.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationCommand {
    /// Use the outline that was found in the photographs.
    FindCircle,
    /// Move the outline by pixels of the photograph, and enlarge its radius.
    NudgeCircle { by: [f64; 2], radius: f64 },
    /// Change the tried response by these differences of γ1, γ2 and the exposure.
    NudgeTrial([f32; 3]),
    /// Calibrate with what is set by hand; the rest is fitted.
    Start,
}

/// Trains the network.
#[derive(Clone, Debug, PartialEq)]
pub enum TrainingCommand {
    /// Train with the chosen settings: from the start, or from the checkpoint on.
    Start { fresh: bool },
    /// Restore the saved checkpoint of this name.
    GoBack(String),
    /// Read which checkpoints there are.
    ListCheckpoints,
}

/// Compares the network with the truth.
#[derive(Clone, Debug, PartialEq)]
pub enum ReviewCommand {
    /// Measure against the truth in this folder, or the one that was used last.
    Measure(Option<PathBuf>),
    /// Write the review's page.
    Report(PathBuf),
    /// Save a verdict and a note.
    Mark(Box<MarkedOlat>),
    /// Give the chosen cell a verdict.
    Verdict(Mark),
    /// Choose a cell, by its indices of case and lamp in the review, and show it beside its truth.
    Choose((usize, usize)),
    /// Choose the worst cell after the chosen one that has no verdict.
    NextWorst,
    /// Estimate the errors of all frames, and which are unlike every pose.
    Trust,
}

/// Measures what accuracy costs in time, and chooses.
#[derive(Clone, Debug, PartialEq)]
pub enum AccuracyCommand {
    /// Measure, or go on with it.
    Measure(Box<TradeoffSettings>),
    /// Use the network of this rung.
    Apply(String),
    /// Read these pictures of rungs.
    Draw(Vec<String>),
}

/// Paints mattes.
#[derive(Clone, Debug, PartialEq)]
pub enum MatteCommand {
    /// Take the brush, or lay it down.
    Tool(bool),
    ToggleTool,
    /// Effect of the brush: to keep or to remove.
    Side(BrushSide),
    SwapSide,
    /// The brush's radius in pixels of the plate.
    Radius(f32),
    /// Make the brush larger by so many steps, or smaller.
    StepRadius(i32),
    /// Add a stroke.
    Stroke(Box<Stroke>),
    /// Take away the strokes of this frame.
    Clear(usize),
    /// Make all mattes that the shoot does not bring.
    MakeAll,
}

/// Exports clips and stills.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportCommand {
    /// Options of the next export.
    Options(Box<ExportOptions>),
    /// Take this file as the export's name.
    Destination(PathBuf),
    /// Add an export of the current settings to the queue.
    Add,
    /// Write an export of the current settings as a job for this engine into a new folder in this one.
    Farm(Engine, PathBuf),
    /// Take an export out of the queue; a running one is asked to stop.
    Withdraw(u64),
    /// Show a folder in the system's file manager.
    OpenFolder(PathBuf),
}

/// Opens, makes and changes projects.
#[derive(Clone, Debug, PartialEq)]
pub enum ProjectCommand {
    /// Open the project in a folder, after a question if work would end.
    Open(PathBuf),
    /// Open the project that was asked about: the work ends.
    Leave,
    /// Read the open project again.
    Reopen,
    /// Remove a folder from the recent projects; nothing on the disk changes.
    Forget(PathBuf),
    /// Plan a project, of the shoot in a folder if it is known.
    New(Option<PathBuf>),
    /// Change the plan for a project; None gives it up.
    Plan(Option<Box<Plan>>),
    /// Bring files or folders of a shoot to the plan, as parts of this kind or as they are guessed.
    Bring(Vec<PathBuf>, Option<Slot>),
    /// Make the planned project and open it.
    Make,
    /// Make the demo in this folder and open its project.
    MakeDemo(PathBuf),
    /// The project's shoot is in this folder now.
    Locate(PathBuf),
    /// Work with this square of the pictures. What was made with another is put aside.
    Reframe(Framing),
    /// Read these thumbnails, which this pane has room for.
    Thumbnails(Pane, Vec<Thumbnail>),
}

/// Commands for any job.
#[derive(Clone, Debug, PartialEq)]
pub enum JobCommand {
    /// Run the job that makes what is missing.
    Provide(Need),
    /// Pause the running job, or continue it.
    Pause,
    /// Stop the running job; what is finished is kept.
    Stop,
}

/// Purpose of a file dialog; the choice comes back as a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialog {
    /// Panoramas to add.
    Environments,
    /// True OLATs to compare the picture with.
    ComparisonTruth,
    /// A project to open.
    Project,
    /// The shoot of a new project.
    Shoot,
    /// A movie of a new project's shoot.
    ShootPart(Slot),
    /// The folder of a new project.
    ProjectFolder,
    /// Present folder of the open project's shoot.
    ShootLocation,
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
    /// A look to show and store.
    LoadLook,
}
