//! Summary and table of a measurement.

use super::ledger::Failure;
use super::measure::Measured;
use serde::Serialize;
use std::path::PathBuf;

/// Results of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct TradeoffReport {
    /// Path of the CSV table.
    pub table: PathBuf,
    pub compared_with: String,
    pub rungs: Vec<Measured>,
    /// True for each rung on the Pareto front.
    pub on_front: Vec<bool>,
    pub failures: Vec<Failure>,
}

impl TradeoffReport {
    /// Table of the rungs and summary.
    pub fn sentence(&self) -> String {
        let mut text = format!("Compared with {}:\n", self.compared_with);
        text += "  setting                     ms a frame      PSNR, dB   FLIP   trained  front\n";
        let mut order: Vec<usize> = (0..self.rungs.len()).collect();
        order.sort_by(|&a, &b| {
            let ms = |i: usize| self.rungs[i].frame.median;
            ms(a).total_cmp(&ms(b))
        });
        for i in order {
            let m = &self.rungs[i];
            text += &format!(
                "  {:24} {:7.1} ({:.1} to {:.1})   {:6.2}   {:.3}   {:5.1} min  {}\n",
                format!("{}{}", m.rung.name, seed_words(&self.rungs, m)),
                m.frame.median,
                m.frame.low,
                m.frame.high,
                m.fidelity.psnr_db,
                m.fidelity.flip,
                m.training_seconds / 60.0,
                if self.on_front[i] { "*" } else { "" }
            );
        }
        for failure in &self.failures {
            text += &format!("  {} was left out: {}\n", failure.rung, failure.sentence);
        }
        text += &format!("* no other setting is both faster and closer to the truth. Table: {}", self.table.display());
        text
    }
}

/// Seed of a rung, if there is more than one.
fn seed_words(all: &[Measured], measured: &Measured) -> String {
    if all.iter().any(|m| m.seed != measured.seed) { format!(" (seed {})", measured.seed) } else { String::new() }
}
