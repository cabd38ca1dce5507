//! Mattes that a shoot does not bring, made and kept in the project.

use super::damaged::{offer, stand_in};
use super::framed::read_picture;
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::{Encoded, Mask, color::byte_from_unit, file};
use matte::{Key, boxed, guessed, key, lit};
use project::{Picture, Project};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Which mattes were made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MattesReport {
    /// The project.
    pub project: PathBuf,
    /// Mattes of interview frames that were made.
    pub frames: usize,
    /// Mattes of poses that were made.
    pub poses: usize,
    /// Mattes that were there before, and were kept.
    pub kept: usize,
    /// Frames made in which no screen but a network told the person.
    pub guessed: usize,
    /// `green` or `blue`; None if no frame was keyed.
    pub screen: Option<&'static str>,
    /// The screen's colour in the first frame that was keyed, in codes from 0 to 255.
    pub screen_color: Option<[u8; 3]>,
    /// The share of pixels, over all mattes made, whose coverage had to be worked out from what is around them; None if none
    /// was made.
    pub uncertain: Option<f32>,
}

impl MattesReport {
    /// What was made, in a sentence.
    pub fn sentence(&self) -> String {
        let mut text = format!(
            "{} mattes of frames and {} of poses made, {} kept",
            self.frames, self.poses, self.kept
        );
        if let (Some(screen), Some([r, g, b])) = (self.screen, self.screen_color) {
            text += &format!("; the screen is {screen} ({r} {g} {b})");
        }
        if self.guessed > 0 {
            text += &format!(
                "; without a screen, a network found the person in {} frames: look at their mattes",
                self.guessed
            );
        }
        if let Some(uncertain) = self.uncertain {
            text += &format!("; {:.1} % of their pixels are edges", 100.0 * uncertain);
        }
        text
    }
}

/// Says how likely each pixel of a picture shows a person: probabilities at any size.
pub type FindPerson<'a> = &'a dyn Fn(&Encoded) -> Result<Mask>;

/// Makes the mattes that neither the shoot nor the project has; all of the project's own again if `replace` is set. Those of
/// the shoot are never touched. With a box (`within`: left, top, width and height in pixels) frames are cut out of it, whatever
/// is behind the person. Without a box and a screen, `person` says where the person is.
///
/// # Errors
/// When a picture cannot be read or its matte cannot be told or written, or the person stops; mattes made before are kept.
pub fn make_mattes(
    root: &Path,
    replace: bool,
    within: Option<[usize; 4]>,
    person: Option<FindPerson>,
    progress: &Progress,
) -> Result<MattesReport> {
    let project = Project::open(root)?;
    let shoot = &project.settings.shoot;
    let (frames, poses) = (shoot.frames.len(), shoot.poses.len());
    let mut report = MattesReport {
        project: project.root.clone(),
        frames: 0,
        poses: 0,
        kept: 0,
        guessed: 0,
        screen: None,
        screen_color: None,
        uncertain: None,
    };
    let mut uncertain = 0.0;
    let mut screen: Option<Key> = None;
    // Whether a matte is to be made at the project's own path.
    let wanted = |matte: project::Matte, own: &Path| match matte {
        project::Matte::Alpha(_) => false,
        project::Matte::Grey(picture) => {
            !picture.file().is_file() || (replace && picture.file() == own)
        }
    };
    for item in 0..frames + poses {
        progress.check("the mattes made so far are kept")?;
        let (found, own) = match item.checked_sub(frames) {
            None => (project.frame_matte(item), project.frame_matte_path(item)),
            Some(pose) => (
                project.exemplar_matte(pose),
                project.exemplar_matte_path(pose),
            ),
        };
        if !wanted(found, &own) {
            report.kept += 1;
            continue;
        }
        progress.step("making mattes", item as u64, (frames + poses) as u64, "");
        let matte = match item.checked_sub(frames) {
            None => {
                if let Some(stand_in) = stand_in(&project, item)? {
                    progress.say(stand_in.sentence);
                    continue;
                }
                report.frames += 1;
                let picture = project.frame_picture(item);
                match (within, person) {
                    (Some(within), _) => of_box(&picture, within),
                    // One way for all frames: what the first one shows.
                    (None, Some(person)) if report.guessed > 0 => {
                        report.guessed += 1;
                        of_person(&picture, person)
                    }
                    (None, Some(person)) => match of_frame(&picture, &mut screen) {
                        Err(Error::Missing { .. }) if screen.is_none() => {
                            report.guessed += 1;
                            of_person(&picture, person)
                        }
                        found => found,
                    },
                    (None, None) => of_frame(&picture, &mut screen),
                }
                .map_err(|e| offer(&project, item, e))?
            }
            Some(pose) => {
                report.poses += 1;
                of_pose(&project, pose)?
            }
        };
        uncertain += matte.uncertain;
        file::write_mask_png(&own, &matte.mask)?;
    }
    let made = report.frames + report.poses;
    report.uncertain = (made > 0).then(|| uncertain / made as f32);
    report.screen = screen.as_ref().map(|key| key.hue.name());
    report.screen_color = screen.map(|key| key.color.map(byte_from_unit));
    Ok(report)
}

