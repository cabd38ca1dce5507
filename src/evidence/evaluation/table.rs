//! Scores as a Markdown table, for `docs/accuracy.md`.

use super::accuracy::Scores;
use super::metrics::MAX_DECIBELS;
use std::collections::BTreeSet;

/// One line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// Name of the measured method.
    pub name: &'a str,
    /// Cost of the method in words, such as `18 min of training`. May be empty.
    pub cost: &'a str,
    pub scores: &'a Scores,
}

/// Table with a column per environment, one for the OLATs and one for the cost.
pub fn markdown(rows: &[Row]) -> String {
    let environments: BTreeSet<&String> = rows.iter().flat_map(|r| r.scores.relit_psnr_db.keys()).collect();
    let decibels = |db: Option<&f64>| match db {
        None => "–".to_owned(),
        Some(&db) if db >= MAX_DECIBELS => "exact".to_owned(),
        Some(db) => format!("{db:.1}"),
    };
    let mut table = String::from("| method |");
    environments.iter().for_each(|name| table += &format!(" {name}, dB |"));
    table += " OLATs, dB | frames | ms a frame | cost |\n|---|";
    table += &"---:|".repeat(environments.len() + 3);
    table += "---|\n";
    for row in rows {
        table += &format!("| {} |", row.name);
        for name in &environments {
            table += &format!(" {} |", decibels(row.scores.relit_psnr_db.get(*name)));
        }
        let olats = decibels(row.scores.olat_psnr_db.as_ref());
        let ms = row.scores.frame_ms.map_or("–".to_owned(), |ms| format!("{ms:.1}"));
        table += &format!(" {olats} | {} | {ms} | {} |\n", row.scores.frames.len(), row.cost);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::Method;
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn every_environment_has_a_column_and_gaps_are_marked() {
        let scores = |name: &str, olat_psnr_db| Scores {
            method: Method::Ratio,
            at: footage::PictureSize::Square,
            frames: vec![5, 14],
            relit_psnr_db: BTreeMap::from([(name.to_owned(), 24.25)]),
            relit_psnr_by_frame_db: BTreeMap::new(),
            relit_regions: BTreeMap::new(),
            olat_psnr_db,
            olat_psnr_by_frame_db: BTreeMap::new(),
            olat_psnr_by_lamp_db: BTreeMap::new(),
            olat_shadow_edges: None,
            frame_ms: Some(12.34),
        };
        let (a, b) = (scores("grace", Some(MAX_DECIBELS)), scores("pisa", None));
        let table = markdown(&[
            Row { name: "ratio", cost: "", scores: &a },
            Row { name: "network", cost: "18 min", scores: &b },
        ]);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0], "| method | grace, dB | pisa, dB | OLATs, dB | frames | ms a frame | cost |");
        assert_eq!(lines[1], "|---|---:|---:|---:|---:|---:|---|");
        assert_eq!(lines[2], "| ratio | 24.2 | – | exact | 2 | 12.3 |  |");
        assert_eq!(lines[3], "| network | – | 24.2 | – | 2 | 12.3 | 18 min |");
    }
}
