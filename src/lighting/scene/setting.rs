//! Animatable settings of a picture, by the names used in files.

use super::{EXPOSURE_STOPS, Pass, STRENGTHS, Strength};
use base::numbers::ANGLES;
use light::{Lighting, PlacedLight, white};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A number that can change over the clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Setting {
    Yaw,
    Pitch,
    Roll,
    BackgroundYaw,
    Intensity,
    Temperature,
    Tint,
    Exposure,
    /// Strength of a pass.
    Effect(Pass),
    /// A number of the placed light with this [`light::PlacedLight::id`].
    Light(u32, LightSetting),
    /// Gain of the light group with this [`light::LightGroup::id`].
    Group(u32),
}

/// A number of a placed light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightSetting {
    Yaw,
    Pitch,
    Radius,
    Intensity,
    Red,
    Green,
    Blue,
}

/// Unit of a setting. Keys can be copied between settings with the same unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    Degrees,
    Stops,
    Kelvin,
    Tint,
    /// A share, in percent in the window.
    Share,
    /// A factor.
    Times,
    /// A placed light's energy.
    Energy,
    /// A channel of a colour.
    Channel,
}

/// A setting as files, command line, window and keys know it.
struct Row<S> {
    setting: S,
    /// Name in files.
    name: &'static str,
    /// Name in the window, without that of a light.
    label: &'static str,
    unit: Unit,
    /// Allowed values. Angles may span many turns.
    range: RangeInclusive<f32>,
}

const fn row<S: Copy>(
    setting: S,
    (name, label): (&'static str, &'static str),
    (unit, range): (Unit, RangeInclusive<f32>),
) -> Row<S> {
    Row { setting, name, label, unit, range }
}

const DEGREES: (Unit, RangeInclusive<f32>) = (Unit::Degrees, ANGLES);
const CHANNEL: (Unit, RangeInclusive<f32>) = (Unit::Channel, 0.0..=1e4);

/// Settings of the picture besides effects.
static PLAIN: [Row<Setting>; 8] = [
    row(Setting::Yaw, ("yaw", "Yaw"), DEGREES),
    row(Setting::Pitch, ("pitch", "Pitch"), DEGREES),
    row(Setting::Roll, ("roll", "Roll"), DEGREES),
    row(Setting::BackgroundYaw, ("background_yaw", "Background yaw"), DEGREES),
    row(Setting::Intensity, ("intensity", "Intensity"), (Unit::Stops, Lighting::STOPS)),
    row(Setting::Temperature, ("temperature", "Temperature"), (Unit::Kelvin, white::RANGE_K)),
    row(Setting::Tint, ("tint", "Tint"), (Unit::Tint, white::RANGE_TINT)),
    row(Setting::Exposure, ("exposure", "Exposure"), (Unit::Stops, EXPOSURE_STOPS)),
];

/// Settings of a placed light.
static LIGHTS: [Row<LightSetting>; 7] = [
    row(LightSetting::Yaw, ("yaw", "Azimuth"), DEGREES),
    row(LightSetting::Pitch, ("pitch", "Elevation"), (Unit::Degrees, -90.0..=90.0)),
    row(LightSetting::Radius, ("radius", "Radius"), (Unit::Degrees, 0.0..=85.0)),
    row(LightSetting::Intensity, ("intensity", "Intensity"), (Unit::Energy, 0.0..=1e4)),
    row(LightSetting::Red, ("red", "Red"), CHANNEL),
    row(LightSetting::Green, ("green", "Green"), CHANNEL),
    row(LightSetting::Blue, ("blue", "Blue"), CHANNEL),
];

impl LightSetting {
    /// All light settings.
    pub const ALL: [Self; 7] =
        [Self::Yaw, Self::Pitch, Self::Radius, Self::Intensity, Self::Red, Self::Green, Self::Blue];

    fn row(self) -> &'static Row<Self> {
        // In the order of the rows, as a test checks.
        &LIGHTS[self as usize]
    }
}

