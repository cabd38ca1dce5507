//! Rungs that combine several knobs, chosen by the gain of each alone.

use super::ladder::{BASE, Knob, Rung};
use super::measure::Measured;

/// Least gain in decibels for a change to join the best combination: seeds differ by as much.
const GAIN_DB: f64 = 0.1;
/// Largest loss in decibels for a change to join the fast combination …
const LOSS_DB: f64 = 0.3;
/// … if it takes at most this share of the base's time.
const FASTER: f64 = 0.95;

/// Promising combinations: of changes that gain, and of changes that are faster without losing much. Only combinations
/// of at least two knobs are new.
pub(super) fn together(measured: &[&Measured]) -> Vec<Rung> {
    let Some(base) = measured.iter().find(|m| m.rung.name == BASE) else { return Vec::new() };
    let knob_rungs = |knob: Knob| measured.iter().filter(move |m| m.rung.knob == Some(knob));
    let knobs = [
        Knob::Size,
        Knob::Width,
        Knob::Depth,
        Knob::LampsPerStep,
        Knob::Features,
        Knob::Field,
        Knob::Weights,
        Knob::Environment,
    ];
    let gain = |m: &Measured| m.fidelity.psnr_db - base.fidelity.psnr_db;
    let best = knobs.map(|knob| {
        let gaining = knob_rungs(knob).filter(|m| gain(m) > GAIN_DB);
        gaining.max_by(|a, b| gain(a).total_cmp(&gain(b)))
    });
    let is_cheap = |m: &&&Measured| gain(m) > -LOSS_DB && m.frame.median <= FASTER * base.frame.median;
    let fast = knobs.map(|knob| {
        let cheap = knob_rungs(knob).filter(is_cheap);
        cheap.min_by(|a, b| a.frame.median.total_cmp(&b.frame.median))
    });
    let mut made = Vec::new();
    for (name, chosen) in [("together=best", best), ("together=fast", fast)] {
        let chosen: Vec<_> = chosen.into_iter().flatten().collect();
        if chosen.len() < 2 {
            continue;
        }
        let all = chosen.iter().fold(base.rung.clone(), |rung, m| rung.and(&m.rung, &base.rung));
        let mut rung = Rung { name: name.to_owned(), knob: Some(Knob::Together), ..all };
        if rung.network != base.rung.network {
            rung.network.name = name.to_owned();
        }
        made.push(rung);
    }
    made
}
