//! What the window shows, as plain data, and how commands change it.

use super::command::Command;
use super::comparison::{CompareMode, CompareSettings};
use super::environment_list::ListedEnvironment;
use super::export_options::ExportOptions;
use super::footage_reader::FootageView;
use super::keyframed::Keyframed;
use super::layout::{Pane, Workspace};
use super::training::TrainChoice;
use calibration::{Circle, Trial};
use light::Lighting;
use light::keyframes::Keyframes;
use scene::{Background, Effects, Inspection, Output, Scene};
use std::sync::Arc;

/// Stops that the exposure can be set to: beyond them a display shows nothing but black or white.
pub const EXPOSURE_STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// What a difference between two pictures is multiplied with.
pub const GAIN: f32 = 4.0;

/// Magnifications of the fitted picture.
const ZOOM: std::ops::RangeInclusive<f32> = 0.1..=64.0;

/// The settings that can be undone.
#[derive(Clone, Debug, PartialEq)]
pub struct LookSettings {
    /// The list of environments.
    pub environments: Arc<Vec<ListedEnvironment>>,
    /// Entry of the list.
    pub environment: usize,
    /// From −180 (exclusive) to 180 degrees; with keys, their value at the shown frame.
    pub yaw_deg: f32,
    /// Yaws over the frames of the interview.
    pub yaw_keys: Keyframes,
    /// Stops over the frames of the interview; with keys, `lighting` has their value at the shown frame.
    pub intensity_keys: Keyframes,
    pub exposure_stops: f32,
    pub lighting: Lighting,
    pub effects: Effects,
    pub background: Background,
    /// The mirror ball's silhouette where it was set by hand.
    pub circle: Option<Circle>,
    /// The response that is tried by hand.
    pub trial: Option<Trial>,
    /// How to train, where it was chosen by hand.
    pub training: Option<TrainChoice>,
}

impl LookSettings {
    /// Sets the yaw; one that has keys may go around any number of times.
    pub(super) fn turn_to(&mut self, degrees: f32) {
        if !degrees.is_finite() {
            return;
        }
        self.yaw_deg = match self.is_keyed(Keyframed::Yaw) {
            true => degrees,
            false => 180.0 - (180.0 - degrees).rem_euclid(360.0),
        };
    }
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
    pub look: LookSettings,
    pub workspace: Workspace,
    /// The pane that keys are meant for.
    pub active: Pane,
    /// The lamp whose mirror ball is shown; none is the interview's.
    pub photograph: Option<usize>,
    /// The lamp under which the pose in training is shown.
    pub trained_lamp: usize,
    /// The exemplar that is relit as the interview.
    pub pose: usize,
    /// The lamps that the frame is shown under, ascending; none is the light.
    pub solo: Vec<usize>,
    /// Where the wipe between two pictures stands: 0 left, 1 right.
    pub wipe: f32,
    pub compare: CompareSettings,
    /// Number of lamps, once it is known.
    pub lamps: usize,
    /// The pixel that is looked at, in columns and rows.
    pub probed: Option<[usize; 2]>,
    /// What of the footage is looked at.
    pub footage: FootageView,
    /// Shown frame, from 0.
    pub frame: usize,
    /// Frames of the interview.
    pub frames: usize,
    /// Frames per second.
    pub frame_rate: f64,
    pub playing: bool,
    /// What the next export is to be.
    pub export_options: ExportOptions,
    pub view: View,
    pub panels: bool,
    pub full_screen: bool,
    /// The list of keys covers the picture.
    pub keys: bool,
    /// The list of commands is open.
    pub palette: bool,
    undo: Vec<LookSettings>,
    redo: Vec<LookSettings>,
    /// The kind of change that a drag in progress makes: all of it is undone at once.
    dragging: Option<std::mem::Discriminant<Command>>,
}

