//! The page: fixed text, and tables and plots of the measurements.

use crate::about::{self, About};
use crate::bench::Bench;
use crate::methods::{METHODS, Scored};
use crate::poses::Added;
use crate::summary::{Figure, Step, steps};
use crate::{added, pictures, plot, rungs};
use base::files::write_beside;
use base::{Error, Result};
use measuring::file_name;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use tradeoff::{Knob, Ledger};

/// A shoot with a truth, and its measurements.
pub struct Shoot {
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    pub ladder: Ledger,
    /// Methods to compare the network with.
    pub methods: Vec<Scored>,
    /// Networks whose pictures are shown beside the methods', the longest-trained last.
    pub networks: Vec<Scored>,
    /// Folder of its sheet, if its pictures may not be published; None for the page's folder.
    pub elsewhere: Option<PathBuf>,
}

impl Shoot {
    /// Columns of the sheet: the network, then the methods; those with training got the network's minutes. Uses the
    /// longest time that all of them had, or otherwise the shortest; None without a network's pictures.
    pub fn compared(&self) -> Option<Vec<&Scored>> {
        let beside = |network: &'_ Scored| -> Vec<&Scored> {
            let same = |other: &&Scored| other.learnt.is_none() || other.learnt == network.learnt;
            let entry = |method: &str| {
                let mut all = self.methods.iter().filter(same);
                all.find(|other| other.method == method)
            };
            METHODS.into_iter().filter_map(entry).collect()
        };
        let complete = (self.networks.iter().rev()).find(|network| beside(network).len() == METHODS.len());
        let network = complete.or(self.networks.first())?;
        Some([vec![network], beside(network)].concat())
    }
}

/// Contents of the page.
pub struct Page {
    pub shoots: Vec<Shoot>,
    pub added: Vec<Added>,
    pub benches: Vec<Bench>,
    pub about: About,
}

const HEAD: &str = include_str!("head.md");
/// Placeholder in the head for the section about the run.
const ABOUT: &str = "<!-- about -->\n";

impl Page {
    /// Writes the page to `path`, and its plots, tables and pictures into the folder of that name beside it.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let folder = path.with_extension("");
        std::fs::create_dir_all(&folder)
            .map_err(|e| Error::io("write", &folder, e, "Check that the folder can be written"))?;
        let stem = folder.file_name().unwrap_or_default();
        let stem = stem.to_string_lossy();
        let mut text = HEAD.replace(ABOUT, &about::section(self));
        for shoot in &self.shoots {
            let steps = steps(&shoot.ladder);
            let file = file_name(&shoot.name);
            let plot = plot::svg(&shoot.name, &steps);
            write_beside(&folder.join(format!("{file}.svg")), |out| out.write_all(plot.as_bytes()))?;
            // The path of the measuring folder would mean nothing to readers.
            let truth = format!("truth of the {}", shoot.name);
            let table = tradeoff::csv(&shoot.ladder.rungs, &shoot.ladder.machine, &truth);
            write_beside(&folder.join(format!("{file}.csv")), |out| out.write_all(table.as_bytes()))?;
            text += &section(shoot, &steps, &format!("{stem}/{file}"));
        }
        pictures::write(&folder, &self.shoots)?;
        text += &added::section(&self.added);
        text += &added::errors(&self.added);
        for bench in &self.benches {
            text += "\n";
            text += &bench.section();
        }
        write_beside(path, |out| out.write_all(text.as_bytes()))
    }
}

