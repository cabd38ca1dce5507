//! Rungs that are worth their time, and the choice among them.

use super::measure::Measured;

/// True for each rung on the Pareto front: no other rung is both faster and closer to the truth, or equal in one and
/// better in the other. Rungs with effects are left out, since they show another picture.
pub fn front(rungs: &[Measured]) -> Vec<bool> {
    let place = |measured: &Measured| {
        let is_comparable = measured.changes_db.is_none();
        is_comparable.then(|| (measured.frame.median, measured.error()))
    };
    let all: Vec<Option<(f64, f64)>> = rungs.iter().map(place).collect();
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let on =
        |mine: &Option<(f64, f64)>| mine.is_some_and(|mine| !all.iter().flatten().any(|&other| beats(other, mine)));
    all.iter().map(on).collect()
}

/// Requirement for a rung.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pick {
    /// The most accurate one within this many milliseconds a frame.
    Within(f64),
    /// The fastest with at least this PSNR in decibels.
    AtLeast(f64),
}

/// The rung that meets a requirement; None if no rung does.
pub fn pick(rungs: &[Measured], pick: Pick) -> Option<usize> {
    let comparable = (0..rungs.len()).filter(|&i| rungs[i].changes_db.is_none());
    match pick {
        Pick::Within(ms) => comparable
            .filter(|&i| rungs[i].frame.median <= ms)
            .min_by(|&a, &b| rungs[a].error().total_cmp(&rungs[b].error())),
        Pick::AtLeast(db) => comparable
            .filter(|&i| rungs[i].fidelity.psnr_db >= db)
            .min_by(|&a, &b| rungs[a].frame.median.total_cmp(&rungs[b].frame.median)),
    }
}
