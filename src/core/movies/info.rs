//! Content of a movie's header, and its meaning for the frames.

use super::process::{self, Tools};
use super::raw::{raw, raw_tag};
use base::error::{Error, Result};
use imaging::file::MAX_PIXELS;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;

/// Content of a movie's header.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// Columns and rows as shown: rotated, with square pixels.
    pub size: (usize, usize),
    /// Average frame rate in frames per second.
    pub frame_rate: f64,
    /// True if frames have an alpha channel.
    pub has_alpha: bool,
    /// True if the movie has sound.
    pub has_sound: bool,
    /// Time code of the first frame, such as `01:00:00:00`; with `;` before the frame number for drop-frame.
    pub time_code: Option<String>,
    /// Reel name, if the file has one.
    pub reel: Option<String>,
    /// The codec's name.
    pub codec: String,
    /// Notes for the user on the frames and their decoding, in sentences.
    pub notes: Vec<String>,
    pub(crate) stream: usize,
    /// Seconds per unit of the time stamps: numerator and denominator.
    pub(crate) time_base: (i64, i64),
    /// True if every frame is a key frame.
    pub(crate) is_intra: bool,
    /// Time stamps of all frames, if the header promises a constant step.
    pub(crate) even: Option<EvenTimes>,
    /// Decoder in place of ffmpeg's own, which drops the alpha.
    pub(crate) decoder: Option<&'static str>,
    /// Pixel format of decoded frames, in ffmpeg's spelling.
    pub(crate) format: String,
    pub(crate) matrix: &'static str,
    pub(crate) is_full_range: bool,
    /// True for RGB and grey, which need no matrix.
    pub(crate) is_rgb: bool,
}

#[derive(Deserialize)]
struct Listing {
    #[serde(default)]
    streams: Vec<Stream>,
    #[serde(default)]
    format: Format,
}

#[derive(Default, Deserialize)]
struct Format {
    #[serde(default)]
    tags: HashMap<String, String>,
}

#[derive(Deserialize)]
struct Stream {
    index: usize,
    codec_type: Option<String>,
    codec_name: Option<String>,
    codec_tag_string: Option<String>,
    width: Option<usize>,
    height: Option<usize>,
    sample_aspect_ratio: Option<String>,
    pix_fmt: Option<String>,
    field_order: Option<String>,
    color_range: Option<String>,
    color_space: Option<String>,
    color_transfer: Option<String>,
    color_primaries: Option<String>,
    r_frame_rate: Option<String>,
    avg_frame_rate: Option<String>,
    time_base: Option<String>,
    start_pts: Option<i64>,
    duration_ts: Option<i64>,
    nb_frames: Option<String>,
    #[serde(default)]
    disposition: HashMap<String, i64>,
    #[serde(default)]
    tags: HashMap<String, String>,
    #[serde(default)]
    side_data_list: Vec<SideData>,
}

#[derive(Deserialize)]
struct SideData {
    rotation: Option<f64>,
}

/// Codecs with key frames only, so that each frame can be decoded alone.
const INTRA: [&str; 20] = [
    "prores", "dnxhd", "mjpeg", "jpeg2000", "ffvhuff", "huffyuv", "utvideo", "rawvideo", "v210", "v308", "v408",
    "v410", "r210", "r10k", "cfhd", "png", "tiff", "dpx", "exr", "qtrle",
];
/// Number of rows from which an untagged movie counts as HD.
const HD_ROWS: usize = 720;

