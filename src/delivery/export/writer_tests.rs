use super::super::exr_settings::{ExrAlpha, ExrCompression, ExrSettings, LayerFiles, LayersBy, Samples};
use super::super::layers::LightLayer;
use super::super::look::output;
use super::super::still::tests::picture;
use super::super::{Bits, OutputSpace};
use super::*;
use imaging::file::read_encoded;
use imaging::{Encoded, Raster};
use scene::{Effects, Output};
use test_support::small_disk::{SmallDisk, names};

/// Stills at 24 frames per second.
fn film() -> Interview {
    Interview::stills(24.0)
}

/// Writer of these frames at this size.
fn open(files: &Files, frames: (usize, usize), size: (usize, usize)) -> Writer {
    let encoding = Encoding::for_files(files).unwrap();
    Writer::open(files, &encoding, frames, size, &film(), None, &Progress::silent()).unwrap()
}

/// A picture that compresses badly.
fn noise(size: usize) -> Picture {
    let mut state = 1u32;
    let codes = Raster::from_fn(size, size, |_, _| {
        [0; 3].map(|_: i32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        })
    });
    Picture { display: Some(Encoded(codes)), ..picture(size, size, [0.5; 3], true) }
}

/// Writes frames until an error.
fn fill(writer: &mut Writer, shown: &Picture) -> Error {
    let fails = (0..200).find_map(|frame| writer.write(frame, shown, None, None, &Progress::silent()).err());
    fails.or_else(|| writer.finish(&Progress::silent()).err()).expect("the disk has no room for this")
}

#[test]
fn stills_that_a_full_disk_had_room_for_are_kept_whole() {
    let Some(disk) = SmallDisk::mount(64) else { return };
    let (files, shown) = (Files::to(disk.at("shot.%04d.png")).unwrap(), noise(80));
    let mut writer = open(&files, (0, 199), (80, 80));
    let said = fill(&mut writer, &shown).to_string();
    let kept = disk.names();
    assert!(!kept.is_empty() && kept.len() < 5, "{kept:?}");
    for wanted in [format!("{} frames are kept", kept.len()), "room".to_owned(), format!("shot.{:04}.png", kept.len())]
    {
        assert!(said.contains(&wanted), "{said}: {wanted}");
    }
    for (frame, name) in kept.iter().enumerate() {
        assert_eq!(*name, format!("shot.{frame:04}.png"));
        read_encoded(&disk.0.path().join(name)).unwrap();
    }
}

#[test]
fn a_movie_that_a_full_disk_has_no_room_for_leaves_nothing_and_what_was_there() {
    if !test_support::ffmpeg() {
        return;
    }
    for (name, kib) in [("clip.mp4", 64), ("clip.mov", 64)] {
        let Some(disk) = SmallDisk::mount(kib) else { return };
        std::fs::write(disk.at(name), "an older movie").unwrap();
        let files = Files::to(disk.at(name)).unwrap();
        let mut writer = open(&files, (0, 199), (256, 256));
        let said = fill(&mut writer, &noise(256)).to_string();
        drop(writer);
        assert!(said.contains("room"), "{said}");
        assert_eq!(disk.names(), [name]);
        assert_eq!(std::fs::read(disk.at(name)).unwrap(), b"an older movie");
    }
}

#[test]
fn what_is_there_is_kept_or_replaced_as_it_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("shot.%02d.png").display().to_string();
    let shown = picture(16, 16, [0.5; 3], true);
    for existing in [Existing::Keep, Existing::Keep, Existing::Replace] {
        let files = Files { existing, ..Files::to(&to).unwrap() };
        let mut writer = open(&files, (3, 4), (16, 16));
        for frame in [3, 4] {
            writer.write(frame, &shown, None, None, &Progress::silent()).unwrap();
        }
        writer.finish(&Progress::silent()).unwrap();
    }
    let wanted = ["shot.03.png", "shot.04.png", "shot_2.03.png", "shot_2.04.png"];
    assert_eq!(names(folder.path()), wanted);
}

