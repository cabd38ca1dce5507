//! The scrub bar: current frame, playback, and the keys of yaw and intensity.

use crate::command::{Command, LookCommand, ViewCommand};
use crate::icons;
use crate::keyframed::Keyframed;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Align2, Color32, Key, Modifiers, Painter, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};
use light::keyframes::Interpolation;

/// Distance from a key's centre to its corners, in points.
const DIAMOND: f32 = 5.5;

/// Holds the key that is being dragged: its kind, its index, and the frame under the pointer.
#[derive(Default)]
pub struct TimelinePanel {
    dragged: Option<(Keyframed, usize, usize)>,
}

impl TimelinePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let state = context.state;
        ui.horizontal_centered(|ui| {
            let last = state.frames.saturating_sub(1);
            let (icon, name) = match state.playing {
                true => (icons::PAUSE, "Pause"),
                false => (icons::PLAY, "Play"),
            };
            ui.scope(|ui| {
                ui.spacing_mut().item_spacing.x = 2.0;
                for (icon, name, enabled, key, command) in [
                    (
                        icons::PREVIOUS,
                        "Previous frame",
                        state.frame > 0,
                        "←",
                        Command::View(ViewCommand::StepFrame(-1)),
                    ),
                    (
                        icon,
                        name,
                        state.frames > 1,
                        "Space",
                        Command::View(ViewCommand::TogglePlay),
                    ),
                    (
                        icons::NEXT,
                        "Next frame",
                        state.frame < last,
                        "→",
                        Command::View(ViewCommand::StepFrame(1)),
                    ),
                ] {
                    let hint = format!("{name}. Key: {key}");
                    if icons::named_ui(ui, enabled, icons::alone(icon), name)
                        .on_hover_text(hint)
                        .clicked()
                    {
                        out.push(command);
                    }
                }
            });
            let mut frame = state.frame;
            let field = egui::DragValue::new(&mut frame).range(0..=last).speed(0.1);
            let label = ui.label("Frame");
            let response = ui.add(field).labelled_by(label.id);
            if response.changed() {
                out.push(Command::View(ViewCommand::Frame(frame)));
            }
            let seconds = state.frame as f64 / state.frame_rate;
            ui.label(format!("0–{last}"))
                .on_hover_text(format!("{} frames", state.frames));
            ui.label(egui::RichText::new(format!("{seconds:.2} s")).color(theme::QUIET))
                .on_hover_text(format!("{} frames a second", state.frame_rate));
            self.bar_ui(ui, context, out);
        });
    }

    /// The bar itself. Predicted frames are marked: they play without waiting.
    fn bar_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let state = context.state;
        let size = vec2(ui.available_width(), 28.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::slider(true, state.frame as f64, "Scrub bar"));
        let track = Track {
            rect: rect.shrink2(vec2(GAP, 0.0)),
            frames: state.frames,
        };
        track.ruler(ui);
        let painter = ui.painter();
        painter.rect_filled(track.rect.shrink2(vec2(0.0, 9.0)), 2.0, theme::WELL);
        let (first, last) = state.export_options.range(state.frames);
        if (first, last) != (0, state.frames.saturating_sub(1)) {
            let range = track
                .span(first, 9.0, 19.0)
                .union(track.span(last, 9.0, 19.0));
            painter.rect_filled(range, 2.0, Color32::from_gray(72));
        }
        for &frame in context.relit.iter().flat_map(|relit| &relit.frames_at_hand) {
            painter.rect_filled(track.span(frame, 12.0, 16.0), 0.0, theme::CACHED);
        }
        let trust = context.review.confidence();
        for unlike in trust.iter().flat_map(|report| report.unlike()) {
            let until = unlike.frame + trust.map_or(1, |report| report.every) - 1;
            let marked = track.span(unlike.frame, 9.0, 12.0);
            let marked =
                marked.union(track.span(until.min(state.frames.saturating_sub(1)), 9.0, 12.0));
            painter.rect_filled(marked, 0.0, theme::WARNING);
        }
        let head = track.span(state.frame, 4.0, 24.0);
        let head = Rect::from_center_size(
            head.center(),
            vec2(head.width().clamp(4.0, 10.0), head.height()),
        );
        painter.rect_filled(head, 2.0, theme::ACCENT);
        if let Some(at) = response.hover_pos().filter(|_| !response.dragged()) {
            let frame = track.frame_at(at.x);
            painter.text(
                track.span(frame, 0.0, 0.0).center_bottom(),
                Align2::CENTER_BOTTOM,
                frame,
                egui::FontId::proportional(12.0),
                theme::QUIET,
            );
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
        for of in Keyframed::ALL {
            self.keys_ui(ui, context, of, &track, out);
        }
    }

    /// A row of keys: yaw above the track, intensity below it.
    fn keys_ui(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        of: Keyframed,
        track: &Track,
        out: &mut Vec<Command>,
    ) {
        let state = context.state;
        let row = match of {
            Keyframed::Yaw => track.rect.top() + DIAMOND,
            Keyframed::Intensity => track.rect.bottom() - DIAMOND,
        };
        for (index, key) in state.look.keys(of).keys().iter().enumerate() {
            let frame = key.frame.round().max(0.0) as usize;
            let dragged = self
                .dragged
                .filter(|&(what, i, _)| (what, i) == (of, index));
            let shown = dragged.map_or(frame, |(.., over)| over);
            let at = pos2(track.span(shown, 0.0, 0.0).center().x, row);
            let spot = Rect::from_center_size(at, egui::Vec2::splat(2.5 * DIAMOND));
            let id = ui.scope_id().with(("key", of, index));
            let response = ui.interact(spot, id, Sense::click_and_drag());
            let name = format!("{} key at frame {frame}", of.name());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
            let is_held = response.hovered() || response.has_focus() || dragged.is_some();
            let color = if is_held { Color32::WHITE } else { theme::KEY };
            diamond(ui.painter(), at, true, color);
            if response.clicked() {
                response.request_focus();
                out.push(Command::View(ViewCommand::Frame(frame)));
            }
            if let Some(to) = response
                .interact_pointer_pos()
                .filter(|_| response.dragged())
            {
                self.dragged = Some((of, index, track.frame_at(to.x)));
            }
            if response.drag_stopped()
                && let Some((.., to)) = self.dragged.take()
                && to != frame
            {
                let frame = to;
                out.push(Command::Look(LookCommand::MoveKey { of, index, frame }));
            }
            let delete = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
            if response.has_focus() && (delete(Key::Delete) || delete(Key::Backspace)) {
                out.push(Command::Look(LookCommand::RemoveKey { of, index }));
            }
            response.context_menu(|ui| menu_ui(ui, context, of, index, out));
            response.on_hover_text(format!(
                "{name}: {:.2}. Click to go there, drag to move it, Delete to remove it.",
                key.value
            ));
        }
    }
}

