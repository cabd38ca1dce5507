//! What the application does about exports.

use super::StudioApp;
use crate::command::Command;
use crate::layout::Pane;
use crate::lookout::Wanted;
use crate::panel::Reading;
use export::Destination;
use export::relight::relight;
use std::path::Path;
use worker::{Export, ExportStatus, WrittenExport};

impl StudioApp {
    pub(super) fn apply_to_exports(&mut self, command: Command) {
        match command {
            Command::ChooseDestination => self.choose_destination(),
            Command::Destination(file) => {
                if let Some(project) = &self.project {
                    self.state.order.choose(&file, &project.root);
                }
            }
            Command::Export => self.export(),
            Command::Withdraw(id) => {
                let is_it =
                    |export: &Export| export.id == id && export.status == ExportStatus::Running;
                if self.exports.iter().any(is_it) {
                    self.apply(Command::StopJob);
                } else if let Some(worker) = &self.worker {
                    worker.withdraw(id);
                }
            }
            Command::OpenFolder(folder) => {
                if let Err(e) = open::that_detached(&folder) {
                    let folder = folder.display();
                    self.news.refuse(format!(
                        "cannot open the folder {folder}: {e}. Open it in your file manager"
                    ));
                }
            }
            _ => {}
        }
    }

    /// Puts an export of what is set now at the end of the line.
    fn export(&mut self) {
        let entry = self.shelf.entries().get(self.state.look.environment);
        let reading = entry.map(|entry| &entry.panorama);
        let order = &self.state.order;
        if let Some(obstacle) = order.obstacle(&self.news.phase, reading) {
            return self.news.refuse(obstacle.to_owned());
        }
        let (Some(worker), Some(project), Some(Reading::Done { panorama, .. })) =
            (&self.worker, &self.project, reading)
        else {
            return;
        };
        self.news.refusal = None;
        let light = panorama.environment.clone();
        let settings = order.settings(project, &self.state.look, light, self.device);
        let project = project.clone();
        let name = |to: &str| {
            let name = Path::new(to).file_name().unwrap_or_default();
            name.display().to_string()
        };
        worker.export(name(&settings.files.to), move |progress| {
            let report = relight(&project, &settings, progress)?;
            let (first, last) = settings.frames.unwrap_or_default();
            let file = Destination::parse(&report.output)?
                .files(first, last)
                .next();
            let file = file.unwrap_or_default();
            Ok(WrittenExport {
                name: name(&report.output),
                folder: file.parent().unwrap_or(&project.root).to_path_buf(),
                sentence: report.sentence(),
            })
        });
    }

    fn choose_destination(&self) {
        let Some(project) = &self.project else {
            return;
        };
        let (root, order) = (project.root.clone(), self.state.order.clone());
        self.dialog(move || {
            let name = root.join(&order.name);
            let folder = name.parent().filter(|folder| folder.is_dir());
            let mut dialog = rfd::FileDialog::new()
                .set_title("Where to export")
                .set_directory(folder.unwrap_or(&root));
            if let Some(name) = name.file_name().and_then(|name| name.to_str()) {
                dialog = dialog.set_file_name(name);
            }
            dialog.save_file().map(Command::Destination)
        });
    }

    /// Another project is opened: what was in line is not written any more, and that is said.
    pub(super) fn leave_exports(&mut self) {
        let unfinished = |export: &&Export| export.status.sentence().is_none();
        let left: Vec<String> = (self.exports.iter().filter(unfinished))
            .map(|export| export.name.clone())
            .collect();
        if !left.is_empty() {
            self.news.refuse(format!(
                "These exports ended as a project was opened: {}. Add them again; stills that were finished are \
                 kept",
                left.join(", ")
            ));
        }
        self.exports.clear();
    }

    /// Has a look at the files of the next export where they are shown.
    pub(super) fn look_out(&mut self) {
        let Some(project) = &self.project else {
            return;
        };
        if self.shown.contains(&Pane::Export) {
            let over = (self.exports.iter()).filter(|e| e.status.sentence().is_some());
            self.lookout.look(Wanted {
                to: self.state.order.to(&project.root),
                range: self.state.order.range(self.state.frames),
                over: over.count(),
            });
        }
    }
}
