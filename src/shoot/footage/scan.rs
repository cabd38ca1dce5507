//! Scan of a shoot's folder before import: contents, missing parts and their effect.

use super::missing_olats::lacks;
use super::shoot::{Listing, MANIFEST, Manifest, Part, file_name, picture_names};
use base::Result;
use imaging::file::{dimensions, with_ending};
use imaging::picture;
use project::Frames;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Contents of a shoot's folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    pub folder: PathBuf,
    /// Name in the manifest, or the folder's.
    pub name: String,
    /// Parts of the shoot, in order of use.
    pub lines: Vec<Line>,
    pub frames: usize,
    pub poses: usize,
    pub lamps: usize,
    /// Width and height of the first frame.
    pub picture: Option<(usize, usize)>,
    /// Layers of an EXR of the shoot that has several.
    pub layers: Vec<String>,
}

/// One part of a shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    pub part: &'static str,
    /// Summary of the part's contents.
    pub found: String,
    /// The part's fault and its effect.
    pub lack: Option<String>,
    /// True if a project needs the part.
    pub needed: bool,
}

impl Scan {
    /// True if the folder holds every part a project needs.
    pub fn is_complete(&self) -> bool {
        self.lines.iter().all(|line| line.lack.is_none() || !line.needed)
    }
}

/// True if `folder` looks like a shoot: it has a manifest, or an interview and exemplars.
pub fn is_shoot(folder: &Path) -> bool {
    let has = |name: &str| folder.join(name).is_dir();
    folder.join(MANIFEST).is_file() || (has("interview") && has("exemplars"))
}

/// Scans the shoot in `folder`: lists files, reads the manifest and the headers of a picture of each kind. (The import reads
/// every header.) EXR files are read by `layer`.
pub fn scan(folder: &Path, layer: Option<&str>) -> Scan {
    picture::choose_layer(folder, layer);
    let manifest = Manifest::read(folder);
    let listing = Listing::present(folder);
    let picture = match &listing.frames {
        Frames::Named(names) => {
            let first = names.first().map(|name| folder.join("interview").join(name));
            first.map(|name| dimensions(&with_ending(&name)))
        }
        Frames::Clip(clip) => Some(movies::open(&folder.join(&clip.movie)).map(|source| source.size())),
    };
    let layers = layers(folder, &listing);
    let rate = manifest.as_ref().ok().and_then(Manifest::frame_rate);
    let rate = listing.frame_rate.or(rate).unwrap_or(24.0);
    let lines = vec![
        manifest_line(folder, &manifest, &listing),
        interview(&listing, picture.as_ref(), rate),
        exemplars(folder, &listing),
        mirror_balls(folder, &listing),
        mattes(folder, &listing),
        environments(folder, manifest.as_ref().ok()),
    ];
    Scan {
        folder: folder.to_path_buf(),
        name: (manifest.ok().and_then(|m| m.name)).unwrap_or_else(|| file_name(folder)),
        lines,
        frames: listing.frames.len(),
        poses: listing.poses.len(),
        lamps: listing.lamps.len(),
        picture: picture.and_then(Result::ok),
        layers,
    }
}

/// Layers of the first frame, OLAT or mirror ball that has several.
fn layers(folder: &Path, listing: &Listing) -> Vec<String> {
    let first = |inside: &str| {
        let name = picture_names(&folder.join(inside)).ok()?.into_iter().next()?;
        Some(with_ending(&folder.join(inside).join(name)))
    };
    let poses = listing.poses.first().map(|pose| format!("exemplars/{pose}"));
    let folders = ["interview", "probes"].into_iter().chain(poses.as_deref());
    let found = folders.filter_map(first).filter_map(|file| picture::layers(&file).ok());
    found.max_by_key(Vec::len).unwrap_or_default()
}

/// A part that every project needs.
fn needed(part: &'static str, found: String, lack: Option<String>) -> Line {
    Line { part, found, lack, needed: true }
}

fn manifest_line(folder: &Path, manifest: &Result<Manifest>, listing: &Listing) -> Line {
    let (found, lack) = match manifest {
        Ok(manifest) => (
            if manifest.ball().is_far() {
                "no sizes: camera and lamps count as far away"
            } else {
                "positions of camera and mirror ball"
            },
            (manifest.check_counts(folder, listing).err()).map(|e| e.to_string()),
        ),
        Err(e) => {
            ("none", Some(format!("{e}. It holds the positions of camera and ball, needed for the lamps' directions")))
        }
    };
    needed("Manifest", found.to_owned(), lack)
}

fn interview(listing: &Listing, picture: Option<&Result<(usize, usize)>>, rate: f64) -> Line {
    let frames = counted(listing.frames.len(), "frame");
    let (found, lack) = match picture {
        Some(Ok((width, height))) => (format!("{frames} of {width} × {height} pixels, {rate} a second"), None),
        Some(Err(e)) => (frames, Some(e.to_string())),
        None => ("no frames".to_owned(), Some("Add the frames to relight as pictures to interview/".to_owned())),
    };
    needed("Interview", found, fault(listing, Part::Interview).or(lack))
}

