use super::super::layers::{LightLayer, LightLayers};
use super::super::rebuild::rebuilt;
use super::super::{ExrSettings, TimeCode};
use super::*;
use compositor::reference::view;
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{AnyChannel, FlatSamples};
use imaging::color::srgb_from_linear;
use imaging::{Image, Mask, Raster, file};
use scene::ViewTransform;
use std::sync::LazyLock;

/// A flat, premultiplied picture. Its alpha falls from left to right unless it is opaque.
pub fn picture(width: usize, height: usize, color: [f32; 3], opaque: bool) -> Picture {
    let alpha = Mask::from_fn(width, height, |x, _| if opaque { 1.0 } else { 1.0 - x as f32 / (width - 1) as f32 });
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

static PLAIN: LazyLock<Encoding> = LazyLock::new(Encoding::default);

/// Frame 8 of a film.
pub fn about(bits: Bits) -> About<'static> {
    About {
        time_code: TimeCode::new(24 + 7, 23.976),
        frame_rate: 23.976,
        bits,
        exr: ExrSettings::default(),
        encoding: &PLAIN,
        reel: None,
        provenance: None,
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
        |raster, at, (r, g, b, a): (f32, f32, f32, f32)| raster.pixels[at.y() * raster.width + at.x()] = [r, g, b, a],
    )
    .unwrap();
    let identity = &read.layer_data.attributes.other[&Text::from("colorInteropID")];
    assert_eq!(*identity, AttributeValue::Text(Text::from("lin_rec709_scene")));
    assert!(read.attributes.chromaticities.is_some());
    assert_eq!(read.layer_data.attributes.frames_per_second, Some((24000, 1001)));
    assert_eq!(
        (read.layer_data.encoding.compression, read.layer_data.encoding.blocks),
        (exr::prelude::Compression::ZIP16, exr::prelude::Blocks::ScanLines)
    );
    let bytes = std::fs::read(&path).unwrap();
    // The encoder's own order of attributes varies between runs.
    for _ in 0..20 {
        write_still(&path, &wanted, &about(Bits::Eight)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes, "the same picture");
    }
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
    write_still(&path, &picture(4, 2, [0.5; 3], false), &about(Bits::Sixteen)).unwrap();
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
        picture: Raster::from_fn(5, 3, |x, y| [x as f32 + 0.1, y as f32, (i * x) as f32 / 7.0]),
    };
    let lamps: Vec<_> = (0..12).map(lamp).collect();
    let mut relit = Image::filled(5, 3, [0.0; 3]);
    for LightLayer { weight, picture, .. } in &lamps {
        for (sum, value) in relit.pixels.iter_mut().zip(&picture.pixels) {
            (0..3).for_each(|c| sum[c] += weight[c] * value[c]);
        }
    }
    let shown = Picture { linear: Some(relit.clone()), ..picture(5, 3, [0.0; 3], true) };
    let with = |lamps: Vec<LightLayer>| {
        let layers = LightLayers { lamps, subject: Some(relit.clone()), ..LightLayers::default() };
        write_still(&path, &shown, &About { layers: Some(&layers), ..about(Bits::Eight) })
    };
    let check = with(lamps.clone()).unwrap().unwrap();
    // Half floats keep 11 bits of each layer.
    assert!(check.residual <= check.brightest * 2f32.powi(-11), "{check:?}");
    // So say the file's own numbers.
    let read = rebuilt(&path).unwrap();
    let differences = read.pixels.iter().flatten().zip(relit.pixels.iter().flatten());
    let residual = differences.fold(0f32, |most, (a, b)| most.max((a - b).abs()));
    assert!((residual - check.residual).abs() <= 1e-6 * check.brightest, "{residual} {check:?}");
    let file = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channels = file.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names.len(), 4 + 3 * 12);
    for name in ["R", "A", "light_00.R", "light_07.G", "light_11.B"] {
        assert!(names.iter().any(|n| n == name), "{names:?}");
    }
    let is_half = |c: &AnyChannel<FlatSamples>| matches!(c.sample_data, FlatSamples::F16(_));
    assert!(channels.iter().all(is_half));

    let mut other = lamps;
    other[7].weight[0] *= 1.05;
    assert!(with(other).is_err(), "a wrong weight is seen");
    write_still(&path, &shown, &about(Bits::Eight)).unwrap();
    assert!(rebuilt(&path).unwrap_err().to_string().contains("weights"));
}

