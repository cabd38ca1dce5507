//! An exported shot, with the data that other programs need.

use crate::lamps::Layers;
use crate::light::Light;
use crate::media::Media;
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use export::relight::{RelightSettings, frame_range};
use export::{Destination, HandOver, Interview, TimeCode, rational_rate};
use project::Project;
use std::path::PathBuf;

/// An exported shot.
pub struct Shot {
    pub name: String,
    pub media: Media,
    /// Numbers of the first and the last file.
    pub frames: (i64, i64),
    /// Frames per second as a fraction.
    pub rate: (i32, u32),
    /// Time code of the first frame.
    pub time_code: TimeCode,
    /// Reel of the interview's movie.
    pub reel: Option<String>,
    pub has_sound: bool,
    /// Name or file of the environment, as requested.
    pub environment: String,
    /// None unless a requested program needs them.
    pub layers: Option<Layers>,
    /// As `layers`.
    pub light: Option<Light>,
}

impl Shot {
    /// Shot of an export of the project to `output`.
    ///
    /// # Errors
    /// When its files, the calibration or the environment cannot be read.
    pub fn new(
        project: &Project,
        settings: &RelightSettings,
        interview: &Interview,
        output: &Destination,
        progress: &Progress,
    ) -> Result<Self> {
        let program = settings.hand_over.first().map_or("", |p| p.name());
        let media = Media::new(output, program)?;
        let frames = frame_range(project, settings.frames)?;
        let has_sound = match &media {
            Media::Movie(path) => match &*movies::open(path)? {
                movies::Source::Movie(movie) => movie.info().has_sound,
                movies::Source::Sequence(_) => false,
            },
            Media::Stills(_) => false,
        };
        // The export reported uneven times with its sound.
        if !has_sound {
            warn_of_uneven_times(interview, frames, progress)?;
        }
        let numbers = settings.files.numbers(interview, frames);
        let mut shot = Self {
            name: media.shot_name(),
            media,
            frames: numbers,
            rate: rational_rate(interview.frame_rate),
            time_code: interview.time_code(frames.0),
            reel: interview.reel().map(str::to_owned),
            has_sound,
            environment: settings.environment.display().to_string(),
            layers: None,
            light: None,
        };
        if settings.hand_over.iter().copied().any(HandOver::needs_layers) {
            let Media::Stills(stills) = &shot.media else {
                return Err(Error::bug(format!("{output} has no light layers")));
            };
            let rig = &Calibration::load(project)?.rig;
            shot.layers = Some(Layers::read(stills, numbers, rig, progress)?);
            shot.light = Some(Light::new(project, settings, frames, rig)?);
        }
        Ok(shot)
    }

    /// File beside the shot, with this ending after its name.
    pub fn file(&self, ending: &str) -> PathBuf {
        self.media.folder().join(format!("{}{ending}", self.name))
    }

    /// Number of frames.
    pub fn count(&self) -> usize {
        (self.frames.1 - self.frames.0 + 1) as usize
    }

    /// In frames per second.
    pub fn frame_rate(&self) -> f64 {
        f64::from(self.rate.0) / f64::from(self.rate.1)
    }
}

/// Warns if the interview's movie has a variable frame rate: other programs count with a constant one.
fn warn_of_uneven_times(interview: &Interview, (first, last): (usize, usize), progress: &Progress) -> Result<()> {
    let Some(source) = &interview.source else { return Ok(()) };
    let movies::Source::Movie(movie) = &*movies::open(&source.file)? else { return Ok(()) };
    let from = source.first_frame as u64;
    let frames = (from + first as u64, from + last as u64);
    let drift = movie.drift(frames, interview.frame_rate)?;
    if drift >= 1.0 {
        progress.say(format!(
            "{} has a variable frame rate, not {:.3} frames per second: its times are up to {drift:.1} frames off. Time codes count \
             frames; make the movie's rate constant before the import if they are to follow its clock",
            source.file.display(),
            interview.frame_rate
        ));
    }
    Ok(())
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::light::tests::moving;
    use crate::media::tests::media;
    use std::process::Command;

    /// Five frames of a film, from frame 10 on, exported to `to`.
    pub fn shot(to: &str) -> Shot {
        Shot {
            name: media(to).shot_name(),
            media: media(to),
            frames: (10, 14),
            rate: (24, 1),
            time_code: TimeCode::parse("10:00:00:10", 24.0).unwrap(),
            reel: Some("A001_C002_1024XY".to_owned()),
            has_sound: false,
            environment: "nave".to_owned(),
            layers: None,
            light: None,
        }
    }

    #[test]
    fn uneven_times_are_reported_once_for_a_movie_with_sound_by_its_sound() {
        if !test_support::ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        // Two frames of three are left out in the first second.
        let uneven = "-vf select='gte(n,30)+not(mod(n,3))' -fps_mode passthrough";
        let sound = "-f lavfi -i sine=d=3 -c:a pcm_s16le";
        for (name, more) in [("talk.mov", uneven), ("quiet.mov", ""), ("loud.mov", sound)] {
            let made = Command::new("ffmpeg")
                .args(["-v", "error", "-f", "lavfi", "-i", "testsrc2=s=64x48:r=30:d=3"])
                .args(more.split_whitespace())
                .args(["-c:v", "prores_ks"])
                .arg(at(name))
                .status();
            assert!(made.unwrap().success(), "{name}");
        }
        let mut project = Project::without_shoot(folder.path());
        project.settings.shoot.frame_rate = 30.0;
        project.settings.shoot.frames =
            project::Frames::Clip(project::Clip { movie: "talk.mov".into(), first: 0, count: 70, alpha: false });
        let interview = Interview::from_project(&project).unwrap();
        let settings = RelightSettings { hand_over: vec![HandOver::Otio], ..moving() };
        for (output, reports) in [("quiet.mov", 1), ("loud.mov", 0)] {
            let output = Destination::parse(&at(output).display().to_string()).unwrap();
            let (shot, said) =
                Progress::heard(|progress| Shot::new(&project, &settings, &interview, &output, progress).unwrap());
            assert_eq!((shot.has_sound, shot.count()), (reports == 0, 70));
            assert_eq!(said.lines().count(), reports, "{said}");
        }
    }
}