impl State {
    /// The state of a window that was just opened.
    pub fn new(frames: usize, frame_rate: f64) -> Self {
        Self {
            look: LookSettings {
                environments: Arc::default(),
                environment: 0,
                yaw_deg: 0.0,
                yaw_keys: Keyframes::default(),
                intensity_keys: Keyframes::default(),
                exposure_stops: 0.0,
                lighting: Lighting::default(),
                effects: Effects::default(),
                background: Background::Environment,
                circle: None,
                trial: None,
                training: None,
            },
            workspace: Workspace::default(),
            active: Workspace::default().main()[0],
            photograph: None,
            trained_lamp: 0,
            pose: 0,
            wipe: 0.5,
            compare: CompareSettings::default(),
            solo: Vec::new(),
            lamps: 0,
            probed: None,
            footage: FootageView::default(),
            frame: 0,
            frames,
            frame_rate,
            playing: false,
            export_options: ExportOptions::default(),
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
        if self.compare.on && self.compare.mode == CompareMode::Difference {
            effects.inspection = Inspection::Difference { gain: GAIN };
        }
        Scene {
            frame: self.frame,
            yaw_deg: self.look.front().turned(self.look.yaw_deg),
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

    /// Whether a setting is being dragged.
    pub fn is_dragged(&self) -> bool {
        self.dragging.is_some()
    }

    /// Ends a drag: the next change is a step of its own.
    pub fn release(&mut self) {
        self.dragging = None;
    }

    /// Applies a command as far as it concerns this state. Commands that need files, threads or the window
    /// leave it as it is.
    pub fn apply(&mut self, command: &Command) {
        let mut look = self.look.clone();
        let environments = look.environments.len();
        let last = self.frames.saturating_sub(1);
        match command.clone() {
            Command::Environment(entry) if entry < environments => look.environment = entry,
            Command::StepEnvironment(step) if environments > 0 => {
                let entry = look.environment as isize + step;
                look.environment = entry.rem_euclid(environments as isize) as usize;
            }
            Command::AddEnvironments(files) => look.add(&files),
            Command::RemoveEnvironment(entry) => look.remove(entry),
            Command::Front(entry, front) => look.set_front(entry, front),
            Command::ToggleKey(_)
            | Command::MoveKey { .. }
            | Command::RemoveKey { .. }
            | Command::Interpolate(..) => look.change_keys(command, self.frame),
            Command::Yaw(degrees) => look.turn_to(degrees),
            Command::Turn(degrees) => look.turn_to(look.yaw_deg + degrees),
            Command::Exposure(stops) => look.exposure_stops = exposure(stops, look.exposure_stops),
            Command::StepExposure(stops) => {
                look.exposure_stops = exposure(look.exposure_stops + stops, look.exposure_stops);
            }
            Command::Lighting(lighting) => look.lighting = *lighting,
            Command::Effects(effects) => look.effects = effects.bounded(),
            Command::Background(background) => look.background = background,
            Command::Circle(circle) => look.circle = circle,
            Command::Try(trial) => look.trial = trial,
            Command::Train(choice) => look.training = Some(choice),
            Command::Workspace(workspace) => {
                self.workspace = workspace;
                self.active = workspace.first();
                self.view = FITTED;
            }
            Command::Activate(pane) | Command::Pane(pane) => self.active = pane,
            Command::Order(options) => self.export_options = *options,
            Command::MarkIn => {
                let (_, end) = self.export_options.range(self.frames);
                self.export_options.frames = Some((self.frame, end.max(self.frame)));
            }
            Command::MarkOut => {
                let (start, _) = self.export_options.range(self.frames);
                self.export_options.frames = Some((start.min(self.frame), self.frame));
            }
            Command::Photograph(lamp) => self.photograph = lamp,
            Command::TrainedLamp(lamp) => self.trained_lamp = lamp,
            Command::Pose(pose) => self.pose = pose,
            Command::Solo(lamp) => self.solo = lamp.into_iter().collect(),
            Command::SoloAlso(lamp) => match self.solo.binary_search(&lamp) {
                Ok(place) => drop(self.solo.remove(place)),
                Err(place) => self.solo.insert(place, lamp),
            },
            Command::Wipe(at) if at.is_finite() => self.wipe = at.clamp(0.0, 1.0),
            Command::Compare(compare) => self.compare = compare,
            Command::ToggleWipe => self.compare.toggle_wipe(),
            Command::ToggleSecond => self.compare.toggle_second(),
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
            Command::Footage(view) => self.footage = view,
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
            Command::Frame(frame) => return self.go(frame),
            Command::StepFrame(step) => return self.go(self.frame.saturating_add_signed(step)),
            Command::LastFrame => return self.go(last),
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
    pub fn nudge(&mut self, command: &Command, change: impl FnOnce(&mut LookSettings)) {
        let mut look = self.look.clone();
        change(&mut look);
        self.settle(command, look);
    }

    fn settle(&mut self, command: &Command, mut look: LookSettings) {
        look.note(&self.look, self.frame);
        look.follow(self.frame);
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

    /// Goes on to the next frame, around the end of the range between in and out.
    pub fn advance(&mut self) {
        let (first, last) = self.export_options.range(self.frames);
        let within = (first..last).contains(&self.frame);
        self.frame = if within { self.frame + 1 } else { first };
        self.look.follow(self.frame);
    }

    fn go(&mut self, frame: usize) {
        self.playing = false;
        self.frame = frame.min(self.frames.saturating_sub(1));
        self.look.follow(self.frame);
    }

    fn travel(&mut self, back: bool) {
        let (from, to) = if back {
            (&mut self.undo, &mut self.redo)
        } else {
            (&mut self.redo, &mut self.undo)
        };
        if let Some(look) = from.pop() {
            to.push(std::mem::replace(&mut self.look, look));
            // It may have been left at another frame.
            self.look.follow(self.frame);
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

fn exposure(stops: f32, old: f32) -> f32 {
    if stops.is_nan() {
        old
    } else {
        stops.clamp(*EXPOSURE_STOPS.start(), *EXPOSURE_STOPS.end())
    }
}

#[cfg(test)]
mod tests {
    use super::super::environment_list::Owner;
    use super::*;
    use light::built_in::{self, BuiltIn};
    use light::conventions::Front;
    use worker::Origin;

    fn state() -> State {
        let mut state = State::new(10, 24.0);
        let listed = |own: &'static BuiltIn| ListedEnvironment {
            name: own.title.to_owned(),
            origin: Origin::BuiltIn(own),
            front: None,
            owner: Owner::Program,
        };
        state.look.environments = Arc::new(built_in::all().into_iter().map(listed).collect());
        state
    }

    #[test]
    fn a_drag_is_undone_at_once_and_separate_steps_one_by_one() {
        let mut s = state();
        (1..=30).for_each(|deg| s.apply(&Command::Yaw(deg as f32)));
        s.release();
        s.apply(&Command::StepExposure(0.5));
        s.release();
        s.apply(&Command::StepEnvironment(-1));
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 7)
        );
        s.apply(&Command::Undo);
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 0)
        );
        s.apply(&Command::Undo);
        s.apply(&Command::Undo);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
        (0..3).for_each(|_| s.apply(&Command::Redo));
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 7)
        );
    }

    #[test]
    fn a_change_after_an_undo_forgets_what_was_undone() {
        let mut s = state();
        s.apply(&Command::Yaw(10.0));
        s.apply(&Command::Undo);
        s.apply(&Command::Exposure(1.0));
        assert!(!s.can_redo());
    }

    #[test]
    fn what_changes_nothing_cannot_be_undone() {
        let mut s = state();
        for command in [
            Command::Yaw(0.0),
            Command::Turn(360.0),
            Command::Environment(99),
            Command::StepEnvironment(8),
            Command::RemoveEnvironment(0),
            Command::Front(0, Some(Front::new(90.0))),
            Command::Exposure(f32::NAN),
            Command::Yaw(f32::INFINITY),
            Command::Fit,
            Command::Frame(3),
        ] {
            s.apply(&command);
        }
        assert!(!s.can_undo());
        assert_eq!(s.look, state().look);
    }

    #[test]
    fn angles_and_stops_stay_in_their_ranges() {
        let mut s = state();
        s.apply(&Command::Turn(190.0));
        assert_eq!(s.look.yaw_deg, -170.0);
        s.apply(&Command::Yaw(-180.0));
        assert_eq!(s.look.yaw_deg, 180.0);
        s.apply(&Command::StepExposure(99.0));
        assert_eq!(s.look.exposure_stops, 10.0);
    }

    #[test]
    fn lamps_are_shown_alone_and_together() {
        let mut s = state();
        let lamps = [
            Command::Solo(Some(7)),
            Command::SoloAlso(2),
            Command::SoloAlso(9),
        ];
        lamps.iter().for_each(|command| s.apply(command));
        assert_eq!(s.solo, [2, 7, 9]);
        s.apply(&Command::SoloAlso(7));
        assert_eq!(s.solo, [2, 9]);
        s.apply(&Command::Solo(Some(4)));
        assert_eq!(s.solo, [4]);
        s.apply(&Command::Solo(None));
        assert!(s.solo.is_empty() && !s.can_undo());
    }

    #[test]
    fn frames_stop_at_the_ends_and_playing_goes_around() {
        let mut s = state();
        s.apply(&Command::StepFrame(-1));
        assert_eq!(s.frame, 0);
        s.apply(&Command::LastFrame);
        s.apply(&Command::StepFrame(1));
        assert_eq!(s.frame, 9);
        s.apply(&Command::TogglePlay);
        s.advance();
        assert_eq!((s.frame, s.playing), (0, true));
        s.apply(&Command::Frame(4));
        assert_eq!((s.frame, s.playing), (4, false));
        let mut still = State::new(1, 24.0);
        still.apply(&Command::TogglePlay);
        assert!(!still.playing, "one frame cannot be played");
    }

    #[test]
    fn between_in_and_out_playing_goes_around() {
        let mut s = state();
        for command in [
            Command::Frame(6),
            Command::MarkOut,
            Command::Frame(4),
            Command::MarkIn,
            Command::Frame(8),
        ] {
            s.apply(&command);
        }
        let mut shown = Vec::new();
        for _ in 0..5 {
            s.advance();
            shown.push(s.frame);
        }
        assert_eq!(shown, [4, 5, 6, 4, 5]);
    }

    #[test]
    fn lamps_are_shown_one_after_the_other_and_then_the_environment() {
        let mut s = state();
        s.apply(&Command::StepSolo(1));
        assert!(s.solo.is_empty(), "no lamp is known yet");
        s.lamps = 3;
        for wanted in [&[0][..], &[1], &[2], &[], &[0]] {
            s.apply(&Command::StepSolo(1));
            assert_eq!(s.solo, wanted);
        }
        s.apply(&Command::StepSolo(-1));
        assert!(s.solo.is_empty());
    }

    #[test]
    fn a_channel_is_looked_at_until_it_is_asked_for_again_and_that_can_be_undone() {
        let mut s = state();
        let red = Inspection::Channel(scene::Channel::Red);
        for wanted in [red, Inspection::Picture] {
            s.apply(&Command::Inspect(red));
            s.release();
            assert_eq!(s.look.effects.inspection, wanted);
        }
        s.apply(&Command::Undo);
        assert_eq!(s.look.effects.inspection, red);
    }

    #[test]
    fn what_is_under_the_cursor_stays_there_as_the_picture_is_zoomed() {
        let mut s = state();
        s.apply(&Command::Pan([7.0, -3.0]));
        let about = [120.0, 45.0];
        let under = |v: &View| [0, 1].map(|i| (about[i] - v.pan[i]) / v.zoom);
        let before = under(&s.view);
        s.apply(&Command::Zoom { factor: 2.5, about });
        let after = under(&s.view);
        assert!(
            (0..2).all(|i| (before[i] - after[i]).abs() < 1e-3),
            "{before:?} {after:?}"
        );
        s.apply(&Command::Zoom { factor: 1e9, about });
        assert_eq!(s.view.zoom, 64.0);
        s.apply(&Command::Fit);
        assert_eq!(s.view, FITTED);
    }

    #[test]
    fn resetting_the_view_can_be_undone_where_it_changed_the_exposure() {
        let mut s = state();
        s.apply(&Command::Exposure(2.0));
        s.release();
        s.apply(&Command::ResetView);
        assert_eq!(s.look.exposure_stops, 0.0);
        s.apply(&Command::Undo);
        assert_eq!(s.look.exposure_stops, 2.0);
    }
}
