//! Passes that a scene needs, with the reasons. The plan is data: it can be shown, tested and overruled.

use super::PASSES;
use super::descriptor::{NOT_ASKED, PassContext, PlannedPass, Run};
use super::facts::{Facts, key};
use scene::{Pass, Scene};

/// Decides on every pass, in running order.
pub fn plan(scene: &Scene, facts: &Facts) -> Vec<PlannedPass> {
    let context = PassContext { scene, effects: scene.effects.bounded(), facts };
    let mut planned: Vec<PlannedPass> = Vec::with_capacity(PASSES.len());
    for descriptor in PASSES {
        let pass = descriptor.pass;
        let fixed = (descriptor.fixed)(scene);
        let forced = context.effects.forced.get(pass);
        let decision = (descriptor.decide)(&context);
        let (run, reason) = match (forced.filter(|_| fixed.is_none()), decision) {
            (None, Ok(reason)) => (true, reason),
            (None, Err(reason)) => (false, reason),
            (Some(true), Err(reason)) if reason == NOT_ASKED => (true, "on by hand; not needed here".to_owned()),
            (Some(true), Ok(reason) | Err(reason)) => (true, format!("on by hand; {reason}")),
            // Its need was not measured.
            (Some(false), _) => (false, "off by hand".to_owned()),
        };
        let read = (descriptor.reads)(&context, &planned);
        let key = match (descriptor.run, pass) {
            // Recomputing these does not change them.
            (Run::Before, _) => read,
            _ if run => key((pass, read, (descriptor.settings)(&context))),
            // Without a background the panorama does not matter.
            (_, Pass::Background) => 0,
            _ => read,
        };
        planned.push(PlannedPass { pass, run, reason, fixed, key });
    }
    planned
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
