//! One picture in progress: measures and runs what the plan says, in memory or on a GPU through a
//! [`Backend`].

use super::background::{Backdrop, backing, draws_whole};
use super::background_blur;
use super::descriptor::{CodesInput, LightStep, PassContext, PlannedPass, Run, is_cut_out, key_in};
use super::facts::{Facts, Inputs};
use super::picture::{Ingredients, PassReport, Picture};
use super::plate::Plate;
use super::reuse::{Cache, Cached, Reuse};
use super::shown::ShownPicture;
use super::smoothing::Steady;
use super::{PASSES, relight::lit_lamps};
use base::error::Result;
use imaging::Mask;
use scene::{Background, Effects, Output, Pass, Scene};

mod backend;
mod in_memory;
mod measure;
mod on_gpu;

pub(super) use backend::{Backend, FinishedPicture, ReadPicture};
pub(super) use in_memory::InMemory;
pub(super) use measure::inputs;
pub(super) use on_gpu::OnGpu;

/// A picture between its first pass and its last.
pub(super) struct Composition<'a, B: Backend> {
    pub scene: &'a Scene,
    effects: Effects,
    ingredients: &'a Ingredients<'a>,
    backend: B,
    reuse: Option<&'a mut Reuse>,
    facts: Facts,
    /// The premultiplied subject; from the pass `light_wrap` on with its background.
    linear: B::Light,
    /// The full background, if needed.
    behind: Option<B::Light>,
    /// True if `linear` contains the background already.
    laid: bool,
    alpha: Mask,
    display: Option<B::Codes>,
    /// Guide of despill.
    guide: Option<B::Light>,
    steady: Option<Steady>,
    /// Gain of the pass `smoothing` on the subject's light.
    gain: [f32; 3],
}

/// Outcome of a pass.
pub(super) struct Done {
    pass: Pass,
    ran: bool,
    reason: String,
    fixed: Option<&'static str>,
    /// Time spent before this picture was started.
    before: Option<f64>,
    /// True if it ran or was measured.
    worked: bool,
}

impl<'a, B: Backend> Composition<'a, B> {
    pub fn new(
        scene: &'a Scene,
        ingredients: &'a Ingredients<'a>,
        inputs: Inputs,
        backend: B,
        reuse: Option<&'a mut Reuse>,
    ) -> Self {
        let matte = ingredients.matte();
        let (width, height) = matte.size();
        let open = matte.pixels.iter().filter(|&&alpha| alpha < 1.0).count();
        Self {
            scene,
            effects: scene.effects.bounded(),
            ingredients,
            linear: backend.black(),
            backend,
            reuse,
            facts: Facts {
                field_cached: ingredients.upstream.predict_ms.is_none(),
                weights_cached: ingredients.upstream.weights_ms.is_none(),
                lamps: ingredients.weights.per_lamp.len(),
                lit_lamps: lit_lamps(&ingredients.weights.per_lamp).len(),
                plate: ingredients.plate().map(Plate::size),
                fine_light: ingredients.finely_lit().is_some(),
                open_share: open as f32 / matte.pixels.len().max(1) as f32,
                inputs,
                second_picture: ingredients.extra.second.is_some(),
                ..Facts::default()
            },
            behind: None,
            laid: false,
            alpha: if is_cut_out(scene) { matte.clone() } else { Mask::filled(width, height, 1.0) },
            display: None,
            guide: None,
            steady: None,
            gain: [1.0; 3],
        }
    }

    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Starts a pass: later measurements and work belong to it.
    pub fn begin(&mut self, pass: Pass) {
        self.backend.begin(pass);
    }

