//! What a person chooses between when something is to be written.

use base::numbers::within;
use footage::PictureSize;
use std::ops::RangeInclusive;

/// Kinds of files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Format {
    #[default]
    Png8,
    Png16,
    Exr,
    H264,
    ProRes,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Png8, Self::Png16, Self::Exr, Self::H264, Self::ProRes];

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png8 => "PNG",
            Self::Png16 => "PNG 16",
            Self::Exr => "EXR",
            Self::H264 => "H.264",
            Self::ProRes => "ProRes",
        }
    }

    /// What it is for.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Png8 => "Stills for a display: 8 bits, straight alpha",
            Self::Png16 => "Stills for a display: 16 bits, straight alpha",
            Self::Exr => {
                "Stills in linear light: half floats, ZIP, premultiplied alpha; time code, frame rate and \
                 colour space in the header"
            }
            Self::H264 => "A movie for review: 8 bits, Rec. 709",
            Self::ProRes => "A movie for editing: ProRes 4444 with straight alpha, Rec. 709",
        }
    }

    /// Whether all frames go into one file.
    pub fn is_movie(self) -> bool {
        matches!(self, Self::H264 | Self::ProRes)
    }

    /// What stands behind the name, as [`super::Destination::parse`] understands it.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png8 | Self::Png16 => ".%04d.png",
            Self::Exr => ".%04d.exr",
            Self::H264 => ".mp4",
            Self::ProRes => ".mov",
        }
    }

    pub fn bits(self) -> Bits {
        match self {
            Self::Png16 => Bits::Sixteen,
            _ => Bits::Eight,
        }
    }
}

/// Bits of a PNG's channels; other files have their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Bits {
    #[default]
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

/// What happens to existing files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Existing {
    /// They are replaced.
    #[default]
    Replace,
    /// They are kept, and a number is appended to the name.
    Keep,
}

/// Where pictures are written, and how.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct Files {
    /// What to write: out.%04d.png, out.%04d.exr, clip.mp4, or clip.mov with alpha.
    #[arg(long)]
    pub to: String,
    #[arg(skip)]
    pub existing: Existing,
    /// What the pictures show, and at which resolution.
    #[arg(long, value_enum, default_value_t)]
    pub at: PictureSize,
    /// Pixels of the longer side, 16 to 8192, if the pictures are to be resized.
    #[arg(long, value_name = "PIXELS", allow_negative_numbers = true, value_parser = within(Self::SIZES))]
    pub size: Option<usize>,
    /// Bits of a PNG's channels.
    #[arg(long, value_enum, default_value_t)]
    pub bits: Bits,
    /// Add the subject under each lamp to an EXR, as light_00.R …, with the lamps' weights in the header.
    #[arg(long)]
    pub layers: bool,
}

impl Files {
    /// Sizes that can be asked for, in pixels.
    pub const SIZES: RangeInclusive<usize> = 16..=8192;

    /// Pictures of the plate's size, 8 bits where they are PNGs.
    pub fn to(to: impl Into<String>) -> Self {
        Self {
            to: to.into(),
            ..Self::default()
        }
    }
}