fn exemplars(folder: &Path, listing: &Listing) -> Line {
    let Listing { poses, lamps, .. } = listing;
    let is_movie = |pose: &&String| listing.pose_movies.contains_key(*pose) || listing.takes.poses.contains_key(*pose);
    let lacking = listing.lacking(folder);
    let lack = if poses.is_empty() || (lamps.is_empty() && !poses.iter().all(|pose| is_movie(&pose))) {
        Some(
            "Add a picture of each pose under each lamp as exemplars/POSE/LAMP.png: the network learns \
             every lamp's effect from them"
                .to_owned(),
        )
    } else {
        let olats = poses.iter().filter(|pose| !is_movie(pose)).flat_map(|pose| {
            let there = pictures(folder, &format!("exemplars/{pose}"));
            let tolerated = lacking.get(pose);
            let missing = lamps
                .iter()
                .filter(move |&lamp| !there.contains(lamp) && !tolerated.is_some_and(|lamps| lamps.contains(lamp)));
            missing.map(move |lamp| format!("exemplars/{pose}/{lamp}.png"))
        });
        absent(
            &olats.collect::<Vec<_>>(),
            "Every pose needs a picture under every lamp: a relit pose would lack that light",
        )
    };
    let lamps = match lamps.len() {
        0 if lack.is_none() => "the lamps of their movies".to_owned(),
        count => counted(count, "lamp"),
    };
    let found = format!("{} × {lamps}", counted(poses.len(), "pose"));
    let lack = fault(listing, Part::Exemplars).or(lack);
    if lack.is_none() && !lacking.is_empty() {
        let lack = Some(lacks(&lacking).collect::<Vec<_>>().join("; "));
        return Line { part: "Poses", found, lack, needed: false };
    }
    needed("Poses", found, lack)
}

fn mirror_balls(folder: &Path, listing: &Listing) -> Line {
    if listing.without_balls {
        return Line {
            part: "Mirror balls",
            found: "none: directions by the list of lamps".to_owned(),
            lack: Some(
                "The interview's light and the lamps' energies are found from the subject, the camera's response only if \
                 a frame shows a pose"
                    .to_owned(),
            ),
            needed: false,
        };
    }
    let there = pictures(folder, "probes");
    let interview = listing.interview_ball.is_none().then_some("interview");
    let is_take = listing.ball_movie.is_some() || listing.takes.balls.is_some();
    let lamps = if is_take { &[] } else { &listing.lamps[..] };
    let wanted = interview.into_iter().chain(lamps.iter().map(String::as_str));
    let missing: Vec<String> =
        wanted.filter(|&name| !there.contains(name)).map(|name| format!("probes/{name}.png")).collect();
    needed(
        "Mirror balls",
        match &listing.ball_movie {
            Some(movie) => {
                format!("{} and {}", movie.display(), counted(there.len(), "photograph"))
            }
            None => counted(there.len(), "photograph"),
        },
        fault(listing, Part::Balls).or_else(|| {
            absent(&missing, "The lamps' directions and the interview's light are measured from the balls")
        }),
    )
}

fn mattes(folder: &Path, listing: &Listing) -> Line {
    let Listing { poses, frames, .. } = listing;
    let (mut found, mut missing) = (0, Vec::new());
    if poses.is_empty() && frames.is_empty() {
        missing.extend(["exemplar_masks/POSE.png", "interview_masks/FRAME.png"].map(str::to_owned));
    }
    let movie = listing.takes.interview_mattes.as_ref();
    found += movie.map_or(0, |_| frames.len());
    let frames = match frames {
        Frames::Named(names) => &names[..],
        Frames::Clip(_) => &[],
    };
    let mut later = Vec::new();
    for (inside, what, wanted) in [("exemplar_masks", "poses", &poses[..]), ("interview_masks", "interview", frames)] {
        let there = pictures(folder, inside);
        // `afterlight matte` makes all of them, but does not fill gaps in a shoot's own mattes.
        if !folder.join(inside).exists() {
            later.extend((!wanted.is_empty()).then_some(what));
            continue;
        }
        found += wanted.iter().filter(|&name| there.contains(name)).count();
        let lacks = wanted.iter().filter(|&name| !there.contains(name));
        missing.extend(lacks.map(|name| format!("{inside}/{name}.png")));
    }
    let found = match found {
        0 if missing.is_empty() => "none yet".to_owned(),
        found => counted(found, "matte"),
    };
    let wrong = fault(listing, Part::Mattes)
        .or_else(|| absent(&missing, "The mattes mark the subject, the only part that is learnt and relit"));
    match (wrong, &later[..]) {
        (None, [_, ..]) => Line {
            part: "Mattes",
            found,
            lack: Some(format!("Missing for {}: the studio makes them", later.join(" and "))),
            needed: false,
        },
        (wrong, _) => needed("Mattes", found, wrong),
    }
}

