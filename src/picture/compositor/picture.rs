//! Ingredients and results of a picture: plain data.

use super::background::CameraView;
use super::facts::{Grain, Spill};
use super::field::Field;
use super::levels::Levels;
use super::plate::Plate;
use super::smoothing::Steady;
use imaging::{Encoded, Image, Mask};
use light::{Environment, LightWeights};
use scene::ViewTransform;
use serde::{Deserialize, Serialize};

/// Ingredients of a picture.
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
    /// Further input of some effects.
    pub extra: Extra<'a>,
}

impl<'a> Ingredients<'a> {
    /// The plate, if the light has to be brought to its size.
    pub fn plate(&self) -> Option<&'a Plate> {
        (self.extra.plate).filter(|plate| plate.is_larger(self.mask.size()))
    }

    /// The plate, if its fine light is to be added.
    pub(crate) fn finely_lit(&self) -> Option<&'a Plate> {
        (self.plate()).filter(|plate| !self.extra.draft && plate.has_fine_light())
    }

    /// The subject's coverage at the picture's size.
    pub fn matte(&self) -> &'a Mask {
        self.plate().map_or(self.mask, |plate| &plate.matte)
    }
}

/// Input of some effects; an effect does nothing if its input is missing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extra<'a> {
    /// The frame's plate, if the picture is to have its size.
    pub plate: Option<&'a Plate>,
    /// A picture that is soon there is better than a sharp one: the plate's fine light is left out.
    pub draft: bool,
    /// Data that the frame before handed on, for the pass `smoothing`: its [`Picture::steady`].
    pub before: Option<&'a Steady>,
    /// The plate's grain under the scene's view transform, for the pass `grain`.
    pub grain: Option<&'a Grain>,
    /// A second picture of the same size, for the pass `difference`.
    pub second: Option<&'a Encoded>,
    /// Numbers by which [`crate::compose_reusing`] recognizes its inputs.
    pub identity: Identity,
}

/// Numbers that the caller chooses: equal numbers stand for equal things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Identity {
    /// The frame's field, matte and plate: another frame or another network is another number.
    pub frame: u64,
    /// The environment at no yaw.
    pub environment: u64,
    /// The second picture.
    pub second: u64,
}

/// Times of the two passes before the compositor in milliseconds; None if the result was cached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Upstream {
    pub predict_ms: Option<f64>,
    pub weights_ms: Option<f64>,
}

/// A relit picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Scene-linear light, premultiplied by `alpha`. Glare may lie where `alpha` is 0. None if
    /// the output is a display, the picture is opaque and a GPU made it.
    pub linear: Option<Image>,
    /// Coverage: the subject's matte, or 1 everywhere in front of a background.
    pub alpha: Mask,
    /// sRGB codes of `linear` under the scene's view transform with grain and dither, or what is inspected
    /// in their place; None if the scene's output is linear.
    pub display: Option<Encoded>,
    /// Passes that ran and that did not, in order.
    pub passes: Vec<PassReport>,
    /// The transform from `linear` to codes of a display.
    pub view: ViewTransform,
    /// Data that the next frame's picture is smoothed by; None if the scene does not ask for smoothing.
    pub steady: Option<Steady>,
    /// The spill that was measured; None if the scene does not ask for despill.
    pub spill: Option<Spill>,
}

/// The outcome of one pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassReport {
    pub name: String,
    pub ran: bool,
    pub reason: String,
    /// Reason that it cannot be forced to run or to be skipped; None if it can.
    #[serde(skip)]
    pub fixed: Option<String>,
    /// Time it took in milliseconds, measuring whether it is called for included: on the CPU by the wall,
    /// on a GPU by its own clock, from the start to the end of each shader. None on a GPU without such a
    /// clock; 0 if nothing was done.
    pub ms: Option<f64>,
}
