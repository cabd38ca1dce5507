//! PNG, JPEG and TIFF, by the `image` crate: turned by orientation, with the colour that the file names.
//!
//! PNG: cICP before iCCP, sRGB, gAMA and cHRM (PNG third edition, 4.3). Orientation is EXIF's, or tag 274 of TIFF.

use super::profile::{self, Named};
use super::{About, Coding, Content, Picture, Source, check_size, tiff};
use crate::color_space::Primaries;
use crate::file::MAX_DECODER_BYTES;
use crate::raster::{Image, Mask};
use base::error::{Error, Result};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{BufRead, Seek};

/// A picture's decoder.
fn decoder<'a>(source: &'a mut Source) -> Result<Box<dyn ImageDecoder + 'a>> {
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
    if reader.format().is_none() {
        let cause = "unknown format: not PNG, JPEG, TIFF, OpenEXR or Radiance HDR";
        return Err(Error::codec("read", path, cause, "Convert it to one of these"));
    }
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| super::broken(path, e))?;
    Ok(Box::new(decoder))
}

pub(super) fn is_turned(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// Columns and rows, turned as the file asks.
pub(super) fn dimensions(mut source: Source) -> Result<(usize, usize)> {
    if let Some(special) = tiff::open(&mut source)? {
        return Ok(special.size());
    }
    let path = source.path;
    let mut decoder = decoder(&mut source)?;
    let (width, height) = decoder.dimensions();
    let orientation = decoder.orientation().map_err(|e| super::broken(path, e))?;
    let (width, height) = (width as usize, height as usize);
    Ok(if is_turned(orientation) { (height, width) } else { (width, height) })
}

/// Reads the whole picture.
pub(super) fn read(mut source: Source) -> Result<Picture> {
    if let Some(special) = tiff::open(&mut source)? {
        return special.read(&mut source);
    }
    let path = source.path;
    let png = png_color(&mut source);
    let tiff_icc = tiff::icc(&mut source);
    let mut decoder = decoder(&mut source)?;
    let (width, height) = decoder.dimensions();
    check_size((width as usize, height as usize)).map_err(|e| super::broken(path, e))?;
    let broken = |e: image::ImageError| super::broken(path, e);
    let orientation = decoder.orientation().map_err(broken)?;
    let icc =
        tiff_icc.map_or_else(|| decoder.icc_profile(), |icc| Ok(Some(icc))).map_err(broken)?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
    picture.apply_orientation(orientation);
    let named = match png {
        Some(named) => Ok(Some(named)),
        None => icc.map(|bytes| profile::icc(&bytes)).transpose(),
    };
    finish(path, picture, named, orientation)
}

/// The picture with what is known of it.
pub(super) fn finish(
    path: &std::path::Path,
    picture: DynamicImage,
    named: std::result::Result<Option<Named>, String>,
    orientation: Orientation,
) -> Result<Picture> {
    let mut notes = Vec::new();
    if orientation != Orientation::NoTransforms {
        notes.push("Turned by the orientation in its file.".to_owned());
    }
    let named = named.unwrap_or_else(|fault| {
        notes.push(format!("{} was read as sRGB: {fault}.", path.display()));
        None
    });
    let color = picture.color();
    let size = (picture.width() as usize, picture.height() as usize);
    let bits = 8 * color.bytes_per_pixel() / color.channel_count();
    let is_light = matches!(picture, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let has_alpha = color.has_alpha();
    let about = |coding, is_converted, notes| About {
        size,
        coding,
        has_alpha,
        bits,
        is_converted,
        is_whole: true,
        notes,
    };
    if is_light {
        let pixels = picture.into_rgba32f();
        let (width, height) = size;
        let alpha = has_alpha.then(|| Mask {
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
        let about = about(Coding::Light("floating point"), matrix.is_some(), notes);
        return Ok(Picture { about, content: Content::Light(light, alpha) });
    }
    let coding = named.as_ref().map_or(Coding::Open, |named| Coding::Named(named.name.clone()));
    let is_converted = named.as_ref().is_some_and(|named| named.profile.is_some());
    Ok(Picture {
        about: about(coding, is_converted, notes),
        content: Content::Codes(picture, named),
    })
}

/// Colour of a PNG by its chunks, unless an ICC profile names it; None for other files.
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
            return Some(Named::srgb());
        }
        let primaries = info.chrm_chunk.map(|chunk| {
            let of = |(x, y): (png::ScaledFloat, png::ScaledFloat)| {
                [f64::from(x.into_value()), f64::from(y.into_value())]
            };
            Primaries {
                red: of(chunk.red),
                green: of(chunk.green),
                blue: of(chunk.blue),
                white: of(chunk.white),
            }
        });
        let gamma = info.gama_chunk?.into_value();
        profile::gamma(gamma, primaries)
    });
    source.file.seek(std::io::SeekFrom::Start(start)).ok()?;
    let _ = source.file.fill_buf();
    named
}
