//! The recent projects as cards: first frame, name, folder and last opening.

use crate::command::{Command, ProjectCommand};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::project::recents::Recent;
use crate::panels::widgets::ago::{ago, since};
use crate::panels::widgets::fit::fitting;
use crate::panels::widgets::notice::quiet_ui;
use crate::theme::{self, GAP};
use base::files::shown;
use egui::{
    Align2, Button, Color32, CursorIcon, FontId, Frame, Label, Margin, Pos2, Rect, RichText, Role, Sense, Ui, Vec2,
    WidgetInfo, vec2,
};

/// Least width of a card in points, and its first frame's height over its width.
const WIDTH: f32 = 240.0;
const SHAPE: f32 = 0.46;

pub fn recent_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    ui.strong("Recent");
    let open = context.session.project.map(|project| &project.root);
    let others = context.picker.recents.list().iter();
    let others: Vec<&Recent> = others.filter(|recent| Some(&recent.folder) != open).collect();
    if others.is_empty() {
        quiet_ui(ui, "No recent projects");
    }
    let room = ui.available_width();
    let columns = ((room + GAP) / (WIDTH + GAP)).floor().max(1.0);
    let width = ((room - (columns - 1.0) * GAP) / columns).floor();
    for row in others.chunks(columns as usize) {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            for recent in row {
                card_ui(ui, context, recent, width, out);
            }
        });
    }
}

fn card_ui(ui: &mut Ui, context: &PanelContext, recent: &Recent, width: f32, out: &mut Vec<Command>) {
    let open = Command::Project(ProjectCommand::Open(recent.folder.clone()));
    let frame = Frame::new().fill(theme::CARD).corner_radius(4);
    frame.show(ui, |ui| {
        ui.vertical(|ui| {
            ui.set_width(width);
            ui.spacing_mut().item_spacing.y = 3.0;
            if thumbnail_ui(ui, context, recent, width) {
                out.push(open.clone());
            }
            let inside = Frame::new().inner_margin(Margin::symmetric(10, 6));
            inside.show(ui, |ui| {
                ui.set_width(width - 20.0);
                words_ui(ui, recent);
                ui.horizontal(|ui| buttons_ui(ui, recent, open, out));
            });
        });
    });
}

/// The first frame, or a neutral box; returns true if the project is to be opened.
fn thumbnail_ui(ui: &mut Ui, context: &PanelContext, recent: &Recent, width: f32) -> bool {
    let can_open = recent.trouble.is_none();
    let sense = if can_open { Sense::click() } else { Sense::hover() };
    let size = vec2(width, (SHAPE * width).round());
    let (rect, response) = ui.allocate_exact_size(size, sense);
    let name = format!("First frame of {}", recent.name);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, can_open, &name));
    let painter = ui.painter();
    painter.rect_filled(rect, 4.0, theme::WELL);
    match context.picker.recents.thumbnail(&recent.folder) {
        Some(texture) => {
            let whole = Rect::from_min_size(Pos2::ZERO, Vec2::splat(1.0));
            painter.image(texture.id(), fitting(texture.size_vec2(), rect), whole, Color32::WHITE);
        }
        None => {
            let (icon, font) = (icons::FOLDER, FontId::proportional(28.0));
            let gray = theme::PLACEHOLDER;
            painter.text(rect.center(), Align2::CENTER_CENTER, icon, font, gray);
        }
    }
    theme::focus_ui(ui, rect, &response);
    can_open && response.on_hover_cursor(CursorIcon::PointingHand).clicked()
}

/// Name, folder, and the last opening, or the reason why the project cannot be opened.
fn words_ui(ui: &mut Ui, recent: &Recent) {
    ui.add(Label::new(RichText::new(&recent.name).strong()).truncate());
    let quiet = |text: String| RichText::new(text).color(theme::QUIET).size(12.0);
    let folder = Label::new(quiet(shown(&recent.folder))).truncate();
    ui.add(folder.sense(Sense::hover()));
    match (&recent.trouble, recent.opened) {
        (Some(trouble), _) => {
            ui.label(RichText::new(trouble).color(theme::WARNING).size(12.0));
        }
        (None, Some(opened)) => {
            ui.label(quiet(format!("Opened {}", ago(since(opened)))));
        }
        (None, None) => {}
    }
}

fn buttons_ui(ui: &mut Ui, recent: &Recent, open: Command, out: &mut Vec<Command>) {
    let button = |ui: &mut Ui, text: &str, enabled: bool| {
        let name = format!("{text} {}", recent.name);
        icons::named_ui(ui, enabled, Button::new(text), &name)
    };
    if button(ui, "Open", recent.trouble.is_none()).clicked() {
        out.push(open);
    }
    let hint = "Removes it from this list. Nothing on disk changes.";
    if button(ui, "Remove", true).on_hover_text(hint).clicked() {
        let folder = recent.folder.clone();
        out.push(Command::Project(ProjectCommand::Forget(folder)));
    }
}
