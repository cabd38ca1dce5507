//! System file dialogs, each with a text field for a typed path: some systems have no dialogs.

use super::StudioApp;
use crate::command::{
    Command, Dialog, ExportCommand, LookCommand, LooksCommand, MachineCommand, ProjectCommand, ReviewCommand,
    ViewCommand,
};
use crate::comparison::{CompareSettings, Reference};
use crate::panels::project::plan::{Plan, folder_of};
use crate::state::{PathEntry, Wanted};
use crate::stored_look::ENDING;
use base::FileFormat;
use base::files::plain;
use rfd::FileDialog;
use scene::{Background, BackgroundFile};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use worker::background::catch_panic;

/// Shortest time in which a person can close a dialog. One that ends sooner never appeared.
const SOON: Duration = Duration::from_millis(400);

/// File extension of looks.
const LOOKS: [&str; 1] = ["json"];

/// Title of a dialog, and the files or folders to choose in it.
struct Ask {
    title: &'static str,
    wanted: Wanted,
    /// Name and extensions of the file type.
    filter: Option<(&'static str, Vec<&'static str>)>,
    folder: Option<PathBuf>,
    name: Option<String>,
}

impl Ask {
    fn new(wanted: Wanted, title: &'static str) -> Self {
        Self { title, wanted, filter: None, folder: None, name: None }
    }

    /// A new file, with a suggested name.
    fn new_file(title: &'static str, filter: (&'static str, &'static [&'static str]), name: &str) -> Self {
        Self {
            filter: Some((filter.0, filter.1.to_vec())),
            name: Some(name.to_owned()),
            ..Self::new(Wanted::NewFile, title)
        }
    }

    /// Shows the system's dialog. None if it was closed or cannot be shown.
    fn show(self) -> Option<Vec<PathBuf>> {
        let mut dialog = FileDialog::new().set_title(self.title);
        if let Some((name, extensions)) = self.filter {
            dialog = dialog.add_filter(name, &extensions);
        }
        if let Some(folder) = &self.folder {
            dialog = dialog.set_directory(folder);
        }
        if let Some(name) = &self.name {
            dialog = dialog.set_file_name(name);
        }
        match self.wanted {
            Wanted::Folder => dialog.pick_folder().map(|folder| vec![folder]),
            Wanted::Files => dialog.pick_files(),
            Wanted::NewFile => dialog.save_file().map(|file| vec![file]),
        }
    }
}

/// Outcome of a dialog.
#[derive(Debug, PartialEq)]
enum Ended {
    Chosen(Vec<PathBuf>),
    Closed,
    /// No dialog appeared; with the reason if known.
    Missing(Option<String>),
}

/// File dialogs. Each runs on its own thread, so that the window does not wait.
pub struct Dialogs {
    /// Number of dialogs shown so far.
    count: u64,
    wake: Arc<dyn Fn() + Send + Sync>,
    end: Sender<(u64, Ended)>,
    /// Outcomes, each with the number of its dialog.
    ended: Receiver<(u64, Ended)>,
}

impl Dialogs {
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        let (end, ended) = channel();
        Self { count: 0, wake: Arc::new(wake), end, ended }
    }

    /// Shows a dialog; returns its number.
    fn show(&mut self, ask: impl FnOnce() -> Option<Vec<PathBuf>> + Send + 'static) -> u64 {
        self.count += 1;
        let (number, end, wake) = (self.count, self.end.clone(), self.wake.clone());
        std::thread::spawn(move || {
            let begun = Instant::now();
            let how = match catch_panic(|| Ok(ask())) {
                Ok(Some(paths)) => Ended::Chosen(paths),
                Ok(None) if begun.elapsed() < SOON => Ended::Missing(None),
                Ok(None) => Ended::Closed,
                Err(e) => Ended::Missing(Some(e.to_string())),
            };
            // Fails once the window is closed, when the answer does not matter.
            let _ = end.send((number, how));
            wake();
        });
        number
    }
}

