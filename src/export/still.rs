//! One picture as a file.

use super::exr_channels::{color_channels, half};
use super::format::Bits;
use super::layers::LightLayers;
use super::rational_rate;
use super::time_code::TimeCode;
use base::error::{Error, Result};
use base::files::write_beside;
use compositor::{Picture, code};
use exr::prelude::{AnyChannel, FlatSamples};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use imaging::color::byte_from_unit;
use imaging::file::io_error;
use std::io::Write;
use std::path::Path;

/// What a still says besides its picture, and how.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// The clip's, in frames per second.
    pub frame_rate: f64,
    /// Of a PNG.
    pub bits: Bits,
    /// Of an EXR, if it is to have any.
    pub layers: Option<&'a LightLayers>,
}

/// Writes a picture as EXR where the path says so, else as PNG.
///
/// # Errors
/// When the file cannot be written, or a picture without display codes is to be a PNG.
pub fn write_still(path: &Path, picture: &Picture, about: &About) -> Result<()> {
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    {
        write_still_exr(path, picture, about)
    } else {
        write_still_png(path, picture, about.bits)
    }
}

/// Writes the display codes: RGB, or RGBA with straight alpha (as the PNG standard has it) where the picture
/// is not opaque.
///
/// # Errors
/// When the file cannot be written or the picture has no display codes.
pub fn write_still_png(path: &Path, picture: &Picture, bits: Bits) -> Result<()> {
    if picture.display.is_none() {
        return Err(no_display(path));
    }
    let opaque = picture.alpha.pixels.iter().all(|&alpha| alpha >= 1.0);
    let channels = if opaque { 3 } else { 4 };
    let codes = straight(picture).ok_or_else(|| no_light(path))?;
    let codes = codes.flat_map(|pixel| pixel.into_iter().take(channels));
    let (bytes, color): (Vec<u8>, _) = match bits {
        Bits::Eight => (
            codes.map(byte_from_unit).collect(),
            [ExtendedColorType::Rgb8, ExtendedColorType::Rgba8],
        ),
        Bits::Sixteen => (
            codes
                .flat_map(|v| word_from_unit(v).to_ne_bytes())
                .collect(),
            [ExtendedColorType::Rgb16, ExtendedColorType::Rgba16],
        ),
    };
    let (width, height) = picture.alpha.size();
    let color = color[channels - 3];
    write_beside(path, |out| {
        PngEncoder::new(out)
            .write_image(&bytes, width as u32, height as u32, color)
            .map_err(io_error)
    })
}

/// A 16-bit code of a value in `[0, 1]`, rounded to nearest.
pub(super) fn word_from_unit(value: f32) -> u16 {
    (value.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16
}

/// Writes linear light with premultiplied alpha as a half-float, ZIP-compressed OpenEXR picture, with its
/// light layers where there are any. The header has time code, frame rate, primaries and the colour space's
/// name. Values beyond half floats are clipped to ±65504.
///
/// # Errors
/// When the file cannot be written or the picture has no linear light.
pub fn write_still_exr(path: &Path, picture: &Picture, about: &About) -> Result<()> {
    use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
    use exr::prelude::{AnyChannels, Encoding, Layer, LayerAttributes, Vec2, WritableImage};

    let linear = picture.linear.as_ref().ok_or_else(|| no_light(path))?;
    let coverage = picture.alpha.pixels.iter().map(|&alpha| half(alpha));
    let coverage = AnyChannel::new("A", FlatSamples::F16(coverage.collect()));
    let layers = about.layers.into_iter().flat_map(LightLayers::channels);
    let channels = color_channels("", linear)
        .into_iter()
        .chain([coverage])
        .chain(layers);
    // ZIP over scan lines in order: the same picture gives the same bytes.
    let encoding = Encoding::SMALL_LOSSLESS;
    let mut header = LayerAttributes {
        frames_per_second: Some(rational_rate(about.frame_rate)),
        software_name: Some(Text::from("Afterlight")),
        ..LayerAttributes::default()
    };
    header
        .other
        .extend(about.layers.map(LightLayers::attribute));
    let mut file = exr::prelude::Image::from_layer(Layer::new(
        linear.size(),
        header,
        encoding,
        AnyChannels::sort(channels.collect()),
    ));
    file.attributes.time_code = Some(TimeCode::of(about.frame, about.frame_rate).into());
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
        .map_err(|e| Error::codec("encode", path, e, "Check the size of the picture"))?;
    write_beside(path, |out| out.write_all(&bytes))
}

/// Display codes with straight alpha, all in `[0, 1]`: RGB is divided by alpha in linear light. Where
/// the picture is opaque these are its display codes. None if light is needed and missing.
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
    Error::bug(format!(
        "cannot write {}: the picture was made for a display, not in linear light",
        path.display()
    ))
}

