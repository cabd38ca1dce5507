//! Lighting of the subject by an environment: turned freely, graded, and joined by lights placed by hand.

use super::group::LightGroup;
use super::placed::PlacedLight;
use super::weights::{Weighting, rotation};
use super::white;
use base::numbers::{ANGLES, within};
use glam::Quat;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Changes of an environment before it lights the subject, besides its yaw. The default changes nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub struct Lighting {
    /// Distribution of the environment's light over the lamps.
    #[arg(long = "weights", value_enum, default_value_t)]
    pub weighting: Weighting,
    /// Turn the environment up, after its yaw.
    #[arg(
        long = "pitch",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub pitch_deg: f32,
    /// Turn the environment counter-clockwise, after its yaw and pitch.
    #[arg(
        long = "roll",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub roll_deg: f32,
    /// Brightness of the environment in stops, −10 to 10.
    #[arg(
        long = "intensity",
        value_name = "STOPS",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(Self::STOPS)
    )]
    pub intensity_stops: f32,
    /// Colour temperature that makes the environment's white warmer or cooler, 1667 to 25000.
    #[arg(
        long = "temperature",
        value_name = "KELVIN",
        default_value_t = white::NEUTRAL_K,
        allow_negative_numbers = true,
        value_parser = within(white::RANGE_K)
    )]
    pub temperature_k: f32,
    /// Tint of the environment, −100 green to 100 magenta.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = within(-100.0f32..=100.0))]
    pub tint: f32,
    /// Turn the background further than the light.
    #[arg(
        long = "background-yaw",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub background_yaw_deg: f32,
    /// A soft light of SIZE degrees across, at an azimuth (−90 camera-left, 90 camera-right, 180 at the camera) and an
    /// elevation. With an intensity of π, white that faces it is 1. Can be given several times.
    ///
    /// No turn of the environment moves it, and it does not show in the background.
    #[arg(
        long = "light",
        value_name = "AZIMUTH,ELEVATION,SIZE,INTENSITY[,R,G,B]",
        allow_hyphen_values = true
    )]
    pub placed: Vec<PlacedLight>,
    /// The groups of placed lights.
    #[arg(skip)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<LightGroup>,
}

impl Default for Lighting {
    fn default() -> Self {
        Self {
            weighting: Weighting::default(),
            pitch_deg: 0.0,
            roll_deg: 0.0,
            intensity_stops: 0.0,
            temperature_k: white::NEUTRAL_K,
            tint: 0.0,
            background_yaw_deg: 0.0,
            placed: vec![],
            groups: vec![],
        }
    }
}

impl Lighting {
    /// The range of the intensity in stops.
    pub const STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

    /// True if lights placed by hand light the subject alone: one that is on is solo. Then the environment and all
    /// other lights are off.
    pub fn is_solo(&self) -> bool {
        self.placed.iter().any(|light| self.lights_alone(light))
    }

    /// The group that a light is in.
    pub fn group_of(&self, light: &PlacedLight) -> Option<&LightGroup> {
        (self.groups.iter()).find(|group| group.name == light.group && !group.name.is_empty())
    }

    /// True if a light is on, and its group too.
    fn is_on(&self, light: &PlacedLight) -> bool {
        light.enabled && self.group_of(light).is_none_or(|group| !group.muted)
    }

    /// True if a light is on, and it or its group is solo.
    fn lights_alone(&self, light: &PlacedLight) -> bool {
        let is_solo = || light.solo || self.group_of(light).is_some_and(|group| group.solo);
        self.is_on(light) && is_solo()
    }

    /// True if a light of this lighting is on, and not silenced by others that are solo.
    pub fn shines(&self, light: &PlacedLight) -> bool {
        self.lights_alone(light) || self.is_on(light) && !self.is_solo()
    }

    /// Titles of the lights that light the subject alone; empty unless [`Self::is_solo`].
    pub fn solo_titles(&self) -> Vec<String> {
        let lights = self.placed.iter().enumerate();
        let solo = lights.filter(|(_, light)| self.lights_alone(light));
        solo.map(|(i, light)| light.title(i)).collect()
    }

