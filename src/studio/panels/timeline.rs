//! The scrub bar: which frame, and whether it plays.

use crate::studio::command::Command;
use crate::studio::panel::Sight;
use crate::studio::theme::{self, GAP};
use egui::{Align2, Rect, Sense, Ui, pos2, vec2};

/// The timeline keeps nothing.
#[derive(Default)]
pub struct TimelinePanel;

impl TimelinePanel {
    pub fn ui(&mut self, ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
        let state = sight.state;
        ui.horizontal_centered(|ui| {
            let text = if state.playing { "Pause" } else { "Play" };
            let play = egui::Button::new(text).min_size(vec2(84.0, 28.0));
            if ui.add_enabled(state.frames > 1, play).clicked() {
                out.push(Command::TogglePlay);
            }
            let last = state.frames.saturating_sub(1);
            let mut frame = state.frame;
            let field = egui::DragValue::new(&mut frame).range(0..=last).speed(0.1);
            let label = ui.label("Frame");
            let response = ui.add(field).labelled_by(label.id);
            if response.changed() {
                out.push(Command::Frame(frame));
            }
            let seconds = state.frame as f64 / state.frame_rate;
            ui.label(format!("of {last}"));
            ui.label(egui::RichText::new(format!("{seconds:.2} s")).color(theme::QUIET))
                .on_hover_text(format!("{} frames a second", state.frame_rate));
            bar_ui(ui, sight, out);
        });
    }
}

/// The bar itself: frames at hand are marked, since they play without waiting.
fn bar_ui(ui: &mut Ui, sight: &Sight, out: &mut Vec<Command>) {
    let state = sight.state;
    let size = vec2(ui.available_width(), 28.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::slider(true, state.frame as f64, "Scrub bar"));
    let track = rect.shrink2(vec2(GAP, 0.0));
    let cell = track.width() / state.frames.max(1) as f32;
    let span = |frame: usize, top: f32, bottom: f32| {
        let left = track.left() + frame as f32 * cell;
        Rect::from_min_max(
            pos2(left, rect.top() + top),
            pos2(left + cell, rect.top() + bottom),
        )
    };
    let painter = ui.painter();
    painter.rect_filled(track.shrink2(vec2(0.0, 9.0)), 2.0, theme::WELL);
    for &frame in sight.relit.iter().flat_map(|relit| &relit.frames_at_hand) {
        painter.rect_filled(span(frame, 12.0, 16.0), 0.0, theme::ACCENT_DIM);
    }
    let head = span(state.frame, 4.0, 24.0);
    let head = Rect::from_center_size(
        head.center(),
        vec2(head.width().clamp(4.0, 10.0), head.height()),
    );
    painter.rect_filled(head, 2.0, theme::ACCENT);
    if let Some(at) = response.hover_pos().filter(|_| !response.dragged()) {
        let frame = frame_at(at.x, track, state.frames);
        let label = span(frame, 0.0, 0.0).center_bottom();
        painter.text(
            label,
            Align2::CENTER_BOTTOM,
            frame,
            egui::FontId::proportional(12.0),
            theme::QUIET,
        );
    }
    if let Some(at) = response.interact_pointer_pos() {
        let frame = frame_at(at.x, track, state.frames);
        if (response.clicked() || response.dragged()) && frame != state.frame {
            out.push(Command::Frame(frame));
        }
    }
}

fn frame_at(x: f32, track: Rect, frames: usize) -> usize {
    let share = ((x - track.left()) / track.width().max(1.0)).clamp(0.0, 1.0);
    ((share * frames as f32) as usize).min(frames.saturating_sub(1))
}
