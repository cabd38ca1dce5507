//! Measures shoots that have a truth, and writes `docs/accuracy.md` with all its tables and plots: `make accuracy`.
//!
//! The program itself does it, as a person would: `stage`, `import`, `calibrate`, `tradeoff`, `evaluate`. What was measured
//! before is not measured again.

mod page;
mod plot;
mod poses;
mod summary;
#[cfg(test)]
mod tests;

use base::{Error, Result};
use clap::Parser;
use page::{Bench, Shoot};
use poses::kept;
use project::Project;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use tradeoff::Ledger;

/// Measures shoots with a truth and writes the page. A run that was stopped goes on.
#[derive(Debug, Parser)]
struct Options {
    /// Minutes of training for each shoot, for all networks and seeds together.
    #[arg(long, default_value_t = 90.0)]
    budget: f64,
    /// Seeds of each rung.
    #[arg(long, default_value_t = 3)]
    seeds: u64,
    /// Working size in pixels.
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// A folder with other shoots and weights; left out where it is missing.
    #[arg(long, default_value = "../shared/data")]
    shared: PathBuf,
    /// A further shoot with a truth. Can be given several times.
    #[arg(long, value_name = "NAME=DIR")]
    shoot: Vec<String>,
    /// Measure no further rungs: write the page with those that are there.
    #[arg(long)]
    no_ladder: bool,
    /// Minutes of training for each of 15 networks that say what chosen poses are worth; 0 for none.
    #[arg(long, default_value_t = 2.0)]
    pose_minutes: f64,
    /// Do not run the benches of passes, sums and plates.
    #[arg(long)]
    no_benches: bool,
    /// The program that measures.
    #[arg(long, default_value = "target/debug/afterlight")]
    program: PathBuf,
    /// Where projects and figures are kept.
    #[arg(long, default_value = "target/accuracy")]
    work: PathBuf,
    /// The page to write; its plots go into a folder of its name.
    #[arg(long, default_value = "docs/accuracy.md")]
    page: PathBuf,
}

/// The methods that the network is compared with, as `evaluate --with` names them.
const METHODS: [&str; 6] = [
    "nearest",
    "ratio",
    "harmonics",
    "texler",
    "sun",
    "truth-olats",
];
/// The weights of LPIPS among the shared data.
const LPIPS: &str = "weights/squeezenet1_1_lpips_v0_1.safetensors";
/// The benches whose tables are in the page, and what is given to them.
const BENCHES: [(&str, &[&str]); 2] = [("passes", &["--software"]), ("relight", &[])];

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
    let mut shoots = Vec::new();
    for (name, folder) in options.shoots()? {
        match options.measured(&name, &folder)? {
            Some(shoot) => shoots.push(shoot),
            None => println!("{name} is left out: nothing was measured on it"),
        }
    }
    let mut benches = Vec::new();
    if !options.no_benches {
        for (name, extra) in BENCHES {
            benches.push(options.bench(name, extra)?);
        }
    }
    let added = if options.pose_minutes > 0.0 {
        poses::measured(options)?
    } else {
        Vec::new()
    };
    page::write(&options.page, &shoots, &added, &benches)?;
    println!("{} is written", options.page.display());
    Ok(())
}

impl Options {
    /// Names and folders of the shoots; the virtual stage's is made if it is not there.
    fn shoots(&self) -> Result<Vec<(String, PathBuf)>> {
        let stage = self.work.join("stage");
        if !stage.join("manifest.json").exists() {
            let size = self.size.to_string();
            let folder = stage.to_string_lossy();
            self.afterlight(&["stage", &folder, "--size", &size, "--frames", "24"])?;
        }
        let mut shoots = vec![("virtual stage".to_owned(), stage)];
        let scan = self.shared.join("stage");
        if scan.join("manifest.json").exists() {
            shoots.push(("head scan".to_owned(), scan));
        } else {
            println!("{} is left out: it is not there", scan.display());
        }
        for named in &self.shoot {
            let (name, folder) = named.split_once('=').ok_or_else(|| {
                Error::invalid(
                    format!("{named:?} names no shoot"),
                    "Write it as NAME=DIR, such as portrait=shoots/portrait",
                )
            })?;
            shoots.push((name.to_owned(), PathBuf::from(folder)));
        }
        Ok(shoots)
    }

