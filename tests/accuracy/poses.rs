//! Whether the frames that `confidence` names are worth more as poses than others, on shoots of the virtual stage.

use crate::{Options, json};
use base::files::{self, write_beside};
use base::{Error, Result};
use chacha20::ChaCha8Rng;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use serde_json::Value;
use std::io::Write;
use std::path::Path;

/// Seeds of the shoots, which nothing was chosen with.
const SEEDS: [u64; 3] = [1001, 1002, 1003];
/// Poses photographed before, and added.
const BEFORE: usize = 3;
const ADDED: usize = 2;
/// How often others are drawn.
const DRAWS: u64 = 3;
const FRAMES: usize = 48;
const SIZE: usize = 64;

/// What a network reached with some poses added.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Frames that the added poses are like.
    pub like: Vec<usize>,
    /// PSNR of the OLATs, and the mean of the environments' relit PSNR, in decibels.
    pub olats: f64,
    pub relit: f64,
}

/// What was measured on one shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    pub seed: u64,
    /// Minutes of training for each network.
    pub minutes: f64,
    pub before: Reached,
    pub chosen: Reached,
    pub drawn: Vec<Reached>,
}

/// Measures all shoots, as far as they were not measured before.
///
/// # Errors
/// When the program fails.
pub fn measured(options: &Options) -> Result<Vec<Added>> {
    SEEDS.iter().map(|&seed| shoot(options, seed)).collect()
}

fn shoot(options: &Options, seed: u64) -> Result<Added> {
    let folder = options.work.join(format!("poses-{seed}"));
    let before = reached(options, &folder, seed, &[])?;
    let named = folder.join("named.json");
    let text = kept(&named, || {
        let project = folder.join("like-none/project");
        // The truth's frames are not taken, so more are asked for.
        let count = (ADDED + 4).to_string();
        let project = project.to_string_lossy();
        options.afterlight(&["confidence", &project, "--poses", &count, "--json"])
    })?;
    let truth = truth_frames(&folder)?;
    let free = |frame: &usize| !truth.contains(frame);
    let missing = json(&named, &text)?;
    let missing = missing["missing"].as_array().cloned().unwrap_or_default();
    let chosen: Vec<usize> = (missing.iter().filter_map(Value::as_u64))
        .map(|frame| frame as usize)
        .filter(free)
        .take(ADDED)
        .collect();
    let others: Vec<usize> = (0..FRAMES).filter(free).collect();
    let drawn = (0..DRAWS).map(|draw| {
        let mut random = ChaCha8Rng::seed_from_u64(seed * DRAWS + draw);
        let mut like = others.clone();
        like.shuffle(&mut random);
        like.truncate(ADDED);
        like.sort_unstable();
        reached(options, &folder, seed, &like)
    });
    Ok(Added {
        seed,
        minutes: options.pose_minutes,
        before,
        chosen: reached(options, &folder, seed, &chosen)?,
        drawn: drawn.collect::<Result<_>>()?,
    })
}

/// A network that had poses like these frames, and what it reached.
fn reached(options: &Options, folder: &Path, seed: u64, like: &[usize]) -> Result<Reached> {
    let names: Vec<String> = like.iter().map(usize::to_string).collect();
    let name = if names.is_empty() {
        "none".to_owned()
    } else {
        names.join("-")
    };
    let at = folder.join(format!("like-{name}"));
    let path = at.join("scores.json");
    let text = kept(&path, || {
        let (shoot, project) = (at.join("shoot"), at.join("project"));
        let (shoot, project) = (shoot.to_string_lossy(), project.to_string_lossy());
        let [size, frames, seed] = [SIZE as u64, FRAMES as u64, seed].map(|n| n.to_string());
        let (poses, minutes) = (BEFORE.to_string(), options.pose_minutes.to_string());
        let like = names.join(",");
        let mut stage = vec![
            "stage", &shoot, "--size", &size, "--frames", &frames, "--seed", &seed, "--poses",
            &poses,
        ];
        if !names.is_empty() {
            stage.extend(["--like-frames", &like]);
        }
        options.afterlight(&stage)?;
        let import = ["import", &project, "--shoot", &shoot, "--size", &size];
        options.afterlight(&import)?;
        options.afterlight(&["calibrate", &project])?;
        options.afterlight(&[
            "train",
            &project,
            "--fresh",
            "--minutes",
            &minutes,
            "--exclude-truth",
            &shoot,
        ])?;
        options.afterlight(&["evaluate", &project, "--truth", &shoot, "--json"])
    })?;
    let scores = json(&path, &text)?;
    let relit = scores["relit_psnr_db"].as_object();
    let relit: Vec<f64> = relit
        .iter()
        .flat_map(|all| all.values())
        .filter_map(Value::as_f64)
        .collect();
    let unknown = || Error::bug(format!("{} has no scores", path.display()));
    Ok(Reached {
        like: like.to_vec(),
        olats: scores["olat_psnr_db"].as_f64().ok_or_else(unknown)?,
        relit: relit.iter().sum::<f64>() / relit.len().max(1) as f64,
    })
}

/// Frames whose truth the shoots have.
fn truth_frames(folder: &Path) -> Result<Vec<usize>> {
    let path = folder.join("like-none/scores.json");
    let text = kept(&path, || {
        Err(Error::bug("a network was measured and is not there"))
    })?;
    let scores = json(&path, &text)?;
    let frames = scores["frames"].as_array().cloned().unwrap_or_default();
    let frames = frames.iter().filter_map(Value::as_u64);
    Ok(frames.map(|frame| frame as usize).collect())
}

/// A file's text, which is made if it is not there.
pub fn kept(path: &Path, make: impl FnOnce() -> Result<String>) -> Result<String> {
    if let Ok(text) = files::read_text(path, files::MOST_TEXT) {
        return Ok(text);
    }
    let text = make()?;
    write_beside(path, |out| out.write_all(text.as_bytes()))?;
    Ok(text)
}
