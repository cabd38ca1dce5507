//! From a camera movie to a relit movie on the command line.

mod program;

use afterlight::imaging::{Mask, file};
use afterlight::movies::{Movie, Tools};
use program::{afterlight, fail, succeed};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use test_support::shown;

/// Columns and rows of the interview.
const PLATE: (usize, usize) = (72, 96);
const FRAMES: usize = 6;
/// Broadcast rate of 29.97 frames a second.
const RATE: &str = "30000/1001";
const FRAME_S: f64 = 1001.0 / 30000.0;
/// Tone in the interview's first half, and in its second.
const TONES_HZ: [f64; 2] = [500.0, 2000.0];

/// Output of a program.
fn output(program: &str, folder: &Path, arguments: &[&str]) -> Vec<u8> {
    let mut command = Command::new(program);
    let output = command.args(["-v", "error"]).args(arguments);
    let output = output.current_dir(folder).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {errors}");
    output.stdout
}

/// Turns the interview into a camera movie: ProRes 422 HQ at 29.97 frames a second with a drop-frame time code, a reel,
/// and sound whose tone changes in the middle.
fn as_a_camera_writes_it(shoot: &Path) {
    let [low, high] = TONES_HZ;
    let (seconds, middle) = (FRAMES as f64 * FRAME_S, FRAMES as f64 / 2.0 * FRAME_S);
    let tone = format!("aevalsrc=sin(2*PI*t*if(lt(t\\,{middle:.6})\\,{low}\\,{high})):s=48000:d={seconds:.6}");
    let words = format!(
        "-r {RATE} -i interview.mov -f lavfi -i {tone} -map 0:v -map 1:a -c:v prores_ks -profile:v 3 -c:a pcm_s24le \
         -timecode 10:20:59;28 -metadata:s:v reel_name=A007 camera.mov"
    );
    output("ffmpeg", shoot, &words.split(' ').collect::<Vec<_>>());
    std::fs::rename(shoot.join("camera.mov"), shoot.join("interview.mov")).unwrap();
}

/// Report of ffprobe on a movie's video and audio.
fn probed(folder: &Path, movie: &str) -> [Value; 2] {
    ["v", "a"].map(|stream| {
        let words = ["-count_frames", "-select_streams", stream, "-show_streams", "-of", "json"];
        let words: Vec<&str> = words.into_iter().chain([movie]).collect();
        let said: Value = serde_json::from_slice(&output("ffprobe", folder, &words)).unwrap();
        assert_eq!(said["streams"].as_array().unwrap().len(), 1, "{movie}");
        said["streams"][0].clone()
    })
}

/// Frequency of a movie's sound between two moments, from its zero crossings.
fn frequency(folder: &Path, movie: &str, from: f64, to: f64) -> f64 {
    let words = ["-i", movie, "-ac", "1", "-ar", "48000", "-f", "s16le", "-"];
    let bytes = output("ffmpeg", folder, &words);
    let samples: Vec<i16> = (bytes.chunks_exact(2)).map(|b| i16::from_le_bytes([b[0], b[1]])).collect();
    let at = |seconds: f64| (seconds * 48000.0).round() as usize;
    let samples = &samples[at(from)..at(to)];
    let zeros = samples.windows(2).filter(|s| (s[0] < 0) != (s[1] < 0));
    zeros.count() as f64 / 2.0 / (to - from)
}

/// Asserts that a movie holds these interview frames: their number, rate, size, sound and time code.
fn has_frames(folder: &Path, movie: &str, first: usize, codec: &str, time_code: Option<&str>) {
    let [video, audio] = probed(folder, movie);
    let count = FRAMES - first;
    assert_eq!(video["nb_read_frames"], count.to_string(), "{movie}");
    assert_eq!(video["codec_name"], codec, "{movie}");
    assert_eq!((&video["r_frame_rate"], &video["avg_frame_rate"]), (&Value::from(RATE), &Value::from(RATE)), "{movie}");
    assert_eq!((&video["width"], &video["height"]), (&Value::from(PLATE.0), &Value::from(PLATE.1)));
    let said = video["tags"]["timecode"].as_str();
    assert_eq!(said, time_code, "{movie}");
    let seconds: f64 = audio["duration"].as_str().unwrap().parse().unwrap();
    assert!((seconds - count as f64 * FRAME_S).abs() < 0.001, "{movie}: {seconds} s of sound");
    // The tone changes at the fourth frame: an offset of half a frame would show.
    let change = (FRAMES as f64 / 2.0 - first as f64) * FRAME_S;
    let (before, after) = (change - 0.5 * FRAME_S, change + 0.5 * FRAME_S);
    for (from, to, tone) in [(before - FRAME_S, before, 0), (after, after + FRAME_S, 1)] {
        if from >= 0.0 {
            let found = frequency(folder, movie, from, to);
            let off = found / TONES_HZ[tone] - 1.0;
            assert!(off.abs() < 0.1, "{movie}: {found} Hz from {from} s to {to} s");
        }
    }
}

