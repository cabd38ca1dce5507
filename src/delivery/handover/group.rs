//! Key, fill and rim: the role of a lamp, from its direction and its light.

use glam::Vec3;

/// Role of a lamp, in a gaffer's terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// In front, on the brighter side.
    Key,
    /// In front, on the other side or along the camera's axis.
    Fill,
    /// Behind the subject.
    Rim,
}

/// Lamps more than 105° away from the direction of the camera are behind the subject: −sin 15°.
const BEHIND: f32 = -0.258_819;
/// Lamps more than 10° away from the vertical plane through the camera's axis are on a side: sin 10°.
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

/// Groups of lamps in these unit directions from the subject (camera on +Z) with these amounts of light.
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
        // Lit only along the axis, as by a ring light.
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

    /// Direction from an azimuth relative to the camera, positive to camera-right, and an elevation, in degrees.
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
