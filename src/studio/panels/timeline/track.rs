//! Where frames are along the timeline, and the ruler that says so.

use crate::theme;
use egui::{Align2, Color32, FontId, Painter, Rangef, Rect, Stroke};

/// The least distance of a ruler's numbers and ticks, in points.
const NUMBER: f32 = 44.0;
const TICK: f32 = 5.0;
/// Height of the ruler in points.
pub const RULER: f32 = 19.0;

/// The frames' positions along the timeline.
#[derive(Clone, Copy)]
pub struct Track {
    /// From the first frame to the last.
    pub across: Rangef,
    pub frames: usize,
}

/// How many frames lie between two marks at least `room` points apart, `cell` points a frame: 1, 2 or 5 times a power of ten.
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
    /// Width of a frame in points.
    pub fn cell(&self) -> f32 {
        self.across.span() / self.frames.max(1) as f32
    }

    /// What a frame covers.
    pub fn span(&self, frame: usize) -> Rangef {
        let left = self.across.min + frame as f32 * self.cell();
        Rangef::new(left, left + self.cell())
    }

    /// The middle of a frame, which may lie between two.
    pub fn x(&self, frame: f64) -> f32 {
        self.across.min + (frame as f32 + 0.5) * self.cell()
    }

    /// The frame at a place.
    pub fn frame_at(&self, x: f32) -> usize {
        let share = (x - self.across.min) / self.across.span().max(1.0);
        let frame = (share.clamp(0.0, 1.0) * self.frames as f32) as usize;
        frame.min(self.frames.saturating_sub(1))
    }

    /// How many frames lie before the border of two frames that is nearest to a place.
    pub fn cut_at(&self, x: f32) -> usize {
        let cut = ((x - self.across.min) / self.cell().max(f32::MIN_POSITIVE)).round();
        (cut.max(0.0) as usize).min(self.frames)
    }

    /// The frames that have numbers on the ruler.
    pub fn numbered(&self) -> impl Iterator<Item = usize> {
        (0..self.frames).step_by(step(NUMBER, self.cell()))
    }

    /// Ticks and numbers of frames in the ruler at the top of `rect`.
    pub fn ruler_ui(&self, painter: &Painter, rect: Rect) {
        if self.frames == 0 {
            return;
        }
        let bottom = rect.top() + RULER;
        let numbered = step(NUMBER, self.cell());
        let ticked = step(TICK, self.cell()).min(numbered);
        for frame in (0..self.frames).step_by(ticked) {
            let x = self.x(frame as f64);
            let has_number = frame % numbered == 0;
            let length = if has_number { 6.0 } else { 3.0 };
            let line = Stroke::new(1.0, Color32::from_gray(110));
            painter.vline(x, bottom - length..=bottom, line);
            if has_number {
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
        let track = Track {
            across: Rangef::new(100.0, 500.0),
            frames: 8,
        };
        for frame in 0..8 {
            assert_eq!(track.frame_at(track.x(frame as f64)), frame);
            assert_eq!(track.span(frame).center(), track.x(frame as f64));
        }
        assert_eq!(
            (track.frame_at(-1e9), track.frame_at(f32::INFINITY)),
            (0, 7)
        );
        let cuts = [-9.0, 124.0, 126.0, 149.0, 9e9].map(|x| track.cut_at(x));
        assert_eq!(cuts, [0, 0, 1, 1, 8]);
    }
}