/// A frame's matte, by the screen of the first one that shows it.
fn of_frame(picture: &Picture, screen: &mut Option<Key>) -> Result<matte::Matte> {
    let pixels = read_picture(picture)?;
    let named = |e: Error| about(picture, e);
    if screen.is_none() {
        *screen = Some(key(&pixels).map_err(named)?);
    }
    let Some(key) = screen else {
        return Err(Error::bug("a screen that was found is gone"));
    };
    key.matte(&pixels).map_err(named)
}

/// A frame's matte, of whom a network finds.
fn of_person(picture: &Picture, person: FindPerson) -> Result<matte::Matte> {
    guessed(&read_picture(picture)?, person).map_err(|e| about(picture, e))
}

/// A frame's matte, of what is in a box.
fn of_box(picture: &Picture, within: [usize; 4]) -> Result<matte::Matte> {
    boxed(&read_picture(picture)?, within).map_err(|e| about(picture, e))
}

/// A pose's matte, of what is brightest under all lamps: by a screen if it has one, by brightness otherwise.
fn of_pose(project: &Project, pose: usize) -> Result<matte::Matte> {
    let mut brightest: Option<Encoded> = None;
    for lamp in 0..project.settings.shoot.all_lamps().len() {
        let picture = project.olat_picture(pose, lamp);
        let pixels = read_picture(&picture)?;
        let Some(so_far) = &mut brightest else {
            brightest = Some(pixels);
            continue;
        };
        if so_far.0.size() != pixels.0.size() {
            return Err(Error::other_size(
                (picture.display(), pixels.0.size()),
                ("the first lamp's picture", so_far.0.size()),
                "All pictures of a pose have one size",
            ));
        }
        for (most, pixel) in so_far.0.pixels.iter_mut().zip(&pixels.0.pixels) {
            *most = std::array::from_fn(|c| most[c].max(pixel[c]));
        }
    }
    let picture = project.olat_picture(pose, 0);
    let brightest = brightest.ok_or_else(|| {
        Error::missing(
            "the shoot has no lamps",
            "Import a shoot that has pictures under them",
        )
    })?;
    match key(&brightest) {
        Ok(key) => key.matte(&brightest),
        Err(_) => lit(&brightest),
    }
    .map_err(|e| about(&picture, e))
}

