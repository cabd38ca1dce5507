//! Placed lights, drawn into a panorama so that weights treat them as environment light.

#[cfg(test)]
use super::Environment;
use super::patch::{Outline, Patch};
use base::numbers;
use imaging::Image;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Outer part of a soft light over which it falls to zero.
const SOFTNESS: f64 = 0.3;

/// Shape of a placed light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// One texel of the panorama.
    Point,
    /// A disc with a sharp edge: a bulb, a sun.
    Disc,
    /// A square with a soft edge: a softbox.
    #[default]
    Area,
}

/// A light placed by hand in the studio.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PlacedLight {
    /// Stable identity, independent of the order of lights; 0 until [`super::Lighting::number_lights`].
    #[serde(skip_serializing_if = "is_none")]
    pub id: u32,
    pub kind: Kind,
    /// Azimuth in degrees, any number of turns: 0 is behind the subject in the middle of the panorama, +90
    /// camera-right, −90 camera-left, ±180 at the camera.
    pub yaw_deg: f32,
    /// Elevation above the horizon in degrees, −90 to 90.
    pub pitch_deg: f32,
    /// Radius of a disc or half side of an area in degrees, as seen from the subject; at most 180 for discs and 85
    /// for areas. Ignored for a point.
    pub radius_deg: f32,
    /// Linear Rec. 709 colour; [`super::white::gains`] converts temperatures. Negative channels count as 0.
    pub color: [f32; 3],
    /// Energy: ∫ L dω is `intensity · color` per channel, independent of size. A white matt surface facing the
    /// light gets radiance `intensity / π`.
    pub intensity: f32,
    /// True if the light is on.
    pub enabled: bool,
    /// Makes the light the only light on the subject; see [`super::Lighting::shines`].
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub solo: bool,
    /// Name given by the user; empty for a numbered title.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Name of its [`super::LightGroup`]; empty without a group.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub group: String,
    /// Colour temperature in kelvin that set `color`; None if set otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f32>,
}

/// True if a light has no id yet.
fn is_none(id: &u32) -> bool {
    *id == 0
}

impl Default for PlacedLight {
    /// A neutral softbox of 25°, 45° camera-left and 45° up, at which white facing it has radiance 1.
    fn default() -> Self {
        Self {
            id: 0,
            kind: Kind::Area,
            yaw_deg: -135.0,
            pitch_deg: 45.0,
            radius_deg: 12.5,
            color: [1.0; 3],
            intensity: std::f32::consts::PI,
            enabled: true,
            solo: false,
            name: String::new(),
            group: String::new(),
            temperature_k: None,
        }
    }
}

impl PlacedLight {
    /// Display name: the given name, or one numbered by the light's index from 0.
    pub fn title(&self, index: usize) -> String {
        if self.name.is_empty() { format!("Light {}", index + 1) } else { self.name.clone() }
    }

    /// Gain in stops: 0 is intensity π, at which white facing the light has radiance 1. −∞ without light.
    pub fn gain_stops(&self) -> f32 {
        (self.intensity / std::f32::consts::PI).log2()
    }

    /// Sets the colour of white light of a temperature in kelvin.
    pub fn set_temperature(&mut self, kelvin: f32) {
        self.color = super::white::gains(kelvin, 0.0);
        self.temperature_k = Some(kelvin);
    }

    /// The light moved to a direction from the subject, of any length. A zero or non-finite direction leaves it in
    /// place.
    #[must_use]
    pub fn towards(self, direction: glam::Vec3) -> Self {
        match direction.try_normalize() {
            Some(glam::Vec3 { x, y, z }) => {
                Self { yaw_deg: x.atan2(-z).to_degrees(), pitch_deg: y.clamp(-1.0, 1.0).asin().to_degrees(), ..self }
            }
            None => self,
        }
    }

