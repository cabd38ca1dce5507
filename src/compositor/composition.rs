//! One picture while it is being made: measures what the plan asks and runs what the plan says. What has
//! been decided is done by a [`Backend`], in memory or on a GPU.

use super::background::Backdrop;
use super::grain::Grain;
use super::picture::{Ingredients, PassReport, Picture};
use super::plan::{Facts, Inputs, PlannedPass, draws_whole, is_cut_out};
use super::reference::lit_lamps;
use super::reuse::{Cached, Reuse, Slots};
use super::smoothing::Steady;
use base::error::Result;
use imaging::Mask;
use scene::{Effects, Inspection, Output, Pass, Scene};

mod backend;
mod in_memory;
mod measure;
mod on_gpu;

pub(super) use backend::Backend;
pub(super) use in_memory::InMemory;
pub(super) use measure::inputs;
pub(super) use on_gpu::OnGpu;

/// A picture between its first pass and its last.
pub(super) struct Composition<'a, B: Backend> {
    pub scene: &'a Scene,
    effects: Effects,
    of: &'a Ingredients<'a>,
    backend: B,
    reuse: Option<&'a mut Reuse>,
    facts: Facts,
    /// The subject, premultiplied; from the pass `light_wrap` on with what is behind it.
    linear: B::Light,
    /// What is behind the subject, where it is needed whole.
    behind: Option<B::Light>,
    /// The background is in `linear` already.
    laid: bool,
    alpha: Mask,
    display: Option<B::Codes>,
    /// What despill goes by.
    guide: Option<B::Light>,
    own_grain: Grain,
    steady: Option<Steady>,
    /// On the subject's light, by the pass `smoothing`.
    gain: [f32; 3],
}

/// What a pass has to say for itself.
pub(super) struct Done {
    pass: Pass,
    ran: bool,
    reason: String,
    fixed: Option<&'static str>,
    /// The time it took before this picture was begun.
    before: Option<f64>,
    /// It ran or was measured.
    worked: bool,
}

type Place<B, T> = fn(&mut Slots<<B as Backend>::Light, <B as Backend>::Own>) -> &mut Cached<T>;

impl<'a, B: Backend> Composition<'a, B> {
    pub fn new(
        scene: &'a Scene,
        of: &'a Ingredients<'a>,
        inputs: Inputs,
        backend: B,
        reuse: Option<&'a mut Reuse>,
    ) -> Self {
        let (width, height) = of.mask.size();
        let open = of.mask.pixels.iter().filter(|&&alpha| alpha < 1.0).count();
        Self {
            scene,
            effects: scene.effects.bounded(),
            of,
            linear: backend.black(),
            backend,
            reuse,
            facts: Facts {
                field_cached: of.upstream.predict_ms.is_none(),
                weights_cached: of.upstream.weights_ms.is_none(),
                lamps: of.weights.per_lamp.len(),
                lit_lamps: lit_lamps(&of.weights.per_lamp).len(),
                open_share: open as f32 / of.mask.pixels.len().max(1) as f32,
                inputs,
                second_picture: of.extra.second.is_some(),
                ..Facts::default()
            },
            behind: None,
            laid: false,
            alpha: if is_cut_out(scene) {
                of.mask.clone()
            } else {
                Mask::filled(width, height, 1.0)
            },
            display: None,
            guide: None,
            own_grain: Grain::default(),
            steady: None,
            gain: [1.0; 3],
        }
    }

    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// What follows is measured and done for this pass.
    pub fn begin(&mut self, pass: Pass) {
        self.backend.begin(pass);
    }

