//! Conversion of the yaw to the conventions of other tools, and the front of a panorama file.
//!
//! All tools lay out a lat-long with u to the right as seen from inside. They differ only by a yaw: the axis in the
//! middle column, the direction of the camera, and the sign of the rotation. Each camera is taken to look along its
//! tool's front: −Z where +Y is up, +Y in Blender, where +Z is up.
//!
//! | tool | middle | front is at u | value for a yaw ψ | source |
//! |---|---|---:|---|---|
//! | ours | −Z | ½ | ψ | [`super::latlong`] |
//! | OpenEXR, USD | +Z | 0 | 180° − ψ | `ImfEnvmap.h`: latitude 0, longitude 0 is +Z, longitude π/2 is +X, left is +π; openusd.org, DomeLight: "adheres to the OpenEXR specification" |
//! | Nuke | +Z | 0 | 180° − ψ | GeoDomeLight, which is USD's; the classic nodes' orientation is not documented |
//! | Mitsuba 3 | +Z | 0 | 180° − ψ | `emitters/envmap.cpp`: u = atan2(x, −z) / 2π of `to_world`⁻¹·d |
//! | three.js | +X | ¼ | 90° − ψ | `common.glsl.js`, `equirectUv`: u = atan(z, x) / 2π + ½; `WebGLBackground.js` looks d up turned by minus `backgroundRotation` |
//! | Blender | +X | ¼ | ψ − 90° | `gpu_shader_material_tex_environment.glsl`: u = −atan(y, x) / 2π + ½; manual, Mapping node: type Point turns the vector that is looked up |

use super::latlong::uv_from_direction;
use base::numbers;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A tool with its own setting for an environment's rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tool {
    OpenExr,
    Nuke,
    Mitsuba,
    ThreeJs,
    Blender,
}

impl Tool {
    /// All tools.
    pub const ALL: [Self; 5] = [Self::OpenExr, Self::Nuke, Self::Mitsuba, Self::ThreeJs, Self::Blender];

    /// Name in the window.
    pub fn title(self) -> &'static str {
        match self {
            Self::OpenExr => "OpenEXR, USD",
            Self::Nuke => "Nuke",
            Self::Mitsuba => "Mitsuba 3",
            Self::ThreeJs => "three.js",
            Self::Blender => "Blender",
        }
    }

    /// Setting of the tool that takes the value.
    pub fn setting(self) -> &'static str {
        match self {
            Self::OpenExr => "rotateY of the DomeLight, in degrees",
            Self::Nuke => "rotate y of the GeoDomeLight, in degrees",
            Self::Mitsuba => "to_world of the envmap: rotate about y, in degrees",
            Self::ThreeJs => "scene.environmentRotation.y and backgroundRotation.y, here in degrees",
            Self::Blender => "Rotation Z of the Mapping node (type Point) before the texture, in degrees",
        }
    }

    /// Sign and offset of the conversion.
    fn sign_and_offset(self) -> (f32, f32) {
        match self {
            Self::OpenExr | Self::Nuke | Self::Mitsuba => (-1.0, 180.0),
            Self::ThreeJs => (-1.0, 90.0),
            Self::Blender => (1.0, -90.0),
        }
    }

    /// The tool's value, above −180° and up to 180°, that matches Afterlight's view of the file at a yaw.
    pub fn value_of_yaw(self, yaw_deg: f32) -> f32 {
        let (sign, offset) = self.sign_and_offset();
        wrapped(offset + sign * yaw_deg)
    }

    /// The yaw, above −180° and up to 180°, that matches the tool's view of the file at a value.
    pub fn yaw_of_value(self, value_deg: f32) -> f32 {
        let (sign, offset) = self.sign_and_offset();
        wrapped(sign * (value_deg - offset))
    }
}

/// Front of a panorama file: the yaw in degrees that centres it. Stored with the file's name; 0 for files made for
/// Afterlight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Front {
    yaw_deg: f32,
}

impl Front {
    /// Front from an offset in degrees; NaN and infinity count as 0.
    pub fn new(yaw_deg: f32) -> Self {
        Self { yaw_deg: wrapped(yaw_deg) }
    }

