//! State of the window as plain data, and its changes by commands.

mod added;
mod aiming;
mod covers;
mod panes;
mod playback;
mod review;
mod shoot;
mod view;
mod viewport;

pub use covers::{Covers, Leaving, PathEntry, Wanted};
pub use panes::{Panes, WindowParts};
pub use playback::Playback;
pub use review::ReviewView;
pub use shoot::{LampCounts, ShootView};
pub use view::View;
pub use viewport::{Display, ViewportView};

use super::command::{LookCommand, ViewCommand};
use super::comparison::{CompareMode, CompareSettings};
use super::export_options::ExportOptions;
use super::four_looks::FourLooks;
use super::history::History;
use super::look::LookSettings;
use super::panels::footage::reader::FootageView;
use added::Additions;
use aiming::Aiming;
use light::Lighting;
use project::Project;
use scene::{Background, Channel, Inspection, Scene, Setting};
use std::mem::{Discriminant, discriminant};

/// The window's state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub look: LookSettings,
    /// The solo lamps, ascending; empty for the environment.
    pub solo: Vec<usize>,
    pub lamps: LampCounts,
    /// Current frame, from 0.
    pub frame: usize,
    pub playback: Playback,
    pub panes: Panes,
    pub covers: Covers,
    pub shoot: ShootView,
    /// The visible part of the footage.
    pub footage: FootageView,
    pub review: ReviewView,
    pub compare: CompareSettings,
    /// Looks shown side by side instead of the picture.
    pub four: FourLooks,
    pub viewport: ViewportView,
    pub display: Display,
    /// Filter of the environment list.
    pub search: String,
    /// Options of the next export.
    pub export_options: ExportOptions,
    additions: Additions,
    history: History,
    /// Kind of change of the current drag, which makes a single undo step.
    dragging: Option<(Discriminant<LookCommand>, Option<Setting>)>,
    aiming: Aiming,
}

impl State {
    /// State of a new window on this many frames.
    pub fn new(frames: usize, frame_rate: f64) -> Self {
        Self {
            look: LookSettings::default(),
            solo: Vec::new(),
            lamps: LampCounts::default(),
            frame: 0,
            playback: Playback::new(frames, frame_rate),
            panes: Panes::default(),
            covers: Covers::default(),
            shoot: ShootView::default(),
            footage: FootageView::default(),
            review: ReviewView::default(),
            compare: CompareSettings::default(),
            four: FourLooks::default(),
            viewport: ViewportView::default(),
            display: Display::default(),
            search: String::new(),
            export_options: ExportOptions::default(),
            additions: Additions::default(),
            history: History::default(),
            dragging: None,
            aiming: Aiming::default(),
        }
    }

