//! The stored looks and their older versions, as entries of a menu.

use crate::four_looks::FourSlot;
use crate::panel_context::PanelContext;
use crate::panels::widgets::ago::{minutes_ago, since};
use crate::stored_looks::{LookId, Shelf};
use crate::theme;
use egui::{RichText, ScrollArea, Ui};

/// Title of a look in a list.
fn titled(id: &LookId) -> String {
    match id.shelf {
        Shelf::Project => id.name.to_string(),
        Shelf::Person => format!("{} (all projects)", id.name),
    }
}

/// A list in a menu. Its height is reserved, because the menu may open before the list is read.
pub fn list() -> ScrollArea {
    ScrollArea::vertical().min_scrolled_height(320.0)
}

/// The looks of a project and of a person, each with its older versions below. Returns the clicked look and the
/// version's number. None as the number means the newest version, also after a later update.
pub fn look_list_ui(ui: &mut Ui, context: &PanelContext, now: &FourSlot) -> Option<(LookId, Option<u32>)> {
    let mut clicked = None;
    let mut is_empty = true;
    list().show(ui, |ui| {
        for shelf in Shelf::ALL {
            for look in context.looks.looks(shelf) {
                is_empty = false;
                let name = look.name.clone();
                let id = LookId { shelf, name };
                let newest = std::iter::once((None, titled(&id), look.versions.first()));
                let older = look.versions.iter().skip(1).map(|version| {
                    let number = version.number;
                    let text = format!("{}, version {number}", titled(&id));
                    (Some(number), text, Some(version))
                });
                for (number, text, version) in newest.chain(older) {
                    let chosen = matches!(now, FourSlot::Stored(of, at) if *of == id && *at == number);
                    let entry = ui.selectable_label(chosen, text);
                    let entry = match version {
                        Some(version) => entry.on_hover_text(minutes_ago(since(version.look.stored))),
                        None => entry,
                    };
                    if entry.clicked() {
                        clicked = Some((id.clone(), number));
                    }
                }
            }
        }
    });
    if is_empty {
        ui.label(RichText::new("None yet: store one in Looks").color(theme::QUIET));
    }
    clicked
}
