//! Long actions. The command line and the studio send the same ones.

use crate::demo::{self, DemoReport};
use crate::latest::Latest;
use base::error::Result;
use base::progress::Progress;
use benchmark::{DeviceSettings, MachineReport};
use calibration::develop::{DevelopReport, DevelopSettings, develop};
use calibration::{self, CalibrateSettings, Calibration};
use check::{CheckReport, Evidence, LitEnvironment};
use confidence::{ConfidenceReport, ConfidenceSettings, confidence};
use evaluation::blind::{AnswersReport, BlindReport, BlindSettings, answers, blind};
use evaluation::review::{Means, ReviewReport, ReviewSettings, review};
use evaluation::{EvaluateReport, EvaluateSettings, Method, evaluate};
use export::relight::{RelightReport, RelightSettings, find_environment, relight};
use farm::{
    AssembleReport, ChunkReport, ChunkSettings, FarmSettings, FrameSpan, JobReport, Training,
};
use footage::{
    self, FindPerson, FrameReport, FrameSettings, ImportSettings, MatteSettings, MattesReport,
    make_mattes,
};
use gpu::DeviceChoice;
use imaging::DualGamma;
use light::Lighting;
use light::subset::Subset;
use person::Segmenter;
use project::{EnvironmentChange, KnownEnvironment, Lock, Project};
use reflectance::checkpoint::{self, CheckpointInfo};
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tradeoff::{Applied, TradeoffReport, TradeoffSettings, apply, tradeoff};
use training::{self, TrainReport, TrainSettings, checkpoints};
use virtual_stage::{self, StageReport, StageSettings};

/// A long action and everything it needs to know.
#[derive(Clone, Debug)]
pub enum Job {
    /// Trace a shoot with the virtual stage into `folder`.
    Stage {
        folder: PathBuf,
        settings: StageSettings,
    },
    /// Make a project in `project` that points at the shoot in `shoot`.
    Import {
        project: PathBuf,
        shoot: PathBuf,
        settings: ImportSettings,
        /// Use only this many of the lamps, evenly distributed.
        lamps: Option<usize>,
        /// The project's name; None for the shoot's.
        name: Option<String>,
    },
    /// Change which environments the project in `project` has, and which way is front in them.
    Environments {
        project: PathBuf,
        change: EnvironmentChange,
    },
    /// Make a light probe of photographs of a mirror ball.
    Develop { settings: Box<DevelopSettings> },
    /// Find lamps, weights and camera response of the project in `project`.
    Calibrate {
        project: PathBuf,
        settings: CalibrateSettings,
    },
    /// Say how far the project in `project` can be trusted, under these environments: names or files; all of the
    /// project's if there are none.
    Check {
        project: PathBuf,
        environments: Vec<PathBuf>,
    },
    /// Train the network of the project in `project`.
    Train {
        project: PathBuf,
        settings: TrainSettings,
    },
    /// Replace the checkpoint of the project in `project` by an earlier one, named by its step or its folder.
    GoBack { project: PathBuf, to: String },
    /// Replace the checkpoint of the project in `project` by that of its copy in `from`, which was trained elsewhere.
    Adopt { project: PathBuf, from: PathBuf },
    /// Write a job for a farm that relights the interview of the project in `project`.
    Farm {
        project: PathBuf,
        settings: Box<RelightSettings>,
        farm: FarmSettings,
        chunks: ChunkSettings,
    },
    /// Write a job for a farm that trains the networks of these projects.
    FarmTrain {
        projects: Vec<PathBuf>,
        trainings: Vec<Training>,
        farm: FarmSettings,
    },
    /// Relight frames of the job in `job`, as a worker of a farm. `shoot` is where the footage is, if not where it was.
    FarmChunk {
        job: PathBuf,
        frames: FrameSpan,
        device: Option<DeviceChoice>,
        shoot: Option<PathBuf>,
    },
    /// Train a network of the job in `job`, as a worker of a farm.
    FarmTask { job: PathBuf, task: usize },
    /// Check the frames of the job in `job` and make its movie.
    FarmAssemble {
        job: PathBuf,
        shoot: Option<PathBuf>,
    },
    /// Relight the interview and write it.
    Relight {
        project: PathBuf,
        settings: Box<RelightSettings>,
    },
    /// Measure against a truth.
    Evaluate {
        project: PathBuf,
        settings: EvaluateSettings,
    },
    /// Compare every predicted OLAT with its truth.
    Review {
        project: PathBuf,
        settings: ReviewSettings,
    },
    /// Write a page that compares methods blindly, with its key in the project in `project`.
    Blind {
        project: PathBuf,
        settings: BlindSettings,
    },
    /// Collect the answers in `files` in the project in `project`, and count all that it has.
    Answers {
        project: PathBuf,
        files: Vec<PathBuf>,
    },
    /// Find out how far predictions for the project in `project` can be trusted.
    Confidence {
        project: PathBuf,
        settings: ConfidenceSettings,
    },
    /// Measure what accuracy costs in time on the project in `project`.
    Tradeoff {
        project: PathBuf,
        settings: Box<TradeoffSettings>,
    },
    /// Make the project in `project` use the network of a rung that was measured.
    Apply { project: PathBuf, rung: String },
    /// Run the demo in `folder`, or only make its project. Its training ends after `minutes`, including earlier runs.
    Demo {
        folder: PathBuf,
        prepare: bool,
        minutes: f64,
        device: DeviceChoice,
    },
    /// Measure what this machine can do. `program` is started for each measure.
    Device {
        program: PathBuf,
        settings: DeviceSettings,
        /// Where what is known is put after each measure, to be shown.
        known: Option<Arc<Latest<MachineReport>>>,
    },
    /// Write the project's network as a starting point for others.
    Pack { project: PathBuf, to: PathBuf },
    /// Use another square of the project's pictures.
    Frame {
        project: PathBuf,
        settings: FrameSettings,
    },
    /// Make the mattes that the shoot of the project in `project` lacks, or all of the project's own again.
    Matte {
        project: PathBuf,
        settings: MatteSettings,
    },
}

