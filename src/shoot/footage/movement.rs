//! Motion of the interview from frame to frame.

use super::framed::read_picture;
use base::error::Result;
use imaging::Encoded;
use matte::{Flow, flow_picture};
use project::Project;
use std::collections::VecDeque;

/// Number of small pictures and flows in memory: 120 MB at most.
const KEPT: usize = 40;

/// Motion of the interview, computed on demand.
pub struct Movement {
    project: Project,
    pictures: VecDeque<(usize, Encoded)>,
    /// None for a frame that does not follow.
    flows: VecDeque<([usize; 2], Option<Flow>)>,
}

impl Movement {
    pub fn from_project(project: Project) -> Self {
        Self { project, pictures: VecDeque::new(), flows: VecDeque::new() }
    }

    /// Adds the small picture of a frame that was already read.
    pub fn show(&mut self, frame: usize, picture: &Encoded) {
        if !self.pictures.iter().any(|(known, _)| *known == frame) {
            keep(&mut self.pictures, (frame, flow_picture(picture)));
        }
    }

    /// Positions of frame `from`'s pixels in frame `to`, chained over the frames between them; None if a frame
    /// between differs in size or does not follow the one before.
    ///
    /// # Errors
    /// When a frame cannot be read.
    pub fn between(&mut self, from: usize, to: usize) -> Result<Option<Flow>> {
        let mut whole: Option<Flow> = None;
        let mut at = from;
        while at != to {
            let next = if to > at { at + 1 } else { at - 1 };
            let Some(step) = self.step(at, next)? else { return Ok(None) };
            whole = Some(match whole {
                Some(so_far) => so_far.then(&step),
                None => step,
            });
            at = next;
        }
        Ok(whole)
    }

    fn step(&mut self, from: usize, to: usize) -> Result<Option<Flow>> {
        if let Some((_, flow)) = self.flows.iter().find(|(pair, _)| *pair == [from, to]) {
            return Ok(flow.clone());
        }
        let (here, there) = (self.picture(from)?, self.picture(to)?);
        if here.0.size() != there.0.size() {
            return Ok(None);
        }
        let flow = Some(Flow::between(&here, &there)).filter(Flow::follows);
        keep(&mut self.flows, ([from, to], flow.clone()));
        Ok(flow)
    }

    fn picture(&mut self, frame: usize) -> Result<Encoded> {
        if let Some((_, picture)) = self.pictures.iter().find(|(known, _)| *known == frame) {
            return Ok(picture.clone());
        }
        let picture = flow_picture(&read_picture(&self.project.frame_picture(frame))?);
        keep(&mut self.pictures, (frame, picture.clone()));
        Ok(picture)
    }
}

fn keep<T>(all: &mut VecDeque<T>, one: T) {
    if all.len() >= KEPT {
        all.pop_front();
    }
    all.push_back(one);
}
