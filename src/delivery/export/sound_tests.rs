use super::super::clip::{ClipWriter, Movie};
use super::super::codec::Codec;
use super::super::colors::Encoding;
use super::super::format::MovieAlpha;
use super::super::still::tests::picture;
use super::*;
use std::path::PathBuf;
use test_support::ffmpeg;

const RATE: f64 = 30000.0 / 1001.0;

/// A movie of 60 frames. Its sound is silent up to frame 20, then loud, and ends `sound_s` seconds after the start.
fn interview(folder: &Path, sound_s: f64) -> Interview {
    let file = folder.join("-take 1'.mov");
    let volume =
        format!("aevalsrc=if(gte(t\\,{0})\\,0.5*sin(2*PI*1000*t)\\,0):s=48000:d={sound_s},asplit[a][b]", 20.0 / RATE);
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-y", "-f", "lavfi", "-i"])
        .arg("testsrc2=s=64x48:r=30000/1001:d=2.002")
        .args(["-filter_complex", &volume, "-map", "0:v", "-map", "[a]", "-map", "[b]"])
        .args(["-c:v", "prores_ks", "-c:a", "pcm_s16le", "-timecode", "01:00:59;20"])
        .arg(file_url(&file))
        .status();
    assert!(made.unwrap().success());
    Interview {
        source: Some(Source {
            file,
            first_frame: 0,
            time_code: crate::TimeCode::parse("01:00:59;20", RATE),
            reel: Some("A007".to_owned()),
        }),
        ..Interview::stills(RATE)
    }
}

/// Samples of the first channel of a file's sound stream `stream`.
fn samples(path: &Path, stream: usize) -> Vec<f32> {
    let output = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(file_url(path))
        .args(["-map", &format!("0:a:{stream}"), "-ac", "1", "-f", "f32le", "-"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    output.stdout.chunks_exact(4).map(value).collect()
}

/// Sound of frames for the movie `beside`, and the messages about it.
fn heard(interview: &Interview, frames: (usize, usize), beside: &Path) -> (Result<Option<Sound>>, String) {
    Progress::heard(|progress| Sound::extract(interview, frames, beside, progress))
}

#[test]
fn sound_is_cut_to_the_exported_frames() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let interview = interview(folder.path(), 2.002);
    let beside = folder.path().join("clip.mov");
    for (first, last) in [(0, 59), (12, 41), (19, 20), (20, 59)] {
        let (sound, said) = heard(&interview, (first, last), &beside);
        let sound = sound.unwrap().unwrap();
        assert_eq!(said, "");
        for stream in [0, 1] {
            let samples = samples(sound.path(), stream);
            let wanted = (last - first + 1) as f64 / RATE * 48000.0;
            assert!((samples.len() as f64 - wanted).abs() <= 1.0, "{} is not {wanted}", samples.len());
            let loud = samples.iter().position(|v| v.abs() > 0.01).unwrap() as f64;
            let begins = (20.0 - first as f64) / RATE * 48000.0;
            // The tone needs a sample to be heard.
            assert!((loud - begins).abs() <= 3.0, "{first}: {loud} is not {begins}");
        }
    }
    test_support::shown!(Strangers, "A part of an interview with sound is exported", bound: "3 samples of 48 kHz", measured: "3 samples or less");
}

#[test]
fn sound_under_uneven_frame_times_starts_at_the_first_frames_own_time() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // Two frames of three are left out in the first second: frames 0 to 9 are 0.1 s apart, later ones 1/30 s.
    for (name, coding) in [("uneven.mov", "-c:v prores_ks"), ("uneven.mkv", "-c:v ffv1")] {
        let file = folder.path().join(name);
        let made = Command::new("ffmpeg")
            .args(["-v", "error", "-y", "-f", "lavfi", "-i", "testsrc2=s=64x48:r=30:d=3"])
            .args(["-f", "lavfi", "-i", "aevalsrc=if(gte(t\\,0.7)\\,0.5*sin(2*PI*1000*t)\\,0):s=48000:d=3"])
            .args(["-vf", "select='gte(n,30)+not(mod(n,3))'", "-fps_mode", "passthrough"])
            .args(coding.split_whitespace())
            .args(["-c:a", "pcm_s16le"])
            .arg(file_url(&file))
            .status();
        assert!(made.unwrap().success());
        let source = Source { file, first_frame: 0, time_code: None, reel: None };
        let interview = Interview { source: Some(source), ..Interview::stills(30.0) };
        let beside = folder.path().join("clip.mov");
        // The tone begins at frame 7, 0.7 s after the first.
        for (first, last, begins, is_uneven) in
            [(0, 69, 0.7, true), (4, 69, 0.3, true), (7, 9, 0.0, true), (30, 69, 0.0, false)]
        {
            let (sound, said) = heard(&interview, (first, last), &beside);
            let samples = samples(sound.unwrap().unwrap().path(), 0);
            let loud = samples.iter().position(|v| v.abs() > 0.01).unwrap() as f64 / 48000.0;
            assert!((loud - begins).abs() < 1e-3, "{name}, frame {first}: {loud}, not {begins}");
            let length = (last - first + 1) as f64 / 30.0;
            assert!((samples.len() as f64 / 48000.0 - length).abs() < 1e-3, "{}", samples.len());
            assert_eq!(said.contains("variable frame rate"), is_uneven, "{name}, {first}: {said}");
        }
    }
    test_support::shown!(Strangers, "A part of an interview with uneven frame times is exported with sound", bound: "1 ms",
        measured: "1 ms or less");
}

