//! One picture as an OpenEXR file, with its light layers where there are any.

use super::about::{About, PROVENANCE};
use super::colors::Encoding;
use super::exr_channels::{Window, channel, color_channels};
use super::exr_encode::encode;
use super::exr_settings::{ExrAlpha, ExrSettings, LayerFiles};
use super::layers::{beside, weights_file};
use super::rational_rate;
use super::rebuild::Rebuild;
use base::error::{Error, Result};
use base::files::write_beside;
use compositor::Picture;
use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding as Blocking, FlatSamples, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, Vec2,
};
use imaging::Image;
use imaging::color_space::{ColorSpace, transformed};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

/// Writes `linear`, the light of `picture`, as an OpenEXR picture, with its light layers where there are any. The header
/// has time code, frame rate, primaries, the colour space's name, and whether colour is times alpha. Values beyond the
/// range of half floats are clipped to ±65504. Returns the accuracy of the layers, where they have a subject.
///
/// # Errors
/// When the file cannot be written, or layers miss their subject by more than half floats round away. Then nothing is
/// written.
pub fn write_still_exr(path: &Path, (picture, linear): (&Picture, &Image), about: &About) -> Result<Option<Rebuild>> {
    let light = written_light(linear, picture, about.encoding, about.exr);
    let alpha = &picture.alpha;
    let samples = about.exr.samples;
    let window = if about.exr.crop { Window::around(linear, alpha) } else { Window::whole(alpha.size()) };
    let mut beauty: Vec<_> = color_channels("", &light, window, samples).into();
    beauty.push(channel("A", alpha, window, samples, |a| a));
    let file = File { about, window, size: alpha.size() };
    let Some(layers) = about.layers else {
        file.write(path, vec![(None, beauty)])?;
        return Ok(None);
    };
    let pictures: Vec<_> = layers.pictures().collect();
    let channels = |(name, light): &(String, &Image)| {
        let light = written_light(light, picture, about.encoding, about.exr);
        let in_picture = about.exr.layers == LayerFiles::Channels;
        let prefix = if in_picture { format!("{name}.") } else { String::new() };
        (name.clone(), color_channels(&prefix, &light, window, samples))
    };
    // Few at once: each is copied where its colours change.
    let groups = pictures.chunks(rayon::current_num_threads());
    let pictures = groups.flat_map(|group| group.par_iter().map(channels).collect::<Vec<_>>());
    let pictures: Vec<_> = pictures.collect();
    let check = layers.subject.as_ref().map(|subject| {
        let subject = written_light(subject, picture, about.encoding, about.exr);
        let layers = layers.lamps.iter().map(|lamp| lamp.weight).zip(&pictures);
        let layers: Vec<_> = layers.map(|(weight, (_, channels))| (weight, channels)).collect();
        Rebuild::of_channels(path, &layers, &window.values(&subject, |pixel| pixel))
    });
    let check = check.transpose()?;
    // The picture itself comes last: once it is there, all is.
    if about.exr.weights || about.exr.layers == LayerFiles::Files {
        let text = layers.weights(path, about.exr.layers);
        write_beside(&weights_file(path), |out| out.write_all(text.as_bytes()))?;
    }
    match about.exr.layers {
        LayerFiles::Channels => {
            beauty.extend(pictures.into_iter().flat_map(|(_, channels)| channels));
            file.write(path, vec![(None, beauty)])?;
        }
        LayerFiles::Parts => {
            let mut parts = vec![(Some("rgba".to_owned()), beauty)];
            let layers = pictures.into_iter();
            parts.extend(layers.map(|(name, channels)| (Some(name), channels.into())));
            file.write(path, parts)?;
        }
        LayerFiles::Files => {
            for (name, channels) in pictures {
                let alone = File { about: &About { layers: None, ..*about }, ..file };
                alone.write(&beside(path, &name), vec![(None, channels.into())])?;
            }
            file.write(path, vec![(None, beauty)])?;
        }
    }
    Ok(check)
}

/// Premultiplied linear Rec. 709 as a file has it: in its primaries or its configuration's space, and divided by alpha where
/// alpha is straight.
fn written_light<'a>(
    light: &'a Image,
    picture: &Picture,
    encoding: &Encoding,
    settings: ExrSettings,
) -> Cow<'a, Image> {
    let mut light = Cow::Borrowed(light);
    let primaries = encoding.primaries();
    if let Some(config) = encoding.config() {
        config.apply(&mut light.to_mut().pixels);
    } else if primaries != ColorSpace::Rec709 {
        let matrix = ColorSpace::Rec709.matrix_to(primaries);
        light.to_mut().pixels.iter_mut().for_each(|pixel| *pixel = transformed(&matrix, *pixel));
    }
    if settings.alpha == ExrAlpha::Straight {
        for (pixel, &alpha) in light.to_mut().pixels.iter_mut().zip(&picture.alpha.pixels) {
            *pixel = pixel.map(|v| if alpha > 0.0 { v / alpha } else { 0.0 });
        }
    }
    light
}

