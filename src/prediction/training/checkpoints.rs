//! List of saved checkpoints: `checkpoints/0012-step-0001200/` holds the checkpoint after step 1200 with
//! the logs of that time.
//!
//! Folder numbers follow the order of creation. Checkpoints saved by training thin out as they age;
//! those set aside (`0013-aside-0003000`) when the user started over or went back stay.

use super::log::{HELD_OUT, STEPS};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use project::Project;
use reflectance::checkpoint::{self, CheckpointInfo};
use reflectance::predictor::check_fits;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Files of a project that accompany its checkpoint.
pub const LOGS: [&str; 2] = [STEPS, HELD_OUT];

/// Most bytes of checkpoints saved by training; the oldest are removed first.
const MAX_BYTES: u64 = 4 << 30;
/// Prefix of folders that are unfinished or no longer needed.
const HIDDEN: &str = ".";

/// A checkpoint in the list.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SavedCheckpoint {
    /// Name of its folder in `checkpoints/`.
    pub name: String,
    /// Serial number within the project.
    pub number: u64,
    /// True if it was set aside, and is therefore never removed.
    pub aside: bool,
    /// True for the project's current checkpoint.
    pub present: bool,
    /// Bytes on disk.
    pub bytes: u64,
    pub info: CheckpointInfo,
}

impl SavedCheckpoint {
    /// Folder of the checkpoint.
    pub fn folder(&self, project: &Project) -> PathBuf {
        folder(project).join(&self.name)
    }
}

/// Reason for keeping a checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Saved by training.
    Automatic,
    /// Set aside when the user started over or went back.
    SetAside,
}

fn folder(project: &Project) -> PathBuf {
    project.result_path("checkpoints")
}

fn named(number: u64, reason: Reason, step: u64) -> String {
    let reason = match reason {
        Reason::Automatic => "step",
        Reason::SetAside => "aside",
    };
    format!("{number:04}-{reason}-{step:07}")
}

/// Number and reason from a folder's name; `None` for names not made by [`named`].
fn parsed(name: &str) -> Option<(u64, Reason)> {
    let parts: Vec<&str> = name.split('-').collect();
    let [number, reason, step] = parts[..] else { return None };
    let reason = match reason {
        "step" => Reason::Automatic,
        "aside" => Reason::SetAside,
        _ => return None,
    };
    let (number, step) = (number.parse().ok()?, step.parse().ok()?);
    (named(number, reason, step) == name).then_some((number, reason))
}

/// A folder of the list.
struct Entry {
    number: u64,
    reason: Reason,
    name: String,
}

/// All folders of the list, the newest first.
fn entries(project: &Project) -> Vec<Entry> {
    let names = std::fs::read_dir(folder(project)).into_iter().flatten();
    let mut all: Vec<_> = names
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter_map(|name| parsed(&name).map(|(number, reason)| Entry { number, reason, name }))
        .collect();
    all.sort_unstable_by_key(|entry| std::cmp::Reverse(entry.number));
    all
}

/// The saved checkpoints, the newest first. Unreadable ones are left out.
pub fn list(project: &Project) -> Vec<SavedCheckpoint> {
    let present = checkpoint::info(&project.checkpoint_path()).ok();
    let kept = |Entry { number, reason, name }: Entry| {
        let folder = folder(project).join(&name);
        let info = checkpoint::info(&folder).ok()?;
        Some(SavedCheckpoint {
            aside: reason == Reason::SetAside,
            present: present.as_ref() == Some(&info),
            bytes: bytes(&folder),
            name,
            number,
            info,
        })
    };
    entries(project).into_iter().filter_map(kept).collect()
}

/// Total bytes of a folder's files.
fn bytes(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let sizes = files.filter_map(|file| file.metadata().ok());
    sizes.map(|data| data.len()).sum()
}

/// Adds the project's checkpoint to the list, with the current logs, unless it is listed already. Weights are
/// hard links where the disk supports them.
///
/// # Errors
/// When there is no readable checkpoint, or the folder cannot be written.
pub fn keep(project: &Project, reason: Reason) -> Result<()> {
    let from = project.checkpoint_path();
    let info = checkpoint::info(&from)?;
    let folder = folder(project);
    let fail = |e: std::io::Error| {
        let remedy = "Check that the folder can be written and the disk has room";
        Error::io("write", &folder, e, remedy)
    };
    let known = list(project).into_iter().find(|kept| kept.info == info);
    match (known, reason) {
        (None, _) => {
            let number = entries(project).first().map_or(1, |entry| entry.number + 1);
            let name = named(number, reason, info.step);
            let partial = folder.join(format!("{HIDDEN}{name}"));
            clean(&folder);
            checkpoint::link(&from, &partial)?;
            for log in LOGS {
                if project.result_path(log).exists() {
                    restore(&project.result_path(log), &partial.join(log))?;
                }
            }
            std::fs::rename(&partial, folder.join(name)).map_err(fail)?;
        }
        (Some(kept), Reason::SetAside) if !kept.aside => {
            let name = named(kept.number, reason, info.step);
            std::fs::rename(folder.join(&kept.name), folder.join(name)).map_err(fail)?;
        }
        (Some(_), _) => {}
    }
    if reason == Reason::Automatic {
        thin_out(project, MAX_BYTES);
    }
    Ok(())
}