    /// State of a new window on a project.
    pub fn from_project(project: &Project) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            lamps: LampCounts { rig: 0, shoot: shoot.lamps.len(), photographed: shoot.all_lamps().len() },
            export_options: ExportOptions::from_project(project),
            ..Self::new(shoot.frames.len(), shoot.frame_rate)
        }
    }

    /// The scene of the picture in this state.
    pub fn scene(&self) -> Scene {
        self.scene_of(&self.look)
    }

    /// The scene of another look at the same frame, with the same viewing settings.
    pub fn scene_of(&self, look: &LookSettings) -> Scene {
        let mut effects = look.effects;
        effects.inspection = self.shown_inspection();
        let mut scene = look.shown.scene(self.frame);
        if effects.inspection == Inspection::Channel(Channel::Alpha) {
            // A background covers everything: the matte is shown without it.
            scene.background = Background::None;
        }
        Scene {
            yaw_deg: look.front().turned(look.yaw_deg),
            effects,
            viewing: self.display.viewing.clone().bounded(),
            ..scene
        }
    }

    /// Image shown instead of the picture: a difference has priority over a channel.
    pub fn shown_inspection(&self) -> Inspection {
        let compares = self.compare.on && !self.four.on;
        if compares && self.compare.mode == CompareMode::Difference {
            Inspection::Difference { gain: self.display.gain }
        } else {
            self.display.inspection
        }
    }

    /// First and last frame to play and export.
    pub fn range(&self) -> (usize, usize) {
        self.look.range_of(self.playback.frames)
    }

    /// Numbers of the first and last exported file.
    pub fn numbers(&self) -> (i64, i64) {
        let start = self.export_options.first_number.unwrap_or(self.playback.first_number);
        let (first, last) = self.range();
        (start + first as i64, start + last as i64)
    }

    /// Number of frame `frame` in the name of the interview's file; None if the numbers start at 0.
    pub fn plate_number(&self, frame: usize) -> Option<i64> {
        (self.playback.first_number != 0).then(|| self.playback.first_number + frame as i64)
    }

    pub fn can_undo(&self) -> bool {
        !self.history.undo.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.history.redo.is_empty()
    }

    /// Looks for undo and for redo, the nearest last.
    pub(crate) fn history(&self) -> [&[LookSettings]; 2] {
        [&self.history.undo, &self.history.redo]
    }

    /// Restores the steps of an earlier session.
    pub(crate) fn remember(&mut self, history: History) {
        self.history = history;
    }

    /// True during the drag of a setting.
    pub fn is_dragged(&self) -> bool {
        self.dragging.is_some()
    }

    /// Ends a drag: the next change is a new step.
    pub fn release(&mut self) {
        self.dragging = None;
    }

    /// Changes the settings. A drag makes a single undo step; a change without effect makes none.
    ///
    /// Ends [`Self::solo`] if the change would be invisible under solo lamps: another environment or stored look, a
    /// rotation, another light.
    pub fn change(&mut self, command: LookCommand) {
        let before = (self.look.environment, self.light());
        let light = self.place_of_chosen();
        let chosen = matches!(command, LookCommand::Environment(_) | LookCommand::Aim(_) | LookCommand::Apply { .. });
        let lit_by = before.0;
        let list = match command {
            LookCommand::AddEnvironments(_) | LookCommand::TryEnvironment(_) | LookCommand::Apply { .. } => {
                Some(self.look.environments.clone())
            }
            _ => None,
        };
        self.set(command);
        self.unfold_chosen(light);
        if let Some(list) = list {
            self.note_added(&list, lit_by);
        }
        if chosen || (self.look.environment, self.light()) != before {
            self.solo.clear();
        }
        if chosen || self.look.environment != lit_by {
            // Such a change is invisible beside the truth.
            self.show(ViewCommand::Cell(None));
        }
    }

    /// Light on the subject apart from the environment's panorama: its rotation and everything else.
    fn light(&self) -> (f32, Option<Lighting>) {
        // Only relevant under solo lamps.
        let alone = !self.solo.is_empty();
        (self.look.yaw_deg, alone.then(|| self.look.lighting.clone()))
    }

    fn set(&mut self, command: LookCommand) {
        let setting = match &command {
            LookCommand::Set(setting, _) => Some(*setting),
            _ => None,
        };
        let kind = (discriminant(&command), setting);
        let mut look = self.look.clone();
        let tried = self.additions.tried.take();
        match command {
            LookCommand::Undo => return self.travel(true),
            LookCommand::Redo => return self.travel(false),
            LookCommand::Environment(entry) => {
                look.light_by(entry);
                // Such a change is invisible under solo lights.
                look.lighting.clear_solo();
            }
            LookCommand::AddEnvironments(files) => {
                look.add(&files);
                if look.environment != self.look.environment {
                    look.lighting.clear_solo();
                }
            }
            LookCommand::TryEnvironment(file) => {
                let shown = look.environments.get(look.environment);
                if shown.is_some_and(|one| Some(&one.origin) == tried.as_ref()) {
                    look.remove(look.environment);
                }
                let count = look.environments.len();
                look.add(&[file]);
                look.lighting.clear_solo();
                let new = look.environments.get(count);
                self.additions.tried = new.map(|listed| listed.origin.clone());
            }
            LookCommand::RemoveEnvironment(entry) => look.remove(entry),
            LookCommand::Front(entry, front) => look.set_front(entry, front),
            LookCommand::Apply { look: stored, exists } => {
                look.show_stored(&stored, exists);
                // The current value of an animated setting is not a change that sets a key.
                look.follow(self.frame);
            }
            LookCommand::ToggleKey(of) => look.toggle_key(of, self.frame),
            LookCommand::Keys(lanes) => look.set_lanes(lanes),
            LookCommand::Set(setting, value) => look.set(setting, value),
            LookCommand::Turn(degrees) => look.set(Setting::Yaw, look.yaw_deg + degrees),
            LookCommand::Lighting(lighting) => {
                look.lighting = *lighting;
                look.unwind();
            }
            LookCommand::AddLight(copied) => look.add_light(*copied),
            LookCommand::Aim(aimed) => return self.aim(aimed),
            LookCommand::Effects(effects) => look.effects = effects.bounded(),
            LookCommand::Background(background) => look.background = background.bounded(),
            LookCommand::Circle(circle) => look.circle = circle,
            LookCommand::Trial(trial) => look.trial = trial,
            LookCommand::Range(range) => look.set_range(range, self.playback.frames),
            LookCommand::Training(choice) => look.training = Some(choice),
            LookCommand::Reset(group) => look.restore(group),
        }
        look.number_lights();
        look.set_keys(&self.look, self.frame);
        look.follow(self.frame);
        if look != self.look {
            if self.dragging != Some(kind) {
                self.history.push(self.look.clone());
                self.dragging = Some(kind);
            }
            self.look = look;
            self.aiming.end();
        }
    }

    fn travel(&mut self, back: bool) {
        if self.history.travel(back, &mut self.look) {
            // The restored look may date from another frame.
            self.look.follow(self.frame);
        }
        self.aiming.end();
        self.dragging = None;
    }
}

#[cfg(test)]
mod tests {
    use super::super::environment_list::{ListedEnvironment, Owner};
    use super::*;
    use light::built_in::{self, BuiltIn};
    use light::conventions::Front;
    use std::sync::Arc;
    use worker::Origin;

