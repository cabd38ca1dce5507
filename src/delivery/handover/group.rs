//! Key, fill and rim: what a lamp is to the picture, by where it stands and how much it gives.

use glam::Vec3;

/// A gaffer's name for a lamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// In front, on the side that gives more light.
    Key,
    /// In front, on the other side, and along the camera's axis.
    Fill,
    /// Behind the subject.
    Rim,
}

/// A lamp is behind the subject if it is more than 105° away from the direction of the camera: −sin 15°.
const BEHIND: f32 = -0.258_819;
/// A lamp is on a side if it is more than 10° away from the plane of the camera's axis and the vertical: sin 10°.
const ASIDE: f32 = 0.173_648;

impl Group {
    pub const ALL: [Self; 3] = [Self::Key, Self::Fill, Self::Rim];

    pub fn name(self) -> &'static str {
        match self {
            Self::Key => "Key",
            Self::Fill => "Fill",
            Self::Rim => "Rim",
        }
    }
}

/// The groups of lamps in these unit directions from the subject, the camera being on +Z, that give so much light.
pub fn groups(lamps: &[(Vec3, f32)]) -> Vec<Group> {
    let side = |direction: &Vec3| match direction {
        Vec3 { z, .. } if *z < BEHIND => None,
        Vec3 { x, .. } if x.abs() <= ASIDE => Some(0),
        Vec3 { x, .. } => Some(if *x < 0.0 { -1 } else { 1 }),
    };
    let light_from = |wanted: i32| -> f32 {
        let there = lamps.iter().filter(|(d, _)| side(d) == Some(wanted));
        there.map(|(_, light)| light).sum()
    };
    let [left, middle, right] = [-1, 0, 1].map(light_from);
    let key = match (left + right > 0.0, left >= right) {
        // Lit along the axis alone, as by a ring light.
        (false, _) if middle > 0.0 => 0,
        (_, true) => -1,
        (_, false) => 1,
    };
    let group = |(direction, _): &(Vec3, f32)| match side(direction) {
        None => Group::Rim,
        Some(side) if side == key => Group::Key,
        Some(_) => Group::Fill,
    };
    lamps.iter().map(group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Group::{Fill, Key, Rim};

    /// A direction at an azimuth from the camera, positive to camera-right, and an elevation, in degrees.
    fn at(azimuth: f32, elevation: f32) -> Vec3 {
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        Vec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), elevation.cos() * azimuth.cos())
    }

    #[test]
    fn the_brighter_side_is_the_key_whichever_it_is() {
        let lamps = |left: f32, right: f32| {
            [
                (at(-45.0, 30.0), left),
                (at(45.0, 10.0), right),
                (at(0.0, 0.0), 9.0),
                (at(150.0, 20.0), 50.0),
                (at(-90.0, 0.0), 0.1),
            ]
        };
        assert_eq!(groups(&lamps(2.0, 1.0)), [Key, Fill, Fill, Rim, Key]);
        assert_eq!(groups(&lamps(1.0, 2.0)), [Fill, Key, Fill, Rim, Fill]);
    }

    #[test]
    fn light_along_the_axis_alone_is_the_key() {
        assert_eq!(groups(&[(at(0.0, 60.0), 1.0), (at(90.0, 0.0), 0.0)]), [Key, Fill]);
        assert_eq!(groups(&[(at(180.0, 0.0), 1.0)]), [Rim]);
        assert_eq!(groups(&[]), []);
    }
}