    /// Front at the column u, 0 to 1, picked by the user.
    pub fn at_column(u: f32) -> Self {
        Self::new(360.0 * (0.5 - u))
    }

    /// Column of the front as u, from 0 up to but not including 1.
    pub fn column(self) -> f32 {
        (0.5 - self.yaw_deg() / 360.0).rem_euclid(1.0)
    }

    /// Front at a direction in the unrotated panorama.
    pub fn at_direction(direction: glam::Vec3) -> Self {
        Self::at_column(uv_from_direction(direction).0)
    }

    /// Front of files made for a tool: its camera's view without rotation.
    pub fn from_tool(tool: Tool) -> Self {
        Self::new(tool.yaw_of_value(0.0))
    }

    /// Offset in degrees, above −180° and up to 180°.
    pub fn yaw_deg(self) -> f32 {
        // A file may hold any value.
        wrapped(self.yaw_deg)
    }

    /// Total yaw of the file for the user's `yaw_deg`. Whole turns are kept.
    pub fn turned(self, yaw_deg: f32) -> f32 {
        yaw_deg + self.yaw_deg()
    }
}

/// Wraps an angle to above −180° and up to 180°; 0 for NaN and infinity.
fn wrapped(degrees: f32) -> f32 {
    if !degrees.is_finite() {
        return 0.0;
    }
    let turned = degrees.rem_euclid(360.0);
    if turned > 180.0 { turned - 360.0 } else { turned }
}

/// The equivalent values in other tools, one per line.
pub fn sentence(yaw_deg: f32) -> String {
    let all = Tool::ALL.map(|tool| {
        let value = tool.value_of_yaw(yaw_deg);
        format!("\n{}: {value:.1}, {}", tool.title(), tool.setting())
    });
    format!("The same turn in other tools:{}", all.concat())
}

impl FromStr for Front {
    type Err = String;

    /// Parses a tool's name, or the yaw in degrees that centres the front.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let name: String = text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
        let tool = match name.as_str() {
            "afterlight" => return Ok(Self::default()),
            "openexr" | "exr" | "usd" => Tool::OpenExr,
            "nuke" => Tool::Nuke,
            "mitsuba" => Tool::Mitsuba,
            "threejs" => Tool::ThreeJs,
            "blender" => Tool::Blender,
            _ => {
                let [yaw_deg] =
                    numbers(text, "afterlight, openexr, usd, nuke, mitsuba, threejs, blender or degrees of yaw")?;
                let yaw_deg = yaw_deg as f32;
                return if numbers::ANGLES.contains(&yaw_deg) {
                    Ok(Self::new(yaw_deg))
                } else {
                    Err(format!("{text:?} is not an angle within 100000°"))
                };
            }
        };
        Ok(Self::from_tool(tool))
    }
}

