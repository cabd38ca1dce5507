//! Training on a full disk.

use super::config::{Preset, TrainSettings, TrainingConfig};
use super::run::train;
use base::progress::{Control, Progress, Report};
use burn::tensor::Device;
use gpu::DeviceChoice;
use reflectance::checkpoint;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use test_shoot::TestShoot;
use test_support::small_disk::{SmallDisk, names};

/// Fills the disk.
fn fill(path: &Path) {
    let mut file = std::fs::File::create(path).unwrap();
    while file.write_all(&[0; 512]).is_ok() {}
}

#[test]
fn a_training_waits_for_room_and_loses_nothing() {
    let Some(disk) = SmallDisk::mount(6144) else { return };
    let (folder, silent) = (tempfile::tempdir().unwrap(), Progress::silent());
    let shoot = TestShoot { frames: 2, lamps: 4, working_size: 16, ..TestShoot::default() };
    let root = disk.0.path().join("project");
    let (project, calibration) = shoot.calibrate(folder.path(), &root);
    let settings = |epochs| TrainSettings {
        config: TrainingConfig {
            width: 8,
            most_channels: 16,
            minutes: None,
            decay: false,
            epochs,
            ..Preset::Quick.config()
        },
        exclude_frames: Vec::new(),
        hold_out: None,
        fresh: false,
        device: DeviceChoice::Cpu,
    };
    let before = train(&project, &calibration, &settings(2), &silent).unwrap();
    let at = project.checkpoint_path();
    let files = names(&at);
    let whole = || {
        assert_eq!(names(&at), files, "no partly written file takes up room");
        let (info, _) = checkpoint::load(&at, &Device::flex()).unwrap();
        assert_eq!(info.step, before.steps);
    };

    let filler = disk.0.path().join("filler");
    fill(&filler);
    let alone = train(&project, &calibration, &settings(4), &silent).unwrap_err();
    assert!(alone.to_string().contains("weights-"), "{alone}");
    whole();

    let (held, control) = (Mutex::new(Vec::new()), Control::default());
    let sink = |report| {
        if let Report::Blocked(sentence) = report {
            whole();
            let mut held = held.lock().unwrap();
            held.push(sentence);
            // The first time the user continues with the disk still full.
            if held.len() > 1 {
                std::fs::remove_file(&filler).unwrap();
            }
            control.pause(false);
        }
    };
    let progress = Progress::new(&sink, control.clone()).attended();
    let after = train(&project, &calibration, &settings(4), &progress).unwrap();
    assert!(after.steps > before.steps);
    let held = held.lock().unwrap();
    assert_eq!(held.len(), 2);
    for sentence in held.iter() {
        assert!(sentence.contains("weights-") && sentence.contains("room"), "{sentence}");
    }
    assert_eq!(checkpoint::info(&at).unwrap().step, after.steps);
    let log = std::fs::read_to_string(root.join("training.csv")).unwrap();
    let last: Vec<&str> = log.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    let new = (before.steps + 1..=after.steps).map(|step| step.to_string());
    assert!(last.ends_with(&new.collect::<Vec<_>>().iter().map(String::as_str).collect::<Vec<_>>()));
}
