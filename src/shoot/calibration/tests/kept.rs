//! Calibration files: saved contents, and contents refused on load.

use super::*;

#[test]
fn a_calibration_of_other_lamps_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    let calibration = small_calibration();
    assert!(Calibration::load(&project).unwrap_err().for_terminal().contains("afterlight calibrate"));
    calibration.save(&project).unwrap();
    assert_eq!(Calibration::load(&project).unwrap(), calibration);
    project.settings.shoot.lamps = vec!["other".into()];
    assert!(Calibration::load(&project).unwrap_err().for_terminal().contains("afterlight calibrate"));
    project.settings.shoot.lamps = vec!["olat_00".into(), "olat_01".into()];
    assert!(Calibration::load(&project).unwrap_err().to_string().contains("2 lamps"));
}

#[test]
fn a_calibration_from_before_the_evidence_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    project.settings.shoot.lamps = vec!["olat_00".into()];
    let calibration = small_calibration();
    calibration.save(&project).unwrap();
    let text = std::fs::read_to_string(project.calibration_path()).unwrap();
    let mut table: toml::Table = toml::from_str(&text).unwrap();
    assert!(table.remove("gamma_evidence").is_some());
    std::fs::write(project.calibration_path(), table.to_string()).unwrap();
    assert_eq!(Calibration::load(&project).unwrap(), calibration);
}

#[test]
fn a_calibration_that_holds_no_numbers_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let project = small_project(folder.path());
    let sound = small_calibration();
    for broken in [
        Calibration { interview_weights: vec![[f32::NAN; 3]], ..sound.clone() },
        Calibration { exposure: f32::INFINITY, ..sound.clone() },
        Calibration { response: Response::Dual(DualGamma { gamma1: f32::NAN, gamma2: 2.0 }), ..sound.clone() },
    ] {
        broken.save(&project).unwrap();
        assert!(Calibration::load(&project).is_err());
    }
}

#[test]
fn a_shoot_without_poses_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let error = calibrate(&mut small_project(folder.path()), &CalibrateSettings::default(), &Progress::silent())
        .unwrap_err()
        .to_string();
    assert!(error.contains("lists no poses"), "{error}");
}

pub(super) fn small_project(root: &Path) -> Project {
    let mut project = Project::without_shoot(root);
    project.settings.size = 32;
    project.settings.shoot =
        Shoot { folder: PathBuf::from("shoot"), lamps: vec!["olat_00".into()], ..project.settings.shoot };
    project
}

fn small_calibration() -> Calibration {
    Calibration {
        response: Response::Dual(DualGamma { gamma1: 2.2, gamma2: 2.2 }),
        gamma_deviation: [0.05; 2],
        exposure: 1.0,
        interview_weights: vec![[0.5; 3]],
        stand_in: None,
        uncovered_energy: 0.0,
        probe_residual: 0.0,
        gamma_residual: 0.0,
        blind_share: 0.02,
        filled_energy: 0.0,
        clipped_pixels: 0,
        rig_findings: vec![],
        rig_faults: vec![],
        two_balls: None,
        by_list: false,
        motion: None,
        gamma_evidence: gamma::Evidence::default(),
        rig: Rig { lamps: vec![Lamp { energy: [0.1; 3], spread_deg: 4.0, ..Lamp::new("olat_00", Vec3::Y) }] },
    }
}
