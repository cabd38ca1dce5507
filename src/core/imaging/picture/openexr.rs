//! OpenEXR block by block: the flat layer that a person would call the picture, its data window anywhere in its display
//! window, its chromaticities brought to Rec. 709.

use super::properties::{About, Coding, Origin, Sink};
use super::source::{self, Source};
use crate::color_space::{Primaries, transformed};
use crate::limits::check_openexr;
use base::error::{Error, Result};
use exr::block::reader::ChunksReader;
use exr::meta::attribute::{Chromaticities, IntegerBounds, SampleType};
use exr::meta::header::Header;
use half::f16;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Layers that hold the finished picture, by the last part of their names; earlier ones are preferred.
const FINISHED: [&str; 8] = ["composite", "combined", "beauty", "rgba", "rgb", "color", "colour", "main"];

pub(super) fn stream(mut source: Source, sink: &mut dyn Sink) -> Result<()> {
    refuse_new_compression(&mut source)?;
    let Source { path, file } = source;
    let broken = |cause: &dyn std::fmt::Display| source::broken(path, cause);
    let reader = exr::block::read(file, false).map_err(|e| match &e {
        exr::error::Error::NotSupported(why) if why.contains("subsampling") => luminance_chroma(path),
        _ => broken(&e),
    })?;
    check_openexr(reader.headers()).map_err(|e| broken(&e))?;
    let mut notes = Vec::new();
    let choice = choose(path, reader.headers(), &mut notes)?;
    let header = &reader.headers()[choice.header];
    let (data, display) = (header.data_window(), header.shared_attributes.display_window);
    let size = |window: IntegerBounds| (window.size.width(), window.size.height());
    let window = if sink.takes_data_window(size(data), size(display)) { data } else { display };
    let offset = data.position - window.position;
    let (inside_x, inside_y) =
        (overlap(offset.x(), size(data).0, size(window).0), overlap(offset.y(), size(data).1, size(window).1));
    if inside_x == 0 || inside_y == 0 {
        return Err(broken(&"its data window is outside its display window"));
    }
    let is_whole = (inside_x, inside_y) == size(window);
    if !is_whole {
        notes.push(format!(
            "The file holds {inside_x} × {inside_y} of its {} × {} pixels; the rest is black.",
            size(window).0,
            size(window).1
        ));
    }
    let primaries = header.shared_attributes.chromaticities.and_then(|c| primaries(&c));
    let matrix = primaries.and_then(Primaries::to_rec709);
    if matrix.is_some() {
        notes.push("Brought from the chromaticities in its header to Rec. 709.".to_owned());
    }
    let list = &header.channels.list;
    let kind = list[choice.channels[0]].sample_type;
    let about = About {
        size: size(window),
        format: "EXR",
        coding: Coding::Light(
            primaries.map(|primaries| Origin { name: primaries.name().to_owned(), by: "its chromaticities" }),
        ),
        has_alpha: choice.alpha.is_some(),
        bits: if kind == SampleType::F16 { 16 } else { 32 },
        layer: choice.layer.clone(),
        turned_by: None,
        is_converted: matrix.is_some(),
        is_whole,
        notes,
    };
    if !sink.begin(&about)? {
        return Ok(());
    }
    let chunks = reader
        .filter_chunks(false, |_, _, block| {
            block.layer == choice.header && (block.level.x(), block.level.y()) == (0, 0)
        })
        .map_err(|e| broken(&e))?;
    let mut row: Vec<[f32; 3]> = Vec::new();
    let mut alphas: Vec<f32> = Vec::new();
    let mut samples = Samples::default();
    // In the order of the file, so that sums do not depend on the number of threads.
    chunks
        .decompress_sequential(false, |meta, block| {
            let channels = &meta.headers[choice.header].channels;
            for line in block.lines(channels) {
                let at = line.location;
                row.resize(at.sample_count, [0.0; 3]);
                let is_alpha = choice.alpha == Some(at.channel);
                if is_alpha || choice.channels.contains(&at.channel) {
                    samples.read(channels.list[at.channel].sample_type, line.value);
                    for c in (0..3).filter(|&c| choice.channels[c] == at.channel) {
                        for (texel, &value) in row.iter_mut().zip(&samples.values) {
                            texel[c] = value;
                        }
                    }
                    if is_alpha {
                        alphas.clone_from(&samples.values);
                    }
                }
                if at.channel + 1 == channels.list.len() {
                    let x = at.position.x() as i64 + i64::from(offset.x());
                    let y = at.position.y() as i64 + i64::from(offset.y());
                    let cut = (-x).max(0) as usize;
                    if y < 0 || cut >= row.len() || y as usize >= size(window).1 {
                        continue;
                    }
                    if let Some(matrix) = &matrix {
                        row.iter_mut().for_each(|texel| *texel = transformed(matrix, *texel));
                    }
                    let visible = size(window).0.saturating_sub(x.max(0) as usize);
                    let run = cut..row.len().min(cut + visible);
                    let alpha = alphas.get(run.clone()).unwrap_or(&[]);
                    sink.run(x.max(0) as usize, y as usize, &row[run], alpha);
                }
            }
            Ok(())
        })
        .map_err(|e| broken(&e))
}

