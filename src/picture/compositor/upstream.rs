//! The passes `predict` and `weights`, which are made before a picture is composed and cached by whoever asks for it.

use super::descriptor::{Descriptor, Run, decide};
use super::facts::key;
use scene::Pass;

const CACHED: &str = "no picture is made without it";

pub(crate) const PREDICT: Descriptor = Descriptor {
    fixed: |_| Some(CACHED),
    reads: |context, _| key((context.scene.frame, context.facts.inputs.frame)),
    run: Run::Before,
    ..Descriptor::new(Pass::Predict, |context| {
        decide(
            !context.facts.field_cached,
            || format!("frame {} was not predicted yet", context.scene.frame),
            "cached",
        )
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
