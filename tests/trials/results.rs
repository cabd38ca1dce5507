//! The table of results: one row for each shoot, as a CSV file.

use base::{Error, Result};
use imaging::file::write_beside;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fmt;
use std::io::Write;
use std::path::Path;

/// What one shoot was, and what its calibration found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Row {
    pub seed: u64,
    pub size: usize,
    pub lamps: usize,
    /// The interview's light and the camera's response in a word.
    pub light: String,
    pub response: String,
    pub ambient: f64,
    /// Share of the interview's light that no sum of the lamps can be.
    pub off_span: f64,
    pub exposure_change: f64,
    pub ball_exposure: f64,
    pub dust: f64,
    pub room: f64,
    pub sway: f64,
    pub skin: f64,
    /// Truth, result and its stated standard deviation.
    pub gamma1: f64,
    pub gamma2: f64,
    pub found1: f64,
    pub found2: f64,
    pub deviation1: f64,
    pub deviation2: f64,
    pub found_exposure: f64,
    /// Of ln exposure.
    pub exposure_deviation: f64,
    /// Stated probability that the exposure was changed.
    pub said_changed: f64,
    /// Difference of the interview's weights, summed over lamps and relative to their sum.
    pub weights_error: f64,
    /// Difference between the subject's picture under the found light and the true one, root mean square and relative,
    /// with true OLATs; 0 could only be reached by light that is a sum of the lamps.
    pub light_error: f64,
    /// Of the lamps' directions, in degrees, over lamps that the ball shows; the worst of those with a confidence above
    /// one half; and how many of these are off by more than five degrees.
    pub direction_median: f64,
    pub direction_worst: f64,
    pub misled: usize,
    /// Seconds for the shoot and for its calibration.
    pub shoot_seconds: f64,
    pub seconds: f64,
    /// Why there is no calibration; empty if there is one.
    pub refused: String,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if !self.refused.is_empty() {
            return write!(f, "seed {}: refused: {}", self.seed, self.refused);
        }
        write!(
            f,
            "seed {:3}: {:9} {:6}  γ {:.2} {:.2}, found {:.2} ± {:.2} {:.2} ± {:.2}; exposure {:.2}, found {:.2} ± {:.2}; \
             light off by {:.1} % ({:.1} % off the span); lamps {:.1}°; {:.0} + {:.0} s",
            self.seed,
            self.light,
            self.response,
            self.gamma1,
            self.gamma2,
            self.found1,
            self.deviation1,
            self.found2,
            self.deviation2,
            self.exposure_change,
            self.found_exposure,
            self.exposure_deviation,
            100.0 * self.light_error,
            100.0 * self.off_span,
            self.direction_median,
            self.shoot_seconds,
            self.seconds
        )
    }
}

/// All rows, in the order in which they were made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    pub rows: Vec<Row>,
}

impl Results {
    /// Reads a table; without one there are no results yet.
    ///
    /// # Errors
    /// When the file cannot be read or is no such table.
    pub fn read(path: &Path) -> Result<Self> {
        const REMEDY: &str = "Begin again with --fresh (make trials FRESH=1)";
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(e) => return Err(Error::io("read", path, e, REMEDY)),
        };
        let mut lines = text.lines();
        let columns: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let rows = lines.map(|line| {
            let value = |cell: &str| serde_json::from_str(cell).unwrap_or_else(|_| cell.into());
            let cells = columns.iter().zip(line.split(','));
            let row: Map<String, Value> = (cells.filter(|(_, cell)| !cell.is_empty()))
                .map(|(name, cell)| ((*name).to_owned(), value(cell)))
                .collect();
            serde_json::from_value(Value::Object(row))
                .map_err(|e| Error::codec("read", path, e, REMEDY))
        });
        Ok(Self {
            rows: rows.collect::<Result<_>>()?,
        })
    }

    /// Writes the table, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut text = String::new();
        for (i, row) in self.rows.iter().enumerate() {
            let Ok(Value::Object(cells)) = serde_json::to_value(row) else {
                return Err(Error::bug("a row of the trials' table is no object"));
            };
            if i == 0 {
                let names: Vec<&str> = cells.keys().map(String::as_str).collect();
                text += &(names.join(",") + "\n");
            }
            let cells: Vec<String> = cells.values().map(cell).collect();
            text += &(cells.join(",") + "\n");
        }
        write_beside(path, |out| out.write_all(text.as_bytes()))
    }

    /// Whether the trial of a seed at a size was made.
    pub fn has(&self, seed: u64, size: usize) -> bool {
        self.rows
            .iter()
            .any(|row| row.seed == seed && row.size == size)
    }
}

/// A value as a cell: numbers to six digits after the point, words without commas.
fn cell(value: &Value) -> String {
    match value {
        Value::String(text) => text.replace([',', '\n'], ";"),
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            format!("{:?}", (number * 1e6).round() / 1e6)
        }
        Value::Null => String::new(),
        other => other.to_string(),
    }
}
