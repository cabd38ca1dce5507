//! Mattes missing from a shoot, made and stored in the project.

use super::damaged::{offer, stand_in};
use super::frame_mattes::{FindPerson, FrameMattes, about};
use super::framed::{read_matte, read_picture};
use super::matte_settings::MatteSettings;
use super::scan::counted;
use super::steady::Steady;
use super::strokes::Strokes;
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::color::{byte_from_unit, linear_from_srgb, srgb_from_linear};
use imaging::{Encoded, Image, file};
use matte::{guessed, key, lit, quantile};
use project::Project;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Quantile of a pose's light that is exposed to [`EXPOSED`] for the network.
const BRIGHT: f32 = 0.98;
const EXPOSED: f32 = 0.7;

/// Report of a matte job.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MattesReport {
    /// The project.
    pub project: PathBuf,
    /// Number of interview mattes made.
    pub frames: usize,
    /// Number of pose mattes made.
    pub poses: usize,
    /// Number of existing mattes kept.
    pub kept: usize,
    /// `green` or `blue`; None without a keyed frame.
    pub screen: Option<&'static str>,
    /// Colour of the screen in the first keyed frame, in codes from 0 to 255.
    pub screen_color: Option<[u8; 3]>,
    /// Share of pixels, over all new mattes, with coverage inferred from their surroundings; None without new
    /// mattes.
    pub uncertain: Option<f32>,
    /// Number of new frames in which a network, not a screen, found the person.
    pub guessed: usize,
    /// The same of poses.
    pub guessed_poses: usize,
    /// Number of new frames with their own strokes.
    pub painted: usize,
    /// Number of new frames that follow a neighbour's matte because nothing else shows their subject.
    pub followed: usize,
    /// Number of frames with strokes whose mattes were kept unchanged.
    pub painted_kept: usize,
    /// Flicker of the frames' mattes, 0 to 1: change of the coverage at their edges from the previous frame, along
    /// the motion ([`matte::flicker`]). None without two consecutive new frames.
    pub flicker: Option<f32>,
    /// Flicker before averaging over time.
    pub flicker_before: Option<f32>,
}

impl MattesReport {
    /// Summary sentence.
    pub fn sentence(&self) -> String {
        let counts = |counts: [(usize, &str); 2]| {
            let counts = counts.into_iter().filter(|(count, _)| *count > 0);
            counts.map(|(count, name)| counted(count, name)).collect::<Vec<_>>().join(" and ")
        };
        let made = counts([(self.frames, "interview matte"), (self.poses, "pose matte")]);
        let mut text = if made.is_empty() { "No matte is missing.".to_owned() } else { format!("{made} made.") };
        if let Some(screen) = self.screen {
            text += &format!(" {}{} screen found.", screen[..1].to_uppercase(), &screen[1..]);
        }
        let guessed = counts([(self.guessed, "frame"), (self.guessed_poses, "pose")]);
        if !guessed.is_empty() {
            text += &format!(" Without a screen, a network found the person in {guessed}: check their mattes.");
        }
        if let (Some(after), Some(before)) = (self.flicker, self.flicker_before) {
            text += &format!(" Edges flicker by {after:.4} ({before:.4} before averaging over time).");
        }
        if self.painted + self.followed > 0 {
            text += &format!(
                " Strokes were used on {}, {} follow their neighbours.",
                counted(self.painted, "frame"),
                self.followed
            );
        }
        if self.painted_kept > 0 {
            text += &format!(" {} with strokes kept their old mattes.", counted(self.painted_kept, "frame"));
        }
        text
    }
}

