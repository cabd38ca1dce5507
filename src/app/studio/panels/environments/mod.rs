//! The list of environments: favourites, the shoot's own, the built-in ones, added and watched ones by folder.

pub mod command;
mod groups;
mod handler;
pub mod library;

use crate::command::{Command, Dialog, EnvironmentsCommand, LookCommand, WindowCommand};
use crate::environment_list::Owner;
use crate::icons;
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use base::files;
use egui::{
    Button, Color32, Event, Key, Mesh, Pos2, Rect, Response, RichText, Sense, Shape, TextEdit, Ui, Vec2, pos2, vec2,
};
use groups::EnvironmentGroup;
use library::{EnvironmentEntry, MOST_WATCHED, PanoramaState};
use std::path::{Path, PathBuf};

/// Side of the button that removes an entry, and of a star, in points.
const REMOVE: f32 = 20.0;
const STAR: f32 = 20.0;

/// Holds the environment drawn last, and a pending focus request.
#[derive(Default)]
pub struct EnvironmentsPanel {
    /// Environment in use when the panel was last drawn.
    last: Option<usize>,
    /// The search field takes the focus at the next draw.
    focus: bool,
}

impl EnvironmentsPanel {
    /// Focuses the search field.
    pub fn focus(&mut self) {
        self.focus = true;
    }

    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if icons::worded_ui(ui, icons::ADD, "Add…")
                    .on_hover_text(
                        "Add panoramas: EXR, HDR, or 8- or 16-bit pictures. They can also be dropped anywhere. A \
                         dropped folder is watched: its HDRIs are listed in every project.",
                    )
                    .clicked()
                {
                    out.push(Command::Dialog(Dialog::Environments));
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    let heading = RichText::new("Environments").strong();
                    ui.add(egui::Label::new(heading).truncate());
                });
            });
        });
        if context.environments().is_empty() {
            ui.label(RichText::new("None yet. Add lat-long panoramas, or drop them here.").color(theme::QUIET));
            return;
        }
        let groups = groups::shown(context.environments(), &context.state.search);
        self.search_ui(ui, context, &groups, out);
        if groups.is_empty() {
            ui.label(RichText::new("No environment matches").color(theme::QUIET));
        }
        let shown = context.state.look.environment;
        let is_new = self.last.is_some_and(|last| last != shown);
        self.last = Some(shown);
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            // Keeps the buttons clear of the scroll bar.
            ui.set_max_width(ui.available_width() - GAP);
            let mut roots: Vec<&PathBuf> = context.autosave.watched().iter().collect();
            for group in &groups {
                // A folded group opens for search results, and for an entry chosen with a key.
                let searched = !context.state.search.trim().is_empty();
                let heading = format!("environments/{}", group.title);
                let folded = context.autosave.folded().contains(&heading);
                let unfolds = folded && is_new && group.entries.contains(&shown);
                let hides = folded && !unfolds && !searched;
                let heading_row = heading_ui(ui, group, hides);
                // The first group of a watched folder stands for all.
                let holds = |root: &&PathBuf| group.folder.iter().any(|one| one.starts_with(root));
                if let Some(at) = roots.iter().position(holds) {
                    unwatch_ui(ui, roots.remove(at), heading_row.rect, out);
                }
                if heading_row.clicked() || unfolds {
                    out.push(Command::Window(WindowCommand::Fold(heading, !hides && !unfolds)));
                }
                if hides {
                    continue;
                }
                for &i in &group.entries {
                    if let Some(entry) = context.environments().get(i) {
                        self.entry_ui(ui, i, entry, (i == shown, is_new), context, out);
                    }
                }
            }
            if context.state.search.trim().is_empty() {
                watched_ui(ui, context, &roots, out);
            }
        });
    }

    fn entry_ui(
        &self,
        ui: &mut Ui,
        i: usize,
        entry: &EnvironmentEntry,
        (chosen, is_new): (bool, bool),
        context: &PanelContext,
        out: &mut Vec<Command>,
    ) {
        let row = row_ui(ui, entry, context, chosen);
        if chosen && is_new {
            row.scroll_to_me(None);
        }
        let is_over = ui.rect_contains_pointer(row.rect);
        if !ui.is_rect_visible(row.rect) {
            return;
        }
        if let PanoramaState::Unread = entry.panorama {
            out.push(Command::Environments(EnvironmentsCommand::Read(i)));
        }
        if (entry.favourite || chosen || is_over) && star_ui(ui, i, entry, row.rect) {
            let toggle = EnvironmentsCommand::ToggleFavourite(Some(i));
            out.push(Command::Environments(toggle));
        } else if chosen && entry.listed.owner == Owner::Person && remove_ui(ui, entry, row.rect) {
            out.push(Command::Look(LookCommand::RemoveEnvironment(i)));
        } else if row.clicked() {
            if entry.panorama.is_failed() {
                out.push(Command::Environments(EnvironmentsCommand::Read(i)));
            }
            let is_solo = context.state.look.lighting.is_solo() || !context.state.solo.is_empty();
            if is_solo || !chosen {
                out.push(entry.choose(i));
            }
        }
    }

    /// The search field. Up and Down step through the matches, Enter takes the first, Escape clears the field.
    fn search_ui(&mut self, ui: &mut Ui, context: &PanelContext, groups: &[EnvironmentGroup], out: &mut Vec<Command>) {
        let mut words = context.state.search.clone();
        let field = TextEdit::singleline(&mut words)
            .id(egui::Id::unique("search environments"))
            .hint_text(format!("{} Search", icons::SEARCH))
            .desired_width(f32::INFINITY);
        let response = ui.add(field);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Search environments"));
        if std::mem::take(&mut self.focus) {
            response.request_focus();
        }
        let search = |words: String| Command::Environments(EnvironmentsCommand::Search(words));
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        // Escape has removed the focus, and the window has consumed the key: only the raw events still hold it.
        let escape = |event: &Event| {
            let key = Key::Escape;
            matches!(event, Event::Key { key: of, pressed: true, .. } if *of == key)
        };
        let escaped = ui.input(|input| input.raw.events.iter().any(escape));
        if response.changed() {
            out.push(search(words));
        } else if response.lost_focus() && escaped {
            out.push(search(String::new()));
        } else if response.lost_focus() && pressed(Key::Enter) {
            let shown = context.state.look.environment;
            let found = groups.iter().flat_map(|group| &group.entries);
            if let (Some(&first), false) = (found.clone().next(), found.clone().any(|&i| i == shown))
                && let Some(entry) = context.environments().get(first)
            {
                out.push(entry.choose(first));
            }
        } else if response.has_focus() {
            for (key, step) in [(Key::ArrowDown, 1), (Key::ArrowUp, -1)] {
                if pressed(key) {
                    out.push(Command::Environments(EnvironmentsCommand::Step(step)));
                }
            }
        }
    }
}

