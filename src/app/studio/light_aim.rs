//! Light by the face: the direction of a light that falls on a point of the picture, the lamp that does, and the points
//! on which the existing lights fall. All are computed in the background, since fields on a GPU take time.

use base::error::Result;
use glam::Vec3;
use light::Rig;
use light::aim::{LampResponses, NoAim};
use light::highlight::Highlights;
use std::sync::{Arc, Mutex, PoisonError};
use worker::{Lookup, PredictedFrame};

/// A point of a picture, and the drag that brought the pointer there.
#[derive(Clone)]
pub struct AimQuestion {
    pub of: Arc<PredictedFrame>,
    pub rig: Arc<Rig>,
    /// Column and row; None outside the picture.
    pub pixel: Option<[usize; 2]>,
    /// Number of the drag.
    pub drag: u64,
}

impl AimQuestion {
    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.of, &other.of) && (self.pixel, self.drag) == (other.pixel, other.drag)
    }
}

/// A frame whose highlights are requested.
#[derive(Clone)]
struct HighlightQuestion {
    of: Arc<PredictedFrame>,
    rig: Arc<Rig>,
}

/// Lamp responses of the newest requested frame, for a whole drag and for both kinds of requests.
type Known = Arc<Mutex<Option<(Arc<PredictedFrame>, Arc<LampResponses>)>>>;

fn responses(known: &Known, of: &Arc<PredictedFrame>, rig: &Rig) -> Result<Arc<LampResponses>> {
    let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((frame, responses)) = &*known
        && Arc::ptr_eq(frame, of)
    {
        return Ok(responses.clone());
    }
    let found = Arc::new(of.responses(rig)?);
    *known = Some((of.clone(), found.clone()));
    Ok(found)
}

/// The newest request of each kind, and the threads that answer them.
#[derive(Default)]
pub struct LightAim {
    known: Known,
    lookup: Option<Lookup<AimQuestion, std::result::Result<Vec3, NoAim>>>,
    asked: Option<AimQuestion>,
    /// Reason that the newest request has no answer.
    refusal: Option<NoAim>,
    proposer: Option<Lookup<AimQuestion, std::result::Result<usize, NoAim>>>,
    /// The requested point, and the newest known lamp.
    pointed: Option<AimQuestion>,
    proposed: Option<usize>,
    seeker: Option<Lookup<HighlightQuestion, Arc<Highlights>>>,
    sought: Option<Arc<PredictedFrame>>,
    highlights: Option<(Arc<PredictedFrame>, Arc<Highlights>)>,
}

impl LightAim {
    /// Requests the direction for a point, instead of the previous request.
    pub fn ask(&mut self, question: AimQuestion, wake: impl Fn() + Send + 'static) {
        if self.asked.as_ref().is_some_and(|asked| asked.is(&question)) {
            return;
        }
        let known = self.known.clone();
        let lookup = self.lookup.get_or_insert_with(|| {
            Lookup::start(wake, move |AimQuestion { of, rig, pixel, .. }| {
                let Some(pixel) = pixel.and_then(|pixel| of.working_pixel(pixel)) else {
                    return Ok(Err(NoAim::Outside));
                };
                Ok(responses(&known, of, rig)?.aim(pixel))
            })
        });
        lookup.ask(question.clone());
        self.asked = Some(question);
    }

    /// Requests the lamp that falls on a point.
    pub fn point(&mut self, question: AimQuestion, wake: impl Fn() + Send + 'static) {
        if (self.pointed.as_ref()).is_some_and(|pointed| pointed.is(&question)) {
            return;
        }
        let known = self.known.clone();
        let proposer = self.proposer.get_or_insert_with(|| {
            Lookup::start(wake, move |AimQuestion { of, rig, pixel, .. }| {
                let Some(pixel) = pixel.and_then(|pixel| of.working_pixel(pixel)) else {
                    return Ok(Err(NoAim::Outside));
                };
                Ok(responses(&known, of, rig)?.lamp(pixel))
            })
        });
        proposer.ask(question.clone());
        self.pointed = Some(question);
    }

    /// Index in the rig of the lamp that falls on the last requested point, or on a point shortly before it.
    pub fn proposed(&self) -> Option<usize> {
        self.proposed
    }

    /// Requests the points on which lights fall in a frame.
    pub fn seek(
        &mut self,
        of: &Arc<PredictedFrame>,
        rig: &Arc<Rig>,
        wake: impl Fn() + Send + 'static,
    ) {
        if self.sought.as_ref().is_some_and(|sought| Arc::ptr_eq(sought, of)) {
            return;
        }
        let known = self.known.clone();
        let seeker = self.seeker.get_or_insert_with(|| {
            Lookup::start(wake, move |HighlightQuestion { of, rig }| {
                Ok(Arc::new(Highlights::of(&*responses(&known, of, rig)?)))
            })
        });
        seeker.ask(HighlightQuestion { of: of.clone(), rig: rig.clone() });
        self.sought = Some(of.clone());
    }

    /// Positions of the lights in a frame; None until found.
    pub fn highlights(&self, of: &Arc<PredictedFrame>) -> Option<&Highlights> {
        let (found, highlights) = self.highlights.as_ref()?;
        Arc::ptr_eq(found, of).then_some(&**highlights)
    }

    /// Directions found since the last call, with their requests, and the error of the newest request, if it failed.
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
        for (_, answer) in self.proposer.iter().flat_map(Lookup::answers) {
            match answer {
                Ok(lamp) => self.proposed = lamp.ok(),
                Err(e) => failure = Some(e.to_string()),
            }
        }
        for (question, answer) in self.seeker.iter().flat_map(Lookup::answers) {
            match answer {
                Ok(highlights) => self.highlights = Some((question.of, highlights)),
                Err(e) => failure = Some(e.to_string()),
            }
        }
        (found, failure)
    }

    /// Reason that the newest request has no answer.
    pub fn refusal(&self) -> Option<NoAim> {
        self.refusal
    }

    /// Drops everything, since a frame's pictures under each lamp take memory.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}