/// Makes the mattes missing from both shoot and project, or remakes all of the project's own if `replace` is set.
/// The shoot's mattes are never changed. A box or a clean plate separates the person from any background. Otherwise
/// the screen does, and without a screen `person` detects the person. Strokes correct all of these. Where only
/// strokes show the person, frames follow the painted ones. Poses are separated by a screen, else by `person`, else by
/// brightness.
///
/// # Errors
/// When a picture cannot be read, its matte cannot be found or written, or the user stops the job. Finished mattes
/// are kept.
pub fn make_mattes(
    root: &Path,
    settings: &MatteSettings,
    person: Option<FindPerson>,
    progress: &Progress,
) -> Result<MattesReport> {
    let project = Project::open(root)?;
    let mut report = MattesReport {
        project: project.root.clone(),
        frames: 0,
        poses: 0,
        kept: 0,
        screen: None,
        screen_color: None,
        uncertain: None,
        guessed: 0,
        guessed_poses: 0,
        painted: 0,
        followed: 0,
        painted_kept: 0,
        flicker: None,
        flicker_before: None,
    };
    let mut uncertain = 0.0;
    let mut mattes = FrameMattes::new(&project, settings, person)?;
    frames(&project, (settings, &mut mattes), progress, &mut report, &mut uncertain)?;
    let settings = (settings, mattes.person.as_ref());
    poses(&project, settings, progress, &mut report, &mut uncertain)?;
    let made = report.frames + report.poses;
    report.uncertain = (made > 0).then(|| uncertain / made as f32);
    Ok(report)
}

/// True if a matte is to be made at the project's own path.
fn is_wanted(matte: project::Matte, own: &Path, replace: bool) -> bool {
    match matte {
        project::Matte::Alpha(_) => false,
        project::Matte::Grey(picture) => !picture.file().is_file() || (replace && picture.file() == own),
    }
}

fn step(progress: &Progress, project: &Project, item: usize) -> Result<()> {
    let shoot = &project.settings.shoot;
    progress.check("the mattes made so far are kept")?;
    let all = shoot.frames.len() + shoot.poses.len();
    progress.step("making mattes", item as u64, all as u64, "");
    Ok(())
}

fn frames(
    project: &Project,
    (settings, mattes): (&MatteSettings, &mut FrameMattes),
    progress: &Progress,
    report: &mut MattesReport,
    uncertain: &mut f32,
) -> Result<()> {
    let count = project.settings.shoot.frames.len();
    let own = |frame| project.frame_matte_path(frame);
    let wanted: Vec<bool> =
        (0..count).map(|frame| is_wanted(project.frame_matte(frame), &own(frame), settings.replace)).collect();
    let strokes = Strokes::load(project)?;
    let painted = strokes.frames();
    let is_kept = |frame: &&usize| !wanted[**frame] && super::strokes::is_own_matte(project, **frame);
    report.painted_kept = painted.iter().filter(is_kept).count();
    report.kept += wanted.iter().filter(|wanted| !**wanted).count();
    let Some(first) = wanted.iter().position(|wanted| *wanted) else { return Ok(()) };
    // Where only strokes show the subject, frames follow the painted ones: first forwards, then backwards.
    let telling = painted.iter().find(|frame| strokes.tell_both(**frame));
    let start = match telling.or(painted.first()) {
        Some(&painted) if !mattes.is_told(first)? => painted,
        _ => 0,
    };
    let mut steady = Steady::new(project, !settings.no_steady);
    let mut done = 0;
    for frame in (start..count).chain((0..start).rev()) {
        if !wanted[frame] {
            if !painted.is_empty() {
                // An existing matte is followed as well.
                let matte = read_matte(&project.frame_matte(frame)).ok();
                mattes.neighbour = matte.map(|matte| (frame, matte));
            }
            if frame == start {
                mattes.first = mattes.neighbour.clone();
            }
            continue;
        }
        let made = step(progress, project, done).and_then(|()| {
            if let Some(stand_in) = stand_in(project, frame)? {
                progress.say(stand_in.sentence);
                return Ok(None);
            }
            let made = mattes.frame_matte(frame, &strokes);
            made.map(Some).map_err(|e| offer(project, frame, e))
        });
        let made = match made {
            Ok(Some(made)) => made,
            Ok(None) => continue,
            Err(e) => {
                // Mattes found so far are kept.
                steady.finish(&mut mattes.movement)?;
                return Err(e);
            }
        };
        if frame == start {
            mattes.first = Some((frame, made.matte.mask.clone()));
        }
        done += 1;
        report.frames += 1;
        report.painted += usize::from(painted.contains(&frame));
        report.followed += usize::from(made.followed);
        report.guessed += usize::from(made.guessed);
        *uncertain += made.matte.uncertain;
        steady.push(frame, made, &mut mattes.movement)?;
    }
    steady.finish(&mut mattes.movement)?;
    (report.flicker, report.flicker_before) = steady.flicker();
    report.screen = mattes.screen.as_ref().map(|key| key.hue.name());
    report.screen_color = mattes.screen.as_ref().map(|key| key.color.map(byte_from_unit));
    Ok(())
}