/// The heading of a group.
fn heading_ui(ui: &mut Ui, group: &EnvironmentGroup, folded: bool) -> Response {
    let arrow = if folded { icons::NEXT } else { icons::DOWN };
    let arrow = RichText::new(arrow).size(12.0).color(theme::QUIET);
    let words = format!("{} ({})", group.title, group.entries.len());
    let words = RichText::new(words).size(12.0).color(theme::QUIET);
    let heading = Button::new((arrow, words)).frame_when_inactive(false).truncate().min_size(vec2(0.0, 20.0));
    ui.spacing_mut().button_padding = vec2(2.0, 1.0);
    let response = ui.add(heading);
    response.widget_info(|| {
        let name = format!("Environments: {}", group.title);
        egui::WidgetInfo::selected(egui::Role::DisclosureTriangle, true, !folded, name)
    });
    response
}

/// A line for each watched folder without a group of its own, and for each that has more than is listed.
fn watched_ui(ui: &mut Ui, context: &PanelContext, alone: &[&PathBuf], out: &mut Vec<Command>) {
    for root in context.autosave.watched() {
        let files = context.environments().iter().filter_map(|one| one.listed.file());
        let count = files.filter(|file| file.starts_with(root)).count();
        let has_group = !alone.contains(&root);
        let is_closed = context.library.scan().map(|scan| scan.closed.contains(root));
        let says = match (is_closed, count) {
            (None, _) => "reading".to_owned(),
            (Some(true), _) => "cannot be opened; connect its disk, or allow reading it".to_owned(),
            (_, MOST_WATCHED..) => format!("the first {MOST_WATCHED} are listed"),
            _ if has_group => continue,
            (_, 0) => "no panorama found".to_owned(),
            _ => "listed above".to_owned(),
        };
        let line = RichText::new(format!("{}: {says}", files::shown(root))).color(theme::QUIET);
        let line = ui.label(line);
        if !has_group {
            unwatch_ui(ui, root, line.rect, out);
        }
    }
}

