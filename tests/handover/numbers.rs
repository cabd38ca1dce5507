//! Exports of numbered plates: pictures, scripts, timelines and hash lists have the plates' numbers.

use crate::program::{fail, succeed};
use serde_json::Value;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;
use test_support::python;

/// Folder with the project `film` of the plates 1001 to 1004; 1003 is missing.
static PLATES: LazyLock<TempDir> = LazyLock::new(|| project(&["1001", "1002", "", "1004"]));

/// Folder with a calibrated project, `film`, of plates with these numbers; "" for none.
fn project(numbers: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let frames = numbers.len().to_string();
    let stage = ["stage", "shoot", "--size", "32", "--lamps", "6", "--frames", &frames, "--json"];
    succeed(at, &stage);
    for (frame, number) in numbers.iter().enumerate() {
        for inside in ["interview", "interview_masks"] {
            let made = at.join(format!("shoot/{inside}/frame_{frame:03}.png"));
            if number.is_empty() {
                std::fs::remove_file(made).unwrap()
            } else {
                let named = format!("shoot/{inside}/s2_plate.{number}.png");
                std::fs::rename(made, at.join(named)).unwrap();
            }
        }
    }
    let manifest = at.join("shoot/manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    let text = text.replacen('{', "{\"damaged_frames\": \"hold\",", 1);
    std::fs::write(&manifest, text).unwrap();
    succeed(at, &["import", "film", "--shoot", "shoot", "--size", "32", "--json"]);
    succeed(at, &["calibrate", "film", "--json"]);
    folder
}

fn export(at: &Path, command: &str, more: &str) -> Value {
    let line = format!("{command} --environment nave --device cpu --json {more}");
    succeed(at, &line.split_whitespace().collect::<Vec<_>>())
}

/// Names of the files in a folder with this ending, in order.
fn names(folder: &Path, ending: &str) -> Vec<String> {
    let files = std::fs::read_dir(folder).unwrap().flatten();
    let names = files.filter_map(|file| file.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(ending)).collect();
    names.sort();
    names
}

fn read(file: &Path) -> String {
    std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

/// Numbers in Blender's script.
fn blender_frames(script: &Path) -> Value {
    let text = read(script);
    let start = text.find("\"frames\":").unwrap() + "\"frames\":".len();
    let end = start + text[start..].find(']').unwrap() + 1;
    serde_json::from_str(&text[start..end]).unwrap()
}

#[test]
fn plates_keep_their_numbers_in_pictures_scripts_and_timelines() {
    let at = PLATES.path();
    for (folder, more, [first, last]) in [
        ("own", "", [1001, 1004]),
        ("part", "--frames 1-2", [1002, 1003]),
        ("from 1", "--first-number 1", [1, 4]),
        ("part from 0", "--first-number 0 --frames 2-3", [2, 3]),
    ] {
        let folder = at.join(folder);
        std::fs::create_dir(&folder).unwrap();
        let command = "relight ../film --to shot.####.exr --layers --hand-over nuke,blender,otio,edl";
        export(&folder, command, more);
        let wanted: Vec<String> = (first..=last).map(|n| format!("shot.{n:04}.exr")).collect();
        let mut found = names(&folder, ".exr");
        found.retain(|name| name != "shot.environment.exr");
        assert_eq!(found, wanted);
        let script = read(&folder.join("shot.nk"));
        for knob in ["first", "last", "origfirst", "first_frame"] {
            let number = if knob == "last" { last } else { first };
            assert!(script.contains(&format!(" {knob} {number}\n")), "{knob}");
        }
        assert!(script.contains(" file shot.%04d.exr\n"));
        assert_eq!(blender_frames(&folder.join("shot.blender.py")), serde_json::json!([first, last]));
        let timeline: Value = serde_json::from_str(&read(&folder.join("shot.otio"))).unwrap();
        let media = &timeline["tracks"]["children"][0]["children"][0]["media_reference"];
        assert_eq!((&media["start_frame"], &media["frame_zero_padding"]), (&first.into(), &4.into()));
        let list = read(&folder.join("shot.edl"));
        assert!(list.contains(&format!("shot.[{first:04}-{last:04}].exr\n")), "{list}");
        let range = format!("{first}-{last}");
        let check = ["check", "shot.####.exr", "--frames", &range, "--strict", "--json"];
        let checked = succeed(&folder, &[&check[..], &["--mhl"]].concat());
        assert_eq!(checked["frames"], serde_json::json!([first, last]));
        assert_eq!(succeed(&folder, &["check", "ascmhl", "--json"])["passed"], true);
    }
    is_verified_by_ascmhl(&at.join("own"));
}

/// Verifies a folder's hash lists with the reference implementation, and one of its lists with ours.
fn is_verified_by_ascmhl(folder: &Path) {
    let Some(python) = python(&["ascmhl"]) else { return };
    let run = |command: &str, more: &[&str]| {
        let program = format!("from ascmhl.commands import {command}; {command}()");
        let mut run = std::process::Command::new(&python);
        run.args(["-c", &program]).arg(folder).args(more);
        let output = run.output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(run("verify", &[]).0, Some(0), "{}", run("verify", &[]).1);
    for formats in [&["-h", "c4"][..], &["-h", "xxh64", "-h", "c4"]] {
        assert_eq!(run("create", formats).0, Some(0), "{}", run("create", formats).1);
        let found = succeed(folder, &["check", "ascmhl", "--strict", "--json"]);
        assert_eq!(found["files"], found["same"]);
    }
    let check = ["check", "shot.####.exr", "--mhl", "--json"];
    let written = succeed(folder, &check)["hash_list"].as_str().unwrap().to_owned();
    assert!(written.contains("0004_own_"), "{written}");
    assert_eq!(run("verify", &[]).0, Some(0), "{}", run("verify", &[]).1);
    std::fs::write(folder.join("shot.edl"), "").unwrap();
    assert_eq!(run("verify", &[]).0, Some(11), "changed");
    assert!(fail(folder, &["check", "ascmhl"]).contains("shot.edl differs in its bytes"));
    std::fs::remove_file(folder.join("shot.edl")).unwrap();
    assert_eq!(run("verify", &[]).0, Some(10), "missing");
    assert!(fail(folder, &["check", "ascmhl"]).contains("shot.edl is missing"));
}

#[test]
fn a_stopped_export_and_a_farm_job_in_parts_number_their_frames_alike() {
    let at = PLATES.path();
    let names_in = |folder: &str| names(&at.join(folder), ".png");
    let wanted = ["a.1001.png", "a.1002.png", "a.1003.png", "a.1004.png"];
    export(at, "relight film --to stills/a.%04d.png", "--frames 1-2");
    assert_eq!(names_in("stills"), wanted[1..3]);
    let resumed = export(at, "relight film --to stills/a.%04d.png --resume", "--frames 1-3");
    assert_eq!(resumed["kept"], 2);
    assert_eq!(names_in("stills"), wanted[1..]);
    for (job, more, first) in [("job", "", 1001), ("other", "--first-number -2", -2)] {
        let farm = format!("farm film --to {job} --output {job}d/a.%04d.png --engine slurm --chunk 2");
        export(at, &farm, more);
        succeed(at, &["farm-chunk", job, "--frames", "2-3", "--json"]);
        let report = succeed(at, &["farm-chunk", job, "--frames", "0-1", "--json"]);
        assert!(report["bytes"].as_u64().unwrap() > 100, "{report}");
        succeed(at, &["farm-assemble", job, "--json"]);
        let mut wanted: Vec<String> = (first..first + 4).map(|n| format!("a.{n:04}.png")).collect();
        wanted.sort();
        assert_eq!(names_in(&format!("{job}d")), wanted);
    }
}

#[test]
fn numbers_below_0_are_written_as_nuke_reads_them_and_refused_where_a_program_cannot() {
    let folder = project(&["-0001", "0000"]);
    let at = folder.path();
    export(at, "relight film --to a/shot.%04d.exr", "--layers --hand-over nuke,edl");
    assert_eq!(names(&at.join("a"), ".exr"), ["shot.-001.exr", "shot.0000.exr"]);
    assert!(read(&at.join("a/shot.nk")).contains(" first_frame -1\n last_frame 0\n"));
    assert!(read(&at.join("a/shot.edl")).contains("shot.[-001-0000].exr"));
    let checked = succeed(at, &["check", "a/shot.%04d.exr", "--frames", "-1-0", "--strict", "--json"]);
    assert_eq!(checked["frames"], serde_json::json!([-1, 0]));
    for program in ["otio", "blender"] {
        let line = format!("relight film --environment nave --layers --to b/shot.%04d.exr --hand-over {program}");
        let said = fail(at, &line.split(' ').collect::<Vec<_>>());
        assert!(said.contains("--first-number") && !at.join("b").exists(), "{said}");
    }
    export(at, "relight film --to b/shot.%d.exr", "--hand-over otio");
    let line = "relight film --environment nave --to b/%04d.exr --first-number 9999999999";
    let said = crate::program::afterlight(at, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(said.status.code(), Some(2));
}
