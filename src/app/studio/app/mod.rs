//! The application: takes in the threads' reports, draws the panels, applies their commands and requests the picture of
//! the current state.

mod autosave;
mod closing;
mod commands;
mod dialogs;
mod drops;
mod errands;
mod gpu_lost;
mod jobs;
mod preview;
mod session;
mod view;
mod window;

pub(crate) use autosave::Autosave;
pub use gpu_lost::ProjectHandover;
pub(crate) use preview::Preview;

use super::command::{Command, WindowCommand};
use super::layout::Pane;
use super::panel_context::PanelContext;
use super::panels::checks::query::ProjectCheck;
use super::panels::environments::library::{EnvironmentEntry, EnvironmentLibrary, Scan};
use super::panels::export::exports::Exports;
use super::panels::footage::painting::MattePainting;
use super::panels::footage::reader::FootageReader;
use super::panels::machine::query::Machine;
use super::panels::probe::query::CalibrationAnalysis;
use super::panels::project::picker::ProjectPicker;
use super::panels::project::plan::Wizard;
use super::panels::project::recents::Recents;
use super::panels::readers::Readers;
use super::panels::review::query::NetworkReview;
use super::panels::training::query::Training;
use super::pointer_order::PointerOrder;
use super::preferences::Preferences;
use super::state::State;
use super::status::{Phase, Status};
use super::stored_looks::{LookId, StoredLooks};
use super::{keys, theme};
use base::progress::Report;
use dialogs::Dialogs;
use eframe::egui_wgpu::RenderState;
use egui::{Context, InputState, UserAttentionType};
use errands::Errands;
use gpu::{DeviceChoice, Gpu};
use project::Project;
use session::Session;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use view::WindowView;
use worker::{Blocked, Event, Export, PreviewPicture, Query, Source, Worker};

/// The window's contents.
pub struct StudioApp {
    pub(crate) ctx: Context,
    pub(crate) device: DeviceChoice,
    pub(crate) state: State,
    pub(crate) status: Status,
    pub(crate) session: Session,
    pub(crate) library: EnvironmentLibrary,
    /// Scan of the watched folders.
    pub(crate) folders: Query<BTreeSet<PathBuf>, Scan>,
    pub(crate) preview: Preview,
    pub(crate) readers: Readers,
    pub(crate) exports: Exports,
    pub(crate) picker: ProjectPicker,
    pub(crate) dialogs: Dialogs,
    pub(crate) errands: Errands,
    pub(crate) machine: Machine,
    pub(crate) autosave: Autosave,
    pub(crate) looks: StoredLooks,
    /// The look to write once a file is chosen for it.
    pub(crate) saved_as: Option<LookId>,
    pub(crate) view: WindowView,
    /// Slot that receives the project when the window can no longer be drawn.
    pub(crate) handover: Option<ProjectHandover>,
}

/// True if the event deserves the attention of an absent person: work has ended or is blocked.
fn needs_a_look(event: &Event) -> bool {
    matches!(event, Event::Finished { .. } | Event::Exported(_) | Event::Report(Report::Blocked(_)))
}

/// True if a key or a button of the pointer was pressed since the last frame.
fn is_pressed(input: &InputState) -> bool {
    let key = |event: &egui::Event| matches!(event, egui::Event::Key { pressed: true, .. });
    input.pointer.any_pressed() || input.events.iter().any(key)
}

/// Commands that keys can give while something covers the window: they close it.
fn closing_keys(state: &State) -> Vec<WindowCommand> {
    let keys = state.covers.keys.then_some(WindowCommand::ToggleKeys);
    keys.into_iter().chain([WindowCommand::Dismiss]).collect()
}

/// The window's title.
pub(super) fn title(project: Option<&Project>) -> String {
    project.map_or("Afterlight".to_owned(), |p| format!("Afterlight — {}", p.settings.name))
}

impl StudioApp {
    /// A window on a project or on the start page, without preferences of a person.
    pub fn new(ctx: &Context, project: Option<Project>, device: DeviceChoice) -> Self {
        Self::with_preferences(ctx, Preferences::default(), project, device)
    }

    /// A person's window, on a project or on the start page.
    pub fn with_preferences(
        ctx: &Context,
        preferences: Preferences,
        project: Option<Project>,
        device: DeviceChoice,
    ) -> Self {
        let mut app = Self::empty(ctx, preferences, device);
        if let Some(project) = project {
            let worker = Worker::start(project.clone(), device, app.wake());
            app.open(project, worker);
        }
        app
    }

    /// A window on frames from any source of reflectance fields, for tests.
    pub fn over(
        ctx: &Context,
        project: Project,
        source: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
    ) -> Self {
        Self::over_as(ctx, Preferences::default(), project, source)
    }

