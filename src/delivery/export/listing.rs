//! Light layers of an EXR and their weights, from its header.

use super::exr_settings::{ExrAlpha, LayerFiles};
use super::layers::{ListedLayer, REST, WEIGHTS, file_name, weights_file};
use base::error::{Error, Result};
use base::files::{open, read_text};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::Header;
use serde::Deserialize;
use std::io::BufReader;
use std::path::Path;

const REMEDY: &str = "Export it again with light layers";
/// Longest JSON of weights that is read, in bytes.
const MOST_WEIGHTS: u64 = 16 << 20;

/// Light layers of one frame, without their pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerListing {
    /// In the order of the rig's lamps.
    pub lamps: Vec<ListedLayer>,
    /// Rest of the picture, beyond the lamps; None without a rest.
    pub rest: Option<RestLayer>,
    /// Storage of the layers.
    pub place: LayerFiles,
    pub alpha: ExrAlpha,
    /// Columns and rows of the display window.
    pub size: (usize, usize),
}

/// Layer of the rest, beyond the lamps.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct RestLayer {
    /// File of the layer, if it is not in the picture's file.
    pub file: Option<String>,
}

/// JSON file beside a picture, as far as it is read.
#[derive(Deserialize)]
struct Beside {
    layers: Vec<ListedLayer>,
    rest: Option<RestLayer>,
}

impl LayerListing {
    /// Light layers of the EXR `path`. If the layers are separate files, the JSON file beside it names them.
    ///
    /// # Errors
    /// When a file cannot be read, or the EXR has no light layers.
    pub fn from_path(path: &Path) -> Result<Self> {
        let file = open(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
        let parts = MetaData::read_from_buffered(BufReader::new(file), false)
            .map_err(|e| Error::codec("read", path, e, REMEDY))?
            .headers;
        Self::of_parts(path, &parts)
    }

    /// Light layers of the EXR `path` with these headers.
    ///
    /// # Errors
    /// When the EXR has no light layers, or a JSON file is needed and cannot be read.
    pub(super) fn of_parts(path: &Path, parts: &[Header]) -> Result<Self> {
        Self::if_any(path, parts)?.ok_or_else(|| {
            let problem = "has no light-layer weights in its header";
            Error::missing(format!("{} {problem}", path.display()), REMEDY)
        })
    }

    /// Light layers of the EXR `path` with these headers. None if the headers name none.
    ///
    /// # Errors
    /// When the headers name layers, and a JSON file is needed and cannot be read.
    pub(super) fn if_any(path: &Path, parts: &[Header]) -> Result<Option<Self>> {
        let Some((first, written)) = (parts.first()).and_then(|first| Some((first, text(first, WEIGHTS)?))) else {
            return Ok(None);
        };
        let lamps: Vec<ListedLayer> =
            serde_json::from_str(&written).map_err(|e| Error::codec("read", path, e, REMEDY))?;
        let window = first.shared_attributes.display_window.size;
        let mut listing = Self {
            lamps,
            rest: None,
            place: LayerFiles::Channels,
            alpha: match text(first, "alpha").as_deref() {
                Some("straight") => ExrAlpha::Straight,
                _ => ExrAlpha::Premultiplied,
            },
            size: (window.width(), window.height()),
        };
        if listing.lamps.is_empty() {
            let json = weights_file(path);
            let text = read_text(&json, MOST_WEIGHTS).map_err(|e| Error::io("read", &json, e, REMEDY))?;
            let beside: Beside = serde_json::from_str(&text).map_err(|e| Error::codec("read", &json, e, REMEDY))?;
            listing.lamps = beside.layers;
            listing.rest = beside.rest;
            if listing.lamps.iter().any(|layer| layer.file.is_some()) {
                listing.place = LayerFiles::Files;
                return Ok(Some(listing));
            }
        }
        let named = |name: &Text| name.eq(REST);
        let is_part = |part: &Header| part.own_attributes.layer_name.as_ref().is_some_and(named);
        let has_channel = (first.channels.list.iter()).any(|c| c.name.eq(&format!("{REST}.R")));
        if parts.len() > 1 {
            listing.place = LayerFiles::Parts;
        }
        if listing.rest.is_none() && (has_channel || parts.iter().any(is_part)) {
            listing.rest = Some(RestLayer { file: None });
        }
        Ok(Some(listing))
    }

    /// Names of the files that accompany the picture `path`: the JSON file of the weights, if it exists, and the files of the
    /// layers.
    pub(super) fn files_beside(self, path: &Path) -> Vec<String> {
        let json = weights_file(path);
        let json = json.is_file().then(|| file_name(&json));
        let layers = self.lamps.into_iter().filter_map(|layer| layer.file);
        let rest = self.rest.and_then(|rest| rest.file);
        json.into_iter().chain(layers).chain(rest).collect()
    }
}

/// Text of a header attribute.
fn text(header: &Header, name: &str) -> Option<String> {
    let key = Text::from(name);
    let shared = header.shared_attributes.other.get(&key);
    // The reader stores unknown attributes here.
    match shared.or_else(|| header.own_attributes.other.get(&key))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}
