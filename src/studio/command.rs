//! What a person can ask for. Panels emit commands; the application applies them.

use super::compare::Compare;
use super::footages::FootageView;
use super::layout::{Pane, Workspace};
use super::order::Order;
use super::state::Keyed;
use super::training::TrainChoice;
use super::wizard::Plan;
use calibration::{Circle, Trial};
use evaluation::review::MarkedOlat;
use light::Lighting;
use light::conventions::Front;
use light::keyframes::Interpolation;
use project::Framing;
use scene::{Background, Effects, Inspection};
use std::path::PathBuf;
use worker::Need;

/// One wish. Those of the first group can be undone.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Light the subject by this entry of the list.
    Environment(usize),
    /// Light the subject by the entry this many places further, around the list's end.
    StepEnvironment(isize),
    /// Add panoramas to the list and show the first of them.
    AddEnvironments(Vec<PathBuf>),
    /// Take this entry out of the list, if a person added it; its file stays.
    RemoveEnvironment(usize),
    /// Which way is front in the file of this entry; none is not to have said it.
    Front(usize, Option<Front>),
    /// Set a key at the shown frame, or take the one there away.
    ToggleKey(Keyed),
    /// Bring the key at this place in the order to another frame, in place of a key that is there.
    MoveKey {
        of: Keyed,
        index: usize,
        frame: usize,
    },
    /// Take the key at this place in the order away.
    RemoveKey {
        of: Keyed,
        index: usize,
    },
    /// How values go from key to key.
    Interpolate(Keyed, Interpolation),
    /// Turn the environment to this yaw in degrees.
    Yaw(f32),
    /// Turn the environment by this many degrees.
    Turn(f32),
    /// Set the exposure in stops.
    Exposure(f32),
    /// Change the exposure by this many stops.
    StepExposure(f32),
    /// How the environment's light is turned, graded and joined by lights placed by hand.
    Lighting(Box<Lighting>),
    /// What is done to the picture.
    Effects(Effects),
    /// What is shown behind the subject.
    Background(Background),
    /// Take this for the mirror ball's silhouette; none is the project's own.
    Circle(Option<Circle>),
    /// Move the silhouette by pixels of the photograph, and enlarge its radius.
    NudgeCircle {
        by: [f64; 2],
        radius: f64,
    },
    /// Try this response of the camera; none is the calibration's own.
    Try(Option<Trial>),
    /// Change what is tried by these differences of γ1, γ2 and the exposure.
    NudgeTrial([f32; 3]),
    /// Train like this from the next start.
    Train(TrainChoice),

    /// Show another arrangement of the window.
    Workspace(Workspace),
    /// Show this pane: its tab comes to the front.
    Pane(Pane),
    /// Take this pane away, unless it is a main one.
    ClosePane(Pane),
    /// Keys are meant for this pane from now on.
    Activate(Pane),
    /// Give the workspace the arrangement that it had at first.
    ResetLayout,
    /// Show the mirror ball under this lamp; none is the interview's.
    Photograph(Option<usize>),
    /// Show the photograph this many places further; the interview's stands before the lamps'.
    StepPhotograph(isize),
    /// Show the pose in training under this lamp.
    TrainedLamp(usize),
    /// Show it under the lamp this many places further.
    StepTrainedLamp(isize),
    /// Relight this exemplar as the interview.
    Pose(usize),
    /// Where the line stands that wipes between two pictures: 0 left, 1 right.
    Wipe(f32),
    /// Put that line to the right, to the left or into the middle, in turn.
    StepWipe,
    /// Compare the picture with another.
    Compare(Compare),
    /// Wipe between the two pictures, or stop that.
    ToggleWipe,
    /// Show the other of the two pictures alone.
    ToggleSecond,
    /// Light the subject by the lamp this many places further alone.
    StepSolo(isize),
    /// Look at this in place of the picture, or at the picture again.
    Inspect(Inspection),
    /// Look at the pixel in this column and row.
    Probe(Option<[usize; 2]>),
    /// Look which checkpoints there are to compare with.
    ListCheckpoints,
    /// Ask for the folder of a truth with a dialog, and compare the picture with it.
    CompareTruth,
    /// Take the silhouette that was found in the photographs.
    FindCircle,
    /// Calibrate with what is set by hand, or by fitting where nothing is.
    Calibrate,

    /// Show the frame under this lamp alone; none is under the light.
    Solo(Option<usize>),
    /// Show it under this lamp too, or no longer.
    SoloAlso(usize),
    /// Compare the network with the truth: the one in this folder, or the one that was used last.
    Measure(Option<PathBuf>),
    /// Ask for a folder with truth with a dialog, and measure.
    ChooseTruth,
    /// Write the review's page.
    Report(PathBuf),
    /// Ask where the page shall be with a dialog, and write it.
    ChooseReport,
    /// Keep a verdict and a note.
    Mark(Box<MarkedOlat>),

    /// Undo the last of the above, and do it again.
    Undo,
    Redo,

    /// Go to this frame; playing stops.
    Frame(usize),
    /// Go this many frames on, as far as there are any; playing stops.
    StepFrame(isize),
    LastFrame,
    TogglePlay,

    /// Scale the picture by a factor about a point, given in points from the viewport's centre.
    Zoom {
        factor: f32,
        about: [f32; 2],
    },
    /// Move the picture by points.
    Pan([f32; 2]),
    /// Fit the picture into the viewport.
    Fit,
    /// Fit the picture and set the exposure to 0 stops.
    ResetView,
    /// Magnify so that a pixel of the picture is one of the screen.
    ActualSize,
    TogglePanels,
    ToggleFullScreen,
    ToggleKeys,
    /// Open the list of all commands, or close it.
    TogglePalette,
    /// Close whatever covers the picture, and leave full screen; where there is nothing of it, as
    /// [`Self::DismissRefusal`].
    Dismiss,
    /// Put away why something could not be done.
    DismissRefusal,

    /// Ask for files with a dialog, and add what is chosen.
    ChooseEnvironments,
    /// Ask for a project's folder with a dialog.
    ChooseProject,
    /// Open the project in a folder.
    OpenProject(PathBuf),
    /// What the next export is to be.
    Order(Box<Order>),
    /// Let the export begin, or end, with the frame that is shown.
    MarkIn,
    MarkOut,
    /// Ask for the export's name with a dialog.
    ChooseDestination,
    /// Take this file for the export's name.
    Destination(PathBuf),
    /// Put an export of what is set now at the end of the line.
    Export,
    /// Take an export out of the line; the one in hand is asked to stop.
    Withdraw(u64),
    /// Show a folder in the system's file manager.
    OpenFolder(PathBuf),
    /// Give the focus to the first control of the pane that keys are meant for.
    FocusPane,
    /// Take a folder out of the list of recent projects; nothing on the disk is changed.
    ForgetProject(PathBuf),
    /// Begin to make a project, of the shoot in a folder where it is known.
    NewProject(Option<PathBuf>),
    /// Go on with this plan for a project; none gives it up.
    Plan(Option<Box<Plan>>),
    /// Ask for the shoot's folder, or the new project's, with a dialog.
    ChooseShoot,
    ChooseProjectFolder,
    /// Make the planned project and open it.
    MakeProject,
    /// Make the demo in this folder and open its project.
    MakeDemo(PathBuf),
    /// Ask with a dialog where the project's shoot is now.
    ChooseLocation,
    /// The project's shoot is in this folder now.
    Locate(PathBuf),
    /// Look at another part of the footage, or at its mattes.
    Footage(FootageView),
    /// Read the thumbnails of these frames.
    Thumbnails(Vec<usize>),
    /// Work with this square of the pictures. What was made under another one is put aside.
    Reframe(Framing),
    /// Run the job that brings what is missing.
    Provide(Need),
    /// Train as was chosen: anew, or from where the checkpoint stands.
    StartTraining {
        fresh: bool,
    },
    /// Put the kept checkpoint of this name in place of the present one.
    GoBack(String),
    /// Pause the running job, or let it go on.
    PauseJob,
    /// Stop the running job; what is finished is kept.
    StopJob,
    /// Forget what is in the log.
    ClearLog,
    /// Put away what the last job said.
    DismissReport,
    /// Read the calibration and the network again.
    Reopen,
}