    /// The same, with a person's preferences.
    pub fn over_as(
        ctx: &Context,
        preferences: Preferences,
        project: Project,
        source: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
    ) -> Self {
        let mut app = Self::empty(ctx, preferences, DeviceChoice::Cpu);
        let worker = Worker::over(source, app.wake());
        app.open(project, worker);
        app
    }

    /// Draws predictions from GPU memory if window and network share a GPU.
    pub fn drawn_with(mut self, window: RenderState) -> Self {
        self.preview = Preview::drawn_by(Gpu::is_shared(&window.device));
        self.view.draw_with(window);
        self
    }

    fn empty(ctx: &Context, preferences: Preferences, device: DeviceChoice) -> Self {
        theme::apply(ctx);
        ctx.add_plugin(PointerOrder::default());
        let wake = {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        let mut app = Self {
            ctx: ctx.clone(),
            device,
            state: State::new(0, 24.0),
            status: Status::new(Phase::NoProject),
            session: Session::default(),
            library: EnvironmentLibrary::new(ctx),
            folders: Query::default(),
            preview: Preview::default(),
            readers: Readers::default(),
            exports: Exports::default(),
            picker: ProjectPicker::new(wake.clone()),
            dialogs: Dialogs::new(wake.clone()),
            errands: Errands::default(),
            machine: Machine::new(wake.clone()),
            looks: StoredLooks::new(preferences.folder(), wake.clone()),
            saved_as: None,
            autosave: Autosave::new(preferences, wake),
            view: WindowView::default(),
            handover: None,
        };
        app.scan_folders();
        app
    }

    /// The current state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Possible actions, the running job and failures.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// The threads of the open project.
    pub fn worker(&self) -> Option<&Worker> {
        self.session.worker.as_ref()
    }

    /// The newest picture.
    pub fn relit(&self) -> Option<&Arc<PreviewPicture>> {
        self.preview.relit.as_ref()
    }

    /// Light of the probed pixel under each lamp at full power, once known.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.readers.inspector.texel()
    }

    /// State of the calibration.
    pub fn analysis(&self) -> &CalibrationAnalysis {
        &self.readers.analysis
    }

    /// State of the network's quality measurements.
    pub fn review(&self) -> &NetworkReview {
        &self.readers.review
    }

    /// State of the project check.
    pub fn check(&self) -> &ProjectCheck {
        &self.readers.check
    }

    /// State of the network's training.
    pub fn training(&self) -> &Training {
        &self.readers.training
    }

    /// Exports: waiting, running and finished.
    pub fn exports(&self) -> &[Export] {
        &self.exports.queue
    }

    /// The open project.
    pub fn project(&self) -> Option<&Project> {
        self.session.project.as_ref()
    }

    /// The recent projects.
    pub fn recents(&self) -> &Recents {
        &self.picker.recents
    }

    /// The plan for a new project.
    pub fn wizard(&self) -> &Wizard {
        &self.picker.wizard
    }

    /// The footage as filmed.
    pub fn footage(&self) -> &FootageReader {
        &self.readers.footage
    }

    /// Strokes on mattes, and the resulting matte.
    pub fn matte(&self) -> &MattePainting {
        &self.readers.matte
    }

    /// The stored looks.
    pub fn looks(&self) -> &StoredLooks {
        &self.looks
    }

    /// The list of environments.
    pub fn environments(&self) -> &[EnvironmentEntry] {
        self.library.entries()
    }

