//! `afterlight farm`, and the commands that its workers run.

use super::OutputArgs;
use super::relight::ExportArgs;
use super::train::TrainingArgs;
use base::error::Result;
use clap::Args;
use farm::{ChunkSettings, FarmSettings, FrameSpan, Training};
use gpu::DeviceChoice;
use std::path::PathBuf;
use worker::Job;

/// Write a job for a render farm: the interview relit in chunks, on many machines. Nothing is submitted.
///
/// The job contains a snapshot of the project, so that you can go on working on it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight farm interview --environment courtyard.hdr --output relit.mov --engine slurm --to jobs/interview",
    // Here --to is the job, and chunks always resume.
    mut_arg("to", |arg| arg.long("output").value_name("FILE").help(
        "Output of the job: stills as out.%04d.png, .tif or .exr, a movie as clip.mp4, .mov, .mkv or .mxf"
    )),
    mut_arg("resume", |arg| arg.hide(true))
)]
pub struct FarmArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    farm: FarmSettings,
    #[command(flatten)]
    chunks: ChunkSettings,
    #[command(flatten)]
    export: ExportArgs,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FarmArgs {
    /// The requested job.
    ///
    /// # Errors
    /// When the keys cannot be read or are too large.
    pub fn job(self) -> Result<Job> {
        Ok(Job::Farm {
            project: self.project,
            settings: Box::new(self.export.settings()?),
            farm: self.farm,
            chunks: self.chunks,
        })
    }
}

/// Write a job for a render farm that trains networks, one task per project. Nothing is submitted.
///
/// Each task trains a copy of its project; `afterlight checkpoints PROJECT --adopt DIR` brings the result back.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight farm-train monday tuesday --preset paper --engine slurm --to jobs/training"
)]
pub struct FarmTrainArgs {
    /// The projects' folders.
    #[arg(required = true)]
    projects: Vec<PathBuf>,
    #[command(flatten)]
    farm: FarmSettings,
    #[command(flatten)]
    training: TrainingArgs,
    /// A rung: train with these settings changed, from the start, as a separate task. Can be given several times;
    /// without it each project has one task.
    #[arg(long, value_name = "KEY=VALUE,…")]
    rung: Vec<String>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FarmTrainArgs {
    /// The requested job.
    ///
    /// # Errors
    /// When a setting is invalid.
    pub fn job(self) -> Result<Job> {
        let settings = self.training.settings()?;
        let mut trainings = Vec::new();
        for rung in &self.rung {
            let mut settings = settings.clone();
            settings.fresh = true;
            rung.split(',').try_for_each(|set| settings.config.set(set))?;
            let name = rung.clone();
            trainings.push(Training { name, settings });
        }
        if trainings.is_empty() {
            let name = String::new();
            trainings.push(Training { name, settings });
        }
        Ok(Job::FarmTrain { projects: self.projects, trainings, farm: self.farm })
    }
}

/// Run one part of a farm's job: relight frames, or train one network. Can be repeated at any time.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight farm-chunk jobs/interview --frames 500-749")]
pub struct FarmChunkArgs {
    /// The job's folder.
    job: PathBuf,
    /// Frames A to B, or N frames from A on. Complete frames of this job are kept.
    #[arg(long, value_name = "A-B|A+N", required_unless_present = "task")]
    frames: Option<FrameSpan>,
    /// Index of a training task, from 0.
    #[arg(long, value_name = "K", conflicts_with = "frames")]
    task: Option<usize>,
    /// Device of the network [default: the job's].
    #[arg(long, value_enum, conflicts_with = "task")]
    device: Option<DeviceChoice>,
    /// The footage's folder, if it is mounted at another path here.
    #[arg(long, value_name = "DIR", conflicts_with = "task")]
    shoot: Option<PathBuf>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FarmChunkArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        match (self.frames, self.task) {
            (None, task) => Job::FarmTask { job: self.job, task: task.unwrap_or_default() },
            (Some(frames), _) => Job::FarmChunk { job: self.job, frames, device: self.device, shoot: self.shoot },
        }
    }
}

/// Finish a farm's job: check every frame, then make the movie with sound and time code. Names the parts to run
/// again.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight farm-assemble jobs/interview")]
pub struct FarmAssembleArgs {
    /// The job's folder.
    job: PathBuf,
    /// The footage's folder, if it is mounted at another path here.
    #[arg(long, value_name = "DIR")]
    shoot: Option<PathBuf>,
    #[command(flatten)]
    pub output: OutputArgs,
}

impl FarmAssembleArgs {
    /// The requested job.
    pub fn job(self) -> Job {
        Job::FarmAssemble { job: self.job, shoot: self.shoot }
    }
}
