//! One picture as a file.

use super::about::{About, PROVENANCE};
use super::colors::Encoding;
use super::exr_still::write_still_exr;
use super::format::Bits;
use super::output_space::OutputSpace;
use super::rebuild::Rebuild;
use base::FileFormat;
use base::error::{Error, Result};
use base::files::write_beside;
use compositor::{Picture, code};
use imaging::color::{byte_from_unit, unit};
use imaging::color_space::Primaries;
use png::chunk::ChunkType;
use std::io;
use std::path::Path;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, colortype};
use tiff::tags::{ExtraSamples, Tag};

/// Writes a picture as EXR or TIFF where the path says so, else as PNG. Returns the accuracy of an EXR's layers, where
/// they have a subject.
///
/// # Errors
/// When the file cannot be written, a picture without display codes is to be a PNG, or an EXR's layers miss their subject by
/// more than half floats round away.
pub fn write_still(path: &Path, picture: &Picture, about: &About) -> Result<Option<Rebuild>> {
    match FileFormat::from_path(path) {
        Some(FileFormat::OpenExr) => {
            let linear = picture.linear.as_ref().ok_or_else(|| no_light(path))?;
            write_still_exr(path, (picture, linear), about)
        }
        Some(FileFormat::Tiff) => write_still_tiff(path, picture, about).map(|()| None),
        _ => write_still_png(path, picture, about).map(|()| None),
    }
}

/// Writes the display codes: RGB, or RGBA with straight alpha (as the PNG standard has it) where the picture
/// is not opaque. Chunks say which colour space they are in: `sRGB`, or `cICP` with `cHRM` and `gAMA`.
///
/// # Errors
/// When the file cannot be written or the picture has no display codes.
pub fn write_still_png(path: &Path, picture: &Picture, about: &About) -> Result<()> {
    let (codes, opaque) = file_codes(path, picture, about.encoding)?;
    let (width, height) = picture.alpha.size();
    write_beside(path, |out| {
        let mut info = png::Info::with_size(width as u32, height as u32);
        info.color_type = if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba };
        let bytes: Vec<u8> = match about.bits {
            Bits::Eight => codes.map(byte_from_unit).collect(),
            Bits::Sixteen => codes.flat_map(|v| word_from_unit(v).to_be_bytes()).collect(),
        };
        info.bit_depth = match about.bits {
            Bits::Eight => png::BitDepth::Eight,
            Bits::Sixteen => png::BitDepth::Sixteen,
        };
        let mut encoder = png::Encoder::with_info(out, info).map_err(io::Error::other)?;
        let cicp = color_chunks(&mut encoder, about.encoding);
        if let Some(provenance) = about.provenance {
            let added = encoder.add_text_chunk(PROVENANCE.to_owned(), provenance.to_owned());
            added.map_err(io::Error::other)?;
        }
        let mut writer = encoder.write_header().map_err(png_error)?;
        if let Some([primaries, transfer]) = cicp {
            let content = [primaries, transfer, 0, 1];
            (writer.write_chunk(ChunkType(*b"cICP"), &content)).map_err(png_error)?;
        }
        writer.write_image_data(&bytes).map_err(png_error)?;
        writer.finish().map_err(png_error)
    })
}

/// Says in which colour space the codes are; returns what `cICP` is to say, if there is to be one.
fn color_chunks<W: io::Write>(encoder: &mut png::Encoder<W>, encoding: &Encoding) -> Option<[u8; 2]> {
    if encoding.is_untagged() {
        return None;
    }
    let space = match encoding.space {
        None | Some(OutputSpace::Srgb) => {
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            return None;
        }
        Some(space) => space,
    };
    let Primaries { red, green, blue, white } = space.primaries().primaries();
    let at = |[x, y]: [f64; 2]| (x as f32, y as f32);
    encoder.set_source_chromaticities(png::SourceChromaticities::new(at(white), at(red), at(green), at(blue)));
    // What decoders go by that know no cICP: the curve of sRGB is nearest to a power of 2.2.
    let power = if space == OutputSpace::P3 { 2.2 } else { 2.4 };
    encoder.set_source_gamma(png::ScaledFloat::new(1.0 / power));
    Some(space.code_points())
}

/// The system's own error, so that a full disk is told as one.
pub(super) fn png_error(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(e) => e,
        other => io::Error::other(other),
    }
}