/// What a job made. Serialised, it is the figures alone.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    Staged(StageReport),
    Imported(ImportReport),
    Listed(EnvironmentsReport),
    Developed(DevelopReport),
    Calibrated(#[serde(serialize_with = "calibrated")] Box<Calibration>),
    Checked(CheckReport),
    Trained(TrainReport),
    Relit(RelightReport),
    Evaluated(EvaluateReport),
    Reviewed(ReviewReport),
    Compared(BlindReport),
    Answered(AnswersReport),
    Trusted(Box<ConfidenceReport>),
    Measured(Box<TradeoffReport>),
    Applied(Applied),
    Shown(Box<DemoReport>),
    Machine(Box<MachineReport>),
    Packed(CheckpointInfo),
    WentBack(WentBack),
    Farmed(JobReport),
    Chunk(ChunkReport),
    Assembled(Box<AssembleReport>),
    Framed(FrameReport),
    Matted(MattesReport),
}

/// The checkpoint that training goes on from now.
#[derive(Clone, Debug, Serialize)]
pub struct WentBack {
    pub info: CheckpointInfo,
    /// Whether it has the optimiser's state, so that training goes on as if it had not stopped.
    pub optimizer: bool,
}

/// The environments that a project has now.
#[derive(Clone, Debug, Serialize)]
pub struct EnvironmentsReport {
    pub environments: Vec<KnownEnvironment>,
}

/// What an import found.
#[derive(Clone, Debug, Serialize)]
pub struct ImportReport {
    pub project: PathBuf,
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    /// Numbers of what the shoot holds.
    pub poses: usize,
    pub lamps: usize,
    pub frames: usize,
    pub environments: usize,
    /// How evenly a part of the lamps was chosen, in degrees: the largest distance of a direction that the whole rig
    /// covers to a lamp, and the smallest distance of two lamps. None if all lamps are used.
    pub covering_deg: Option<f32>,
    pub separation_deg: Option<f32>,
}

/// What a training is called while it runs.
pub const TRAINING: &str = "training the network";

