//! Movies made by ffmpeg whose frames show their own numbers.

mod alpha;
mod stills;
mod strange;

use super::*;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use test_support::shown;

/// Binary digits of a frame's number, each a block of pixels.
const DIGITS: usize = 8;
const BLOCK: usize = 16;
const SIZE: (usize, usize) = (BLOCK * DIGITS, 32);

fn tools(folder: &Path) -> Tools {
    Tools { cache: Some(folder.join("cache")), ..Tools::default() }
}

/// Makes a movie of frames that show the numbers from 0 on. `coding` holds ffmpeg's options.
fn make(path: &Path, frames: usize, rate: &str, coding: &str) {
    let size = format!("{}x{}", SIZE.0, SIZE.1);
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", &size]);
    command.args(["-r", rate, "-i", "pipe:0"]);
    command.args(coding.split_whitespace()).arg(path);
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    for frame in 0..frames {
        let pixel = |i: usize| 40 + 160 * (frame >> (i % SIZE.0 / BLOCK) & 1) as u8;
        let bytes: Vec<u8> = (0..SIZE.0 * SIZE.1).map(pixel).collect();
        stdin.write_all(&bytes).unwrap();
    }
    drop(stdin);
    assert!(child.wait().unwrap().success());
}

fn ffmpeg(words: &[&str]) {
    let words = ["-v", "error", "-y"].iter().chain(words);
    assert!(Command::new("ffmpeg").args(words).status().unwrap().success());
}

/// The number shown in a frame.
fn number(pixels: &Pixels) -> usize {
    let picture = pixels.encoded().0;
    let (width, height) = picture.size();
    (0..DIGITS)
        .map(|digit| {
            let at = picture.at((2 * digit + 1) * width / (2 * DIGITS), height / 2);
            usize::from(at[1] > 0.5) << digit
        })
        .sum()
}

/// Forwards, backwards and by jumps.
fn orders(count: u64) -> Vec<u64> {
    let jumps = (0..count).map(|i| (i * 37 + 11) % count);
    (0..count).chain((0..count).rev()).chain(jumps).collect()
}

/// Checks that every frame of a movie shows its number, in any order, with and without earlier decoded frames.
fn check(path: &Path, expected: &[usize]) {
    let folder = path.parent().unwrap();
    let movie = Movie::open(path, &tools(folder)).unwrap();
    assert_eq!(movie.count().unwrap(), expected.len() as u64, "{}", path.display());
    for (i, frame) in orders(expected.len() as u64).into_iter().enumerate() {
        if i % 20 == 0 {
            movie.forget();
        }
        let read = movie.frame(frame).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(number(&read), expected[frame as usize], "frame {frame} of {}", path.display());
    }
}

