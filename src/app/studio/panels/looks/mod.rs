//! The stored looks: stores the current look under a name; a click shows a stored look.

pub mod command;
mod handler;
mod row;

use crate::command::{Command, Dialog, LooksCommand};
use crate::icons;
use crate::look_name::LookName;
use crate::panel_context::PanelContext;
use crate::stored_looks::{LookId, Shelf};
use crate::theme::{self, GAP};
use egui::{Button, Id, Key, RichText, ScrollArea, TextEdit, TextureHandle, Ui, WidgetInfo, vec2};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use worker::SrgbPicture;

/// Width of the button beside the name in points.
const STORE: f32 = 66.0;

/// Holds the typed name, the unfolded looks, and the thumbnails drawn last.
#[derive(Default)]
pub struct LooksPanel {
    name: String,
    /// The look that the name was copied from.
    named: Option<LookId>,
    renaming: Option<Renaming>,
    /// Looks whose versions are listed.
    open: BTreeSet<LookId>,
    /// Removed looks are listed.
    removed: bool,
    thumbnails: Thumbnails,
}

/// The look being renamed, and the typed name.
struct Renaming {
    of: LookId,
    typed: String,
    /// The field was shown already.
    begun: bool,
}

/// Thumbnail textures drawn in this frame and in the one before.
#[derive(Default)]
pub struct Thumbnails {
    now: HashMap<usize, (Arc<SrgbPicture>, TextureHandle)>,
    before: HashMap<usize, (Arc<SrgbPicture>, TextureHandle)>,
}

impl Thumbnails {
    /// The texture of a picture.
    fn texture(&mut self, ctx: &egui::Context, picture: &Arc<SrgbPicture>) -> &TextureHandle {
        let key = Arc::as_ptr(picture) as usize;
        let before = &mut self.before;
        let entry = self.now.entry(key).or_insert_with(|| {
            before.remove(&key).unwrap_or_else(|| {
                let size = [picture.width, picture.height];
                let codes = egui::ColorImage::from_rgb(size, &picture.rgb);
                let options = egui::TextureOptions::LINEAR;
                (picture.clone(), ctx.load_texture("look", codes, options))
            })
        });
        &entry.1
    }

    /// Drops the textures that the last frame did not draw.
    fn next_frame(&mut self) {
        self.before = std::mem::take(&mut self.now);
    }
}

