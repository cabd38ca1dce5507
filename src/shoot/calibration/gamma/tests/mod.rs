mod doubt;
mod small_shoot;
mod study;

use super::*;
use project::{Ball, Project, Settings};
use small_shoot::{SmallShoot, dual};
use std::path::Path;

fn fitted(settings: &SmallShoot, wanted: Option<Comparison>) -> GammaFit {
    let (subject, probes) = settings.load();
    fit(&subject, &probes, wanted, &Progress::silent()).unwrap().fit
}

/// Errors of the exponents.
fn off(fit: &GammaFit, [gamma1, gamma2]: [f32; 2]) -> [f32; 2] {
    let off = [fit.response.gamma1 - gamma1, fit.response.gamma2 - gamma2];
    println!(
        "γ ({gamma1:.3}, {gamma2:.3}) by {:?}: off {off:.3?} ± {:.3?}; exposure {:.3}; residuals {:.4}, {:.4}",
        fit.comparison, fit.deviation, fit.exposure, fit.residual, fit.ball_residual
    );
    off
}

/// Warnings of a calibration with this fit.
fn warnings(fit: &GammaFit) -> Vec<String> {
    let shoot = SmallShoot::default().project(Path::new("nowhere")).settings.shoot;
    Evidence::new(fit, &shoot).warnings([fit.deviation[0], fit.deviation[1]], fit.exposure)
}

#[test]
fn the_truth_lies_within_two_deviations() {
    let truths = [[2.5, 1.9], [2.0, 2.3], [2.2, 2.2], [2.8, 2.0], [1.8, 1.8], [1.5, 2.6], [2.6, 2.1], [3.0, 2.4]];
    let mut within = 0;
    for (i, [gamma1, gamma2]) in truths.into_iter().enumerate() {
        let fit =
            fitted(&SmallShoot { response: dual(gamma1, gamma2), seed: 10 + i as u32, ..SmallShoot::default() }, None);
        let off = off(&fit, [gamma1, gamma2]);
        assert!(warnings(&fit).is_empty(), "{:?}", warnings(&fit));
        for (off, deviation) in off.into_iter().zip(fit.deviation) {
            // Wide bars would make the count worthless.
            assert!(deviation < 0.1 && off.abs() < 0.1);
            within += usize::from(off.abs() <= 2.0 * deviation);
        }
    }
    // One of sixteen is expected outside.
    assert!(within >= 14, "{within} of 16");
}

#[test]
fn a_frame_that_shows_a_pose_is_compared_pixel_by_pixel() {
    let settings = SmallShoot { turn: 0.0, ..SmallShoot::default() };
    let fit = fitted(&settings, None);
    assert!(off(&fit, [2.5, 1.9]).iter().all(|off| off.abs() < 0.03));
    assert_eq!(fit.comparison, Comparison::Pixels);
    assert_eq!(fit.same_poses, [[0, 0], [1, 1], [2, 2], [3, 3]]);
    let asked = fitted(&settings, Some(Comparison::Distribution));
    assert_eq!((asked.comparison, asked.same_poses.len()), (Comparison::Distribution, 0));
}

#[test]
fn pixels_of_other_poses_are_not_compared() {
    let (subject, probes) = SmallShoot::default().load();
    let fit = |wanted| fit(&subject, &probes, wanted, &Progress::silent());
    assert_eq!(fit(None).unwrap().fit.comparison, Comparison::Distribution);
    let Err(error) = fit(Some(Comparison::Pixels)) else {
        panic!("no frame shows a pose");
    };
    assert!(error.to_string().contains("Compare distributions"), "{error}");
}

#[test]
fn the_virtual_stage_is_fitted_to_0_03_by_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let settings = virtual_stage::StageSettings {
        frames: 1,
        size: 64,
        seed: 5,
        lamps: 10,
        ..virtual_stage::StageSettings::default()
    };
    let shoot = folder.path().join("shoot");
    virtual_stage::write_shoot(&shoot, &settings, &Progress::silent()).unwrap();
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(shoot.join(name)).unwrap()).unwrap()
    };
    let (manifest, truth) = (json("manifest.json"), json("truth.json"));
    let number = |value: &serde_json::Value| value.as_f64().unwrap() as f32;
    // The stage also photographs its poses under the interview's light; here they serve as frames.
    for pose in ["pose00", "pose03"] {
        let taken = format!("truth/{pose}_under_interview_light_black_bg.png");
        let frame = format!("interview/{pose}.png");
        let (mask, frame_mask) = (format!("exemplar_masks/{pose}.png"), format!("interview_masks/{pose}.png"));
        std::fs::copy(shoot.join(taken), shoot.join(frame)).unwrap();
        std::fs::copy(shoot.join(mask), shoot.join(frame_mask)).unwrap();
    }
    let ball = &manifest["probes"];
    let project = Project {
        root: folder.path().to_path_buf(),
        results: None,
        settings: Settings {
            format: project::FORMAT,
            name: "stage".into(),
            size: 64,
            seed: 1,
            shoot: Shoot {
                folder: "shoot".into(),
                frame_rate: 24.0,
                without_balls: false,
                layer: None,
                corrections: project::Corrections::default(),
                poses: (0..6).map(|i| format!("pose{i:02}")).collect(),
                lamps: (0..10).map(|i| format!("olat_{i:02}")).collect(),
                other_lamps: vec![],
                frames: ["frame_000", "pose00", "pose03"].map(String::from).to_vec().into(),
                damaged_frames: Default::default(),
                takes: Default::default(),
                ball: Ball {
                    center_px: [0, 1].map(|i: usize| number(&ball["ball_center_px"][i])),
                    radius_px: number(&ball["ball_radius_px"]),
                    radius_m: number(&ball["ball_radius_m"]),
                    camera_distance_m: number(&manifest["camera"]["position"][2]),
                },
                second_ball: None,
                dome_radius_m: Some(number(&manifest["dome_radius_m"])),
                environments: vec![],
                lamp_layout: vec![],
            },
            environments: vec![],
            color_config: None,
            framing: Default::default(),
        },
    };
    let probes = Probes::load(&project, &Progress::silent()).unwrap();
    let subject = Subject::load(&project, &probes, &Progress::silent()).unwrap();
    let fit = fit(&subject, &probes, None, &Progress::silent()).unwrap().fit;
    let off = off(&fit, [number(&truth["g1"]), number(&truth["g2"])]);
    assert!(off.iter().all(|off| off.abs() < 0.03));
    assert_eq!(fit.same_poses, [[0, 1], [3, 2]]);
}