/// Names of the pictures in a folder of the shoot; empty if it cannot be read.
fn pictures(folder: &Path, inside: &str) -> HashSet<String> {
    let names = picture_names(&folder.join(inside)).unwrap_or_default();
    names.into_iter().collect()
}

/// Several candidates for a part.
fn fault(listing: &Listing, part: Part) -> Option<String> {
    let fault = listing.faults.iter().find(|(faulty, _)| *faulty == part);
    fault.map(|(_, error)| error.to_string())
}

/// Environments can be added at any time.
fn environments(folder: &Path, manifest: Option<&Manifest>) -> Line {
    let named = manifest.map_or(&[][..], |manifest| &manifest.hdris);
    let missing: Vec<String> = (named.iter())
        .filter(|one| !folder.join(&one.file).is_file())
        .map(|one| one.file.display().to_string())
        .collect();
    Line {
        part: "Environments",
        found: counted(named.len() - missing.len(), "panorama"),
        lack: if named.is_empty() {
            Some("You can relight with the built-in environments, and add your own panoramas later".to_owned())
        } else {
            absent(&missing, "The others and the built-in environments can still be used")
        },
        needed: false,
    }
}

fn absent(files: &[String], why: &str) -> Option<String> {
    let first = files.first()?;
    let more = match files.len() - 1 {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let is = if files.len() == 1 { "is" } else { "are" };
    Some(format!("{first}{more} {is} missing. {why}"))
}

/// A count with its noun.
pub fn counted(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImportSettings, import};
    use base::progress::Progress;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn a_whole_shoot_is_complete_and_each_hole_is_named_with_its_reason() {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 2, size: 16, lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent).unwrap();
        assert!(is_shoot(&shoot) && !is_shoot(folder.path()));
        let whole = scan(&shoot, None);
        assert!(whole.is_complete(), "{whole:?}");
        assert_eq!((whole.frames, whole.lamps, whole.picture), (2, 4, Some((16, 16))));
        assert!(whole.lines[2].found.ends_with("× 4 lamps"));
        assert_eq!(whole.lines[3].found, "5 photographs");

        let refused = |project: &str| {
            let settings = ImportSettings { size: 16, seed: 1, layer: None };
            import(&folder.path().join(project), &shoot, &settings, &silent).is_err()
        };
        for (line, file, says) in [
            (0, "manifest.json", ["manifest.json", "direction"]),
            (0, "interview/frame_000.png", ["`frames`", "the folder has 1"]),
            (3, "probes/interview.png", ["probes/interview.png", "measured"]),
            (4, "interview_masks/frame_001.png", ["frame_001.png", "subject"]),
        ] {
            let path = shoot.join(file);
            let bytes = std::fs::read(&path).unwrap();
            std::fs::remove_file(&path).unwrap();
            let holed = scan(&shoot, None);
            let sentence = holed.lines[line].lack.clone().unwrap_or_default();
            assert!(says.iter().all(|word| sentence.contains(word)), "{file}: {sentence}");
            assert!(!holed.is_complete() && refused("film"), "{file}");
            std::fs::write(&path, bytes).unwrap();
        }
        // A lamp that lacks in every pose, and one that lacks in one.
        let olat = |pose: &str| shoot.join(format!("exemplars/{pose}/olat_01.png"));
        let poses: Vec<String> = (0..whole.poses).map(|pose| format!("pose{pose:02}")).collect();
        let bytes: Vec<_> = poses.iter().map(|pose| std::fs::read(olat(pose)).unwrap()).collect();
        std::fs::remove_file(olat(&poses[0])).unwrap();
        let holed = scan(&shoot, None);
        let sentence = holed.lines[2].lack.clone().unwrap_or_default();
        assert!(sentence.contains("pose00 lacks olat_01: its other lamps stand in"));
        assert!(holed.is_complete());
        poses[1..].iter().for_each(|pose| std::fs::remove_file(olat(pose)).unwrap());
        let holed = scan(&shoot, None);
        let sentence = holed.lines[2].lack.clone().unwrap_or_default();
        assert!(sentence.contains("pose00/olat_01.png") && sentence.contains("under every lamp"));
        assert!(!holed.is_complete() && refused("film"));
        poses.iter().zip(bytes).for_each(|(pose, bytes)| std::fs::write(olat(pose), bytes).unwrap());
        let nothing = scan(&folder.path().join("nothing"), None);
        assert!(!nothing.is_complete() && nothing.name == "nothing");
        assert!(nothing.lines.iter().all(|line| line.lack.is_some()));
        assert_eq!(scan(&shoot, None), whole);
    }
}
