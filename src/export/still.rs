//! One picture as a file.

use super::rational_rate;
use crate::compositor::{Picture, code};
use crate::error::{Error, Result};
use crate::imaging::color::byte_from_unit;
use crate::imaging::file::{write_beside, write_png};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::Path;

/// Writes a picture as EXR where the path says so, else as PNG. `frame_rate` is the clip's, in frames
/// per second.
///
/// # Errors
/// When the file cannot be written, or a picture without display codes is to be a PNG.
pub fn write_still(path: &Path, picture: &Picture, frame_rate: f64) -> Result<()> {
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    {
        write_still_exr(path, picture, frame_rate)
    } else {
        write_still_png(path, picture)
    }
}

/// Writes the display codes in 8 bits: RGB, or RGBA with straight alpha (as the PNG standard has it)
/// where the picture is not opaque.
///
/// # Errors
/// When the file cannot be written or the picture has no display codes.
pub fn write_still_png(path: &Path, picture: &Picture) -> Result<()> {
    let display = picture.display.as_ref().ok_or_else(|| no_display(path))?;
    if picture.alpha.pixels.iter().all(|&alpha| alpha >= 1.0) {
        return write_png(path, display);
    }
    let (width, height) = picture.alpha.size();
    let straight = straight(picture).ok_or_else(|| no_light(path))?;
    let bytes: Vec<u8> = straight.flatten().map(byte_from_unit).collect();
    write_beside(path, |out| {
        PngEncoder::new(out).write_image(
            &bytes,
            width as u32,
            height as u32,
            ExtendedColorType::Rgba8,
        )
    })
}

/// Writes linear light with premultiplied alpha as a half-float, ZIP-compressed OpenEXR picture. The
/// header names the colour space and the frame rate. Values beyond half floats are clipped to ±65504.
///
/// # Errors
/// When the file cannot be written or the picture has no linear light.
pub fn write_still_exr(path: &Path, picture: &Picture, frame_rate: f64) -> Result<()> {
    use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
    use exr::prelude::{
        Compression, Encoding, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage, f16,
    };

    let linear = picture.linear.as_ref().ok_or_else(|| no_light(path))?;
    let half = |v: f32| f16::from_f32(v.clamp(-65504.0, 65504.0));
    let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
        let [r, g, b] = linear.at(at.x(), at.y());
        (
            half(r),
            half(g),
            half(b),
            half(picture.alpha.at(at.x(), at.y())),
        )
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        ..Encoding::default()
    };
    let about = LayerAttributes {
        frames_per_second: Some(rational_rate(frame_rate)),
        software_name: Some(Text::from("Afterlight")),
        ..LayerAttributes::default()
    };
    let mut file =
        exr::prelude::Image::from_layer(Layer::new(linear.size(), about, encoding, channels));
    // ITU-R BT.709, and the name that the ASWF's Color Interop Forum gives to its linear form.
    file.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let identity = AttributeValue::Text(Text::from("lin_rec709_scene"));
    file.attributes
        .other
        .insert(Text::from("colorInteropID"), identity);
    let mut bytes = Vec::new();
    file.write()
        .to_buffered(std::io::Cursor::new(&mut bytes))
        .map_err(|e| Error::file("encode", path, e, "Check the size of the picture"))?;
    write_beside(path, |out| out.write_all(&bytes))
}

/// Display codes with straight alpha, all in `[0, 1]`: RGB is divided by alpha in linear light. Where
/// the picture is opaque these are its display codes. None where light is needed and not there.
pub(super) fn straight(picture: &Picture) -> Option<impl Iterator<Item = [f32; 4]> + '_> {
    let codes = picture.display.as_ref().map(|display| &display.0);
    let light = picture.linear.as_ref();
    let opaque = picture.alpha.pixels.iter().all(|&alpha| alpha >= 1.0);
    let pixels = (0..picture.alpha.pixels.len()).map(move |i| {
        let alpha = picture.alpha.pixels[i];
        let [r, g, b] = match (codes, light) {
            (Some(codes), _) if alpha >= 1.0 => codes.pixels[i],
            (_, Some(light)) if alpha > 0.0 => {
                code(light.pixels[i].map(|v| v / alpha), picture.view)
            }
            _ => [0.0; 3],
        };
        [r, g, b, alpha]
    });
    (light.is_some() || (opaque && codes.is_some())).then_some(pixels)
}

