//! Histogram, waveform, parade and vectorscope of the picture or of a region, one of which may fill the pane, and the pixel under
//! the cursor.

mod counts;
mod pixel;
pub mod query;

use crate::command::Command;
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::viewport::readout::{REGION_HINT, RegionReadings, moves};
use crate::panels::viewport::side::{Seen, Side};
use crate::panels::viewport::words;
use crate::panels::widgets::missing::no_picture_ui;
use crate::panels::widgets::names::short;
use crate::panels::widgets::rows::segments_ui;
use crate::region::{Region, counted_rows};
use crate::theme::{self, GAP};
use counts::{COLORS, Codes, Histogram, REACH, SKIN_DEG, chroma, clipped, histogram, parade, vectorscope, waveform};
use egui::{
    Align, Align2, Button, Color32, FontId, Layout, Pos2, Rect, RichText, Role, Sense, Stroke, StrokeKind,
    TextureHandle, TextureOptions, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use pixel::{pixel_ui, readings_ui};
use std::sync::Arc;
use worker::PreviewPicture;

/// Columns and levels of the waveform, and columns and rows of the vectorscope: small, and enlarged.
const WAVEFORM: [[usize; 2]; 2] = [[192, 96], [512, 256]];
const VECTORS: [usize; 2] = [128, 256];

/// Scope below the histogram.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Scope {
    #[default]
    Waveform,
    Parade,
    Vectorscope,
}

impl Scope {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Waveform, "Waveform", "Brightness of each column of the picture"),
        (Self::Parade, "Parade", "Brightness of red, green and blue in each column"),
        (
            Self::Vectorscope,
            "Vectors",
            "Hue as direction, saturation as distance from the middle; skin lies along the line",
        ),
    ];
}

/// A drawing that can fill the pane.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Large {
    Histogram,
    Scope,
}

/// Unit of the levels beside the waveform.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum Scale {
    #[default]
    Percent,
    Codes,
}

impl Scale {
    /// Levels with a line, from 0 to 1, and their labels.
    fn levels(self) -> [(f32, u32); 5] {
        match self {
            Self::Percent => [0, 25, 50, 75, 100].map(|level| (level as f32 / 100.0, level)),
            Self::Codes => [0, 64, 128, 192, 255].map(|level| (level as f32 / 255.0, level)),
        }
    }
}

/// The panel, with the scopes of the newest picture.
#[derive(Default)]
pub struct ScopesPanel {
    scope: Scope,
    scale: Scale,
    /// The drawing that fills the pane.
    large: Option<Large>,
    /// The picture to count while both are visible.
    side: Side,
    found: Option<Found>,
    means: RegionReadings,
}

/// The counted codes, and the drawing of them.
#[derive(Clone, Copy, PartialEq)]
struct Counted {
    scope: Scope,
    region: Option<Region>,
    is_large: bool,
    side: Side,
}

struct Found {
    of: Arc<PreviewPicture>,
    counted: Counted,
    /// Row step: 1 counts all rows.
    step: usize,
    /// Number of pixels that one counted pixel represents.
    share: f32,
    histogram: Histogram,
    texture: TextureHandle,
}

