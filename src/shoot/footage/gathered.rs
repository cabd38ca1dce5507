//! A shoot assembled from single parts: missing parts, misfits, and its map.

use super::candidate::{Candidate, Slot};
use super::round;
use base::error::{Error, Result};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Parts with their assigned slots.
pub type Gathered<'a> = [(Slot, &'a Candidate)];

/// Number of lamps in the parts, from the list or else the mirror ball's movie.
pub fn lamps(parts: &Gathered) -> Option<usize> {
    let candidates = |slot| parts.iter().filter(move |(is, _)| *is == slot).map(|(_, part)| part);
    let listed = candidates(Slot::Lamps).find_map(|list| list.lamps);
    let shown = |ball: &&Candidate| round::find(&ball.light, ball.first, None).ok().map(|round| round.lamps.len());
    listed.or_else(|| candidates(Slot::Balls).find_map(shown))
}

/// Name of the shoot: the name of the interview's folder.
pub fn name(parts: &Gathered) -> Option<String> {
    let interview = parts.iter().find(|(slot, _)| *slot == Slot::Interview)?.1;
    let folder = interview.path.parent()?.file_name()?;
    Some(folder.to_string_lossy().into_owned())
}

/// Reason that a part does not fit its slot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// The reason, and the remedy.
    pub sentence: String,
    /// True for a judgement of its brightness, which a person may overrule; false for a fact.
    pub is_guess: bool,
}

/// Reason why part `index` does not fit its slot; `None` if it fits.
pub fn misfit(parts: &Gathered, index: usize) -> Option<Misfit> {
    let (slot, part) = parts[index];
    let fact = |sentence: String| Some(Misfit { sentence, is_guess: false });
    let guess = |sentence: String| Some(Misfit { sentence, is_guess: true });
    if let Some(failure) = &part.failure {
        return fact(failure.clone());
    }
    let earlier = parts[..index].iter().any(|(is, _)| *is == slot);
    if earlier && slot != Slot::Pose {
        return fact("Already present: remove one of them, or choose another type for this one".to_owned());
    }
    let is_list = part.lamps.is_some();
    match slot {
        Slot::Lamps if !is_list => fact("Not a list of lamps (.lp)".to_owned()),
        Slot::Lamps => None,
        _ if is_list => fact("This is a list of lamps".to_owned()),
        Slot::InterviewBall => None,
        Slot::Interview if part.frames < 2 => fact("An interview needs two or more".to_owned()),
        Slot::Interview if part.jumps == Some(true) => {
            guess("The brightness jumps from frame to frame, as in a lamp cycle: probably a pose".to_owned())
        }
        Slot::Interview => None,
        Slot::Balls | Slot::Pose if part.light.is_empty() => guess(match (part.jumps, slot) {
            (Some(true), _) => format!(
                "{} frames are too many for a lamp cycle. Trim it, or give the frames in a map (docs/movies.md)",
                part.frames
            ),
            (_, Slot::Balls) => "Neither the highlight nor the brightness changes as in a lamp cycle".to_owned(),
            _ => "The brightness does not change as in a lamp cycle".to_owned(),
        }),
        Slot::Balls | Slot::Pose => fact(round::find(&part.light, part.first, lamps(parts)).err()?),
    }
}

/// First missing part; `None` if a project can be made.
pub fn missing(parts: &Gathered) -> Option<Slot> {
    let needed = [Slot::Interview, Slot::InterviewBall, Slot::Balls, Slot::Pose];
    needed.into_iter().find(|slot| !parts.iter().any(|(is, _)| is == slot))
}