impl Unit {
    /// Suffix after a number, such as a degree sign.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Degrees => "°",
            Self::Stops | Self::Energy => " stops",
            Self::Kelvin => " K",
            Self::Share => " %",
            Self::Times => "×",
            Self::Tint | Self::Channel => "",
        }
    }

    /// Value shown in the window. Energy is shown in stops, where 0 is π, at which white facing the light has
    /// radiance 1; a light that is off is shown as the lowest stop value.
    pub fn shown(self, value: f64) -> f64 {
        match self {
            Self::Energy => {
                let stops = (value.max(0.0) / std::f64::consts::PI).log2();
                stops.max(f64::from(*Lighting::STOPS.start()))
            }
            // 0.3 in f32 is 30 %, not 30.000001.
            Self::Share => (1e6 * value).round() / 1e4,
            _ => value,
        }
    }

    /// Inverse of [`Self::shown`].
    pub fn of_shown(self, shown: f64) -> f64 {
        match self {
            Self::Energy => std::f64::consts::PI * shown.exp2(),
            Self::Share => shown / 100.0,
            _ => shown,
        }
    }

    /// Smallest visible change.
    pub fn step(self) -> f32 {
        match self {
            Self::Degrees | Self::Tint => 10.0,
            Self::Stops | Self::Energy => 0.5,
            Self::Kelvin => 500.0,
            Self::Share | Self::Channel => 0.1,
            Self::Times => 0.2,
        }
    }

    /// Change of the shown value by a point of a drag.
    pub fn speed(self) -> f64 {
        let speed = f64::from(self.step()) / 20.0;
        if self == Self::Share { self.shown(speed) } else { speed }
    }

    /// Number of decimals.
    pub fn decimals(self) -> usize {
        match self {
            Self::Degrees | Self::Share => 1,
            Self::Kelvin | Self::Tint => 0,
            _ => 2,
        }
    }
}

impl Setting {
    /// Every setting under this lighting.
    pub fn all(lighting: &Lighting) -> Vec<Self> {
        let effects = STRENGTHS.iter().map(|strength| Self::Effect(strength.pass));
        let of_light = |light: &PlacedLight| LightSetting::ALL.map(|one| Self::Light(light.id, one));
        let lights = lighting.placed.iter().flat_map(of_light);
        let groups = lighting.groups.iter().map(|group| Self::Group(group.id));
        let plain = PLAIN.iter().map(|row| row.setting);
        plain.chain(effects).chain(lights).chain(groups).collect()
    }

    /// Name among the settings of the same light or group, or of the picture.
    pub fn label(self) -> &'static str {
        match self {
            Self::Effect(pass) => strength(pass).map_or("", |strength| strength.label),
            Self::Light(_, setting) => setting.row().label,
            Self::Group(_) => "Intensity",
            plain => plain.row().map_or("", |row| row.label),
        }
    }

    /// Name among all settings, with the name of the light or group.
    pub fn title(self, lighting: &Lighting) -> String {
        let light = |i: usize| lighting.placed[i].title(i);
        let owner = match self {
            Self::Light(id, _) => index(id, lighting).map_or("Light".to_owned(), light),
            Self::Group(id) => group(id, lighting).map_or("Group", |i| &lighting.groups[i].name).to_owned(),
            _ => return self.label().to_owned(),
        };
        format!("{owner} {}", self.label().to_lowercase())
    }

    /// Explanation for a tooltip; empty if the label is enough.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Effect(pass) => strength(pass).map_or("", |strength| strength.hint),
            Self::Light(_, LightSetting::Yaw) => "0 is behind the subject, −90 camera left, 180 at the camera",
            Self::Light(_, LightSetting::Pitch) => "Above the horizon",
            Self::Light(_, LightSetting::Radius) => "As seen from the subject: a larger light is softer, not brighter",
            _ => "",
        }
    }

    /// Row of a setting of the picture; None for effects, lights and groups.
    fn row(self) -> Option<&'static Row<Self>> {
        PLAIN.iter().find(|row| row.setting == self)
    }

    /// Unit of the setting.
    pub fn unit(self) -> Unit {
        match self {
            Self::Effect(Pass::Grain) => Unit::Times,
            Self::Effect(_) => Unit::Share,
            Self::Light(_, setting) => setting.row().unit,
            plain => plain.row().map_or(Unit::Stops, |row| row.unit),
        }
    }

    /// Allowed values. Angles may span many turns.
    pub fn range(self) -> RangeInclusive<f32> {
        match self {
            Self::Effect(pass) => 0.0..=strength(pass).map_or(0.0, |strength| strength.most),
            Self::Light(_, setting) => setting.row().range.clone(),
            plain => plain.row().map_or(Lighting::STOPS, |row| row.range.clone()),
        }
    }

    /// True for an angle that keys may turn several times.
    pub fn turns(self) -> bool {
        self.range() == ANGLES
    }

    /// Value clamped to [`Self::range`]; NaN stays NaN.
    pub fn bounded(self, value: f64) -> f64 {
        let range = self.range();
        value.clamp(f64::from(*range.start()), f64::from(*range.end()))
    }

    /// True if the setting exists under this lighting.
    pub fn exists(self, lighting: &Lighting) -> bool {
        match self {
            Self::Light(id, _) => index(id, lighting).is_some(),
            Self::Group(id) => group(id, lighting).is_some(),
            _ => true,
        }
    }
}

