//! The queue of exports, and where the next one goes.

use super::StudioApp;
use crate::command::{ExportCommand, JobCommand};
use crate::destination_check::{DestinationCheck, DestinationQuery};
use crate::environment_library::light_of;
use crate::state::State;
use export::Destination;
use export::relight::RelightSettings;
use farm::{ChunkSettings, Engine, FarmSettings};
use handover::relight;
use std::path::Path;
use worker::{Export, ExportStatus, Job, WrittenExport};

/// The exports, and whether files of the next one exist already.
pub struct Exports {
    /// Those that wait, run or are finished.
    pub queue: Vec<Export>,
    pub destination: DestinationCheck,
}

impl Exports {
    pub fn new(wake: impl Fn() + Send + 'static) -> Self {
        Self {
            queue: Vec::new(),
            destination: DestinationCheck::new(wake),
        }
    }

    /// Looks for files of the next export of the project in `root`.
    pub fn ask(&mut self, state: &State, root: &Path) {
        let finished = (self.queue.iter()).filter(|e| e.status.sentence().is_some());
        self.destination.ask(DestinationQuery {
            to: state.export_options.to(root),
            range: state.export_options.range(state.frames),
            finished: finished.count(),
        });
    }
}

impl StudioApp {
    pub(super) fn apply_to_exports(&mut self, command: ExportCommand) {
        match command {
            ExportCommand::Options(options) => self.state.export_options = *options,
            ExportCommand::Destination(file) => {
                if let Some(project) = &self.session.project {
                    self.state.export_options.choose(&file, &project.root);
                }
            }
            ExportCommand::Add => self.add_export(),
            ExportCommand::Farm(engine, folder) => self.send_to_farm(engine, &folder),
            ExportCommand::Withdraw(id) => self.withdraw_export(id),
            ExportCommand::OpenFolder(folder) => {
                if open::that_detached(&folder).is_err() {
                    let folder = folder.display().to_string();
                    let sentence = format!("Could not open the folder. Path copied: {folder}");
                    self.ctx.copy_text(folder);
                    self.status.refuse(sentence);
                }
            }
        }
    }

    fn withdraw_export(&mut self, id: u64) {
        let running = |export: &Export| export.id == id && export.status == ExportStatus::Running;
        if self.exports.queue.iter().any(running) {
            self.apply_to_job(JobCommand::Stop);
        } else if let Some(worker) = &self.session.worker {
            worker.withdraw(id);
        }
    }

    /// What is exported now; None if nothing can be: why is said.
    fn export_settings(&mut self) -> Option<RelightSettings> {
        let entry = self.library.entries().get(self.state.look.environment);
        let panorama = entry.map(|entry| &entry.panorama);
        let (options, look) = (&self.state.export_options, &self.state.look);
        if let Some(obstacle) = options.obstacle(&self.status.phase, panorama, look) {
            self.status.refuse(obstacle.to_owned());
            return None;
        }
        let entries = self.library.entries();
        let light = entry.and_then(|entry| light_of(entries, &entry.listed.origin));
        let (Some(project), Some(light)) = (&self.session.project, light) else {
            return None;
        };
        self.status.refusal = None;
        Some(options.settings(project, look, &self.state.solo, light, self.device))
    }

    /// Writes a job of the current settings for a farm, as the command line does, into a folder of its own in `folder`.
    fn send_to_farm(&mut self, engine: Engine, folder: &Path) {
        let Some(settings) = self.export_settings() else {
            return;
        };
        let (Some(worker), Some(project)) = (&self.session.worker, &self.session.project) else {
            return;
        };
        let to = Path::new(&settings.files.to).file_name();
        let name = to.unwrap_or_default().to_string_lossy();
        let stem = match name.split(['.', '%']).next() {
            Some("") | None => "export",
            Some(stem) => stem,
        };
        let free = (1..)
            .map(|number| match number {
                1 => folder.join(format!("{stem}-job")),
                _ => folder.join(format!("{stem}-job-{number}")),
            })
            .find(|job| !job.exists());
        let job = Job::Farm {
            project: project.root.clone(),
            settings: Box::new(settings),
            farm: FarmSettings::new(engine, free.unwrap_or_default()),
            chunks: ChunkSettings::default(),
        };
        if let Err(e) = worker.run(job) {
            self.status.refuse(e.to_string());
        }
    }

    /// Adds an export of the current settings to the queue.
    fn add_export(&mut self) {
        let Some(settings) = self.export_settings() else {
            return;
        };
        let options = &self.state.export_options;
        let (Some(worker), Some(project)) = (&self.session.worker, &self.session.project) else {
            return;
        };
        let project = project.clone();
        let name = |to: &str| {
            let name = Path::new(to).file_name().unwrap_or_default();
            name.display().to_string()
        };
        // A number is appended where files are there already.
        let taken = self.exports.destination.found();
        let taken = taken.filter(|taken| {
            taken.files > 0 && taken.query.to == settings.files.to && !options.replaces()
        });
        let to = taken.map_or(&settings.files.to, |taken| &taken.free);
        worker.export(name(to), move |progress| {
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

    /// Another project is opened: exports in the queue are not written any more, and the window says so.
    pub(super) fn leave_exports(&mut self) {
        let unfinished = |export: &Export| export.status.sentence().is_none();
        let exports = self.exports.queue.drain(..).filter(unfinished);
        let left: Vec<String> = exports.map(|export| export.name).collect();
        if !left.is_empty() {
            self.status.refuse(format!(
                "These exports ended when another project was opened: {}. Finished stills are kept; add the exports \
                 again",
                left.join(", ")
            ));
        }
    }
}