fn primaries(c: &Chromaticities) -> Option<Primaries> {
    let chromaticity = |v: exr::math::Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    let primaries = Primaries {
        red: chromaticity(c.red),
        green: chromaticity(c.green),
        blue: chromaticity(c.blue),
        white: chromaticity(c.white),
    };
    primaries.is_usable().then_some(primaries)
}

/// Refuses compressions that came after OpenEXR 2, which the decoder takes for damage.
fn refuse_new_compression(source: &mut Source) -> Result<()> {
    const NAME: &[u8] = b"compression\0compression\0";
    let mut head = Vec::new();
    // Headers are short, but for those with pictures in them.
    let _ = (&mut source.file).take(1 << 16).read_to_end(&mut head);
    source.file.seek(SeekFrom::Start(0)).map_err(|e| source.broken(e))?;
    let at = head.windows(NAME.len()).position(|part| part == NAME);
    // The value follows its size; 9 is DWAB.
    match at.and_then(|at| head.get(at + NAME.len() + 4)) {
        Some(&method) if method > 9 => Err(Error::invalid(
            format!(
                "{} has a compression newer than OpenEXR 2 (number {method}; 10 and 11 are HTJ2K)",
                source.path.display()
            ),
            "Write it with ZIP compression",
        )
        .with_how("oiiotool IN.exr --compression zip -o OUT.exr")),
        _ => Ok(()),
    }
}

/// Number of places among `length` from `start` on that are below `end` and not negative.
fn overlap(start: i32, length: usize, end: usize) -> usize {
    let start = i64::from(start);
    ((start + length as i64).min(end as i64) - start.max(0)).max(0) as usize
}

/// The values of a line.
#[derive(Default)]
struct Samples {
    values: Vec<f32>,
}

impl Samples {
    /// Reads a line's bytes, which the decoder has brought to this machine's order.
    fn read(&mut self, kind: SampleType, bytes: &[u8]) {
        self.values.clear();
        match kind {
            SampleType::F16 => {
                let (pairs, _) = bytes.as_chunks::<2>();
                self.values.extend(pairs.iter().map(|b| f16::from_ne_bytes(*b).to_f32()));
            }
            SampleType::F32 => {
                let (words, _) = bytes.as_chunks::<4>();
                self.values.extend(words.iter().map(|b| f32::from_ne_bytes(*b)));
            }
            SampleType::U32 => {
                let (words, _) = bytes.as_chunks::<4>();
                self.values.extend(words.iter().map(|b| u32::from_ne_bytes(*b) as f32));
            }
        }
    }
}

/// The part of a file that is read.
struct LayerChoice {
    header: usize,
    /// Numbers of the channels of red, green and blue: three times the same for grey.
    channels: [usize; 3],
    alpha: Option<usize>,
    /// Name of one of several layers with colours, if it has one.
    layer: Option<String>,
}

