//! Light by the face: the direction of a light that falls on a point of the picture, the lamp that does, and the points
//! on which the existing lights fall. All are computed in the background, since fields on a GPU take time.

use base::error::Result;
use glam::Vec3;
use light::Rig;
use light::aim::{LampResponses, NoAim};
use light::highlight::Highlights;
use std::sync::{Arc, Mutex, PoisonError};
use worker::{PredictedFrame, Query};

/// A point of a picture, and the drag that brought the pointer there.
#[derive(Clone, PartialEq)]
pub struct AimQuestion {
    pub of: Arc<PredictedFrame>,
    pub rig: Arc<Rig>,
    /// Column and row; None outside the picture.
    pub pixel: Option<[usize; 2]>,
    /// Number of the drag.
    pub drag: u64,
}

/// A frame whose highlights are requested.
#[derive(Clone, PartialEq)]
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

impl AimQuestion {
    fn answer<T>(
        &self,
        known: &Known,
        find: impl Fn(&LampResponses, [usize; 2]) -> std::result::Result<T, NoAim>,
    ) -> Result<std::result::Result<T, NoAim>> {
        match self.pixel.and_then(|pixel| self.of.working_pixel(pixel)) {
            Some(pixel) => Ok(find(&*responses(known, &self.of, &self.rig)?, pixel)),
            None => Ok(Err(NoAim::Outside)),
        }
    }
}

/// The query of each kind, and the newest answers.
#[derive(Default)]
pub struct LightAim {
    known: Known,
    directions: Query<AimQuestion, std::result::Result<Vec3, NoAim>>,
    /// Reason that the newest request has no answer.
    refusal: Option<NoAim>,
    lamps: Query<AimQuestion, std::result::Result<usize, NoAim>>,
    /// The newest known lamp.
    proposed: Option<usize>,
    seeker: Query<HighlightQuestion, Highlights>,
    highlights: Option<(Arc<PredictedFrame>, Highlights)>,
}

impl LightAim {
    /// Requests the direction for a point, instead of the previous request.
    pub fn ask(&mut self, question: AimQuestion, wake: impl Fn() + Send + 'static) {
        let known = self.known.clone();
        self.directions
            .ask(question, wake, |_| move |question: &AimQuestion| question.answer(&known, LampResponses::aim));
    }

    /// Requests the lamp that falls on a point.
    pub fn point(&mut self, question: AimQuestion, wake: impl Fn() + Send + 'static) {
        let known = self.known.clone();
        self.lamps.ask(question, wake, |_| move |question: &AimQuestion| question.answer(&known, LampResponses::lamp));
    }

    /// Index in the rig of the lamp that falls on the last requested point, or on a point shortly before it.
    pub fn proposed(&self) -> Option<usize> {
        self.proposed
    }

    /// Requests the points on which lights fall in a frame.
    pub fn seek(&mut self, of: &Arc<PredictedFrame>, rig: &Arc<Rig>, wake: impl Fn() + Send + 'static) {
        let known = self.known.clone();
        let question = HighlightQuestion { of: of.clone(), rig: rig.clone() };
        self.seeker.ask(question, wake, |_| {
            move |HighlightQuestion { of, rig }: &HighlightQuestion| {
                Ok(Highlights::from_responses(&*responses(&known, of, rig)?))
            }
        });
    }

    /// Positions of the lights in a frame; None until found.
    pub fn highlights(&self, of: &Arc<PredictedFrame>) -> Option<&Highlights> {
        let (found, highlights) = self.highlights.as_ref()?;
        Arc::ptr_eq(found, of).then_some(highlights)
    }

    /// Directions found since the last call, with their requests, and the error of the newest request, if it failed.
    pub fn receive(&mut self) -> (Vec<(AimQuestion, Vec3)>, Option<String>) {
        let (mut found, mut failure) = (Vec::new(), None);
        for (question, answer) in self.directions.answers() {
            failure = None;
            match answer {
                Ok(Ok(direction)) => {
                    self.refusal = None;
                    found.push((question, direction));
                }
                Ok(Err(none)) => self.refusal = Some(none),
                Err(sentence) => failure = Some(sentence),
            }
        }
        for (_, answer) in self.lamps.answers() {
            match answer {
                Ok(lamp) => self.proposed = lamp.ok(),
                Err(sentence) => failure = Some(sentence),
            }
        }
        for (question, answer) in self.seeker.answers() {
            match answer {
                Ok(highlights) => self.highlights = Some((question.of, highlights)),
                Err(sentence) => failure = Some(sentence),
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
