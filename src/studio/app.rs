//! The application: it hears the worker, shows the panels, applies their commands and asks for the
//! picture that the state calls for.

mod asking;
mod blind;
mod drops;
mod exporting;
mod jobs;
mod projects;

use asking::Wanted;
pub use blind::Left;

use super::command::Command;
use super::compare::{Compare, With};
use super::footages::Footages;
use super::inspected::Inspected;
use super::kept::KeptLook;
use super::layout::Pane;
use super::lookout::Lookout;
use super::news::{News, Phase};
use super::order::Order;
use super::palette::Palette;
use super::panel::{Entry, Sight};
use super::panels::{JobPanel, StatusPanel, TabsPanel};
use super::panes::{Panes, Shown};
use super::preferences::Preferences;
use super::recents::Recents;
use super::reviews::Reviews;
use super::saver::Saver;
use super::shelf::Shelf;
use super::state::State;
use super::studies::Studies;
use super::training::Training;
use super::wizard::Wizard;
use super::{keys, theme};
use crate::calibration::{CalibrateSettings, Circle};
use crate::gpu::DeviceChoice;
use crate::project::{Lock, Project};
use crate::worker::{Blocked, Event, Export, Job, Latest, Need, Relit, Source, Worker};
use egui::{CentralPanel, Context, Frame, Panel, ViewportCommand};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// The window's contents.
pub struct StudioApp {
    ctx: Context,
    device: DeviceChoice,
    project: Option<Project>,
    worker: Option<Worker>,
    shelf: Shelf,
    state: State,
    news: News,
    relit: Option<Arc<Relit>>,
    /// What the worker was asked for last, and whether something was being dragged.
    asked: Option<(Wanted, bool)>,
    inspected: Inspected,
    studies: Studies,
    reviews: Reviews,
    training: Training,
    /// The worker's line of exports.
    exports: Vec<Export>,
    lookout: Lookout,
    footages: Footages,
    recents: Recents,
    wizard: Wizard,
    /// The folder of a project that a job has made.
    made: Arc<Latest<PathBuf>>,
    /// Where the project goes when the window can no longer be drawn.
    next: Option<Left>,
    /// Keeps others from writing into the open project.
    lock: Option<Lock>,
    /// Why nothing can be written into it, where another keeps us from it.
    read_only: Option<String>,
    /// When the next frame is due while playing, in the window's seconds.
    due: f64,
    /// What a dialog brought.
    chosen: Arc<Latest<Command>>,
    preferences: Preferences,
    /// The arrangement was changed by a drag that is not over yet.
    edited: bool,
    saver: Saver,
    /// The look that was kept last.
    kept: KeptLook,
    panes: Panes,
    palette: Palette,
    /// The panes that were drawn last.
    shown: Vec<Pane>,
    tabs: TabsPanel,
    job: JobPanel,
    status: StatusPanel,
}

/// The window's title.
pub(super) fn title(project: Option<&Project>) -> String {
    project.map_or("Afterlight".to_owned(), |p| {
        format!("Afterlight — {}", p.settings.name)
    })
}

impl StudioApp {
    /// A window on a project, or on the offer to open one, that remembers nothing of a person.
    pub fn new(ctx: &Context, project: Option<Project>, device: DeviceChoice) -> Self {
        Self::of(ctx, Preferences::default(), project, device)
    }

    /// A person's window, on a project or on the offer to open one.
    pub fn of(
        ctx: &Context,
        preferences: Preferences,
        project: Option<Project>,
        device: DeviceChoice,
    ) -> Self {
        let mut app = Self::empty(ctx, preferences, device);
        if let Some(project) = project {
            let wake = app.wake();
            let worker = Worker::start(project.clone(), device, wake);
            app.open(project, worker);
        }
        app
    }

    /// A window on frames from anywhere, for tests and for other sources of reflectance fields.
    pub fn over(
        ctx: &Context,
        project: Project,
        source: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
    ) -> Self {
        let mut app = Self::empty(ctx, Preferences::default(), DeviceChoice::Cpu);
        let worker = Worker::over(source, app.wake());
        app.open(project, worker);
        app
    }

