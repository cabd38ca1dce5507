//! What the window shows, as plain data, and how commands change it.

use super::command::{AimedLight, Dialog, LookCommand, ViewCommand};
use super::comparison::{CellPicture, CompareMode, CompareSettings, GAINS};
use super::export_options::ExportOptions;
use super::footage_reader::FootageView;
use super::four_looks::FourLooks;
use super::layout::{Pane, Workspace};
use super::look::LookSettings;
use super::region::Region;
use super::saved_history::History;
use evaluation::review::Metric;
use project::Project;
use scene::{Inspection, Output, Scene};
use std::mem::{Discriminant, discriminant, replace};
use worker::Origin;

/// Magnifications of the fitted picture.
const ZOOM: std::ops::RangeInclusive<f32> = 0.1..=64.0;

/// Where the picture is in the viewport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// 1 fits the picture into the viewport.
    pub zoom: f32,
    /// Offset of the picture's centre from the viewport's, in points.
    pub pan: [f32; 2],
}

impl View {
    /// The picture fills the viewport.
    pub(super) const FITTED: Self = Self {
        zoom: 1.0,
        pan: [0.0; 2],
    };
}

/// What can be chosen in a file dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    Folder,
    Files,
    /// A file to write, which need not be there.
    NewFile,
}

/// The field for a path that is open beside a file dialog.
#[derive(Clone, Debug, PartialEq)]
pub struct PathEntry {
    pub dialog: Dialog,
    pub title: &'static str,
    pub wanted: Wanted,
    /// What the field begins with.
    pub begun: String,
    /// Why the system shows no dialog, if it does not.
    pub missing: Option<String>,
}

/// A panorama that was added, and what was shown before.
#[derive(Clone, Debug, PartialEq)]
struct Added {
    origin: Origin,
    before: Option<Origin>,
}

/// The window's state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub look: LookSettings,
    pub workspace: Workspace,
    /// The pane that keys go to.
    pub active: Pane,
    /// The lamp whose mirror ball is shown; None for the interview's light.
    pub photograph: Option<usize>,
    /// The lamp under which the pose in training is shown.
    pub trained_lamp: usize,
    /// The exemplar that is relit as the interview.
    pub pose: usize,
    /// The lamps that the frame is shown under, ascending; empty for the environment.
    pub solo: Vec<usize>,
    /// The measured frame or pose and lamp that are shown beside the truth: indices in the review.
    pub cell: Option<(usize, usize)>,
    /// The cell that was chosen last: indices in the review.
    pub chosen: Option<(usize, usize)>,
    /// The picture of a cell that is shown alone; None for all three.
    pub enlarged: Option<CellPicture>,
    /// What measured cells are ordered by.
    pub metric: Metric,
    /// What differences are multiplied by: one of [`GAINS`].
    pub gain: f32,
    /// Where the wipe between two pictures is: 0 left, 1 right.
    pub wipe: f32,
    pub compare: CompareSettings,
    /// Looks that are shown side by side in place of the picture.
    pub four: FourLooks,
    /// What the list of environments is filtered by.
    pub search: String,
    /// Where errors are expected lies over the picture.
    pub doubts: bool,
    /// A press on the picture places a light.
    pub aims: bool,
    /// The light placed by hand that was chosen last, by its index; see [`Self::chosen_light`].
    light: Option<usize>,
    /// Number of the rig's lamps, once it is known.
    pub lamps: usize,
    /// Lamps of the shoot that the network is trained with.
    shoot_lamps: usize,
    /// Lamps of the shoot with a photograph of the mirror ball.
    photographed_lamps: usize,
    /// The pixel whose values are read, in columns and rows.
    pub probed: Option<[usize; 2]>,
    /// The part of the picture whose means are read.
    pub region: Option<Region>,
    /// What of the footage is shown.
    pub footage: FootageView,
    /// Current frame, from 0.
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
    /// What this machine can do lies over the window.
    pub machine: bool,
    /// The field for a path, while a file dialog is open or missing.
    pub path: Option<PathEntry>,
    /// What a close that was asked for would end, a sentence each; empty unless the question is open.
    pub closing: Vec<String>,
    /// Panoramas that were added since the window was opened.
    added: Vec<Added>,
    undo: Vec<LookSettings>,
    redo: Vec<LookSettings>,
    /// The kind of change that a drag makes: all of it is undone at once.
    dragging: Option<Discriminant<LookCommand>>,
    /// How often a press began to place a light, and for which of them a light was placed.
    aim_drag: u64,
    placed_for: u64,
    /// The light that the newest step of undo has placed, and its index.
    aimed: Option<(AimedLight, usize)>,
}

