//! The thread that relights: it keeps the fields at hand and answers the newest [`Ask`], so that a
//! turn of the light is shown at once, whatever the network is doing.

use super::PredictedFrame;
use super::cache::FieldCache;
use super::event::Event;
use super::latest::Latest;
use super::network::{Challenge, Challenger, Opened, Wanted};
use super::second::{self, Codes, Second};
use crate::compositor::{
    CameraView, Extra, Grain, Identity, Ingredients, Levels, PassReport, Reuse, Steady, Upstream,
    compose_reusing,
};
use crate::error::{Error, Result};
use crate::footage::Frame;
use crate::imaging::{Encoded, Image};
use crate::light::lighting::Lit;
use crate::light::{Environment, LightWeights, Lighting, Rig};
use crate::progress::Control;
use crate::scene::{Background, Output, Scene, ViewTransform};
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
    /// What the picture is compared with.
    pub second: Option<Second>,
    /// Lamps that light the subject alone, each as bright as half of an even light; none is the light.
    pub solo: Vec<usize>,
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
    /// What it is compared with, of the same size.
    pub second: Option<(Second, Codes)>,
    /// Lamps that light the subject alone.
    pub solo: Vec<usize>,
    /// Scene-linear light of each pixel, premultiplied, where it is in memory.
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
    pub asks: Arc<Latest<Ask>>,
    pub opened: Arc<Latest<Opened>>,
    pub fields: Arc<Latest<Arc<PredictedFrame>>>,
    pub wanted: Arc<Latest<Wanted>>,
    pub challenge: Arc<Latest<Challenge>>,
    pub rivals: Arc<Latest<Challenger>>,
    pub relit: Arc<Latest<Arc<Relit>>>,
    pub tell: Tell,
    pub stop: Control,
    pub cache: FieldCache,
}

/// All that a picture is made of.
struct Made {
    ask: Ask,
    shown: Arc<PredictedFrame>,
    rival: Option<Arc<PredictedFrame>>,
}

impl Made {
    /// Whether the same picture comes of both.
    fn is(&self, other: &Self) -> bool {
        let rivals = self.rival.as_ref().map(Arc::as_ptr) == other.rival.as_ref().map(Arc::as_ptr);
        let environments = Arc::ptr_eq(&self.ask.environment, &other.ask.environment);
        let (mine, theirs) = (&self.ask, &other.ask);
        let asks = (&mine.scene, &mine.solo, &mine.second)
            == (&theirs.scene, &theirs.solo, &theirs.second);
        rivals && environments && asks && Arc::ptr_eq(&self.shown, &other.shown)
    }
}

fn scaled(weights: &[[f32; 3]], factor: f32) -> Vec<[f32; 3]> {
    let scaled = weights.iter().map(|weight| weight.map(|w| w * factor));
    scaled.collect()
}

/// What the thread knows of the light.
struct Light {
    environment: Arc<Environment>,
    lit: Lit,
    levels: Levels,
    /// What `weights` are of.
    lighting: Lighting,
    yaw_deg: f32,
    weights: LightWeights,
}

impl Light {
    /// The weights of some lamps alone, each with half of the energy of an even light from all of them.
    fn solo(&self, lamps: &[usize]) -> LightWeights {
        let mut weights = self.lit.even();
        let share = 0.5 * weights.per_lamp.len() as f32 * self.levels.of_unit_light();
        for (lamp, weight) in weights.per_lamp.iter_mut().enumerate() {
            let on = if lamps.contains(&lamp) { share } else { 0.0 };
            *weight = weight.map(|w| w * on);
        }
        weights
    }
}

