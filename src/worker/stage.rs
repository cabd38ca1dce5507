//! What the relighter knows of the shoot: the light, the frame that sets its level, and what one picture
//! leaves for the next.

use super::PredictedFrame;
use super::adaptive_resolution::AdaptiveResolution;
use super::comparison::{self, Comparison};
use super::relighter::PreviewRequest;
use base::error::Result;
use compositor::{Grain, Identity, Levels, Reuse, Steady};
use footage::Frame;
use imaging::Encoded;
use light::lighting::EnvironmentWeights;
use light::{Environment, LightWeights, Lighting, Rig};
use scene::{Background, Pass, Scene, ViewTransform};
use std::sync::Arc;
use std::time::Instant;

/// What the thread knows of the light.
pub struct Light {
    pub environment: Arc<Environment>,
    lit: EnvironmentWeights,
    pub levels: Levels,
    /// What `weights` are of.
    lighting: Lighting,
    yaw_deg: f32,
    pub weights: LightWeights,
}

impl Light {
    /// The weights of some lamps alone, each with half of the energy of an even light from all of them.
    pub fn solo(&self, lamps: &[usize]) -> LightWeights {
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
pub struct Stage {
    pub rig: Arc<Rig>,
    /// The first frame that was predicted: it sets the level of every light for the whole session.
    reference: Option<Arc<PredictedFrame>>,
    pub light: Option<Light>,
    /// How many environments there have been.
    environments: u64,
    /// The field that was composed last, and how many there have been.
    composed: Option<Arc<PredictedFrame>>,
    fields: u64,
    /// Its plate's grain under a view transform, where a scene asked for it.
    pub grain: Option<(ViewTransform, Grain)>,
    /// What it hands on to the frame after it.
    pub steady: Option<Steady>,
    pub reuse: Reuse,
    pub resolution: AdaptiveResolution,
    /// The lights of the pictures that are compared, where they have some of their own.
    others: [Option<Light>; 2],
    /// How many pictures to compare there have been.
    seconds: u64,
}

impl Stage {
    /// Pictures may take so many milliseconds while something is dragged.
    pub fn new(rig: Arc<Rig>, budget_ms: f64) -> Self {
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
            resolution: AdaptiveResolution::within(budget_ms),
            others: [None, None],
            seconds: 0,
        }
    }

    /// Takes in which frame is composed next, under which view transform, and says what it is known by.
    pub fn begin(&mut self, shown: &Arc<PredictedFrame>, scene: &Scene) -> Identity {
        let last = self.composed.as_ref();
        if last.is_none_or(|last| !Arc::ptr_eq(last, shown)) {
            self.composed = Some(shown.clone());
            self.fields += 1;
            self.grain = None;
        }
        let view = scene.effects.view;
        if scene.effects.asks(Pass::Grain) && self.grain.as_ref().is_none_or(|(of, _)| *of != view)
        {
            let Frame { plate, mask, .. } = &*shown.frame;
            self.grain = Some((view, Grain::of_plate(plate, mask, view)));
        }
        Identity {
            frame: self.fields,
            environment: self.environments,
            second: self.seconds,
        }
    }

    /// The first or the second picture (`side` 0 or 1) that is asked for to be compared, where all that it is
    /// made of is at hand.
    pub fn compared(
        &mut self,
        ask: &PreviewRequest,
        side: usize,
        shown: &Arc<PredictedFrame>,
        rival: Option<&PredictedFrame>,
    ) -> Result<Option<(Comparison, Encoded)>> {
        let Some(wanted) = [&ask.first, &ask.second][side] else {
            return Ok(None);
        };
        self.seconds += 1;
        let scene = comparison::plain(&ask.scene);
        let picture = match (wanted, rival, &mut self.light) {
            (Comparison::Plate, ..) => Some(comparison::plate(&shown.frame.plate, &scene)),
            (Comparison::Olats(_), Some(rival), Some(light)) => {
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
                comparison::rival(&scene, rival, weights, &light.environment, light.levels)?
            }
            (Comparison::Light(environment, yaw_deg), ..) => {
                let yaw_deg = *yaw_deg;
                let scene = Scene { yaw_deg, ..scene };
                // The same as the picture itself, with the two lights' places changed.
                let first = std::mem::replace(&mut self.light, self.others[side].take());
                let lit = self.light(environment, &scene, shown);
                self.others[side] = std::mem::replace(&mut self.light, first);
                lit?;
                let other = self.others[side].as_ref();
                let made = other.map(|light| {
                    let (weights, levels) = (&light.weights, light.levels);
                    comparison::rival(&scene, shown, weights, &light.environment, levels)
                });
                made.transpose()?.flatten()
            }
            _ => None,
        };
        Ok(picture.map(|picture| (wanted.clone(), picture)))
    }

    /// The weights that a scene asks for, and what finding them took in milliseconds; none where they were
    /// at hand.
    pub fn light(
        &mut self,
        environment: &Arc<Environment>,
        scene: &Scene,
        shown: &Arc<PredictedFrame>,
    ) -> Result<Option<f64>> {
        self.reference.get_or_insert_with(|| shown.clone());
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
                    None => EnvironmentWeights::new(environment, &self.rig, lighting.weighting),
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