impl Job {
    /// What is being done, as the window and the progress bar say it.
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
            Self::Matte { .. } => "making mattes",
        }
    }

    /// The folder of the project that this job writes into; None if it writes into none.
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
            | Self::Matte { project, .. } => Some(project.clone()),
            Self::Demo { folder, .. } => Some(demo::project_folder(folder)),
            // Environments are brought into line with what others write.
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

    /// Keeps others from writing into the project that this job writes into, while the lock is held. Whoever
    /// has the project open already, as the studio has, holds it for the jobs that it runs.
    ///
    /// # Errors
    /// When somebody else writes there.
    pub fn lock(&self) -> Result<Option<Lock>> {
        // A project that is not there yet is nobody's.
        let there = self.writes().filter(|project| project.is_dir());
        there
            .map(|project| Lock::take(&project, self.what()))
            .transpose()
    }

    /// Does it; files are written when it succeeds.
    ///
    /// # Errors
    /// When the action fails or was stopped; what was finished before is kept.
    pub fn run(self, progress: &Progress) -> Result<Outcome> {
        match self {
            Self::Stage { folder, settings } => {
                virtual_stage::write_shoot(&folder, &settings, progress).map(Outcome::Staged)
            }
            Self::Import {
                project,
                shoot,
                settings,
                lamps,
                name,
            } => {
                let mut project = footage::plan_import(&project, &shoot, &settings, progress)?;
                if let Some(name) = name {
                    project.settings.name = name;
                }
                // Saved once all of it succeeded: a project that is there is not imported again.
                let subset = lamps
                    .map(|count| calibration::keep_lamps(&mut project, count, progress))
                    .transpose()?;
                project.save()?;
                Ok(Outcome::Imported(ImportReport::of(
                    &project,
                    subset.as_ref(),
                )))
            }
            Self::Environments { project, change } => {
                let environments = Project::change(&project, |project| {
                    project.apply(&change)?;
                    Ok(project.environments())
                })?;
                Ok(Outcome::Listed(EnvironmentsReport { environments }))
            }
            Self::Develop { settings } => develop(&settings).map(Outcome::Developed),
            Self::Calibrate { project, settings } => {
                let mut project = Project::open(&project)?;
                let found = calibration::calibrate(&mut project, &settings, progress)?;
                found.save(&project)?;
                // The circle is kept last: a calibration that failed leaves the project as it was. What else
                // was changed in the meantime stays.
                Project::change(&project.root, |kept| {
                    kept.settings.shoot.ball = project.settings.shoot.ball;
                    Ok(())
                })?;
                Ok(Outcome::Calibrated(Box::new(found)))
            }
            Self::Check {
                project,
                environments,
            } => {
                let project = Project::open(&project)?;
                let lit = lit_by(&project, &environments, progress)?;
                let evidence = Evidence::read(&project, progress)?;
                Ok(Outcome::Checked(evidence.report(&lit)))
            }
            Self::Train { project, settings } => {
                let project = Project::open(&project)?;
                let calibration = Calibration::load(&project)?;
                training::train(&project, &calibration, &settings, progress).map(Outcome::Trained)
            }
            Self::GoBack { project, to } => {
                let project = Project::open(&project)?;
                let info = checkpoints::go_back(&project, &to)?;
                let optimizer = checkpoint::has_optimizer(&project.checkpoint_path())?;
                Ok(Outcome::WentBack(WentBack { info, optimizer }))
            }
            Self::Adopt { project, from } => {
                let project = Project::open(&project)?;
                let info = checkpoints::adopt(&project, &Project::open(&from)?)?;
                let optimizer = checkpoint::has_optimizer(&project.checkpoint_path())?;
                Ok(Outcome::WentBack(WentBack { info, optimizer }))
            }
            Self::Farm {
                project,
                settings,
                farm,
                chunks,
            } => {
                let project = Project::open(&project)?;
                farm::write_job(&project, &settings, &farm, &chunks, progress).map(Outcome::Farmed)
            }
            Self::FarmTrain {
                projects,
                trainings,
                farm,
            } => {
                let projects = projects.iter().map(|root| Project::open(root));
                let projects = projects.collect::<Result<Vec<_>>>()?;
                farm::write_training(&projects, &trainings, &farm).map(Outcome::Farmed)
            }
            Self::FarmChunk {
                job,
                frames,
                device,
                shoot,
            } => farm::run_chunk(&job, frames, device, shoot.as_deref(), progress)
                .map(Outcome::Chunk),
            Self::FarmTask { job, task } => {
                farm::run_task(&job, task, progress).map(Outcome::Trained)
            }
            Self::FarmAssemble { job, shoot } => {
                let report = farm::assemble(&job, shoot.as_deref(), progress)?;
                Ok(Outcome::Assembled(Box::new(report)))
            }
            Self::Relight { project, settings } => {
                relight(&Project::open(&project)?, &settings, progress).map(Outcome::Relit)
            }
            Self::Evaluate { project, settings } => {
                evaluate(&Project::open(&project)?, &settings, progress).map(Outcome::Evaluated)
            }
            Self::Review { project, settings } => {
                review(&Project::open(&project)?, &settings, progress).map(Outcome::Reviewed)
            }
            Self::Blind { project, settings } => {
                blind(&Project::open(&project)?, &settings, progress).map(Outcome::Compared)
            }
            Self::Answers { project, files } => {
                answers(&Project::open(&project)?, &files).map(Outcome::Answered)
            }
            Self::Confidence { project, settings } => {
                let report = confidence(&Project::open(&project)?, &settings, progress)?;
                Ok(Outcome::Trusted(Box::new(report)))
            }
            Self::Tradeoff { project, settings } => {
                let report = tradeoff(&Project::open(&project)?, &settings, progress)?;
                Ok(Outcome::Measured(Box::new(report)))
            }
            Self::Apply { project, rung } => {
                apply(&Project::open(&project)?, &rung, progress).map(Outcome::Applied)
            }
            Self::Demo {
                folder,
                prepare: true,
                ..
            } => {
                let project = demo::prepare(&folder, progress)?;
                Ok(Outcome::Imported(ImportReport::of(&project, None)))
            }
            Self::Demo {
                folder,
                minutes,
                device,
                ..
            } => {
                let report = demo::run(&folder, minutes, device, progress)?;
                Ok(Outcome::Shown(Box::new(report)))
            }
            Self::Frame { project, settings } => {
                Project::change(&project, |project| settings.run(project)).map(Outcome::Framed)
            }
            Self::Matte { project, settings } => {
                let person = Some(find_person()?);
                make_mattes(&project, &settings, person, progress).map(Outcome::Matted)
            }
            Self::Device {
                program,
                settings,
                known,
            } => {
                let put = |report: &MachineReport| {
                    if let Some(known) = &known {
                        known.put(report.clone());
                    }
                };
                let report = benchmark::device(&program, &settings, progress, &put)?;
                Ok(Outcome::Machine(Box::new(report)))
            }
            Self::Pack { project, to } => {
                let project = Project::open(&project)?;
                checkpoint::pack(&project.checkpoint_path(), &to).map(Outcome::Packed)
            }
        }
    }
}

