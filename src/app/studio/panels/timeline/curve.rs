//! The curve of a lane over the frames, with keys and tangents to drag, in front of the other lanes' curves.

use super::TimelinePanel;
use super::drag::{KeyDrag, Side, push_changed, turned};
use super::key_selection::KeySelection;
use super::lanes::nearest;
use super::track::Track;
use crate::command::Command;
use crate::panel_context::PanelContext;
use crate::panels::widgets::diamond::DIAMOND;
use crate::theme::{self, GAP};
use egui::{
    Align2, Color32, CursorIcon, FontId, PointerButton, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};
use light::keyframes::Keyframes;
use scene::{Setting, Unit};
use std::time::Duration;

/// Length of a tangent in points, and radius of the knob at its end.
const TANGENT: f32 = 44.0;
const KNOB: f32 = 4.0;
/// Least distance of grid lines in points.
const GRID: f32 = 26.0;
/// A vertical drag by fewer points leaves the value unchanged.
const STILL: f32 = 4.0;
/// Greatest distance in points from which a click chooses another lane's curve.
const NEAR: f32 = 6.0;

/// Positions of frames and values.
#[derive(Clone, Copy)]
struct Plot {
    track: Track,
    rect: Rect,
    /// Values at the bottom and at the top.
    values: [f64; 2],
}

impl Plot {
    /// Points per unit of value.
    fn scale(&self) -> f64 {
        f64::from(self.rect.height()) / (self.values[1] - self.values[0])
    }

    fn at(&self, frame: f64, value: f64) -> Pos2 {
        let up = (value - self.values[0]) * self.scale();
        pos2(self.track.x(frame), self.rect.bottom() - up as f32)
    }

    /// The same for another curve, which fills the plot by its own values.
    fn for_curve(&self, of: Setting, keys: &Keyframes) -> Self {
        Self { values: span(of, keys, self.track.frames), ..*self }
    }

    /// The curve's points, from left to right.
    fn line(&self, of: Setting, keys: &Keyframes) -> Vec<Pos2> {
        let columns = (self.rect.width().ceil().max(1.0) as usize).min(4096);
        let frames = (0..=columns).map(|i| self.track.between(i as f64 / columns as f64));
        let value = |frame| of.bounded(keys.at(frame).unwrap_or_default());
        frames.map(|frame| self.at(frame, value(frame))).collect()
    }

    fn value(&self, y: f32) -> f64 {
        self.values[0] + f64::from(self.rect.bottom() - y) / self.scale()
    }

    /// The knob of a tangent of a key with this slope, within the plot.
    fn knob(&self, key: Pos2, side: Side, slope: f64) -> Pos2 {
        let along = vec2(self.track.cell(), (-slope * self.scale()) as f32);
        let along = side.sign() * along.normalized();
        let room = if along.y < 0.0 { key.y - self.rect.top() } else { self.rect.bottom() - key.y };
        let length = (room - KNOB).max(2.0 * KNOB) / along.y.abs().max(1e-3);
        key + length.min(TANGENT) * along
    }
}

/// Range of a curve's values over a clip, with a margin.
fn span(of: Setting, keys: &Keyframes, frames: usize) -> [f64; 2] {
    let last = frames.saturating_sub(1) as f64;
    let along = (0..=200).map(|i| last * f64::from(i) / 200.0);
    let keyed = keys.keys().iter().map(|key| key.frame);
    let values = along.chain(keyed).filter_map(|frame| keys.at(frame));
    let (least, most) = values
        .map(|value| of.bounded(value))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)));
    let room = (0.15 * (most - least)).max(f64::from(of.unit().step()));
    [least - room, most + room]
}

/// Distance of grid lines, at least `least`: 1, 2 or 5 times a power of ten.
fn grid(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|times| times * decade);
    (steps.into_iter().find(|step| *step >= least)).unwrap_or(steps[3])
}

