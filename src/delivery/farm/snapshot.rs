//! Copy of a project for a job, so that the artist can keep working on the project. Weights and mattes are hard
//! links where the disk supports them: the program never changes them in place.

use super::environment::KeptEnvironment;
use super::job::{BACKGROUND, ENVIRONMENT, PinnedFile, SNAPSHOT, TABLE};
use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use export::relight::{RelightSettings, frame_range};
use footage::STAND_IN_REACH;
use movies::Source;
use project::{Matte, Picture, Project};
use reflectance::checkpoint;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use training::checkpoints::LOGS;

const REMEDY: &str = "Check that the job's folder can be written and the disk has room";

/// Copies settings and calibration of `project` to `to`, without pictures and network. The footage gets an absolute path.
///
/// # Errors
/// When a part of it is missing, or files cannot be written.
pub(crate) fn copy_project(project: &Project, to: &Path) -> Result<Project> {
    std::fs::create_dir_all(to).map_err(|e| Error::io("write", to, e, REMEDY))?;
    let mut copy = project.clone();
    copy.root = to.to_path_buf();
    let shoot = project.shoot_path("");
    copy.settings.shoot.folder = (shoot.canonicalize()).map_err(|e| {
        let remedy = "Check the shoot's folder in the project";
        Error::io("open", &shoot, e, remedy)
    })?;
    // The job has the environment in use, and absolute paths mean nothing on other machines.
    copy.settings.environments.clear();
    copy.settings.color_config = None;
    copy.choose_layer();
    copy.save()?;
    copy_file(&project.calibration_path(), &copy.calibration_path())?;
    Ok(copy)
}

/// Links a project's network and its logs into the copy, if it has one.
///
/// # Errors
/// When the network is damaged, or files cannot be written.
pub(crate) fn copy_network(project: &Project, copy: &Project) -> Result<()> {
    if !project.checkpoint_path().exists() {
        return Ok(());
    }
    checkpoint::link(&project.checkpoint_path(), &copy.checkpoint_path())?;
    for log in LOGS {
        let from = project.result_path(log);
        if from.exists() {
            copy_file(&from, &copy.result_path(log))?;
        }
    }
    Ok(())
}

/// Links the project's own mattes among `mattes` into the copy.
///
/// # Errors
/// When they cannot be written.
pub(crate) fn link_mattes(project: &Project, copy: &Project, mattes: impl Iterator<Item = Matte>) -> Result<()> {
    for matte in mattes {
        let Matte::Grey(Picture::File(file)) = matte else { continue };
        let Ok(inside) = file.strip_prefix(&project.root) else { continue };
        // A shoot's folder may lie within the project's.
        if !inside.starts_with("mattes") || !file.is_file() {
            continue;
        }
        let to = copy.root.join(inside);
        let folder = to.parent().unwrap_or(&copy.root);
        std::fs::create_dir_all(folder).map_err(|e| Error::io("write", folder, e, REMEDY))?;
        link(&file, &to)?;
    }
    Ok(())
}

/// Input of an export job: the copy of the project, the environment and the look-up table. `settings` then point into
/// the job.
///
/// # Errors
/// When a part of the project is missing, or files cannot be read or written.
pub(crate) fn take(
    project: &Project,
    settings: &mut RelightSettings,
    job: &Path,
    progress: &Progress,
) -> Result<(Project, KeptEnvironment)> {
    let (environment, front) = settings.find_environment(project, progress)?;
    settings.front = Some(front);
    *settings = settings.of_project(project);
    // A worker has another variable OCIO, or none, and another working folder.
    settings.files.ocio = std::mem::take(&mut settings.files.ocio).pinned()?;
    let kept = KeptEnvironment::write(&environment, &job.join(ENVIRONMENT))?;
    settings.read = Some(environment);
    let copy = copy_project(project, &job.join(SNAPSHOT))?;
    copy_network(project, &copy)?;
    if let Some(table) = &mut settings.files.lut {
        let to = job.join(TABLE);
        copy_file(table, &to)?;
        *table = to;
    }
    if let Some(file) = settings.look.background.file().filter(|_| settings.solo.is_empty()) {
        let copied = copy_background(file, job)?;
        settings.look.background = std::mem::take(&mut settings.look.background).with_file(copied);
    }
    let (first, last) = frame_range(project, settings.frames)?;
    // A damaged frame is replaced by a neighbour.
    let end = project.settings.shoot.frames.len();
    let frames = first.saturating_sub(STAND_IN_REACH)..(last + 1 + STAND_IN_REACH).min(end);
    let poses = 0..project.settings.shoot.poses.len();
    let mattes = (frames.map(|frame| project.frame_matte(frame))).chain(poses.map(|pose| project.exemplar_matte(pose)));
    link_mattes(project, &copy, mattes)?;
    Ok((copy, kept))
}

/// Copies a background's still, movie or numbered stills into the job. Returns its address, relative to the job's folder.
///
/// # Errors
/// When a file cannot be read or written.
fn copy_background(file: &Path, job: &Path) -> Result<PathBuf> {
    let (inside, to) = (Path::new(BACKGROUND), job.join(BACKGROUND));
    std::fs::create_dir_all(&to).map_err(|e| Error::io("write", &to, e, REMEDY))?;
    let name = file.file_name().unwrap_or_default();
    if file.is_file() {
        copy_file(file, &to.join(name))?;
        return Ok(inside.join(name));
    }
    if let Source::Sequence(stills) = &*movies::open(file)? {
        let first = stills.first().unwrap_or_default();
        let stills = (first..first + stills.count()).filter_map(|number| stills.file(number));
        for still in stills.filter(|still| still.is_file()) {
            copy_file(&still, &to.join(still.file_name().unwrap_or_default()))?;
        }
    }
    // A folder stands for all of its pictures.
    Ok(if file.is_dir() { inside.to_path_buf() } else { inside.join(name) })
}

/// Files of a job's snapshot with their hashes, in order. Mattes and the files of a background are left out: the
/// provenance of each frame covers them.
///
/// # Errors
/// When they cannot be read.
pub(crate) fn pin(job: &Path) -> Result<Vec<PinnedFile>> {
    let mut names = BTreeSet::new();
    let mut folders = vec![PathBuf::from(SNAPSHOT)];
    while let Some(folder) = folders.pop() {
        let full = job.join(&folder);
        let entries = std::fs::read_dir(&full).map_err(|e| Error::io("open", &full, e, REMEDY))?;
        for entry in entries.flatten() {
            let name = folder.join(entry.file_name());
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            match is_folder {
                true if name.ends_with("mattes") || name == Path::new(BACKGROUND) => {}
                true => folders.push(name),
                false => drop(names.insert(name)),
            }
        }
    }
    (names.into_iter()).map(|name| PinnedFile::new(job, name)).collect()
}

pub(crate) fn copy_file(from: &Path, to: &Path) -> Result<()> {
    let mut file =
        base::files::open(from).map_err(|e| Error::io("open", from, e, "Make it first, or check that it exists"))?;
    write_beside(to, |out| std::io::copy(&mut file, out).map(drop))
}

fn link(from: &Path, to: &Path) -> Result<()> {
    match std::fs::hard_link(from, to) {
        Ok(()) => Ok(()),
        Err(_) => copy_file(from, to),
    }
}
