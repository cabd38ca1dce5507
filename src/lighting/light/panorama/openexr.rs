//! OpenEXR block by block: any flat layer of colour or grey, its data window anywhere in its display
//! window. The `image` crate reads only unnamed R, G and B, and all of a file at once.

use super::canvas::Canvas;
use super::reader::PanoramaReader;
use base::error::{Error, Result};
use exr::block::reader::ChunksReader;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use half::f16;
use imaging::file::check_openexr;
use std::io::{BufRead, Seek};

pub(super) fn read(panorama: &mut PanoramaReader, file: impl BufRead + Seek) -> Result<Canvas> {
    let reader = exr::block::read(file, false).map_err(|e| panorama.broken(e))?;
    check_openexr(reader.headers()).map_err(|e| panorama.broken(e))?;
    let choice = choose(panorama, reader.headers())?;
    let header = &reader.headers()[choice.header];
    let (data, display) = (header.data_window(), header.shared_attributes.display_window);
    let size =
        |window: exr::meta::attribute::IntegerBounds| (window.size.width(), window.size.height());
    let is_panorama = |(width, height): (usize, usize)| width.abs_diff(2 * height) <= 2;
    // Some tools leave the display window of the shot that the panorama was made for.
    let window =
        if is_panorama(size(data)) && !is_panorama(size(display)) { data } else { display };
    let offset = data.position - window.position;
    let (inside_x, inside_y) = (
        overlap(offset.x(), size(data).0, size(window).0),
        overlap(offset.y(), size(data).1, size(window).1),
    );
    if inside_x == 0 || inside_y == 0 {
        return Err(panorama.broken("its data window is outside its display window"));
    }
    if (inside_x, inside_y) != size(window) {
        panorama.notes.push(format!(
            "The file holds {inside_x}×{inside_y} of its {}×{} pixels; the rest is black.",
            size(window).0,
            size(window).1
        ));
    }
    if header.shared_attributes.chromaticities.is_some_and(|c| {
        let primaries = [(c.red, 0.64, 0.33), (c.green, 0.30, 0.60), (c.blue, 0.15, 0.06)];
        primaries.iter().any(|(p, x, y)| (p.x() - x).abs() + (p.y() - y).abs() > 0.02)
    }) {
        panorama.notes.push(
            "The file declares other primaries than Rec. 709. Its values are used unchanged, so colours may look paler."
                .into(),
        );
    }
    let (mut canvas, top) = panorama.canvas(size(window))?;
    // What the file leaves out is black, not a continuation of its edge.
    canvas.extend &= (inside_x, inside_y) == size(window);
    let chunks = reader
        .filter_chunks(false, |_, _, block| {
            block.layer == choice.header && (block.level.x(), block.level.y()) == (0, 0)
        })
        .map_err(|e| panorama.broken(e))?;
    let mut row: Vec<[f32; 3]> = Vec::new();
    let mut samples = Samples::default();
    // In the order of the file, so that sums do not depend on the number of threads.
    chunks
        .decompress_sequential(false, |meta, block| {
            let channels = &meta.headers[choice.header].channels;
            for line in block.lines(channels) {
                let at = line.location;
                row.resize(at.sample_count, [0.0; 3]);
                if choice.channels.contains(&at.channel) {
                    let kind = channels.list[at.channel].sample_type;
                    samples.read(kind, line.value);
                    for c in (0..3).filter(|&c| choice.channels[c] == at.channel) {
                        for (texel, &value) in row.iter_mut().zip(&samples.values) {
                            texel[c] = value;
                        }
                    }
                }
                if at.channel + 1 == channels.list.len() {
                    let x = at.position.x() as i64 + i64::from(offset.x());
                    let y = at.position.y() as i64 + i64::from(offset.y());
                    let cut = (-x).max(0) as usize;
                    if y >= 0 && cut < row.len() {
                        let visible = size(window).0.saturating_sub(x.max(0) as usize);
                        let run = &row[cut..row.len().min(cut + visible)];
                        if (y as usize) < size(window).1 {
                            canvas.paint(x.max(0) as usize, top + y as usize, run);
                        }
                    }
                }
            }
            Ok(())
        })
        .map_err(|e| panorama.broken(e))?;
    Ok(canvas)
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
    /// For red, green and blue the channel's number: three times the same for grey.
    channels: [usize; 3],
}

/// The channels of red, green and blue, and the name of their layer: empty if `unnamed`, else any other.
fn colour_layer(names: &[String], unnamed: bool) -> Option<([usize; 3], String)> {
    names.iter().find_map(|name| {
        let (layer, last) = name.rsplit_once('.').unwrap_or(("", name));
        let triple =
            [["r", "g", "b"], ["red", "green", "blue"]].into_iter().find(|t| t[0] == last)?;
        let find = |channel: &str| {
            let wanted =
                if layer.is_empty() { channel.to_string() } else { format!("{layer}.{channel}") };
            names.iter().position(|n| *n == wanted)
        };
        let channels = [find(triple[0])?, find(triple[1])?, find(triple[2])?];
        (layer.is_empty() == unnamed).then_some((channels, layer.to_string()))
    })
}

/// Colour without a layer's name first, then with one, then grey; in the first part that has it.
fn choose(panorama: &mut PanoramaReader, headers: &[Header]) -> Result<LayerChoice> {
    let flat = |header: &Header| {
        !header.deep
            && header.channels.list.iter().all(|c| (c.sampling.x(), c.sampling.y()) == (1, 1))
    };
    let parts: Vec<(usize, Vec<String>)> = headers
        .iter()
        .enumerate()
        .filter(|(_, header)| flat(header))
        .map(|(i, header)| {
            (
                i,
                header
                    .channels
                    .list
                    .iter()
                    .map(|c| c.name.to_string().to_ascii_lowercase())
                    .collect(),
            )
        })
        .collect();
    for unnamed in [true, false] {
        for (header, names) in &parts {
            if let Some((channels, layer)) = colour_layer(names, unnamed) {
                let others =
                    names.iter().filter(|n| n.ends_with('r') || n.ends_with("red")).count();
                if headers.len() > 1 || others > 1 && !unnamed {
                    let part = headers[*header].own_attributes.layer_name.as_ref();
                    let name =
                        if layer.is_empty() { part.map(ToString::to_string) } else { Some(layer) };
                    panorama.notes.push(format!(
                        "The file has several layers; {} was read.",
                        name.map_or("the first with colours".into(), |name| format!("\"{name}\""))
                    ));
                }
                return Ok(LayerChoice { header: *header, channels });
            }
        }
    }
    for (header, names) in &parts {
        let grey = names
            .iter()
            .position(|n| ["y", "l", "luminance"].contains(&n.rsplit('.').next().unwrap_or(n)))
            .or_else(|| (names.len() == 1).then_some(0));
        if let Some(channel) = grey {
            panorama.notes.push("The file has no colour channels, so it was read as grey.".into());
            return Ok(LayerChoice { header: *header, channels: [channel; 3] });
        }
    }
    let found: Vec<String> = headers
        .iter()
        .flat_map(|header| header.channels.list.iter().map(|c| c.name.to_string()))
        .take(12)
        .collect();
    Err(Error::invalid(
        format!(
            "{} has the channels {}, but no flat layer with R, G and B or with Y at full resolution",
            panorama.path.display(),
            found.join(", ")
        ),
        "Write it again with the channels R, G and B",
    ))
}