/// The menu of a key: remove it, or change how all keys of its row are interpolated.
fn menu_ui(
    ui: &mut Ui,
    context: &PanelContext,
    of: Keyframed,
    index: usize,
    out: &mut Vec<Command>,
) {
    if ui.button("Remove key").clicked() {
        out.push(Command::Look(LookCommand::RemoveKey { of, index }));
        ui.close();
    }
    let now = context.state.look.keys(of).interpolation;
    for (kind, name) in [
        (Interpolation::Smooth, "smooth"),
        (Interpolation::Linear, "linear"),
    ] {
        let text = format!("{}: {name} between keys", of.name());
        if ui.radio(kind == now, text).clicked() {
            out.push(Command::Look(LookCommand::Interpolate(of, kind)));
            ui.close();
        }
    }
}

/// The diamond of a key, filled or outlined.
pub fn diamond(painter: &Painter, at: Pos2, filled: bool, color: Color32) {
    let corners = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)];
    let corners = corners.map(|(x, y)| at + DIAMOND * vec2(x, y)).to_vec();
    let (fill, edge) = if filled {
        (color, Color32::BLACK)
    } else {
        (Color32::TRANSPARENT, color)
    };
    painter.add(egui::Shape::convex_polygon(
        corners,
        fill,
        Stroke::new(1.0, edge),
    ));
}

/// The frames' positions along the bar.
struct Track {
    rect: Rect,
    frames: usize,
}

/// Height of the ruler above the bar, and the least distance of its numbers and ticks, in points.
const RULER: f32 = 14.0;
const NUMBER: f32 = 44.0;
const TICK: f32 = 5.0;

/// How many frames lie between two marks at least `room` points apart, `cell` points a frame: 1, 2 or 5 times a power of ten.
fn step(room: f32, cell: f32) -> usize {
    let mut decade = 1usize;
    loop {
        for times in [1, 2, 5] {
            let step = times * decade;
            if step as f32 * cell >= room || decade > 1_000_000_000 {
                return step;
            }
        }
        decade *= 10;
    }
}

impl Track {
    /// The rectangle of a frame, from `top` to `bottom` points below the bar's upper edge.
    fn span(&self, frame: usize, top: f32, bottom: f32) -> Rect {
        let cell = self.rect.width() / self.frames.max(1) as f32;
        let left = self.rect.left() + frame as f32 * cell;
        Rect::from_min_max(
            pos2(left, self.rect.top() + top),
            pos2(left + cell, self.rect.top() + bottom),
        )
    }

    /// Ticks and numbers of frames above the bar, where there is room.
    fn ruler(&self, ui: &Ui) {
        let top = self.rect.top() - RULER;
        if self.frames == 0 || top < ui.clip_rect().top() {
            return;
        }
        let cell = self.rect.width() / self.frames as f32;
        let painter = ui.painter();
        let numbered = step(NUMBER, cell);
        let ticked = step(TICK, cell).min(numbered);
        for frame in (0..self.frames).step_by(ticked) {
            let middle = self.span(frame, 0.0, 0.0).center().x;
            let has_number = frame % numbered == 0;
            let length = if has_number { 6.0 } else { 3.0 };
            let below = self.rect.top() + 4.0;
            let line = Stroke::new(1.0, Color32::from_gray(110));
            painter.vline(middle, below - length..=below, line);
            if has_number {
                let font = egui::FontId::proportional(11.0);
                let at = pos2(middle, below - length - 1.0);
                painter.text(at, Align2::CENTER_BOTTOM, frame, font, theme::QUIET);
            }
        }
    }

    fn frame_at(&self, x: f32) -> usize {
        let share = ((x - self.rect.left()) / self.rect.width().max(1.0)).clamp(0.0, 1.0);
        ((share * self.frames as f32) as usize).min(self.frames.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_far_enough_apart() {
        for (cell, expected) in [(50.0, 1), (44.0, 1), (30.0, 2), (9.0, 5), (0.5, 100)] {
            assert_eq!(step(NUMBER, cell), expected, "{cell}");
        }
        assert!(step(NUMBER, 0.0) > 1_000_000);
    }
}
