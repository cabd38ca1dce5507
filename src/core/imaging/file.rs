//! Picture files: PNG, JPEG and TIFF as encoded values, EXR and Radiance HDR as linear light.

pub use super::limits::{MAX_PIXELS, check_openexr};

use super::color::byte_from_unit;
use super::limits::{MAX_DECODER_BYTES, check_size};
use super::picture;
use super::raster::{Encoded, Image, Mask};
use base::FileFormat;
use base::error::{Error, Result};
use base::files::write_beside;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

const REMEDY: &str = "Check that the file is there and is a complete picture";

/// Decodes a picture in memory: columns and rows, and three 8-bit codes per pixel.
///
/// # Errors
/// When it cannot be decoded.
pub fn codes_from_memory(file: &[u8]) -> Result<((usize, usize), Vec<u8>)> {
    let damaged = |cause: String| Error::invalid(format!("a picture: {cause}"), REMEDY);
    let reader = ImageReader::new(Cursor::new(file)).with_guessed_format();
    let mut reader = reader.map_err(|e| damaged(e.to_string()))?;
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| damaged(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    let size = (width as usize, height as usize);
    check_size(size).map_err(damaged)?;
    let picture = image::DynamicImage::from_decoder(decoder).map_err(|e| damaged(e.to_string()))?;
    Ok((size, picture.into_rgb8().into_raw()))
}

/// A picture as 16-bit codes: three per pixel, or four with alpha, row by row from the top left.
pub struct Codes {
    /// Columns and rows.
    pub size: (usize, usize),
    /// The fourth of four codes is alpha.
    pub has_alpha: bool,
    /// The codes, from 0 to 65535.
    pub codes: Vec<u16>,
}

/// The picture of this path without an ending: the file of a format that is read, its ending in lower or upper case; `.png` if there
/// is none.
pub fn with_ending(path: &Path) -> PathBuf {
    let with = |ending: &str| {
        let mut name = path.as_os_str().to_os_string();
        name.push(".");
        name.push(ending);
        PathBuf::from(name)
    };
    let png = with("png");
    // Most pictures are PNGs, and folders without pictures need no search.
    if png.is_file() || !path.parent().is_some_and(Path::is_dir) {
        return png;
    }
    let endings = FileFormat::extensions(FileFormat::is_picture);
    let spelled = endings.iter().flat_map(|ending| [with(ending), with(&ending.to_uppercase())]);
    spelled.into_iter().find(|file| file.is_file()).unwrap_or(png)
}

/// Reads a picture as encoded values in `[0, 1]`, without alpha: [`read_codes`].
///
/// # Errors
/// As [`picture::read`].
pub fn read_encoded(path: &Path) -> Result<Encoded> {
    Ok(picture::read(path)?.into_encoded())
}

/// Reads a picture as 16-bit codes: as stored if the file names no curve or sRGB. Other light is encoded as sRGB and
/// clipped at 1.
///
/// # Errors
/// As [`picture::read`].
pub fn read_codes(path: &Path) -> Result<Codes> {
    let picture = picture::read(path)?;
    let size = picture.size();
    let (codes, has_alpha) = picture.into_codes();
    Ok(Codes { size, has_alpha, codes })
}

/// Reads a picture as scene-linear Rec. 709, from sRGB if the file names no curve. NaN and infinities are unchanged.
///
/// # Errors
/// As [`picture::read`].
pub fn read_linear(path: &Path) -> Result<Image> {
    Ok(picture::read(path)?.into_light())
}

/// Reads a matte as linear coverage in `[0, 1]`: alpha if that varies, otherwise brightness.
///
/// # Errors
/// As [`picture::read`].
pub fn read_mask(path: &Path) -> Result<Mask> {
    Ok(picture::read(path)?.into_matte())
}

/// Reads a picture's alpha as linear coverage in `[0, 1]`: 1 everywhere if it has none.
///
/// # Errors
/// As [`picture::read`].
pub fn read_alpha(path: &Path) -> Result<Mask> {
    Ok(picture::read(path)?.into_alpha())
}

/// Width and height without decoding the pixels, turned as the file asks.
///
/// # Errors
/// As [`picture::read`].
pub fn dimensions(path: &Path) -> Result<(usize, usize)> {
    picture::dimensions(path)
}

/// Writes encoded values as an 8-bit RGB PNG.
pub fn write_png(path: &Path, picture: &Encoded) -> Result<()> {
    let codes = rgb_bytes(picture);
    write_png_bytes(path, picture.0.size(), &codes, ExtendedColorType::Rgb8)
}

/// An 8-bit RGB PNG in memory.
///
/// # Errors
/// When the picture has no pixel.
pub fn png_bytes(picture: &Encoded) -> Result<Vec<u8>> {
    let (width, height) = picture.0.size();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&rgb_bytes(picture), width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(|e| {
            Error::invalid(
                format!("a picture of {width} × {height} pixels cannot be a PNG: {e}"),
                "Choose another size",
            )
        })?;
    Ok(bytes)
}

/// An 8-bit RGB JPEG in memory, with a quality from 1 to 100.
///
/// # Errors
/// When the picture has no pixel, or more than 65,535 on a side.
pub fn jpeg_bytes(picture: &Encoded, quality: u8) -> Result<Vec<u8>> {
    let (width, height) = picture.0.size();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality.clamp(1, 100))
        .write_image(&rgb_bytes(picture), width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(|e| {
            Error::invalid(
                format!("a picture of {width} × {height} pixels cannot be a JPEG: {e}"),
                "Choose another size",
            )
        })?;
    Ok(bytes)
}

fn rgb_bytes(picture: &Encoded) -> Vec<u8> {
    let codes = picture.0.pixels.iter().flatten();
    codes.map(|&v| byte_from_unit(v)).collect()
}

/// Writes coverage as an 8-bit grey PNG.
pub fn write_mask_png(path: &Path, mask: &Mask) -> Result<()> {
    let bytes: Vec<u8> = mask.pixels.iter().map(|&v| byte_from_unit(v)).collect();
    write_png_bytes(path, mask.size(), &bytes, ExtendedColorType::L8)
}

fn write_png_bytes(path: &Path, (width, height): (usize, usize), bytes: &[u8], color: ExtendedColorType) -> Result<()> {
    write_beside(path, |out| {
        PngEncoder::new(out).write_image(bytes, width as u32, height as u32, color).map_err(io_error)
    })
}

/// Writes scene-linear RGB as a half-float, ZIP-compressed OpenEXR picture. Values beyond the range
/// of half floats are clipped to ±65504.
pub fn write_exr(path: &Path, picture: &Image) -> Result<()> {
    use exr::prelude::*;
    let half = |v: f32| f16::from_f32(v.clamp(-65504.0, 65504.0));
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = picture.at(at.x(), at.y());
        (half(r), half(g), half(b))
    });
    // Scan lines in order: the same picture gives the same bytes.
    let encoding = Encoding::SMALL_LOSSLESS;
    let layer = Layer::new(picture.size(), LayerAttributes::default(), encoding, channels);
    let mut bytes = Vec::new();
    exr::prelude::Image::from_layer(layer)
        .write()
        .to_buffered(std::io::Cursor::new(&mut bytes))
        .map_err(|e| base::error::Error::codec("encode", path, e, "Check the size of the picture"))?;
    write_beside(path, |out| out.write_all(&bytes))
}

