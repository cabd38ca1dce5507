//! One reading of a picture file, by its content: how it is turned, its colour, its coverage, and how each is known.
//!
//! [`stream`] passes light on line by line: a panorama of 16384 × 8192 is 1.6 GB of it. [`read`] keeps a whole picture,
//! codes as codes.

mod coded;
mod exif;
mod mended;
mod openexr;
mod profile;
mod radiance;
mod raw;
mod tiff;

use crate::color::{linear_from_srgb, luminance, srgb_from_linear, unit};
use crate::file::MAX_PIXELS;
use crate::raster::{Encoded, Image, Mask, Raster};
use base::error::{Error, Result};
use base::files;
use image::DynamicImage;
pub use openexr::choose_layer;
use profile::Named;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

/// Largest half float.
const HALF_MAX: f32 = 65504.0;
const REMEDY: &str = "Check that the file is there and is a complete picture";

/// Properties of a picture, known before its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Columns and rows, turned as the file asks.
    pub size: (usize, usize),
    /// Name of the format, such as `PNG`.
    pub format: &'static str,
    pub coding: Coding,
    /// True if the file stores coverage.
    pub has_alpha: bool,
    /// Bits of a sample.
    pub bits: u8,
    /// Name of the layer that was read, of several with colours; None if it has none, or there is one layer.
    pub layer: Option<String>,
    /// Source of the turn that was applied, such as `EXIF`; None if the picture is as stored.
    pub turned_by: Option<&'static str>,
    /// True if light was brought from other primaries to Rec. 709, where some of it may be negative.
    pub is_converted: bool,
    /// False if parts of the picture are not in the file: they are black.
    pub is_whole: bool,
    /// Sentences about guesses, conversions and omissions; none for an ordinary picture.
    pub notes: Vec<String>,
}

/// Meaning of a file's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Linear light, of primaries that the file names or else Rec. 709.
    Light(Option<Origin>),
    /// Codes of the curve and primaries that the file names.
    Named(Origin),
    /// Codes of a curve that the file leaves open: a camera's, or sRGB.
    Open,
}

/// A colour with its source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Name, such as `Display P3`.
    pub name: String,
    /// Part of the file that names it, such as `its ICC profile`.
    pub by: &'static str,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} by {}", self.name, self.by)
    }
}

impl About {
    /// Format, depth, colour and turn, such as `PNG, 16 bits, Display P3 by its ICC profile, turned by EXIF`.
    pub fn sentence(&self) -> String {
        let coding = match &self.coding {
            Coding::Light(None) => "scene-linear".to_owned(),
            Coding::Light(Some(origin)) => format!("scene-linear, {origin}"),
            Coding::Named(origin) => origin.to_string(),
            Coding::Open => "curve not named".to_owned(),
        };
        let turned = self.turned_by.map_or(String::new(), |by| format!(", turned by {by}"));
        let layer = self.layer.as_ref().map_or(String::new(), |name| format!(", layer \"{name}\""));
        format!("{}, {} bits{layer}, {coding}{turned}", self.format, self.bits)
    }
}

/// Receiver of a picture's light.
pub trait Sink {
    /// Called once, before any pixel. False ends the reading.
    ///
    /// # Errors
    /// When the picture does not fit.
    fn begin(&mut self, about: &About) -> Result<bool>;

    /// Light of row `y` from column `x` on: linear Rec. 709, and its coverage if the file has any (else empty).
    fn run(&mut self, x: usize, y: usize, light: &[[f32; 3]], alpha: &[f32]);

    /// True if the picture is the file's data window instead of its display window; sizes of both.
    fn takes_data_window(&self, _data: (usize, usize), _display: (usize, usize)) -> bool {
        false
    }
}

/// A file that is being read.
struct Source<'a> {
    path: &'a Path,
    file: BufReader<File>,
}

impl Source<'_> {
    /// Error of a damaged file.
    fn broken(&self, cause: impl std::fmt::Display) -> Error {
        broken(self.path, cause)
    }
}

fn broken(path: &Path, cause: impl std::fmt::Display) -> Error {
    Error::codec("read", path, cause, REMEDY)
}

/// Formats that are told apart by their first bytes.
enum Format {
    Radiance,
    OpenExr,
    /// PNG, JPEG, TIFF and others that the `image` crate reads.
    Coded,
}

