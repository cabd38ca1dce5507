//! Positions of frames along the timeline, and the ruler that shows them.

use crate::theme;
use egui::{Align2, Color32, FontId, Painter, Rangef, Rect, Stroke};

/// Least distance of a ruler's numbers, and of its ticks, in points.
const NUMBER: f32 = 44.0;
const TICK: f32 = 5.0;
/// Height of the ruler in points.
pub const RULER: f32 = 19.0;

/// Width of the button that shows all frames, at the right end of the ruler.
pub const FIT: f32 = 22.0;
/// Least number of frames in sight.
const LEAST: f64 = 4.0;

/// Positions of the frames along the timeline.
#[derive(Clone, Copy)]
pub struct Track {
    /// From the first frame in sight to the last.
    pub across: Rangef,
    /// Frames of the clip.
    pub frames: usize,
    /// The part in sight.
    sight: Sight,
}

/// A part of the clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Frames before the part, and within it. Both may be fractional.
    pub from: f64,
    pub frames: f64,
}

impl Sight {
    /// The part limited to a clip of `frames` frames. None if it covers the whole clip.
    fn within(self, frames: usize) -> Option<Self> {
        let all = frames as f64;
        let shown = self.frames.clamp(LEAST.min(all), all);
        let sight = Self { from: self.from.clamp(0.0, all - shown), frames: shown };
        (shown < all && sight.from.is_finite()).then_some(sight)
    }
}

/// Number of frames between two marks at least `room` points apart, at `cell` points per frame: 1, 2 or 5 times a power
/// of ten.
fn step(room: f32, cell: f32) -> usize {
    let mut decade = 1usize;
    loop {
        for times in [1, 2, 5] {
            let step = times * decade;
            if step as f32 * cell >= room || decade > 1_000_000_000 {
                return step;
            }
        }
        decade *= 10;
    }
}

impl Track {
    /// Track for the part `sight` of a clip of `frames` frames; None for the whole clip.
    pub fn new(across: Rangef, frames: usize, sight: Option<Sight>) -> Self {
        let all = Sight { from: 0.0, frames: frames as f64 };
        Self { across, frames, sight: sight.and_then(|sight| sight.within(frames)).unwrap_or(all) }
    }

    /// The part in sight; None if it is the whole clip.
    pub fn sight(&self) -> Option<Sight> {
        self.sight.within(self.frames)
    }

    /// The part in sight after a zoom by `factor` about `x`, which keeps its frame.
    pub fn zoomed(&self, factor: f32, x: f32) -> Option<Sight> {
        let all = self.frames as f64;
        let frames = self.sight.frames / f64::from(factor.max(f32::MIN_POSITIVE));
        let frames = frames.clamp(LEAST.min(all), all);
        let share = self.share(x).clamp(0.0, 1.0);
        let from = self.sight.from + share * (self.sight.frames - frames);
        Sight { from, frames }.within(self.frames)
    }

    /// The part in sight after a pan by `points` to the right.
    pub fn panned(&self, points: f32) -> Option<Sight> {
        let frames = f64::from(points) / f64::from(self.cell().max(f32::MIN_POSITIVE));
        let from = self.sight.from - frames;
        Sight { from, ..self.sight }.within(self.frames)
    }

    /// The part in sight, moved if needed to show a frame and the frames after it.
    pub fn showing(&self, frame: usize) -> Option<Sight> {
        let Sight { from, frames } = self.sight;
        let at = frame as f64;
        let from = if at >= from && at + 1.0 <= from + frames { from } else { at - 0.05 * frames };
        Sight { from, frames }.within(self.frames)
    }

    /// First and last frame that are at least partly in sight.
    pub fn ends(&self) -> (usize, usize) {
        let Sight { from, frames } = self.sight;
        let last = (from + frames).ceil() as usize;
        let last = last.min(self.frames).saturating_sub(1);
        ((from as usize).min(last), last)
    }

    /// True if a position is in sight.
    pub fn has(&self, x: f32) -> bool {
        self.across.expand(0.5).contains(x)
    }

    /// Width of a frame in points.
    pub fn cell(&self) -> f32 {
        (f64::from(self.across.span()) / self.sight.frames.max(1.0)) as f32
    }

    /// Position as a share of the track: 0 at the left end, 1 at the right end.
    fn share(&self, x: f32) -> f64 {
        f64::from((x - self.across.min) / self.across.span().max(1.0))
    }

    /// Position of the left edge of a frame.
    fn left(&self, frame: f64) -> f32 {
        let share = (frame - self.sight.from) / self.sight.frames.max(1.0);
        self.across.min + (share * f64::from(self.across.span())) as f32
    }

    /// Span that a frame covers.
    pub fn span(&self, frame: usize) -> Rangef {
        let frame = frame as f64;
        Rangef::new(self.left(frame), self.left(frame + 1.0))
    }

    /// The visible part of a run of frames; None if the run is out of sight.
    pub fn run(&self, first: usize, last: usize) -> Option<Rangef> {
        let (left, right) = (self.span(first).min, self.span(last).max);
        let run = Rangef::new(left.max(self.across.min), right.min(self.across.max));
        (run.min < run.max).then_some(run)
    }

    /// Position of the middle of a frame, which may be fractional.
    pub fn x(&self, frame: f64) -> f32 {
        self.left(frame + 0.5)
    }

    /// The frame at a share of the track, which may be fractional; the inverse of [`Self::x`].
    pub fn between(&self, share: f64) -> f64 {
        self.sight.from + share * self.sight.frames - 0.5
    }

