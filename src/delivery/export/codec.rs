//! Codecs and containers of movies.

use super::output_space::OutputSpace;
use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Movie codecs of ffmpeg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
pub enum Codec {
    /// H.264, 8 bits, for review [.mp4, .mov, .mkv].
    #[value(name = "h264")]
    #[serde(rename = "h264")]
    H264,
    /// H.265, 10 bits, for review [.mp4, .mov, .mkv].
    #[value(name = "h265")]
    #[serde(rename = "h265")]
    H265,
    /// ProRes 4444 with alpha, straight by default [.mov].
    #[value(name = "prores-4444")]
    #[serde(rename = "prores-4444")]
    ProRes4444,
    /// ProRes 422 HQ [.mov].
    #[value(name = "prores-422-hq")]
    #[serde(rename = "prores-422-hq")]
    ProRes422Hq,
    /// DNxHR HQ, 4:2:2, 8 bits [.mov, .mxf].
    #[value(name = "dnxhr-hq")]
    #[serde(rename = "dnxhr-hq")]
    DnxhrHq,
    /// DNxHR HQX, 4:2:2, 10 bits [.mov, .mxf].
    #[value(name = "dnxhr-hqx")]
    #[serde(rename = "dnxhr-hqx")]
    DnxhrHqx,
    /// DNxHR 444, 10 bits [.mov, .mxf].
    #[value(name = "dnxhr-444")]
    #[serde(rename = "dnxhr-444")]
    Dnxhr444,
    /// FFV1, 16-bit RGB with alpha, straight by default, lossless [.mkv].
    #[value(name = "ffv1")]
    #[serde(rename = "ffv1")]
    Ffv1,
}

/// Container of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    Mp4,
    Mov,
    Mkv,
    Mxf,
}

/// Names from H.273, in ffmpeg's spelling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tags {
    pub primaries: &'static str,
    pub transfer: &'static str,
    pub matrix: &'static str,
    pub range: &'static str,
}

impl Container {
    /// Container of a file extension.
    pub fn from_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_ascii_lowercase();
        Some(match extension.to_str()? {
            "mp4" => Self::Mp4,
            "mov" => Self::Mov,
            "mkv" => Self::Mkv,
            "mxf" => Self::Mxf,
            _ => return None,
        })
    }

    /// ffmpeg's name.
    pub fn muxer(self) -> &'static str {
        match self {
            Self::Mp4 => "mp4",
            Self::Mov => "mov",
            Self::Mkv => "matroska",
            Self::Mxf => "mxf",
        }
    }

    /// Ending of a file's name.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Mp4 => ".mp4",
            Self::Mov => ".mov",
            Self::Mkv => ".mkv",
            Self::Mxf => ".mxf",
        }
    }

    /// Default codec.
    pub fn codec(self) -> Codec {
        match self {
            Self::Mp4 => Codec::H264,
            Self::Mov => Codec::ProRes4444,
            Self::Mkv => Codec::Ffv1,
            Self::Mxf => Codec::DnxhrHq,
        }
    }
}

impl Codec {
    /// Codec of the movie `path`: the requested codec, or the container's default.
    ///
    /// # Errors
    /// When the container cannot hold the codec.
    pub fn for_path(asked: Option<Self>, path: &Path) -> Result<Self> {
        let container = Container::from_path(path).unwrap_or(Container::Mp4);
        let codec = asked.unwrap_or(container.codec());
        if codec.endings().contains(&container) {
            return Ok(codec);
        }
        let fits: Vec<_> = codec.endings().iter().map(|c| c.ending()).collect();
        Err(Error::invalid(
            format!("{} cannot be written to {}", codec.name(), path.display()),
            format!("Give the movie a name that ends in {}", fits.join(" or ")),
        ))
    }