impl StudioApp {
    /// The command for a dialog's choice since the last call.
    pub(super) fn chosen(&mut self) -> Option<Command> {
        while let Ok((number, ended)) = self.dialogs.ended.try_recv() {
            // The path may have been typed meanwhile, and another dialog opened.
            let is_shown = |entry: &&mut PathEntry| entry.number == number;
            let Some(entry) = self.state.covers.path.as_mut().filter(is_shown) else { continue };
            match ended {
                Ended::Chosen(paths) => return Some(Command::Chosen(entry.dialog, paths)),
                // Some systems close a dialog after a time without an answer.
                Ended::Closed if self.view.path_is_typed(entry) => {
                    entry.missing = Some("The system dialog was closed.".to_owned());
                }
                Ended::Closed => self.state.covers.path = None,
                Ended::Missing(why) => {
                    entry.missing =
                        Some(why.unwrap_or_else(|| "No file dialog on this system. Type a path below.".to_owned()));
                }
            }
        }
        None
    }

    /// Uses a typed path as the new file. Asks first if a file exists there.
    pub(super) fn take_new_file(&mut self, dialog: Dialog, path: PathBuf) {
        let asks = dialog != Dialog::Destination;
        self.errand(
            move || Ok((asks && path.symlink_metadata().is_ok(), path)),
            move |app, found| {
                // The lookup of a file cannot fail.
                let (is_there, path) = found.unwrap_or_default();
                let entry = app.state.covers.path.as_mut();
                let Some(entry) = entry.filter(|entry| entry.dialog == dialog) else {
                    // The field was closed meanwhile.
                    return;
                };
                if is_there { entry.existing = Some(path) } else { app.apply(Command::Chosen(dialog, vec![path])) }
            },
        );
    }

    /// Shows the system's dialog with the path field beside it.
    pub(crate) fn open_dialog(&mut self, dialog: Dialog) {
        let Some(ask) = self.ask_for(dialog) else { return };
        let begun = ask.folder.as_ref().map_or(String::new(), |folder| {
            let name = ask.name.clone().unwrap_or_default();
            plain(&folder.join(name))
        });
        let (title, wanted) = (ask.title, ask.wanted);
        let number = self.dialogs.show(move || ask.show());
        self.state.covers.path =
            Some(PathEntry { dialog, number, title, wanted, begun, fills: 0, missing: None, existing: None });
    }

    fn ask_for(&self, dialog: Dialog) -> Option<Ask> {
        let folder = |title| Some(Ask::new(Wanted::Folder, title));
        match dialog {
            Dialog::Environments => Some(Ask {
                filter: Some(("Panoramas", FileFormat::extensions(FileFormat::is_picture))),
                ..Ask::new(Wanted::Files, "Add environments")
            }),
            Dialog::EnvironmentFolder => folder("Watch a folder of HDRIs"),
            Dialog::ComparisonTruth => folder("Compare with truth"),
            Dialog::Project => folder("Open a project"),
            Dialog::Shoot => folder("Choose the shoot's folder"),
            Dialog::ShootPart(_) => Some(Ask::new(Wanted::Files, "Choose a movie, or the first picture of a sequence")),
            Dialog::ProjectFolder => folder("Choose the project's folder"),
            Dialog::ShootLocation => folder("Locate the project's shoot"),
            Dialog::Background => {
                let is_shown = |format: FileFormat| format.is_picture() || format.is_sequence() || format.is_movie();
                Some(Ask {
                    filter: Some(("Stills and movies", FileFormat::extensions(is_shown))),
                    ..Ask::new(Wanted::Files, "Choose the background")
                })
            }
            Dialog::Destination => {
                let root = &self.session.project.as_ref()?.root;
                let name = root.join(&self.state.export_options.name);
                let folder = name.parent().filter(|folder| folder.is_dir());
                Some(Ask {
                    folder: Some(folder.unwrap_or(root).to_path_buf()),
                    name: (name.file_name().and_then(|name| name.to_str())).map(str::to_owned),
                    ..Ask::new(Wanted::NewFile, "Export to")
                })
            }
            Dialog::FarmFolder(_) => folder("Choose a folder that the farm sees"),
            Dialog::Truth => folder("Choose a folder with truth"),
            Dialog::ReportPage => Some(Ask::new_file("Save the report", ("Web page", &["html"]), "review.html")),
            Dialog::MachineReport => {
                Some(Ask::new_file("Save the performance of this machine", ("Markdown", &["md"]), "machine.md"))
            }
            Dialog::SaveLook => {
                let name = &self.saved_as.as_ref()?.name;
                let (kind, file) = (("Look", &LOOKS[..]), format!("{name}{ENDING}"));
                Some(Ask::new_file("Save the look", kind, &file))
            }
            Dialog::LoadLook => {
                Some(Ask { filter: Some(("Look", LOOKS.to_vec())), ..Ask::new(Wanted::Files, "Load a look") })
            }
        }
    }

