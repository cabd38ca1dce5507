//! Checks of a project: each doubt about lamps, response, pictures and environments with its sentence and its
//! remedy.
//!
//! [`Evidence::read`] reads the project once: the calibration, the poses and some frames. [`Evidence::report`]
//! judges the findings, and some environments, in milliseconds. A value that was not measured is
//! [`Level::Unknown`], never green.

mod check;
mod environments;
mod frames;
mod lamps;
mod likeness;
mod mattes;
mod motion;
mod pictures;
mod response;
mod subject_shading;

pub use check::{Check, Level, Subject};
pub use environments::LitEnvironment;

use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use check::Known;
use pictures::Pictures;
use project::Project;
use serde::Serialize;

/// All checks of a project.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// The worst level; unknown only if all else is green.
    pub level: Level,
    pub checks: Vec<Check>,
}

/// Evidence from the project, the basis of reports.
pub struct Evidence {
    /// None before the first calibration.
    calibration: Known<Option<Calibration>>,
    /// Findings from poses and frames; none without a calibration.
    pictures: Option<Known<Pictures>>,
    /// Likeness of the frames to the poses; None without a calibration.
    frames: Option<Known<Check>>,
}

impl CheckReport {
    fn new(checks: Vec<Check>) -> Self {
        let levels = checks.iter().map(|check| check.level);
        Self { level: levels.fold(Level::Good, Level::worst), checks }
    }

    /// Number of checks with a level.
    pub fn count(&self, level: Level) -> usize {
        self.checks.iter().filter(|c| c.level == level).count()
    }

    /// All checks, a line each.
    pub fn sentence(&self) -> String {
        let lines: Vec<String> = self.checks.iter().map(Check::line).collect();
        lines.join("\n")
    }
}

/// A value, or why it could not be read.
///
/// # Errors
/// When the job was stopped.
fn known<T>(read: Result<T>) -> Result<Known<T>> {
    match read {
        Err(stopped @ Error::Cancelled { .. }) => Err(stopped),
        read => Ok(read.map_err(|e| e.to_string())),
    }
}

/// The checks of a calibration's lamps.
pub fn lamp_checks(calibration: &Calibration) -> Vec<Check> {
    lamps::checks(calibration)
}

impl Evidence {
    /// Reads a project. Read errors become part of the checks that need the data.
    ///
    /// # Errors
    /// When the job was stopped.
    pub fn read(project: &Project, progress: &Progress) -> Result<Self> {
        let calibration =
            if project.calibration_path().exists() { Calibration::load(project).map(Some) } else { Ok(None) };
        let (mut pictures, mut frames) = (None, None);
        if let Ok(Some(calibration)) = &calibration {
            pictures = Some(known(Pictures::read(project, calibration, progress))?);
            frames = Some(known(frames::check(project, progress))?);
        }
        Ok(Self { calibration: calibration.map_err(|e| e.to_string()), pictures, frames })
    }

    /// Judges the project, and the demands of some environments on it.
    pub fn report(&self, environments: &[LitEnvironment]) -> CheckReport {
        const OF_PICTURES: [Subject; 2] = [Subject::Shading, Subject::Mattes];
        let mut checks = match &self.calibration {
            Ok(Some(calibration)) => {
                let mut checks = lamps::checks(calibration);
                checks.push(response::response(calibration));
                checks.push(response::interview_light(calibration));
                checks.push(motion::check(calibration));
                checks.extend(match &self.pictures {
                    Some(Ok(pictures)) => [subject_shading::check(pictures, calibration), mattes::check(pictures)],
                    Some(Err(why)) => OF_PICTURES.map(|subject| Check::unread(subject, why)),
                    None => OF_PICTURES.map(Check::uncalibrated),
                });
                checks.push(match &self.frames {
                    Some(Ok(check)) => check.clone(),
                    Some(Err(why)) => Check::unread(Subject::Frames, why),
                    None => Check::uncalibrated(Subject::Frames),
                });
                checks
            }
            other => Subject::OF_PROJECT.map(|subject| not_calibrated(subject, other)).into(),
        };
        for lit in environments {
            let about = match &self.calibration {
                Ok(Some(calibration)) => environments::checks(lit, calibration, self.pictures.as_ref()),
                other => Subject::OF_ENVIRONMENT.map(|subject| not_calibrated(subject, other)).into(),
            };
            checks.extend(about.into_iter().map(|check| Check { environment: Some(lit.name.clone()), ..check }));
        }
        CheckReport::new(checks)
    }
}

/// The check of a project whose calibration is missing or cannot be read.
fn not_calibrated(subject: Subject, calibration: &Known<Option<Calibration>>) -> Check {
    match calibration {
        Err(why) => Check::unread(subject, why),
        Ok(_) => Check::uncalibrated(subject),
    }
}

#[cfg(test)]
mod tests;
