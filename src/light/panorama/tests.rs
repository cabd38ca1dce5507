use super::*;
use crate::imaging::{Encoded, Image, file};
use crate::light::latlong::{texel_direction, texel_solid_angle};
use exr::prelude::{
    AnyChannel, AnyChannels, FlatSamples, IntegerBounds, Layer, LayerAttributes, SmallVec, Vec2,
    WritableImage,
};
use std::path::PathBuf;

fn picture(width: usize, height: usize) -> Image {
    Image::from_fn(width, height, |x, y| {
        [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7) % 97) as f32 / 32.0 + 0.25)
    })
}

/// A picture in RGBE, mantissas of 8 bits.
fn rgbe(pixel: [f32; 3]) -> [u8; 4] {
    let most = pixel.into_iter().fold(0.0, f32::max);
    if most <= 0.0 {
        return [0; 4];
    }
    let exponent = most.log2().floor() as i32 + 1;
    let [r, g, b] = pixel.map(|v| (v / 2f32.powi(exponent - 8)).min(255.0) as u8);
    [r, g, b, (exponent + 128) as u8]
}

fn decoded(code: [u8; 4]) -> [f32; 3] {
    let scale = 2f32.powi(i32::from(code[3]) - 136);
    [code[0], code[1], code[2]].map(|v| f32::from(v) * scale)
}

/// How a line is written.
#[derive(Clone, Copy)]
enum Coding {
    Plain,
    Old,
    New,
}

fn hdr(header: &str, lines: &[Vec<[u8; 4]>], coding: Coding) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    for line in lines {
        match coding {
            Coding::Plain => bytes.extend(line.iter().flatten()),
            Coding::Old => {
                let mut x = 0;
                while x < line.len() {
                    let run = line[x..].iter().take_while(|p| **p == line[x]).count();
                    bytes.extend(line[x]);
                    if run > 1 {
                        bytes.extend([1, 1, 1, ((run - 1) & 255) as u8]);
                        if run > 256 {
                            bytes.extend([1, 1, 1, ((run - 1) >> 8) as u8]);
                        }
                    }
                    x += run;
                }
            }
            Coding::New => {
                bytes.extend([2, 2, (line.len() >> 8) as u8, line.len() as u8]);
                for c in 0..4 {
                    let mut x = 0;
                    while x < line.len() {
                        let run = line[x..]
                            .iter()
                            .take(127)
                            .take_while(|p| p[c] == line[x][c])
                            .count();
                        if run > 2 {
                            bytes.extend([128 + run as u8, line[x][c]]);
                            x += run;
                        } else {
                            let count = (line.len() - x).min(100);
                            bytes.push(count as u8);
                            bytes.extend(line[x..x + count].iter().map(|p| p[c]));
                            x += count;
                        }
                    }
                }
            }
        }
    }
    bytes
}

const HEADER: &str = "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n";

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
    read(path, &Reading::default()).unwrap()
}

#[test]
fn the_eight_orientations_of_radiance_are_one_picture() {
    let folder = Folder::new();
    let (w, h) = (24, 12);
    let codes = Image::from_fn(w, h, |x, y| decoded(rgbe(picture(w, h).at(x, y))));
    let code = |x: usize, y: usize| rgbe(picture(w, h).at(x, y));
    for first in ["-Y", "+Y", "-X", "+X"] {
        for second in ["-Y", "+Y", "-X", "+X"] {
            if first[1..] == second[1..] {
                continue;
            }
            let columns = first.ends_with('X');
            let (x_sign, y_sign) = if columns {
                (first, second)
            } else {
                (second, first)
            };
            let (lines, length) = if columns { (w, h) } else { (h, w) };
            let at = |i: usize, j: usize| {
                let (x, y) = if columns { (i, j) } else { (j, i) };
                // +X goes right and +Y goes up.
                code(
                    if x_sign == "+X" { x } else { w - 1 - x },
                    if y_sign == "-Y" { y } else { h - 1 - y },
                )
            };
            let data: Vec<Vec<_>> = (0..lines)
                .map(|i| (0..length).map(|j| at(i, j)).collect())
                .collect();
            for coding in [Coding::Plain, Coding::Old, Coding::New] {
                let header = format!("{HEADER}{first} {lines} {second} {length}\n");
                let path = folder.write("o.hdr", &hdr(&header, &data, coding));
                let read = read_all(&path);
                assert_eq!(read.environment.radiance, codes, "{first} {second}");
                assert!(read.notes.is_empty(), "{:?}", read.notes);
            }
        }
    }
}