impl Info {
    /// Reads a movie's header.
    ///
    /// # Errors
    /// When the file is not a movie that ffmpeg reads, has no pictures, or claims an impossible size.
    pub(crate) fn read(path: &Path, tools: &Tools) -> Result<Self> {
        const REMEDY: &str =
            "Check that the file is whole, or convert it: ffmpeg -i FILE -c:v prores_ks -profile:v 4 NEW.mov";
        let words = ["-v", "error", "-of", "json", "-show_streams", "-show_format"];
        let mut arguments: Vec<_> = words.map(Into::into).to_vec();
        arguments.extend(process::input(path));
        let said = process::run(&tools.ffprobe, arguments, tools.patience)?;
        let refuse = |cause: &str| Error::codec("read", path, cause, REMEDY);
        let bytes = said.map_err(|words| refuse(if words.is_empty() { "ffprobe cannot read it" } else { &words }))?;
        let listing: Listing = serde_json::from_slice(&bytes).map_err(|e| refuse(&e.to_string()))?;
        let is_video = |s: &&Stream| {
            let is_cover = s.disposition.get("attached_pic") == Some(&1);
            s.codec_type.as_deref() == Some("video") && !is_cover
        };
        let video = listing.streams.iter().find(is_video);
        let video = video.ok_or_else(|| refuse("it holds no pictures"))?;
        let is_known = video.codec_name.as_deref().is_some_and(|name| name != "unknown");
        let tag = video.codec_tag_string.as_deref().filter(|_| !is_known);
        if let Some(program) = tag.and_then(raw_tag) {
            return Err(raw(path, program));
        }
        let tagged = video.color_space.as_deref();
        let tagged = tagged.filter(|_| !video.pix_fmt.as_deref().is_some_and(is_rgb));
        let Some(matrix) = matrix(tagged, video.height.unwrap_or(0)) else {
            return Err(Error::invalid(
                format!(
                    "the colours of {} are tagged {}, which cannot be converted to RGB here",
                    path.display(),
                    tagged.map_or("unknown", matrix_name)
                ),
                "Convert it: ffmpeg -i FILE -vf zscale=matrix=709 -pix_fmt yuv444p10le -c:v prores_ks -profile:v 4 NEW.mov",
            ));
        };
        let mut info = Self::new(video, &listing, matrix).map_err(|cause| refuse(&cause))?;
        if let Some(decoder) = alpha_decoder(video) {
            if info.format != "yuv420p" {
                info.notes.push(format!(
                    "It has alpha, which ffmpeg reads beside 8 bits in 4:2:0 alone, not beside {}: it is read without alpha. \
                     Make it again as ProRes 4444",
                    info.format
                ));
            } else if knows_decoder(decoder, tools)? {
                (info.decoder, info.has_alpha) = (Some(decoder), true);
                "yuva420p".clone_into(&mut info.format);
            } else {
                info.notes.push(format!(
                    "It has alpha, which this ffmpeg cannot read: install one with the decoder {decoder}"
                ));
            }
        }
        Ok(info)
    }