/// Writes the display codes in 16 bits as a TIFF, compressed without loss: RGB, or RGBA with straight alpha where the
/// picture is not opaque.
///
/// # Errors
/// When the file cannot be written or the picture has no display codes.
fn write_still_tiff(path: &Path, picture: &Picture, about: &About) -> Result<()> {
    let (codes, opaque) = file_codes(path, picture, about.encoding)?;
    let words: Vec<u16> = codes.map(word_from_unit).collect();
    let (width, height) = picture.alpha.size();
    let space = match about.encoding.config() {
        Some(config) => &*config.space,
        None => (about.encoding.space).map_or("sRGB", OutputSpace::name),
    };
    let mut described = format!("Colour space: {space}");
    if let Some(provenance) = about.provenance {
        described += &format!("\n{PROVENANCE}: {provenance}");
    }
    write_beside(path, |out| {
        let write = |out| {
            let compression = Compression::Deflate(DeflateLevel::Balanced);
            let mut file = TiffEncoder::new(out)?.with_compression(compression);
            let mut image = file.new_image::<colortype::RGB16>(width as u32, height as u32)?;
            if !opaque {
                image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?;
            }
            let tags = image.encoder();
            tags.write_tag(Tag::ImageDescription, &*described)?;
            tags.write_tag(Tag::Software, "Afterlight")?;
            image.write_data(&words)
        };
        write(out).map_err(|e| match e {
            tiff::TiffError::IoError(e) => e,
            other => io::Error::other(other),
        })
    })
}

/// A file's codes channel by channel, RGB or RGBA with straight alpha, and whether the picture is opaque.
fn file_codes<'a>(
    path: &Path,
    picture: &'a Picture,
    encoding: &'a Encoding,
) -> Result<(impl Iterator<Item = f32> + 'a, bool)> {
    if picture.display.is_none() {
        return Err(no_display(path));
    }
    let opaque = picture.alpha.pixels.iter().all(|&alpha| alpha >= 1.0);
    let channels = if opaque { 3 } else { 4 };
    let codes = straight(picture, encoding).ok_or_else(|| no_light(path))?;
    let codes = codes.flat_map(move |pixel| pixel.into_iter().take(channels));
    Ok((codes, opaque))
}

/// A 16-bit code of a value in `[0, 1]`, rounded to nearest.
pub(super) fn word_from_unit(value: f32) -> u16 {
    (value.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16
}

/// Codes of a file with straight alpha, all in `[0, 1]`: RGB is divided by alpha in linear light. Where
/// the picture is opaque these are its display codes. None if light is needed and missing.
pub(super) fn straight<'a>(
    picture: &'a Picture,
    encoding: &'a Encoding,
) -> Option<impl Iterator<Item = [f32; 4]> + 'a> {
    let codes = picture.display.as_ref().map(|display| &display.0);
    let light = picture.linear.as_ref();
    let opaque = picture.alpha.pixels.iter().all(|&alpha| alpha >= 1.0);
    let of_file = encoding.codes();
    let of_config = (encoding.config().zip(light)).map(|(config, light)| {
        let divided = light.pixels.iter().zip(&picture.alpha.pixels);
        let divided = divided.map(|(pixel, &alpha)| match alpha {
            1.0.. => *pixel,
            _ if alpha > 0.0 => pixel.map(|v| v / alpha),
            _ => [0.0; 3],
        });
        let mut pixels: Vec<_> = divided.collect();
        config.apply(&mut pixels);
        pixels
    });
    let is_there = match encoding.config() {
        Some(_) => light.is_some(),
        None => light.is_some() || (opaque && codes.is_some()),
    };
    let pixels = (0..picture.alpha.pixels.len()).map(move |i| {
        let alpha = picture.alpha.pixels[i];
        let [r, g, b] = match (&of_config, codes, light) {
            (Some(codes), ..) if alpha > 0.0 => codes[i].map(unit),
            (None, Some(codes), _) if alpha >= 1.0 => of_file(codes.pixels[i]),
            (None, _, Some(light)) if alpha > 0.0 => of_file(code(light.pixels[i].map(|v| v / alpha), picture.view)),
            _ => [0.0; 3],
        };
        [r, g, b, alpha]
    });
    is_there.then_some(pixels)
}

/// Codes of a file without alpha, all in `[0, 1]`: the picture in front of black. None if light is needed and missing.
pub(super) fn over_black(picture: &Picture, encoding: &Encoding) -> Option<Vec<[f32; 3]>> {
    match encoding.config() {
        Some(config) => {
            let light = picture.linear.as_ref()?;
            Some(config.encoded(light).0.pixels)
        }
        None => {
            let codes = picture.display.as_ref()?.0.pixels.iter();
            Some(codes.copied().map(encoding.codes()).collect())
        }
    }
}

/// A picture that was made for a display alone is asked for in linear light.
pub(super) fn no_light(path: &Path) -> Error {
    Error::bug(format!("cannot write {}: the picture was made for a display, not in linear light", path.display()))
}

/// A picture that was made in linear light is asked for in display codes.
pub(super) fn no_display(path: &Path) -> Error {
    Error::bug(format!("cannot write {}: the picture was made in linear light, not for a display", path.display()))
}

#[cfg(test)]
#[path = "still_tests.rs"]
pub(super) mod tests;
