//! The settings that can be undone: the light, the picture, and what is set by hand in calibration and training.

mod environments;
mod groups;
mod keyframes;
mod stored;

pub use groups::Group;
pub use stored::AppliedLook;

use super::environment_list::ListedEnvironment;
use super::training::TrainChoice;
use calibration::{Circle, Trial};
use light::Lighting;
use scene::{Animation, Background, EXPOSURE_STOPS, Effects, Setting};
use std::sync::Arc;

/// The settings that can be undone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LookSettings {
    /// The list of environments.
    pub environments: Arc<Vec<ListedEnvironment>>,
    /// Entry of the list.
    pub environment: usize,
    /// Keys of settings over the frames of the interview. A setting with keys has their value at the current frame.
    pub animation: Animation,
    /// From −180 (exclusive) to 180 degrees; with keys, any number of turns.
    pub yaw_deg: f32,
    pub exposure_stops: f32,
    pub lighting: Lighting,
    pub effects: Effects,
    pub background: Background,
    /// The mirror ball's outline if it was set by hand.
    pub circle: Option<Circle>,
    /// The response that is tried by hand.
    pub trial: Option<Trial>,
    /// How to train, if it was chosen by hand.
    pub training: Option<TrainChoice>,
}

impl LookSettings {
    /// Lights the subject by an entry of the list, if there is one.
    pub(super) fn light_by(&mut self, entry: usize) {
        if entry < self.environments.len() {
            self.environment = entry;
        }
    }

    /// Sets the yaw; with keys it may go around any number of times.
    pub(super) fn turn_to(&mut self, degrees: f32) {
        if !degrees.is_finite() {
            return;
        }
        self.yaw_deg = match self.is_keyed(Setting::Yaw) {
            true => degrees,
            false => 180.0 - (180.0 - degrees).rem_euclid(360.0),
        };
    }

    /// Sets the exposure within its range; NaN changes nothing.
    pub(super) fn expose(&mut self, stops: f32) {
        if !stops.is_nan() {
            self.exposure_stops = stops.clamp(*EXPOSURE_STOPS.start(), *EXPOSURE_STOPS.end());
        }
    }
}