impl State {
    /// The state of a window that was just opened on so many frames.
    pub fn new(frames: usize, frame_rate: f64) -> Self {
        Self {
            look: LookSettings::default(),
            workspace: Workspace::default(),
            active: Workspace::default().main()[0],
            photograph: None,
            trained_lamp: 0,
            pose: 0,
            cell: None,
            chosen: None,
            enlarged: None,
            metric: Metric::default(),
            gain: GAINS[2],
            wipe: 0.5,
            compare: CompareSettings::default(),
            four: FourLooks::default(),
            search: String::new(),
            doubts: false,
            aims: false,
            light: None,
            solo: Vec::new(),
            lamps: 0,
            shoot_lamps: 0,
            photographed_lamps: 0,
            probed: None,
            region: None,
            footage: FootageView::default(),
            frame: 0,
            frames,
            frame_rate,
            playing: false,
            export_options: ExportOptions::default(),
            view: View::FITTED,
            panels: true,
            full_screen: false,
            keys: false,
            palette: false,
            machine: false,
            path: None,
            closing: Vec::new(),
            added: Vec::new(),
            undo: Vec::new(),
            redo: Vec::new(),
            dragging: None,
            aim_drag: 0,
            placed_for: 0,
            aimed: None,
        }
    }

    /// The state of a window that was just opened on a project.
    pub fn of(project: &Project) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            shoot_lamps: shoot.lamps.len(),
            photographed_lamps: shoot.all_lamps().len(),
            export_options: ExportOptions::of(project),
            ..Self::new(shoot.frames.len(), shoot.frame_rate)
        }
    }

    /// The picture that this state asks for.
    pub fn scene(&self) -> Scene {
        self.scene_of(&self.look)
    }

    /// The picture of a look that stands at the same frame, seen as this state shows pictures.
    pub fn scene_of(&self, look: &LookSettings) -> Scene {
        let mut effects = look.effects;
        let compares = self.compare.on && !self.four.on;
        if compares && self.compare.mode == CompareMode::Difference {
            effects.inspection = Inspection::Difference { gain: self.gain };
        }
        Scene {
            frame: self.frame,
            yaw_deg: look.front().turned(look.yaw_deg),
            lighting: look.lighting.clone(),
            effects,
            exposure_stops: look.exposure_stops,
            background: look.background,
            output: Output::Display,
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// The looks that can be undone and redone, the nearest last.
    pub(crate) fn history(&self) -> [&[LookSettings]; 2] {
        [&self.undo, &self.redo]
    }

    /// Takes over the steps of a session before.
    pub(crate) fn remember(&mut self, history: History) {
        (self.undo, self.redo) = (history.undo, history.redo);
    }

    /// The light placed by hand that was chosen last, by its index, if it is still there.
    pub fn chosen_light(&self) -> Option<usize> {
        let lights = self.look.lighting.placed.len();
        self.light.filter(|&light| light < lights)
    }

    /// Begins to place another light.
    pub fn begin_aim(&mut self) {
        self.aim_drag += 1;
    }

    /// Number of the drag that places a light.
    pub fn aim_drag(&self) -> u64 {
        self.aim_drag
    }

    /// Where on the picture of a frame the light falls that was placed last, if nothing was changed since.
    pub fn aimed_at(&self, frame: usize) -> Option<[usize; 2]> {
        let (aimed, _) = self.aimed.as_ref()?;
        (aimed.frame == frame).then_some(aimed.pixel)
    }

    /// Whether a setting is being dragged.
    pub fn is_dragged(&self) -> bool {
        self.dragging.is_some()
    }

    /// Ends a drag: the next change is a step of its own.
    pub fn release(&mut self) {
        self.dragging = None;
    }

    /// Changes the settings. What a drag changes is one step of undo, and what changes nothing is none.
    ///
    /// Another environment ends [`Self::solo`], and so does a light: it would change nothing that is seen.
    pub fn change(&mut self, command: LookCommand) {
        let lit_by = self.look.environment;
        let chosen = matches!(
            command,
            LookCommand::Environment(_) | LookCommand::Aim(_) | LookCommand::Apply(_)
        );
        let list = match command {
            LookCommand::AddEnvironments(_) | LookCommand::Apply(_) => {
                Some(self.look.environments.clone())
            }
            _ => None,
        };
        self.set(command);
        if let Some(list) = list {
            let before = list.get(lit_by).map(|listed| listed.origin.clone());
            let new = self.look.environments.iter().skip(list.len());
            self.added.extend(new.map(|listed| Added {
                origin: listed.origin.clone(),
                before: before.clone(),
            }));
        }
        if chosen || self.look.environment != lit_by {
            self.solo.clear();
        }
    }

    fn set(&mut self, command: LookCommand) {
        let kind = discriminant(&command);
        let mut look = self.look.clone();
        match command {
            LookCommand::Undo => return self.travel(true),
            LookCommand::Redo => return self.travel(false),
            LookCommand::ResetView => {
                self.view = View::FITTED;
                look.exposure_stops = 0.0;
            }
            LookCommand::Environment(entry) => look.light_by(entry),
            LookCommand::StepEnvironment(step) => look.step_environment(step),
            LookCommand::AddEnvironments(files) => look.add(&files),
            LookCommand::RemoveEnvironment(entry) => look.remove(entry),
            LookCommand::Front(entry, front) => look.set_front(entry, front),
            LookCommand::Apply(applied) => {
                look.show_stored(&applied);
                // The present value of what has keys is no change that sets one.
                look.follow(self.frame);
            }
            LookCommand::ToggleKey(of) => look.toggle_key(of, self.frame),
            LookCommand::MoveKey { of, index, frame } => look.move_key(of, index, frame),
            LookCommand::RemoveKey { of, index } => look.remove_key(of, index),
            LookCommand::Interpolate(of, interpolation) => look.interpolate(of, interpolation),
            LookCommand::Yaw(degrees) => look.turn_to(degrees),
            LookCommand::Turn(degrees) => look.turn_to(look.yaw_deg + degrees),
            LookCommand::Exposure(stops) => look.expose(stops),
            LookCommand::StepExposure(stops) => look.expose(look.exposure_stops + stops),
            LookCommand::Lighting(lighting) => look.lighting = *lighting,
            LookCommand::Aim(aimed) => return self.aim(aimed),
            LookCommand::Effects(effects) => look.effects = effects.bounded(),
            LookCommand::Background(background) => look.background = background,
            LookCommand::Inspect(inspection) => look.inspect(inspection),
            LookCommand::Circle(circle) => look.circle = circle,
            LookCommand::Trial(trial) => look.trial = trial,
            LookCommand::Training(choice) => look.training = Some(choice),
            LookCommand::Reset(group) => look.restore(group),
        }
        look.set_keys(&self.look, self.frame);
        look.follow(self.frame);
        if look != self.look {
            if self.dragging != Some(kind) {
                self.undo.push(self.look.clone());
                self.dragging = Some(kind);
            }
            self.redo.clear();
            self.look = look;
            self.aimed = None;
        }
    }

    /// Places a light, or moves the one that the same drag has placed. What was asked for before something else was changed or
    /// undone comes too late.
    fn aim(&mut self, aimed: AimedLight) {
        let same = self.aimed.filter(|(last, _)| last.drag == aimed.drag);
        let index = match same {
            Some((_, index)) => index,
            None if aimed.drag <= self.placed_for => return,
            None => {
                self.undo.push(self.look.clone());
                let lighting = &mut self.look.lighting;
                lighting.placed.push(lighting.another_light());
                lighting.placed.len() - 1
            }
        };
        if let Some(light) = self.look.lighting.placed.get_mut(index) {
            *light = light.clone().towards(aimed.direction);
        }
        self.redo.clear();
        self.placed_for = aimed.drag;
        self.aimed = Some((aimed, index));
        self.light = Some(index);
        self.dragging = Some(discriminant(&LookCommand::Aim(aimed)));
    }

    /// Takes a panorama out of the list that was added since the window was opened and cannot be read, and shows the one that
    /// was shown before. Returns whether it was such a one.
    pub fn withdraw(&mut self, origin: &Origin) -> bool {
        let Some(added) = self.added.iter().position(|added| added.origin == *origin) else {
            return false;
        };
        let before = self.added.remove(added).before;
        let lists = self.undo.iter_mut().chain(&mut self.redo);
        for look in lists.chain([&mut self.look]) {
            let place = |look: &LookSettings, of: &Origin| {
                let mut list = look.environments.iter();
                list.position(|listed| listed.origin == *of)
            };
            if let Some(at) = place(look, origin) {
                let is_shown = look.environment == at;
                look.remove(at);
                if let Some(before) = before.as_ref().filter(|_| is_shown) {
                    look.environment = place(look, before).unwrap_or(look.environment);
                }
            }
        }
        // Nothing is left to undo of the addition.
        while self.undo.last() == Some(&self.look) {
            self.undo.pop();
        }
        true
    }

    /// Changes what is shown.
    ///
    /// What asks for another frame or lamp ends [`Self::cell`].
    pub fn show(&mut self, command: ViewCommand) {
        use ViewCommand::{Frame, LastFrame, Solo, SoloAlso, StepFrame, StepSolo, TogglePlay};
        if matches!(
            command,
            Frame(_) | StepFrame(_) | LastFrame | TogglePlay | Solo(_) | SoloAlso(_) | StepSolo(_)
        ) {
            self.cell = None;
        }
        match command {
            ViewCommand::Cell(cell) => {
                self.cell = cell;
                match cell {
                    Some(_) => self.chosen = cell,
                    None => self.enlarged = None,
                }
            }
            ViewCommand::Enlarge(picture) => self.enlarged = picture,
            ViewCommand::FlipCell => self.enlarged = Some(CellPicture::flipped(self.enlarged)),
            ViewCommand::Metric(metric) => self.metric = metric,
            ViewCommand::Gain(gain) if GAINS.contains(&gain) => self.gain = gain,
            ViewCommand::Gain(_) => {}
            ViewCommand::Photograph(lamp) => self.photograph = lamp,
            ViewCommand::StepPhotograph(step) => {
                self.photograph = next(self.photograph, step, self.photographed_lamps);
            }
            ViewCommand::TrainedLamp(lamp) => self.trained_lamp = lamp,
            ViewCommand::StepTrainedLamp(step) => {
                let lamps = self.shoot_lamps.max(1) as isize;
                self.trained_lamp = (self.trained_lamp as isize + step).rem_euclid(lamps) as usize;
            }
            ViewCommand::Pose(pose) => self.pose = pose,
            ViewCommand::Wipe(at) => self.wipe_at(at),
            ViewCommand::StepWipe => {
                self.wipe = match self.wipe {
                    at if at <= 0.0 => 0.5,
                    at if at >= 1.0 => 0.0,
                    _ => 1.0,
                }
            }
            ViewCommand::Compare(compare) => self.compare = compare,
            ViewCommand::ToggleWipe => self.compare.toggle_wipe(),
            ViewCommand::ToggleDoubts => self.doubts = !self.doubts,
            ViewCommand::ToggleSecond => self.compare.toggle_second(),
            ViewCommand::Solo(lamp) => self.solo = lamp.into_iter().collect(),
            ViewCommand::SoloAlso(lamp) => match self.solo.binary_search(&lamp) {
                Ok(place) => drop(self.solo.remove(place)),
                Err(place) => self.solo.insert(place, lamp),
            },
            ViewCommand::StepSolo(step) => {
                let lamp = next(self.solo.first().copied(), step, self.lamps);
                self.solo = lamp.into_iter().collect();
            }
            ViewCommand::ChooseLight(light) => self.light = light,
            ViewCommand::Pixel(pixel) => self.probed = pixel,
            ViewCommand::Region(region) => self.region = region,
            ViewCommand::Footage(view) => self.footage = view,
            ViewCommand::Frame(frame) => self.go(frame),
            ViewCommand::StepFrame(step) => self.go(self.frame.saturating_add_signed(step)),
            ViewCommand::LastFrame => self.go(usize::MAX),
            ViewCommand::TogglePlay => self.playing = !self.playing && self.frames > 1,
            ViewCommand::MarkIn => {
                let (_, end) = self.export_options.range(self.frames);
                self.export_options.frames = Some((self.frame, end.max(self.frame)));
            }
            ViewCommand::MarkOut => {
                let (start, _) = self.export_options.range(self.frames);
                self.export_options.frames = Some((start.min(self.frame), self.frame));
            }
            ViewCommand::Zoom { factor, about } => self.zoom(factor, about),
            ViewCommand::Pan([x, y]) => {
                self.view.pan = [self.view.pan[0] + x, self.view.pan[1] + y];
            }
            ViewCommand::Fit => self.view = View::FITTED,
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
            to.push(replace(&mut self.look, look));
            // It may have been left at another frame.
            self.look.follow(self.frame);
        }
        self.aimed = None;
        self.dragging = None;
    }

    fn wipe_at(&mut self, at: f32) {
        if at.is_finite() {
            self.wipe = at.clamp(0.0, 1.0);
        }
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

/// The lamp `step` places after `lamp`, around the end of `count` lamps; None, the environment or the interview's
/// light, comes before the first.
fn next(lamp: Option<usize>, step: isize, count: usize) -> Option<usize> {
    let place = lamp.map_or(0, |lamp| lamp + 1) as isize + step;
    (place.rem_euclid(count as isize + 1) as usize).checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::super::environment_list::{ListedEnvironment, Owner};
    use super::*;
    use light::built_in::{self, BuiltIn};
    use light::conventions::Front;
    use std::sync::Arc;
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
        (1..=30).for_each(|deg| s.change(LookCommand::Yaw(deg as f32)));
        s.release();
        s.change(LookCommand::StepExposure(0.5));
        s.release();
        s.change(LookCommand::StepEnvironment(-1));
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 7)
        );
        s.change(LookCommand::Undo);
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 0)
        );
        s.change(LookCommand::Undo);
        s.change(LookCommand::Undo);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
        (0..3).for_each(|_| s.change(LookCommand::Redo));
        assert_eq!(
            (s.look.yaw_deg, s.look.exposure_stops, s.look.environment),
            (30.0, 0.5, 7)
        );
    }

    #[test]
    fn a_change_after_an_undo_forgets_what_was_undone() {
        let mut s = state();
        s.change(LookCommand::Yaw(10.0));
        s.change(LookCommand::Undo);
        s.change(LookCommand::Exposure(1.0));
        assert!(!s.can_redo());
    }

    #[test]
    fn what_changes_nothing_cannot_be_undone() {
        let mut s = state();
        for command in [
            LookCommand::Yaw(0.0),
            LookCommand::Turn(360.0),
            LookCommand::Environment(99),
            LookCommand::StepEnvironment(8),
            LookCommand::RemoveEnvironment(0),
            LookCommand::Front(0, Some(Front::new(90.0))),
            LookCommand::Exposure(f32::NAN),
            LookCommand::Yaw(f32::INFINITY),
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
        s.change(LookCommand::Yaw(-180.0));
        assert_eq!(s.look.yaw_deg, 180.0);
        s.change(LookCommand::StepExposure(99.0));
        assert_eq!(s.look.exposure_stops, 10.0);
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
            assert_eq!(s.gain, 16.0);
        }
        assert!(!s.can_undo());
        assert_eq!(s.look, state().look);
    }

    #[test]
    fn a_cell_s_pictures_are_flipped_and_stay_large_from_cell_to_cell() {
        let mut s = state();
        s.show(ViewCommand::Cell(Some((0, 1))));
        let mut flip = |from| {
            s.show(ViewCommand::Enlarge(from));
            s.show(ViewCommand::FlipCell);
            s.enlarged
        };
        assert_eq!(flip(None), Some(CellPicture::Prediction));
        assert_eq!(
            flip(Some(CellPicture::Difference)),
            Some(CellPicture::Prediction)
        );
        assert_eq!(
            flip(Some(CellPicture::Truth)),
            Some(CellPicture::Prediction)
        );
        assert_eq!(
            flip(Some(CellPicture::Prediction)),
            Some(CellPicture::Truth)
        );
        s.show(ViewCommand::Frame(3));
        s.show(ViewCommand::Cell(Some((2, 1))));
        assert_eq!(
            (s.chosen, s.enlarged),
            (Some((2, 1)), Some(CellPicture::Truth))
        );
        s.show(ViewCommand::Cell(None));
        assert_eq!((s.chosen, s.enlarged), (Some((2, 1)), None));
    }

    #[test]
    fn lamps_are_shown_alone_and_together() {
        let mut s = state();
        let lamps = [
            ViewCommand::Solo(Some(7)),
            ViewCommand::SoloAlso(2),
            ViewCommand::SoloAlso(9),
        ];
        lamps.into_iter().for_each(|command| s.show(command));
        assert_eq!(s.solo, [2, 7, 9]);
        s.show(ViewCommand::SoloAlso(7));
        assert_eq!(s.solo, [2, 9]);
        s.show(ViewCommand::Solo(Some(4)));
        assert_eq!(s.solo, [4]);
        s.show(ViewCommand::Solo(None));
        assert!(s.solo.is_empty() && !s.can_undo());
    }

    fn aimed(drag: u64, direction: glam::Vec3) -> LookCommand {
        LookCommand::Aim(AimedLight {
            drag,
            frame: 3,
            pixel: [drag as usize, 2],
            direction,
        })
    }

    #[test]
    fn a_light_follows_its_drag_and_all_of_that_is_undone_at_once() {
        use glam::Vec3;
        let mut s = state();
        s.show(ViewCommand::Solo(Some(4)));
        s.begin_aim();
        s.change(aimed(1, Vec3::Z));
        assert!(s.solo.is_empty() && s.is_dragged());
        s.change(aimed(1, Vec3::X));
        // The last answer may come after the pointer was released.
        s.release();
        s.change(aimed(1, Vec3::NEG_X));
        s.release();
        assert_eq!(s.look.lighting.placed.len(), 1);
        assert_eq!(s.look.lighting.placed[0].yaw_deg, -90.0);
        assert_eq!(
            (s.chosen_light(), s.aimed_at(3), s.aimed_at(4)),
            (Some(0), Some([1, 2]), None)
        );
        s.begin_aim();
        s.change(aimed(2, Vec3::Z));
        assert_eq!(
            (s.look.lighting.placed.len(), s.chosen_light()),
            (2, Some(1))
        );
        s.change(LookCommand::Undo);
        assert_eq!((s.look.lighting.placed.len(), s.chosen_light()), (1, None));
        s.change(LookCommand::Undo);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
    }

    #[test]
    fn what_a_drag_asked_for_before_it_was_undone_comes_too_late() {
        use glam::Vec3;
        let mut s = state();
        s.begin_aim();
        s.change(aimed(1, Vec3::Z));
        s.change(LookCommand::Undo);
        s.change(aimed(1, Vec3::X));
        assert!(s.look.lighting.placed.is_empty() && s.can_redo());
        s.begin_aim();
        s.change(aimed(2, Vec3::Z));
        s.change(LookCommand::StepExposure(0.5));
        s.change(aimed(2, Vec3::X));
        assert_eq!(
            s.look.lighting.placed[0].yaw_deg, 180.0,
            "another change ended the drag"
        );
    }

    #[test]
    fn frames_stop_at_the_ends_and_playing_goes_around() {
        let mut s = state();
        s.show(ViewCommand::StepFrame(-1));
        assert_eq!(s.frame, 0);
        s.show(ViewCommand::LastFrame);
        s.show(ViewCommand::StepFrame(1));
        assert_eq!(s.frame, 9);
        s.show(ViewCommand::TogglePlay);
        s.advance();
        assert_eq!((s.frame, s.playing), (0, true));
        s.show(ViewCommand::Frame(4));
        assert_eq!((s.frame, s.playing), (4, false));
        let mut still = State::new(1, 24.0);
        still.show(ViewCommand::TogglePlay);
        assert!(!still.playing, "one frame cannot be played");
    }

    #[test]
    fn between_in_and_out_playing_goes_around() {
        let mut s = state();
        for command in [
            ViewCommand::Frame(6),
            ViewCommand::MarkOut,
            ViewCommand::Frame(4),
            ViewCommand::MarkIn,
            ViewCommand::Frame(8),
        ] {
            s.show(command);
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
        s.show(ViewCommand::StepSolo(1));
        assert!(s.solo.is_empty(), "no lamp is known yet");
        s.lamps = 3;
        for wanted in [&[0][..], &[1], &[2], &[], &[0]] {
            s.show(ViewCommand::StepSolo(1));
            assert_eq!(s.solo, wanted);
        }
        s.show(ViewCommand::StepSolo(-1));
        assert!(s.solo.is_empty());
    }

    #[test]
    fn a_channel_is_looked_at_until_it_is_asked_for_again_and_that_can_be_undone() {
        let mut s = state();
        let red = Inspection::Channel(scene::Channel::Red);
        for wanted in [red, Inspection::Picture] {
            s.change(LookCommand::Inspect(red));
            s.release();
            assert_eq!(s.look.effects.inspection, wanted);
        }
        s.change(LookCommand::Undo);
        assert_eq!(s.look.effects.inspection, red);
    }

    #[test]
    fn what_is_under_the_cursor_stays_there_as_the_picture_is_zoomed() {
        let mut s = state();
        s.show(ViewCommand::Pan([7.0, -3.0]));
        let about = [120.0, 45.0];
        let under = |v: &View| [0, 1].map(|i| (about[i] - v.pan[i]) / v.zoom);
        let before = under(&s.view);
        s.show(ViewCommand::Zoom { factor: 2.5, about });
        let after = under(&s.view);
        assert!(
            (0..2).all(|i| (before[i] - after[i]).abs() < 1e-3),
            "{before:?} {after:?}"
        );
        s.show(ViewCommand::Zoom { factor: 1e9, about });
        assert_eq!(s.view.zoom, 64.0);
        s.show(ViewCommand::Fit);
        assert_eq!(s.view, View::FITTED);
    }

    #[test]
    fn resetting_the_view_can_be_undone_where_it_changed_the_exposure() {
        let mut s = state();
        s.change(LookCommand::Exposure(2.0));
        s.release();
        s.change(LookCommand::ResetView);
        assert_eq!(s.look.exposure_stops, 0.0);
        s.change(LookCommand::Undo);
        assert_eq!(s.look.exposure_stops, 2.0);
    }
}
