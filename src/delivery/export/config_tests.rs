//! Files in the colours of an OpenColorIO configuration.

use super::colors::{Encoding, check_colors};
use super::layers::{LightLayer, LightLayers};
use super::rebuild::Rebuild;
use super::still::tests::{about, picture};
use super::{About, Bits, Files, OutputSpace, write_still};
use color_config::ColorChoice;
use exr::meta::attribute::{AttributeValue, Text};
use imaging::color_space::{ColorSpace, transformed};
use std::path::{Path, PathBuf};

const CONFIG: &str = "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5";
const DISPLAY: &str = "sRGB - Display";

fn choice(display: Option<&str>, space: Option<&str>) -> ColorChoice {
    ColorChoice {
        config: Some(PathBuf::from(CONFIG)),
        display: display.map(str::to_owned),
        space: space.map(str::to_owned),
        ..ColorChoice::default()
    }
}

fn encoding(choice: &ColorChoice) -> Encoding {
    let files = Files { ocio: choice.clone(), ..Files::to("a.png").unwrap() };
    Encoding::for_files(&files).unwrap()
}

#[test]
fn an_exr_holds_the_space_of_a_role_and_its_layers_add_up_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("look.exr");
    let encoding = encoding(&choice(None, Some("scene_linear")));
    let layer = |color, weight: [f32; 3]| LightLayer {
        lamp: "lamp".to_owned(),
        weight,
        picture: picture(5, 3, color, false).linear.unwrap(),
    };
    let lamps = vec![layer([0.5, 1.0, 0.25], [0.5, 0.25, 1.0]), layer([0.25, 0.0, 2.0], [1.0, 1.0, 0.125])];
    let mut whole = picture(5, 3, [0.0; 3], false);
    let sum = whole.linear.as_mut().unwrap();
    for (i, pixel) in sum.pixels.iter_mut().enumerate() {
        for lamp in &lamps {
            (0..3).for_each(|c| pixel[c] += lamp.weight[c] * lamp.picture.pixels[i][c]);
        }
    }
    let layers = LightLayers { lamps, ..LightLayers::default() }.in_space(encoding.keeps_light());
    let about = About { encoding: &encoding, layers: Some(&layers), ..about(Bits::Eight) };
    write_still(&path, &whole, &about).unwrap();
    let light = &whole.linear.as_ref().unwrap().pixels;
    // The reader brings the file's chromaticities back.
    let back = imaging::file::read_linear(&path).unwrap();
    for (found, light) in back.pixels.iter().zip(light) {
        assert!((0..3).all(|c| (found[c] - light[c]).abs() < 3e-3), "{found:?} {light:?}");
    }
    assert!(Rebuild::of_file(&path).unwrap().is_exact());
    let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let matrix = ColorSpace::Rec709.matrix_to(ColorSpace::AcesCg);
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let channels = &read.layer_data.channel_data.list;
        let channel = channels.iter().find(|channel| channel.name.eq(name)).unwrap();
        for (found, light) in channel.sample_data.values_as_f32().zip(light) {
            let wanted = transformed(&matrix, *light)[c];
            // Half floats.
            assert!((found - wanted).abs() < 1e-3, "{name}: {found} {wanted}");
        }
    }
    let text = |key: &str| read.layer_data.attributes.other.get(&Text::from(key)).cloned();
    let said = |value: &str| Some(AttributeValue::Text(Text::from(value)));
    assert_eq!(text("colorInteropID"), said("lin_ap1_scene"));
    assert_eq!(text("oiio:ColorSpace"), said("ACEScg"));
    let red = read.attributes.chromaticities.unwrap().red;
    assert_eq!((red.x(), red.y()), (0.713, 0.293));
}

#[test]
fn a_png_holds_the_codes_of_a_view_and_says_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("look.png");
    let chosen = choice(Some(DISPLAY), None);
    let encoding = encoding(&chosen);
    let about = About { encoding: &encoding, ..about(Bits::Sixteen) };
    for opaque in [true, false] {
        let picture = picture(4, 2, [0.5, 4.0, 0.02], opaque);
        write_still(&path, &picture, &about).unwrap();
        let mut wanted = [[0.5, 4.0, 0.02]];
        chosen.transform().unwrap().unwrap().apply(&mut wanted);
        let file = image::open(&path).unwrap().into_rgba16();
        for pixel in file.pixels().filter(|pixel| pixel.0[3] > 0) {
            for (code, wanted) in pixel.0.iter().zip(wanted[0]) {
                let off = f32::from(*code) - wanted.clamp(0.0, 1.0) * 65535.0;
                // Light multiplied by alpha and divided again.
                assert!(off.abs() <= 2.0, "{pixel:?} {wanted}");
            }
        }
    }
    let chunks = |path: &Path| {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let reader = png::Decoder::new(file).read_info().unwrap();
        (reader.info().srgb.is_some(), reader.info().gama_chunk.is_some())
    };
    assert!(chunks(&path).0);
    // Display codes without a matching tag have none.
    let space = self::encoding(&choice(None, Some("ACEScct")));
    let about = About { encoding: &space, ..about };
    write_still(&path, &picture(4, 2, [0.18; 3], true), &about).unwrap();
    assert_eq!(chunks(&path), (false, false));
    let grey = image::open(&path).unwrap().into_rgb16().get_pixel(0, 0).0[1];
    // Middle grey of ACEScct (S-2016-001).
    assert!((f32::from(grey) / 65535.0 - 0.4135).abs() < 1e-3, "{grey}");
}

#[test]
fn a_configuration_that_nothing_is_asked_of_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let [with, without] = ["with", "without"].map(|name| folder.path().join(name));
    let named = ColorChoice { config: Some(PathBuf::from(CONFIG)), ..ColorChoice::default() };
    assert_eq!(encoding(&named), Encoding::default());
    for name in ["a.png", "a.exr", "a.tif"] {
        for (folder, encoding) in [(&with, &encoding(&named)), (&without, &Encoding::default())] {
            let about = About { encoding, ..about(Bits::Eight) };
            write_still(&folder.join(name), &picture(6, 4, [0.5, 2.0, 0.1], false), &about).unwrap();
        }
        let [a, b] = [&with, &without].map(|folder| std::fs::read(folder.join(name)).unwrap());
        assert_eq!(a, b, "{name}");
    }
}

#[test]
fn what_cannot_be_together_is_refused() {
    let to = |to: &str, ocio: ColorChoice| Files { ocio, ..Files::to(to).unwrap() };
    let view = |name: &str| to(name, choice(Some(DISPLAY), None));
    let refused = |files: &Files| check_colors(files).unwrap_err().for_terminal();
    let spaced = Files { space: Some(OutputSpace::P3), ..view("a.png") };
    assert!(refused(&spaced).contains("--space"));
    assert!(refused(&Files { lut: Some("x.cube".into()), ..view("a.png") }).contains("--lut"));
    assert!(refused(&view("a.exr")).contains("linear light"));
    check_colors(&view("a.png")).unwrap();
    check_colors(&Files { space: spaced.space, ..Files::to("a.exr").unwrap() }).unwrap();
    let log = |name: &str| Encoding::for_files(&to(name, choice(None, Some("ACEScct"))));
    let said = log("a.exr").unwrap_err().to_string();
    assert!(said.contains("ACEScct is not linear"), "{said}");
    log("a.png").unwrap();
    let wall = Encoding::for_files(&to("a.png", choice(Some("Wall"), None)));
    assert!(wall.unwrap_err().to_string().contains(DISPLAY));
}