#[test]
fn frame_n_is_frame_n_in_every_codec_and_order() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("b_frames.mp4", "25", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p"),
        (
            "pyramid.mkv",
            "30000/1001",
            "-c:v libx264 -bf 5 -b_strategy 0 -g 20 -pix_fmt yuv420p -x264-params b-pyramid=normal",
        ),
        ("open_gop.mp4", "24", "-c:v libx264 -bf 3 -g 10 -pix_fmt yuv420p -x264-params open-gop=1:scenecut=0"),
        ("refresh.mp4", "24", "-c:v libx264 -bf 0 -g 15 -pix_fmt yuv420p -x264-params intra-refresh=1"),
        (
            "open_gop.hevc.mp4",
            "24",
            "-c:v libx265 -bf 4 -g 10 -pix_fmt yuv420p10le -x265-params open-gop=1:log-level=none",
        ),
        ("slow.mp4", "1", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p"),
        ("stream.ts", "25", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p"),
        ("program.mpg", "25", "-c:v mpeg2video -bf 2 -g 9 -pix_fmt yuv420p -q:v 2"),
        ("xvid.avi", "25", "-c:v mpeg4 -bf 2 -g 9 -pix_fmt yuv420p -q:v 2"),
        ("prores.mov", "24000/1001", "-c:v prores_ks -profile:v 3"),
        ("dnxhr.mxf", "25", "-s 256x128 -c:v dnxhd -profile:v dnxhr_hq -pix_fmt yuv422p"),
        ("lossless.mkv", "24", "-c:v ffv1 -pix_fmt gray"),
        ("webm.webm", "24", "-c:v libvpx-vp9 -b:v 1M -g 12 -pix_fmt yuv420p -deadline realtime -cpu-used 8"),
    ];
    for (name, rate, coding) in cases {
        let path = folder.path().join(name);
        make(&path, 60, rate, coding);
        check(&path, &(0..60).collect::<Vec<_>>());
    }
    shown!(
        Strangers,
        "A movie with B frames, open groups of pictures or slow rates is read backwards and by jumps",
        bound: "every frame, in three orders",
        measured: format!("{} kinds of movies", cases.len()),
    );
}

#[test]
fn frames_are_counted_as_shown_where_times_are_uneven_start_late_or_are_cut() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = |path: &PathBuf| path.to_str().unwrap().to_owned();
    let all: Vec<usize> = (0..60).collect();
    // Every third frame of the first half is left out, and the rest starts late.
    let uneven = "-vf select='gt(n,30)+mod(n,3)',setpts=PTS+5/TB -fps_mode passthrough";
    let kept: Vec<usize> = all.iter().copied().filter(|n| *n > 30 || n % 3 > 0).collect();
    for (name, coding) in [
        ("uneven.mp4", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p"),
        ("uneven.mkv", "-c:v libx264 -bf 2 -g 12 -pix_fmt yuv420p -copyts"),
        ("uneven.mov", "-c:v prores_ks"),
    ] {
        make(&at(name), 60, "25", &format!("{uneven} {coding}"));
        check(&at(name), &kept);
        let movie = Movie::open(&at(name), &tools(folder.path())).unwrap();
        let last = kept.len() as u64 - 1;
        assert!(movie.drift((0, last), 25.0).unwrap() > 5.0, "{name}");
        // Its second half is steady.
        assert!(movie.drift((21, last), 25.0).unwrap() < 0.1, "{name}");
        assert!(movie.drift((21, last), 24.0).unwrap() > 1.0, "{name}");
    }
    make(&at("late.ts"), 60, "25", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p -output_ts_offset 3600");
    check(&at("late.ts"), &all);
    // Cut without re-encoding: the edit list hides the frames before the cut.
    make(&at("whole.mp4"), 60, "25", "-c:v libx264 -bf 3 -g 12 -pix_fmt yuv420p");
    ffmpeg(&["-ss", "0.68", "-i", &text(&at("whole.mp4")), "-c", "copy", &text(&at("cut.mp4"))]);
    let movie = Movie::open(&at("cut.mp4"), &tools(folder.path())).unwrap();
    let first = number(&movie.frame(0).unwrap());
    assert_eq!(first, 17);
    check(&at("cut.mp4"), &(17..17 + movie.count().unwrap() as usize).collect::<Vec<_>>());
    shown!(
        Strangers,
        "A movie with uneven times, times that start late, or an edit list",
        done: "the index lists the frames that are shown, one by one",
    );
}

#[test]
fn colours_come_as_tagged() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (expected, mut worst) = ([0.8, 0.3, 0.1], 0f32);
    for (name, filter, coding) in [
        (
            "709.mov",
            "scale=out_color_matrix=bt709:out_range=tv,setparams=colorspace=bt709:range=tv:color_primaries=bt709:color_trc=bt709",
            "-pix_fmt yuv444p10le -c:v prores_ks -profile:v 4",
        ),
        (
            "601.mkv",
            "scale=out_color_matrix=bt601:out_range=tv,setparams=colorspace=smpte170m:range=tv",
            "-pix_fmt yuv444p -c:v ffv1",
        ),
        (
            "2020.mkv",
            "scale=out_color_matrix=bt2020:out_range=pc,setparams=colorspace=bt2020nc:range=pc",
            "-pix_fmt yuv444p16le -c:v ffv1",
        ),
        ("full.mov", "scale=out_color_matrix=bt601:out_range=pc", "-pix_fmt yuvj444p -c:v mjpeg -q:v 1"),
        ("rgb.mkv", "null", "-pix_fmt gbrp16le -c:v ffv1"),
        (
            "alpha.mov",
            "scale=out_color_matrix=bt709:out_range=tv,setparams=colorspace=bt709:range=tv:color_primaries=bt709:color_trc=bt709,format=yuva444p10le",
            "-c:v prores_ks -profile:v 4444",
        ),
    ] {
        let path = folder.path().join(name);
        let hex = "color=0xCC4D1A:s=64x48:r=24:d=0.2,format=gbrp16le";
        let words = format!("-f lavfi -i {hex} -vf {filter} {coding}");
        let mut words: Vec<&str> = words.split_whitespace().collect();
        words.push(path.to_str().unwrap());
        ffmpeg(&words);
        let movie = Movie::open(&path, &tools(folder.path())).unwrap();
        let read = movie.frame(2).unwrap();
        let pixel = read.encoded().0.at(30, 20);
        let off = (0..3).map(|c| (pixel[c] - expected[c]).abs()).fold(0.0, f32::max);
        worst = worst.max(off);
        assert!(off < 0.012, "{name}: {pixel:?}, {:?}", movie.info());
        let alpha = read.alpha().map(|alpha| alpha.at(5, 5));
        assert_eq!(alpha, (name == "alpha.mov").then_some(1.0));
    }
    let white = folder.path().join("white.mkv");
    ffmpeg(&[
        "-f",
        "lavfi",
        "-i",
        "color=white:s=32x32:d=0.1",
        "-pix_fmt",
        "yuv420p",
        "-c:v",
        "ffv1",
        white.to_str().unwrap(),
    ]);
    let white = Movie::open(&white, &tools(folder.path())).unwrap().frame(0).unwrap();
    assert!(white.codes.iter().all(|&code| code >= 65500), "{}", white.codes[0]);
    shown!(
        Pictures,
        "A movie's codes are of full or limited range, of Rec. 601, 709 or 2020",
        bound: "0.012 of the brightest code",
        measured: format!("{worst:.4}"),
    );
}

#[test]
fn turned_and_stretched_movies_have_the_size_that_players_show() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    make(Path::new(&at("flat.mp4")), 4, "25", "-c:v libx264 -pix_fmt yuv420p");
    ffmpeg(&["-i", &at("flat.mp4"), "-c", "copy", "-metadata:s:v", "rotate=90", &at("turned.mp4")]);
    make(Path::new(&at("wide.mp4")), 4, "25", "-c:v libx264 -pix_fmt yuv420p -vf setsar=4/3");
    make(Path::new(&at("odd.mkv")), 4, "25", "-c:v ffv1 -vf crop=97:31:0:0");
    for (name, size) in [("turned.mp4", (32, 128)), ("wide.mp4", (171, 32)), ("odd.mkv", (97, 31))] {
        let movie = Movie::open(Path::new(&at(name)), &tools(folder.path())).unwrap();
        assert_eq!(movie.info().size, size, "{name}");
        assert_eq!(movie.frame(3).unwrap().size, size, "{name}");
    }
    shown!(
        Pictures,
        "A camera was held upright, or its pixels are not square",
        done: "frames are rotated and widened as tagged in the file, with a sentence",
    );
}

