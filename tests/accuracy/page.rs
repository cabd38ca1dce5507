//! The page: words that stay, and tables and plots of what was measured.

use crate::plot;
use crate::poses::{Added, Reached};
use crate::summary::{Figure, Step, steps};
use base::files::write_beside;
use base::{Error, Result};
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use tradeoff::{Knob, Ledger};

/// A shoot with a truth, and what was measured on it.
pub struct Shoot {
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    pub ladder: Ledger,
    /// Methods to compare the network with, and what `evaluate --json` says of each.
    pub methods: Vec<(&'static str, Value)>,
}

/// A bench, and the lines of its tables.
pub struct Bench {
    pub name: &'static str,
    pub rows: Vec<String>,
}

const HEAD: &str = include_str!("head.md");
const PASSES: &str = "## What each pass costs

The bench `passes` prints these rows. Each pass is timed in whole pictures with every effect, including the measurement that
decides whether it runs: by wall clock on the CPU, by timestamps on a GPU. The limit is the time in which the same device, in
the same run, copies the bytes that the pass must read and write at least once: its field, its pictures and its matte. A
column for a software GPU shows that the passes run there, not how fast a GPU is; [device.md](device.md) has those.
";
const POSES: &str = "Shoots of the virtual stage at 64 × 64 with three poses and 48 frames. `confidence` names frames that are least like the
poses; two of them are photographed as further poses, and beside that two frames drawn at random, three times. Cells are
the PSNR of the OLATs and the mean of the relit frames', in decibels, on the frames of the truth, which are neither named nor
drawn; in brackets are the frames.
";
const RELIGHT: &str = "## The sum of lamps

The bench `relight` prints these rows: the sum alone, beside NumPy and PyTorch on the same data where they are there
(`-lamps`: lamp by lamp). The limit reads the field once.
";

/// Writes the page to `path`, and its plots into the folder of the same name beside it.
///
/// # Errors
/// When a file cannot be written.
pub fn write(path: &Path, shoots: &[Shoot], added: &[Added], benches: &[Bench]) -> Result<()> {
    let folder = path.with_extension("");
    std::fs::create_dir_all(&folder)
        .map_err(|e| Error::io("write", &folder, e, "Check that the folder can be written"))?;
    let stem = folder
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut text = HEAD.to_owned();
    for shoot in shoots {
        let steps = steps(&shoot.ladder);
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let file: String = shoot.name.chars().map(plain).collect();
        plot::write(&folder.join(format!("{file}.svg")), &shoot.name, &steps)?;
        // Nobody else has the folder that the figures were measured in.
        let table = tradeoff::csv(&Ledger {
            compared_with: format!("truth of the {}", shoot.name),
            ..shoot.ladder.clone()
        });
        write_beside(&folder.join(format!("{file}.csv")), |out| {
            out.write_all(table.as_bytes())
        })?;
        text += &section(shoot, &steps, &format!("{stem}/{file}"));
    }
    if !added.is_empty() {
        text += &poses(added);
    }
    for bench in benches {
        text += "\n";
        text += match bench.name {
            "passes" => PASSES,
            _ => RELIGHT,
        };
        text += "\n";
        for row in &bench.rows {
            text += row;
            text += "\n";
        }
    }
    write_beside(path, |out| out.write_all(text.as_bytes()))
}

/// What a shoot showed; plot and table are beside the page, named `stem`.
fn section(shoot: &Shoot, steps: &[Step], stem: &str) -> String {
    let Shoot {
        name, size, ladder, ..
    } = shoot;
    let base = ladder.rungs.first();
    let minutes = base.map_or(0.0, |base| base.rung.minutes);
    let frames = shoot.methods.first().map_or(0, |(_, scores)| {
        scores["frames"].as_array().map_or(0, Vec::len)
    });
    let mut text = format!("\n## {name}\n\n");
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Working size {size}, {frames} frames with a truth, {} seeds, {:.1} minutes of training for the base. Measured on: {}. \
         {}.\n",
        ladder.settings.seeds,
        minutes,
        ladder.machine.words(),
        ladder.device
    );
    let left = ladder.left();
    if left > 0 {
        let _ = writeln!(
            text,
            "{left} of {} measurements are not made yet: most rungs have fewer seeds.\n",
            ladder.planned
        );
    }
    text += &methods(shoot, steps);
    let _ = writeln!(
        text,
        "\n![Time for a frame against error]({stem}.svg)\n\nRungs too close to others to be named there are in the table below; every seed of every rung, with its settings, is in [a file for other programs]({stem}.csv).\n"
    );
    text += &ladder_table(steps);
    for failure in &ladder.failures {
        let _ = writeln!(
            text,
            "\n- {} was left out: {}",
            failure.rung, failure.sentence
        );
    }
    text
}

