//! Properties of a picture, and the receiver of its light.

use base::error::Result;
use std::fmt;

/// Properties of a picture, known before its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Columns and rows, turned as the file asks.
    pub size: (usize, usize),
    /// Name of the format, such as `PNG`.
    pub format: &'static str,
    pub coding: Coding,
    /// True if the file stores coverage.
    pub has_alpha: bool,
    /// Bits of a sample.
    pub bits: u8,
    /// Name of the layer that was read, of several with colours; None if it has none, or there is one layer.
    pub layer: Option<String>,
    /// Source of the turn that was applied, such as `EXIF`; None if the picture is as stored.
    pub turned_by: Option<&'static str>,
    /// True if light was brought from other primaries to Rec. 709, where some of it may be negative.
    pub is_converted: bool,
    /// False if parts of the picture are not in the file: they are black.
    pub is_whole: bool,
    /// Sentences about guesses, conversions and omissions; none for an ordinary picture.
    pub notes: Vec<String>,
}

/// Meaning of a file's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Linear light, of primaries that the file names or else Rec. 709.
    Light(Option<Origin>),
    /// Codes of the curve and primaries that the file names.
    Named(Origin),
    /// Codes of a curve that the file leaves open: a camera's, or sRGB.
    Open,
}

/// A colour with its source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Name, such as `Display P3`.
    pub name: String,
    /// Part of the file that names it, such as `its ICC profile`.
    pub by: &'static str,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} by {}", self.name, self.by)
    }
}

impl About {
    /// Format, depth, colour and turn, such as `PNG, 16 bits, Display P3 by its ICC profile, turned by EXIF`.
    pub fn sentence(&self) -> String {
        let coding = match &self.coding {
            Coding::Light(None) => "scene-linear".to_owned(),
            Coding::Light(Some(origin)) => format!("scene-linear, {origin}"),
            Coding::Named(origin) => origin.to_string(),
            Coding::Open => "curve not named".to_owned(),
        };
        let turned = self.turned_by.map_or(String::new(), |by| format!(", turned by {by}"));
        let layer = self.layer.as_ref().map_or(String::new(), |name| format!(", layer \"{name}\""));
        format!("{}, {} bits{layer}, {coding}{turned}", self.format, self.bits)
    }
}

/// Receiver of a picture's light.
pub trait Sink {
    /// Called once, before any pixel. False ends the reading.
    ///
    /// # Errors
    /// When the picture does not fit.
    fn begin(&mut self, about: &About) -> Result<bool>;

    /// Light of row `y` from column `x` on: linear Rec. 709, and its coverage if the file has any (else empty).
    fn run(&mut self, x: usize, y: usize, light: &[[f32; 3]], alpha: &[f32]);

    /// True if the picture is the file's data window instead of its display window; sizes of both.
    fn takes_data_window(&self, _data: (usize, usize), _display: (usize, usize)) -> bool {
        false
    }
}
