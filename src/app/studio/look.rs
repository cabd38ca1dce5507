//! The settings that can be undone: the light, the picture, and what is set by hand in calibration and training.

mod copied_light;
mod environments;
mod groups;
mod keyframes;
mod stored;

pub use copied_light::{CopiedLight, MOST_LETTERS};
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
    /// First and last frame that are played and exported; None for all.
    pub range: Option<(usize, usize)>,
    /// The mirror ball's outline if it was set by hand.
    pub circle: Option<Circle>,
    /// The response that is tried by hand.
    pub trial: Option<Trial>,
    /// Training choice, if it was made by hand.
    pub training: Option<TrainChoice>,
}

/// The same angle, above −180° and up to 180°.
pub fn within_a_turn(degrees: f32) -> f32 {
    match degrees > -180.0 && degrees <= 180.0 {
        true => degrees,
        false => 180.0 - (180.0 - degrees).rem_euclid(360.0),
    }
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
            false => within_a_turn(degrees),
        };
    }

    /// First and last of `frames` frames that are played and exported.
    pub fn range_of(&self, frames: usize) -> (usize, usize) {
        let most = frames.saturating_sub(1);
        let (first, last) = self.range.unwrap_or((0, most));
        (first.min(most), last.min(most))
    }

    /// Sets the first and the last of `frames` frames that are played and exported, as far as they are in order.
    pub(super) fn set_range(&mut self, range: Option<(usize, usize)>, frames: usize) {
        let range = range.filter(|(first, last)| first <= last);
        let all = (0, frames.saturating_sub(1));
        self.range = range.filter(|range| *range != all);
    }

    /// Sets the exposure within its range; NaN changes nothing.
    pub(super) fn expose(&mut self, stops: f32) {
        if !stops.is_nan() {
            self.exposure_stops = stops.clamp(*EXPOSURE_STOPS.start(), *EXPOSURE_STOPS.end());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_is_brought_within_a_turn_and_one_that_is_there_stays_as_it_is() {
        for (degrees, within) in [
            (442.0, 82.0),
            (-180.0, 180.0),
            (180.0, 180.0),
            (190.0, -170.0),
            (-725.0, -5.0),
            (0.1, 0.1),
            (-179.9, -179.9),
        ] {
            assert_eq!(within_a_turn(degrees), within);
        }
    }

    #[test]
    fn a_range_lies_within_the_interview() {
        let mut look = LookSettings::default();
        assert_eq!(look.range_of(8), (0, 7));
        look.set_range(Some((5, 99)), 8);
        assert_eq!(look.range_of(8), (5, 7));
        assert_eq!(look.range_of(0), (0, 0));
        look.set_range(Some((0, 7)), 8);
        assert_eq!(look.range, None, "all frames");
        look.set_range(Some((5, 4)), 8);
        assert_eq!(look.range, None, "none at all");
    }
}
