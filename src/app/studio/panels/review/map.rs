//! The error map: one column per lamp, one row per frame or pose, and each lamp's mean as a bar above.

use super::verdict;
use crate::panels::lamp_title;
use crate::theme;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, ScrollArea, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};
use evaluation::review::{Case, Marks, Metric, Review, badness, heat};
use imaging::color::byte_from_unit;

/// In points: height of a row, width of the names, height of the bars, narrowest and widest column.
const ROW: f32 = 18.0;
const NAMES: f32 = 86.0;
const BARS: f32 = 40.0;
const LEAST_COLUMN: f32 = 5.0;
const MOST_COLUMN: f32 = 22.0;

/// Draws the map.
pub struct MapUi<'a> {
    pub review: &'a Review,
    pub metric: Metric,
    pub marks: &'a Marks,
    pub chosen: Option<(usize, usize)>,
    pub solo: &'a [usize],
    pub frame: usize,
}

impl MapUi<'_> {
    /// Draws the map. Returns the clicked cell: the indices of its case and lamp in the review.
    pub fn ui(&self, ui: &mut Ui) -> Option<(usize, usize)> {
        let (rows, columns) = (self.review.cases.len(), self.review.lamps.len());
        let room = ui.available_width() - NAMES;
        let column = (room / columns as f32).clamp(LEAST_COLUMN, MOST_COLUMN);
        let size = vec2(NAMES + column * columns as f32, BARS + ROW * rows as f32);
        ScrollArea::horizontal()
            .show(ui, |ui| {
                let (rect, response) = ui.allocate_exact_size(size, Sense::click());
                let name = format!("{} by lamp and frame", self.metric.name());
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
                let origin = rect.min + vec2(NAMES, BARS);
                let steps = vec2(column, ROW);
                self.names_ui(ui.painter(), rect.left(), origin);
                self.bars_ui(ui.painter(), origin, column);
                self.cells_ui(ui.painter(), origin, steps);
                theme::focus_ui(ui, rect, &response);
                let cell = |at: Pos2| -> Option<(usize, usize)> {
                    let place = (at - origin) / steps;
                    let inside = place.x >= 0.0 && place.y >= 0.0 && place.x < columns as f32 && place.y < rows as f32;
                    inside.then_some((place.y as usize, place.x as usize))
                };
                let pressed = response.interact_pointer_pos().filter(|_| response.clicked());
                let under = response.hover_pos().and_then(cell);
                if let Some(cell) = under {
                    response.on_hover_text_at_pointer(self.says(cell));
                }
                pressed.and_then(cell)
            })
            .inner
    }

    fn says(&self, (case, lamp): (usize, usize)) -> String {
        let (case, name) = (&self.review.cases[case], &self.review.lamps[lamp]);
        let figures = Metric::ALL.map(|m| format!("{} {}", m.name(), m.text(m.score(&case.cells[lamp]))));
        let seen = if case.seen { "seen in training" } else { "unseen" };
        let lamp = lamp_title(name);
        let mut text = format!("{}, {lamp}, {seen}\n{}", case.name, figures.join("  "));
        if let Some(marked) = self.marks.get(&case.name, name) {
            let mark = marked.mark.map_or("", |m| m.name());
            text += &format!("\n{mark} {}", marked.note);
        }
        text
    }

    fn names_ui(&self, painter: &Painter, left: f32, origin: Pos2) {
        for (row, case) in self.review.cases.iter().enumerate() {
            let shown = case.case == Case::Frame(self.frame);
            let color = match (shown, case.seen) {
                (true, _) => theme::ACCENT,
                (false, true) => theme::QUIET,
                (false, false) => theme::TEXT,
            };
            let at = pos2(left, origin.y + (row as f32 + 0.5) * ROW);
            painter.text(at, Align2::LEFT_CENTER, &case.name, FontId::proportional(12.0), color);
        }
    }

    /// Each lamp's mean: a longer bar is worse.
    fn bars_ui(&self, painter: &Painter, origin: Pos2, column: f32) {
        for (lamp, mean) in self.review.lamp_means(self.metric).into_iter().enumerate() {
            let error = badness(self.metric, mean);
            let height = 1.0 + error * (BARS - 6.0);
            let left = origin.x + lamp as f32 * column;
            let bar = Rect::from_min_max(
                pos2(left, origin.y - 3.0 - height),
                pos2(left + column - gap(column), origin.y - 3.0),
            );
            let color = if self.solo.contains(&lamp) { theme::ACCENT } else { Color32::from_gray(128) };
            painter.rect_filled(bar, 0.0, color);
        }
    }

    fn cells_ui(&self, painter: &Painter, origin: Pos2, steps: Vec2) {
        let place = |case: usize, lamp: usize| {
            let corner = origin + vec2(lamp as f32, case as f32) * steps;
            Rect::from_min_size(corner, steps - vec2(gap(steps.x), 1.0))
        };
        for (row, case) in self.review.cases.iter().enumerate() {
            for (lamp, cell) in case.cells.iter().enumerate() {
                let rect = place(row, lamp);
                let error = badness(self.metric, self.metric.score(cell));
                let [r, g, b] = heat(error).map(byte_from_unit);
                painter.rect_filled(rect, 0.0, Color32::from_rgb(r, g, b));
                if let Some(marked) = self.marks.get(&case.name, &self.review.lamps[lamp]) {
                    let radius = (0.3 * steps.x).min(3.0);
                    let rim = Stroke::new(1.0, Color32::BLACK);
                    let color = marked.mark.map_or(Color32::WHITE, verdict::color);
                    painter.circle(rect.center(), radius, color, rim);
                }
            }
        }
        if let Some((case, lamp)) = self.chosen {
            let around = place(case, lamp).expand(1.0);
            painter.rect_stroke(around, 1.0, Stroke::new(2.0, theme::ACCENT), StrokeKind::Outside);
        }
    }
}

/// The gap between two columns, where there is room.
fn gap(column: f32) -> f32 {
    1.0f32.min(0.15 * column)
}
