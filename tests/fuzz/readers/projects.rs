//! Contents of project and shoot folders.

use base::progress::Progress;
use calibration::Calibration;
use calibration::probe::Probes;
use footage::{Frame, ImportSettings, OlatReader, TrackingFrames, import, scan};
use fuzz::{Outcome, Target};
use imaging::Response;
use project::{EnvironmentChange, Project};
use std::path::Path;
use std::sync::LazyLock;
use test_shoot::TestShoot;
use test_support::{copy_folder, shown};

/// A calibrated project in a folder of its own.
fn made() -> (tempfile::TempDir, Project) {
    static MADE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = tempfile::tempdir().unwrap();
        let shoot = TestShoot { frames: 2, lamps: 4, ..TestShoot::default() };
        let (project, _) = shoot.calibrate(folder.path(), "project");
        project.save().unwrap();
        folder
    });
    let folder = tempfile::tempdir().unwrap();
    copy_folder(MADE.path(), folder.path());
    let project = Project::open(&folder.path().join("project")).unwrap();
    (folder, project)
}

/// Text of an error, also if it names another file than the changed one.
fn elsewhere(error: impl std::fmt::Display) -> String {
    format!("project.toml: {error}")
}

/// Everything that commands read of a project first.
fn use_project(root: &Path) -> Outcome {
    let project = Project::open(root).map_err(|e| e.to_string())?;
    let read = || {
        project.check_shoot()?;
        project.check_parts()?;
        project.clone().apply(&EnvironmentChange::default())?;
        project.environments();
        let response = Response::Srgb;
        let last = project.settings.shoot.frames.len() - 1;
        Frame::load(&project, &response, last)?;
        let reader = OlatReader::new(&project, &response, 0)?;
        reader.read(project.settings.shoot.all_lamps().len() - 1)?;
        TrackingFrames::new(&project, 0)?;
        Probes::load(&project, &Progress::silent())?;
        Calibration::load(&project)
    };
    read().map(drop).map_err(elsewhere)
}

#[test]
fn a_project_file_of_any_content_is_used_or_refused() {
    let (_folder, mut project) = made();
    let path = project.root.join("project.toml");
    let plain = std::fs::read(&path).unwrap();
    let mut framing = project::Framing::largest((32, 32));
    framing.x = 3;
    project.settings.framing.set(framing);
    project.settings.shoot.lamp_layout = vec![glam::Vec3::Y; 4];
    project.settings.shoot.dome_radius_m = Some(2.0);
    project.save().unwrap();
    let rich = std::fs::read(&path).unwrap();
    let target = Target::of_text("project", path, vec![plain, rich]);
    let measured = fuzz::run!(target, |path: &Path| use_project(path.parent().unwrap()));
    shown!(Strangers, "A `project.toml` with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn a_calibration_of_any_content_is_used_or_refused() {
    let (_folder, project) = made();
    let path = project.calibration_path();
    let sealed = std::fs::read_to_string(&path).unwrap();
    // Without the checksum line.
    let open = sealed.split_once('\n').unwrap().1.to_owned();
    let seeds = [open, sealed].map(String::into_bytes).to_vec();
    let measured = fuzz::run!(Target::of_text("calibration", path, seeds), |path: &Path| {
        let calibration = Calibration::load(&project).map_err(|e| e.to_string())?;
        calibration.warnings();
        let light = [calibration.interview_light(), calibration.learnt_light()].concat();
        assert!(light.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{light:?}");
        let name = path.display();
        let reader = OlatReader::new(&project, &calibration.response, 0);
        let olat = reader.and_then(|reader| reader.read(0)).map_err(|e| format!("{name}: {e}"))?;
        assert!(olat.pixels.iter().flatten().all(|v| v.is_finite()));
        Ok(())
    });
    shown!(Strangers, "A `calibration.toml` with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn a_manifest_of_any_content_gives_a_project_that_opens_or_none() {
    let (folder, project) = made();
    let shoot = project.shoot_path("");
    let path = shoot.join("manifest.json");
    let full = std::fs::read(&path).unwrap();
    let some = br#"{"name": "a", "frame_rate": 24, "dome_radius_m": 2.5, "camera": {"position": [0, 0, 3]},
        "probes": {"ball_center_px": [16, 16], "ball_radius_px": 12, "ball_radius_m": 0.1, "ball_position_m": [0, 0, 0]},
        "second_probes": {"ball_radius_m": 0.1, "ball_position_m": [0.3, 0, 0]}, "frames": 2, "exemplar_poses": 1,
        "tracking": {"before_lamp": [0, 2, 4]}, "bank_directions": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]],
        "hdris": [{"name": "sky", "file": "sky.exr", "front": 90}]}"#;
    let poses = project.settings.shoot.poses.len().to_string();
    let some = String::from_utf8_lossy(some).replace("\"exemplar_poses\": 1", &format!("\"exemplar_poses\": {poses}"));
    let root = folder.path().join("imported");
    let target = Target::of_text("manifest", path, vec![full, some.into_bytes(), b"{}".to_vec()]);
    let measured = fuzz::run!(target, |path: &Path| {
        scan::scan(&shoot, None);
        let settings = ImportSettings { size: 32, seed: 1, layer: None };
        let _ = std::fs::remove_dir_all(&root);
        let imported =
            import(&root, &shoot, &settings, &Progress::silent()).map_err(|e| format!("{}: {e}", path.display()))?;
        assert_eq!(Project::open(&root).unwrap(), imported);
        TrackingFrames::new(&imported, 0).map(drop).map_err(|e| e.to_string())
    });
    shown!(Strangers, "A `manifest.json` with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}
