//! A stored look in the list: picture, name, menu and versions.

use super::{LooksPanel, Renaming, Thumbnails};
use crate::command::{Command, LooksCommand};
use crate::icons;
use crate::look_name::LookName;
use crate::look_shelf::{LookVersion, ShelvedLook};
use crate::panel_context::PanelContext;
use crate::panels::widgets::ago::{minutes_ago, since};
use crate::panels::widgets::fit::covering;
use crate::stored_looks::{LookId, Shelf};
use crate::theme::{self, GAP};
use egui::containers::menu::MenuButton;
use egui::{
    Button, Color32, FontId, Id, Key, Painter, Rect, Response, RichText, Role, Sense, TextEdit, Ui, UiBuilder, Vec2,
    WidgetInfo, pos2, vec2,
};

/// Height of a look's row, and of a version's, in points.
const LOOK: f32 = 52.0;
const VERSION: f32 = 36.0;
/// Side of the button that opens a look's menu.
const MORE: f32 = 24.0;

/// Texts of a row, beside its picture.
struct RowText<'a> {
    /// Name for screen readers.
    called: &'a str,
    name: &'a str,
    below: &'a str,
    /// This is the current look.
    chosen: bool,
}

impl LooksPanel {
    /// A look, and its versions if they are listed.
    pub fn look_ui(
        &mut self,
        ui: &mut Ui,
        id: &LookId,
        look: &ShelvedLook,
        context: &PanelContext,
        out: &mut Vec<Command>,
    ) {
        let Some(newest) = look.versions.first() else { return };
        if self.renaming.as_ref().is_some_and(|one| one.of == *id) {
            return self.rename_ui(ui, out);
        }
        let state = context.state;
        let shown = |version: &LookVersion| version.look.is(&state.look, state.frame);
        let chosen = shown(newest);
        let current = context.looks.current.as_ref();
        let of_this = current.filter(|(of, _)| of == id);
        let is_old = of_this.and_then(|&(_, number)| context.looks.version(id, Some(number)));
        let is_old = is_old.filter(|version| !chosen && shown(version));
        let mut below = minutes_ago(since(newest.look.stored));
        if let Some(old) = is_old {
            below = format!("version {} is shown", old.number);
        } else if of_this.is_some() && !chosen {
            "changed since".clone_into(&mut below);
        } else if look.versions.len() > 1 {
            below = format!("{} versions, {below}", look.versions.len());
        }
        let name = look.name.text();
        let called = match id.shelf {
            Shelf::Project => name.to_owned(),
            Shelf::Person => format!("{name}, all projects"),
        };
        let text = RowText { called: &called, name, below: &below, chosen };
        let (place, row) = row_ui(ui, LOOK, newest, &text, MORE, &mut self.thumbnails);
        if row.clicked() && !chosen {
            out.push(Command::Looks(LooksCommand::Apply(id.clone(), None)));
        }
        let environment = &newest.look.environment.name;
        row.on_hover_text(format!("Shows this look, under {environment}"));
        let corner = place.right_top() + vec2(-MORE, 4.0);
        let corner = Rect::from_min_size(corner, Vec2::splat(MORE));
        // Drawn over the row, so that nothing moves.
        let mut over = ui.new_child(UiBuilder::new().max_rect(corner));
        self.menu_ui(&mut over, id, &called, chosen, context, out);
        if self.open.contains(id) {
            for version in &look.versions {
                self.version_ui(ui, id, version, shown(version), out);
            }
        }
    }

    fn version_ui(&mut self, ui: &mut Ui, id: &LookId, version: &LookVersion, chosen: bool, out: &mut Vec<Command>) {
        let number = version.number;
        let name = format!("Version {number}");
        let text = RowText {
            called: &format!("{}, version {number}", id.name),
            name: &name,
            below: &minutes_ago(since(version.look.stored)),
            chosen,
        };
        ui.horizontal(|ui| {
            ui.add_space(2.0 * GAP);
            let (_, row) = row_ui(ui, VERSION, version, &text, 0.0, &mut self.thumbnails);
            let row = row.on_hover_text("Shows this version; Update then makes it the newest");
            if row.clicked() && !chosen {
                let apply = LooksCommand::Apply(id.clone(), Some(number));
                out.push(Command::Looks(apply));
            }
        });
    }