fn open(path: &Path) -> Result<(Source<'_>, Format)> {
    let fail = |e: std::io::Error| Error::io("open", path, e, REMEDY);
    let mut file = BufReader::with_capacity(1 << 18, files::open(path).map_err(fail)?);
    let mut head = [0; 32];
    let mut known = 0;
    while known < head.len() {
        match file.read(&mut head[known..]).map_err(fail)? {
            0 => break,
            count => known += count,
        }
    }
    file.rewind().map_err(fail)?;
    raw::refuse(path, &head[..known], &mut file)?;
    file.rewind().map_err(fail)?;
    let format = match &head[..known] {
        [b'#', b'?', ..] => Format::Radiance,
        [0x76, 0x2f, 0x31, 0x01, ..] => Format::OpenExr,
        _ => Format::Coded,
    };
    Ok((Source { path, file }, format))
}

/// Passes a picture's light to `sink`, in any order.
///
/// # Errors
/// When the file cannot be read, is a camera's raw file, or has no colour or grey; and those of `sink`.
pub fn stream(path: &Path, sink: &mut dyn Sink) -> Result<()> {
    let (source, format) = open(path)?;
    match format {
        Format::Radiance => radiance::stream(source, sink),
        Format::OpenExr => openexr::stream(source, sink),
        Format::Coded => coded::read(source)?.stream(sink),
    }
}

/// Properties of a picture, without decoding pixels where the format allows.
///
/// # Errors
/// As [`stream`].
pub fn about(path: &Path) -> Result<About> {
    /// Ends the reading before the pixels.
    struct Header(Option<About>);
    impl Sink for Header {
        fn begin(&mut self, about: &About) -> Result<bool> {
            self.0 = Some(about.clone());
            Ok(false)
        }
        fn run(&mut self, _: usize, _: usize, _: &[[f32; 3]], _: &[f32]) {}
    }
    let (source, format) = open(path)?;
    let mut header = Header(None);
    match format {
        Format::Radiance => radiance::stream(source, &mut header)?,
        Format::OpenExr => openexr::stream(source, &mut header)?,
        Format::Coded => return coded::about(source),
    }
    header.0.ok_or_else(|| broken(path, "it has no header"))
}

/// Columns and rows as [`read`] gives them.
///
/// # Errors
/// As [`stream`].
pub fn dimensions(path: &Path) -> Result<(usize, usize)> {
    let (source, format) = open(path)?;
    match format {
        Format::Coded => coded::dimensions(source),
        _ => Ok(about(path)?.size),
    }
}

/// Names of a file's layers with colours, the finished picture first; empty unless there are several.
///
/// # Errors
/// When the file cannot be read.
pub fn layers(path: &Path) -> Result<Vec<String>> {
    match open(path)? {
        (source, Format::OpenExr) => openexr::layers(source),
        _ => Ok(Vec::new()),
    }
}

/// A whole picture.
pub struct Picture {
    pub about: About,
    content: Content,
}

enum Content {
    /// Codes with their colour: sRGB if None.
    Codes(DynamicImage, Option<Named>),
    Light(Image, Option<Mask>),
}

/// Reads a whole picture.
///
/// # Errors
/// As [`stream`], and when it has more than [`MAX_PIXELS`].
pub fn read(path: &Path) -> Result<Picture> {
    let (source, format) = open(path)?;
    let mut whole = Whole { path, picture: None };
    match format {
        Format::Radiance => radiance::stream(source, &mut whole)?,
        Format::OpenExr => openexr::stream(source, &mut whole)?,
        Format::Coded => return coded::read(source),
    }
    whole.picture.ok_or_else(|| broken(path, "it ends before its pixels"))
}

/// Keeps what is streamed.
struct Whole<'a> {
    path: &'a Path,
    picture: Option<Picture>,
}

impl Sink for Whole<'_> {
    fn begin(&mut self, about: &About) -> Result<bool> {
        let (width, height) = about.size;
        check_size(about.size).map_err(|cause| broken(self.path, cause))?;
        // Pixels that the file leaves out are black, and nothing covers them.
        let alpha = about.has_alpha.then(|| Mask::filled(width, height, 0.0));
        let light = Image::filled(width, height, [0.0; 3]);
        self.picture =
            Some(Picture { about: about.clone(), content: Content::Light(light, alpha) });
        Ok(true)
    }

    fn run(&mut self, x: usize, y: usize, light: &[[f32; 3]], alpha: &[f32]) {
        let Some(Picture { content: Content::Light(image, mask), .. }) = &mut self.picture else {
            return;
        };
        let at = y * image.width + x;
        image.pixels[at..][..light.len()].copy_from_slice(light);
        if let Some(mask) = mask {
            mask.pixels[at..][..alpha.len()].copy_from_slice(alpha);
        }
    }
}

