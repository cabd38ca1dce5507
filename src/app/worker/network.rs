//! The thread that owns the network: predicts the newest requested frame, and switches to a newer network when a
//! job saves one.

use super::background::Handler;
use super::event::{Blocked, Event};
use super::mailbox::Mailbox;
use super::messages::{
    ComparisonRequest, FoundComparison, FrameRequest, NetworkRequest, OpenedSource, RelighterRequest,
};
use super::prediction::PredictedFrame;
use super::source::Source;
use base::error::{Error, Result};
use std::sync::Arc;
use std::time::Instant;

/// State of the thread, and its ends of the connections.
pub(super) struct Network<Open, Tell> {
    open: Open,
    source: Option<Source>,
    /// Number of sources opened so far.
    generation: u64,
    own: Arc<Mailbox<NetworkRequest>>,
    relighter: Arc<Mailbox<RelighterRequest>>,
    tell: Tell,
}

/// Result of a request.
pub(super) enum Done {
    Opened(OpenedSource, String),
    Blocked(Blocked),
    Predicted(PredictedFrame),
    Compared(usize, FoundComparison),
    /// Meant for an older network; requested again if still needed.
    Outdated,
}

impl<Open, Tell> Network<Open, Tell> {
    /// Creates the thread's state, with no network open.
    pub fn new(
        open: Open,
        own: Arc<Mailbox<NetworkRequest>>,
        relighter: Arc<Mailbox<RelighterRequest>>,
        tell: Tell,
    ) -> Self {
        Self { open, source: None, generation: 0, own, relighter, tell }
    }

    /// The source, if it belongs to this generation.
    fn source(&mut self, generation: u64) -> Option<&mut Source> {
        self.source.as_mut().filter(|_| generation == self.generation)
    }

    fn predict(&mut self, request: FrameRequest) -> Result<Done> {
        let Some(source) = self.source(request.generation) else { return Ok(Done::Outdated) };
        let started = Instant::now();
        let predicted = (source.predict)(request.frame)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let predicted = PredictedFrame::new(predicted, request.generation, ms);
        Ok(Done::Predicted(predicted))
    }

    fn compare(&mut self, side: usize, of: &ComparisonRequest) -> Result<Done> {
        let Some(source) = self.source(of.generation) else { return Ok(Done::Outdated) };
        let started = Instant::now();
        let found = (source.comparison)(&of.source, of.frame)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let found = Arc::new(PredictedFrame::new(found, of.generation, ms));
        let request = of.clone();
        Ok(Done::Compared(side, FoundComparison { of: request, found }))
    }
}

impl<Open, Tell> Handler for Network<Open, Tell>
where
    Open: FnMut() -> std::result::Result<Source, Blocked>,
    Tell: Fn(Event) + Clone + Send + 'static,
{
    type Request = NetworkRequest;
    type Answer = Done;

    fn work(&mut self, request: &mut NetworkRequest) -> Result<Done> {
        match request {
            NetworkRequest::Open => {
                if self.source.is_none() {
                    (self.tell)(Event::Opening);
                }
                let mut source = match (self.open)() {
                    Ok(source) => source,
                    Err(blocked) => return Ok(Done::Blocked(blocked)),
                };
                self.generation += 1;
                let opened = OpenedSource { generation: self.generation, rig: Arc::new(source.rig.clone()) };
                if let Some(later) = source.later.take() {
                    let (own, tell) = (self.own.clone(), self.tell.clone());
                    std::thread::spawn(move || match later() {
                        Ok(true) => own.put(NetworkRequest::Open),
                        Ok(false) => {}
                        Err(e) => tell(Event::Failed { sentence: e.to_string() }),
                    });
                }
                let device = source.device.clone();
                self.source = Some(source);
                Ok(Done::Opened(opened, device))
            }
            NetworkRequest::Predict(request) => self.predict(*request),
            NetworkRequest::Compare(side, of) => self.compare(*side, of),
        }
    }

    fn deliver(&mut self, request: NetworkRequest, answer: Result<Done>) {
        let failed = |sentence| (self.tell)(Event::Failed { sentence });
        match answer {
            Ok(Done::Opened(opened, device)) => {
                self.relighter.put(RelighterRequest::Opened(opened));
                (self.tell)(Event::Ready { device });
            }
            Ok(Done::Predicted(frame)) => {
                self.relighter.put(RelighterRequest::Predicted(Arc::new(frame)));
            }
            Ok(Done::Compared(side, found)) => {
                self.relighter.put(RelighterRequest::Compared(side, found));
            }
            Ok(Done::Outdated) => {}
            // An earlier source stays in use.
            Ok(Done::Blocked(blocked)) if self.source.is_some() => failed(blocked.sentence),
            Ok(Done::Blocked(blocked)) => (self.tell)(Event::Blocked(blocked)),
            Err(e) if matches!(request, NetworkRequest::Open) && self.source.is_none() => {
                (self.tell)(Event::Blocked(Blocked { sentence: e.to_string(), need: None }));
            }
            Err(e) => {
                failed(e.to_string());
                // Another device is needed. Requests that are still needed are made again.
                if matches!(e, Error::GpuLost) && !matches!(request, NetworkRequest::Open) {
                    self.own.put(NetworkRequest::Open);
                }
            }
        }
    }
}
