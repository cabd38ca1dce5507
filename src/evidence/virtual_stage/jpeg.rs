//! JPEG artefacts of a camera: coarse colour, coarse blocks, eight bits.

use base::error::{Error, Result};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};
use imaging::{Encoded, Raster};

/// The picture decoded from a JPEG file of `quality` (1 to 100), with colour at half size (4:2:0) as in cameras.
///
/// # Errors
/// When the picture cannot be encoded, which never happens on the stage.
pub fn through_jpeg(picture: &Encoded, quality: u8) -> Result<Encoded> {
    let (width, height) = picture.0.size();
    let bytes: Vec<u8> = (coarse_colour(&picture.0).pixels.iter().flatten())
        .map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8)
        .collect();
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality)
        .encode(&bytes, width as u32, height as u32, ExtendedColorType::Rgb8)
        .map_err(failed)?;
    decode(&file)
}

/// Codes of a JPEG file.
///
/// # Errors
/// When it cannot be decoded, which never happens on the stage.
pub fn decode(file: &[u8]) -> Result<Encoded> {
    let read = image::load_from_memory_with_format(file, ImageFormat::Jpeg).map_err(failed)?;
    let read = read.to_rgb8();
    let (width, height) = (read.width() as usize, read.height() as usize);
    Ok(Encoded(Raster::from_fn(width, height, |x, y| {
        read.get_pixel(x as u32, y as u32).0.map(|code| f32::from(code) / 255.0)
    })))
}

fn failed(error: image::ImageError) -> Error {
    Error::bug(format!("the virtual stage's JPEG failed: {error}"))
}

/// Luma of each pixel (ITU-R BT.601, as in JFIF) with the mean colour of its 2 × 2 block.
fn coarse_colour(picture: &Raster<[f32; 3]>) -> Raster<[f32; 3]> {
    let luma = |[r, g, b]: [f32; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
    let (width, height) = picture.size();
    Raster::from_fn(width, height, |x, y| {
        let mut mean = [0.0; 3];
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (x, y) = ((x & !1) + dx, (y & !1) + dy);
            let pixel = picture.at(x.min(width - 1), y.min(height - 1));
            mean = [0, 1, 2].map(|c| mean[c] + 0.25 * pixel[c]);
        }
        let lift = luma(picture.at(x, y)) - luma(mean);
        mean.map(|v| v + lift)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(a: &Encoded, b: &Encoded) -> f32 {
        let pairs = a.0.pixels.iter().flatten().zip(b.0.pixels.iter().flatten());
        let square: f32 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        255.0 * (square / (3 * a.0.pixels.len()) as f32).sqrt()
    }

    #[test]
    fn a_good_file_changes_little_and_a_small_one_more() {
        let picture = Encoded(Raster::from_fn(37, 21, |x, y| {
            let wave = |k: f32| 0.5 + 0.4 * (k * x as f32 + 0.3 * y as f32).sin();
            [1.0, 0.9, 0.7].map(|c| c * wave(0.2))
        }));
        let (good, small) =
            (off(&picture, &through_jpeg(&picture, 98).unwrap()), off(&picture, &through_jpeg(&picture, 30).unwrap()));
        assert!(good < 2.0 && small > 1.5 * good && small < 20.0, "{good} and {small} codes");
    }

    #[test]
    fn grey_stays_grey_and_level() {
        let picture = Encoded(Raster::filled(16, 16, [100.0 / 255.0; 3]));
        assert!(off(&picture, &through_jpeg(&picture, 90).unwrap()) < 1.1);
    }
}
