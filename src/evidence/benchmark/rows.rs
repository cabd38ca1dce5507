//! Rows of a report, built from measured figures.

use super::measure::{Figure, Measure};
use super::names::{FIRST, PASSES, SELF_TEST, first_again, first_ever};
use super::report::{DeviceReport, Row};

impl DeviceReport {
    pub fn new(kind: &str, name: &str) -> Self {
        Self {
            kind: kind.to_owned(),
            name: name.to_owned(),
            self_test: None,
            copied_per_second: None,
            rows: Vec::new(),
        }
    }

    fn row(measure: &Measure, what: &str) -> Row {
        let (preset, size) = measure.shape();
        Row { what: what.to_owned(), network: preset.map(|preset| preset.name().to_owned()), size, ..Row::default() }
    }

    /// Adds a row or replaces the one of the same name; returns its index.
    fn put(&mut self, row: Row) -> usize {
        let same = |old: &Row| (&old.what, &old.network, old.size) == (&row.what, &row.network, row.size);
        let at = self.rows.iter().position(same).unwrap_or(self.rows.len());
        match self.rows.get_mut(at) {
            Some(old) => *old = row,
            None => self.rows.push(row),
        }
        at
    }

    /// Takes in a figure of a measure and returns the index of its row. `fresh`: the process found no cached kernels.
    pub fn found(&mut self, measure: &Measure, fresh: bool, figure: Figure) -> usize {
        if *measure == Measure::SelfTest {
            self.self_test.clone_from(&figure.note);
        }
        // Speed at the largest size copied.
        self.copied_per_second = figure.bytes_per_second.or(self.copied_per_second);
        let first = FIRST.iter().find(|(what, _)| *what == figure.what);
        let row = Row {
            first_ms: figure.first_ms,
            copy_ms: figure.copy_ms,
            peak_bytes: figure.peak_bytes,
            gpu_bytes: figure.gpu_bytes,
            ..Self::row(measure, &figure.what)
        };
        if let (Measure::FirstUse { .. }, Some(first)) = (measure, first) {
            return self.put(Row { what: first_again(first), ..row });
        }
        if let (true, Some(first)) = (fresh, first) {
            self.put(Row { what: first_ever(first), ..row.clone() });
        }
        let times = figure.times;
        let row = Row {
            median_ms: times.map(|times| times.median_ms),
            low_ms: times.map(|times| times.low_ms),
            high_ms: times.map(|times| times.high_ms),
            runs: times.map_or(0, |times| times.runs),
            ..row
        };
        self.put(row.with_goal())
    }

    /// Gives the rows of a measure without times their reason.
    pub fn leave_out(&mut self, measure: &Measure, predicted: Option<&[f64]>, why: &str) {
        for (i, what) in measure.rows().into_iter().enumerate() {
            let mut row = Self::row(measure, &what);
            let known =
                self.rows.iter().find(|old| (&old.what, &old.network, old.size) == (&row.what, &row.network, row.size));
            if let Some(known) = known {
                if known.median_ms.is_some() || matches!(measure, Measure::FirstUse { .. }) {
                    continue;
                }
                row = known.clone();
            }
            let timed = |old: &Row| old.copy_ms.is_some() && old.size == row.size;
            if what == PASSES && self.rows.iter().any(timed) {
                row.what = OTHER_PASSES.to_owned();
            }
            row.predicted_ms = predicted.and_then(|rows| rows.get(i).copied());
            row.left_out = Some(why.to_owned());
            self.put(row);
        }
    }

    /// A row as one line of text.
    pub fn sentence(&self, row: &Row) -> String {
        let kind = self.kind.to_uppercase();
        let name = row.name();
        if row.what == SELF_TEST {
            let verdict = self.self_test.as_deref().unwrap_or("no verdict");
            return format!("{kind}: {name}: {verdict}");
        }
        let first = match row.first_ms {
            Some(first) if row.median_ms.is_none() => {
                format!("the first run took {:.1} s", first / 1e3)
            }
            // A shorter first run is not worth reporting.
            Some(first) if first > 1e3 => {
                format!("{} ms; the first run took {:.1} s more", row.time(), first / 1e3)
            }
            _ => format!("{} ms", row.time()),
        };
        format!("{kind}: {name}: {first}")
    }
}

/// Placeholder for the passes after those that were timed.
const OTHER_PASSES: &str = "the passes after these";