impl ScopesPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(relit) = context.relit() else { return no_picture_ui(ui, context, "No picture yet", out) };
        let region = context.state.viewport.region;
        let seen = Seen::now(ui, context, relit);
        let side = match seen {
            Seen::Alone => Side::First,
            Seen::One(side) => side,
            Seen::Both | Seen::Difference => self.side,
        };
        let moves = moves(ui, context);
        self.count(ui, relit, (side, region), moves);
        self.side_ui(ui, context, relit, seen);
        let inspection = relit.scene.effects.inspection;
        if let Some(words) = words(&relit.scene.viewing, inspection) {
            let text = format!("Counted as you see it: {words}");
            ui.label(RichText::new(text).size(12.0).color(theme::VIEWING));
        }
        if self.large != Some(Large::Scope) {
            self.histogram_ui(ui);
        }
        if self.large != Some(Large::Histogram) {
            self.scope_ui(ui);
        }
        if self.large.is_some() {
            return;
        }
        ui.add_space(GAP);
        match region {
            Some(region) => {
                let [columns, rows] = region.size();
                let Region { left, top, .. } = region;
                let text = format!("Mean of {columns} × {rows} pixels at {left}, {top}");
                ui.label(RichText::new(text).color(theme::QUIET)).on_hover_text(REGION_HINT);
                readings_ui(ui, self.means.readings(context, relit, region, moves));
            }
            None => {
                let hint = "Ctrl+Shift+drag: mean of a region";
                ui.label(RichText::new(hint).color(theme::QUIET)).on_hover_text(REGION_HINT);
            }
        }
        let is_relit = side == Side::First && relit.first.is_none();
        pixel_ui(ui, context, (relit, is_relit), out);
    }

    /// Name of the counted picture, if there are two; a choice while both are visible.
    fn side_ui(&mut self, ui: &mut Ui, context: &PanelContext, relit: &PreviewPicture, seen: Seen) {
        let says = |ui: &mut Ui, name: &str| {
            let text = RichText::new(format!("Counted: {name}")).size(12.0);
            ui.label(text.color(theme::QUIET));
        };
        let first = match seen {
            Seen::Alone if context.state.four.on => return says(ui, "current look"),
            Seen::Alone => return,
            Seen::One(side) => return says(ui, &side.title(context, relit)),
            Seen::Both => Side::First.title(context, relit),
            Seen::Difference => format!("difference × {}", context.state.display.gain),
        };
        let second = Side::Second.title(context, relit);
        segments_ui(ui, |ui| {
            for (side, name) in [(Side::First, first), (Side::Second, second)] {
                let chosen = self.side == side;
                let text = RichText::new(short(&name)).size(12.0);
                let entry = ui.selectable_label(chosen, text);
                entry.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, format!("Count {name}")));
                if entry.on_hover_text(format!("Scopes of {name}")).clicked() {
                    self.side = side;
                }
            }
        });
    }

    /// Counts the newest picture, unless already counted. While it `moves`, counts only some rows.
    fn count(&mut self, ui: &Ui, relit: &Arc<PreviewPicture>, (side, region): (Side, Option<Region>), moves: bool) {
        let counted = Counted { scope: self.scope, region, is_large: self.large == Some(Large::Scope), side };
        let (rgb, size) = side.codes(relit);
        let step = counted_rows(region.map_or(size, Region::size), moves);
        let is_this = |found: &Found| Arc::ptr_eq(&found.of, relit) && found.counted == counted && found.step <= step;
        if self.found.as_ref().is_some_and(is_this) {
            return;
        }
        if rgb.is_empty() {
            // A picture that is only on the GPU was requested before this pane was visible; its codes follow.
            self.found = self.found.take().filter(|found| found.counted.side == side);
            return;
        }
        let whole = [relit.width, relit.height];
        let codes = Codes::new(rgb, size, (region, whole), step);
        let size = WAVEFORM[usize::from(counted.is_large)];
        let picture = match self.scope {
            Scope::Waveform => waveform(&codes, size),
            Scope::Parade => parade(&codes, size),
            Scope::Vectorscope => vectorscope(&codes, VECTORS[usize::from(counted.is_large)]),
        };
        self.found = Some(Found {
            of: relit.clone(),
            counted,
            step,
            share: codes.share(),
            histogram: histogram(&codes),
            texture: ui.ctx().load_texture("scope", picture, TextureOptions::NEAREST),
        });
    }

    fn histogram_ui(&mut self, ui: &mut Ui) {
        let Some(found) = &self.found else { return };
        let large = &mut self.large;
        heading_ui(ui, large, Large::Histogram, |ui| {
            ui.label(RichText::new("Histogram").color(theme::QUIET));
        });
        let clips = [255, 0].map(|code| clipped(&found.histogram, code, found.share));
        let below = clips.len() as f32 * 20.0;
        let height = match large {
            Some(_) => (room(ui) - below).max(90.0),
            None => 90.0,
        };
        histogram_ui(ui, &found.histogram, height);
        for clip in clips {
            ui.label(RichText::new(clip).size(12.0).color(theme::QUIET))
                .on_hover_text("Pixels with this channel at 0 or 255");
        }
    }

    fn scope_ui(&mut self, ui: &mut Ui) {
        let Some(found) = &self.found else { return };
        let (large, scope, scale) = (&mut self.large, &mut self.scope, &mut self.scale);
        heading_ui(ui, large, Large::Scope, |ui| {
            segments_ui(ui, |ui| {
                for (one, name, hint) in Scope::ALL {
                    ui.selectable_value(scope, one, name).on_hover_text(hint);
                }
            });
        });
        let left = room(ui) - 36.0;
        let height = |small: f32| match large {
            Some(_) => left.max(small),
            None => small,
        };
        match found.counted.scope {
            Scope::Vectorscope => vectors_ui(ui, &found.texture, height(220.0)),
            shown => {
                let height = height(110.0);
                levels_ui(ui, &found.texture, shown == Scope::Parade, *scale, height);
                segments_ui(ui, |ui| {
                    ui.spacing_mut().interact_size.y = 18.0;
                    for (one, name, hint) in [
                        (Scale::Percent, "%", "Levels in percent of white"),
                        (Scale::Codes, "0–255", "Levels in 8-bit codes"),
                    ] {
                        ui.selectable_value(scale, one, RichText::new(name).size(12.0)).on_hover_text(hint);
                    }
                });
            }
        }
    }
}