#[test]
fn pictures_are_written_at_the_size_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size) in [("small.png", 16), ("large.exr", 50)] {
        let files = Files { size: Some(size), ..Files::to(folder.path().join(name).display().to_string()).unwrap() };
        let mut writer = open(&files, (0, 0), (32, 32));
        writer.write(0, &picture(32, 32, [0.5; 3], false), None, None, &Progress::silent()).unwrap();
        let found = imaging::file::dimensions(&folder.path().join(name)).unwrap();
        assert_eq!(found, (size, size));
    }
}

#[test]
fn numbers_no_file_can_have_are_refused() {
    for number in [i64::MAX, i64::MIN, 1_000_000_001] {
        let files = Files { first_number: Some(number), ..Files::to("out.%04d.png").unwrap() };
        let error = check_files(&files, 2).unwrap_err().to_string();
        assert!(error.contains(&number.to_string()), "{error}");
    }
}

#[test]
fn sixteen_bits_are_made_of_light_unless_an_effect_works_on_codes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.png");
    let files = Files { bits: Bits::Sixteen, ..Files::to(path.display().to_string()).unwrap() };
    let mut writer = open(&files, (0, 0), (16, 16));
    let grainy = Effects { grain: 1.0, ..Effects::default() };
    let kind = |effects: &Effects| output(&files, (16, 16), &writer.encoding, effects);
    assert_eq!(kind(&Effects::default()), Output::Linear);
    assert_eq!(kind(&grainy), Output::Display);
    let linear = Picture { display: None, ..picture(16, 16, [0.3, 0.2, 0.1], true) };
    writer.write(0, &linear, None, None, &Progress::silent()).unwrap();
    let codes = view(linear.linear.as_ref().unwrap(), linear.view).0.pixels[0];
    let read = read_encoded(&path).unwrap().0.pixels[0];
    assert!((0..3).all(|c| (codes[c] - read[c]).abs() < 1.0 / 65535.0));
}

#[test]
fn every_still_at_another_size_averages_light() {
    let folder = tempfile::tempdir().unwrap();
    // Highlights above white beside black: their mean light is not that of their codes.
    let stripes = Raster::from_fn(32, 32, |x, _| if x % 2 == 0 { [1.2, 0.9, 0.2] } else { [0.0; 3] });
    let shown = Picture { linear: Some(stripes), display: None, ..picture(32, 32, [0.0; 3], true) };
    let mean = Raster::filled(1, 1, [0.6, 0.45, 0.1]);
    let codes = view(&mean, shown.view).0.pixels[0];
    for (name, bits, near) in [
        ("a.png", Bits::Eight, 0.51 / 255.0),
        ("b.png", Bits::Sixteen, 1e-4),
        ("c.tif", Bits::Eight, 1e-4),
        ("d.exr", Bits::Eight, 1e-3),
    ] {
        let path = folder.path().join(name);
        let files = Files { size: Some(16), bits, ..Files::to(path.display().to_string()).unwrap() };
        let mut writer = open(&files, (0, 0), (32, 32));
        let kind = |size: (usize, usize)| {
            let effects = Effects::default();
            output(&files, size, &writer.encoding, &effects)
        };
        assert_eq!(kind((32, 32)), Output::Linear, "{name}");
        let own = if name == "a.png" { Output::Display } else { Output::Linear };
        assert_eq!(kind((16, 16)), own, "{name} at its own size");
        writer.write(0, &shown, None, None, &Progress::silent()).unwrap();
        let (read, wanted) = match name {
            "d.exr" => (imaging::file::read_linear(&path).unwrap(), mean.pixels[0]),
            _ => (read_encoded(&path).unwrap().0, codes),
        };
        assert_eq!(read.size(), (16, 16));
        for pixel in &read.pixels {
            assert!((0..3).all(|c| (pixel[c] - wanted[c]).abs() < near), "{name}: {pixel:?}");
        }
    }
}

#[test]
fn what_a_destination_cannot_hold_is_refused() {
    let refused = |files: &Files, frames| check_files(files, frames).unwrap_err().to_string();
    let mut files = Files::to("clip.mp4").unwrap();
    files.layers = true;
    assert!(refused(&files, 1).contains("%04d.exr"));
    let mut files = Files::to("a.%04d.png").unwrap();
    files.size = Some(3);
    assert!(refused(&files, 9).contains("16 to 8192"));
    assert!(refused(&Files::to("a.png").unwrap(), 2).contains("2 frames"));
}

