//! The picture, alone or compared with another; without a picture, the steps that are missing.

mod aim;
mod canvas;
pub mod cell;
pub mod command;
mod compared;
mod doubts;
mod four;
pub mod four_pictures;
mod gizmo;
mod handler;
mod instead;
pub mod light_aim;
mod look_list;
mod native_texture;
pub mod readout;
pub mod side;
mod toolbar;
mod viewing;

use crate::command::{Command, LookCommand, ViewCommand};
use crate::comparison::CompareMode;
use crate::icons;
use crate::layout::Pane;
use crate::panel_context::PanelContext;
use crate::panels::environments::library::PanoramaState;
use crate::panels::widgets::notice::{TEXT_WIDTH, backdrop_ui, dismiss_ui, notice_ui};
use crate::region::Region;
use crate::theme::{self, GAP};
use canvas::{label, paint, placed, texture, zoom};
use cell::CellUi;
use doubts::Doubts;
use eframe::egui_wgpu::RenderState;
use egui::{
    Align2, Color32, CursorIcon, FontId, PointerButton, Pos2, Rect, Response, Sense, Stroke, StrokeKind, TextureHandle,
    Ui, Vec2, pos2, vec2,
};
use four::FourUi;
use native_texture::{NativeTexture, ShownTexture};
use scene::Inspection;
use side::{Side, peeks};
use std::sync::Arc;
use worker::PreviewPicture;

pub use viewing::words;

/// Degrees of yaw per point of a drag: half a turn across a small window.
const DEGREES_PER_POINT: f32 = 0.4;
/// Points to either side of the wipe line within which it can be grabbed.
const HOLD: f32 = 6.0;
/// Points that a pointer may move in a click.
const STILL: f32 = 4.0;

/// The viewport, and the textures that it shows.
#[derive(Default)]
pub struct ViewportPanel {
    shown: Option<ViewportTextures>,
    /// Points per pixel of the fitted picture.
    fit: f32,
    native: NativeTexture,
    doubts: Doubts,
    cell: CellUi,
    four: FourUi,
    /// The second of two pictures was under the cursor last.
    second: bool,
    /// Start of the drag that draws a region.
    drawing: Option<Pos2>,
    means: readout::RegionReadings,
}

struct ViewportTextures {
    relit: Arc<PreviewPicture>,
    first: ShownTexture,
    second: Option<TextureHandle>,
}

impl ViewportTextures {
    fn size(&self) -> Vec2 {
        vec2(self.relit.width as f32, self.relit.height as f32)
    }

    /// Rectangle of the picture in wipe mode, also before the second picture arrives.
    fn wiped(&self, rect: Rect, context: &PanelContext) -> Option<Rect> {
        let compare = &context.state.compare;
        let is_wiped = compare.on && compare.mode == CompareMode::Wipe;
        is_wiped.then(|| placed(rect, self.size(), context).0)
    }

    /// True if the two pictures are side by side.
    fn has_sides(&self, context: &PanelContext) -> bool {
        let compare = &context.state.compare;
        compare.on && compare.mode == CompareMode::Side && self.second.is_some()
    }

    /// Rectangle of the picture drawn at a point, and true if it is the right one of two. `place` is the rectangle of
    /// the only or the left picture.
    fn place_at(&self, at: Pos2, rect: Rect, place: Rect, context: &PanelContext) -> (Rect, bool) {
        let right = 0.5 * rect.width();
        if self.has_sides(context) && at.x > rect.left() + right {
            (place.translate(vec2(right, 0.0)), true)
        } else {
            (place, false)
        }
    }

    /// The pixel under the cursor, and true if the second picture is visible there. `place` is the rectangle of the
    /// only or the left picture.
    fn under(&self, ui: &Ui, rect: Rect, place: Rect, context: &PanelContext) -> Option<([usize; 2], bool)> {
        let at = ui.input(|i| i.pointer.latest_pos());
        let at = at.filter(|_| ui.rect_contains_pointer(rect))?;
        let compare = &context.state.compare;
        let has_two = compare.on && self.second.is_some();
        let (place, is_right) = self.place_at(at, rect, place, context);
        let share = (at - place.min) / place.size();
        let inside = (0.0..1.0).contains(&share.x) && (0.0..1.0).contains(&share.y);
        let pixel = |share: f32, length: usize| (share * length as f32) as usize;
        let second = has_two
            && match compare.mode {
                CompareMode::Side => is_right,
                _ if peeks(ui) => true,
                CompareMode::Difference => false,
                CompareMode::Toggle => compare.second,
                CompareMode::Wipe => share.x >= context.state.viewport.wipe,
            };
        inside.then_some(([pixel(share.x, self.relit.width), pixel(share.y, self.relit.height)], second))
    }
}

