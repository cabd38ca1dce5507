//! Long actions, shared by the command line and the studio.

mod run;

pub use run::find_person;

use crate::demo;
use crate::latest::Latest;
use base::error::Result;
use benchmark::{DeviceSettings, MachineReport};
use calibration::CalibrateSettings;
use calibration::develop::DevelopSettings;
use confidence::ConfidenceSettings;
use evaluation::EvaluateSettings;
use evaluation::blind::BlindSettings;
use evaluation::review::ReviewSettings;
use export::relight::RelightSettings;
use farm::{ChunkSettings, FarmSettings, FrameSpan, Training};
use footage::{FrameSettings, ImportSettings, LampSettings, MatteSettings};
use gpu::DeviceChoice;
use project::{EnvironmentChange, Lock};
use std::path::PathBuf;
use std::sync::Arc;
use tradeoff::TradeoffSettings;
use training::TrainSettings;
use virtual_stage::StageSettings;

/// A long action and all its inputs.
#[derive(Clone, Debug)]
pub enum Job {
    /// Trace a shoot with the virtual stage into `folder`.
    Stage { folder: PathBuf, settings: StageSettings },
    /// Make a project in `project` that points at the shoot in `shoot`.
    Import {
        project: PathBuf,
        shoot: PathBuf,
        settings: ImportSettings,
        corrections: LampSettings,
        /// Use only this many of the lamps, evenly distributed.
        lamps: Option<usize>,
        /// Name of the project; None for the shoot's.
        name: Option<String>,
    },
    /// Change the environments of the project in `project`, and their front directions.
    Environments { project: PathBuf, change: EnvironmentChange },
    /// Make a light probe from photographs of a mirror ball.
    Develop { settings: Box<DevelopSettings> },
    /// Find lamps, weights and camera response of the project in `project`.
    Calibrate { project: PathBuf, settings: CalibrateSettings },
    /// Check the project in `project` under these environments: names or files; if there are none, all of the
    /// project's.
    Check { project: PathBuf, environments: Vec<PathBuf> },
    /// Train the network of the project in `project`.
    Train { project: PathBuf, settings: TrainSettings },
    /// Replace the checkpoint of the project in `project` by an earlier one, named by its step or its folder.
    GoBack { project: PathBuf, to: String },
    /// Replace the checkpoint of the project in `project` by that of its copy in `from`, which was trained elsewhere.
    Adopt { project: PathBuf, from: PathBuf },
    /// Write a job for a farm that relights the interview of the project in `project`.
    Farm { project: PathBuf, settings: Box<RelightSettings>, farm: FarmSettings, chunks: ChunkSettings },
    /// Write a job for a farm that trains the networks of these projects.
    FarmTrain { projects: Vec<PathBuf>, trainings: Vec<Training>, farm: FarmSettings },
    /// Relight frames of the job in `job`, as a worker of a farm. `shoot` is the footage's folder, if it was
    /// moved.
    FarmChunk { job: PathBuf, frames: FrameSpan, device: Option<DeviceChoice>, shoot: Option<PathBuf> },
    /// Train a network of the job in `job`, as a worker of a farm.
    FarmTask { job: PathBuf, task: usize },
    /// Check the frames of the job in `job` and make its movie.
    FarmAssemble { job: PathBuf, shoot: Option<PathBuf> },
    /// Relight the interview and write it.
    Relight { project: PathBuf, settings: Box<RelightSettings> },
    /// Measure against a truth.
    Evaluate { project: PathBuf, settings: EvaluateSettings },
    /// Compare every predicted OLAT with its truth.
    Review { project: PathBuf, settings: ReviewSettings },
    /// Write a page that compares methods blindly, with its key in the project in `project`.
    Blind { project: PathBuf, settings: BlindSettings },
    /// Collect the answers in `files` in the project in `project`, and count all of its answers.
    Answers { project: PathBuf, files: Vec<PathBuf> },
    /// Estimate the prediction error for the project in `project`.
    Confidence { project: PathBuf, settings: ConfidenceSettings },
    /// Measure speed against accuracy on the project in `project`.
    Tradeoff { project: PathBuf, settings: Box<TradeoffSettings> },
    /// Make the project in `project` use the network of a measured rung.
    Apply { project: PathBuf, rung: String },
    /// Run the demo in `folder`, or only make its project. Its training ends after `minutes`, including earlier
    /// runs.
    Demo { folder: PathBuf, prepare: bool, minutes: f64, device: DeviceChoice },
    /// Measure this machine's capabilities. `program` is started for each measurement.
    Device {
        program: PathBuf,
        settings: DeviceSettings,
        /// Slot for the report so far, filled after each measurement.
        known: Option<Arc<Latest<MachineReport>>>,
    },
    /// Write the project's network as a small file, for archiving or hand-over.
    Pack { project: PathBuf, to: PathBuf },
    /// Use another crop of the project's pictures.
    Frame { project: PathBuf, settings: FrameSettings },
    /// Correct the lamps of the project in `project`.
    Lamps { project: PathBuf, settings: LampSettings },
    /// Make the mattes that the shoot of the project in `project` lacks, or remake all of the project's own.
    Matte { project: PathBuf, settings: MatteSettings },
}