    /// ∫ L dω per channel; 0 for lights that are off or have non-finite numbers.
    pub fn energy(&self) -> [f64; 3] {
        let numbers = [self.yaw_deg, self.pitch_deg, self.radius_deg];
        if !self.enabled || !numbers.iter().all(|v| v.is_finite()) {
            return [0.0; 3];
        }
        self.color.map(|channel| {
            let energy = f64::from(channel) * f64::from(self.intensity);
            // Values beyond the range of a texel do not count.
            let is_light = energy > 0.0 && energy < f64::from(f32::MAX) * 1e-9;
            if is_light { energy } else { 0.0 }
        })
    }

    /// Unit direction from the subject to the light.
    pub fn direction(&self) -> glam::Vec3 {
        let (sin_yaw, cos_yaw) = (self.yaw_deg % 360.0).to_radians().sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_deg.clamp(-90.0, 90.0).to_radians().sin_cos();
        glam::Vec3::new(cos_pitch * sin_yaw, sin_pitch, -cos_pitch * cos_yaw)
    }

    /// Adds the light to a panorama of any size, whose energy grows by [`Self::energy`] up to rounding. A small
    /// panorama is enough for weights.
    pub fn add_to(&self, panorama: &mut Image) {
        self.patch().add(panorama, self.energy());
    }

    fn patch(&self) -> Patch {
        let radius = f64::from(self.radius_deg.max(0.0)).to_radians();
        let (outline, softness) = match self.kind {
            Kind::Point => (Outline::Disc(0.0), SOFTNESS),
            Kind::Disc => (Outline::Disc(radius), 0.0),
            Kind::Area => (Outline::Rectangle(radius, radius), SOFTNESS),
        };
        Patch {
            azimuth: f64::from(self.yaw_deg % 360.0).to_radians(),
            elevation: f64::from(self.pitch_deg.clamp(-90.0, 90.0)).to_radians(),
            outline,
            softness,
        }
    }
}

/// The environment with lights added; unchanged if no light is on.
#[cfg(test)]
pub(super) fn with_lights(environment: &Environment, lights: &[PlacedLight]) -> Environment {
    let mut lit = environment.clone();
    for light in lights {
        light.add_to(&mut lit.radiance);
    }
    lit
}

impl FromStr for PlacedLight {
    type Err = String;