impl ViewportPanel {
    /// Returns a viewport that draws textures of this GPU.
    pub fn drawn_with(window: RenderState) -> Self {
        Self { native: NativeTexture::from_window(window), ..Self::default() }
    }

    /// Points per pixel of the fitted picture; 0 before the first picture.
    pub fn fit(&self) -> f32 {
        self.fit
    }

    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let mut rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        self.upload(ui.ctx(), context.relit());
        // A visible Lamps pane shows the cell instead, larger.
        let is_elsewhere = context.shows(Pane::Lamps);
        if !is_elsewhere && self.cell.ui(ui, rect, context, out) {
            ui.advance_cursor_after_rect(rect);
            return;
        }
        if context.state.four.on && context.is_live() && context.relit().is_some() {
            self.four.ui(ui, rect, context, out);
            if let Some(refusal) = &context.status.refusal {
                note_ui(ui, rect, refusal, true, out);
            }
            ui.advance_cursor_after_rect(rect);
            return;
        }
        match &self.shown {
            Some(shown) if context.is_live() => {
                let height = toolbar::height(ui, rect.width());
                let bar = Rect::from_min_size(rect.min, vec2(rect.width(), height));
                toolbar::toolbar_ui(ui, bar, context, out);
                rect.min.y = bar.bottom();
                let below = rect.with_min_y(rect.bottom() - readout::HEIGHT);
                rect.max.y = below.top();
                let aims = context.state.viewport.aims;
                let wiped = shown.wiped(rect, context);
                let response = gestures(ui, rect, wiped, (aims, &mut self.drawing), out);
                let (place, fit) = pictures_ui(ui, rect, shown, context, out);
                self.fit = fit;
                if let Some(from) = self.drawing {
                    let side_place = shown.place_at(from, rect, place, context).0;
                    if draw_region(ui, &response, (from, side_place), shown, context, out) {
                        self.drawing = None;
                    }
                }
                region_ui(ui, rect, place, shown, context);
                let under = shown.under(ui, rect, place, context);
                let pixel = under.map(|(pixel, _)| pixel);
                let on_picture = (&*shown.relit, place);
                if aims {
                    aim::aim_ui(ui, &response, pixel, on_picture, context, out);
                }
                aim::handles_ui(ui, rect, pixel, on_picture, context, out);
                if let Some((pixel, second)) = under {
                    self.second = second;
                    // The last pixel is kept while the cursor moves to the panel that shows it.
                    if Some(pixel) != context.state.viewport.probed {
                        out.push(Command::View(ViewCommand::Pixel(Some(pixel))));
                    }
                }
                let means = &mut self.means;
                let drawn = (self.second, fit * context.state.viewport.view.zoom);
                readout::strip_ui(ui, below, context, &shown.relit, drawn, means, out);
                if context.state.display.inspection == Inspection::FalseColor {
                    // Below the sign of the viewing settings.
                    readout::legend_ui(ui, rect.with_min_y(rect.top() + viewing::SIGN));
                }
                viewing::sign_ui(ui, rect, Align2::CENTER_TOP, context.state);
                if context.state.viewport.doubts {
                    let painter = ui.painter().with_clip_rect(rect);
                    let words = self.doubts.draw(&painter, place, &shown.relit, context);
                    label(ui, rect, Align2::LEFT_BOTTOM, &words);
                }
                gizmo::gizmo_ui(ui, rect, context, out);
                if !context.state.solo.is_empty() || context.state.look.lighting.is_solo() {
                    let edge = Stroke::new(3.0, theme::ACCENT);
                    (ui.painter()).rect_stroke(rect, 0.0, edge, StrokeKind::Inside);
                }
                // Above the hint of "Light by the face".
                let mut below = rect.with_max_y(rect.bottom() - if aims { aim::HINT } else { 0.0 });
                if let Some(sentence) = overlay(context, &shown.relit) {
                    below.max.y = note_ui(ui, below, &sentence, false, out).top() + GAP;
                }
                if let Some(refusal) = &context.status.refusal {
                    note_ui(ui, below, refusal, true, out);
                }
            }
            _ => {
                if context.status.phase.waits_for_job() {
                    backdrop_ui(ui, context);
                }
                notice_ui(ui, |ui| instead::instead_ui(ui, context, out));
            }
        }
        ui.advance_cursor_after_rect(rect);
    }

    fn upload(&mut self, ctx: &egui::Context, relit: Option<&Arc<PreviewPicture>>) {
        let Some(relit) = relit else {
            self.shown = None;
            return;
        };
        if let Some(shown) = &self.shown
            && Arc::ptr_eq(&shown.relit, relit)
        {
            return;
        }
        let (first, second) = match self.shown.take() {
            Some(old) => (old.first.in_memory(), old.second),
            None => (None, None),
        };
        let in_memory = |old, size, rgb: &[u8]| texture(ctx, "relit", old, size, rgb);
        let first = match (&relit.first, &relit.texture) {
            (Some((_, codes)), _) => {
                let size = [codes.width, codes.height];
                ShownTexture::InMemory(in_memory(first, size, &codes.rgb))
            }
            (None, Some(there)) if let Some(id) = self.native.show(there) => ShownTexture::OnGpu(id, first),
            _ => ShownTexture::InMemory(in_memory(first, relit.rgb_size, &relit.rgb)),
        };
        self.shown = Some(ViewportTextures {
            relit: relit.clone(),
            first,
            second: relit.second.as_ref().map(|(_, codes)| {
                let size = [codes.width, codes.height];
                texture(ctx, "second", second, size, &codes.rgb)
            }),
        });
    }
}

