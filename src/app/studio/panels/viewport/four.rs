//! Four looks side by side, panned and zoomed together. A click makes one of them the current look.

use super::canvas::{paint, placed, texture, zoom};
use super::four_pictures::FourPicture;
use super::look_list::look_list_ui;
use super::viewing;
use crate::command::{Command, LooksCommand, ViewCommand};
use crate::four_looks::{FourLooks, FourSlot};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::containers::menu::MenuButton;
use egui::{
    Align, Align2, Button, CursorIcon, FontId, Label, Layout, Margin, PointerButton, Pos2, Rect, RichText, Role, Sense,
    Stroke, StrokeKind, TextureHandle, Ui, UiBuilder, WidgetInfo, pos2, vec2,
};
use scene::Inspection;
use std::sync::Arc;
use worker::SrgbPicture;

/// Height of the line above the pictures in points.
const HEIGHT: f32 = 32.0;
/// Height and greatest width of a place's menu in points.
const MENU: [f32; 2] = [24.0, 220.0];

/// Textures of the pictures.
#[derive(Default)]
pub struct FourUi {
    shown: [Option<(Arc<SrgbPicture>, TextureHandle)>; 4],
}

impl FourUi {
    pub fn ui(&mut self, ui: &mut Ui, rect: Rect, context: &PanelContext, out: &mut Vec<Command>) {
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        let bar = rect.with_max_y(rect.top() + HEIGHT);
        let rect = rect.with_min_y(bar.bottom());
        let read = self.read(ui, rect, context);
        bar_ui(ui, bar, read, context, out);
        for place in 0..4 {
            self.place_ui(ui, place, part(rect, place), context, out);
        }
        viewing::sign_ui(ui, rect, Align2::CENTER_BOTTOM, context.state);
    }

    /// The pixel under the cursor, and its codes in each of the four pictures. None for a channel or false colours,
    /// which are not codes of the pictures.
    fn read(&self, ui: &Ui, rect: Rect, context: &PanelContext) -> Option<String> {
        if context.state.display.inspection != Inspection::Picture {
            return None;
        }
        let at = ui.input(|i| i.pointer.latest_pos())?;
        let at = Some(at).filter(|_| ui.rect_contains_pointer(rect))?;
        let size = |codes: &SrgbPicture| vec2(codes.width as f32, codes.height as f32);
        let pixel = (0..4).find_map(|place| {
            let (codes, _) = self.shown[place].as_ref()?;
            let part = part(rect, place);
            let (shown, _) = placed(part, size(codes), context);
            let share = (at - shown.min) / shown.size();
            let inside = shown.intersect(part).contains(at);
            let [x, y] = <[f32; 2]>::from(share * size(codes)).map(|at| at as usize);
            (inside && x < codes.width && y < codes.height).then_some([x, y])
        });
        let [x, y] = pixel?;
        let mut read = format!("{x}, {y}");
        let newest = context.relit().map(|relit| &relit.looks);
        for (place, look) in newest.into_iter().flatten().enumerate() {
            let codes = look.as_ref().and_then(|(_, codes)| {
                let inside = x < codes.width && y < codes.height;
                let pixel = codes.rgb.as_chunks::<3>().0.get(y * codes.width + x);
                pixel.filter(|_| inside)
            });
            if let Some([r, g, b]) = codes {
                let letter = FourLooks::LETTERS[place];
                read += &format!("   {letter} {r} {g} {b}");
            }
        }
        Some(read)
    }

