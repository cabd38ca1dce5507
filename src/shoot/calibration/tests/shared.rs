//! The shared shoot of a real head scan, compared with ground truth.

use super::*;

/// The shared shoot of a real head scan, rendered by other software; None if it is missing, and the test returns.
pub(crate) fn shared_shoot(probes: &str) -> Option<(Project, tempfile::TempDir, serde_json::Value, Vec<Vec3>)> {
    let folder = test_support::shared("data/stage")?;
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(folder.join(name)).unwrap()).unwrap()
    };
    let (manifest, truth) = (read("manifest.json"), read("truth.json"));
    let number = |value: &serde_json::Value| value.as_f64().unwrap() as f32;
    let names = |what: &str, digits: usize, n: &serde_json::Value| -> Vec<String> {
        (0..n.as_u64().unwrap()).map(|i| format!("{what}{i:0digits$}")).collect()
    };
    let probe = &manifest["probes"];
    let home = tempfile::tempdir().unwrap();
    let mut project = Project::without_shoot(home.path());
    project.settings.size = 128;
    project.settings.shoot = Shoot {
        folder: std::fs::canonicalize(&folder).unwrap(),
        poses: names("pose", 2, &manifest["exemplar_poses"]),
        lamps: names("olat_", 2, &manifest["olat_conditions"]),
        frames: names("frame_", 3, &manifest["frames"]).into(),
        ball: Ball {
            center_px: [0, 1].map(|i: usize| number(&probe["ball_center_px"][i])),
            radius_px: number(&probe["ball_radius_px"]),
            radius_m: number(&probe["ball_radius_m"]),
            camera_distance_m: number(&manifest["camera"]["position"][2]),
        },
        dome_radius_m: Some(number(&manifest["dome_radius_m"])),
        ..project.settings.shoot
    };
    let directions = manifest["bank_directions"].as_array().unwrap();
    let directions = directions.iter().map(|d| Vec3::from_array([0, 1, 2].map(|c| number(&d[c])))).collect();
    if probes == "probes" {
        return Some((project, home, truth, directions));
    }
    // The same shoot with other ball photographs.
    let shoot = home.path().join("shoot");
    std::fs::create_dir(&shoot).unwrap();
    for name in ["exemplars", "exemplar_masks", "interview", "interview_masks"] {
        std::os::unix::fs::symlink(project.shoot_path(name), shoot.join(name)).unwrap();
    }
    std::os::unix::fs::symlink(project.shoot_path(probes), shoot.join("probes")).unwrap();
    project.settings.shoot.folder = "shoot".into();
    Some((project, home, truth, directions))
}

/// Prints angles and weights against the truth; returns their medians and γ's errors.
fn judge(found: &Calibration, truth: &serde_json::Value, directions: &[Vec3]) -> (f32, f32, [f32; 2]) {
    let number = |value: &serde_json::Value| value.as_f64().unwrap() as f32;
    let angles = angles_deg(&found.rig, directions);
    let weights = &truth["weights_linear_interview_per_olat"];
    let errors: Vec<f32> = (found.interview_weights.iter().enumerate())
        .flat_map(|(i, w)| [0, 1, 2].map(|c| (w[c] / number(&weights[i][c]) - 1.0).abs()))
        .collect();
    let gamma = [exponents(found)[0] - number(&truth["g1"]), exponents(found)[1] - number(&truth["g2"])];
    println!(
        "γ ({:.3}, {:.3}) ± {:.3?}, off by {gamma:.3?}; exposure {:.3}; residuals: quantiles {:.4}, probe {:.4}; \
         uncovered {:.4}; blind {:.3}; filled {:.4}; clipped {}",
        exponents(found)[0],
        exponents(found)[1],
        found.gamma_deviation,
        found.exposure,
        found.gamma_residual,
        found.probe_residual,
        found.uncovered_energy,
        found.blind_share,
        found.filled_energy,
        found.clipped_pixels,
    );
    println!(
        "lamp directions: median {:.3}°, worst {:.2}°; weights: median {:.2} %, worst {:.2} %; least confident {:?}",
        median(angles.clone()),
        angles.iter().copied().fold(0.0, f32::max),
        100.0 * median(errors.clone()),
        100.0 * errors.iter().copied().fold(0.0, f32::max),
        found.rig.lamps.iter().min_by(|a, b| a.confidence.total_cmp(&b.confidence)).map(|l| (&l.name, l.confidence)),
    );
    (median(angles), median(errors), gamma)
}