/// The picture and its comparison. Returns the rectangle of the only or the left picture, and the points per pixel when
/// fitted.
fn pictures_ui(
    ui: &Ui,
    rect: Rect,
    shown: &ViewportTextures,
    context: &PanelContext,
    out: &mut Vec<Command>,
) -> (Rect, f32) {
    let relit = &shown.relit;
    let size = shown.size();
    let compare = &context.state.compare;
    let first_texture = shown.first.id();
    let second = (shown.second.as_ref().filter(|_| compare.on)).map(TextureHandle::id);
    let name = || Side::Second.name(context, relit);
    let first = || Side::First.name(context, relit);
    let (place, fit) = match (second, compare.mode) {
        (Some(second), CompareMode::Side) => {
            let (left, right) = rect.split_left_right_at_fraction(0.5);
            let (place, fit) = placed(left, size, context);
            let (other, _) = placed(right, size, context);
            paint(ui, left, first_texture, place, (0.0, 1.0));
            paint(ui, right, second, other, (0.0, 1.0));
            label(ui, left, Align2::LEFT_TOP, &first());
            label(ui, right, Align2::LEFT_TOP, &name());
            (place, fit)
        }
        (Some(second), _) if peeks(ui) => {
            let (place, fit) = placed(rect, size, context);
            paint(ui, rect, second, place, (0.0, 1.0));
            label(ui, rect, Align2::LEFT_TOP, &name());
            (place, fit)
        }
        (Some(second), CompareMode::Wipe) => {
            let (place, fit) = placed(rect, size, context);
            let wipe = context.state.viewport.wipe.clamp(0.0, 1.0);
            paint(ui, rect, first_texture, place, (0.0, wipe));
            paint(ui, rect, second, place, (wipe, 1.0));
            label(ui, rect, Align2::LEFT_TOP, &first());
            label(ui, rect, Align2::RIGHT_TOP, &name());
            wipe_ui(ui, rect, place, wipe, out);
            (place, fit)
        }
        (Some(second), CompareMode::Toggle) => {
            let (place, fit) = placed(rect, size, context);
            let (texture, name) = if compare.second { (second, name()) } else { (first_texture, first()) };
            paint(ui, rect, texture, place, (0.0, 1.0));
            label(ui, rect, Align2::LEFT_TOP, &name);
            (place, fit)
        }
        (second, _) => {
            let (place, fit) = placed(rect, size, context);
            paint(ui, rect, first_texture, place, (0.0, 1.0));
            if second.is_some() {
                let gain = context.state.display.gain;
                let text = format!("difference of {} and {}, × {gain}", first(), name());
                label(ui, rect, Align2::LEFT_TOP, &text);
            } else if compare.on {
                label(ui, rect, Align2::LEFT_TOP, &first());
            }
            (place, fit)
        }
    };
    (place, fit)
}