/// What the thread knows of the shoot.
struct Stage {
    rig: Arc<Rig>,
    /// The first frame that was predicted: it sets the level of every light for the whole session.
    reference: Option<Arc<PredictedFrame>>,
    light: Option<Light>,
    /// How many environments there have been.
    environments: u64,
    /// The field that was composed last, and how many there have been.
    composed: Option<Arc<PredictedFrame>>,
    fields: u64,
    /// Its plate's grain under a view transform, where a scene asked for it.
    grain: Option<(ViewTransform, Grain)>,
    /// What it hands on to the frame after it.
    steady: Option<Steady>,
    reuse: Reuse,
    /// The light of the second picture, where it has one of its own.
    other: Option<Light>,
    /// How many second pictures there have been.
    seconds: u64,
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
        let mut made: Option<Made> = None;
        // What was asked for to compare with, and what came last.
        let mut challenge: Option<Challenge> = None;
        let mut rival: Option<Arc<PredictedFrame>> = None;
        while bell.recv().is_ok() && !self.stop.stopped() {
            // In this order: a field that is here was put after the opening that it belongs to.
            let field = self.fields.take();
            if let Some(opened) = self.opened.take() {
                generation = opened.generation;
                self.cache = FieldCache::new(super::FIELD_BUDGET_BYTES);
                (sent, challenge, rival) = (None, None, None);
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
            let found = self.rivals.take();
            if let Some(Challenger { found, .. }) =
                found.filter(|found| challenge.as_ref() == Some(&found.of))
            {
                rival = Some(found);
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
            match &ask.second {
                Some(Second::Rival(of)) => {
                    let wanted = Challenge {
                        generation,
                        rival: of.clone(),
                        frame: shown.frame.index,
                    };
                    if challenge.as_ref() != Some(&wanted) {
                        rival = None;
                        challenge = Some(wanted.clone());
                        self.challenge.put(wanted);
                    }
                }
                _ => (challenge, rival) = (None, None),
            }
            let making = Made {
                ask: Ask {
                    scene: scene.clone(),
                    ..ask.clone()
                },
                shown: shown.clone(),
                rival: rival.clone(),
            };
            if made.as_ref().is_some_and(|made| made.is(&making)) {
                continue;
            }
            let predict_ms = (fresh == Some(shown.frame.index)).then_some(shown.ms);
            let relit = self.relight(stage, &making, predict_ms, started);
            made = Some(making);
            match relit {
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
        making: &Made,
        predict_ms: Option<f64>,
        started: Instant,
    ) -> Result<Relit> {
        let Made { ask, shown, rival } = making;
        let mut scene = ask.scene.clone();
        stage.reference.get_or_insert_with(|| shown.clone());
        let weights_ms = stage.light(&ask.environment, &scene, shown)?;
        let second = stage.second(ask, shown, rival.as_deref())?;
        if stage
            .composed
            .as_ref()
            .is_none_or(|last| !Arc::ptr_eq(last, shown))
        {
            stage.composed = Some(shown.clone());
            stage.fields += 1;
            stage.grain = None;
        }
        let view = scene.effects.view;
        if scene.effects.grain > 0.0 && stage.grain.as_ref().is_none_or(|(of, _)| *of != view) {
            let Frame { plate, mask, .. } = &*shown.frame;
            stage.grain = Some((view, Grain::of_plate(plate, mask, view)));
        }
        let identity = Identity {
            frame: stage.fields,
            environment: stage.environments,
            second: stage.seconds,
        };
        let Stage {
            rig,
            light,
            grain,
            steady,
            reuse,
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
        let picture = compose_reusing(
            &scene,
            &Ingredients {
                field: &shown.field,
                mask: &shown.frame.mask,
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
        *steady = picture.steady;
        let (width, height) = picture.alpha.size();
        let display = picture.display.as_ref().map(Codes::of);
        Ok(Relit {
            scene: ask.scene.clone(),
            second: second.map(|(of, picture)| (of, Codes::of(&picture))),
            solo: ask.solo.clone(),
            weights: scaled(&weights.per_lamp, light.levels.subject),
            environment: light.environment.name.clone(),
            width,
            height,
            rgb: display.map_or_else(Vec::new, |codes| codes.rgb),
            linear: picture.linear,
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

impl Stage {
    fn new(rig: Arc<Rig>) -> Self {
        Self {
            rig,
            reference: None,
            light: None,
            environments: 0,
            composed: None,
            fields: 0,
            grain: None,
            steady: None,
            reuse: Reuse::default(),
            other: None,
            seconds: 0,
        }
    }

    /// The second picture that is asked for, where all that it is made of is at hand.
    fn second(
        &mut self,
        ask: &Ask,
        shown: &PredictedFrame,
        rival: Option<&PredictedFrame>,
    ) -> Result<Option<(Second, Encoded)>> {
        let Some(wanted) = &ask.second else {
            return Ok(None);
        };
        self.seconds += 1;
        let scene = second::plain(&ask.scene);
        let picture = match (wanted, rival, &mut self.light) {
            (Second::Plate, ..) => Some(second::plate(&shown.frame.plate, &scene)),
            (Second::Rival(_), Some(rival), Some(light)) => {
                let solo = (!ask.solo.is_empty()).then(|| light.solo(&ask.solo));
                let weights = solo.as_ref().unwrap_or(&light.weights);
                let scene = Scene {
                    background: if solo.is_some() {
                        Background::None
                    } else {
                        scene.background
                    },
                    ..scene
                };
                second::rival(&scene, rival, weights, &light.environment, light.levels)?
            }
            (Second::Light(environment, yaw_deg), ..) => {
                let yaw_deg = *yaw_deg;
                let scene = Scene { yaw_deg, ..scene };
                // The same as the picture itself, with the two lights' places changed.
                let first = std::mem::replace(&mut self.light, self.other.take());
                let lit = self.light(environment, &scene, shown);
                self.other = std::mem::replace(&mut self.light, first);
                lit?;
                let other = self.other.as_ref();
                let made = other.map(|light| {
                    let (weights, levels) = (&light.weights, light.levels);
                    second::rival(&scene, shown, weights, &light.environment, levels)
                });
                made.transpose()?.flatten()
            }
            _ => None,
        };
        Ok(picture.map(|picture| (wanted.clone(), picture)))
    }

    /// The weights that a scene asks for, and what finding them took in milliseconds; none where they were
    /// at hand.
    fn light(
        &mut self,
        environment: &Arc<Environment>,
        scene: &Scene,
        shown: &PredictedFrame,
    ) -> Result<Option<f64>> {
        let started = Instant::now();
        let (yaw_deg, lighting) = (scene.yaw_deg, &scene.lighting);
        let mut old = self.light.take();
        let same = |light: &Light| Arc::ptr_eq(&light.environment, environment);
        if let Some(light) = old.as_ref().filter(|light| same(light))
            && light.yaw_deg == yaw_deg
            && light.lighting == *lighting
        {
            self.light = old;
            return Ok(None);
        }
        let (mut lit, levels) = match old.take() {
            Some(light) if same(&light) => (light.lit, light.levels),
            other => {
                self.environments += 1;
                let lit = match other {
                    Some(light) => light.lit.environment(environment),
                    None => Lit::new(environment, &self.rig, lighting.weighting),
                };
                let reference = self.reference.as_deref().unwrap_or(shown);
                let (field, mask) = (&reference.field, &reference.frame.mask);
                let levels = Levels::balanced(environment, &lit.even(), field, mask)?;
                (lit, levels)
            }
        };
        self.light = Some(Light {
            environment: environment.clone(),
            levels,
            lighting: lighting.clone(),
            yaw_deg,
            weights: lit.weights(lighting, yaw_deg, 1.0 / levels.background),
            lit,
        });
        Ok(Some(started.elapsed().as_secs_f64() * 1e3))
    }
}
