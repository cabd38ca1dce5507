//! Light by the face: a press on the picture places a light that falls there, and the light follows the pointer.

use crate::command::{AimCommand, Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::lamp_title;
use crate::panels::light::handle::{Seen, handle_ui};
use crate::theme::{self, GAP};
use egui::{
    Align2, Color32, CursorIcon, FontId, PointerButton, Pos2, Rect, Response, Role, Sense, Stroke, Ui, Vec2,
    WidgetInfo, vec2,
};
use light::aim::LEAST_MATTE;
use worker::PreviewPicture;

/// Height in points of the hint and its margin.
pub const HINT: f32 = 32.0;
/// Radius in points of the dot where the light falls.
const DOT: f32 = 6.0;
/// Reach in points around the place where a light falls: a press within it grabs that light.
const NEAR: f32 = 24.0;

/// True if a drag of the picture aims a light: with Ctrl it turns the environment.
pub fn takes(ui: &Ui, response: &Response) -> bool {
    response.dragged_by(PointerButton::Primary) && !ui.input(|i| i.modifiers.command)
}

/// Follows the pointer over `pixel` of the picture in `place`. Proposes the light or lamp that falls there, and shows
/// what to do or why nothing was done.
pub fn aim_ui(
    ui: &Ui,
    response: &Response,
    pixel: Option<[usize; 2]>,
    (relit, place): (&PreviewPicture, Rect),
    context: &PanelContext,
    out: &mut Vec<Command>,
) {
    let placed = &context.state.look.lighting.placed;
    let near = |at: Option<Pos2>| at.and_then(|at| nearest(at, (relit, place), context));
    if takes(ui, response) {
        if response.drag_started() {
            let light = near(ui.input(|i| i.pointer.press_origin()));
            out.push(Command::Aim(AimCommand::Begin(light)));
        }
        out.push(Command::Aim(AimCommand::At(pixel)));
    }
    let over = pixel.is_some_and(|pixel| is_subject(relit, pixel));
    let light = near(ui.input(|i| i.pointer.latest_pos())).filter(|_| over);
    let lamp = context.readers.aim.proposed().filter(|_| over);
    if over {
        let cursor = match light {
            Some(_) => CursorIcon::Grab,
            None => CursorIcon::Crosshair,
        };
        ui.ctx().set_cursor_icon(cursor);
    }
    let asks = ui.input(|i| i.pointer.button_clicked(PointerButton::Secondary));
    if let Some(lamp) = lamp.filter(|_| asks) {
        out.push(Command::View(ViewCommand::Solo(Some(lamp))));
    }
    let painter = ui.painter().with_clip_rect(response.rect);
    let light = light.and_then(|light| Some(placed.get(light)?.title(light)));
    let words = match (context.readers.aim.refusal(), light, lamp) {
        (Some(none), ..) if !over || lamp.is_none() => none.to_string(),
        (_, Some(light), _) => format!("{light} falls here. Drag to move it."),
        (_, _, Some(lamp)) if let Some(lamp) = relit.rig.lamps.get(lamp) => {
            let lamp = lamp_title(&lamp.name);
            format!("Click to light from here. Right-click: solo {lamp}, which falls here.")
        }
        _ => "Click where a light should fall; drag to move it. Esc ends this.".to_owned(),
    };
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(words.clone(), font, theme::TEXT);
    let size = galley.size() + vec2(12.0, 6.0);
    let back = Align2::CENTER_BOTTOM.align_size_within_rect(size, response.rect.shrink(GAP));
    painter.rect_filled(back, 3.0, theme::OVER_PICTURE);
    painter.galley(back.min + vec2(6.0, 3.0), galley, theme::TEXT);
    let said = ui.interact(back, ui.scope_id().with("aim"), Sense::hover());
    said.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
}

/// Handles where lights fall on the picture in `place`: of all lights in "Light by the face", otherwise of the chosen
/// light. A drag moves the light so that it falls under the pointer.
pub fn handles_ui(
    ui: &Ui,
    rect: Rect,
    pixel: Option<[usize; 2]>,
    (relit, place): (&PreviewPicture, Rect),
    context: &PanelContext,
    out: &mut Vec<Command>,
) {
    let state = context.state;
    let lighting = &state.look.lighting;
    let painter = ui.painter().with_clip_rect(rect);
    for (i, light) in lighting.placed.iter().enumerate() {
        let is_chosen = state.chosen_light() == Some(i);
        if !is_chosen && !state.viewport.aims {
            continue;
        }
        let Some(at) = falls_at(i, (relit, place), context) else { continue };
        let spot = Rect::from_center_size(at, Vec2::splat(2.5 * DOT)).intersect(rect);
        if !spot.is_positive() {
            continue;
        }
        let id = ui.scope_id().with(("handle", light.id));
        let handle = ui.interact(spot, id, Sense::click_and_drag());
        let name = format!("{} on the picture", light.title(i));
        handle.widget_info(|| WidgetInfo::labeled(Role::Slider, true, &name));
        if handle.drag_started() {
            out.push(Command::Aim(AimCommand::Begin(Some(i))));
        }
        handle_ui(ui, context, &handle, (i, light), Seen::ByCamera, out);
        if handle.dragged() {
            out.push(Command::Aim(AimCommand::At(pixel)));
        }
        let fill = match (lighting.shines(light), is_chosen) {
            (true, true) => theme::ACCENT,
            (true, false) => theme::TEXT,
            (false, _) => theme::QUIET,
        };
        let edge = if is_chosen { Stroke::new(2.0, Color32::WHITE) } else { Stroke::new(1.5, Color32::BLACK) };
        painter.circle(at, DOT, fill, edge);
        let hint =
            format!("{name}: drag it to where the light should fall, or use the arrow keys (1°, with Shift 10°)");
        theme::hint_at_rest_ui(handle.on_hover_cursor(CursorIcon::Grab), hint);
    }
}

/// Point where a hand-placed light falls on the picture in `place`. None for light from behind, which falls on nothing
/// visible.
fn falls_at(light: usize, (relit, place): (&PreviewPicture, Rect), context: &PanelContext) -> Option<Pos2> {
    let state = context.state;
    let aimed = state.aimed_light().zip(state.aimed_at(relit.scene.frame));
    let [x, y] = match aimed {
        Some((of, [x, y])) if of == light => [x as f32, y as f32],
        _ => {
            let direction = state.look.lighting.placed.get(light)?.direction();
            let at = context.highlights()?.at(direction)?;
            relit.predicted.picture_place(at)
        }
    };
    let share = |at: f32, length: usize| (at + 0.5) / length.max(1) as f32;
    let share = vec2(share(x, relit.width), share(y, relit.height));
    Some(place.min + share * place.size())
}

/// The hand-placed light that falls nearest to a point, within reach.
fn nearest(at: Pos2, picture: (&PreviewPicture, Rect), context: &PanelContext) -> Option<usize> {
    let lights = 0..context.state.look.lighting.placed.len();
    let falls = lights.filter_map(|i| Some((i, falls_at(i, picture, context)?.distance(at))));
    let near = falls.filter(|(_, far)| *far <= NEAR);
    Some(near.min_by(|a, b| a.1.total_cmp(&b.1))?.0)
}

/// True if a pixel of the picture belongs to the subject.
fn is_subject(relit: &PreviewPicture, pixel: [usize; 2]) -> bool {
    let mask = &relit.predicted.frame.mask;
    let working = relit.predicted.working_pixel(pixel);
    working.is_some_and(|[x, y]| x < mask.width && y < mask.height && mask.at(x, y) >= LEAST_MATTE)
}
