//! Properties of the interview that an export keeps: frame rate, time code, reel and sound.

use super::time_code::TimeCode;
use base::error::Result;
use project::{Picture, Project};
use std::path::PathBuf;

/// The interview that is exported.
#[derive(Clone, Debug)]
pub struct Interview {
    /// In frames per second.
    pub frame_rate: f64,
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
    pub time_code: Option<String>,
    pub reel: Option<String>,
}

impl Interview {
    /// Interview of a project: a movie, a sequence of pictures, or stills.
    ///
    /// # Errors
    /// When the movie cannot be read.
    pub fn of(project: &Project) -> Result<Self> {
        let mut interview = Self::stills(project.settings.shoot.frame_rate);
        if let Picture::Movie { file, frame } = project.frame_picture(0)
            && let movies::Source::Movie(movie) = &*movies::open(&file)?
        {
            let info = movie.info();
            interview.source = Some(Source {
                file,
                first_frame: frame as usize,
                time_code: info.time_code.clone(),
                reel: info.reel.clone(),
            });
        }
        Ok(interview)
    }

    /// Stills, which have no sound.
    pub fn stills(frame_rate: f64) -> Self {
        Self { frame_rate, source: None }
    }

    /// Time code of frame `frame`: the movie's, or counted from the interview's first frame.
    pub fn time_code(&self, frame: usize) -> TimeCode {
        let counted = TimeCode::of(frame, self.frame_rate);
        self.filmed_time_code(frame).unwrap_or(counted)
    }

    /// The movie's time code of frame `frame`, if it has one.
    pub fn filmed_time_code(&self, frame: usize) -> Option<TimeCode> {
        let source = self.source.as_ref()?;
        let start = TimeCode::parse(source.time_code.as_ref()?, self.frame_rate)?;
        Some(start.plus(source.first_frame + frame))
    }

    /// Reel name, if the movie has one.
    pub fn reel(&self) -> Option<&str> {
        self.source.as_ref()?.reel.as_deref()
    }
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
        shoot.frames = project::Frames::Clip(project::Clip {
            movie: "talk.mov".into(),
            first: 10,
            count: 40,
            alpha: false,
        });
        let interview = Interview::of(&project).unwrap();
        let source = interview.source.as_ref().unwrap();
        assert_eq!((source.first_frame, interview.reel()), (10, Some("B003")));
        assert_eq!(interview.time_code(0).to_string(), "09:59:59;10");
        assert_eq!(interview.time_code(20).to_string(), "10:00:00;00");
    }
}
