//! Fuzzing of every reader that depends on the network, its training or the window. The other readers are in
//! `tests/fuzz`.

use afterlight::cli::Cli;
use afterlight::evaluation::review::{Marks, Means, Metric, Review};
use afterlight::export::TimeCode;
use afterlight::export::relight::RelightSettings;
use afterlight::farm::{self, ChunkSettings, Engine, FarmSettings};
use afterlight::progress::Progress;
use afterlight::project::Project;
use afterlight::reflectance::checkpoint::{self, CheckpointInfo, TrainingState};
use afterlight::reflectance::{Formulation, Normalization, Precision, Statistics, UNetConfig};
use afterlight::studio::{Layout, Preferences, SavedLook, State, StoredLook};
use afterlight::training::features::{Features, WeightFile};
use afterlight::training::{History, Preset};
use burn::tensor::Device;
use clap::Parser;
use fuzz::{Outcome, Target};
use std::path::Path;
use test_shoot::TestShoot;
use test_support::shown;

#[global_allocator]
static COUNTED: fuzz::Counted = fuzz::Counted;

/// A checkpoint of the smallest network.
fn save_checkpoint(folder: &Path) {
    let info = CheckpointInfo {
        step: 7,
        seconds: 1.5,
        scale: 1.25,
        training_frames: vec![0, 3],
        network: UNetConfig {
            size: 16,
            lamps: 2,
            depth: Some(2),
            width: 8,
            most_channels: 8,
            normalization: Normalization::Group,
            statistics: Statistics::default(),
            formulation: Formulation::Ratio,
            precision: Precision::default(),
        },
        held_out: None,
    };
    let network = info.network.init(0.5, &Device::flex());
    let state = TrainingState {
        average_weights: None,
        live_weights: checkpoint::weight_bytes(&network).unwrap(),
        optimizer: checkpoint::weight_bytes(&network).unwrap(),
    };
    checkpoint::save(folder, &info, &network, &state).unwrap();
}

/// Loads a checkpoint in every way; errors may name any of its files.
fn load_checkpoint(folder: &Path, changed: &Path) -> Outcome {
    let device = Device::flex();
    let read = || {
        checkpoint::has_optimizer(folder)?;
        let (_, network) = checkpoint::load(folder, &device)?;
        assert!(network.is_finite());
        checkpoint::load_training(folder, &device)
    };
    read().map(drop).map_err(|e| format!("{}: {e}", changed.display()))
}

#[test]
fn a_checkpoint_s_table_of_any_content_is_loaded_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    save_checkpoint(folder.path());
    let path = folder.path().join("checkpoint.toml");
    let table = std::fs::read(&path).unwrap();
    let measured =
        fuzz::run!(Target::of_text("table", path, vec![table]), |path: &Path| { load_checkpoint(folder.path(), path) });
    shown!(Strangers, "A `checkpoint.toml` with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn weights_of_any_content_are_loaded_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    save_checkpoint(folder.path());
    let table = folder.path().join("checkpoint.toml");
    let text = std::fs::read_to_string(&table).unwrap();
    // As a stranger may write it: without checksums, and with a single file for all.
    let (start, rest) = text.split_once("[checksums]").unwrap();
    let info = &rest[rest.find("[info]").unwrap()..];
    let start = start.replace("live-", "weights-");
    std::fs::write(&table, format!("{start}{info}")).unwrap();
    let path = folder.path().join("weights-0000007.bpk");
    let seed = std::fs::read(&path).unwrap();
    let measured = fuzz::run!(Target::of_bytes("weights", path, vec![seed]), |path: &Path| {
        load_checkpoint(folder.path(), path)
    });
    shown!(Strangers, "Weights (`.bpk`) with arbitrary content and no checksum",
        bound: "4 GiB at once", measured: measured);
}

/// A safetensors file of two tensors.
fn safetensors() -> Vec<u8> {
    let header = br#"{"features.0.weight":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]},"b":{"dtype":"F16","shape":[4],"data_offsets":[24,32]}}"#;
    let data = [0u8, 0, 0x80, 0x3f].repeat(8);
    [&(header.len() as u64).to_le_bytes()[..], header, &data].concat()
}

