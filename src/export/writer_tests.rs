use super::super::still::tests::picture;
use super::*;
use imaging::file::read_encoded;
use imaging::{Encoded, Raster};
use test_support::small_disk::{SmallDisk, names};

/// A picture that no codec makes much smaller.
fn noise(size: usize) -> Picture {
    let mut state = 1u32;
    let codes = Raster::from_fn(size, size, |_, _| {
        [0; 3].map(|_: i32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        })
    });
    Picture {
        display: Some(Encoded(codes)),
        ..picture(size, size, [0.5; 3], true)
    }
}

/// Writes frames until one cannot be written.
fn fill(writer: &mut Writer, shown: &Picture) -> Error {
    let fails =
        (0..200).find_map(|frame| writer.write(frame, shown, None, &Progress::silent()).err());
    fails
        .or_else(|| writer.finish(&Progress::silent()).err())
        .expect("the disk has no room for this")
}

#[test]
fn stills_that_a_full_disk_had_room_for_are_kept_whole() {
    let Some(disk) = SmallDisk::mount(64) else {
        return;
    };
    let (files, shown) = (Files::to(disk.at("shot.%04d.png")), noise(80));
    let mut writer = Writer::open(&files, (0, 199), (80, 80), 24.0).unwrap();
    let said = fill(&mut writer, &shown).to_string();
    let kept = disk.names();
    assert!(!kept.is_empty() && kept.len() < 5, "{kept:?}");
    for wanted in [
        format!("{} frames are kept", kept.len()),
        "room".to_owned(),
        format!("shot.{:04}.png", kept.len()),
    ] {
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
        let Some(disk) = SmallDisk::mount(kib) else {
            return;
        };
        std::fs::write(disk.at(name), "an older movie").unwrap();
        let files = Files::to(disk.at(name));
        let mut writer = Writer::open(&files, (0, 199), (256, 256), 24.0).unwrap();
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
        let files = Files {
            existing,
            ..Files::to(&to)
        };
        let mut writer = Writer::open(&files, (3, 4), (16, 16), 24.0).unwrap();
        for frame in [3, 4] {
            writer
                .write(frame, &shown, None, &Progress::silent())
                .unwrap();
        }
        writer.finish(&Progress::silent()).unwrap();
    }
    let wanted = [
        "shot.03.png",
        "shot.04.png",
        "shot_2.03.png",
        "shot_2.04.png",
    ];
    assert_eq!(names(folder.path()), wanted);
}

#[test]
fn pictures_are_written_at_the_size_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size) in [("small.png", 16), ("large.exr", 50)] {
        let files = Files {
            size: Some(size),
            ..Files::to(folder.path().join(name).display().to_string())
        };
        let mut writer = Writer::open(&files, (0, 0), (32, 32), 24.0).unwrap();
        writer
            .write(
                0,
                &picture(32, 32, [0.5; 3], false),
                None,
                &Progress::silent(),
            )
            .unwrap();
        let found = imaging::file::dimensions(&folder.path().join(name)).unwrap();
        assert_eq!(found, (size, size));
    }
}

#[test]
fn sixteen_bits_are_made_of_light_unless_an_effect_works_on_codes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.png");
    let files = Files {
        bits: Bits::Sixteen,
        ..Files::to(path.display().to_string())
    };
    let mut writer = Writer::open(&files, (0, 0), (16, 16), 24.0).unwrap();
    let grainy = Effects {
        grain: 1.0,
        ..Effects::default()
    };
    assert_eq!(writer.output(&Effects::default()), Output::Linear);
    assert_eq!(writer.output(&grainy), Output::Display);
    let linear = Picture {
        display: None,
        ..picture(16, 16, [0.3, 0.2, 0.1], true)
    };
    writer.write(0, &linear, None, &Progress::silent()).unwrap();
    let codes = view(linear.linear.as_ref().unwrap(), linear.view).0.pixels[0];
    let read = read_encoded(&path).unwrap().0.pixels[0];
    assert!((0..3).all(|c| (codes[c] - read[c]).abs() < 1.0 / 65535.0));
}

#[test]
fn what_a_destination_cannot_hold_is_refused() {
    let refused = |files: &Files, frames| check(files, &files.to, frames).unwrap_err().to_string();
    let mut files = Files::to("clip.mp4");
    files.layers = true;
    assert!(refused(&files, 1).contains("%04d.exr"));
    let mut files = Files::to("a.%04d.png");
    files.size = Some(3);
    assert!(refused(&files, 9).contains("16 to 8192"));
    assert!(refused(&Files::to("a.png"), 2).contains("2 frames"));
}

#[test]
fn the_next_export_removes_what_a_killed_one_left() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(60);
    for name in [
        ".clip.mov.A1b2C3.afterlight",
        "clip.mov",
        ".mine.afterlight",
    ] {
        let file = std::fs::File::create(at(name)).unwrap();
        file.set_modified(long_ago).unwrap();
    }
    let to = at("shot.%02d.png").display().to_string();
    Writer::open(&Files::to(to), (0, 3), (16, 16), 24.0).unwrap();
    assert_eq!(names(folder.path()), [".mine.afterlight", "clip.mov"]);
    test_support::shown!(
        Accidents,
        "An export that was killed",
        danger: "its unfinished file stays in the person's folder",
        done: "the next export to that folder removes it, and nothing that is not named as the program names such files"
    );
}