/// Says where a person is in a picture, by a small network.
///
/// # Errors
/// When its weights are damaged.
pub fn find_person() -> Result<FindPerson> {
    let segmenter = Segmenter::new()?;
    Ok(Box::new(move |picture| segmenter.probability(picture)))
}

impl ImportReport {
    fn of(project: &Project, subset: Option<&Subset>) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            project: project.root.clone(),
            name: project.settings.name.clone(),
            size: project.settings.size,
            poses: shoot.poses.len(),
            lamps: shoot.lamps.len(),
            frames: shoot.frames.len(),
            environments: shoot.environments.len(),
            covering_deg: subset.map(|s| s.covering_deg),
            separation_deg: subset.map(|s| s.separation_deg),
        }
    }
}

/// Of a response that has no exponents, those of the nearest dual gamma are told too: scripts read them.
fn calibrated<S: Serializer>(found: &Calibration, to: S) -> std::result::Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Figures<'a> {
        #[serde(flatten)]
        nearest: Option<DualGamma>,
        #[serde(flatten)]
        found: &'a Calibration,
    }
    let response = &found.response;
    let has_exponents = response.exponents().is_some();
    Figures {
        nearest: (!has_exponents).then(|| response.nearest_dual_gamma().0),
        found,
    }
    .serialize(to)
}

