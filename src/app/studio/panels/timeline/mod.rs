//! The timeline: playback, the scrub bar, and the lanes of animated settings with their keys and curves.

pub mod command;
mod curve;
mod drag;
mod key_selection;
mod lanes;
mod menu;
mod scrub;
mod track;

use crate::command::{Command, LookCommand, TimelineCommand, ViewCommand};
use crate::icons;
use crate::layout::{MARGIN, Pane, is_wide};
use crate::panel_context::PanelContext;
use crate::panels::widgets::numbers::computing;
use crate::state::State;
use crate::theme::{self, GAP};
use drag::{KeyDrag, push_changed};
use egui::{
    Button, CursorIcon, Event, Key, Label, Modifiers, PointerButton, Pos2, Rangef, Rect, RichText, ScrollArea, Stroke,
    Ui, UiBuilder, pos2, vec2,
};
use key_selection::{KeySelection, Onto, pasted};
use scene::{Animation, Setting};
use scrub::HANDLE;
use track::{FIT, RULER, Sight, Track};

/// Width of the lanes' names in points where the scrub bar is under the buttons.
const NARROW_NAMES: f32 = 148.0;
/// Least width in points of the buttons, and of the lanes' names below them.
const BUTTONS: f32 = 290.0;
/// Height of a message in points.
const NOTE: f32 = 36.0;

/// Holds the selection, the drag and the frames in sight.
#[derive(Default)]
pub struct TimelinePanel {
    selection: KeySelection,
    /// The lane that was chosen last: keys are pasted there, and its curve is shown.
    chosen: Option<Setting>,
    /// The chosen lane's curve is shown in place of the lanes.
    curves: bool,
    /// The lane whose curve was clicked behind the chosen one's, and the time in seconds.
    clicked: Option<(Setting, f64)>,
    drag: Option<KeyDrag>,
    /// Corners of the box that selects keys.
    boxed: Option<[Pos2; 2]>,
    /// Range of values in the curve's plot; fixed during a drag.
    values: [f64; 2],
    /// A key has the focus.
    has_focus: bool,
    /// Reason for a refusal, shown until the next press.
    note: Option<String>,
    /// Target of a paste, used once the system has sent the clipboard's contents.
    awaited: Option<Onto>,
    /// The frames in sight; None for all.
    sight: Option<Sight>,
    /// The current frame and the clip's number of frames when it was drawn last.
    drawn: (usize, usize),
    /// Position of the pointer while it pans the frames.
    held: Option<f32>,
    /// The pointer is over the timeline.
    is_hovered: bool,
    /// There are more lanes than fit: the wheel scrolls them.
    lanes_scroll: bool,
}