/// The same error with the picture that it is about.
fn about(picture: &Picture, error: Error) -> Error {
    match error {
        Error::Missing { problem, remedy } => {
            Error::missing(format!("{}: {problem}", picture.display()), remedy)
        }
        Error::Invalid { problem, remedy } => {
            Error::invalid(format!("{}: {problem}", picture.display()), remedy)
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImportSettings, import};
    use imaging::Mask;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn what_a_shoot_lacks_is_made_and_what_it_has_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings {
            frames: 3,
            size: 64,
            lamps: 6,
            ..StageSettings::default()
        };
        write_shoot(&shoot, &stage, &silent).unwrap();
        let settings = ImportSettings { size: 16, seed: 1 };
        let root = folder.path().join("project");
        let project = import(&root, &shoot, &settings, &silent).unwrap();
        let poses = project.settings.shoot.poses.len();
        let nothing = make_mattes(&root, true, None, None, &silent).unwrap();
        assert_eq!(
            (nothing.frames, nothing.poses, nothing.kept),
            (0, 0, 3 + poses)
        );
        assert!(nothing.uncertain.is_none() && !root.join("mattes").exists());

        let truth = |from: &Path| file::read_mask(from).unwrap();
        let mut missing = Vec::new();
        for (matte, own) in [
            (project.frame_matte(0), project.frame_matte_path(0)),
            (project.frame_matte(2), project.frame_matte_path(2)),
            (project.exemplar_matte(1), project.exemplar_matte_path(1)),
        ] {
            missing.push((truth(matte.file()), own));
            std::fs::remove_file(matte.file()).unwrap();
        }
        let made = make_mattes(&root, false, None, None, &silent).unwrap();
        assert_eq!((made.frames, made.poses, made.kept), (2, 1, poses));
        assert_eq!(made.screen, Some("green"));
        assert!(made.sentence().contains("green"), "{}", made.sentence());
        for (truth, own) in &missing {
            let found = file::read_mask(own).unwrap();
            let off = found.pixels.iter().zip(&truth.pixels);
            let off = off.map(|(a, b)| (a - b).abs()).sum::<f32>() / found.pixels.len() as f32;
            assert!(off < 0.02, "{}: {off}", own.display());
        }
        assert!(!project.frame_matte_path(1).exists());

        // Painted by hand: kept, until all are to be made again.
        let own = &missing[0].1;
        let painted = Mask::filled(64, 64, 1.0);
        file::write_mask_png(own, &painted).unwrap();
        assert_eq!(
            make_mattes(&root, false, None, None, &silent).unwrap().kept,
            3 + poses
        );
        assert_eq!(file::read_mask(own).unwrap(), painted);
        let again = make_mattes(&root, true, None, None, &silent).unwrap();
        assert_eq!((again.frames, again.poses, again.kept), (2, 1, poses));
        assert_ne!(file::read_mask(own).unwrap(), painted);

        // A frame without a screen is named.
        std::fs::remove_file(own).unwrap();
        let picture = project.frame_picture(0).file().to_owned();
        let grey = Encoded(imaging::Raster::filled(64, 64, [0.5; 3]));
        file::write_png(&picture, &grey).unwrap();
        let said = make_mattes(&root, false, None, None, &silent)
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("frame_000.png") && said.contains("screen"),
            "{said}"
        );
        // Unless somebody says where the person is.
        let middle = |_: &Encoded| {
            let inside = |at: usize| (4..12).contains(&at);
            Ok(Mask::from_fn(16, 16, |x, y| {
                f32::from(u8::from(inside(x) && inside(y)))
            }))
        };
        let found = make_mattes(&root, false, None, Some(&middle), &silent).unwrap();
        assert_eq!((found.frames, found.guessed, found.screen), (1, 1, None));
        assert!(
            found.sentence().contains("found the person in 1"),
            "{}",
            found.sentence()
        );
        let matte = file::read_mask(own).unwrap();
        assert_eq!((matte.at(32, 32), matte.at(4, 32)), (1.0, 0.0));
        // And unless nobody is found.
        std::fs::remove_file(own).unwrap();
        let nobody = |_: &Encoded| Ok(Mask::filled(16, 16, 0.1));
        let said = make_mattes(&root, false, None, Some(&nobody), &silent).unwrap_err();
        let said = said.to_string();
        assert!(
            said.contains("frame_000.png") && said.contains("nor a person"),
            "{said}"
        );
    }
}
