//! The scrub bar: the ruler, the range between in and out, the frames that are cached, and the current frame.

use super::track::{RULER, Track};
use crate::command::{Command, ExportCommand, ViewCommand};
use crate::export_options::ExportOptions;
use crate::panel_context::PanelContext;
use crate::theme;
use egui::{
    Align2, Color32, CornerRadius, CursorIcon, FontId, Rangef, Rect, Role, Sense, Stroke, Ui,
    WidgetInfo, pos2, vec2,
};

/// Width of an in or out handle in points.
pub const HANDLE: f32 = 12.0;
/// What is between the ruler and the bottom: the bar, and the line of what is cached.
const BAR: f32 = 16.0;
const CACHE: f32 = 2.0;
/// Height of all of it.
pub const HEIGHT: f32 = RULER + BAR + CACHE + 2.0;
/// Width that the number beside a handle takes.
const NUMBER: f32 = 32.0;

/// Draws it. Predicted frames are marked: they play without waiting.
pub fn scrub_ui(
    ui: &mut Ui,
    context: &PanelContext,
    track: &Track,
    rect: Rect,
    out: &mut Vec<Command>,
) {
    let state = context.state;
    let id = ui.scope_id().with("scrub bar");
    let response = ui.interact(rect, id, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::slider(true, state.frame as f64, "Scrub bar"));
    let top = rect.top() + RULER + 1.0;
    let bar = Rangef::new(top, top + BAR);
    let painter = ui.painter();
    track.ruler_ui(painter, rect);
    painter.rect_filled(Rect::from_x_y_ranges(track.across, bar), 2.0, theme::WELL);
    let (first, last) = state.export_options.range(state.frames);
    let within = Rangef::new(track.span(first).min, track.span(last).max);
    painter.rect_filled(
        Rect::from_x_y_ranges(within, bar),
        0.0,
        Color32::from_gray(64),
    );
    let cached = Rangef::new(bar.max + 1.0, bar.max + 1.0 + CACHE);
    for &frame in context.relit.iter().flat_map(|relit| &relit.frames_at_hand) {
        let line = Rect::from_x_y_ranges(track.span(frame), cached);
        painter.rect_filled(line, 0.0, theme::CACHED);
    }
    let trust = context.review.confidence();
    for unlike in trust.iter().flat_map(|report| report.unlike()) {
        let until = unlike.frame + trust.map_or(1, |report| report.every) - 1;
        let until = until.min(state.frames.saturating_sub(1));
        let marked = Rangef::new(track.span(unlike.frame).min, track.span(until).max);
        let above = Rangef::new(bar.min, bar.min + 3.0);
        let mark = Rect::from_x_y_ranges(marked, above);
        painter.rect_filled(mark, 0.0, theme::WARNING);
    }
    if let Some(at) = response.hover_pos().filter(|_| !response.dragged()) {
        let frame = track.frame_at(at.x);
        hovered_ui(ui, track, rect, frame);
        let unlike = trust.and_then(|report| {
            let found = report
                .unlike()
                .into_iter()
                .find(|unlike| (unlike.frame..unlike.frame + report.every).contains(&frame));
            Some(found?.distance / report.far)
        });
        if let Some(times) = unlike {
            response.clone().on_hover_text(format!(
                "Frame {frame} is unlike every pose: {times:.1} times as far from the nearest as any pose is from the \
                 others. Expect larger errors here."
            ));
        }
    }
    if let Some(at) = response.interact_pointer_pos() {
        let frame = track.frame_at(at.x);
        if (response.clicked() || response.dragged()) && frame != state.frame {
            out.push(Command::View(ViewCommand::Frame(frame)));
        }
    }
    let head = track.span(state.frame);
    let head = Rect::from_center_size(
        pos2(head.center(), bar.center()),
        vec2(head.span().clamp(4.0, 10.0), BAR + 4.0),
    );
    ui.painter().rect_filled(head, 2.0, theme::ACCENT);
    if state.frames > 1 {
        handles_ui(ui, context, track, bar, out);
    }
}