#[test]
fn long_runs_of_the_old_coding_are_read() {
    let folder = Folder::new();
    let lines = vec![vec![[128, 64, 32, 129]; 1400]; 2];
    let path = folder.write(
        "old.hdr",
        &hdr(&format!("{HEADER}-Y 2 +X 1400\n"), &lines, Coding::Old),
    );
    let reading = Reading {
        mapping: Some(Mapping::LatLong),
        ..Reading::default()
    };
    let image = read(&path, &reading).unwrap().environment.radiance;
    assert!(image.pixels.iter().all(|p| *p == [1.0, 0.5, 0.25]));
}

#[test]
fn what_the_image_crate_reads_is_read_alike() {
    for name in [
        "probulator_pisa.hdr",
        "polyhaven_street_lamp_1k.hdr",
        "grace_cathedral.exr",
    ] {
        let path = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap())
            .join("../shared/data/hdri")
            .join(name);
        if !path.exists() {
            eprintln!("skipped: {} is not here", path.display());
            continue;
        }
        let reference = file::read_linear(&path).unwrap();
        let read = read_all(&path);
        assert_eq!(read.environment.radiance.size(), reference.size());
        let repaired = Environment::from_radiance("", reference).radiance;
        // A file may say that its values have been multiplied by an exposure.
        let gain = read.environment.radiance.pixels[0][0] / repaired.pixels[0][0];
        for (a, b) in read
            .environment
            .radiance
            .pixels
            .iter()
            .zip(&repaired.pixels)
        {
            for (a, b) in a.iter().zip(b) {
                assert!(
                    (a - gain * b).abs() <= 2e-6 * a.abs(),
                    "{name}: {a} for {b} times {gain}"
                );
            }
        }
    }
}

#[test]
fn xyz_exposure_and_colour_correction_are_taken_out() {
    let folder = Folder::new();
    // The white of D65, and the file says that it was made twice as bright and its red half as bright again.
    let lines = vec![vec![[243, 255, 255, 128]; 16]; 8];
    let path = folder.write(
        "xyz.hdr",
        &hdr(
            "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 8 +X 16\n",
            &lines,
            Coding::New,
        ),
    );
    let [r, g, b] = read_all(&path).environment.radiance.pixels[0];
    assert!(
        (r - 1.01).abs() < 0.05 && (g - 1.0).abs() < 0.02 && (b - 0.94).abs() < 0.05,
        "{r} {g} {b}"
    );
    let header = "#?RGBE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE= 0.5\nEXPOSURE=4\nCOLORCORR=2 1 1\n\n-Y 8 +X 16\n";
    let lines = vec![vec![[128, 128, 128, 131]; 16]; 8];
    let path = folder.write("gain.hdr", &hdr(header, &lines, Coding::New));
    assert_eq!(
        read_all(&path).environment.radiance.pixels[0],
        [0.5, 1.0, 1.0]
    );
}

