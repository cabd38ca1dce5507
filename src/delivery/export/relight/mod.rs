//! The relit interview: every frame predicted, lit by an environment and written.

mod clip;
mod named;
mod report;
mod settings;

pub use named::{find_environment, lamps_named};
pub use report::RelightReport;
pub use settings::{RelightSettings, frame_range};

use super::Rebuild;
use super::overlap::overlapped;
use super::writer::check_files;
use base::error::{Error, Result};
use base::progress::Progress;
use clip::{Clip, Made, Plan};
use compositor::Plate;
use footage::Frame;
use project::Project;
use std::path::PathBuf;
use std::time::Instant;

/// Relights the project's interview and writes the result.
///
/// # Errors
/// When a prerequisite is missing, a file cannot be read or written, or the user stops:
/// finished stills are kept then, a movie is not.
pub fn relight(project: &Project, settings: &RelightSettings, progress: &Progress) -> Result<RelightReport> {
    run(project, settings, None, progress)
}

/// Part of an export that one worker makes. It writes the same frames as the whole export would: the level of the light
/// comes from the export's first frame, which is predicted too.
#[derive(Clone, Debug)]
pub struct Part {
    /// First and last frame to write.
    pub frames: (usize, usize),
    /// Folder for the frames of a movie, which [`super::join_movie`] joins. Stills go to the export's destination.
    pub folder: PathBuf,
}

/// Relights a part of an export by [`relight`]. Complete frames with the same provenance are kept.
///
/// # Errors
/// As [`relight`], and when the export lacks such frames.
pub fn relight_part(
    project: &Project,
    settings: &RelightSettings,
    part: &Part,
    progress: &Progress,
) -> Result<RelightReport> {
    run(project, settings, Some(part), progress)
}

fn run(
    project: &Project,
    settings: &RelightSettings,
    part: Option<&Part>,
    progress: &Progress,
) -> Result<RelightReport> {
    let settings = &settings.of_project(project);
    let whole = frame_range(project, settings.frames)?;
    check_files(&settings.files, whole.1 - whole.0 + 1)?;
    settings.check()?;
    let (first, last) = part.map_or(whole, |part| part.frames);
    if first > last || first < whole.0 || last > whole.1 {
        return Err(Error::missing(
            format!("the export has frames {} to {}, not {first} to {last}", whole.0, whole.1),
            "Choose frames within this range",
        ));
    }
    let count = last - first + 1;
    let part_folder = part.map(|part| &*part.folder);
    let (mut clip, mut writer) = Clip::open(project, settings, part_folder, progress)?;
    let started = Instant::now();
    let (planned, provenance) = clip.plan((first, last), &mut writer, progress)?;
    let relit = planned.iter().filter(|plan| plan.write).count();
    let response = clip.calibration.response;
    let mut rebuild: Option<Rebuild> = None;
    let frames: Vec<&Plan> = planned.iter().collect();
    let (mut times, done) = overlapped(
        &frames,
        |plan| {
            if let Some(stand_in) = footage::stand_in(project, plan.frame)? {
                progress.say(stand_in.sentence);
            }
            let (frame, filmed) = Frame::load_filmed(project, &response, plan.frame)?;
            let filmed = filmed.shown(settings.files.at);
            let plate = filmed.map(|filmed| Plate::from_filmed(filmed, &frame)).transpose()?;
            let made_of = match (&plan.made_of, &provenance) {
                (None, Some(provenance)) if plan.write => Some(provenance.frame(project, &plan.scene)?),
                (known, _) => known.clone(),
            };
            Ok((frame, plate, made_of))
        },
        |plan, (frame, plate, made_of)| {
            progress.check("")?;
            let note = format!("frame {}", plan.frame);
            let done = plan.frame.saturating_sub(first) as u64;
            progress.step("relighting", done, count as u64, note);
            let made = clip.relight_frame(plan, &frame, plate)?;
            Ok(made.map(|made| (made, made_of)))
        },
        |plan, (made, made_of): (Made, Option<String>)| {
            let (picture, layers) = (&made.picture, made.layers);
            let check = writer.write(plan.frame, picture, layers, made_of.as_deref(), progress)?;
            rebuild = match (rebuild, check) {
                (Some(worst), Some(check)) => Some(worst.and(check)),
                (worst, check) => worst.or(check),
            };
            Ok(())
        },
    );
    done.map_err(|e| match e {
        Error::Cancelled { .. } => Error::Cancelled { kept: writer.keeps() },
        other => other,
    })?;
    let ending = Instant::now();
    writer.finish(progress)?;
    // An encoder may still hold frames that it has not written.
    times.write += ending.elapsed();
    progress.step("relighting", count as u64, count as u64, "");
    for pass in &mut clip.passes {
        pass.ms = pass.ms.map(|ms| ms / planned.len() as f64);
    }
    let whole = started.elapsed();
    let stages = times.of_frames(planned.len(), whole);
    if settings.profile {
        clip.profile(stages, progress);
    }
    Ok(RelightReport {
        frames: count,
        kept: count - relit,
        ms_per_frame: whole.as_secs_f64() * 1e3 / relit.max(1) as f64,
        stages,
        passes: clip.passes,
        output: writer.files.to,
        layers: rebuild,
        uncovered_energy: clip.uncovered_energy,
        device: clip.compute.description,
        hand_over: Vec::new(),
    })
}
