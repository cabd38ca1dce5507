//! The picture in the viewport: its request, and the time of the next frame.

use crate::layout::Pane;
use crate::panels::environments::library::EnvironmentLibrary;
use crate::panels::viewport::four_pictures::FourPicture;
use crate::state::State;
use crate::status::Status;
use crate::stored_looks::StoredLooks;
use egui::Context;
use scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use worker::{Comparison, LookView, Origin, PreviewPicture, PreviewRequest, Worker};

/// Weight of the newest frame time in the mean.
const NEWEST: f64 = 0.25;

/// The newest picture, and the last request.
#[derive(Default)]
pub struct Preview {
    pub relit: Option<Arc<PreviewPicture>>,
    asked: Option<(PictureRequest, Shortcuts)>,
    /// True if the window draws textures of the network's GPU.
    shares_gpu: bool,
    /// Time of the next frame during playback, in seconds of the window's clock.
    due: f64,
    /// Time of the last advance during playback, in seconds of the window's clock, and the mean time between advances.
    advanced: Option<(f64, f64)>,
}

/// Request for the picture of a state.
#[derive(PartialEq)]
struct PictureRequest {
    scene: Scene,
    environment: Origin,
    compared: [Option<Comparison>; 2],
    looks: [Option<LookView>; 4],
    solo: Vec<usize>,
    table: Option<PathBuf>,
}

/// Work to skip while the picture changes.
#[derive(Clone, Copy, PartialEq)]
struct Shortcuts {
    /// Skip full size and fine light: a setting is being dragged or the clip plays.
    moving: bool,
    /// Skip the copy to memory: no visible panel reads it.
    texture: bool,
}

impl Preview {
    /// A preview for a window that does or does not share its GPU with the network.
    pub fn drawn_by(shares_gpu: bool) -> Self {
        Self { shares_gpu, ..Self::default() }
    }

    /// Drops the picture and its request.
    pub fn clear(&mut self) {
        (self.relit, self.asked) = (None, None);
    }

    /// Shows a newer picture, if there is one.
    pub fn show(&mut self, newer: Option<Arc<PreviewPicture>>) {
        self.relit = newer.or(self.relit.take());
    }

    /// Number of lamps in the rig; 0 before the first picture.
    pub fn lamps(&self) -> usize {
        self.relit.as_ref().map_or(0, |relit| relit.rig.lamps.len())
    }

    /// Requests the picture of the state if the request changed and its environment is loaded. `root`: the project's
    /// folder.
    pub fn ask(
        &mut self,
        (worker, root): (&Worker, Option<&Path>),
        (library, stored): (&EnvironmentLibrary, &StoredLooks),
        state: &State,
        status: &mut Status,
    ) {
        let Some(entry) = library.entries().get(state.look.environment) else { return };
        let Some(environment) = library.environment(&entry.listed.origin) else { return };
        let compared =
            if state.four.on { [None, None] } else { (state.compare).pictures(state, stored, library.entries()) };
        let look = |slot| match FourPicture::new(slot, state, stored, library.entries()) {
            FourPicture::View(view) if state.four.on => Some(*view),
            _ => None,
        };
        let request = PictureRequest {
            scene: state.scene(),
            environment: entry.listed.origin.clone(),
            compared,
            looks: state.four.slots.each_ref().map(look),
            solo: state.solo.clone(),
            table: root.and_then(|root| state.export_options.shown_table(root)),
        };
        let moving = state.is_dragged() || state.playback.playing;
        let shortcuts = Shortcuts { moving, texture: self.shares_gpu && moving && !state.panes.shows(Pane::Scopes) };
        let (same, same_shortcuts) = match &self.asked {
            Some((asked, before)) => (*asked == request, *before == shortcuts),
            None => (false, false),
        };
        if !same {
            status.failure = None;
        }
        if !same || !same_shortcuts {
            let [first, second] = request.compared.clone();
            worker.show(PreviewRequest {
                scene: request.scene.clone(),
                environment,
                first,
                second,
                looks: request.looks.clone(),
                solo: request.solo.clone(),
                table: request.table.clone(),
                frame_rate: state.playback.frame_rate,
                moving,
                texture: shortcuts.texture,
            });
            self.asked = Some((request, shortcuts));
        }
    }

    /// Frames shown per second during playback; None while nothing plays.
    pub fn played(&self, now: f64) -> Option<f64> {
        let (last, mean) = self.advanced?;
        // A frame that is late already counts.
        Some(1.0 / mean.max(now - last))
    }

    /// Advances to the next frame when it is due and the current one has been shown.
    pub fn play(&mut self, ctx: &Context, state: &mut State) {
        let period = 1.0 / state.playback.frame_rate;
        let now = ctx.input(|i| i.time);
        let relit = self.relit.as_ref();
        let seen = relit.is_some_and(|relit| relit.scene.frame == state.frame);
        if !state.playback.playing {
            self.due = now + period;
            self.advanced = None;
        } else if seen {
            if now >= self.due {
                state.advance();
                let (before, mean) = self.advanced.unwrap_or((now - period, period));
                self.advanced = Some((now, mean + NEWEST * (now - before - mean)));
                // Late frames are not caught up: they would play faster than filmed.
                self.due = (self.due + period).max(now);
            }
            ctx.request_repaint_after(Duration::from_secs_f64((self.due - now).max(0.0)));
        }
    }
}
