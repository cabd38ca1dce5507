//! PNG, JPEG and TIFF, by the `image` crate: turned by orientation, with the colour that the file names.
//!
//! PNG: cICP before iCCP, sRGB, gAMA and cHRM (PNG third edition, 4.3). JPEG: ICC before EXIF. Orientation is EXIF's, or tag 274
//! of TIFF.

use super::profile::{self, Named};
use super::{About, Coding, Content, Picture, Source, check_size, exif, tiff};
use crate::color_space::Primaries;
use crate::file::MAX_DECODER_BYTES;
use crate::raster::{Image, Mask};
use base::error::{Error, Result};
use image::metadata::Orientation;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{BufRead, Seek};

/// A picture's decoder, and the name of its format.
fn decoder<'a>(source: &'a mut Source) -> Result<(Box<dyn ImageDecoder + 'a>, &'static str)> {
    let path = source.path;
    let head = source.file.fill_buf().map_err(|e| super::broken(path, e))?;
    let is_tiff = super::raw::is_tiff(head);
    let mut reader = ImageReader::new(&mut source.file);
    if is_tiff {
        // BigTIFF is not guessed.
        reader.set_format(ImageFormat::Tiff);
    } else {
        reader = reader.with_guessed_format().map_err(|e| super::broken(path, e))?;
    }
    let format = match reader.format() {
        Some(ImageFormat::Png) => "PNG",
        Some(ImageFormat::Jpeg) => "JPEG",
        Some(ImageFormat::Tiff) => "TIFF",
        _ => {
            let cause = "unknown format: not PNG, JPEG, TIFF, OpenEXR or Radiance HDR";
            return Err(Error::codec("read", path, cause, "Convert it to one of these"));
        }
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| super::broken(path, e))?;
    Ok((Box::new(decoder), format))
}

/// Columns and rows after the turn.
pub(super) fn turned(stored: (usize, usize), orientation: Orientation) -> (usize, usize) {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    match orientation {
        Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH => (stored.1, stored.0),
        _ => stored,
    }
}

/// Columns and rows, turned as the file asks.
pub(super) fn dimensions(mut source: Source) -> Result<(usize, usize)> {
    if let Some(special) = tiff::open(&mut source)? {
        return Ok(special.size());
    }
    let path = source.path;
    let mut decoder = decoder(&mut source)?.0;
    let (width, height) = decoder.dimensions();
    let orientation = decoder.orientation().map_err(|e| super::broken(path, e))?;
    Ok(turned((width as usize, height as usize), orientation))
}

/// Properties of the picture, without decoding pixels.
pub(super) fn about(mut source: Source) -> Result<About> {
    if let Some(special) = tiff::open(&mut source)? {
        return Ok(special.about(&mut source)?.0);
    }
    Ok(header(&mut source)?.0)
}

/// Reads the whole picture.
pub(super) fn read(mut source: Source) -> Result<Picture> {
    if let Some(special) = tiff::open(&mut source)? {
        return special.read(&mut source);
    }
    let path = source.path;
    let (about, named, orientation) = header(&mut source)?;
    source.file.rewind().map_err(|e| super::broken(path, e))?;
    let decoder = decoder(&mut source)?.0;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| super::broken(path, e))?;
    Ok(finish(about, named, picture, orientation))
}

/// What is known before the pixels, the colour and the turn.
fn header(source: &mut Source) -> Result<(About, Option<Named>, Orientation)> {
    let path = source.path;
    let is_png = source.file.fill_buf().is_ok_and(|head| head.starts_with(b"\x89PNG"));
    let png = if is_png { png_color(source) } else { None };
    let tiff_icc = tiff::icc(source);
    let (mut decoder, format) = decoder(source)?;
    let broken = |e: image::ImageError| super::broken(path, e);
    let (width, height) = decoder.dimensions();
    let stored = (width as usize, height as usize);
    check_size(stored).map_err(|e| super::broken(path, e))?;
    let orientation = decoder.orientation().map_err(broken)?;
    let icc =
        tiff_icc.map_or_else(|| decoder.icc_profile(), |icc| Ok(Some(icc))).map_err(broken)?;
    // A PNG's EXIF leaves the colour to its chunks.
    let exif = if is_png { None } else { decoder.exif_metadata().map_err(broken)? };
    let named = match (png, icc, exif) {
        (Some(named), ..) => Ok(Some(named)),
        (None, Some(icc), _) => profile::icc(&icc).map(Some),
        (None, None, exif) => Ok(exif.and_then(|exif| exif::color(&exif))),
    };
    let color = decoder.color_type();
    let (about, named) = describe(path, format, stored, color, named, orientation);
    Ok((about, named, orientation))
}