    /// The command for paths that were chosen or typed.
    pub(super) fn command_for(&self, dialog: Dialog, paths: Vec<PathBuf>) -> Option<Command> {
        let first = paths.first().cloned()?;
        Some(match dialog {
            Dialog::Environments | Dialog::EnvironmentFolder => return None,
            Dialog::ComparisonTruth => Command::View(ViewCommand::Compare(CompareSettings {
                on: true,
                reference: Reference::Truth(first),
                ..self.state.compare.clone()
            })),
            Dialog::Project => Command::Project(ProjectCommand::Open(folder_of(first))),
            Dialog::Shoot => Command::Project(ProjectCommand::New(Some(folder_of(first)))),
            Dialog::ShootPart(slot) => Command::Project(ProjectCommand::Bring(paths, Some(slot))),
            Dialog::ProjectFolder => {
                let plan = self.picker.wizard.plan().cloned().unwrap_or_default();
                let folder = plain(&folder_of(first));
                Command::Project(ProjectCommand::Plan(Some(Box::new(Plan { folder, ..plan }))))
            }
            Dialog::ShootLocation => Command::Project(ProjectCommand::Locate(folder_of(first))),
            Dialog::Background => {
                let placed = match &self.state.look.background {
                    Background::File(placed) => placed.clone(),
                    _ => BackgroundFile::default(),
                };
                let typed = PathBuf::from(plain(&first));
                let file = std::path::absolute(&typed).unwrap_or(typed);
                let placed = BackgroundFile { file, ..placed };
                Command::Look(LookCommand::Background(Background::File(placed)))
            }
            Dialog::Destination => Command::Export(ExportCommand::Destination(first)),
            Dialog::FarmFolder(engine) => Command::Export(ExportCommand::Farm(engine, first)),
            Dialog::Truth => Command::Review(ReviewCommand::Measure(Some(first))),
            Dialog::ReportPage => Command::Review(ReviewCommand::Report(first)),
            Dialog::MachineReport => Command::Machine(MachineCommand::Save(first)),
            Dialog::SaveLook => Command::Looks(LooksCommand::Write(first)),
            Dialog::LoadLook => Command::Looks(LooksCommand::Load(first)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dialog_that_is_not_there_is_told_from_one_that_was_closed() {
        let (wake, woken) = channel();
        let mut dialogs = Dialogs::new(move || wake.send(()).unwrap());
        let mut ended = |ask: fn() -> Option<Vec<PathBuf>>| {
            let number = dialogs.show(ask);
            woken.recv().unwrap();
            let (of, how) = dialogs.ended.try_recv().unwrap();
            assert_eq!(of, number);
            how
        };
        let Ended::Missing(Some(why)) = ended(|| panic!("on purpose")) else {
            panic!("the dialog is not missing");
        };
        assert!(why.contains("on purpose"), "{why}");
        assert_eq!(ended(|| None), Ended::Missing(None));
        let closed = ended(|| {
            std::thread::sleep(2 * SOON);
            None
        });
        assert_eq!(closed, Ended::Closed);
        let chosen = ended(|| Some(vec!["/film".into()]));
        assert_eq!(chosen, Ended::Chosen(vec!["/film".into()]));
    }
}
