//! OpenTimelineIO timeline with the shot as its only clip.

use crate::media::{Media, Stills};
use crate::shot::Shot;
use base::error::{Error, Result};
use export::TimeCode;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Refuses numbers that OpenTimelineIO writes otherwise: it pads -5 with four digits to -0005, `%04d` to -005.
///
/// # Errors
/// When the first of several padded numbers is below 0.
pub fn check(media: &Media, (first, _): (i64, i64)) -> Result<()> {
    match media {
        Media::Stills(stills) if first < 0 && stills.digits.is_some_and(|digits| digits > 1) => Err(Error::invalid(
            format!("OpenTimelineIO does not find files with a padded number below 0, such as {}", stills.name(first)),
            (
                "Number the files from 0 or above, or do not hand over to OTIO",
                "--first-number 0, or leave otio out of --hand-over",
            ),
        )),
        _ => Ok(()),
    }
}

/// Usual start of a timeline: 01:00:00:00.
pub fn record_start(time_code: TimeCode) -> TimeCode {
    TimeCode { hours: 1, minutes: 0, seconds: 0, frame: 0, ..time_code }
}

/// JSON of the timeline.
pub fn timeline(shot: &Shot) -> String {
    let rate = shot.frame_rate();
    let time = |frames: u64| json!({ "OTIO_SCHEMA": "RationalTime.1", "rate": rate, "value": frames as f64 });
    let range = json!({
        "OTIO_SCHEMA": "TimeRange.1",
        "start_time": time(shot.time_code.count()),
        "duration": time(shot.count() as u64),
    });
    let media = media(shot, &range);
    let clip = json!({
        "OTIO_SCHEMA": "Clip.1",
        "name": shot.name,
        "metadata": metadata(shot),
        "source_range": range,
        "effects": [],
        "markers": [],
        "media_reference": media,
    });
    let track = |kind: &str, name: &str| {
        json!({
            "OTIO_SCHEMA": "Track.1",
            "name": name,
            "kind": kind,
            "metadata": {},
            "source_range": null,
            "effects": [],
            "markers": [],
            "children": [clip],
        })
    };
    let mut tracks = vec![track("Video", "V1")];
    if shot.has_sound {
        tracks.push(track("Audio", "A1"));
    }
    let timeline = json!({
        "OTIO_SCHEMA": "Timeline.1",
        "name": shot.name,
        "metadata": {},
        "global_start_time": time(record_start(shot.time_code).count()),
        "tracks": {
            "OTIO_SCHEMA": "Stack.1",
            "name": "tracks",
            "metadata": {},
            "source_range": null,
            "effects": [],
            "markers": [],
            "children": tracks,
        },
    });
    format!("{timeline:#}\n")
}

fn metadata(shot: &Shot) -> Value {
    let (first, last) = shot.frames;
    let mut metadata = json!({
        "afterlight": {
            "version": env!("CARGO_PKG_VERSION"),
            "frames": [first, last],
            "time_code": shot.time_code.to_string(),
            "environment": shot.environment,
        },
    });
    if let Some(reel) = &shot.reel {
        metadata["afterlight"]["reel"] = json!(reel);
        // Converters look for it here.
        metadata["cmx_3600"] = json!({ "reel": reel });
    }
    metadata
}

fn media(shot: &Shot, range: &Value) -> Value {
    let mut media = json!({
        "name": shot.name,
        "metadata": metadata(shot),
        "available_range": range,
    });
    match &shot.media {
        Media::Stills(Stills { folder, before, digits: Some(digits), after }) => {
            media["OTIO_SCHEMA"] = json!("ImageSequenceReference.1");
            media["target_url_base"] = json!(format!("{}/", url(folder).trim_end_matches('/')));
            media["name_prefix"] = json!(encoded(before.as_bytes()));
            media["name_suffix"] = json!(encoded(after.as_bytes()));
            media["start_frame"] = json!(shot.frames.0);
            media["frame_step"] = json!(1);
            media["rate"] = json!(shot.frame_rate());
            media["frame_zero_padding"] = json!(digits);
            media["missing_frame_policy"] = json!("error");
        }
        Media::Stills(stills) => {
            media["OTIO_SCHEMA"] = json!("ExternalReference.1");
            media["target_url"] = json!(url(&stills.folder.join(&stills.before)));
        }
        Media::Movie(path) => {
            media["OTIO_SCHEMA"] = json!("ExternalReference.1");
            media["target_url"] = json!(url(path));
        }
    }
    media
}

/// File URL (RFC 8089).
fn url(path: &Path) -> String {
    let path = path.to_string_lossy().replace('\\', "/");
    let slash = if path.starts_with('/') { "" } else { "/" };
    format!("file://{slash}{}", encoded(path.as_bytes()))
}

/// Percent-encoded bytes (RFC 3986).
fn encoded(bytes: &[u8]) -> String {
    let mut text = String::new();
    for &byte in bytes {
        if byte.is_ascii_alphanumeric() || b"/-._~:".contains(&byte) {
            text.push(char::from(byte));
        } else {
            // Writing into a string does not fail.
            let _ = write!(text, "%{byte:02X}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::media::tests::media;
    use crate::shot::tests::shot;

    fn clip(to: &str) -> Value {
        let timeline: Value = serde_json::from_str(&timeline(&shot(to))).unwrap();
        timeline["tracks"]["children"][0]["children"][0].clone()
    }

    #[test]
    fn a_sequence_has_its_range_in_time_code() {
        let clip = clip("/films/a b/é.%04d.exr");
        let range = &clip["source_range"];
        assert_eq!(range["start_time"]["value"], 10.0 * 3600.0 * 24.0 + 10.0);
        assert_eq!(range["duration"], json!({ "OTIO_SCHEMA": "RationalTime.1", "rate": 24.0, "value": 5.0 }));
        let media = &clip["media_reference"];
        assert_eq!(media["target_url_base"], "file:///films/a%20b/");
        assert_eq!(media["name_prefix"], "%C3%A9.");
        assert_eq!((&media["start_frame"], &media["frame_zero_padding"]), (&json!(10), &json!(4)));
        assert_eq!(clip["metadata"]["cmx_3600"]["reel"], "A001_C002_1024XY");
    }

    #[test]
    fn a_movie_and_a_single_still_are_files() {
        for (to, url) in [
            ("/films/100% \"x\".mov", "file:///films/100%25%20%22x%22.mov"),
            ("/films/one.exr", "file:///films/one.exr"),
        ] {
            let media = &clip(to)["media_reference"];
            assert_eq!(media["OTIO_SCHEMA"], "ExternalReference.1");
            assert_eq!(media["target_url"], url);
        }
    }

    #[test]
    fn numbers_that_opentimelineio_pads_otherwise_are_refused_with_the_file() {
        for (to, first, refused) in [
            ("shot.%04d.exr", -5, Some("shot.-005.exr")),
            ("shot.%04d.exr", 0, None),
            ("shot.%d.exr", -5, None),
            ("shot.mov", -5, None),
        ] {
            let checked = check(&media(to), (first, 9));
            match (checked, refused) {
                (Ok(()), None) => (),
                (Err(e), Some(file)) => assert!(e.to_string().contains(file), "{e}"),
                (checked, _) => panic!("{to} from {first}: {checked:?}"),
            }
        }
    }
}
