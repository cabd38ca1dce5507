//! Unreadable frames of the interview, and their stand-ins.

use super::framed::read_picture;
use base::error::{Error, Result};
use project::{DamagedFrames, Project};

/// Number of frames searched on either side of an unreadable one: ten seconds.
pub const STAND_IN_REACH: usize = 240;

/// Stand-in for an unreadable frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StandIn {
    /// Frame whose picture and matte are read instead.
    pub held: usize,
    /// True if the frame is shown as black, without the subject.
    pub is_black: bool,
    /// Sentence with the unreadable frame, the reason, and the frame shown instead.
    pub sentence: String,
}

/// Stand-in for frame `index`; `None` if the frame is readable or the project stops at damaged frames. Decodes the
/// frame unless the project stops.
///
/// # Errors
/// When neither the frame nor any near it is readable, with the cause.
pub fn stand_in(project: &Project, index: usize) -> Result<Option<StandIn>> {
    let choice = project.settings.shoot.damaged_frames;
    if choice.is_stop() {
        return Ok(None);
    }
    let Err(error) = read_picture(&project.frame_picture(index)) else { return Ok(None) };
    let Some(held) = nearest(project, index) else { return Err(error) };
    let is_black = choice == DamagedFrames::Black;
    let instead = if is_black { "it is black".to_owned() } else { format!("frame {held} is shown in its place") };
    let cause = error.to_string();
    Ok(Some(StandIn { held, is_black, sentence: format!("Frame {index} cannot be read: {instead}. {cause}") }))
}

/// Frame whose picture is read for frame `index`: itself, or its stand-in.
///
/// # Errors
/// As [`stand_in`].
pub fn readable_frame(project: &Project, index: usize) -> Result<usize> {
    Ok(stand_in(project, index)?.map_or(index, |stand_in| stand_in.held))
}

/// The reading error of a frame. If the frame is unreadable but others are not, adds its number and the
/// alternatives.
pub fn offer(project: &Project, index: usize, error: Error) -> Error {
    let is_readable = |frame| read_picture(&project.frame_picture(frame)).is_ok();
    let is_damaged = project.settings.shoot.damaged_frames.is_stop() && !is_readable(index);
    if !is_damaged || nearest(project, index).is_none() {
        return error;
    }
    let note = format!("or continue without frame {index} of the interview");
    error.with_note(&note).with_how(format!(
        "afterlight frame {} --damaged-frames hold repeats the previous frame, `black` shows black",
        project.root.display()
    ))
}

