//! Plot of the ladder: time per frame against error, both on logarithmic axes.

use crate::summary::Step;
use base::{Error, Result};
use plotters::coord::combinators::WithKeyPoints;
use plotters::prelude::*;
use std::path::Path;
use tradeoff::Knob;

const SIZE: (u32, u32) = (760, 470);

/// Colours of knobs, distinct with red-green colour blindness too.
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

/// A logarithmic axis with ticks at round numbers, also within a decade.
fn logarithmic(range: std::ops::Range<f64>) -> WithKeyPoints<LogCoord<f64>> {
    const ROUND: [f64; 11] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let ticks = decades.flat_map(|decade| ROUND.map(|round| round * 10f64.powi(decade)));
    let ticks = ticks.filter(|tick| range.contains(tick)).collect();
    range.log_scale().with_key_points(ticks)
}

/// A box in the plot, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Area {
    left: i32,
    top: i32,
    right: i32,
    bottom: i32,
}

impl Area {
    /// Box of a point's marker.
    fn around((x, y): (i32, i32)) -> Self {
        Self { left: x - 4, top: y - 4, right: x + 4, bottom: y + 4 }
    }

    /// Candidate positions of a point's label: right, left, above and below.
    fn beside((x, y): (i32, i32), name: &str) -> [Self; 4] {
        let width = 6 * name.len() as i32;
        [(6, -5), (-6 - width, -5), (-width / 2, -16), (-width / 2, 6)].map(|(by_x, by_y)| Self {
            left: x + by_x,
            top: y + by_y,
            right: x + by_x + width,
            bottom: y + by_y + 10,
        })
    }

    fn meets(&self, other: &Self) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    fn holds(&self, other: &Self) -> bool {
        other.left >= self.left
            && other.right <= self.right
            && other.top >= self.top
            && other.bottom <= self.bottom
    }
}

/// Error in per cent of white, from a PSNR.
fn percent(decibels: f64) -> f64 {
    100.0 * 10f64.powf(-decibels / 20.0)
}

/// Writes the plot. Bars span the lowest to the highest seed, and the 10th to the 90th percentile of the frames.
///
/// # Errors
/// When there is nothing to plot, or the file cannot be written.
pub fn write(path: &Path, title: &str, steps: &[Step]) -> Result<()> {
    draw(path, title, steps).map_err(|e| {
        Error::codec("write", path, e.to_string(), "Check that the folder can be written")
    })
}

fn draw(
    path: &Path,
    title: &str,
    steps: &[Step],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let shown: Vec<&Step> = steps.iter().filter(|step| step.knob != Some(Knob::Effects)).collect();
    let around = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        (0.85 * low)..(1.18 * high)
    };
    let x = around(&mut shown.iter().map(|step| step.place().0));
    let y = around(&mut shown.iter().map(|step| percent(step.place().1)));
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 15))
        .margin(10)
        .margin_right(24)
        .x_label_area_size(42)
        .y_label_area_size(56)
        .build_cartesian_2d(logarithmic(x), logarithmic(y))?;
    chart
        .configure_mesh()
        .x_desc("time for a frame, ms")
        .y_desc("error, % of white")
        .x_label_formatter(&|ms| format!("{ms:.0}"))
        .y_label_formatter(&|error| error.to_string())
        .bold_line_style(RGBColor(228, 228, 228))
        .light_line_style(TRANSPARENT)
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
        let (low, high) = (step.figure(|m| Some(m.frame.low)), step.figure(|m| Some(m.frame.high)));
        if let (Some(low), Some(high)) = (low, high) {
            let bar = vec![(low.mean, at.1), (high.mean, at.1)];
            chart.draw_series([PathElement::new(bar, faint)])?;
        }
        let radius = if step.on_front { 4 } else { 3 };
        chart.draw_series([Circle::new(at, radius, color.filled())])?;
    }
    // The most informative first: a point too close to others gets no label.
    let mut named = shown.clone();
    named.sort_by_key(|step| (!step.on_front, step.knob.is_some()));
    let at = |step: &Step| (step.place().0, percent(step.place().1));
    let points: Vec<(i32, i32)> =
        (shown.iter()).map(|step| chart.backend_coord(&at(step))).collect();
    let mut taken: Vec<Area> = points.iter().map(|&point| Area::around(point)).collect();
    let (across, down) = chart.plotting_area().get_pixel_range();
    let whole = Area { left: across.start, top: down.start, right: across.end, bottom: down.end };
    for step in named {
        let point = chart.backend_coord(&at(step));
        let own = Area::around(point);
        let free = |place: &Area| {
            whole.holds(place) && taken.iter().all(|other| *other == own || !other.meets(place))
        };
        let Some(place) = Area::beside(point, step.name).into_iter().find(free) else {
            continue;
        };
        let style = ("sans-serif", 10).into_font().color(&color(step.knob));
        let by = (place.left - point.0, place.top - point.1);
        let text = Text::new(step.name.to_owned(), by, style);
        chart.draw_series([EmptyElement::at(at(step)) + text])?;
        taken.push(place);
    }
    area.present()?;
    Ok(())
}
