//! Edit decision list (CMX 3600) with the shot as its only event.

use crate::media::Media;
use crate::otio::record_start;
use crate::shot::Shot;
use base::error::{Error, Result};

/// Longest reel name and longest title of the format.
const REEL: usize = 8;
const TITLE: usize = 70;

/// Refuses rates that the format cannot count: it counts whole frames in two digits.
///
/// # Errors
/// When the rate does not fit; the remedy names an alternative.
pub fn check((frames, seconds): (i32, u32)) -> Result<()> {
    let rate = f64::from(frames) / f64::from(seconds);
    let counts = seconds == 1 || seconds == 1001;
    if counts && (1.0..=100.0).contains(&rate) {
        return Ok(());
    }
    Err(Error::invalid(
        format!("an EDL cannot count {rate:.3} frames per second, only integer and television rates from 1 to 100"),
        ("Hand over by OpenTimelineIO", "--hand-over otio, or leave edl out of it"),
    ))
}

/// Text of the list.
pub fn list(shot: &Shot) -> String {
    let record = record_start(shot.time_code);
    let count = shot.count();
    let times = [shot.time_code, record].map(|start| (start, start.plus(count)));
    let [(source_in, source_out), (record_in, record_out)] = times;
    let mode = if shot.time_code.drop { "DROP FRAME" } else { "NON-DROP FRAME" };
    let tracks = if shot.has_sound { "AA/V" } else { "V" };
    let reel = shot.reel.as_deref().map_or("AX".to_owned(), reel);
    let mut lines = vec![
        format!("TITLE: {}", title(&shot.name)),
        format!("FCM: {mode}"),
        String::new(),
        format!("001  {reel:REEL$} {tracks:5} C        {source_in} {source_out} {record_in} {record_out}"),
        format!("* FROM CLIP NAME: {}", plain(&shot.name)),
        format!("* SOURCE FILE: {}", plain(&files(shot))),
    ];
    if let Some(whole) = shot.reel.as_deref().filter(|whole| *whole != reel) {
        lines.push(format!("* REEL NAME: {}", plain(whole)));
    }
    lines.push(format!("* FRAME RATE: {}", rate(shot)));
    lines.join("\n") + "\n"
}

/// Frames per second, with as many digits as needed.
fn rate(shot: &Shot) -> String {
    match shot.rate {
        (frames, 1) => frames.to_string(),
        _ => format!("{:.3}", shot.frame_rate()),
    }
}

/// File names of a sequence in the editors' notation: `shot.[0010-0014].exr`.
fn files(shot: &Shot) -> String {
    match &shot.media {
        Media::Movie(path) => {
            let name = path.file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        }
        Media::Stills(stills) => match stills.digits {
            None => stills.before.clone(),
            Some(digits) => {
                let (first, last) = shot.frames;
                let (before, after) = (&stills.before, &stills.after);
                format!("{before}[{first:0digits$}-{last:0digits$}]{after}")
            }
        },
    }
}

/// Reel name in the format: at most eight letters and digits.
fn reel(name: &str) -> String {
    let allowed = name.chars().filter(char::is_ascii_alphanumeric);
    let short: String = allowed.take(REEL).collect();
    match short.as_str() {
        "" => "AX".to_owned(),
        _ => short,
    }
}

fn title(name: &str) -> String {
    let letters = name.chars().map(|c| if (' '..='~').contains(&c) { c } else { '_' });
    letters.take(TITLE).collect()
}