/// The line between the two pictures, to drag.
fn wipe_ui(ui: &Ui, rect: Rect, place: Rect, wipe: f32, out: &mut Vec<Command>) {
    let x = place.left() + wipe * place.width();
    let line = Rect::from_x_y_ranges(x - HOLD..=x + HOLD, place.y_range()).intersect(rect);
    if !line.is_positive() {
        return;
    }
    let response = ui.interact(line, ui.scope_id().with("wipe line"), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::slider(true, f64::from(wipe), "Wipe"));
    let color = if response.hovered() || response.dragged() { Color32::WHITE } else { theme::ACCENT };
    let painter = ui.painter().with_clip_rect(rect);
    painter.vline(x, line.y_range(), egui::Stroke::new(1.5, color));
    painter.circle_filled(pos2(x, place.center().y), 5.0, color);
    if response.hovered() || response.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        out.push(wipe_to(place, at));
    }
}

/// Command that moves the line between two pictures under the pointer.
fn wipe_to(place: Rect, at: Pos2) -> Command {
    Command::View(ViewCommand::Wipe((at.x - place.left()) / place.width()))
}

/// Drags and the wheel. In wipe mode a drag moves the line over `wiped`, the picture's rectangle. Otherwise it turns
/// the light, unless it `aims` one. With Ctrl and Shift it draws a region that starts at `drawing`.
fn gestures(
    ui: &Ui,
    rect: Rect,
    wiped: Option<Rect>,
    (aims, drawing): (bool, &mut Option<Pos2>),
    out: &mut Vec<Command>,
) -> Response {
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Relit picture"));
    let shift = ui.input(|i| i.modifiers.shift);
    let delta = response.drag_delta();
    let by = |button| response.dragged_by(button);
    let draws = ui.input(|i| i.modifiers.command && i.modifiers.shift);
    if response.drag_started() {
        let origin = ui.input(|i| i.pointer.press_origin());
        *drawing = origin.filter(|_| draws && by(PointerButton::Primary));
    }
    if draws && response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    if drawing.is_some() {
        // Handled in `draw_region`, once the picture's rectangle is known.
    } else if by(PointerButton::Primary) && !(aims && aim::takes(ui, &response)) {
        match (wiped, response.interact_pointer_pos()) {
            (Some(place), Some(at)) => out.push(wipe_to(place, at)),
            _ => {
                out.push(Command::Look(LookCommand::Turn(delta.x * DEGREES_PER_POINT * if shift { 0.1 } else { 1.0 })))
            }
        }
    } else if by(PointerButton::Secondary) && shift {
        out.push(Command::Look(LookCommand::Turn(delta.x * DEGREES_PER_POINT)));
    } else if by(PointerButton::Middle) {
        out.push(Command::View(ViewCommand::Pan(delta.into())));
    }
    zoom(ui, &response, rect, out);
    response
}

/// Draws a region of the picture in `place`, from `from` to the pointer; a click removes the region. Returns true once
/// the drag is over.
fn draw_region(
    ui: &Ui,
    drag: &Response,
    (from, place): (Pos2, Rect),
    shown: &ViewportTextures,
    context: &PanelContext,
    out: &mut Vec<Command>,
) -> bool {
    let is_over = !drag.dragged();
    let Some(at) = ui.input(|i| i.pointer.interact_pos()) else { return is_over };
    let region = match (at.distance(from) > STILL, is_over) {
        (true, false) => {
            let share = |at: Pos2| -> [f32; 2] { ((at - place.min) / place.size()).into() };
            let size = [shown.relit.width, shown.relit.height];
            Region::between(share(from), share(at), size)
        }
        (false, true) => None,
        // The last motion of the drag is already handled.
        _ => return is_over,
    };
    if region != context.state.viewport.region {
        out.push(Command::View(ViewCommand::Region(region)));
    }
    is_over
}

