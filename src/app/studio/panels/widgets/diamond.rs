//! The diamond beside a setting: shows whether the current frame has a key, and sets or removes it.

use crate::command::{Command, LookCommand};
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Color32, Painter, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};
use scene::Setting;

/// Distance from a diamond's centre to its corners, in points.
pub const DIAMOND: f32 = 5.5;
/// Width of the clickable area in points.
pub const WIDTH: f32 = 20.0;

/// A diamond, filled or outlined.
pub fn diamond(painter: &Painter, at: Pos2, filled: bool, color: Color32) {
    let corners = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)];
    let corners = corners.map(|(x, y)| at + DIAMOND * vec2(x, y)).to_vec();
    let (fill, edge) = if filled { (color, Color32::BLACK) } else { (Color32::TRANSPARENT, color) };
    painter.add(Shape::convex_polygon(corners, fill, Stroke::new(1.0, edge)));
}

/// The diamond beside the field of a setting.
pub fn beside_ui(ui: &Ui, context: &PanelContext, of: Setting, field: Rect, out: &mut Vec<Command>) {
    let name = of.title(&context.state.look.lighting);
    within_ui(ui, context, (&[of], &name), beside(field), out);
}

/// Rectangle of the diamond beside a field.
pub fn beside(field: Rect) -> Rect {
    let corner = field.right_top() + vec2(GAP, 0.0);
    Rect::from_min_size(corner, vec2(WIDTH, field.height()))
}

/// The diamond after the last widget of a row; otherwise as [`within_ui`].
pub fn after_ui(ui: &mut Ui, context: &PanelContext, settings: (&[Setting], &str), out: &mut Vec<Command>) {
    let size = vec2(WIDTH, ui.spacing().interact_size.y);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    within_ui(ui, context, settings, rect, out);
}

/// One diamond for several settings, such as the channels of a colour; `called` is their common name. Filled if any of
/// them has a key at the current frame.
pub fn within_ui(
    ui: &Ui,
    context: &PanelContext,
    (settings, called): (&[Setting], &str),
    rect: Rect,
    out: &mut Vec<Command>,
) {
    let (look, frame) = (&context.state.look, context.state.frame);
    let has_key = |of: &&Setting| look.key_at(**of, frame).is_some();
    let is_here = settings.iter().any(|of| has_key(&of));
    let id = ui.scope_id().with(("key", settings));
    let response = ui.interact(rect, id, Sense::click());
    let name = format!("{called} key at this frame");
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, is_here, &name));
    let is_keyed = settings.iter().any(|of| look.is_keyed(*of));
    let color = if response.hovered() || response.has_focus() || is_keyed { theme::KEY } else { theme::QUIET };
    diamond(ui.painter(), rect.center(), is_here, color);
    let does = if is_here { "Removes the key at this frame" } else { "Sets a key at this frame" };
    let key = match settings {
        [Setting::Yaw] => ". Key: K",
        [Setting::Intensity] => ". Key: Shift+K",
        _ => "",
    };
    if response.on_hover_text(format!("{does}{key}")).clicked() {
        let changed = settings.iter().filter(|of| has_key(of) == is_here);
        out.extend(changed.map(|of| Command::Look(LookCommand::ToggleKey(*of))));
    }
}

/// Lists the settings of a group that have keys.
pub fn animated_ui(ui: &mut Ui, context: &PanelContext, group: Group) {
    let look = &context.state.look;
    let lanes = look.animation.lanes().map(|(setting, _)| setting);
    let names = lanes.filter(|of| Group::from_setting(*of) == group);
    let names: Vec<String> = names.map(|of| of.title(&look.lighting)).collect();
    let Some((last, others)) = names.split_last() else { return };
    let subject = match others {
        [] => format!("{last} is"),
        _ => format!("{} and {last} are", others.join(", ")),
    };
    let frame = context.state.frame;
    let sentence = format!("{subject} animated: changes set a key at frame {frame}.");
    ui.label(RichText::new(sentence).small().color(theme::QUIET));
}
