//! Header and pixels of one frame's file.

use super::super::about::PROVENANCE;
use super::super::exr_file::{ExrFile, Part};
use super::super::listing::LayerListing;
use super::super::output_space::interop_id;
use super::super::rebuild::Rebuild;
use super::hash::{FileHash, c4, c4_of_file};
use base::error::{Error, Result};
use base::files::is_bare;
use exr::meta::attribute::{AttributeValue, Text, TimeCode};
use exr::prelude::{FlatImage, FlatSamples};
use imaging::color_space::ColorSpace;
use sha2::{Digest, Sha512};
use std::collections::HashMap;
use std::path::Path;

const REMEDY: &str = "Export the frame again";
/// Number of values hashed at a time.
const CHUNK: usize = 4096;
/// Longest file of a light layer that is hashed, in bytes: more than the largest picture that can be read.
const MOST_BESIDE: u64 = 8 << 30;

/// A frame of a shot.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub number: i64,
    pub file: FileHash,
    /// Content of the file, or the reason why it cannot be read.
    pub picture: std::result::Result<Content, String>,
}

/// Content of a frame's file.
#[derive(Clone, Debug)]
pub(super) struct Content {
    /// C4 ID of all channels.
    pub pixels: String,
    /// All pixels of the picture are equal.
    pub is_flat: bool,
    /// Left, top, width and height.
    pub display_window: [i64; 4],
    /// Left, top, width and height.
    pub data_window: [i64; 4],
    /// Channel names with their part and sample type.
    pub channels: String,
    pub color: Color,
    /// Frames per second as a fraction.
    pub rate: Option<(i32, u32)>,
    pub time_code: Option<TimeCode>,
    /// Provenance text from the header.
    pub provenance: Option<String>,
    /// Values that are NaN or infinite.
    pub not_finite: u64,
    /// None without light layers.
    pub layers: Option<std::result::Result<Rebuild, String>>,
    /// Files that accompany the frame.
    pub beside: Vec<FileHash>,
    /// Memory needed to read the frame, in bytes.
    pub memory: u64,
}

/// Colour tags of a header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Color {
    /// x and y of red, green, blue and white.
    pub chromaticities: Option<[f32; 8]>,
    pub interop_id: Option<String>,
    pub alpha: Option<String>,
}

impl Frame {
    /// Reads a file. Faults of the file are part of the result.
    pub fn read(path: &Path, number: i64, name: &str) -> Self {
        let named = |bytes, c4| FileHash { name: name.to_owned(), bytes, c4 };
        let file = match ExrFile::open(path, REMEDY) {
            Ok(file) => file,
            // A file far longer than any picture is not read to its end for a hash.
            Err(e) => {
                return Self {
                    number,
                    file: named(path.metadata().map_or(0, |data| data.len()), String::new()),
                    picture: Err(e.to_string()),
                };
            }
        };
        let bytes = file.bytes.len() as u64;
        Self {
            number,
            file: named(bytes, c4(Sha512::digest(&file.bytes))),
            picture: Content::new(path, &file).map_err(|e| e.to_string()),
        }
    }
}

impl Content {
    /// Decodes a file and examines all of it.
    ///
    /// # Errors
    /// When the file cannot be decoded.
    pub fn new(path: &Path, file: &ExrFile) -> Result<Self> {
        let image = file.decode(path, REMEDY)?;
        let no_part = || Error::invalid(format!("{} has no part", path.display()), REMEDY);
        let first = image.layer_data.first().ok_or_else(no_part)?;
        let text = |key: &str| {
            // The reader stores unknown attributes with the part.
            let key = Text::from(key);
            let shared = image.attributes.other.get(&key);
            match shared.or_else(|| first.attributes.other.get(&key)) {
                Some(AttributeValue::Text(text)) => Some(text.to_string()),
                _ => None,
            }
        };
        let (layers, beside) = match LayerListing::if_any(path, &file.parts) {
            Ok(None) => (None, Vec::new()),
            Ok(Some(listing)) => {
                let found = Rebuild::of_image(path, &image, &listing).map_err(|e| e.to_string());
                (Some(found), hashes(path, &listing.files_beside(path)))
            }
            Err(e) => (Some(Err(e.to_string())), Vec::new()),
        };
        let window = image.attributes.display_window;
        let at = first.attributes.layer_position;
        let chromaticities: Option<[f32; 8]> = image.attributes.chromaticities.map(|c| {
            [c.red, c.green, c.blue, c.white]
                .map(|point| [point.x(), point.y()])
                .as_flattened()
                .try_into()
                .unwrap_or_default()
        });
        Ok(Self {
            pixels: hash_of(&image),
            is_flat: is_flat(first),
            display_window: [
                i64::from(window.position.x()),
                i64::from(window.position.y()),
                window.size.width() as i64,
                window.size.height() as i64,
            ],
            data_window: [i64::from(at.x()), i64::from(at.y()), first.size.width() as i64, first.size.height() as i64],
            channels: channels(&image),
            color: Color { chromaticities, interop_id: text("colorInteropID"), alpha: text("alpha") },
            rate: first.attributes.frames_per_second,
            time_code: image.attributes.time_code,
            provenance: text(PROVENANCE),
            not_finite: image.layer_data.iter().map(not_finite).sum(),
            layers,
            beside,
            // Sums of light layers and rest, and the picture itself, are kept as f64.
            memory: file.bytes.len() as u64 + 2 * file.unpacked + 72 * first.size.area() as u64,
        })
    }

