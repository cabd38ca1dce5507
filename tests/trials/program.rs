//! Calibrates many small shoots of the virtual stage whose light, camera, subject and mirror ball are drawn at random,
//! and writes how far the calibration was off, and how often the truth lay within what it stated: `make trials`.
//!
//! The idea is that of simulation-based calibration (Talts, Betancourt, Simpson, Vehtari and Gelman, "Validating Bayesian
//! Inference Algorithms with Simulation-Based Calibration", 2018): what is stated must hold as often as it says.

mod page;
mod plot;
mod results;
mod summary;
#[cfg(test)]
mod tests;
mod trial;

use base::Result;
use clap::Parser;
use results::Results;
use std::path::PathBuf;
use std::process::ExitCode;

/// Calibrates shoots drawn at random and writes what came out. Trials that the table holds are not made again.
#[derive(Debug, Parser)]
struct Options {
    /// How many shoots, of the seeds 1, 2, 3 and so on.
    #[arg(long, default_value_t = 200)]
    trials: u64,
    /// Width and height of every picture in pixels.
    #[arg(long, default_value_t = trial::SIZE)]
    size: usize,
    /// The table that is continued.
    #[arg(long, default_value = "target/trials/results.csv")]
    table: PathBuf,
    /// Forget the table and begin again: after a change of the calibration or the stage.
    #[arg(long)]
    fresh: bool,
    /// The page to write; its plots go into a folder of its name.
    #[arg(long, default_value = "docs/robustness.md")]
    page: PathBuf,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let mut results = if options.fresh {
        Results::default()
    } else {
        Results::read(&options.table)?
    };
    let seeds: Vec<u64> = (1..=options.trials)
        .filter(|s| !results.has(*s, options.size))
        .collect();
    for (i, &seed) in seeds.iter().enumerate() {
        let outcome = trial::run(seed, options.size)?;
        println!("{:3} of {}  {outcome}", i + 1, seeds.len());
        results.rows.push(outcome);
        results.write(&options.table)?;
    }
    results
        .rows
        .retain(|row| row.size == options.size && row.seed <= options.trials);
    page::write(&options.page, &results)?;
    println!("{} is written", options.page.display());
    Ok(())
}
