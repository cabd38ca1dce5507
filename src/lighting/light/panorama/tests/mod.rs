use super::*;
use crate::Mapping;
use crate::latlong::{texel_direction, texel_solid_angle};
use exr::prelude::{
    AnyChannel, AnyChannels, FlatSamples, IntegerBounds, Layer, LayerAttributes, SmallVec, Vec2, WritableImage,
};
use imaging::{Encoded, Image, file};
use std::path::PathBuf;

mod openexr;
mod radiance_hdr;

fn picture(width: usize, height: usize) -> Image {
    Image::from_fn(width, height, |x, y| [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7) % 97) as f32 / 32.0 + 0.25))
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

fn read_all(path: &Path) -> Panorama {
    read(path, &ReadSettings::default()).unwrap()
}

/// An EXR with named channels and a data window placed in a display window.
fn write_exr(path: &Path, image: &Image, names: &[(&str, usize)], at: (i32, i32), display: (usize, usize)) {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = names
        .iter()
        .map(|&(name, c)| {
            let values = image.pixels.iter().map(|p| p[c]).collect();
            AnyChannel::new(name, FlatSamples::F32(values))
        })
        .collect();
    let attributes = LayerAttributes { layer_position: Vec2(at.0, at.1), ..Default::default() };
    let layer =
        Layer::new(image.size(), attributes, exr::prelude::Encoding::FAST_LOSSLESS, AnyChannels::sort(channels));
    let mut file = exr::prelude::Image::from_layer(layer);
    file.attributes.display_window = IntegerBounds::from_dimensions(display);
    file.write().to_file(path).unwrap();
}

fn same_energy(a: &Environment, b: &Environment) {
    for (a, b) in a.energy().into_iter().zip(b.energy()) {
        assert!((a - b).abs() <= 3e-6 * b, "{a} for {b}");
    }
}

#[test]
fn wide_panoramas_are_averaged_by_solid_angle() {
    let folder = Folder::new();
    let path = folder.0.path().join("wide.exr");
    let mut image = picture(100, 50);
    image.pixels[731] = [1e6; 3];
    write_exr(&path, &image, &[("R", 0), ("G", 1), ("B", 2)], (0, 0), (100, 50));
    for width in [2, 7, 30, 50, 64, 99, 100, 200] {
        let read = read(&path, &ReadSettings { width, mapping: None }).unwrap();
        assert_eq!(read.file_size, (100, 50));
        let whole = Environment::from_radiance("", image.clone());
        same_energy(&read.environment, &whole);
        if width == 50 {
            for (a, b) in read.environment.radiance.pixels.iter().zip(whole.reduced(50).radiance.pixels) {
                assert!((a[0] - b[0]).abs() <= 1e-5 * b[0], "{a:?} for {b:?}");
            }
        }
    }
}

#[test]
fn texels_that_are_not_light_are_repaired_at_any_size() {
    let folder = Folder::new();
    let path = folder.0.path().join("broken.exr");
    let mut image = Image::filled(64, 32, [1.0; 3]);
    image.pixels[40] = [f32::NAN; 3];
    image.pixels[700] = [f32::INFINITY, 1.0, 1.0];
    image.pixels[900] = [-5.0; 3];
    image.pixels[901] = [7.0; 3];
    write_exr(&path, &image, &[("R", 0), ("G", 1), ("B", 2)], (0, 0), (64, 32));
    let mended = Environment::from_radiance("", image);
    for width in [64, 32, 20] {
        let read = read(&path, &ReadSettings { width, mapping: None }).unwrap();
        assert_eq!(read.environment.repaired_texels, 3);
        assert!(read.notes[0].starts_with("3 pixels"), "{:?}", read.notes);
        same_energy(&read.environment, &mended);
    }
}

#[test]
fn encoded_pictures_are_light_with_a_warning() {
    let folder = Folder::new();
    let path = folder.0.path().join("sky.png");
    let picture = imaging::Raster::from_fn(16, 8, |x, _| [x as f32 / 15.0, 0.5, 0.0]);
    file::write_png(&path, &Encoded(picture)).unwrap();
    let read = read_all(&path);
    let [r, g, b] = read.environment.radiance.at(7, 3);
    // 7/15 and 1/2 of white, linearised.
    assert!((r - 0.1845).abs() < 2e-3 && (g - 0.2159).abs() < 2e-3 && b == 0.0, "{r} {g} {b}");
    assert!(read.notes[0].contains("6.2 % of its pixels are clipped"), "{:?}", read.notes);

    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(16, 8, |x, _| image::Rgb([x as u16, 32768, 65535]));
    let path = folder.0.path().join("sky.tiff");
    deep.save(&path).unwrap();
    let read = read_all(&path);
    let [r, g, b] = read.environment.radiance.at(15, 3);
    assert!((f64::from(r) - 15.0 / 65535.0 / 12.92).abs() < 1e-8 && (g - 0.2140).abs() < 1e-3 && b == 1.0);
    assert!(read.notes[0].starts_with("16 bits"), "{:?}", read.notes);

    let path = folder.0.path().join("sky.jpg");
    image::RgbImage::from_pixel(32, 16, image::Rgb([128; 3])).save(&path).unwrap();
    assert!((read_all(&path).environment.radiance.at(3, 3)[1] - 0.2159).abs() < 0.01);
}

