//! Calibrates many small shoots of the virtual stage with random light, camera, subject and mirror ball, and writes the
//! errors of the calibration and the coverage of its intervals: `make trials`.
//!
//! Based on simulation-based calibration (Talts, Betancourt, Simpson, Vehtari and Gelman, "Validating Bayesian
//! Inference Algorithms with Simulation-Based Calibration", 2018): a stated interval must hold as often as it claims.

mod faults;
mod motion;
mod networks;
mod page;
mod results;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod trial;

use base::Result;
use clap::Parser;
use faults::FaultRow;
use networks::{Pair, Training};
use results::Row;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Calibrates random shoots and writes the results. Trials already in the tables are not repeated.
#[derive(Debug, Parser)]
struct Options {
    /// Number of shoots, from the first seed on.
    #[arg(long, default_value_t = 200)]
    trials: u64,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    first: u64,
    /// Number of shoots for which networks are trained, to measure the calibration's cost in the picture.
    #[arg(long, default_value_t = 0)]
    networks: u64,
    /// Number of shoots that are checked as they are, and with a fault in their files.
    #[arg(long, default_value_t = 0)]
    faults: u64,
    /// Width and height of every picture in pixels.
    #[arg(long, default_value_t = trial::SIZE)]
    size: usize,
    /// Epochs of each network's training. Two cores without a GPU make about as many in ten minutes at 128 × 128.
    #[arg(long, default_value_t = 2300)]
    epochs: u64,
    /// Program for training the networks.
    #[arg(long, default_value = "target/debug/afterlight")]
    program: PathBuf,
    /// Folder of the tables, which are continued.
    #[arg(long, default_value = "target/trials")]
    tables: PathBuf,
    /// Discard the tables and calibrate again, after a change of the calibration.
    #[arg(long)]
    fresh: bool,
    /// Discard the shoots too, which take the most time, after a change of the stage.
    #[arg(long)]
    fresh_shoots: bool,
    /// Page to write; its plots go into a folder of that name.
    #[arg(long, default_value = "docs/robustness.md")]
    page: PathBuf,
}

impl Options {
    fn seeds(&self) -> Range<u64> {
        self.first..self.first.saturating_add(self.trials)
    }
}

fn main() -> ExitCode {
    measuring::finish(run(&Options::parse()))
}

fn run(options: &Options) -> Result<()> {
    let mut rows = calibrations(options)?;
    let mut pairs = pairs(options)?;
    rows.retain(|row| row.size == options.size && options.seeds().contains(&row.seed));
    pairs.retain(|pair| pair.size == options.size);
    let mut faults = faults(options)?;
    faults.retain(|row| row.size == options.size && options.seeds().contains(&row.seed));
    page::write(&options.page, &rows, &faults, &pairs)?;
    println!("{} is written", options.page.display());
    Ok(())
}

/// Table of the calibrations, completed if necessary.
fn calibrations(options: &Options) -> Result<Vec<Row>> {
    let path = options.tables.join("calibrations.csv");
    let shoots = options.tables.join("shoots");
    if options.fresh_shoots {
        trial::remove(&shoots)?;
    }
    let mut rows: Vec<Row> = kept(options, &path)?;
    let is_made = |rows: &[Row], seed| (rows.iter()).any(|r| (r.seed, r.size) == (seed, options.size));
    for seed in options.seeds() {
        if !is_made(&rows, seed) {
            let row = trial::run(seed, options.size, &shoots)?;
            println!("{row}");
            rows.push(row);
            table::write(&path, &rows)?;
        }
    }
    Ok(rows)
}

/// Table of the faults, completed if necessary.
fn faults(options: &Options) -> Result<Vec<FaultRow>> {
    let path = options.tables.join("faults.csv");
    let shoots = options.tables.join("shoots");
    let mut rows: Vec<FaultRow> = kept(options, &path)?;
    for seed in options.seeds().take(options.faults as usize) {
        if !rows.iter().any(|row| (row.seed, row.size) == (seed, options.size)) {
            for row in faults::run(seed, options.size, &shoots)? {
                println!("{row}");
                rows.push(row);
            }
            table::write(&path, &rows)?;
        }
    }
    Ok(rows)
}

/// Table of the networks, completed if necessary.
fn pairs(options: &Options) -> Result<Vec<Pair>> {
    let path = options.tables.join("networks.csv");
    let mut pairs: Vec<Pair> = kept(options, &path)?;
    let training = Training { program: &options.program, size: options.size, epochs: options.epochs };
    let is_made = |pairs: &[Pair], seed| {
        let wanted = (seed, training.size, training.epochs);
        pairs.iter().any(|p| (p.seed, p.size, p.epochs) == wanted)
    };
    for seed in options.seeds().take(options.networks as usize) {
        if !is_made(&pairs, seed) {
            for pair in training.run(seed)? {
                println!("{pair}");
                pairs.push(pair);
            }
            table::write(&path, &pairs)?;
        }
    }
    Ok(pairs)
}

/// Rows of a table, or none if it is discarded.
fn kept<R: DeserializeOwned>(options: &Options, path: &Path) -> Result<Vec<R>> {
    if options.fresh || options.fresh_shoots {
        return Ok(vec![]);
    }
    table::read(path)
}
