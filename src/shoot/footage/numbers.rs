//! Numbers of the interview's frames in the names of its files: `plate.1001.exr` …

use super::shoot::stem;
use base::FileFormat;
use base::error::Result;
use project::{Clip, Frames, Project};
use std::ops::RangeInclusive;
use std::path::Path;

/// Frame numbers that files can have; larger ones are dates or times.
pub const FRAME_NUMBERS: RangeInclusive<i64> = -1_000_000_000..=1_000_000_000;

/// Number of the interview's first frame in its file's name. 0 for a movie, and if the numbers do not rise by one from frame
/// to frame.
///
/// # Errors
/// When the interview is a folder of pictures that cannot be read.
pub fn first_number(project: &Project) -> Result<i64> {
    let found = match &project.settings.shoot.frames {
        Frames::Named(names) => common_number(names),
        Frames::Clip(clip) => clip_number(clip, &project.shoot_path(&clip.movie))?,
    };
    Ok(found.unwrap_or(0))
}

fn clip_number(clip: &Clip, path: &Path) -> Result<Option<i64>> {
    if path.is_dir() {
        let pictures = movies::pictures(path)?;
        let (first, count) = (clip.first as usize, clip.count as usize);
        let names = pictures.iter().skip(first).take(count);
        let stems = names.map(|name| stem(name));
        return Ok(common_number(&stems.collect::<Vec<_>>()));
    }
    let is_sequence = FileFormat::from_path(path).is_some_and(FileFormat::is_sequence);
    let number = i64::try_from(clip.first).ok();
    Ok(number.filter(|number| is_sequence && FRAME_NUMBERS.contains(number)))
}

/// Number of the first of these names, without endings; `None` unless it rises by one from name to name and the rest
/// of the names is the same. In a single name the last number counts.
fn common_number(names: &[impl AsRef<str>]) -> Option<i64> {
    let first = names.first()?.as_ref();
    let mut end = first.len();
    while let Some(digit) = first[..end].rfind(|c: char| c.is_ascii_digit()) {
        let (stem, after) = first.split_at(digit + 1);
        let before = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        end = before.len();
        // A hyphen after a letter or digit joins; at the start and after a dot or underscore it is a sign.
        let unsigned = before.strip_suffix('-').filter(|before| before.is_empty() || before.ends_with(['.', '_']));
        let around = (unsigned.unwrap_or(before), after);
        let Some(start) = number(first, around).filter(|start| FRAME_NUMBERS.contains(start)) else { continue };
        let mut rest = (start..).zip(names);
        if rest.all(|(wanted, name)| number(name.as_ref(), around) == Some(wanted)) {
            return Some(start);
        }
    }
    None
}

/// Number in a name between two texts, in letters of any case.
fn number(name: &str, (before, after): (&str, &str)) -> Option<i64> {
    let end = name.len().checked_sub(after.len())?;
    let (start, digits, rest) = (name.get(..before.len())?, name.get(before.len()..end)?, name.get(end..)?);
    let is_same = start.eq_ignore_ascii_case(before) && rest.eq_ignore_ascii_case(after);
    // `parse` accepts a plus sign, too.
    (is_same && !digits.starts_with('+')).then(|| digits.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_that_rises_from_name_to_name_counts() {
        for (names, number) in [
            (&["plate.1001", "plate.1002", "plate.1003"][..], Some(1001)),
            (&["frame_000", "frame_001"], Some(0)),
            (&["s020_1001_v3", "s020_1002_v3"], Some(1001)),
            (&["A003_8", "a003_9", "A003_10"], Some(8)),
            (&["s.-2", "s.-1", "s.0", "s.1"], Some(-2)),
            (&["s.-002", "s.-001", "s.0000"], Some(-2)),
            (&["-1", "0"], Some(-1)),
            (&["shot-2", "shot-3"], Some(2)),
            (&["f_1", "f_02", "f_3"], Some(1)),
            (&["take 2 (7)"], Some(7)),
            // Steps, gaps, dates and other names.
            (&["f_10", "f_20"], None),
            (&["f_1", "f_2", "f_4"], None),
            (&["20240109123000", "20240109123001"], None),
            (&["99999999999999999999", "100000000000000000000"], None),
            (&["a1", "b2"], None),
            (&["é1", "é2"], Some(1)),
            (&["back", "front"], None),
            (&[], None),
        ] {
            assert_eq!(common_number(names), number, "{names:?}");
        }
    }

    #[test]
    fn sequences_and_folders_know_their_first_number_and_movies_start_at_0() {
        let folder = tempfile::tempdir().unwrap();
        let mut project = Project::without_shoot(folder.path());
        for (inside, names) in
            [("below", &["s.-2.exr", "s.-1.exr", "s.0.exr", "s.1.exr"][..]), ("apart", &["f_10.exr", "f_20.exr"])]
        {
            std::fs::create_dir(folder.path().join(inside)).unwrap();
            for name in names {
                std::fs::write(folder.path().join(inside).join(name), "").unwrap();
            }
        }
        for (movie, first, number) in [
            ("plates/plate.%04d.exr", 1001, 1001),
            ("plates/plate.####.dpx", 7, 7),
            ("talk.mov", 12, 0),
            ("below", 0, -2),
            ("below", 1, -1),
            ("apart", 0, 0),
        ] {
            let clip = Clip { movie: movie.into(), first, count: 2, alpha: false };
            project.settings.shoot.frames = Frames::Clip(clip);
            assert_eq!(first_number(&project).unwrap(), number, "{movie} from {first}");
        }
        project.settings.shoot.frames = vec!["a.0041".to_owned(), "a.0042".to_owned()].into();
        assert_eq!(first_number(&project).unwrap(), 41);
    }
}