/// Sentence that lists the builds behind some figures, with the number of figures of each.
pub fn builds<'a>(of: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    of.for_each(|build| *counts.entry(build).or_default() += 1);
    let name = |build: &str| match build {
        "" => "older versions".to_owned(),
        build => build.to_owned(),
    };
    match counts.len() {
        0 => String::new(),
        1 => counts.keys().map(|build| format!("Build {}.", name(build))).collect(),
        _ => {
            let all = counts.iter().map(|(build, count)| match count {
                1 => format!("{} (1 figure)", name(build)),
                _ => format!("{} ({count} figures)", name(build)),
            });
            format!("**Builds differ, so figures may not be comparable: {}.**", all.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Section of a shoot; plot and table are beside the page, named `stem`.
fn section(shoot: &Shoot, steps: &[Step], stem: &str) -> String {
    let Shoot { name, size, ladder, .. } = shoot;
    let base = ladder.rungs.first();
    let minutes = base.map_or(0.0, |base| base.rung.minutes);
    let frames = shoot.methods.first().map_or(0, |first| first.kept.result["frames"].as_array().map_or(0, Vec::len));
    let mut text = format!("\n## {name}\n\n");
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Working size {size}, {frames} truth frames, base trained {minutes:.2} minutes. {}. {}.\n",
        ladder.machine.words(),
        ladder.device,
    );
    text += &methods(shoot, steps);
    let _ = writeln!(
        text,
        "\n![Time for a frame against error]({stem}.svg)\n\nAll seeds with settings, costs, SSIM and LPIPS: [CSV]({stem}.csv).\n"
    );
    text += &rungs::table(steps);
    for failure in &ladder.failures {
        let _ = writeln!(text, "\n- {} was left out: {}", failure.rung, failure.sentence);
    }
    text
}

/// Builds behind a shoot's figures.
pub fn of_shoot(shoot: &Shoot) -> impl Iterator<Item = &str> {
    let rungs = shoot.ladder.rungs.iter().map(|measured| measured.build.as_str());
    let all = shoot.methods.iter().chain(&shoot.networks);
    rungs.chain(all.map(|of| of.kept.build.as_str()))
}

/// Table of the other methods, and of the prediction trained as long; the rungs have the other training times.
fn methods(shoot: &Shoot, steps: &[Step]) -> String {
    let environments: Vec<String> = shoot
        .ladder
        .rungs
        .first()
        .map(|base| base.relit_psnr_db.iter().map(|(name, _)| name.clone()).collect())
        .unwrap_or_default();
    let mut text = "| method |".to_owned();
    for name in &environments {
        let _ = write!(text, " {name}, dB |");
    }
    text += " OLATs, dB | ms a frame | training |\n|---|";
    text += &"---:|".repeat(environments.len() + 2);
    text += "---|\n";
    for same in shoot.methods.chunk_by(|a, b| a.method == b.method && a.minutes() == b.minutes()) {
        let found = |of: &dyn Fn(&Value) -> Option<f64>| {
            Figure::from_values(same.iter().filter_map(|one| of(&one.kept.result)))
        };
        let text_of =
            |figure: Option<Figure>, digits: usize| figure.map_or("–".to_owned(), |figure| figure.text(digits));
        let decibels = |of: &dyn Fn(&Value) -> Option<f64>| match found(of) {
            Some(figure) if figure.low >= evaluation::metrics::MAX_DECIBELS => "exact".to_owned(),
            figure => text_of(figure, 1),
        };
        let _ = write!(text, "| {} |", words(same[0].method));
        for name in &environments {
            let db = decibels(&|scores| scores["relit_psnr_db"][name].as_f64());
            let _ = write!(text, " {db} |");
        }
        let training = match same[0].minutes() {
            None => "none".to_owned(),
            Some(minutes) => {
                format!("{minutes:.1} min, {} steps", text_of(found(&|scores| scores["training_steps"].as_f64()), 0))
            }
        };
        let _ = writeln!(
            text,
            " {} | {} | {training} |",
            decibels(&|scores| scores["olat_psnr_db"].as_f64()),
            text_of(found(&|scores| scores["frame_ms"].as_f64()), 1)
        );
    }
    let minutes = |step: &Step| step.seeds.first().map_or(0.0, |m| m.rung.minutes);
    let as_long = |step: &&Step| {
        let mut methods = shoot.methods.iter();
        step.knob == Some(Knob::Minutes) && methods.any(|method| method.minutes() == Some(minutes(step)))
    };
    for step in steps.iter().filter(|step| step.knob.is_none() || as_long(step)) {
        let figure = |figure: Option<Figure>, digits| figure.map_or("–".to_owned(), |figure| figure.text(digits));
        text += "| **prediction** |";
        for name in &environments {
            let db = step.figure(|m| {
                let found = m.relit_psnr_db.iter().find(|(of, _)| of == name);
                found.map(|(_, db)| *db)
            });
            let _ = write!(text, " {} |", figure(db, 1));
        }
        let _ = writeln!(
            text,
            " {} | {} | {:.1} min, {} steps |",
            figure(step.figure(|m| m.olat_psnr_db), 1),
            figure(step.figure(|m| Some(m.predict_ms)), 1),
            minutes(step),
            figure(step.figure(|m| Some(m.steps as f64)), 0)
        );
    }
    text
}

/// Name of a method on the page.
pub fn words(method: &str) -> &str {
    match method {
        "nearest" => "nearest exemplar pose",
        "ratio" => "ratio image",
        "harmonics" => "ratio image of order-2 harmonics (Fyffe 2011)",
        "network" => "network alone",
        "transfer" => "reflectance transfer",
        "texler" => "patch-based training (Texler 2020)",
        "sun" => "portrait relighting (Sun 2019)",
        "truth-olats" => "true OLATs: the rig's limit",
        other => other,
    }
}
