//! Description of a pass beyond its name and its strength: when it runs, what its picture depends on, and its steps
//! in memory and on a GPU. Each pass has one in the file of its name; [`crate::PASSES`] lists them.

use super::facts::{Facts, Grain, key};
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::{Encoded, Image, Mask};
use scene::{Background, Effects, Output, Pass, Scene};

/// Decision on one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    pub pass: Pass,
    pub run: bool,
    /// Reason for running it, or for skipping it without a change of the picture; also names a manual override.
    pub reason: String,
    /// Reason why it cannot be forced on or off; None if it can.
    pub fixed: Option<&'static str>,
    /// Key of everything that the picture after this pass depends on: equal keys mean equal pictures. A skipped pass
    /// has the key of the picture before it.
    pub key: u64,
}

/// Reason for running a pass (`Ok`), or for skipping it (`Err`).
pub(crate) type Decision = std::result::Result<String, String>;

/// A pass.
#[derive(Clone, Copy)]
pub(crate) struct Descriptor {
    pub pass: Pass,
    /// Reason why it cannot be forced; None if it can.
    pub fixed: fn(&Scene) -> Option<&'static str>,
    /// Decision to run or skip it.
    pub decide: fn(&PassContext) -> Decision,
    /// Key of its settings and measurements.
    pub settings: fn(&PassContext) -> u64,
    /// Key of its input pictures, from the passes planned before it.
    pub reads: fn(&PassContext, &[PlannedPass]) -> u64,
    /// Its own shader, if it has one.
    pub shader: Option<&'static Shader>,
    pub run: Run,
}

impl Descriptor {
    /// A pass that can be forced, reads the picture before it, and has no settings and no step yet.
    pub const fn new(pass: Pass, decide: fn(&PassContext) -> Decision) -> Self {
        Self {
            pass,
            fixed: |_| None,
            decide,
            settings: |_| 0,
            reads: |_, planned| planned.last().map_or(0, |before| before.key),
            shader: None,
            run: Run::Composed,
        }
    }
}

/// Key of a pass that is already planned.
pub(crate) fn key_in(planned: &[PlannedPass], pass: Pass) -> u64 {
    let found = planned.iter().find(|planned| planned.pass == pass);
    found.map_or(0, |found| found.key)
}

/// Step of a pass.
#[derive(Clone, Copy)]
pub(crate) enum Run {
    /// Runs before the picture is composed: nothing to do.
    Before,
    /// Special steps in [`crate::composition`].
    Composed,
    Light(LightStep),
    Encode(EncodeStep),
    Codes(CodesStep),
}

/// Step from linear light to linear light, on both backends.
#[derive(Clone, Copy)]
pub(crate) struct LightStep {
    pub in_memory: fn(&PassContext, &mut Image),
    pub on_gpu: fn(&PassContext, &mut Recording, &GpuPicture) -> Result<GpuPicture>,
    /// True if its picture is cached: the step costs more than the memory.
    pub cached: bool,
}

/// Step from linear light to display codes; None if the codes stay.
#[derive(Clone, Copy)]
pub(crate) struct EncodeStep {
    pub in_memory: fn(&PassContext, &Image) -> Option<Encoded>,
    pub on_gpu: fn(&PassContext, &mut Recording, &GpuPicture) -> Result<Option<GpuPicture>>,
}

/// Step on display codes. On a GPU the fourth value of codes is the picture's coverage.
#[derive(Clone, Copy)]
pub(crate) struct CodesStep {
    pub in_memory: fn(&PassContext, &CodesInput, &mut Encoded) -> Result<()>,
    /// The last two are the codes, and a picture whose fourth value is the subject's matte.
    pub on_gpu: fn(&PassContext, &CodesInput, &mut Recording, &GpuPicture, &GpuPicture) -> Result<GpuPicture>,
}

/// Further input of steps on codes.
pub(crate) struct CodesInput<'a> {
    /// The subject's coverage.
    pub mask: &'a Mask,
    /// The picture's coverage.
    pub alpha: &'a Mask,
    /// The plate's grain.
    pub plate: Option<&'a Grain>,
    /// Second picture of a comparison.
    pub second: Option<&'a Encoded>,
}

/// Input of a pass's decision and of its step.
pub(crate) struct PassContext<'a> {
    pub scene: &'a Scene,
    /// Strengths of the scene, each within its bounds.
    pub effects: Effects,
    pub facts: &'a Facts,
}

impl PassContext<'_> {
    /// Skips a pass whose strength is 0 in the scene.
    pub fn asked(&self, pass: Pass) -> std::result::Result<(), String> {
        if self.effects.strength(pass) > 0.0 { Ok(()) } else { Err(NOT_ASKED.to_owned()) }
    }

    /// Skips a pass that acts only on the background, if none shows.
    pub fn behind(&self) -> std::result::Result<(), String> {
        let why = if self.scene.background == Background::None {
            NO_BACKGROUND
        } else if is_cut_out(self.scene) {
            "background is off by hand"
        } else if self.facts.open_share > 0.0 {
            return Ok(());
        } else {
            "the subject covers every pixel"
        };
        Err(why.to_owned())
    }

    /// Skips a pass on display codes, if the output has none.
    pub fn displayed(&self) -> std::result::Result<(), String> {
        match self.scene.output {
            Output::Display => Ok(()),
            Output::Linear => Err(LINEAR.to_owned()),
        }
    }
}

/// Reason for skipping a pass.
pub(crate) const NOT_ASKED: &str = "off";
pub(crate) const NO_BACKGROUND: &str = "background is off";
const LINEAR: &str = "the output stays linear";

/// Runs the pass for the reason `yes` if needed; otherwise skips it.
pub(crate) fn decide(run: bool, yes: impl FnOnce() -> String, no: &str) -> Decision {
    if run { Ok(yes()) } else { Err(no.to_owned()) }
}

/// True if there is no background: the scene has none, or it is forced off.
pub(crate) fn is_cut_out(scene: &Scene) -> bool {
    scene.background == Background::None || scene.effects.forced.get(Pass::Background) == Some(false)
}

/// For [`Descriptor::fixed`]: a pass that acts only on the background.
pub(crate) fn needs_background(scene: &Scene) -> Option<&'static str> {
    is_cut_out(scene).then_some("nothing is behind the subject")
}

/// For [`Descriptor::fixed`]: a pass on display codes.
pub(crate) fn needs_display(scene: &Scene) -> Option<&'static str> {
    (scene.output == Output::Linear).then_some(LINEAR)
}

/// For [`Descriptor::settings`]: the inspection that replaces the picture.
pub(crate) fn inspected(context: &PassContext) -> u64 {
    use scene::Inspection::{Channel, Difference, FalseColor, Picture};
    key(match context.effects.inspection {
        Picture | FalseColor => (None, 0),
        Channel(channel) => (Some(channel), 0),
        Difference { gain } => (None, gain.to_bits()),
    })
}
