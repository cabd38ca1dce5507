//! Hand-over: files beside an exported shot with which Nuke, Blender and editors open it.

mod blender;
mod edl;
mod group;
mod lamps;
mod light;
mod media;
mod nuke;
mod otio;
mod shot;
mod tcl;

use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use export::relight::{RelightReport, RelightSettings};
use export::{Destination, HandOver, Interview, LayersBy, rational_rate};
use media::Media;
use project::Project;
use shot::Shot;
use std::io::Write;
use std::path::PathBuf;

/// Relights the project's interview, and writes it with the files for other programs.
///
/// # Errors
/// As [`export::relight::relight`], and when a program cannot open such a shot: this is checked before anything is relit.
pub fn relight(project: &Project, settings: &RelightSettings, progress: &Progress) -> Result<RelightReport> {
    check(project, settings)?;
    let mut report = export::relight::relight(project, settings, progress)?;
    report.hand_over = hand_over(project, settings, &report.output, progress)?;
    Ok(report)
}

/// Refuses settings that a program could not open.
///
/// # Errors
/// When one does not fit; the message names the program and the reason.
pub fn check(project: &Project, settings: &RelightSettings) -> Result<()> {
    let Some(first_asked) = settings.hand_over.first() else { return Ok(()) };
    let files = &settings.files;
    if let Some(program) = (settings.hand_over.iter()).find(|p| p.needs_layers() && !files.layers) {
        return Err(Error::invalid(
            format!("a hand-over to {} needs light layers, but {} has none", program.name(), files.to),
            (
                "Add light layers and write an EXR, such as shot.%04d.exr",
                format!("--layers, or leave {} out of --hand-over", program.name().to_lowercase()),
            ),
        ));
    }
    if settings.hand_over.iter().any(|p| p.needs_layers()) && files.exr.layers_by == LayersBy::Light {
        return Err(Error::invalid(
            "Nuke and Blender scripts need a light layer for each lamp, but there is one for each light",
            ("Choose light layers by lamp", "--layers-by lamp"),
        ));
    }
    let media = Media::new(&files.to, first_asked.name())?;
    let frames = export::relight::frame_range(project, settings.frames)?;
    let numbers = files.numbers(&Interview::from_project(project)?, frames);
    let rate = rational_rate(project.settings.shoot.frame_rate);
    for program in &settings.hand_over {
        match program {
            HandOver::Nuke => nuke::check(&media)?,
            HandOver::Blender => blender::check(&media, numbers, files.exr.layers)?,
            HandOver::Edl => edl::check(rate)?,
            HandOver::Otio => otio::check(&media, numbers)?,
        }
    }
    Ok(())
}

/// Writes the requested files for an export to `output`, if any. Returns their paths.
///
/// # Errors
/// When the export's files, the calibration or the environment cannot be read, or a file cannot be written.
pub fn hand_over(
    project: &Project,
    settings: &RelightSettings,
    output: &Destination,
    progress: &Progress,
) -> Result<Vec<PathBuf>> {
    if settings.hand_over.is_empty() {
        return Ok(Vec::new());
    }
    let interview = Interview::from_project(project)?;
    let shot = Shot::new(project, settings, &interview, output, progress)?;
    let mut written = Vec::new();
    for &program in &settings.hand_over {
        let path = shot.file(program.ending());
        if written.contains(&path) {
            continue;
        }
        let text = match program {
            HandOver::Nuke => nuke::script(&shot),
            HandOver::Blender => {
                if let Some(light) = &shot.light {
                    light.write_environment(&shot.file(light::ENVIRONMENT))?;
                }
                blender::script(&shot)
            }
            HandOver::Otio => otio::timeline(&shot),
            HandOver::Edl => edl::list(&shot),
        };
        write_beside(&path, |out| out.write_all(text.as_bytes()))?;
        written.push(path);
    }
    Ok(written)
}
