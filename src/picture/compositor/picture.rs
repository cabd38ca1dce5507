//! Ingredients and results of a picture: plain data.

use super::camera_view::CameraView;
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
    /// OLATs of the scene's frame. Values outside the mask are not used.
    pub field: &'a Field,
    /// Coverage of the subject in that frame.
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
    /// Ingredients of a single picture, seen from the camera, without input of further effects.
    pub fn new(field: &'a Field, mask: &'a Mask, weights: &'a LightWeights, environment: &'a Environment) -> Self {
        Self {
            field,
            mask,
            weights,
            environment,
            levels: Levels::default(),
            view: CameraView::default(),
            upstream: Upstream::default(),
            extra: Extra::default(),
        }
    }

    /// Plate that the light is brought to, if any.
    pub fn plate(&self) -> Option<&'a Plate> {
        (self.extra.plate).filter(|plate| plate.is_larger(self.mask.size()))
    }

    /// Plate whose fine light is added, if any.
    pub(crate) fn finely_lit(&self) -> Option<&'a Plate> {
        (self.plate()).filter(|plate| !self.extra.draft && plate.has_fine_light())
    }

    /// Coverage of the subject at the picture's size.
    pub fn matte(&self) -> &'a Mask {
        self.plate().map_or(self.mask, |plate| &plate.matte)
    }
}

/// Input of some effects; an effect does nothing without its input.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extra<'a> {
    /// Plate of the frame, if the picture takes its size.
    pub plate: Option<&'a Plate>,
    /// The frame as filmed at the working size, linear, for the background [`scene::Background::Plate`] of a picture without
    /// plate.
    pub filmed: Option<&'a Image>,
    /// Light of the picture that the background [`scene::Background::File`] shows, of any size.
    pub behind: Option<&'a Image>,
    /// True if speed matters more than sharpness: the plate's fine light is left out.
    pub draft: bool,
    /// Data from the frame before, for the pass `smoothing`: its [`Picture::steady`].
    pub before: Option<&'a Steady>,
    /// Grain of the plate under the scene's view transform, for the pass `grain`.
    pub grain: Option<&'a Grain>,
    /// Second picture of the same size, for the pass `difference`.
    pub second: Option<&'a Encoded>,
    /// Numbers by which [`crate::compose_reusing`] recognizes its inputs.
    pub identity: Identity,
}

/// Keys chosen by the caller: equal numbers mean equal inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Identity {
    /// Field, matte and plate of the frame: another frame or another network has another number.
    pub frame: u64,
    /// Environment at yaw 0.
    pub environment: u64,
    /// Picture that a background's file shows.
    pub behind: u64,
    /// Second picture.
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
    /// sRGB codes of `linear` under the scene's view transform with grain and dither, or the inspection
    /// in their place; None if the scene's output is linear.
    pub display: Option<Encoded>,
    /// Reports on all passes, run or skipped, in order.
    pub passes: Vec<PassReport>,
    /// Transform from `linear` to display codes.
    pub view: ViewTransform,
    /// Data for smoothing the next frame's picture; None without smoothing in the scene.
    pub steady: Option<Steady>,
    /// Measured spill; None without despill in the scene.
    pub spill: Option<Spill>,
}

/// Outcome of one pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassReport {
    pub name: String,
    pub ran: bool,
    pub reason: String,
    /// Reason why it cannot be forced on or off; None if it can.
    #[serde(skip)]
    pub fixed: Option<String>,
    /// Time in milliseconds, including the measurement of its need: on the CPU by the wall clock,
    /// on a GPU by its own clock, from the start to the end of each shader. None on a GPU without such a
    /// clock; 0 if nothing was done.
    pub ms: Option<f64>,
}