    fn empty(ctx: &Context, preferences: Preferences, device: DeviceChoice) -> Self {
        theme::apply(ctx);
        let wake = {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        Self {
            ctx: ctx.clone(),
            device,
            project: None,
            worker: None,
            shelf: Shelf::new(ctx),
            state: State::new(0, 24.0),
            news: News::new(Phase::NoProject),
            relit: None,
            asked: None,
            inspected: Inspected::default(),
            studies: Studies::default(),
            reviews: Reviews::default(),
            training: Training::default(),
            exports: Vec::new(),
            lookout: Lookout::new(wake.clone()),
            footages: Footages::default(),
            recents: Recents::default(),
            wizard: Wizard::default(),
            made: Arc::new(Latest::new(wake.clone())),
            next: None,
            lock: None,
            read_only: None,
            due: 0.0,
            chosen: Arc::new(Latest::new(wake.clone())),
            preferences,
            edited: false,
            saver: Saver::start(wake),
            kept: KeptLook::default(),
            panes: Panes::default(),
            palette: Palette::default(),
            shown: Vec::new(),
            tabs: TabsPanel,
            job: JobPanel,
            status: StatusPanel,
        }
    }

    /// The state that is shown.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// What happened.
    pub fn news(&self) -> &News {
        &self.news
    }

    /// The threads behind the open project.
    pub fn worker(&self) -> Option<&Worker> {
        self.worker.as_ref()
    }

    /// The newest picture.
    pub fn relit(&self) -> Option<&Arc<Relit>> {
        self.relit.as_ref()
    }

    /// The light of the probed pixel under each lamp at full power, once it was found.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.inspected.texel()
    }

    /// What was found out about the calibration.
    pub fn studies(&self) -> &Studies {
        &self.studies
    }

    /// What was found out about the network.
    pub fn reviews(&self) -> &Reviews {
        &self.reviews
    }

    /// What is known of the network's training.
    pub fn training(&self) -> &Training {
        &self.training
    }

    /// The exports that wait, run or are over.
    pub fn exports(&self) -> &[Export] {
        &self.exports
    }

    /// The open project.
    pub fn project(&self) -> Option<&Project> {
        self.project.as_ref()
    }

    /// The project that is being made.
    pub fn wizard(&self) -> &Wizard {
        &self.wizard
    }

    /// The pictures as they were filmed.
    pub fn footages(&self) -> &Footages {
        &self.footages
    }

    /// The list of environments.
    pub fn environments(&self) -> &[Entry] {
        self.shelf.entries()
    }

