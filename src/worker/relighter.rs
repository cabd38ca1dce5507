//! The thread that relights: it keeps the fields at hand and answers the newest [`Ask`], so that a
//! turn of the light is shown at once, whatever the network is doing.

use super::PredictedFrame;
use super::cache::FieldCache;
use super::event::Event;
use super::latest::Latest;
use super::network::{Opened, Wanted};
use crate::compositor::{CameraView, Ingredients, Levels, PassReport, Upstream, compose};
use crate::error::Result;
use crate::imaging::Image;
use crate::imaging::color::byte_from_unit;
use crate::light::weights::{Partition, Weighting};
use crate::light::{Environment, LightWeights, Rig, YawTable};
use crate::progress::Control;
use crate::scene::{Output, Scene};
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// A picture that the window wants.
#[derive(Clone, Debug)]
pub struct Ask {
    /// Its output is a display whatever it says.
    pub scene: Scene,
    pub environment: Arc<Environment>,
}

/// A relit picture, ready for a texture.
#[derive(Clone, Debug)]
pub struct Relit {
    /// What the picture shows. While a frame is being predicted, this is an older frame in the new
    /// light.
    pub scene: Scene,
    /// Name of the environment.
    pub environment: String,
    pub width: usize,
    pub height: usize,
    /// sRGB codes, three bytes a pixel, row by row.
    pub rgb: Vec<u8>,
    /// What ran and what did not.
    pub passes: Vec<PassReport>,
    /// What the frame's prediction took in milliseconds when it was made.
    pub predict_ms: f64,
    /// What relighting took in milliseconds, from the ask to the codes.
    pub relight_ms: f64,
    /// Share of the environment's energy from where the rig has no lamp.
    pub uncovered: f32,
    /// Frames whose field is at hand.
    pub frames_at_hand: HashSet<usize>,
}

/// The thread's ends of what connects it.
pub(super) struct Relighter<Tell> {
    pub asks: Arc<Latest<Ask>>,
    pub opened: Arc<Latest<Opened>>,
    pub fields: Arc<Latest<Arc<PredictedFrame>>>,
    pub wanted: Arc<Latest<Wanted>>,
    pub relit: Arc<Latest<Arc<Relit>>>,
    pub tell: Tell,
    pub stop: Control,
    pub cache: FieldCache,
}

/// What the thread knows of the light.
struct Light {
    environment: Arc<Environment>,
    /// Its weights at every yaw: a turn is a look-up.
    yaws: YawTable,
    levels: Levels,
    yaw_deg: f32,
    weights: LightWeights,
}

/// What the thread knows of the shoot.
struct Stage {
    rig: Arc<Rig>,
    partition: Partition,
    /// The first frame that was predicted: it sets the level of every light for the whole session.
    reference: Option<Arc<PredictedFrame>>,
    light: Option<Light>,
}

impl<Tell: Fn(Event)> Relighter<Tell> {
    /// Works until it is stopped.
    pub fn run(mut self, bell: &Receiver<()>) {
        let mut generation = 0;
        let mut stage: Option<Stage> = None;
        let mut ask: Option<Ask> = None;
        let mut shown: Option<Arc<PredictedFrame>> = None;
        // The frame that the network was last sent for: one that fails is not sent for again until
        // another was wanted.
        let mut sent: Option<usize> = None;
        // What the newest picture shows: the same is not made again.
        let mut made: Option<(Scene, Arc<Environment>, Arc<PredictedFrame>)> = None;
        while bell.recv().is_ok() && !self.stop.stopped() {
            // In this order: a field that is here was put after the opening that it belongs to.
            let field = self.fields.take();
            if let Some(opened) = self.opened.take() {
                generation = opened.generation;
                self.cache = FieldCache::new(super::FIELD_BUDGET_BYTES);
                sent = None;
                // Under the same lamps the picture stays, at its level, until the network that is at
                // hand now has predicted it.
                if stage.as_ref().is_none_or(|stage| stage.rig != opened.rig) {
                    stage = Some(Stage::new(opened.rig));
                    shown = None;
                }
            }
            let mut fresh = None;
            if let Some(predicted) = field.filter(|field| field.generation == generation) {
                fresh = Some(predicted.frame.index);
                // Until the wanted frame is there, the first one that came stands in for it.
                shown.get_or_insert_with(|| predicted.clone());
                self.cache.insert(predicted);
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
            } else if sent != Some(wanted) {
                sent = Some(wanted);
                self.wanted.put(Wanted {
                    generation,
                    frame: wanted,
                });
            }
            let Some(shown) = &shown else { continue };
            let scene = Scene {
                frame: shown.frame.index,
                output: Output::Display,
                ..ask.scene.clone()
            };
            if made.as_ref().is_some_and(|(s, environment, field)| {
                *s == scene
                    && Arc::ptr_eq(environment, &ask.environment)
                    && Arc::ptr_eq(field, shown)
            }) {
                continue;
            }
            made = Some((scene.clone(), ask.environment.clone(), shown.clone()));
            let predict_ms = (fresh == Some(shown.frame.index)).then_some(shown.ms);
            match self.relight(stage, scene, &ask.environment, shown, predict_ms, started) {
                Ok(relit) => self.relit.put(Arc::new(relit)),
                Err(e) => (self.tell)(Event::Failed {
                    sentence: e.to_string(),
                }),
            }
        }
    }

