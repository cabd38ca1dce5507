//! One picture while it is being made: measures what the plan asks and runs what the plan says.

use super::background::{Backdrop, draw_background};
use super::background_blur::background_blur;
use super::channels::channels;
use super::compose::{Ingredients, PassReport, Picture};
use super::despill::despill;
use super::difference::difference;
use super::false_color::false_color;
use super::glare::glare;
use super::grain::{Grain, grain};
use super::light_wrap::light_wrap;
use super::pass::Pass;
use super::plan::{Facts, PlannedPass, draws_whole};
use super::reference::{dither, extend_edges, lit_lamps, scale};
use super::reuse::{Kept, Reuse};
use super::smoothing::Steady;
use super::view::view;
use crate::error::Result;
use crate::imaging::{Encoded, Image, Mask};
use crate::scene::{Background, Effects, Inspection, Scene};
use rayon::prelude::*;
use std::sync::Arc;

mod measure;

/// A picture between its first pass and its last.
pub(super) struct Stage<'a> {
    scene: &'a Scene,
    effects: Effects,
    of: &'a Ingredients<'a>,
    reuse: Option<&'a mut Reuse>,
    facts: Facts,
    /// The subject, premultiplied; from the pass `light_wrap` on with what is behind it.
    linear: Arc<Image>,
    /// What is behind the subject, where it is needed whole.
    behind: Option<Arc<Image>>,
    /// The background is in `linear` already.
    laid: bool,
    alpha: Mask,
    display: Option<Encoded>,
    /// What despill goes by.
    guide: Option<Arc<Image>>,
    own_grain: Grain,
    steady: Option<Steady>,
    /// On the subject's light, by the pass `smoothing`.
    gain: [f32; 3],
}

/// What a pass has to say for itself.
pub(super) struct Done {
    pub ran: bool,
    pub reason: String,
    /// The time it took before this picture was begun.
    pub ms: Option<f64>,
}