    fn wake(&self) -> impl Fn() + Clone + Send + Sync + 'static {
        let ctx = self.ctx.clone();
        move || ctx.request_repaint()
    }

    fn open(&mut self, project: Project, worker: Worker) {
        let shoot = &project.settings.shoot;
        self.state = State::new(shoot.frames.len(), shoot.frame_rate);
        self.state.order = Order::of(&project);
        self.preferences.opened(&project.root);
        self.preferences.save(&self.saver);
        self.recents.renew();
        self.wizard.set(None);
        self.start(project.clone(), worker);
        self.leave_exports();
        let (list, complaints) = self.shelf.open(&project, self.read_only.is_none());
        self.state.look.environments = list;
        complaints.into_iter().for_each(|it| self.news.say(it));
        self.saver.settle();
        match KeptLook::load(&project) {
            Ok(kept) => kept
                .into_iter()
                .for_each(|kept| kept.apply(&mut self.state.look)),
            Err(e) => self.news.refuse(e.to_string()),
        }
        self.kept = KeptLook::of(&self.state.look);
    }

    /// Takes in what the threads have to say.
    fn hear(&mut self) {
        if let Some(worker) = &self.worker {
            for event in worker.events() {
                // A worker without a project has nothing to open.
                if self.project.is_none() && matches!(event, Event::Opening | Event::Blocked(_)) {
                    continue;
                }
                if matches!(event, Event::Opening | Event::Failed { .. }) {
                    self.state.playing = false;
                }
                if event == Event::Opening {
                    // Pictures of another network are no longer what was asked for.
                    (self.relit, self.asked) = (None, None);
                }
                if matches!(event, Event::Finished { .. }) {
                    // The job may have calibrated.
                    self.studies.renew();
                    self.reviews.renew();
                }
                self.training.hear(&event);
                self.news.hear(event);
            }
            self.training.pictures = worker.pictures().or(self.training.pictures.take());
            self.relit = worker.relit().or(self.relit.take());
            let rig = self.relit.as_ref().map(|relit| &relit.rig);
            self.state.lamps = rig.map_or(0, |rig| rig.lamps.len());
            self.exports = worker.exports();
        }
        self.inspected.hear();
        self.studies.hear();
        self.reviews.hear();
        self.training.read();
        self.footages.hear(&self.ctx);
        self.hear_made();
        let unsaved = self.saver.failures().chain(self.shelf.hear());
        unsaved.for_each(|failure| self.news.refuse(failure));
    }

    fn apply(&mut self, command: Command) {
        let state = &self.state;
        let covered = state.palette || state.keys || state.full_screen;
        self.state.apply(&command);
        match command {
            Command::DismissRefusal => self.news.refusal = None,
            Command::Dismiss if !covered => self.news.refusal = None,
            Command::AddEnvironments(_) => self.news.refusal = None,
            Command::ListCheckpoints => self.training.list(),
            Command::ToggleFullScreen | Command::Dismiss => {
                self.ctx
                    .send_viewport_cmd(ViewportCommand::Fullscreen(self.state.full_screen));
            }
            Command::ChooseEnvironments => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Add environments");
                dialog
                    .add_filter("Panoramas", &drops::PANORAMAS)
                    .pick_files()
                    .map(Command::AddEnvironments)
            }),
            Command::CompareTruth => {
                let compare = self.state.compare.clone();
                self.dialog(move || {
                    let dialog = rfd::FileDialog::new().set_title("Open a truth's folder");
                    let folder = dialog.pick_folder()?;
                    Some(Command::Compare(Compare {
                        on: true,
                        with: With::Truth(folder),
                        ..compare
                    }))
                });
            }
            Command::ActualSize if self.panes.fit() > 0.0 => {
                let factor = 1.0 / (self.panes.fit() * self.ctx.pixels_per_point());
                let about = [0.0; 2];
                self.state.apply(&Command::Fit);
                self.state.apply(&Command::Zoom { factor, about });
            }
            Command::Mark(marked) => match &self.read_only {
                Some(why) => self.news.refuse(why.clone()),
                None => self.reviews.mark(*marked),
            },
            Command::NudgeCircle { by, radius } => {
                if let Some(Circle {
                    center_px: [x, y],
                    radius_px,
                }) = self.studies.circle(&self.state)
                {
                    let moved = Circle::new([x + by[0], y + by[1]], radius_px + radius).ok();
                    self.state.nudge(&command, |look| {
                        look.circle = moved.or(look.circle);
                    });
                }
            }
            Command::NudgeTrial(by) => {
                if let Some(trial) = self.studies.trial(&self.state) {
                    self.state
                        .nudge(&command, |look| look.trial = Some(trial.nudged(by)));
                }
            }
            Command::StepPhotograph(step) => {
                let lamps = self
                    .project
                    .as_ref()
                    .map_or(0, |p| p.settings.shoot.all_lamps().len());
                let shown = self.state.photograph.map_or(0, |lamp| lamp + 1) as isize + step;
                self.state.photograph =
                    (shown.rem_euclid(lamps as isize + 1) as usize).checked_sub(1);
            }
            Command::FindCircle => {
                if let Some(found) = self.studies.found() {
                    self.apply(Command::Circle(Some(found)));
                }
            }
            Command::ChooseDestination
            | Command::Destination(_)
            | Command::Export
            | Command::Withdraw(_)
            | Command::OpenFolder(_) => self.apply_to_exports(command),
            Command::FocusPane => self.panes.focus(self.state.active),
            Command::Calibrate => self.calibrate(),
            Command::Measure(truth) => self.review(truth, true, None),
            Command::Report(to) => self.review(None, false, Some(to)),
            Command::ChooseTruth => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Choose a folder with truth");
                dialog
                    .pick_folder()
                    .map(|truth| Command::Measure(Some(truth)))
            }),
            Command::ChooseReport => self.dialog(|| {
                let dialog = rfd::FileDialog::new().set_title("Write the review's page");
                let dialog = dialog
                    .add_filter("Page", &["html"])
                    .set_file_name("review.html");
                dialog.save_file().map(Command::Report)
            }),
            Command::Provide(Need::Shoot) => self.apply(Command::ChooseLocation),
            Command::Provide(Need::Network) => self.train(false),
            Command::Provide(Need::Calibration) => self.run(|project| Job::Calibrate {
                project,
                settings: CalibrateSettings::default(),
            }),
            // Before it is known what is there, nothing can be gone on from.
            Command::StartTraining { fresh } if self.training.records.is_some() => {
                self.train(fresh);
            }
            Command::GoBack(to) => {
                self.training.pictures = None;
                self.run(|project| Job::GoBack { project, to });
            }
            Command::StepTrainedLamp(step) => {
                if let Some(project) = &self.project {
                    let lamps = project.settings.shoot.lamps.len().max(1) as isize;
                    let lamp = self.state.trained_lamp as isize + step;
                    self.state.trained_lamp = lamp.rem_euclid(lamps) as usize;
                }
            }
            Command::PauseJob => {
                if let (Some(worker), Some(work)) = (&self.worker, &mut self.news.work) {
                    let pause = !work.is_paused();
                    if work.held.is_some() {
                        self.news.failure = None;
                    }
                    work.pause(pause, Instant::now());
                    worker.pause(pause);
                }
            }
            Command::StopJob => {
                if let (Some(worker), Some(work)) = (&self.worker, &mut self.news.work) {
                    work.stopping = true;
                    worker.cancel();
                }
            }
            Command::DismissReport => self.news.said = None,
            Command::ClearLog => self.news.log.clear(),
            Command::Pane(pane) => {
                let workspace = self.state.workspace;
                self.preferences.layout().open(workspace, pane);
                self.edited = true;
            }
            Command::ClosePane(pane) => {
                let workspace = self.state.workspace;
                self.preferences.layout().close(workspace, pane);
                self.edited = true;
            }
            Command::ResetLayout => {
                self.preferences.layout().reset(self.state.workspace);
                self.edited = true;
            }
            Command::Reopen => {
                if let Some(project) = &self.project {
                    self.apply(Command::OpenProject(project.root.clone()));
                }
            }
            command => self.apply_to_project(command),
        }
    }

    /// Shows a dialog beside the window's thread; what it brings is applied when it closes.
    fn dialog(&self, ask: impl FnOnce() -> Option<Command> + Send + 'static) {
        let chosen = self.chosen.clone();
        std::thread::spawn(move || {
            if let Some(command) = ask() {
                chosen.put(command);
            }
        });
    }
}