fn poses(
    project: &Project,
    (settings, person): (&MatteSettings, Option<&FindPerson>),
    progress: &Progress,
    report: &mut MattesReport,
    uncertain: &mut f32,
) -> Result<()> {
    let shoot = &project.settings.shoot;
    for pose in 0..shoot.poses.len() {
        let own = project.exemplar_matte_path(pose);
        if !is_wanted(project.exemplar_matte(pose), &own, settings.replace) {
            report.kept += 1;
            continue;
        }
        step(progress, project, shoot.frames.len() + pose)?;
        let (matte, guessed) = pose_matte(project, pose, person)?;
        report.poses += 1;
        report.guessed_poses += usize::from(guessed);
        *uncertain += matte.uncertain;
        file::write_mask_png(&own, &matte.mask)?;
    }
    Ok(())
}

/// Matte of a pose, and if a network found the person: from its brightest values under all lamps by a screen, else by the
/// network from the mean of its OLATs, else by brightness.
fn pose_matte(project: &Project, pose: usize, person: Option<&FindPerson>) -> Result<(matte::Matte, bool)> {
    let mut lit_by_all: Option<(Encoded, Image)> = None;
    for lamp in project.pose_lamps(pose) {
        let picture = project.olat_picture(pose, lamp);
        let pixels = read_picture(&picture)?;
        let light = pixels.0.map(|p| p.map(linear_from_srgb));
        let Some((brightest, sum)) = &mut lit_by_all else {
            lit_by_all = Some((pixels, light));
            continue;
        };
        if brightest.0.size() != pixels.0.size() {
            return Err(Error::other_size(
                (picture.display(), pixels.0.size()),
                ("the first lamp's picture", brightest.0.size()),
                "All pictures of a pose have one size",
            ));
        }
        for (most, pixel) in brightest.0.pixels.iter_mut().zip(&pixels.0.pixels) {
            *most = std::array::from_fn(|c| most[c].max(pixel[c]));
        }
        for (sum, light) in sum.pixels.iter_mut().zip(&light.pixels) {
            *sum = std::array::from_fn(|c| sum[c] + light[c]);
        }
    }
    let picture = project.first_olat(pose);
    let (brightest, sum) =
        lit_by_all.ok_or_else(|| Error::missing("the shoot has no lamps", "Import a shoot with OLATs"))?;
    let matte = match key(&brightest) {
        Ok(key) => key.matte(&brightest).map(|matte| (matte, false)),
        Err(_) => match person.map(|person| guessed(&exposed(&sum), person)) {
            Some(Ok(matte)) => Ok((matte, true)),
            None | Some(Err(Error::Missing { .. })) => lit(&brightest).map(|matte| (matte, false)),
            Some(Err(e)) => Err(e),
        },
    };
    matte.map_err(|e| about(&picture, e))
}

/// Light as an evenly exposed picture.
fn exposed(light: &Image) -> Encoded {
    let green = light.pixels.iter().map(|p| p[1]).collect();
    let bright = quantile(green, BRIGHT).unwrap_or(1.0);
    let scale = EXPOSED / bright.max(f32::MIN_POSITIVE);
    Encoded(light.map(|p| p.map(|v| srgb_from_linear((v * scale).min(1.0)))))
}

#[cfg(test)]
#[path = "mattes_tests.rs"]
mod tests;
