//! Sections about `confidence`: the benefit of the poses that it suggests, and a test of its expected errors.

use crate::page::builds;
use crate::poses::{Added, Reached};
use serde_json::Value;
use std::fmt::Write as _;

const POSES: &str = "\
Virtual stages at 64 × 64, three poses, 48 frames. Two frames become poses: those least like the poses, as `confidence`
names them, or random ones (three draws). Cells: PSNR of OLATs / mean of relit frames, dB, on truth frames, never named
nor drawn; added frames in brackets.
";
const ERRORS: &str = "\
The same shoots. `confidence` predicts each pose from the others and gives each part of a frame, 1/16 of the picture
wide, two bounds: the usual one, and one that holds with a chance of 3 in 4. Aims: 80 % of the parts on truth frames.
Last columns: parts within the usual bound, in quarters by predicted error.
";

/// Benefit of the poses that `confidence` suggests, against random ones.
pub fn section(added: &[Added]) -> String {
    let Some(first) = added.first() else { return String::new() };
    let builds = builds(added.iter().flat_map(|one| &one.builds).map(String::as_str));
    let mut text = format!(
        "\n## Suggested poses\n\n{POSES}\nOne seed; {} minutes of training with three poses, as many steps with more. {builds}\n\n\
         | shoot | three poses | named by `confidence` | drawn at random | named less drawn |\n|---|---:|---:|---:|---:|\n",
        first.minutes
    );
    let db = |reached: &Reached| format!("{:.2} / {:.2}", reached.olats, reached.relit);
    let like = |reached: &Reached| {
        let frames: Vec<String> = reached.like.iter().map(usize::to_string).collect();
        format!("{} ({})", db(reached), frames.join(", "))
    };
    let mean = |all: &[Reached], of: fn(&Reached) -> f64| all.iter().map(of).sum::<f64>() / all.len().max(1) as f64;
    let more = |one: &Added, of: fn(&Reached) -> f64| of(&one.chosen) - mean(&one.drawn, of);
    for one in added {
        let drawn: Vec<String> = one.drawn.iter().map(like).collect();
        let _ = writeln!(
            text,
            "| seed {} | {} | {} | {} | {:+.2} / {:+.2} |",
            one.seed,
            db(&one.before),
            like(&one.chosen),
            drawn.join("<br>"),
            more(one, |r| r.olats),
            more(one, |r| r.relit)
        );
    }
    let over = |of: fn(&Reached) -> f64| added.iter().map(|one| more(one, of)).sum::<f64>() / added.len() as f64;
    let _ = writeln!(
        text,
        "\nMean: named poses are worth {:+.2} dB more than drawn ones in OLATs and {:+.2} dB in relit frames.",
        over(|r| r.olats),
        over(|r| r.relit)
    );
    text
}

/// Test of the errors that `confidence` expected; empty without one.
pub fn errors(added: &[Added]) -> String {
    let judged: Vec<(&Added, &Value)> =
        (added.iter()).map(|one| (one, &one.judged)).filter(|(_, judged)| !judged.is_null()).collect();
    if judged.is_empty() {
        return String::new();
    }
    let mut text = format!(
        "\n## Coverage of the expected errors\n\n{ERRORS}\n| shoot | frames | usual | 3 in 4 | frames that hold 3 in 4 | better than \
         expected, dB | least predicted | | | most predicted |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    );
    let percent = |value: &Value| {
        let share = value.as_f64();
        share.map_or("–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
    };
    for (one, judged) in judged {
        let _ = write!(
            text,
            "| seed {} | {} | {} | {} | {} | {} |",
            one.seed,
            judged["frames"],
            percent(&judged["cells_within"][0]),
            percent(&judged["cells_within"][1]),
            percent(&judged["frames_within"]),
            judged["better_by_db"].as_f64().map_or("–".to_owned(), |db| format!("{db:+.1}")),
        );
        for quarter in judged["quarters"].as_array().into_iter().flatten() {
            let most = quarter["said"][1].as_f64().unwrap_or(f64::NAN);
            let _ = write!(text, " {} ≤ {:.1} % |", percent(&quarter["within"][0]), 100.0 * most);
        }
        text += "\n";
    }
    text
}