/// Outline of the measured region, in each of the pictures.
fn region_ui(ui: &Ui, rect: Rect, place: Rect, shown: &ViewportTextures, context: &PanelContext) {
    let size = [shown.relit.width, shown.relit.height];
    let Some(region) = context.state.viewport.region.and_then(|region| region.inside(size)) else { return };
    let point = place.size() / vec2(size[0] as f32, size[1] as f32);
    let at = |[x, y]: [usize; 2]| vec2(x as f32, y as f32) * point;
    let corner = place.min + at([region.left, region.top]);
    let edge = Rect::from_min_size(corner, at(region.size()));
    let (left, right) = rect.split_left_right_at_fraction(0.5);
    let sides: &[(Rect, f32)] =
        if shown.has_sides(context) { &[(left, 0.0), (right, 0.5 * rect.width())] } else { &[(rect, 0.0)] };
    for &(clip, by) in sides {
        let (painter, edge) = (ui.painter().with_clip_rect(clip), edge.translate(vec2(by, 0.0)));
        for (width, color) in [(3.0, Color32::BLACK), (1.0, theme::ACCENT)] {
            painter.rect_stroke(edge, 0.0, Stroke::new(width, color), StrokeKind::Middle);
        }
    }
}

/// Message over the picture: why it is not the requested one yet.
fn overlay(context: &PanelContext, relit: &PreviewPicture) -> Option<String> {
    if let Some(failure) = &context.status.failure {
        return Some(failure.clone());
    }
    match (context.state.review.cell, &context.readers.review.cell) {
        (Some(_), None) => return Some("Predicting the measured picture".to_owned()),
        (Some(_), Some(Err(sentence))) => return Some(sentence.clone()),
        _ => {}
    }
    match context.environment().map(|e| &e.panorama) {
        None => Some("Add an environment: a lat-long panorama, .exr or .hdr".to_owned()),
        Some(PanoramaState::Unread | PanoramaState::Waiting) => Some("Reading the environment".to_owned()),
        Some(PanoramaState::Failed(sentence)) => Some(sentence.clone()),
        Some(PanoramaState::Done { panorama, .. }) if panorama.environment.is_none() => {
            Some("Reading the environment".to_owned())
        }
        Some(PanoramaState::Done { .. }) if let Some(why) = missing(context) => Some(why),
        Some(PanoramaState::Done { .. }) if relit.scene.frame != context.state.frame => {
            Some(format!("Predicting frame {}", context.state.frame))
        }
        Some(PanoramaState::Done { .. }) => relit.missing.first().cloned(),
    }
}

/// Reason for the absence of one of the compared pictures.
fn missing(context: &PanelContext) -> Option<String> {
    let state = context.state;
    (state.compare).missing(state, context.looks, context.environments())
}

/// A message in the lower left corner; returns its rectangle. A `refusal` gives the reason for a refusal and stays
/// until it is dismissed.
fn note_ui(ui: &mut Ui, rect: Rect, sentence: &str, refusal: bool, out: &mut Vec<Command>) -> Rect {
    let sides = if refusal { [26.0, 34.0] } else { [0.0; 2] };
    let width = TEXT_WIDTH.min(rect.width() - 6.0 * GAP - sides[0] - sides[1]);
    let font = egui::TextStyle::Body.resolve(ui.style());
    let painter = ui.painter();
    let text = painter.layout(sentence.to_owned(), font, theme::TEXT, width);
    let size = text.size() + vec2(sides[0] + sides[1], 0.0);
    let corner = rect.left_bottom() + vec2(2.0 * GAP, -2.0 * GAP - size.y);
    let back = Rect::from_min_size(corner, size).expand2(vec2(10.0, 6.0));
    painter.rect_filled(back, 4.0, theme::OVER_PICTURE);
    if refusal {
        let (icon, font) = (icons::WARNING, FontId::proportional(18.0));
        painter.text(corner, Align2::LEFT_TOP, icon, font, theme::WARNING);
    }
    painter.galley(corner + vec2(sides[0], 0.0), text, theme::TEXT);
    let label = ui.interact(back, ui.scope_id().with(("note", refusal)), Sense::hover());
    label.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, sentence));
    if refusal {
        let at = Rect::from_min_size(back.right_top() + vec2(-32.0, 4.0), vec2(28.0, 24.0));
        ui.scope_builder(egui::UiBuilder::new().max_rect(at), |ui| {
            dismiss_ui(ui, out);
        });
    }
    back
}