/// Pickle of such a file in PyTorch's format: a dictionary with a tensor of 2 × 3 values.
fn pickle() -> Vec<u8> {
    let word = |text: &str| [b"X", &(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    [
        b"\x80\x02}".to_vec(),
        word("features.0.weight"),
        b"ctorch._utils\n_rebuild_tensor_v2\n((".to_vec(),
        word("storage"),
        b"ctorch\nFloatStorage\n".to_vec(),
        word("0"),
        word("cpu"),
        b"K\x06tQK\x00K\x02K\x03\x86K\x03K\x01\x86\x89ccollections\nOrderedDict\n)RtRs.".to_vec(),
    ]
    .concat()
}

/// An uncompressed ZIP archive, the container of PyTorch's format.
fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let start = bytes.len() as u32;
        let mut fields = [0u8; 26];
        fields[0] = 20;
        fields[10..14].copy_from_slice(&crc32fast::hash(content).to_le_bytes());
        fields[14..18].copy_from_slice(&(content.len() as u32).to_le_bytes());
        fields[18..22].copy_from_slice(&(content.len() as u32).to_le_bytes());
        fields[22..24].copy_from_slice(&(name.len() as u16).to_le_bytes());
        bytes.extend([b"PK\x03\x04", &fields[..], name.as_bytes(), content].concat());
        directory.extend([b"PK\x01\x02\x14\0", &fields[..], &[0; 10], &start.to_le_bytes(), name.as_bytes()].concat());
    }
    let (start, length) = (bytes.len() as u32, directory.len() as u32);
    let count = (files.len() as u16).to_le_bytes();
    bytes.extend(directory);
    bytes.extend(
        [b"PK\x05\x06\0\0\0\0", &count[..], &count, &length.to_le_bytes(), &start.to_le_bytes(), &[0; 2]].concat(),
    );
    bytes
}

/// Wraps a pickle in the archive that holds its values.
fn packed(file: &mut Vec<u8>) {
    if !file.starts_with(b"PK") {
        let values = [0u8, 0, 0x80, 0x3f].repeat(6);
        *file =
            archive(&[("a/data.pkl", file), ("a/byteorder", b"little"), ("a/data/0", &values), ("a/version", b"3\n")]);
    }
}

/// Opens a file of features and reads one of its tensors.
fn read_features(path: &Path) -> Outcome {
    // The file holds none of the known networks; that is not its fault.
    assert!(Features::open(path, &Device::flex()).is_err());
    let file = WeightFile::open(path).map_err(|e| e.to_string())?;
    let read = file.parameter("features.0.weight", [2, 3], &Device::flex());
    read.map(drop).map_err(|e| e.to_string())
}

#[test]
fn feature_weights_of_any_content_are_loaded_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = Target::of_bytes("safetensors", folder.path().join("vgg.safetensors"), vec![safetensors()]);
    let first = fuzz::run!(target, read_features);
    let mut whole = pickle();
    packed(&mut whole);
    std::fs::write(folder.path().join("whole.pth"), &whole).unwrap();
    read_features(&folder.path().join("whole.pth")).unwrap();
    let target =
        Target { repair: packed, ..Target::of_bytes("pth", folder.path().join("vgg.pth"), vec![whole, pickle()]) };
    let second = fuzz::run!(target, read_features);
    shown!(Strangers, "Feature weights (`.safetensors`, `.pth`) with arbitrary content",
        bound: "4 GiB at once", measured: format!("{first}; {second}"));
}

#[derive(Parser)]
struct Asked {
    #[command(flatten)]
    settings: RelightSettings,
}