/// What panels see of the window. A function would borrow the panels along with it.
macro_rules! sight {
    ($app:ident) => {
        Sight {
            project: $app.project.as_ref(),
            state: &$app.state,
            news: &$app.news,
            environments: $app.shelf.entries(),
            shown: &$app.shown,
            relit: $app.relit.as_ref(),
            texel: $app.inspected.texel(),
            exports: &$app.exports,
            taken: $app.lookout.found(),
            probe: $app.studies.probe.as_ref(),
            gamma: $app.studies.gamma.as_ref(),
            reviews: &$app.reviews,
            training: &$app.training,
            read_only: $app.read_only.as_deref(),
            recents: $app.recents.list(),
            wizard: &$app.wizard,
            footages: &$app.footages,
        }
    };
}

impl StudioApp {
    /// The lines around the panes.
    fn bars_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let sight = sight!(self);
        let bar = |margin: i8| {
            Frame::new()
                .fill(theme::PANEL)
                .inner_margin(egui::Margin::symmetric(12, margin))
        };
        Panel::top("workspaces")
            .exact_size(34.0)
            .frame(bar(2))
            .show(ui, |ui| self.tabs.ui(ui, &sight, commands));
        if let Some(why) = &self.read_only {
            let line = Panel::top("read-only").frame(bar(4));
            line.show(ui, |ui| projects::read_only_ui(ui, why, commands));
        }
        Panel::bottom("status")
            .exact_size(30.0)
            .frame(bar(2))
            .show(ui, |ui| self.status.ui(ui, &sight, commands));
        if JobPanel::is_needed(&sight) {
            Panel::bottom("job")
                .frame(bar(5))
                .show(ui, |ui| self.job.ui(ui, &sight, commands));
        }
    }

    /// Has the look written where it is another than before.
    fn keep(&mut self) {
        let Some(project) = &self.project else {
            return;
        };
        // The value at a frame that is merely shown is no change where it has keys.
        let look = KeptLook::of(&self.state.look);
        if !self.state.playing && self.read_only.is_none() && look != self.kept {
            self.saver.save(KeptLook::path(project), look.text());
            self.kept = look;
        }
    }

    fn panes_ui(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let mut shown = Shown {
            panes: &mut self.panes,
            sight: sight!(self),
            out: commands,
            drawn: Vec::new(),
            edited: false,
        };
        let workspace = self.state.workspace;
        if self.state.panels && self.project.is_some() {
            self.preferences.layout().ui(workspace, ui, &mut shown);
        } else {
            let pane = match self.project {
                Some(_) => workspace.main()[0],
                None => Pane::Project,
            };
            shown.alone_ui(ui, pane);
        }
        self.edited |= shown.edited;
        let drawn = shown.drawn;
        if !drawn.contains(&self.state.active) {
            let main = workspace.main().iter().find(|&pane| drawn.contains(pane));
            if let Some(&active) = main.or(drawn.first()) {
                self.state.apply(&Command::Activate(active));
            }
        }
        self.shown = drawn;
    }
}