    pub(crate) fn wake(&self) -> impl Fn() + Clone + Send + Sync + 'static {
        let ctx = self.ctx.clone();
        move || ctx.request_repaint()
    }

    /// Takes in what the threads report.
    fn receive(&mut self) {
        self.receive_events();
        self.readers.receive(&self.ctx);
        self.machine.receive();
        self.receive_aim();
        self.make_mattes();
        self.finish_errands();
        self.receive_folders();
        // What an errand added has its entry in this draw.
        self.library.follow(&self.state.look.environments);
        self.open_made();
        self.receive_looks();
        let unreadable = self.library.receive();
        let withdrawn =
            unreadable.into_iter().filter(|(origin, _)| self.state.withdraw(origin)).map(|(_, sentence)| sentence);
        let withdrawn: Vec<String> = withdrawn.collect();
        let unsaved = self.autosave.failures().chain(self.library.unsaved());
        let unread = self.readers.inspector.failure();
        let unseen = self.readers.colors.receive(&mut self.state);
        let failures = unsaved.chain(withdrawn).chain(unread).chain(unseen).chain(self.exports.destination.failure());
        failures.for_each(|failure| self.status.refuse(failure));
    }

    fn receive_events(&mut self) {
        let Some(worker) = &self.session.worker else { return };
        for event in worker.events() {
            // Without a project, a worker has nothing to open.
            if self.session.project.is_none() && matches!(event, Event::Opening | Event::Blocked(_)) {
                continue;
            }
            if matches!(event, Event::Opening | Event::Failed { .. }) {
                self.state.playback.playing = false;
            }
            if event == Event::Opening {
                // Pictures of an older network are stale.
                self.preview.clear();
            }
            if needs_a_look(&event) && !self.ctx.input(|input| input.focused) {
                let asked = UserAttentionType::Informational;
                let asked = egui::ViewportCommand::RequestUserAttention(asked);
                self.ctx.send_viewport_cmd(asked);
            }
            self.readers.on_event(&event);
            self.status.on_event(event);
        }
        self.readers.training.show(worker.pictures());
        self.preview.show(worker.relit());
        self.state.lamps.rig = self.preview.lamps();
        self.exports.receive(worker.exports());
    }

    /// Draws the window.
    fn draw(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        if self.autosave.saving().is_some() {
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(500));
        }
        let mut layout = self.autosave.lend_layout();
        let context = PanelContext {
            session: self.session.shown(),
            state: &self.state,
            status: &self.status,
            library: &self.library,
            looks: &self.looks,
            preview: &self.preview,
            readers: &self.readers,
            exports: &self.exports,
            picker: &self.picker,
            autosave: &self.autosave,
        };
        let drawn = self.view.ui(ui, &context, &self.machine, &mut layout, commands);
        self.autosave.return_layout(layout, drawn.layout_edited);
        self.state.panes.drawn = drawn.panes;
        self.state.panes.activate_drawn();
    }

    /// Requests from the threads whatever is visible and not known yet.
    fn ask(&mut self) {
        let wake = self.wake();
        if let Some(worker) = &self.session.worker {
            let library = (&self.library, &self.looks);
            let root = self.session.project.as_ref().map(|project| &*project.root);
            self.preview.ask((worker, root), library, &self.state, &mut self.status);
        }
        if self.state.panes.shows(Pane::Project) || self.session.project.is_some() {
            self.picker.ask(&self.autosave, wake.clone());
        }
        // The project menu shows first frames too.
        if self.state.panes.shows(Pane::Project) || egui::Popup::is_any_open(&self.ctx) {
            self.picker.recents.draw(&self.ctx, wake.clone());
        }
        if let Some(project) = &self.session.project {
            if self.state.panes.shows(Pane::Export) {
                self.exports.ask(&self.state, &project.root, self.wake());
            }
            let relit = self.preview.relit.as_ref();
            let measuring = self.status.job.is_some();
            (self.readers).ask(project, &self.state, (measuring, self.device), relit, wake.clone());
            let waits = self.status.phase.waits_for_job();
            (self.readers).ask_backdrop(project, &self.state, waits, wake.clone());
            let still = !self.state.playback.playing && !self.ctx.input(|i| i.pointer.any_down());
            if still && self.status.phase != Phase::Opening {
                let environments = self.library.entries();
                (self.readers.check).ask(project, &self.state, environments, wake);
            }
        }
    }

    /// Saves changes once no drag is in progress.
    fn save(&mut self) {
        if self.ctx.input(|i| i.pointer.any_down()) {
            return;
        }
        self.state.release();
        self.save_look();
        self.autosave.save_layout();
    }

    /// Saves the look if it changed, even while the clip plays.
    pub(crate) fn save_look(&mut self) {
        if let (Some(project), None) = (&self.session.project, &self.session.read_only) {
            self.autosave.save_look(project, &self.state);
        }
    }
}

impl eframe::App for StudioApp {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if self.closes_without_gpu(frame) {
            return;
        }
        if self.ctx.input(is_pressed) {
            self.status.pressed();
        }
        let to_front = |event: &egui::Event| matches!(event, egui::Event::WindowFocused(true));
        if self.ctx.input(|input| input.raw.events.iter().any(to_front)) {
            self.scan_folders();
        }
        self.receive();
        self.follow_color_config();
        self.ask_before_closing();
        let mut commands = Vec::new();
        commands.extend(self.chosen());
        let hovered = self.state.panes.shows(Pane::Timeline) && self.view.is_over_timeline();
        let hovered = hovered.then_some(Pane::Timeline);
        let covered = self.state.covers.takes_keys().then(|| closing_keys(&self.state));
        let panes = (self.state.panes.active, hovered);
        keys::pressed(&self.ctx, panes, covered.as_deref(), &mut commands);
        self.dropped(&mut commands);
        self.draw(ui, &mut commands);
        if !commands.is_empty() {
            // Commands are applied after the panels are drawn, so another frame is needed.
            self.ctx.request_repaint();
        }
        for command in commands {
            self.apply(command);
        }
        self.follow_environments();
        self.save();
        self.preview.play(&self.ctx, &mut self.state);
        self.ask();
    }
}
