//! The rungs that are worth their time, and the one that a person wants.

use super::measure::Measured;

/// For each rung, true if it is on the Pareto front: no other is both faster and nearer to the truth, or as good in one and
/// better in the other. Rungs with effects are left out, since they show another picture.
pub fn front(rungs: &[Measured]) -> Vec<bool> {
    let place = |measured: &Measured| {
        let is_comparable = measured.changes_db.is_none();
        is_comparable.then(|| (measured.frame.median, measured.error()))
    };
    let all: Vec<Option<(f64, f64)>> = rungs.iter().map(place).collect();
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let on = |mine: &Option<(f64, f64)>| {
        mine.is_some_and(|mine| !all.iter().flatten().any(|&other| beats(other, mine)))
    };
    all.iter().map(on).collect()
}

/// A person's demand on a rung.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pick {
    /// The nearest to the truth in at most so many milliseconds a frame.
    Within(f64),
    /// The fastest with at least this PSNR in decibels.
    AtLeast(f64),
}

/// The rung that does what is asked; None if none does.
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