impl TimelinePanel {
    pub(super) fn curve_ui(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        of: Setting,
        (track, rect): (Track, Rect),
        out: &mut Vec<Command>,
    ) {
        let look = &context.state.look;
        let keys = look.keys(of);
        if self.drag.is_none() {
            self.values = span(of, keys, context.state.playback.frames);
        }
        let plot = Plot { track, rect: rect.shrink2(vec2(0.0, 2.0)), values: self.values };
        let others = look.animation.lanes().filter(|(other, _)| *other != of);
        let others: Vec<(Setting, Vec<Pos2>)> =
            others.map(|(other, keys)| (other, plot.for_curve(other, keys).line(other, keys))).collect();
        plot_ui(ui, of, (keys, &others), &plot, context.state.frame);
        let area = ui.interact(rect, ui.scope_id().with("curve"), Sense::click_and_drag());
        let tangents = self.tangents_ui(ui, context, of, &plot);
        for key in keys.keys() {
            let at = plot.at(key.frame, key.value);
            if track.across.expand(DIAMOND).contains(at.x) {
                self.key_ui(ui, context, (of, key), at, out);
            }
        }
        let pointer = area.hover_pos().filter(|_| !ui.input(|input| input.pointer.is_decidedly_dragging()));
        let own = plot.line(of, keys);
        let under = pointer.and_then(|at| under(&others, &own, at));
        if let Some(other) = under {
            ui.set_cursor_icon(CursorIcon::PointingHand);
            area.show_tooltip_text(other.title(&look.lighting));
        }
        self.drag_curve_ui(ui, context, (of, keys), &area, (&plot, &tangents), out);
        self.choose_ui(ui, &area, under);
        let all = keys.keys().iter();
        let all = all.map(|key| (of, key.frame, plot.at(key.frame, key.value)));
        self.select_boxed(ui, &area, all);
    }

    /// Chooses the lane whose curve was clicked, unless a second click follows: that sets a key of the edited lane.
    fn choose_ui(&mut self, ui: &Ui, area: &Response, under: Option<Setting>) {
        let (now, plain) = ui.input(|input| (input.time, input.modifiers.is_none()));
        if area.double_clicked() {
            self.clicked = None;
        } else if let Some(other) = under.filter(|_| plain && area.clicked()) {
            self.clicked = Some((other, now));
        }
        let Some((other, since)) = self.clicked else { return };
        let left = ui.ctx().options(|options| options.input_options.max_double_click_delay);
        let left = left - (now - since);
        if left > 0.0 {
            ui.request_repaint_after(Duration::from_secs_f64(left));
        } else {
            (self.clicked, self.chosen) = (None, Some(other));
            self.selection = KeySelection::default();
        }
    }