/// Refuses pictures that would take too much memory, or none.
pub(crate) fn check_size((width, height): (usize, usize)) -> std::result::Result<(), String> {
    match width.checked_mul(height) {
        Some(0) => Err("it has no pixels".to_owned()),
        Some(pixels) if pixels <= MAX_PIXELS => Ok(()),
        _ => Err(format!(
            "it claims to have {width} × {height} pixels, and at most {MAX_PIXELS} are read"
        )),
    }
}

impl Picture {
    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.about.size
    }

    /// Linear Rec. 709. Codes without a named curve are taken for sRGB. Light from other primaries may be negative; NaN
    /// and infinities are passed on.
    pub fn into_light(self) -> Image {
        let (width, height) = self.about.size;
        match self.content {
            Content::Light(light, _) => light,
            Content::Codes(codes, named) => {
                let decode = decoder(named.as_ref());
                let rgb = codes.into_rgb16().into_raw();
                let pixels = rgb.as_chunks::<3>().0.iter().map(|pixel| decode(*pixel)).collect();
                Image { width, height, pixels }
            }
        }
    }

    /// Scene-linear light of a file that says so, for a camera's pictures: not negative, NaN and infinities filled from their
    /// neighbours, with the number of pixels so mended. A file of codes comes back.
    ///
    /// # Errors
    /// The picture, if it has codes.
    pub fn into_scene_light(self) -> std::result::Result<(Image, usize), Box<Self>> {
        if !matches!(self.about.coding, Coding::Light(_)) {
            return Err(Box::new(self));
        }
        let mut light = self.into_light();
        let mended = mended::fill(&mut light);
        for pixel in &mut light.pixels {
            *pixel = pixel.map(|v| if v > 0.0 { v.min(HALF_MAX) } else { 0.0 });
        }
        Ok((light, mended))
    }

    /// Three codes of 16 bits for each pixel, or four with alpha: as stored if the file names no curve or sRGB. Otherwise
    /// its light encoded as sRGB and cut at 1.
    pub fn into_codes(self) -> (Vec<u16>, bool) {
        let has_alpha = self.about.has_alpha;
        let code = |v: f32| (65535.0 * v.clamp(0.0, 1.0)).round() as u16;
        let encoded = |light: [f32; 3]| light.map(|v| code(srgb_from_linear(v)));
        let codes = match self.content {
            Content::Codes(codes, named) => {
                let mut codes = if has_alpha {
                    codes.into_rgba16().into_raw()
                } else {
                    codes.into_rgb16().into_raw()
                };
                if let Some(named) = named.filter(|named| named.profile.is_some()) {
                    let decode = decoder(Some(&named));
                    for pixel in codes.chunks_exact_mut(3 + usize::from(has_alpha)) {
                        let rgb = encoded(decode([pixel[0], pixel[1], pixel[2]]));
                        pixel[..3].copy_from_slice(&rgb);
                    }
                }
                codes
            }
            Content::Light(light, None) => light.pixels.into_iter().flat_map(encoded).collect(),
            Content::Light(light, Some(alpha)) => {
                let pixels = light.pixels.into_iter().zip(alpha.pixels);
                let four = pixels.flat_map(|(light, alpha)| {
                    let [r, g, b] = encoded(light);
                    [r, g, b, code(alpha)]
                });
                four.collect()
            }
        };
        (codes, has_alpha)
    }

    /// [`Self::into_codes`] in `[0, 1]`, without alpha.
    pub fn into_encoded(self) -> Encoded {
        let (width, height) = self.about.size;
        let (codes, has_alpha) = self.into_codes();
        let pixels = codes.chunks_exact(3 + usize::from(has_alpha));
        let pixels = pixels.map(|p| [p[0], p[1], p[2]].map(|v| f32::from(v) / 65535.0)).collect();
        Encoded(Raster { width, height, pixels })
    }

    /// Coverage in `[0, 1]`: 1 everywhere in a file without alpha.
    pub fn into_alpha(self) -> Mask {
        let (width, height) = self.about.size;
        let full = || Mask::filled(width, height, 1.0);
        match self.content {
            Content::Light(_, alpha) => alpha.unwrap_or_else(full),
            Content::Codes(codes, _) if self.about.has_alpha => {
                let codes = codes.into_rgba16();
                let pixels = codes.pixels().map(|p| f32::from(p.0[3]) / 65535.0).collect();
                Mask { width, height, pixels }
            }
            Content::Codes(..) => full(),
        }
    }

    /// Coverage that a matte's picture shows, in `[0, 1]`: its alpha wherever that varies, otherwise its stored brightness.
    pub fn into_matte(self) -> Mask {
        let (width, height) = self.about.size;
        let varies = |mask: &Mask| {
            let first = mask.pixels.first().copied().unwrap_or_default();
            mask.pixels.iter().any(|v| (v - first).abs() > 1e-3)
        };
        match self.content {
            Content::Light(_, Some(alpha)) if varies(&alpha) => alpha,
            Content::Light(light, _) => light.map(|pixel| unit(luminance(pixel))),
            Content::Codes(codes, _) => {
                if self.about.has_alpha {
                    let pixels = codes.to_rgba16();
                    let pixels = pixels.pixels().map(|p| f32::from(p.0[3]) / 65535.0).collect();
                    let alpha = Mask { width, height, pixels };
                    if varies(&alpha) {
                        return alpha;
                    }
                }
                let pixels = codes.into_luma16().into_raw();
                let pixels = pixels.into_iter().map(|v| f32::from(v) / 65535.0).collect();
                Mask { width, height, pixels }
            }
        }
    }

    /// Passes its light on, row by row.
    fn stream(self, sink: &mut dyn Sink) -> Result<()> {
        if !sink.begin(&self.about)? {
            return Ok(());
        }
        let (width, height) = self.about.size;
        let has_alpha = self.about.has_alpha;
        match self.content {
            Content::Light(light, alpha) => {
                for y in 0..height {
                    let row = y * width..(y + 1) * width;
                    let alpha = alpha.as_ref().map_or(&[][..], |mask| &mask.pixels[row.clone()]);
                    sink.run(0, y, &light.pixels[row], alpha);
                }
            }
            Content::Codes(codes, named) => {
                let decode = decoder(named.as_ref());
                let channels = 3 + usize::from(has_alpha);
                let wide = codes.color().bytes_per_pixel() > codes.color().channel_count();
                let mut row = vec![[0.0; 3]; width];
                let mut alphas = vec![0.0; if has_alpha { width } else { 0 }];
                let mut pass = |y: usize, line: &mut dyn Iterator<Item = u16>| {
                    for x in 0..width {
                        let mut next = || line.next().unwrap_or_default();
                        row[x] = decode([next(), next(), next()]);
                        if channels == 4 {
                            alphas[x] = f32::from(next()) / 65535.0;
                        }
                    }
                    sink.run(0, y, &row, &alphas);
                };
                if wide {
                    let raw = if has_alpha {
                        codes.into_rgba16().into_raw()
                    } else {
                        codes.into_rgb16().into_raw()
                    };
                    for (y, line) in raw.chunks_exact(channels * width).enumerate() {
                        pass(y, &mut line.iter().copied());
                    }
                } else {
                    let raw = if has_alpha {
                        codes.into_rgba8().into_raw()
                    } else {
                        codes.into_rgb8().into_raw()
                    };
                    for (y, line) in raw.chunks_exact(channels * width).enumerate() {
                        // The same share of white in 16 bits.
                        pass(y, &mut line.iter().map(|&code| u16::from(code) * 257));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Linear Rec. 709 of 16-bit codes.
fn decoder(named: Option<&Named>) -> impl Fn([u16; 3]) -> [f32; 3] + '_ {
    let profile = named.and_then(|named| named.profile.as_ref());
    let table: Vec<f32> = match profile {
        Some(_) => Vec::new(),
        None => (0..=u16::MAX).map(|code| linear_from_srgb(f32::from(code) / 65535.0)).collect(),
    };
    move |codes| match profile {
        Some(profile) => profile.light(codes.map(|code| f32::from(code) / 65535.0)),
        None => codes.map(|code| table[usize::from(code)]),
    }
}
