//! The curves of a run: losses on a logarithmic axis, the held-out pose below.

use crate::panels::widgets::still_plot::{axis, still_plot};
use base::progress::LossPoint;
use egui::{Color32, Rect, RichText, Sense, Ui, WidgetInfo, vec2};
use egui_plot::{AxisHints, GridInput, GridMark, HoverPosition, Line, Plot, PlotPoints, Points};

/// Colours of the two losses, distinct for people with red-green colour blindness.
pub const OLATS: Color32 = Color32::from_rgb(240, 228, 110);
pub const RELIT: Color32 = Color32::from_rgb(108, 172, 228);
const HELD_OUT: Color32 = Color32::from_gray(222);
/// Share of all points that a smoothed curve averages over.
const SMOOTHED: f32 = 1.0 / 40.0;

/// The losses over the steps, raw and smoothed.
pub fn losses_ui(ui: &mut Ui, height: f32, points: &[LossPoint]) {
    let olats = curve(points, |p| p.reconstruction);
    let relit = curve(points, |p| p.rendering);
    let hint = |position: &HoverPosition| match position {
        HoverPosition::NearDataPoint { plot_name, position, .. } => {
            Some(format!("{plot_name}\nstep {:.0}\n{}", position.x, plain(10f64.powf(position.y))))
        }
        HoverPosition::Elsewhere { .. } => None,
    };
    let response = plot("losses", height)
        .y_grid_spacer(decades)
        .custom_y_axes(vec![
            axis(AxisHints::new_y())
                .formatter(|mark, _| plain(10f64.powf(mark.value)))
                .label_spacing(14.0..=20.0)
                .min_thickness(46.0),
        ])
        .label_formatter(hint)
        .show(ui, |plot| {
            for (name, color, curve) in [("OLATs", OLATS, &olats), ("relit", RELIT, &relit)] {
                let faint = Line::new(format!("{name}, raw"), logarithms(curve))
                    .color(color.gamma_multiply(0.28))
                    .width(1.0)
                    .allow_hover(false);
                plot.line(faint);
            }
            for (name, color, curve) in [("OLATs", OLATS, &olats), ("relit", RELIT, &relit)] {
                let line = Line::new(name, logarithms(&smoothed(curve)));
                plot.line(line.color(color).width(1.8));
            }
        })
        .response;
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Loss curves"));
}

/// The names of the curves in their colours.
pub fn legend_ui(ui: &mut Ui) {
    for (name, color, hint) in [
        ("OLATs", OLATS, "Reconstruction loss: how far predicted OLATs are from the photographs"),
        ("Relit", RELIT, "Rendering loss: how far relit OLATs are from the interview"),
    ] {
        let (rect, _) = ui.allocate_exact_size(vec2(14.0, 12.0), Sense::hover());
        let line = Rect::from_center_size(rect.center(), vec2(14.0, 2.0));
        ui.painter().rect_filled(line, 0.0, color);
        ui.label(RichText::new(name).size(12.0).color(color)).on_hover_text(hint);
    }
}

/// PSNR on the held-out pose over the steps.
pub fn held_out_ui(ui: &mut Ui, height: f32, points: &[LossPoint]) {
    let curve = curve(points, |p| p.held_out_db);
    let hint = |position: &HoverPosition| match position {
        HoverPosition::NearDataPoint { position, .. } => Some(format!("step {:.0}\n{:.2} dB", position.x, position.y)),
        HoverPosition::Elsewhere { .. } => None,
    };
    let last = points.last().map_or(1, |point| point.step);
    let response = plot("held out", height)
        .include_x(0.0)
        .include_x(last as f64)
        .y_grid_spacer(|input| few(&input, 3.0))
        .custom_y_axes(vec![
            axis(AxisHints::new_y())
                .formatter(|mark, _| format!("{} dB", tidy(mark.value, 2)))
                .label_spacing(14.0..=20.0)
                .min_thickness(46.0),
        ])
        .label_formatter(hint)
        .show(ui, |plot| {
            plot.line(Line::new("held-out pose", PlotPoints::from(curve.clone())).color(HELD_OUT));
            let marks = Points::new("measured", PlotPoints::from(curve)).color(HELD_OUT);
            plot.points(marks.radius(2.0).allow_hover(false));
        })
        .response;
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Held-out pose's curve"));
}

/// A plot that cannot be moved or zoomed.
fn plot<'a>(name: &'static str, height: f32) -> Plot<'a> {
    let steps = axis(AxisHints::new_x()).formatter(|mark, _| {
        if mark.value >= 0.0 && mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
    });
    still_plot(name, height).x_grid_spacer(|input| few(&input, 6.0)).custom_x_axes(vec![steps])
}

