//! The command line. Each command reads its arguments, runs one action of the library with a progress bar on
//! stderr, and prints its figures: sentences, or with `--json` one object.

mod blind;
mod check;
mod checkpoints;
mod confidence;
mod console;
mod device;
mod environments;
mod farm;
mod frame;
mod lamps;
mod matte;
mod ocio;
mod parse;
mod probe;
mod relight;
mod review;
mod tradeoff;
mod train;

use base::error::Result;
use blind::BlindArgs;
use calibration::CalibrateSettings;
use check::CheckArgs;
use checkpoints::CheckpointsArgs;
use clap::{Args, Parser, Subcommand};
use confidence::ConfidenceArgs;
use console::Console;
use device::MachineArgs;
use environments::EnvironmentsArgs;
use evaluation::EvaluateSettings;
use farm::{FarmArgs, FarmAssembleArgs, FarmChunkArgs, FarmTrainArgs};
use footage::{ImportSettings, LampSettings};
use frame::FrameArgs;
use gpu::DeviceChoice;
use lamps::LampsArgs;
use matte::MatteArgs;
use ocio::OcioArgs;
use parse::parse_count;
use probe::ProbeArgs;
use project::Project;
use relight::RelightArgs;
use review::ReviewArgs;
use std::path::{Path, PathBuf};
use studio;
use tradeoff::TradeoffArgs;
use train::TrainArgs;
use virtual_stage::StageSettings;
use worker::Job;

/// Relight filmed interviews after filming.
///
/// Without a command, opens the studio, with PROJECT if given.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// The project to open in the studio.
    project: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
// Only one command is parsed per run, so its size does not matter.
#[allow(clippy::large_enum_variant)]
enum Command {
    Stage(StageArgs),
    Import(ImportArgs),
    Environments(EnvironmentsArgs),
    Probe(Box<ProbeArgs>),
    Calibrate(CalibrateArgs),
    Check(CheckArgs),
    Train(TrainArgs),
    Checkpoints(CheckpointsArgs),
    Frame(FrameArgs),
    Lamps(LampsArgs),
    Matte(MatteArgs),
    Relight(Box<RelightArgs>),
    Farm(Box<FarmArgs>),
    FarmTrain(Box<FarmTrainArgs>),
    FarmChunk(FarmChunkArgs),
    FarmAssemble(FarmAssembleArgs),
    Evaluate(EvaluateArgs),
    Review(ReviewArgs),
    Blind(BlindArgs),
    Confidence(ConfidenceArgs),
    Tradeoff(TradeoffArgs),
    Device(MachineArgs),
    Ocio(OcioArgs),
    Studio(StudioArgs),
    Demo(DemoArgs),
    Pack(PackArgs),
}

/// Write a shoot of a virtual light stage with its ground truth, as test material.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight stage shoot --frames 24 --size 128")]
struct StageArgs {
    /// The folder to write.
    dir: PathBuf,
    #[command(flatten)]
    settings: StageSettings,
    #[command(flatten)]
    output: OutputArgs,
}

/// Make a project from a shoot folder or a map of movies. No pictures are copied.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight import interview --shoot shoot --size 128")]
struct ImportArgs {
    /// The project's folder, created if it is missing.
    project: PathBuf,
    /// The folder with the shoot's manifest.json, whose interview, poses and balls may be movies; or a TOML map
    /// of files and frames (docs/movies.md).
    #[arg(long)]
    shoot: PathBuf,
    #[command(flatten)]
    settings: ImportSettings,
    /// Use only this many lamps, chosen evenly over the sphere, of those in the shoot's .lp list if it has one.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    lamps: Option<usize>,
    #[command(flatten)]
    corrections: LampSettings,
    /// The project's name [default: the shoot's].
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Find lamps, interview light and camera response from the mirror balls and the pictures.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight calibrate interview --json")]
struct CalibrateArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: CalibrateSettings,
    #[command(flatten)]
    output: OutputArgs,
}

/// Score relit frames and OLATs against the ground truth.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight evaluate interview --truth shoot --with ratio")]
struct EvaluateArgs {
    /// The project's folder.
    project: PathBuf,
    #[command(flatten)]
    settings: EvaluateSettings,
    #[command(flatten)]
    output: OutputArgs,
}

