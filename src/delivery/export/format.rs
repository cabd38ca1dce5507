//! Formats of exported files.

use super::codec::Codec;
use super::destination::Destination;
use super::exr_settings::ExrSettings;
use super::interview::Interview;
use super::output_space::OutputSpace;
use base::error::Result;
use base::numbers::within;
use color_config::ColorChoice;
use footage::{FRAME_NUMBERS, PictureSize};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// File formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Format {
    #[default]
    Png8,
    Png16,
    Tiff,
    Exr,
    Movie(Codec),
}

/// Bits per pixel in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelBits {
    /// Uncompressed; compression saves more or less of it.
    AtMost(f64),
    /// Target bitrate of the codec.
    About(f64),
}

impl Format {
    /// Bits per pixel; None where the encoder adapts to the content. ProRes and DNxHR aim at a bitrate:
    /// here the makers' rates for 1920 × 1080 at 29.97 frames a second, divided by its pixels (Apple, "ProRes White
    /// Paper", 2022; Avid, "DNxHR Codec Bandwidth Specifications").
    pub fn pixel_bits(self, has_alpha: bool) -> Option<PixelBits> {
        let channels = if has_alpha { 4.0 } else { 3.0 };
        let of_rate = |megabits: f64| PixelBits::About(megabits * 1e6 / (1920.0 * 1080.0 * 29.97));
        Some(match self {
            Self::Png8 => PixelBits::AtMost(8.0 * channels),
            Self::Png16 | Self::Tiff | Self::Movie(Codec::Ffv1) => PixelBits::AtMost(16.0 * channels),
            // Half floats; 32-bit floats take twice that.
            Self::Exr => PixelBits::AtMost(64.0),
            Self::Movie(Codec::ProRes422Hq) => of_rate(220.0),
            Self::Movie(Codec::ProRes4444) => of_rate(330.0),
            Self::Movie(Codec::DnxhrHq | Codec::DnxhrHqx) => of_rate(220.0),
            Self::Movie(Codec::Dnxhr444) => of_rate(440.0),
            Self::Movie(Codec::H264 | Codec::H265) => return None,
        })
    }

    /// All formats.
    pub const ALL: [Self; 12] = [
        Self::Png8,
        Self::Png16,
        Self::Tiff,
        Self::Exr,
        Self::Movie(Codec::H264),
        Self::Movie(Codec::H265),
        Self::Movie(Codec::ProRes422Hq),
        Self::Movie(Codec::ProRes4444),
        Self::Movie(Codec::DnxhrHq),
        Self::Movie(Codec::DnxhrHqx),
        Self::Movie(Codec::Dnxhr444),
        Self::Movie(Codec::Ffv1),
    ];

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png8 => "PNG",
            Self::Png16 => "PNG 16",
            Self::Tiff => "TIFF 16",
            Self::Exr => "EXR",
            Self::Movie(codec) => codec.name(),
        }
    }

    /// Purpose and properties in one sentence.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Png8 => "Stills for a display: 8 bits, straight alpha",
            Self::Png16 => "Stills for a display: 16 bits, straight alpha",
            Self::Tiff => "Stills for a display: 16 bits, straight alpha, as a TIFF",
            Self::Exr => {
                "Stills in linear light: half floats, ZIP, premultiplied alpha; time code, frame rate and \
                 colour space in the header"
            }
            Self::Movie(Codec::H264) => "A movie for review: 8 bits, Rec. 709",
            Self::Movie(Codec::H265) => "A movie for review: 10 bits, Rec. 709",
            Self::Movie(Codec::ProRes422Hq) => "A movie for editing: 4:2:2, 10 bits",
            Self::Movie(Codec::ProRes4444) => "A movie for editing: ProRes 4444 with straight alpha, Rec. 709",
            Self::Movie(Codec::DnxhrHq) => "A movie for editing: 4:2:2, 8 bits, 256 × 120 pixels and more",
            Self::Movie(Codec::DnxhrHqx) => "A movie for editing: 4:2:2, 10 bits, 256 × 120 pixels and more",
            Self::Movie(Codec::Dnxhr444) => "A movie for editing: 4:4:4, 10 bits, 256 × 120 pixels and more",
            Self::Movie(Codec::Ffv1) => "A movie for the archive: 16-bit RGB with straight alpha, lossless",
        }
    }

    /// True if one file holds all frames.
    pub fn is_movie(self) -> bool {
        self.codec().is_some()
    }

    /// Codec of a movie; None for stills.
    pub fn codec(self) -> Option<Codec> {
        match self {
            Self::Movie(codec) => Some(codec),
            _ => None,
        }
    }

    /// Extension, as [`Destination::parse`] reads it.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png8 | Self::Png16 => ".%04d.png",
            Self::Tiff => ".%04d.tif",
            Self::Exr => ".%04d.exr",
            Self::Movie(codec) => codec.ending(),
        }
    }

    pub fn bits(self) -> Bits {
        match self {
            Self::Png16 => Bits::Sixteen,
            _ => Bits::Eight,
        }
    }
}