#[test]
fn broken_files_say_what_is_wrong() {
    let folder = Folder::new();
    let lines = vec![vec![[128, 128, 128, 129]; 16]; 8];
    let whole = hdr(&format!("{HEADER}-Y 8 +X 16\n"), &lines, Coding::New);
    let mut bad_run = whole.clone();
    let at = whole.len() - 2;
    bad_run[at] = 255;
    for (bytes, says) in [
        (whole[..whole.len() - 3].to_vec(), "line 8 of 8"),
        (whole[..20].to_vec(), "header"),
        (bad_run, "run of"),
        (
            format!("{HEADER}-Y 8 +Z 16\n").into_bytes(),
            "-Y 512 +X 1024",
        ),
        (format!("{HEADER}-Y 0 +X 16\n").into_bytes(), "0"),
        (
            format!("{HEADER}-Y 99999999 +X 99999999\n").into_bytes(),
            "99999999×99999999",
        ),
        (
            b"#?RADIANCE\nFORMAT=32-bit_other\n\n-Y 1 +X 2\n".to_vec(),
            "32-bit_other",
        ),
        (b"no picture at all".to_vec(), "another kind"),
        (Vec::new(), "another kind"),
        (b"\x76\x2f\x31\x01 nor this".to_vec(), "sphere.hdr"),
    ] {
        let path = folder.write("sphere.hdr", &bytes);
        let error = super::read(&path, &Reading::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(says) && error.contains("sphere.hdr"),
            "{error} lacks {says}"
        );
    }
    assert!(read(&folder.0.path().join("none.hdr"), &Reading::default()).is_err());
}

