use super::super::encoder::{TAIL, tail};
use super::super::still::tests::picture;
use super::*;
use base::progress::Control;
use std::process::Command;
use test_support::small_disk::names;
use test_support::{ffmpeg, wait_for};

/// Long enough for a test that waits for something else.
const LONG: Duration = Duration::from_secs(3600);

/// Movie in its container's default codec, starting at this frame.
fn movie(path: &Path, frame_rate: f64, first: usize) -> Movie {
    let codec = Codec::for_path(None, path).unwrap();
    Movie {
        codec,
        frame_rate,
        time_code: (codec != Codec::H264).then(|| TimeCode::new(first, frame_rate)),
        reel: None,
        encoding: Encoding::default(),
        alpha: MovieAlpha::default(),
        sound: None,
    }
}

fn silent() -> Progress<'static> {
    Progress::silent()
}

/// Decoded frames as RGBA bytes.
fn decoded(path: &Path) -> Vec<u8> {
    let output = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(path)
        .args(["-f", "rawvideo", "-pix_fmt", "rgba", "-vf", "scale=in_color_matrix=bt709", "-"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

#[test]
fn a_movie_has_the_frames_and_colours_that_were_pushed() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(33, 17, [0.6, 0.2, 0.05], true);
    let code = shown.display.as_ref().unwrap().0.pixels[0].map(byte_from_unit);
    for name in ["new/clip.mp4", "a:b %d.mov"] {
        let path = folder.path().join(name);
        let mut writer = ClipWriter::create(&path, (33, 17), &movie(&path, 29.97, 0)).unwrap();
        (0..3).for_each(|_| writer.push(&shown, &silent()).unwrap());
        writer.finish(&silent()).unwrap();
        let bytes = decoded(&path);
        assert_eq!(bytes.len(), 3 * 34 * 18 * 4);
        // Limited range and halved chroma cost a few codes; a wrong matrix costs twenty.
        for pixel in bytes.chunks(4) {
            assert!((0..3).all(|c| pixel[c].abs_diff(code[c]) <= 4), "{pixel:?} is not {code:?}");
        }
        assert_eq!(
            std::fs::read_dir(path.parent().unwrap()).unwrap().filter(|e| e.as_ref().unwrap().path().is_file()).count(),
            1
        );
    }
}

#[test]
fn a_mov_keeps_straight_alpha() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mov");
    let shown = picture(64, 16, [0.5; 3], false);
    let mut writer = ClipWriter::create(&path, (64, 16), &movie(&path, 24.0, 24 * 61 + 5)).unwrap();
    writer.push(&shown, &silent()).unwrap();
    writer.finish(&silent()).unwrap();
    let bytes = decoded(&path);
    for (x, pixel) in bytes.chunks(4).take(48).enumerate() {
        let alpha = byte_from_unit(shown.alpha.pixels[x]);
        assert!(pixel[3].abs_diff(alpha) <= 2 && pixel[0].abs_diff(188) <= 3, "{x}: {pixel:?}, {alpha}");
    }
}

#[test]
fn alpha_is_straight_or_premultiplied_as_asked_and_the_movie_says_which() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(64, 16, [0.5; 3], false);
    for (alpha, word) in [(MovieAlpha::Straight, "straight alpha"), (MovieAlpha::Premultiplied, "premultiplied alpha")]
    {
        for name in ["cut.mov", "cut.mkv"] {
            let path = folder.path().join(name);
            let movie = Movie { alpha, ..movie(&path, 24.0, 0) };
            let mut writer = ClipWriter::create(&path, (64, 16), &movie).unwrap();
            writer.push(&shown, &silent()).unwrap();
            writer.finish(&silent()).unwrap();
            let bytes = decoded(&path);
            for (x, pixel) in bytes.chunks(4).take(48).enumerate() {
                let cover = shown.alpha.pixels[x];
                let wanted = match alpha {
                    MovieAlpha::Straight => 188.0,
                    MovieAlpha::Premultiplied => 188.0 * cover,
                };
                assert!(
                    pixel[3].abs_diff(byte_from_unit(cover)) <= 2 && (f32::from(pixel[0]) - wanted).abs() <= 3.0,
                    "{name} {alpha:?} {x}: {pixel:?}, {cover}"
                );
            }
            let probe = Command::new("ffprobe")
                .args(["-v", "error", "-show_entries", "format_tags", "-of", "json"])
                .arg(&path)
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&probe.stdout);
            assert!(said.contains(word), "{name}: {said}");
        }
    }
}