/// What is known of a picture with these colours, `stored` columns and rows, and this turn.
pub(super) fn describe(
    path: &std::path::Path,
    format: &'static str,
    stored: (usize, usize),
    color: ColorType,
    named: std::result::Result<Option<Named>, String>,
    orientation: Orientation,
) -> (About, Option<Named>) {
    let mut notes = Vec::new();
    let is_as_stored = orientation == Orientation::NoTransforms;
    if !is_as_stored {
        notes.push("Turned by the orientation in its file.".to_owned());
    }
    let named = named.unwrap_or_else(|fault| {
        notes.push(format!("{} was read as sRGB: {fault}.", path.display()));
        None
    });
    let turned_by = if format == "TIFF" { "its orientation tag" } else { "EXIF" };
    let origin = named.as_ref().map(|named| named.origin.clone());
    let is_light = matches!(color, ColorType::Rgb32F | ColorType::Rgba32F);
    let about = About {
        size: turned(stored, orientation),
        format,
        coding: match origin {
            origin if is_light => Coding::Light(origin),
            Some(origin) => Coding::Named(origin),
            None => Coding::Open,
        },
        has_alpha: color.has_alpha(),
        bits: 8 * color.bytes_per_pixel() / color.channel_count(),
        layer: None,
        turned_by: (!is_as_stored).then_some(turned_by),
        is_converted: named.as_ref().is_some_and(|named| {
            if is_light { named.matrix().is_some() } else { named.profile.is_some() }
        }),
        is_whole: true,
        notes,
    };
    (about, named)
}

/// The picture of decoded pixels.
pub(super) fn finish(
    about: About,
    named: Option<Named>,
    mut picture: DynamicImage,
    orientation: Orientation,
) -> Picture {
    picture.apply_orientation(orientation);
    if !matches!(about.coding, Coding::Light(_)) {
        return Picture { about, content: Content::Codes(picture, named) };
    }
    let (width, height) = about.size;
    let pixels = picture.into_rgba32f();
    let alpha = about.has_alpha.then(|| Mask {
        width,
        height,
        pixels: pixels.pixels().map(|p| p.0[3]).collect(),
    });
    let matrix = named.as_ref().and_then(Named::matrix);
    let light = pixels.pixels().map(|p| {
        let light = [p.0[0], p.0[1], p.0[2]];
        matrix.map_or(light, |matrix| crate::color_space::transformed(&matrix, light))
    });
    let light = Image { width, height, pixels: light.collect() };
    Picture { about, content: Content::Light(light, alpha) }
}

/// Colour of a PNG by its chunks, unless an ICC profile names it.
fn png_color(source: &mut Source) -> Option<Named> {
    let start = source.file.stream_position().ok()?;
    let info = png::Decoder::new(&mut source.file).read_info();
    let named = info.ok().and_then(|reader| {
        let info = reader.info();
        if let Some(cicp) = &info.coding_independent_code_points
            && let Some(named) = profile::cicp(cicp.color_primaries, cicp.transfer_function)
        {
            return Some(named);
        }
        if info.icc_profile.is_some() {
            return None;
        }
        if info.srgb.is_some() {
            return Some(Named::srgb("sRGB"));
        }
        let primaries = info.chrm_chunk.map(|chunk| {
            let chromaticity = |(x, y): (png::ScaledFloat, png::ScaledFloat)| {
                [f64::from(x.into_value()), f64::from(y.into_value())]
            };
            Primaries {
                red: chromaticity(chunk.red),
                green: chromaticity(chunk.green),
                blue: chromaticity(chunk.blue),
                white: chromaticity(chunk.white),
            }
        });
        let gamma = info.gama_chunk?.into_value();
        profile::gamma(gamma, primaries)
    });
    source.file.seek(std::io::SeekFrom::Start(start)).ok()?;
    let _ = source.file.fill_buf();
    named
}