    /// Menu of the actions on a look.
    fn menu_ui(
        &mut self,
        ui: &mut Ui,
        id: &LookId,
        called: &str,
        chosen: bool,
        context: &PanelContext,
        out: &mut Vec<Command>,
    ) {
        let icon = RichText::new(icons::MORE).size(16.0);
        let button = Button::new(icon).min_size(Vec2::splat(MORE)).frame_when_inactive(false);
        let menu = MenuButton::from_button(button).ui(ui, |ui| {
            let can_write = id.shelf == Shelf::Person || context.session.read_only.is_none();
            let mut entry = |ui: &mut Ui, enabled: bool, words: &str, does: LooksCommand| {
                if ui.add_enabled(enabled, Button::new(words)).clicked() {
                    out.push(Command::Looks(does));
                }
            };
            let update = LooksCommand::Update(id.clone());
            entry(ui, can_write && !chosen, "Update with the current look", update);
            if ui.add_enabled(can_write, Button::new("Rename…")).clicked() {
                self.renaming = Some(Renaming { of: id.clone(), typed: id.name.to_string(), begun: false });
            }
            entry(ui, can_write, "Duplicate", LooksCommand::Duplicate(id.clone()));
            let is_open = self.open.contains(id);
            let words = if is_open { "Hide versions" } else { "Show versions" };
            if ui.button(words).clicked() {
                if is_open {
                    self.open.remove(id)
                } else {
                    self.open.insert(id.clone())
                };
            }
            let (words, enabled) = match id.shelf {
                Shelf::Project => ("Keep for all projects", true),
                Shelf::Person => ("Store in this project", context.session.read_only.is_none()),
            };
            entry(ui, enabled, words, LooksCommand::Copy(id.clone()));
            entry(ui, true, "Save look…", LooksCommand::SaveAs(id.clone()));
            ui.separator();
            entry(ui, can_write, "Remove", LooksCommand::Remove(id.clone()));
        });
        let button = menu.0.on_hover_text("Actions on this look");
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("More for {called}")));
    }

    /// The field for a new name: Enter confirms, Escape cancels.
    fn rename_ui(&mut self, ui: &mut Ui, out: &mut Vec<Command>) {
        let Some(renaming) = &mut self.renaming else { return };
        let field = TextEdit::singleline(&mut renaming.typed)
            .id(Id::unique("another name of the look"))
            .desired_width(f32::INFINITY);
        let response = ui.add(field);
        response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Another name"));
        if !std::mem::replace(&mut renaming.begun, true) {
            return response.request_focus();
        }
        let entered = ui.input(|input| input.key_pressed(Key::Enter));
        if response.lost_focus() || !response.has_focus() {
            let is_new = LookName::new(&renaming.typed).is_ok_and(|name| name != renaming.of.name);
            let said = !renaming.typed.trim().is_empty() && LookName::new(&renaming.typed).is_err();
            if entered && (is_new || said) {
                let does = LooksCommand::Rename(renaming.of.clone(), renaming.typed.clone());
                out.push(Command::Looks(does));
            }
            self.renaming = None;
        }
    }
}

/// A picture with a name beside it and a line below the name. Leaves `beside` points free at the right end. Returns the
/// row's rectangle.
fn row_ui(
    ui: &mut Ui,
    height: f32,
    version: &LookVersion,
    text: &RowText,
    beside: f32,
    thumbnails: &mut Thumbnails,
) -> (Rect, Response) {
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, text.chosen, text.called));
    if !ui.is_rect_visible(rect) {
        return (rect, response);
    }
    let painter = ui.painter().clone();
    let fill = match (text.chosen, response.hovered()) {
        (true, _) => theme::ROW_CHOSEN,
        (false, true) => theme::ROW_HOVERED,
        (false, false) => theme::PANEL,
    };
    painter.rect_filled(rect, 3.0, fill);
    if text.chosen {
        let edge = Rect::from_min_size(rect.min, vec2(3.0, rect.height()));
        painter.rect_filled(edge, 0.0, theme::ACCENT);
    }
    theme::focus_ui(ui, rect, &response);
    let side = height - 8.0;
    let picture = Rect::from_min_size(rect.min + vec2(8.0, 4.0), vec2(1.3 * side, side));
    painter.rect_filled(picture, 2.0, theme::WELL);
    if let Some(small) = &version.picture {
        let texture = thumbnails.texture(ui.ctx(), small);
        let uv = covering(texture.size_vec2(), picture.size());
        painter.image(texture.id(), picture, uv, Color32::WHITE);
    }
    let left = picture.right() + GAP;
    let width = (rect.right() - beside - left).max(1.0);
    let color = if text.chosen { Color32::WHITE } else { theme::TEXT };
    let name = line(&painter, text.name, 14.0, color, width);
    let below = line(&painter, text.below, 12.0, theme::QUIET, rect.right() - left);
    let top = rect.center().y - 0.5 * (name.size().y + below.size().y);
    let at = pos2(left, top);
    let under = at + vec2(0.0, name.size().y);
    painter.galley(at, name, color);
    painter.galley(under, below, theme::QUIET);
    (rect, response)
}

/// A line of text, cut at `width` points.
fn line(painter: &Painter, words: &str, size: f32, color: Color32, width: f32) -> std::sync::Arc<egui::Galley> {
    let font = FontId::proportional(size);
    let mut job = egui::text::LayoutJob::simple(words.to_owned(), font, color, width);
    job.wrap.max_rows = 1;
    job.wrap.break_anywhere = true;
    painter.layout_job(job)
}