    /// The tangents of the selected keys. Returns each with its key's index and the place of its knob.
    fn tangents_ui(&mut self, ui: &Ui, context: &PanelContext, of: Setting, plot: &Plot) -> Vec<(usize, Side, Pos2)> {
        let look = &context.state.look;
        let keys = look.keys(of);
        let painter = ui.painter().with_clip_rect(plot.rect.expand(KNOB));
        let mut knobs = Vec::new();
        for (index, key) in keys.keys().iter().enumerate() {
            let slopes = keys.slopes(index).unwrap_or_default();
            let own = [key.slope_in, key.slope_out];
            if !self.selection.contains(of, key.frame) {
                continue;
            }
            for (side, (slope, own)) in Side::BOTH.into_iter().zip(slopes.into_iter().zip(own)) {
                if !side.is_shaped(keys, index) {
                    continue;
                }
                let at = plot.at(key.frame, key.value);
                let knob = plot.knob(at, side, slope);
                if !plot.rect.expand(KNOB).contains(knob) {
                    continue;
                }
                let spot = Rect::from_center_size(knob, Vec2::splat(3.5 * KNOB));
                let id = ui.scope_id().with(("tangent", side, index));
                let response = ui.interact(spot, id, Sense::click());
                let title = of.title(&look.lighting);
                let name = format!("{title} tangent {} at frame {}", side.name(), key.frame);
                response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, &name));
                let color = if response.hovered() { Color32::WHITE } else { theme::TEXT };
                painter.line_segment([at, knob], Stroke::new(1.0, color));
                match own {
                    Some(_) => painter.circle_filled(knob, KNOB, color),
                    None => painter.circle(knob, KNOB, theme::WELL, Stroke::new(1.5, color)),
                };
                response.on_hover_text(format!("{name}: drag it. Alt leaves the other side unchanged"));
                knobs.push((index, side, knob));
            }
        }
        knobs
    }

    /// Moves keys and turns tangents.
    fn drag_curve_ui(
        &mut self,
        ui: &Ui,
        context: &PanelContext,
        (of, keys): (Setting, &Keyframes),
        area: &Response,
        (plot, tangents): (&Plot, &[(usize, Side, Pos2)]),
        out: &mut Vec<Command>,
    ) {
        let animation = &context.state.look.animation;
        let (modifiers, from) = ui.input(|i| (i.modifiers, i.pointer.press_origin()));
        if area.clicked() && !area.double_clicked() && !modifiers.shift {
            self.selection = KeySelection::default();
        }
        self.set_key_ui(context, area, |_| Some((of, keys)), &plot.track, out);
        area.context_menu(|ui| self.menu_ui(ui, context, out));
        if let Some(from) = from.filter(|_| area.drag_started_by(PointerButton::Primary)) {
            // Clears a drag that was interrupted.
            (self.drag, self.boxed) = (None, None);
            let knob = tangents.iter().find(|(.., at)| at.distance(from) < 2.0 * KNOB);
            let all = keys.keys().iter();
            let all = all.map(|key| (of, *key, plot.at(key.frame, key.value)));
            match (knob, nearest(all, from)) {
                (Some((index, side, _)), _) => {
                    self.drag = Some(KeyDrag::Tangent { of, index: *index, side: *side, before: keys.clone() });
                }
                (None, Some((_, key))) => {
                    self.selection = self.selection.within(of);
                    // Here Shift keeps the frame, so it does not add to the selection.
                    self.grab(of, key, false, animation);
                }
                (None, None) => self.boxed = Some([from; 2]),
            }
        }
        if let Some((from, to)) = from.zip(area.interact_pointer_pos())
            && area.dragged_by(PointerButton::Primary)
        {
            match &self.drag {
                Some(KeyDrag::Keys { key, before, selection }) => {
                    let frames = if modifiers.shift { 0.0 } else { plot.track.frame_at(to.x) as f64 - key.frame };
                    let value = if (to.y - from.y).abs() < STILL { 0.0 } else { plot.value(to.y) - plot.value(from.y) };
                    let last = context.state.playback.frames.saturating_sub(1);
                    let (lanes, moved) = selection.moved(before, frames, value, last);
                    self.selection = moved;
                    push_changed(lanes, animation, out);
                }
                Some(KeyDrag::Tangent { of, index, side, before }) => {
                    if let Some(key) = before.keys().get(*index) {
                        let at = plot.at(key.frame, key.value);
                        let along = side.sign() * (to.x - at.x) / plot.track.cell();
                        let frames = f64::from(side.sign() * along.max(0.1));
                        let slope = (plot.value(to.y) - key.value) / frames;
                        let keys = turned(before, *index, *side, slope, modifiers.alt);
                        push_changed(vec![(*of, keys)], animation, out);
                    }
                }
                None => {}
            }
        }
        if area.drag_stopped() {
            self.drag = None;
        }
    }
}

/// The lane whose curve in `others` is nearest to a place; None beyond [`NEAR`], and nearer to the curve `own`.
fn under(others: &[(Setting, Vec<Pos2>)], own: &[Pos2], at: Pos2) -> Option<Setting> {
    let distance = |line: &[Pos2]| {
        let segments = line.windows(2).filter(|two| (two[0].x - at.x).abs() < 2.0 * NEAR);
        let distances = segments.map(|two| {
            let along = two[1] - two[0];
            let share = (at - two[0]).dot(along) / along.length_sq().max(1e-6);
            at.distance(two[0] + share.clamp(0.0, 1.0) * along)
        });
        distances.fold(f32::INFINITY, f32::min)
    };
    let others = others.iter().map(|(of, line)| (*of, distance(line)));
    let (other, far) = others.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (far < NEAR && far < distance(own)).then_some(other)
}

