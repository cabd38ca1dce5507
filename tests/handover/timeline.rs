use crate::{FOLDER, HARD_NAME, handed_over};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use test_support::{ffmpeg, python, repository};

const LOOK: &str = "--environment nave --frames 1-3 --hand-over otio,edl";

/// A timeline as read by OpenTimelineIO.
fn read(python: &Path, file: &Path, rate: &[&str]) -> Value {
    let output = Command::new(python).arg(repository("tests/peers/timeline.py")).arg(file).args(rate).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", file.display());
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_sequence_is_read_with_its_frames_rate_and_time_code() {
    let Some(python) = python(&["opentimelineio", "otio_cmx3600_adapter"]) else { return };
    let (figures, folder) = handed_over("cut", HARD_NAME, LOOK);
    let file = |ending: &str| folder.join(HARD_NAME.replace(".%04d.exr", ending));
    let timeline = read(&python, &file(".otio"), &[]);
    let clip = &timeline["clips"][0];
    let rate = clip["start"][1].as_f64().unwrap();
    assert_eq!(clip["name"], HARD_NAME.replace(".%04d.exr", ""));
    assert_eq!((&clip["start"][0], &clip["duration"][0]), (&1.0.into(), &3.0.into()));
    assert_eq!(clip["codes"][0], "00:00:00:01");
    assert_eq!(clip["media"]["range"][0], clip["start"]);
    assert_eq!(timeline["start"][0].as_f64().unwrap(), 3600.0 * rate);
    let addresses = clip["media"]["urls"].as_array().unwrap();
    assert_eq!(addresses.len(), 3);
    for (address, frame) in addresses.iter().zip(1..) {
        let path = decoded(address.as_str().unwrap());
        let wanted = folder.join(HARD_NAME.replace("%04d", &format!("{frame:04}")));
        assert_eq!(std::fs::canonicalize(path).unwrap(), std::fs::canonicalize(wanted).unwrap());
    }
    let list = read(&python, &file(".edl"), &[&format!("{rate}/1")]);
    assert_eq!(list["clips"][0]["start"], clip["start"]);
    assert_eq!(list["clips"][0]["duration"], clip["duration"]);
    let said = figures["hand_over"].as_array().unwrap();
    assert!(said.len() == 2 && said.iter().all(|f| FOLDER.path().join(f.as_str().unwrap()).is_file()));
}

#[test]
fn a_movie_is_one_file_with_one_frame_or_many() {
    let Some(python) = python(&["opentimelineio", "otio_cmx3600_adapter"]).filter(|_| ffmpeg()) else { return };
    let premultiplied = LOOK.replace("1-3", "2-2") + " --movie-alpha premultiplied --no-background";
    let (_, folder) = handed_over("movie", "clip 1.mov", &premultiplied);
    let clip = &read(&python, &folder.join("clip 1.otio"), &[])["clips"][0];
    assert_eq!(clip["duration"][0], 1.0);
    assert_eq!(clip["media"]["kind"], "ExternalReference");
    let path = decoded(clip["media"]["urls"][0].as_str().unwrap());
    assert!(Path::new(&path).is_file(), "{path}");
    let list = read(&python, &folder.join("clip 1.edl"), &["24/1"]);
    assert_eq!(list["clips"].as_array().unwrap().len(), 1);
}

/// Path of a file URL.
fn decoded(address: &str) -> String {
    let path = address.strip_prefix("file://").expect("a file URL");
    let mut bytes = Vec::new();
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'%' {
            let digits = [rest.next().unwrap(), rest.next().unwrap()];
            u8::from_str_radix(std::str::from_utf8(&digits).unwrap(), 16).unwrap()
        } else {
            byte
        });
    }
    String::from_utf8(bytes).unwrap()
}