    /// The frame in sight nearest to a position.
    pub fn frame_at(&self, x: f32) -> usize {
        let Sight { from, frames } = self.sight;
        let frame = (from + self.share(x).clamp(0.0, 1.0) * frames) as usize;
        let (first, last) = self.ends();
        frame.clamp(first, last)
    }

    /// Number of frames before the frame border nearest to a position.
    pub fn cut_at(&self, x: f32) -> usize {
        let cut = (self.sight.from + self.share(x) * self.sight.frames).round();
        (cut.max(0.0) as usize).min(self.frames)
    }

    /// The frames in sight that have numbers on the ruler.
    pub fn numbered(&self) -> impl Iterator<Item = usize> {
        self.every(step(NUMBER, self.cell()))
    }

    /// Frames in sight at multiples of `step`.
    fn every(&self, step: usize) -> impl Iterator<Item = usize> {
        let (first, last) = self.ends();
        let all = (first.next_multiple_of(step)..=last).step_by(step);
        let track = *self;
        all.filter(move |frame| track.has(track.x(*frame as f64)))
    }

    /// Ticks and numbers of frames in the ruler at the top of `rect`.
    pub fn ruler_ui(&self, painter: &Painter, rect: Rect) {
        if self.frames == 0 {
            return;
        }
        let bottom = rect.top() + RULER;
        let numbered = step(NUMBER, self.cell());
        let ticked = step(TICK, self.cell()).min(numbered);
        let beside = match self.sight() {
            Some(_) => self.across.max - FIT - 0.5 * NUMBER,
            None => self.across.max,
        };
        for frame in self.every(ticked) {
            let x = self.x(frame as f64);
            let has_number = frame % numbered == 0;
            let length = if has_number { 6.0 } else { 3.0 };
            let line = Stroke::new(1.0, Color32::from_gray(110));
            painter.vline(x, bottom - length..=bottom, line);
            if has_number && x <= beside {
                let at = egui::pos2(x, bottom - length);
                let font = FontId::proportional(11.0);
                painter.text(at, Align2::CENTER_BOTTOM, frame, font, theme::QUIET);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_far_enough_apart() {
        for (cell, expected) in [(50.0, 1), (44.0, 1), (30.0, 2), (9.0, 5), (0.5, 100)] {
            assert_eq!(step(NUMBER, cell), expected, "{cell}");
        }
        assert!(step(NUMBER, 0.0) > 1_000_000);
    }

    #[test]
    fn a_frame_is_found_where_it_is_drawn() {
        let track = Track::new(Rangef::new(100.0, 500.0), 8, None);
        for frame in 0..8 {
            assert_eq!(track.frame_at(track.x(frame as f64)), frame);
            assert_eq!(track.span(frame).center(), track.x(frame as f64));
        }
        assert_eq!((track.frame_at(-1e9), track.frame_at(f32::INFINITY)), (0, 7));
        let cuts = [-9.0, 124.0, 126.0, 149.0, 9e9].map(|x| track.cut_at(x));
        assert_eq!(cuts, [0, 0, 1, 1, 8]);
        assert_eq!((track.sight(), track.ends()), (None, (0, 7)));
    }

    fn long(sight: Option<Sight>) -> Track {
        Track::new(Rangef::new(100.0, 480.0), 2000, sight)
    }

    #[test]
    fn a_place_keeps_its_frame_while_it_is_zoomed_until_all_is_in_sight_again() {
        let mut track = long(None);
        assert!(track.cell() < 0.2, "five frames share a point");
        let x = 250.0;
        let under = track.frame_at(x);
        for _ in 0..60 {
            track = long(track.zoomed(1.3, x));
            assert!(track.frame_at(x).abs_diff(under) <= 1);
        }
        assert!(track.cell() > 90.0, "no further than a few frames");
        let (first, last) = track.ends();
        for frame in first + 1..last {
            assert_eq!(track.frame_at(track.x(frame as f64)), frame);
            assert_eq!(track.cut_at(track.span(frame).min), frame);
        }
        assert!(track.numbered().count() >= 3, "every frame has a number");
        for _ in 0..60 {
            track = long(track.zoomed(0.7, 470.0));
        }
        assert_eq!(track.sight(), None);
    }

    #[test]
    fn it_is_moved_within_the_clip_and_follows_a_frame_out_of_sight() {
        let sight = Sight { from: 500.0, frames: 38.0 };
        let track = long(Some(sight));
        assert_eq!(track.cell(), 10.0);
        assert_eq!(track.ends(), (500, 537));
        assert_eq!(track.panned(-100.0).unwrap().from, 510.0);
        assert_eq!(track.panned(1e9).unwrap().from, 0.0);
        assert_eq!(track.panned(-1e9).unwrap().from, 1962.0);
        for frame in [500, 520, 537] {
            assert_eq!(track.showing(frame), Some(sight), "{frame} is in sight");
        }
        for frame in [0, 499, 538, 1999] {
            let shown = long(track.showing(frame));
            let (first, last) = shown.ends();
            assert!((first..=last).contains(&frame), "{frame}: {first} to {last}");
            assert!(shown.has(shown.x(frame as f64)));
            assert_eq!(shown.cell(), 10.0);
        }
        assert_eq!(long(None).showing(7), None);
        // Numbers and ticks are on frames in sight only, as many as fit.
        assert_eq!(track.numbered().collect::<Vec<_>>(), [500, 505, 510, 515, 520, 525, 530, 535]);
        assert_eq!(track.run(0, 509), Some(Rangef::new(100.0, 200.0)));
        assert_eq!(track.run(538, 600), None);
        // A shorter clip was opened.
        assert_eq!(Track::new(track.across, 8, Some(sight)).sight(), None);
        assert_eq!(Track::new(track.across, 0, Some(sight)).ends(), (0, 0));
    }
}