/// Text of a comment, on one line.
fn plain(text: &str) -> String {
    text.replace(char::is_control, "_")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shot::tests::shot;
    use export::TimeCode;
    use serde_json::Value;
    use std::path::Path;
    use std::process::Command;

    #[test]
    fn an_event_has_reel_range_and_files() {
        let text = list(&shot("a/shot 1.%04d.exr"));
        assert_eq!(
            text,
            "TITLE: shot 1\nFCM: NON-DROP FRAME\n\n\
             001  A001C002 V     C        10:00:00:10 10:00:00:15 01:00:00:00 01:00:00:05\n\
             * FROM CLIP NAME: shot 1\n* SOURCE FILE: shot 1.[0010-0014].exr\n\
             * REEL NAME: A001_C002_1024XY\n* FRAME RATE: 24\n"
        );
        let mut bare = shot("a/é\u{7}.mov");
        bare.reel = None;
        bare.has_sound = true;
        let text = list(&bare);
        assert!(text.contains("TITLE: __\n") && text.contains("001  AX       AA/V  C"), "{text}");
        assert!(text.contains("* SOURCE FILE: é_.mov\n") && !text.contains("REEL"), "{text}");
    }

    #[test]
    fn drop_frame_counts_on_both_sides() {
        let rate = 30000.0 / 1001.0;
        let mut drop = shot("shot.mov");
        drop.rate = (30000, 1001);
        drop.time_code = TimeCode::parse("00:00:59;28", rate).unwrap();
        drop.frames = (0, 3);
        let text = list(&drop);
        assert!(text.contains("FCM: DROP FRAME\n"), "{text}");
        // Numbers 00 and 01 of the minute are dropped.
        assert!(text.contains("00:00:59;28 00:01:00;04 01:00:00;00 01:00:00;04"), "{text}");
        assert!(text.contains("* FRAME RATE: 29.970\n"), "{text}");
    }

    /// Timeline that OpenTimelineIO reads from a file with this extension.
    fn read(python: &Path, shot: &Shot, ending: &str, text: &str) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(format!("shot{ending}"));
        std::fs::write(&file, text).unwrap();
        let (frames, seconds) = shot.rate;
        let output = Command::new(python)
            .arg(test_support::repository("tests/peers/timeline.py"))
            .arg(&file)
            .arg(format!("{frames}/{seconds}"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}\n{text}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    #[test]
    fn opentimelineio_reads_the_same_range_from_list_and_timeline_at_every_rate() {
        let modules = ["opentimelineio", "otio_cmx3600_adapter"];
        let Some(python) = test_support::python(&modules) else { return };
        for (rate, start, count) in [
            ((24, 1), "10:00:00:10", 5),
            ((24000, 1001), "23:59:59:00", 1),
            ((25, 1), "00:00:00:00", 90_000),
            ((30000, 1001), "00:59:59;28", 4),
            ((30000, 1001), "00:59:59:28", 4),
            ((30, 1), "01:02:03:04", 2),
            ((60000, 1001), "00:08:59;58", 200),
            ((60, 1), "19:59:59:59", 4_000),
        ] {
            let mut shot = shot("a/it's \"é\".%04d.exr");
            shot.rate = rate;
            shot.time_code = TimeCode::parse(start, shot.frame_rate()).unwrap();
            // Twenty hours at 60 frames a second precede it.
            shot.frames = (4_320_000, 4_320_000 + count as i64 - 1);
            let timeline = read(&python, &shot, ".otio", &crate::otio::timeline(&shot));
            let list = read(&python, &shot, ".edl", &list(&shot));
            for read in [&timeline, &list] {
                let clip = &read["clips"][0];
                let codes = clip["codes"].as_array().unwrap();
                assert!(codes.contains(&start.into()), "{rate:?}: {codes:?}");
                assert_eq!(clip["duration"][0], count as f64, "{rate:?}");
                assert_eq!(clip["start"][0], shot.time_code.count() as f64, "{rate:?}");
                let apart = clip["start"][1].as_f64().unwrap() - shot.frame_rate();
                assert!(apart.abs() < 1e-9, "{rate:?}");
            }
            assert_eq!(list["clips"][0]["reel"], "A001C002");
            assert_eq!(timeline["clips"][0]["reel"], "A001_C002_1024XY");
            let urls = timeline["clips"][0]["media"]["urls"].as_array().unwrap();
            assert_eq!(urls.len(), count);
            let first = urls[0].as_str().unwrap();
            assert!(first.ends_with("/a/it%27s%20%22%C3%A9%22.4320000.exr"), "{first}");
        }
    }

    #[test]
    fn rates_that_have_no_two_digits_are_refused() {
        for rate in [(24, 1), (24000, 1001), (60000, 1001), (100, 1), (1, 1)] {
            assert!(check(rate).is_ok(), "{rate:?}");
        }
        for rate in [(120, 1), (12500, 1000), (1, 2)] {
            let error = check(rate).unwrap_err().for_terminal();
            assert!(error.contains("otio"), "{error}");
        }
    }
}
