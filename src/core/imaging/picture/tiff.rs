//! TIFF that the `image` crate misreads: floating point, more than 16 bits, and planes one after the other.

use super::profile::{self, Named};
use super::properties::About;
use super::source::{Source, broken};
use super::whole::Picture;
use super::{decoded, raw};
use crate::limits::{MAX_DECODER_BYTES, check_size};
use base::error::{Error, Result};
use half::f16;
use image::metadata::Orientation;
use image::{ColorType as ImageColor, DynamicImage, ImageBuffer};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, SampleFormat, Tag};

/// A TIFF that is read here.
pub(super) struct Special {
    /// Columns and rows as stored.
    stored: (usize, usize),
    /// Samples of a pixel, and those that are used: 1 to 4.
    samples: (usize, usize),
    /// Floating point.
    is_light: bool,
    is_planar: bool,
    is_inverted: bool,
    orientation: Orientation,
}

/// The file, if it is a TIFF of these kinds.
///
/// # Errors
/// When it is a TIFF of a kind that cannot be read.
pub(super) fn open(source: &mut Source) -> Result<Option<Special>> {
    let mut magic = [0; 4];
    let read = source.file.read_exact(&mut magic);
    source.file.seek(SeekFrom::Start(0)).map_err(|e| source.broken(e))?;
    if read.is_err() || !raw::is_tiff(&magic) {
        return Ok(None);
    }
    let special = layout(source.path, decoder(source)?)?;
    source.file.seek(SeekFrom::Start(0)).map_err(|e| source.broken(e))?;
    Ok(special)
}

fn decoder<'f>(source: &'f mut Source) -> Result<Decoder<&'f mut BufReader<File>>> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_DECODER_BYTES as usize;
    limits.intermediate_buffer_size = MAX_DECODER_BYTES as usize;
    let path = source.path;
    let decoder = Decoder::new(&mut source.file).map_err(|e| broken(path, e))?;
    Ok(decoder.with_limits(limits))
}

/// ICC profile of a TIFF: the `image` crate finds none that is larger than the picture.
pub(super) fn icc(source: &mut Source) -> Option<Vec<u8>> {
    let found = decoder(source).ok().and_then(|mut tiff| tiff.get_tag_u8_vec(Tag::IccProfile).ok());
    source.file.seek(SeekFrom::Start(0)).ok()?;
    found
}

fn layout(path: &Path, mut decoder: Decoder<&mut BufReader<File>>) -> Result<Option<Special>> {
    let mut tag = |tag: Tag| decoder.find_tag_unsigned::<u16>(tag).ok().flatten();
    if tag(Tag::Compression).map(CompressionMethod::from_u16_exhaustive) == Some(CompressionMethod::ZSTD) {
        return Err(Error::invalid(
            format!("{} is compressed with ZSTD, which is not read", path.display()),
            "Write it with Deflate or LZW: oiiotool IN.tif --compression zip -o OUT.tif",
        ));
    }
    let is_planar = tag(Tag::PlanarConfiguration) == Some(2);
    let is_inverted = tag(Tag::PhotometricInterpretation) == Some(PhotometricInterpretation::WhiteIsZero.to_u16());
    let orientation = tag(Tag::Orientation)
        .and_then(|value| Orientation::from_exif(value as u8))
        .unwrap_or(Orientation::NoTransforms);
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).ok().flatten();
    let format = formats.as_ref().and_then(|all| all.first().copied()).unwrap_or(1);
    let (width, height) = decoder.dimensions().map_err(|e| broken(path, e))?;
    let color = decoder.colortype().map_err(|e| broken(path, e))?;
    if format == SampleFormat::Int.to_u16() {
        return Err(Error::invalid(
            format!("{} has signed samples, which are not read", path.display()),
            "Write it with unsigned samples of 16 bits, or as floating point",
        ));
    }
    let is_light = format == SampleFormat::IEEEFP.to_u16();
    let is_uint = format == SampleFormat::Uint.to_u16();
    let several = color.num_samples() > 1;
    if is_uint && color.bit_depth() <= 16 && !(is_planar && several) {
        return Ok(None);
    }
    let samples = usize::from(color.num_samples());
    let used = match color {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        ColorType::Multiband { num_samples, .. } => usize::from(num_samples).min(3),
        other => {
            return Err(Error::invalid(
                format!("{} has the colours {other:?}, which are not read", path.display()),
                "Write it as RGB with 16 bits",
            ));
        }
    };
    let used = if color.bit_depth() < 8 { samples.min(1) } else { used };
    let stored = (width as usize, height as usize);
    check_size(stored).map_err(|e| broken(path, e))?;
    let samples = (samples, used);
    Ok(Some(Special { stored, samples, is_light, is_planar, is_inverted, orientation }))
}