impl Outcome {
    /// Sentences that say what came of the job.
    pub fn sentence(&self) -> String {
        match self {
            Self::Staged(report) => staged(report),
            Self::Imported(found) => imported(found),
            Self::Listed(report) => listed(report),
            Self::Developed(report) => developed(report),
            Self::Calibrated(found) => format!(
                "{} lamps found; camera response {}, exposure {:.3}; {:.1} % of the interview's light comes \
                 from directions without a lamp",
                found.rig.lamps.len(),
                found.response,
                found.exposure,
                100.0 * found.uncovered_energy
            ),
            Self::Checked(report) => report.sentence(),
            Self::Trained(report) => format!(
                "{} steps in {:.0} s on the {}. Error: OLATs {:.4}, relit {:.4}, measured by {}",
                report.steps,
                report.seconds,
                report.device,
                report.loss_rec,
                report.loss_render,
                report.features
            ),
            Self::Relit(report) => report.sentence(),
            Self::Evaluated(report) => evaluated(report),
            Self::Reviewed(report) => reviewed(report),
            Self::Compared(report) => report.sentence(),
            Self::Answered(report) => report.sentence(),
            Self::Trusted(report) => report.sentence(),
            Self::Measured(report) => report.sentence(),
            Self::Applied(applied) => applied.sentence(),
            Self::Shown(report) => report.sentence(),
            Self::Machine(report) => report.sentence(),
            Self::Farmed(report) => report.sentence(),
            Self::Chunk(report) => report.sentence(),
            Self::Assembled(report) => report.sentence(),
            Self::WentBack(WentBack { info, optimizer }) => format!(
                "The checkpoint of step {} is restored, after {:.0} s of training. The one before is in the list of \
                 checkpoints. {}",
                info.step,
                info.seconds,
                if *optimizer {
                    "Training resumes there as if it had never stopped."
                } else {
                    "It has no optimiser state: training resumes from its weights with a new optimiser."
                }
            ),
            Self::Framed(report) => report.sentence(),
            Self::Matted(report) => report.sentence(),
            Self::Packed(info) => {
                format!(
                    "A network for {} lamps at {} pixels",
                    info.network.lamps, info.network.size
                )
            }
        }
    }
}

/// The environments of these names or files, as they light the project; all of its own if there are none.
fn lit_by(
    project: &Project,
    wanted: &[PathBuf],
    progress: &Progress,
) -> Result<Vec<LitEnvironment>> {
    let lit = |name: &Path| {
        let (environment, front) = find_environment(project, name, None, progress)?;
        Ok(LitEnvironment {
            name: name.display().to_string(),
            environment: Arc::new(environment),
            lighting: Lighting::default(),
            yaw_deg: front.turned(0.0),
        })
    };
    if !wanted.is_empty() {
        return wanted.iter().map(|name| lit(name)).collect();
    }
    let known = project.environments();
    known
        .iter()
        .map(|known| lit(Path::new(&known.name)))
        .collect()
}

fn staged(report: &StageReport) -> String {
    let mut text = format!(
        "{} files in {:.0} s. What was traced:",
        report.files, report.seconds
    );
    for effect in &report.effects {
        let share = 100.0 * effect.share;
        text += &format!(
            "\n  {} for {share:.1} % of {}; elsewhere {}",
            effect.name, effect.of, effect.skipped
        );
    }
    text
}

fn imported(found: &ImportReport) -> String {
    let mut text = format!(
        "{}: {} frames, {} poses under {} lamps, {} environments, working size {} pixels. The project is in {}",
        found.name,
        found.frames,
        found.poses,
        found.lamps,
        found.environments,
        found.size,
        found.project.display()
    );
    if let (Some(covering), Some(separation)) = (found.covering_deg, found.separation_deg) {
        text += &format!(
            "\nThe lamps are evenly distributed: every direction that the whole rig covers is within {covering:.1}° \
             of one of them, and no two are closer than {separation:.1}°"
        );
    }
    text
}