/// Other methods beside the network after each length of training.
fn methods(shoot: &Shoot, steps: &[Step]) -> String {
    let environments: Vec<String> = shoot
        .ladder
        .rungs
        .first()
        .map(|base| {
            base.relit_psnr_db
                .iter()
                .map(|(name, _)| name.clone())
                .collect()
        })
        .unwrap_or_default();
    let mut text = "| method |".to_owned();
    for name in &environments {
        let _ = write!(text, " {name}, dB |");
    }
    text += " OLATs, dB | ms a frame | training |\n|---|";
    text += &"---:|".repeat(environments.len() + 2);
    text += "---|\n";
    let number = |value: &Value, digits: usize| match value.as_f64() {
        Some(db) if db >= evaluation::metrics::MAX_DECIBELS => "exact".to_owned(),
        Some(value) => format!("{value:.digits$}"),
        None => "–".to_owned(),
    };
    for (method, scores) in &shoot.methods {
        let _ = write!(text, "| {} |", words(method));
        for name in &environments {
            let _ = write!(text, " {} |", number(&scores["relit_psnr_db"][name], 1));
        }
        let (olats, ms) = (
            number(&scores["olat_psnr_db"], 1),
            number(&scores["frame_ms"], 1),
        );
        let learnt = |seconds: f64| {
            let steps = scores["training_steps"].as_u64().unwrap_or_default();
            format!("{:.1} min, {steps} steps", seconds / 60.0)
        };
        let seconds = scores["training_seconds"].as_f64();
        let training = seconds.map_or("none".to_owned(), learnt);
        let _ = writeln!(text, " {olats} | {ms} | {training} |");
    }
    let mut trained: Vec<&Step> = (steps.iter())
        .filter(|step| matches!(step.knob, None | Some(Knob::Minutes | Knob::Start)))
        .collect();
    let minutes = |step: &Step| step.seeds.first().map_or(0.0, |m| m.rung.minutes);
    trained.sort_by(|a, b| minutes(a).total_cmp(&minutes(b)));
    for step in trained {
        let figure = |figure: Option<Figure>, digits| {
            figure.map_or("–".to_owned(), |figure| figure.text(digits))
        };
        text += match step.knob {
            Some(Knob::Start) => "| **network**, from random weights |",
            _ => "| **network** |",
        };
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

/// What poses are worth that `confidence` names, beside others.
fn poses(added: &[Added]) -> String {
    let first = &added[0];
    let mut text = format!(
        "\n## Which poses to photograph next\n\n{POSES}\nEach network is trained for {} minutes with one seed.\n\n\
         | shoot | three poses | named by `confidence` | drawn at random | named less drawn |\n|---|---:|---:|---:|---:|\n",
        first.minutes
    );
    let db = |reached: &Reached| format!("{:.2} / {:.2}", reached.olats, reached.relit);
    let like = |reached: &Reached| {
        let frames: Vec<String> = reached.like.iter().map(usize::to_string).collect();
        format!("{} ({})", db(reached), frames.join(", "))
    };
    let mean = |all: &[Reached], of: fn(&Reached) -> f64| {
        all.iter().map(of).sum::<f64>() / all.len().max(1) as f64
    };
    let more = |one: &Added, of: fn(&Reached) -> f64| of(&one.chosen) - mean(&one.drawn, of);
    for one in added {
        let drawn: Vec<String> = one.drawn.iter().map(like).collect();
        let _ = writeln!(
            text,
            "| seed {} | {} | {} | {} | {:+.2} / {:+.2} |",
            one.seed,
            db(&one.before),
            like(&one.chosen),
            drawn.join("<br>"),
            more(one, |r| r.olats),
            more(one, |r| r.relit)
        );
    }
    let over = |of: fn(&Reached) -> f64| {
        added.iter().map(|one| more(one, of)).sum::<f64>() / added.len() as f64
    };
    let _ = writeln!(
        text,
        "\nOn average the named poses are worth {:+.2} dB more than drawn ones in OLATs and {:+.2} dB in relit frames.",
        over(|r| r.olats),
        over(|r| r.relit)
    );
    text
}

/// What a method is called on the page.
fn words(method: &str) -> &str {
    match method {
        "nearest" => "nearest exemplar pose",
        "ratio" => "ratio image",
        "harmonics" => "ratio image of order-2 harmonics (Fyffe 2011)",
        "texler" => "patch-based training (Texler 2020)",
        "sun" => "portrait relighting (Sun 2019)",
        "truth-olats" => "true OLATs: the rig's limit",
        other => other,
    }
}

fn ladder_table(steps: &[Step]) -> String {
    let mut order: Vec<&Step> = steps.iter().collect();
    order.sort_by(|a, b| a.place().0.total_cmp(&b.place().0));
    let has = |of: fn(&tradeoff::Measured) -> Option<f64>| {
        steps.iter().any(|step| step.figure(of).is_some())
    };
    let has_lpips = has(|m| m.fidelity.lpips);
    let mut text = "| rung | front | ms a frame | predicted | PSNR, dB | SSIM | FLIP |".to_owned();
    if has_lpips {
        text += " LPIPS |";
    }
    text += " OLATs, dB | flicker, % | memory, MB | disk, MB | training, min |\n|---|---|";
    text += &"---:|".repeat(10 + usize::from(has_lpips));
    text += "\n";
    for step in order {
        let cell = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            let figure = step.figure(of);
            figure.map_or("–".to_owned(), |figure| figure.text(digits))
        };
        let mean = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            let figure = step.figure(of);
            figure.map_or("–".to_owned(), |figure| {
                format!("{:.digits$}", figure.mean)
            })
        };
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            step.name,
            if step.on_front { "yes" } else { "" },
            cell(&|m| Some(m.frame.median), 1),
            mean(&|m| m.predicted.map(|cost| cost.frame_ms), 1),
            cell(&|m| Some(m.fidelity.psnr_db), 2),
            mean(&|m| Some(m.fidelity.ssim), 3),
            mean(&|m| Some(m.fidelity.flip), 3),
        );
        if has_lpips {
            let _ = write!(text, " {} |", mean(&|m| m.fidelity.lpips, 3));
        }
        let _ = writeln!(
            text,
            " {} | {} | {} | {} | {} |",
            mean(&|m| m.olat_psnr_db, 1),
            mean(&|m| m.flicker, 2),
            mean(&|m| Some(m.cost.memory_bytes as f64 / 1e6), 1),
            mean(&|m| Some(m.cost.disk_bytes as f64 / 1e6), 1),
            mean(&|m| Some(m.training_seconds / 60.0), 1),
        );
    }
    text
}
