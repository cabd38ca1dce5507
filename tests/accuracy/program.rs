//! Measures shoots with a truth, and writes `docs/accuracy.md` with all its tables and plots: `make accuracy`.
//!
//! All measurements go through the program, as a user would run it: `stage`, `import`, `calibrate`, `tradeoff`,
//! `evaluate`. Earlier measurements are reused. Everything must fit a time budget; the most informative comes first,
//! and the page lists what is missing.

mod about;
mod added;
mod bench;
mod clock;
mod kept;
mod methods;
mod page;
mod pictures;
mod plot;
mod poses;
mod rungs;
mod sheet;
mod shoots;
mod summary;
#[cfg(test)]
mod tests;

use about::About;
use base::Result;
use base::files::{self, write_beside};
use clap::Parser;
use clock::Clock;
use measuring::{Program, finish};
use page::{Page, Shoot};
use serde_json::Value;
use shoots::Source;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Measures shoots with a truth and writes the page. Continues a stopped run.
#[derive(Debug, Parser)]
struct Options {
    /// Minutes by the clock for everything. Only the base's networks are always trained.
    #[arg(long, default_value_t = 90.0)]
    budget: f64,
    /// Minutes of training for the base [default: as before, or a 90th of the budget].
    #[arg(long)]
    minutes: Option<f64>,
    /// Seeds of each rung, and of each method with training.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=20))]
    seeds: u64,
    /// Working size in pixels.
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// Folder with other shoots and weights; skipped if missing.
    #[arg(long, default_value = "../shared/data")]
    shared: PathBuf,
    /// Further shoot with a truth; repeatable.
    #[arg(long, value_name = "NAME=DIR", value_parser = measuring::named_folder)]
    shoot: Vec<(String, PathBuf)>,
    /// Measure nothing: write the page from earlier results.
    #[arg(long)]
    no_ladder: bool,
    /// Training minutes for each of 15 networks that test the suggested poses; 0 for none.
    #[arg(long, default_value_t = 0.5)]
    pose_minutes: f64,
    /// Skip the benches of passes and sums.
    #[arg(long)]
    no_benches: bool,
    /// Program to measure.
    #[arg(long, default_value = "target/debug/afterlight")]
    program: PathBuf,
    /// Folder of projects and figures.
    #[arg(long, default_value = "target/accuracy")]
    work: PathBuf,
    /// Page to write; its plots go into a folder of that name.
    #[arg(long, default_value = "docs/accuracy.md")]
    page: PathBuf,
    #[arg(skip)]
    build: OnceLock<String>,
}

/// LPIPS weights in the shared data.
const LPIPS: &str = "weights/squeezenet1_1_lpips_v0_1.safetensors";
/// Share of the time reserved for poses and expected errors before the ladders continue.
const POSES_SHARE: f64 = 0.3;

fn main() -> ExitCode {
    finish(run(&Options::parse()))
}

fn run(options: &Options) -> Result<()> {
    let clock = Clock::start(options.budget);
    let sources = shoots::sources(options)?;
    if !options.no_ladder {
        // A failed run has also taken measuring time.
        let measured = measure(options, &sources, &clock);
        options.note(&clock)?;
        measured?;
    }
    let page = options.page(&sources)?;
    page.write(&options.page)?;
    println!("{} is written", options.page.display());
    Ok(())
}

/// Measures in order of information, so that an incomplete page says most: the base with every seed, the methods and
/// their pictures, the benches, the methods' other seeds, the poses, the ladders, and the methods with as much time as
/// the longest-trained network.
fn measure(options: &Options, sources: &[Source], clock: &Clock) -> Result<()> {
    for source in sources {
        source.climb(options, 0.0)?;
    }
    for source in sources {
        methods::measure(options, source, clock, (0, false))?;
        pictured(options, source, clock)?;
    }
    if !options.no_benches {
        bench::measure(options, clock)?;
    }
    for seed in 1..options.seeds {
        for source in sources {
            methods::measure(options, source, clock, (seed, false))?;
        }
    }
    if options.pose_minutes > 0.0 {
        poses::measured(options, Some(&Clock::start(POSES_SHARE * clock.left())))?;
    }
    shoots::climb_all(options, sources, clock)?;
    for source in sources {
        methods::measure(options, source, clock, (0, true))?;
        pictured(options, source, clock)?;
    }
    // Uses what is left of the poses' share.
    if options.pose_minutes > 0.0 {
        poses::measured(options, Some(clock))?;
    }
    Ok(())
}

