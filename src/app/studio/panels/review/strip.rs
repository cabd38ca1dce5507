//! Measured cases as a strip of thumbnails, worst first.

use crate::command::{Command, ProjectCommand, ReviewCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::footage::reader::Thumbnail;
use crate::panels::lamp_title;
use crate::panels::widgets::fit::fitting;
use crate::theme;
use egui::text::LayoutJob;
use egui::{Color32, FontId, Painter, Pos2, Rect, ScrollArea, Sense, Stroke, StrokeKind, TextFormat, Ui, pos2, vec2};
use evaluation::review::{Case, CaseScores, Review};

/// In points: a thumbnail, the gap between two, the height of a line below them.
const WIDTH: f32 = 84.0;
const HEIGHT: f32 = 56.0;
const BETWEEN: f32 = 6.0;
const LINE: f32 = 15.0;
/// Colour of a case without a thumbnail.
const EMPTY: Color32 = Color32::from_gray(60);

/// Draws the cases of the review with their mean scores. A click goes to a case under its worst lamp.
pub fn strip_ui(ui: &mut Ui, review: &Review, context: &PanelContext, out: &mut Vec<Command>) {
    let metric = context.state.review.metric;
    let cases = review.worst_cases(metric);
    let step = WIDTH + BETWEEN;
    let size = vec2(step * cases.len() as f32, HEIGHT + 2.0 * LINE);
    let mut thumbnails = Vec::new();
    ScrollArea::horizontal().id_salt("measured cases").show_viewport(ui, |ui, visible| {
        let (strip, _) = ui.allocate_exact_size(size, Sense::hover());
        let first = (visible.left() / step).max(0.0) as usize;
        let count = (visible.width() / step).max(0.0) as usize + 2;
        for (place, &(index, mean)) in cases.iter().enumerate().skip(first).take(count) {
            let Some(case) = review.cases.get(index) else { continue };
            let lamp = review.worst_lamp(metric, index);
            // A pose is lit by single lamps only. Its thumbnail is under the lamp that a click leads to.
            let thumbnail = match case.case {
                Case::Frame(frame) => Thumbnail::Frame(frame),
                Case::Pose(pose) => Thumbnail::Olat { pose, lamp: lamp.unwrap_or(0) },
            };
            thumbnails.push(thumbnail);
            let corner = strip.min + vec2(place as f32 * step, 0.0);
            let item = CaseItem {
                case,
                thumbnail,
                figure: format!("{} {}", metric.name(), metric.text(mean)),
                rect: Rect::from_min_size(corner, vec2(WIDTH, size.y)),
                chosen: context.state.review.chosen.is_some_and(|(case, _)| case == index),
            };
            let worst = lamp.and_then(|lamp| review.lamps.get(lamp));
            if item.ui(ui, context, &worst.map_or(String::new(), |name| lamp_title(name)))
                && let Some(lamp) = lamp
            {
                out.push(Command::Review(ReviewCommand::Choose((index, lamp))));
            }
        }
    });
    if thumbnails != context.readers.footage.wanted(Pane::Review) {
        let wanted = ProjectCommand::Thumbnails(Pane::Review, thumbnails);
        out.push(Command::Project(wanted));
    }
}

/// A case and its rectangle.
struct CaseItem<'a> {
    case: &'a CaseScores,
    thumbnail: Thumbnail,
    /// Its mean score.
    figure: String,
    rect: Rect,
    chosen: bool,
}

impl CaseItem<'_> {
    /// Draws the case. Returns true if it was clicked.
    fn ui(&self, ui: &Ui, context: &PanelContext, worst_lamp: &str) -> bool {
        let id = ui.scope_id().with(("case", &self.case.name));
        let response = ui.interact(self.rect, id, Sense::click());
        let name = format!("{}: mean {}", self.case.name, self.figure);
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, self.chosen, &name));
        self.paint(ui.painter(), context, response.hovered());
        theme::focus_ui(ui, self.rect.expand(1.0), &response);
        let clicked = response.clicked();
        let seen = if self.case.seen { "seen in training" } else { "unseen" };
        response.on_hover_text(format!("{name}, {seen}. Click to see it under its worst lamp, {worst_lamp}."));
        clicked
    }

    fn paint(&self, painter: &Painter, context: &PanelContext, hovered: bool) {
        let place = self.rect.with_max_y(self.rect.top() + HEIGHT);
        match context.readers.footage.thumbnail(self.thumbnail) {
            Some(picture) => {
                painter.rect_filled(place, 2.0, theme::WELL);
                let inside = fitting(picture.size_vec2(), place);
                let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
                painter.image(picture.id(), inside, whole, Color32::WHITE);
            }
            None => {
                painter.rect_filled(place, 2.0, EMPTY);
            }
        }
        let color = if self.case.seen { theme::QUIET } else { theme::TEXT };
        for (line, text) in [&self.case.name, &self.figure].into_iter().enumerate() {
            let format = TextFormat::simple(FontId::proportional(12.0), color);
            let mut job = LayoutJob::single_section(text.clone(), format);
            job.wrap = egui::text::TextWrapping::truncate_at_width(WIDTH);
            let at = place.left_bottom() + vec2(0.0, LINE * line as f32);
            painter.galley(at, painter.layout_job(job), color);
        }
        if self.chosen || hovered {
            let color = if self.chosen { theme::ACCENT } else { theme::QUIET };
            let edge = Stroke::new(2.0, color);
            painter.rect_stroke(place, 2.0, edge, StrokeKind::Inside);
        }
    }
}
