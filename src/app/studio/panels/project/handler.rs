//! The open project: opening, planning, making, moving, framing.

use crate::app::{StudioApp, title};
use crate::command::{ProjectCommand, ViewCommand, WindowCommand};
use crate::layout::{Pane, Workspace};
use crate::panels::project::plan::{MAP, Plan};
use crate::panels::readers::Readers;
use crate::state::{Leaving, State};
use crate::status::Phase;
use base::error::{Error, Result};
use base::files::shown;
use color_config::ColorChoice;
use egui::{Event, ViewportCommand};
use footage::candidate::{Candidate, Slot};
use footage::gathered;
use project::Project;
use std::io::Write;
use std::path::{Path, PathBuf};
use worker::{Blocked, Job, Worker};

impl StudioApp {
    pub(crate) fn apply_to_project(&mut self, command: ProjectCommand) {
        match command {
            ProjectCommand::Open(folder) => self.open_folder(&folder, false),
            ProjectCommand::Leave => {
                if let Some(leaving) = self.state.covers.leaving.take() {
                    self.open_folder(&leaving.folder, true);
                }
            }
            ProjectCommand::Reopen => {
                if let Some(project) = &self.session.project {
                    self.open_folder(&project.root.clone(), false);
                }
            }
            ProjectCommand::Forget(folder) => self.autosave.forget(&folder),
            ProjectCommand::New(shoot) => {
                let begun = || self.picker.wizard.plan().cloned().unwrap_or_default();
                let plan = shoot.map_or_else(begun, |shoot| Plan::from_shoot(&shoot));
                self.picker.wizard.set(Some(plan));
                if self.session.project.is_some() {
                    self.apply_to_window(WindowCommand::Workspace(Workspace::Calibrate));
                    self.apply_to_window(WindowCommand::ShowPane(Pane::Project));
                }
            }
            ProjectCommand::Plan(plan) => self.picker.wizard.set(plan.map(|plan| *plan)),
            ProjectCommand::Bring(paths, slot) => {
                let mut plan = self.picker.wizard.plan().cloned().unwrap_or_default();
                plan.bring(paths, slot, None);
                self.picker.wizard.set(Some(plan));
            }
            ProjectCommand::Make => match self.picker.wizard.job() {
                Ok((job, project)) => {
                    let gathered = self.picker.wizard.plan().is_some_and(Plan::is_gathered);
                    let parts = if gathered { self.picker.wizard.gathered() } else { vec![] };
                    let parts = parts.into_iter().map(|(slot, part)| (slot, part.clone()));
                    self.make(job, project, parts.collect());
                }
                Err(sentence) => self.status.refuse(sentence.to_owned()),
            },
            ProjectCommand::MakeDemo(folder) => {
                let project = worker::demo::project_folder(&folder);
                let job = Job::Demo { folder, prepare: true, minutes: worker::demo::MINUTES, device: self.device };
                self.make(job, project, vec![]);
            }
            ProjectCommand::Locate(folder) => {
                let locate = move |project: &mut Project| {
                    project.locate(&folder)?;
                    Ok(project.root.clone())
                };
                self.change_project(locate, |app, root| app.open_folder(&root, false));
            }
            ProjectCommand::Reframe(framing) => self.change_inputs(move |p| p.frame(framing)),
            ProjectCommand::CorrectLamps(settings) => {
                self.change_inputs(move |project| Ok(settings.run(project)?.aside));
            }
            ProjectCommand::Thumbnails(pane, all) => self.readers.footage.want(pane, all),
        }
    }

    /// Opens the project in a folder. Asks first if work would end, unless `agreed`.
    fn open_folder(&mut self, folder: &Path, agreed: bool) {
        self.open_folder_in(folder, agreed, |_| None);
    }

    /// The same, and shows a workspace chosen by the project.
    fn open_folder_in(&mut self, folder: &Path, agreed: bool, workspace: fn(&Project) -> Option<Workspace>) {
        let folder = folder.to_path_buf();
        let read = move || Project::open(&folder).map(|project| (workspace(&project), project));
        self.errand(read, move |app, opened| match opened {
            Ok((workspace, project)) => {
                let root = project.root.clone();
                app.leave_for(project, agreed);
                if let Some(workspace) = workspace.filter(|_| app.session.is_of(&root)) {
                    app.apply_to_window(WindowCommand::Workspace(workspace));
                }
            }
            Err(e) => app.status.refuse(e.to_string()),
        });
    }

    /// Opens a project already read from disk. Asks first if work would end, unless `agreed`.
    fn leave_for(&mut self, project: Project, agreed: bool) {
        let again = self.session.is_of(&project.root);
        if again && let Err(sentence) = self.session.can_leave() {
            // Reading now would race with the job that is writing.
            return self.status.refuse(sentence);
        }
        let ends = self.would_end();
        if !agreed && !ends.is_empty() {
            let folder = project.root;
            self.state.covers.leaving = Some(Leaving { folder, again, ends });
            return;
        }
        let title = title(Some(&project));
        self.ctx.send_viewport_cmd(ViewportCommand::Title(title));
        let worker = Worker::start(project.clone(), self.device, self.wake());
        self.open(project, worker);
    }

    /// Switches the window to another project, driven by `worker`.
    pub(crate) fn open(&mut self, project: Project, worker: Worker) {
        self.save_look();
        let before = std::mem::replace(&mut self.state, State::from_project(&project));
        self.state.display.gain = before.display.gain;
        self.state.panes.drawn = before.panes.drawn;
        self.autosave.remember(&project.root);
        self.picker.opened();
        self.view.opened();
        self.start(project.clone(), worker);
        self.exports.clear();
        let mine = self.session.read_only.is_none();
        let (list, complaints) = (self.library).open(&project, mine);
        self.state.look.environments = list;
        complaints.into_iter().for_each(|it| self.status.advise(it));
        self.looks.open(&project.root);
        let own_project = project.clone();
        // A folder that cannot be read is reported where its pictures are.
        self.errand_here(
            move || footage::first_number(&own_project),
            |app, number| app.state.playback.first_number = number.unwrap_or(0),
        );
        if let Err(e) = (self.autosave).load_look(&project, mine, &mut self.state) {
            self.status.refuse(e.to_string());
        }
    }

