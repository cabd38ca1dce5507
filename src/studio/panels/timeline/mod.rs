//! The timeline: playback, the scrub bar, and the lanes of what is animated with their keys and curves.

mod curve;
mod drag;
mod lanes;
mod menu;
mod scrub;
mod track;

use crate::command::{Command, ViewCommand};
use crate::icons;
use crate::key_selection::{KeySelection, pasted};
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use drag::KeyDrag;
use egui::{
    DragValue, Event, Key, Label, Modifiers, Pos2, Rangef, Rect, RichText, ScrollArea, Stroke, Ui,
    UiBuilder,
};
use lanes::push_changed;
use scene::Setting;
use scrub::HANDLE;
use track::Track;

/// A pane of fewer points has the scrub bar below the buttons, not beside them, and lanes with names this wide.
const WIDE: f32 = 600.0;
const NARROW_NAMES: f32 = 148.0;
/// Least width in points of the buttons, and of the lanes' names below them.
const BUTTONS: f32 = 290.0;
/// Height of a message in points.
const NOTE: f32 = 36.0;

/// Holds what is selected, and what is being dragged.
#[derive(Default)]
pub struct TimelinePanel {
    selection: KeySelection,
    /// The lane that was chosen last: keys are pasted there, and its curve is shown.
    chosen: Option<Setting>,
    /// The chosen lane's curve is shown in place of the lanes.
    curves: bool,
    drag: Option<KeyDrag>,
    /// Corners of the box that selects keys.
    boxed: Option<[Pos2; 2]>,
    /// The values that the curve's plot spans; they stay while something is dragged.
    values: [f64; 2],
    /// A key has the focus.
    has_focus: bool,
    /// Why something could not be done, until the next press.
    note: Option<String>,
}

impl TimelinePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let look = &context.state.look;
        self.selection.keep(&look.animation);
        self.chosen = self.chosen.filter(|of| look.is_keyed(*of));
        self.has_focus = false;
        if ui.input(|input| input.pointer.any_pressed()) {
            self.note = None;
        }
        let area = ui.available_rect_before_wrap();
        let is_wide = area.width() >= WIDE;
        let head = area.with_max_y(area.top() + scrub::HEIGHT);
        let buttons = ui.scope_builder(UiBuilder::new().max_rect(head), |ui| {
            ui.horizontal_centered(|ui| {
                buttons_ui(ui, context, out);
                ui.min_rect().width()
            })
            .inner
        });
        let (gutter, top) = match is_wide {
            true => (buttons.inner.max(BUTTONS) + GAP, area.top()),
            false => (NARROW_NAMES, head.bottom()),
        };
        // The bar to scroll by covers nothing.
        let across = Rangef::new(area.left() + gutter + HANDLE, area.right() - HANDLE - GAP);
        let track = Track {
            across,
            frames: context.state.frames,
        };
        let bar = Rect::from_x_y_ranges(across.expand(HANDLE), top..=top + scrub::HEIGHT);
        scrub::scrub_ui(ui, context, &track, bar, out);
        let below = area.with_min_y(bar.bottom() + 2.0);
        if look.animation.is_empty() {
            Self::empty_ui(ui, below);
        } else if below.is_positive() {
            self.below_ui(ui, context, (track, gutter), below, out);
            let head = Stroke::new(1.0, theme::ACCENT);
            let now = track.x(context.state.frame as f64);
            ui.painter().vline(now, below.y_range(), head);
        }
        self.press_ui(ui, context, out);
        if let Some(note) = &self.note {
            let place = area.with_min_y(area.bottom() - NOTE);
            let place = place.with_max_x(area.left() + gutter);
            ui.painter().rect_filled(place, 0.0, theme::PANEL);
            let text = RichText::new(note).small().color(theme::WARNING);
            ui.put(place, Label::new(text).wrap());
        }
    }

    /// The lanes, or their names beside a curve.
    fn below_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        (track, gutter): (Track, f32),
        below: Rect,
        out: &mut Vec<Command>,
    ) {
        let curve = self.chosen.filter(|_| self.curves);
        let place = match curve {
            Some(_) => below.with_max_x(below.left() + gutter),
            None => below,
        };
        ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
            let lanes = ScrollArea::vertical().id_salt("lanes").auto_shrink(false);
            lanes.show(ui, |ui| match curve {
                Some(_) => drop(self.names_ui(ui, context, gutter - GAP, out)),
                None => self.lanes_ui(ui, context, (&track, gutter - GAP), out),
            });
        });
        if let Some(of) = curve {
            let down = below.y_range();
            let plot = Rect::from_x_y_ranges(track.across, down.min..=down.max - 2.0);
            self.curve_ui(ui, context, of, (track, plot), out);
        }
    }

    /// Copies, pastes and removes keys, if the keyboard is the timeline's.
    fn press_ui(&mut self, ui: &Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let is_ours = context.state.active == Pane::Timeline || self.has_focus;
        if !is_ours || ui.ctx().text_edit_focused() {
            return;
        }
        let (mut copies, mut cuts, mut pastes) = (false, false, None);
        ui.input_mut(|input| {
            input.events.retain(|event| {
                match event {
                    Event::Copy => copies = true,
                    Event::Cut => cuts = true,
                    Event::Paste(text) => pastes = Some(text.clone()),
                    _ => return true,
                }
                false
            });
        });
        let look = &context.state.look;
        let animation = &look.animation;
        if !self.selection.is_empty() {
            if copies || cuts {
                ui.copy_text(self.selection.copied(animation));
            }
            let delete = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
            if cuts || delete(Key::Delete) || delete(Key::Backspace) {
                push_changed(self.selection.removed(animation), animation, out);
            }
        }
        if let Some(text) = pastes {
            let onto = self.chosen;
            match pasted(
                &text,
                context.state.frame,
                onto,
                (animation, &look.lighting),
            ) {
                Ok((lanes, selection)) => {
                    self.selection = selection;
                    push_changed(lanes, animation, out);
                }
                Err(why) => self.note = Some(why),
            }
        }
    }
}

/// The buttons that play, and the number of the current frame.
fn buttons_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let state = context.state;
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
                ViewCommand::StepFrame(-1),
            ),
            (
                icon,
                name,
                state.frames > 1,
                "Space",
                ViewCommand::TogglePlay,
            ),
            (
                icons::NEXT,
                "Next frame",
                state.frame < last,
                "→",
                ViewCommand::StepFrame(1),
            ),
        ] {
            let hint = format!("{name}. Key: {key}");
            if icons::named_ui(ui, enabled, icons::alone(icon), name)
                .on_hover_text(hint)
                .clicked()
            {
                out.push(Command::View(command));
            }
        }
    });
    let mut frame = state.frame;
    let field = DragValue::new(&mut frame).range(0..=last).speed(0.1);
    let label = ui.label("Frame");
    let response = ui.add(field).labelled_by(label.id);
    if response.changed() {
        out.push(Command::View(ViewCommand::Frame(frame)));
    }
    let seconds = state.frame as f64 / state.frame_rate;
    ui.label(format!("0–{last}"))
        .on_hover_text(format!("{} frames", state.frames));
    ui.label(RichText::new(format!("{seconds:.2} s")).color(theme::QUIET))
        .on_hover_text(format!("{} frames a second", state.frame_rate));
}