#[test]
fn other_shapes_are_guessed_with_a_word_or_refused() {
    let folder = Folder::new();
    let path = folder.0.path().join("shape.exr");
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    let write = |w, h| write_exr(&path, &picture(w, h), &rgb, (0, 0), (w, h));
    write(64, 64);
    let error = super::read(&path, &ReadSettings::default()).unwrap_err().to_string();
    assert!(error.contains("mirror ball"), "{error}");
    write(60, 40);
    assert!(read_all(&path).notes[0].contains("stretched"));
    write(64, 33);
    assert!(read_all(&path).notes.is_empty());
    write(64, 48);
    assert!(read_all(&path).notes[0].contains("cross"));
    // A strip around the horizon.
    for width in [64, 24, 10] {
        write(64, 12);
        let read = read(&path, &ReadSettings { width, mapping: None }).unwrap();
        assert!(read.notes[0].contains("68° in height"), "{:?}", read.notes);
        let image = &read.environment.radiance;
        assert_eq!(image.size(), (width, width / 2));
        assert_eq!(image.pixels[0], image.pixels[width - 1]);
        let (low, high) = image.pixels.iter().flatten().fold((9f32, 0f32), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(low >= 0.24 && high <= 3.3, "{low} to {high}");
    }
}

#[test]
fn a_light_probe_is_unwrapped_when_asked() {
    let folder = Folder::new();
    let path = folder.0.path().join("probe.exr");
    for mapping in [Mapping::Angular, Mapping::MirrorBall, Mapping::CubeCross] {
        let size = mapping.size(96);
        let sky = |d: glam::Vec3| [1.0 + d.x, 1.0 + d.y, 1.0 + d.z];
        let image = Image::from_fn(size.0, size.1, |x, y| {
            // Pixels with their middle beyond a disc's rim show the sphere just inside it.
            let shown = (0..10).find_map(|step| {
                let pull = 1.0 - 0.01 * f64::from(step);
                let place = |p: usize, size: usize| 0.5 + pull * ((p as f64 + 0.5) / size as f64 - 0.5);
                mapping.direction(place(x, size.0), place(y, size.1))
            });
            shown.map_or([9.0; 3], |d| sky(d.as_vec3()))
        });
        write_exr(&path, &image, &[("R", 0), ("G", 1), ("B", 2)], (0, 0), size);
        let read = read(&path, &ReadSettings { width: 4096, mapping: Some(mapping) }).unwrap();
        let (w, h) = read.environment.radiance.size();
        let (mut error, mut sphere) = (0.0, 0.0);
        for y in 0..h {
            for x in 0..w {
                let (is, wanted) = (read.environment.radiance.at(x, y), sky(texel_direction(x, y, w, h)));
                error +=
                    texel_solid_angle(y, w, h) * f64::from((is[0] - wanted[0]).powi(2) + (is[2] - wanted[2]).powi(2));
                sphere += texel_solid_angle(y, w, h);
            }
        }
        assert!((error / sphere).sqrt() < 0.02, "{mapping:?}: {}", (error / sphere).sqrt());
    }
}
#[test]
fn what_the_image_crate_reads_is_read_alike() {
    for name in ["probulator_pisa.hdr", "polyhaven_street_lamp_1k.hdr", "grace_cathedral.exr"] {
        let Some(path) = test_support::shared(format!("data/hdri/{name}")) else { return };
        let reference = file::read_linear(&path).unwrap();
        let read = read_all(&path);
        assert_eq!(read.environment.radiance.size(), reference.size());
        let repaired = Environment::from_radiance("", reference).radiance;
        // A file may declare an exposure that its values were multiplied by.
        let gain = read.environment.radiance.pixels[0][0] / repaired.pixels[0][0];
        for (a, b) in read.environment.radiance.pixels.iter().zip(&repaired.pixels) {
            for (a, b) in a.iter().zip(b) {
                assert!((a - gain * b).abs() <= 2e-6 * a.abs(), "{name}: {a} for {b} times {gain}");
            }
        }
    }
}