#[test]
fn a_movie_says_its_colours_its_rate_and_its_time() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shown = picture(32, 16, [0.5; 3], false);
    for (name, codec, format) in [("a.mp4", "h264", "yuv420p"), ("a.mov", "prores", "yuva444p12le")] {
        let path = folder.path().join(name);
        let mut writer = ClipWriter::create(&path, (32, 16), &movie(&path, 23.976, 24 * 61 + 5)).unwrap();
        (0..2).for_each(|_| writer.push(&shown, &silent()).unwrap());
        writer.finish(&silent()).unwrap();
        let probed =
            Command::new("ffprobe").args(["-v", "error", "-show_streams", "-of", "json"]).arg(&path).output().unwrap();
        let probed: serde_json::Value = serde_json::from_slice(&probed.stdout).unwrap();
        let stream = &probed["streams"][0];
        for (key, wanted) in [
            ("codec_name", codec),
            ("pix_fmt", format),
            ("color_primaries", "bt709"),
            ("color_transfer", "bt709"),
            ("color_space", "bt709"),
            ("color_range", "tv"),
            ("r_frame_rate", "24000/1001"),
        ] {
            // ffprobe 6 reports the ten bits that were written, ffprobe 5 the twelve that ProRes allows.
            let found = stream[key].as_str().unwrap_or("none");
            let same = found == wanted || (wanted == "yuva444p12le" && found == "yuva444p10le");
            assert!(same, "{name}: {key} is {found}, not {wanted}");
        }
        let time = &stream["tags"]["timecode"];
        match codec {
            "prores" => assert!(time.as_str().unwrap().starts_with("00:01:01:"), "{time}"),
            _ => assert!(time.is_null()),
        }
    }
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    let mut writer = ClipWriter::create(&path, (16, 16), &movie(&path, 24.0, 0)).unwrap();
    writer.push(&picture(16, 16, [0.5; 3], true), &silent()).unwrap();
    assert!(writer.push(&picture(8, 16, [0.5; 3], true), &silent()).unwrap_err().to_string().contains("8 × 16"));
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_missing_ffmpeg_is_a_sentence_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    let error = ClipWriter::create_with(("no-such-ffmpeg", PATIENCE), &path, (16, 16), &movie(&path, 24.0, 0))
        .unwrap_err()
        .to_string();
    assert!(error.contains("clip.mp4") && error.contains("install"), "{error}");
}

