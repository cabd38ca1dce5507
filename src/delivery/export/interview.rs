//! Properties of the interview that an export keeps: frame rate, time code, reel and sound.

use super::time_code::TimeCode;
use base::error::{Error, Result};
use project::{Picture, Project};
use std::path::{Path, PathBuf};

/// The interview that is exported.
#[derive(Clone, Debug)]
pub struct Interview {
    /// In frames per second.
    pub frame_rate: f64,
    /// Number of the first frame in the name of its file; 0 for a movie.
    pub first_number: i64,
    /// Movie of the interview; None for stills.
    pub source: Option<Source>,
}

/// Frames of a movie.
#[derive(Clone, Debug)]
pub struct Source {
    pub file: PathBuf,
    /// The movie's frame that is frame 0 of the interview.
    pub first_frame: usize,
    /// Time code of the movie's first frame, from the file.
    pub time_code: Option<TimeCode>,
    pub reel: Option<String>,
}

impl Interview {
    /// Interview of a project: a movie, a sequence of pictures, or stills.
    ///
    /// # Errors
    /// When the interview cannot be read, or a movie's time code is none at its frame rate.
    pub fn from_project(project: &Project) -> Result<Self> {
        let mut interview = Self::stills(project.settings.shoot.frame_rate);
        interview.first_number = footage::first_number(project)?;
        if let Picture::Movie { file, frame } = project.frame_picture(0)
            && let movies::Source::Movie(movie) = &*movies::open(&file)?
        {
            let info = movie.info();
            let read = |text: &String| time_code_of(&file, text, interview.frame_rate);
            interview.source = Some(Source {
                time_code: info.time_code.as_ref().map(read).transpose()?,
                first_frame: frame as usize,
                reel: info.reel.clone(),
                file,
            });
        }
        Ok(interview)
    }

    /// Stills, which have no sound.
    pub fn stills(frame_rate: f64) -> Self {
        Self { frame_rate, first_number: 0, source: None }
    }

    /// Time code of frame `frame`: the movie's, or counted from the interview's first frame.
    pub fn time_code(&self, frame: usize) -> TimeCode {
        let counted = TimeCode::new(frame, self.frame_rate);
        self.filmed_time_code(frame).unwrap_or(counted)
    }

    /// The movie's time code of frame `frame`, if it has one.
    pub fn filmed_time_code(&self, frame: usize) -> Option<TimeCode> {
        let source = self.source.as_ref()?;
        Some(source.time_code?.plus(source.first_frame + frame))
    }

    /// Reel name, if the movie has one.
    pub fn reel(&self) -> Option<&str> {
        self.source.as_ref()?.reel.as_deref()
    }
}

/// Time code `text` of the first frame of a movie.
///
/// # Errors
/// When it is none at this frame rate.
fn time_code_of(file: &Path, text: &str, frame_rate: f64) -> Result<TimeCode> {
    TimeCode::parse(text, frame_rate).ok_or_else(|| {
        let rate = (1000.0 * frame_rate).round() / 1000.0;
        Error::invalid(
            format!("{}: the time code {text:?} does not exist at {rate} frames a second", file.display()),
            (
                "Write a valid one into the movie: hours:minutes:seconds:frames. Drop-frame has a semicolon before \
                 the frames and needs 29.97, 30, 59.94 or 60",
                "ffmpeg -i OLD.mov -map 0 -c copy -timecode 01:00:00:00 NEW.mov",
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn a_project_whose_interview_is_a_movie_hands_on_what_the_movie_says() {
        if !test_support::ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let made = Command::new("ffmpeg")
            .args(["-v", "error", "-f", "lavfi", "-i", "testsrc2=s=64x48:r=30000/1001:d=2"])
            .args(["-f", "lavfi", "-i", "sine=d=2", "-c:v", "prores_ks"])
            .args(["-timecode", "09:59:59;00", "-metadata:s:v:0", "reel_name=B003"])
            .arg(folder.path().join("talk.mov"))
            .status();
        assert!(made.unwrap().success());
        let mut project = Project::without_shoot(folder.path());
        let shoot = &mut project.settings.shoot;
        shoot.frame_rate = 30000.0 / 1001.0;
        shoot.frames =
            project::Frames::Clip(project::Clip { movie: "talk.mov".into(), first: 10, count: 40, alpha: false });
        let interview = Interview::from_project(&project).unwrap();
        let source = interview.source.as_ref().unwrap();
        assert_eq!((source.first_frame, interview.reel()), (10, Some("B003")));
        assert_eq!(interview.time_code(0).to_string(), "09:59:59;10");
        assert_eq!(interview.time_code(20).to_string(), "10:00:00;00");
    }

    #[test]
    fn a_time_code_that_does_not_exist_is_refused_with_its_text() {
        let file = Path::new("A001.mov");
        assert_eq!(time_code_of(file, "01:00:00;00", 30.0).unwrap().to_string(), "01:00:00;00");
        for (text, rate, says) in [
            ("01:00:00:24", 24.0, "at 24 frames"),
            ("01:00:00;00", 24000.0 / 1001.0, "at 23.976 frames"),
            ("01:00:00;00", 25.0, "at 25 frames"),
            ("01:01:00;00", 30000.0 / 1001.0, "at 29.97 frames"),
            ("yesterday", 50.0, "at 50 frames"),
            ("", 60.0, "at 60 frames"),
        ] {
            let said = time_code_of(file, text, rate).unwrap_err().to_string();
            for words in ["A001.mov", &format!("{text:?}"), says, "semicolon"] {
                assert!(said.contains(words), "{said}: {words}");
            }
        }
    }
}
