//! Description of a pass beside its name and its strength: when it runs, what its picture depends on, and how it is
//! made in memory and on a GPU. Each pass has one in the file of its name; [`crate::PASSES`] lists them.

use super::facts::{Facts, Grain, key};
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::{Encoded, Image, Mask};
use scene::{Background, Effects, Output, Pass, Scene};

/// The decision about one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    pub pass: Pass,
    pub run: bool,
    /// Reason for running it, or for skipping it without a change of the picture; it also says if it was forced.
    pub reason: String,
    /// Reason that it cannot be forced to run or to be skipped; None if it can.
    pub fixed: Option<&'static str>,
    /// Stands for all that the picture after this pass depends on: equal keys stand for equal pictures. A pass that is
    /// skipped has the key of the picture that it passes on.
    pub key: u64,
}

/// Reason for running a pass (`Ok`), or that it may be skipped (`Err`).
pub(crate) type Decision = std::result::Result<String, String>;

/// A pass.
#[derive(Clone, Copy)]
pub(crate) struct Descriptor {
    pub pass: Pass,
    /// Reason that it cannot be forced; None if it can.
    pub fixed: fn(&Scene) -> Option<&'static str>,
    /// The decision to run it or to skip it.
    pub decide: fn(&PassContext) -> Decision,
    /// Stands for the settings and measurements that it goes by.
    pub settings: fn(&PassContext) -> u64,
    /// Stands for the pictures that it reads, by the passes that are planned before it.
    pub reads: fn(&PassContext, &[PlannedPass]) -> u64,
    /// Its shader, if it has one of its own.
    pub shader: Option<&'static Shader>,
    pub run: Run,
}

impl Descriptor {
    /// A pass that can be forced, reads the picture before it, has no settings and no run of its own.
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

/// The key of a pass that is planned already.
pub(crate) fn key_of(planned: &[PlannedPass], pass: Pass) -> u64 {
    let found = planned.iter().find(|planned| planned.pass == pass);
    found.map_or(0, |found| found.key)
}

/// The way a pass is made.
#[derive(Clone, Copy)]
pub(crate) enum Run {
    /// Before the picture is composed: there is nothing to do.
    Before,
    /// By steps of its own in [`crate::composition`].
    Composed,
    Light(LightStep),
    Encode(EncodeStep),
    Codes(CodesStep),
}

/// A step from a picture in linear light to another, on both backends.
#[derive(Clone, Copy)]
pub(crate) struct LightStep {
    pub in_memory: fn(&PassContext, &mut Image),
    pub on_gpu: fn(&PassContext, &mut Recording, &GpuPicture) -> Result<GpuPicture>,
    /// The picture after it is cached: it costs more than memory for one.
    pub cached: bool,
}

/// A step from linear light to codes of a display; None if the codes stay.
#[derive(Clone, Copy)]
pub(crate) struct EncodeStep {
    pub in_memory: fn(&PassContext, &Image) -> Option<Encoded>,
    pub on_gpu: fn(&PassContext, &mut Recording, &GpuPicture) -> Result<Option<GpuPicture>>,
}

/// A step on codes of a display. On a GPU the fourth value of codes is the picture's coverage.
#[derive(Clone, Copy)]
pub(crate) struct CodesStep {
    pub in_memory: fn(&PassContext, &CodesInput, &mut Encoded) -> Result<()>,
    /// The last two are the codes, and a picture whose fourth value is the subject's matte.
    pub on_gpu: fn(
        &PassContext,
        &CodesInput,
        &mut Recording,
        &GpuPicture,
        &GpuPicture,
    ) -> Result<GpuPicture>,
}

/// Further input of steps on codes.
pub(crate) struct CodesInput<'a> {
    /// The subject's coverage.
    pub mask: &'a Mask,
    /// The picture's coverage.
    pub alpha: &'a Mask,
    /// The plate's grain.
    pub plate: Option<&'a Grain>,
    /// The picture to compare with.
    pub second: Option<&'a Encoded>,
}

/// Input that a pass is decided and made by.
pub(crate) struct PassContext<'a> {
    pub scene: &'a Scene,
    /// The scene's, each strength within its bounds.
    pub effects: Effects,
    pub facts: &'a Facts,
}

impl PassContext<'_> {
    /// Refuses a pass that the scene does not ask for by its strength.
    pub fn asked(&self, pass: Pass) -> std::result::Result<(), String> {
        if self.effects.strength(pass) > 0.0 { Ok(()) } else { Err(NOT_ASKED.to_owned()) }
    }

    /// Refuses what only shows behind the subject, if nothing does.
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

    /// Refuses what needs codes of a display, if the picture has none.
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

/// `yes` if it runs, else why not.
pub(crate) fn decide(run: bool, yes: impl FnOnce() -> String, no: &str) -> Decision {
    if run { Ok(yes()) } else { Err(no.to_owned()) }
}

/// Nothing is behind the subject: the scene asks for no background, or it is forced off.
pub(crate) fn is_cut_out(scene: &Scene) -> bool {
    scene.background == Background::None
        || scene.effects.forced.get(Pass::Background) == Some(false)
}

/// For [`Descriptor::fixed`]: a pass that only shows behind the subject.
pub(crate) fn needs_background(scene: &Scene) -> Option<&'static str> {
    is_cut_out(scene).then_some("nothing is behind the subject")
}

/// For [`Descriptor::fixed`]: a pass on codes of a display.
pub(crate) fn needs_display(scene: &Scene) -> Option<&'static str> {
    (scene.output == Output::Linear).then_some(LINEAR)
}

/// For [`Descriptor::settings`]: what is shown in place of the picture.
pub(crate) fn inspected(context: &PassContext) -> u64 {
    use scene::Inspection::{Channel, Difference, FalseColor, Picture};
    key(match context.effects.inspection {
        Picture | FalseColor => (None, 0),
        Channel(channel) => (Some(channel), 0),
        Difference { gain } => (None, gain.to_bits()),
    })
}