    fn new(
        video: &Stream,
        listing: &Listing,
        (matrix, matrix_note): (&'static str, String),
    ) -> std::result::Result<Self, String> {
        let (width, height) = (video.width.unwrap_or(0), video.height.unwrap_or(0));
        let format = video.pix_fmt.clone().unwrap_or_default();
        if width == 0 || height == 0 || format.is_empty() {
            let codec = video.codec_name.as_deref().unwrap_or("unknown");
            return Err(format!("ffmpeg cannot decode its pictures (codec {codec})"));
        }
        let aspect = video.sample_aspect_ratio.as_deref().and_then(|s| ratio(s, ':'));
        let aspect = aspect.map_or(1.0, |(a, b)| a as f64 / b as f64);
        let square = (width as f64 * aspect).round().max(1.0);
        if !(0.01..=100.0).contains(&aspect) || square * height as f64 > MAX_PIXELS as f64 {
            return Err(format!(
                "it claims frames of {width} × {height} pixels of aspect {aspect}; the limit is {MAX_PIXELS} pixels"
            ));
        }
        let turns = video.side_data_list.iter().find_map(|side| side.rotation);
        let tagged = video.tags.get("rotate").and_then(|said| said.parse().ok());
        let turns = turns.or(tagged).unwrap_or(0.0);
        let is_upright = ((turns / 90.0).round() as i64).rem_euclid(2) == 1;
        let square = (square as usize, height);
        let size = if is_upright { (square.1, square.0) } else { square };
        let [rate, average] =
            [&video.r_frame_rate, &video.avg_frame_rate].map(|said| said.as_deref().and_then(|said| ratio(said, '/')));
        let seconds = average.or(rate).unwrap_or((24, 1));
        let time_base = video.time_base.as_deref().and_then(|said| ratio(said, '/'));
        let time_base = time_base.ok_or("its time stamps have no unit")?;
        let codec = video.codec_name.clone().unwrap_or_default();
        let is_intra = INTRA.contains(&&*codec);
        let even = (rate == average).then(|| even(video, rate?, time_base)).flatten();
        let is_full = video.color_range.as_deref() == Some("pc") || format.starts_with("yuvj");
        let mut info = Self {
            size,
            frame_rate: seconds.0 as f64 / seconds.1 as f64,
            has_alpha: has_alpha(&format),
            has_sound: (listing.streams.iter()).any(|s| s.codec_type.as_deref() == Some("audio")),
            time_code: tag(listing, video, "timecode"),
            reel: tag(listing, video, "reel_name"),
            codec,
            notes: vec![],
            stream: video.index,
            time_base,
            is_intra,
            even: even.filter(|_| is_intra),
            decoder: None,
            format: format.clone(),
            matrix,
            is_full_range: is_full,
            is_rgb: is_rgb(&format),
        };
        if !(0.001..=100_000.0).contains(&info.frame_rate) {
            return Err(format!("it claims {} frames per second", info.frame_rate));
        }
        info.note(video, &format, (width, height), matrix_note);
        Ok(info)
    }

    /// Adds notes on the decoding of its frames.
    fn note(&mut self, video: &Stream, format: &str, coded: (usize, usize), matrix_note: String) {
        let notes = &mut self.notes;
        if self.is_rgb {
            notes.push(format!("Pictures are stored as RGB or grey ({format})"));
        } else {
            let range = match (&video.color_range, self.is_full_range) {
                (None, false) => "limited range (not tagged)",
                (_, true) => "full range",
                (_, false) => "limited range",
            };
            notes.push(format!("Colours are decoded from {format} with {matrix_note}, {range}"));
        }
        let known = |tag: &Option<String>| tag.clone().filter(|tag| tag != "unknown" && tag != "unspecified");
        let said = |what: &str, tag: &Option<String>| {
            known(tag).map_or(format!("no {what} are tagged"), |tag| format!("{what} are tagged {tag}"))
        };
        notes.push(format!(
            "Its {}, and its {}; calibration fits the response and ignores these tags",
            said("primaries", &video.color_primaries),
            said("transfer curves", &video.color_transfer)
        ));
        if let Some((wide, high)) = Some(self.size).filter(|&size| size != coded) {
            notes.push(format!(
                "Frames of {} × {} pixels are rotated or widened to {wide} × {high} square pixels, as tagged in the file",
                coded.0, coded.1
            ));
        }
        if let Some(order @ ("tt" | "bb" | "tb" | "bt")) = video.field_order.as_deref() {
            notes.push(format!(
                "It is interlaced ({order}): both fields stay in one picture. Deinterlace it before import"
            ));
        }
    }
}

/// Time stamps of `count` frames with a constant step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EvenTimes {
    pub start: i64,
    pub step: i64,
    pub count: u64,
}

/// Time stamps of a movie whose header counts its frames and promises a constant step.
fn even(video: &Stream, rate: (i64, i64), base: (i64, i64)) -> Option<EvenTimes> {
    let count: u64 = video.nb_frames.as_deref()?.parse().ok()?;
    let ticks = i128::from(rate.1) * i128::from(base.1);
    let per = i128::from(rate.0) * i128::from(base.0);
    let step = i64::try_from(ticks / per).ok().filter(|_| ticks % per == 0)?;
    let length = i64::try_from(count).ok()?.checked_mul(step)?;
    let fits = count > 0 && count < 1 << 32 && step > 0 && video.duration_ts == Some(length);
    let start = video.start_pts.filter(|start| start.checked_add(length).is_some())?;
    fits.then_some(EvenTimes { start, step, count })
}

/// A tag of the movie, its video or any of its streams: the time code has a stream of its own.
fn tag(listing: &Listing, video: &Stream, name: &str) -> Option<String> {
    let streams = listing.streams.iter().map(|stream| &stream.tags);
    let mut all = std::iter::once(&video.tags).chain([&listing.format.tags]).chain(streams);
    all.find_map(|tags| tags.get(name)).cloned()
}

