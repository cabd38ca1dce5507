//! Tables as CSV files: one row per record, with field names as the header.

use base::files::write_beside;
use base::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::io::Write;
use std::path::Path;

/// Reads a table; empty without a file.
///
/// # Errors
/// When the file cannot be read, or is not such a table.
pub fn read<R: DeserializeOwned>(path: &Path) -> Result<Vec<R>> {
    const REMEDY: &str = "Begin again with --fresh (make trials FRESH=1)";
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(vec![]),
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
        serde_json::from_value(Value::Object(row)).map_err(|e| Error::codec("read", path, e, REMEDY))
    });
    rows.collect()
}

/// Writes a table atomically.
///
/// # Errors
/// When the file cannot be written.
pub fn write<R: Serialize>(path: &Path, rows: &[R]) -> Result<()> {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let Ok(Value::Object(cells)) = serde_json::to_value(row) else {
            return Err(Error::bug("a row of a table is not an object"));
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

/// A value as a cell: numbers to six decimals, words without commas.
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
