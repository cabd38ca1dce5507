//! Measures predictions on a panel of dissimilar shoots and writes `docs/panel.md`: `make panel`.
//!
//! All measurements go through the program, as a user would run it: `stage`, `import`, `calibrate`, `evaluate`,
//! `train`. Existing figures are reused.

use base::files::write_beside;
use base::{Error, Result};
use clap::Parser;
use measuring::{Program, cell, file_name, finish};
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Measures the panel and writes its page.
#[derive(Debug, Parser)]
struct Options {
    /// Total minutes of training, in ascending order; none measures only the methods without training.
    #[arg(long, value_delimiter = ',')]
    minutes: Vec<f64>,
    /// Working size in pixels.
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// Further shoot with a truth, such as one of a person; repeatable.
    #[arg(long, value_name = "NAME=DIR", value_parser = measuring::named_folder)]
    shoot: Vec<(String, PathBuf)>,
    /// Folder with the head scan; left out if it is missing.
    #[arg(long, default_value = "../shared/data")]
    shared: PathBuf,
    #[arg(long, default_value = "target/debug/afterlight")]
    program: PathBuf,
    /// Folder of shoots, projects and figures.
    #[arg(long, default_value = "target/panel")]
    work: PathBuf,
    /// Page to write.
    #[arg(long, default_value = "docs/panel.md")]
    page: PathBuf,
}

/// Shoots made here: name and options of `stage`.
const STAGES: [(&str, &str); 3] = [
    ("stage: hair, glasses", "--seed 301 --hair brown --glasses"),
    ("stage: hand, reseated", "--seed 302 --hands --reseated 0.02"),
    ("stage: dark skin, shine", "--seed 303 --skin 0.95 --shine 0.8"),
];
/// Methods without training, named as in `evaluate --with`. The last is the rig's limit.
const UNTRAINED: [&str; 4] = ["nearest", "ratio", "transfer", "truth-olats"];

/// Figures of a method on a shoot, in decibels.
struct Figures {
    /// Mean over environments and frames, and the worst environment's mean.
    relit: [f64; 2],
    /// The worst environment's name.
    worst: String,
    /// OLATs at shadow edges.
    edges: Option<f64>,
    /// Share of these edges in the OLATs' squared error.
    edge_share: Option<f64>,
    /// Mean over frames, and the worst frame's value; None for a method whose OLATs are the truth.
    olats: Option<[f64; 2]>,
}

struct Row {
    method: String,
    figures: Figures,
}

/// A shoot of the panel.
struct Shoot {
    name: String,
    folder: PathBuf,
    /// True if given by the caller instead of made here.
    given: bool,
}

fn main() -> ExitCode {
    finish(run(&Options::parse()))
}

fn run(options: &Options) -> Result<()> {
    let mut page = String::from(
        "# Panel\n\n`make panel` writes this page: PSNR in dB on dissimilar shoots, on frames that no exemplar shows and no\n\
         training sees. `truth-olats`: the limit, the sum of the true OLATs. `prediction`: the transfer, corrected by the\n\
         network. `network`: the network alone, trained on from one length to the next.\n",
    );
    let mut all = Vec::new();
    for shoot in shoots(options)? {
        let rows = measure(options, &shoot.name, &shoot.folder)?;
        all.push((shoot, rows));
    }
    page += &means(&all);
    page += &by_shoot(&all);
    write_beside(&options.page, |out| out.write_all(page.as_bytes()))
}

/// Table of each method's means over given and over made-up shoots, and its worst shoot.
fn means(all: &[(Shoot, Vec<Row>)]) -> String {
    let mut text = String::from(
        "\n## All shoots\n\nRelit / OLATs / shadow edges, means over shoots.\n\n| method | given shoots | made-up shoots | worst shoot |\n|---|---|---|---|\n",
    );
    let methods = all.first().map_or(&[][..], |(_, rows)| rows);
    for method in methods.iter().map(|row| &row.method) {
        let result = |(shoot, rows): &(Shoot, Vec<Row>)| {
            let row = rows.iter().find(|row| row.method == *method)?;
            let olats = row.figures.olats.map_or(f64::NAN, |[mean, _]| mean);
            Some((shoot.given, [row.figures.relit[0], olats, row.figures.edges.unwrap_or(f64::NAN)]))
        };
        let found: Vec<(bool, [f64; 3])> = all.iter().filter_map(result).collect();
        let said = |figures: [f64; 3]| figures.map(|db| cell(Some(db), 1)).join(" / ");
        let mean = |given: bool| {
            let group: Vec<[f64; 3]> =
                (found.iter().filter(|(of, _)| *of == given)).map(|(_, figures)| *figures).collect();
            let sum = |i: usize| group.iter().map(|figures| figures[i]).sum::<f64>();
            said([0, 1, 2].map(|i| sum(i) / group.len() as f64))
        };
        let worst = |i: usize| (found.iter().map(|(_, figures)| figures[i])).fold(f64::NAN, f64::min);
        let _ = writeln!(text, "| {method} | {} | {} | {} |", mean(true), mean(false), said([0, 1, 2].map(worst)));
    }
    text
}

