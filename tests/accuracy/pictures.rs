//! Page of the best method by region: a sheet of pictures, and the error in each region of the subject.

use crate::methods::{LIMIT, Scored};
use crate::page::{self, Shoot};
use crate::sheet;
use base::Result;
use base::files::write_beside;
use evaluation::metrics::MAX_DECIBELS;
use measuring::decibels;
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// File name of the page in the folder of plots and tables.
pub const NAME: &str = "pictures.md";

const HEAD: &str = "# Methods by region

Prediction, truth and methods of [accuracy.md](../accuracy.md) on the same frames, with the measure's exposure and
codes, over black. Per light: the frames in which the prediction is closest to the truth and farthest from it. OLATs: a
truth frame under the lamps with the prediction's lowest, lower-quartile and median PSNR. Below each: its difference
from the truth, times four, about grey. A border marks the best picture of a row.

Tables: PSNR by region of the subject, dB, over all truth frames; the region's share in brackets. *Edge*: the outermost
1/64 of the picture. *Highlights*: brighter than half of white at the measure's exposure. *Shadow*: a tenth as bright or
less. *Lit*: the rest. Bold: best, without the limit (true OLATs).
";

/// Smallest distance to the limit that is reported, in decibels.
const TELLING: f64 = 0.05;

/// Writes the page and its sheets into the folder, for shoots whose prediction was compared. Writes nothing if there
/// are none.
///
/// # Errors
/// When a picture is missing, or a file cannot be written.
pub fn write(folder: &Path, shoots: &[Shoot]) -> Result<()> {
    let mut text = HEAD.to_owned();
    let mut count = 0;
    for shoot in shoots {
        let Some(compared) = shoot.compared() else { continue };
        let name = format!("{}.jpg", measuring::file_name(&shoot.name));
        let olats = format!("{}-olats.jpg", measuring::file_name(&shoot.name));
        let place = shoot.elsewhere.as_deref().unwrap_or(folder);
        sheet::write(&place.join(&name), &compared, sheet::relit_rows)?;
        let has_olats = sheet::write(&place.join(&olats), &compared, sheet::olat_rows)?;
        let shown = match shoot.elsewhere {
            None if has_olats => {
                format!("![Truth, prediction and methods]({name})\n\n![True and predicted OLATs]({olats})")
            }
            None => format!("![Truth, prediction and methods]({name})"),
            Some(_) => format!(
                "Pictures are not published: `make accuracy` writes them into `{}` of its work folder.",
                measuring::file_name(&shoot.name)
            ),
        };
        text += &section(shoot, &compared, &shown);
        count += 1;
    }
    if count == 0 {
        return Ok(());
    }
    write_beside(&folder.join(NAME), |out| out.write_all(text.as_bytes()))
}

fn section(shoot: &Shoot, compared: &[&Scored], shown: &str) -> String {
    let mut text = format!("\n## {}\n\n", shoot.name);
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{}\n\n{shown}\n", learnt(compared));
    let cells = cells(compared);
    for sentence in sentences(compared, &cells) {
        let _ = writeln!(text, "{sentence}\n");
    }
    text += &table(compared, &cells);
    text
}

/// Training time and steps of the methods with training.
fn learnt(compared: &[&Scored]) -> String {
    let learning = compared.iter().filter_map(|of| {
        let scores = &of.kept.result;
        let minutes = scores["training_seconds"].as_f64()? / 60.0;
        let steps = scores["training_steps"].as_u64()?;
        Some(format!("{} {minutes:.1} min, {steps} steps", page::words(of.method)))
    });
    format!("Training: {}.", learning.collect::<Vec<_>>().join("; "))
}

/// A region in a light.
struct Cell {
    environment: String,
    region: String,
    /// Share of the subject's pixels.
    share: f64,
    /// Decibels of each method.
    reached: Vec<Option<f64>>,
}

impl Cell {
    /// The method closest to the truth; the rig's limit does not count.
    fn best(&self, compared: &[&Scored]) -> Option<usize> {
        let all = self.reached.iter().enumerate();
        let comparable = all.filter(|(number, _)| compared[*number].method != LIMIT);
        let known = comparable.filter_map(|(number, db)| Some((number, (*db)?)));
        let best = known.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(number, _)| number)
    }
}