/// Steps and values of a loss, without the steps at which it is missing.
fn curve(points: &[LossPoint], term: impl Fn(&LossPoint) -> Option<f32>) -> Vec<[f64; 2]> {
    let value = |p| term(p).map(|value| [p.step as f64, f64::from(value)]);
    points.iter().filter_map(value).collect()
}

fn logarithms(curve: &[[f64; 2]]) -> PlotPoints<'static> {
    let positive = curve.iter().filter(|[_, y]| *y > 0.0);
    positive.map(|&[x, y]| [x, y.log10()]).collect()
}

/// The running mean of the logarithm, over the last fortieth.
fn smoothed(curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = (curve.len() as f32 * SMOOTHED).max(4.0);
    let mut mean = None;
    let mut seen = 0.0f64;
    (curve.iter().filter(|[_, y]| *y > 0.0))
        .map(|&[x, y]| {
            // Early on it follows fast, so that it does not lag behind the first drop.
            seen += 1.0;
            let share = (1.0 / seen).max(1.0 / f64::from(count));
            let old = mean.unwrap_or(y.ln());
            let new = old + share * (y.ln() - old);
            mean = Some(new);
            [x, new.exp()]
        })
        .collect()
}

/// Marks at 1, 2 and 5 of each visible power of ten.
fn decades(input: GridInput) -> Vec<GridMark> {
    let (from, to) = input.bounds;
    if !(from.is_finite() && to.is_finite()) || to - from > 30.0 {
        return Vec::new();
    }
    let exponents = from.floor() as i32..=to.ceil() as i32;
    let marks = exponents.flat_map(|exponent| {
        [(1.0f64, 1.0), (2.0, 0.3), (5.0, 0.3)]
            .map(|(digit, step_size)| GridMark { value: f64::from(exponent) + digit.log10(), step_size })
    });
    marks.filter(|mark| (from..=to).contains(&mark.value)).collect()
}

/// About `count` marks at multiples of 1, 2 or 5 of a power of ten.
fn few(input: &GridInput, count: f64) -> Vec<GridMark> {
    let (from, to) = input.bounds;
    let room = (to - from) / count;
    if !(room.is_finite() && room > 0.0) {
        return Vec::new();
    }
    let power = 10f64.powf(room.log10().floor());
    let digits = [1.0, 2.0, 5.0, 10.0].into_iter();
    let mut steps = digits.map(|digit| digit * power);
    let step_size = steps.find(|step| *step >= room).unwrap_or(10.0 * power);
    let numbers = (from / step_size).ceil() as i64..=(to / step_size).floor() as i64;
    let mark = |number: i64| GridMark { value: number as f64 * step_size, step_size };
    numbers.map(mark).collect()
}

/// A loss as written on an axis: two digits.
fn plain(value: f64) -> String {
    let digits = (1.0 - value.log10().floor()).clamp(0.0, 7.0) as usize;
    tidy(value, digits)
}

/// A number with at most `digits` decimals.
fn tidy(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_are_written_as_plain_numbers() {
        for (value, text) in
            [(0.02, "0.02"), (0.0213, "0.021"), (1.0, "1"), (0.5, "0.5"), (200.0, "200"), (2e-5, "0.00002")]
        {
            assert_eq!(plain(value), text);
        }
    }

    #[test]
    fn a_smoothed_curve_keeps_a_constant_and_calms_an_alternation() {
        let curve = |value: fn(usize) -> f64| -> Vec<[f64; 2]> { (0..400).map(|i| [i as f64, value(i)]).collect() };
        let flat = smoothed(&curve(|_| 0.3));
        assert!(flat.iter().all(|[_, y]| (y - 0.3).abs() < 1e-9));
        let calm = smoothed(&curve(|i| if i % 2 == 0 { 0.1 } else { 0.4 }));
        // The geometric mean of 0.1 and 0.4 is 0.2.
        assert!(calm[100..].iter().all(|[_, y]| (0.18..0.22).contains(y)));
    }

    #[test]
    fn a_few_marks_at_round_numbers_divide_any_range() {
        let marks = |from, to| -> Vec<String> {
            let input = GridInput { bounds: (from, to), base_step_size: 0.01 };
            let marks = few(&input, 4.0);
            marks.iter().map(|mark| tidy(mark.value, 2)).collect()
        };
        assert_eq!(marks(-60.0, 1300.0), ["0", "500", "1000"]);
        assert_eq!(marks(22.4, 24.1), ["22.5", "23", "23.5", "24"]);
        assert!(marks(1.0, 1.0).is_empty() && marks(0.0, f64::INFINITY).is_empty());
    }

    #[test]
    fn marks_are_at_round_losses_within_what_is_seen() {
        let input = GridInput { bounds: (-2.1, -0.9), base_step_size: 0.01 };
        let marks: Vec<String> = (decades(input).iter()).map(|mark| plain(10f64.powf(mark.value))).collect();
        assert_eq!(marks, ["0.01", "0.02", "0.05", "0.1"]);
    }
}