#[test]
fn sequences_are_patterns_folders_or_first_files() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (ending, format) in [("png", "rgb48be"), ("tif", "rgb48le"), ("jpg", "yuvj444p"), ("dpx", "rgb48be")] {
        let shots = folder.path().join(ending);
        std::fs::create_dir(&shots).unwrap();
        make(&shots.join(format!("shot.%04d.{ending}")), 12, "24", &format!("-start_number 98 -pix_fmt {format}"));
        let tools = tools(folder.path());
        let first = shots.join(format!("shot.0098.{ending}"));
        let (pattern, start) = Sequence::pattern_from_first(&first).unwrap();
        assert_eq!((pattern.file_name().unwrap().to_str().unwrap(), start), (&*format!("shot.%04d.{ending}"), 98));
        for name in [format!("shot.%04d.{ending}"), format!("shot.####.{ending}")] {
            let sequence = Sequence::open(&shots.join(name), &tools).unwrap();
            assert_eq!((sequence.first(), sequence.count(), sequence.size()), (Some(98), 12, SIZE));
            assert_eq!(number(&sequence.frame(103).unwrap()), 5, "{ending}");
            let said = sequence.frame(110).unwrap_err().to_string();
            assert!(said.contains("shot.0110"), "{said}");
        }
        let all = Sequence::open(&shots, &tools).unwrap();
        assert_eq!((all.first(), all.count()), (Some(0), 12));
        assert_eq!(number(&all.frame(11).unwrap()), 11);
        std::fs::remove_file(shots.join(format!("shot.0100.{ending}"))).unwrap();
        let holed = Sequence::open(&shots.join(format!("shot.####.{ending}")), &tools).unwrap();
        assert_eq!((holed.gaps(), holed.count()), (vec![100..=100], 12));
    }
}
