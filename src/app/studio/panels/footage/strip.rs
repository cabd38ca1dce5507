//! The strip of thumbnails: as many frames as fit, spread over the clip.

use crate::command::{Command, ProjectCommand, ViewCommand};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::footage::reader::Thumbnail;
use crate::panels::widgets::fit::fitting;
use crate::theme;
use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

/// Minimum width of a thumbnail, and the gap between two, in points.
const LEAST: f32 = 64.0;
const BETWEEN: f32 = 3.0;

/// Draws the strip into the rest of `ui`.
pub fn strip_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let rect = ui.available_rect_before_wrap().shrink2(vec2(0.0, 5.0));
    let frames = spread(context.state.playback.frames, (rect.width() / LEAST) as usize);
    let wanted: Vec<_> = frames.iter().copied().map(Thumbnail::Frame).collect();
    if wanted != context.readers.footage.wanted(Pane::Footage) {
        let wanted = ProjectCommand::Thumbnails(Pane::Footage, wanted);
        out.push(Command::Project(wanted));
    }
    let (first, last) = context.state.range();
    let cell = rect.width() / frames.len().max(1) as f32;
    let current = frames.partition_point(|&frame| frame <= context.state.frame);
    for (i, &frame) in frames.iter().enumerate() {
        let left = rect.left() + i as f32 * cell;
        let place = Rect::from_min_size(pos2(left, rect.top()), vec2(cell - BETWEEN, rect.height()));
        let response = ui.interact(place, ui.scope_id().with(("thumbnail", i)), Sense::click());
        let shown = i + 1 == current;
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::Button, true, shown, format!("Thumbnail of frame {frame}"))
        });
        ui.painter().rect_filled(place, 2.0, theme::WELL);
        if let Some(picture) = context.readers.footage.thumbnail(Thumbnail::Frame(frame)) {
            let inside = fitting(picture.size_vec2(), place);
            let tint = if (first..=last).contains(&frame) { Color32::WHITE } else { Color32::from_gray(70) };
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            ui.painter().image(picture.id(), inside, whole, tint);
        }
        let text = place.left_bottom() + vec2(3.0, -1.0);
        ui.painter().text(text, Align2::LEFT_BOTTOM, frame, FontId::proportional(11.0), theme::TEXT);
        if shown || response.hovered() {
            let color = if shown { theme::ACCENT } else { theme::QUIET };
            ui.painter().rect_stroke(place, 2.0, Stroke::new(2.0, color), StrokeKind::Inside);
        }
        theme::focus_ui(ui, place.expand(2.0), &response);
        if response.clicked() {
            out.push(Command::View(ViewCommand::Frame(frame)));
        }
    }
}

/// Returns at most `room` of `frames` frames, spread evenly from the first.
fn spread(frames: usize, room: usize) -> Vec<usize> {
    let count = frames.min(room.max(1));
    (0..count).map(|i| i * frames / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thumbnails_are_spread_over_the_clip() {
        assert_eq!(spread(4, 10), [0, 1, 2, 3]);
        assert_eq!(spread(100, 4), [0, 25, 50, 75]);
        assert_eq!(spread(3, 0), [0]);
        assert!(spread(0, 5).is_empty());
    }
}