/// Renders the pictures of the base's network and of the longest-trained one.
fn pictured(options: &Options, source: &Source, clock: &Clock) -> Result<()> {
    if let Some((base, most)) = source.ladder()?.as_ref().and_then(shoots::minutes) {
        methods::network(options, source, base, Some(clock))?;
        methods::network(options, source, most, Some(clock))?;
    }
    Ok(())
}

impl Options {
    /// Contents of the page.
    fn page(&self, sources: &[Source]) -> Result<Page> {
        let mut left_out = Vec::new();
        let mut shoots = Vec::new();
        for source in sources {
            let Some(ladder) = source.ladder()?.filter(|ladder| !ladder.rungs.is_empty()) else {
                left_out.push(source.name.clone());
                continue;
            };
            let methods = methods::all(self, source, &ladder);
            let mut networks = Vec::new();
            if let Some((base, most)) = shoots::minutes(&ladder) {
                let mut lengths = vec![base, most];
                lengths.dedup();
                for minutes in lengths {
                    networks.extend(methods::network(self, source, minutes, None)?);
                }
            }
            for method in methods::METHODS {
                if methods.iter().all(|of| of.method != method) {
                    left_out.push(format!("{} on the {}", page::words(method), source.name));
                }
            }
            shoots.push(Shoot {
                name: source.name.clone(),
                size: self.size,
                ladder,
                methods,
                networks,
                // The program's own footage may be published.
                elsewhere: (source.folder != shoots::stage(self)).then(|| source.work.clone()),
            });
        }
        let benches = bench::all(self);
        for (name, title) in [("passes", "time of each pass"), ("relight", "sum of lamps")] {
            if benches.iter().all(|bench| bench.name != name) {
                left_out.push(title.to_owned());
            }
        }
        let added = poses::measured(self, None)?;
        if added.len() < poses::SEEDS.len() {
            left_out.push(format!(
                "{} of {} shoots of the poses",
                poses::SEEDS.len() - added.len(),
                poses::SEEDS.len()
            ));
        }
        Ok(Page {
            shoots,
            added,
            benches,
            about: About { runs: self.runs(), build: self.build().to_owned(), seeds: self.seeds, left_out },
        })
    }

    /// Build of the measuring program.
    fn build(&self) -> &str {
        let named = || evaluation::build_of(&self.program);
        self.build.get_or_init(|| named().unwrap_or_else(|_| "unknown".to_owned()))
    }

    /// Records of the measuring runs.
    fn runs(&self) -> Vec<Value> {
        let text = files::read_text(&self.work.join("runs.json"), files::MOST_TEXT);
        let runs = text.ok().and_then(|text| serde_json::from_str(&text).ok());
        runs.unwrap_or_default()
    }

    /// Saves a record of this run.
    fn note(&self, clock: &Clock) -> Result<()> {
        let mut runs = self.runs();
        runs.push(clock.record(self.build()));
        let text = Value::from(runs).to_string();
        write_beside(&self.work.join("runs.json"), |out| out.write_all(text.as_bytes()))
    }

    /// LPIPS weights; None if missing.
    fn lpips(&self) -> PathBuf {
        self.shared.join(LPIPS)
    }

    /// Output of the program.
    fn afterlight(&self, arguments: &[&str]) -> Result<String> {
        Program(&self.program).run(arguments)
    }
}
