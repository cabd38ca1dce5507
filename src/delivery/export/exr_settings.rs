//! Settings of exported EXR files.

use exr::compression::Compression;
use serde::{Deserialize, Serialize};

/// Settings of an EXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::Args)]
pub struct ExrSettings {
    /// Sample type of an EXR.
    #[arg(id = "exr_samples", long = "exr-samples", value_enum, default_value_t)]
    pub samples: Samples,
    /// Compression of an EXR.
    #[arg(id = "exr_compression", long = "exr-compression", value_enum, default_value_t)]
    pub compression: ExrCompression,
    /// Alpha of an EXR.
    #[arg(id = "exr_alpha", long = "exr-alpha", value_enum, default_value_t)]
    pub alpha: ExrAlpha,
    /// Crop the data window of an EXR to its non-empty pixels.
    #[arg(id = "exr_crop", long = "exr-crop")]
    pub crop: bool,
    /// One light layer for each lamp, or for each light of the look.
    #[arg(id = "layers_by", long = "layers-by", value_enum, default_value_t)]
    #[serde(default)]
    pub layers_by: LayersBy,
    /// Storage of an EXR's light layers.
    #[arg(id = "layer_files", long = "layer-files", value_enum, default_value_t)]
    pub layers: LayerFiles,
    /// Write a JSON file with the light layers' weights beside each EXR; always written if layers are separate files.
    #[arg(id = "layer_weights", long = "layer-weights")]
    pub weights: bool,
}

/// Sample types.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Samples {
    /// 16 bits, to ±65504 with 11 significant bits.
    #[default]
    Half,
    /// 32 bits.
    Float,
}

/// Compressions of OpenEXR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ExrCompression {
    None,
    /// Run-length encoding.
    Rle,
    /// ZIP of single lines, fastest to read in compositing programs.
    Zips,
    /// ZIP of 16 lines.
    #[default]
    Zip,
    /// Wavelets, smallest for grain.
    Piz,
    /// Lossy ZIP: floats are rounded to 24 bits.
    Pxr24,
}

/// Alpha of an EXR's colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ExrAlpha {
    /// Colour times alpha, OpenEXR's convention.
    #[default]
    Premultiplied,
    /// Colour divided by alpha; black where alpha is 0.
    Straight,
}

/// Light of one layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LayersBy {
    /// One lamp at weight 1: light_00 ….
    #[default]
    Lamp,
    /// The environment, a group of placed lights, or a placed light without a group: light_00_environment, light_01_Key ….
    Light,
}

/// Storage of light layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LayerFiles {
    /// Channels in the picture's part: light_00.R ….
    #[default]
    Channels,
    /// Parts of the picture's file.
    Parts,
    /// One file per layer beside the picture's: out.light_00.0001.exr.
    Files,
}

impl ExrCompression {
    pub const ALL: [Self; 6] = [Self::Zip, Self::Zips, Self::Piz, Self::Pxr24, Self::Rle, Self::None];

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Rle => "RLE",
            Self::Zips => "ZIPS",
            Self::Zip => "ZIP",
            Self::Piz => "PIZ",
            Self::Pxr24 => "PXR24",
        }
    }

    /// Compression in the `exr` crate.
    pub(super) fn method(self) -> Compression {
        match self {
            Self::None => Compression::Uncompressed,
            Self::Rle => Compression::RLE,
            Self::Zips => Compression::ZIP1,
            Self::Zip => Compression::ZIP16,
            Self::Piz => Compression::PIZ,
            Self::Pxr24 => Compression::PXR24,
        }
    }
}

impl ExrAlpha {
    /// Name in the header.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Premultiplied => "premultiplied",
            Self::Straight => "straight",
        }
    }
}
