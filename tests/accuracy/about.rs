//! Section about the run: what was measured, and what is missing.

use crate::page::{Page, builds, of_shoot};
use crate::summary::{Step, steps};
use serde_json::Value;
use std::fmt::Write as _;
use tradeoff::Ledger;

/// Tolerated ratio between steps of networks that should have made the same number: epochs are whole.
const SAME: f64 = 1.03;

/// Facts about the measuring runs.
pub struct About {
    /// Record of each run, as made by [`crate::Clock::record`].
    pub runs: Vec<Value>,
    /// Build that writes the page.
    pub build: String,
    /// Requested number of seeds.
    pub seeds: u64,
    /// Sections left out because this build has not measured them.
    pub left_out: Vec<String>,
}

/// The section.
pub fn section(page: &Page) -> String {
    let about = &page.about;
    let mut text = "## This run\n\n".to_owned();
    text += &runs(&about.runs);
    let of_added = page.added.iter().flat_map(|one| &one.builds).map(String::as_str);
    let of_benches = page.benches.iter().map(|bench| bench.kept.build.as_str());
    let all = page.shoots.iter().flat_map(of_shoot).chain(of_added).chain(of_benches);
    // Writing to a String cannot fail.
    let _ = writeln!(text, " {} Written by build {}.\n", builds(all), about.build);
    for shoot in &page.shoots {
        let _ = writeln!(text, "- **{}**: {} {}", shoot.name, left(&shoot.ladder, about.seeds), trained(&shoot.ladder));
    }
    if !about.left_out.is_empty() {
        let _ = writeln!(text, "- Not measured yet and left out: {}.", about.left_out.join("; "));
    }
    text + "\n"
}

/// Measuring time, and the machine's other work meanwhile.
fn runs(runs: &[Value]) -> String {
    let minutes: f64 = runs.iter().filter_map(|run| run["minutes"].as_f64()).sum();
    let mut text = match runs.len() {
        0 => {
            return "Measured in runs that were stopped; their duration is unknown.".to_owned();
        }
        1 => format!("Measured in one run of {minutes:.0} minutes."),
        count => format!("Measured in {count} runs, {minutes:.0} minutes in total."),
    };
    let others: Vec<f64> = runs.iter().filter_map(|run| run["others"].as_f64()).collect();
    let least = others.iter().copied().fold(f64::INFINITY, f64::min);
    let most = others.iter().copied().fold(0.0, f64::max);
    if !others.is_empty() {
        let percent = |share: f64| format!("{:.0}", 100.0 * share);
        let range = match (percent(least), percent(most)) {
            (least, most) if least == most => most,
            (least, most) => format!("{least} to {most}"),
        };
        let _ = write!(text, " Other work took {range} % of the processor.");
    }
    text
}

/// Rungs with all seeds, rungs with fewer, and measurements still to be made.
fn left(ladder: &Ledger, seeds: u64) -> String {
    let steps = steps(ladder);
    let count = |step: &Step| step.seeds.len() as u64;
    let fewer: Vec<&Step> = steps.iter().filter(|step| count(step) < seeds).collect();
    let mut text = match ladder.left() {
        0 => "all planned measurements complete.".to_owned(),
        left => format!("{left} of {} planned measurements missing.", ladder.planned),
    };
    if fewer.is_empty() {
        let plural = if seeds == 1 { "" } else { "s" };
        let _ = write!(text, " Every measured rung has {seeds} seed{plural}.");
        return text;
    }
    let whole: Vec<&str> = (steps.iter()).filter(|step| count(step) >= seeds).map(|step| step.name).collect();
    let _ = match whole.len() {
        0 => write!(text, " No rung has {seeds} seeds yet:"),
        _ => write!(text, " {seeds} seeds: {}; others:", whole.join(", ")),
    };
    let least = count(fewer[0]);
    if fewer.iter().all(|step| count(step) == least) {
        return format!("{text} {least}.");
    }
    let fewer = fewer.iter().map(|step| format!(" {} ({})", step.name, count(step)));
    text + &fewer.collect::<Vec<_>>().join(",") + "."
}

/// Evenness of the networks' training.
fn trained(ladder: &Ledger) -> String {
    let unevenness = unevenness(ladder);
    let by_steps = match ladder.base_step_ms {
        Some(ms) => {
            format!("Training by steps, {ms:.1} ms each for the base on a quiet machine.")
        }
        None => "Training by the clock, so that other work cost steps.".to_owned(),
    };
    match unevenness {
        Some(times) if times > SAME => format!(
            "{by_steps} Networks of one kind and length made up to {times:.1} times as many steps as others: small \
             differences are not significant."
        ),
        _ => by_steps,
    }
}

/// Ratio between the most and the fewest steps of one rung's networks with different seeds; None without two seeds.
fn unevenness(ladder: &Ledger) -> Option<f64> {
    let several = steps(ladder).into_iter().filter(|step| step.seeds.len() > 1);
    let ratios = several.filter_map(|step| {
        let steps = step.figure(|measured| Some(measured.steps as f64))?;
        Some(steps.high / steps.low.max(1.0))
    });
    ratios.reduce(f64::max)
}