    /// A shoot's ladder and the methods beside it; None if there is no ladder and none was asked for.
    fn measured(&self, name: &str, shoot: &Path) -> Result<Option<Shoot>> {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let folder = self.work.join(name.chars().map(plain).collect::<String>());
        let root = folder.join("project");
        if self.no_ladder && !root.join("tradeoff/ladder.json").exists() {
            return Ok(None);
        }
        let (to, from) = (root.to_string_lossy(), shoot.to_string_lossy());
        if !root.join("project.toml").exists() {
            let size = self.size.to_string();
            self.afterlight(&["import", &to, "--shoot", &from, "--size", &size])?;
        }
        if !root.join("calibration.toml").exists() {
            self.afterlight(&["calibrate", &to])?;
        }
        let (budget, seeds) = (self.budget.to_string(), self.seeds.to_string());
        let lpips = self.shared.join(LPIPS);
        let lpips_file = lpips.to_string_lossy();
        let mut ladder = vec![
            "tradeoff", &to, "--truth", &from, "--budget", &budget, "--seeds", &seeds,
        ];
        if lpips.exists() {
            ladder.extend(["--lpips", &lpips_file]);
        }
        if !self.no_ladder {
            self.afterlight(&ladder)?;
        }
        let ladder = Ledger::load(&Project::open(&root)?)?
            .ok_or_else(|| Error::bug("a ladder was measured and is not there"))?;
        // What learns has the time of the network that had most.
        let minutes = ladder.rungs.iter().map(|measured| measured.rung.minutes);
        let minutes = minutes.fold(0.0, f64::max).to_string();
        let mut methods = Vec::new();
        for method in METHODS {
            let path = folder.join(format!("{method}.json"));
            let text = kept(&path, || {
                self.afterlight(&[
                    "evaluate",
                    &to,
                    "--truth",
                    &from,
                    "--with",
                    method,
                    "--minutes",
                    &minutes,
                    "--json",
                ])
            })?;
            methods.push((method, json(&path, &text)?));
        }
        Ok(Some(Shoot {
            name: name.to_owned(),
            size: self.size,
            ladder,
            methods,
        }))
    }

    /// The tables that a bench prints, one line each.
    fn bench(&self, name: &'static str, extra: &[&str]) -> Result<Bench> {
        let path = self.work.join(format!("bench-{name}.txt"));
        let text = kept(&path, || {
            let mut command = Command::new("cargo");
            command.args([
                "bench",
                "--locked",
                "--profile",
                "dev",
                "--bench",
                name,
                "--",
            ]);
            command.args(extra);
            printed(&mut command)
        })?;
        let rows = text.lines().filter(|line| line.starts_with('|'));
        Ok(Bench {
            name,
            rows: rows.map(str::to_owned).collect(),
        })
    }

    /// What the program prints.
    fn afterlight(&self, arguments: &[&str]) -> Result<String> {
        println!("afterlight {}", arguments.join(" "));
        printed(Command::new(&self.program).args(arguments))
    }
}

/// What a command prints; its errors are shown.
fn printed(command: &mut Command) -> Result<String> {
    let shown = format!("{command:?}");
    let output = command.stderr(Stdio::inherit()).output().map_err(|e| {
        Error::invalid(
            format!("{shown} cannot be run: {e}"),
            "Build it first: make build",
        )
    })?;
    if !output.status.success() {
        return Err(Error::invalid(
            format!("{shown} failed"),
            "What it says stands above",
        ));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn json(path: &Path, text: &str) -> Result<Value> {
    serde_json::from_str(text).map_err(|e| {
        Error::codec(
            "read",
            path,
            e.to_string(),
            "Remove it, and it is measured again",
        )
    })
}
