//! Measurements of a picture in progress, if the plan needs them.

use super::{Backend, Composition};
use crate::descriptor::{PlannedPass, is_cut_out};
use crate::facts::{Grain, Inputs, key};
use crate::picture::Ingredients;
use crate::smoothing::Steady;
use base::error::Result;
use scene::Pass;

impl<B: Backend> Composition<'_, B> {
    /// Measures the need for the last of these passes, if the scene requests it and nothing else decides it.
    /// Returns true if something was measured.
    pub fn measure(&mut self, planned: &[PlannedPass]) -> Result<bool> {
        let [earlier @ .., this] = planned else { return Ok(false) };
        let (ingredients, effects) = (self.ingredients, self.effects);
        let asked = effects.asks(this.pass);
        let upstream = key(earlier.iter().map(|p| p.key).collect::<Vec<_>>());
        match this.pass {
            Pass::Smoothing if asked => {
                let (frame, before) = (self.scene.frame, ingredients.extra.before);
                let even = || self.backend.even_samples();
                let steady = Steady::after(before, frame, effects.smoothing, even)?;
                self.facts.steady_gain = Some(steady.gain);
                self.steady = Some(steady);
            }
            Pass::Despill if asked => {
                let guide = |this: &mut Self| this.backend.guide(&this.linear);
                let (guide, spill) = self.cached(|cache| &mut cache.spill, upstream, guide)?;
                self.guide = Some(guide);
                self.facts.spill = Some(spill);
            }
            Pass::LightWrap if asked => {
                let Some(behind) = self.behind.clone() else { return Ok(false) };
                let need = |this: &mut Self| this.backend.wrap_need(&this.linear, &behind);
                self.facts.wrap_need = self.cached(|cache| &mut cache.wrap_need, upstream, need)?;
            }
            Pass::Glare if asked => {
                let brightest = |this: &mut Self| this.backend.brightest(&this.linear);
                self.facts.brightest = self.cached(|cache| &mut cache.brightest, upstream, brightest)?;
            }
            Pass::Grain if asked => {
                let (Some(plate), Some(_)) = (ingredients.extra.grain, &self.display) else { return Ok(false) };
                let own = |this: &mut Self| match &this.display {
                    Some(codes) => this.backend.measure_grain(codes),
                    None => Ok(Grain::default()),
                };
                let own = self.cached(|cache| &mut cache.grain, upstream, own)?;
                let mut missing = plate.beyond(&own, effects.grain).most();
                if !is_cut_out(self.scene) && self.facts.open_share > 0.0 {
                    missing = missing.max(effects.grain * plate.most());
                }
                self.facts.own_grain = own;
                self.facts.missing_grain = missing;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

/// Hashes of a picture's ingredients. Lamps and levels are few and are hashed here;
/// the caller provides the keys of large data.
pub fn inputs(ingredients: &Ingredients) -> Inputs {
    let bits = f32::to_bits;
    let identity = ingredients.extra.identity;
    let weights: Vec<[u32; 3]> = ingredients.weights.per_lamp.iter().map(|w| w.map(bits)).collect();
    let grain = ingredients.extra.grain.map(|grain| grain.deviation.map(|bin| bin.map(bits)));
    Inputs {
        frame: key((identity.frame, ingredients.mask.size(), ingredients.matte().size())),
        light: key((weights, bits(ingredients.levels.subject))),
        backdrop: key((
            identity.environment,
            bits(ingredients.levels.background),
            bits(ingredients.view.vertical_fov_deg),
            ingredients.matte().size(),
        )),
        behind: key((identity.behind, ingredients.matte().size())),
        grain: key(grain),
        second: identity.second,
    }
}