/// Properties that all parts of a file share.
#[derive(Clone, Copy)]
struct File<'a> {
    about: &'a About<'a>,
    window: Window,
    size: (usize, usize),
}

/// A part's name, if it has one, and its channels.
type Part = (Option<String>, Vec<AnyChannel<FlatSamples>>);

impl File<'_> {
    fn write(&self, path: &Path, parts: Vec<Part>) -> Result<()> {
        let Window { x, y, width, height } = self.window;
        // Scan lines in order: the same picture gives the same bytes.
        let blocking = Blocking {
            compression: self.about.exr.compression.method(),
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let layers: Vec<_> = (parts.into_iter().enumerate())
            .map(|(index, (name, channels))| {
                let header = LayerAttributes {
                    layer_name: name.map(|name| Text::from(name.as_str())),
                    layer_position: Vec2(x as i32, y as i32),
                    ..self.header(index == 0)
                };
                let channels = AnyChannels::sort(channels.into());
                Layer::new((width, height), header, blocking, channels)
            })
            .collect();
        let file = exr::prelude::Image::from_layers(self.attributes(), layers);
        let mut bytes = encode(&file).map_err(|e| Error::codec("encode", path, e, "Check the size of the picture"))?;
        sort_attributes(&mut bytes);
        write_beside(path, |out| out.write_all(&bytes))
    }

    fn header(&self, first: bool) -> LayerAttributes {
        let about = self.about;
        let mut header = LayerAttributes {
            frames_per_second: Some(rational_rate(about.frame_rate)),
            software_name: Some(Text::from("Afterlight")),
            ..LayerAttributes::default()
        };
        if first {
            let weights = about.layers.map(|layers| layers.attribute(about.exr.layers));
            header.other.extend(weights);
        }
        header
    }

    fn attributes(&self) -> ImageAttributes {
        let about = self.about;
        let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(self.size));
        attributes.time_code = Some(about.time_code.into());
        let (space, id) = about.encoding.linear_tags();
        let at = |[x, y]: [f64; 2]| Vec2(x as f32, y as f32);
        attributes.chromaticities = space.map(|space| {
            let corners = space.primaries();
            Chromaticities {
                red: at(corners.red),
                green: at(corners.green),
                blue: at(corners.blue),
                white: at(corners.white),
            }
        });
        let of_config = about.encoding.config().map(|config| &*config.space);
        let texts = [
            ("colorInteropID", id.as_deref()),
            // As OpenImageIO writes what a configuration calls it.
            ("oiio:ColorSpace", of_config),
            ("alpha", Some(about.exr.alpha.word())),
            ("reelName", about.reel),
            (PROVENANCE, about.provenance),
        ];
        for (key, text) in texts {
            // Headers know few letters beyond these.
            let text = text.map(|text| text.replace(|c: char| !(' '..='~').contains(&c), "_"));
            let value = text.map(|text| AttributeValue::Text(Text::from(text.as_str())));
            (attributes.other).extend(value.map(|value| (Text::from(key), value)));
        }
        attributes
    }
}

/// Sorts the attributes of each header by name, as OpenEXR's own library writes them: the encoder takes those that it does
/// not know from a table in random order, and the same picture is to give the same bytes. None if a header ends too soon.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    // Bit 12 of the version: several parts, whose headers end with an empty one.
    let has_parts = bytes.get(5)? & 0x10 != 0;
    let mut at = 8;
    loop {
        let start = at;
        let mut attributes = Vec::new();
        while *bytes.get(at)? != 0 {
            let from = at;
            for _ in ["name", "type"] {
                at += bytes.get(at..)?.iter().position(|byte| *byte == 0)? + 1;
            }
            let size = bytes.get(at..at + 4)?.try_into().ok()?;
            at += 4 + usize::try_from(i32::from_le_bytes(size)).ok()?;
            attributes.push(bytes.get(from..at)?.to_vec());
        }
        // A name ends with 0, so that the shorter of two comes first.
        attributes.sort();
        bytes.get_mut(start..at)?.copy_from_slice(&attributes.concat());
        at += 1;
        if !has_parts || *bytes.get(at)? == 0 {
            return Some(());
        }
    }
}
