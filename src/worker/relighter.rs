//! The thread that relights: it keeps the fields at hand and answers the newest [`PreviewRequest`], so that a
//! turn of the light is shown at once, whatever the network is doing.

use super::PredictedFrame;
use super::adaptive_resolution::ReducedFrame;
use super::cache::FieldCache;
use super::catch_panic::catch_panic;
use super::comparison::{self, Comparison};
use super::event::Event;
use super::latest::Latest;
use super::network::{ComparisonRequest, FoundComparison, FrameRequest, OpenedSource};
use super::srgb_picture::SrgbPicture;
use super::stage::Stage;
use base::error::{Error, Result};
use base::progress::Control;
use compositor::{CameraView, Extra, Ingredients, PassReport, Upstream, compose_reusing};
use imaging::resample::resize;
use imaging::{Encoded, Image};
use light::{Environment, Rig};
use scene::{Background, Output, Scene};
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// A picture that is smaller than it could be is made anew at its full size when nothing else was asked for so
/// long.
pub(super) const STILL: Duration = Duration::from_millis(120);

/// A picture that the window wants.
#[derive(Clone, Debug)]
pub struct PreviewRequest {
    /// Its output is a display whatever it says.
    pub scene: Scene,
    pub environment: Arc<Environment>,
    /// What is compared in place of the picture.
    pub first: Option<Comparison>,
    /// What it is compared with.
    pub second: Option<Comparison>,
    /// Lamps that light the subject alone, each as bright as half of an even light; none is the light.
    pub solo: Vec<usize>,
    /// Something is being dragged: a picture that is soon there is better than a sharp one.
    pub dragged: bool,
}

/// A relit picture, ready for a texture.
#[derive(Clone, Debug)]
pub struct PreviewPicture {
    /// What the picture shows. While a frame is being predicted, this is an older frame in the new
    /// light.
    pub scene: Scene,
    /// Name of the environment.
    pub environment: String,
    pub width: usize,
    pub height: usize,
    /// How many pixels along each axis were lit as one, while something was dragged; 1 in a picture that stays.
    pub coarse: usize,
    /// sRGB codes, three bytes a pixel, row by row.
    pub rgb: Vec<u8>,
    /// What is compared in its place, of the same size; where a scene asks for the difference, that to the
    /// second.
    pub first: Option<(Comparison, SrgbPicture)>,
    /// What it is compared with, of the same size.
    pub second: Option<(Comparison, SrgbPicture)>,
    /// Lamps that light the subject alone.
    pub solo: Vec<usize>,
    /// Scene-linear light of each pixel, premultiplied, where it is in memory at full size.
    pub linear: Option<Image>,
    /// What each lamp's picture was multiplied with.
    pub weights: Vec<[f32; 3]>,
    /// What ran and what did not.
    pub passes: Vec<PassReport>,
    /// What the frame's prediction took in milliseconds when it was made.
    pub predict_ms: f64,
    /// What relighting took in milliseconds, from the ask to the codes.
    pub relight_ms: f64,
    /// Share of the light's energy from where the rig has no lamp.
    pub uncovered: f32,
    /// The lamps.
    pub rig: Arc<Rig>,
    /// Frames whose field is at hand.
    pub frames_at_hand: HashSet<usize>,
    /// The frame and its field.
    pub predicted: Arc<PredictedFrame>,
}

/// The thread's ends of what connects it.
pub(super) struct Relighter<Tell> {
    pub asks: Arc<Latest<PreviewRequest>>,
    pub opened: Arc<Latest<OpenedSource>>,
    pub fields: Arc<Latest<Arc<PredictedFrame>>>,
    pub wanted: Arc<Latest<FrameRequest>>,
    /// For the first picture and the second.
    pub challenge: [Arc<Latest<ComparisonRequest>>; 2],
    pub rivals: [Arc<Latest<FoundComparison>>; 2],
    pub relit: Arc<Latest<Arc<PreviewPicture>>>,
    pub tell: Tell,
    pub stop: Control,
    pub cache: FieldCache,
    /// Asks the network's thread to open its source again.
    pub renew: Arc<Latest<()>>,
    /// What a picture may take in milliseconds while something is dragged.
    pub budget_ms: f64,
    /// How long a drag has to rest, see [`STILL`].
    pub rest: Duration,
}

/// One of the two pictures that are compared: the OLATs that were asked for elsewhere, and what was found.
#[derive(Default)]
struct ComparisonSlot {
    challenge: Option<ComparisonRequest>,
    rival: Option<Arc<PredictedFrame>>,
}

