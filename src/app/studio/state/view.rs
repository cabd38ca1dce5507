//! Visible part of the project, and its display.

use super::State;
use crate::command::{LookCommand, ViewCommand};
use crate::comparison::{CellPicture, GAINS};
use scene::{Inspection, Viewing};

/// Zoom range of the fitted picture. A picture of 64 pixels fills a large pane at 30 times its size.
const ZOOM: std::ops::RangeInclusive<f32> = 0.02..=64.0;

/// Zoom and position of the picture in the viewport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Zoom; 1 fits the picture into the viewport.
    pub zoom: f32,
    /// Offset of the picture's centre from the viewport's, in points.
    pub pan: [f32; 2],
}

impl View {
    /// The picture fills the viewport.
    pub(crate) const FITTED: Self = Self { zoom: 1.0, pan: [0.0; 2] };
}

impl State {
    /// Changes the view.
    ///
    /// A change of frame or lamp ends [`ReviewView::cell`](super::ReviewView::cell).
    pub fn show(&mut self, command: ViewCommand) {
        use ViewCommand::{Frame, LastFrame, Solo, SoloAlso, StepFrame, StepSolo, TogglePlay};
        if matches!(command, Frame(_) | StepFrame(_) | LastFrame | TogglePlay | Solo(_) | SoloAlso(_) | StepSolo(_)) {
            self.review.cell = None;
        }
        match command {
            ViewCommand::Cell(cell) => {
                self.review.cell = cell;
                match cell {
                    Some(_) => self.review.chosen = cell,
                    None => self.review.enlarged = None,
                }
            }
            ViewCommand::Enlarge(picture) => self.review.enlarged = picture,
            ViewCommand::FlipCell => self.review.enlarged = Some(CellPicture::flipped(self.review.enlarged)),
            ViewCommand::Metric(metric) => self.review.metric = metric,
            ViewCommand::Gain(gain) if GAINS.contains(&gain) => self.display.gain = gain,
            ViewCommand::Gain(_) => {}
            ViewCommand::Photograph(lamp) => self.shoot.photograph = lamp,
            ViewCommand::StepPhotograph(step) => {
                self.shoot.photograph = next(self.shoot.photograph, step, self.lamps.photographed);
            }
            ViewCommand::TrainedLamp(lamp) => self.shoot.trained_lamp = lamp,
            ViewCommand::StepTrainedLamp(step) => {
                let lamps = self.lamps.shoot.max(1) as isize;
                self.shoot.trained_lamp = (self.shoot.trained_lamp as isize + step).rem_euclid(lamps) as usize;
            }
            ViewCommand::Pose(pose) => self.shoot.pose = pose,
            ViewCommand::Wipe(at) => self.wipe_at(at),
            ViewCommand::StepWipe => {
                self.viewport.wipe = match self.viewport.wipe {
                    at if at <= 0.0 => 0.5,
                    at if at >= 1.0 => 0.0,
                    _ => 1.0,
                }
            }
            ViewCommand::Compare(compare) => self.compare = compare,
            ViewCommand::ToggleWipe => self.compare.toggle_wipe(),
            ViewCommand::ToggleDoubts => self.viewport.doubts = !self.viewport.doubts,
            ViewCommand::ToggleSecond => self.compare.toggle_second(),
            ViewCommand::Solo(lamp) => self.solo = lamp.into_iter().collect(),
            ViewCommand::SoloAlso(lamp) => match self.solo.binary_search(&lamp) {
                Ok(place) => drop(self.solo.remove(place)),
                Err(place) => self.solo.insert(place, lamp),
            },
            ViewCommand::StepSolo(step) => {
                let lamp = next(self.solo.first().copied(), step, self.lamps.rig);
                self.solo = lamp.into_iter().collect();
            }
            ViewCommand::ChooseLight(light) => self.choose_light(light),
            ViewCommand::FoldLights(group, true) => drop(self.aiming.folded.insert(group)),
            ViewCommand::FoldLights(group, false) => drop(self.aiming.folded.remove(&group)),
            ViewCommand::Viewing(viewing) => self.display.viewing = viewing.bounded(),
            ViewCommand::StepViewing(stops) => {
                self.display.viewing.exposure_stops += stops;
                self.display.viewing = self.display.viewing.clone().bounded();
            }
            ViewCommand::LookThrough(choice) => {
                if choice.is_none() {
                    self.display.viewing.through = None;
                }
                self.display.color_view = choice;
            }
            ViewCommand::Inspect(inspection) => {
                self.display.inspection =
                    if self.display.inspection == inspection { Inspection::Picture } else { inspection };
            }
            ViewCommand::ResetView => {
                self.viewport.view = View::FITTED;
                (self.display.viewing, self.display.inspection) = (Viewing::default(), Inspection::Picture);
                self.display.color_view = None;
            }
            ViewCommand::Pixel(pixel) => self.viewport.probed = pixel,
            ViewCommand::Region(region) => self.viewport.region = region,
            ViewCommand::Footage(view) => self.footage = view,
            ViewCommand::Frame(frame) => self.go(frame),
            ViewCommand::StepFrame(step) => self.go(self.frame.saturating_add_signed(step)),
            ViewCommand::LastFrame => self.go(usize::MAX),
            ViewCommand::TogglePlay => {
                let (first, last) = self.range();
                self.playback.playing = !self.playback.playing && self.playback.frames > 1;
                if self.playback.playing && !self.playback.loops && self.frame >= last {
                    self.frame = first;
                    self.look.follow(first);
                }
            }
            ViewCommand::ToggleLoop => self.playback.loops = !self.playback.loops,
            ViewCommand::MarkIn => {
                let (_, end) = self.range();
                let range = (self.frame, end.max(self.frame));
                self.change(LookCommand::Range(Some(range)));
            }
            ViewCommand::MarkOut => {
                let (start, _) = self.range();
                let range = (start.min(self.frame), self.frame);
                self.change(LookCommand::Range(Some(range)));
            }
            ViewCommand::Zoom { factor, about } => self.zoom(factor, about),
            ViewCommand::Pan([x, y]) => {
                let pan = &mut self.viewport.view.pan;
                *pan = [pan[0] + x, pan[1] + y];
            }
            ViewCommand::Fit => self.viewport.view = View::FITTED,
        }
    }