    pub(super) fn state() -> State {
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
        (1..=30).for_each(|deg| s.change(LookCommand::Set(Setting::Yaw, deg as f32)));
        s.release();
        s.change(LookCommand::Set(Setting::Exposure, 0.5));
        s.release();
        s.change(LookCommand::Environment(7));
        assert_eq!((s.look.yaw_deg, s.look.exposure_stops, s.look.environment), (30.0, 0.5, 7));
        s.change(LookCommand::Undo);
        assert_eq!((s.look.yaw_deg, s.look.exposure_stops, s.look.environment), (30.0, 0.5, 0));
        s.change(LookCommand::Undo);
        s.change(LookCommand::Undo);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
        (0..3).for_each(|_| s.change(LookCommand::Redo));
        assert_eq!((s.look.yaw_deg, s.look.exposure_stops, s.look.environment), (30.0, 0.5, 7));
    }

    #[test]
    fn a_change_after_an_undo_forgets_what_was_undone() {
        let mut s = state();
        s.change(LookCommand::Set(Setting::Yaw, 10.0));
        s.change(LookCommand::Undo);
        s.change(LookCommand::Set(Setting::Exposure, 1.0));
        assert!(!s.can_redo());
    }

    #[test]
    fn what_changes_nothing_cannot_be_undone() {
        let mut s = state();
        for command in [
            LookCommand::Set(Setting::Yaw, 0.0),
            LookCommand::Turn(360.0),
            LookCommand::Environment(99),
            LookCommand::RemoveEnvironment(0),
            LookCommand::Front(0, Some(Front::new(90.0))),
            LookCommand::Set(Setting::Exposure, f32::NAN),
            LookCommand::Set(Setting::Yaw, f32::INFINITY),
        ] {
            s.change(command);
        }
        s.show(ViewCommand::Fit);
        s.show(ViewCommand::Frame(3));
        assert!(!s.can_undo());
        assert_eq!(s.look, state().look);
    }

    #[test]
    fn angles_and_stops_stay_in_their_ranges() {
        let mut s = state();
        s.change(LookCommand::Turn(190.0));
        assert_eq!(s.look.yaw_deg, -170.0);
        s.change(LookCommand::Set(Setting::Yaw, -180.0));
        assert_eq!(s.look.yaw_deg, 180.0);
        s.change(LookCommand::Set(Setting::Exposure, 99.0));
        assert_eq!(s.look.exposure_stops, 10.0);
    }

    #[test]
    fn what_is_not_seen_under_a_lamp_alone_ends_that_and_what_is_seen_does_not() {
        let mut s = state();
        let lit = |s: &State, intensity_stops: f32| {
            LookCommand::Lighting(Box::new(Lighting { intensity_stops, ..s.look.lighting.clone() }))
        };
        let ends = |s: &mut State, command: LookCommand| {
            s.show(ViewCommand::Solo(Some(4)));
            s.change(command);
            s.release();
            s.solo.is_empty()
        };
        let brighter = lit(&s, 1.0);
        assert!(ends(&mut s, brighter));
        assert!(ends(&mut s, LookCommand::Turn(10.0)));
        assert!(ends(&mut s, LookCommand::Environment(0)));
        assert!(ends(&mut s, LookCommand::Undo), "the rotation is undone");
        assert!(!ends(&mut s, LookCommand::Set(Setting::Exposure, 0.5)));
        let same = lit(&s, 1.0);
        assert!(!ends(&mut s, same), "there was no change");
    }

    #[test]
    fn another_environment_ends_the_solo_of_lights_as_one_step() {
        let mut s = state();
        let mut lighting = Lighting::default();
        lighting.placed.push(lighting.another_light());
        lighting.placed[0].solo = true;
        s.change(LookCommand::Lighting(Box::new(lighting)));
        s.release();
        s.change(LookCommand::Environment(3));
        assert_eq!((s.look.environment, s.look.lighting.is_solo()), (3, false));
        s.change(LookCommand::Undo);
        assert_eq!((s.look.environment, s.look.lighting.is_solo()), (0, true));
    }

    #[test]
    fn a_difference_is_shown_by_the_chosen_gain_and_that_is_no_setting_of_the_look() {
        let mut s = state();
        s.show(ViewCommand::Compare(CompareSettings {
            on: true,
            mode: CompareMode::Difference,
            ..CompareSettings::default()
        }));
        let shown = |s: &State| s.scene().effects.inspection;
        assert_eq!(shown(&s), Inspection::Difference { gain: 4.0 });
        s.show(ViewCommand::Gain(16.0));
        assert_eq!(shown(&s), Inspection::Difference { gain: 16.0 });
        for none in [0.0, 3.0, f32::NAN, f32::INFINITY] {
            s.show(ViewCommand::Gain(none));
            assert_eq!(s.display.gain, 16.0);
        }
        assert!(!s.can_undo());
        assert_eq!(s.look, state().look);
    }
}