    fn relight(
        &self,
        stage: &mut Stage,
        scene: Scene,
        environment: &Arc<Environment>,
        shown: &Arc<PredictedFrame>,
        predict_ms: Option<f64>,
        started: Instant,
    ) -> Result<Relit> {
        let (light, weights_ms) = stage.light(environment, scene.yaw_deg, shown)?;
        let picture = compose(
            &scene,
            &Ingredients {
                field: &shown.field,
                mask: &shown.frame.mask,
                weights: &light.weights,
                environment: &light.environment,
                levels: light.levels,
                view: CameraView::default(),
                upstream: Upstream {
                    predict_ms,
                    weights_ms,
                },
            },
        )?;
        let (width, height) = picture.linear.size();
        let codes = picture
            .display
            .iter()
            .flat_map(|shown| shown.0.pixels.iter().flatten());
        Ok(Relit {
            scene,
            environment: light.environment.name.clone(),
            width,
            height,
            rgb: codes.map(|&code| byte_from_unit(code)).collect(),
            passes: picture.passes,
            predict_ms: shown.ms,
            relight_ms: started.elapsed().as_secs_f64() * 1e3,
            uncovered: light.weights.uncovered,
            frames_at_hand: self.cache.indices().collect(),
        })
    }
}

impl Stage {
    fn new(rig: Arc<Rig>) -> Self {
        Self {
            partition: Partition::of(Weighting::default(), &rig),
            rig,
            reference: None,
            light: None,
        }
    }

    /// The weights of an environment at a yaw, and what finding them took in milliseconds; none where
    /// they were at hand.
    fn light(
        &mut self,
        environment: &Arc<Environment>,
        yaw_deg: f32,
        shown: &Arc<PredictedFrame>,
    ) -> Result<(&Light, Option<f64>)> {
        let started = Instant::now();
        let old = self
            .light
            .take()
            .filter(|light| Arc::ptr_eq(&light.environment, environment));
        let at_hand = old.as_ref().is_some_and(|light| light.yaw_deg == yaw_deg);
        let light = match old {
            Some(light) if at_hand => light,
            Some(light) => Light {
                yaw_deg,
                weights: light.yaws.at(yaw_deg),
                ..light
            },
            None => {
                let reference = self.reference.get_or_insert_with(|| shown.clone());
                let yaws = YawTable::new(&self.partition, environment);
                let (width, height) = (Partition::WIDTH, Partition::WIDTH / 2);
                let even =
                    Environment::from_radiance("even", Image::filled(width, height, [1.0; 3]));
                let even = self.partition.weights(&even, 0.0);
                let (field, mask) = (&reference.field, &reference.frame.mask);
                Light {
                    environment: environment.clone(),
                    levels: Levels::balanced(environment, &even, field, mask)?,
                    yaw_deg,
                    weights: yaws.at(yaw_deg),
                    yaws,
                }
            }
        };
        let ms = (!at_hand).then(|| started.elapsed().as_secs_f64() * 1e3);
        Ok((self.light.insert(light), ms))
    }
}