    /// Parses azimuth, elevation and size in degrees, intensity, and an optional colour (white by default).
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        const NAMES: &str = "AZIMUTH,ELEVATION,SIZE,INTENSITY or the same with R,G,B";
        let full = if text.matches(',').count() == 3 { format!("{text},1,1,1") } else { text.to_owned() };
        let values = numbers(&full, NAMES)?.map(|v: f64| v as f32);
        let [yaw, pitch, size, intensity, r, g, b] = values;
        let lights = size >= 0.0 && intensity >= 0.0 && [r, g, b].iter().all(|v| *v >= 0.0);
        if !lights || !values.iter().all(|v| v.is_finite()) || pitch.abs() > 90.0 {
            return Err(format!("{text:?} is not a light: {NAMES}, elevation within 90°, the rest not negative"));
        }
        Ok(Self {
            yaw_deg: yaw,
            pitch_deg: pitch,
            radius_deg: size / 2.0,
            color: [r, g, b],
            intensity,
            ..Self::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::Partition;
    use crate::{Lamp, Rig};
    use proptest::prelude::*;

    fn sky(width: usize, height: usize) -> Environment {
        let image = Image::from_fn(width, height, |x, y| [0.2 + (x % 7) as f32 * 0.1, 0.5, 0.1 + (y % 5) as f32 * 0.2]);
        Environment::from_radiance("sky", image)
    }

    fn any_light() -> impl Strategy<Value = PlacedLight> {
        (0usize..3, -800f32..800.0, -90f32..90.0, 0f32..120.0, 0.001f32..1e5).prop_map(
            |(kind, yaw_deg, pitch_deg, radius_deg, intensity)| PlacedLight {
                kind: [Kind::Point, Kind::Disc, Kind::Area][kind],
                yaw_deg,
                pitch_deg,
                radius_deg,
                color: [1.0, 0.5, 0.0],
                intensity,
                id: kind as u32,
                solo: kind == 1,
                name: ["", "Key", "Rim \"2\""][kind].to_owned(),
                group: ["", "Left", ""][kind].to_owned(),
                temperature_k: (kind == 2).then_some(3200.0),
                ..PlacedLight::default()
            },
        )
    }

    proptest! {
        #[test]
        fn a_light_adds_its_energy_at_any_size(light in any_light(), w in 1usize..200, h in 1usize..100) {
            let before = sky(w, h);
            let after = with_lights(&before, std::slice::from_ref(&light));
            let energies = before.energy().into_iter().zip(after.energy()).zip(light.energy());
            for ((before, after), light) in energies {
                // f32 values; the sum is precise to 6 · 10⁻⁸.
                prop_assert!((after - before - light).abs() <= 1e-5 * light + 1e-6 * before);
            }
        }

        #[test]
        fn a_light_file_round_trips(light in any_light()) {
            let text = toml::to_string(&light).unwrap();
            prop_assert_eq!(toml::from_str::<PlacedLight>(&text).unwrap(), light);
        }
    }

    #[test]
    fn a_light_of_an_older_file_is_read_and_a_plain_one_is_written_as_before() {
        let text = r#"{"kind":"area","yaw_deg":10.0,"pitch_deg":5.0,"radius_deg":3.0,"color":[1.0,1.0,1.0],"intensity":2.0,"enabled":true}"#;
        let light: PlacedLight = serde_json::from_str(text).unwrap();
        assert!(!light.solo && light.name.is_empty() && light.group.is_empty());
        assert_eq!(light.temperature_k, None);
        assert_eq!(light.title(2), "Light 3");
        assert_eq!(serde_json::to_string(&light).unwrap(), text);
    }

    #[test]
    fn a_light_is_as_bright_and_as_warm_as_it_is_set() {
        let mut light = PlacedLight::default();
        assert_eq!(light.gain_stops(), 0.0);
        light.intensity *= 4.0;
        assert_eq!(light.gain_stops(), 2.0);
        light.set_temperature(3200.0);
        let [r, g, b] = light.color;
        assert!(r > g && g > b && light.temperature_k == Some(3200.0));
        // Versions without colour temperatures read the same colour.
        let text = serde_json::to_string(&light).unwrap();
        let mut older: serde_json::Value = serde_json::from_str(&text).unwrap();
        older.as_object_mut().unwrap().remove("temperature_k");
        let older: PlacedLight = serde_json::from_value(older).unwrap();
        assert_eq!((older.color, older.intensity), (light.color, light.intensity));
    }

    #[test]
    fn a_light_is_where_it_is_put() {
        for (yaw_deg, pitch_deg) in [(0.0, 0.0), (-135.0, 45.0), (90.0, -80.0), (179.0, 10.0)] {
            let there = PlacedLight { yaw_deg, pitch_deg, ..PlacedLight::default() };
            let put = PlacedLight::default().towards(3.0 * there.direction());
            assert!((put.yaw_deg - yaw_deg).abs() < 1e-3 && (put.pitch_deg - pitch_deg).abs() < 1e-3);
        }
        let up = PlacedLight::default().towards(glam::Vec3::Y);
        assert!(up.direction().distance(glam::Vec3::Y) < 1e-6);
        for none in [glam::Vec3::ZERO, glam::Vec3::NAN, glam::Vec3::INFINITY] {
            assert_eq!(PlacedLight::default().towards(none), PlacedLight::default());
        }
    }

    #[test]
    fn lights_at_the_poles_and_on_the_seam_have_their_energy() {
        let black = Environment::from_radiance("", Image::filled(512, 256, [0.0; 3]));
        for kind in [Kind::Point, Kind::Disc, Kind::Area] {
            for (yaw_deg, pitch_deg) in [(0.0, 90.0), (33.0, -90.0), (180.0, 0.0), (-180.0, 20.0), (539.9, 89.9)] {
                let light = PlacedLight { kind, yaw_deg, pitch_deg, ..PlacedLight::default() };
                let [energy, ..] = with_lights(&black, std::slice::from_ref(&light)).energy();
                let wanted = std::f64::consts::PI;
                assert!((energy / wanted - 1.0).abs() < 1e-6, "{light:?}: {energy}");
            }
        }
    }

    #[test]
    fn a_light_in_front_of_a_lamp_is_that_lamp() {
        let lamp = |name: &str, light: &PlacedLight| Lamp { energy: [2.0; 3], ..Lamp::new(name, light.direction()) };
        let at = |yaw_deg, pitch_deg| PlacedLight {
            kind: Kind::Disc,
            yaw_deg,
            pitch_deg,
            radius_deg: 2.0,
            ..PlacedLight::default()
        };
        let spots = [at(-135.0, 30.0), at(120.0, 10.0), at(0.0, 60.0), at(30.0, -50.0)];
        let rig = Rig { lamps: spots.iter().map(|spot| lamp("lamp", spot)).collect() };
        let black = Environment::from_radiance("", Image::filled(256, 128, [0.0; 3]));
        for (i, spot) in spots.iter().enumerate() {
            let lit = with_lights(&black, std::slice::from_ref(spot));
            for (j, weights) in Partition::cells(&rig, Partition::WIDTH).weights(&lit, 0.0).per_lamp.iter().enumerate()
            {
                let wanted = if i == j { 0.5 * std::f32::consts::PI } else { 0.0 };
                assert!((weights[0] - wanted).abs() < 1e-3, "lamp {j} under spot {i}: {weights:?}");
            }
        }
    }

    #[test]
    fn lights_that_are_off_or_no_light_change_nothing() {
        let before = sky(64, 32);
        let standard = PlacedLight::default;
        let lights = [
            PlacedLight { enabled: false, ..standard() },
            PlacedLight { intensity: f32::NAN, ..standard() },
            PlacedLight { intensity: -1.0, ..standard() },
            PlacedLight { intensity: f32::INFINITY, ..standard() },
            PlacedLight { yaw_deg: f32::NAN, ..standard() },
            PlacedLight { pitch_deg: f32::INFINITY, ..standard() },
            PlacedLight { color: [f32::NAN, -1.0, 0.0], ..standard() },
        ];
        assert_eq!(with_lights(&before, &lights).radiance, before.radiance);
    }

    #[test]
    fn a_light_grows_softer_and_not_brighter() {
        let black = Environment::from_radiance("", Image::filled(512, 256, [0.0; 3]));
        let brightest = |radius_deg| {
            let light = PlacedLight { radius_deg, ..PlacedLight::default() };
            let lit = with_lights(&black, &[light]);
            lit.radiance.pixels.iter().map(|p| p[0]).fold(0.0, f32::max)
        };
        assert!(brightest(5.0) > 3.5 * brightest(10.0) && brightest(10.0) > 3.5 * brightest(20.0));
    }

    #[test]
    fn lights_are_read_or_refused() {
        let light: PlacedLight = "-135,45,25,3.14,1,0.5,0.25".parse().unwrap();
        assert_eq!((light.radius_deg, light.color), (12.5, [1.0, 0.5, 0.25]));
        assert_eq!("0,0,1,1".parse::<PlacedLight>().unwrap().color, [1.0; 3]);
        for text in ["", "0,0,1", "0,91,1,1", "0,0,-1,1", "0,0,1,nan", "0,0,1,1,1"] {
            assert!(text.parse::<PlacedLight>().is_err(), "{text}");
        }
    }
}