#[test]
fn the_next_export_removes_what_a_killed_one_left() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(60);
    for name in [".clip.mov.A1b2C3.afterlight", "clip.mov", ".mine.afterlight"] {
        let file = std::fs::File::create(at(name)).unwrap();
        file.set_modified(long_ago).unwrap();
    }
    let to = at("shot.%02d.png").display().to_string();
    open(&Files::to(to).unwrap(), (0, 3), (16, 16));
    assert_eq!(names(folder.path()), [".mine.afterlight", "clip.mov"]);
    test_support::shown!(
        Accidents,
        "An export that was killed",
        done: "the next export to that folder removes the unfinished file; files with other names are never touched"
    );
}

/// The sum of lamps on a subject whose coverage falls to the right, the same with a background, and the lamps.
fn lit() -> (Picture, LightLayers) {
    let subject = picture(12, 7, [0.5, 0.25, 2.0], false);
    let layer = |index: usize| {
        let weight = [0.5, 0.25, 1.5].map(|w| w + index as f32);
        let light = subject.linear.as_ref().unwrap();
        let share = if index == 0 { 0.7 } else { 0.3 };
        LightLayer {
            lamp: format!("{index}"),
            weight,
            picture: light.map(|p| std::array::from_fn(|c| share * p[c] / weight[c])),
        }
    };
    let lamps = (0..2).map(layer).collect();
    let layers = LightLayers { lamps, subject: subject.linear.clone(), ..LightLayers::default() };
    let mut shown = subject.clone();
    shown.display = None;
    for pixel in &mut shown.linear.as_mut().unwrap().pixels {
        pixel[1] += 0.125;
    }
    (shown, layers)
}

#[test]
fn every_way_to_keep_layers_gives_back_the_picture() {
    for (layers, files) in [(LayerFiles::Channels, 2), (LayerFiles::Parts, 2), (LayerFiles::Files, 5)] {
        for (space, alpha, samples, compression, crop) in [
            (None, ExrAlpha::Premultiplied, Samples::Half, ExrCompression::Zip, false),
            (Some(OutputSpace::Acescg), ExrAlpha::Straight, Samples::Float, ExrCompression::Piz, true),
            (Some(OutputSpace::P3), ExrAlpha::Premultiplied, Samples::Half, ExrCompression::None, true),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let exr =
                ExrSettings { samples, compression, alpha, crop, layers, layers_by: LayersBy::Lamp, weights: true };
            let files_settings = Files {
                exr,
                space,
                layers: true,
                ..Files::to(folder.path().join("shot.%04d.exr").display().to_string()).unwrap()
            };
            let silent = Progress::silent();
            let mut writer = open(&files_settings, (7, 7), (12, 7));
            let (shown, lit) = lit();
            let check = writer.write(7, &shown, Some(lit), None, &silent).unwrap();
            assert!(check.unwrap().is_exact(), "{exr:?}: {check:?}");
            let path = folder.path().join("shot.0007.exr");
            let found = Rebuild::of_file(&path).unwrap();
            assert!(found.layers == 2 && found.is_exact() && found.brightest > 1.0, "{exr:?}: {found:?}");
            assert_eq!(names(folder.path()).len(), files, "{:?}", names(folder.path()));
            let json = std::fs::read_to_string(folder.path().join("shot.0007.json")).unwrap();
            let json: serde_json::Value = serde_json::from_str(&json).unwrap();
            assert_eq!(json["layers"][1]["layer"], "light_01");
            assert_eq!(json["rest"]["layer"], "rest");
            let read = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
            let alpha = &read.layer_data[0].attributes.other[&exr::meta::attribute::Text::from("alpha")];
            assert_eq!(format!("{alpha:?}").contains("straight"), exr.alpha == ExrAlpha::Straight);
            let window = (read.layer_data[0].size.width(), read.attributes.display_window.size.width());
            // The last column has no coverage, only background.
            assert_eq!(window, (12, 12));
        }
    }
}

