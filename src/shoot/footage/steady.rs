//! Mattes of consecutive frames, averaged along the motion and written.

use super::frame_mattes::FrameMatte;
use super::movement::Movement;
use base::error::Result;
use imaging::{Mask, file};
use matte::{Neighbour, flicker, steadied};
use project::Project;
use std::collections::VecDeque;

/// Number of neighbouring frames on each side in the average.
const AROUND: usize = 2;

/// Frames in processing order, forwards or backwards. A matte is written when the frames after it are known.
pub struct Steady<'a> {
    project: &'a Project,
    average: bool,
    window: VecDeque<(usize, FrameMatte)>,
    /// Number of written mattes in the window.
    written: usize,
    /// Last written frame and its matte.
    last: Option<(usize, Mask)>,
    raw: Mean,
    steadied: Mean,
}

#[derive(Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: Option<f32>) {
        if let Some(value) = value {
            self.sum += f64::from(value);
            self.count += 1;
        }
    }

    fn value(&self) -> Option<f32> {
        (self.count > 0).then(|| (self.sum / self.count as f64) as f32)
    }
}

impl<'a> Steady<'a> {
    /// Writer of this project's mattes, averaged over time if `average`.
    pub fn new(project: &'a Project, average: bool) -> Self {
        Self {
            project,
            average,
            window: VecDeque::new(),
            written: 0,
            last: None,
            raw: Mean::default(),
            steadied: Mean::default(),
        }
    }

    /// Adds the next frame's matte. A frame that does not follow the previous one starts over.
    ///
    /// # Errors
    /// When a matte cannot be written or a frame cannot be read.
    pub fn push(&mut self, frame: usize, found: FrameMatte, movement: &mut Movement) -> Result<()> {
        if let Some((before, earlier)) = self.window.back() {
            if before.abs_diff(frame) != 1 || earlier.matte.mask.size() != found.matte.mask.size() {
                self.finish(movement)?;
            } else if let Some(flow) = movement.between(frame, *before)? {
                let between = flicker(&found.matte.mask, &earlier.matte.mask, &flow);
                self.raw.add(between);
            }
        }
        self.window.push_back((frame, found));
        if self.window.len() - self.written > AROUND {
            self.write_next(movement)?;
        }
        while self.written > AROUND {
            self.window.pop_front();
            self.written -= 1;
        }
        Ok(())
    }

    /// Writes the remaining mattes.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn finish(&mut self, movement: &mut Movement) -> Result<()> {
        while self.written < self.window.len() {
            self.write_next(movement)?;
        }
        self.window.clear();
        (self.written, self.last) = (0, None);
        Ok(())
    }

    /// Flicker of the mattes, as written and before averaging.
    pub fn flicker(&self) -> (Option<f32>, Option<f32>) {
        (self.steadied.value(), self.raw.value())
    }

    fn write_next(&mut self, movement: &mut Movement) -> Result<()> {
        let at = self.written;
        let (frame, found) = &self.window[at];
        let mut mask = found.matte.mask.clone();
        if self.average {
            let mut around = Vec::new();
            let others = at.saturating_sub(AROUND)..(at + AROUND + 1).min(self.window.len());
            for other in others.filter(|other| *other != at) {
                if let Some(flow) = movement.between(*frame, self.window[other].0)? {
                    around.push((other, flow));
                }
            }
            let others: Vec<_> = (around.iter())
                .map(|(other, flow)| {
                    let (_, other) = &self.window[*other];
                    Neighbour { picture: &other.picture, matte: &other.matte.mask, flow }
                })
                .collect();
            mask = steadied(&found.picture, &mask, &others);
            found.seeds.force(&mut mask);
        }
        file::write_mask_png(&self.project.frame_matte_path(*frame), &mask)?;
        if let Some((before, earlier)) = &self.last
            && let Some(flow) = movement.between(*frame, *before)?
        {
            self.steadied.add(flicker(&mask, earlier, &flow));
        }
        self.last = Some((*frame, mask));
        self.written += 1;
        Ok(())
    }
}