#[test]
fn a_farm_s_job_of_any_content_is_run_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = TestShoot { frames: 2, lamps: 4, ..TestShoot::default() };
    let (project, _) = shoot.calibrate(folder.path(), "project");
    save_checkpoint(&project.checkpoint_path());
    let job = folder.path().join("job");
    let to = folder.path().join("%02d.exr").display().to_string();
    let asked = ["farm", "--environment", "nave", "--to", &to];
    let settings = Asked::try_parse_from(asked).unwrap().settings;
    let chunks = ChunkSettings { chunk: Some(1), ..ChunkSettings::default() };
    let farm = FarmSettings::new(Engine::Slurm, job.clone());
    let silent = Progress::silent();
    farm::write_job(&project, &settings, &farm, &chunks, &silent).unwrap();
    let path = job.join("job.json");
    let seed = std::fs::read(&path).unwrap();
    // No frame exists: for a valid job the message lists all frames to write.
    let read = |path: &Path| {
        let said = farm::assemble(&job, None, &silent).unwrap_err().to_string();
        if said.contains("have to be written again: ") {
            Ok(())
        } else {
            // Settings lead to other files too.
            Err(format!("{}: {said}", path.display()))
        }
    };
    let measured = fuzz::run!(Target::of_text("job", path, vec![seed]), read);
    shown!(Strangers, "A farm's `job.json` with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn training_logs_of_any_content_are_drawn_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let steps = "step,seconds,loss_rec,loss_render,learning_rate,gradient_norm,taken\n1,0.25,0.5,0.25,1e-3,2.5,true\n2,0.5,,0.125,1e-3,2.5,true\n";
    std::fs::write(folder.path().join("held_out.csv"), "step,seconds,decibels\n2,0.5,21.5\n").unwrap();
    let target = Target::of_text("log", folder.path().join("training.csv"), vec![steps.into()]);
    let measured = fuzz::run!(target, |path: &Path| {
        let history = History::read(path.parent().unwrap()).map_err(|e| e.to_string())?;
        for point in history.points() {
            let losses = [point.reconstruction, point.rendering, point.held_out_db];
            assert!(losses.into_iter().flatten().all(f32::is_finite) && point.seconds.is_finite());
        }
        assert!(history.seconds_per_step().is_none_or(f64::is_finite));
        Ok(())
    });
    shown!(Strangers, "A `training.csv` with arbitrary content", bound: "finite curves", measured: measured);
}

#[test]
fn a_review_of_any_content_is_shown_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let project = Project::without_shoot(folder.path());
    let cell = r#"{"psnr_db": 30.5, "ssim": 0.9, "flip": 0.1}"#;
    let measured = format!(
        r#"{{"format": 1, "basis": {{}}, "truth": null, "training_steps": 12, "training_seconds": 6.5, "lamps": ["a", "b"],
        "cases": [{{"case": {{"frame": 5}}, "name": "frame_005", "seen": false, "scale": 1.0, "cells": [{cell}, {cell}]}},
        {{"case": {{"pose": 0}}, "name": "pose00", "seen": true, "scale": 1.0, "cells": [{cell}, {cell}]}}]}}"#
    );
    let mut value: serde_json::Value = serde_json::from_str(&measured).unwrap();
    value["basis"] = serde_json::to_value(afterlight::evaluation::review::Fingerprint::default()).unwrap();
    let target = Target::of_text("review", project.measured_path(), vec![value.to_string().into_bytes()]);
    let first = fuzz::run!(target, |_: &Path| {
        let Some(review) = Review::load(&project).map_err(|e| e.to_string())? else { return Ok(()) };
        for metric in Metric::ALL {
            review.worst(metric);
            review.worst_lamps(metric);
            review.case_means(metric);
        }
        Means::from_cases(&review.judged());
        Ok(())
    });
    let marks =
        b"format = 1\n\n[[cells]]\ncase = \"frame_005\"\nlamp = \"a\"\nmark = \"bad\"\nnote = \"hair\"\nlater = 3\n";
    let target = Target::of_text("marks", project.marks_path(), vec![marks.to_vec()]);
    let second = fuzz::run!(target, |_: &Path| {
        let marks = Marks::load(&project).map_err(|e| e.to_string())?;
        marks.get("frame_005", "a");
        Ok(())
    });
    shown!(Strangers, "A `measured.json` and a `review.toml` with arbitrary content", bound: "4 GiB at once", measured: format!("{first}; {second}"));
}

