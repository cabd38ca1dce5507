//! Expected errors, in red over the picture.

use crate::panel_context::PanelContext;
use crate::theme;
use confidence::{ConfidenceReport, FrameConfidence, SIDE};
use egui::{Color32, ColorImage, Painter, Rect, TextureHandle, TextureOptions, pos2, vec2};
use imaging::Mask;
use std::sync::Arc;
use worker::{PredictedFrame, PreviewPicture};

/// Opacity at the largest expected errors.
const MOST_OPAQUE: f32 = 0.75;

/// Overlay of one frame.
#[derive(Default)]
pub struct Doubts {
    made: Option<Made>,
}

struct Made {
    report: Arc<ConfidenceReport>,
    predicted: Arc<PredictedFrame>,
    texture: TextureHandle,
    words: String,
}

/// Overlay values of a frame: one per cell, the values drawn clear and opaque, and a legend.
struct Values<'a> {
    cells: &'a [f32],
    clear: f32,
    opaque: f32,
    words: String,
}

impl Doubts {
    /// Draws the expected errors over the picture in `place`. Returns the legend of the colour.
    pub fn draw(&mut self, painter: &Painter, place: Rect, relit: &PreviewPicture, context: &PanelContext) -> String {
        let Some(report) = context.readers.review.confidence() else {
            return "not estimated yet: see Review".to_owned();
        };
        let Some(frame) = shown(report, relit.scene.frame) else { return "this frame was not estimated".to_owned() };
        let predicted = &relit.predicted;
        let is_of = |made: &&Made| Arc::ptr_eq(&made.report, report) && Arc::ptr_eq(&made.predicted, predicted);
        let made = match self.made.take().filter(|made| is_of(&made)) {
            Some(made) => made,
            None => {
                let values = Values::new(report, frame);
                let picture = picture(&values, &predicted.frame.mask);
                let options = TextureOptions::LINEAR;
                Made {
                    report: report.clone(),
                    predicted: predicted.clone(),
                    texture: painter.ctx().load_texture("doubts", picture, options),
                    words: values.words,
                }
            }
        };
        let made = self.made.insert(made);
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let square = square(place, relit, context);
        painter.image(made.texture.id(), square, whole, Color32::WHITE);
        made.words.clone()
    }
}

/// Estimate for a frame, or for the last estimated frame before it.
fn shown(report: &ConfidenceReport, frame: usize) -> Option<&FrameConfidence> {
    let all = report.frames.iter();
    all.rev().find(|known| (known.frame..known.frame + report.every.max(1)).contains(&frame))
}

/// Rectangle of the network's crop, for a picture in `place`.
fn square(place: Rect, relit: &PreviewPicture, context: &PanelContext) -> Rect {
    let (Some(_), Some(project)) = (&relit.predicted.plate, context.session.project) else { return place };
    let framing = project.settings.framing.for_size((relit.width, relit.height));
    let points = place.width() / relit.width.max(1) as f32;
    let corner = place.min + points * vec2(framing.x as f32, framing.y as f32);
    let side = points * framing.side as f32;
    Rect::from_min_size(corner, vec2(side, side))
}

impl<'a> Values<'a> {
    fn new(report: &ConfidenceReport, frame: &'a FrameConfidence) -> Self {
        // A colour has the same meaning in all frames.
        let known = |of: fn(&FrameConfidence) -> &Vec<f32>| {
            let all = report.frames.iter().flat_map(of).copied();
            let mut all: Vec<f32> = all.filter(|value| *value > 0.0).collect();
            all.sort_unstable_by(f32::total_cmp);
            let at = |share: f32| all.get((share * (all.len() as f32 - 1.0)) as usize).copied();
            (at(0.5).unwrap_or(0.0), at(0.99).unwrap_or(1.0))
        };
        if frame.errors.is_empty() {
            let (clear, most) = (report.far, known(|frame| &frame.cells).1);
            let opaque = most.max(1.5 * report.far);
            return Self { cells: &frame.cells, clear, opaque, words: "red: unlike the poses here".to_owned() };
        }
        let (clear, opaque) = known(|frame| &frame.errors);
        Self {
            cells: &frame.errors,
            clear,
            opaque,
            words: format!("expected errors: clear {:.0} %, red {:.0} % of white", 100.0 * clear, 100.0 * opaque),
        }
    }

    /// Opacity of the colour for a value.
    fn opacity(&self, value: f32) -> f32 {
        let share = (value - self.clear) / (self.opaque - self.clear).max(f32::MIN_POSITIVE);
        MOST_OPAQUE * share.clamp(0.0, 1.0)
    }

    /// The value at a point of the square, both coordinates from 0 to 1: interpolated between the nearest cells that
    /// show the subject.
    fn at(&self, x: f32, y: f32) -> f32 {
        let along = |share: f32| {
            let place = (share * SIDE as f32 - 0.5).clamp(0.0, (SIDE - 1) as f32);
            let low = (place as usize).min(SIDE - 2);
            (low, place - low as f32)
        };
        let ((column, right), (row, down)) = (along(x), along(y));
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dy, wy) in [(0, 1.0 - down), (1, down)] {
            for (dx, wx) in [(0, 1.0 - right), (1, right)] {
                let value = self.cells.get((row + dy) * SIDE + column + dx).copied().unwrap_or(0.0);
                if value > 0.0 {
                    sum += wx * wy * value;
                    weights += wx * wy;
                }
            }
        }
        if weights > 0.0 { sum / weights } else { 0.0 }
    }
}

/// The overlay: the warning colour on the subject, as opaque as the values require.
fn picture(values: &Values, mask: &Mask) -> ColorImage {
    let (width, height) = mask.size();
    let pixels = (0..width * height).map(|i| {
        let (x, y) = (i % width, i / width);
        let at = |place: usize, length: usize| (place as f32 + 0.5) / length as f32;
        let value = values.at(at(x, width), at(y, height));
        theme::WARNING.gamma_multiply(values.opacity(value) * mask.at(x, y).clamp(0.0, 1.0))
    });
    ColorImage::new([width, height], pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_beside_the_subject_do_not_thin_out_its_edge() {
        let mut cells = vec![0.0; SIDE * SIDE];
        for row in 0..SIDE {
            cells[row * SIDE + 8] = 0.1;
            cells[row * SIDE + 9] = 0.3;
        }
        let values = Values { cells: &cells, clear: 0.1, opaque: 0.3, words: String::new() };
        let middle = |column: f32| (column + 0.5) / SIDE as f32;
        let at = |column: f32| values.at(middle(column), 0.4);
        assert!((at(8.0) - 0.1).abs() < 1e-6 && (at(9.4) - 0.3).abs() < 1e-6);
        assert!((at(8.5) - 0.2).abs() < 1e-6);
        assert_eq!(at(2.0), 0.0);
        assert_eq!((values.opacity(0.05), values.opacity(9.0)), (0.0, MOST_OPAQUE));
        assert!(values.at(0.0, 0.0).is_finite() && values.at(1.0, 1.0).is_finite());
        // Clear outside the matte, whatever the value there.
        let mask = Mask::from_fn(32, 32, |x, _| if x < 19 { 1.0 } else { 0.0 });
        let picture = picture(&values, &mask);
        assert!(picture.pixels[18 + 32 * 5].a() > 0);
        assert_eq!(picture.pixels[19 + 32 * 5].a(), 0);
    }
}
