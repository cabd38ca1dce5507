//! Undoable settings: the light, the picture, and manual settings of calibration and training.

mod copied_light;
mod environments;
mod groups;
mod keyframes;
mod stored;

pub use copied_light::{CopiedLight, MOST_LETTERS};
pub use groups::Group;

use super::environment_list::ListedEnvironment;
use super::panels::training::query::TrainChoice;
use calibration::{Circle, Trial};
use scene::{Look, Setting};
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// The undoable settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LookSettings {
    /// The list of environments.
    pub environments: Arc<Vec<ListedEnvironment>>,
    /// Index of the current environment in the list.
    pub environment: usize,
    /// The look that is saved and exported; its fields can be read and set as those of these settings. A setting with
    /// keys has its value at the current frame. The yaw is above −180 and up to 180 degrees; with keys, any number of
    /// turns.
    pub shown: Look,
    /// First and last frame to play and export; None for all.
    pub range: Option<(usize, usize)>,
    /// The mirror ball's outline, if set by hand.
    pub circle: Option<Circle>,
    /// The trial response.
    pub trial: Option<Trial>,
    /// Training settings, if set by hand.
    pub training: Option<TrainChoice>,
}

/// The same angle, above −180° and up to 180°.
pub fn within_a_turn(degrees: f32) -> f32 {
    if degrees > -180.0 && degrees <= 180.0 { degrees } else { 180.0 - (180.0 - degrees).rem_euclid(360.0) }
}

impl Deref for LookSettings {
    type Target = Look;

    fn deref(&self) -> &Look {
        &self.shown
    }
}

impl DerefMut for LookSettings {
    fn deref_mut(&mut self) -> &mut Look {
        &mut self.shown
    }
}

impl LookSettings {
    /// Lights the subject with an entry of the list, if it exists.
    pub(super) fn light_by(&mut self, entry: usize) {
        if entry < self.environments.len() {
            self.environment = entry;
        }
    }

    /// Sets a setting within its range; only with keys, an angle makes several turns. NaN is ignored.
    pub(super) fn set(&mut self, setting: Setting, value: f32) {
        let value = if setting.turns() && !self.is_keyed(setting) {
            within_a_turn(value)
        } else {
            setting.bounded(f64::from(value)) as f32
        };
        if let Some(field) = setting.field(&mut self.shown).filter(|_| !value.is_nan()) {
            *field = value;
        }
    }

    /// First and last of `frames` frames to play and export.
    pub fn range_of(&self, frames: usize) -> (usize, usize) {
        let most = frames.saturating_sub(1);
        let (first, last) = self.range.unwrap_or((0, most));
        (first.min(most), last.min(most))
    }

    /// Sets the first and last of `frames` frames to play and export, if they are in order.
    pub(super) fn set_range(&mut self, range: Option<(usize, usize)>, frames: usize) {
        let range = range.filter(|(first, last)| first <= last);
        let all = (0, frames.saturating_sub(1));
        self.range = range.filter(|range| *range != all);
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
        assert_eq!(look.range, None, "no range");
    }
}