/// The button at the right end of a line that stops watching a folder.
fn unwatch_ui(ui: &Ui, folder: &Path, line: Rect, out: &mut Vec<Command>) {
    let right = pos2(ui.max_rect().right(), line.center().y);
    let place = Rect::from_center_size(right - vec2(0.5 * REMOVE, 0.0), Vec2::splat(REMOVE));
    let name = format!("Stop watching {}", files::shown(folder));
    if cross_ui(ui, &name, place).on_hover_text(format!("{name}; the files are kept")).clicked() {
        out.push(Command::Environments(EnvironmentsCommand::Unwatch(folder.to_path_buf())));
    }
}

/// One environment of the list.
fn row_ui(ui: &mut Ui, entry: &EnvironmentEntry, context: &PanelContext, chosen: bool) -> Response {
    let size = vec2(ui.available_width(), 46.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &entry.listed.name));
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let fill = match (chosen, response.hovered()) {
        (true, _) => theme::ROW_CHOSEN,
        (false, true) => theme::ROW_HOVERED,
        (false, false) => theme::PANEL,
    };
    ui.painter().rect_filled(rect, 3.0, fill);
    if chosen {
        ui.painter().rect_filled(Rect::from_min_size(rect.min, vec2(3.0, rect.height())), 0.0, theme::ACCENT);
    }
    theme::focus_ui(ui, rect, &response);
    let picture = Rect::from_min_size(rect.min + vec2(8.0, 5.0), vec2(72.0, 36.0));
    ui.painter().rect_filled(picture, 0.0, theme::WELL);
    let yaw_deg = context.state.look.yaw_deg;
    panorama_ui(ui, entry, picture, entry.listed.front().turned(yaw_deg));
    let removable = chosen && entry.listed.owner == Owner::Person;
    let text = Rect::from_min_max(
        pos2(picture.right() + GAP, rect.top()),
        rect.max - vec2(if removable { REMOVE } else { GAP }, 0.0),
    );
    let state = match &entry.panorama {
        PanoramaState::Unread | PanoramaState::Waiting => Some(["", "Reading"]),
        PanoramaState::Failed(_) => Some([icons::WARNING, "Unreadable"]),
        PanoramaState::Done { .. } if entry.listed.asks() => Some([icons::FRONT, "Front?"]),
        PanoramaState::Done { panorama, .. } if !panorama.notes.is_empty() => Some(["", "See notes"]),
        PanoramaState::Done { .. } => None,
    };
    let color = if chosen { Color32::WHITE } else { theme::TEXT };
    // With a state below it, the name gets one line.
    let line = |words: &str, size: f32, color, max_rows: usize| {
        let font = egui::FontId::proportional(size);
        let mut job = egui::text::LayoutJob::simple(words.to_owned(), font, color, text.width());
        job.wrap.max_rows = max_rows;
        ui.painter().layout_job(job)
    };
    let name = line(&entry.listed.name, 14.0, color, if state.is_some() { 1 } else { 2 });
    let state = state.map(|parts| line(parts.join(" ").trim(), 12.0, theme::QUIET, 1));
    let height = name.size().y + state.as_ref().map_or(0.0, |state| state.size().y);
    let at = pos2(text.left(), text.center().y - height / 2.0);
    let below = at + vec2(0.0, name.size().y);
    ui.painter().galley(at, name, color);
    if let Some(state) = state {
        ui.painter().galley(below, state, theme::QUIET);
    }
    match &entry.panorama {
        PanoramaState::Failed(sentence) => response.on_hover_text(format!("{sentence}\nClick to try again")),
        PanoramaState::Done { panorama, .. } => {
            let (width, height) = panorama.size;
            let (from, whose) = (&entry.listed.origin, entry.listed.owner.says());
            let mut hint = format!("{from}\n{whose}, {width} × {height} pixels");
            for note in &panorama.notes {
                hint += &format!("\n{note}");
            }
            response.on_hover_text(hint)
        }
        PanoramaState::Unread | PanoramaState::Waiting => response,
    }
}