/// All that a picture is made of.
struct PreviewInputs {
    ask: PreviewRequest,
    shown: Arc<PredictedFrame>,
    rivals: [Option<Arc<PredictedFrame>>; 2],
    coarse: usize,
}

impl PreviewInputs {
    /// Whether this is the same picture, no coarser.
    fn serves(&self, other: &Self) -> bool {
        let rivals = |made: &Self| {
            made.rivals
                .each_ref()
                .map(|it| it.as_ref().map(Arc::as_ptr))
        };
        let rivals = rivals(self) == rivals(other);
        let environments = Arc::ptr_eq(&self.ask.environment, &other.ask.environment);
        let (mine, theirs) = (&self.ask, &other.ask);
        let asks = (&mine.scene, &mine.solo, &mine.first, &mine.second)
            == (&theirs.scene, &theirs.solo, &theirs.first, &theirs.second);
        self.coarse <= other.coarse
            && rivals
            && environments
            && asks
            && Arc::ptr_eq(&self.shown, &other.shown)
    }
}

fn scaled(weights: &[[f32; 3]], factor: f32) -> Vec<[f32; 3]> {
    let scaled = weights.iter().map(|weight| weight.map(|w| w * factor));
    scaled.collect()
}

impl<Tell: Fn(Event)> Relighter<Tell> {
    /// Works until it is stopped.
    pub fn run(mut self, bell: &Receiver<()>) {
        let mut generation = 0;
        let mut stage: Option<Stage> = None;
        let mut ask: Option<PreviewRequest> = None;
        let mut shown: Option<Arc<PredictedFrame>> = None;
        // The frame that the network was last sent for: one that fails is not sent for again until
        // another was wanted.
        let mut sent: Option<usize> = None;
        // What the newest picture shows: the same is not made again.
        let mut made: Option<PreviewInputs> = None;
        let mut sides: [ComparisonSlot; 2] = Default::default();
        loop {
            let coarse = made.as_ref().is_some_and(|made| made.coarse > 1);
            let wait = if coarse { self.rest } else { Duration::MAX };
            let settled = match bell.recv_timeout(wait) {
                Ok(()) => false,
                Err(RecvTimeoutError::Timeout) => true,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if self.stop.stopped() {
                break;
            }
            // In this order: a field that is here was put after the opening that it belongs to.
            let field = self.fields.take();
            if let Some(opened) = self.opened.take() {
                generation = opened.generation;
                self.cache = FieldCache::new(super::FIELD_BUDGET_BYTES);
                (sent, sides) = (None, Default::default());
                // Under the same lamps the picture stays, at its level, until the network that is at
                // hand now has predicted it.
                if stage.as_ref().is_none_or(|stage| stage.rig != opened.rig) {
                    stage = Some(Stage::new(opened.rig, self.budget_ms));
                    (shown, made) = (None, None);
                }
            }
            let mut fresh = None;
            if let Some(predicted) = field.filter(|field| field.generation == generation) {
                fresh = Some(predicted.frame.index);
                // Until the wanted frame is there, the first one that came stands in for it.
                shown.get_or_insert_with(|| predicted.clone());
                self.cache.insert(predicted);
            }
            for (side, found) in sides.iter_mut().zip(&self.rivals) {
                let found = found.take();
                let found = found.filter(|found| side.challenge.as_ref() == Some(&found.of));
                side.rival = found.map(|it| it.found).or(side.rival.take());
            }
            ask = self.asks.take().or(ask);
            let (Some(stage), Some(ask)) = (&mut stage, &ask) else {
                continue;
            };
            let started = Instant::now();
            let wanted = ask.scene.frame;
            if let Some(field) = self.cache.get(wanted) {
                shown = Some(field);
                sent = None;
            } else {
                // The nearest stands in for it.
                shown = self.cache.nearest(wanted).or(shown);
                if sent != Some(wanted) {
                    sent = Some(wanted);
                    self.wanted.put(FrameRequest {
                        generation,
                        frame: wanted,
                    });
                }
            }
            let Some(current) = &shown else { continue };
            let scene = Scene {
                frame: current.frame.index,
                output: Output::Display,
                ..ask.scene.clone()
            };
            for (i, second) in [&ask.first, &ask.second].into_iter().enumerate() {
                let side = &mut sides[i];
                let Some(Comparison::Olats(of)) = second else {
                    *side = ComparisonSlot::default();
                    continue;
                };
                let wanted = ComparisonRequest {
                    generation,
                    source: of.clone(),
                    frame: current.frame.index,
                };
                if side.challenge.as_ref() != Some(&wanted) {
                    side.rival = None;
                    side.challenge = Some(wanted.clone());
                    self.challenge[i].put(wanted);
                }
            }
            let making = PreviewInputs {
                ask: PreviewRequest {
                    scene: scene.clone(),
                    ..ask.clone()
                },
                shown: current.clone(),
                rivals: sides.each_ref().map(|side| side.rival.clone()),
                // What is compared has its full size, and so has what it is compared with.
                coarse: if ask.dragged && !settled && ask.first.is_none() && ask.second.is_none() {
                    stage.resolution.factor()
                } else {
                    1
                },
            };
            if made.as_ref().is_some_and(|made| made.serves(&making)) {
                continue;
            }
            let predict_ms = (fresh == Some(current.frame.index)).then_some(current.ms);
            let relit = catch_panic(|| self.relight(stage, &making, predict_ms, started));
            made = Some(PreviewInputs {
                coarse: relit.as_ref().map_or(1, |relit| relit.coarse),
                ..making
            });
            match relit {
                Ok(relit) => self.relit.put(Arc::new(relit)),
                Err(e) => {
                    (self.tell)(Event::Failed {
                        sentence: e.to_string(),
                    });
                    if matches!(e, Error::GpuLost) {
                        // Whatever is at hand is there. The network's thread finds another device.
                        self.cache = FieldCache::new(super::FIELD_BUDGET_BYTES);
                        *stage = Stage::new(stage.rig.clone(), self.budget_ms);
                        (shown, made) = (None, None);
                        sides = Default::default();
                        self.renew.put(());
                    }
                }
            }
        }
    }

    fn relight(
        &self,
        stage: &mut Stage,
        making: &PreviewInputs,
        predict_ms: Option<f64>,
        started: Instant,
    ) -> Result<PreviewPicture> {
        let PreviewInputs {
            ask, shown, rivals, ..
        } = making;
        let mut scene = ask.scene.clone();
        let weights_ms = stage.light(&ask.environment, &scene, shown)?;
        let first = stage.compared(ask, 0, shown, rivals[0].as_deref())?;
        let second = stage.compared(ask, 1, shown, rivals[1].as_deref())?;
        let identity = stage.begin(shown, &scene);
        let Stage {
            rig,
            light,
            grain,
            steady,
            reuse,
            resolution,
            ..
        } = stage;
        let Some(light) = light else {
            return Err(Error::Cancelled {
                kept: "no light was found".into(),
            });
        };
        let solo = (!ask.solo.is_empty()).then(|| light.solo(&ask.solo));
        if solo.is_some() {
            scene.background = Background::None;
        }
        let weights = solo.as_ref().unwrap_or(&light.weights);
        let (width, height) = shown.frame.mask.size();
        let small = match making.coarse {
            1 => None,
            factor => resolution.small(shown, factor),
        };
        let (coarse, field, mask, reuse) = match small {
            Some(ReducedFrame {
                field, mask, reuse, ..
            }) => (making.coarse, &*field, &*mask, reuse),
            None => (1, &*shown.field, &shown.frame.mask, reuse),
        };
        let composed = Instant::now();
        let picture = compose_reusing(
            &scene,
            &Ingredients {
                field,
                mask,
                weights,
                environment: &light.environment,
                levels: light.levels,
                view: CameraView::default(),
                upstream: Upstream {
                    predict_ms,
                    weights_ms,
                },
                extra: Extra {
                    before: steady.as_ref(),
                    grain: grain.as_ref().map(|(_, grain)| grain),
                    second: second.as_ref().map(|(_, picture)| picture),
                    identity,
                },
            },
            reuse,
        )?;
        let display = picture.display.as_ref().map(|display| match coarse {
            1 => SrgbPicture::of(display),
            _ => SrgbPicture::of(&Encoded(resize(&display.0, width, height))),
        });
        if coarse == 1 {
            *steady = picture.steady;
        }
        resolution.took(coarse, composed.elapsed().as_secs_f64() * 1e3);
        Ok(PreviewPicture {
            scene: ask.scene.clone(),
            first: comparison::differing(first, second.as_ref(), &scene)?,
            second: second.map(|(of, picture)| (of, SrgbPicture::of(&picture))),
            solo: ask.solo.clone(),
            weights: scaled(&weights.per_lamp, light.levels.subject),
            environment: light.environment.name.clone(),
            width,
            height,
            coarse,
            rgb: display.map_or_else(Vec::new, |codes| codes.rgb),
            linear: picture.linear.filter(|_| coarse == 1),
            passes: picture.passes,
            predict_ms: shown.ms,
            relight_ms: started.elapsed().as_secs_f64() * 1e3,
            uncovered: light.weights.uncovered,
            rig: rig.clone(),
            frames_at_hand: self.cache.indices().collect(),
            predicted: shown.clone(),
        })
    }
}
