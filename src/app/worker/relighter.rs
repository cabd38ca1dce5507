//! The thread that relights: keeps predicted frames in memory and answers the newest [`PreviewRequest`]. A turn
//! of the light is shown at once, whatever the network is doing.

use super::background::Handler;
use super::cache::FieldCache;
use super::comparison::Comparison;
use super::event::Event;
use super::latest::Latest;
use super::mailbox::Mailbox;
use super::messages::{
    ComparisonRequest, FoundComparison, FrameRequest, NetworkRequest, OpenedSource, RelighterRequest,
};
use super::prediction::PredictedFrame;
use super::preview::{PreviewInputs, PreviewPicture, PreviewRequest};
use super::preview_maker::PreviewMaker;
use base::error::{Error, Result};
use light::Rig;
use scene::{Output, Scene};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time without requests after which a reduced picture is made again at full size.
pub(super) const STILL: Duration = Duration::from_millis(120);

/// Memory for reflectance fields: about 130 frames of 41 lamps at 128 pixels, or 8 at 512.
const FIELD_BUDGET_BYTES: usize = 1 << 30;

/// State of the thread, and its ends of the connections.
pub(super) struct Relighter<Tell> {
    network: Arc<Mailbox<NetworkRequest>>,
    pictures: Arc<Latest<Arc<PreviewPicture>>>,
    tell: Tell,
    /// Time budget of a picture while something moves, in milliseconds.
    budget_ms: f64,
    /// Rest time of a drag, see [`STILL`].
    still: Duration,
    cache: FieldCache,
    /// Number of the source's current opening.
    generation: u64,
    /// None until a source was opened.
    maker: Option<PreviewMaker>,
    request: Option<PreviewRequest>,
    /// Frame of the pictures.
    shown: Option<Arc<PredictedFrame>>,
    /// Frame last requested from the network. A failed one is requested again only after another.
    asked: Option<usize>,
    /// Frame predicted since the last picture.
    fresh: Option<usize>,
    compared: [AskedOlats; 2],
    /// Inputs of the newest picture; an identical one is not made again.
    made: Option<PreviewInputs>,
    /// True if there was news since the last picture.
    changed: bool,
}

/// One side of a comparison: the requested OLATs, and those that were found.
#[derive(Default)]
struct AskedOlats {
    asked: Option<ComparisonRequest>,
    found: Option<Arc<PredictedFrame>>,
}

impl<Tell> Relighter<Tell> {
    /// Creates a relighter without a source. `budget_ms` is the time budget of a picture in milliseconds while
    /// something moves; a coarse one is made again at full size after `still` without requests.
    pub fn new(
        network: Arc<Mailbox<NetworkRequest>>,
        pictures: Arc<Latest<Arc<PreviewPicture>>>,
        tell: Tell,
        budget_ms: f64,
        still: Duration,
    ) -> Self {
        Self {
            network,
            pictures,
            tell,
            budget_ms,
            still,
            cache: FieldCache::new(FIELD_BUDGET_BYTES),
            generation: 0,
            maker: None,
            request: None,
            shown: None,
            asked: None,
            fresh: None,
            compared: Default::default(),
            made: None,
            changed: false,
        }
    }

    fn opened(&mut self, opened: &OpenedSource) {
        self.generation = opened.generation;
        self.cache.clear();
        self.asked = None;
        self.compared = Default::default();
        // With the same lamps the picture stays, at its level, until the current network has predicted it.
        let known = self.maker.as_ref().map(PreviewMaker::rig);
        if known != Some(&opened.rig) {
            self.forget_pictures(opened.rig.clone());
        }
    }

    fn forget_pictures(&mut self, rig: Arc<Rig>) {
        self.maker = Some(PreviewMaker::new(rig, self.budget_ms));
        (self.shown, self.made) = (None, None);
    }

    /// Drops all frames in memory after the device was lost. The network's thread finds another device.
    fn forget_device(&mut self) {
        self.cache.clear();
        self.compared = Default::default();
        if let Some(maker) = &self.maker {
            self.forget_pictures(maker.rig().clone());
        }
        self.network.put(NetworkRequest::Open);
    }

    fn predicted(&mut self, predicted: &Arc<PredictedFrame>) {
        if predicted.generation != self.generation {
            return;
        }
        self.fresh = Some(predicted.frame.index);
        // The first frame that arrives is shown until the requested one is there.
        self.shown.get_or_insert_with(|| predicted.clone());
        self.cache.insert(predicted.clone());
    }

    fn found(&mut self, side: usize, comparison: &FoundComparison) {
        let compared = &mut self.compared[side];
        if compared.asked.as_ref() == Some(&comparison.of) {
            compared.found = Some(comparison.found.clone());
        }
    }