/// Open the studio.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight studio interview")]
struct StudioArgs {
    /// The project's folder.
    project: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Run the complete workflow once, on a shoot of the virtual stage. Needs no data and no download.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight demo demo")]
struct DemoArgs {
    /// The working folder. Existing results are kept.
    #[arg(default_value = "demo")]
    dir: PathBuf,
    /// Only make the project, for the studio to open.
    #[arg(long)]
    prepare: bool,
    /// End after this many minutes of training, including earlier runs.
    #[arg(long, default_value_t = worker::demo::MINUTES, value_parser = parse::parse_minutes)]
    minutes: f64,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Write a small copy of a project's network, for archiving or hand-over: half floats, without the optimiser's
/// state.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight pack interview --to packed")]
struct PackArgs {
    /// The project's folder.
    project: PathBuf,
    /// The folder to write.
    #[arg(long)]
    to: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Clone, Copy, Debug, Args)]
struct OutputArgs {
    /// Print one JSON object with the figures instead of sentences.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct DeviceArgs {
    /// Device of the network.
    #[arg(long, value_enum, default_value = "auto")]
    device: DeviceChoice,
}

impl Cli {
    /// Rejects settings that no run can have, before anything is read or written.
    ///
    /// # Errors
    /// For an invalid setting: its name and its valid values.
    pub fn check(&self) -> Result<()> {
        match &self.command {
            Some(Command::Stage(args)) => args.settings.check(),
            Some(Command::Import(args)) => project::check_size(args.settings.size),
            Some(Command::Train(args)) => args.check(),
            Some(Command::Tradeoff(args)) => args.check(),
            Some(Command::Device(args)) => args.check(),
            _ => Ok(()),
        }
    }

    /// Runs the command.
    ///
    /// # Errors
    /// The error of the action, as one sentence.
    pub fn run(self) -> Result<()> {
        let Some(command) = self.command else { return open_studio(self.project, DeviceChoice::Auto) };
        match command {
            Command::Studio(args) => {
                open_studio(args.project.clone(), args.device.device)?;
                if args.output.json {
                    console::print(&serde_json::json!({ "project": args.project }).to_string())?;
                }
                Ok(())
            }
            Command::Stage(args) => do_job(args.output, Ok(Job::Stage { folder: args.dir, settings: args.settings })),
            Command::Import(args) => do_job(
                args.output,
                Ok(Job::Import {
                    project: args.project,
                    shoot: args.shoot,
                    settings: args.settings,
                    corrections: args.corrections,
                    lamps: args.lamps,
                    name: args.name,
                }),
            ),
            Command::Environments(args) => do_job(args.output, Ok(args.job())),
            Command::Probe(args) => do_job(args.output, Ok(args.job())),
            Command::Calibrate(args) => {
                do_job(args.output, Ok(Job::Calibrate { project: args.project, settings: args.settings }))
            }
            Command::Check(args) => args.run(),
            Command::Train(args) => do_job(args.output, args.job()),
            Command::Checkpoints(args) => args.run(),
            Command::Frame(args) => do_job(args.output, Ok(args.job())),
            Command::Lamps(args) => do_job(args.output, Ok(args.job())),
            Command::Matte(args) => do_job(args.output, Ok(args.job())),
            Command::Relight(args) => do_job(args.output, args.job()),
            Command::Farm(args) => do_job(args.output, args.job()),
            Command::FarmTrain(args) => do_job(args.output, args.job()),
            Command::FarmChunk(args) => do_job(args.output, Ok(args.job())),
            Command::FarmAssemble(args) => do_job(args.output, Ok(args.job())),
            Command::Evaluate(args) => {
                do_job(args.output, Ok(Job::Evaluate { project: args.project, settings: args.settings }))
            }
            Command::Review(args) => do_job(args.output, Ok(args.job())),
            Command::Blind(args) => do_job(args.output, Ok(args.job())),
            Command::Confidence(args) => do_job(args.output, Ok(args.job())),
            Command::Tradeoff(args) => do_job(args.output, Ok(args.job())),
            Command::Device(args) => args.run(),
            Command::Ocio(args) => args.run(),
            Command::Demo(args) => do_job(
                args.output,
                Ok(Job::Demo {
                    folder: args.dir,
                    prepare: args.prepare,
                    minutes: args.minutes,
                    device: args.device.device,
                }),
            ),
            Command::Pack(args) => do_job(args.output, Ok(Job::Pack { project: args.project, to: args.to })),
        }
    }
}

/// Runs a job on this thread and prints its result.
fn do_job(output: OutputArgs, job: Result<Job>) -> Result<()> {
    let job = job?;
    let console = Console::new(output.json);
    let _lock = job.lock()?;
    let outcome = console.run(|progress| job.run(progress))?;
    console.finish(&outcome, || outcome.sentence())
}

fn open_studio(project: Option<PathBuf>, device: DeviceChoice) -> Result<()> {
    let project = project.map(|path| Project::open(project_folder(&path)));
    studio::run(project.transpose()?, device)
}

/// A project's folder. Also accepts its `project.toml`, as when a desktop opens that file.
fn project_folder(path: &Path) -> &Path {
    if !path.ends_with("project.toml") || !path.is_file() {
        return path;
    }
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_arguments_contradict_each_other() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn a_project_is_opened_by_its_folder_or_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("project.toml");
        assert_eq!(project_folder(folder.path()), folder.path());
        // An error names the given path.
        assert_eq!(project_folder(&file), file);
        std::fs::write(&file, "").unwrap();
        assert_eq!(project_folder(&file), folder.path());
    }
}
