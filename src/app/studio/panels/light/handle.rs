//! Focus and keyboard of a placed light's handle, the same on every map.

use super::lights;
use crate::command::{Command, LookCommand, ViewCommand};
use crate::keys;
use crate::look::within_a_turn;
use crate::panel_context::PanelContext;
use egui::{EventFilter, Key, Response, Ui, Vec2, vec2};
use light::PlacedLight;

/// Degrees that an arrow key moves a light; with Shift ten times as many.
const STEP_DEG: f32 = 1.0;

/// Orientation of a map of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// As a panorama: azimuths grow to the right.
    Unrolled,
    /// As the camera sees it: camera right is on the right.
    ByCamera,
}

/// Chooses the light at `index` and focuses its handle when the handle is pressed. With the focus, the arrow keys move
/// the light, and the keyboard copies, pastes and removes it.
pub fn handle_ui(
    ui: &Ui,
    context: &PanelContext,
    handle: &Response,
    (index, light): (usize, &PlacedLight),
    seen: Seen,
    out: &mut Vec<Command>,
) {
    let is_pressed = handle.clicked() || handle.drag_started();
    if is_pressed {
        handle.request_focus();
    }
    let is_chosen = context.state.chosen_light() == Some(index);
    if (is_pressed || handle.gained_focus()) && !is_chosen {
        out.push(Command::View(ViewCommand::ChooseLight(Some(index))));
    }
    if !handle.has_focus() || context.state.covers.takes_keys() {
        return;
    }
    if let Some(by) = arrows(ui, handle.id) {
        let mut lighting = context.state.look.lighting.clone();
        lighting.placed[index] = moved(light, by, seen);
        out.push(Command::Look(LookCommand::Lighting(Box::new(lighting))));
    }
    lights::press_ui(ui, context, true, out);
}

/// Degrees to the right and up by which the arrow keys move the light whose handle has the focus.
fn arrows(ui: &Ui, handle: egui::Id) -> Option<Vec2> {
    keys::leave_arrows(ui.ctx(), handle);
    let all = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(handle, all));
    let by = ui.input(|input| {
        let presses = |key| input.num_presses(key) as f32;
        let step = STEP_DEG * if input.modifiers.shift { 10.0 } else { 1.0 };
        step * vec2(presses(Key::ArrowRight) - presses(Key::ArrowLeft), presses(Key::ArrowUp) - presses(Key::ArrowDown))
    });
    (by != Vec2::ZERO).then_some(by)
}

/// Returns the light moved by degrees to the right and up. The azimuth wraps around, the elevation stops at the poles.
fn moved(light: &PlacedLight, by: Vec2, seen: Seen) -> PlacedLight {
    // In front of the subject, azimuths grow to the camera's left.
    let is_mirrored = seen == Seen::ByCamera && light.direction().z > 0.0;
    let right = if is_mirrored { -by.x } else { by.x };
    PlacedLight {
        yaw_deg: within_a_turn(light.yaw_deg + right),
        pitch_deg: (light.pitch_deg + by.y).clamp(-90.0, 90.0),
        ..light.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_moves_a_light_to_where_it_points_on_any_map() {
        for yaw_deg in [-150.0, -30.0, 10.0, 170.0, 180.0] {
            let light = PlacedLight { yaw_deg, pitch_deg: 0.0, ..PlacedLight::default() };
            let to_right = moved(&light, vec2(5.0, 0.0), Seen::ByCamera);
            assert!(to_right.direction().x > light.direction().x, "{yaw_deg}");
            let further = moved(&light, vec2(5.0, 200.0), Seen::Unrolled);
            assert_eq!(further.yaw_deg, within_a_turn(yaw_deg + 5.0));
            assert_eq!(further.pitch_deg, 90.0);
        }
    }
}