    /// Draws one of the four pictures in `part`.
    fn place_ui(&mut self, ui: &mut Ui, place: usize, part: Rect, context: &PanelContext, out: &mut Vec<Command>) {
        let state = context.state;
        let slot = &state.four.slots[place];
        let letter = FourLooks::LETTERS[place];
        let wanted = FourPicture::new(slot, state, context.looks, context.environments());
        let name = slot.name();
        let response = ui.interact(part, ui.scope_id().with(("look", place)), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("{letter}: {name}")));
        let told = match &wanted {
            FourPicture::Empty => Some("Choose a look above".to_owned()),
            FourPicture::Waiting => Some("Reading the environment".to_owned()),
            FourPicture::Missing(why) => Some(why.clone()),
            FourPicture::View(_) => None,
        };
        match told {
            Some(words) => words_ui(ui, part, &words),
            None => self.picture_ui(ui, place, part, context),
        }
        let is_present = match slot {
            FourSlot::Empty => false,
            FourSlot::Present => true,
            FourSlot::Stored(id, number) => {
                (context.looks.version(id, *number)).is_some_and(|version| version.look.is(&state.look, state.frame))
            }
        };
        if is_present || response.hovered() {
            let color = if is_present { theme::ACCENT } else { theme::TEXT };
            let edge = Stroke::new(2.0, color);
            (ui.painter()).rect_stroke(part, 0.0, edge, StrokeKind::Inside);
        }
        let drags = [PointerButton::Primary, PointerButton::Middle];
        if drags.into_iter().any(|button| response.dragged_by(button)) {
            let by = response.drag_delta();
            out.push(Command::View(ViewCommand::Pan(by.into())));
        } else if response.clicked() && *slot != FourSlot::Empty {
            out.push(Command::Looks(LooksCommand::Pick(place)));
        }
        zoom(ui, &response, part, out);
        if *slot != FourSlot::Empty {
            response.on_hover_cursor(CursorIcon::PointingHand);
        }
        menu_ui(ui, place, part, &name, context, out);
    }

    /// The newest picture of a place.
    fn picture_ui(&mut self, ui: &Ui, place: usize, part: Rect, context: &PanelContext) {
        let newest = context.relit().and_then(|relit| relit.looks[place].as_ref());
        let shown = &mut self.shown[place];
        if let Some((_, codes)) = newest
            && !shown.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, codes))
        {
            let old = shown.take().map(|(_, old)| old);
            let size = [codes.width, codes.height];
            let drawn = texture(ui.ctx(), "look", old, size, &codes.rgb);
            *shown = Some((codes.clone(), drawn));
        }
        match (newest, shown) {
            (Some(_), Some((codes, drawn))) => {
                let size = vec2(codes.width as f32, codes.height as f32);
                let (at, _) = placed(part, size, context);
                paint(ui, part, drawn.id(), at, (0.0, 1.0));
            }
            _ => words_ui(ui, part, "Making the picture"),
        }
    }
}

/// Rectangle of one of the four places.
fn part(rect: Rect, place: usize) -> Rect {
    let (column, row) = (place % 2, place / 2);
    let part = 0.5 * rect.size();
    let corner = rect.min + part * vec2(column as f32, row as f32);
    Rect::from_min_size(corner, part).shrink(1.0)
}

fn words_ui(ui: &Ui, part: Rect, words: &str) {
    let painter = ui.painter().with_clip_rect(part);
    let width = (part.width() - 6.0 * GAP).max(1.0);
    let font = FontId::proportional(14.0);
    let text = painter.layout(words.to_owned(), font, theme::TEXT, width);
    let back = Align2::CENTER_CENTER.align_size_within_rect(text.size() + vec2(20.0, 12.0), part);
    painter.rect_filled(back, 4.0, egui::Color32::from_black_alpha(200));
    painter.galley(back.min + vec2(10.0, 6.0), text, theme::TEXT);
}

/// The menu of a place: names its look, and lists the looks to choose from.
fn menu_ui(ui: &mut Ui, place: usize, part: Rect, name: &str, context: &PanelContext, out: &mut Vec<Command>) {
    let letter = FourLooks::LETTERS[place];
    let [height, width] = MENU;
    let corner: Pos2 = part.min + vec2(GAP, GAP);
    let right = part.right() - GAP;
    let area = Rect::from_min_max(corner, pos2((corner.x + width).min(right), corner.y + height));
    let now = context.state.four.slots[place].clone();
    let set = |slot| Command::Looks(LooksCommand::Place(place, slot));
    ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
        let text = RichText::new(format!("{letter}  {name}")).strong();
        let button = Button::new(text).truncate();
        let menu = MenuButton::from_button(button).ui(ui, |ui| {
            if ui.selectable_label(now == FourSlot::Present, "Current look").clicked() {
                out.push(set(FourSlot::Present));
            }
            if let Some((id, number)) = look_list_ui(ui, context, &now) {
                out.push(set(FourSlot::Stored(id, number)));
            }
            if ui.selectable_label(now == FourSlot::Empty, "Nothing").clicked() {
                out.push(set(FourSlot::Empty));
            }
        });
        let button = menu.0.on_hover_text("Choose the look shown here");
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Place {letter}, {name}")));
    });
}

/// Name of the view, the values `read` from it, and the button back.
fn bar_ui(ui: &mut Ui, rect: Rect, read: Option<String>, context: &PanelContext, out: &mut Vec<Command>) {
    ui.painter().rect_filled(rect, 0.0, theme::PANEL);
    let inner = UiBuilder::new().max_rect(rect - Margin::symmetric(8, 3));
    ui.scope_builder(inner, |ui| {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0 * GAP;
            ui.strong("Four looks");
            ui.label(format!("frame {}", context.state.frame));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let hint = "Exit comparison. Keys: Esc, 4";
                if ui.button("Back").on_hover_text(hint).clicked() {
                    out.push(Command::Looks(LooksCommand::ToggleFour));
                }
                if let Some(read) = read {
                    ui.add(Label::new(RichText::new(read).monospace()).truncate());
                } else if ui.available_width() > 260.0 {
                    let hint = "Click one to use it; wheel and drag move all";
                    ui.label(RichText::new(hint).color(theme::QUIET));
                }
            });
        });
    });
}