impl LooksPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        self.thumbnails.next_frame();
        ui.add_space(GAP);
        ui.horizontal(|ui| {
            ui.strong("Looks");
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let hint = "Load a look file (.look.json), or drop one anywhere.";
                let load = icons::worded_ui(ui, icons::FOLDER, "Load…");
                if load.on_hover_text(hint).clicked() {
                    out.push(Command::Dialog(Dialog::LoadLook));
                }
            });
        });
        self.store_ui(ui, context, out);
        let four = Button::new((icons::FOUR, "Compare four"))
            .selected(context.state.four.on)
            .min_size(vec2(ui.available_width(), 24.0));
        let hint = "Four looks side by side. Key: 4";
        if icons::named_ui(ui, true, four, "Compare four").on_hover_text(hint).clicked() {
            out.push(Command::Looks(LooksCommand::ToggleFour));
        }
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            // Keeps the buttons clear of the scroll bar.
            ui.set_max_width(ui.available_width() - GAP);
            let looks = context.looks;
            if Shelf::ALL.iter().all(|&shelf| looks.looks(shelf).is_empty()) {
                ui.add_space(GAP);
                let text = "None yet. Type a name and press Store: it keeps environment, lights, effects and keys.";
                ui.label(RichText::new(text).color(theme::QUIET));
            }
            for (shelf, title) in [(Shelf::Project, "This project"), (Shelf::Person, "All projects")] {
                if !looks.looks(shelf).is_empty() {
                    heading_ui(ui, title);
                }
                for look in looks.looks(shelf) {
                    let id = LookId { shelf, name: look.name.clone() };
                    self.look_ui(ui, &id, look, context, out);
                }
            }
            self.removed_ui(ui, context, out);
        });
    }

    /// The name under which the current look is stored.
    fn store_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let current = context.looks.current.as_ref().map(|(id, _)| id);
        if current.is_some() && current != self.named.as_ref() {
            self.named = current.cloned();
            self.name = current.map_or(String::new(), |id| id.name.to_string());
        }
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let field = TextEdit::singleline(&mut self.name)
                .id(Id::unique("name of the look"))
                .hint_text("Name")
                .desired_width(ui.available_width() - STORE - 16.0);
            let response = ui.add(field);
            response.widget_info(|| WidgetInfo::labeled(egui::Role::TextInput, true, "Name of the look"));
            let entered = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            let name = LookName::new(&self.name);
            let named = self.named.as_ref().filter(|id| {
                // An update goes to the shelf that the look is on.
                name.as_ref().is_ok_and(|name| name.is_like(&id.name))
            });
            let id = name.as_ref().ok().map(|name| {
                let shelf = named.map_or(Shelf::Project, |id| id.shelf);
                let mut stored = context.looks.looks(shelf).iter().map(|look| &look.name);
                let like = stored.find(|one| one.is_like(name));
                let name = like.unwrap_or(name).clone();
                LookId { shelf, name }
            });
            let newest = id.as_ref().and_then(|id| context.looks.version(id, None));
            let state = context.state;
            let same = newest.is_some_and(|newest| newest.look.is(&state.look, state.frame));
            let is_project = id.as_ref().is_none_or(|id| id.shelf == Shelf::Project);
            let why = match (&name, context.session.read_only) {
                (_, Some(_)) if is_project => Some("This window only reads the project".to_owned()),
                _ if self.name.trim().is_empty() => Some("Type a name first".to_owned()),
                (Err(e), _) => Some(e.to_string()),
                _ if same => Some("Nothing has changed".to_owned()),
                _ => None,
            };
            let (words, hint) = match newest {
                Some(_) => ("Update", "Stores a new version; older ones stay"),
                None => ("Store", "Stores the current look under this name"),
            };
            let button = theme::main_button(why.is_none(), words).min_size(vec2(STORE, 24.0));
            let response = icons::named_ui(ui, why.is_none(), button, words).on_hover_text(hint);
            let response = match &why {
                Some(why) => response.on_disabled_hover_text(why),
                None => response,
            };
            if let (true, None, Some(id)) = (response.clicked() || entered, &why, id) {
                out.push(Command::Looks(match newest {
                    Some(_) => LooksCommand::Update(id),
                    None => LooksCommand::Store(self.name.clone()),
                }));
            }
        });
    }

    /// The removed looks, each with a button that restores it.
    fn removed_ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let removed = Shelf::ALL.map(|shelf| context.looks.removed(shelf));
        let count = removed.iter().map(|names| names.len()).sum::<usize>();
        if count == 0 {
            return;
        }
        ui.add_space(GAP);
        let arrow = if self.removed { icons::DOWN } else { icons::NEXT };
        let arrow = RichText::new(arrow).size(12.0).color(theme::QUIET);
        let words = RichText::new(format!("Removed ({count})")).color(theme::QUIET);
        let fold = Button::new((arrow, words)).frame_when_inactive(false);
        if icons::named_ui(ui, true, fold, "Removed looks").clicked() {
            self.removed = !self.removed;
        }
        if !self.removed {
            return;
        }
        for (shelf, names) in Shelf::ALL.into_iter().zip(removed) {
            for name in names {
                ui.horizontal(|ui| {
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        let back = Button::new(RichText::new("Restore").size(12.0));
                        let called = format!("Restore {name}");
                        if icons::named_ui(ui, true, back, &called).clicked() {
                            let name = name.clone();
                            let id = LookId { shelf, name };
                            out.push(Command::Looks(LooksCommand::BringBack(id)));
                        }
                        ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                            let text = RichText::new(name.text()).color(theme::QUIET);
                            ui.add(egui::Label::new(text).truncate());
                        });
                    });
                });
            }
        }
    }
}

/// Heading of a shelf: where the looks below are stored.
pub fn heading_ui(ui: &mut Ui, title: &str) {
    ui.add_space(GAP);
    ui.label(RichText::new(title).size(12.0).color(theme::QUIET));
}
