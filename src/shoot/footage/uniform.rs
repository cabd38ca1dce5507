//! Mattes with one value everywhere: a wrong file, or a movie with an alpha that nobody used.

use super::framed::read_matte;
use imaging::Mask;
use project::{Matte, Project};

/// Largest difference from the value, in coverage: a code of 8 bits and some noise of a codec.
const EVEN: f32 = 0.005;

/// The coverage, 0 or 1, that a matte has everywhere; None for others.
pub fn uniform_coverage(mask: &Mask) -> Option<f32> {
    let is_all = |value: f32| mask.pixels.iter().all(|covered| (covered - value).abs() <= EVEN);
    [0.0, 1.0].into_iter().find(|&value| !mask.pixels.is_empty() && is_all(value))
}

/// Doubts about the mattes of all poses and of some frames, spread over the interview, in sentences with their remedy.
/// Missing mattes and those that cannot be read are left out.
pub(super) fn doubts(project: &Project) -> Vec<String> {
    const FRAMES: usize = 9;
    let shoot = &project.settings.shoot;
    let count = shoot.frames.len();
    let looks = FRAMES.min(count);
    let frames = (0..looks).map(|i| i * (count - 1) / (looks - 1).max(1));
    let frames = frames.map(|frame| project.frame_matte(frame));
    let poses = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose));
    let mattes: Vec<Matte> = frames.chain(poses).collect();
    let covers = |matte: &Matte| uniform_coverage(&read_matte(matte).ok()?);
    let found: Vec<_> = mattes.iter().map(covers).collect();
    let doubt = |(value, what): (f32, &str)| {
        let mut these = mattes.iter().zip(&found).filter(|(_, found)| **found == Some(value));
        let (first, others) = (these.next()?.0, these.count());
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        Some(format!("The matte {}{others}, of {} checked, {what}", first.display(), mattes.len()))
    };
    let kinds = [(1.0, "covers the whole picture"), (0.0, "covers nothing")];
    kinds.into_iter().filter_map(doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImportSettings, import};
    use base::progress::{Control, Progress, Report};
    use std::sync::Mutex;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn coverage_is_uniform_within_a_code() {
        let half = |low: f32, high: f32| Mask::from_fn(4, 2, |x, _| if x < 2 { low } else { high });
        for (mask, expected) in [
            (half(0.0, 0.0), Some(0.0)),
            (half(0.0, 0.004), Some(0.0)),
            (half(1.0, 0.996), Some(1.0)),
            (half(0.0, 1.0), None),
            (half(0.5, 0.5), None),
            (Mask::filled(0, 0, 1.0), None),
        ] {
            assert_eq!(uniform_coverage(&mask), expected, "{:?}", mask.pixels);
        }
    }

    #[test]
    fn import_names_mattes_of_one_value() {
        let folder = tempfile::tempdir().unwrap();
        let shoot = folder.path().join("shoot");
        let stage = StageSettings { frames: 3, size: 32, lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &Progress::silent()).unwrap();
        let said = Mutex::new(Vec::new());
        let sink = |report| {
            if let Report::Advise { sentence, .. } = report {
                said.lock().unwrap().push(sentence);
            }
        };
        let heard = |name: &str| {
            let settings = ImportSettings { size: 16, seed: 1, layer: None };
            let progress = Progress::new(&sink, Control::default());
            import(&folder.path().join(name), &shoot, &settings, &progress).unwrap();
            let all = std::mem::take(&mut *said.lock().unwrap());
            all.into_iter().filter(|said| said.contains("matte")).collect::<Vec<_>>()
        };
        assert_eq!(heard("whole"), Vec::<String>::new());
        for (file, value) in [
            ("interview_masks/frame_001.png", 0),
            ("interview_masks/frame_002.png", 255),
            ("exemplar_masks/pose01.png", 255),
        ] {
            let path = shoot.join(file);
            let mut picture = image::open(&path).unwrap().to_luma8();
            picture.pixels_mut().for_each(|pixel| pixel.0 = [value]);
            picture.save(&path).unwrap();
        }
        let all = heard("doubted");
        assert_eq!(all.len(), 2, "{all:?}");
        for part in ["frame_002.png and 1 more", "covers the whole picture", "Replace the mattes"] {
            assert!(all[0].contains(part), "{all:?}");
        }
        assert!(all[1].contains("frame_001.png") && all[1].contains("covers nothing"), "{all:?}");
    }
}