/// Bits per channel of a PNG; other formats fix theirs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Bits {
    #[default]
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

/// Alpha of a movie's colour codes, named in the movie's comment metadata.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum MovieAlpha {
    /// Full colour, not multiplied by alpha.
    #[default]
    Straight,
    /// Codes times alpha: over black.
    Premultiplied,
}

impl MovieAlpha {
    /// Text in the movie's metadata.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Straight => "straight alpha",
            Self::Premultiplied => "premultiplied alpha (black)",
        }
    }

    /// Pixel of the movie from a pixel with straight alpha.
    pub(super) fn of_straight(self, [r, g, b, a]: [f32; 4]) -> [f32; 4] {
        match self {
            Self::Straight => [r, g, b, a],
            // Editors composite codes, so codes are multiplied.
            Self::Premultiplied => [r * a, g * a, b * a, a],
        }
    }
}

/// Treatment of existing files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Existing {
    /// Existing files are replaced.
    #[default]
    Replace,
    /// Existing files are kept; a number is appended to the new name.
    Keep,
}

/// Destination and format of an export.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
pub struct Files {
    /// Files to write: stills as out.%04d.png or out.####.png, .tif or .exr, or a movie as clip.mp4, .mov, .mkv or .mxf.
    #[arg(long, value_parser = Destination::parse)]
    pub to: Destination,
    /// Number of the interview's first frame in the names of stills; also with --frames [default: the plate's own, such as
    /// 1001, or 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = within(FRAME_NUMBERS))]
    pub first_number: Option<i64>,
    /// Movie codec [default: H.264 in .mp4, ProRes 4444 in .mov, FFV1 in .mkv, DNxHR HQ in .mxf].
    #[arg(long, value_enum)]
    pub codec: Option<Codec>,
    /// Alpha of a movie with alpha: ProRes 4444 and FFV1.
    #[arg(long = "movie-alpha", value_enum, default_value_t)]
    pub movie_alpha: MovieAlpha,
    /// Colour space of the files; an EXR is linear in its primaries [default: sRGB; linear Rec. 709 in an EXR].
    #[arg(long = "space", value_enum)]
    pub space: Option<OutputSpace>,
    /// Bake a .cube look-up table (sRGB codes in and out) into PNG, TIFF or a movie.
    #[arg(long, value_name = "FILE")]
    pub lut: Option<PathBuf>,
    #[command(flatten)]
    pub ocio: ColorChoice,
    /// Resume a stopped export: keep finished stills with the same project, network, environment and look, and write the rest.
    #[arg(long)]
    pub resume: bool,
    /// Write no sound, even if the interview's movie has some.
    #[arg(long)]
    pub no_sound: bool,
    #[command(flatten)]
    pub exr: ExrSettings,
    #[arg(skip)]
    pub existing: Existing,
    /// Crop and resolution of the pictures.
    #[arg(long, value_enum, default_value_t)]
    pub at: PictureSize,
    /// Longer side in pixels, 16 to 8192, if the pictures are to be resized.
    #[arg(long, value_name = "PIXELS", allow_negative_numbers = true, value_parser = within(Self::SIZES))]
    pub size: Option<usize>,
    /// Bits of a PNG's channels.
    #[arg(long, value_enum, default_value_t)]
    pub bits: Bits,
    /// Add the subject under each lamp to an EXR, as light_00.R …, with the lamps' weights in the header; or under each
    /// light (--layers-by light).
    #[arg(long)]
    pub layers: bool,
}

impl Files {
    /// Range of sizes, in pixels.
    pub const SIZES: RangeInclusive<usize> = 16..=8192;

    /// Pictures at the plate's size, 8 bits in PNGs.
    ///
    /// # Errors
    /// As [`Destination::parse`].
    pub fn to(to: impl AsRef<str>) -> Result<Self> {
        Ok(Self { to: Destination::parse(to.as_ref())?, ..Self::default() })
    }

    /// Numbers of the interview's frames `first` to `last` in the names of the files.
    pub fn numbers(&self, interview: &Interview, (first, last): (usize, usize)) -> (i64, i64) {
        let start = self.first_number.unwrap_or(interview.first_number);
        (start + first as i64, start + last as i64)
    }
}
