//! The settings that can be undone: the light, the picture, and what is set by hand in calibration and training.

mod environments;
mod groups;
mod keyframes;
mod stored;

pub use groups::Group;
pub use stored::AppliedLook;

use super::environment_list::ListedEnvironment;
use super::keyframed::Keyframed;
use super::training::TrainChoice;
use calibration::{Circle, Trial};
use light::Lighting;
use light::keyframes::Keyframes;
use scene::{Background, EXPOSURE_STOPS, Effects, Inspection};
use std::sync::Arc;

/// The settings that can be undone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LookSettings {
    /// The list of environments.
    pub environments: Arc<Vec<ListedEnvironment>>,
    /// Entry of the list.
    pub environment: usize,
    /// From −180 (exclusive) to 180 degrees; with keys, their value at the current frame.
    pub yaw_deg: f32,
    /// Yaws over the frames of the interview.
    pub yaw_keys: Keyframes,
    /// Stops over the frames of the interview; with keys, `lighting` has their value at the current frame.
    pub intensity_keys: Keyframes,
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

    /// Goes on in the list, around its end.
    pub(super) fn step_environment(&mut self, step: isize) {
        let count = self.environments.len() as isize;
        if count > 0 {
            self.environment = (self.environment as isize + step).rem_euclid(count) as usize;
        }
    }

    /// Sets the yaw; with keys it may go around any number of times.
    pub(super) fn turn_to(&mut self, degrees: f32) {
        if !degrees.is_finite() {
            return;
        }
        self.yaw_deg = match self.is_keyed(Keyframed::Yaw) {
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

    /// Looks at something in place of the picture, or at the picture again.
    pub(super) fn inspect(&mut self, inspection: Inspection) {
        let shown = &mut self.effects.inspection;
        *shown = match *shown == inspection {
            true => Inspection::Picture,
            false => inspection,
        };
    }
}
