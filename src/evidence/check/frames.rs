//! Frames unlike every pose, for which the prediction has to guess.

use super::check::{Check, Level, Subject};
use base::error::Result;
use base::progress::Progress;
use confidence::{ConfidenceReport, ConfidenceSettings, estimate};
use footage::scan::counted;
use project::Project;

/// Most frames to look at without an estimate of confidence.
const FRAMES: usize = 16;
/// Limits for the share of frames that are unlike every pose.
const SHARES: [f32; 2] = [0.02, 0.25];

/// Checks that the poses resemble the frames, by the project's estimate of confidence or one of some frames.
///
/// # Errors
/// When a picture cannot be read, the shoot has fewer than two poses, or the job was stopped.
pub(super) fn check(project: &Project, progress: &Progress) -> Result<Check> {
    let frames = &project.settings.shoot.frames;
    let report = match ConfidenceReport::load(project) {
        Ok(Some((report, true))) => report,
        _ => {
            let every = Some(frames.len().div_ceil(FRAMES).max(1));
            estimate(project, &ConfidenceSettings { poses: 0, every, truth: None }, progress)?
        }
    };
    if report.far <= 0.0 {
        let sentence = "No pose shows a subject that can be compared with the frames";
        return Ok(Check::new(Subject::Frames, Level::Unknown, sentence).remedy("Check the poses and their mattes"));
    }
    let shown = report.frames.iter().filter(|frame| frame.distance > 0.0);
    let Some(farthest) = shown.max_by(|a, b| a.distance.total_cmp(&b.distance)) else {
        let sentence = "No frame shows a subject that can be compared with the poses";
        return Ok(Check::new(Subject::Frames, Level::Unknown, sentence).remedy("Check the frames and their mattes"));
    };
    let (unlike, looked) = (report.unlike().len(), report.frames.len());
    let [doubtful, bad] = SHARES;
    let level = Level::new(unlike as f32 / looked as f32, doubtful, bad);
    let total = if frames.len() == looked {
        counted(looked, "frame")
    } else {
        format!("{} ({} in all)", counted(looked, "checked frame"), frames.len())
    };
    let are = if unlike == 1 { "is" } else { "are" };
    let sentence = format!(
        "{unlike} of {total} {are} unlike every pose. The farthest, {}, is {:.1} × the distance \
         between poses away from its nearest pose",
        frames.name(farthest.frame),
        report.times(farthest)
    );
    Ok(Check::new(Subject::Frames, level, sentence).remedy(
        "Photograph poses like these frames, or expect guesses there. If the interview's light or the response is in \
         doubt, fix that first",
    ))
}
