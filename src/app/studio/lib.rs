//! The studio: a window with the relit frame, the timeline and the light. Panels emit [`Command`]s, [`StudioApp`]
//! applies them. Pictures come from [`worker`], and the window never waits for it.

mod app;
mod command;
mod comparison;
mod environment_list;
mod export_options;
mod favourites;
mod four_looks;
mod history;
mod icons;
mod keys;
mod layout;
mod look;
mod look_name;
mod look_shelf;
mod palette;
mod panel_context;
mod panels;
mod pointer_order;
mod preferences;
mod region;
mod saved_history;
mod saved_look;
mod saver;
mod state;
mod status;
mod stored_look;
mod stored_looks;
mod theme;
mod workspace_view;

pub use app::{ProjectHandover, StudioApp};
pub use command::{
    CalibrationCommand, Command, Dialog, EnvironmentsCommand, ExportCommand, JobCommand, LookCommand, LooksCommand,
    MatteCommand, ProjectCommand, ReviewCommand, TimelineCommand, TrainingCommand, ViewCommand, WindowCommand,
};
pub use comparison::{CellPicture, CompareMode, CompareSettings, GAINS, Reference};
pub use environment_list::{ListedEnvironment, Owner};
pub use export_options::ExportOptions;
pub use four_looks::{FourLooks, FourSlot};
pub use layout::{Layout, Pane, Workspace};
pub use look::{Group, LookSettings};
pub use look_name::LookName;
pub use look_shelf::{LookVersion, ShelvedLook};
pub use panels::checks::query::ProjectCheck;
pub use panels::environments::library::{EnvironmentEntry, PanoramaState};
pub use panels::footage::painting::MattePainting;
pub use panels::footage::reader::{FootageReader, FootageView, MatteView, Thumbnail};
pub use panels::probe::query::CalibrationAnalysis;
pub use panels::project::plan::{Plan, Wizard};
pub use panels::project::recents::{Recent, Recents};
pub use panels::review::query::NetworkReview;
pub use panels::training::query::{TrainChoice, Training};
pub use panels::viewport::four_pictures::FourPicture;
pub use preferences::Preferences;
pub use region::Region;
pub use saved_look::SavedLook;
pub use state::{
    Covers, Display, LampCounts, Panes, Playback, ReviewView, ShootView, State, View, ViewportView, WindowParts,
};
pub use status::{LogLine, Phase, RunningJob, Severity, Status};
pub use stored_look::StoredLook;
pub use stored_looks::{LookId, Shelf, StoredLooks};

use base::error::{Error, Result};
use eframe::egui_wgpu::{RenderState, WgpuSetupCreateNew};
use gpu::{DeviceChoice, Gpu, WgpuSetup, device_descriptor};
use project::Project;
use std::sync::Arc;
use std::time::{Duration, Instant};
use worker::Latest;

/// Shortest life of a window that is reopened after its GPU is lost.
const SOON: Duration = Duration::from_secs(20);

/// Opens the window, on a project or on the start page, and returns when it is closed. If the GPU that draws it is
/// lost, the window opens again on the same project and shows a message.
///
/// # Errors
/// If there is no display, or no graphics adapter that can draw a window.
pub fn run(mut project: Option<Project>, device: DeviceChoice) -> Result<()> {
    let handover = ProjectHandover::new(Latest::new(|| {}));
    let mut lost = false;
    loop {
        let opened = Instant::now();
        show(project, device, handover.clone(), lost)?;
        match handover.take() {
            None => return Ok(()),
            Some(_) if opened.elapsed() < SOON => return Err(Error::GpuLost),
            Some(open) => (project, lost) = (open, true),
        }
    }
}

/// One window, until it is closed. `lost`: it replaces a window whose GPU was lost.
fn show(project: Option<Project>, device: DeviceChoice, handover: ProjectHandover, lost: bool) -> Result<()> {
    let title = app::title(project.as_ref());
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(device_descriptor);
    let mut options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(&title)
            .with_app_id("afterlight")
            .with_icon(icon())
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([720.0, 480.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    options.wgpu_options.wgpu_setup = setup.into();
    let create = move |cc: &eframe::CreationContext| {
        if let Some(window) = &cc.wgpu_render_state {
            share(window);
        }
        let message = lost.then(|| Error::GpuLost.to_string());
        let mut app = StudioApp::with_preferences(&cc.egui_ctx, Preferences::of_user(), project, device);
        if let Some(window) = &cc.wgpu_render_state {
            app = app.drawn_with(window.clone());
        }
        Ok(Box::new(app.replaced_by(handover, message.as_deref())) as Box<dyn eframe::App>)
    };
    eframe::run_native(&title, options, Box::new(create)).map_err(|e| {
        Error::device(
            format!("the window cannot be opened: {e}"),
            "Start it in a desktop session with a graphics adapter, or use the commands: afterlight --help",
        )
    })
}

/// Icon in the title bar and the list of windows.
fn icon() -> egui::IconData {
    let png = include_bytes!("../../../assets/icon/128.png");
    eframe::icon_data::from_png_bytes(png).unwrap_or_default()
}

/// Lets the network compute on the GPU that draws the window.
fn share(window: &RenderState) {
    Gpu::share(WgpuSetup {
        instance: window.instance.clone(),
        adapter: window.adapter.clone(),
        device: window.device.clone(),
        queue: window.queue.clone(),
        backend: window.adapter.get_info().backend,
    });
}
