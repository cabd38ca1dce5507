//! Frames that are unlike every pose: there the network has to guess.
//!
//! Small pictures are compared as a viewer sees them: display values of the exposure that suits each, so that the
//! brightness of poses and frames does not matter. How far poses are from their nearest other pose is the scale.

use super::pictures::Pictures;
use super::{Check, Level, Subject};
use imaging::color::luminance;
use imaging::{Image, Mask};

/// A frame is unlike the poses if it is this many times farther from the nearest than poses are from each other.
const UNLIKE: f32 = 1.2;
/// Shares of the frames that are unlike every pose.
const SHARES: [f32; 2] = [0.02, 0.25];

/// Whether the poses show what the frames show.
pub(super) fn check(pictures: &Pictures) -> Check {
    let poses: Vec<Vec<f32>> = (pictures.poses.iter())
        .map(|pose| seen(&pose.plate, &pose.mask))
        .collect();
    let apart = (0..poses.len()).filter_map(|i| {
        let others = poses.iter().enumerate().filter(|(j, _)| *j != i);
        nearest(&poses[i], others.map(|(_, other)| other))
    });
    let mut apart: Vec<f32> = apart.filter(|d| d.is_finite() && *d > 0.0).collect();
    apart.sort_by(f32::total_cmp);
    let Some(&scale) = apart.get(apart.len() / 2) else {
        let sentence = "With one pose, or poses that are all alike, it is not known how far frames may be from them";
        return Check::new(Subject::Frames, Level::Unknown, sentence)
            .remedy("Photograph several poses that differ as the interview does");
    };
    let mut far: Vec<(f32, &str)> = (pictures.frames.iter())
        .filter_map(|frame| {
            let distance = nearest(&seen(&frame.plate, &frame.mask), poses.iter())?;
            Some((distance / scale, frame.name.as_str()))
        })
        .collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some(&(worst, name)) = far.first().filter(|(worst, _)| worst.is_finite()) else {
        let sentence = "No frame shows a subject that can be compared with the poses";
        return Check::new(Subject::Frames, Level::Unknown, sentence)
            .remedy("Check the frames and their mattes");
    };
    let unlike = far.iter().filter(|(d, _)| *d > UNLIKE).count();
    let [doubtful, bad] = SHARES;
    let level = Level::of(unlike as f32 / far.len() as f32, doubtful, bad);
    let looked = match pictures.all_frames == far.len() {
        true => format!("{} frames", far.len()),
        false => format!(
            "{} of {} frames that were looked at",
            far.len(),
            pictures.all_frames
        ),
    };
    let sentence = format!(
        "{unlike} of {looked} are unlike every pose: the farthest, {name}, is {worst:.1} times as far from its nearest \
         pose as poses are from each other"
    );
    Check::new(Subject::Frames, level, sentence).remedy(
        "Photograph poses like these frames, or expect guesses there. If the interview's light or the response is in \
         doubt, mend that first",
    )
}

/// A picture as a viewer sees it: display values where the subject is, at the exposure that suits it.
fn seen(plate: &Image, mask: &Mask) -> Vec<f32> {
    /// The exposure puts the subject's 90th percentile here.
    const EXPOSED: f32 = 0.5;
    let mut lit: Vec<f32> = (plate.pixels.iter().zip(&mask.pixels))
        .filter(|(_, covered)| **covered > 0.5)
        .map(|(pixel, _)| luminance(*pixel))
        .collect();
    lit.sort_by(f32::total_cmp);
    let level = lit.get(lit.len() * 9 / 10).copied().unwrap_or(f32::NAN);
    (plate.pixels.iter().zip(&mask.pixels))
        .map(|(pixel, covered)| {
            let value = (EXPOSED * luminance(*pixel) / level).max(0.0);
            covered * value.powf(1.0 / 2.2)
        })
        .collect()
}

/// The root-mean-square distance to the nearest of some pictures; None if there are none.
fn nearest<'a>(picture: &[f32], others: impl Iterator<Item = &'a Vec<f32>>) -> Option<f32> {
    others
        .map(|other| {
            let squares = picture.iter().zip(other).map(|(a, b)| (a - b) * (a - b));
            (squares.sum::<f32>() / picture.len().max(1) as f32).sqrt()
        })
        .min_by(f32::total_cmp)
}
