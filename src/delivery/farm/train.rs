//! Jobs that train: several projects, several ways to train them, one task each. Each task works on a copy of its project within the job; what it has
//! learnt comes home by `afterlight checkpoints PROJECT --adopt DIR`.

use super::engine::Engine;
use super::job::{Job, TrainTask, Work};
use super::settings::FarmSettings;
use super::snapshot::{copy_network, copy_project, link_mattes};
use super::write::{JobReport, clear, new_folder, program};
use super::{open_job_description, slurm};
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use project::{Lock, Project};
use std::path::{Path, PathBuf};
use training::{TrainReport, TrainSettings, train};

/// One way to train.
#[derive(Clone, Debug)]
pub struct Training {
    /// Settings that it changes, such as `width=32`; "" for none.
    pub name: String,
    pub settings: TrainSettings,
}

/// Writes a job that trains each of `projects` in each of these ways, from where it stands or, with `fresh`, from the start.
///
/// # Errors
/// When a project is not calibrated, a network cannot have the asked shape, the job's folder holds something, or files cannot be written.
pub fn write_training(
    projects: &[Project],
    trainings: &[Training],
    farm: &FarmSettings,
) -> Result<JobReport> {
    for project in projects {
        project.check_shoot()?;
        Calibration::load(project).map_err(|e| e.within(&project.root))?;
        // What cannot be is said here, not by each worker.
        for training in trainings {
            training.settings.config.network(project).check()?;
        }
    }
    let job = new_folder(&farm.job)?;
    fill(&job, projects, trainings, farm).inspect_err(|_| clear(&job))
}

/// Writes the job into its folder.
fn fill(
    job: &Path,
    projects: &[Project],
    trainings: &[Training],
    farm: &FarmSettings,
) -> Result<JobReport> {
    let mut tasks = Vec::with_capacity(projects.len() * trainings.len());
    for project in projects {
        for training in trainings {
            tasks.push(write_task(project, training, job, tasks.len())?);
        }
    }
    let names: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
    let name = format!("training {}", names.join(", "));
    let program = program(farm)?;
    let submit = match farm.engine {
        Engine::OpenJobDescription => {
            open_job_description::write_training(job, &name, &program, farm, &tasks)?
        }
        Engine::Slurm => slurm::write_training(job, &name, &program, farm, &tasks)?,
    };
    let count = tasks.len();
    // A task changes its copy: nothing is pinned.
    Job::new(name, Work::Train(tasks), Vec::new())?.save(job)?;
    Ok(JobReport {
        job: job.to_path_buf(),
        engine: farm.engine,
        tasks: count,
        chunk: None,
        chunks: count,
        ms_per_frame: None,
        output: None,
        submit,
    })
}

/// Copies a project for the task `number`.
fn write_task(
    project: &Project,
    training: &Training,
    job: &Path,
    number: usize,
) -> Result<TrainTask> {
    let name = match &*training.name {
        "" => project.settings.name.clone(),
        what => format!("{} {what}", project.settings.name),
    };
    let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
    let folder: String = name.chars().map(plain).take(60).collect();
    let folder = PathBuf::from("projects").join(format!("{number}-{folder}"));
    let copy = copy_project(project, &job.join(&folder))?;
    if !training.settings.fresh {
        copy_network(project, &copy)?;
    }
    let shoot = &project.settings.shoot;
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_matte(frame));
    let poses = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose));
    link_mattes(project, &copy, frames.chain(poses))?;
    let mut settings = training.settings.clone();
    // What starts over has nothing to go on from; what a lost worker has learnt is gone on with.
    settings.fresh = false;
    if let Some(features) = &mut settings.config.features {
        *features = std::path::absolute(&*features)
            .map_err(|e| Error::io("open", &*features, e, "Check the path"))?;
    }
    Ok(TrainTask {
        name,
        project: (project.root.canonicalize()).unwrap_or_else(|_| project.root.clone()),
        folder,
        settings,
    })
}

/// Trains task `number` of the job in `folder`, or goes on with it. Says how its network comes home.
///
/// # Errors
/// When the job is another program's or has no such task, another worker is at it, or the training fails.
pub fn run_task(folder: &Path, number: usize, progress: &Progress) -> Result<TrainReport> {
    let job = Job::open(folder)?;
    let tasks = match &job.work {
        Work::Train(tasks) => &tasks[..],
        Work::Relight(_) => &[],
    };
    let task = tasks.get(number).ok_or_else(|| {
        Error::missing(
            format!("{} has no training {number}: it has {}", folder.display(), tasks.len()),
            "Ask for one that it has, from 0, or for frames: --frames A-B",
        )
    })?;
    let root = task.root(folder)?;
    let project = Project::open(&root)?;
    let _lock = Lock::take(&root, "training the network")?;
    let calibration = Calibration::load(&project)?;
    let report = train(&project, &calibration, &task.settings, progress)?;
    progress.say(format!(
        "Take it home: afterlight checkpoints {} --adopt {}",
        super::shell::quoted(&task.project.display().to_string()),
        super::shell::quoted(&root.display().to_string())
    ));
    Ok(report)
}