#[test]
fn the_shared_shoot_is_calibrated() {
    let Some((mut project, _home, truth, directions)) = shared_shoot("probes") else { return };
    let start = std::time::Instant::now();
    let found = calibrate(&mut project, &CalibrateSettings::default(), &Progress::silent()).unwrap();
    println!("calibrated in {:.1} s", start.elapsed().as_secs_f32());
    let (angle, weight, gamma) = judge(&found, &truth, &directions);
    assert!(angle <= 0.5 && weight <= 0.02 && gamma.iter().all(|g| g.abs() <= 0.1));
}

#[test]
fn a_changed_exposure_of_the_shared_shoot_is_found() {
    let Some((mut project, home, truth, _)) = shared_shoot("probes") else { return };
    let gamma = |key: &str| truth[key].as_f64().unwrap() as f32;
    let response = DualGamma::new(gamma("g1"), gamma("g2")).unwrap();
    let shoot = home.path().join("brighter");
    std::fs::create_dir(&shoot).unwrap();
    for name in ["exemplars", "exemplar_masks", "interview_masks", "probes"] {
        std::os::unix::fs::symlink(project.shoot_path(name), shoot.join(name)).unwrap();
    }
    // Every fifth frame, filmed 20 % brighter.
    project.settings.shoot.frames =
        project.settings.shoot.frames.names().step_by(5).map(Into::into).collect::<Vec<String>>().into();
    for (i, name) in project.settings.shoot.frames.names().enumerate() {
        let light = response.decode(&file::read_encoded(project.frame_picture(i).file()).unwrap());
        let brighter = light.map(|pixel| pixel.map(|l| 1.2 * l));
        let path = shoot.join(format!("interview/{name}.png"));
        file::write_png(&path, &response.encode(&brighter)).unwrap();
    }
    project.settings.shoot.folder = "brighter".into();
    let found = calibrate(&mut project, &CalibrateSettings::default(), &Progress::silent()).unwrap();
    let off = [exponents(&found)[0] - response.gamma1, exponents(&found)[1] - response.gamma2];
    println!("off {off:.3?} ± {:.3?}; exposure {:.3}", found.gamma_deviation, found.exposure);
    assert!(off.iter().all(|off| off.abs() < 0.1) && (found.exposure - 1.2).abs() < 0.1);
    assert!(found.gamma_evidence.changed_exposure > 0.5);
    assert!(found.warnings().iter().any(|w| w.contains("brighter than the mirror balls say")));
}

#[test]
fn clipped_balls_are_counted_and_leave_directions_trusted() {
    let Some((mut project, _home, truth, directions)) = shared_shoot("probes_hot") else { return };
    let found = calibrate(&mut project, &CalibrateSettings::default(), &Progress::silent()).unwrap();
    let (angle, weight, gamma) = judge(&found, &truth, &directions);
    assert!(angle <= 2.5 && weight <= 0.05 && gamma.iter().all(|g| g.abs() <= 0.15));
    assert!(found.clipped_pixels > 1000 && found.rig.lamps.iter().all(|lamp| lamp.clipped > 0.5));
    // The truth is within two deviations here too.
    for (off, deviation) in gamma.iter().zip(found.gamma_deviation) {
        assert!(off.abs() < 2.0 * deviation, "{off} ± {deviation}");
    }
    let trusted = found.rig.lamps.iter().filter(|lamp| lamp.confidence > 0.5);
    assert!(trusted.count() >= 40);
    let Some((plain, ..)) = shared_shoot("probes") else { return };
    let probes = Probes::load(&plain, &Progress::silent()).unwrap();
    let plain = probes.lamps(plain.settings.shoot.all_lamps(), &found.response);
    let apart: Vec<f32> = (found.rig.lamps.iter().zip(&plain))
        .map(|(hot, plain)| hot.direction.angle_between(plain.direction).to_degrees())
        .collect();
    let worst = apart.iter().copied().fold(0.0, f32::max);
    println!("clipped and not: {:.2}° apart in the median, {worst:.2}° at most", median(apart.clone()));
    // Except lamps reported as touching the cone behind the ball, whose directions are estimates.
    let is_estimate = |lamp: &Lamp| {
        let behind = |sentence: &String| sentence.contains("behind the mirror ball") && sentence.contains(&lamp.name);
        found.rig_findings.iter().any(behind)
    };
    assert!(plain.iter().filter(|lamp| is_estimate(lamp)).count() <= 4);
    for (lamp, apart) in plain.iter().zip(apart) {
        let bound = if is_estimate(lamp) { 1.5 } else { 1.0 };
        assert!(apart <= bound, "{} {}: {apart:.2}°", lamp.name, lamp.confidence);
    }
    assert!(found.warnings().iter().any(|w| w.contains("clipped")));
    test_support::shown!(Light, "A calibration from balls with every lamp clipped",
 bound: "directions to 2.5° and weights to 5 % in the median; γ within two of its deviations",
 measured: format!("{angle:.2}°, {:.1} %", 100.0 * weight));
}
