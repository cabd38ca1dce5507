use super::super::clip::{ClipWriter, Movie};
use super::super::colors::Encoding;
use super::super::format::MovieAlpha;
use super::super::still::tests::picture;
use super::super::time_code::TimeCode;
use super::*;
use base::progress::Progress;
use std::process::Command;
use test_support::ffmpeg;

const ALL: [Codec; 8] = [
    Codec::H264,
    Codec::H265,
    Codec::ProRes4444,
    Codec::ProRes422Hq,
    Codec::DnxhrHq,
    Codec::DnxhrHqx,
    Codec::Dnxhr444,
    Codec::Ffv1,
];

fn movie(codec: Codec, space: Option<OutputSpace>) -> Movie {
    Movie {
        codec,
        frame_rate: 23.976,
        time_code: TimeCode::parse("10:20:30:12", 23.976),
        reel: Some("A001_C002".to_owned()),
        encoding: Encoding::open(space, None).unwrap(),
        alpha: MovieAlpha::default(),
        sound: None,
    }
}

fn probed(path: &Path) -> serde_json::Value {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-show_streams", "-show_format", "-of", "json"])
        .arg(path)
        .output()
        .unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

/// First frame of a movie as 16-bit RGB.
fn decoded(path: &Path, matrix: &str) -> Vec<u16> {
    let output = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(path)
        .args(["-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "rgb48le", "-vf"])
        .arg(format!("scale=in_color_matrix={matrix}:flags=accurate_rnd+full_chroma_int"))
        .arg("-")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let word = |b: &[u8]| u16::from_le_bytes([b[0], b[1]]);
    output.stdout.chunks_exact(2).map(word).collect()
}

#[test]
fn every_codec_says_its_colours_rate_time_and_reel_and_keeps_its_codes() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(258, 122, [0.6, 0.2, 0.05], true);
    let code = shown.display.as_ref().unwrap().0.pixels[0];
    for codec in ALL {
        for &container in codec.endings() {
            let path = folder.path().join(format!("a b'{}{}", codec.name(), container.ending()));
            for space in [None, Some(OutputSpace::Srgb), Some(OutputSpace::P3), Some(OutputSpace::Rec2020)] {
                let is_first = container == codec.endings()[0];
                if !is_first && space.is_some() {
                    continue;
                }
                let movie = movie(codec, space);
                let mut writer = ClipWriter::create(&path, (258, 122), &movie).unwrap();
                (0..2).for_each(|_| writer.push(&shown, &Progress::silent()).unwrap());
                writer.finish(&Progress::silent()).unwrap();
                let found = probed(&path);
                let streams = found["streams"].as_array().unwrap();
                let video = streams.iter().find(|s| s["codec_type"] == "video").unwrap();
                let tags = codec.tags(space);
                for (key, wanted) in [
                    ("color_primaries", tags.primaries),
                    ("color_transfer", tags.transfer),
                    ("color_space", tags.matrix),
                    ("color_range", tags.range),
                    ("r_frame_rate", "24000/1001"),
                ] {
                    assert_eq!(video[key], wanted, "{codec:?} in {container:?}, {space:?}: {key}");
                }
                assert_eq!((video["width"].as_u64(), video["height"].as_u64()), (Some(258), Some(122)));
                let everything = found.to_string();
                assert!(everything.contains("10:20:30:12"), "{codec:?} {container:?}: {everything}");
                if container != Container::Mp4 {
                    assert!(everything.contains("A001_C002"), "{codec:?} {container:?}: {everything}");
                }
                let wanted = movie.encoding.codes()(code);
                let matrix = if tags.matrix == "bt2020nc" { "bt2020" } else { "bt709" };
                // Rounding to 8 or 10 bits, plus the encoder's loss.
                let within = if codec.is_rgb() { 1e-4 } else { 0.012 };
                for pixel in decoded(&path, matrix).chunks(3) {
                    for c in 0..3 {
                        let found = f32::from(pixel[c]) / 65535.0;
                        assert!((found - wanted[c]).abs() < within, "{codec:?} {space:?}: {found}, not {}", wanted[c]);
                    }
                }
            }
            if matches!(container, Container::Mov | Container::Mp4) {
                // The atom that players read; QuickTime's has no range.
                let bytes = std::fs::read(&path).unwrap();
                let at = bytes.windows(4).position(|w| w == b"colr").unwrap();
                let number = |i: usize| u16::from_be_bytes([bytes[at + 8 + 2 * i], bytes[at + 9 + 2 * i]]);
                // Rec. 2020 came last, or only Rec. 709.
                let wanted = if container == codec.endings()[0] { 9 } else { 1 };
                assert_eq!([number(0), number(2)], [wanted; 2], "{codec:?} in {container:?}");
            }
        }
    }
}

/// Luma of the first frame's middle row, in the movie's own codes, with their bits.
fn luma(path: &Path, width: usize, height: usize) -> (Vec<u16>, u32) {
    let found = probed(path);
    let streams = found["streams"].as_array().unwrap();
    let video = streams.iter().find(|s| s["codec_type"] == "video").unwrap();
    let format = video["pix_fmt"].as_str().unwrap();
    let bits = [10, 12].into_iter().find(|bits| format.ends_with(&format!("p{bits}le")));
    let output = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(path)
        .args(["-frames:v", "1", "-f", "rawvideo", "-pix_fmt", format, "-"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = height / 2 * width;
    let codes: Vec<u16> = match bits {
        Some(_) => {
            let words = output.stdout.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]));
            words.skip(row).take(width).collect()
        }
        None => output.stdout[row..][..width].iter().map(|&code| u16::from(code)).collect(),
    };
    (codes, bits.unwrap_or(8))
}

#[test]
fn a_ramp_has_the_codes_of_limited_range_in_every_codec() {
    if !ffmpeg() {
        return;
    }
    // Black and white are as wide as an encoder's largest block.
    const FLAT: usize = 64;
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (1024, 128);
    let level = |x: usize| ((x as f32 - FLAT as f32) / (width - 2 * FLAT - 1) as f32).clamp(0.0, 1.0);
    let codes = imaging::Image::from_fn(width, height, |x, _| [level(x); 3]);
    let mut shown = picture(width, height, [1.0; 3], true);
    shown.display = Some(imaging::Encoded(codes));
    for codec in ALL.into_iter().filter(|codec| !codec.is_rgb()) {
        for space in [None, Some(OutputSpace::Rec2020)] {
            let path = folder.path().join(format!("{}{}", codec.name(), codec.ending()));
            let movie = movie(codec, space);
            let mut writer = ClipWriter::create(&path, (width, height), &movie).unwrap();
            writer.push(&shown, &Progress::silent()).unwrap();
            writer.finish(&Progress::silent()).unwrap();
            let (found, bits) = luma(&path, width, height);
            let code = f32::from(1u16 << (bits - 8));
            // ProRes 4444 decodes to 12 bits, but ffmpeg's encoder takes 10.
            let step = if codec == Codec::ProRes4444 { 4.0 } else { 1.0 };
            // H.264 and H.265 ring where BT.1886 is steep, near black.
            let is_lossy = matches!(codec, Codec::H264 | Codec::H265);
            let within = if is_lossy { 4.0 } else { step };
            let encoded = movie.encoding.codes();
            let mut sum = 0.0;
            for (x, &found) in found.iter().enumerate() {
                let wanted = (16.0 + 219.0 * encoded([level(x); 3])[0]) * code;
                let off = f32::from(found) - wanted;
                assert!(off.abs() <= within, "{codec:?} {space:?}, column {x}: {found}, not {wanted}");
                sum += off;
            }
            let mean = sum / width as f32;
            assert!(mean.abs() <= 0.25 * step, "{codec:?} {space:?}: off by {mean} in the mean");
            let ends = [found[8], found[width - 8]].map(f32::from);
            for (found, wanted) in ends.into_iter().zip([16.0 * code, 235.0 * code]) {
                assert!((found - wanted).abs() <= 1.0, "{codec:?}: {found}, not {wanted}");
            }
        }
    }
}

#[test]
fn sizes_and_rates_that_a_codec_has_not_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let said = |name: &str, codec, size, frame_rate| {
        let movie = Movie { frame_rate, ..movie(codec, None) };
        let created = ClipWriter::create(&folder.path().join(name), size, &movie);
        created.err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(said("a.mov", Codec::DnxhrHq, (128, 128), 24.0).contains("256 × 120"));
    assert!(said("a.mp4", Codec::H264, (8, 64), 24.0).contains("16 × 16"));
    assert!(said("a.mxf", Codec::DnxhrHq, (256, 128), 12.5).contains("12.5"));
    assert_eq!(Codec::Ffv1.padded((33, 17)), (33, 17));
    assert_eq!(Codec::ProRes422Hq.padded((33, 17)), (34, 18));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let wrong = Codec::for_path(Some(Codec::Ffv1), Path::new("a.mov")).unwrap_err().to_string();
    assert!(wrong.contains("FFV1") && wrong.contains(".mkv"), "{wrong}");
}

#[test]
fn names_that_ffmpeg_could_take_for_something_else_are_names() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(16, 16, [0.5; 3], true);
    let names = [
        "-y.mp4",
        "a b.mp4",
        "quote'\"s.mp4",
        "line\nbreak.mp4",
        "concat:a|b.mp4",
        "http:,,x.mp4",
        "%d.mp4",
        "file:x.mp4",
        "pipe:1.mp4",
        "$(touch x).mp4",
    ];
    for name in names {
        let path = folder.path().join(name);
        let mut writer = ClipWriter::create(&path, (16, 16), &movie(Codec::H264, None)).unwrap();
        writer.push(&shown, &Progress::silent()).unwrap();
        writer.finish(&Progress::silent()).unwrap();
        assert!(std::fs::metadata(&path).unwrap().len() > 500, "{name}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), names.len());
    test_support::shown!(Strangers, "A movie's name with spaces, quotes, a line break, a dash in front, concat: or http:",
        bound: "one file under that name", measured: "one file under each of 10 names");
}
