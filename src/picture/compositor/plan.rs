//! Passes that a scene calls for, with the reasons. The plan is data: it can be shown, tested and overruled.

use super::PASSES;
use super::descriptor::{NOT_ASKED, PassContext, PlannedPass, Run};
use super::facts::{Facts, key};
use scene::{Pass, Scene};

/// Decides about every pass, in the order in which they run.
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
            (Some(true), Err(reason)) if reason == NOT_ASKED => {
                (true, "on by hand; not needed here".to_owned())
            }
            (Some(true), Ok(reason) | Err(reason)) => (true, format!("on by hand; {reason}")),
            // Whether it would be called for was not measured.
            (Some(false), _) => (false, "off by hand".to_owned()),
        };
        let read = (descriptor.reads)(&context, &planned);
        let key = match (descriptor.run, pass) {
            // Whether these had to be made again does not change what they are.
            (Run::Before, _) => read,
            _ if run => key((pass, read, (descriptor.settings)(&context))),
            // Nothing is behind the subject, whatever the panorama is.
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