/// The number of the frame under the pointer, over the ruler.
fn hovered_ui(ui: &Ui, track: &Track, rect: Rect, frame: usize) {
    let font = FontId::proportional(12.0);
    let text = ui
        .painter()
        .layout_no_wrap(frame.to_string(), font, theme::TEXT);
    let middle = pos2(track.x(frame as f64), rect.top() + 0.5 * RULER);
    let place = Rect::from_center_size(middle, text.size());
    ui.painter()
        .rect_filled(place.expand2(vec2(3.0, 1.0)), 2.0, theme::PANEL);
    ui.painter().galley(place.min, text, theme::TEXT);
}

/// The handles of the in and the out point, each with its frame beside it.
fn handles_ui(ui: &Ui, context: &PanelContext, track: &Track, bar: Rangef, out: &mut Vec<Command>) {
    let state = context.state;
    let last_frame = state.frames.saturating_sub(1);
    let (first, last) = state.export_options.range(state.frames);
    let (left, right) = (track.span(first).min, track.span(last).max);
    let is_wide = right - left > 2.0 * NUMBER + 12.0;
    for (is_in, name, key, frame, edge) in [
        (true, "In point", "I", first, left),
        (false, "Out point", "O", last, right),
    ] {
        let outwards = if is_in { -1.0 } else { 1.0 };
        let across = Rangef::new(
            edge.min(edge + outwards * HANDLE),
            edge.max(edge + outwards * HANDLE),
        );
        let rect = Rect::from_x_y_ranges(across, bar.expand(2.0));
        let id = ui.scope_id().with(name);
        let response = ui.interact(rect, id, Sense::click_and_drag());
        let label = format!("{name} at frame {frame}");
        response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, &label));
        let is_held = response.hovered() || response.dragged();
        let grey = if is_held { 222 } else { 150 };
        let corners = match is_in {
            true => CornerRadius {
                nw: 4,
                sw: 4,
                ne: 0,
                se: 0,
            },
            false => CornerRadius {
                nw: 0,
                sw: 0,
                ne: 4,
                se: 4,
            },
        };
        let painter = ui.painter();
        painter.rect_filled(rect, corners, Color32::from_gray(grey));
        for grip in [-1.5, 1.5] {
            let line = rect.y_range().shrink(5.0);
            painter.vline(rect.center().x + grip, line, Stroke::new(1.0, theme::PANEL));
        }
        // Within the range where there is room, and outside of it otherwise.
        let (x, inwards) = match is_wide {
            true => (edge - outwards * 4.0, true),
            false => (edge + outwards * (HANDLE + 4.0), false),
        };
        if is_wide || track.across.expand(HANDLE).contains(x + outwards * NUMBER) {
            let align = match is_in == inwards {
                true => Align2::LEFT_CENTER,
                false => Align2::RIGHT_CENTER,
            };
            let font = FontId::proportional(12.0);
            painter.text(pos2(x, bar.center()), align, frame, font, theme::TEXT);
        }
        if let Some(to) = response
            .interact_pointer_pos()
            .filter(|_| response.dragged())
        {
            let cut = track.cut_at(to.x - outwards * 0.5 * HANDLE);
            let frames = match is_in {
                true => (cut.min(last), last),
                false => (first, cut.saturating_sub(1).max(first)),
            };
            if frames != (first, last) {
                let options = ExportOptions {
                    frames: Some(frames).filter(|all| *all != (0, last_frame)),
                    ..state.export_options.clone()
                };
                out.push(Command::Export(ExportCommand::Options(Box::new(options))));
            }
        }
        response
            .on_hover_cursor(CursorIcon::ResizeHorizontal)
            .on_hover_text(format!("{label}: drag it. Key: {key}"));
    }
}
