//! File systems with missing features.

use crate::Ground;
use afterlight::training::checkpoints;
use std::collections::BTreeSet;
use std::path::Path;
use test_support::small_disk::SmallDisk;

const TRAIN: [&str; 8] = ["train", "film", "--device", "cpu", "--set", "width=8", "--set", "checkpoint-seconds=0"];

#[test]
fn checkpoints_are_copied_where_the_disk_refuses_links() {
    let ground = Ground::new();
    // Hard links to another disk's files are refused.
    let Some(disk) = SmallDisk::mount(64 * 1024) else { return };
    let kept = ground.at("film/checkpoints");
    std::fs::create_dir_all(&kept).unwrap();
    let mut copy = std::process::Command::new("cp");
    let copied = copy.arg("-a").arg(kept.join(".")).arg(disk.0.path()).status();
    assert!(copied.unwrap().success());
    std::fs::remove_dir_all(&kept).unwrap();
    std::os::unix::fs::symlink(disk.0.path(), &kept).unwrap();
    let linked = std::fs::hard_link(ground.at("film/project.toml"), kept.join("linked"));
    assert!(linked.is_err(), "this disk takes links");

    let first = checkpoints::list(&ground.project());
    ground.succeed(&[&TRAIN[..], &["--epochs", "3"]].concat());
    let all = checkpoints::list(&ground.project());
    assert!(all.len() > first.len());
    let (newest, oldest) = (&all[0], all.last().unwrap());
    assert!(newest.info.step > oldest.info.step);
    for back in [oldest, newest] {
        let step = back.info.step.to_string();
        ground.succeed(&["checkpoints", "film", "--back-to", &step]);
        let folder = ground.at("film/checkpoint");
        let info = afterlight::reflectance::checkpoint::info(&folder).unwrap();
        assert_eq!(info, back.info);
        ground.succeed(&["relight", "film", "--environment", "nave", "--frames", "0", "--to", "out/one.png"]);
    }
    ground.succeed(&[&TRAIN[..], &["--epochs", "4"]].concat());
    ground.check_outside();
    test_support::shown!(
        Accidents,
        "A disk that refuses hard links",
        bound: "going back and forth restores each checkpoint, and training continues",
        measured: format!("{} checkpoints", all.len())
    );
}

/// Names below a folder that differ only in case.
fn twins(folder: &Path, found: &mut Vec<String>) {
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !names.insert(name.to_lowercase()) {
            found.push(format!("{}/{name}", folder.display()));
        }
        if entry.file_type().unwrap().is_dir() {
            twins(&entry.path(), found);
        }
    }
}

#[test]
fn no_names_that_the_program_gives_differ_in_case_alone() {
    let ground = Ground::new();
    ground.succeed(&[&TRAIN[..], &["--epochs", "3", "--hold-out", "1", "--fresh"]].concat());
    for to in ["out/%02d.png", "out/%02d.exr"] {
        ground.succeed(&["relight", "film", "--environment", "nave", "--to", to]);
    }
    let mut found = Vec::new();
    twins(ground.folder.path(), &mut found);
    assert!(found.is_empty(), "{found:?}");
    test_support::shown!(
        Accidents,
        "A disk that does not tell upper case from lower case",
        done: "no two file names differ only in case"
    );
}