impl<'a> Stage<'a> {
    pub fn new(scene: &'a Scene, of: &'a Ingredients<'a>, reuse: Option<&'a mut Reuse>) -> Self {
        let (width, height) = of.mask.size();
        let open = of.mask.pixels.iter().filter(|&&alpha| alpha < 1.0).count();
        Self {
            scene,
            effects: scene.effects.bounded(),
            of,
            reuse,
            facts: Facts {
                field_cached: of.upstream.predict_ms.is_none(),
                weights_cached: of.upstream.weights_ms.is_none(),
                lamps: of.weights.per_lamp.len(),
                lit_lamps: lit_lamps(&of.weights.per_lamp).len(),
                open_share: open as f32 / of.mask.pixels.len().max(1) as f32,
                inputs: measure::inputs(of),
                second_picture: of.extra.second.is_some(),
                ..Facts::default()
            },
            linear: Arc::new(Image::filled(width, height, [0.0; 3])),
            behind: None,
            laid: false,
            alpha: match scene.background {
                Background::Environment => Mask::filled(width, height, 1.0),
                Background::None => of.mask.clone(),
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

    /// What is kept under `key`, or what `make` makes, which is then kept.
    fn kept<T: Clone>(
        &mut self,
        slot: impl Fn(&mut Reuse) -> &mut Kept<T>,
        key: u64,
        make: impl FnOnce() -> T,
    ) -> T {
        let Some(reuse) = self.reuse.as_deref_mut() else {
            return make();
        };
        let slot = slot(reuse);
        slot.get(key).unwrap_or_else(|| {
            let made = make();
            slot.put(key, made.clone());
            made
        })
    }

    /// What is kept under the key of a later pass, if anything.
    fn found<T: Clone>(
        &mut self,
        slot: impl Fn(&mut Reuse) -> &mut Kept<T>,
        key: u64,
    ) -> Option<T> {
        self.reuse
            .as_deref_mut()
            .and_then(|reuse| slot(reuse).get(key))
    }

    fn keep<T: Clone>(&mut self, slot: impl Fn(&mut Reuse) -> &mut Kept<T>, key: u64, value: T) {
        if let Some(reuse) = self.reuse.as_deref_mut() {
            slot(reuse).put(key, value);
        }
    }

    /// Runs one pass of a plan, or does not. A pass whose picture was kept under its key takes that.
    pub fn run(&mut self, planned: &[PlannedPass], index: usize) -> Result<Done> {
        let this = &planned[index];
        let key_of = |pass| planned.iter().find(|p| p.pass == pass).map_or(0, |p| p.key);
        let mut done = Done {
            ran: this.run,
            reason: this.reason.clone(),
            ms: None,
        };
        let mut reused = false;
        match this.pass {
            // The subject is laid over its background here, whether light wraps around it or not.
            Pass::LightWrap => reused = self.lay(this, key_of(Pass::BackgroundBlur)),
            _ if !this.run => (),
            Pass::Predict => done.ms = self.of.upstream.predict_ms,
            Pass::Weights => done.ms = self.of.upstream.weights_ms,
            // The gain multiplies the weights.
            Pass::Smoothing => self.gain = self.facts.steady_gain.unwrap_or([1.0; 3]),
            Pass::Relight => {
                let mended;
                (mended, reused) = self.relight(this.key)?;
                if mended > 0 {
                    done.reason += &format!(
                        "; {mended} pixels were no numbers and took their neighbours' light"
                    );
                }
            }
            Pass::Despill => {
                if let (Some(guide), Some(spill)) = (&self.guide, self.facts.spill) {
                    let linear = Arc::make_mut(&mut self.linear);
                    despill(linear, guide, spill.screen, self.effects.despill);
                }
            }
            Pass::Background => {
                let keys = [Pass::BackgroundBlur, Pass::LightWrap].map(key_of);
                reused = self.background(keys);
            }
            Pass::BackgroundBlur => reused = self.blur(this.key),
            Pass::Glare => {
                if let Some(glared) = self.found(|r| &mut r.glared, this.key) {
                    (self.linear, reused) = (glared, true);
                } else {
                    let white = (-self.scene.exposure_stops).exp2();
                    glare(Arc::make_mut(&mut self.linear), self.effects.glare, white);
                    self.keep(|r| &mut r.glared, this.key, self.linear.clone());
                }
            }
            Pass::Exposure => {
                let factor = self.scene.exposure_stops.exp2();
                scale(Arc::make_mut(&mut self.linear), factor);
            }
            Pass::View => self.display = Some(view(&self.linear, self.effects.view)),
            Pass::Grain | Pass::Dither | Pass::Channels | Pass::Difference | Pass::FalseColor => {
                self.encoded(this.pass)?;
            }
        }
        if reused {
            done.ran = false;
            done.reason = "nothing that it depends on has changed: its picture was kept".to_owned();
        }
        Ok(done)
    }

    /// The relit subject times its coverage: how many of its pixels were no numbers, and whether the
    /// picture was at hand.
    fn relight(&mut self, key: u64) -> Result<(usize, bool)> {
        if let Some((linear, mended)) = self.found(|r| &mut r.relit, key) {
            self.linear = linear;
            return Ok((mended, true));
        }
        let of = self.of;
        let gain = self.gain;
        let level =
            |share: [f32; 3]| std::array::from_fn(|c| share[c] * of.levels.subject * gain[c]);
        let weights: Vec<[f32; 3]> = of.weights.per_lamp.iter().map(|&w| level(w)).collect();
        let mut subject = of.field.relight(&weights)?;
        let mended = extend_edges(&mut subject, of.mask);
        for (pixel, &alpha) in subject.pixels.iter_mut().zip(&of.mask.pixels) {
            *pixel = pixel.map(|v| v * alpha);
        }
        self.linear = Arc::new(subject);
        self.keep(|r| &mut r.relit, key, (self.linear.clone(), mended));
        Ok((mended, false))
    }

    /// Draws what is behind the subject: whole, or where the matte is open and at once into the picture.
    /// `keys` are those of the passes whose picture would make this needless.
    fn background(&mut self, keys: [u64; 2]) -> bool {
        let of = self.of;
        if self.scene.background != Background::Environment {
            return false;
        }
        let draw = |picture: &mut Image, mask: &Mask| {
            let panorama = &of.environment.radiance;
            let backdrop = Backdrop::of(self.scene, of.levels.background);
            draw_background(picture, mask, panorama, &backdrop, of.view);
        };
        if draws_whole(&self.effects) {
            let (width, height) = of.mask.size();
            let mut behind = Image::filled(width, height, [0.0; 3]);
            let kept = self.reuse.as_ref().and_then(|r| r.behind.get(keys[0]));
            let reused = kept.is_some();
            self.behind = Some(kept.unwrap_or_else(|| {
                draw(&mut behind, &Mask::filled(width, height, 0.0));
                Arc::new(behind)
            }));
            return reused;
        }
        if self
            .reuse
            .as_ref()
            .is_some_and(|r| r.laid.get(keys[1]).is_some())
        {
            return true;
        }
        draw(Arc::make_mut(&mut self.linear), of.mask);
        self.laid = true;
        false
    }

    /// Puts what is behind the subject out of focus, unless it came so.
    fn blur(&mut self, key: u64) -> bool {
        if self.found(|r| &mut r.behind, key).is_some() {
            return true;
        }
        if let Some(behind) = &mut self.behind {
            let radius = self.effects.background_blur * behind.height as f32;
            background_blur(Arc::make_mut(behind), radius);
        }
        false
    }

    /// Wraps light around the subject where the plan says so, and lays it over what is behind it.
    /// `behind_key` stands for what is behind it.
    fn lay(&mut self, this: &PlannedPass, behind_key: u64) -> bool {
        let of = self.of;
        if let Some(behind) = self.behind.clone() {
            self.keep(|r| &mut r.behind, behind_key, behind);
        }
        if !self.laid
            && let Some(laid) = self.found(|r| &mut r.laid, this.key)
        {
            self.linear = laid;
            return this.run;
        }
        if let Some(behind) = self.behind.take() {
            let linear = Arc::make_mut(&mut self.linear);
            if this.run {
                light_wrap(linear, of.mask, &behind, self.effects.light_wrap);
            }
            let pixels = linear.pixels.par_iter_mut().zip(&behind.pixels);
            let pixels = pixels.zip(&of.mask.pixels).with_min_len(4096);
            pixels.for_each(|((pixel, light), alpha)| {
                (0..3).for_each(|c| pixel[c] += (1.0 - alpha) * light[c]);
            });
        }
        self.keep(|r| &mut r.laid, this.key, self.linear.clone());
        false
    }

    /// Passes on the codes of a display; none where there is no display.
    fn encoded(&mut self, pass: Pass) -> Result<()> {
        let (of, effects) = (self.of, self.effects);
        let Some(codes) = &mut self.display else {
            return Ok(());
        };
        match (pass, effects.inspection) {
            (Pass::Grain, _) => {
                if let Some(plate) = of.extra.grain {
                    let (masks, grains) = ([of.mask, &self.alpha], [plate, &self.own_grain]);
                    grain(codes, masks, grains, effects.grain, self.scene.frame);
                }
            }
            (Pass::Dither, _) => dither(codes, of.mask),
            (Pass::Channels, Inspection::Channel(channel)) => channels(codes, &self.alpha, channel),
            (Pass::Difference, Inspection::Difference { gain }) => {
                if let Some(second) = of.extra.second {
                    difference(codes, second, gain)?;
                }
            }
            (Pass::FalseColor, Inspection::FalseColor) => *codes = false_color(&self.linear),
            _ => (),
        }
        Ok(())
    }

    pub fn finish(self, passes: Vec<PassReport>) -> Picture {
        Picture {
            linear: Arc::unwrap_or_clone(self.linear),
            alpha: self.alpha,
            display: self.display,
            passes,
            view: self.effects.view,
            steady: self.steady,
            spill: self.facts.spill,
        }
    }
}
