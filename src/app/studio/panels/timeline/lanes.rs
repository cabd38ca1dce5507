//! The lanes: one for each setting that has keys, with its name, its value and its keys.

use super::TimelinePanel;
use super::drag::{KeyDrag, push_changed};
use super::key_selection::KeySelection;
use super::track::Track;
use crate::command::{Command, LookCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::widgets::diamond::{self, DIAMOND, diamond};
use crate::panels::widgets::numbers::computing;
use crate::theme::{self, GAP};
use egui::{
    Align, Button, Color32, Layout, PointerButton, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, StrokeKind, Ui,
    UiBuilder, WidgetInfo, pos2, vec2,
};
use light::keyframes::{Key, Keyframes};
use scene::{Animation, Setting};

/// Height of a lane in points.
pub const ROW: f32 = 22.0;
/// Width of a lane's value, and of the button that opens its curve.
const VALUE: f32 = 84.0;
const CURVE: f32 = 24.0;

impl TimelinePanel {
    /// Begins to drag a key, and all keys selected with it.
    pub(super) fn grab(&mut self, of: Setting, key: Key, adds: bool, animation: &Animation) {
        if !self.selection.contains(of, key.frame) {
            if !adds {
                self.selection = KeySelection::default();
            }
            self.selection.add(of, key.frame);
        }
        self.chosen = Some(of);
        self.drag = Some(KeyDrag::Keys { key, before: animation.clone(), selection: self.selection.clone() });
    }

    /// The lanes with their keys, which can be selected, dragged and shaped.
    pub(super) fn lanes_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        (track, gutter): (&Track, f32),
        out: &mut Vec<Command>,
    ) {
        let lanes = lanes(context);
        let rows = self.names_ui(ui, context, gutter, out);
        let Some(first) = rows.first() else { return };
        let bottom = ui.clip_rect().bottom();
        let across = track.across.expand(DIAMOND);
        let down = first.top()..=first.top().max(bottom).max(first.top() + ROW * rows.len() as f32);
        let place = Rect::from_x_y_ranges(across, down);
        let id = ui.scope_id().with("keys");
        let area = ui.interact(place, id, Sense::click_and_drag());
        let ground = ui.painter();
        for row in &rows {
            let across = Rect::from_x_y_ranges(track.across, row.y_range());
            ground.rect_filled(across.shrink2(vec2(0.0, 1.0)), 2.0, theme::WELL);
            for frame in track.numbered() {
                let line = Stroke::new(1.0, theme::PANEL);
                ground.vline(track.x(frame as f64), across.y_range().shrink(1.0), line);
            }
        }
        let at = |row: usize, frame: f64| pos2(track.x(frame), rows[row].center().y);
        for (row, (of, keys)) in lanes.iter().enumerate() {
            for key in keys.keys() {
                let at = at(row, key.frame);
                if across.contains(at.x) {
                    self.key_ui(ui, context, (*of, key), at, out);
                }
            }
        }
        let key_at = |pos: Pos2| -> Option<(Setting, Key)> {
            let all = lanes.iter().enumerate();
            let all = all.flat_map(|(row, (of, keys))| {
                let keys = keys.keys().iter();
                keys.map(move |key| (*of, *key, at(row, key.frame)))
            });
            nearest(all, pos)
        };
        let lane_at = |pos: Pos2| {
            let row = rows.iter().position(|row| row.y_range().contains(pos.y))?;
            lanes.get(row).copied()
        };
        self.set_key_ui(context, &area, lane_at, track, out);
        self.drag_ui(ui, context, &area, track, key_at, out);
        area.context_menu(|ui| self.menu_ui(ui, context, out));
        let all = lanes.iter().enumerate();
        let all = all.flat_map(|(row, (of, keys))| {
            let keys = keys.keys().iter();
            keys.map(move |key| (*of, key.frame, at(row, key.frame)))
        });
        self.select_boxed(ui, &area, all);
    }

    /// The names of the lanes, as buttons that choose one, with their values. Returns the rectangles of the lanes.
    pub(super) fn names_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        gutter: f32,
        out: &mut Vec<Command>,
    ) -> Vec<Rect> {
        ui.spacing_mut().item_spacing.y = 0.0;
        let lanes = lanes(context);
        let mut rows = Vec::with_capacity(lanes.len());
        for (of, _) in lanes {
            let size = vec2(ui.available_width(), ROW);
            let (row, _) = ui.allocate_exact_size(size, Sense::hover());
            let left = row.with_max_x(row.left() + gutter);
            if self.chosen == Some(of) {
                ui.painter().rect_filled(left, 2.0, ui.visuals().faint_bg_color);
            }
            let beside =
                UiBuilder::new().id_salt(("lane", of)).max_rect(left).layout(Layout::right_to_left(Align::Center));
            // A separate child, so that it does not make the lane higher.
            self.name_ui(&mut ui.new_child(beside), context, of, out);
            rows.push(row);
        }
        rows
    }

    fn name_ui(&mut self, ui: &mut Ui, context: &PanelContext, of: Setting, out: &mut Vec<Command>) {
        let look = &context.state.look;
        let title = of.title(&look.lighting);
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().interact_size.y = ROW - 2.0;
        ui.spacing_mut().button_padding.y = 0.0;
        let lane = format!("{title} lane");
        diamond::after_ui(ui, context, (&[of], &lane), out);
        self.curve_button_ui(ui, of, &title);
        let unit = of.unit();
        let shown = |value: f32| unit.shown(f64::from(value)) as f32;
        let mut value = shown(look.value(of).unwrap_or_default());
        let range = of.range();
        let field = computing(&mut value)
            .speed(unit.speed())
            .range(shown(*range.start())..=shown(*range.end()))
            .fixed_decimals(unit.decimals())
            .suffix(unit.suffix());
        let width = VALUE.min(0.4 * ui.available_width());
        let field = ui.add_sized(vec2(width, ROW - 4.0), field);
        if field.changed() {
            let mut keys = look.keys(of).clone();
            let frame = context.state.frame as f64;
            let value = of.bounded(unit.of_shown(f64::from(value)));
            if keys.insert(frame, value).is_ok() {
                out.push(Command::Look(LookCommand::Keys(vec![(of, keys)])));
            }
        }
        let named = ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let is_chosen = self.chosen == Some(of);
            let text = RichText::new(&title).size(13.0);
            let name = Button::new(text).frame(false).truncate();
            let response = ui.add(name);
            response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_chosen, &lane));
            if response.clicked() {
                // A second click releases the lane, unless a curve is shown.
                let stays = self.curves || !is_chosen;
                self.chosen = stays.then_some(of);
            }
            if response.double_clicked() {
                self.chosen = Some(of);
                self.selection = KeySelection::lane(of, &look.animation);
            }
            response.context_menu(|ui| {
                if ui.button("Select all keys").clicked() {
                    self.selection = KeySelection::lane(of, &look.animation);
                    ui.close();
                }
                if ui.button("Remove all keys").clicked() {
                    out.push(Command::Look(LookCommand::Keys(vec![(of, Keyframes::NONE)])));
                    ui.close();
                }
            });
            let hint = format!("{title}: click to choose or release the lane, double-click to select its keys");
            response.on_hover_text(hint).id
        });
        field.labelled_by(named.inner);
    }

    /// The button that shows the curve of a lane, or the lanes again.
    fn curve_button_ui(&mut self, ui: &mut Ui, of: Setting, title: &str) {
        let (rect, response) = ui.allocate_exact_size(vec2(CURVE, ROW - 4.0), Sense::click());
        let is_on = self.curves && self.chosen == Some(of);
        let name = format!("Curve of {title}");
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_on, &name));
        let fill = match (is_on, response.hovered()) {
            (true, _) => ui.visuals().selection.bg_fill,
            (false, true) => ui.visuals().widgets.hovered.weak_bg_fill,
            (false, false) => ui.visuals().widgets.inactive.weak_bg_fill,
        };
        ui.painter().rect_filled(rect, 3.0, fill);
        theme::focus_ui(ui, rect, &response);
        let inner = rect.shrink2(vec2(5.0, 4.0));
        let points = (0..=12).map(|i| {
            let t = i as f32 / 12.0;
            inner.lerp_inside(vec2(t, 1.0 - t * t * (3.0 - 2.0 * t)))
        });
        let color = if is_on { Color32::WHITE } else { theme::TEXT };
        ui.painter().add(Shape::line(points.collect(), Stroke::new(1.5, color)));
        if response.clicked() {
            (self.curves, self.chosen) = (!is_on, Some(of));
        }
        response.on_hover_text(if is_on { "Show the lanes again" } else { "Show the curve: drag keys and tangents" });
    }

    /// A key's diamond: a click selects it and goes to its frame.
    pub(super) fn key_ui(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        (of, key): (Setting, &Key),
        at: Pos2,
        out: &mut Vec<Command>,
    ) {
        let look = &context.state.look;
        let frame = key.frame.round().max(0.0) as usize;
        let spot = Rect::from_center_size(at, egui::Vec2::splat(2.5 * DIAMOND));
        let id = ui.scope_id().with(("key", of, key.frame.to_bits()));
        let response = ui.interact(spot, id, Sense::click());
        let name = format!("{} key at frame {frame}", of.title(&look.lighting));
        let is_selected = self.selection.contains(of, key.frame);
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_selected, &name));
        let color = match (is_selected, response.hovered()) {
            (true, _) => theme::ACCENT,
            (false, true) => Color32::WHITE,
            (false, false) => theme::KEY,
        };
        diamond(ui.painter(), at, true, color);
        if response.has_focus() {
            self.has_focus = true;
            ui.painter().circle_stroke(at, DIAMOND + 2.5, Stroke::new(1.0, Color32::WHITE));
        }
        if response.clicked() {
            response.request_focus();
            self.chosen = Some(of);
            if ui.input(|input| input.modifiers.shift || input.modifiers.command) {
                self.selection.toggle(of, key.frame);
            } else {
                self.selection = KeySelection::one(of, key.frame);
                out.push(Command::View(ViewCommand::Frame(frame)));
            }
        }
        if response.secondary_clicked() && !is_selected {
            self.selection = KeySelection::one(of, key.frame);
        }
        response.context_menu(|ui| self.menu_ui(ui, context, out));
        let unit = of.unit();
        let hint = format!(
            "{name}: {:.*}{}. Click to go there, drag to move it, right-click to shape it, Delete to remove it.",
            unit.decimals(),
            unit.shown(key.value),
            unit.suffix()
        );
        theme::hint_at_rest_ui(response, hint);
    }

    /// A double-click on an empty place of a lane sets a key there, with the lane's value at that frame.
    pub(super) fn set_key_ui<'a>(
        &mut self,
        context: &PanelContext,
        area: &egui::Response,
        lane_at: impl Fn(Pos2) -> Option<(Setting, &'a Keyframes)>,
        track: &Track,
        out: &mut Vec<Command>,
    ) {
        let at = area.interact_pointer_pos().filter(|_| area.double_clicked());
        let Some((at, (of, keys))) = at.and_then(|at| Some((at, lane_at(at)?))) else { return };
        let frame = track.frame_at(at.x) as f64;
        let mut keys = keys.clone();
        let value = of.bounded(keys.at(frame).unwrap_or_default());
        if keys.insert(frame, value).is_ok() {
            (self.chosen, self.selection) = (Some(of), KeySelection::one(of, frame));
            push_changed(vec![(of, keys)], &context.state.look.animation, out);
        }
    }

    /// Moves the selected keys while one of them is dragged.
    fn drag_ui(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        area: &egui::Response,
        track: &Track,
        key_at: impl Fn(Pos2) -> Option<(Setting, Key)>,
        out: &mut Vec<Command>,
    ) {
        let shift = ui.input(|input| input.modifiers.shift);
        let animation = &context.state.look.animation;
        if area.clicked() && !area.double_clicked() && !shift {
            self.selection = KeySelection::default();
        }
        if area.drag_started_by(PointerButton::Primary)
            && let Some(from) = ui.input(|input| input.pointer.press_origin())
        {
            // Clears a drag that was interrupted.
            (self.drag, self.boxed) = (None, None);
            match key_at(from) {
                Some((of, key)) => self.grab(of, key, shift, animation),
                None => self.boxed = Some([from; 2]),
            }
        }
        if let (Some(KeyDrag::Keys { key, before, selection }), Some(to)) = (&self.drag, area.interact_pointer_pos())
            && area.dragged_by(PointerButton::Primary)
        {
            let frames = track.frame_at(to.x) as f64 - key.frame;
            let last = context.state.playback.frames.saturating_sub(1);
            let (lanes, moved) = selection.moved(before, frames, 0.0, last);
            self.selection = moved;
            push_changed(lanes, animation, out);
        }
        if area.drag_stopped() {
            self.drag = None;
        }
    }

    /// Draws the selection box, and selects the keys in it when the drag ends.
    pub(super) fn select_boxed(
        &mut self,
        ui: &Ui,
        area: &egui::Response,
        keys: impl Iterator<Item = (Setting, f64, Pos2)>,
    ) {
        let Some([from, to]) = &mut self.boxed else { return };
        if let Some(now) = area.interact_pointer_pos() {
            *to = now;
        }
        let drawn = Rect::from_two_pos(*from, *to);
        if area.drag_stopped() {
            self.boxed = None;
            if !ui.input(|input| input.modifiers.shift) {
                self.selection = KeySelection::default();
            }
            for (of, frame, _) in keys.filter(|(.., at)| drawn.contains(*at)) {
                self.selection.add(of, frame);
            }
        } else {
            let edge = Stroke::new(1.0, theme::TEXT);
            let fill = Color32::from_white_alpha(16);
            ui.painter().rect(drawn, 0.0, fill, edge, StrokeKind::Inside);
        }
    }

    /// Text shown without a lane.
    pub(super) fn empty_ui(ui: &Ui, rect: Rect) {
        let text = "Nothing is animated. Click the diamond beside a setting to set its first key.";
        let font = egui::FontId::proportional(12.0);
        let text = ui.painter().layout(text.to_owned(), font, theme::QUIET, rect.width() - GAP);
        ui.painter().galley(rect.min + vec2(0.0, 4.0), text, theme::QUIET);
    }
}

/// The settings with keys.
pub fn lanes<'a>(context: &'a PanelContext) -> Vec<(Setting, &'a Keyframes)> {
    context.state.look.animation.lanes().collect()
}

/// The key drawn at a position, if any.
pub fn nearest(keys: impl Iterator<Item = (Setting, Key, Pos2)>, pos: Pos2) -> Option<(Setting, Key)> {
    let far = |at: Pos2| at.distance(pos);
    let near = keys.filter(|(.., at)| far(*at) <= 1.6 * DIAMOND);
    let nearest = near.min_by(|(.., a), (.., b)| far(*a).total_cmp(&far(*b)));
    nearest.map(|(of, key, _)| (of, key))
}
