//! The pixel under the cursor: its values, and the light from each lamp.

use crate::command::{Command, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::viewport::readout::{Reading, readings};
use crate::region::Region;
use crate::theme::{self, GAP};
use egui::{Rect, RichText, Sense, Ui, pos2, vec2};
use imaging::color::luminance;
use worker::PreviewPicture;

/// The pixel under the cursor. `is_relit` is true while the relit picture itself is visible or counted.
pub fn pixel_ui(
    ui: &mut Ui,
    context: &PanelContext,
    (relit, is_relit): (&PreviewPicture, bool),
    out: &mut Vec<Command>,
) {
    ui.add_space(GAP);
    let Some([x, y]) = context.state.viewport.probed else {
        let hint = "Point at the picture to read a pixel";
        ui.label(RichText::new(hint).color(theme::QUIET));
        return;
    };
    ui.label(RichText::new(format!("Pixel {x}, {y}")).color(theme::QUIET));
    readings_ui(ui, &readings(context, relit, Region::pixel([x, y]), 1));
    if let Some(texel) = context.readers.inspector.texel() {
        lamps_ui(ui, texel, context, (relit, is_relit), out);
    }
}

/// The readings of each picture.
pub fn readings_ui(ui: &mut Ui, found: &[Reading]) {
    let row = |ui: &mut Ui, name: &str, values: String| {
        ui.horizontal(|ui| {
            ui.label(RichText::new(name).size(13.0));
            ui.label(RichText::new(values).monospace().size(12.0));
        });
    };
    for reading in found {
        if found.len() > 1 {
            ui.label(RichText::new(&reading.name).size(13.0).color(theme::QUIET));
        }
        row(ui, "Codes", reading.codes_text());
        if let Some([r, g, b]) = reading.linear {
            row(ui, "Linear", format!("{r:.4} {g:.4} {b:.4}"));
        }
    }
}

/// The pixel's light from each lamp, as bars; a click shows that lamp alone.
fn lamps_ui(
    ui: &mut Ui,
    texel: &[[f32; 3]],
    context: &PanelContext,
    (relit, is_relit): (&PreviewPicture, bool),
    out: &mut Vec<Command>,
) {
    let light: Vec<[f32; 3]> =
        texel.iter().zip(&relit.weights).map(|(texel, weight)| std::array::from_fn(|c| texel[c] * weight[c])).collect();
    let most = (light.iter().map(|&light| luminance(light))).fold(f32::MIN_POSITIVE, f32::max);
    let heading = if is_relit {
        "Light from each lamp"
    } else {
        // Other pictures may have no lamps, or another light.
        "Light from each lamp, in the relit picture"
    };
    ui.label(RichText::new(heading).color(theme::QUIET));
    let size = vec2(ui.available_width(), 100.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Light by lamp"));
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    let step = rect.width() / light.len().max(1) as f32;
    let under = (response.hover_pos()).map(|at| ((at.x - rect.left()) / step) as usize);
    for (lamp, light) in light.iter().enumerate() {
        let height = (luminance(*light) / most).clamp(0.0, 1.0) * (rect.height() - 4.0);
        let left = rect.left() + lamp as f32 * step;
        let bar =
            Rect::from_min_max(pos2(left, rect.bottom() - height), pos2(left + (step - 1.0).max(1.0), rect.bottom()));
        let chosen = context.state.solo.contains(&lamp) || under == Some(lamp);
        let color = if chosen { theme::ACCENT } else { theme::QUIET };
        ui.painter().rect_filled(bar, 0.0, color);
    }
    theme::focus_ui(ui, rect, &response);
    let Some(lamp) = under.filter(|&lamp| lamp < light.len()) else { return };
    if response.clicked() {
        out.push(Command::View(ViewCommand::Solo(Some(lamp))));
    }
    let share = luminance(light[lamp]) / light.iter().map(|&l| luminance(l)).sum::<f32>();
    response.on_hover_text(format!(
        "{}: {:.1} % of this pixel's light. Click to solo it.",
        context.lamp_title(lamp),
        100.0 * share
    ));
}
