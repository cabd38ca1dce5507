//! A whole picture in memory, codes as codes.

use super::mended;
use super::profile::Named;
use super::properties::{About, Coding, Sink};
use super::source::broken;
use crate::color::{linear_from_srgb, luminance, srgb_from_linear, unit};
use crate::limits::check_size;
use crate::raster::{Encoded, Image, Mask, Raster};
use base::error::Result;
use image::DynamicImage;
use std::path::Path;

/// Largest half float.
const HALF_MAX: f32 = 65504.0;

/// A whole picture.
pub struct Picture {
    pub about: About,
    pub(super) content: Content,
}

pub(super) enum Content {
    /// Codes with their colour: sRGB if None.
    Codes(DynamicImage, Option<Named>),
    Light(Image, Option<Mask>),
}

/// Keeps what is streamed.
pub(super) struct Whole<'a> {
    pub path: &'a Path,
    pub picture: Option<Picture>,
}

impl Sink for Whole<'_> {
    fn begin(&mut self, about: &About) -> Result<bool> {
        let (width, height) = about.size;
        check_size(about.size).map_err(|cause| broken(self.path, cause))?;
        // Pixels that the file leaves out are black, and nothing covers them.
        let alpha = about.has_alpha.then(|| Mask::filled(width, height, 0.0));
        let light = Image::filled(width, height, [0.0; 3]);
        self.picture = Some(Picture { about: about.clone(), content: Content::Light(light, alpha) });
        Ok(true)
    }

    fn run(&mut self, x: usize, y: usize, light: &[[f32; 3]], alpha: &[f32]) {
        let Some(Picture { content: Content::Light(image, mask), .. }) = &mut self.picture else { return };
        let at = y * image.width + x;
        image.pixels[at..][..light.len()].copy_from_slice(light);
        if let Some(mask) = mask {
            mask.pixels[at..][..alpha.len()].copy_from_slice(alpha);
        }
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
                let mut codes = if has_alpha { codes.into_rgba16().into_raw() } else { codes.into_rgb16().into_raw() };
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
    pub(super) fn stream(self, sink: &mut dyn Sink) -> Result<()> {
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
                    let raw = if has_alpha { codes.into_rgba16().into_raw() } else { codes.into_rgb16().into_raw() };
                    for (y, line) in raw.chunks_exact(channels * width).enumerate() {
                        pass(y, &mut line.iter().copied());
                    }
                } else {
                    let raw = if has_alpha { codes.into_rgba8().into_raw() } else { codes.into_rgb8().into_raw() };
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
