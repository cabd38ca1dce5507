//! Benches whose tables are on the page. They are measured again for every build and machine.

use crate::kept::Kept;
use crate::{Clock, Options};
use base::Result;
use measuring::{cell, printed};
use serde_json::Value;
use std::fmt::Write as _;
use std::process::Command;

/// Names and arguments of the benches.
const BENCHES: [(&str, &[&str]); 2] = [("passes", &["--size", "1024"]), ("relight", &["--size", "1024"])];

const PASSES: &str = "## Time of each pass

Whole pictures with every effect; wall clock on the CPU, timestamps on a GPU ([device.md](device.md)). \"× copy\":
relative to one copy of the pass's field, pictures and matte.
";
const RELIGHT: &str = "## The sum of lamps

Beside NumPy and PyTorch on the same data (`-lamps`: lamp by lamp). The limit reads the field once.
";

/// A bench and its output.
pub struct Bench {
    pub name: &'static str,
    pub kept: Kept,
}

/// Runs the benches that this build has not run. Starts none when the time is up.
///
/// # Errors
/// When one fails.
pub fn measure(options: &Options, clock: &Clock) -> Result<()> {
    for (name, extra) in BENCHES {
        let path = options.work.join(format!("bench-{name}.json"));
        let is_current = Kept::read(&path).is_some_and(|kept| kept.build == options.build());
        if is_current || clock.is_over() {
            continue;
        }
        let mut command = Command::new("cargo");
        command.args(["bench", "--locked", "--profile", "dev", "--bench", name, "--", "--json"]);
        command.args(extra);
        println!("bench {name}");
        let text = printed(&mut command)?;
        // Replaces the output of an older build.
        let _ = std::fs::remove_file(&path);
        Kept::or(&path, options.build(), || Ok(text))?;
    }
    Ok(())
}

/// Output of the benches by this build on this machine; figures of other builds are not shown.
pub fn all(options: &Options) -> Vec<Bench> {
    let machine = serde_json::to_value(base::machine::Machine::this()).unwrap_or_default();
    let kept = BENCHES.iter().filter_map(|(name, _)| {
        let kept = Kept::read(&options.work.join(format!("bench-{name}.json")))?;
        let is_current = kept.build == options.build() && kept.result["machine"] == machine;
        is_current.then_some(Bench { name, kept })
    });
    kept.collect()
}

impl Bench {
    /// Section of the page.
    pub fn section(&self) -> String {
        let result = &self.kept.result;
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let machine = &result["machine"];
        let mut section = match self.name {
            "passes" => PASSES,
            _ => RELIGHT,
        }
        .to_owned();
        // Writing to a String cannot fail.
        let _ = writeln!(
            section,
            "\nBench `{}`: {}, {} threads, {}, Afterlight {}, build {}{}.\n",
            self.name,
            text(&machine["processor"]),
            result["threads"],
            text(&machine["system"]),
            text(&machine["version"]),
            self.kept.build,
            result["device"].as_str().map_or(String::new(), |device| format!("; {device}")),
        );
        section += &match self.name {
            "passes" => passes(result),
            _ => sums(result),
        };
        section
    }
}

fn number(value: &Value, digits: usize) -> String {
    cell(value.as_f64(), digits)
}

fn sums(result: &Value) -> String {
    let mut table = "| size | sum | ms | GB/s | times the limit |\n|---:|---|---:|---:|---:|\n".to_owned();
    for row in result["rows"].as_array().into_iter().flatten() {
        let _ = writeln!(
            table,
            "| {} | {} | {} | {} | {} |",
            row["size"],
            row["what"].as_str().unwrap_or_default(),
            number(&row["ms"], 2),
            number(&row["gigabytes_per_second"], 1),
            number(&row["times_the_limit"], 2)
        );
    }
    table
}

/// A row for each pass, columns for each device and size that ran.
fn passes(result: &Value) -> String {
    let sizes = result["sizes"].as_array().map_or(&[][..], Vec::as_slice);
    let columns: Vec<(String, &Value)> = [("CPU", "cpu"), ("GPU", "gpu")]
        .into_iter()
        .flat_map(|(label, key)| sizes.iter().map(move |size| (format!("{label} {}, ms", size["size"]), &size[key])))
        .filter(|(_, column)| column["passes"].as_array().is_some_and(|all| !all.is_empty()))
        .collect();
    let all = |column: &Value| column["passes"].as_array().cloned().unwrap_or_default();
    let mut table = "| pass |".to_owned();
    let mut copying = "| copying, GB/s |".to_owned();
    let mut names: Vec<Value> = Vec::new();
    for (label, column) in &columns {
        let _ = write!(table, " {label} | × copy |");
        let speed = column["copied_per_second"].as_f64().map(|bytes| bytes / 1e9);
        let _ = write!(copying, " {} | |", cell(speed, 1));
        for pass in all(column) {
            if !names.contains(&pass["name"]) {
                names.push(pass["name"].clone());
            }
        }
    }
    let _ = writeln!(table, "\n|---|{}\n{copying}", "---:|".repeat(2 * columns.len()));
    for name in names {
        let _ = write!(table, "| {} |", name.as_str().unwrap_or_default());
        for (_, column) in &columns {
            let pass = all(column).into_iter().find(|pass| pass["name"] == name);
            let _ = write!(table, " {} |", cells(&pass.unwrap_or_default()));
        }
        table += "\n";
    }
    table
}

/// Time, and its ratio to the limit.
fn cells(pass: &Value) -> String {
    let (ms, limit) = (&pass["times"]["median_ms"], &pass["copy_ms"]);
    let times = ms.as_f64().zip(limit.as_f64()).map(|(ms, limit)| ms / limit);
    format!("{} | {}", number(ms, 2), cell(times, 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_section_names_its_machine_and_has_every_row() {
        let machine = json!({"processor": "A, B", "threads": 2, "system": "linux", "version": "9.9"});
        let kept = |result| Kept { build: "0badcafe".to_owned(), result };
        let times = |ms: f64| json!({"median_ms": ms, "low_ms": ms, "high_ms": ms, "runs": 1});
        let passes = Bench {
            name: "passes",
            kept: kept(json!({"machine": machine, "threads": 2, "device": "no GPU", "sizes": [{
                "size": 512,
                "cpu": {"copied_per_second": 5e10, "passes": [
                    {"name": "glare", "times": times(2.0), "copy_ms": 0.5},
                    {"name": "sum, f32", "times": times(3.0), "copy_ms": null},
                ]},
                "gpu": {"copied_per_second": 1e10, "passes": [
                    {"name": "glare", "times": times(1.0), "copy_ms": 1.0},
                    {"name": "relight, f16", "times": null, "copy_ms": 1.0},
                ]},
            }]})),
        };
        let section = passes.section();
        for expected in [
            "A, B, 2 threads, linux, Afterlight 9.9, build 0badcafe; no GPU.",
            "| copying, GB/s | 50.0 | | 10.0 | |",
            "| glare | 2.00 | 4.00 | 1.00 | 1.00 |",
            "| sum, f32 | 3.00 | – | – | – |",
            "| relight, f16 | – | – | – | – |",
        ] {
            assert!(section.contains(expected), "{expected} is not in\n{section}");
        }
        let sums = Bench {
            name: "relight",
            kept: kept(json!({"machine": machine, "threads": 2, "rows": [
                {"size": 512, "what": "f32", "ms": 3.5, "gigabytes_per_second": 36.52, "times_the_limit": 1.04},
            ]})),
        };
        assert!(sums.section().contains("| 512 | f32 | 3.50 | 36.5 | 1.04 |"));
    }
}