#[test]
fn layers_that_miss_the_picture_are_not_written_and_files_that_lie_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let files = Files { layers: true, ..Files::to(path.display().to_string()).unwrap() };
    let silent = Progress::silent();
    let write = |change: f32| {
        let (shown, mut layers) = lit();
        layers.lamps[0].picture.pixels[3][0] *= change;
        let mut writer = open(&files, (0, 0), (12, 7));
        writer.write(0, &shown, Some(layers), None, &silent)
    };
    assert!(write(1.0).unwrap().unwrap().is_exact());
    assert!(Rebuild::of_file(&path).unwrap().is_exact());
    let whole = std::fs::read(&path).unwrap();
    let said = write(1.2).unwrap_err().to_string();
    assert!(said.contains("miss the relit subject"), "{said}");
    assert!(std::fs::read(&path).unwrap() == whole, "the earlier file stays");
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(Rebuild::of_file(&path).unwrap_err().to_string().contains("a.exr"));
    imaging::file::write_exr(&path, &imaging::Image::filled(4, 4, [0.5; 3])).unwrap();
    assert!(Rebuild::of_file(&path).unwrap_err().to_string().contains("weights"));
    // A layer's file must lie beside its picture.
    let apart = Files { exr: ExrSettings { layers: LayerFiles::Files, ..ExrSettings::default() }, ..files.clone() };
    let (shown, layers) = lit();
    let mut writer = open(&apart, (0, 0), (12, 7));
    writer.write(0, &shown, Some(layers), None, &silent).unwrap();
    let json = folder.path().join("a.json");
    let text = std::fs::read_to_string(&json).unwrap();
    std::fs::write(&json, text.replace("a.light_01.exr", "/etc/passwd")).unwrap();
    let said = Rebuild::of_file(&path).unwrap_err().to_string();
    assert!(said.contains("/etc/passwd") && said.contains("without a folder"), "{said}");
    test_support::shown!(Strangers, "An EXR that is truncated, has no weights, or whose JSON names a file in another folder", bound: "none", measured: "refused");
}

#[test]
fn what_is_empty_is_left_out_if_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let alpha = Raster::from_fn(9, 8, |x, y| if (2..5).contains(&x) && y == 6 { 1.0 } else { 0.0 });
    let mut shown = picture(9, 8, [0.0; 3], true);
    shown.linear = Some(alpha.map(|a| [a; 3]));
    shown.alpha = alpha;
    let files = Files {
        exr: ExrSettings { crop: true, ..ExrSettings::default() },
        ..Files::to(path.display().to_string()).unwrap()
    };
    let silent = Progress::silent();
    let window = |shown: &Picture| {
        let mut writer = open(&files, (0, 0), (9, 8));
        writer.write(0, shown, None, None, &silent).unwrap();
        let read = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
        let part = &read.layer_data[0];
        let at = part.attributes.layer_position;
        assert_eq!(read.attributes.display_window.size.area(), 72);
        (at.x(), at.y(), part.size.width(), part.size.height())
    };
    assert_eq!(window(&shown), (2, 6, 3, 1));
    let nothing = picture(9, 8, [0.0; 3], false);
    let nothing = Picture { alpha: nothing.alpha.map(|_| 0.0), ..nothing };
    assert_eq!(window(&nothing), (0, 0, 1, 1));
}

#[test]
fn stills_and_movies_refuse_what_is_the_others() {
    let check = |files: Files| check_files(&files, 1).map_err(|e| e.to_string());
    let to = |name: &str| Files::to(name).unwrap();
    let said = check(Files { codec: Some(Codec::H264), ..to("a.png") });
    assert!(said.unwrap_err().contains("are stills"));
    let said = check(Files { codec: Some(Codec::ProRes422Hq), ..to("a.mp4") });
    assert!(said.unwrap_err().contains(".mov"));
    let said = check(Files { space: Some(OutputSpace::Acescg), ..to("a.mov") });
    assert!(said.unwrap_err().contains("linear light"));
    let premultiplied = |name: &str| check(Files { movie_alpha: MovieAlpha::Premultiplied, ..to(name) });
    let said = premultiplied("a.mp4").unwrap_err();
    assert!(said.contains("H.264 keeps no alpha"), "{said}");
    assert!(premultiplied("a.mov").is_ok() && premultiplied("a.mkv").is_ok());
    let said = check(Files { lut: Some("look.cube".into()), ..to("a.exr") });
    assert!(said.unwrap_err().contains("look.cube"));
    assert!(check(to("a.tif")).is_ok() && check(to("a.mxf")).is_ok() && check(to("a.mkv")).is_ok());
}