/// An encoder's failure to write, for [`base::files::write_beside`].
pub fn io_error(error: image::ImageError) -> std::io::Error {
    match error {
        image::ImageError::IoError(e) => e,
        other => std::io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    #[test]
    fn pictures_come_back_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let linear = Raster::from_fn(5, 3, |x, y| [x as f32 * 0.25, y as f32 * 4.0, 70_000.0]);
        let path = folder.path().join("new/linear.exr");
        write_exr(&path, &linear).unwrap();
        assert_eq!(read_linear(&path).unwrap(), linear.map(|[r, g, _]| [r, g, 65504.0]));

        let encoded = Encoded(Raster::from_fn(4, 2, |x, y| [x as f32 / 3.0, y as f32, 0.2]));
        let path = folder.path().join("encoded.png");
        write_png(&path, &encoded).unwrap();
        assert_eq!(dimensions(&path).unwrap(), (4, 2));
        assert_eq!(read_encoded(&path).unwrap(), encoded);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_file_that_is_no_picture_is_named_in_the_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.png");
        std::fs::write(&path, b"not a picture").unwrap();
        assert!(read_encoded(&path).unwrap_err().to_string().contains("broken.png"));
    }

    #[test]
    fn a_small_file_that_claims_a_huge_picture_is_refused_before_memory_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("claims.hdr");
        let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
        std::fs::write(&path, header).unwrap();
        let said = read_linear(&path).unwrap_err().to_string();
        assert!(said.contains("claims.hdr") && said.contains("60000 × 60000"), "{said}");
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_no_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        for said in [read_encoded(&path).unwrap_err(), dimensions(&path).unwrap_err()] {
            assert!(said.to_string().contains("device"), "{said}");
        }
    }
}
