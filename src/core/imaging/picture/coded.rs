//! PNG, JPEG and TIFF, by the `image` crate: turned by orientation, with the colour that the file names.
//!
//! PNG: cICP before iCCP, sRGB, gAMA and cHRM (PNG third edition, 4.3). JPEG: ICC before EXIF. Orientation is EXIF's, or tag 274
//! of TIFF.

use super::decoded::{describe, finish, turned};
use super::profile::{self, Named};
use super::properties::About;
use super::source::{Source, broken};
use super::whole::Picture;
use super::{exif, raw, tiff};
use crate::color_space::Primaries;
use crate::limits::{MAX_DECODER_BYTES, check_size};
use base::error::{Error, Result};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{BufRead, Seek};

/// A picture's decoder, and the name of its format.
fn decoder<'a>(source: &'a mut Source) -> Result<(Box<dyn ImageDecoder + 'a>, &'static str)> {
    let path = source.path;
    let head = source.file.fill_buf().map_err(|e| broken(path, e))?;
    let is_tiff = raw::is_tiff(head);
    let mut reader = ImageReader::new(&mut source.file);
    if is_tiff {
        // BigTIFF is not guessed.
        reader.set_format(ImageFormat::Tiff);
    } else {
        reader = reader.with_guessed_format().map_err(|e| broken(path, e))?;
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
    let decoder = reader.into_decoder().map_err(|e| broken(path, e))?;
    Ok((Box::new(decoder), format))
}

/// Columns and rows, turned as the file asks.
pub(super) fn dimensions(mut source: Source) -> Result<(usize, usize)> {
    if let Some(special) = tiff::open(&mut source)? {
        return Ok(special.size());
    }
    let path = source.path;
    let mut decoder = decoder(&mut source)?.0;
    let (width, height) = decoder.dimensions();
    let orientation = decoder.orientation().map_err(|e| broken(path, e))?;
    Ok(turned((width as usize, height as usize), orientation))
}

/// Properties of the picture, without decoding pixels.
pub(super) fn about(mut source: Source) -> Result<About> {
    if let Some(special) = tiff::open(&mut source)? {
        return Ok(special.about(&mut source)?.0);
    }
    Ok(header(&mut source)?.about)
}

/// Reads the whole picture.
pub(super) fn read(mut source: Source) -> Result<Picture> {
    if let Some(special) = tiff::open(&mut source)? {
        return special.read(&mut source);
    }
    let path = source.path;
    let Header { about, named, orientation } = header(&mut source)?;
    source.file.rewind().map_err(|e| broken(path, e))?;
    let decoder = decoder(&mut source)?.0;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| broken(path, e))?;
    Ok(finish(about, named, picture, orientation))
}

/// A picture without its pixels.
struct Header {
    about: About,
    named: Option<Named>,
    orientation: Orientation,
}

fn header(source: &mut Source) -> Result<Header> {
    let path = source.path;
    let is_png = source.file.fill_buf().is_ok_and(|head| head.starts_with(b"\x89PNG"));
    let png = if is_png { png_color(source) } else { None };
    let tiff_icc = tiff::icc(source);
    let (mut decoder, format) = decoder(source)?;
    let fail = |e: image::ImageError| broken(path, e);
    let (width, height) = decoder.dimensions();
    let stored = (width as usize, height as usize);
    check_size(stored).map_err(|e| broken(path, e))?;
    let orientation = decoder.orientation().map_err(fail)?;
    let icc = tiff_icc.map_or_else(|| decoder.icc_profile(), |icc| Ok(Some(icc))).map_err(fail)?;
    // A PNG's EXIF leaves the colour to its chunks.
    let exif = if is_png { None } else { decoder.exif_metadata().map_err(fail)? };
    let named = match (png, icc, exif) {
        (Some(named), ..) => Ok(Some(named)),
        (None, Some(icc), _) => profile::icc(&icc).map(Some),
        (None, None, exif) => Ok(exif.and_then(|exif| exif::color(&exif))),
    };
    let color = decoder.color_type();
    let (about, named) = describe(path, format, stored, color, named, orientation);
    Ok(Header { about, named, orientation })
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
            let chromaticity =
                |(x, y): (png::ScaledFloat, png::ScaledFloat)| [f64::from(x.into_value()), f64::from(y.into_value())];
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
