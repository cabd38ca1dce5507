//! Single-lamp frames of a movie of a lamp cycle.
//!
//! Brightness alone separates three kinds of frames: fully lit ones (tracking frames, several lamps at once),
//! single lamps (OLATs), and dark ones before, between and after. A known number of lamps resolves ambiguities. A
//! mismatch is refused, with the counts.

use super::scan::counted;

/// Contents of a movie, as ascending frame numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Round {
    /// Frame of each single lamp, in order of time.
    pub lamps: Vec<u64>,
    /// Fully lit frames between the first lamp and the last, or adjacent to them.
    pub tracking: Vec<u64>,
}

/// Smallest brightness ratio of fully lit frames to the brightest single lamp: a lamp may give half of all light.
const LIT: f32 = 1.7;
/// Largest brightness ratio between fully lit frames of one cycle.
const ALIKE: f32 = 1.15;
/// Smallest brightness ratio of the darkest lamp to dark frames.
const DARK: f32 = 4.0;
/// Smallest brightness ratio of the brightest frame to dark frames.
const FAINT: f32 = 20.0;
/// Linear light below this is black in 8 bits.
const BLACK: f32 = 1e-4;

/// Finds the lamps in frames of mean linear light `light`, starting with frame number `first`. `expected` is the
/// number of lamps, if known.
///
/// # Errors
/// When no frame shows a single lamp, or their number differs from the expected one; the message lists the frames
/// found.
pub fn find(light: &[f32], first: u64, expected: Option<usize>) -> Result<Round, String> {
    if light.is_empty() {
        return Err("it has no frames".to_owned());
    }
    let (dark, lit) = bounds(light);
    let frame = |i: usize| first + i as u64;
    let is_lit = |i: usize| light[i] >= lit;
    let bright: Vec<usize> = (0..light.len()).filter(|&i| light[i] > dark).collect();
    let single: Vec<usize> = bright.iter().copied().filter(|&i| !is_lit(i)).collect();
    let (Some(&start), Some(&end)) = (single.first(), single.last()) else {
        return Err("no frame with a single lamp".to_owned());
    };
    // A lamp behind the subject may leave it as dark as no lamp does.
    let with_dark: Vec<usize> = (start..=end).filter(|&i| !is_lit(i)).collect();
    let groups = groups(&single);
    let middle = |group: &[usize]| group[(group.len() - 1) / 2];
    let found = match expected {
        None => single.clone(),
        Some(count) if single.len() == count => single.clone(),
        Some(count) if with_dark.len() == count => with_dark,
        // Some lamps are far brighter than others, and no frame is fully lit.
        Some(count) if bright.len() == count && differ(&bright, light, lit) => bright.clone(),
        Some(count) if groups.len() == count => groups.iter().map(|group| middle(group)).collect(),
        Some(count) if single.len().is_multiple_of(count) => {
            // Every lamp was on for the same number of frames.
            single.chunks(single.len() / count).map(middle).collect()
        }
        Some(count) => {
            return Err(format!(
                "{} with a single lamp, from {} to {}, for {}. {} fully lit, {} dark",
                counted(single.len(), "frame"),
                frame(start),
                frame(end),
                counted(count, "lamp"),
                bright.len() - single.len(),
                light.len() - bright.len()
            ));
        }
    };
    let round = found[0].saturating_sub(1)..=found[found.len() - 1] + 1;
    let is_tracking = |i: &&usize| is_lit(**i) && round.contains(*i) && !found.contains(*i);
    let tracking = bright.iter().filter(is_tracking);
    Ok(Round { tracking: tracking.map(|&i| frame(i)).collect(), lamps: found.into_iter().map(frame).collect() })
}

