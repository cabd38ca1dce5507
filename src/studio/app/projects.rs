//! Which project is open: opening, making, locking, moving, framing.

use super::{StudioApp, title};
use crate::command::Command;
use crate::footages::Footages;
use crate::inspected::Inspected;
use crate::layout::{Pane, Workspace};
use crate::news::Phase;
use crate::reviews::Reviews;
use crate::studies::Studies;
use crate::theme;
use crate::training::Training;
use crate::wizard::Plan;
use base::error::Result;
use egui::{Ui, ViewportCommand};
use project::{Framing, Lock, Project};
use std::path::{Path, PathBuf};
use worker::{Blocked, Job, Worker};

impl StudioApp {
    /// Shows what `worker` makes of `project`, in place of what was shown before.
    pub(super) fn start(&mut self, project: Project, mut worker: Worker) {
        let before = self.lock_for(&project.root);
        if let Some(why) = &self.read_only {
            worker.refuse_writes(why.clone());
        }
        self.news.begin(Phase::Opening);
        (self.relit, self.asked) = (None, None);
        self.inspected = Inspected::default();
        self.studies = Studies::default();
        self.reviews = Reviews::default();
        self.footages = Footages::default();
        self.training = Training::default();
        self.project = Some(project);
        // The old worker is joined beside the window: it may be amid a training step, and keeps the right to
        // write its checkpoint until then.
        let old = (self.worker.replace(worker), before);
        std::thread::spawn(move || drop(old));
    }

    /// Takes the lock of the project in `root`, unless it is held here already; gives back the one of before.
    fn lock_for(&mut self, root: &Path) -> Option<Lock> {
        let full = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let open = self.project.as_ref().map(|project| full(&project.root));
        let before = self.lock.take();
        if open == Some(full(root)) && before.is_some() {
            self.lock = before;
            return None;
        }
        let taken = Lock::take(root, "the studio");
        self.read_only = taken.as_ref().err().map(ToString::to_string);
        self.lock = taken.ok();
        before
    }

    /// Applies the commands that concern the project as a whole.
    pub(super) fn apply_to_project(&mut self, command: Command) {
        match command {
            Command::OpenProject(folder) => match self.shelf.written(|| Project::open(&folder)) {
                Ok(project) => {
                    let title = title(Some(&project));
                    self.ctx.send_viewport_cmd(ViewportCommand::Title(title));
                    let worker = Worker::start(project.clone(), self.device, self.wake());
                    self.open(project, worker);
                }
                Err(e) => self.news.refuse(e.to_string()),
            },
            Command::ForgetProject(folder) => {
                self.preferences.forget(&folder);
                self.preferences.save(&self.saver);
            }
            Command::NewProject(shoot) => {
                let plan = shoot.map_or_else(Plan::default, |shoot| Plan::of(&shoot));
                self.wizard.set(Some(plan));
                if self.project.is_some() {
                    self.apply(Command::Workspace(Workspace::Calibrate));
                    self.apply(Command::Pane(Pane::Project));
                }
            }
            Command::Plan(plan) => self.wizard.set(plan.map(|plan| *plan)),
            Command::MakeProject => match self.wizard.job() {
                Ok((job, project)) => self.make(job, project),
                Err(sentence) => self.news.refuse(sentence.to_owned()),
            },
            Command::MakeDemo(folder) => {
                let project = worker::demo::project_folder(&folder);
                let job = Job::Demo {
                    folder,
                    prepare: true,
                    minutes: worker::demo::MINUTES,
                    device: self.device,
                };
                self.make(job, project);
            }
            Command::Locate(folder) => {
                let located = self.change(|project| {
                    project.locate(&folder)?;
                    Ok(project.root.clone())
                });
                if let Some(root) = located {
                    self.apply(Command::OpenProject(root));
                }
            }
            Command::Reframe(framing) => self.reframe(framing),
            Command::Thumbnails(frames) => self.footages.want(frames),
            Command::ChooseProject => self.choose("Open a project's folder", Command::OpenProject),
            Command::ChooseShoot => self.choose("Choose a shoot's folder", |shoot| {
                Command::NewProject(Some(shoot))
            }),
            Command::ChooseProjectFolder => {
                let plan = self.wizard.plan().cloned().unwrap_or_default();
                self.choose("Choose a folder for the project", move |folder| {
                    let folder = folder.display().to_string();
                    Command::Plan(Some(Box::new(Plan { folder, ..plan })))
                });
            }
            Command::ChooseLocation => {
                self.choose("Where is this project's shoot now?", Command::Locate);
            }
            _ => {}
        }
    }

