//! What the window shows, as plain data, and how commands change it.

use super::command::Command;
use super::compare::{Compare, How};
use super::layout::{Pane, Workspace};
use super::order::Order;
use crate::calibration::{Circle, Trial};
use crate::light::Lighting;
use crate::scene::{Background, Effects, Inspection, Output, Scene};

/// Stops that the exposure can be set to: beyond them a display shows nothing but black or white.
pub const EXPOSURE_STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// What a difference between two pictures is multiplied with.
pub const GAIN: f32 = 4.0;

/// Magnifications of the fitted picture.
const ZOOM: std::ops::RangeInclusive<f32> = 0.1..=64.0;

/// The settings that can be undone.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Entry of the list of environments.
    pub environment: usize,
    /// From −180 (exclusive) to 180 degrees.
    pub yaw_deg: f32,
    pub exposure_stops: f32,
    pub lighting: Lighting,
    pub effects: Effects,
    pub background: Background,
    /// The mirror ball's silhouette where it was set by hand.
    pub circle: Option<Circle>,
    /// The response that is tried by hand.
    pub trial: Option<Trial>,
}

/// Where the picture is in the viewport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// 1 fits the picture into the viewport.
    pub zoom: f32,
    /// Offset of the picture's centre from the viewport's, in points.
    pub pan: [f32; 2],
}

const FITTED: View = View {
    zoom: 1.0,
    pan: [0.0; 2],
};

/// The window's state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub look: Look,
    pub workspace: Workspace,
    /// The pane that keys are meant for.
    pub active: Pane,
    /// The lamp whose mirror ball is shown; none is the interview's.
    pub photograph: Option<usize>,
    /// The exemplar that is relit as the interview.
    pub pose: usize,
    /// Where the wipe between two pictures stands: 0 left, 1 right.
    pub wipe: f32,
    pub compare: Compare,
    /// Lamps that light the subject alone; none is the environment.
    pub solo: Vec<usize>,
    /// Number of lamps, once it is known.
    pub lamps: usize,
    /// The pixel that is looked at, in columns and rows.
    pub probed: Option<[usize; 2]>,
    /// Shown frame, from 0.
    pub frame: usize,
    /// Frames of the interview.
    pub frames: usize,
    /// Frames per second.
    pub frame_rate: f64,
    pub playing: bool,
    /// What the next export is to be.
    pub order: Order,
    pub view: View,
    pub panels: bool,
    pub full_screen: bool,
    /// The list of keys covers the picture.
    pub keys: bool,
    /// The list of commands is open.
    pub palette: bool,
    undo: Vec<Look>,
    redo: Vec<Look>,
    /// The kind of change that a drag in progress makes: all of it is undone at once.
    dragging: Option<std::mem::Discriminant<Command>>,
}

impl State {
    /// The state of a window that was just opened.
    pub fn new(frames: usize, frame_rate: f64) -> Self {
        Self {
            look: Look {
                environment: 0,
                yaw_deg: 0.0,
                exposure_stops: 0.0,
                lighting: Lighting::default(),
                effects: Effects::default(),
                background: Background::Environment,
                circle: None,
                trial: None,
            },
            workspace: Workspace::default(),
            active: Workspace::default().main()[0],
            photograph: None,
            pose: 0,
            wipe: 0.5,
            compare: Compare::default(),
            solo: Vec::new(),
            lamps: 0,
            probed: None,
            frame: 0,
            frames,
            frame_rate,
            playing: false,
            order: Order::default(),
            view: FITTED,
            panels: true,
            full_screen: false,
            keys: false,
            palette: false,
            undo: Vec::new(),
            redo: Vec::new(),
            dragging: None,
        }
    }

