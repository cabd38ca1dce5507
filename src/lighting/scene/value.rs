//! Values of settings: their fields in a look, and their keys' values at a frame.

use super::setting::strength;
use super::{LightSetting, Look, Setting};
use light::PlacedLight;

impl Setting {
    /// Field of the setting; None if the light or group does not exist.
    pub fn field(self, look: &mut Look) -> Option<&mut f32> {
        let lighting = &mut look.lighting;
        Some(match self {
            Self::Yaw => &mut look.yaw_deg,
            Self::Pitch => &mut lighting.pitch_deg,
            Self::Roll => &mut lighting.roll_deg,
            Self::BackgroundYaw => &mut lighting.background_yaw_deg,
            Self::Intensity => &mut lighting.intensity_stops,
            Self::Temperature => &mut lighting.temperature_k,
            Self::Tint => &mut lighting.tint,
            Self::Exposure => &mut look.exposure_stops,
            Self::Effect(pass) => (strength(pass)?.of)(&mut look.effects),
            Self::Light(id, setting) => setting.field(lighting.placed.iter_mut().find(|light| light.id == id)?),
            Self::Group(id) => {
                let group = lighting.groups.iter_mut().find(|group| group.id == id)?;
                &mut group.gain_stops
            }
        })
    }

    /// Value in a new look, or of a new light or group.
    pub fn default_value(self) -> f32 {
        match self {
            Self::Light(_, setting) => *setting.field(&mut PlacedLight::default()),
            other => other.field(&mut Look::default()).copied().unwrap_or_default(),
        }
    }
}

impl LightSetting {
    fn field(self, light: &mut PlacedLight) -> &mut f32 {
        match self {
            Self::Yaw => &mut light.yaw_deg,
            Self::Pitch => &mut light.pitch_deg,
            Self::Radius => &mut light.radius_deg,
            Self::Intensity => &mut light.intensity,
            Self::Red => &mut light.color[0],
            Self::Green => &mut light.color[1],
            Self::Blue => &mut light.color[2],
        }
    }
}

impl Look {
    /// Value of a setting, without its keys; None if its light or group does not exist.
    pub fn value(&self, setting: Setting) -> Option<f32> {
        let (lighting, effects) = (self.lighting.clone(), self.effects);
        let (yaw_deg, exposure_stops) = (self.yaw_deg, self.exposure_stops);
        let mut look = Self { yaw_deg, lighting, effects, exposure_stops, ..Self::default() };
        setting.field(&mut look).copied()
    }

    /// Sets each setting with keys to its value at a frame.
    pub fn follow(&mut self, frame: usize) {
        let values: Vec<_> = (self.animation.lanes())
            .map(|(setting, _)| (setting, self.animation.value(setting, frame as f64)))
            .collect();
        for (setting, value) in values {
            if let Some((field, value)) = setting.field(self).zip(value) {
                *field = value;
            }
        }
    }

    /// The look with the values of its keys at a frame.
    #[must_use]
    pub fn at(&self, frame: usize) -> Self {
        let mut look = self.clone();
        look.follow(frame);
        look
    }
}