    /// Advances to the next frame. At the out point, loops to the in point or stops.
    pub fn advance(&mut self) {
        let (first, last) = self.range();
        let within = (first..last).contains(&self.frame);
        if self.frame == last && !self.playback.loops {
            self.playback.playing = false;
            return;
        }
        self.frame = if within { self.frame + 1 } else { first };
        self.look.follow(self.frame);
    }

    fn go(&mut self, frame: usize) {
        self.playback.playing = false;
        self.frame = frame.min(self.playback.frames.saturating_sub(1));
        self.look.follow(self.frame);
    }

    fn wipe_at(&mut self, at: f32) {
        if at.is_finite() {
            self.viewport.wipe = at.clamp(0.0, 1.0);
        }
    }

    /// Zooms so that the point under `about` stays in place.
    fn zoom(&mut self, factor: f32, about: [f32; 2]) {
        let view = &mut self.viewport.view;
        let zoom = (view.zoom * factor).clamp(*ZOOM.start(), *ZOOM.end());
        let grown = zoom / view.zoom;
        if zoom.is_finite() {
            for (pan, about) in view.pan.iter_mut().zip(about) {
                *pan = about + (*pan - about) * grown;
            }
            view.zoom = zoom;
        }
    }
}

/// The lamp `step` places after `lamp` among `count` lamps, wrapping around. None, which is the environment or the
/// interview's light, comes before the first.
fn next(lamp: Option<usize>, step: isize, count: usize) -> Option<usize> {
    let place = lamp.map_or(0, |lamp| lamp + 1) as isize + step;
    (place.rem_euclid(count as isize + 1) as usize).checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::tests::state;

    #[test]
    fn a_cell_s_pictures_are_flipped_and_stay_large_from_cell_to_cell() {
        let mut s = state();
        s.show(ViewCommand::Cell(Some((0, 1))));
        let mut flip = |from| {
            s.show(ViewCommand::Enlarge(from));
            s.show(ViewCommand::FlipCell);
            s.review.enlarged
        };
        assert_eq!(flip(None), Some(CellPicture::Prediction));
        assert_eq!(flip(Some(CellPicture::Difference)), Some(CellPicture::Prediction));
        assert_eq!(flip(Some(CellPicture::Truth)), Some(CellPicture::Prediction));
        assert_eq!(flip(Some(CellPicture::Prediction)), Some(CellPicture::Truth));
        s.show(ViewCommand::Frame(3));
        s.show(ViewCommand::Cell(Some((2, 1))));
        assert_eq!((s.review.chosen, s.review.enlarged), (Some((2, 1)), Some(CellPicture::Truth)));
        s.show(ViewCommand::Cell(None));
        assert_eq!((s.review.chosen, s.review.enlarged), (Some((2, 1)), None));
    }

    #[test]
    fn lamps_are_shown_alone_and_together() {
        let mut s = state();
        let lamps = [ViewCommand::Solo(Some(7)), ViewCommand::SoloAlso(2), ViewCommand::SoloAlso(9)];
        lamps.into_iter().for_each(|command| s.show(command));
        assert_eq!(s.solo, [2, 7, 9]);
        s.show(ViewCommand::SoloAlso(7));
        assert_eq!(s.solo, [2, 9]);
        s.show(ViewCommand::Solo(Some(4)));
        assert_eq!(s.solo, [4]);
        s.show(ViewCommand::Solo(None));
        assert!(s.solo.is_empty() && !s.can_undo());
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
        assert_eq!((s.frame, s.playback.playing), (0, true));
        s.show(ViewCommand::Frame(4));
        assert_eq!((s.frame, s.playback.playing), (4, false));
        let mut still = State::new(1, 24.0);
        still.show(ViewCommand::TogglePlay);
        assert!(!still.playback.playing, "a single frame cannot be played");
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
        assert!(s.solo.is_empty(), "the lamps are not known yet");
        s.lamps.rig = 3;
        for wanted in [&[0][..], &[1], &[2], &[], &[0]] {
            s.show(ViewCommand::StepSolo(1));
            assert_eq!(s.solo, wanted);
        }
        s.show(ViewCommand::StepSolo(-1));
        assert!(s.solo.is_empty());
    }

    #[test]
    fn how_a_picture_is_looked_at_is_no_part_of_the_look_and_is_reset_at_once() {
        let mut s = state();
        let red = Inspection::Channel(scene::Channel::Red);
        for wanted in [red, Inspection::Picture, red] {
            s.show(ViewCommand::Inspect(red));
            assert_eq!(s.scene().effects.inspection, wanted);
        }
        (0..3).for_each(|_| s.show(ViewCommand::StepViewing(0.5)));
        s.show(ViewCommand::StepViewing(-0.5));
        assert_eq!(s.scene().viewing.exposure_stops, 1.0);
        s.show(ViewCommand::Viewing(Viewing {
            gamma: 99.0,
            view: Some(scene::ViewTransform::Aces),
            ..s.display.viewing.clone()
        }));
        assert_eq!(s.scene().viewing.gamma, 5.0);
        assert_eq!(s.scene().view(), scene::ViewTransform::Aces);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
        s.show(ViewCommand::Pan([3.0, 4.0]));
        s.show(ViewCommand::ResetView);
        assert_eq!((s.viewport.view, s.scene()), (View::FITTED, state().scene()));
        s.show(ViewCommand::StepViewing(f32::NAN));
        assert!(s.scene().viewing.is_neutral());
    }

    #[test]
    fn without_a_loop_playing_stops_at_the_out_point_and_begins_again_at_the_in_point() {
        let mut s = state();
        for command in [
            ViewCommand::ToggleLoop,
            ViewCommand::Frame(5),
            ViewCommand::MarkOut,
            ViewCommand::Frame(3),
            ViewCommand::MarkIn,
            ViewCommand::TogglePlay,
        ] {
            s.show(command);
        }
        let mut shown = vec![s.frame];
        while s.playback.playing {
            s.advance();
            shown.push(s.frame);
        }
        assert_eq!(shown, [3, 4, 5, 5]);
        s.show(ViewCommand::TogglePlay);
        assert_eq!((s.frame, s.playback.playing), (3, true));
    }

    #[test]
    fn what_is_under_the_cursor_stays_there_as_the_picture_is_zoomed() {
        let mut s = state();
        s.show(ViewCommand::Pan([7.0, -3.0]));
        let about = [120.0, 45.0];
        let under = |v: &View| [0, 1].map(|i| (about[i] - v.pan[i]) / v.zoom);
        let before = under(&s.viewport.view);
        s.show(ViewCommand::Zoom { factor: 2.5, about });
        let after = under(&s.viewport.view);
        assert!((0..2).all(|i| (before[i] - after[i]).abs() < 1e-3), "{before:?} {after:?}");
        s.show(ViewCommand::Zoom { factor: 1e9, about });
        assert_eq!(s.viewport.view.zoom, 64.0);
        s.show(ViewCommand::Fit);
        assert_eq!(s.viewport.view, View::FITTED);
    }
}