    /// The value cached under `key`, or the result of `make`, which is then cached.
    fn cached<T: Clone>(
        &mut self,
        place: impl Fn(&mut Cache<B::Light, B::Own>) -> &mut Cached<T>,
        key: u64,
        make: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<T> {
        let found = self.reuse.as_deref_mut();
        if let Some(found) = found.and_then(|reuse| place(B::cache(reuse)).get(key)) {
            return Ok(found);
        }
        let made = make(self)?;
        if let Some(reuse) = self.reuse.as_deref_mut() {
            place(B::cache(reuse)).put(key, made.clone());
        }
        Ok(made)
    }

    /// The picture after a pass, if it is cached under this key.
    fn found(&mut self, pass: Pass, key: u64) -> Option<B::Light> {
        let reuse = self.reuse.as_deref_mut()?;
        B::cache(reuse).after(pass).get(key)
    }

    /// Caches the picture after a pass.
    fn keep(&mut self, pass: Pass, key: u64, picture: B::Light) {
        if let Some(reuse) = self.reuse.as_deref_mut() {
            B::cache(reuse).after(pass).put(key, picture);
        }
    }

    /// Runs or skips one pass of a plan. A picture cached under the pass's key is reused.
    /// `measured` is true if its need was measured just now.
    pub fn run(&mut self, planned: &[PlannedPass], index: usize, measured: bool) -> Result<Done> {
        let this = &planned[index];
        let mut done = Done {
            pass: this.pass,
            ran: this.run,
            reason: this.reason.clone(),
            fixed: this.fixed,
            before: None,
            worked: measured,
        };
        let mut reused = false;
        match this.pass {
            // The subject is laid over its background here, with or without light wrap.
            Pass::LightWrap => reused = self.lay(this, key_in(planned, Pass::BackgroundBlur))?,
            _ if !this.run => (),
            Pass::Predict => done.before = self.ingredients.upstream.predict_ms,
            Pass::Weights => done.before = self.ingredients.upstream.weights_ms,
            // The gain multiplies the weights.
            Pass::Smoothing => self.gain = self.facts.steady_gain.unwrap_or([1.0; 3]),
            Pass::Relight => reused = self.relight(this.key)?,
            Pass::Plate => reused = self.plate(this.key)?,
            Pass::Despill => {
                if let (Some(guide), Some(spill)) = (&self.guide, self.facts.spill) {
                    let amount = self.effects.despill;
                    self.backend.despill(&mut self.linear, guide, spill.screen, amount)?;
                }
            }
            Pass::Background => {
                let after = [Pass::BackgroundBlur, Pass::LightWrap];
                reused = self.background(after.map(|pass| key_in(planned, pass)))?;
            }
            Pass::BackgroundBlur => reused = self.blur(this.key)?,
            _ => reused = self.step(this)?,
        }
        if reused {
            done.ran = false;
            done.reason = "cached".to_owned();
        }
        done.worked |= done.ran;
        Ok(done)
    }

    /// The relit subject times its coverage; true if it was cached.
    fn relight(&mut self, key: u64) -> Result<bool> {
        if let Some(linear) = self.found(Pass::Relight, key) {
            self.linear = linear;
            return Ok(true);
        }
        self.linear = self.backend.relight(&self.weights())?;
        self.keep(Pass::Relight, key, self.linear.clone());
        Ok(false)
    }

    /// Weights of the lamps at the picture's level.
    fn weights(&self) -> Vec<[f32; 3]> {
        let (ingredients, gain) = (self.ingredients, self.gain);
        let level = |share: &[f32; 3]| std::array::from_fn(|c| share[c] * ingredients.levels.subject * gain[c]);
        ingredients.weights.per_lamp.iter().map(level).collect()
    }

    /// Brings the subject to the plate's size; returns true if the result was cached.
    fn plate(&mut self, key: u64) -> Result<bool> {
        if let Some(linear) = self.found(Pass::Plate, key) {
            self.linear = linear;
            return Ok(true);
        }
        let weights = self.weights();
        self.backend.plate(&mut self.linear, &weights)?;
        self.keep(Pass::Plate, key, self.linear.clone());
        Ok(false)
    }

    /// Draws the background: everywhere, or only where the matte is open and directly into the picture.
    /// `keys` are the keys of the passes whose cached picture would make this unnecessary.
    fn background(&mut self, keys: [u64; 2]) -> Result<bool> {
        if is_cut_out(self.scene) {
            return Ok(false);
        }
        let backdrop = Backdrop::new(self.scene, self.ingredients.levels.background);
        if draws_whole(&self.effects) || self.scene.background != Background::Environment {
            let found = self.found(Pass::BackgroundBlur, keys[0]);
            let reused = found.is_some();
            self.behind = Some(match found {
                Some(found) => found,
                None => match backing(self.scene, self.ingredients) {
                    Some(picture) => self.backend.placed(picture)?,
                    None => self.backend.behind(&backdrop)?,
                },
            });
            return Ok(reused);
        }
        if self.found(Pass::LightWrap, keys[1]).is_some() {
            return Ok(true);
        }
        self.backend.surround(&mut self.linear, &backdrop)?;
        self.laid = true;
        Ok(false)
    }

    /// Blurs the background, unless the blurred picture is cached.
    fn blur(&mut self, key: u64) -> Result<bool> {
        if self.found(Pass::BackgroundBlur, key).is_some() {
            return Ok(true);
        }
        let context = PassContext { scene: self.scene, effects: self.effects, facts: &self.facts };
        if let Some(behind) = &mut self.behind {
            self.backend.light(&background_blur::STEP, &context, behind)?;
        }
        Ok(false)
    }

    /// Wraps light around the subject if the plan says so, and lays the subject over its background.
    /// `behind_key` is the key of the background.
    fn lay(&mut self, this: &PlannedPass, behind_key: u64) -> Result<bool> {
        if let Some(behind) = self.behind.clone() {
            self.keep(Pass::BackgroundBlur, behind_key, behind);
        }
        if !self.laid
            && let Some(laid) = self.found(Pass::LightWrap, this.key)
        {
            self.linear = laid;
            return Ok(this.run);
        }
        if let Some(behind) = self.behind.take() {
            if this.run {
                let amount = self.effects.light_wrap;
                self.backend.light_wrap(&mut self.linear, &behind, amount)?;
            }
            self.backend.over(&mut self.linear, &behind)?;
        }
        self.keep(Pass::LightWrap, this.key, self.linear.clone());
        Ok(false)
    }

    /// Runs the step of a pass; returns true if its picture was cached. Steps on codes do nothing without display
    /// codes.
    fn step(&mut self, this: &PlannedPass) -> Result<bool> {
        let run = PASSES[this.pass as usize].run;
        let is_cached = matches!(run, Run::Light(LightStep { cached: true, .. }));
        if is_cached && let Some(linear) = self.found(this.pass, this.key) {
            self.linear = linear;
            return Ok(true);
        }
        let context = PassContext { scene: self.scene, effects: self.effects, facts: &self.facts };
        match (run, &mut self.display) {
            (Run::Light(step), _) => {
                self.backend.light(&step, &context, &mut self.linear)?;
            }
            (Run::Encode(step), display) => {
                let codes = self.backend.encode(&step, &context, &self.linear)?;
                *display = codes.or(display.take());
            }
            (Run::Codes(step), Some(codes)) => {
                let input = CodesInput {
                    mask: self.ingredients.matte(),
                    alpha: &self.alpha,
                    plate: self.ingredients.extra.grain,
                    second: self.ingredients.extra.second,
                };
                self.backend.codes(&step, &context, &input, codes)?;
            }
            (Run::Before | Run::Composed | Run::Codes(_), _) => (),
        }
        if is_cached {
            self.keep(this.pass, this.key, self.linear.clone());
        }
        Ok(false)
    }

    /// The picture, and the outcome of each pass. It may stay on a GPU, to be shown, and read later.
    pub fn finish(self, done: Vec<Done>, may_stay: bool) -> Result<ShownPicture> {
        // A picture that is not opaque is converted to straight alpha in linear light.
        let opaque = !is_cut_out(self.scene) || self.facts.open_share == 0.0;
        let needs_linear = self.scene.output == Output::Linear || !opaque;
        let (finished, own) = self.backend.finish(self.linear, self.display, needs_linear, may_stay)?;
        if let Some(reuse) = self.reuse {
            B::cache(reuse).own = own;
        }
        let report = |done: Done| PassReport {
            name: done.pass.name().to_owned(),
            ran: done.ran,
            reason: done.reason,
            fixed: done.fixed.map(str::to_owned),
            ms: match done.before {
                None if done.worked => None,
                before => Some(before.unwrap_or(0.0)),
            },
        };
        let picture = Picture {
            linear: None,
            alpha: self.alpha,
            display: None,
            passes: done.into_iter().map(report).collect(),
            view: self.effects.view,
            steady: self.steady,
            spill: self.facts.spill,
        };
        Ok(ShownPicture::new(picture, finished))
    }
}