/// A picture that was made for a display alone is asked for in linear light.
pub(super) fn no_light(path: &Path) -> Error {
    Error::unexpected(
        path.display(),
        "a picture in linear light",
        "one made for a display",
        "Ask the scene for Output::Linear, or write a PNG",
    )
}

/// A picture that was made in linear light is asked for in display codes.
pub(super) fn no_display(path: &Path) -> Error {
    Error::unexpected(
        path.display(),
        "a picture made for a display",
        "one in linear light",
        "Ask the scene for Output::Display, or write an EXR",
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::compositor::reference::view;
    use crate::imaging::color::srgb_from_linear;
    use crate::imaging::{Image, Mask, file};
    use crate::scene::ViewTransform;
    use exr::meta::attribute::{AttributeValue, Text};

    /// A flat picture, premultiplied, whose alpha falls from left to right where it is not opaque.
    pub fn picture(width: usize, height: usize, color: [f32; 3], opaque: bool) -> Picture {
        let alpha = Mask::from_fn(width, height, |x, _| {
            if opaque {
                1.0
            } else {
                1.0 - x as f32 / (width - 1) as f32
            }
        });
        let linear: Image = alpha.map(|a| color.map(|v| v * a));
        Picture {
            display: Some(view(&linear)),
            linear: Some(linear),
            alpha,
            passes: Vec::new(),
            view: ViewTransform::default(),
            steady: None,
            spill: None,
        }
    }

    #[test]
    fn an_exr_keeps_light_alpha_and_says_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/look.exr");
        let mut wanted = picture(5, 3, [0.5, 2.0, 8.0], false);
        wanted.linear.as_mut().unwrap().pixels[0] = [1e9, -1e9, 0.25];
        write_still(&path, &wanted, 23.976).unwrap();
        let read = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| Mask::filled(size.width(), size.height(), 0.0).map(|_| [0f32; 4]),
            |raster, at, (r, g, b, a): (f32, f32, f32, f32)| {
                raster.pixels[at.y() * raster.width + at.x()] = [r, g, b, a]
            },
        )
        .unwrap();
        let identity = &read.layer_data.attributes.other[&Text::from("colorInteropID")];
        assert_eq!(
            *identity,
            AttributeValue::Text(Text::from("lin_rec709_scene"))
        );
        assert!(read.attributes.chromaticities.is_some());
        assert_eq!(
            read.layer_data.attributes.frames_per_second,
            Some((24000, 1001))
        );
        let pixels = &read.layer_data.channel_data.pixels.pixels;
        assert_eq!(pixels[0], [65504.0, -65504.0, 0.25, 1.0]);
        assert_eq!(pixels[2], [0.25, 1.0, 4.0, 0.5]);
        assert_eq!(file::dimensions(&path).unwrap(), (5, 3));
    }

    #[test]
    fn a_png_is_opaque_or_has_straight_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("opaque.png");
        write_still(&path, &picture(4, 2, [0.5; 3], true), 24.0).unwrap();
        assert!(!image::open(&path).unwrap().color().has_alpha());
        write_still(&path, &picture(4, 2, [0.5; 3], false), 24.0).unwrap();
        let read = image::open(&path).unwrap().into_rgba8();
        let code = byte_from_unit(srgb_from_linear(0.5));
        assert_eq!(read.get_pixel(0, 0).0, [code, code, code, 255]);
        assert_eq!(read.get_pixel(1, 1).0, [code, code, code, 170]);
        assert_eq!(read.get_pixel(3, 1).0, [0; 4]);
    }

    #[test]
    fn a_linear_picture_is_no_png() {
        let folder = tempfile::tempdir().unwrap();
        let linear = Picture {
            display: None,
            ..picture(2, 2, [0.5; 3], true)
        };
        let error = write_still(&folder.path().join("a.png"), &linear, 24.0).unwrap_err();
        assert!(error.to_string().contains("linear light"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