    /// What is kept under `key`, or what `make` makes, which is then kept.
    fn kept<T: Clone>(
        &mut self,
        place: Place<B, T>,
        key: u64,
        make: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<T> {
        if let Some(found) = self.found(place, key) {
            return Ok(found);
        }
        let made = make(self)?;
        self.keep(place, key, made.clone());
        Ok(made)
    }

    /// What is kept under a key, if anything.
    fn found<T: Clone>(&mut self, place: Place<B, T>, key: u64) -> Option<T> {
        let reuse = self.reuse.as_deref_mut()?;
        place(B::slots(reuse)).get(key)
    }

    fn keep<T: Clone>(&mut self, place: Place<B, T>, key: u64, value: T) {
        if let Some(reuse) = self.reuse.as_deref_mut() {
            place(B::slots(reuse)).put(key, value);
        }
    }

    /// Runs one pass of a plan, or does not. A pass whose picture was kept under its key takes that.
    /// `measured` says that its need was measured just now.
    pub fn run(&mut self, planned: &[PlannedPass], index: usize, measured: bool) -> Result<Done> {
        let this = &planned[index];
        let key_of = |pass| planned.iter().find(|p| p.pass == pass).map_or(0, |p| p.key);
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
            // The subject is laid over its background here, whether light wraps around it or not.
            Pass::LightWrap => reused = self.lay(this, key_of(Pass::BackgroundBlur))?,
            _ if !this.run => (),
            Pass::Predict => done.before = self.of.upstream.predict_ms,
            Pass::Weights => done.before = self.of.upstream.weights_ms,
            // The gain multiplies the weights.
            Pass::Smoothing => self.gain = self.facts.steady_gain.unwrap_or([1.0; 3]),
            Pass::Relight => reused = self.relight(this.key)?,
            Pass::Despill => {
                if let (Some(guide), Some(spill)) = (&self.guide, self.facts.spill) {
                    let amount = self.effects.despill;
                    self.backend
                        .despill(&mut self.linear, guide, spill.screen, amount)?;
                }
            }
            Pass::Background => {
                let keys = [Pass::BackgroundBlur, Pass::LightWrap].map(key_of);
                reused = self.background(keys)?;
            }
            Pass::BackgroundBlur => reused = self.blur(this.key)?,
            Pass::Glare => {
                if let Some(glared) = self.found(|s| &mut s.glared, this.key) {
                    (self.linear, reused) = (glared, true);
                } else {
                    let white = (-self.scene.exposure_stops).exp2();
                    let amount = self.effects.glare;
                    self.backend.glare(&mut self.linear, amount, white)?;
                    self.keep(|s| &mut s.glared, this.key, self.linear.clone());
                }
            }
            Pass::Exposure => {
                let stops = self.scene.exposure_stops;
                self.backend.exposure(&mut self.linear, stops)?;
            }
            Pass::View => self.display = Some(self.backend.view(&self.linear, self.effects.view)?),
            Pass::Grain | Pass::Dither | Pass::Channels | Pass::Difference | Pass::FalseColor => {
                self.encoded(this.pass)?;
            }
        }
        if reused {
            done.ran = false;
            done.reason = "nothing that it depends on has changed: its picture was kept".to_owned();
        }
        done.worked |= done.ran;
        Ok(done)
    }

    /// The relit subject times its coverage, and whether it was kept.
    fn relight(&mut self, key: u64) -> Result<bool> {
        if let Some(linear) = self.found(|s| &mut s.relit, key) {
            self.linear = linear;
            return Ok(true);
        }
        let (of, gain) = (self.of, self.gain);
        let level =
            |share: [f32; 3]| std::array::from_fn(|c| share[c] * of.levels.subject * gain[c]);
        let weights: Vec<[f32; 3]> = of.weights.per_lamp.iter().map(|&w| level(w)).collect();
        self.linear = self.backend.relight(&weights)?;
        self.keep(|s| &mut s.relit, key, self.linear.clone());
        Ok(false)
    }