/// Upper limit of dark frames and lower limit of fully lit ones: the widest brightness gaps between frames.
fn bounds(light: &[f32]) -> (f32, f32) {
    let mut sorted: Vec<f32> = light.iter().copied().filter(|l| l.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    let step = |i: &usize| sorted[i + 1].max(BLACK) / sorted[*i].max(BLACK);
    let widest = |steps: std::ops::Range<usize>, least: f32| {
        let widest = steps.max_by(|a, b| step(a).total_cmp(&step(b)));
        widest.filter(|i| step(i) >= least)
    };
    let steps = sorted.len().saturating_sub(1);
    // Most frames may be dark, but not black in every camera.
    let dark = widest(0..steps * 3 / 4, DARK).map(|i| sorted[i]);
    let dark = dark.filter(|dark| *dark < sorted[steps] / FAINT).unwrap_or(BLACK).max(BLACK);
    // Fewer than half of the others are fully lit.
    let first = sorted.partition_point(|&l| l <= dark);
    let lit = widest((first + steps) / 2..steps, LIT).map(|i| sorted[i + 1]);
    (dark, lit.unwrap_or(f32::INFINITY))
}

/// True if the frames from `lit` on differ in light, as lamps do and fully lit frames do not.
fn differ(bright: &[usize], light: &[f32], lit: f32) -> bool {
    let lit = bright.iter().map(|&i| light[i]).filter(|&l| l >= lit);
    let (least, most) = lit.fold((f32::INFINITY, 0f32), |(least, most), l| (least.min(l), most.max(l)));
    most > ALIKE * least
}

/// Runs of consecutive frames.
fn groups(frames: &[usize]) -> Vec<&[usize]> {
    frames.chunk_by(|a, b| b - a == 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lamps of different strength, by frame: `l` a lamp, `t` fully lit, `.` dark.
    fn light(pattern: &str) -> Vec<f32> {
        let mut lamp = 0;
        let lights = pattern.chars().map(|kind| match kind {
            't' => 0.4,
            'l' => {
                lamp += 1;
                0.004 + 0.03 * (0.5 + 0.5 * (lamp as f32).sin())
            }
            _ => 0.00012,
        });
        lights.collect()
    }

    #[test]
    fn as_many_frames_as_lamps_are_the_lamps_however_bright() {
        let strong = [0.01, 0.02, 0.09, 0.012, 0.2, 0.015, 0.01, 0.3, 0.02];
        let found = find(&strong, 5, Some(9)).unwrap();
        assert_eq!(found.lamps, (5..14).collect::<Vec<_>>());
        assert_eq!(found.tracking, [0u64; 0]);
        let with_dark = [&[0.0f32, 0.0][..], &strong, &[0.0]].concat();
        let found = find(&with_dark, 0, Some(9)).unwrap();
        assert_eq!(found.lamps, (2..11).collect::<Vec<_>>());
        assert_eq!(found.tracking, [0u64; 0]);
    }

    #[test]
    fn lamps_and_fully_lit_frames_are_told_apart() {
        let found = find(&light("...tlllltlllltllllt.."), 100, None).unwrap();
        assert_eq!(found.tracking, [103, 108, 113, 118]);
        assert_eq!(found.lamps.len(), 12);
        assert_eq!(found.lamps[0], 104);
        // Without tracking frames, and with dark frames between.
        for pattern in ["llllllllllll", "..llllllllllll.", ".l.l.l.l.l.l.l.l.l.l.l.l."] {
            let found = find(&light(pattern), 0, Some(12)).unwrap();
            let expected = pattern.char_indices().filter(|(_, c)| *c == 'l');
            assert_eq!(found.lamps, expected.map(|(i, _)| i as u64).collect::<Vec<_>>(), "{pattern}");
            assert!(found.tracking.is_empty());
        }
    }

    #[test]
    fn a_lamp_that_burns_for_frames_gives_its_middle_one() {
        let held = find(&light(".lll.lll.lll.lll."), 0, Some(4)).unwrap();
        assert_eq!(held.lamps, [2, 6, 10, 14]);
        let joined = find(&light("lllllllll"), 0, Some(3)).unwrap();
        assert_eq!(joined.lamps, [1, 4, 7]);
    }

    #[test]
    fn a_lamp_behind_the_subject_is_counted_where_the_number_is_known() {
        let found = find(&light("..tllll.llllt.."), 0, Some(9)).unwrap();
        assert_eq!(found.lamps, [3, 4, 5, 6, 7, 8, 9, 10, 11]);
        assert_eq!(found.tracking, [2, 12]);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_its_counts() {
        let said = find(&light("..tlllllllt."), 40, Some(9)).unwrap_err();
        for word in ["7 frames", "43 to 49", "9 lamps", "2 fully lit", "3 dark"] {
            assert!(said.contains(word), "{said}");
        }
        for nothing in [vec![], vec![0.0; 30], vec![f32::NAN; 9]] {
            assert!(find(&nothing, 0, None).is_err());
        }
        test_support::shown!(
            Strangers,
            "A movie of a pose with more or fewer single-lamp frames than lamps",
            done: "the import is refused, with the number of frames lit by one lamp, by all, or by none",
        );
    }
}