/// Strength of a pass, if it has one.
pub(super) fn strength(pass: Pass) -> Option<&'static Strength> {
    STRENGTHS.iter().find(|strength| strength.pass == pass)
}

/// Index of a light.
fn index(id: u32, lighting: &Lighting) -> Option<usize> {
    lighting.placed.iter().position(|light| light.id == id)
}

/// Index of a group.
fn group(id: u32, lighting: &Lighting) -> Option<usize> {
    lighting.groups.iter().position(|group| group.id == id)
}

impl Display for Setting {
    /// Name in files, such as `pitch`, `effects.glare`, `lights.2.yaw` and `groups.1.gain`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match *self {
            Self::Effect(pass) => write!(f, "effects.{}", pass.name()),
            Self::Light(id, setting) => write!(f, "lights.{id}.{}", setting.row().name),
            Self::Group(id) => write!(f, "groups.{id}.gain"),
            plain => f.write_str(plain.row().map_or("", |row| row.name)),
        }
    }
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let light = |rest: &str| {
            let (id, name) = rest.split_once('.')?;
            let id = id.parse().ok().filter(|id| *id > 0)?;
            let row = LIGHTS.iter().find(|row| row.name == name)?;
            Some(Self::Light(id, row.setting))
        };
        let group = |rest: &str| {
            let id = rest.strip_suffix(".gain")?.parse().ok();
            id.filter(|id| *id > 0).map(Self::Group)
        };
        let found = match text.split_once('.') {
            Some(("effects", name)) => STRENGTHS
                .iter()
                .find(|strength| strength.pass.name() == name)
                .map(|strength| Self::Effect(strength.pass)),
            Some(("lights", rest)) => light(rest),
            Some(("groups", rest)) => group(rest),
            _ => PLAIN.iter().find(|row| row.name == text).map(|row| row.setting),
        };
        found.ok_or_else(|| {
            let plain = PLAIN.each_ref().map(|row| row.name).join(", ");
            format!(
                "{text:?} cannot have keys; settings with keys are {plain}, effects.NAME such as effects.glare, \
                 lights.NUMBER.NAME such as lights.1.yaw, and groups.NUMBER.gain"
            )
        })
    }
}

