//! Plot of the ladder: time per frame against error, both on logarithmic axes.

use crate::summary::Step;
use measuring::{Axis, Plot, Scale};
use tradeoff::Knob;

const SIZE: (f64, f64) = (760.0, 470.0);

/// Colours of knobs, distinct with red-green colour blindness too.
const COLORS: [&str; 7] = ["#c8641e", "#1f6fb4", "#968200", "#288c6e", "#b4468c", "#505ac8", "#787878"];

fn color(knob: Option<Knob>) -> &'static str {
    knob.map_or("#000", |knob| COLORS[knob as usize % COLORS.len()])
}

/// Error in per cent of white, from a PSNR.
fn percent(decibels: f64) -> f64 {
    100.0 * 10f64.powf(-decibels / 20.0)
}

/// Milliseconds per frame, and error in per cent of white.
fn place(step: &Step) -> (f64, f64) {
    let (ms, db) = step.place();
    (ms, percent(db))
}

/// The plot as SVG. Bars span the lowest to the highest seed, and the 10th to the 90th percentile of the frames.
pub fn svg(title: &str, steps: &[Step]) -> String {
    let mut shown: Vec<&Step> = steps.iter().filter(|step| step.knob != Some(Knob::Effects)).collect();
    let axis = |name, of: fn((f64, f64)) -> f64| {
        let values = shown.iter().map(|step| of(place(step)));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        Axis { name, from: 0.85 * low, to: 1.18 * high, scale: Scale::Logarithmic }
    };
    let (x, y) = (axis("time for a frame, ms", |at| at.0), axis("error, % of white", |at| at.1));
    let mut plot = Plot::new(title, SIZE, x, y);
    let mut front: Vec<(f64, f64)> = shown.iter().filter(|step| step.on_front).map(|step| place(step)).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    plot.line(front, "#888", false);
    for step in &shown {
        let ((ms, error), color) = (place(step), color(step.knob));
        if let Some(seeds) = step.figure(|m| Some(m.fidelity.psnr_db)) {
            plot.bar((ms, percent(seeds.high)), (ms, percent(seeds.low)), color);
        }
        let (low, high) = (step.figure(|m| Some(m.frame.low)), step.figure(|m| Some(m.frame.high)));
        if let (Some(low), Some(high)) = (low, high) {
            plot.bar((low.mean, error), (high.mean, error), color);
        }
        plot.point((ms, error), if step.on_front { 4 } else { 3 }, color);
    }
    // The most informative first: a point too close to others gets no label.
    shown.sort_by_key(|step| (!step.on_front, step.knob.is_some()));
    let named: Vec<_> = shown.iter().map(|step| (place(step), step.name, color(step.knob))).collect();
    plot.label(&named);
    plot.svg()
}