/// The button that removes a row's entry; returns true if it was clicked.
fn remove_ui(ui: &Ui, entry: &EnvironmentEntry, row: Rect) -> bool {
    let name = format!("Remove {}", entry.listed.name);
    let place = Rect::from_min_size(row.right_top() - vec2(REMOVE, 0.0), Vec2::splat(REMOVE));
    cross_ui(ui, &name, place).on_hover_text(format!("{name} from the list; the file is kept")).clicked()
}

/// A cross to click.
fn cross_ui(ui: &Ui, name: &str, place: Rect) -> Response {
    let response = ui.interact(place, ui.scope_id().with(name), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    let color = if response.hovered() || response.has_focus() { theme::ACCENT } else { theme::QUIET };
    let font = egui::FontId::proportional(14.0);
    ui.painter().text(place.center(), egui::Align2::CENTER_CENTER, icons::REMOVE, font, color);
    response
}

/// The star over a row's picture; returns true if it was clicked.
fn star_ui(ui: &Ui, i: usize, entry: &EnvironmentEntry, row: Rect) -> bool {
    let name = &entry.listed.name;
    let (called, hint) = if entry.favourite {
        (format!("Unstar {name}"), "Removes it from the favourites")
    } else {
        (format!("Star {name}"), "A favourite: first in the list, in every project. Key: S")
    };
    let place = Rect::from_min_size(row.min + vec2(8.0, 5.0), Vec2::splat(STAR));
    let response = ui.interact(place, ui.scope_id().with(("star", i)), Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, entry.favourite, &called));
    let painter = ui.painter();
    painter.rect_filled(place, 3.0, Color32::from_black_alpha(160));
    let color =
        if entry.favourite || response.hovered() || response.has_focus() { Color32::WHITE } else { theme::QUIET };
    if entry.favourite {
        painter.add(star(place.center(), 0.4 * STAR, color));
    } else {
        let font = egui::FontId::proportional(14.0);
        let center = egui::Align2::CENTER_CENTER;
        painter.text(place.center(), center, icons::STAR, font, color);
    }
    response.on_hover_text(hint).clicked()
}

/// A full star.
fn star(center: Pos2, radius: f32, color: Color32) -> Shape {
    let mut mesh = Mesh::default();
    mesh.colored_vertex(center, color);
    for i in 0..10u32 {
        // The inner corners of a pentagram.
        let radius = if i % 2 == 0 { radius } else { 0.45 * radius };
        let angle = std::f32::consts::PI * (i as f32 / 5.0 - 0.5);
        mesh.colored_vertex(center + radius * Vec2::angled(angle), color);
        mesh.add_triangle(0, 1 + i, 1 + (i + 1) % 10);
    }
    Shape::mesh(mesh)
}

/// The panorama turned by `yaw_deg`; positive angles move the content to the right.
pub(super) fn panorama_ui(ui: &Ui, entry: &EnvironmentEntry, rect: Rect, yaw_deg: f32) {
    if let PanoramaState::Done { thumbnail, .. } = &entry.panorama {
        let from = -yaw_deg / 360.0;
        let part = Rect::from_min_max(Pos2::new(from, 0.0), Pos2::new(from + 1.0, 1.0));
        ui.painter().image(thumbnail.id(), rect, part, Color32::WHITE);
    }
}

impl EnvironmentEntry {
    /// Lights the subject with this entry at `place`.
    pub fn choose(&self, place: usize) -> Command {
        Command::Look(match (self.listed.owner, self.listed.file()) {
            (Owner::Folder, Some(file)) => LookCommand::TryEnvironment(file.to_path_buf()),
            _ => LookCommand::Environment(place),
        })
    }
}
