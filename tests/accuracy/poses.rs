//! Benefit of the poses that `confidence` suggests, against random ones, on shoots of the virtual stage.

use crate::kept::Kept;
use crate::{Clock, Options};
use base::{Error, Result};
use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use serde_json::Value;
use std::path::{Path, PathBuf};
use training::Preset;

/// Seeds of the shoots; nothing was tuned on them.
pub const SEEDS: [u64; 3] = [1001, 1002, 1003];
/// Number of initial poses, and of added ones.
const BEFORE: usize = 3;
const ADDED: usize = 2;
/// Number of random draws.
const DRAWS: u64 = 3;
const FRAMES: usize = 48;
const SIZE: usize = 64;

/// Accuracy of a network with added poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Frames of the added poses.
    pub like: Vec<usize>,
    /// PSNR of the OLATs, and the mean of the environments' relit PSNR, in decibels.
    pub olats: f64,
    pub relit: f64,
}

/// Measurements on one shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    pub seed: u64,
    /// Minutes of training for each network.
    pub minutes: f64,
    pub before: Reached,
    pub chosen: Reached,
    pub drawn: Vec<Reached>,
    /// Result of `confidence --truth` for the network with the initial poses.
    pub judged: Value,
    /// Builds of the measuring program.
    pub builds: Vec<String>,
}

/// Measures the shoots that are not measured yet until the time is up; without a clock, only reads earlier results.
/// Incomplete shoots are left out.
///
/// # Errors
/// When the program fails.
pub fn measured(options: &Options, clock: Option<&Clock>) -> Result<Vec<Added>> {
    let mut all = Vec::new();
    for seed in SEEDS {
        let minutes = options.pose_minutes;
        let shoot =
            Shoot { folder: options.work.join(format!("poses-{seed}-for-{minutes}-minutes")), options, seed, clock };
        all.extend(shoot.measured()?);
    }
    Ok(all)
}

/// One of the shoots.
struct Shoot<'a> {
    options: &'a Options,
    folder: PathBuf,
    seed: u64,
    clock: Option<&'a Clock>,
}

