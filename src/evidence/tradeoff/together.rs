//! Rungs that change several knobs, made from what each of them alone is worth.

use super::ladder::{BASE, Knob, Rung};
use super::measure::Measured;

/// A rung has to gain more than this to be taken into the best, in decibels: seeds differ by as much.
const GAIN_DB: f64 = 0.1;
/// A rung may lose less than this to be taken into the fast, in decibels …
const LOSS_DB: f64 = 0.3;
/// … if it takes at most this share of the base's time.
const FASTER: f64 = 0.95;

/// Combined rungs that would pay: of changes that gain, and of changes that are faster without losing much. Only a rung that
/// changes two knobs or more is new.
pub(super) fn together(measured: &[&Measured]) -> Vec<Rung> {
    let Some(base) = measured.iter().find(|m| m.rung.name == BASE) else {
        return Vec::new();
    };
    let of_knob = |knob: Knob| measured.iter().filter(move |m| m.rung.knob == Some(knob));
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
        let gaining = of_knob(knob).filter(|m| gain(m) > GAIN_DB);
        gaining.max_by(|a, b| gain(a).total_cmp(&gain(b)))
    });
    let is_cheap =
        |m: &&&Measured| gain(m) > -LOSS_DB && m.frame.median <= FASTER * base.frame.median;
    let fast = knobs.map(|knob| {
        let cheap = of_knob(knob).filter(is_cheap);
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