#[cfg(test)]
mod balls;
#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    /// The tool's own look-up, from its source: u and v (from the top) for a direction in the tool's axes and a
    /// value in degrees.
    fn looked_up(tool: Tool, d: DVec3, value: f64) -> (f64, f64) {
        let radians = value.to_radians();
        // An object rotated by a matrix M shows in direction d the content of M⁻¹·d.
        let turned_y = DMat3::from_rotation_y(radians).inverse() * d;
        match tool {
            Tool::OpenExr | Tool::Nuke => {
                // LatLongMap::latLong and pixelPosition: longitude π is the left edge.
                let longitude = turned_y.x.atan2(turned_y.z);
                let latitude = turned_y.y.atan2(turned_y.z.hypot(turned_y.x));
                ((PI - longitude) / TAU, (PI / 2.0 - latitude) / PI)
            }
            Tool::Mitsuba => {
                let u = turned_y.x.atan2(-turned_y.z) / TAU;
                (u - u.floor(), turned_y.y.clamp(-1.0, 1.0).acos() / PI)
            }
            Tool::ThreeJs => {
                // makeRotationFromEuler(−rotation) · d, and a texture whose first row is at the top (flipY).
                let d = DMat3::from_rotation_y(-radians) * d;
                let (u, v) = (d.z.atan2(d.x) / TAU + 0.5, d.y.clamp(-1.0, 1.0).asin() / PI + 0.5);
                (u, 1.0 - v)
            }
            Tool::Blender => {
                let d = DMat3::from_rotation_z(radians) * d;
                let v = d.z.atan2(d.x.hypot(d.y)) / PI + 0.5;
                (-d.y.atan2(d.x) / TAU + 0.5, 1.0 - v)
            }
        }
    }

    /// Converts our axes to the tool's; front, up and right correspond.
    fn in_axes_of(tool: Tool, d: DVec3) -> DVec3 {
        match tool {
            Tool::Blender => DVec3::new(d.x, -d.z, d.y),
            _ => d,
        }
    }

    proptest! {
        #[test]
        fn a_direction_shows_the_same_texel_in_every_tool(
            x in -1.0f64..1.0, y in -1.0f64..1.0, z in -1.0f64..1.0, yaw in -400f32..400.0,
        ) {
            let d = DVec3::new(x, y, z);
            prop_assume!(d.length() > 0.1 && d.x.hypot(d.z) > 0.05);
            let d = d.normalize();
            // At yaw ψ direction d shows the column ψ to the left of its own.
            let u = 0.5 + d.x.atan2(-d.z) / TAU - f64::from(yaw) / 360.0;
            let v = d.y.acos() / PI;
            for tool in Tool::ALL {
                let value = f64::from(tool.value_of_yaw(yaw));
                let (their_u, their_v) = looked_up(tool, in_axes_of(tool, d), value);
                let apart = (their_u - u + 0.5).rem_euclid(1.0) - 0.5;
                prop_assert!(apart.abs() < 1e-6 && (their_v - v).abs() < 1e-6, "{tool:?}: {their_u} {u}");
            }
        }

        #[test]
        fn values_and_yaws_round_trip(yaw in -179.9f32..180.0) {
            for tool in Tool::ALL {
                let value = tool.value_of_yaw(yaw);
                prop_assert!(value > -180.0 && value <= 180.0);
                prop_assert!((tool.yaw_of_value(value) - yaw).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn the_table_is_what_the_code_does() {
        for (tool, front) in [
            (Tool::OpenExr, 0.0),
            (Tool::Nuke, 0.0),
            (Tool::Mitsuba, 0.0),
            (Tool::ThreeJs, 0.25),
            (Tool::Blender, 0.25),
        ] {
            let (u, _) = looked_up(tool, in_axes_of(tool, DVec3::NEG_Z), 0.0);
            assert!((u - front + 0.5).rem_euclid(1.0) - 0.5 < 1e-9, "{tool:?}: {u}");
            // That column moves to the middle.
            assert_eq!(Front::from_tool(tool), Front::at_column(front as f32), "{tool:?}");
        }
    }

    #[test]
    fn what_is_pointed_to_comes_to_the_front() {
        assert_eq!(Front::at_column(0.75).turned(0.0), -90.0);
        assert_eq!(Front::at_column(0.75).column(), 0.75);
        assert_eq!(Front::from_tool(Tool::Nuke).column(), 0.0);
        assert_eq!(Front::at_column(0.5).turned(720.0), 720.0);
        assert_eq!(Front::at_direction(glam::Vec3::X).yaw_deg(), -90.0);
        assert_eq!(Front::new(f32::NAN), Front::default());
        assert_eq!(serde_json::to_string(&Front::new(450.0)).unwrap(), "90.0");
        assert_eq!(serde_json::from_str::<Front>("-270.0").unwrap().yaw_deg(), 90.0);
    }

    #[test]
    fn front_is_a_tools_or_an_angle() {
        assert_eq!("three.js".parse(), Ok(Front::at_column(0.25)));
        assert_eq!("USD".parse(), Ok(Front::at_column(0.0)));
        assert_eq!("Afterlight".parse(), Ok(Front::default()));
        assert_eq!("-450".parse(), Ok(Front::new(-90.0)));
        for text in ["", "maya", "nan", "1,2"] {
            assert!(text.parse::<Front>().is_err(), "{text}");
        }
    }
}
