//! Lighting of the subject by an environment: rotated, graded, and combined with placed lights.

use super::group::{LightGroup, STOPS};
use super::placed::PlacedLight;
use super::weights::{Weighting, rotation};
use super::white;
use base::numbers::{ANGLES, within};
use glam::Quat;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::ops::RangeInclusive;

/// Changes to an environment besides its yaw before it lights the subject. The default changes nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub struct Lighting {
    /// Distribution of the environment's light over the lamps.
    #[arg(long = "weights", value_enum, default_value_t)]
    pub weighting: Weighting,
    /// Pitch of the environment in degrees, applied after yaw.
    #[arg(
        long = "pitch",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub pitch_deg: f32,
    /// Roll of the environment in degrees counter-clockwise, applied after yaw and pitch.
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
    /// Tint of the environment, −150 green to 150 magenta.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = within(white::RANGE_TINT))]
    pub tint: f32,
    /// Extra yaw of the background in degrees, relative to the light.
    #[arg(
        long = "background-yaw",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub background_yaw_deg: f32,
    /// A soft light, SIZE degrees wide, at an azimuth (−90 camera-left, 90 camera-right, 180 at the camera) and an
    /// elevation. At intensity π, white facing the light has radiance 1. Repeatable.
    ///
    /// Independent of the environment's rotation; invisible in the background.
    #[arg(long = "light", value_name = "AZIMUTH,ELEVATION,SIZE,INTENSITY[,R,G,B]", allow_hyphen_values = true)]
    pub placed: Vec<PlacedLight>,
    /// Groups of placed lights.
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
    /// Range of the intensity in stops.
    pub const STOPS: RangeInclusive<f32> = STOPS;

    /// True if an enabled placed light is solo. The environment and all other lights are off then.
    pub fn is_solo(&self) -> bool {
        self.placed.iter().any(|light| self.lights_alone(light))
    }

    /// Group of a light.
    pub fn group_of(&self, light: &PlacedLight) -> Option<&LightGroup> {
        (self.groups.iter()).find(|group| group.name == light.group && !group.name.is_empty())
    }

    /// True if a light and its group are on.
    fn is_on(&self, light: &PlacedLight) -> bool {
        light.enabled && self.group_of(light).is_none_or(|group| !group.muted)
    }

    /// True if a light is on, and it or its group is solo.
    fn lights_alone(&self, light: &PlacedLight) -> bool {
        let is_solo = || light.solo || self.group_of(light).is_some_and(|group| group.solo);
        self.is_on(light) && is_solo()
    }

    /// True if a light of this lighting is on and not silenced by a solo light.
    pub fn shines(&self, light: &PlacedLight) -> bool {
        self.lights_alone(light) || self.is_on(light) && !self.is_solo()
    }

    /// Titles of the solo lights; empty unless [`Self::is_solo`].
    pub fn solo_titles(&self) -> Vec<String> {
        let lights = self.placed.iter().enumerate();
        let solo = lights.filter(|(_, light)| self.lights_alone(light));
        solo.map(|(i, light)| light.title(i)).collect()
    }

    /// Parts of the lighting, with their names: the environment, each group, and each light without a
    /// group. None for a part that is dark. Names and order do not depend on what is on.
    pub fn parts(&self) -> Vec<(String, Option<Self>)> {
        let part = |name: String, member: &dyn Fn(&PlacedLight) -> bool| {
            let shine = self.placed.iter().filter(|light| member(light) && self.shines(light));
            let solo = |light: &PlacedLight| PlacedLight { solo: true, ..light.clone() };
            let placed: Vec<_> = shine.map(solo).collect();
            (name, (!placed.is_empty()).then(|| Self { placed, ..self.clone() }))
        };
        let sky = (!self.is_solo()).then(|| Self { placed: Vec::new(), ..self.clone() });
        let mut parts = vec![("environment".to_owned(), sky)];
        for group in self.groups.iter().filter(|group| !group.name.is_empty()) {
            let member = |light: &PlacedLight| self.group_of(light).is_some_and(|of| std::ptr::eq(of, group));
            parts.push(part(group.name.clone(), &member));
        }
        for (index, alone) in self.placed.iter().enumerate() {
            if self.group_of(alone).is_none() {
                parts.push(part(alone.title(index), &|light| std::ptr::eq(light, alone)));
            }
        }
        parts
    }

    /// Turns every solo switch off.
    pub fn clear_solo(&mut self) {
        (self.placed.iter_mut()).for_each(|light| light.solo = false);
        (self.groups.iter_mut()).for_each(|group| group.solo = false);
    }

    /// Gives the smallest free [`PlacedLight::id`] to each light without one, and to duplicates of an earlier id.
    /// Groups get theirs in the same way.
    pub fn number_lights(&mut self) {
        number(self.placed.iter_mut().map(|light| &mut light.id));
        number(self.groups.iter_mut().map(|group| &mut group.id));
    }

    /// Smallest id that no light uses.
    fn free_id(&self) -> u32 {
        let taken: HashSet<u32> = self.placed.iter().map(|light| light.id).collect();
        (1..).find(|id| !taken.contains(id)).unwrap_or(u32::MAX)
    }

    /// The light with its group's gain applied.
    pub fn with_group_gain(&self, light: &PlacedLight) -> PlacedLight {
        let gain = self.group_of(light).map_or(1.0, LightGroup::gain);
        PlacedLight { intensity: light.intensity * gain, ..light.clone() }
    }

    /// A new softbox for the user to add; solo if other lights are, so that it is visible.
    pub fn another_light(&self) -> PlacedLight {
        PlacedLight { id: self.free_id(), solo: self.is_solo(), ..PlacedLight::default() }
    }

    /// Factor on the environment's radiance per channel; finite, not negative, and 0 if [`Self::is_solo`].
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

    /// Full rotation of the environment: `yaw_deg`, then the tilt.
    pub fn turn(&self, yaw_deg: f32) -> Quat {
        self.tilt() * rotation(yaw_deg, 0.0, 0.0)
    }

    /// Rotation after the yaw; the identity if an angle is not finite.
    pub fn tilt(&self) -> Quat {
        let tilt = rotation(0.0, self.pitch_deg, self.roll_deg);
        if tilt.is_finite() { tilt } else { Quat::IDENTITY }
    }
}

/// Replaces 0 and duplicates of earlier ids by the smallest free id.
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
            let mut lighting = Lighting { placed: ids.iter().map(light).collect(), ..Lighting::default() };
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