    /// Common name.
    pub fn name(self) -> &'static str {
        match self {
            Self::H264 => "H.264",
            Self::H265 => "H.265",
            Self::ProRes4444 => "ProRes 4444",
            Self::ProRes422Hq => "ProRes 422 HQ",
            Self::DnxhrHq => "DNxHR HQ",
            Self::DnxhrHqx => "DNxHR HQX",
            Self::Dnxhr444 => "DNxHR 444",
            Self::Ffv1 => "FFV1",
        }
    }

    /// Containers that hold this codec; the studio uses the first.
    pub fn endings(self) -> &'static [Container] {
        use Container::{Mkv, Mov, Mp4, Mxf};
        match self {
            Self::H264 | Self::H265 => &[Mp4, Mov, Mkv],
            Self::ProRes4444 | Self::ProRes422Hq => &[Mov],
            Self::DnxhrHq | Self::DnxhrHqx | Self::Dnxhr444 => &[Mov, Mxf],
            Self::Ffv1 => &[Mkv],
        }
    }

    /// Extension that the studio appends to a name.
    pub fn ending(self) -> &'static str {
        self.endings()[0].ending()
    }

    /// True if the codec keeps alpha.
    pub fn has_alpha(self) -> bool {
        matches!(self, Self::ProRes4444 | Self::Ffv1)
    }

    /// True if the codec has more than 8 bits.
    pub fn is_deep(self) -> bool {
        !matches!(self, Self::H264 | Self::DnxhrHq)
    }

    /// True if its pixels are RGB, which allows any size and needs no matrix.
    pub fn is_rgb(self) -> bool {
        self == Self::Ffv1
    }

    /// Size that is written: chroma subsampling and editors need even sizes.
    pub fn padded(self, (width, height): (usize, usize)) -> (usize, usize) {
        if self.is_rgb() { (width, height) } else { (width.next_multiple_of(2), height.next_multiple_of(2)) }
    }

    /// Reason why the codec cannot encode `width × height` pixels at `rate` frames per second; None if it can.
    pub fn obstacle(
        self,
        (width, height): (usize, usize),
        container: Container,
        (frames, seconds): (i32, u32),
    ) -> Option<String> {
        const MXF: [(i32, u32); 10] = [
            (24000, 1001),
            (24, 1),
            (25, 1),
            (30000, 1001),
            (30, 1),
            (48, 1),
            (50, 1),
            (60000, 1001),
            (60, 1),
            (100, 1),
        ];
        let is_dnxhr = matches!(self, Self::DnxhrHq | Self::DnxhrHqx | Self::Dnxhr444);
        if is_dnxhr && (width < 256 || height < 120) {
            let name = self.name();
            return Some(format!("{name} needs at least 256 × 120 pixels; the picture has {width} × {height}"));
        }
        if matches!(self, Self::H264 | Self::H265) && (width < 16 || height < 16) {
            let name = self.name();
            return Some(format!("{name} needs at least 16 × 16 pixels; the picture has {width} × {height}"));
        }
        if container == Container::Mxf && !MXF.contains(&(frames, seconds)) {
            return Some(format!(
                "an MXF needs a frame rate of film or television, not {:.3}",
                f64::from(frames) / f64::from(seconds)
            ));
        }
        None
    }

    /// True if ffmpeg is fed luma and chroma in planes: from deep RGB it would make 943 of white, not 940.
    pub fn is_planar(self) -> bool {
        self.is_deep() && !self.is_rgb()
    }

    /// ffmpeg's name of the raw input format.
    pub fn input(self) -> &'static str {
        match (self.is_planar(), self.has_alpha()) {
            (true, true) => "yuva444p10le",
            (true, false) => "yuv444p10le",
            (false, true) => "rgba64le",
            (false, false) => "rgb24",
        }
    }

    /// ffmpeg's arguments for the encoder.
    pub fn encoder(self) -> &'static str {
        match self {
            Self::H264 => "-c:v libx264 -preset medium -crf 16 -pix_fmt yuv420p",
            Self::H265 => {
                "-c:v libx265 -preset medium -crf 16 -pix_fmt yuv420p10le -tag:v hvc1 -x265-params log-level=error"
            }
            Self::ProRes4444 => "-c:v prores_ks -profile:v 4444 -pix_fmt yuva444p10le -alpha_bits 16",
            Self::ProRes422Hq => "-c:v prores_ks -profile:v hq -pix_fmt yuv422p10le -vendor apl0",
            Self::DnxhrHq => "-c:v dnxhd -profile:v dnxhr_hq -pix_fmt yuv422p",
            Self::DnxhrHqx => "-c:v dnxhd -profile:v dnxhr_hqx -pix_fmt yuv422p10le",
            Self::Dnxhr444 => "-c:v dnxhd -profile:v dnxhr_444 -pix_fmt yuv444p10le",
            Self::Ffv1 => "-c:v ffv1 -level 3 -g 1 -slices 4 -slicecrc 1 -pix_fmt gbrap16le",
        }
    }

    /// Colour tags of the movie.
    ///
    /// sRGB codes without further information are tagged Rec. 709 throughout: most players then show the display codes
    /// unchanged. ProRes and DNxHR have no tag for the sRGB curve and none of their own for the Rec. 2020 curve, which
    /// equals that of Rec. 709; QuickTime's `colr` knows neither.
    pub fn tags(self, space: Option<OutputSpace>) -> Tags {
        let is_plain = !matches!(self, Self::H264 | Self::H265 | Self::Ffv1);
        let (primaries, transfer, matrix) = match space {
            None | Some(OutputSpace::Rec709 | OutputSpace::Acescg) => ("bt709", "bt709", "bt709"),
            Some(OutputSpace::Srgb) => ("bt709", "iec61966-2-1", "bt709"),
            Some(OutputSpace::P3) => ("smpte432", "iec61966-2-1", "bt709"),
            Some(OutputSpace::Rec2020) => ("bt2020", "bt2020-10", "bt2020nc"),
        };
        let transfer = match space {
            None if self.is_rgb() => "iec61966-2-1",
            _ if is_plain => "bt709",
            _ => transfer,
        };
        let (matrix, range) = if self.is_rgb() { ("gbr", "pc") } else { (matrix, "tv") };
        Tags { primaries, transfer, matrix, range }
    }

    /// ffmpeg filter that converts the input to the codec's colours and tags them.
    ///
    /// By default ffmpeg uses the matrix of standard definition, and it leaves ProRes without tags unless the frames
    /// carry them.
    pub fn filter(self, space: Option<OutputSpace>) -> String {
        let Tags { primaries, transfer, matrix, range } = self.tags(space);
        let named = if matrix == "bt2020nc" { "bt2020" } else { matrix };
        let input = if self.is_planar() { format!("in_color_matrix={named}:in_range=tv:") } else { String::new() };
        let scale = if self.is_rgb() {
            String::new()
        } else {
            format!(
                "scale={input}out_color_matrix={named}:out_range=tv:\
                 flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp,"
            )
        };
        format!("{scale}setparams=range={range}:color_primaries={primaries}:color_trc={transfer}:colorspace={matrix}")
    }
}

#[cfg(test)]
#[path = "codec_tests.rs"]
mod tests;