    /// Returns all inputs of the requested picture, and requests missing ones from the network. None while there
    /// is no frame to show.
    fn inputs(&mut self, rested: bool) -> Option<PreviewInputs> {
        let (maker, request) = (self.maker.as_ref()?, self.request.as_ref()?);
        let coarse = maker.coarse();
        let wanted = request.scene.frame;
        if let Some(predicted) = self.cache.get(wanted) {
            self.shown = Some(predicted);
            self.asked = None;
        } else {
            // The nearest frame is shown meanwhile.
            self.shown = self.cache.nearest(wanted).or(self.shown.take());
            if self.asked.replace(wanted) != Some(wanted) {
                self.network.put(NetworkRequest::Predict(FrameRequest { generation: self.generation, frame: wanted }));
            }
        }
        let predicted = self.shown.clone()?;
        let frame = predicted.frame.index;
        let comparisons = [&request.first, &request.second];
        for (side, comparison) in comparisons.into_iter().enumerate() {
            let compared = &mut self.compared[side];
            let Some(Comparison::Olats(source)) = comparison else {
                *compared = AskedOlats::default();
                continue;
            };
            let wanted = ComparisonRequest { generation: self.generation, source: source.clone(), frame };
            if compared.asked.as_ref() != Some(&wanted) {
                *compared = AskedOlats { asked: Some(wanted.clone()), found: None };
                self.network.put(NetworkRequest::Compare(side, wanted));
            }
        }
        // Both sides of a comparison have full size.
        let alone =
            comparisons.iter().all(|comparison| comparison.is_none()) && request.looks.iter().all(Option::is_none);
        let draft = request.moving && !rested && alone;
        Some(PreviewInputs {
            request: PreviewRequest {
                scene: Scene { frame, output: Output::Display, ..request.scene.clone() },
                ..request.clone()
            },
            predicted,
            olats: self.compared.each_ref().map(|side| side.found.clone()),
            coarse: if draft { coarse } else { 1 },
            draft,
            in_memory: rested || !request.texture,
        })
    }

    /// Makes the requested picture. If the last one fits but is only on the GPU, its codes are read back instead.
    fn relight(&mut self, rested: bool) -> Result<Option<PreviewPicture>> {
        let started = Instant::now();
        self.changed = false;
        let Some(inputs) = self.inputs(rested) else { return Ok(None) };
        let fresh = self.fresh.take();
        let Some(maker) = &mut self.maker else { return Ok(None) };
        if self.made.as_ref().is_some_and(|made| made.serves(&inputs)) {
            let read = if inputs.in_memory { maker.read()? } else { None };
            return Ok(read.map(|picture| self.with_frames(picture)));
        }
        // A failed picture is not tried again.
        let made = self.made.insert(PreviewInputs { coarse: 1, draft: false, ..inputs.clone() });
        let predicted = &inputs.predicted;
        let predict_ms = (fresh == Some(predicted.frame.index)).then_some(predicted.ms);
        let picture = maker.make(&inputs, predict_ms, started)?;
        (made.coarse, made.draft) = (picture.coarse, picture.draft);
        Ok(Some(self.with_frames(picture)))
    }

    fn with_frames(&self, picture: PreviewPicture) -> PreviewPicture {
        PreviewPicture { frames_at_hand: self.cache.indices().collect(), ..picture }
    }
}

impl<Tell: Fn(Event)> Handler for Relighter<Tell> {
    type Request = RelighterRequest;
    type Answer = Option<PreviewPicture>;

    fn work(&mut self, request: &mut RelighterRequest) -> Result<Option<PreviewPicture>> {
        match request {
            RelighterRequest::Opened(opened) => self.opened(opened),
            RelighterRequest::Predicted(predicted) => self.predicted(predicted),
            RelighterRequest::Compared(side, comparison) => self.found(*side, comparison),
            RelighterRequest::Show(request) => self.request = Some((**request).clone()),
            RelighterRequest::Relight { rested } => return self.relight(*rested),
        }
        self.changed = true;
        Ok(None)
    }

    fn deliver(&mut self, _: RelighterRequest, answer: Result<Option<PreviewPicture>>) {
        match answer {
            Ok(Some(picture)) => self.pictures.put(Arc::new(picture)),
            Ok(None) => {}
            Err(e) => {
                (self.tell)(Event::Failed { sentence: e.to_string() });
                if matches!(e, Error::GpuLost) {
                    self.forget_device();
                }
            }
        }
    }

    /// A picture is made when no messages wait. At rest, a rough one is made again at full size, and one that is
    /// only on the GPU is read back.
    fn rest(&self) -> Option<(Duration, RelighterRequest)> {
        let made = self.made.as_ref();
        let rough = made.is_some_and(|made| made.coarse > 1 || made.draft);
        let unread = self.maker.as_ref().is_some_and(PreviewMaker::is_unread);
        match (self.changed, rough || unread) {
            (true, _) => Some((Duration::ZERO, RelighterRequest::Relight { rested: false })),
            (false, true) => Some((self.still, RelighterRequest::Relight { rested: true })),
            (false, false) => None,
        }
    }
}

#[cfg(test)]
#[path = "relighter_tests.rs"]
mod tests;