impl Special {
    /// Columns and rows, turned.
    pub fn size(&self) -> (usize, usize) {
        decoded::turned(self.stored, self.orientation)
    }

    /// Properties of the picture, and its colour.
    pub fn about(&self, source: &mut Source) -> Result<(About, Option<Named>)> {
        let icc = decoder(source)?.get_tag_u8_vec(Tag::IccProfile).ok();
        let named = icc.map(|bytes| profile::icc(&bytes)).transpose();
        let used = self.samples.1;
        let color = match (self.is_light, used) {
            (true, 2 | 4) => ImageColor::Rgba32F,
            (true, _) => ImageColor::Rgb32F,
            (false, 1) => ImageColor::L16,
            (false, 2) => ImageColor::La16,
            (false, 3) => ImageColor::Rgb16,
            (false, _) => ImageColor::Rgba16,
        };
        Ok(decoded::describe(source.path, "TIFF", self.stored, color, named, self.orientation))
    }

    pub fn read(&self, source: &mut Source) -> Result<Picture> {
        let path = source.path;
        let (about, named) = self.about(source)?;
        source.file.seek(SeekFrom::Start(0)).map_err(|e| broken(path, e))?;
        let mut decoder = decoder(source)?;
        let mut result = DecodingResult::U8(Vec::new());
        decoder.read_image_to_buffer(&mut result).map_err(|e| broken(path, e))?;
        let unsigned = |share: f64| if self.is_inverted { 1.0 - share } else { share };
        let code = |share: f64| (65535.0 * unsigned(share)).round() as u16;
        let picture = match result {
            DecodingResult::U8(v) => self.codes(&v, |v| code(f64::from(v) / 255.0)),
            DecodingResult::U16(v) => self.codes(&v, |v| code(f64::from(v) / 65535.0)),
            DecodingResult::U32(v) => self.codes(&v, |v| code(f64::from(v) / f64::from(u32::MAX))),
            DecodingResult::U64(v) => self.codes(&v, |v| code(v as f64 / u64::MAX as f64)),
            DecodingResult::F16(v) => self.light(&v, f16::to_f32),
            DecodingResult::F32(v) => self.light(&v, |v| v),
            DecodingResult::F64(v) => self.light(&v, |v| v as f32),
            _ => return Err(broken(path, "its samples are signed")),
        };
        let picture = picture.ok_or_else(|| broken(path, "it ends before its pixels"))?;
        Ok(decoded::finish(about, named, picture, self.orientation))
    }

    /// Used samples pixel by pixel; None if some are missing.
    fn pixels<T: Copy, U>(&self, all: &[T], value: impl Fn(T) -> U) -> Option<Vec<U>> {
        let (width, height) = self.stored;
        let (samples, used) = self.samples;
        let pixels = width * height;
        if all.len() < pixels * samples {
            return None;
        }
        let at = |pixel: usize, sample: usize| {
            if self.is_planar { sample * pixels + pixel } else { pixel * samples + sample }
        };
        let each = (0..pixels).flat_map(|pixel| (0..used).map(move |sample| (pixel, sample)));
        Some(each.map(|(pixel, sample)| value(all[at(pixel, sample)])).collect())
    }

    fn codes<T: Copy>(&self, all: &[T], code: impl Fn(T) -> u16) -> Option<DynamicImage> {
        let (width, height) = (self.stored.0 as u32, self.stored.1 as u32);
        let codes = self.pixels(all, code)?;
        match self.samples.1 {
            1 => ImageBuffer::from_raw(width, height, codes).map(DynamicImage::ImageLuma16),
            2 => ImageBuffer::from_raw(width, height, codes).map(DynamicImage::ImageLumaA16),
            3 => ImageBuffer::from_raw(width, height, codes).map(DynamicImage::ImageRgb16),
            _ => ImageBuffer::from_raw(width, height, codes).map(DynamicImage::ImageRgba16),
        }
    }

    fn light<T: Copy>(&self, all: &[T], light: impl Fn(T) -> f32) -> Option<DynamicImage> {
        let (width, height) = (self.stored.0 as u32, self.stored.1 as u32);
        let used = self.samples.1;
        let values = self.pixels(all, light)?;
        let rgb = |pixel: &[f32]| if used < 3 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] };
        let pixels = values.chunks_exact(used);
        if used.is_multiple_of(2) {
            let values = pixels.flat_map(|pixel| {
                let [r, g, b] = rgb(pixel);
                [r, g, b, pixel[used - 1]]
            });
            ImageBuffer::from_raw(width, height, values.collect()).map(DynamicImage::ImageRgba32F)
        } else {
            let values = pixels.flat_map(rgb);
            ImageBuffer::from_raw(width, height, values.collect()).map(DynamicImage::ImageRgb32F)
        }
    }
}
