//! Table of a ladder's rungs. SSIM, LPIPS, memory, disk and predicted costs are in the CSV beside it.

use crate::summary::Step;
use std::fmt::Write as _;

/// The rungs, fastest first.
pub fn table(steps: &[Step]) -> String {
    let mut order: Vec<&Step> = steps.iter().collect();
    order.sort_by(|a, b| a.place().0.total_cmp(&b.place().0));
    let mut text = "| rung | front | ms a frame | PSNR, dB | FLIP | OLATs, dB | flicker, % | steps |\n\
                    |---|---|---:|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for step in order {
        let cell = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            let figure = step.figure(of);
            figure.map_or("–".to_owned(), |figure| figure.text(digits))
        };
        let mean = |of: &dyn Fn(&tradeoff::Measured) -> Option<f64>, digits: usize| {
            measuring::cell(step.figure(of).map(|figure| figure.mean), digits)
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            step.name,
            if step.on_front { "yes" } else { "" },
            cell(&|m| Some(m.frame.median), 1),
            cell(&|m| Some(m.fidelity.psnr_db), 2),
            mean(&|m| Some(m.fidelity.flip), 3),
            mean(&|m| m.olat_psnr_db, 1),
            mean(&|m| m.flicker, 2),
            mean(&|m| Some(m.steps as f64), 0),
        );
    }
    text
}