/// Table of each shoot: the transfer, the prediction after the longest training, and the limit.
fn by_shoot(all: &[(Shoot, Vec<Row>)]) -> String {
    let mut text = String::from(
        "\n## Each shoot\n\nMean (worst environment or frame); the prediction after the longest training. Edges: PSNR, and their share of the\n\
         OLATs' squared error.\n\n\
         | shoot | transfer: relit | OLATs | edges | prediction: relit | OLATs | edges | limit: relit |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    let both = |[mean, worst]: [f64; 2]| format!("{mean:.1} ({worst:.1})");
    let relit = |figures: &Figures| {
        let [mean, worst] = figures.relit;
        format!("{mean:.1} ({} {worst:.1})", figures.worst)
    };
    for (shoot, rows) in all {
        let _ = write!(text, "| {} |", shoot.name);
        let last = |method: &str| rows.iter().rfind(|row| row.method.starts_with(method));
        for method in ["transfer", "prediction"] {
            let figures = last(method).map(|row| &row.figures);
            let relit = figures.map_or("–".to_owned(), relit);
            let olats = figures.and_then(|figures| figures.olats).map_or("–".to_owned(), both);
            let edges = cell(figures.and_then(|figures| figures.edges), 1);
            let share = cell(figures.and_then(|figures| Some(100.0 * figures.edge_share?)), 0);
            let _ = write!(text, " {relit} | {olats} | {edges}, {share} % |");
        }
        let limit = last("truth-olats").map_or("–".to_owned(), |row| relit(&row.figures));
        let _ = writeln!(text, " {limit} |");
    }
    text
}

/// Shoots of the panel. Those of the virtual stage are made if missing.
fn shoots(options: &Options) -> Result<Vec<Shoot>> {
    let afterlight = Program(&options.program);
    let mut all = Vec::new();
    if options.shoot.is_empty() {
        println!("people skipped: no --shoot names one");
    }
    for (name, folder) in options.shoot.iter().cloned() {
        all.push(Shoot { name, folder, given: true });
    }
    let mut made = |name: &str, folder: PathBuf| {
        all.push(Shoot { name: name.to_owned(), folder, given: false });
    };
    let demo = options.work.join("demo");
    afterlight.run(&["demo", &demo.to_string_lossy(), "--prepare"])?;
    made("demo", demo.join("shoot"));
    let scan = options.shared.join("stage");
    if scan.join("manifest.json").exists() {
        made("head scan", scan);
    } else {
        println!("head scan skipped: {} is missing", scan.display());
    }
    for (name, settings) in STAGES {
        let folder = options.work.join(file_name(name)).join("shoot");
        if !folder.join("manifest.json").exists() {
            let size = options.size.to_string();
            let to = folder.to_string_lossy();
            let mut command = vec!["stage", &to, "--size", &size, "--frames", "12"];
            command.extend(settings.split(' '));
            afterlight.run(&command)?;
        }
        made(name, folder);
    }
    Ok(all)
}

/// Measures a shoot: first the methods without training, then the prediction and the network after each training time.
fn measure(options: &Options, name: &str, shoot: &Path) -> Result<Vec<Row>> {
    let afterlight = Program(&options.program);
    let work = options.work.join(file_name(name));
    std::fs::create_dir_all(&work).map_err(|e| Error::io("write", &work, e, "Check that the folder can be written"))?;
    let project = work.join("project");
    let (to, from, size) = (project.to_string_lossy(), shoot.to_string_lossy(), options.size.to_string());
    if !project.join("project.toml").exists() {
        afterlight.run(&["import", &to, "--shoot", &from, "--size", &size])?;
    }
    if !project.join("calibration.toml").exists() {
        afterlight.run(&["calibrate", &to])?;
    }
    let score = |method: &str, file: &str| -> Result<Figures> {
        let path = work.join(format!("{file}.json"));
        if let Some(kept) = std::fs::read(&path).ok().and_then(|text| serde_json::from_slice(&text).ok()) {
            return figures(&kept, method);
        }
        let found = afterlight.json(&["evaluate", &to, "--truth", &from, "--with", method])?;
        write_beside(&path, |out| out.write_all(found.to_string().as_bytes()))?;
        figures(&found, method)
    };
    let mut rows = Vec::new();
    for method in UNTRAINED {
        rows.push(Row { method: method.to_owned(), figures: score(method, method)? });
    }
    for minutes in &options.minutes {
        let kept = |method: &str| format!("{method}-{minutes}");
        if !work.join(format!("{}.json", kept("network"))).exists() {
            let total = minutes.to_string();
            let train = ["train", &to, "--preset", "quick", "--minutes", &total, "--exclude-truth", &from];
            afterlight.run(&train)?;
        }
        for method in ["prediction", "network"] {
            let method_after = format!("{method}, {minutes} min");
            rows.push(Row { method: method_after, figures: score(method, &kept(method))? });
        }
    }
    Ok(rows)
}

fn figures(found: &Value, method: &str) -> Result<Figures> {
    let missing = || Error::bug(format!("evaluate --with {method} printed no figures"));
    let relit = found["relit_psnr_db"].as_object().ok_or_else(missing)?;
    let named = relit.iter().filter_map(|(name, db)| Some((name, db.as_f64()?)));
    let worst = named.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(name, _)| name.clone());
    let relit: Vec<f64> = relit.values().filter_map(Value::as_f64).collect();
    let frames = found["olat_psnr_by_frame_db"].as_object().ok_or_else(missing)?;
    let frames: Vec<f64> = frames.values().filter_map(Value::as_f64).collect();
    let both = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        [mean, values.iter().copied().fold(f64::INFINITY, f64::min)]
    };
    if relit.is_empty() {
        return Err(missing());
    }
    let olats = (method != "truth-olats" && !frames.is_empty()).then(|| both(&frames));
    Ok(Figures {
        relit: both(&relit),
        worst: worst.unwrap_or_default(),
        edges: found["olat_shadow_edges"]["psnr_db"].as_f64().filter(|_| olats.is_some()),
        edge_share: found["olat_shadow_edges"]["error_share"].as_f64().filter(|_| olats.is_some()),
        olats,
    })
}
