//! Time for a frame against error, both on logarithmic axes: a point for each rung, and a line through the Pareto
//! front.

use super::words;
use crate::panels::widgets::still_plot::{axis, still_plot};
use crate::theme;
use egui::{Color32, Rect, RichText, Sense, Ui, WidgetInfo, pos2, vec2};
use egui_plot::{AxisHints, GridInput, GridMark, HoverPosition, Line, MarkerShape, PlotPoint, PlotPoints, Points};
use tradeoff::{Knob, Measured};

/// Reach of a click around the point of a rung, in points of the screen.
const REACH: f32 = 14.0;

/// Colours of knobs, distinct with red-green colour blindness too. A knob past the last colour starts over with a square.
const COLORS: [Color32; 7] = [
    Color32::from_rgb(222, 222, 222),
    Color32::from_rgb(108, 172, 228),
    Color32::from_rgb(240, 228, 110),
    Color32::from_rgb(150, 210, 180),
    Color32::from_rgb(214, 130, 180),
    Color32::from_rgb(120, 140, 230),
    Color32::from_rgb(214, 110, 80),
];

fn color(knob: Option<Knob>) -> Color32 {
    match knob {
        None => Color32::WHITE,
        Some(knob) => COLORS[knob as usize % COLORS.len()],
    }
}

fn is_square(knob: Option<Knob>) -> bool {
    knob.is_some_and(|knob| knob as usize >= COLORS.len())
}

/// Plot of the rungs.
pub struct Ladder<'a> {
    pub rungs: &'a [Measured],
    pub on_front: &'a [bool],
    pub chosen: Option<usize>,
    /// The rung that the project uses.
    pub applied: Option<&'a str>,
}

/// Position of a rung: the logarithms of milliseconds and error.
fn place(measured: &Measured) -> [f64; 2] {
    let error = measured.error().max(1e-6);
    [measured.frame.median.max(1e-3).log10(), error.log10()]
}

impl Ladder<'_> {
    /// Draws the plot. Returns the index of the clicked rung.
    pub fn ui(&self, ui: &mut Ui, height: f32) -> Option<usize> {
        let mut front: Vec<[f64; 2]> = (self.rungs.iter().zip(self.on_front))
            .filter(|&(_, &on)| on)
            .map(|(measured, _)| place(measured))
            .collect();
        front.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let hint = |position: &HoverPosition| match position {
            HoverPosition::NearDataPoint { plot_name, .. } if !plot_name.is_empty() => Some((*plot_name).to_owned()),
            _ => None,
        };
        let shown = still_plot("ladder", height)
            .set_margin_fraction(vec2(0.06, 0.1))
            .x_grid_spacer(steps)
            .y_grid_spacer(steps)
            .custom_x_axes(vec![
                axis(AxisHints::new_x())
                    .label("time for a frame")
                    .formatter(|mark, _| words::ms(10f64.powf(mark.value))),
            ])
            .custom_y_axes(vec![
                axis(AxisHints::new_y())
                    .label("error, % of white")
                    .formatter(|mark, _| {
                        format!("{:.3}", 100.0 * 10f64.powf(mark.value))
                            .trim_end_matches('0')
                            .trim_end_matches('.')
                            .to_owned()
                    })
                    .min_thickness(52.0),
            ])
            .label_formatter(hint)
            .show(ui, |plot| {
                plot.line(Line::new("", PlotPoints::from(front)).color(theme::QUIET).width(1.2).allow_hover(false));
                for (number, measured) in self.rungs.iter().enumerate() {
                    self.point(plot, number, measured);
                }
            });
        let response = shown.response;
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Time for a frame against error"));
        let pressed = response.interact_pointer_pos().filter(|_| response.clicked())?;
        let near = self.rungs.iter().enumerate().map(|(number, measured)| {
            let [x, y] = place(measured);
            let at = shown.transform.position_from_point(&PlotPoint::new(x, y));
            (number, at.distance(pressed))
        });
        let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|&(_, distance)| distance <= REACH).map(|(number, _)| number)
    }

    fn point(&self, plot: &mut egui_plot::PlotUi, number: usize, measured: &Measured) {
        let chosen = self.chosen == Some(number);
        let applied = self.applied == Some(measured.rung.name.as_str());
        let on_front = self.on_front[number];
        let mut name = format!(
            "{}\n{} a frame ({} to {})\n{:.1} dB, error {:.2} %",
            words::title(measured),
            words::ms(measured.frame.median),
            words::ms(measured.frame.low),
            words::ms(measured.frame.high),
            measured.fidelity.psnr_db,
            100.0 * measured.error(),
        );
        if on_front {
            name += "\nno other setting is both faster and more accurate";
        }
        if applied {
            name += "\nin use";
        }
        let color = color(measured.rung.knob);
        let place = place(measured);
        if chosen || applied {
            let ring = Points::new("", PlotPoints::from(vec![place]))
                .radius(if chosen { 9.0 } else { 7.5 })
                .filled(false)
                .color(if chosen { theme::ACCENT } else { theme::TEXT })
                .allow_hover(false);
            plot.points(ring);
        }
        let dot = Points::new(name, PlotPoints::from(vec![place]))
            .shape(if is_square(measured.rung.knob) { MarkerShape::Square } else { MarkerShape::Circle })
            .radius(if on_front { 5.0 } else { 3.5 })
            .color(if on_front { color } else { color.gamma_multiply(0.65) });
        plot.points(dot);
    }
}

/// Legend of the knobs, in their colours.
pub fn legend_ui(ui: &mut Ui, rungs: &[Measured]) {
    let mut knobs: Vec<Option<Knob>> = rungs.iter().map(|m| m.rung.knob).collect();
    knobs.sort_unstable();
    knobs.dedup();
    ui.horizontal_wrapped(|ui| {
        for knob in knobs {
            let (rect, _) = ui.allocate_exact_size(vec2(10.0, 14.0), Sense::hover());
            if is_square(knob) {
                let square = Rect::from_center_size(rect.center(), vec2(7.0, 7.0));
                ui.painter().rect_filled(square, 0.0, color(knob));
            } else {
                ui.painter().circle_filled(rect.center(), 4.0, color(knob));
            }
            let text = knob.map_or("Baseline", Knob::label);
            ui.label(RichText::new(text).size(12.0).color(theme::QUIET));
        }
        let (rect, _) = ui.allocate_exact_size(vec2(16.0, 14.0), Sense::hover());
        let line = [pos2(rect.left(), rect.center().y), pos2(rect.right(), rect.center().y)];
        ui.painter().line_segment(line, egui::Stroke::new(1.2, theme::QUIET));
        ui.label(RichText::new("Best trade-off").size(12.0).color(theme::QUIET))
            .on_hover_text("No other setting is both faster and more accurate");
    });
}

/// Marks at 1, 2 and 5 of each visible power of ten.
fn steps(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let decades = low.floor() as i32..=high.ceil() as i32;
    let marks = decades.flat_map(|decade| {
        [1.0f64, 2.0, 5.0].map(|digit| GridMark { value: f64::from(decade) + digit.log10(), step_size: 1.0 })
    });
    marks.filter(|mark| (low..=high).contains(&mark.value)).collect()
}
