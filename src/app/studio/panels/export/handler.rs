//! The export queue, and the destination of the next export.

use super::exports::Ahead;
use crate::app::StudioApp;
use crate::command::{ExportCommand, JobCommand};
use crate::export_options::{ExportOptions, Overwrite};
use crate::panels::environments::library::light_of;
use crate::panels::lamp_title;
use base::files::shown;
use export::relight::RelightSettings;
use export::{Destination, Existing, LayersBy};
use farm::{ChunkSettings, Engine, FarmSettings};
use footage::PictureSize;
use handover::relight;
use scene::Background;
use std::path::{Path, PathBuf};
use worker::{Export, ExportStatus, Job, WrittenExport};

impl StudioApp {
    pub(crate) fn apply_to_exports(&mut self, command: ExportCommand) {
        match command {
            ExportCommand::Options(options) => {
                let before = self.state.export_options.clone();
                self.state.export_options = *options;
                self.ask_about_other_files(&before);
            }
            ExportCommand::Destination(file) => {
                if let Some(project) = &self.session.project {
                    let before = self.state.export_options.clone();
                    self.state.export_options.choose(&file, &project.root);
                    self.ask_about_other_files(&before);
                }
            }
            ExportCommand::Add => self.add_export(),
            ExportCommand::Farm(engine, folder) => self.send_to_farm(engine, &folder),
            ExportCommand::Withdraw(id) => self.withdraw_export(id),
            ExportCommand::WriteNext(id) => {
                if let Some(worker) = &self.session.worker {
                    worker.write_export_next(id);
                }
            }
            ExportCommand::Retry(id) => {
                if let Some(worker) = &self.session.worker {
                    worker.retry_export(id);
                }
            }
            ExportCommand::OpenFolder(folder) => {
                if open::that_detached(&folder).is_err() {
                    let folder = shown(&folder);
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

    /// Settings of the next export. None if nothing can be exported; then the reason is shown.
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
        let (Some(project), Some(light)) = (&self.session.project, light) else { return None };
        self.status.refusal = None;
        Some(options.settings(project, look, &self.state.solo, light, self.device))
    }

    /// Writes the current settings as a farm job, as the command line does, into a new folder in `folder`.
    fn send_to_farm(&mut self, engine: Engine, folder: &Path) {
        let Some(settings) = self.export_settings() else { return };
        let (Some(worker), Some(project)) = (&self.session.worker, &self.session.project) else { return };
        let to = settings.files.to.to_string();
        let name = Path::new(&to).file_name().unwrap_or_default().to_string_lossy();
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

    /// Adds an export with the current settings to the queue.
    fn add_export(&mut self) {
        let Some(mut settings) = self.export_settings() else { return };
        let (Some(worker), Some(project)) = (&self.session.worker, &self.session.project) else { return };
        let project = project.clone();
        let range = self.state.numbers();
        let keeps = settings.files.existing == Existing::Keep;
        if keeps {
            settings.files.to = self.exports.goes_to(&settings.files.to, range);
        }
        let to = settings.files.to.clone();
        // True once this export itself has written some of its files.
        let mut begun = false;
        let id = worker.export(title(&to, range), summary(&settings, range), move |progress| {
            let (first, last) = range;
            if keeps && !begun {
                settings.files.to = settings.files.to.untaken(first, last)?;
            } else if keeps {
                settings.files.existing = Existing::Replace;
                settings.files.resume = true;
            }
            let report = relight(&project, &settings, progress);
            if keeps && report.is_err() {
                begun = settings.files.to.taken(first, last) > 0;
            }
            let report = report?;
            let file = report.output.files(first, last).next().unwrap_or_default();
            Ok(WrittenExport {
                name: title(&report.output, range),
                folder: file.parent().unwrap_or(&project.root).to_path_buf(),
                sentence: report.sentence(),
            })
        });
        self.exports.queue = worker.exports();
        self.exports.ahead.push(Ahead { id, to, range });
        self.state.export_options.overwrite = Overwrite::Never;
    }

    /// Consent to replace or resume files holds for their name alone.
    fn ask_about_other_files(&mut self, before: &ExportOptions) {
        let options = &mut self.state.export_options;
        if (&options.name, options.format) != (&before.name, before.format) {
            options.overwrite = Overwrite::Never;
        }
    }
}

/// Settings of an export of files with the numbers `first` to `last`, a line each.
fn summary(settings: &RelightSettings, (first, last): (i64, i64)) -> String {
    let files = &settings.files;
    let at = match files.at {
        PictureSize::Plate => "Plate",
        PictureSize::Box => "Box",
        PictureSize::Square => "Square",
    };
    let size = files.size.map_or(String::new(), |pixels| format!(", {pixels} px"));
    let background = match &settings.look.background {
        _ if !settings.solo.is_empty() => "none".to_owned(),
        Background::Environment => "environment".to_owned(),
        Background::None => "none".to_owned(),
        Background::Plate => "plate".to_owned(),
        Background::Color([r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
        Background::Checker => "checker".to_owned(),
        Background::File(placed) => shown(&placed.file),
    };
    let mut lines = vec![
        format!("Frames {first} to {last}, {at}{size}"),
        format!("Environment: {}", settings.environment.display()),
        format!("Background: {background}"),
    ];
    if !settings.solo.is_empty() {
        let lamps: Vec<_> = settings.solo.iter().map(|name| lamp_title(name)).collect();
        lines.push(format!("Solo: {}", lamps.join(", ")));
    }
    if let Some(codec) = files.codec {
        lines.push(format!("Codec: {}", codec.name()));
    }
    if files.layers {
        lines.push(match files.exr.layers_by {
            LayersBy::Lamp => "Layers by lamp".to_owned(),
            LayersBy::Light => "Layers by light".to_owned(),
        });
    }
    if !settings.hand_over.is_empty() {
        let programs: Vec<&str> = settings.hand_over.iter().map(|to| to.name()).collect();
        lines.push(format!("For {}", programs.join(", ")));
    }
    lines.push(format!("To {}", files.to.to_string().replace("%%", "%")));
    lines.join("\n")
}

/// Title of an export: its file name, or its first and last still, such as `clay.0000–0007.png`.
fn title(to: &Destination, (first, last): (i64, i64)) -> String {
    let parts = match to {
        Destination::Stills(stills) if first != last => stills.parts(),
        _ => ("", None, ""),
    };
    let file = match parts {
        (before, Some(digits), after) => PathBuf::from(format!("{before}{first:0digits$}–{last:0digits$}{after}")),
        _ => to.files(first, last).next().unwrap_or_default(),
    };
    file.file_name().unwrap_or_default().display().to_string()
}

#[cfg(test)]
mod tests {
    use super::Destination;

    #[test]
    fn stills_are_called_by_their_first_and_last() {
        let title = |to: &str, range| super::title(&Destination::parse(to).unwrap(), range);
        assert_eq!(title("a/exports/clay.%04d.png", (0, 7)), "clay.0000–0007.png");
        assert_eq!(title("clay.%04d.exr", (3, 3)), "clay.0003.exr");
        assert_eq!(title("clay_%d.png", (8, 12)), "clay_8–12.png");
        assert_eq!(title("clay.%04d.exr", (-2, 1001)), "clay.-002–1001.exr");
        assert_eq!(title("clay.mov", (0, 7)), "clay.mov");
        assert_eq!(title("50 %%.%02d.png", (0, 7)), "50 %.00–07.png");
    }
}