#[test]
fn a_linear_picture_is_no_png() {
    let folder = tempfile::tempdir().unwrap();
    let linear = Picture { display: None, ..picture(2, 2, [0.5; 3], true) };
    let path = folder.path().join("a.png");
    let error = write_still(&path, &linear, &about(Bits::Eight)).unwrap_err();
    assert!(error.to_string().contains("linear light"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_png_and_a_tiff_say_their_colour_space_and_what_they_are_of() {
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(4, 3, [0.5, 0.25, 0.125], true);
    let codes = |path: &Path| {
        let read = image::open(path).unwrap().into_rgb16().get_pixel(1, 1).0;
        read.map(|code| f32::from(code) / 65535.0)
    };
    for space in
        [None, Some(OutputSpace::Srgb), Some(OutputSpace::P3), Some(OutputSpace::Rec709), Some(OutputSpace::Rec2020)]
    {
        let encoding = Encoding::open(space, None).unwrap();
        let about = About { encoding: &encoding, provenance: Some("look=12"), ..about(Bits::Sixteen) };
        let wanted = encoding.codes()(shown.display.as_ref().unwrap().0.pixels[0]);
        for name in ["a.png", "a.tif", "b.TIFF"] {
            let path = folder.path().join(name);
            write_still(&path, &shown, &about).unwrap();
            let found = codes(&path);
            assert!((0..3).all(|c| (found[c] - wanted[c]).abs() < 2e-5), "{name}: {found:?}, {wanted:?}");
        }
        let file = std::fs::File::open(folder.path().join("a.png")).unwrap();
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        let info = reader.info();
        let text = &info.uncompressed_latin1_text[0];
        assert_eq!((&*text.keyword, &*text.text), (PROVENANCE, "look=12"));
        let cicp = info.coding_independent_code_points.as_ref();
        let cicp = cicp.map(|c| [c.color_primaries, c.transfer_function]);
        match space {
            None | Some(OutputSpace::Srgb) => assert!(info.srgb.is_some() && cicp.is_none()),
            Some(space) => assert_eq!(cicp, Some(space.code_points())),
        }
        let mut tiff = tiff::decoder::Decoder::new(std::fs::File::open(folder.path().join("a.tif")).unwrap()).unwrap();
        let said = tiff.get_tag_ascii_string(Tag::ImageDescription).unwrap();
        assert!(said.contains("look=12") && said.contains("Colour space"), "{said}");
    }
    let path = folder.path().join("cut.tif");
    write_still(&path, &picture(4, 2, [0.5; 3], false), &about(Bits::Eight)).unwrap();
    let read = image::open(&path).unwrap();
    assert_eq!(read.color(), image::ColorType::Rgba16);
    assert_eq!(read.into_rgba16().get_pixel(1, 1).0[3], 43690);
}

#[test]
fn every_compression_gives_back_half_floats() {
    use super::super::exr_settings::{ExrCompression, Samples};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut shown = picture(37, 21, [0.5; 3], false);
    shown.linear = Some(Raster::from_fn(37, 21, |x, y| [x as f32 / 7.0, (x * y) as f32, 0.1]));
    for compression in ExrCompression::ALL {
        for samples in [Samples::Half, Samples::Float] {
            let exr = ExrSettings { samples, compression, ..ExrSettings::default() };
            write_still(&path, &shown, &About { exr, ..about(Bits::Eight) }).unwrap();
            let found = file::read_linear(&path).unwrap();
            for (found, wanted) in
                found.pixels.iter().flatten().zip(shown.linear.as_ref().unwrap().pixels.iter().flatten())
            {
                let within = match (samples, compression) {
                    (Samples::Half, _) => 2f32.powi(-11),
                    (_, ExrCompression::Pxr24) => 2f32.powi(-16),
                    _ => 0.0,
                };
                assert!((found - wanted).abs() <= within * wanted.abs(), "{exr:?}: {found}, {wanted}");
            }
        }
    }
}

#[test]
fn every_still_says_what_it_was_made_of() {
    use super::super::exr_settings::LayerFiles;
    use super::super::provenance::provenance_of;
    let folder = tempfile::tempdir().unwrap();
    let light = picture(4, 3, [0.5; 3], true).linear.unwrap();
    let layers = LightLayers { rest: Some(light), ..LightLayers::default() };
    for name in ["a.png", "a.tif", "a.exr", "b.exr"] {
        let path = folder.path().join(name);
        let about = About {
            provenance: Some("look=1 frame=2"),
            layers: (name == "b.exr").then_some(&layers),
            exr: ExrSettings { layers: LayerFiles::Parts, ..ExrSettings::default() },
            ..about(Bits::Eight)
        };
        write_still(&path, &picture(4, 3, [0.5; 3], true), &about).unwrap();
        assert_eq!(provenance_of(&path).as_deref(), Some("look=1 frame=2"), "{name}");
    }
}