    /// The same with no light and no group that is solo.
    pub fn without_solo(mut self) -> Self {
        (self.placed.iter_mut()).for_each(|light| light.solo = false);
        (self.groups.iter_mut()).for_each(|group| group.solo = false);
        self
    }

    /// Gives each light that has no [`PlacedLight::id`], or that of one before it, the smallest that is free; and each group so
    /// among the groups.
    pub fn number_lights(&mut self) {
        number(self.placed.iter_mut().map(|light| &mut light.id));
        number(self.groups.iter_mut().map(|group| &mut group.id));
    }

    /// The smallest number that no light has.
    fn free_id(&self) -> u32 {
        let taken: HashSet<u32> = self.placed.iter().map(|light| light.id).collect();
        (1..).find(|id| !taken.contains(id)).unwrap_or(u32::MAX)
    }

    /// A light as it lights the subject: with the gain of its group.
    pub fn with_group_gain(&self, light: &PlacedLight) -> PlacedLight {
        let gain = self.group_of(light).map_or(1.0, LightGroup::gain);
        PlacedLight { intensity: light.intensity * gain, ..light.clone() }
    }

    /// A light to add: a softbox, solo if others are, so that it is seen.
    pub fn another_light(&self) -> PlacedLight {
        PlacedLight { id: self.free_id(), solo: self.is_solo(), ..PlacedLight::default() }
    }

    /// The factor on the environment's radiance per channel; finite and not negative. It is 0 if [`Self::is_solo`].
    pub fn gains(&self) -> [f32; 3] {
        if self.is_solo() {
            return [0.0; 3];
        }
        let stops = if self.intensity_stops.is_nan() {
            0.0
        } else {
            self.intensity_stops.clamp(*Self::STOPS.start(), *Self::STOPS.end())
        };
        white::gains(self.temperature_k, self.tint).map(|gain| gain * stops.exp2())
    }

    /// The whole turn of the environment: first by `yaw_deg`, then the tilt.
    pub fn turn(&self, yaw_deg: f32) -> Quat {
        self.tilt() * rotation(yaw_deg, 0.0, 0.0)
    }

    /// The turn after the yaw; the identity if an angle is not finite.
    pub fn tilt(&self) -> Quat {
        let tilt = rotation(0.0, self.pitch_deg, self.roll_deg);
        if tilt.is_finite() { tilt } else { Quat::IDENTITY }
    }
}

/// Gives each that is 0, or that one before it is too, the smallest that is free.
fn number<'a>(ids: impl Iterator<Item = &'a mut u32>) {
    let mut taken = HashSet::new();
    let mut missing = Vec::new();
    for id in ids {
        if *id == 0 || !taken.insert(*id) {
            missing.push(id);
        }
    }
    let mut free = (1..).filter(|id| !taken.contains(id));
    for id in missing {
        *id = free.next().unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_light_gets_a_number_of_its_own_and_keeps_it() {
        let numbered = |ids: &[u32]| {
            let light = |&id: &u32| PlacedLight { id, ..PlacedLight::default() };
            let mut lighting =
                Lighting { placed: ids.iter().map(light).collect(), ..Lighting::default() };
            let group = |&id: &u32| LightGroup { id, ..LightGroup::default() };
            lighting.groups = ids.iter().map(group).collect();
            lighting.number_lights();
            let groups = lighting.groups.iter().map(|group| group.id);
            assert!(groups.eq(lighting.placed.iter().map(|light| light.id)));
            let ids: Vec<u32> = lighting.placed.iter().map(|light| light.id).collect();
            (ids, lighting.another_light().id)
        };
        assert_eq!(numbered(&[]), (vec![], 1));
        assert_eq!(numbered(&[0, 0]), (vec![1, 2], 3));
        assert_eq!(numbered(&[2, 0, 2, 5, 0]), (vec![2, 1, 3, 5, 4], 6));
        assert_eq!(numbered(&[3, u32::MAX]), (vec![3, u32::MAX], 1));
    }
}
