//! Light by the face: a press on the picture places a light that falls there, and it follows the pointer.

use crate::command::{AimCommand, Command};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{
    Align2, Color32, CursorIcon, FontId, PointerButton, Rect, Response, Role, Sense, Stroke, Ui,
    WidgetInfo, vec2,
};
use light::aim::LEAST_MATTE;
use worker::PreviewPicture;

/// Radius in points of the dot where the light falls.
const DOT: f32 = 6.0;

/// Whether a drag of the picture aims a light: with Ctrl it turns the environment.
pub fn takes(ui: &Ui, response: &Response) -> bool {
    response.dragged_by(PointerButton::Primary) && !ui.input(|i| i.modifiers.command)
}

/// Follows the pointer, which is over this pixel of the picture, and says what to do or why nothing was done. `place` is where
/// the picture is.
pub fn aim_ui(
    ui: &Ui,
    response: &Response,
    pixel: Option<[usize; 2]>,
    (relit, place): (&PreviewPicture, Rect),
    context: &PanelContext,
    out: &mut Vec<Command>,
) {
    if takes(ui, response) {
        if response.drag_started() {
            out.push(Command::Aim(AimCommand::Begin));
        }
        out.push(Command::Aim(AimCommand::At(pixel)));
    }
    if response.hovered() && pixel.is_some_and(|pixel| is_subject(relit, pixel)) {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let painter = ui.painter().with_clip_rect(response.rect);
    if let Some([x, y]) = context.state.aimed_at(relit.scene.frame) {
        let share = |at: usize, length: usize| (at as f32 + 0.5) / length.max(1) as f32;
        let share = vec2(share(x, relit.width), share(y, relit.height));
        let edge = Stroke::new(1.5, Color32::BLACK);
        painter.circle(place.min + share * place.size(), DOT, theme::ACCENT, edge);
    }
    let words = context.no_aim.map_or_else(
        || "Click where a light should fall; drag to move it. Esc ends this.".to_owned(),
        |none| none.to_string(),
    );
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(words.clone(), font, theme::TEXT);
    let size = galley.size() + vec2(12.0, 6.0);
    let back = Align2::CENTER_BOTTOM.align_size_within_rect(size, response.rect.shrink(GAP));
    painter.rect_filled(back, 3.0, Color32::from_black_alpha(190));
    painter.galley(back.min + vec2(6.0, 3.0), galley, theme::TEXT);
    let said = ui.interact(back, ui.scope_id().with("aim"), Sense::hover());
    said.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
}

/// Whether a pixel of the picture belongs to the subject.
fn is_subject(relit: &PreviewPicture, pixel: [usize; 2]) -> bool {
    let mask = &relit.predicted.frame.mask;
    let working = relit.predicted.working_pixel(pixel);
    working.is_some_and(|[x, y]| x < mask.width && y < mask.height && mask.at(x, y) >= LEAST_MATTE)
}