/// An EXR of channels by name, a data window at a place within a display window.
fn write_exr(
    path: &Path,
    image: &Image,
    names: &[(&str, usize)],
    at: (i32, i32),
    display: (usize, usize),
) {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = names
        .iter()
        .map(|&(name, c)| {
            let values = image.pixels.iter().map(|p| p[c]).collect();
            AnyChannel::new(name, FlatSamples::F32(values))
        })
        .collect();
    let attributes = LayerAttributes {
        layer_position: Vec2(at.0, at.1),
        ..Default::default()
    };
    let layer = Layer::new(
        image.size(),
        attributes,
        exr::prelude::Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let mut file = exr::prelude::Image::from_layer(layer);
    file.attributes.display_window = IntegerBounds::from_dimensions(display);
    file.write().to_file(path).unwrap();
}

#[test]
fn channels_by_other_names_are_found() {
    let folder = Folder::new();
    let path = folder.0.path().join("named.exr");
    let image = picture(32, 16);
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    write_exr(&path, &image, &rgb, (0, 0), (32, 16));
    let read = read_all(&path);
    assert_eq!(
        (read.environment.radiance, read.notes.len()),
        (image.clone(), 0)
    );
    for names in [
        vec![("sky.R", 0), ("sky.G", 1), ("sky.B", 2)],
        vec![("red", 0), ("green", 1), ("blue", 2), ("Z", 1)],
        // Colour without a layer's name comes first.
        vec![
            ("a.R", 2),
            ("a.G", 2),
            ("a.B", 2),
            ("R", 0),
            ("G", 1),
            ("B", 2),
            ("A", 1),
        ],
    ] {
        write_exr(&path, &image, &names, (0, 0), (32, 16));
        assert_eq!(read_all(&path).environment.radiance, image, "{names:?}");
    }
    for names in [
        vec![("Y", 1)],
        vec![("light.Y", 1), ("id", 0)],
        vec![("depth", 1)],
    ] {
        write_exr(&path, &image, &names, (0, 0), (32, 16));
        let read = read_all(&path);
        assert_eq!(
            read.environment.radiance,
            image.map(|p| [p[1]; 3]),
            "{names:?}"
        );
        assert!(read.notes[0].contains("grey"), "{:?}", read.notes);
    }
    write_exr(
        &path,
        &image,
        &[("R", 0), ("G", 1), ("U", 2)],
        (0, 0),
        (32, 16),
    );
    let error = super::read(&path, &Reading::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("channels G, R, U"), "{error}");
}

#[test]
fn layers_are_named() {
    let folder = Folder::new();
    let path = folder.0.path().join("layers.exr");
    let image = picture(16, 8);
    let names = [
        ("key.R", 0),
        ("key.G", 1),
        ("key.B", 2),
        ("rim.R", 2),
        ("rim.G", 2),
        ("rim.B", 2),
    ];
    write_exr(&path, &image, &names, (0, 0), (16, 8));
    let read = read_all(&path);
    assert!(read.notes[0].contains("\"key\""), "{:?}", read.notes);
    assert_eq!(read.environment.radiance, image);
}

#[test]
fn a_data_window_lies_where_it_says() {
    let folder = Folder::new();
    let path = folder.0.path().join("window.exr");
    let image = picture(10, 6);
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    // Within, and over two edges.
    for at in [(4, 3), (-3, -2), (29, 12)] {
        write_exr(&path, &image, &rgb, at, (32, 16));
        let read = read_all(&path);
        let expected = Image::from_fn(32, 16, |x, y| {
            let (x, y) = (x as i32 - at.0, y as i32 - at.1);
            match (0..10).contains(&x) && (0..6).contains(&y) {
                true => image.at(x as usize, y as usize),
                false => [0.0; 3],
            }
        });
        assert_eq!(read.environment.radiance, expected, "{at:?}");
        assert!(
            read.notes[0].contains("the rest is black"),
            "{:?}",
            read.notes
        );
        // The same, averaged down.
        let small = super::read(
            &path,
            &Reading {
                width: 12,
                mapping: None,
            },
        )
        .unwrap()
        .environment;
        same_energy(&small, &Environment::from_radiance("", expected));
    }
    // A display window of a shot: the panorama is the data.
    write_exr(&path, &picture(16, 8), &rgb, (0, 0), (192, 108));
    assert_eq!(read_all(&path).environment.radiance, picture(16, 8));
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
    write_exr(
        &path,
        &image,
        &[("R", 0), ("G", 1), ("B", 2)],
        (0, 0),
        (100, 50),
    );
    for width in [2, 7, 30, 50, 64, 99, 100, 200] {
        let read = read(
            &path,
            &Reading {
                width,
                mapping: None,
            },
        )
        .unwrap();
        assert_eq!(read.file_size, (100, 50));
        let whole = Environment::from_radiance("", image.clone());
        same_energy(&read.environment, &whole);
        if width == 50 {
            for (a, b) in read
                .environment
                .radiance
                .pixels
                .iter()
                .zip(whole.reduced(50).radiance.pixels)
            {
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
    write_exr(
        &path,
        &image,
        &[("R", 0), ("G", 1), ("B", 2)],
        (0, 0),
        (64, 32),
    );
    let mended = Environment::from_radiance("", image);
    for width in [64, 32, 20] {
        let read = read(
            &path,
            &Reading {
                width,
                mapping: None,
            },
        )
        .unwrap();
        assert_eq!(read.environment.repaired_texels, 3);
        assert!(read.notes[0].starts_with("3 pixels"), "{:?}", read.notes);
        same_energy(&read.environment, &mended);
    }
}

#[test]
fn encoded_pictures_are_light_with_a_warning() {
    let folder = Folder::new();
    let path = folder.0.path().join("sky.png");
    let picture = crate::imaging::Raster::from_fn(16, 8, |x, _| [x as f32 / 15.0, 0.5, 0.0]);
    file::write_png(&path, &Encoded(picture)).unwrap();
    let read = read_all(&path);
    let [r, g, b] = read.environment.radiance.at(7, 3);
    // 7/15 and 1/2 of white, decoded.
    assert!(
        (r - 0.1845).abs() < 2e-3 && (g - 0.2159).abs() < 2e-3 && b == 0.0,
        "{r} {g} {b}"
    );
    assert!(
        read.notes[0].contains("6.2 % of its pixels are clipped"),
        "{:?}",
        read.notes
    );

    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(16, 8, |x, _| {
        image::Rgb([x as u16, 32768, 65535])
    });
    let path = folder.0.path().join("sky.tiff");
    deep.save(&path).unwrap();
    let read = read_all(&path);
    let [r, g, b] = read.environment.radiance.at(15, 3);
    assert!(
        (f64::from(r) - 15.0 / 65535.0 / 12.92).abs() < 1e-8
            && (g - 0.2140).abs() < 1e-3
            && b == 1.0
    );
    assert!(read.notes[0].starts_with("16 bits"), "{:?}", read.notes);

    let path = folder.0.path().join("sky.jpg");
    image::RgbImage::from_pixel(32, 16, image::Rgb([128; 3]))
        .save(&path)
        .unwrap();
    assert!((read_all(&path).environment.radiance.at(3, 3)[1] - 0.2159).abs() < 0.01);
}

#[test]
fn other_shapes_are_guessed_with_a_word_or_refused() {
    let folder = Folder::new();
    let path = folder.0.path().join("shape.exr");
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    let write = |w, h| write_exr(&path, &picture(w, h), &rgb, (0, 0), (w, h));
    write(64, 64);
    let error = super::read(&path, &Reading::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("mirror ball"), "{error}");
    write(60, 40);
    assert!(read_all(&path).notes[0].contains("stretched"));
    write(64, 33);
    assert!(read_all(&path).notes.is_empty());
    write(64, 48);
    assert!(read_all(&path).notes[0].contains("cross"));
    // A strip about the horizon.
    for width in [64, 24, 10] {
        write(64, 12);
        let read = read(
            &path,
            &Reading {
                width,
                mapping: None,
            },
        )
        .unwrap();
        assert!(read.notes[0].contains("68° in height"), "{:?}", read.notes);
        let image = &read.environment.radiance;
        assert_eq!(image.size(), (width, width / 2));
        assert_eq!(image.pixels[0], image.pixels[width - 1]);
        let (low, high) = image
            .pixels
            .iter()
            .flatten()
            .fold((9f32, 0f32), |(a, b), v| (a.min(*v), b.max(*v)));
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
            // Pixels whose middle lies beyond a disc's rim show what is just within it.
            let shown = (0..10).find_map(|step| {
                let pull = 1.0 - 0.01 * f64::from(step);
                let place =
                    |p: usize, size: usize| 0.5 + pull * ((p as f64 + 0.5) / size as f64 - 0.5);
                mapping.direction(place(x, size.0), place(y, size.1))
            });
            shown.map_or([9.0; 3], |d| sky(d.as_vec3()))
        });
        write_exr(&path, &image, &[("R", 0), ("G", 1), ("B", 2)], (0, 0), size);
        let read = read(
            &path,
            &Reading {
                width: 4096,
                mapping: Some(mapping),
            },
        )
        .unwrap();
        let (w, h) = read.environment.radiance.size();
        let (mut error, mut sphere) = (0.0, 0.0);
        for y in 0..h {
            for x in 0..w {
                let (is, wanted) = (
                    read.environment.radiance.at(x, y),
                    sky(texel_direction(x, y, w, h)),
                );
                error += texel_solid_angle(y, w, h)
                    * f64::from((is[0] - wanted[0]).powi(2) + (is[2] - wanted[2]).powi(2));
                sphere += texel_solid_angle(y, w, h);
            }
        }
        assert!(
            (error / sphere).sqrt() < 0.02,
            "{mapping:?}: {}",
            (error / sphere).sqrt()
        );
    }
}

#[test]
fn a_panorama_of_8192_columns_is_read_line_by_line() {
    let folder = Folder::new();
    let (w, h) = (8192, 4096);
    let mut bytes = format!("{HEADER}-Y {h} +X {w}\n").into_bytes();
    let line = hdr(
        "",
        &[(0..w).map(|x| [128, 64, (x / 64) as u8, 129]).collect()],
        Coding::New,
    );
    (0..h).for_each(|_| bytes.extend(&line));
    let path = folder.write("large.hdr", &bytes);
    let read = read(
        &path,
        &Reading {
            width: 512,
            mapping: None,
        },
    )
    .unwrap();
    assert_eq!(read.environment.radiance.size(), (512, 256));
    let sphere = 4.0 * std::f64::consts::PI;
    // Every blue code from 0 to 127 sixty-four times a line: 63.5/128 in the mean.
    for (is, wanted) in read
        .environment
        .energy()
        .into_iter()
        .zip([1.0, 0.5, 63.5 / 128.0])
    {
        assert!((is / sphere - wanted).abs() < 1e-5, "{is} for {wanted}");
    }
}