impl TimelinePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let look = &context.state.look;
        self.selection.keep(&look.animation);
        self.chosen = self.chosen.filter(|of| look.is_keyed(*of));
        let keyed = |(of, _): &(Setting, f64)| look.is_keyed(*of);
        self.clicked = self.clicked.filter(keyed).filter(|_| self.curves);
        self.has_focus = false;
        if ui.input(|input| input.pointer.any_pressed()) {
            (self.note, self.awaited) = (None, None);
        }
        let area = ui.available_rect_before_wrap();
        let is_wide = is_wide(area.width() + 2.0 * MARGIN);
        let head = area.with_max_y(area.top() + scrub::HEIGHT);
        let buttons = ui.scope_builder(UiBuilder::new().max_rect(head), |ui| {
            ui.horizontal_centered(|ui| {
                buttons_ui(ui, context, out);
                ui.min_rect().width()
            })
            .inner
        });
        let (gutter, top) =
            if is_wide { (buttons.inner.max(BUTTONS) + GAP, area.top()) } else { (NARROW_NAMES, head.bottom()) };
        // Leaves room for the scroll bar.
        let across = Rangef::new(area.left() + gutter + HANDLE, area.right() - HANDLE - GAP);
        let bar = Rect::from_x_y_ranges(across.expand(HANDLE), top..=top + scrub::HEIGHT);
        let track = self.track(ui, context.state, (area, bar.bottom()), across);
        scrub::scrub_ui(ui, context, &track, bar, out);
        if track.sight().is_some() {
            self.fit_ui(ui, pos2(across.max, bar.top()));
        }
        let below = area.with_min_y(bar.bottom() + 2.0);
        if look.animation.is_empty() {
            Self::empty_ui(ui, below);
        } else if below.is_positive() {
            self.below_ui(ui, context, (track, gutter), below, out);
            let head = Stroke::new(1.0, theme::ACCENT);
            let now = track.x(context.state.frame as f64);
            if track.has(now) {
                ui.painter().vline(now, below.y_range(), head);
            }
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

    /// True if the pointer is over the timeline.
    pub fn is_hovered(&self) -> bool {
        self.is_hovered
    }

    /// Applies the action of a keyboard key. Returns a command that the window must still apply.
    pub fn apply(&mut self, command: TimelineCommand, state: &State) -> Option<Command> {
        let animation = &state.look.animation;
        match command {
            TimelineCommand::ShowAll => self.sight = None,
            TimelineCommand::SelectAll => self.select_all(animation),
            TimelineCommand::StepKey(step) => {
                let frame = self.key_beside(step > 0, state)?;
                return Some(Command::View(ViewCommand::Frame(frame)));
            }
            TimelineCommand::Nudge(frames) if !self.selection.is_empty() => {
                let last = state.playback.frames.saturating_sub(1);
                let moved = self.selection.moved(animation, frames as f64, 0.0, last);
                self.selection = moved.1;
                return Some(Command::Look(LookCommand::Keys(moved.0)));
            }
            TimelineCommand::Nudge(_) => self.note = Some("Select keys to move them".to_owned()),
        }
        None
    }

    /// The nearest frame after the current one, or before it, with a key in the chosen lane, or in any if none is chosen.
    fn key_beside(&self, after: bool, state: &State) -> Option<usize> {
        let lanes = state.look.animation.lanes();
        let lanes = lanes.filter(|(of, _)| self.chosen.is_none_or(|chosen| chosen == *of));
        let frames = lanes.flat_map(|(_, keys)| keys.keys());
        let frames = frames.map(|key| key.frame.round().max(0.0) as usize);
        let frames = frames.filter(|frame| *frame < state.playback.frames);
        if after {
            frames.filter(|frame| *frame > state.frame).min()
        } else {
            frames.filter(|frame| *frame < state.frame).max()
        }
    }

    /// Selects all keys of the curve, or of the lanes.
    fn select_all(&mut self, animation: &Animation) {
        let curve = self.chosen.filter(|_| self.curves);
        self.selection = match curve {
            Some(of) => KeySelection::lane(of, animation),
            None => KeySelection::all(animation),
        };
    }

    /// The frames in sight: zoomed and panned by wheel and pointer, and moved to the current frame when that changes.
    fn track(&mut self, ui: &Ui, state: &State, (area, lanes): (Rect, f32), across: Rangef) -> Track {
        if self.drawn.1 != state.playback.frames {
            self.sight = None;
        }
        let with = |sight| Track::new(across, state.playback.frames, sight);
        if self.drawn.0 != state.frame {
            self.sight = with(self.sight).showing(state.frame);
        }
        self.drawn = (state.frame, state.playback.frames);
        self.is_hovered = ui.rect_contains_pointer(area);
        let pointer = ui.input(|input| input.pointer.latest_pos());
        if let Some(at) = pointer.filter(|_| self.is_hovered) {
            let (zoom, wheel) = ui.input(|input| (input.zoom_delta(), input.smooth_scroll_delta()));
            if zoom != 1.0 {
                self.sight = with(self.sight).zoomed(zoom, at.x);
            }
            let scrolls = self.lanes_scroll && at.y > lanes && !(self.curves && at.x > across.min);
            let along = wheel.x + if scrolls { 0.0 } else { wheel.y };
            if along != 0.0 {
                self.sight = with(self.sight).panned(along);
            }
        }
        let middle = PointerButton::Middle;
        let (pressed, down, origin) = ui.input(|input| {
            let pointer = &input.pointer;
            let pressed = pointer.button_pressed(middle);
            (pressed, pointer.button_down(middle), pointer.press_origin())
        });
        if pressed && self.is_hovered {
            self.held = origin.map(|origin| origin.x);
        }
        match (self.held.filter(|_| down), pointer) {
            (Some(from), Some(to)) => {
                self.sight = with(self.sight).panned(to.x - from);
                self.held = Some(to.x);
                ui.set_cursor_icon(CursorIcon::Grabbing);
            }
            _ => self.held = None,
        }
        with(self.sight)
    }

    /// The button that shows all frames, at the right end of the ruler.
    fn fit_ui(&mut self, ui: &mut Ui, corner: Pos2) {
        let least = corner + vec2(-FIT, 3.0);
        let place = Rect::from_min_size(least, vec2(FIT, RULER - 4.0));
        ui.painter().rect_filled(place, 2.0, theme::PANEL);
        ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
            ui.spacing_mut().interact_size.y = place.height();
            ui.spacing_mut().button_padding = vec2(3.0, 0.0);
            let icon = RichText::new(icons::FIT).size(12.0);
            let button = Button::new(icon).min_size(place.size());
            let response = icons::named_ui(ui, true, button, "Show all frames");
            if response.on_hover_text("Shows all frames. Key: F").clicked() {
                self.sight = None;
            }
        });
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
            let shown = lanes.show(ui, |ui| match curve {
                Some(_) => drop(self.names_ui(ui, context, gutter - GAP, out)),
                None => self.lanes_ui(ui, context, (&track, gutter - GAP), out),
            });
            self.lanes_scroll = shown.content_size.y > shown.inner_rect.height() + 1.0;
        });
        if let Some(of) = curve {
            let down = below.y_range();
            let plot = Rect::from_x_y_ranges(track.across, down.min..=down.max - 2.0);
            self.curve_ui(ui, context, of, (track, plot), out);
        }
    }

    /// Copies, pastes and removes keys, if the timeline has the keyboard.
    fn press_ui(&mut self, ui: &Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let is_ours = context.state.panes.active == Pane::Timeline || self.has_focus;
        let takes = is_ours || self.awaited.is_some();
        if !takes || context.state.covers.takes_keys() || ui.ctx().text_edit_focused() {
            return;
        }
        let (mut copies, mut cuts, mut pastes) = (false, false, None);
        ui.input_mut(|input| {
            input.events.retain(|event| {
                match event {
                    Event::Copy if is_ours => copies = true,
                    Event::Cut if is_ours => cuts = true,
                    Event::Paste(text) => pastes = Some(text.clone()),
                    _ => return true,
                }
                false
            });
        });
        let look = &context.state.look;
        let animation = &look.animation;
        if is_ours && !self.selection.is_empty() {
            if copies || cuts {
                ui.copy_text(self.selection.copied(animation));
            }
            let delete = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
            if cuts || delete(Key::Delete) || delete(Key::Backspace) {
                push_changed(self.selection.removed(animation), animation, out);
            }
        }
        if let Some(text) = pastes {
            let onto = self.awaited.take().unwrap_or(Onto::Lane(self.chosen));
            match pasted(&text, context.state.frame, onto, (animation, &look.lighting)) {
                Ok((lanes, selection)) => {
                    self.selection = selection;
                    push_changed(lanes, animation, out);
                }
                Err(why) => self.note = Some(why),
            }
        }
    }
}