/// A layer with colours.
struct Layer {
    /// Part, view and layer, as far as they have names, in lower case.
    name: String,
    choice: LayerChoice,
}

impl Layer {
    /// True if the whole name is `chosen`, in lower case, or ends with it.
    fn is_called(&self, chosen: &str) -> bool {
        let name = self.name.trim_matches('.');
        name == chosen || name.strip_suffix(chosen).is_some_and(|before| before.ends_with('.'))
    }

    /// Rank among the layers of a file, lower first: unnamed and finished ones, the left eye before the right.
    fn rank(&self) -> (usize, usize) {
        let words: Vec<&str> = self.name.split('.').filter(|word| !word.is_empty()).collect();
        let is_right = words.contains(&"right");
        let named: Vec<&&str> = words.iter().filter(|word| !["left", "right", "default"].contains(*word)).collect();
        let rank = |word: &str| FINISHED.iter().position(|finished| *finished == word);
        let finished = match named.last() {
            None => 0,
            Some(last) => {
                // "composite.combined" comes before the "combined" of a view layer.
                let all = named.iter().filter_map(|word| rank(word)).min();
                rank(last).and(all).map_or(usize::MAX, |rank| rank + 1)
            }
        };
        (finished, usize::from(is_right))
    }
}

/// Layers chosen by name, in lower case, for the files in a folder and below.
static CHOSEN: Mutex<BTreeMap<PathBuf, String>> = Mutex::new(BTreeMap::new());

/// Chooses the layer of EXR files at `place`, a file or folder, that have several, for this process; None: the finished
/// picture. Files without this layer among several are refused.
pub fn choose_layer(place: &Path, layer: Option<&str>) {
    let mut chosen = CHOSEN.lock().unwrap_or_else(PoisonError::into_inner);
    match layer {
        Some(layer) => chosen.insert(place.to_path_buf(), layer.to_lowercase()),
        None => chosen.remove(place),
    };
}

fn chosen_layer(path: &Path) -> Option<String> {
    let chosen = CHOSEN.lock().unwrap_or_else(PoisonError::into_inner);
    path.ancestors().find_map(|place| chosen.get(place).cloned())
}

/// True for luminance with chroma at full resolution, whose Y alone is no grey picture.
fn has_chroma(headers: &[Header]) -> bool {
    let is_chroma = |name: &str| ["ry", "by"].contains(&name.rsplit('.').next().unwrap_or(name));
    let mut channels = headers.iter().flat_map(|header| &header.channels.list);
    channels.any(|channel| is_chroma(&channel.name.to_string().to_lowercase()))
}

/// Refusal of luminance with chroma, which the decoder names by its subsampling.
fn luminance_chroma(path: &Path) -> Error {
    Error::invalid(
        format!("{} has luminance and chroma (Y, RY, BY) or other subsampled channels, not R, G and B", path.display()),
        "Write it with the channels R, G and B, in the program that wrote it",
    )
}

/// Layers with red, green and blue.
fn color_layers(headers: &[Header]) -> Vec<Layer> {
    let mut found = Vec::new();
    for (header, part) in headers.iter().enumerate() {
        if !is_flat(part) {
            continue;
        }
        let names: Vec<String> = part.channels.list.iter().map(|c| c.name.to_string().to_lowercase()).collect();
        let own = part.own_attributes.layer_name.as_ref().map(ToString::to_string);
        let view = part.own_attributes.view_name.as_ref().map(ToString::to_string);
        for name in &names {
            let (layer, last) = name.rsplit_once('.').unwrap_or(("", name));
            let triples = [["r", "g", "b", "a"], ["red", "green", "blue", "alpha"]];
            let Some(triple) = triples.into_iter().find(|triple| triple[0] == last) else { continue };
            let find = |channel: &str| {
                let wanted = if layer.is_empty() { channel.to_owned() } else { format!("{layer}.{channel}") };
                names.iter().position(|name| *name == wanted)
            };
            if let (Some(r), Some(g), Some(b)) = (find(triple[0]), find(triple[1]), find(triple[2])) {
                let words = [own.clone(), view.clone(), Some(layer.to_owned())];
                let words: Vec<String> = words.into_iter().flatten().map(|w| w.to_lowercase()).collect();
                let channels = [r, g, b];
                let choice = LayerChoice { header, channels, alpha: find(triple[3]), layer: None };
                found.push(Layer { name: words.join("."), choice });
            }
        }
    }
    found
}

