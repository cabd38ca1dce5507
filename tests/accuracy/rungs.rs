//! Table of a ladder's rungs.

use crate::summary::Step;
use std::fmt::Write as _;

/// The rungs, fastest first.
pub fn table(steps: &[Step]) -> String {
    let mut order: Vec<&Step> = steps.iter().collect();
    order.sort_by(|a, b| a.place().0.total_cmp(&b.place().0));
    let has = |of: fn(&tradeoff::Measured) -> Option<f64>| {
        steps.iter().any(|step| step.figure(of).is_some())
    };
    let has_lpips = has(|m| m.fidelity.lpips);
    let mut text = "| rung | front | ms a frame | predicted | PSNR, dB | SSIM | FLIP |".to_owned();
    if has_lpips {
        text += " LPIPS |";
    }
    text += " OLATs, dB | flicker, % | memory, MB | disk, MB | training, min | steps |\n|---|---|";
    text += &"---:|".repeat(11 + usize::from(has_lpips));
    text += "\n";
    for step in order {
        let cell = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            let figure = step.figure(of);
            figure.map_or("–".to_owned(), |figure| figure.text(digits))
        };
        let mean = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            measuring::cell(step.figure(of).map(|figure| figure.mean), digits)
        };
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            step.name,
            if step.on_front { "yes" } else { "" },
            cell(&|m| Some(m.frame.median), 1),
            mean(&|m| m.predicted.map(|cost| cost.frame_ms), 1),
            cell(&|m| Some(m.fidelity.psnr_db), 2),
            mean(&|m| Some(m.fidelity.ssim), 3),
            mean(&|m| Some(m.fidelity.flip), 3),
        );
        if has_lpips {
            let _ = write!(text, " {} |", mean(&|m| m.fidelity.lpips, 3));
        }
        let _ = writeln!(
            text,
            " {} | {} | {} | {} | {} | {} |",
            mean(&|m| m.olat_psnr_db, 1),
            mean(&|m| m.flicker, 2),
            mean(&|m| Some(m.cost.memory_bytes as f64 / 1e6), 1),
            mean(&|m| Some(m.cost.disk_bytes as f64 / 1e6), 1),
            mean(&|m| Some(m.rung.minutes), 1),
            mean(&|m| Some(m.steps as f64), 0),
        );
    }
    text
}
