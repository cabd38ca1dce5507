//! Findings of a check: faults and remarks.

use serde::Serialize;
use std::collections::BTreeSet;

/// Most spans of frame numbers that a message names.
const NAMED: usize = 12;

/// Fault of a shot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// Kind, such as `missing` or `time_code`.
    pub kind: String,
    /// Frame numbers, such as `3, 7-9`, or `-2 to 3` below 0.
    pub frames: String,
    pub sentence: String,
}

/// Point that was not checked, or that may be intended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remark {
    pub kind: String,
    pub sentence: String,
}

/// Faults of a shot, and remarks on points that were not checked or may be intended.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
}

impl Findings {
    pub fn fault(&mut self, kind: &'static str, frames: impl IntoIterator<Item = i64>, sentence: String) {
        let frames: BTreeSet<i64> = frames.into_iter().collect();
        self.faults.push(Fault { kind: kind.to_owned(), frames: spans(&frames), sentence });
    }

    pub fn remark(&mut self, kind: &'static str, sentence: impl Into<String>) {
        self.remarks.push(Remark { kind: kind.to_owned(), sentence: sentence.into() });
    }
}

/// Frame numbers `from` to `to`: `7-9`, or `-2 to 3` below 0.
pub(super) fn span(from: i64, to: i64) -> String {
    match from {
        _ if from == to => from.to_string(),
        ..0 => format!("{from} to {to}"),
        _ => format!("{from}-{to}"),
    }
}

/// Frame numbers as spans: `3, 7-9`.
pub(super) fn spans(numbers: &BTreeSet<i64>) -> String {
    let mut spans: Vec<(i64, i64)> = Vec::new();
    for &number in numbers {
        match spans.last_mut() {
            Some((_, to)) if *to + 1 == number => *to = number,
            _ => spans.push((number, number)),
        }
    }
    let spans: Vec<String> = spans.into_iter().map(|(from, to)| span(from, to)).collect();
    joined(&spans)
}

/// Spans in one text.
pub(super) fn joined(spans: &[String]) -> String {
    let named = spans[..spans.len().min(NAMED)].join(", ");
    match spans.len().checked_sub(NAMED) {
        Some(more) if more > 0 => format!("{named} and {more} more"),
        _ => named,
    }
}
