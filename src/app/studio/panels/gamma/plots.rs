//! Plots of the response: the curve with its asymptotes, the loss surface, the histograms.

use crate::theme;
use calibration::Trial;
use calibration::gamma::Surface;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, TextureId, Ui, Vec2, pos2, vec2};
use imaging::{DualGamma, Response};
use worker::GammaView;

const RED: Color32 = Color32::from_rgb(224, 96, 84);
const GREEN: Color32 = Color32::from_rgb(108, 190, 104);
const BLUE: Color32 = Color32::from_rgb(96, 140, 232);
const QUIET_LINE: Color32 = Color32::from_gray(110);
/// Points along a curve.
const STEPS: usize = 96;

/// The curve of a trial, with I^γ1 and I^γ2: encoded values to the right, linear upward. `cases` are the open cases of
/// the calibration.
pub fn curve_ui(ui: &mut Ui, side: f32, trial: &Trial, calibrated: Option<&Trial>, cases: &[Trial]) {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Response curve"));
    let painter = ui.painter();
    frame_ui(painter, rect, "encoded", "linear");
    let place = |x: f32, y: f32| pos2(rect.left() + x * rect.width(), rect.bottom() - y * rect.height());
    let curve = |value: &dyn Fn(f32) -> f32| -> Vec<Pos2> {
        (0..=STEPS).map(|i| i as f32 / STEPS as f32).map(|x| place(x, value(x))).collect()
    };
    let dual = match trial.response {
        Response::Dual(curve) => Some([curve.gamma1, curve.gamma2]),
        _ => None,
    };
    for gamma in dual.into_iter().flatten() {
        let points = curve(&|x| x.powf(gamma));
        painter.extend(Shape::dashed_line(&points, Stroke::new(1.0, QUIET_LINE), 4.0, 3.0));
    }
    for case in cases {
        let points = curve(&|x| case.response.decode_value(x));
        painter.line(points, Stroke::new(1.0, BLUE));
    }
    if let Some(calibrated) = calibrated.filter(|c| *c != trial) {
        let points = curve(&|x| calibrated.response.decode_value(x));
        painter.line(points, Stroke::new(1.0, theme::TEXT));
    }
    painter.line(curve(&|x| trial.response.decode_value(x)), Stroke::new(2.0, theme::ACCENT));
    let what = match dual {
        Some([gamma1, gamma2]) => format!(
            "I′ = (1 − I)·I^γ1 + I·I^γ2. Near black it follows I^{gamma1:.2}, near white I^{gamma2:.2} (dashed)."
        ),
        None => format!("Response: {}.", trial.response),
    };
    let open = match cases {
        [] => "",
        _ => " Blue: the curves of both open answers.",
    };
    response.on_hover_text(format!("{what} White: the calibrated curve, if another is tried.{open}"));
}

/// The fit's cost over γ1 (to the right) and γ2 (upward). Returns γ1 and γ2 where it was clicked or dragged.
pub fn surface_ui(ui: &mut Ui, side: f32, view: &GammaView, texture: TextureId) -> Option<[f32; 2]> {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Loss surface"));
    let painter = ui.painter();
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    painter.image(texture, rect, whole, Color32::WHITE);
    frame_ui(painter, rect, "γ1", "γ2");
    let range = *DualGamma::BOUNDS.start()..=*DualGamma::BOUNDS.end();
    let span = range.end() - range.start();
    let place = |[gamma1, gamma2]: [f32; 2]| {
        let (x, y) = ((gamma1 - range.start()) / span, (gamma2 - range.start()) / span);
        pos2(rect.left() + x * rect.width(), rect.bottom() - y * rect.height())
    };
    let [gamma1, gamma2, _] = view.surface.optimum;
    painter.circle_stroke(place([gamma1, gamma2]), 4.0, Stroke::new(1.5, Color32::WHITE));
    if let Some(at) = view.trial.response.exponents().map(place) {
        for direction in [vec2(1.0, 0.0), vec2(0.0, 1.0)] {
            painter.line_segment([at - 7.0 * direction, at + 7.0 * direction], Stroke::new(1.5, theme::ACCENT));
        }
    }
    theme::focus_ui(ui, rect, &response);
    let touched = response.dragged() || response.clicked();
    let to = response.interact_pointer_pos().filter(|_| touched).map(|at| {
        let (x, y) = ((at.x - rect.left()) / rect.width(), (rect.bottom() - at.y) / rect.height());
        [x, y].map(|v| range.start() + v.clamp(0.0, 1.0) * span)
    });
    let hint = "Error of each pair of exponents, dark is small. Ring: best fit. Cross: the tried pair; drag it.";
    theme::hint_at_rest_ui(response, hint);
    to
}