    /// Starts `worker` on `project`, with a fresh preview and fresh readers.
    pub(crate) fn start(&mut self, project: Project, worker: Worker) {
        self.session.open(project, worker);
        self.status.begin(Phase::Opening);
        self.preview.clear();
        self.readers = Readers::default();
    }

    /// Runs the job that makes the project in folder `project`, and opens the project when the job ends. First writes
    /// the map of gathered `parts`, if there are any.
    fn make(&mut self, job: Job, project: PathBuf, parts: Vec<(Slot, Candidate)>) {
        let wake = self.wake();
        let worker = self.session.worker.get_or_insert_with(|| {
            let nothing = || Err(Blocked { sentence: String::new(), need: None });
            Worker::over(nothing, wake)
        });
        let made = self.picker.made.clone();
        let begun = worker.work(job.what(), move |progress| {
            let _lock = job.lock()?;
            if !parts.is_empty() {
                write_map(&parts, &project)?;
            }
            let outcome = job.run(progress)?;
            made.put(project);
            Ok(outcome.sentence())
        });
        if let Err(e) = begun {
            self.status.refuse(e.to_string());
        }
    }

    /// Opens a project that a job has made, once the job has ended.
    pub(crate) fn open_made(&mut self) {
        if self.session.can_leave().is_ok()
            && let Some(project) = self.picker.made.take()
        {
            self.open_folder_in(&project, false, first_step);
        }
    }

    /// Changes the open project on disk, then calls `then` with the result of `change`. Shows the reason if the project
    /// cannot be changed.
    fn change_project<T: Send + 'static>(
        &mut self,
        change: impl FnOnce(&mut Project) -> Result<T> + Send + 'static,
        then: impl FnOnce(&mut Self, T) + Send + 'static,
    ) {
        let Some(project) = &self.session.project else { return };
        if let Err(sentence) = self.session.writable().and_then(|()| self.session.idle()) {
            return self.status.refuse(sentence);
        }
        let root = project.root.clone();
        self.errand(
            move || Project::change(&root, change),
            |app, changed| match changed {
                Ok(made) => {
                    app.status.refusal = None;
                    then(app, made);
                }
                Err(e) => app.status.refuse(e.to_string()),
            },
        );
    }

    /// Rereads the project when the window regains focus: another program may have set a different OpenColorIO
    /// configuration.
    pub(crate) fn follow_color_config(&mut self) {
        let is_back = (self.ctx).input(|i| i.events.contains(&Event::WindowFocused(true)));
        let Some(project) = self.session.project.as_ref().filter(|_| is_back) else { return };
        let root = project.root.clone();
        self.errand(
            move || Project::open(&root),
            |app, read| {
                // A project that cannot be read is reported where it is needed.
                if let Ok(read) = read {
                    app.take_color_config(read);
                }
            },
        );
    }

    /// Uses the OpenColorIO configuration that was read from disk.
    fn take_color_config(&mut self, read: Project) {
        let config = read.settings.color_config;
        let Some(project) = &mut self.session.project else { return };
        if project.root != read.root || project.settings.color_config == config {
            return;
        }
        project.settings.color_config = config;
        let choice = ColorChoice::default().or_config(project.color_config());
        self.status.say(match choice.named() {
            Some(named) => format!("OpenColorIO configuration is now {}", shown(&named)),
            None => {
                self.state.show(ViewCommand::LookThrough(None));
                self.state.export_options.ocio = ColorChoice::default();
                "The project no longer has an OpenColorIO configuration".to_owned()
            }
        });
    }

    /// Changes the project's crop or lamps; `change` returns the folder of results that no longer apply. The window's settings
    /// stay.
    fn change_inputs(&mut self, change: impl FnOnce(&mut Project) -> Result<Option<PathBuf>> + Send + 'static) {
        let change = move |project: &mut Project| {
            let aside = change(project)?;
            Ok((project.clone(), aside))
        };
        self.change_project(change, |app, (project, aside)| {
            if let Err(sentence) = app.session.can_leave() {
                return app.status.refuse(sentence);
            }
            let worker = Worker::start(project.clone(), app.device, app.wake());
            app.start(project, worker);
            if let Some(folder) = aside {
                app.status
                    .say(format!("Calibrate again: the previous calibration and network are in {}", shown(&folder)));
            }
        });
    }
}

/// Writes the map of gathered parts into the folder of a project that does not exist yet.
fn write_map(parts: &[(Slot, Candidate)], project: &Path) -> Result<()> {
    if project.join("project.toml").exists() {
        // The import reports it.
        return Ok(());
    }
    let remedy = "Choose another folder for the project";
    std::fs::create_dir_all(project).map_err(|e| Error::io("make", project, e, remedy))?;
    let parts: Vec<_> = parts.iter().map(|(slot, part)| (*slot, part)).collect();
    let text = gathered::map(&parts, project)?;
    base::files::write_beside(&project.join(MAP), |file| file.write_all(text.as_bytes()))
}

/// Workspace of a made project's next step: *Calibrate*, unless it is calibrated or lacks mattes, which *Relight* offers to
/// make.
fn first_step(project: &Project) -> Option<Workspace> {
    let is_next = footage::missing_matte(project).is_none() && !project.calibration_path().exists();
    is_next.then_some(Workspace::Calibrate)
}