fn mean_difference(a: &Mask, b: &Mask) -> f32 {
    assert_eq!(a.size(), b.size());
    let off = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (a - b).abs());
    off.sum::<f32>() / a.pixels.len() as f32
}

#[test]
fn a_cameras_movie_becomes_a_relit_movie_with_its_sound() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = |line: &str| succeed(at, &line.split(' ').collect::<Vec<_>>());
    let (width, height) = PLATE;
    run(&format!("stage shoot --as movies --size 64 --plate {width}x{height} --frames {FRAMES} --lamps 9 --json"));
    let shoot = at.join("shoot");
    as_a_camera_writes_it(&shoot);
    // The stage's own mattes are kept for comparison.
    std::fs::rename(shoot.join("interview_masks"), at.join("true_mattes")).unwrap();
    std::fs::remove_dir_all(shoot.join("exemplar_masks")).unwrap();

    let imported = afterlight(at, &["import", "film", "--shoot", "shoot", "--size", "64"]);
    let said = String::from_utf8_lossy(&imported.stderr);
    assert!(imported.status.success(), "{said}");
    assert!(said.contains("29.97") && said.contains("afterlight matte"), "{said}");
    let refused = fail(at, &["calibrate", "film"]);
    assert!(refused.contains("afterlight matte"), "{refused}");

    let matted = run("matte film --json");
    assert_eq!((&matted["frames"], &matted["poses"]), (&Value::from(6), &Value::from(6)));
    let matte = |frame: usize| {
        let name = format!("frame_{frame:06}.png");
        let made = file::read_mask(&at.join("film/mattes/interview").join(&name)).unwrap();
        (made, file::read_mask(&at.join("true_mattes").join(name)).unwrap())
    };
    let mattes_off = (0..FRAMES).map(|frame| {
        let (made, truth) = matte(frame);
        mean_difference(&made, &truth)
    });
    let mattes_off = mattes_off.fold(0.0, f32::max);
    assert!(mattes_off < 0.02, "{mattes_off}");

    let calibrated = run("calibrate film --json");
    assert_eq!(calibrated["lamps"].as_array().unwrap().len(), 9);
    assert_eq!(run("train film --epochs 1 --device cpu --json")["steps"], 6);

    let relight = |to: &str, options: &str| {
        let line = format!("relight film --environment nave --device cpu --to {to} --json{options}");
        run(&line)["frames"].clone()
    };
    assert_eq!(relight("all.mov", ""), FRAMES);
    has_frames(at, "all.mov", 0, "prores", Some("10:20:59;28"));
    assert_eq!(relight("half.mov", " --frames 3-5 --codec prores-422-hq"), 3);
    // Numbers 00 and 01 of the minute are dropped.
    has_frames(at, "half.mov", 3, "prores", Some("10:21:00;03"));
    assert_eq!(relight("review.mov", " --codec h264"), FRAMES);
    has_frames(at, "review.mov", 0, "h264", Some("10:20:59;28"));

    // The subject is lit and moves; the background is the environment and stands still.
    let tools = Tools { cache: None, ..Tools::default() };
    let movie = Movie::open(&at.join("all.mov"), &tools).unwrap();
    assert_eq!(movie.info().reel.as_deref(), Some("A007"));
    let read = |frame: usize| movie.frame(frame as u64).unwrap().encoded().0;
    let (first, last) = (0, FRAMES - 1);
    let [before, after] = [first, last].map(read);
    let [there, then] = [first, last].map(|frame| matte(frame).0);
    let mean = |keep: &dyn Fn(usize) -> bool, value: &dyn Fn(usize) -> f32| {
        let kept: Vec<f32> = (0..there.pixels.len()).filter(|&i| keep(i)).map(value).collect();
        kept.iter().sum::<f32>() / kept.len() as f32
    };
    let covered = |i: usize| there.pixels[i] > 0.9 && then.pixels[i] > 0.9;
    let open = |i: usize| there.pixels[i] == 0.0 && then.pixels[i] == 0.0;
    let change = |i: usize| (before.pixels[i][1] - after.pixels[i][1]).abs();
    let light = mean(&covered, &|i| before.pixels[i][1]);
    assert!((0.1..0.9).contains(&light), "{light}");
    let (moves, stands) = (mean(&covered, &change), mean(&open, &change));
    assert!(moves > 2.0 * stands && stands < 0.01, "{moves}, {stands}");
    shown!(
        Strangers,
        "An interview is a ProRes movie at 29.97 frames a second with sound and a drop-frame time code, and is relit to a movie",
        bound: "a millisecond of sound, no frame of time code, 0.02 of a matte's mean",
        measured: format!("mattes {mattes_off:.3} off in the mean"),
    );
}