    /// The picture that this state asks for.
    pub fn scene(&self) -> Scene {
        let mut effects = self.look.effects;
        if self.compare.on && self.compare.how == How::Difference {
            effects.inspection = Inspection::Difference { gain: GAIN };
        }
        Scene {
            frame: self.frame,
            yaw_deg: self.look.yaw_deg,
            lighting: self.look.lighting.clone(),
            effects,
            exposure_stops: self.look.exposure_stops,
            background: self.look.background,
            output: Output::Display,
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Ends a drag: the next change is a step of its own.
    pub fn release(&mut self) {
        self.dragging = None;
    }

    /// Applies a command as far as it concerns this state. `environments` is the length of their
    /// list. Commands that need files, threads or the window leave it as it is.
    pub fn apply(&mut self, command: &Command, environments: usize) {
        let mut look = self.look.clone();
        let last = self.frames.saturating_sub(1);
        match command.clone() {
            Command::Environment(entry) if entry < environments => look.environment = entry,
            Command::StepEnvironment(step) if environments > 0 => {
                let entry = look.environment as isize + step;
                look.environment = entry.rem_euclid(environments as isize) as usize;
            }
            Command::Yaw(degrees) => look.yaw_deg = wrapped(degrees, look.yaw_deg),
            Command::Turn(degrees) => look.yaw_deg = wrapped(look.yaw_deg + degrees, look.yaw_deg),
            Command::Exposure(stops) => look.exposure_stops = exposure(stops, look.exposure_stops),
            Command::StepExposure(stops) => {
                look.exposure_stops = exposure(look.exposure_stops + stops, look.exposure_stops);
            }
            Command::Lighting(lighting) => look.lighting = *lighting,
            Command::Effects(effects) => look.effects = effects.bounded(),
            Command::Background(background) => look.background = background,
            Command::Circle(circle) => look.circle = circle,
            Command::Try(trial) => look.trial = trial,
            Command::Workspace(workspace) => {
                self.workspace = workspace;
                self.active = workspace.first();
                self.view = FITTED;
            }
            Command::Activate(pane) | Command::Pane(pane) => self.active = pane,
            Command::Order(order) => self.order = *order,
            Command::MarkIn => {
                let (_, end) = self.order.range(self.frames);
                self.order.frames = Some((self.frame, end.max(self.frame)));
            }
            Command::MarkOut => {
                let (start, _) = self.order.range(self.frames);
                self.order.frames = Some((start.min(self.frame), self.frame));
            }
            Command::Photograph(lamp) => self.photograph = lamp,
            Command::Pose(pose) => self.pose = pose,
            Command::Wipe(at) if at.is_finite() => self.wipe = at.clamp(0.0, 1.0),
            Command::Compare(compare) => self.compare = compare,
            Command::ToggleWipe => self.compare.toggle_wipe(),
            Command::ToggleSecond => self.compare.toggle_second(),
            Command::Solo(lamps) => self.solo = lamps,
            Command::StepSolo(step) if self.lamps > 0 => {
                // The environment stands before the first lamp.
                let shown = self.solo.first().map_or(0, |lamp| lamp + 1) as isize + step;
                let shown = shown.rem_euclid(self.lamps as isize + 1) as usize;
                self.solo = shown.checked_sub(1).into_iter().collect();
            }
            Command::Inspect(inspection) => {
                let old = &mut look.effects.inspection;
                *old = if *old == inspection {
                    Inspection::Picture
                } else {
                    inspection
                };
            }
            Command::Probe(pixel) => self.probed = pixel,
            Command::StepWipe => {
                self.wipe = match self.wipe {
                    at if at <= 0.0 => 0.5,
                    at if at >= 1.0 => 0.0,
                    _ => 1.0,
                }
            }
            Command::ResetView => {
                self.view = FITTED;
                look.exposure_stops = 0.0;
            }
            Command::Undo => return self.travel(true),
            Command::Redo => return self.travel(false),
            Command::Frame(frame) => self.go(frame),
            Command::StepFrame(step) => self.go(self.frame.saturating_add_signed(step)),
            Command::LastFrame => self.go(last),
            Command::TogglePlay => self.playing = !self.playing && self.frames > 1,
            Command::Zoom { factor, about } => self.zoom(factor, about),
            Command::Pan([x, y]) => {
                self.view.pan = [self.view.pan[0] + x, self.view.pan[1] + y];
            }
            Command::Fit => self.view = FITTED,
            Command::TogglePanels => self.panels = !self.panels,
            Command::ToggleFullScreen => self.full_screen = !self.full_screen,
            Command::ToggleKeys => self.keys = !self.keys,
            Command::TogglePalette => self.palette = !self.palette,
            Command::Dismiss if self.palette => self.palette = false,
            Command::Dismiss if self.keys => self.keys = false,
            Command::Dismiss => self.full_screen = false,
            _ => {}
        }
        self.settle(command, look);
    }

    /// Changes the settings as `command` means, whose effect depends on more than this state.
    pub fn nudge(&mut self, command: &Command, change: impl FnOnce(&mut Look)) {
        let mut look = self.look.clone();
        change(&mut look);
        self.settle(command, look);
    }

    fn settle(&mut self, command: &Command, look: Look) {
        if look != self.look {
            let kind = std::mem::discriminant(command);
            if self.dragging != Some(kind) {
                self.undo.push(self.look.clone());
                self.dragging = Some(kind);
            }
            self.redo.clear();
            self.look = look;
        }
    }

    /// Goes on to the next frame, around the clip's end.
    pub fn advance(&mut self) {
        self.frame = (self.frame + 1) % self.frames.max(1);
    }

    fn go(&mut self, frame: usize) {
        self.playing = false;
        self.frame = frame.min(self.frames.saturating_sub(1));
    }

    fn travel(&mut self, back: bool) {
        let (from, to) = if back {
            (&mut self.undo, &mut self.redo)
        } else {
            (&mut self.redo, &mut self.undo)
        };
        if let Some(look) = from.pop() {
            to.push(std::mem::replace(&mut self.look, look));
        }
        self.dragging = None;
    }

    /// What is under `about` stays there.
    fn zoom(&mut self, factor: f32, about: [f32; 2]) {
        let zoom = (self.view.zoom * factor).clamp(*ZOOM.start(), *ZOOM.end());
        let grown = zoom / self.view.zoom;
        if zoom.is_finite() {
            for (pan, about) in self.view.pan.iter_mut().zip(about) {
                *pan = about + (*pan - about) * grown;
            }
            self.view.zoom = zoom;
        }
    }
}

/// An angle from −180 (exclusive) to 180 degrees; `old` where it is none.
fn wrapped(degrees: f32, old: f32) -> f32 {
    let turned = 180.0 - (180.0 - degrees).rem_euclid(360.0);
    if turned.is_finite() { turned } else { old }
}

fn exposure(stops: f32, old: f32) -> f32 {
    if stops.is_nan() {
        old
    } else {
        stops.clamp(*EXPOSURE_STOPS.start(), *EXPOSURE_STOPS.end())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        State::new(10, 24.0)
    }

    #[test]
    fn a_drag_is_undone_at_once_and_separate_steps_one_by_one() {
        let mut s = state();
        (1..=30).for_each(|deg| s.apply(&Command::Yaw(deg as f32), 3));
        s.release();
        s.apply(&Command::StepExposure(0.5), 3);
        s.release();
        s.apply(&Command::StepEnvironment(-1), 3);
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 2)
        );
        s.apply(&Command::Undo, 3);
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 0)
        );
        s.apply(&Command::Undo, 3);
        s.apply(&Command::Undo, 3);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
        (0..3).for_each(|_| s.apply(&Command::Redo, 3));
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 2)
        );
    }

    #[test]
    fn a_change_after_an_undo_forgets_what_was_undone() {
        let mut s = state();
        s.apply(&Command::Yaw(10.0), 1);
        s.apply(&Command::Undo, 1);
        s.apply(&Command::Exposure(1.0), 1);
        assert!(!s.can_redo());
    }

    #[test]
    fn what_changes_nothing_cannot_be_undone() {
        let mut s = state();
        for command in [
            Command::Yaw(0.0),
            Command::Turn(360.0),
            Command::Environment(5),
            Command::StepEnvironment(1),
            Command::Exposure(f32::NAN),
            Command::Yaw(f32::INFINITY),
            Command::Fit,
            Command::Frame(3),
        ] {
            s.apply(&command, 0);
        }
        assert!(!s.can_undo());
        assert_eq!(s.look, state().look);
    }

    #[test]
    fn angles_and_stops_stay_in_their_ranges() {
        let mut s = state();
        s.apply(&Command::Turn(190.0), 1);
        assert_eq!(s.look.yaw_deg, -170.0);
        s.apply(&Command::Yaw(-180.0), 1);
        assert_eq!(s.look.yaw_deg, 180.0);
        s.apply(&Command::StepExposure(99.0), 1);
        assert_eq!(s.look.exposure_stops, 10.0);
    }

    #[test]
    fn frames_stop_at_the_ends_and_playing_goes_around() {
        let mut s = state();
        s.apply(&Command::StepFrame(-1), 0);
        assert_eq!(s.frame, 0);
        s.apply(&Command::LastFrame, 0);
        s.apply(&Command::StepFrame(1), 0);
        assert_eq!(s.frame, 9);
        s.apply(&Command::TogglePlay, 0);
        s.advance();
        assert_eq!((s.frame, s.playing), (0, true));
        s.apply(&Command::Frame(4), 0);
        assert_eq!((s.frame, s.playing), (4, false));
        let mut still = State::new(1, 24.0);
        still.apply(&Command::TogglePlay, 0);
        assert!(!still.playing, "one frame cannot be played");
    }

    #[test]
    fn lamps_are_shown_one_after_the_other_and_then_the_environment() {
        let mut s = state();
        s.apply(&Command::StepSolo(1), 0);
        assert!(s.solo.is_empty(), "no lamp is known yet");
        s.lamps = 3;
        for wanted in [&[0][..], &[1], &[2], &[], &[0]] {
            s.apply(&Command::StepSolo(1), 0);
            assert_eq!(s.solo, wanted);
        }
        s.apply(&Command::StepSolo(-1), 0);
        assert!(s.solo.is_empty());
    }

    #[test]
    fn a_channel_is_looked_at_until_it_is_asked_for_again_and_that_can_be_undone() {
        let mut s = state();
        let red = Inspection::Channel(crate::scene::Channel::Red);
        for wanted in [red, Inspection::Picture] {
            s.apply(&Command::Inspect(red), 0);
            s.release();
            assert_eq!(s.look.effects.inspection, wanted);
        }
        s.apply(&Command::Undo, 0);
        assert_eq!(s.look.effects.inspection, red);
    }

    #[test]
    fn what_is_under_the_cursor_stays_there_as_the_picture_is_zoomed() {
        let mut s = state();
        s.apply(&Command::Pan([7.0, -3.0]), 0);
        let about = [120.0, 45.0];
        let under = |v: &View| [0, 1].map(|i| (about[i] - v.pan[i]) / v.zoom);
        let before = under(&s.view);
        s.apply(&Command::Zoom { factor: 2.5, about }, 0);
        let after = under(&s.view);
        assert!(
            (0..2).all(|i| (before[i] - after[i]).abs() < 1e-3),
            "{before:?} {after:?}"
        );
        s.apply(&Command::Zoom { factor: 1e9, about }, 0);
        assert_eq!(s.view.zoom, 64.0);
        s.apply(&Command::Fit, 0);
        assert_eq!(s.view, FITTED);
    }

    #[test]
    fn resetting_the_view_can_be_undone_where_it_changed_the_exposure() {
        let mut s = state();
        s.apply(&Command::Exposure(2.0), 0);
        s.release();
        s.apply(&Command::ResetView, 0);
        assert_eq!(s.look.exposure_stops, 0.0);
        s.apply(&Command::Undo, 0);
        assert_eq!(s.look.exposure_stops, 2.0);
    }
}
