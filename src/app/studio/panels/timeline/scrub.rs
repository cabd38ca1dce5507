//! The scrub bar: the ruler, the range between in and out, the frames that are cached, and the current frame.

use super::track::{RULER, Track};
use crate::command::{Command, LookCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme;
use egui::{
    Align2, Color32, CornerRadius, CursorIcon, FontId, PointerButton, Rangef, Rect, Role, Sense, Stroke, Ui,
    WidgetInfo, pos2, vec2,
};

/// Width of an in or out handle in points.
pub const HANDLE: f32 = 12.0;
/// Heights between the ruler and the bottom: the bar, and the line of cached frames.
const BAR: f32 = 16.0;
const CACHE: f32 = 2.0;
/// Height of the mark for the part of the clip in sight.
const OVERVIEW: f32 = 3.0;
/// Height of the whole scrub bar.
pub const HEIGHT: f32 = RULER + BAR + CACHE + 2.0;
/// Width of the number beside a handle.
const NUMBER: f32 = 32.0;

/// Draws the scrub bar. Marks predicted frames, which play without waiting.
pub fn scrub_ui(ui: &mut Ui, context: &PanelContext, track: &Track, rect: Rect, out: &mut Vec<Command>) {
    let state = context.state;
    let id = ui.scope_id().with("scrub bar");
    let response = ui.interact(rect, id, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::slider(true, state.frame as f64, "Scrub bar"));
    let top = rect.top() + RULER + 1.0;
    let bar = Rangef::new(top, top + BAR);
    let painter = ui.painter();
    track.ruler_ui(painter, rect);
    overview_ui(ui, track, rect);
    painter.rect_filled(Rect::from_x_y_ranges(track.across, bar), 2.0, theme::WELL);
    let (first, last) = state.range();
    if let Some(within) = track.run(first, last) {
        let within = Rect::from_x_y_ranges(within, bar);
        painter.rect_filled(within, 0.0, Color32::from_gray(64));
    }
    let cached = Rangef::new(bar.max + 1.0, bar.max + 1.0 + CACHE);
    let at_hand = context.relit().into_iter().flat_map(|relit| &relit.frames_at_hand);
    for line in lines(track, at_hand.copied()) {
        let line = Rect::from_x_y_ranges(line, cached);
        painter.rect_filled(line, 0.0, theme::CACHED);
    }
    let trust = context.readers.review.confidence();
    for unlike in trust.iter().flat_map(|report| report.unlike()) {
        let until = unlike.frame + trust.map_or(1, |report| report.every) - 1;
        let until = until.min(state.playback.frames.saturating_sub(1));
        if let Some(marked) = track.run(unlike.frame, until) {
            let above = Rangef::new(bar.min, bar.min + 3.0);
            let mark = Rect::from_x_y_ranges(marked, above);
            painter.rect_filled(mark, 0.0, theme::WARNING);
        }
    }
    if let Some(at) = response.hover_pos().filter(|_| !response.dragged()) {
        let frame = track.frame_at(at.x);
        let number = state.plate_number(frame);
        let text = number.map_or(frame.to_string(), |number| format!("{frame} · plate {number}"));
        hovered_ui(ui, rect, track.x(frame as f64), text);
        let unlike = trust.and_then(|report| {
            let found =
                report.unlike().into_iter().find(|unlike| (unlike.frame..unlike.frame + report.every).contains(&frame));
            Some(report.times(found?))
        });
        if let Some(times) = unlike {
            response.clone().on_hover_text(format!(
                "Frame {frame} is unlike every pose ({times:.1} × the distance between poses). Expect larger errors."
            ));
        }
    }
    if let Some(at) = response.interact_pointer_pos() {
        let frame = track.frame_at(at.x);
        let is_dragged = response.dragged_by(PointerButton::Primary);
        if (response.clicked() || is_dragged) && frame != state.frame {
            out.push(Command::View(ViewCommand::Frame(frame)));
        }
    }
    let head = track.span(state.frame);
    if track.has(head.center()) {
        let size = vec2(head.span().clamp(4.0, 10.0), BAR + 4.0);
        let head = Rect::from_center_size(pos2(head.center(), bar.center()), size);
        ui.painter().rect_filled(head, 2.0, theme::ACCENT);
    }
    theme::focus_ui(ui, rect, &response);
    if state.playback.frames > 1 {
        handles_ui(ui, context, track, bar, out);
    }
}

/// Frames as lines, one for each run of consecutive frames.
fn lines(track: &Track, frames: impl Iterator<Item = usize>) -> Vec<Rangef> {
    let mut frames: Vec<usize> = frames.collect();
    frames.sort_unstable();
    let runs = frames.chunk_by(|one, next| next - one <= 1);
    let ends = runs.filter_map(|run| run.first().zip(run.last()));
    ends.filter_map(|(first, last)| track.run(*first, *last)).collect()
}

/// A mark above the ruler for the part of the clip in sight; none if the whole clip is.
fn overview_ui(ui: &Ui, track: &Track, rect: Rect) {
    let Some(sight) = track.sight() else { return };
    let whole = Rect::from_x_y_ranges(track.across, rect.top()..=rect.top() + OVERVIEW);
    let x = |frame: f64| whole.left() + whole.width() * (frame / track.frames as f64) as f32;
    let shown = Rangef::new(x(sight.from), x(sight.from + sight.frames));
    // It stays visible, however small the part is.
    let shown = shown.expand((3.0 - shown.span()).max(0.0) / 2.0);
    let response = ui.interact(whole, ui.scope_id().with("overview"), Sense::hover());
    let (first, last) = track.ends();
    let name = format!("Frames {first} to {last} are in sight");
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    ui.painter().rect_filled(whole, 1.0, Color32::from_gray(64));
    let shown = Rect::from_x_y_ranges(shown, whole.y_range());
    ui.painter().rect_filled(shown, 1.0, theme::TEXT);
}

/// The number of the frame under the pointer, over the ruler.
fn hovered_ui(ui: &Ui, rect: Rect, x: f32, text: String) {
    let font = FontId::proportional(12.0);
    let text = ui.painter().layout_no_wrap(text, font, theme::TEXT);
    let middle = pos2(x, rect.top() + 0.5 * RULER);
    let place = Rect::from_center_size(middle, text.size());
    ui.painter().rect_filled(place.expand2(vec2(3.0, 1.0)), 2.0, theme::PANEL);
    ui.painter().galley(place.min, text, theme::TEXT);
}

/// The handles of the in and the out point, each with its frame beside it.
fn handles_ui(ui: &Ui, context: &PanelContext, track: &Track, bar: Rangef, out: &mut Vec<Command>) {
    let state = context.state;
    let (first, last) = state.range();
    let (left, right) = (track.span(first).min, track.span(last).max);
    let is_wide = right - left > 2.0 * NUMBER + 12.0;
    for (is_in, name, key, frame, edge) in
        [(true, "In point", "I", first, left), (false, "Out point", "O", last, right)]
    {
        if !track.has(edge) {
            continue;
        }
        let outwards = if is_in { -1.0 } else { 1.0 };
        let across = Rangef::new(edge.min(edge + outwards * HANDLE), edge.max(edge + outwards * HANDLE));
        let rect = Rect::from_x_y_ranges(across, bar.expand(2.0));
        let id = ui.scope_id().with(name);
        let response = ui.interact(rect, id, Sense::click_and_drag());
        let label = format!("{name} at frame {frame}");
        response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, &label));
        let is_held = response.hovered() || response.dragged();
        let grey = if is_held { 222 } else { 150 };
        let corners = if is_in {
            CornerRadius { nw: 4, sw: 4, ne: 0, se: 0 }
        } else {
            CornerRadius { nw: 0, sw: 0, ne: 4, se: 4 }
        };
        let painter = ui.painter();
        painter.rect_filled(rect, corners, Color32::from_gray(grey));
        for grip in [-1.5, 1.5] {
            let line = rect.y_range().shrink(5.0);
            painter.vline(rect.center().x + grip, line, Stroke::new(1.0, theme::PANEL));
        }
        theme::focus_ui(ui, rect.expand(2.0), &response);
        // Within the range if there is room, otherwise outside.
        let (x, inwards) =
            if is_wide { (edge - outwards * 4.0, true) } else { (edge + outwards * (HANDLE + 4.0), false) };
        if is_wide || track.across.expand(HANDLE).contains(x + outwards * NUMBER) {
            let align = if is_in == inwards { Align2::LEFT_CENTER } else { Align2::RIGHT_CENTER };
            let font = FontId::proportional(12.0);
            painter.text(pos2(x, bar.center()), align, frame, font, theme::TEXT);
        }
        if let Some(to) = response.interact_pointer_pos().filter(|_| response.dragged_by(PointerButton::Primary)) {
            let cut = track.cut_at(to.x - outwards * 0.5 * HANDLE);
            let frames = if is_in { (cut.min(last), last) } else { (first, cut.saturating_sub(1).max(first)) };
            if frames != (first, last) {
                out.push(Command::Look(LookCommand::Range(Some(frames))));
            }
        }
        let hint = format!("{label}: drag it. Key: {key}");
        theme::hint_at_rest_ui(response.on_hover_cursor(CursorIcon::ResizeHorizontal), hint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_covers_the_frames_that_are_cached_and_no_other() {
        let track = Track::new(Rangef::new(0.0, 80.0), 8, None);
        let line = |min, max| Rangef::new(min, max);
        let found = lines(&track, [6, 1, 0, 3, 2].into_iter());
        assert_eq!(found, [line(0.0, 40.0), line(60.0, 70.0)]);
        assert!(lines(&track, std::iter::empty()).is_empty());
        // With a part of the clip in sight.
        let sight = track.zoomed(2.0, 80.0);
        let part = Track::new(track.across, 8, sight);
        assert_eq!(part.ends(), (4, 7));
        let found = lines(&part, [2, 3, 4, 7].into_iter());
        assert_eq!(found, [line(0.0, 20.0), line(60.0, 80.0)]);
    }
}
