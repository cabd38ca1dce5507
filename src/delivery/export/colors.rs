//! Colours of exported files. The program works in linear Rec. 709.

use super::format::Files;
use super::output_space::{OutputSpace, interop_id};
use base::error::{Error, Result};
use color_config::{Target, Transform};
use imaging::Cube;
use imaging::color::{bt1886_from_linear, linear_from_srgb, srgb_from_linear};
use imaging::color_space::{ColorSpace, Matrix, transformed};
use std::path::Path;
use std::sync::Arc;

/// Conversion to the codes of a file: of a picture's sRGB codes by a look-up table and a colour space, or of its light by an
/// OpenColorIO configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Encoding {
    /// None for plain sRGB codes.
    pub space: Option<OutputSpace>,
    table: Option<Arc<Cube>>,
    config: Option<Arc<Transform>>,
}

impl Encoding {
    /// For these files.
    ///
    /// # Errors
    /// When the look-up table or the configuration cannot be read, or a file of linear light cannot hold the
    /// configuration's colour space.
    pub fn for_files(files: &Files) -> Result<Self> {
        let Files { to, space, lut, ocio, .. } = files;
        let Some(config) = ocio.transform()? else { return Self::open(*space, lut.as_deref()) };
        match &config.target {
            Target::Space { name, is_linear: false } if to.is_linear() => Err(Error::invalid(
                format!("{to} holds linear light, but {name} is not linear or has a look"),
                "Choose a linear colour space, such as scene_linear, without a look",
            )),
            _ => Ok(Self { space: display_of(&config), table: None, config: Some(Arc::new(config)) }),
        }
    }

    /// For files in `space`, with the look-up table of the file `table`.
    ///
    /// # Errors
    /// When the look-up table cannot be read.
    pub fn open(space: Option<OutputSpace>, table: Option<&Path>) -> Result<Self> {
        let table = table.map(Cube::read).transpose()?.map(Arc::new);
        Ok(Self { space, table, config: None })
    }

    /// OpenColorIO transform of the light; None without a configuration.
    pub fn config(&self) -> Option<&Transform> {
        self.config.as_deref()
    }

    /// Identity of the configuration's transform, for comparisons; "" without one. Equal numbers give equal identities.
    pub fn identity(&self) -> &str {
        self.config().map_or("", |config| config.identity())
    }

    /// True if codes stay unchanged.
    pub fn is_plain(&self) -> bool {
        self.config.is_none() && self.table.is_none() && matches!(self.space, None | Some(OutputSpace::Srgb))
    }

    /// True if the codes belong to a space without tags.
    pub fn is_untagged(&self) -> bool {
        self.config.is_some() && self.space.is_none()
    }

    /// True if linear files keep the working space.
    pub fn keeps_light(&self) -> bool {
        self.config.is_none() && self.primaries() == ColorSpace::Rec709
    }

    /// Codes of a file, in `[0, 1]`, from sRGB codes in `[0, 1]`.
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
                // Refused earlier: linear light has no codes.
                OutputSpace::Acescg => light(&matrix, code),
            }
        }
    }

    /// Primaries of linear files, unless a configuration decides.
    pub fn primaries(&self) -> ColorSpace {
        self.space.map_or(ColorSpace::Rec709, OutputSpace::primaries)
    }

    /// Colour tags of linear files: the chromaticities, if known, and the name of the space.
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
}

/// Refuses colours that the destination cannot hold.
///
/// # Errors
/// When a setting does not fit; the message names it and the remedy.
pub(super) fn check_colors(files: &Files) -> Result<()> {
    let Files { to, space, lut, ocio, .. } = files;
    if *space == Some(OutputSpace::Acescg) && !to.is_linear() {
        return Err(Error::invalid(
            format!("{to} cannot hold ACEScg, which is linear light"),
            "Write an EXR, such as out.%04d.exr, or choose another colour space",
        ));
    }
    if let Some(table) = lut.as_ref().filter(|_| to.is_linear()) {
        return Err(Error::invalid(
            format!(
                "the look-up table {} cannot be baked into {to}: it reads display codes, and an EXR holds \
                 linear light",
                table.display()
            ),
            "Leave the table out, or write PNG, TIFF or a movie",
        ));
    }
    if !ocio.is_asked() {
        return Ok(());
    }
    if space.is_some() || lut.is_some() {
        return Err(Error::invalid(
            "an OpenColorIO configuration replaces the colour space and the LUT",
            (
                "Leave out the colour space and the LUT, or the configuration",
                "--space and --lut, or --ocio-display, --ocio-view, --ocio-look and --ocio-space",
            ),
        ));
    }
    if to.is_linear() && ocio.is_view() {
        return Err(Error::invalid(
            format!("{to} holds linear light, but a view makes display codes"),
            ("Write PNG, TIFF or a movie, or name a linear colour space", "--ocio-space scene_linear"),
        ));
    }
    Ok(())
}

/// Our display that matches a configuration's display, for the tags of files: by the ASWF's names and the names in ACES
/// configurations.
fn display_of(config: &Transform) -> Option<OutputSpace> {
    let name = config.interop_id.as_deref().unwrap_or(&config.space);
    Some(match name {
        "srgb_rec709_display"
        | "sRGB - Display"
        | "srgb_rec709_scene"
        | "srgb_tx"
        | "sRGB - Texture"
        | "sRGB Encoded Rec.709 (sRGB)" => OutputSpace::Srgb,
        "g24_rec709_display" | "Rec.1886 Rec.709 - Display" | "Gamma 2.4 Rec.709 - Display" => OutputSpace::Rec709,
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
        let codes = |space, code: [f32; 3]| {
            let encoding = Encoding::open(Some(space), None).unwrap();
            encoding.codes()(code)
        };
        for space in OutputSpace::ALL {
            for white in [0.0f32, 1.0] {
                let found = codes(space, [white; 3]);
                assert!(found.iter().all(|v| (v - white).abs() < 1e-6), "{space:?}: {found:?}");
            }
        }
        // Display P3 of pure sRGB red, from CSS Color 4.
        let red = codes(OutputSpace::P3, [1.0, 0.0, 0.0]);
        for (found, wanted) in red.into_iter().zip([0.917_49, 0.200_29, 0.138_56]) {
            assert!((found - wanted).abs() < 1e-4, "{red:?}");
        }
        let grey = codes(OutputSpace::Rec709, [0.5; 3])[0];
        assert!((grey.powf(2.4) - linear_from_srgb(0.5)).abs() < 1e-6);
        let grey = codes(OutputSpace::Rec2020, [0.5; 3]);
        assert!((grey[0].powf(2.4) - linear_from_srgb(0.5)).abs() < 1e-5);
    }

    #[test]
    fn what_a_file_cannot_have_is_refused() {
        let said = |to: &str, space, table: Option<&str>| {
            let files = Files { space, lut: table.map(Into::into), ..Files::to(to).unwrap() };
            check_colors(&files).map_err(|e| e.to_string()).err().unwrap_or_default()
        };
        assert!(said("a.png", Some(OutputSpace::Acescg), None).contains("linear light"));
        assert!(said("a.exr", None, Some("x.cube")).contains("x.cube"));
        assert_eq!(said("a.exr", Some(OutputSpace::Acescg), None), "");
        assert_eq!(said("a.png", Some(OutputSpace::P3), Some("x.cube")), "");
    }
}