impl eframe::App for StudioApp {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if self.is_blind(frame) {
            return;
        }
        self.hear();
        let mut commands = Vec::new();
        commands.extend(self.chosen.take());
        keys::pressed(&self.ctx, self.state.active, &mut commands);
        self.dropped(&mut commands);
        if self.state.panels && self.project.is_some() {
            self.bars_ui(ui, &mut commands);
        }
        CentralPanel::no_frame().show(ui, |ui| self.panes_ui(ui, &mut commands));
        if self.state.keys {
            keys::overlay_ui(ui, self.state.active, &mut commands);
        }
        if self.state.palette {
            let sight = sight!(self);
            self.palette.ui(ui, &sight, &mut commands);
        }
        if !commands.is_empty() {
            // The panels were drawn before the commands were applied.
            self.ctx.request_repaint();
        }
        for command in commands {
            self.apply(command);
        }
        self.shelf.follow(&self.state.look.environments);
        if !self.ctx.input(|i| i.pointer.any_down()) {
            self.state.release();
            self.keep();
            if std::mem::take(&mut self.edited) {
                self.preferences.save(&self.saver);
            }
        }
        self.play();
        self.ask();
        self.look_out();
        self.look_at_folders();
        if let (Some(relit), Some(pixel)) = (&self.relit, self.state.probed) {
            let wake = self.wake();
            (self.inspected).ask(&relit.predicted, pixel, &self.shown, wake);
        }
        if let Some(project) = &self.project {
            let wake = self.wake();
            self.training.ask(project, &self.shown, wake.clone());
            self.studies
                .ask(project, &self.state, &self.shown, wake.clone());
            if self
                .shown
                .iter()
                .any(|pane| matches!(pane, Pane::Lamps | Pane::Review))
            {
                let still = self.relit.as_ref().filter(|_| !self.state.playing);
                self.reviews.ask(project, still, wake);
            }
        }
    }
}