    fn choose(&self, title: &'static str, then: impl FnOnce(PathBuf) -> Command + Send + 'static) {
        self.dialog(move || {
            rfd::FileDialog::new()
                .set_title(title)
                .pick_folder()
                .map(then)
        });
    }

    /// Runs the job that makes the project in folder `project`, which is opened when it is done.
    fn make(&mut self, job: Job, project: PathBuf) {
        let wake = self.wake();
        let worker = self.worker.get_or_insert_with(|| {
            let nothing = || {
                Err(Blocked {
                    sentence: String::new(),
                    need: None,
                })
            };
            Worker::over(nothing, wake)
        });
        let made = self.made.clone();
        let begun = worker.work(job.what(), move |progress| {
            let _lock = job.lock()?;
            let outcome = job.run(progress)?;
            made.put(project);
            Ok(outcome.sentence())
        });
        if !begun {
            let sentence = "Something else is being made: wait until it is done, or stop it";
            self.news.refuse(sentence.to_owned());
        }
    }

    /// Opens what a job has made, once the job is over.
    pub(super) fn hear_made(&mut self) {
        if self.news.work.is_none()
            && let Some(project) = self.made.take()
        {
            self.apply(Command::OpenProject(project));
        }
    }

    /// Changes the open project as it is on the disk; none where that cannot be, which is said.
    fn change<T>(&mut self, change: impl FnOnce(&mut Project) -> Result<T>) -> Option<T> {
        let root = self.project.as_ref()?.root.clone();
        let changed = match (&self.read_only, &self.news.work) {
            (Some(why), _) => Err(format!("Nothing can be written here. {why}")),
            (None, Some(_)) => Err(
                "A job works with the project as it is: wait until it is done, or stop it"
                    .to_owned(),
            ),
            (None, None) => {
                let changed = self.shelf.written(|| Project::change(&root, change));
                changed.map_err(|e| e.to_string())
            }
        };
        match changed {
            Ok(done) => {
                self.news.refusal = None;
                Some(done)
            }
            Err(sentence) => {
                self.news.refuse(sentence);
                None
            }
        }
    }

    /// Works with another square of the pictures; what is set in the window stays.
    fn reframe(&mut self, framing: Framing) {
        let framed = self.change(|project| {
            let aside = project.frame(framing)?;
            Ok((project.clone(), aside))
        });
        if let Some((project, aside)) = framed {
            let worker = Worker::start(project.clone(), self.device, self.wake());
            self.start(project, worker);
            if let Some(folder) = aside {
                self.news.say(format!(
                    "What was made under the framing of before is in {} now",
                    folder.display()
                ));
            }
        }
    }

    /// Looks at what the panes of project and footage show of the disk.
    pub(super) fn look_at_folders(&mut self) {
        let wake = self.wake();
        if self.shown.contains(&Pane::Project) {
            self.recents.look(self.preferences.recent(), wake.clone());
            self.wizard.look(wake.clone());
        }
        if let (Some(project), true) = (&self.project, self.shown.contains(&Pane::Footage)) {
            self.footages.ask(project, &self.state, wake);
        }
    }
}

/// The line that says why nothing can be written.
pub(super) fn read_only_ui(ui: &mut Ui, why: &str, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.colored_label(theme::ACCENT, "Read-only");
        ui.label(why);
        let hint = "Opens the project again, to write where nobody else does any more";
        if ui.button("Try again").on_hover_text(hint).clicked() {
            out.push(Command::Reopen);
        }
    });
}
