//! Jobs that train: several projects with several settings, one task each. Each task trains a copy of its project within the
//! job. `afterlight checkpoints PROJECT --adopt DIR` brings the trained network home.

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

/// One variant of the training settings.
#[derive(Clone, Debug)]
pub struct Training {
    /// Changed settings, such as `width=32`; "" for none.
    pub name: String,
    pub settings: TrainSettings,
}

/// Writes a job that trains each of `projects` with each variant, from its current state or, with `fresh`, from the start.
///
/// # Errors
/// When a project is not calibrated, a network shape is invalid, the job's folder is not empty, or files cannot be written.
pub fn write_training(projects: &[Project], trainings: &[Training], farm: &FarmSettings) -> Result<JobReport> {
    for project in projects {
        project.check_shoot()?;
        Calibration::load(project).map_err(|e| e.within(&project.root))?;
        // Invalid settings are reported here, not by each worker.
        for training in trainings {
            training.settings.config.network(project).check()?;
        }
    }
    let job = new_folder(&farm.job)?;
    fill(&job, projects, trainings, farm).inspect_err(|_| clear(&job))
}

/// Writes the job into its folder.
fn fill(job: &Path, projects: &[Project], trainings: &[Training], farm: &FarmSettings) -> Result<JobReport> {
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
        Engine::OpenJobDescription => open_job_description::write_training(job, &name, &program, farm, &tasks)?,
        Engine::Slurm => slurm::write_training(job, &name, &program, farm, &tasks)?,
    };
    let count = tasks.len();
    // A task changes its copy, so nothing is pinned.
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
fn write_task(project: &Project, training: &Training, job: &Path, number: usize) -> Result<TrainTask> {
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
    // A fresh training has no earlier state; progress of a lost worker is continued.
    settings.fresh = false;
    if let Some(features) = &mut settings.config.features {
        *features = std::path::absolute(&*features).map_err(|e| Error::io("open", &*features, e, "Check the path"))?;
    }
    Ok(TrainTask {
        name,
        project: (project.root.canonicalize()).unwrap_or_else(|_| project.root.clone()),
        folder,
        settings,
    })
}

/// Trains task `number` of the job in `folder`, or continues it. Reports how to bring its network home.
///
/// # Errors
/// When another program wrote the job, it lacks this task, another worker has the task, or the training fails.
pub fn run_task(folder: &Path, number: usize, progress: &Progress) -> Result<TrainReport> {
    let job = Job::open(folder)?;
    let tasks = match &job.work {
        Work::Train(tasks) => &tasks[..],
        Work::Relight(_) => &[],
    };
    let task = tasks.get(number).ok_or_else(|| {
        Error::missing(
            format!("{} has no training {number}: it has {}", folder.display(), tasks.len()),
            "Choose a task, counted from 0, or frames: --frames A-B",
        )
    })?;
    let root = task.root(folder)?;
    let project = Project::open(&root)?;
    let _lock = Lock::take(&root, "training the network")?;
    let calibration = Calibration::load(&project)?;
    let report = train(&project, &calibration, &task.settings, progress)?;
    progress.say(format!(
        "Bring the network home: afterlight checkpoints {} --adopt {}",
        base::shell::quoted(&task.project.display().to_string()),
        base::shell::quoted(&root.display().to_string())
    ));
    Ok(report)
}
