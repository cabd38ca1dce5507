//! The list of all commands: typing filters it, arrow keys select, Enter runs the selected command.

use super::command::{Command, Dialog, JobCommand, LightsCommand, LookCommand, LooksCommand, WindowCommand};
use super::environment_list::Owner;
use super::keys;
use super::layout::Pane;
use super::look::Group;
use super::panel_context::PanelContext;
use super::panels::environments::library::EnvironmentEntry;
use super::stored_looks::Shelf;
use super::theme::{self, GAP};
use egui::{Id, Key, Modal, RichText, ScrollArea, TextEdit};

/// Commands without a shortcut.
const OTHERS: [(&str, Command); 17] = [
    ("Add environments…", Command::Dialog(Dialog::Environments)),
    ("Watch a folder of HDRIs…", Command::Dialog(Dialog::EnvironmentFolder)),
    ("Load look…", Command::Dialog(Dialog::LoadLook)),
    ("Add light", Command::Lights(LightsCommand::Add)),
    ("Remove light", Command::Lights(LightsCommand::Remove)),
    ("Compare with truth…", Command::Dialog(Dialog::ComparisonTruth)),
    ("Measure against truth…", Command::Dialog(Dialog::Truth)),
    ("Save the report…", Command::Dialog(Dialog::ReportPage)),
    ("Performance of this machine", Command::Window(WindowCommand::ToggleMachine)),
    ("Stop the job", Command::Job(JobCommand::Stop)),
    ("Reset the environment's rotation", reset(Group::Environment)),
    ("Reset the grade", reset(Group::Grade)),
    ("Remove all lights", reset(Group::Lights)),
    ("Reset the picture", reset(Group::Picture)),
    ("Reset the effects", reset(Group::Effects)),
    ("Reset the layout of panels", Command::Window(WindowCommand::ResetLayout)),
    ("Clear the log", Command::Window(WindowCommand::ClearLog)),
];

const fn reset(group: Group) -> Command {
    Command::Look(LookCommand::Reset(group))
}

/// A command, its label, and its shortcut if it has one.
struct PaletteEntry {
    label: String,
    key: String,
    command: Command,
}

/// The palette, with the typed text.
#[derive(Default)]
pub struct Palette {
    typed: String,
    /// The selected entry, which Enter runs.
    chosen: usize,
}

impl Palette {
    pub fn ui(&mut self, ui: &egui::Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let frame = egui::Frame::window(ui.style()).inner_margin(1.5 * GAP);
        let modal = Modal::new(Id::unique("palette")).frame(frame);
        let shown = modal.show(ui.ctx(), |ui| {
            ui.set_width(460.0);
            let field = TextEdit::singleline(&mut self.typed).hint_text("Find a command").desired_width(f32::INFINITY);
            let response = ui.add(field);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Find a command"));
            response.request_focus();
            if response.changed() {
                self.chosen = 0;
            }
            let found = matching(all(ui.ctx(), context), &self.typed);
            let (enter, down, up) = ui.input(|i| {
                let presses = |key| i.num_presses(key);
                (i.key_pressed(Key::Enter), presses(Key::ArrowDown), presses(Key::ArrowUp))
            });
            let last = found.len().saturating_sub(1);
            self.chosen = (self.chosen + down).saturating_sub(up).min(last);
            let first = found.get(self.chosen).filter(|_| enter);
            let mut chosen = first.map(|first| first.command.clone());
            // Constant height, so that nothing moves while the list gets shorter.
            ScrollArea::vertical().max_height(320.0).min_scrolled_height(320.0).auto_shrink(false).show(ui, |ui| {
                for (place, entry) in found.iter().enumerate() {
                    ui.horizontal(|ui| {
                        let is_chosen = place == self.chosen;
                        let line = ui.selectable_label(is_chosen, &entry.label);
                        if is_chosen && down + up > 0 {
                            line.scroll_to_me(None);
                        }
                        if line.clicked() {
                            chosen = Some(entry.command.clone());
                        }
                        let right = egui::Layout::right_to_left(egui::Align::Center);
                        ui.with_layout(right, |ui| {
                            ui.label(RichText::new(&entry.key).color(theme::QUIET));
                        });
                    });
                }
                if found.is_empty() {
                    ui.label(RichText::new("No command has this name").color(theme::QUIET));
                }
            });
            chosen
        });
        if shown.inner.is_some() || shown.should_close() {
            out.push(Command::Window(WindowCommand::TogglePalette));
            out.extend(shown.inner);
        }
    }
}

fn all(ctx: &egui::Context, context: &PanelContext) -> Vec<PaletteEntry> {
    let bound = keys::listed(ctx, context.state.panes.active).into_iter().map(|listed| PaletteEntry {
        label: listed.label.to_owned(),
        key: listed.key,
        command: listed.command,
    });
    let others = OTHERS.map(|(label, command)| entry(label.to_owned(), command));
    let panes = Pane::ALL.map(|pane| {
        let show = Command::Window(WindowCommand::ShowPane(pane));
        entry(format!("Panel: {}", pane.name()), show)
    });
    let listed = |(_, entry): &(usize, &EnvironmentEntry)| entry.listed.owner != Owner::Folder;
    let environments = context.environments().iter().enumerate().filter(listed);
    let environments = environments.map(|(i, e)| entry(format!("Environment: {}", e.listed.name), e.choose(i)));
    let looks = context.looks.ids().map(|id| {
        let label = match id.shelf {
            Shelf::Project => format!("Look: {}", id.name),
            Shelf::Person => format!("Look for all projects: {}", id.name),
        };
        entry(label, Command::Looks(LooksCommand::Apply(id, None)))
    });
    bound.chain(others).chain(panes).chain(environments).chain(looks).collect()
}

/// A command without a shortcut.
fn entry(label: String, command: Command) -> PaletteEntry {
    PaletteEntry { label, key: String::new(), command }
}

/// The entries that contain every typed word, in any order.
fn matching(mut entries: Vec<PaletteEntry>, typed: &str) -> Vec<PaletteEntry> {
    let typed = typed.to_lowercase();
    entries.retain(|entry| {
        let label = entry.label.to_lowercase();
        typed.split_whitespace().all(|word| label.contains(word))
    });
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_narrow_the_list_in_any_order_and_case() {
        let entries = || OTHERS.map(|(label, command)| entry(label.to_owned(), command));
        assert_eq!(matching(entries().into(), "").len(), OTHERS.len());
        let found = matching(entries().into(), "  LOOK load");
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].command, Command::Dialog(Dialog::LoadLook));
        assert!(matching(entries().into(), "no such").is_empty());
    }
}