pub(super) fn layers(Source { path, file }: Source) -> Result<Vec<String>> {
    let reader = exr::block::read(file, false).map_err(|e| source::broken(path, e))?;
    let mut layers = color_layers(reader.headers());
    layers.sort_by_key(Layer::rank);
    let names = layers.iter().map(|layer| layer.name.trim_matches('.').to_owned());
    Ok(if layers.len() > 1 { names.collect() } else { Vec::new() })
}

fn is_flat(header: &Header) -> bool {
    !header.deep && header.channels.list.iter().all(|c| (c.sampling.x(), c.sampling.y()) == (1, 1))
}

/// The layer to read: the only one with colours, or the finished picture among several; else grey.
fn choose(path: &Path, headers: &[Header], notes: &mut Vec<String>) -> Result<LayerChoice> {
    let mut layers = color_layers(headers);
    let count = layers.len();
    layers.sort_by_key(Layer::rank);
    let shown = |layer: &Layer| format!("\"{}\"", layer.name.trim_matches('.'));
    let chosen = if count > 1 { chosen_layer(path) } else { None };
    if let Some(first) = layers.first() {
        let is_wanted = match &chosen {
            Some(chosen) => {
                // The left view stays before the right.
                layers.sort_by_key(|layer| !layer.is_called(chosen));
                layers[0].is_called(chosen)
            }
            None => count == 1 || first.rank().0 < usize::MAX,
        };
        if !is_wanted {
            let names: Vec<String> = layers.iter().take(12).map(shown).collect();
            let lacks =
                chosen.map_or("that is the finished picture".to_owned(), |chosen| format!("called \"{chosen}\""));
            return Err(Error::invalid(
                format!("{} has {count} layers with colours and none {lacks}: {}", path.display(), names.join(", ")),
                "Choose one as EXR layer in New project or with --layer NAME (import, probe) or --environment-layer NAME (relight), \
                 write the wanted one as R, G and B, or name it \"beauty\"",
            ));
        }
        if count > 1 {
            let first = &layers[0];
            let name = if first.name.trim_matches('.').is_empty() { "the unnamed one".into() } else { shown(first) };
            notes.push(format!("The file has {count} layers with colours; {name} was read."));
        }
        let Layer { name, choice } = layers.remove(0);
        let name = (count > 1).then(|| name.trim_matches('.').to_owned());
        return Ok(LayerChoice { layer: name.filter(|name| !name.is_empty()), ..choice });
    }
    if has_chroma(headers) {
        return Err(luminance_chroma(path));
    }
    for (header, part) in headers.iter().enumerate().filter(|(_, part)| is_flat(part)) {
        let list = &part.channels.list;
        let last = |channel: &exr::meta::attribute::ChannelDescription| {
            let name = channel.name.to_string().to_lowercase();
            name.rsplit('.').next().unwrap_or_default().to_owned()
        };
        let named = |wanted: &[&str]| list.iter().position(|c| wanted.contains(&&*last(c)));
        let grey = named(&["y", "l", "luminance"]).or_else(|| (list.len() == 1).then_some(0));
        if let Some(channel) = grey {
            notes.push("The file has no colour channels, so it was read as grey.".into());
            let alpha = named(&["a", "alpha"]).filter(|alpha| *alpha != channel);
            return Ok(LayerChoice { header, channels: [channel; 3], alpha, layer: None });
        }
    }
    let found = headers.iter().flat_map(|header| &header.channels.list);
    let found: Vec<String> = found.map(|c| c.name.to_string()).take(12).collect();
    Err(Error::invalid(
        format!(
            "{} has the channels {}, but no flat layer with R, G and B or with Y at full resolution",
            path.display(),
            found.join(", ")
        ),
        "Write it again with the channels R, G and B",
    ))
}
