//! Rungs with several seeds, combined.

use tradeoff::{Knob, Ledger, Measured};

/// A figure over several seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

impl Figure {
    /// None without values.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        let count = values.len();
        (count > 0).then(|| Self {
            mean: values.iter().sum::<f64>() / count as f64,
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }

    /// The mean, with the lowest and highest in brackets if they differ.
    pub fn text(self, digits: usize) -> String {
        let (low, high) = (format!("{:.digits$}", self.low), format!("{:.digits$}", self.high));
        if low == high {
            return format!("{:.digits$}", self.mean);
        }
        format!("{:.digits$} ({low} to {high})", self.mean)
    }
}

/// A rung over its seeds.
pub struct Step<'a> {
    pub name: &'a str,
    pub knob: Option<Knob>,
    pub seeds: Vec<&'a Measured>,
    /// True if no other rung is both faster and closer to the truth, by the means.
    pub on_front: bool,
}

impl Step<'_> {
    /// A figure of the rung over its seeds; None if unknown.
    pub fn figure(&self, of: impl Fn(&Measured) -> Option<f64>) -> Option<Figure> {
        Figure::from_values(self.seeds.iter().filter_map(|measured| of(measured)))
    }

    /// Milliseconds per frame, and decibels.
    pub fn place(&self) -> (f64, f64) {
        let mean = |of: fn(&Measured) -> f64| {
            let figure = self.figure(|m| Some(of(m)));
            figure.map_or(f64::NAN, |figure| figure.mean)
        };
        (mean(|m| m.frame.median), mean(|m| m.fidelity.psnr_db))
    }

    fn has_effects(&self) -> bool {
        self.seeds.iter().any(|measured| measured.changes_db.is_some())
    }
}

/// The ladder's rungs, each over its seeds, in measuring order.
pub fn steps(ladder: &Ledger) -> Vec<Step<'_>> {
    let mut steps: Vec<Step> = Vec::new();
    for measured in &ladder.rungs {
        let name = measured.rung.name.as_str();
        match steps.iter_mut().find(|step| step.name == name) {
            Some(step) => step.seeds.push(measured),
            None => steps.push(Step { name, knob: measured.rung.knob, seeds: vec![measured], on_front: false }),
        }
    }
    let places: Vec<Option<(f64, f64)>> =
        steps.iter().map(|step| (!step.has_effects()).then(|| step.place())).collect();
    for (step, mine) in steps.iter_mut().zip(&places) {
        let beats =
            |other: &(f64, f64)| mine.is_some_and(|mine| other.0 <= mine.0 && other.1 >= mine.1 && *other != mine);
        step.on_front = mine.is_some() && !places.iter().flatten().any(beats);
    }
    steps
}
