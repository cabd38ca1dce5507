//! PNG, JPEG and TIFF as light: linearised from sRGB, with a note about what is clipped.

use super::canvas::Canvas;
use super::reader::PanoramaReader;
use base::error::{Error, Result};
use image::{DynamicImage, ImageReader};
use imaging::color::linear_from_srgb;
use imaging::file::decode_within_limits;
use std::io::{BufRead, Seek};

pub(super) fn read(panorama: &mut PanoramaReader, file: impl BufRead + Seek) -> Result<Canvas> {
    let reader = ImageReader::new(file).with_guessed_format().map_err(|e| panorama.broken(e))?;
    if reader.format().is_none() {
        return Err(Error::invalid(
            format!(
                "{} has an unknown format: it is not Radiance HDR, OpenEXR, PNG, JPEG or TIFF",
                panorama.path.display()
            ),
            "Convert it to OpenEXR",
        ));
    }
    let picture = decode_within_limits(reader).map_err(|e| panorama.broken(e))?;
    match picture {
        // Floating point is linear already.
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let rgb = picture.into_rgb32f();
            paint(panorama, rgb.dimensions(), rgb.as_raw(), |v| v, None)
        }
        _ if picture.color().bytes_per_pixel() > picture.color().channel_count() => {
            let rgb = picture.into_rgb16();
            let light = |v: u16| linear_from_srgb(f32::from(v) / 65535.0);
            paint(panorama, rgb.dimensions(), rgb.as_raw(), light, Some((16, u16::MAX)))
        }
        _ => {
            let rgb = picture.into_rgb8();
            let table: Vec<f32> =
                (0..=255u8).map(|v| linear_from_srgb(f32::from(v) / 255.0)).collect();
            let light = |v: u8| table[usize::from(v)];
            paint(panorama, rgb.dimensions(), rgb.as_raw(), light, Some((8, u8::MAX)))
        }
    }
}

/// Paints rows of RGB samples. `white` is the number of bits of a sample and its highest code value; `None` for
/// floating point.
fn paint<T: Copy + PartialEq>(
    panorama: &mut PanoramaReader,
    (width, height): (u32, u32),
    samples: &[T],
    light: impl Fn(T) -> f32,
    white: Option<(u8, T)>,
) -> Result<Canvas> {
    let (width, height) = (width as usize, height as usize);
    let (mut canvas, top) = panorama.canvas((width, height))?;
    let mut clipped = 0;
    let mut row = vec![[0.0; 3]; width];
    for (y, line) in samples.chunks_exact(3 * width).enumerate() {
        let (pixels, _) = line.as_chunks::<3>();
        for (texel, pixel) in row.iter_mut().zip(pixels) {
            *texel = pixel.map(&light);
            clipped += usize::from(white.is_some_and(|(_, white)| pixel.contains(&white)));
        }
        canvas.paint(0, top + y, &row);
    }
    if let Some((bits, _)) = white {
        panorama.notes.push(format!(
            "{bits} bits per channel cannot hold bright lights: the file was linearised from sRGB, and {:.1} % of \
             its pixels are clipped. Its suns and lamps are too dark; place lights by hand there.",
            100.0 * clipped as f64 / (width * height) as f64
        ));
    }
    Ok(canvas)
}