/// Sets the project's checkpoint aside before another replaces it, even if it is unreadable.
///
/// # Errors
/// When the folder cannot be written.
pub fn set_aside(project: &Project) -> Result<()> {
    let present = project.checkpoint_path();
    if !present.join("checkpoint.toml").exists() {
        return Ok(());
    }
    if checkpoint::info(&present).is_ok() {
        return keep(project, Reason::SetAside);
    }
    let number = entries(project).first().map_or(1, |entry| entry.number + 1);
    let unread = folder(project).join(format!("{number:04}-unreadable-{}", std::process::id()));
    std::fs::create_dir_all(folder(project))
        .and_then(|()| std::fs::rename(&present, &unread))
        .map_err(|e| Error::io("move", &present, e, "Check that the folder can be written"))
}

/// Replaces the project's checkpoint, which is set aside, by a saved one, by its name or its step (the
/// newest of that step). If the process is killed, one of the two is complete.
///
/// # Errors
/// When there is no such checkpoint, it belongs to other pictures, or files cannot be written.
pub fn go_back(project: &Project, wanted: &str) -> Result<CheckpointInfo> {
    let kept = list(project);
    let by_step = |kept: &&SavedCheckpoint| wanted.parse() == Ok(kept.info.step);
    let found = kept.iter().find(|kept| kept.name == wanted);
    let Some(found) = found.or_else(|| kept.iter().find(by_step)) else {
        return Err(Error::missing(
            format!("no checkpoint in {} has the step or the name {wanted}", folder(project).display()),
            ("Choose an existing one", "afterlight checkpoints PROJECT lists them"),
        ));
    };
    check_fits(&found.info, project)?;
    if !found.present {
        set_aside(project)?;
        let from = folder(project).join(&found.name);
        checkpoint::link(&from, &project.checkpoint_path())?;
        for log in LOGS {
            restore(&from.join(log), &project.result_path(log))?;
        }
    }
    Ok(found.info.clone())
}

/// Replaces the project's checkpoint, which is set aside, by that of a copy of the project, such as one trained on a
/// farm. If the process is killed, one of the two is complete; `other` stays unchanged.
///
/// # Errors
/// When `other` has a different shoot, framing, size or rig, has no checkpoint, or files cannot be written.
pub fn adopt(project: &Project, other: &Project) -> Result<CheckpointInfo> {
    check_same(project, other)?;
    let info = checkpoint::info(&other.checkpoint_path())?;
    check_fits(&info, project)?;
    if checkpoint::info(&project.checkpoint_path()).ok().as_ref() != Some(&info) {
        set_aside(project)?;
        checkpoint::link(&other.checkpoint_path(), &project.checkpoint_path())?;
        for log in LOGS {
            restore(&other.result_path(log), &project.result_path(log))?;
        }
    }
    Ok(info)
}

/// Refuses a project that is not a copy of `project`: a network for other pictures or lamps gives wrong pictures.
fn check_same(project: &Project, other: &Project) -> Result<()> {
    let read = |project: &Project| {
        let path = project.calibration_path();
        let remedy = ("Calibrate it", "afterlight calibrate PROJECT");
        std::fs::read(&path).map_err(|e| Error::io("open", &path, e, remedy))
    };
    let shoot = |project: &Project| {
        let mut shoot = project.settings.shoot.clone();
        // A copy may be in another folder, and the list of environments does not affect training.
        shoot.folder = PathBuf::new();
        shoot.environments.clear();
        shoot
    };
    let (ours, theirs) = (&project.settings, &other.settings);
    let what = if ours.size != theirs.size {
        "its size"
    } else if ours.shoot.lamps != theirs.shoot.lamps {
        "its lamps"
    } else if shoot(project) != shoot(other) {
        "its shoot"
    } else if ours.framing != theirs.framing {
        "its framing"
    } else if read(project)? != read(other)? {
        "its calibration"
    } else {
        return Ok(());
    };
    Err(Error::invalid(
        format!(
            "the network in {} belongs to another project than {}: {what} differs",
            other.root.display(),
            project.root.display()
        ),
        "Adopt a network that was trained on a copy of this project in its current state",
    ))
}