/// Map of the parts, to be saved in the existing folder `beside`.
///
/// # Errors
/// When a part is missing, or its folder cannot be found or has a name that is not UTF-8.
pub fn map(parts: &Gathered, beside: &Path) -> Result<String> {
    const REMEDY: &str = "Bring all parts of the shoot";
    if let Some(slot) = missing(parts) {
        return Err(Error::missing(format!("the shoot has no {}", slot.name()), REMEDY));
    }
    // Patterns are not files.
    let full = |path: &Path| -> Result<PathBuf> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let name = path.file_name().unwrap_or_default();
        let fail = |e| Error::io("open", folder, e, "Check that it is there");
        Ok(folder.canonicalize().map_err(fail)?.join(name))
    };
    let paths = parts.iter().map(|(_, part)| full(&part.path)).collect::<Result<Vec<_>>>()?;
    let mut folder = paths[0].parent().unwrap_or(Path::new("/")).to_path_buf();
    while !paths.iter().all(|path| path.starts_with(&folder)) {
        folder.pop();
    }
    let quoted = |path: &Path| match path.to_str() {
        Some(text) => Ok(toml::Value::from(text).to_string()),
        None => Err(Error::invalid(format!("{} is not a UTF-8 name", path.display()), "Rename it")),
    };
    let all = |slot: Slot| {
        let these = parts.iter().zip(&paths).filter(move |((is, _), _)| *is == slot);
        these.map(|(_, path)| quoted(path.strip_prefix(&folder).unwrap_or(path)).map(|file| (file, path)))
    };
    let one = |slot: Slot| all(slot).next().transpose().map(|one| one.map(|(file, _)| file).unwrap_or_default());
    let mut text = format!("folder = {}\n", quoted(&project::relative(beside, &folder)?)?);
    if let Some(name) = name(parts) {
        let _ = writeln!(text, "name = {}", toml::Value::from(name));
    }
    if let Some(list) = all(Slot::Lamps).next() {
        let _ = writeln!(text, "lamps = {}", list?.0);
    }
    let (interview, ball) = (one(Slot::Interview)?, one(Slot::InterviewBall)?);
    let _ = writeln!(text, "\n[interview]\nfile = {interview}\nball = {{ file = {ball} }}");
    let _ = writeln!(text, "\n[balls]\nfile = {}", one(Slot::Balls)?);
    let mut names = BTreeSet::new();
    for pose in all(Slot::Pose) {
        let (file, path) = pose?;
        let name = toml::Value::from(free_name(path, &mut names)).to_string();
        let _ = writeln!(text, "\n[[pose]]\nname = {name}\nfile = {file}");
    }
    Ok(text)
}