/// The playback buttons, and the number of the current frame.
fn buttons_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let state = context.state;
    let last = state.playback.frames.saturating_sub(1);
    let (icon, name) = if state.playback.playing { (icons::PAUSE, "Pause") } else { (icons::PLAY, "Play") };
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for (icon, name, enabled, key, command) in [
            (icons::PREVIOUS, "Previous frame", state.frame > 0, "←", ViewCommand::StepFrame(-1)),
            (icon, name, state.playback.frames > 1, "Space", ViewCommand::TogglePlay),
            (icons::NEXT, "Next frame", state.frame < last, "→", ViewCommand::StepFrame(1)),
        ] {
            let hint = format!("{name}. Key: {key}");
            if icons::named_ui(ui, enabled, icons::alone(icon), name).on_hover_text(hint).clicked() {
                out.push(Command::View(command));
            }
        }
    });
    let mut frame = state.frame;
    let field = computing(&mut frame).range(0..=last).speed(0.1);
    let label = ui.label("Frame");
    let response = ui.add(field).labelled_by(label.id);
    if response.changed() {
        out.push(Command::View(ViewCommand::Frame(frame)));
    }
    let seconds = state.frame as f64 / state.playback.frame_rate;
    ui.label(format!("0–{last}")).on_hover_text(format!("{} frames", state.playback.frames));
    if let Some(number) = state.plate_number(state.frame) {
        ui.label(format!("plate {number}")).on_hover_text("Number in the name of the interview's file");
    }
    ui.label(RichText::new(format!("{seconds:.2} s")).color(theme::QUIET))
        .on_hover_text(format!("{} frames a second", state.playback.frame_rate));
}
