//! What a picture is measured by while it is made, where the plan asks.

use super::Stage;
use crate::compositor::compose::Ingredients;
use crate::compositor::despill::{guide, rim, spill};
use crate::compositor::glare::brightest;
use crate::compositor::grain::Grain;
use crate::compositor::light_wrap::need;
use crate::compositor::pass::Pass;
use crate::compositor::plan::{Inputs, PlannedPass, key};
use crate::compositor::smoothing::Steady;
use crate::error::Result;
use crate::scene::Background;
use std::sync::Arc;

impl Stage<'_> {
    /// Measures whether the last of these passes is called for, where the scene asks for it and nothing
    /// else says so. Whether something was measured.
    pub fn measure(&mut self, planned: &[PlannedPass]) -> Result<bool> {
        let [earlier @ .., this] = planned else {
            return Ok(false);
        };
        let (of, effects) = (self.of, self.effects);
        let upstream = key(earlier.iter().map(|p| p.key).collect::<Vec<_>>());
        match this.pass {
            Pass::Smoothing if effects.smoothing > 0.0 => {
                let (frame, before) = (self.scene.frame, of.extra.before);
                let steady = Steady::after(before, frame, of.field, of.mask, effects.smoothing)?;
                self.facts.steady_gain = Some(steady.gain);
                self.steady = Some(steady);
            }
            Pass::Despill if effects.despill > 0.0 => {
                let frame = self.facts.inputs.frame;
                let rim = self.kept(|r| &mut r.rim, frame, || Arc::new(rim(of.mask)));
                let linear = self.linear.clone();
                let (guide, spill) = self.kept(
                    |r| &mut r.spill,
                    upstream,
                    || {
                        let guide = guide(&linear, of.mask, &rim);
                        let spill = spill(&linear, &guide);
                        (Arc::new(guide), spill)
                    },
                );
                self.guide = Some(guide);
                self.facts.spill = Some(spill);
            }
            Pass::LightWrap if effects.light_wrap > 0.0 => {
                let Some(behind) = self.behind.clone() else {
                    return Ok(false);
                };
                let linear = self.linear.clone();
                let need = || need(&linear, of.mask, &behind);
                self.facts.wrap_need = self.kept(|r| &mut r.wrap_need, upstream, need);
            }
            Pass::Glare if effects.glare > 0.0 => self.facts.brightest = brightest(&self.linear),
            Pass::Grain if effects.grain > 0.0 => {
                let (Some(plate), Some(codes)) = (of.extra.grain, &self.display) else {
                    return Ok(false);
                };
                self.own_grain = Grain::of(codes, of.mask);
                let mut missing = plate.beyond(&self.own_grain, effects.grain).most();
                if self.scene.background == Background::Environment && self.facts.open_share > 0.0 {
                    missing = missing.max(effects.grain * plate.most());
                }
                self.facts.missing_grain = missing;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

/// Numbers that stand for what a picture is made of. Lamps and levels are few and are read themselves;
/// for what is large, whoever asks has to answer.
pub fn inputs(of: &Ingredients) -> Inputs {
    let bits = f32::to_bits;
    let identity = of.extra.identity;
    let weights: Vec<[u32; 3]> = of.weights.per_lamp.iter().map(|w| w.map(bits)).collect();
    let grain = of
        .extra
        .grain
        .map(|grain| grain.deviation.map(|bin| bin.map(bits)));
    Inputs {
        frame: key((identity.frame, of.mask.size())),
        light: key((weights, bits(of.levels.subject))),
        backdrop: key((
            identity.environment,
            bits(of.levels.background),
            bits(of.view.vertical_fov_deg),
            of.mask.size(),
        )),
        grain: key(grain),
        second: identity.second,
    }
}
