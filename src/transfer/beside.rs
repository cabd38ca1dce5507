//! Frames before and after the one that is predicted, for light that is steady in time.

use crate::transfer::{Carried, Matched, Transfer};

use footage::Frame;
use imaging::Response;
use project::Project;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Matched frames that are kept: those that frames in order, of two threads, ask for again.
const KEPT: usize = 6;

/// The interview of a project, matched with its exemplars frame by frame.
#[derive(Debug)]
pub struct Beside {
    project: Project,
    response: Response,
    kept: Mutex<VecDeque<Arc<Matched>>>,
}

impl Beside {
    pub fn of(project: &Project, response: Response) -> Self {
        Self {
            project: project.clone(),
            response,
            kept: Mutex::default(),
        }
    }

    /// A frame carried over with what the frames before and after it say: the same alone and in a sequence. A frame that cannot
    /// be read says nothing.
    pub fn carry(&self, transfer: &Transfer, frame: &Frame) -> Carried {
        let own = self.kept(frame.index).filter(|kept| {
            let same = (&kept.frame.plate.pixels, &kept.frame.mask.pixels);
            same == (&frame.plate.pixels, &frame.mask.pixels)
        });
        let own = own.unwrap_or_else(|| self.keep(transfer, frame));
        let numbers = [frame.index.checked_sub(1), frame.index.checked_add(1)];
        let beside = numbers.into_iter().flatten().filter_map(|index| {
            self.kept(index).or_else(|| {
                let read = Frame::load(&self.project, &self.response, index).ok()?;
                Some(self.keep(transfer, &read))
            })
        });
        transfer.carry_beside(&own, &beside.collect::<Vec<_>>())
    }

    fn kept(&self, index: usize) -> Option<Arc<Matched>> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|kept| kept.frame.index == index).cloned()
    }

    fn keep(&self, transfer: &Transfer, frame: &Frame) -> Arc<Matched> {
        let matched = Arc::new(transfer.matched(frame));
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|kept| kept.frame.index != frame.index);
        if kept.len() >= KEPT {
            kept.pop_front();
        }
        kept.push_back(matched.clone());
        matched
    }
}