impl TryFrom<String> for Setting {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Setting> for String {
    fn from(setting: Setting) -> Self {
        setting.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Look;
    use light::{LightGroup, PlacedLight};

    /// Every setting of a picture with two lights and two groups.
    fn all() -> (Vec<Setting>, Lighting) {
        let mut lighting = Lighting {
            placed: vec![PlacedLight::default(); 2],
            groups: ["Left", "Right"].map(|name| LightGroup { name: name.to_owned(), ..LightGroup::default() }).into(),
            ..Lighting::default()
        };
        lighting.number_lights();
        (Setting::all(&lighting), lighting)
    }

    #[test]
    fn every_setting_has_a_name_of_its_own_that_leads_back_to_it() {
        let (all, lighting) = all();
        let mut names: Vec<String> = all.iter().map(ToString::to_string).collect();
        for (setting, name) in all.iter().zip(&names) {
            assert_eq!(name.parse(), Ok(*setting));
            assert!(setting.exists(&lighting));
        }
        assert_eq!(
            [Setting::Pitch, Setting::Effect(Pass::Glare), Setting::Light(2, LightSetting::Yaw), Setting::Group(2),]
                .map(String::from),
            ["pitch", "effects.glare", "lights.2.yaw", "groups.2.gain"]
        );
        names.sort();
        names.dedup();
        assert_eq!(names.len(), all.len());
        let mut titles: Vec<String> = all.iter().map(|s| s.title(&lighting)).collect();
        titles.sort();
        titles.dedup();
        assert_eq!(titles.len(), all.len(), "{titles:?}");
    }

    #[test]
    fn each_light_setting_has_its_row() {
        for setting in LightSetting::ALL {
            assert_eq!(setting.row().setting, setting);
        }
    }

    #[test]
    fn a_light_s_intensity_is_shown_in_stops_as_in_its_row() {
        let (_, mut lighting) = all();
        let gain = Setting::Light(2, LightSetting::Intensity);
        assert_eq!(gain.title(&lighting), "Light 2 intensity");
        assert_eq!(gain.to_string(), "lights.2.intensity");
        let unit = gain.unit();
        assert_eq!(unit.suffix(), " stops");
        let light = &mut lighting.placed[1];
        for stops in [-3.0f32, 0.0, 1.5] {
            light.intensity = std::f32::consts::PI * stops.exp2();
            let shown = unit.shown(f64::from(light.intensity));
            assert!((shown - f64::from(stops)).abs() < 1e-5, "{shown}");
            let stored = unit.of_shown(shown);
            assert!((stored - f64::from(light.intensity)).abs() < 1e-5);
        }
        assert_eq!(unit.shown(0.0), f64::from(*Lighting::STOPS.start()));
        // Keys of a file may be brighter than the window's range.
        assert!((unit.shown(unit.of_shown(11.5)) - 11.5).abs() < 1e-9);
        assert_eq!(Unit::Stops.shown(2.0), 2.0);
        assert_eq!((Unit::Share.shown(0.25), Unit::Share.of_shown(25.0)), (25.0, 0.25));
        assert_eq!(Unit::Share.shown(f64::from(0.3f32)), 30.0);
    }

    #[test]
    fn what_is_no_setting_is_refused_in_a_sentence() {
        for text in [
            "",
            "yaw_deg",
            "effects.relight",
            "effects.",
            "lights.0.yaw",
            "lights.-1.yaw",
            "lights.1",
            "lights.1.size.x",
            "lights.99999999999.yaw",
            "groups.0.gain",
            "groups.1",
            "groups.1.yaw",
        ] {
            let said = text.parse::<Setting>().unwrap_err();
            assert!(said.contains("effects.glare"), "{said}");
        }
        assert!(!Setting::Light(9, LightSetting::Yaw).exists(&Lighting::default()));
        assert!(!Setting::Group(1).exists(&Lighting::default()));
    }

    #[test]
    fn every_setting_has_a_place_of_its_own_and_values_within_its_range() {
        let (all, lighting) = all();
        let mut seen = Vec::new();
        for setting in all {
            let mut changed = Look { lighting: lighting.clone(), ..Look::default() };
            let value = setting.bounded(1e12) as f32;
            assert_eq!(value, *setting.range().end());
            *setting.field(&mut changed).unwrap() = value;
            assert!(!seen.contains(&changed), "{setting:?}");
            seen.push(changed);
        }
    }
}
