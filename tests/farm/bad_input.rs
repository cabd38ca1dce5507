//! Faults on farms: nothing is lost or doubled, and each has its message.

use crate::job::{FRAMES, Ground};
use crate::program::{afterlight, fail, succeed};
use serde_json::Value;
use std::path::Path;
use test_support::shown;
use test_support::small_disk::SmallDisk;

/// A job in two chunks whose output is `joined.mov`.
fn written() -> Option<Ground> {
    test_support::ffmpeg().then(|| {
        let ground = Ground::new();
        ground.write_job("a job", "joined.mov", &["--engine", "openjd", "--chunk", "6"]);
        ground
    })
}

/// Replaces a file as an editor does: with a new one.
fn replace(path: &Path, change: impl FnOnce(Vec<u8>) -> Vec<u8>) {
    let bytes = change(std::fs::read(path).unwrap());
    std::fs::remove_file(path).unwrap();
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_project_that_changes_while_its_job_runs_changes_nothing_in_it() {
    let Some(ground) = written() else { return };
    ground.export("alone.mov");
    ground.chunk("a job", "0-5");
    // More training, another calibration, another name: changes that an artist may make meanwhile.
    let train = "train;my film;--epochs;3;--device;cpu;--set;width=8;--set;most-channels=16;--json";
    succeed(ground.path(), &train.split(';').collect::<Vec<_>>());
    succeed(ground.path(), &["calibrate", "my film", "--gamma", "srgb", "--json"]);
    ground.export("later.mov");
    assert!(ground.read("later.mov") != ground.read("alone.mov"));
    ground.chunk("a job", "6-11");
    ground.assemble("a job");
    assert!(ground.read("joined.mov") == ground.read("alone.mov"));
    shown!(Accidents, "A project is trained and calibrated while its job runs on a farm", bound: "the movie of one export", measured: "equal bytes");
}

#[test]
fn a_worker_of_another_version_is_refused_by_both_names() {
    let Some(ground) = written() else { return };
    let file = ground.at("a job/job.json");
    let text = std::fs::read_to_string(&file).unwrap();
    let mut job: Value = serde_json::from_str(&text).unwrap();
    let ours = job["program"]["sha256"].as_str().unwrap()[..12].to_owned();
    job["program"] = serde_json::json!({ "version": "0.0.9", "sha256": "f".repeat(64) });
    // Unknown settings must not fail before the version check.
    job["work"] = serde_json::json!({ "dream": {} });
    std::fs::write(&file, job.to_string()).unwrap();
    for command in [&["farm-chunk", "a job", "--frames", "0-5"][..], &["farm-assemble", "a job"]] {
        let said = fail(ground.path(), command);
        let names = [env!("CARGO_PKG_VERSION"), &ours, "0.0.9 (build ffffffffffff)"];
        assert!(names.iter().all(|name| said.contains(name)), "{said}");
    }
    assert!(ground.frames("a job").is_empty());
    shown!(Surroundings, "A worker of a farm has another version of the program",
        done: "the job names its program by version and hash; another one is refused, and the message names both");
}

#[test]
fn a_snapshot_that_was_touched_is_refused() {
    let Some(ground) = written() else { return };
    for file in ["calibration.toml", "environment.f32", "project.toml"] {
        let path = ground.at("a job/snapshot").join(file);
        let whole = std::fs::read(&path).unwrap();
        replace(&path, |mut bytes| {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            bytes
        });
        let said = fail(ground.path(), &["farm-chunk", "a job", "--frames", "0-5"]);
        assert!(said.contains(file) && said.contains("hash"), "{said}");
        replace(&path, |_| whole);
    }
    assert_eq!(ground.chunk("a job", "0")["kept"], 0);
}

#[test]
fn frames_that_lack_or_are_damaged_are_named_with_their_command() {
    let Some(ground) = written() else { return };
    ground.export("alone.mov");
    ground.chunk("a job", "0-5");
    let said = fail(ground.path(), &["farm-assemble", "a job"]);
    assert!(said.contains("6 of 12") && said.contains("6-11 are missing"), "{said}");
    assert!(said.contains("afterlight farm-chunk 'a job' --frames 6-11"), "{said}");
    ground.chunk("a job", "6-11");
    // Half a frame, a frame with another's content, and a missing frame.
    let frame = |number| ground.frame("a job", number);
    replace(&frame(2), |bytes| bytes[..bytes.len() * 2 / 3].to_vec());
    std::fs::copy(frame(7), frame(8)).unwrap();
    std::fs::remove_file(frame(11)).unwrap();
    let said = fail(ground.path(), &["farm-assemble", "a job"]);
    for words in ["3 of 12", "2 is damaged", "8 was made from another", "11 is missing"] {
        assert!(said.contains(words), "{said}");
    }
    assert!(!ground.at("joined.mov").exists());
    let report: Value = serde_json::from_slice(&ground.read("a job/report.json")).unwrap();
    let again: Vec<&str> = report["again"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert_eq!(again.len(), 3);
    for (command, frames) in again.iter().zip(["2", "8", "11"]) {
        assert_eq!(*command, format!("afterlight farm-chunk 'a job' --frames {frames}"));
        assert_eq!(ground.chunk("a job", frames)["kept"], 0);
    }
    ground.assemble("a job");
    assert!(ground.read("joined.mov") == ground.read("alone.mov"));
    shown!(Accidents, "A farm chunk writes half a frame, or loses one",
        bound: "the movie of one export", measured: "equal bytes");
}

#[test]
fn a_lost_worker_s_frames_are_kept_and_two_workers_at_one_chunk_do_no_harm() {
    let Some(ground) = written() else { return };
    ground.export("alone.mov");
    ground.kill_a_chunk("a job", 0, "0-5");
    let left = ground.frames("a job").len();
    assert!((1..6).contains(&left), "{left} frames");
    // The job is submitted twice.
    let both: Vec<Value> = std::thread::scope(|threads| {
        let run = || ground.chunk("a job", "0-5");
        let workers = [threads.spawn(run), threads.spawn(run)];
        workers.map(|worker| worker.join().unwrap()).into()
    });
    let kept: Vec<usize> = both.iter().map(|r| r["kept"].as_u64().unwrap() as usize).collect();
    assert!(kept.contains(&left), "{kept:?}: {left} were there");
    assert!(kept.contains(&6), "{kept:?}: the other one finds all frames");
    ground.chunk("a job", "6-11");
    // Clocks of workers and of the disk differ: nothing depends on file times.
    for frame in 0..FRAMES {
        let file = std::fs::File::options().write(true).open(ground.frame("a job", frame)).unwrap();
        file.set_modified(std::time::UNIX_EPOCH + std::time::Duration::from_secs(frame as u64)).unwrap();
    }
    let again = ground.chunk("a job", "0-11");
    assert_eq!(again["kept"], 12);
    ground.assemble("a job");
    assert!(ground.read("joined.mov") == ground.read("alone.mov"));
    shown!(Accidents, "A farm worker is killed, and two workers get the same chunk",
        bound: "the movie of one export", measured: "equal bytes");
}

#[test]
fn footage_that_changes_is_noticed_and_footage_elsewhere_is_found() {
    let Some(ground) = written() else { return };
    ground.chunk("a job", "0-11");
    // The shoot moves; workers may see it under another path.
    std::fs::rename(ground.at("shoot"), ground.at("moved")).unwrap();
    let said = fail(ground.path(), &["farm-chunk", "a job", "--frames", "0-5"]);
    assert!(said.contains("shoot"), "{said}");
    let chunk = ["farm-chunk", "a job", "--frames", "0-11", "--shoot", "moved", "--json"];
    assert_eq!(succeed(ground.path(), &chunk)["kept"], 12, "the same pictures");
    let plates = std::fs::read_dir(ground.at("moved/interview")).unwrap();
    let mut plates: Vec<_> = plates.map(|entry| entry.unwrap().path()).collect();
    plates.sort();
    std::fs::copy(&plates[4], &plates[5]).unwrap();
    let said = fail(ground.path(), &["farm-assemble", "a job", "--shoot", "moved"]);
    assert!(said.contains("1 of 12") && said.contains("5 was made from another"), "{said}");
}

#[test]
fn a_lost_layer_a_new_first_frame_and_another_field_are_made_again() {
    let ground = Ground::new();
    let more = "--engine;openjd;--chunk;6;--layers;--layer-files;files";
    let more: Vec<&str> = more.split(';').collect();
    ground.write_job("a job", "shot/a.%02d.exr", &more);
    let took = ground.chunk("a job", "0-5")["seconds"].as_f64().unwrap();
    ground.chunk("a job", "6-11");
    let report = ground.assemble("a job");
    let layer = std::fs::read_dir(ground.at("shot")).unwrap();
    let layer = layer
        .map(|entry| entry.unwrap().path())
        .find(|path| {
            let name = path.file_name().unwrap().to_string_lossy();
            name.contains("light_01") && name.contains("04")
        })
        .unwrap();
    std::fs::remove_file(&layer).unwrap();
    let said = fail(ground.path(), &["farm-assemble", "a job"]);
    assert!(said.contains("4 is damaged"), "{said}");
    assert_eq!(ground.chunk("a job", "4")["kept"], 0);
    assert!(layer.is_file());
    // Kept frames add nothing: times and bytes are counted once.
    assert_eq!(ground.chunk("a job", "0-5")["kept"], 6);
    let again = ground.assemble("a job");
    assert_eq!(again["frame_bytes"], report["frame_bytes"]);
    let record = &again["chunks"].as_array().unwrap()[0];
    assert_eq!(record["seconds"].as_f64(), Some(took));
    // Another storage format of OLATs makes other files.
    let other = [&more[..], &["--field", "f32"]].concat();
    ground.write_job("other", "shot/a.%02d.exr", &other);
    let said = fail(ground.path(), &["farm-assemble", "other"]);
    assert!(said.contains("12 of 12"), "{said}");
    // The first frame's light sets the level of all.
    let plates = std::fs::read_dir(ground.at("shoot/interview")).unwrap();
    let mut plates: Vec<_> = plates.map(|entry| entry.unwrap().path()).collect();
    plates.sort();
    std::fs::copy(&plates[4], &plates[0]).unwrap();
    let said = fail(ground.path(), &["farm-assemble", "a job"]);
    assert!(said.contains("12 of 12"), "{said}");
}

#[test]
fn a_full_disk_is_a_sentence_and_loses_nothing() {
    let ground = Ground::new();
    let Some(disk) = SmallDisk::mount(200) else { return };
    ground.write_job("a job", &disk.at("%02d.exr"), &["--engine", "slurm", "--chunk", "12"]);
    let said = fail(ground.path(), &["farm-chunk", "a job", "--frames", "0-11"]);
    assert!(said.contains("room") && said.contains("frames are kept"), "{said}");
    let there = disk.names().len() as u64;
    assert!(there > 0);
    // Finished frames are complete and are not made again.
    let output = afterlight(ground.path(), &["farm-chunk", "a job", "--frames", "0-0", "--json"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["kept"], 1, "it is {there} files");
}

#[test]
fn a_job_is_written_into_an_empty_folder_alone_and_to_its_end() {
    let ground = Ground::new();
    std::fs::create_dir(ground.at("taken")).unwrap();
    std::fs::write(ground.at("taken/notes"), "mine").unwrap();
    let asked = "farm;my film;--environment;nave;--output;a.mov;--engine;slurm;--to;taken";
    let said = fail(ground.path(), &asked.split(';').collect::<Vec<_>>());
    assert!(said.contains("taken is not empty"), "{said}");
    assert_eq!(std::fs::read_dir(ground.at("taken")).unwrap().count(), 1);
    let said = fail(ground.path(), &["farm-chunk", "taken", "--frames", "0"]);
    assert!(said.contains("job.json"), "{said}");
    // A job that cannot be written leaves its folder unchanged.
    let asked = "farm;my film;--environment;nave;--output;a%d.png;--lut;gone.cube;--engine;slurm;--to;half";
    let said = fail(ground.path(), &asked.split(';').collect::<Vec<_>>());
    assert!(said.contains("gone.cube"), "{said}");
    let left = std::fs::read_dir(ground.at("half")).map_or(0, Iterator::count);
    assert_eq!(left, 0);
    let Some(ground) = written() else { return };
    let said = fail(ground.path(), &["farm-chunk", "a job", "--frames", "6-99"]);
    assert!(said.contains("0 to 11"), "{said}");
    let said = fail(ground.path(), &["farm-chunk", "a job", "--task", "0"]);
    assert!(said.contains("no training 0") || said.contains("has no training"), "{said}");
}
