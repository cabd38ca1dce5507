//! Checks of a project: each doubt about lamps, response, pictures and environments with its sentence and its
//! remedy.
//!
//! [`Evidence::read`] reads the project once: the calibration, the poses and some frames. [`Evidence::report`]
//! judges the findings, and some environments, in milliseconds. A value that was not measured is
//! [`Level::Unknown`], never green.

mod environments;
mod frames;
mod lamps;
mod likeness;
mod mattes;
mod motion;
mod pictures;
mod response;
mod subject_shading;

pub use environments::LitEnvironment;

use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use footage::LampSettings;
use pictures::Pictures;
use project::Project;
use serde::Serialize;

/// Level of trust.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Level {
    /// No action needed.
    #[serde(rename = "green")]
    Good,
    /// Pictures suffer a little, or may suffer.
    #[serde(rename = "amber")]
    Doubtful,
    /// Pictures will be wrong.
    #[serde(rename = "red")]
    Bad,
    /// Not measured.
    #[serde(rename = "unknown")]
    Unknown,
}

/// Subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// Visibility of every lamp on the mirror balls.
    LampsSeen,
    /// Agreement of all evidence on the lamps' directions.
    LampsAgree,
    /// Agreement of the lamps' directions with the subject's shading.
    Shading,
    /// Clipping of the lamps on the mirror balls.
    LampsClipped,
    /// Lamps hidden behind the ball.
    LampsHidden,
    /// Certainty of the camera's response.
    Response,
    /// Share of the interview's light that is not a sum of the lamps.
    InterviewLight,
    /// Motion of the subject while the lamps went round.
    Motion,
    /// Likeness of the poses to the frames.
    Frames,
    /// Coverage of the mattes, neither nothing nor everything.
    Mattes,
    /// Fit of an environment's pictures into half floats.
    HalfFloats,
    /// Share of an environment's light that comes from places without a lamp.
    Coverage,
    /// Share of an environment's light in lights that are smaller than the lamps.
    Contrast,
}

impl Subject {
    /// Subjects for every calibrated project.
    const OF_PROJECT: [Self; 10] = [
        Self::LampsSeen,
        Self::LampsAgree,
        Self::LampsClipped,
        Self::LampsHidden,
        Self::Response,
        Self::InterviewLight,
        Self::Motion,
        Self::Shading,
        Self::Mattes,
        Self::Frames,
    ];
    /// Subjects for each environment.
    const OF_ENVIRONMENT: [Self; 3] = [Self::Coverage, Self::Contrast, Self::HalfFloats];
}

/// One doubt, or the lack of one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    pub subject: Subject,
    /// The environment's name; None if the check is about the project.
    pub environment: Option<String>,
    pub level: Level,
    /// The finding.
    pub sentence: String,
    /// Remedy; None if no action is needed.
    pub remedy: Option<String>,
    /// Correction of the lamps that is the remedy, without a change of files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<LampSettings>,
}

/// All checks of a project.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// The worst level; unknown only if all else is green.
    pub level: Level,
    pub checks: Vec<Check>,
}

/// A value that was read, or the reason that it could not be, in a sentence.
type Known<T> = std::result::Result<T, String>;

/// Evidence from the project, the basis of reports.
pub struct Evidence {
    /// None before the first calibration.
    calibration: Known<Option<Calibration>>,
    /// Findings from poses and frames; none without a calibration.
    pictures: Option<Known<Pictures>>,
    /// Likeness of the frames to the poses; None without a calibration.
    frames: Option<Known<Check>>,
}

impl Level {
    /// Level of a value for which smaller is better; NaN means not measured.
    fn new(value: f32, doubtful: f32, bad: f32) -> Self {
        match value {
            v if v.is_nan() => Self::Unknown,
            v if v >= bad => Self::Bad,
            v if v >= doubtful => Self::Doubtful,
            _ => Self::Good,
        }
    }

    /// Rank in the overall level: the worst wins.
    fn rank(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::Unknown => 1,
            Self::Doubtful => 2,
            Self::Bad => 3,
        }
    }

    /// The worse of both.
    pub fn worst(self, other: Self) -> Self {
        if other.rank() > self.rank() { other } else { self }
    }

    /// Word in sentences.
    pub fn word(self) -> &'static str {
        match self {
            Self::Good => "green",
            Self::Doubtful => "amber",
            Self::Bad => "red",
            Self::Unknown => "not known",
        }
    }
}

impl Subject {
    /// Title in reports and in the window.
    pub fn title(self) -> &'static str {
        match self {
            Self::LampsSeen => "Lamps seen",
            Self::LampsAgree => "Lamps agree",
            Self::Shading => "Lamps on the subject",
            Self::LampsClipped => "Lamps clipped",
            Self::LampsHidden => "Lamps hidden",
            Self::Response => "Camera response",
            Self::InterviewLight => "Interview light",
            Self::Motion => "Subject still",
            Self::Frames => "Frames and poses",
            Self::Mattes => "Mattes",
            Self::HalfFloats => "Half floats",
            Self::Coverage => "Light covered",
            Self::Contrast => "Hard light",
        }
    }
}

impl Check {
    fn new(subject: Subject, level: Level, sentence: impl Into<String>) -> Self {
        let sentence = sentence.into();
        Self { subject, environment: None, level, sentence, remedy: None, correction: None }
    }

    /// The same with a remedy, unless it is green.
    fn remedy(self, remedy: impl Into<String>) -> Self {
        Self { remedy: (self.level != Level::Good).then(|| remedy.into()), ..self }
    }

    /// Unknown result before the project is calibrated.
    fn uncalibrated(subject: Subject) -> Self {
        Self::new(subject, Level::Unknown, "Not known yet").remedy("Calibrate the project")
    }

    /// Unknown result because something could not be read; `why` has the reason and the remedy.
    fn unread(subject: Subject, why: &str) -> Self {
        let (sentence, remedy) =
            why.rsplit_once(". ").unwrap_or((why, "Fix that, and check again"));
        Self::new(subject, Level::Unknown, format!("Not known: {sentence}")).remedy(remedy)
    }

    /// The whole check as one line.
    pub fn line(&self) -> String {
        let about = self.environment.as_ref();
        let about = about.map_or(String::new(), |name| format!(", {name}"));
        let remedy = self.remedy.as_ref();
        let mut remedy = remedy.map_or(String::new(), |remedy| format!(". {remedy}"));
        if let Some(correction) = &self.correction {
            remedy += &format!(": afterlight lamps PROJECT {}", correction.arguments());
        }
        format!(
            "{:>9}  {}{about}: {}{remedy}",
            self.level.word(),
            self.subject.title(),
            self.sentence
        )
    }
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
        let calibration = if project.calibration_path().exists() {
            Calibration::load(project).map(Some)
        } else {
            Ok(None)
        };
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
                    Some(Ok(pictures)) => {
                        [subject_shading::check(pictures, calibration), mattes::check(pictures)]
                    }
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
                Ok(Some(calibration)) => {
                    environments::checks(lit, calibration, self.pictures.as_ref())
                }
                other => {
                    Subject::OF_ENVIRONMENT.map(|subject| not_calibrated(subject, other)).into()
                }
            };
            checks.extend(
                about
                    .into_iter()
                    .map(|check| Check { environment: Some(lit.name.clone()), ..check }),
            );
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