/// Parses two positive numbers.
fn ratio(said: &str, between: char) -> Option<(i64, i64)> {
    let (a, b) = said.split_once(between)?;
    let both: (i64, i64) = (a.parse().ok()?, b.parse().ok()?);
    let is_sane = |n: i64| (1..=1 << 40).contains(&n);
    (is_sane(both.0) && is_sane(both.1)).then_some(both)
}

/// Name of the matrix for ffmpeg's `scale`, and in words; None for a matrix that it lacks.
fn matrix(tagged: Option<&str>, rows: usize) -> Option<(&'static str, String)> {
    let (name, words) = match tagged {
        Some("bt709") => ("bt709", "the matrix of Rec. 709"),
        Some("bt470bg" | "smpte170m") => ("bt601", "the matrix of Rec. 601"),
        Some("bt2020nc") => ("bt2020", "the matrix of Rec. 2020"),
        Some("smpte240m") => ("smpte240m", "the matrix of SMPTE 240M"),
        Some("fcc") => ("fcc", "the matrix of FCC"),
        Some(tag) if !["unknown", "unspecified", "reserved"].contains(&tag) => return None,
        _ if rows >= HD_ROWS => ("bt709", "the matrix of Rec. 709 (HD, not tagged)"),
        _ => ("bt601", "the matrix of Rec. 601 (fewer than 720 rows, not tagged)"),
    };
    Some((name, words.to_owned()))
}

/// Common name of a matrix, from ffmpeg's.
fn matrix_name(tag: &str) -> &str {
    match tag {
        "ictcp" => "ICtCp",
        "ycgco" | "ycgco-re" | "ycgco-ro" => "YCgCo",
        "bt2020c" => "Rec. 2020 with constant luminance",
        tag => tag,
    }
}

/// The decoder that joins colour and alpha of VP8 and VP9, which WebM keeps as two streams in one; None for other
/// movies. It joins them in 8 bits and 4:2:0 alone.
fn alpha_decoder(video: &Stream) -> Option<&'static str> {
    let is_mode = |(name, value): (&String, &String)| name.eq_ignore_ascii_case("alpha_mode") && value == "1";
    let is_split = video.tags.iter().any(is_mode);
    match video.codec_name.as_deref() {
        Some("vp8") if is_split => Some("libvpx"),
        Some("vp9") if is_split => Some("libvpx-vp9"),
        _ => None,
    }
}

/// True if this ffmpeg has the decoder.
fn knows_decoder(decoder: &str, tools: &Tools) -> Result<bool> {
    let words = ["-hide_banner", "-h", &format!("decoder={decoder}")].map(Into::into);
    let said = process::run(&tools.ffmpeg, words.to_vec(), tools.patience)?.unwrap_or_default();
    Ok(said.starts_with(b"Decoder"))
}

fn is_rgb(format: &str) -> bool {
    is_grey(format)
        || ["rgb", "bgr", "gbr", "argb", "abgr", "x2rgb", "x2bgr", "0rgb", "0bgr", "pal8", "mono"]
            .iter()
            .any(|start| format.starts_with(start))
}

/// True for grey, with or without alpha.
pub(crate) fn is_grey(format: &str) -> bool {
    format.starts_with("gray") || format.starts_with("ya")
}

/// Bits of each channel of a pixel format: the number before its byte order, which deep formats have. Packed
/// formats count all channels.
pub(crate) fn bits(format: &str) -> u32 {
    let Some(name) = format.strip_suffix("le").or(format.strip_suffix("be")) else { return 8 };
    let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    match name[digits..].parse::<u32>().unwrap_or(8) % 100 {
        bits @ (9 | 10 | 12 | 14 | 16) => bits,
        30 => 10,
        36 => 12,
        48 | 64 => 16,
        _ => 8,
    }
}

fn has_alpha(format: &str) -> bool {
    ["yuva", "rgba", "bgra", "argb", "abgr", "gbrap", "ya8", "ya16", "ayuv", "vuya"]
        .iter()
        .any(|start| format.starts_with(start))
}