/// Copies the log `from` to `to`, or removes `to` if there is none.
fn restore(from: &Path, to: &Path) -> Result<()> {
    if from.exists() {
        return write_beside(to, |out| std::io::copy(&mut files::open(from)?, out).map(drop));
    }
    match std::fs::remove_file(to) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            let remedy = "Check that the folder can be written";
            Err(Error::io("remove", to, e, remedy))
        }
        _ => Ok(()),
    }
}

/// True if checkpoint `number` stays when `newest` is the last: of the numbers that 2^k divides and 2^(k+1) does not, the
/// last two stay. So ages double, and of n checkpoints at most 2·(log2 n + 1) stay.
fn stays(number: u64, newest: u64) -> bool {
    let lasts = 4u64.checked_shl(number.trailing_zeros());
    lasts.is_none_or(|lasts| newest.saturating_sub(number) < lasts)
}

/// Most bytes of the list after this many saves of `bytes` each; without a number, at any time.
pub(crate) fn most_bytes(saves: Option<u64>, bytes: u64) -> u64 {
    let limit = MAX_BYTES.max(bytes);
    saves.map_or(limit, |saves| {
        let kept = 2 * (u64::from(saves.max(1).ilog2()) + 1);
        limit.min(bytes.saturating_mul(kept.min(saves.max(1))))
    })
}

/// Removes aged checkpoints, and the oldest beyond `max_bytes`.
fn thin_out(project: &Project, max_bytes: u64) {
    let all = entries(project);
    let newest = all.first().map_or(0, |entry| entry.number);
    let mut total = 0;
    for Entry { number, reason, name } in all {
        if reason == Reason::SetAside {
            continue;
        }
        let path = folder(project).join(&name);
        total += bytes(&path);
        if number != newest && (!stays(number, newest) || total > max_bytes) {
            // Hidden first: if the process is killed meanwhile, no partly removed folder counts as a checkpoint. One
            // that cannot be removed only costs space.
            let hidden = folder(project).join(format!("{HIDDEN}{name}"));
            let _ = std::fs::rename(&path, hidden);
        }
    }
    clean(&folder(project));
}

/// Removes unfinished folders. Other folders, even hidden ones, belong to the user.
fn clean(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_ours = name.strip_prefix(HIDDEN).and_then(parsed).is_some();
        if is_ours && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            // A failure only costs space.
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_stays_short_and_reaches_back_by_doubling() {
        let mut left: Vec<u64> = Vec::new();
        for newest in 1..3000u64 {
            left.push(newest);
            left.retain(|&number| stays(number, newest));
            let bound = 2 * (u64::from(newest.ilog2()) + 1);
            assert!(left.len() as u64 <= bound, "{} of {newest}", left.len());
            assert!(left.contains(&newest));
            // For any age a checkpoint remains within twice that age, unless the run is younger.
            for age in 1..newest {
                let near = left.iter().any(|&number| {
                    let old = newest - number;
                    (age..=2 * age).contains(&old)
                });
                assert!(near || 2 * age >= newest, "{age} of {newest}: {left:?}");
            }
        }
    }

    #[test]
    fn names_say_what_was_kept_and_others_are_not_of_the_list() {
        for reason in [Reason::Automatic, Reason::SetAside] {
            assert_eq!(parsed(&named(12, reason, 1200)), Some((12, reason)));
        }
        for name in [
            "",
            ".0012-step-0001200",
            "0012-unreadable-7",
            "step-12",
            "x-step-1",
            "12-step-1200",
            "0012-step-0001200-copy",
            "+012-step-0001200",
        ] {
            assert_eq!(parsed(name), None, "{name}");
        }
    }

    #[test]
    fn only_unfinished_checkpoints_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let unfinished = ".0012-step-0001200";
        let others = [".notes", ".ssh", ".0012-step-0001200-mine", "0012-step-0001200"];
        for name in others.iter().chain([&unfinished]) {
            std::fs::create_dir(path(name)).unwrap();
            std::fs::write(path(name).join("file"), "").unwrap();
        }
        clean(folder.path());
        assert!(!path(unfinished).exists());
        assert!(others.iter().all(|name| path(name).join("file").exists()));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path(".ssh"), path(unfinished)).unwrap();
            clean(folder.path());
            assert!(path(".ssh").join("file").exists());
        }
        test_support::shown!(
            Strangers,
            "`checkpoints/` holds the user's own hidden folders, or links to folders",
            done: "only unfinished checkpoints are removed, by name, and links are not followed",
        );
    }
}