/// Regions of the first method, in each light.
fn cells(compared: &[&Scored]) -> Vec<Cell> {
    let regions = |of: &Scored, environment: &str| -> Vec<Value> {
        let all = of.kept.result["relit_regions"][environment].as_array();
        all.cloned().unwrap_or_default()
    };
    let Some(first) = compared.first() else { return Vec::new() };
    let environments = first.kept.result["relit_regions"].as_object();
    let mut cells = Vec::new();
    for environment in environments.into_iter().flat_map(|all| all.keys()) {
        for region in regions(first, environment) {
            let name = region["region"].as_str().unwrap_or_default().to_owned();
            let reached = compared.iter().map(|of| {
                let all = regions(of, environment);
                let same = all.iter().find(|other| other["region"] == region["region"])?;
                same["psnr_db"].as_f64()
            });
            cells.push(Cell {
                environment: environment.clone(),
                share: region["share"].as_f64().unwrap_or_default(),
                reached: reached.collect(),
                region: name,
            });
        }
    }
    cells
}

/// Sentences about the number of regions that the prediction wins, and its largest distance from the limit.
fn sentences(compared: &[&Scored], cells: &[Cell]) -> Vec<String> {
    let won = cells.iter().filter(|cell| cell.best(compared) == Some(0));
    let mut found = vec![format!(
        "The prediction is closest to the truth in {} of {} regions and lights.",
        won.count(),
        cells.len()
    )];
    // The limit of other frames would be meaningless.
    let same = |of: &Scored| of.kept.result["frames"] == compared[0].kept.result["frames"];
    let limit = compared.iter().position(|of| of.method == LIMIT && same(of));
    let behind = limit.and_then(|limit| {
        let behind = cells.iter().filter_map(|cell| Some((cell.reached[limit]? - cell.reached[0]?, cell)));
        behind.max_by(|a, b| a.0.total_cmp(&b.0))
    });
    if let Some((db, cell)) = behind.filter(|(db, _)| *db > TELLING) {
        found.push(format!(
            "The prediction is farthest from the rig's limit in {} under {}: {db:.1} dB.",
            cell.region, cell.environment
        ));
    }
    found
}

fn table(compared: &[&Scored], cells: &[Cell]) -> String {
    let mut text = "| light | region |".to_owned();
    for of in compared {
        let _ = write!(text, " {} |", page::words(of.method));
    }
    text += "\n|---|---|";
    text += &"---:|".repeat(compared.len());
    text += "\n";
    for cell in cells {
        let _ = write!(text, "| {} | {} ({:.0} %) |", cell.environment, cell.region, 100.0 * cell.share);
        let best = cell.best(compared);
        for (number, db) in cell.reached.iter().enumerate() {
            let db = decibels(*db, MAX_DECIBELS);
            let _ = if best == Some(number) { write!(text, " **{db}** |") } else { write!(text, " {db} |") };
        }
        text += "\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept::Kept;
    use serde_json::json;

    #[test]
    fn who_wins_is_counted_region_by_region() {
        let method = |name: &'static str, lit: f64, edge: f64| {
            let regions = json!([
                {"region": "lit", "share": 0.9, "psnr_db": lit},
                {"region": "edge", "share": 0.1, "psnr_db": edge},
            ]);
            Scored {
                method: name,
                learnt: None,
                kept: Kept { build: String::new(), result: json!({"relit_regions": {"nave": regions}}) },
                pictures: std::path::PathBuf::new(),
            }
        };
        let all = [method("prediction", 31.0, 24.0), method("ratio", 28.0, 25.5), method("truth-olats", 36.0, 31.0)];
        let all: Vec<&Scored> = all.iter().collect();
        let cells = cells(&all);
        let sentences = sentences(&all, &cells).join(" ");
        assert_eq!(
            sentences,
            "The prediction is closest to the truth in 1 of 2 regions and lights. The prediction is farthest from the rig's limit in \
             edge under nave: 7.0 dB."
        );
        let table = table(&all, &cells);
        assert!(table.contains("| nave | lit (90 %) | **31.0** | 28.0 | 36.0 |"), "{table}");
        assert!(table.contains("| nave | edge (10 %) | 24.0 | **25.5** | 31.0 |"), "{table}");
    }
}
