//! Background readers of the open project.

use crate::layout::Pane;
use crate::panels::accuracy::query::Accuracy;
use crate::panels::checks::query::ProjectCheck;
use crate::panels::color_views::query::ColorViews;
use crate::panels::footage::painting::MattePainting;
use crate::panels::footage::reader::{FootageReader, FootageView};
use crate::panels::probe::query::CalibrationAnalysis;
use crate::panels::review::query::NetworkReview;
use crate::panels::scopes::query::PixelInspector;
use crate::panels::training::query::Training;
use crate::panels::viewport::light_aim::{AimQuestion, LightAim};
use crate::state::State;
use egui::Context;
use gpu::DeviceChoice;
use project::Project;
use std::sync::Arc;
use worker::{Event, PreviewPicture};

/// State of the readers.
#[derive(Default)]
pub struct Readers {
    pub analysis: CalibrationAnalysis,
    pub review: NetworkReview,
    pub accuracy: Accuracy,
    pub check: ProjectCheck,
    pub training: Training,
    pub footage: FootageReader,
    pub matte: MattePainting,
    pub inspector: PixelInspector,
    pub aim: LightAim,
    pub colors: ColorViews,
}

impl Readers {
    pub fn on_event(&mut self, event: &Event) {
        if matches!(event, Event::Finished { .. }) {
            // The job may have calibrated, measured or made mattes.
            self.analysis.invalidate();
            self.review.invalidate();
            self.accuracy.invalidate();
            self.check.invalidate();
            self.footage.invalidate();
        }
        self.training.on_event(event);
    }

    /// Reason a verdict or a stroke is not on disk.
    pub fn unsaved(&self) -> Option<&str> {
        self.review.failure.as_deref().or(self.matte.unsaved())
    }

    /// Takes in the readers' results.
    pub fn receive(&mut self, ctx: &Context) {
        self.analysis.receive();
        self.review.receive();
        self.accuracy.receive(ctx);
        self.check.receive();
        self.training.receive();
        self.footage.receive(ctx);
        self.matte.receive(ctx);
        self.inspector.receive();
    }

    /// Requests whatever the visible panes need and is not known yet.
    pub fn ask(
        &mut self,
        project: &Project,
        state: &State,
        (measuring, device): (bool, DeviceChoice),
        relit: Option<&Arc<PreviewPicture>>,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) {
        let shown = &state.panes.drawn;
        self.training.ask(project, shown, wake.clone());
        self.colors.ask(project, state, wake.clone());
        self.analysis.ask(project, state, wake.clone());
        // The timeline marks frames unlike every pose, whichever other panes are visible.
        let draws = state.panes.shows(Pane::Lamps) || state.panes.shows(Pane::Review);
        let still = relit.filter(|_| draws && !state.playback.playing);
        let cell = state.review.cell.map(|(case, lamp)| (case, lamp, device));
        self.review.ask(project, still, cell, wake.clone());
        if state.panes.shows(Pane::Export) {
            self.accuracy.ask(project, false, wake.clone());
        }
        if state.panes.shows(Pane::Accuracy) {
            self.accuracy.ask(project, measuring, wake.clone());
        }
        if state.panes.shows(Pane::Footage) {
            let (frame, pose, view) = (state.frame, state.shoot.pose, state.footage);
            (self.footage).ask(project, frame, pose, view, wake.clone());
            self.matte.ask(project, frame, wake.clone());
        }
        (self.footage).ask_thumbnails(project, shown, wake.clone());
        if let (Some(relit), Some(pixel)) = (relit, state.viewport.probed) {
            self.inspector.ask(&relit.predicted, pixel, shown, wake.clone());
        }
        if let (Some(relit), Some(pixel)) = (relit, state.viewport.probed)
            && (state.viewport.aims && !state.playback.playing && state.panes.shows(Pane::Picture))
        {
            let question =
                AimQuestion { of: relit.predicted.clone(), rig: relit.rig.clone(), pixel: Some(pixel), drag: 0 };
            self.aim.point(question, wake.clone());
        }
        match relit.filter(|_| state.shows_handles() && state.panes.shows(Pane::Picture)) {
            // A frame that is only being played is not worth the work.
            Some(relit) if !state.playback.playing => self.aim.seek(&relit.predicted, &relit.rig, wake),
            Some(_) => {}
            None if state.viewport.aims => {}
            None => self.aim.clear(),
        }
    }

    /// Requests the interview frame shown as a backdrop of empty panes: while nothing is trained, and where `waits`
    /// says that the project needs a calibration or a training.
    pub fn ask_backdrop(
        &mut self,
        project: &Project,
        state: &State,
        waits: bool,
        wake: impl Fn() + Clone + Send + 'static,
    ) {
        let picture = waits && state.panes.shows(Pane::Picture);
        let training = self.training.is_empty() && state.panes.shows(Pane::Training);
        if (picture || training) && !state.panes.shows(Pane::Footage) {
            let view = FootageView::default();
            (self.footage).ask(project, state.frame, state.shoot.pose, view, wake);
        }
    }
}
