//! The rig: position and strength of each lamp, as recorded by the mirror balls.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// One lamp, or a bank of lamps that switch together, as measured on its OLAT's mirror ball.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lamp {
    /// Name of its OLAT in the files, such as `olat_07`.
    pub name: String,
    /// Unit direction from the subject towards the lamp's centroid.
    pub direction: Vec3,
    /// ∫ L dω per channel over the lamp's footprint on the ball, in units of the OLAT session. A lower bound if
    /// part of it is [`Self::clipped`].
    pub energy: [f32; 3],
    /// Root-mean-square angle of the footprint about the centroid, in degrees.
    pub spread_deg: f32,
    /// Confidence in the direction, 0 (not seen) to 1. Above 0.5 it is nearly always right within five degrees.
    /// Clipping lowers it a little.
    pub confidence: f32,
    /// Share of the energy, 0 to 1, from pixels with a clipped channel. The lamp is brighter than measured there.
    #[serde(default)]
    pub clipped: f32,
}

/// All lamps of a session, in the order of their OLATs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    pub lamps: Vec<Lamp>,
}

impl Lamp {
    /// Smallest usable energy. Below it, an environment's energy of 10⁸ would need a weight beyond
    /// [`super::weights::MOST`].
    const LEAST_ENERGY: f32 = 1e-17;

    /// Lamp of energy 1 and a spread of 5 degrees, seen for certain and without clipping.
    pub fn new(name: impl Into<String>, direction: Vec3) -> Self {
        Self { name: name.into(), direction, energy: [1.0; 3], spread_deg: 5.0, confidence: 1.0, clipped: 0.0 }
    }

    /// True if the ball shows the lamp in every channel. A channel without light would need an infinite weight.
    pub fn is_usable(&self) -> bool {
        self.confidence > 0.0
            && self.direction.is_finite()
            && self.direction.length_squared() > 0.0
            && self.energy.iter().all(|e| e.is_finite() && *e >= Self::LEAST_ENERGY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rig_survives_its_file() {
        let lamp = Lamp {
            energy: [0.1, 0.2, 0.3],
            spread_deg: 9.5,
            confidence: 0.75,
            ..Lamp::new("olat_00", Vec3::new(0.6, 0.8, 0.0))
        };
        let rig = Rig { lamps: vec![lamp.clone(), Lamp { name: "olat_01".into(), ..lamp }] };
        assert_eq!(toml::from_str::<Rig>(&toml::to_string(&rig).unwrap()).unwrap(), rig);
    }

    #[test]
    fn a_file_that_does_not_speak_of_clipping_is_read() {
        let text =
            "lamps = [{ name = \"a\", direction = [0, 1, 0], energy = [1, 1, 1], spread_deg = 1, confidence = 1 }]";
        let rig: Rig = toml::from_str(text).unwrap();
        assert!(rig.lamps[0].clipped == 0.0 && rig.lamps[0].is_usable());
    }

    #[test]
    fn a_lamp_that_was_not_seen_is_not_usable() {
        let lamp = Lamp { spread_deg: 1.0, ..Lamp::new("a", Vec3::Y) };
        assert!(lamp.is_usable());
        assert!(!Lamp { confidence: 0.0, ..lamp.clone() }.is_usable());
        assert!(!Lamp { energy: [1.0, 0.0, 1.0], ..lamp.clone() }.is_usable());
        assert!(!Lamp { energy: [1.0, f32::NAN, 1.0], ..lamp.clone() }.is_usable());
        assert!(!Lamp { direction: Vec3::ZERO, ..lamp.clone() }.is_usable());
        assert!(!Lamp { direction: Vec3::NAN, ..lamp }.is_usable());
    }
}