    /// Draws what is behind the subject: whole, or where the matte is open and at once into the picture.
    /// `keys` are those of the passes whose picture would make this needless.
    fn background(&mut self, keys: [u64; 2]) -> Result<bool> {
        if is_cut_out(self.scene) {
            return Ok(false);
        }
        let backdrop = Backdrop::of(self.scene, self.of.levels.background);
        if draws_whole(&self.effects) {
            let kept = self.found(|s| &mut s.behind, keys[0]);
            let reused = kept.is_some();
            self.behind = Some(match kept {
                Some(kept) => kept,
                None => self.backend.behind(&backdrop)?,
            });
            return Ok(reused);
        }
        if self.found(|s| &mut s.laid, keys[1]).is_some() {
            return Ok(true);
        }
        self.backend.surround(&mut self.linear, &backdrop)?;
        self.laid = true;
        Ok(false)
    }

    /// Puts what is behind the subject out of focus, unless it came so.
    fn blur(&mut self, key: u64) -> Result<bool> {
        if self.found(|s| &mut s.behind, key).is_some() {
            return Ok(true);
        }
        if let Some(behind) = &mut self.behind {
            let radius = self.effects.background_blur * self.of.mask.height as f32;
            self.backend.background_blur(behind, radius)?;
        }
        Ok(false)
    }

    /// Wraps light around the subject where the plan says so, and lays it over what is behind it.
    /// `behind_key` stands for what is behind it.
    fn lay(&mut self, this: &PlannedPass, behind_key: u64) -> Result<bool> {
        if let Some(behind) = self.behind.clone() {
            self.keep(|s| &mut s.behind, behind_key, behind);
        }
        if !self.laid
            && let Some(laid) = self.found(|s| &mut s.laid, this.key)
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
        self.keep(|s| &mut s.laid, this.key, self.linear.clone());
        Ok(false)
    }

    /// Passes on the codes of a display; none where there is no display.
    fn encoded(&mut self, pass: Pass) -> Result<()> {
        let (extra, effects) = (self.of.extra, self.effects);
        let Some(codes) = &mut self.display else {
            return Ok(());
        };
        match (pass, effects.inspection) {
            (Pass::Grain, _) => {
                if let Some(plate) = extra.grain {
                    let grains = [plate, &self.own_grain];
                    let amount = effects.grain;
                    self.backend
                        .grain(codes, &self.alpha, grains, amount, self.scene.frame)?;
                }
            }
            (Pass::Dither, _) => self.backend.dither(codes)?,
            (Pass::Channels, Inspection::Channel(channel)) => {
                self.backend.channels(codes, &self.alpha, channel)?;
            }
            (Pass::Difference, Inspection::Difference { gain }) => {
                if let Some(second) = extra.second {
                    self.backend.difference(codes, second, gain)?;
                }
            }
            (Pass::FalseColor, Inspection::FalseColor) => {
                *codes = self.backend.false_color(&self.linear)?;
            }
            _ => (),
        }
        Ok(())
    }

    /// The picture, and what became of each pass.
    pub fn finish(self, done: Vec<Done>) -> Result<Picture> {
        // What is not opaque is brought to straight alpha in linear light.
        let opaque = !is_cut_out(self.scene) || self.facts.open_share == 0.0;
        let needs_linear = self.scene.output == Output::Linear || !opaque;
        let finished = self
            .backend
            .finish(self.linear, self.display, needs_linear)?;
        if let Some(reuse) = self.reuse {
            B::slots(reuse).own = finished.own;
        }
        let report = |done: Done| {
            let mut reason = done.reason;
            if done.pass == Pass::Relight && done.ran && finished.mended > 0 {
                let mended = finished.mended;
                reason +=
                    &format!("; {mended} pixels were NaN or infinite, filled from neighbours");
            }
            PassReport {
                name: done.pass.name().to_owned(),
                ran: done.ran,
                reason,
                fixed: done.fixed.map(str::to_owned),
                ms: match done.before {
                    None if done.worked => finished.ms.map(|ms| ms[done.pass as usize]),
                    before => Some(before.unwrap_or(0.0)),
                },
            }
        };
        Ok(Picture {
            linear: finished.linear,
            alpha: self.alpha,
            display: finished.display,
            passes: done.into_iter().map(report).collect(),
            view: self.effects.view,
            steady: self.steady,
            spill: self.facts.spill,
        })
    }
}