/// A picture of the surface: dark near the optimum, grey where the curve is not valid.
pub fn surface_picture(surface: &Surface) -> egui::ColorImage {
    let side = surface.gammas.len();
    // Compressed, so that detail near the optimum shows.
    let level = |cost: f32| cost.max(0.0).sqrt().ln_1p();
    let finite = surface.cost.iter().filter(|cost| cost.is_finite());
    let most = finite.map(|&cost| level(cost)).fold(1e-6, f32::max);
    let pixels = (0..side * side)
        .map(|i| {
            // Rows run downward, γ2 upward.
            let cost = surface.cost[(side - 1 - i / side) * side + i % side];
            if !cost.is_finite() {
                return Color32::from_gray(60);
            }
            let mix = |from: f32, to: f32| (from + (to - from) * level(cost) / most) as u8;
            Color32::from_rgb(mix(14.0, 226.0), mix(20.0, 214.0), mix(44.0, 190.0))
        })
        .collect();
    egui::ColorImage::new([side, side], pixels)
}

/// Histograms of 8-bit codes: the interview filled, the relit exemplars as lines, before and after.
pub fn histograms_ui(ui: &mut Ui, width: f32, height: f32, view: &GammaView) {
    let (rect, response) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Histograms"));
    let each = rect.height() / 3.0;
    for (channel, color) in [RED, GREEN, BLUE].into_iter().enumerate() {
        let band =
            Rect::from_min_size(pos2(rect.left(), rect.top() + each * channel as f32), vec2(rect.width(), each - 3.0));
        let painter = ui.painter();
        painter.rect_filled(band, 0.0, theme::WELL);
        let sets = [&view.interview_histogram, &view.before_histogram, &view.relit_histogram];
        let shares = sets.map(|set| smooth(&set[channel]));
        // Clipped codes do not set the scale: they would flatten everything else.
        let inner = shares.iter().flat_map(|share| &share[2..254]);
        let most = inner.copied().fold(1e-6, f32::max);
        let place = |code: usize, share: f32| {
            let y = (share / most).min(1.0) * (band.height() - 2.0);
            pos2(band.left() + (code as f32 + 0.5) / 256.0 * band.width(), band.bottom() - y)
        };
        let [interview, before, after] = shares;
        for (code, share) in interview.iter().enumerate() {
            let to = place(code, *share);
            let stroke = Stroke::new(band.width() / 256.0 + 0.5, color.gamma_multiply(0.45));
            painter.line_segment([pos2(to.x, band.bottom()), to], stroke);
        }
        let line = |shares: &[f32], stroke: Stroke| {
            painter.line(shares.iter().enumerate().map(|(code, s)| place(code, *s)).collect(), stroke);
        };
        line(&before, Stroke::new(1.0, QUIET_LINE));
        line(&after, Stroke::new(1.5, color));
    }
    response.on_hover_text(
        "Codes of the subject from black to white. Filled: the interview. Coloured: poses in the same light with the tried \
         response. Grey: with a gamma of 2.2.",
    );
}

/// Shares of all counts, each the mean of five neighbours.
fn smooth(counts: &[u32]) -> Vec<f32> {
    let all = counts.iter().sum::<u32>().max(1) as f32;
    (0..counts.len())
        .map(|i| {
            let window = &counts[i.saturating_sub(2)..(i + 3).min(counts.len())];
            window.iter().sum::<u32>() as f32 / window.len() as f32 / all
        })
        .collect()
}

fn frame_ui(painter: &Painter, rect: Rect, to_right: &str, upward: &str) {
    if to_right == "encoded" {
        painter.rect_filled(rect, 0.0, theme::WELL);
    }
    let stroke = Stroke::new(1.0, Color32::from_gray(70));
    painter.rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Inside);
    let font = || FontId::proportional(11.0);
    // The surface is light at its corners.
    let color = if to_right == "encoded" { theme::QUIET } else { Color32::from_gray(40) };
    painter.text(rect.right_bottom() - vec2(4.0, 3.0), Align2::RIGHT_BOTTOM, to_right, font(), color);
    painter.text(rect.left_top() + vec2(4.0, 3.0), Align2::LEFT_TOP, upward, font(), color);
}
