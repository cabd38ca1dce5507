//! The measured shoots: written, imported, calibrated, and their ladders.

use crate::{Clock, Options};
use base::Result;
use measuring::file_name;
use project::Project;
use std::path::PathBuf;
use tradeoff::{Knob, Ledger};

/// Share of the budget for the base's training by default: about a hundred networks are trained.
const BASE_SHARE: f64 = 1.0 / 90.0;
const BASE_MINUTES: std::ops::RangeInclusive<f64> = 0.02..=10.0;

/// A shoot with a truth.
pub struct Source {
    pub name: String,
    pub folder: PathBuf,
    /// Folder of its figures.
    pub work: PathBuf,
}

impl Source {
    /// Path of its project.
    pub fn project(&self) -> PathBuf {
        self.work.join("project")
    }

    /// Measurements of its ladder, if any.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn ladder(&self) -> Result<Option<Ledger>> {
        if !self.project().join("project.toml").exists() {
            return Ok(None);
        }
        Ledger::load(&Project::open(&self.project())?)
    }

    /// Measures its ladder for a number of minutes; the base always with all seeds.
    ///
    /// # Errors
    /// When the program fails.
    pub fn climb(&self, options: &Options, minutes: f64) -> Result<()> {
        let (project, truth) = (self.project(), &self.folder);
        let (project, truth) = (project.to_string_lossy(), truth.to_string_lossy());
        let kept = self.ladder()?.and_then(|ladder| ladder.settings.base_minutes);
        let share = (BASE_SHARE * options.budget).clamp(*BASE_MINUTES.start(), *BASE_MINUTES.end());
        let base = options.minutes.or(kept).unwrap_or(share).to_string();
        let (seeds, within) = (options.seeds.to_string(), minutes.max(0.05).to_string());
        let mut command = vec![
            "tradeoff",
            &project,
            "--truth",
            &truth,
            "--base-minutes",
            &base,
            "--seeds",
            &seeds,
            "--within",
            &within,
        ];
        let lpips = options.lpips();
        let lpips_file = lpips.to_string_lossy();
        if lpips.exists() {
            command.extend(["--lpips", &lpips_file]);
        }
        options.afterlight(&command).map(drop)
    }
}

/// Folder of the virtual stage's shoot.
pub fn stage(options: &Options) -> PathBuf {
    options.work.join("stage")
}

/// The shoots, imported and calibrated. The virtual stage's is written if missing.
///
/// # Errors
/// When the program fails.
pub fn sources(options: &Options) -> Result<Vec<Source>> {
    let size = options.size.to_string();
    let stage = stage(options);
    if !stage.join("manifest.json").exists() {
        let folder = stage.to_string_lossy();
        options.afterlight(&["stage", &folder, "--size", &size, "--frames", "24"])?;
    }
    let mut named = vec![("virtual stage".to_owned(), stage)];
    let scan = options.shared.join("stage");
    if scan.join("manifest.json").exists() {
        named.push(("head scan".to_owned(), scan));
    } else {
        println!("Skipped {}: it is missing", scan.display());
    }
    named.extend(options.shoot.iter().cloned());
    let ready = named.into_iter().map(|(name, folder)| {
        let source = Source { work: options.work.join(file_name(&name)), name, folder };
        let (project, shoot) = (source.project(), &source.folder);
        let (to, from) = (project.to_string_lossy(), shoot.to_string_lossy());
        if !options.no_ladder && !project.join("project.toml").exists() {
            options.afterlight(&["import", &to, "--shoot", &from, "--size", &size])?;
        }
        if !options.no_ladder && !project.join("calibration.toml").exists() {
            options.afterlight(&["calibrate", &to])?;
        }
        Ok(source)
    });
    ready.collect()
}

/// Measures the ladders further while there is time, which they share.
///
/// # Errors
/// When the program fails.
pub fn climb_all(options: &Options, sources: &[Source], clock: &Clock) -> Result<()> {
    for (done, source) in sources.iter().enumerate() {
        let share = clock.left() / (sources.len() - done) as f64;
        if share > 0.0 {
            source.climb(options, share)?;
        }
    }
    Ok(())
}

/// Training minutes of the base, and of the longest-trained network.
pub fn minutes(ladder: &Ledger) -> Option<(f64, f64)> {
    let base = ladder.rungs.first()?.rung.minutes;
    let lengths = (ladder.rungs.iter())
        .filter(|measured| measured.rung.knob == Some(Knob::Minutes))
        .map(|measured| measured.rung.minutes);
    Some((base, lengths.fold(base, f64::max)))
}