#[test]
fn a_look_and_preferences_of_any_content_are_used_or_put_aside() {
    let folder = tempfile::tempdir().unwrap();
    let project = Project::without_shoot(folder.path());
    let look = r#"{"environment": "sky", "yaw_deg": 40.5, "exposure_stops": -1.5,
        "yaw_keys": {"interpolation": "smooth", "keys": [{"frame": 0, "value": 0}, {"frame": 24.5, "value": 90}]},
        "keys": {"exposure": {"keys": [{"frame": 0, "value": 1, "interpolation": "bezier", "in": -2.5, "out": 0.5}]},
        "lights.1.red": {"interpolation": "hold", "keys": [{"frame": 3, "value": 0.5}]}, "effects.glare": {"keys": []}},
        "lighting": {"pitch_deg": 10, "temperature_k": 5600, "tint": 3, "placed": [{"kind": "disc", "yaw_deg": 20,
        "pitch_deg": 45, "radius_deg": 10, "color": [1, 1, 0.5], "intensity": 3.14, "enabled": true}]}}"#;
    let plain = SavedLook::from_look(&State::new(10, 24.0).look).text();
    let seeds = vec![look.into(), plain.into_bytes()];
    let first = fuzz::run!(Target::of_text("look", SavedLook::path(&project), seeds), |_: &Path| {
        let read = SavedLook::load(&project, true).map_err(|e| e.to_string())?;
        let mut state = State::new(10, 24.0);
        read.unwrap().apply(&mut state.look);
        assert!(state.look.yaw_deg.is_finite() && state.look.exposure_stops.is_finite());
        let gains = state.look.lighting.gains();
        assert!(gains.iter().all(|v| v.is_finite() && *v >= 0.0), "{gains:?}");
        assert!(state.look.lighting.turn(state.look.yaw_deg).is_finite());
        let scene = state.scene();
        assert_eq!(scene.effects, scene.effects.bounded());
        Ok(())
    });
    let place = folder.path().join("window.json");
    let layout = serde_json::to_string(&Layout::default()).unwrap();
    let preferences = format!(r#"{{"recent": ["/a/b"], "layout": {layout}}}"#).into_bytes();
    let second = fuzz::run!(Target::of_text("preferences", place, vec![preferences]), |path: &Path| {
        Preferences::from_file(path).layout();
        Ok(())
    });
    let stored = StoredLook::from_look(&State::new(10, 24.0).look).text();
    let third = fuzz::run!(
        Target::of_text("stored look", folder.path().join("0001.json"), vec![stored.into_bytes()]),
        |path: &Path| {
            let read = StoredLook::read(path).map_err(|e| e.to_string())?;
            let mut state = State::new(10, 24.0);
            read.apply(&mut state.look, None);
            assert!(state.look.yaw_deg.is_finite() && state.look.exposure_stops.is_finite());
            Ok(())
        }
    );
    shown!(Strangers, "A `look.json`, stored looks and preferences with arbitrary content",
        bound: "finite light, turns and effects", measured: format!("{first}; {second}; {third}"));
}

#[test]
fn a_command_of_any_words_is_parsed_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let commands = [
        "stage dir --frames 24 --size 128 --lamps 41 --seed 3",
        "import p --shoot s --size 128 --seed 1 --lamps 12 --name n --json",
        "calibrate p --circle 320,240,200.5 --gamma 2.5,1.75,1.25 --comparison pixels",
        "relight p --to out --yaw 30 --frames 0-23 --exposure -1.5 --intensity 2 --temperature 5600 --light -90,45,30,3.14",
        "relight p --to out.mp4 --yaw-keys 0:0,24:90 --pitch 10 --roll -3 --tint 20",
        "train p --minutes 0.5 --set width=32 --set learning-rate=1e-3 --preset quick",
        "frame p --interview 10,-20,300 --padding edge",
        "probe in.exr --to out.hdr",
        "demo d --minutes 1 --device cpu",
        "environments p --add sky.exr --front blender",
    ];
    let target =
        Target::of_text("commands", folder.path().join("typed"), commands.map(|c| c.as_bytes().to_vec()).to_vec());
    let measured = fuzz::run!(target, |path: &Path| {
        let typed = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
        if let Err(error) = Cli::try_parse_from(std::iter::once("afterlight").chain(typed.split_whitespace())) {
            assert!(matches!(error.exit_code(), 0 | 2), "{error}");
        }
        for setting in typed.split_whitespace() {
            let _ = Preset::Quick.config().set(setting);
        }
        let numbers: Vec<f64> =
            typed.split(|c: char| c.is_whitespace() || c == ',').filter_map(|word| word.parse().ok()).collect();
        for pair in numbers.windows(2) {
            TimeCode::new(pair[0] as usize, pair[1]).to_string();
        }
        Ok(())
    });
    shown!(Strangers, "Malformed command lines, settings and time codes", bound: "exit code 2", measured: measured);
}
