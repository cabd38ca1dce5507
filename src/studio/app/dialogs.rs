//! The system's file dialogs.

use super::StudioApp;
use super::drops::PANORAMAS;
use crate::command::{
    Command, Dialog, ExportCommand, LookCommand, ProjectCommand, ReviewCommand, ViewCommand,
};
use crate::comparison::{CompareSettings, Reference};
use crate::wizard::Plan;
use rfd::FileDialog;
use std::path::PathBuf;
use std::sync::Arc;
use worker::Latest;
use worker::background::catch_panic;

/// The dialogs. Each runs on a thread of its own, so that the window does not wait.
pub struct Dialogs {
    /// What the last dialog gave, or why it failed.
    chosen: Arc<Latest<Result<Command, String>>>,
}

impl Dialogs {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            chosen: Arc::new(Latest::new(wake)),
        }
    }

    /// Shows a dialog; what it gives is applied when it closes.
    fn show(&self, ask: impl FnOnce() -> Option<Command> + Send + 'static) {
        let chosen = self.chosen.clone();
        std::thread::spawn(move || match catch_panic(|| Ok(ask())) {
            Ok(None) => {}
            Ok(Some(command)) => chosen.put(Ok(command)),
            Err(e) => chosen.put(Err(e.to_string())),
        });
    }

    fn folder(&self, title: &'static str, then: impl FnOnce(PathBuf) -> Command + Send + 'static) {
        self.show(move || FileDialog::new().set_title(title).pick_folder().map(then));
    }
}

impl StudioApp {
    /// The command for what was chosen in a dialog since the last call. A dialog that failed is said.
    pub(super) fn chosen(&mut self) -> Option<Command> {
        let chosen = self.dialogs.chosen.take()?;
        chosen.map_err(|failure| self.status.refuse(failure)).ok()
    }

    pub(super) fn open_dialog(&self, dialog: Dialog) {
        let dialogs = &self.dialogs;
        match dialog {
            Dialog::Environments => dialogs.show(|| {
                let dialog = FileDialog::new().set_title("Add environments");
                let files = dialog.add_filter("Panoramas", &PANORAMAS).pick_files()?;
                Some(Command::Look(LookCommand::AddEnvironments(files)))
            }),
            Dialog::ComparisonTruth => {
                let compare = self.state.compare.clone();
                dialogs.folder("Compare with true OLATs", move |folder| {
                    Command::View(ViewCommand::Compare(CompareSettings {
                        on: true,
                        reference: Reference::Truth(folder),
                        ..compare
                    }))
                });
            }
            Dialog::Project => dialogs.folder("Open a project", |folder| {
                Command::Project(ProjectCommand::Open(folder))
            }),
            Dialog::Shoot => dialogs.folder("Choose the shoot's folder", |shoot| {
                Command::Project(ProjectCommand::New(Some(shoot)))
            }),
            Dialog::ShootPart(slot) => dialogs.show(move || {
                let dialog = FileDialog::new()
                    .set_title("Choose a movie, or the first picture of a sequence");
                let files = dialog.pick_files()?;
                Some(Command::Project(ProjectCommand::Bring(files, Some(slot))))
            }),
            Dialog::ProjectFolder => {
                let plan = self.picker.wizard.plan().cloned().unwrap_or_default();
                dialogs.folder("Choose the project's folder", move |folder| {
                    let folder = folder.display().to_string();
                    let plan = Plan { folder, ..plan };
                    Command::Project(ProjectCommand::Plan(Some(Box::new(plan))))
                });
            }
            Dialog::ShootLocation => dialogs.folder("Locate the project's shoot", |folder| {
                Command::Project(ProjectCommand::Locate(folder))
            }),
            Dialog::Destination => self.choose_destination(),
            Dialog::Truth => dialogs.folder("Choose a folder with true OLATs", |truth| {
                Command::Review(ReviewCommand::Measure(Some(truth)))
            }),
            Dialog::ReportPage => dialogs.show(|| {
                let dialog = FileDialog::new().set_title("Save the report");
                let dialog = dialog.add_filter("Web page", &["html"]);
                let page = dialog.set_file_name("review.html").save_file()?;
                Some(Command::Review(ReviewCommand::Report(page)))
            }),
        }
    }

    fn choose_destination(&self) {
        let Some(project) = &self.session.project else {
            return;
        };
        let (root, options) = (project.root.clone(), self.state.export_options.clone());
        self.dialogs.show(move || {
            let name = root.join(&options.name);
            let folder = name.parent().filter(|folder| folder.is_dir());
            let mut dialog = FileDialog::new()
                .set_title("Export to")
                .set_directory(folder.unwrap_or(&root));
            if let Some(name) = name.file_name().and_then(|name| name.to_str()) {
                dialog = dialog.set_file_name(name);
            }
            let file = dialog.save_file()?;
            Some(Command::Export(ExportCommand::Destination(file)))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn a_dialog_that_panics_is_said_and_the_next_gives_its_command() {
        let (wake, woken) = channel();
        let dialogs = Dialogs::new(move || wake.send(()).unwrap());
        dialogs.show(|| panic!("on purpose"));
        woken.recv().unwrap();
        let failure = dialogs.chosen.take().unwrap().unwrap_err();
        assert!(failure.contains("on purpose"), "{failure}");
        let open = Command::Dialog(Dialog::Project);
        let chosen = open.clone();
        dialogs.show(move || Some(chosen));
        woken.recv().unwrap();
        assert_eq!(dialogs.chosen.take(), Some(Ok(open)));
    }
}
