//! The program as a person or a script meets it: the whole way on a small shoot, exit codes, JSON.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn afterlight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afterlight"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn succeed(folder: &Path, arguments: &[&str]) -> Value {
    let output = afterlight(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{arguments:?} failed: {errors}"
    );
    let printed = String::from_utf8(output.stdout).expect("figures are text");
    serde_json::from_str(&printed)
        .unwrap_or_else(|e| panic!("{arguments:?} printed {printed:?}: {e}"))
}

/// The one line of an expected failure.
fn fail(folder: &Path, arguments: &[&str]) -> String {
    let output = afterlight(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?} did not fail");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    errors.lines().last().unwrap_or_default().to_owned()
}

fn has_keys(figures: &Value, keys: &[&str]) {
    for key in keys {
        assert!(figures.get(key).is_some(), "no {key} in {figures}");
    }
}

#[test]
fn a_small_shoot_goes_all_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(
        at,
        &[
            "stage", "shoot", "--size", "32", "--frames", "8", "--lamps", "12", "--json",
        ],
    );
    succeed(
        at,
        &[
            "import", "film", "--shoot", "shoot", "--size", "32", "--json",
        ],
    );

    let calibration = succeed(at, &["calibrate", "film", "--json"]);
    has_keys(
        &calibration,
        &[
            "gamma1",
            "gamma2",
            "exposure",
            "interview_weights",
            "uncovered_energy",
            "lamps",
        ],
    );
    let lamps = calibration["lamps"].as_array().unwrap();
    assert_eq!(lamps.len(), 12);
    has_keys(&lamps[0], &["name", "direction", "energy", "confidence"]);
    assert_eq!(
        calibration["interview_weights"][0]
            .as_array()
            .unwrap()
            .len(),
        3
    );

    let refused = fail(
        at,
        &["relight", "film", "--environment", "nave", "--to", "x.mp4"],
    );
    assert!(refused.contains("afterlight train"), "{refused}");

    let train = [
        "train",
        "film",
        "--epochs",
        "1",
        "--exclude-truth",
        "shoot",
        "--device",
        "cpu",
        "--json",
    ];
    let trained = succeed(at, &train);
    has_keys(
        &trained,
        &[
            "steps",
            "seconds",
            "features",
            "device",
            "parameters",
            "loss_rec",
            "loss_render",
        ],
    );
    assert_eq!(trained["steps"], 6);

    let scores = succeed(
        at,
        &[
            "evaluate",
            "film",
            "--truth",
            "shoot",
            "--sheet",
            "sheet.png",
            "--json",
        ],
    );
    has_keys(&scores, &["relit_psnr_db", "olat_psnr_db", "frames"]);
    assert!(
        scores["relit_psnr_db"]
            .as_object()
            .unwrap()
            .values()
            .all(Value::is_number)
    );
    assert!(at.join("sheet.png").exists());

    let to_stills = [
        "relight",
        "film",
        "--environment",
        "nave",
        "--frames",
        "2-3",
        "--to",
        "out.%04d.exr",
        "--json",
    ];
    let relit = succeed(at, &to_stills);
    has_keys(&relit, &["frames", "ms_per_frame", "passes", "output"]);
    has_keys(&relit["passes"][0], &["name", "ran", "reason", "ms"]);
    assert!(at.join("out.0002.exr").exists() && at.join("out.0003.exr").exists());

    if Command::new("ffmpeg").arg("-version").output().is_ok() {
        let to_clip = [
            "relight",
            "film",
            "--environment",
            "nave",
            "--turntable",
            "--to",
            "clip.mp4",
            "--json",
        ];
        assert_eq!(succeed(at, &to_clip)["frames"], 8);
        assert!(at.join("clip.mp4").metadata().unwrap().len() > 500);
    } else {
        println!("skipped the movie: there is no ffmpeg here");
    }

    // More training on all frames makes the truth's frames known to the network.
    succeed(
        at,
        &[
            "train", "film", "--epochs", "2", "--device", "cpu", "--json",
        ],
    );
    let refused = fail(at, &["evaluate", "film", "--truth", "shoot"]);
    assert!(refused.contains("--exclude-frames"), "{refused}");
}

#[test]
fn a_shoot_with_a_hole_is_refused_by_the_files_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(
        at,
        &[
            "stage", "shoot", "--size", "16", "--frames", "1", "--lamps", "4", "--json",
        ],
    );

    let olat = at.join("shoot/exemplars/pose01/olat_02.png");
    let bytes = std::fs::read(&olat).unwrap();
    std::fs::remove_file(&olat).unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("pose01/olat_02.png"), "{refused}");

    std::fs::write(&olat, b"no picture").unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("pose01/olat_02.png"), "{refused}");

    image::RgbImage::new(8, 16).save(&olat).unwrap();
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(
        refused.contains("pose01/olat_02.png") && refused.contains("8 × 16"),
        "{refused}"
    );

    std::fs::write(&olat, bytes).unwrap();
    succeed(
        at,
        &[
            "import", "film", "--shoot", "shoot", "--size", "16", "--json",
        ],
    );
    let project = std::fs::read_to_string(at.join("film/project.toml")).unwrap();
    assert!(project.contains("folder = \"../shoot\""), "{project}");
    let refused = fail(at, &["import", "film", "--shoot", "shoot", "--size", "16"]);
    assert!(refused.contains("project.toml"), "{refused}");
}

#[test]
fn wrong_usage_exits_with_2_and_help_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    for wrong in [
        &["train"][..],
        &["stage", "x", "--size", "many"],
        &["relight", "film", "--yaw"],
        &["--nonsense"],
    ] {
        assert_eq!(
            afterlight(folder.path(), wrong).status.code(),
            Some(2),
            "{wrong:?}"
        );
    }
    for command in [
        "stage",
        "import",
        "calibrate",
        "train",
        "relight",
        "evaluate",
        "studio",
        "demo",
        "pack",
    ] {
        let help = afterlight(folder.path(), &[command, "--help"]);
        assert_eq!(help.status.code(), Some(0));
        assert!(
            String::from_utf8_lossy(&help.stdout).contains("Example: afterlight"),
            "{command}"
        );
    }
    let missing = fail(folder.path(), &["calibrate", "nowhere"]);
    assert!(
        missing.contains("nowhere") && missing.contains("afterlight import"),
        "{missing}"
    );
}