#[test]
fn sound_that_is_shorter_or_longer_than_the_pictures_fits_them_and_that_is_said() {
    if !ffmpeg() {
        return;
    }
    for (sound_s, complains) in [(1.0, true), (9.0, false)] {
        let folder = tempfile::tempdir().unwrap();
        let interview = interview(folder.path(), sound_s);
        let beside = folder.path().join("clip.mov");
        let (sound, said) = heard(&interview, (0, 59), &beside);
        let samples = samples(sound.unwrap().unwrap().path(), 0);
        assert!((samples.len() as f64 - 60.0 / RATE * 48000.0).abs() <= 1.0, "{}", samples.len());
        assert_eq!(said.contains("silence"), complains, "{said}");
        let last = samples.iter().rposition(|v| v.abs() > 0.01).unwrap() as f64 / 48000.0;
        assert!((last - sound_s.min(2.0)).abs() < 0.01, "{last}");
    }
    test_support::shown!(Strangers, "Sound that is longer or shorter than the interview's pictures", bound: "the pictures' length",
        measured: "1 sample or less");
}

#[test]
fn a_movie_has_the_interviews_sound_time_code_and_reel() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let interview = interview(folder.path(), 2.002);
    let shown = picture(256, 120, [0.5; 3], true);
    for (name, codec) in
        [("a.mov", Codec::ProRes4444), ("a.mp4", Codec::H264), ("a.mxf", Codec::DnxhrHqx), ("a.mkv", Codec::Ffv1)]
    {
        let path = folder.path().join(name);
        let sound = Sound::extract(&interview, (12, 23), &path, &Progress::silent()).unwrap().unwrap();
        let movie = Movie {
            codec,
            frame_rate: interview.frame_rate,
            time_code: interview.filmed_time_code(12),
            reel: interview.reel().map(str::to_owned),
            encoding: Encoding::default(),
            alpha: MovieAlpha::default(),
            sound: Some(PathBuf::from(sound.path())),
        };
        let mut writer = ClipWriter::create(&path, (256, 120), &movie).unwrap();
        (12..24).for_each(|_| writer.push(&shown, &Progress::silent()).unwrap());
        writer.finish(&Progress::silent()).unwrap();
        let output = Command::new("ffprobe")
            .args(["-v", "error", "-count_frames", "-show_streams", "-show_format", "-of", "json"])
            .arg(&path)
            .output()
            .unwrap();
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let streams = found["streams"].as_array().unwrap();
        let video = streams.iter().find(|s| s["codec_type"] == "video").unwrap();
        assert_eq!(video["nb_read_frames"], "12", "{name}");
        assert_eq!(video["r_frame_rate"], "30000/1001", "{name}");
        let sounds = streams.iter().filter(|s| s["codec_type"] == "audio").count();
        assert_eq!(sounds, 2, "{name}: both tracks");
        let all = found.to_string();
        // 01:00:59;20 and 12 frames: 00 and 01 are dropped.
        assert!(all.contains("01:01:00;04") || all.contains("01:01:00:04"), "{name}: {all}");
        let samples = samples(&path, 0);
        let wanted = 12.0 / RATE * 48000.0;
        // AAC comes in blocks of 1024 samples.
        let within = if codec == Codec::H264 { 1100.0 } else { 2.0 };
        assert!((samples.len() as f64 - wanted).abs() <= within, "{name}: {}", samples.len());
        let loud = samples.iter().position(|v| v.abs() > 0.05).unwrap() as f64;
        assert!((loud - 8.0 / RATE * 48000.0).abs() < 300.0, "{name}: {loud}");
    }
}

#[test]
fn a_movie_without_sound_or_that_is_cut_off_is_said() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let interview = interview(folder.path(), 2.0);
    let file = interview.source.as_ref().unwrap().file.clone();
    let extract = || heard(&interview, (0, 9), &folder.path().join("clip.mov"));
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let said = extract().0.unwrap_err().for_terminal();
    assert!(said.contains("take 1") && said.contains("--no-sound"), "{said}");
    let silent = Command::new("ffmpeg")
        .args(["-v", "error", "-y", "-f", "lavfi", "-i", "testsrc2=s=64x48:d=1", "-c:v", "prores_ks"])
        .arg(file_url(&file))
        .status();
    assert!(silent.unwrap().success());
    let (sound, said) = extract();
    assert!(sound.unwrap().is_none() && said.contains("has no sound"), "{said}");
    std::fs::write(&file, "#EXTM3U\nhttp://localhost/a.ts\n").unwrap();
    let said = extract().0.unwrap_err().to_string();
    assert!(said.contains("take 1"), "{said}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    test_support::shown!(Strangers, "The interview's movie is truncated, or is a playlist with a network address",
        bound: "before the first picture", measured: "refused");
}