    /// Provenance entries of the header, by key.
    pub fn made_of(&self) -> HashMap<&str, &str> {
        let words = self.provenance.as_deref().unwrap_or_default();
        let pairs = words.split_whitespace();
        pairs.filter_map(|word| word.split_once('=')).collect()
    }
}

impl Color {
    /// Message if name and chromaticities belong to different spaces.
    pub fn contradiction(&self) -> Option<String> {
        let id = self.interop_id.as_deref()?;
        let found = self.chromaticities?;
        let all = [ColorSpace::Rec709, ColorSpace::P3D65, ColorSpace::Rec2020, ColorSpace::AcesCg];
        let named = all.into_iter().find(|space| interop_id(*space) == id)?;
        let primaries = named.primaries();
        let wanted = [primaries.red, primaries.green, primaries.blue, primaries.white];
        let is_other =
            (found.iter().zip(wanted.as_flattened())).any(|(a, b)| a.is_nan() || (f64::from(*a) - b).abs() > 1e-4);
        is_other.then(|| format!("named {id}, but its chromaticities belong to another space"))
    }

    /// Colour tags as text.
    pub fn words(&self) -> String {
        let or_none = |text: &Option<String>| text.clone().unwrap_or_else(|| "none".to_owned());
        let chromaticities = self.chromaticities.map(|c| {
            let [red, green, blue, white] = [0, 2, 4, 6].map(|i| format!("{}, {}", c[i], c[i + 1]));
            format!("red {red}; green {green}; blue {blue}; white {white}")
        });
        format!(
            "colorInteropID {}, chromaticities {}, alpha {}",
            or_none(&self.interop_id),
            or_none(&chromaticities),
            or_none(&self.alpha)
        )
    }
}

/// Sizes and hashes of the accompanying files. A file that cannot be read has an empty hash.
fn hashes(path: &Path, names: &[String]) -> Vec<FileHash> {
    let of_file = |name: &String| {
        let beside = path.with_file_name(name);
        let found = is_bare(name).then(|| c4_of_file(&beside, MOST_BESIDE));
        let (bytes, c4) = (found.and_then(std::result::Result::ok)).unwrap_or_default();
        FileHash { name: name.clone(), bytes, c4 }
    };
    names.iter().map(of_file).collect()
}

/// C4 ID of all channels: their names and their samples, as stored in memory.
fn hash_of(image: &FlatImage) -> String {
    fn update<T: Copy, const N: usize>(hash: &mut Sha512, values: &[T], bytes: impl Fn(T) -> [u8; N]) {
        for values in values.chunks(CHUNK) {
            let bytes: Vec<u8> = values.iter().flat_map(|v| bytes(*v)).collect();
            hash.update(bytes);
        }
    }
    let mut hash = Sha512::new();
    for part in &image.layer_data {
        for channel in &part.channel_data.list {
            hash.update(channel.name.to_string());
            hash.update([0u8]);
            match &channel.sample_data {
                FlatSamples::F16(values) => update(&mut hash, values, |v| v.to_le_bytes()),
                FlatSamples::F32(values) => update(&mut hash, values, |v| v.to_le_bytes()),
                FlatSamples::U32(values) => update(&mut hash, values, |v| v.to_le_bytes()),
            }
        }
    }
    c4(hash.finalize())
}

fn is_flat(part: &Part) -> bool {
    let color = |name: &str| matches!(name, "R" | "G" | "B" | "A");
    let mut picture = (part.channel_data.list.iter()).filter(|c| color(&c.name.to_string()));
    picture.all(|channel| {
        let mut values = channel.sample_data.values_as_f32();
        let first = values.next();
        values.all(|value| Some(value) == first)
    })
}

fn not_finite(part: &Part) -> u64 {
    let of_channel = |samples: &FlatSamples| match samples {
        FlatSamples::F16(values) => values.iter().filter(|v| !v.is_finite()).count(),
        FlatSamples::F32(values) => values.iter().filter(|v| !v.is_finite()).count(),
        FlatSamples::U32(_) => 0,
    };
    let counts = part.channel_data.list.iter();
    counts.map(|c| of_channel(&c.sample_data) as u64).sum()
}

/// All channels with their part and sample type.
fn channels(image: &FlatImage) -> String {
    let mut words = Vec::new();
    for part in &image.layer_data {
        let name = part.attributes.layer_name.as_ref();
        words.extend(name.map(|name| format!("[{name}]")));
        for channel in &part.channel_data.list {
            let kind = match channel.sample_data {
                FlatSamples::F16(_) => "half",
                FlatSamples::F32(_) => "float",
                FlatSamples::U32(_) => "uint",
            };
            words.push(format!("{} {kind}", channel.name));
        }
    }
    words.join(", ")
}