#[test]
fn what_ffmpeg_says_reaches_the_person() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    // A program without ffmpeg's options prints a message and fails.
    let begun = || ClipWriter::create_with(("ls", PATIENCE), &path, (16, 16), &movie(&path, 24.0, 0)).unwrap();
    let at_the_end = begun().finish(&silent()).unwrap_err();
    let (mut writer, shown) = (begun(), picture(16, 16, [0.5; 3], true));
    // More than fits into a pipe without a reader.
    let in_the_middle = (0..1000).find_map(|_| writer.push(&shown, &silent()).err()).unwrap();
    drop(writer);
    for error in [at_the_end, in_the_middle] {
        let said = error.to_string();
        assert!(said.contains("clip.mp4") && said.contains("ffmpeg says: ls: "), "{said}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    assert_eq!(tail(&[b'x'; 10_000][..]).len(), TAIL);
}

/// Shell script that replaces ffmpeg.
#[cfg(unix)]
fn script(folder: &Path, text: &str) -> String {
    let (source, program) = (folder.join("source"), folder.join("ffmpeg"));
    std::fs::write(&source, format!("#!/bin/sh\n{text}\n")).unwrap();
    // A file that this process wrote may still be open in a child of another test, and cannot be started then.
    let installed = Command::new("install").args([&source, &program]).status();
    assert!(installed.unwrap().success());
    program.display().to_string()
}

/// Writes a movie with `program` until an error.
#[cfg(unix)]
fn fail(program: &str, patience: Duration, path: &Path, progress: &Progress) -> Error {
    let mut writer = ClipWriter::create_with((program, patience), path, (64, 64), &movie(path, 24.0, 0)).unwrap();
    let shown = picture(64, 64, [0.5; 3], true);
    let failed = (0..100).find_map(|_| writer.push(&shown, progress).err());
    failed.unwrap_or_else(|| writer.finish(progress).unwrap_err())
}

#[cfg(target_os = "linux")]
#[test]
fn an_ffmpeg_that_hangs_is_ended_with_all_that_it_started() {
    // Each way to hang: it never reads, stops reading, closes its input, or does not end.
    let hangs = ["", "head -c 70000 >/dev/null", "exec <&-", "cat >/dev/null"];
    for before in hangs {
        for stop in [false, true] {
            let tools = tempfile::tempdir().unwrap();
            let folder = tempfile::tempdir().unwrap();
            let pids = tools.path().join("pids");
            let program = script(
                tools.path(),
                &format!("{before}\nsleep 100000 &\necho $$ $! >{0}.new; mv {0}.new {0}\nwait", pids.display()),
            );
            let path = folder.path().join("clip.mp4");
            let control = Control::default();
            let progress = Progress::new(&|_| {}, control.clone());
            let patience = if stop { LONG } else { Duration::from_millis(600) };
            let failed = std::thread::scope(|threads| {
                let failing = threads.spawn(|| fail(&program, patience, &path, &progress));
                if stop {
                    wait_for(|| pids.exists().then_some(()));
                    control.stop();
                }
                failing.join().unwrap()
            });
            match failed {
                Error::Cancelled { kept } => assert!(stop && kept == "no movie was written"),
                failed => {
                    let said = failed.to_string();
                    let words = ["clip.mp4", "neither took a frame", "ffmpeg -version"];
                    assert!(!stop && words.iter().all(|word| said.contains(word)), "{said}");
                }
            }
            assert!(names(folder.path()).is_empty());
            let started = std::fs::read_to_string(&pids).unwrap_or_default();
            for process in started.split_whitespace() {
                let stat = format!("/proc/{process}/stat");
                // A zombie waits for its new parent, and does nothing.
                wait_for(|| {
                    let state = std::fs::read_to_string(&stat).unwrap_or_default();
                    (state.is_empty() || state.contains(") Z ")).then_some(())
                });
            }
        }
    }
    test_support::shown!(
        Surroundings,
        "ffmpeg that hangs: it never reads, stops reading, closes its input, or does not end",
        bound: "no file and no process remain",
        measured: "none"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_written_is_not_blamed_on_the_encoder() {
    let folder = tempfile::tempdir().unwrap();
    let unwritable = Path::new("/proc/clip.mp4");
    let refused = ClipWriter::create(unwritable, (16, 16), &movie(unwritable, 24.0, 0)).unwrap_err();
    let program = script(folder.path(), "echo clip.mp4: Permission denied >&2; exit 1");
    let denied = fail(&program, LONG, &folder.path().join("clip.mp4"), &silent());
    for said in [refused.to_string(), denied.to_string()] {
        assert!(
            said.contains("clip.mp4") && said.contains("folder can be written") && !said.contains("H.264"),
            "{said}"
        );
    }
    let program = script(folder.path(), "echo Unknown encoder libx264 >&2; exit 1");
    let said = fail(&program, LONG, &folder.path().join("clip.mp4"), &silent()).to_string();
    assert!(said.contains("can encode H.264"), "{said}");
    test_support::shown!(
        Surroundings,
        "A movie in a folder that cannot be written",
        done: "the message names the folder; it names encoders only if ffmpeg does"
    );
}
