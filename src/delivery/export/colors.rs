//! The colour space of what is written. The program works in linear Rec. 709.

use base::error::{Error, Result};
use color_config::{ColorChoice, Target, Transform};
use imaging::Cube;
use imaging::color::{bt1886_from_linear, linear_from_srgb, srgb_from_linear};
use imaging::color_space::{ColorSpace, Matrix, transformed};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// Colour spaces that pictures can be written in. An EXR is linear in its primaries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OutputSpace {
    /// sRGB, as computers show it.
    Srgb,
    /// Rec. 709 for a reference monitor (BT.1886, a power of 2.4).
    Rec709,
    /// Display P3: the primaries of P3, D65, the curve of sRGB.
    P3,
    /// Rec. 2020 for a reference monitor (BT.1886, a power of 2.4).
    Rec2020,
    /// ACEScg, linear: in EXR alone.
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

    /// Its primaries and white.
    pub fn primaries(self) -> ColorSpace {
        match self {
            Self::Srgb | Self::Rec709 => ColorSpace::Rec709,
            Self::P3 => ColorSpace::P3D65,
            Self::Rec2020 => ColorSpace::Rec2020,
            Self::Acescg => ColorSpace::AcesCg,
        }
    }

    /// H.273's numbers of primaries and transfer, for a PNG's `cICP`.
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

/// The name that the ASWF's Color Interop Forum gives to linear light of these primaries.
pub fn interop_id(space: ColorSpace) -> &'static str {
    match space {
        ColorSpace::Rec709 => "lin_rec709_scene",
        ColorSpace::P3D65 => "lin_p3d65_scene",
        ColorSpace::Rec2020 => "lin_rec2020_scene",
        ColorSpace::AcesCg => "lin_ap1_scene",
    }
}

/// Conversion of a picture's sRGB codes to the codes of a file, by a look-up table and to another space; or of its light, by an
/// OpenColorIO configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Encoding {
    /// None for sRGB codes that are tagged as they always were.
    pub space: Option<OutputSpace>,
    table: Option<Arc<Cube>>,
    config: Option<Arc<Transform>>,
}

impl Encoding {
    /// For files in `space`, by the table in the file `table`.
    ///
    /// # Errors
    /// When the table cannot be read.
    pub fn open(space: Option<OutputSpace>, table: Option<&Path>) -> Result<Self> {
        let table = table.map(Cube::read).transpose()?.map(Arc::new);
        Ok(Self { space, table, config: None })
    }

    /// The same, or what a configuration makes of light in place of it.
    #[must_use]
    pub fn with_config(self, config: Option<Transform>) -> Self {
        match config {
            None => self,
            Some(config) => {
                Self { space: display_of(&config), table: None, config: Some(Arc::new(config)) }
            }
        }
    }

    /// OpenColorIO transform of the light, if one is asked for.
    pub fn config(&self) -> Option<&Transform> {
        self.config.as_deref()
    }

    /// Identity of the configuration's transform of light, for comparing; "" without one. The same for the same numbers.
    pub fn identity(&self) -> &str {
        self.config().map_or("", |config| config.identity())
    }

    /// True if codes stay as they are.
    pub fn is_plain(&self) -> bool {
        self.config.is_none()
            && self.table.is_none()
            && matches!(self.space, None | Some(OutputSpace::Srgb))
    }

    /// True if a file's codes are of a space that has no tags.
    pub fn is_untagged(&self) -> bool {
        self.config.is_some() && self.space.is_none()
    }

    /// True if linear files keep the program's own light.
    pub fn keeps_light(&self) -> bool {
        self.config.is_none() && self.primaries() == ColorSpace::Rec709
    }

    /// Codes of a file, in `[0, 1]`, for sRGB codes in `[0, 1]`.
    pub fn codes(&self) -> impl Fn([f32; 3]) -> [f32; 3] + '_ {
        let space = self.space.unwrap_or(OutputSpace::Srgb);
        let matrix = ColorSpace::Rec709.matrix_to(space.primaries());
        move |code| {
            let code = self.table.as_ref().map_or(code, |table| table.apply(code));
            match space {
                OutputSpace::Srgb => code,
                OutputSpace::Rec709 => code.map(|v| bt1886_from_linear(linear_from_srgb(v))),
                OutputSpace::P3 => light(&matrix, code).map(srgb_from_linear),
                OutputSpace::Rec2020 => light(&matrix, code).map(bt1886_from_linear),
                // Refused before: there are no codes of linear light.
                OutputSpace::Acescg => light(&matrix, code),
            }
        }
    }

    /// The primaries of linear files, unless a configuration decides them.
    pub fn primaries(&self) -> ColorSpace {
        self.space.map_or(ColorSpace::Rec709, OutputSpace::primaries)
    }

    /// Colour tags of linear files: chromaticities, where they are known, and the space's name.
    pub fn linear_tags(&self) -> (Option<ColorSpace>, Option<String>) {
        match &self.config {
            None => (Some(self.primaries()), Some(interop_id(self.primaries()).to_owned())),
            Some(config) => {
                let known = config.known_space();
                let id = known.map(|space| interop_id(space).to_owned());
                (known, id.or_else(|| config.interop_id.clone()))
            }
        }
    }

    /// Refuses what a file for a display, or one in linear light, cannot have.
    ///
    /// # Errors
    /// Then: which setting, and what to do.
    pub fn check(
        space: Option<OutputSpace>,
        table: Option<&Path>,
        to: &str,
        is_linear: bool,
    ) -> Result<()> {
        if space == Some(OutputSpace::Acescg) && !is_linear {
            return Err(Error::invalid(
                format!("{to} cannot be in ACEScg, which is linear light"),
                "Write an EXR, such as out.%04d.exr, or choose another colour space",
            ));
        }
        match table {
            Some(table) if is_linear => Err(Error::invalid(
                format!(
                    "the look-up table {} cannot be baked into {to}: it reads the codes of a display, and an EXR holds \
                     linear light",
                    table.display()
                ),
                "Leave the table out, or write PNG, TIFF or a movie",
            )),
            _ => Ok(()),
        }
    }
}

