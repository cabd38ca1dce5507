//! Colour spaces of exported pictures.

use imaging::color_space::ColorSpace;
use serde::{Deserialize, Serialize};

/// Colour spaces of exported pictures. An EXR is linear in the primaries of its space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OutputSpace {
    /// sRGB, for computer displays.
    Srgb,
    /// Rec. 709 for a reference monitor (BT.1886, gamma 2.4).
    Rec709,
    /// Display P3: P3 primaries, D65, sRGB curve.
    P3,
    /// Rec. 2020 for a reference monitor (BT.1886, gamma 2.4).
    Rec2020,
    /// ACEScg, linear: only in EXR.
    Acescg,
}

impl OutputSpace {
    pub const ALL: [Self; 5] = [Self::Srgb, Self::Rec709, Self::P3, Self::Rec2020, Self::Acescg];

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "sRGB",
            Self::Rec709 => "Rec. 709",
            Self::P3 => "P3",
            Self::Rec2020 => "Rec. 2020",
            Self::Acescg => "ACEScg",
        }
    }

    /// Primaries and white.
    pub fn primaries(self) -> ColorSpace {
        match self {
            Self::Srgb | Self::Rec709 => ColorSpace::Rec709,
            Self::P3 => ColorSpace::P3D65,
            Self::Rec2020 => ColorSpace::Rec2020,
            Self::Acescg => ColorSpace::AcesCg,
        }
    }

    /// H.273 numbers of primaries and transfer, for a PNG's `cICP`.
    pub fn code_points(self) -> [u8; 2] {
        match self {
            Self::Srgb => [1, 13],
            Self::Rec709 => [1, 1],
            Self::P3 => [12, 13],
            Self::Rec2020 => [9, 14],
            Self::Acescg => [2, 8],
        }
    }
}

/// Name of linear light with these primaries, from the ASWF's Color Interop Forum.
pub fn interop_id(space: ColorSpace) -> &'static str {
    match space {
        ColorSpace::Rec709 => "lin_rec709_scene",
        ColorSpace::P3D65 => "lin_p3d65_scene",
        ColorSpace::Rec2020 => "lin_rec2020_scene",
        ColorSpace::AcesCg => "lin_ap1_scene",
    }
}