/// Unused pose name, taken from the pose's file.
fn free_name(path: &Path, taken: &mut BTreeSet<String>) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let stem = stem.split(['%', '#']).next().unwrap_or_default();
    let stem = stem.trim_end_matches(['.', '_', '-', ' ']);
    let stem: String = stem.chars().filter(|c| !matches!(c, '/' | '\\' | '\0')).collect();
    let stem = if stem.is_empty() { "pose".to_owned() } else { stem };
    let numbered = (2..).map(|n| format!("{stem}_{n}"));
    let mut names = std::iter::once(stem.clone()).chain(numbered);
    names.find(|name| taken.insert(name.clone())).unwrap_or(stem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::expand;
    use crate::{ImportSettings, import};
    use base::progress::Progress;
    use imaging::{Encoded, Raster};
    use test_support::shown;
    use virtual_stage::{StageSettings, TroubleSettings, WrittenAs, write_shoot};

    const LAMPS: usize = 8;

    /// A filmed shoot in two folders whose file names carry no information, except the balls'.
    fn scattered(folder: &Path) -> Vec<PathBuf> {
        let stage = StageSettings {
            frames: 6,
            size: 32,
            lamps: LAMPS,
            written_as: WrittenAs::Movies,
            trouble: TroubleSettings { tracking: Some(4), ..TroubleSettings::default() },
            ..StageSettings::default()
        };
        let shoot = folder.join("stage");
        write_shoot(&shoot, &stage, &Progress::silent()).unwrap();
        let [day, balls] = ["day 1 \u{201c}A\u{201d}", "second card"].map(|name| folder.join(name));
        std::fs::create_dir(&day).unwrap();
        std::fs::create_dir(&balls).unwrap();
        let moved = [
            ("interview.mov", day.join("A001.mov")),
            ("exemplars/pose00.mov", day.join("A002.mov")),
            ("exemplars/pose01.mov", day.join("A003.mov")),
            ("probes.mov", balls.join("chrome.mov")),
            ("probes/interview.png", balls.join("B7.png")),
        ];
        for (from, to) in &moved {
            std::fs::rename(shoot.join(from), to).unwrap();
        }
        moved.into_iter().map(|(_, to)| to).collect()
    }

    #[test]
    fn scattered_files_are_told_apart_and_become_a_project() {
        if !test_support::ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let files = scattered(folder.path());
        let dropped: Vec<PathBuf> = expand(files[0].parent().unwrap());
        assert_eq!(dropped, files[..3], "a folder of movies expands to the movies");
        assert_eq!(expand(&files[4]), files[4..]);
        let looked: Vec<Candidate> = files.iter().map(|file| Candidate::look(file)).collect();
        let expected = [Slot::Interview, Slot::Pose, Slot::Pose, Slot::Balls, Slot::InterviewBall];
        for (candidate, slot) in looked.iter().zip(expected) {
            assert_eq!(candidate.guess, Some(slot), "{candidate:?}");
            assert_eq!(candidate.failure, None);
            assert_eq!(candidate.thumbnails.len(), if slot == Slot::InterviewBall { 1 } else { 3 });
        }
        for word in ["8 frames each lit by one lamp", "3 fully lit"] {
            assert!(looked[1].reason.contains(word), "{}", looked[1].reason);
        }
        // Thumbnails show three lamps, not three fully lit frames.
        let [a, b, _] = &looked[1].thumbnails[..] else {
            panic!("expected three thumbnails");
        };
        let off = a.0.pixels.iter().zip(&b.0.pixels);
        let off = off.map(|(a, b)| (a[1] - b[1]).abs()).sum::<f32>() / a.0.pixels.len() as f32;
        assert!(off > 0.01, "{off}");
        assert!(looked[3].reason.contains("chrome"), "{}", looked[3].reason);
        let parts: Vec<_> = expected.into_iter().zip(&looked).collect();
        for part in 0..parts.len() {
            assert_eq!(misfit(&parts, part), None, "{:?}", parts[part].0);
        }
        assert_eq!((lamps(&parts), missing(&parts)), (Some(LAMPS), None));
        let root = folder.path().join("project");
        std::fs::create_dir(&root).unwrap();
        std::fs::write(root.join("shoot.toml"), map(&parts, &root).unwrap()).unwrap();
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        let project = import(&root, &root.join("shoot.toml"), &settings, &Progress::silent()).unwrap();
        let shoot = &project.settings.shoot;
        assert_eq!((&*shoot.poses, shoot.lamps.len()), (&["A002".to_owned(), "A003".to_owned()][..], LAMPS));
        assert_eq!((shoot.frames.len(), &*project.settings.name), (6, "day 1 \u{201c}A\u{201d}"));
        assert!(shoot.folder.is_relative());
        shown!(
            Strangers,
            "Movies straight from cameras' cards, in several folders, under meaningless names",
            done: "names and brightness classify each, with the reason; a map of them is made and imported",
        );
    }

    #[test]
    fn balls_of_one_brightness_are_known_by_their_moving_highlight() {
        let folder = tempfile::tempdir().unwrap();
        let frames = |name: &str, spot: &dyn Fn(usize) -> [usize; 2]| {
            let folder = folder.path().join(name);
            for i in 0..41 {
                let [x, y] = spot(i);
                let near = |u: usize, v: usize| u.abs_diff(x) < 2 && v.abs_diff(y) < 2;
                let picture = Raster::from_fn(96, 64, |u, v| if near(u, v) { [0.9; 3] } else { [0.02; 3] });
                let path = folder.join(format!("{i:02}.png"));
                imaging::file::write_png(&path, &Encoded(picture)).unwrap();
            }
            Candidate::look(&folder)
        };
        // Lamps around the ball, and a person who sways.
        let around = |i: usize| {
            let turn = i as f32 * 0.6;
            [48.0 + 20.0 * turn.cos(), 32.0 + 20.0 * turn.sin()].map(|at| at as usize)
        };
        let balls = frames("A003", &around);
        assert_eq!((balls.guess, balls.jumps), (Some(Slot::Balls), Some(false)), "{balls:?}");
        assert!(balls.reason.contains("41 frames each lit by one lamp"), "{}", balls.reason);
        let parts = [(Slot::Balls, &balls)];
        assert_eq!((misfit(&parts, 0), lamps(&parts)), (None, Some(41)));
        let person = frames("A004", &|i| [40 + i / 8, 20]);
        assert_eq!(person.guess, Some(Slot::Interview), "{person:?}");
        let wrong = misfit(&[(Slot::Balls, &person)], 0).unwrap();
        assert!(wrong.is_guess && wrong.sentence.contains("highlight"), "{wrong:?}");
    }

    #[test]
    fn what_does_not_fit_says_why() {
        if !test_support::ffmpeg() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let files = scattered(folder.path());
        let list = folder.path().join("dome.lp");
        std::fs::write(&list, "3\na 0 0 1\nb 0 1 0\nc 1 0 0\n").unwrap();
        let broken = folder.path().join("broken.mov");
        std::fs::write(&broken, "no movie").unwrap();
        let look = |file: &Path| Candidate::look(file);
        let (interview, pose, list) = (look(&files[0]), look(&files[1]), look(&list));
        let broken = look(&broken);
        let said = |parts: &Gathered| misfit(parts, parts.len() - 1).map_or_else(String::new, |misfit| misfit.sentence);
        for (parts, says) in [
            (&[(Slot::Interview, &pose)][..], "jumps"),
            (&[(Slot::Pose, &interview)], "does not change"),
            (&[(Slot::Lamps, &list), (Slot::Pose, &pose)], "3 lamps"),
            (&[(Slot::Pose, &list)], "list of lamps"),
            (&[(Slot::Lamps, &pose)], "Not a list"),
            (&[(Slot::Interview, &broken)], "broken.mov"),
            (&[(Slot::Interview, &interview), (Slot::Interview, &interview)], "Already present"),
        ] {
            assert!(said(parts).contains(says), "{says}: {}", said(parts));
        }
        let some = [(Slot::Interview, &interview)];
        assert_eq!(missing(&some), Some(Slot::InterviewBall));
        assert!(map(&some, folder.path()).is_err());
        shown!(
            Strangers,
            "A file in the wrong slot, or poses that do not match the lamps",
            done: "each file shows its misfit before a project is made",
        );
    }
}