/// Refuses what of a configuration a file cannot have.
///
/// # Errors
/// Then: which setting, and what to do.
pub(super) fn check_config(
    choice: &ColorChoice,
    (space, table): (Option<OutputSpace>, Option<&Path>),
    to: &str,
    is_linear: bool,
) -> Result<()> {
    if !choice.is_asked() {
        return Ok(());
    }
    if space.is_some() || table.is_some() {
        return Err(Error::invalid(
            "an OpenColorIO configuration decides the colours of a file alone",
            (
                "Leave out the colour space and the LUT, or the configuration",
                "--space and --lut, or --ocio-display, --ocio-view, --ocio-look and --ocio-space",
            ),
        ));
    }
    if is_linear && choice.is_view() {
        return Err(Error::invalid(
            format!("{to} holds linear light, and a view makes codes of a display"),
            (
                "Write PNG, TIFF or a movie, or name a linear colour space",
                "--ocio-space scene_linear",
            ),
        ));
    }
    Ok(())
}

/// Refuses a colour space of a configuration that is not linear in a file that is.
///
/// # Errors
/// Then.
pub(super) fn check_linear(config: Option<&Transform>, to: &str, is_linear: bool) -> Result<()> {
    match config.map(|config| &config.target) {
        Some(Target::Space { name, is_linear: false }) if is_linear => Err(Error::invalid(
            format!("{to} holds linear light, and {name} is not linear, or a look is on it"),
            "Choose a linear colour space, such as scene_linear, without a look",
        )),
        _ => Ok(()),
    }
}

/// Our display that matches a configuration's, for the tags of files: by the ASWF's names, and by those that configurations
/// for ACES have given them.
fn display_of(config: &Transform) -> Option<OutputSpace> {
    let name = config.interop_id.as_deref().unwrap_or(&config.space);
    Some(match name {
        "srgb_rec709_display"
        | "sRGB - Display"
        | "srgb_rec709_scene"
        | "srgb_tx"
        | "sRGB - Texture"
        | "sRGB Encoded Rec.709 (sRGB)" => OutputSpace::Srgb,
        "g24_rec709_display" | "Rec.1886 Rec.709 - Display" | "Gamma 2.4 Rec.709 - Display" => {
            OutputSpace::Rec709
        }
        "srgb_p3d65_display" | "Display P3 - Display" => OutputSpace::P3,
        "g24_rec2020_display" | "Rec.1886 Rec.2020 - Display" => OutputSpace::Rec2020,
        _ => return None,
    })
}

fn light(matrix: &Matrix, code: [f32; 3]) -> [f32; 3] {
    transformed(matrix, code.map(linear_from_srgb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_light_has_the_codes_of_its_display() {
        let of = |space, code: [f32; 3]| {
            let encoding = Encoding::open(Some(space), None).unwrap();
            encoding.codes()(code)
        };
        for space in OutputSpace::ALL {
            for white in [0.0f32, 1.0] {
                let found = of(space, [white; 3]);
                assert!(found.iter().all(|v| (v - white).abs() < 1e-6), "{space:?}: {found:?}");
            }
        }
        // Display P3 of pure sRGB red, as CSS Color 4 gives it.
        let red = of(OutputSpace::P3, [1.0, 0.0, 0.0]);
        for (found, wanted) in red.into_iter().zip([0.917_49, 0.200_29, 0.138_56]) {
            assert!((found - wanted).abs() < 1e-4, "{red:?}");
        }
        let grey = of(OutputSpace::Rec709, [0.5; 3])[0];
        assert!((grey.powf(2.4) - linear_from_srgb(0.5)).abs() < 1e-6);
        let grey = of(OutputSpace::Rec2020, [0.5; 3]);
        assert!((grey[0].powf(2.4) - linear_from_srgb(0.5)).abs() < 1e-5);
    }

    #[test]
    fn what_a_file_cannot_have_is_refused() {
        let said = |space, table: Option<&str>, linear| {
            let refused = Encoding::check(space, table.map(Path::new), "a", linear);
            refused.map_err(|e| e.to_string()).err().unwrap_or_default()
        };
        assert!(said(Some(OutputSpace::Acescg), None, false).contains("linear light"));
        assert!(said(None, Some("x.cube"), true).contains("x.cube"));
        assert_eq!(said(Some(OutputSpace::Acescg), None, true), "");
        assert_eq!(said(Some(OutputSpace::P3), Some("x.cube"), false), "");
    }
}
