//! Passes `predict` and `weights`, which run before composition; the caller caches them.

use super::descriptor::{Descriptor, Run, decide};
use super::facts::key;
use scene::Pass;

const CACHED: &str = "every picture needs it";

pub(crate) const PREDICT: Descriptor = Descriptor {
    fixed: |_| Some(CACHED),
    reads: |context, _| key((context.scene.frame, context.facts.inputs.frame)),
    run: Run::Before,
    ..Descriptor::new(Pass::Predict, |context| {
        decide(!context.facts.field_cached, || format!("frame {} was not predicted yet", context.scene.frame), "cached")
    })
};

pub(crate) const WEIGHTS: Descriptor = Descriptor {
    fixed: |_| Some(CACHED),
    reads: |context, _| context.facts.inputs.light,
    run: Run::Before,
    ..Descriptor::new(Pass::Weights, |context| {
        decide(
            !context.facts.weights_cached,
            || "the environment, its rotation or its grade has changed".to_owned(),
            "cached",
        )
    })
};
