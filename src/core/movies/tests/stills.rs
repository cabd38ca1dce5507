//! Sequences of pictures: EXR in every compression, and very long ones.

use super::*;
use base::memory;

/// A picture of linear light that shows a frame's number.
fn picture_of(number: usize) -> impl Fn(exr::math::Vec2<usize>) -> (f32, f32, f32) + Sync {
    move |at| {
        let bit = number >> (at.x() / BLOCK) & 1;
        let light = if bit == 1 { 0.6 } else { 0.02 };
        (light, light, 4.0 * light)
    }
}

#[test]
fn exr_sequences_of_every_compression_are_read() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let all = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ];
    let file = |frame: usize| folder.path().join(format!("shot.{:04}.exr", 1001 + frame));
    for (frame, compression) in all.into_iter().enumerate() {
        let channels = SpecificChannels::rgb(picture_of(frame));
        let encoding = Encoding { compression, ..Encoding::FAST_LOSSLESS };
        let layer = Layer::new(SIZE, LayerAttributes::named(""), encoding, channels);
        Image::from_layer(layer).write().to_file(file(frame)).unwrap();
    }
    let tools = tools(folder.path());
    let sequence = Source::open(&folder.path().join("shot.####.exr"), &tools).unwrap();
    assert_eq!((sequence.first(), sequence.count().unwrap(), sequence.size()), (1001, 10, SIZE));
    for (frame, compression) in all.into_iter().enumerate() {
        let pixels = sequence.frame(1001 + frame as u64).unwrap();
        assert_eq!(number(&pixels), frame, "{compression:?}");
        // Light is encoded as sRGB, and values above 1 are clipped.
        let [red, _, blue] = pixels.encoded().0.at(BLOCK / 2, 16);
        let lit = frame & 1 == 1;
        let wanted = imaging::color::srgb_from_linear(if lit { 0.6 } else { 0.02 });
        assert!((red - wanted).abs() < 0.01, "{compression:?}: {red}, {wanted}");
        assert!(!lit || blue == 1.0, "{compression:?}: {blue}");
    }
    assert!(sequence.notes().iter().any(|note| note.contains("EXR")));
    // A compression known only to newer programs.
    let path = file(2);
    let mut bytes = std::fs::read(&path).unwrap();
    let name = b"compression\0compression\0";
    let at = bytes.windows(name.len()).position(|part| part == name).unwrap();
    bytes[at + name.len() + 4] = 11;
    std::fs::write(&path, bytes).unwrap();
    let said = sequence.frame(1003).unwrap_err().for_terminal();
    assert!(said.contains("shot.1003.exr") && said.contains("oiiotool"), "{said}");
    shown!(
        Strangers,
        "An EXR sequence is compressed by DWAA, DWAB, PIZ, B44 or any other method of OpenEXR 2, or by a newer one",
        done: "those of OpenEXR 2 are read; for a newer one the error says how to convert the pictures",
    );
}

/// Number of bytes that this thread has read from files.
#[cfg(target_os = "linux")]
fn bytes_read() -> u64 {
    let said = std::fs::read_to_string("/proc/thread-self/io").unwrap();
    let read = said.lines().find_map(|line| line.strip_prefix("rchar: "));
    read.unwrap().parse().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn a_hundred_thousand_stills_are_listed_and_only_those_asked_for_are_read() {
    const STILLS: u64 = 100_000;
    let folder = tempfile::tempdir().unwrap();
    let shots = folder.path().join("shots");
    std::fs::create_dir(&shots).unwrap();
    let still = |i: u64| shots.join(format!("shot.{i}.png"));
    image::GrayImage::new(16, 16).save(still(0)).unwrap();
    // A file may have 65,000 hard links.
    let mut source = still(0);
    for i in 1..STILLS {
        if i % 50_000 == 0 {
            std::fs::copy(&source, still(i)).unwrap();
            source = still(i);
        } else {
            std::fs::hard_link(&source, still(i)).unwrap();
        }
    }
    std::fs::remove_file(still(77_777)).unwrap();
    image::GrayImage::from_pixel(16, 16, image::Luma([255])).save(still(77_777)).unwrap();
    let size = still(0).metadata().unwrap().len();
    let before = (memory::held().unwrap_or(0), bytes_read());
    let all = Sequence::open(&shots, &tools(folder.path())).unwrap();
    let numbered = Sequence::open(&shots.join("shot.%d.png"), &tools(folder.path())).unwrap();
    for sequence in [&all, &numbered] {
        assert_eq!((sequence.count(), sequence.gaps()), (STILLS, vec![]));
        let [dark, bright] = [77_776, 77_777].map(|i| sequence.frame(i).unwrap().codes[0]);
        assert_eq!((dark, bright), (0, 65535), "frames are in the order of their numbers");
    }
    let read = bytes_read() - before.1;
    let more = memory::held().unwrap_or(0).saturating_sub(before.0);
    assert!(read < 60 * size + 20_000, "{read} bytes for stills of {size}");
    assert!(more < 64 << 20, "{more} bytes");
    shown!(
        Strangers,
        "An interview of a hundred thousand stills",
        bound: "64 MB more memory, and no still read without a request",
        measured: format!("{} MB, {} kB read", more >> 20, read / 1000),
    );
}

#[test]
fn a_pattern_takes_letters_of_any_case_and_names_its_gaps() {
    let folder = tempfile::tempdir().unwrap();
    for (name, code) in [
        ("shot.0001.png", 10),
        ("SHOT.0002.PNG", 20),
        ("shot.0005.png", 50),
        ("shot.-0003.png", 0),
        ("shot.-0001.png", 0),
        ("._shot.0003.png", 0),
    ] {
        let picture = image::GrayImage::from_pixel(16, 16, image::Luma([code]));
        picture
            .write_to(&mut std::fs::File::create(folder.path().join(name)).unwrap(), image::ImageFormat::Png)
            .unwrap();
    }
    let tools = tools(folder.path());
    let numbered = Source::open(&folder.path().join("shot.%04d.png"), &tools).unwrap();
    assert_eq!((numbered.first(), numbered.count().unwrap()), (1, 5));
    assert_eq!(numbered.frame(2).unwrap().codes[0], 20 * 257);
    let missing = numbered.frame(3).unwrap_err().to_string();
    assert!(missing.contains("shot.0003.png"), "{missing}");
    let notes = numbered.notes().join(" ");
    assert!(notes.contains("Pictures 3–4") && notes.contains("below 0"), "{notes}");
    // A folder has them all, from -3 on.
    let all = Source::open(folder.path(), &tools).unwrap();
    let codes = [0, 1, 2, 3, 4].map(|frame| all.frame(frame).unwrap().codes[0] / 257);
    assert_eq!((all.count().unwrap(), codes), (5, [0, 0, 10, 20, 50]));
    for name in ["shot.0001.png", "SHOT.0002.PNG", "shot.0005.png"] {
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
    let said = Source::open(&folder.path().join("shot.%04d.png"), &tools).unwrap_err().to_string();
    assert!(said.contains("below 0") && said.contains("folder"), "{said}");
}
