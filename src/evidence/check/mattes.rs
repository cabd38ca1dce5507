//! Mattes with one value everywhere: a wrong file, or a movie with an alpha that nobody used.

use super::check::{Check, Level, Subject};
use super::pictures::Pictures;
use footage::scan::counted;
use footage::uniform_coverage;
use imaging::{Mask, Raster};

/// Checks that each matte tells the subject from the background.
pub(super) fn check(pictures: &Pictures) -> Check {
    // A square may reach beyond the pictures, where nothing is covered.
    let within = |mask: &Mask| {
        let shown = mask.pixels.iter().zip(&pictures.shown.pixels).filter(|(_, shown)| **shown > 0.999);
        let pixels: Vec<f32> = shown.map(|(covered, _)| *covered).collect();
        uniform_coverage(&Raster { width: pixels.len(), height: 1, pixels })
    };
    let poses = pictures.poses.iter().map(|pose| (&pose.matte, &pose.mask));
    let frames = pictures.frames.iter().map(|frame| (&frame.matte, &frame.mask));
    let found: Vec<_> = poses.chain(frames).map(|(name, mask)| (name, within(mask))).collect();
    let even: Vec<_> = found.iter().filter_map(|(name, value)| Some((name, (*value)?))).collect();
    let Some((name, value)) = even.first() else {
        let sentence = format!("All {} separate subject and background", counted(found.len(), "matte"));
        return Check::new(Subject::Mattes, Level::Good, sentence);
    };
    let level = Level::new(even.len() as f32 / found.len() as f32, f32::MIN_POSITIVE, 0.5);
    let covers = if *value == 0.0 { "nothing" } else { "the whole picture" };
    let sentence = format!(
        "{} of {} checked mattes {} the same everywhere: the first, {name}, covers {covers}",
        even.len(),
        found.len(),
        if even.len() == 1 { "is" } else { "are" },
    );
    Check::new(Subject::Mattes, level, sentence).remedy(
        "Replace the mattes, or remove them and make new ones; if a movie's alpha is uniform, import without it",
    )
}