/// The grid, the curve, and the other lanes' curves behind it, each over its own values.
fn plot_ui(ui: &Ui, of: Setting, (keys, others): (&Keyframes, &[(Setting, Vec<Pos2>)]), plot: &Plot, frame: usize) {
    let (rect, track) = (plot.rect, plot.track);
    let painter = ui.painter().with_clip_rect(rect.expand(1.0).intersect(ui.clip_rect()));
    painter.rect_filled(rect, 2.0, theme::WELL);
    let line = Stroke::new(1.0, Color32::from_gray(44));
    for frame in track.numbered() {
        painter.vline(track.x(frame as f64), rect.y_range(), line);
    }
    let step = grid(f64::from(GRID) / plot.scale());
    let unit = of.unit();
    let shown = if unit == Unit::Share { unit.shown(step) } else { step };
    let decimals = (-shown.log10().floor()).clamp(0.0, 4.0) as usize;
    let first = (plot.values[0] / step).ceil();
    for i in 0..64 {
        let value = (first + f64::from(i)) * step;
        let y = plot.at(0.0, value).y;
        if y < rect.top() {
            break;
        }
        painter.hline(rect.x_range(), y, line);
        let text = if unit == Unit::Energy && value <= 0.0 {
            // Zero energy is −∞ stops. Energy cannot be negative.
            if value < 0.0 { "" } else { "off" }.to_owned()
        } else {
            // Adding 0 turns −0 into 0.
            format!("{:.decimals$}{}", unit.shown(value) + 0.0, unit.suffix())
        };
        let font = FontId::proportional(11.0);
        let at = pos2(rect.left() + GAP / 2.0, y - 1.0);
        painter.text(at, Align2::LEFT_BOTTOM, text, font, theme::QUIET);
    }
    let value = |frame: f64| of.bounded(keys.at(frame).unwrap_or_default());
    let behind = Stroke::new(1.0, Color32::from_gray(96));
    for (_, line) in others {
        painter.add(Shape::line(line.clone(), behind));
    }
    painter.add(Shape::line(plot.line(of, keys), Stroke::new(1.5, theme::KEY)));
    let now = plot.at(frame as f64, value(frame as f64));
    painter.circle_filled(now, 3.0, theme::ACCENT);
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::Rangef;

    #[test]
    fn the_nearest_other_curve_is_found_and_the_own_one_goes_before() {
        let track = Track::new(Rangef::new(0.0, 100.0), 11, None);
        let rect = Rect::from_min_size(pos2(0.0, 20.0), vec2(100.0, 80.0));
        let rising: Keyframes = "0:0,10:90".parse().unwrap();
        let plot = Plot { track, rect, values: span(Setting::Yaw, &rising, 11) };
        let own = plot.line(Setting::Yaw, &rising);
        let falling: Keyframes = "0:2,10:-2".parse().unwrap();
        let other = plot.for_curve(Setting::Exposure, &falling).line(Setting::Exposure, &falling);
        let ends = [other[0], other[other.len() - 1]];
        assert!(ends[0].y < 40.0 && ends[1].y > 80.0, "it fills the plot: {ends:?}");
        let others = [(Setting::Exposure, other.clone())];
        let at = |place| under(&others, &own, place);
        assert_eq!(at(other[10] + vec2(0.0, 3.0)), Some(Setting::Exposure));
        assert_eq!(at(other[10] + vec2(0.0, 3.0 * NEAR)), None);
        let crossing = own.iter().zip(&other).position(|(own, other)| own.y < other.y).unwrap();
        assert!(own[crossing].distance(other[crossing]) < NEAR);
        assert_eq!(at(own[crossing]), None, "the edited curve is in front");
        assert_eq!(under(&[], &own, own[10]), None);
    }

    #[test]
    fn lines_of_the_grid_are_round() {
        for (least, expected) in [(0.03, 0.05), (7.0, 10.0), (1.0, 1.0), (130.0, 200.0)] {
            let found = grid(least);
            assert!((found / expected - 1.0).abs() < 1e-9, "{least}: {found}");
        }
    }

    #[test]
    fn a_value_is_found_where_it_is_drawn_and_a_flat_curve_has_room() {
        let flat: Keyframes = "3:40".parse().unwrap();
        let values = span(Setting::Yaw, &flat, 10);
        assert_eq!(values, [30.0, 50.0]);
        let plot = Plot {
            track: Track::new(Rangef::new(0.0, 100.0), 10, None),
            rect: Rect::from_min_size(pos2(0.0, 20.0), vec2(100.0, 80.0)),
            values,
        };
        for value in [30.0, 41.5, 50.0] {
            let at = plot.at(4.0, value);
            assert!((plot.value(at.y) - value).abs() < 1e-4 && at.x == 45.0);
        }
        // A steep tangent's knob stays within the plot.
        for (side, slope) in [(Side::Out, 1e6), (Side::In, 1e6), (Side::Out, -1e6), (Side::In, 0.0)] {
            let knob = plot.knob(plot.at(4.0, 40.0), side, slope);
            assert!(plot.rect.contains(knob), "{side:?} {slope}: {knob:?}");
        }
    }
}
