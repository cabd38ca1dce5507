//! The application: it hears the worker, shows the panels, applies their commands and asks for the
//! picture that the state calls for.

mod applying;
mod asking;
mod blind;
#[macro_use]
mod drawing;
mod drops;
mod exporting;
mod jobs;
mod projects;

use asking::Wanted;
pub use blind::Left;

use super::command::Command;
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
use super::panes::Panes;
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
use egui::{CentralPanel, Context};
use gpu::DeviceChoice;
use project::{Lock, Project};
use std::path::PathBuf;
use std::sync::Arc;
use worker::{Blocked, Event, Export, Latest, PreviewPicture, Source, Worker};

/// The window's contents.
pub struct StudioApp {
    ctx: Context,
    device: DeviceChoice,
    project: Option<Project>,
    worker: Option<Worker>,
    shelf: Shelf,
    state: State,
    news: News,
    relit: Option<Arc<PreviewPicture>>,
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
    pub fn relit(&self) -> Option<&Arc<PreviewPicture>> {
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