impl Shoot<'_> {
    /// The saved result, or otherwise the one that `make` prints, if there is time.
    fn kept(&self, path: &Path, make: impl FnOnce() -> Result<String>) -> Result<Option<Kept>> {
        match Kept::read(path) {
            Some(kept) => Ok(Some(kept)),
            None if self.clock.is_none_or(Clock::is_over) => Ok(None),
            None => Kept::or(path, self.options.build(), make).map(Some),
        }
    }

    /// None if there is no time for all of it.
    fn measured(&self) -> Result<Option<Added>> {
        let Some((before, scores)) = self.reached(&[], None)? else { return Ok(None) };
        let Some(named) = self.named()? else { return Ok(None) };
        let frames = scores.result["frames"].as_array().cloned().unwrap_or_default();
        let truth: Vec<usize> = frames.iter().filter_map(as_frame).collect();
        // Networks with more poses get the same number of steps, however busy the machine is by then.
        let steps = scores.result["training_steps"].as_u64().unwrap_or_default();
        let epochs = Preset::Quick.config().for_steps(steps, BEFORE + ADDED, FRAMES - truth.len());
        let epochs = Some(epochs.epochs);
        let free = |frame: &usize| !truth.contains(frame);
        let missing = named.result["missing"].as_array().cloned().unwrap_or_default();
        let missing = missing.iter().filter_map(as_frame);
        let chosen: Vec<usize> = missing.filter(free).take(ADDED).collect();
        let mut builds = vec![scores.build, named.build];
        let others: Vec<usize> = (0..FRAMES).filter(free).collect();
        let mut found = Vec::new();
        for draw in 0..=DRAWS {
            let like = match draw {
                0 => chosen.clone(),
                draw => drawn(&others, self.seed * DRAWS + draw - 1),
            };
            let Some((reached, kept)) = self.reached(&like, epochs)? else { return Ok(None) };
            builds.push(kept.build);
            found.push(reached);
        }
        builds.sort_unstable();
        builds.dedup();
        Ok(Some(Added {
            seed: self.seed,
            minutes: self.options.pose_minutes,
            before,
            chosen: found.remove(0),
            drawn: found,
            judged: named.result["judged"].clone(),
            builds,
        }))
    }

    /// Output of `confidence` for the shoot with the initial poses.
    fn named(&self) -> Result<Option<Kept>> {
        self.kept(&self.folder.join("named.json"), || {
            let at = self.folder.join("like-none");
            let (project, shoot) = (at.join("project"), at.join("shoot"));
            let (project, shoot) = (project.to_string_lossy(), shoot.to_string_lossy());
            // The truth's frames are skipped, so ask for more.
            let count = (ADDED + 4).to_string();
            self.options.afterlight(&["confidence", &project, "--poses", &count, "--truth", &shoot, "--json"])
        })
    }

    /// Accuracy and scores of a network with poses like these frames. It is trained for a number of epochs, or by the
    /// clock.
    fn reached(&self, like: &[usize], epochs: Option<u32>) -> Result<Option<(Reached, Kept)>> {
        let names: Vec<String> = like.iter().map(usize::to_string).collect();
        let name = if names.is_empty() { "none".to_owned() } else { names.join("-") };
        let at = self.folder.join(format!("like-{name}"));
        let path = at.join("scores.json");
        let kept = self.kept(&path, || self.trained(&at, &names, epochs))?;
        let Some(kept) = kept else { return Ok(None) };
        let relit = kept.result["relit_psnr_db"].as_object();
        let relit: Vec<f64> = relit.iter().flat_map(|all| all.values()).filter_map(Value::as_f64).collect();
        let unknown = || Error::bug(format!("{} has no scores", path.display()));
        let reached = Reached {
            like: like.to_vec(),
            olats: kept.result["olat_psnr_db"].as_f64().ok_or_else(unknown)?,
            relit: relit.iter().sum::<f64>() / relit.len().max(1) as f64,
        };
        Ok(Some((reached, kept)))
    }

    /// Writes a shoot with further poses like these frames, trains a network on it and prints its scores.
    fn trained(&self, at: &Path, like: &[String], epochs: Option<u32>) -> Result<String> {
        let options = self.options;
        if at.exists() {
            // An earlier run was stopped half-way.
            std::fs::remove_dir_all(at).map_err(|e| Error::io("remove", at, e, "Remove it yourself"))?;
        }
        let (shoot, project) = (at.join("shoot"), at.join("project"));
        let (shoot, project) = (shoot.to_string_lossy(), project.to_string_lossy());
        let [size, frames, seed] = [SIZE as u64, FRAMES as u64, self.seed].map(|n| n.to_string());
        let poses = BEFORE.to_string();
        let (unit, length) = match epochs {
            Some(epochs) => ("--epochs", epochs.to_string()),
            None => ("--minutes", options.pose_minutes.to_string()),
        };
        let like = like.join(",");
        let mut stage = vec!["stage", &shoot, "--size", &size, "--frames", &frames, "--seed", &seed, "--poses", &poses];
        if !like.is_empty() {
            stage.extend(["--like-frames", &like]);
        }
        options.afterlight(&stage)?;
        let import = ["import", &project, "--shoot", &shoot, "--size", &size];
        options.afterlight(&import)?;
        options.afterlight(&["calibrate", &project])?;
        options.afterlight(&["train", &project, "--fresh", unit, &length, "--exclude-truth", &shoot])?;
        options.afterlight(&["evaluate", &project, "--truth", &shoot, "--json"])
    }
}

/// Random frames, in ascending order.
fn drawn(frames: &[usize], seed: u64) -> Vec<usize> {
    let mut like = frames.to_vec();
    like.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    like.truncate(ADDED);
    like.sort_unstable();
    like
}

fn as_frame(value: &Value) -> Option<usize> {
    value.as_u64().map(|frame| frame as usize)
}