/// A picture that was made in linear light is asked for in display codes.
pub(super) fn no_display(path: &Path) -> Error {
    Error::bug(format!(
        "cannot write {}: the picture was made in linear light, not for a display",
        path.display()
    ))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::layers::{LightLayer, Rebuild, rebuilt};
    use super::*;
    use compositor::reference::view;
    use exr::meta::attribute::{AttributeValue, Text};
    use imaging::color::srgb_from_linear;
    use imaging::{Image, Mask, Raster, file};
    use scene::ViewTransform;

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

    /// The eighth frame of a film.
    pub fn about(bits: Bits) -> About<'static> {
        About {
            frame: 24 + 7,
            frame_rate: 23.976,
            bits,
            layers: None,
        }
    }

    #[test]
    fn an_exr_keeps_light_alpha_and_says_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/look.exr");
        let mut wanted = picture(5, 3, [0.5, 2.0, 8.0], false);
        wanted.linear.as_mut().unwrap().pixels[0] = [1e9, -1e9, 0.25];
        write_still(&path, &wanted, &about(Bits::Eight)).unwrap();
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
        assert_eq!(
            (
                read.layer_data.encoding.compression,
                read.layer_data.encoding.blocks
            ),
            (
                exr::prelude::Compression::ZIP16,
                exr::prelude::Blocks::ScanLines
            )
        );
        let bytes = std::fs::read(&path).unwrap();
        write_still(&path, &wanted, &about(Bits::Eight)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes, "the same picture");
        let time = read.attributes.time_code.unwrap();
        assert_eq!((time.seconds, time.frame), (1, 7));
        let pixels = &read.layer_data.channel_data.pixels.pixels;
        assert_eq!(pixels[0], [65504.0, -65504.0, 0.25, 1.0]);
        assert_eq!(pixels[2], [0.25, 1.0, 4.0, 0.5]);
        assert_eq!(file::dimensions(&path).unwrap(), (5, 3));
    }

    #[test]
    fn a_png_is_opaque_or_has_straight_alpha() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("opaque.png");
        for bits in [Bits::Eight, Bits::Sixteen] {
            write_still(&path, &picture(4, 2, [0.5; 3], true), &about(bits)).unwrap();
            assert!(!image::open(&path).unwrap().color().has_alpha());
        }
        write_still(&path, &picture(4, 2, [0.5; 3], false), &about(Bits::Eight)).unwrap();
        let read = image::open(&path).unwrap().into_rgba8();
        let code = byte_from_unit(srgb_from_linear(0.5));
        assert_eq!(read.get_pixel(0, 0).0, [code, code, code, 255]);
        assert_eq!(read.get_pixel(1, 1).0, [code, code, code, 170]);
        assert_eq!(read.get_pixel(3, 1).0, [0; 4]);
    }

    #[test]
    fn a_png_of_16_bits_tells_apart_what_8_bits_cannot() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep.png");
        write_still(
            &path,
            &picture(4, 2, [0.5; 3], false),
            &about(Bits::Sixteen),
        )
        .unwrap();
        let read = image::open(&path).unwrap();
        assert_eq!(read.color(), image::ColorType::Rgba16);
        let read = read.into_rgba16();
        let code = word_from_unit(srgb_from_linear(0.5));
        assert_ne!(u32::from(code) * 255 % 65535, 0, "no code of 8 bits");
        assert_eq!(read.get_pixel(0, 0).0, [code, code, code, 65535]);
        assert_eq!(read.get_pixel(1, 1).0, [code, code, code, 43690]);
    }

    #[test]
    fn light_layers_times_their_weights_give_back_the_subject() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("shot.0031.exr");
        let lamp = |i: usize| LightLayer {
            lamp: format!("olat {i} ü"),
            weight: [0.5 + i as f32, 0.25, 1.0 / (1.0 + i as f32)],
            picture: Raster::from_fn(5, 3, |x, y| {
                [x as f32 + 0.1, y as f32, (i * x) as f32 / 7.0]
            }),
        };
        let lights = LightLayers((0..12).map(lamp).collect());
        let mut relit = Image::filled(5, 3, [0.0; 3]);
        for LightLayer {
            weight, picture, ..
        } in &lights.0
        {
            for (sum, value) in relit.pixels.iter_mut().zip(&picture.pixels) {
                (0..3).for_each(|c| sum[c] += weight[c] * value[c]);
            }
        }
        let shown = Picture {
            linear: Some(relit.clone()),
            ..picture(5, 3, [0.0; 3], true)
        };
        let with = |lights: &LightLayers| {
            let layers = Some(lights);
            let about = About {
                layers,
                ..about(Bits::Eight)
            };
            write_still(&path, &shown, &about).unwrap();
            Rebuild::check(&path, lights.0.len(), &relit).unwrap()
        };
        let check = with(&lights);
        // Half floats keep 11 bits of each layer.
        assert!(
            check.residual <= check.brightest * 2f32.powi(-11),
            "{check:?}"
        );
        let file = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        let channels = file.layer_data.channel_data.list;
        let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names.len(), 4 + 3 * 12);
        for name in ["R", "A", "light_00.R", "light_07.G", "light_11.B"] {
            assert!(names.iter().any(|n| n == name), "{names:?}");
        }
        let is_half = |c: &AnyChannel<FlatSamples>| matches!(c.sample_data, FlatSamples::F16(_));
        assert!(channels.iter().all(is_half));

        let mut other = lights.clone();
        other.0[7].weight[0] *= 1.05;
        assert!(
            with(&other).residual > 4.0 * check.residual,
            "a wrong weight is seen"
        );
        write_still(&path, &shown, &about(Bits::Eight)).unwrap();
        assert!(rebuilt(&path).unwrap_err().to_string().contains("weights"));
    }

    #[test]
    fn a_linear_picture_is_no_png() {
        let folder = tempfile::tempdir().unwrap();
        let linear = Picture {
            display: None,
            ..picture(2, 2, [0.5; 3], true)
        };
        let path = folder.path().join("a.png");
        let error = write_still(&path, &linear, &about(Bits::Eight)).unwrap_err();
        assert!(error.to_string().contains("linear light"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
