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

/// The dialogs. They run on threads of their own, so that the window does not wait.
pub struct Dialogs {
    chosen: Arc<Latest<Command>>,
}

impl Dialogs {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            chosen: Arc::new(Latest::new(wake)),
        }
    }

    /// What was chosen since the last call.
    pub fn chosen(&self) -> Option<Command> {
        self.chosen.take()
    }

    /// Shows a dialog; what it gives is applied when it closes.
    fn show(&self, ask: impl FnOnce() -> Option<Command> + Send + 'static) {
        let chosen = self.chosen.clone();
        std::thread::spawn(move || {
            if let Some(command) = ask() {
                chosen.put(command);
            }
        });
    }

    fn folder(&self, title: &'static str, then: impl FnOnce(PathBuf) -> Command + Send + 'static) {
        self.show(move || FileDialog::new().set_title(title).pick_folder().map(then));
    }
}

impl StudioApp {
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
