//! Work of each job.

use super::Job;
use crate::demo;
use crate::outcome::{EnvironmentsReport, ImportReport, Outcome, WentBack};
use base::error::Result;
use base::progress::Progress;
use benchmark::MachineReport;
use calibration::Calibration;
use calibration::develop::develop;
use check::{Evidence, LitEnvironment};
use confidence::confidence;
use evaluation::blind::{answers, blind};
use evaluation::evaluate;
use evaluation::review::{review, with_and_without_network};
use export::relight::find_environment;
use footage::{FindPerson, make_mattes};
use gpu::DeviceChoice;
use light::Lighting;
use person::Segmenter;
use project::Project;
use reflectance::checkpoint;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tradeoff::{apply, tradeoff};
use training::{Prediction, checkpoints};

impl Job {
    /// Runs the job; files are written when it succeeds.
    ///
    /// # Errors
    /// When the action fails or was stopped; finished output is kept.
    pub fn run(self, progress: &Progress) -> Result<Outcome> {
        let outcome = self.act(progress);
        footage::report_mended(progress);
        outcome
    }

    fn act(self, progress: &Progress) -> Result<Outcome> {
        match self {
            Self::Stage { folder, settings } => {
                virtual_stage::write_shoot(&folder, &settings, progress).map(Outcome::Staged)
            }
            Self::Import { project, shoot, settings, corrections, lamps, name } => {
                let mut project = footage::plan_import(&project, &shoot, &settings, &corrections, progress)?;
                if let Some(name) = name {
                    project.settings.name = name;
                }
                // Saved only after complete success: an existing project is not imported again.
                let subset = lamps.map(|count| calibration::keep_lamps(&mut project, count, progress)).transpose()?;
                project.save()?;
                Ok(Outcome::Imported(ImportReport::new(&project, subset.as_ref())))
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
                // The circle is saved last, so a failed calibration leaves the project unchanged. Other changes
                // in the meantime stay.
                Project::change(&project.root, |kept| {
                    kept.settings.shoot.ball = project.settings.shoot.ball;
                    Ok(())
                })?;
                Ok(Outcome::Calibrated(Box::new(found)))
            }
            Self::Check { project, environments } => {
                let project = Project::open(&project)?;
                let lit = lit_by(&project, &environments, progress)?;
                let evidence = Evidence::read(&project, progress)?;
                Ok(Outcome::Checked(evidence.report(&lit)))
            }
            Self::Train { project, settings } => {
                let project = Project::open(&project)?;
                let calibration = Calibration::load(&project)?;
                let mut report = training::train(&project, &calibration, &settings, progress)?;
                if let Some(pose) = settings.hold_out.filter(|_| !progress.cancelled()) {
                    report.prediction = judged(&project, pose, settings.device, progress);
                }
                Ok(Outcome::Trained(report))
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
            Self::Farm { project, settings, farm, chunks } => {
                let project = Project::open(&project)?;
                farm::write_job(&project, &settings, &farm, &chunks, progress).map(Outcome::Farmed)
            }
            Self::FarmTrain { projects, trainings, farm } => {
                let projects = projects.iter().map(|root| Project::open(root));
                let projects = projects.collect::<Result<Vec<_>>>()?;
                farm::write_training(&projects, &trainings, &farm).map(Outcome::Farmed)
            }
            Self::FarmChunk { job, frames, device, shoot } => {
                farm::run_chunk(&job, frames, device, shoot.as_deref(), progress).map(Outcome::Chunk)
            }
            Self::FarmTask { job, task } => farm::run_task(&job, task, progress).map(Outcome::Trained),
            Self::FarmAssemble { job, shoot } => {
                let report = farm::assemble(&job, shoot.as_deref(), progress)?;
                Ok(Outcome::Assembled(Box::new(report)))
            }
            Self::Relight { project, settings } => {
                handover::relight(&Project::open(&project)?, &settings, progress).map(Outcome::Relit)
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
            Self::Answers { project, files } => answers(&Project::open(&project)?, &files).map(Outcome::Answered),
            Self::Confidence { project, settings } => {
                let report = confidence(&Project::open(&project)?, &settings, progress)?;
                Ok(Outcome::Trusted(Box::new(report)))
            }
            Self::Tradeoff { project, settings } => {
                let report = tradeoff(&Project::open(&project)?, &settings, progress)?;
                Ok(Outcome::Measured(Box::new(report)))
            }
            Self::Apply { project, rung } => apply(&Project::open(&project)?, &rung, progress).map(Outcome::Applied),
            Self::Demo { folder, prepare: true, .. } => {
                let project = demo::prepare(&folder, progress)?;
                Ok(Outcome::Imported(ImportReport::new(&project, None)))
            }
            Self::Demo { folder, minutes, device, .. } => {
                let report = demo::run(&folder, minutes, device, progress)?;
                Ok(Outcome::Shown(Box::new(report)))
            }
            Self::Frame { project, settings } => {
                Project::change(&project, |project| settings.run(project)).map(Outcome::Framed)
            }
            Self::Lamps { project, settings } => {
                Project::change(&project, |project| settings.run(project)).map(Outcome::Lamps)
            }
            Self::Matte { project, settings } => {
                let person = Some(find_person()?);
                make_mattes(&project, &settings, person, progress).map(Outcome::Matted)
            }
            Self::Device { program, settings, known } => {
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

/// Quality of a trained network on a held-out pose. A training counts as finished even if this fails.
fn judged(project: &Project, pose: usize, device: DeviceChoice, progress: &Progress) -> Option<Prediction> {
    match with_and_without_network(project, pose, device) {
        Ok([carried_db, corrected_db]) => Some(Prediction { pose, carried_db, corrected_db }),
        Err(e) => {
            progress.report(format!("The held-out pose was not predicted: {e}"), &e);
            None
        }
    }
}

/// The named environments or files, as they light the project; all of the project's own if there are none.
fn lit_by(project: &Project, wanted: &[PathBuf], progress: &Progress) -> Result<Vec<LitEnvironment>> {
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
    known.iter().map(|known| lit(Path::new(&known.name))).collect()
}

/// Loads a small network that finds a person in a picture.
///
/// # Errors
/// When its weights are damaged.
pub fn find_person() -> Result<FindPerson> {
    let segmenter = Segmenter::new()?;
    Ok(Box::new(move |picture| segmenter.probability(picture)))
}