fn listed(report: &EnvironmentsReport) -> String {
    let lines = report.environments.iter().map(|known| {
        let front = known.front.map_or(String::new(), |front| {
            format!(", front at yaw {:.1}°", front.yaw_deg())
        });
        let owner = if known.added { "added" } else { "the shoot's" };
        let line = format!("{}: {}, {owner}{front}", known.name, known.file.display());
        match known.complaint() {
            Some(complaint) => format!("{line}. {complaint}"),
            None => line,
        }
    });
    let lines: Vec<String> = lines.collect();
    match lines.is_empty() {
        true => "The project has no environments of its own yet".to_owned(),
        false => lines.join("\n"),
    }
}

fn developed(report: &DevelopReport) -> String {
    let mut text = format!("{}:", report.written.display());
    for (i, ball) in report.balls.iter().enumerate() {
        text += &format!(
            " ball {} has its centre at {:.1}, {:.1} and a radius of {:.1} pixels, by {:.0} % of its rim to within \
             {:.2} pixels; {} pixels are clipped;",
            i + 1,
            ball.circle.center_px[0],
            ball.circle.center_px[1],
            ball.circle.radius_px,
            100.0 * ball.rim_share,
            ball.residual_px,
            report.clipped_pixels[i]
        );
    }
    text += &format!(
        " the photographs do not show {:.1} % of the sphere, where {:.1} % of the light was filled in",
        100.0 * report.blind_share,
        100.0 * report.filled_share
    );
    let estimated = report
        .estimated_energy_share
        .iter()
        .copied()
        .fold(0.0, f32::max);
    if estimated > 0.0 {
        text += &format!(
            "; {:.1} % of the light was estimated, for clipped lamps",
            100.0 * estimated
        );
    }
    if let (Some(ratio), Some(stops)) = (report.exposure_ratio, report.disagreement_stops) {
        text += &format!(
            "; the second ball is {ratio:.3} times as bright, and differs by {stops:.2} stops (median)"
        );
    }
    text
}

fn evaluated(report: &EvaluateReport) -> String {
    let scores = &report.scores;
    let method = match scores.method {
        Method::Network => "The network",
        Method::TruthOlats => "The true OLATs",
        Method::Nearest => "The nearest pose",
        Method::Ratio => "The ratio image",
        Method::Harmonics => "The ratio image of low-order harmonics",
        Method::Texler => "Patch-based training (Texler 2020)",
        Method::Sun => "Portrait relighting (Sun 2019)",
    };
    let relit: Vec<String> = scores
        .relit_psnr_db
        .iter()
        .map(|(name, db)| format!("{db:.2} dB under {name}"))
        .collect();
    let olats = scores
        .olat_psnr_db
        .map_or(String::new(), |db| format!("; OLATs {db:.2} dB"));
    let frames: Vec<String> = scores.frames.iter().map(ToString::to_string).collect();
    let (relit, frames) = (relit.join(", "), frames.join(", "));
    let flicker = report
        .flicker
        .map_or(String::new(), |flicker| format!("\n{}", flicker.sentence()));
    let learnt = match (report.training_seconds, report.training_steps) {
        (Some(seconds), Some(steps)) if scores.method.learns() => {
            let minutes = seconds / 60.0;
            let ms = scores.frame_ms.unwrap_or_default();
            format!("; learnt for {minutes:.1} min, {steps} steps; {ms:.0} ms a picture")
        }
        _ => String::new(),
    };
    format!("{method}: {relit}{olats}; frames {frames}{learnt}{flicker}")
}

fn reviewed(report: &ReviewReport) -> String {
    let over = |what: &str, means: &Means| {
        let cell = &means.over_cells;
        format!(
            "{} {what}: FLIP {:.3}, PSNR {:.1} dB, SSIM {:.3}",
            means.cases, cell.flip, cell.psnr_db, cell.ssim
        )
    };
    let unseen = (report.unseen.iter()).map(|m| over("frames or poses kept out of training", m));
    let seen = report.seen.iter().map(|m| over("seen in training", m));
    let mut text = unseen.chain(seen).collect::<Vec<_>>().join("; ");
    if let Some(worst) = report.worst.first() {
        text += &format!(
            ". The worst is {} in {}, FLIP {:.3}",
            worst.lamp, worst.case, worst.cell.flip
        );
    }
    if let Some(path) = &report.report {
        text += &format!(". The report is {}", path.display());
    }
    text
}
