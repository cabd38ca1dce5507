//! Light by the face: which direction a light comes from that falls on a point of the picture. It is found in the
//! background: a field on a GPU takes time.

use glam::Vec3;
use light::Rig;
use light::aim::{LampResponses, NoAim};
use std::sync::Arc;
use worker::{Lookup, PredictedFrame};

/// A point of a picture, and the drag that brought the pointer there.
#[derive(Clone)]
pub struct AimQuestion {
    pub of: Arc<PredictedFrame>,
    pub rig: Arc<Rig>,
    /// Column and row; None beside the picture.
    pub pixel: Option<[usize; 2]>,
    /// Number of the drag.
    pub drag: u64,
}

impl AimQuestion {
    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.of, &other.of) && (self.pixel, self.drag) == (other.pixel, other.drag)
    }
}

/// Finds directions. What is known of a frame serves a whole drag.
fn finder() -> impl FnMut(&AimQuestion) -> base::error::Result<Result<Vec3, NoAim>> + Send {
    let mut known: Option<(Arc<PredictedFrame>, LampResponses)> = None;
    move |AimQuestion { of, rig, pixel, .. }| {
        let Some(pixel) = pixel.and_then(|pixel| of.working_pixel(pixel)) else {
            return Ok(Err(NoAim::Outside));
        };
        let same = known.take().filter(|(frame, _)| Arc::ptr_eq(frame, of));
        let (_, responses) = match same {
            Some(same) => known.insert(same),
            None => known.insert((of.clone(), of.responses(rig)?)),
        };
        Ok(responses.aim(pixel))
    }
}

/// The newest question, and the thread that answers it.
#[derive(Default)]
pub struct LightAim {
    lookup: Option<Lookup<AimQuestion, Result<Vec3, NoAim>>>,
    asked: Option<AimQuestion>,
    /// Why the newest question has no answer.
    refusal: Option<NoAim>,
}

impl LightAim {
    /// Asks in place of what was asked before.
    pub fn ask(&mut self, question: AimQuestion, wake: impl Fn() + Send + 'static) {
        if self.asked.as_ref().is_some_and(|asked| asked.is(&question)) {
            return;
        }
        let lookup = (self.lookup).get_or_insert_with(|| Lookup::start(wake, finder()));
        lookup.ask(question.clone());
        self.asked = Some(question);
    }

    /// Directions that were found since the last call, with their questions, and why the newest could not be looked for.
    pub fn receive(&mut self) -> (Vec<(AimQuestion, Vec3)>, Option<String>) {
        let (mut found, mut failure) = (Vec::new(), None);
        for (question, answer) in self.lookup.iter().flat_map(Lookup::answers) {
            failure = None;
            match answer {
                Ok(Ok(direction)) => {
                    self.refusal = None;
                    found.push((question, direction));
                }
                Ok(Err(none)) => self.refusal = Some(none),
                Err(e) => failure = Some(e.to_string()),
            }
        }
        (found, failure)
    }

    /// Why the newest question has no answer.
    pub fn refusal(&self) -> Option<NoAim> {
        self.refusal
    }

    /// Forgets everything: a frame's pictures under each lamp take memory.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}