/// Height in points left in the visible part of the pane, which scrolls.
fn room(ui: &Ui) -> f32 {
    ui.clip_rect().bottom() - ui.cursor().top() - 2.0 * GAP
}

/// Heading above a scope, and the button that enlarges it or shows all scopes again.
fn heading_ui(ui: &mut Ui, large: &mut Option<Large>, this: Large, beside: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        beside(ui);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let what = match this {
                Large::Histogram => "histogram",
                Large::Scope => "scope",
            };
            let (icon, name, to) = match large {
                Some(_) => (icons::REDUCE, "Show all scopes".to_owned(), None),
                None => (icons::ENLARGE, format!("Enlarge the {what}"), Some(this)),
            };
            let button = Button::new(RichText::new(icon).size(14.0)).min_size(vec2(26.0, 22.0));
            if icons::named_ui(ui, true, button, &name).on_hover_text(&name).clicked() {
                *large = to;
            }
        });
    });
}

/// A waveform or parade with its scale.
fn levels_ui(ui: &mut Ui, texture: &TextureHandle, is_parade: bool, scale: Scale, height: f32) {
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = if is_parade { "RGB parade" } else { "Waveform scope" };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
    let inner = rect.with_min_x(rect.left() + 30.0);
    whole_ui(ui, texture, inner);
    let line = Stroke::new(1.0, Color32::from_white_alpha(40));
    let levels = scale.levels();
    for (place, (share, number)) in levels.into_iter().enumerate() {
        let y = inner.bottom() - inner.height() * share;
        ui.painter().hline(inner.x_range(), y, line);
        let align = match place {
            0 => Align2::LEFT_BOTTOM,
            4 => Align2::LEFT_TOP,
            _ => Align2::LEFT_CENTER,
        };
        let font = FontId::proportional(12.0);
        ui.painter().text(pos2(rect.left(), y), align, number, font, theme::QUIET);
    }
}

fn whole_ui(ui: &Ui, texture: &TextureHandle, rect: Rect) {
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    ui.painter().image(texture.id(), rect, whole, Color32::WHITE);
}

/// The vectorscope with its circle, the six colours at 75 %, and the line of skin.
fn vectors_ui(ui: &mut Ui, texture: &TextureHandle, height: f32) {
    let side = ui.available_width().min(height);
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Vectorscope"));
    whole_ui(ui, texture, rect);
    let painter = ui.painter().with_clip_rect(rect);
    let line = Stroke::new(1.0, Color32::from_white_alpha(60));
    let radius = 0.5 * side;
    painter.circle_stroke(rect.center(), radius - 1.0, line);
    let to_skin = SKIN_DEG.to_radians();
    let skin = rect.center() + radius * vec2(to_skin.cos(), -to_skin.sin());
    painter.line_segment([rect.center(), skin], Stroke::new(1.0, theme::TEXT));
    let font = FontId::proportional(12.0);
    let at = rect.center().lerp(skin, 0.92) + vec2(-6.0, 0.0);
    painter.text(at, Align2::RIGHT_CENTER, "skin", font.clone(), theme::TEXT);
    for (name, color) in [
        ("R", [0.75, 0.0, 0.0]),
        ("Y", [0.75, 0.75, 0.0]),
        ("G", [0.0, 0.75, 0.0]),
        ("C", [0.0, 0.75, 0.75]),
        ("B", [0.0, 0.0, 0.75]),
        ("M", [0.75, 0.0, 0.75]),
    ] {
        let [cb, cr] = chroma(color);
        let at = rect.center() + radius / REACH * vec2(cb, -cr);
        painter.rect_stroke(Rect::from_center_size(at, Vec2::splat(8.0)), 0.0, line, StrokeKind::Middle);
        painter.text(at, Align2::CENTER_CENTER, name, font.clone(), theme::QUIET);
    }
}

fn histogram_ui(ui: &mut Ui, histogram: &Histogram, height: f32) {
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Histogram"));
    ui.painter().rect_filled(rect, 0.0, theme::WELL);
    // Clipped pixels do not set the scale: they would flatten everything else.
    let inner = histogram.iter().flat_map(|counts| &counts[1..255]);
    let most = inner.copied().max().unwrap_or(0).max(1) as f32;
    for (counts, color) in histogram.iter().zip(COLORS) {
        let line: Vec<Pos2> = (0..256)
            .map(|code| {
                let height = (counts[code] as f32 / most).min(1.0).sqrt();
                pos2(rect.left() + code as f32 / 255.0 * rect.width(), rect.bottom() - height * rect.height())
            })
            .collect();
        ui.painter().add(egui::Shape::line(line, Stroke::new(1.0, color)));
    }
}