/// Name of a training while it runs.
pub const TRAINING: &str = "training the network";

impl Job {
    /// Name of the work, for the window and the progress bar.
    pub fn what(&self) -> &'static str {
        match self {
            Self::Stage { .. } => "tracing a shoot",
            Self::Import { .. } => "importing the shoot",
            Self::Environments { .. } => "listing the environments",
            Self::Develop { .. } => "making a light probe",
            Self::Calibrate { .. } => "calibrating",
            Self::Check { .. } => "checking the project",
            Self::Train { .. } => TRAINING,
            Self::GoBack { .. } => "going back to a checkpoint",
            Self::Relight { .. } => "relighting the interview",
            Self::Adopt { .. } => "adopting a checkpoint",
            Self::Farm { .. } | Self::FarmTrain { .. } => "writing a job for the farm",
            Self::FarmChunk { .. } => "relighting frames of a job",
            Self::FarmTask { .. } => TRAINING,
            Self::FarmAssemble { .. } => "assembling a job",
            Self::Evaluate { .. } => "measuring",
            Self::Review { .. } => "reviewing the network",
            Self::Blind { .. } => "making the blind comparison",
            Self::Answers { .. } => "counting answers",
            Self::Confidence { .. } => "estimating errors",
            Self::Tradeoff { .. } => "measuring speed against accuracy",
            Self::Apply { .. } => "applying a rung",
            Self::Demo { .. } => "making the demo",
            Self::Device { .. } => "measuring this machine",
            Self::Pack { .. } => "packing the network",
            Self::Frame { .. } => "framing the pictures",
            Self::Lamps { .. } => "correcting the lamps",
            Self::Matte { .. } => "making mattes",
        }
    }

    /// Folder of the project that this job writes into; None if there is none.
    pub fn writes(&self) -> Option<PathBuf> {
        match self {
            Self::Import { project, .. }
            | Self::Calibrate { project, .. }
            | Self::Train { project, .. }
            | Self::GoBack { project, .. }
            | Self::Adopt { project, .. }
            | Self::Review { project, .. }
            | Self::Blind { project, .. }
            | Self::Answers { project, .. }
            | Self::Confidence { project, .. }
            | Self::Tradeoff { project, .. }
            | Self::Apply { project, .. }
            | Self::Frame { project, .. }
            | Self::Lamps { project, .. }
            | Self::Matte { project, .. } => Some(project.clone()),
            Self::Demo { folder, .. } => Some(demo::project_folder(folder)),
            // The environment list is merged with what others write.
            Self::Environments { .. }
            | Self::Stage { .. }
            | Self::Develop { .. }
            | Self::Check { .. }
            | Self::Relight { .. }
            | Self::Farm { .. }
            | Self::FarmTrain { .. }
            | Self::FarmChunk { .. }
            | Self::FarmTask { .. }
            | Self::FarmAssemble { .. }
            | Self::Evaluate { .. }
            | Self::Device { .. }
            | Self::Pack { .. } => None,
        }
    }

    /// Locks the project that this job writes into against other writers. A program with the project open, such
    /// as the studio, already holds the lock for its jobs.
    ///
    /// # Errors
    /// When somebody else writes there.
    pub fn lock(&self) -> Result<Option<Lock>> {
        // A project that does not exist yet needs no lock.
        let there = self.writes().filter(|project| project.is_dir());
        there.map(|project| Lock::take(&project, self.what())).transpose()
    }
}