/// Nearest earlier readable frame, or else the nearest later one.
fn nearest(project: &Project, index: usize) -> Option<usize> {
    let count = project.settings.shoot.frames.len();
    let before = (index.saturating_sub(STAND_IN_REACH)..index).rev();
    let after = index + 1..(index + 1 + STAND_IN_REACH).min(count);
    before.chain(after).find(|&frame| read_picture(&project.frame_picture(frame)).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Frame, ImportSettings, import, make_mattes};
    use base::progress::Progress;
    use imaging::Response;
    use std::path::Path;
    use std::process::Command;
    use test_support::shown;
    use virtual_stage::{StageSettings, TroubleSettings, WrittenAs, write_shoot};

    const SETTINGS: ImportSettings = ImportSettings { size: 16, seed: 1, layer: None };

    fn stage(folder: &Path, written_as: WrittenAs) {
        let stage = StageSettings {
            frames: 4,
            size: 32,
            lamps: 6,
            written_as,
            trouble: TroubleSettings { tracking: Some(3), ..TroubleSettings::default() },
            ..StageSettings::default()
        };
        write_shoot(folder, &stage, &Progress::silent()).unwrap();
    }

    /// Sets a key of the shoot's manifest.
    fn choose(shoot: &Path, choice: &str) {
        let path = shoot.join("manifest.json");
        let text = std::fs::read_to_string(&path).unwrap();
        let mut manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
        manifest["damaged_frames"] = choice.into();
        std::fs::write(path, manifest.to_string()).unwrap();
    }

    /// Frame 2 is unreadable: work stops with a remedy, or continues with the previous frame or black.
    fn check(project: &Project) {
        let filmed = |project: &Project, frame| Frame::load_filmed(project, &Response::Srgb, frame);
        let said = filmed(project, 2).unwrap_err().for_terminal();
        for word in ["frame 2", "--damaged-frames hold", "`black`"] {
            assert!(said.contains(word), "{said}");
        }
        assert!(filmed(project, 3).is_ok());
        let mut project = project.clone();
        let choice = |project: &mut Project, choice| {
            project.settings.shoot.damaged_frames = choice;
        };
        let before = filmed(&project, 1).unwrap();
        choice(&mut project, DamagedFrames::Hold);
        let (frame, plate) = filmed(&project, 2).unwrap();
        assert_eq!((frame.index, &frame.plate, &frame.mask), (2, &before.0.plate, &before.0.mask));
        assert_eq!(plate, before.1);
        let sentence = stand_in(&project, 2).unwrap().unwrap().sentence;
        assert!(sentence.contains("Frame 2") && sentence.contains("frame 1 is shown"), "{sentence}");
        assert_eq!(stand_in(&project, 3).unwrap(), None);
        choice(&mut project, DamagedFrames::Black);
        let (frame, plate) = filmed(&project, 2).unwrap();
        assert!(frame.plate.pixels.iter().all(|p| *p == [0.0; 3]));
        assert!(plate.mask.pixels.iter().all(|v| *v == 0.0));
        assert_eq!(plate.plate.size(), before.1.plate.size());
        // Black is not used for training.
        let learnt = Frame::load(&project, &Response::Srgb, 2).unwrap();
        assert_eq!(learnt.plate, before.0.plate);
    }

    #[test]
    fn a_damaged_picture_in_the_middle_is_held_or_black_by_choice() {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        stage(&shoot, WrittenAs::Files);
        let project = import(&folder.path().join("whole"), &shoot, &SETTINGS, &silent).unwrap();
        let path = shoot.join("interview/frame_002.png");
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        check(&project);
        // Its header is gone too: the import offers the choice.
        std::fs::write(&path, vec![0; whole.len()]).unwrap();
        check(&project);
        let again = folder.path().join("again");
        let said = import(&again, &shoot, &SETTINGS, &silent).unwrap_err().to_string();
        for word in ["frame_002.png", "damaged_frames", "hold", "black"] {
            assert!(said.contains(word), "{said}");
        }
        choose(&shoot, "hold");
        let held = import(&again, &shoot, &SETTINGS, &silent).unwrap();
        assert_eq!(Project::open(&again).unwrap().settings.shoot.damaged_frames, DamagedFrames::Hold);
        assert_eq!(readable_frame(&held, 2).unwrap(), 1);
        // It needs no matte.
        for part in ["interview_masks", "exemplar_masks"] {
            std::fs::remove_dir_all(shoot.join(part)).unwrap();
        }
        let made = make_mattes(&again, &crate::MatteSettings::default(), None, &silent).unwrap();
        assert_eq!((made.frames, made.kept), (3, 0));
        Frame::load_filmed(&held, &Response::Srgb, 2).unwrap();
        // The first frame has no earlier frame.
        std::fs::write(shoot.join("interview/frame_000.png"), "no picture").unwrap();
        assert_eq!(readable_frame(&held, 0).unwrap(), 1);
        shown!(
            Strangers,
            "A truncated or invalid picture in the middle of a sequence",
            done: "work stops and names the frame; as a setting, it repeats the previous frame or is black, and is reported",
        );
    }

    #[test]
    fn a_damaged_frame_in_the_middle_of_a_movie_is_held_or_black_by_choice() {
        if !test_support::ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        stage(&shoot, WrittenAs::Movies);
        let movie = shoot.join("interview.mov");
        let listed = Command::new("ffprobe")
            .args(["-v", "error", "-of", "csv=p=0", "-select_streams", "v"])
            .args(["-show_entries", "packet=pos,size"])
            .arg(&movie)
            .output()
            .unwrap();
        let listed = String::from_utf8(listed.stdout).unwrap();
        let third = listed.lines().nth(2).unwrap();
        let numbers: Vec<usize> = third.split(',').filter_map(|n| n.parse().ok()).collect();
        let mut bytes = std::fs::read(&movie).unwrap();
        bytes[numbers[1]..numbers[1] + numbers[0]].fill(0);
        std::fs::write(&movie, bytes).unwrap();
        let project = import(&folder.path().join("film"), &shoot, &SETTINGS, &silent).unwrap();
        check(&project);
        shown!(
            Strangers,
            "Zeroed bytes in the middle of an interview's movie",
            done: "work stops and names the frame; as a setting, it repeats the previous frame or is black, and is reported",
        );
    }
}
