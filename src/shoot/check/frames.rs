//! Frames unlike every pose, for which the network has to guess.
//!
//! Small pictures are compared in display values, each at its own best exposure, so that the brightness of poses
//! and frames does not matter. The scale is the distance of poses from their nearest other pose.

use super::pictures::Pictures;
use super::{Check, Level, Subject};
use footage::scan::counted;
use imaging::color::luminance;
use imaging::{Image, Mask};

/// A frame is unlike the poses if its distance from the nearest is this multiple of the distance between poses.
const UNLIKE: f32 = 1.2;
/// Limits for the share of frames that are unlike every pose.
const SHARES: [f32; 2] = [0.02, 0.25];

/// Checks that the poses resemble the frames.
pub(super) fn check(pictures: &Pictures) -> Check {
    let poses: Vec<Vec<f32>> = (pictures.poses.iter())
        .map(|pose| seen(&pose.plate, &pose.mask, &pictures.shown))
        .collect();
    let apart = (0..poses.len()).filter_map(|i| {
        let others = poses.iter().enumerate().filter(|(j, _)| *j != i);
        nearest(&poses[i], others.map(|(_, other)| other))
    });
    let mut apart: Vec<f32> = apart.filter(|d| d.is_finite() && *d > 0.0).collect();
    apart.sort_by(f32::total_cmp);
    let Some(&scale) = apart.get(apart.len() / 2) else {
        let sentence = "With one pose, or with poses all alike, the frames cannot be compared";
        return Check::new(Subject::Frames, Level::Unknown, sentence)
            .remedy("Photograph several poses as varied as the interview");
    };
    let mut far: Vec<(f32, &str)> = (pictures.frames.iter())
        .filter_map(|frame| {
            let frame_seen = seen(&frame.plate, &frame.mask, &pictures.shown);
            let distance = nearest(&frame_seen, poses.iter())?;
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
        true => counted(far.len(), "frame"),
        false => {
            format!("{} ({} in all)", counted(far.len(), "checked frame"), pictures.all_frames)
        }
    };
    let are = if unlike == 1 { "is" } else { "are" };
    let sentence = format!(
        "{unlike} of {looked} {are} unlike every pose: the farthest, {name}, is {worst:.1} times as far from its nearest \
         pose as poses are from each other"
    );
    Check::new(Subject::Frames, level, sentence).remedy(
        "Photograph poses like these frames, or expect guesses there. If the interview's light or the response is in \
         doubt, fix that first",
    )
}

/// Display values of a picture: the subject within `shown`, at its own best exposure.
fn seen(plate: &Image, mask: &Mask, shown: &Mask) -> Vec<f32> {
    /// Display value of the subject's 90th percentile.
    const EXPOSED: f32 = 0.5;
    let covered: Vec<f32> =
        (mask.pixels.iter().zip(&shown.pixels)).map(|(covered, shown)| covered * shown).collect();
    let mut lit: Vec<f32> = (plate.pixels.iter().zip(&covered))
        .filter(|(_, covered)| **covered > 0.5)
        .map(|(pixel, _)| luminance(*pixel))
        .collect();
    lit.sort_by(f32::total_cmp);
    let level = lit.get(lit.len() * 9 / 10).copied().unwrap_or(f32::NAN);
    (plate.pixels.iter().zip(&covered))
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

#[cfg(test)]
mod tests {
    use super::super::pictures::{Filmed, Pose};
    use super::*;

    /// A head on shoulders that reach from side to side, with the head `at` a column, cropped to `columns`.
    fn subject(at: f32, columns: std::ops::Range<usize>) -> (Image, Mask) {
        let covers = |x: usize, y: usize| {
            let head = (x as f32 - at).hypot(y as f32 - 12.0) < 7.0;
            columns.contains(&x) && (head || y > 20)
        };
        let mask = Mask::from_fn(32, 32, |x, y| f32::from(u8::from(covers(x, y))));
        let plate = mask.map(|covered| [0.4 * covered; 3]);
        (plate, mask)
    }

    #[test]
    fn shoulders_that_a_narrow_plate_cuts_off_make_no_frame_unlike_the_poses() {
        let filmed = 7..25;
        let level = |shown: Mask| {
            let poses = [13.0, 15.0, 17.0, 19.0].map(|at| {
                let (plate, mask) = subject(at, 0..32);
                let (matte, name, shading) = Default::default();
                Pose { olats: vec![], peaks: vec![], plate, mask, matte, name, shading }
            });
            let frames = [14.0, 16.0, 18.0].map(|at| {
                let (plate, mask) = subject(at, filmed.clone());
                let name = "frame".to_owned();
                Filmed { name, plate, mask, matte: String::new() }
            });
            let pictures =
                Pictures { poses: poses.into(), frames: frames.into(), shown, all_frames: 3 };
            check(&pictures).level
        };
        assert_eq!(level(Mask::filled(32, 32, 1.0)), Level::Bad);
        let shown = |x, _| f32::from(u8::from(filmed.contains(&x)));
        assert_eq!(level(Mask::from_fn(32, 32, shown)), Level::Good);
    }
}
