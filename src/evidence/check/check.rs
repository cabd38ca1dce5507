//! One check: its subject, level, finding and remedy.

use footage::LampSettings;
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
    pub(crate) const OF_PROJECT: [Self; 10] = [
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
    pub(crate) const OF_ENVIRONMENT: [Self; 3] = [Self::Coverage, Self::Contrast, Self::HalfFloats];
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

/// A value that was read, or the reason that it could not be, in a sentence.
pub(crate) type Known<T> = std::result::Result<T, String>;

impl Level {
    /// Level of a value for which smaller is better; NaN means not measured.
    pub(crate) fn new(value: f32, doubtful: f32, bad: f32) -> Self {
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
    pub(crate) fn new(subject: Subject, level: Level, sentence: impl Into<String>) -> Self {
        let sentence = sentence.into();
        Self { subject, environment: None, level, sentence, remedy: None, correction: None }
    }

    /// The same with a remedy, unless it is green.
    pub(crate) fn remedy(self, remedy: impl Into<String>) -> Self {
        Self { remedy: (self.level != Level::Good).then(|| remedy.into()), ..self }
    }

    /// Unknown result before the project is calibrated.
    pub(crate) fn uncalibrated(subject: Subject) -> Self {
        Self::new(subject, Level::Unknown, "Not known yet").remedy("Calibrate the project")
    }

    /// Unknown result because something could not be read; `why` has the reason and the remedy.
    pub(crate) fn unread(subject: Subject, why: &str) -> Self {
        let (sentence, remedy) = why.rsplit_once(". ").unwrap_or((why, "Fix that, and check again"));
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
        format!("{:>9}  {}{about}: {}{remedy}", self.level.word(), self.subject.title(), self.sentence)
    }
}
