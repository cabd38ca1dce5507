//! Light by the face: a press on the picture places a light that falls there, and it follows the pointer.

use crate::command::{AimCommand, Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{
    Align2, Color32, CursorIcon, FontId, PointerButton, Rect, Response, Role, Sense, Stroke, Ui,
    Vec2, WidgetInfo, vec2,
};
use light::aim::LEAST_MATTE;
use worker::PreviewPicture;

/// Radius in points of the dot where the light falls.
const DOT: f32 = 6.0;

/// Whether a drag of the picture aims a light: with Ctrl it turns the environment.
pub fn takes(ui: &Ui, response: &Response) -> bool {
    response.dragged_by(PointerButton::Primary) && !ui.input(|i| i.modifiers.command)
}

/// Follows the pointer, which is over this pixel of the picture, and says what to do or why nothing was done.
pub fn aim_ui(
    ui: &Ui,
    response: &Response,
    pixel: Option<[usize; 2]>,
    relit: &PreviewPicture,
    context: &PanelContext,
    out: &mut Vec<Command>,
) {
    if takes(ui, response) {
        if response.drag_started() {
            out.push(Command::Aim(AimCommand::Begin(None)));
        }
        out.push(Command::Aim(AimCommand::At(pixel)));
    }
    if response.hovered() && pixel.is_some_and(|pixel| is_subject(relit, pixel)) {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let painter = ui.painter().with_clip_rect(response.rect);
    let words = context.no_aim.map_or_else(
        || "Click where a light should fall; drag to move it. Esc ends this.".to_owned(),
        |none| none.to_string(),
    );
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(words.clone(), font, theme::TEXT);
    let size = galley.size() + vec2(12.0, 6.0);
    let back = Align2::CENTER_BOTTOM.align_size_within_rect(size, response.rect.shrink(GAP));
    painter.rect_filled(back, 3.0, theme::OVER_PICTURE);
    painter.galley(back.min + vec2(6.0, 3.0), galley, theme::TEXT);
    let said = ui.interact(back, ui.scope_id().with("aim"), Sense::hover());
    said.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
}

/// Handles where lights fall on the picture, which is in `place`: of all lights while lights are placed by the face, else of
/// the one that was chosen last. A drag moves its light to where it falls on the point under the pointer.
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
    let aimed = state.aimed_light().zip(state.aimed_at(relit.scene.frame));
    let painter = ui.painter().with_clip_rect(rect);
    for (i, light) in lighting.placed.iter().enumerate() {
        let is_chosen = state.chosen_light() == Some(i);
        if !is_chosen && !state.aims {
            continue;
        }
        let falls = match aimed {
            Some((of, [x, y])) if of == i => Some([x as f32, y as f32]),
            _ => (context.highlights)
                .and_then(|highlights| highlights.at(light.direction()))
                .map(|at| relit.predicted.picture_place(at)),
        };
        // Light from behind falls on nothing that is seen.
        let Some([x, y]) = falls else { continue };
        let share = |at: f32, length: usize| (at + 0.5) / length.max(1) as f32;
        let share = vec2(share(x, relit.width), share(y, relit.height));
        let at = place.min + share * place.size();
        let spot = Rect::from_center_size(at, Vec2::splat(2.5 * DOT)).intersect(rect);
        if !spot.is_positive() {
            continue;
        }
        let id = ui.scope_id().with(("handle", i));
        let handle = ui.interact(spot, id, Sense::click_and_drag());
        let name = format!("{} on the picture", light.title(i));
        handle.widget_info(|| WidgetInfo::labeled(Role::Slider, true, &name));
        if handle.drag_started() {
            out.push(Command::Aim(AimCommand::Begin(Some(i))));
        }
        if (handle.clicked() || handle.drag_started()) && !is_chosen {
            out.push(Command::View(ViewCommand::ChooseLight(Some(i))));
        }
        if handle.dragged() {
            out.push(Command::Aim(AimCommand::At(pixel)));
        }
        let fill = match lighting.shines(light) {
            true => theme::ACCENT,
            false => theme::QUIET,
        };
        let edge = match is_chosen {
            true => Stroke::new(2.0, Color32::WHITE),
            false => Stroke::new(1.5, Color32::BLACK),
        };
        painter.circle(at, DOT, fill, edge);
        let hint = format!("{name}: drag it to where the light should fall");
        handle.on_hover_cursor(CursorIcon::Grab).on_hover_text(hint);
    }
}

/// Whether a pixel of the picture belongs to the subject.
fn is_subject(relit: &PreviewPicture, pixel: [usize; 2]) -> bool {
    let mask = &relit.predicted.frame.mask;
    let working = relit.predicted.working_pixel(pixel);
    working.is_some_and(|[x, y]| x < mask.width && y < mask.height && mask.at(x, y) >= LEAST_MATTE)
}
