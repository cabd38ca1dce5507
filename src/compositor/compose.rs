//! Makes pictures: from a reflectance field to what a scene asks for, with a report on every pass.

use super::background::CameraView;
use super::despill::Spill;
use super::field::Field;
use super::grain::Grain;
use super::levels::Levels;
use super::plan::{PlannedPass, plan};
use super::reuse::Reuse;
use super::smoothing::Steady;
use super::stage::{Hand, InMemory, OnGpu, Stage, inputs};
use base::error::{Error, Result};
use imaging::{Encoded, Image, Mask};
use light::{Environment, LightWeights};
use scene::{Scene, ViewTransform};
use serde::{Deserialize, Serialize};

/// What a picture is made of.
#[derive(Clone, Copy, Debug)]
pub struct Ingredients<'a> {
    /// The scene's frame under every lamp. Values outside the mask are not used.
    pub field: &'a Field,
    /// The subject's coverage in that frame.
    pub mask: &'a Mask,
    /// The lamps' shares of the environment at the scene's yaw.
    pub weights: &'a LightWeights,
    pub environment: &'a Environment,
    pub levels: Levels,
    pub view: CameraView,
    pub upstream: Upstream,
    /// What some effects read besides.
    pub extra: Extra<'a>,
}

/// What some effects read; an effect whose own is missing does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extra<'a> {
    /// What the frame before handed on, for the pass `smoothing`: its [`Picture::steady`].
    pub before: Option<&'a Steady>,
    /// The plate's grain under the scene's view transform, for the pass `grain`.
    pub grain: Option<&'a Grain>,
    /// A second picture of the same size, for the pass `difference`.
    pub second: Option<&'a Encoded>,
    /// By what [`compose_reusing`] knows that it was given the same again.
    pub identity: Identity,
}

/// Numbers that whoever asks for pictures chooses: where one is the same, so is what it stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Identity {
    /// The frame's field and matte: another frame or another network is another number.
    pub frame: u64,
    /// The environment at no yaw.
    pub environment: u64,
    /// The second picture.
    pub second: u64,
}

/// What the two passes before the compositor took in milliseconds; `None` where the result was there
/// already.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Upstream {
    pub predict_ms: Option<f64>,
    pub weights_ms: Option<f64>,
}

/// A relit picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Scene-linear light, premultiplied by `alpha`. Glare may lie where `alpha` is 0. It is there where
    /// the scene's output is linear or the picture is not opaque; from the CPU always.
    pub linear: Option<Image>,
    /// Coverage: the subject's matte, or 1 everywhere in front of a background.
    pub alpha: Mask,
    /// sRGB codes of `linear` under the scene's view transform with grain and dither, or what is inspected
    /// in their place; where the scene is for a display.
    pub display: Option<Encoded>,
    /// What ran and what did not, in order.
    pub passes: Vec<PassReport>,
    /// How `linear` becomes codes of a display.
    pub view: ViewTransform,
    /// What the next frame's picture needs to be as bright, where the scene asks for smoothing.
    pub steady: Option<Steady>,
    /// The spill that was measured, where the scene asks for despill.
    pub spill: Option<Spill>,
}

/// What became of one pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassReport {
    pub name: String,
    pub ran: bool,
    pub reason: String,
    /// Why it cannot be forced to run or to be left out; nothing where it can.
    #[serde(skip)]
    pub fixed: Option<String>,
    /// Time it took in milliseconds, measuring whether it is called for included: on the CPU by the wall,
    /// on a GPU by its own clock, from the start to the end of each shader. None on a GPU without such a
    /// clock; 0 where nothing was done.
    pub ms: Option<f64>,
}

/// Makes the picture that `scene` asks for.
///
/// # Errors
/// When field, mask and weights do not belong together, the view is impossible, or a GPU fails.
pub fn compose(scene: &Scene, of: &Ingredients) -> Result<Picture> {
    make(scene, of, None, None)
}

/// Makes the picture that `scene` asks for. Pictures after chosen passes are kept in `reuse` and taken
/// from there as long as nothing that they depend on has changed: `of.extra.identity` has to say so.
///
/// # Errors
/// As [`compose`].
pub fn compose_reusing(scene: &Scene, of: &Ingredients, reuse: &mut Reuse) -> Result<Picture> {
    make(scene, of, None, Some(reuse))
}

/// Runs a plan as it is given: a test may force what [`plan`] would skip. Every pass has to be in it.
///
/// # Errors
/// As [`compose`].
pub fn execute(scene: &Scene, of: &Ingredients, passes: &[PlannedPass]) -> Result<Picture> {
    make(scene, of, Some(passes), None)
}

fn make(
    scene: &Scene,
    of: &Ingredients,
    given: Option<&[PlannedPass]>,
    mut reuse: Option<&mut Reuse>,
) -> Result<Picture> {
    check(of)?;
    let inputs = inputs(of);
    match of.field {
        Field::Gpu(field, passes) => passes.guarded(|| {
            let uploads = reuse.as_mut().map(|r| r.gpu.own.clone());
            let hand = OnGpu::new(of, inputs, (field, passes), uploads.unwrap_or_default())?;
            perform(Stage::new(scene, of, inputs, hand, reuse), given)
        }),
        _ => {
            let rim = reuse.as_mut().map(|r| r.memory.own.clone());
            let hand = InMemory::new(of, inputs, rim.unwrap_or_default());
            perform(Stage::new(scene, of, inputs, hand, reuse), given)
        }
    }
}

/// Goes through the plan, pass by pass.
fn perform<H: Hand>(mut stage: Stage<H>, given: Option<&[PlannedPass]>) -> Result<Picture> {
    let mut planned = plan(stage.scene, stage.facts());
    let mut done = Vec::with_capacity(planned.len());
    for index in 0..planned.len() {
        stage.begin(planned[index].pass);
        let measured = stage.measure(&planned[..=index])?;
        if measured {
            planned = plan(stage.scene, stage.facts());
        }
        if let Some(forced) = given.and_then(|given| given.get(index)) {
            planned[index] = forced.clone();
        }
        done.push(stage.run(&planned, index, measured)?);
    }
    stage.finish(done)
}

fn check(of: &Ingredients) -> Result<()> {
    let remedy = "Predict this frame again with the network of this project";
    let field = of.field;
    let (width, height) = field.size();
    if (width, height) != of.mask.size() {
        return Err(Error::invalid(
            format!(
                "the reflectance field has {width} × {height} pixels, but the matte has {} × {}",
                of.mask.width, of.mask.height
            ),
            remedy,
        ));
    }
    if field.lamps() != of.weights.per_lamp.len() {
        return Err(Error::invalid(
            format!(
                "the reflectance field has {} lamps, but there are weights for {}",
                field.lamps(),
                of.weights.per_lamp.len()
            ),
            remedy,
        ));
    }
    if of.environment.radiance.pixels.is_empty() {
        return Err(Error::invalid(
            format!("the environment {} has no texels", of.environment.name),
            "Choose another environment",
        ));
    }
    let fov = of.view.vertical_fov_deg;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(Error::invalid(
            format!("the background's field of view is {fov}°, not between 0° and 180°"),
            "Leave it at 40°",
        ));
    }
    Ok(())
}

#[cfg(test)]
#[path = "compose_tests.rs"]
pub(super) mod tests;

#[cfg(test)]
#[path = "effects_tests.rs"]
mod effects_tests;
