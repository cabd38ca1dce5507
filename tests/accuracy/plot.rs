//! The ladder as a plot: time for a frame against error, both on logarithmic axes.

use crate::summary::Step;
use base::{Error, Result};
use plotters::prelude::*;
use std::path::Path;
use tradeoff::Knob;

const SIZE: (u32, u32) = (760, 470);

/// Colours of knobs, distinct for people with red-green colour blindness too.
const COLORS: [RGBColor; 7] = [
    RGBColor(200, 100, 30),
    RGBColor(31, 111, 180),
    RGBColor(150, 130, 0),
    RGBColor(40, 140, 110),
    RGBColor(180, 70, 140),
    RGBColor(80, 90, 200),
    RGBColor(120, 120, 120),
];

fn color(knob: Option<Knob>) -> RGBColor {
    knob.map_or(BLACK, |knob| COLORS[knob as usize % COLORS.len()])
}

/// An error in per cent of white, of a PSNR.
fn percent(decibels: f64) -> f64 {
    100.0 * 10f64.powf(-decibels / 20.0)
}

/// Writes the plot: bars are from the lowest to the highest seed, and from the tenth to the ninetieth of a hundred frames.
///
/// # Errors
/// When there is nothing to draw, or the file cannot be written.
pub fn write(path: &Path, title: &str, steps: &[Step]) -> Result<()> {
    draw(path, title, steps).map_err(|e| {
        Error::codec(
            "write",
            path,
            e.to_string(),
            "Check that the folder can be written",
        )
    })
}

fn draw(
    path: &Path,
    title: &str,
    steps: &[Step],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let shown: Vec<&Step> = steps
        .iter()
        .filter(|step| step.knob != Some(Knob::Effects))
        .collect();
    let around = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        (0.85 * low)..(1.18 * high)
    };
    let x = around(&mut shown.iter().map(|step| step.place().0));
    let y = around(&mut shown.iter().map(|step| percent(step.place().1)));
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 15))
        .margin(10)
        .margin_right(120)
        .x_label_area_size(42)
        .y_label_area_size(56)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("time for a frame, ms")
        .y_desc("error, % of white")
        .x_label_formatter(&|ms| format!("{ms:.0}"))
        .y_label_formatter(&|error| format!("{error:.1}"))
        .light_line_style(RGBColor(238, 238, 238))
        .draw()?;
    let mut front: Vec<(f64, f64)> = (shown.iter().filter(|step| step.on_front))
        .map(|step| (step.place().0, percent(step.place().1)))
        .collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(front, BLACK.mix(0.5)))?;
    for step in &shown {
        let (ms, db) = step.place();
        let (at, color) = ((ms, percent(db)), color(step.knob));
        let faint = color.mix(0.4);
        if let Some(seeds) = step.figure(|m| Some(m.fidelity.psnr_db)) {
            let bar = vec![(ms, percent(seeds.high)), (ms, percent(seeds.low))];
            chart.draw_series([PathElement::new(bar, faint)])?;
        }
        let (low, high) = (
            step.figure(|m| Some(m.frame.low)),
            step.figure(|m| Some(m.frame.high)),
        );
        if let (Some(low), Some(high)) = (low, high) {
            let bar = vec![(low.mean, at.1), (high.mean, at.1)];
            chart.draw_series([PathElement::new(bar, faint)])?;
        }
        let radius = if step.on_front { 4 } else { 3 };
        chart.draw_series([Circle::new(at, radius, color.filled())])?;
        let style = ("sans-serif", 10).into_font().color(&color);
        chart.draw_series([Text::new(format!("  {}", step.name), at, style)])?;
    }
    area.present()?;
    Ok(())
}
