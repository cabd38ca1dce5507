//! Shoots without mirror balls: a list of the lamps' directions is enough.

use super::*;
use footage::ImportSettings;
use virtual_stage::{StageSettings, write_shoot};

/// A shoot in `folder` and the same without balls, both imported.
fn with_and_without_balls(folder: &Path, stage: &StageSettings) -> [Project; 2] {
    let silent = Progress::silent();
    let shoot = folder.join("shoot");
    write_shoot(&shoot, stage, &silent).unwrap();
    let settings = ImportSettings { size: 32, seed: 1, layer: None };
    let with = footage::import(&folder.join("with"), &shoot, &settings, &silent).unwrap();
    let lamps = with.settings.shoot.lamps.iter().zip(&with.settings.shoot.lamp_layout);
    let lines: String = lamps.map(|(name, d)| format!("{name}.png {} {} {}\n", d.x, d.y, d.z)).collect();
    let other = folder.join("other");
    std::fs::create_dir(&other).unwrap();
    std::fs::write(other.join("dome.lp"), lines).unwrap();
    for part in ["interview", "exemplars", "interview_masks", "exemplar_masks"] {
        std::fs::rename(shoot.join(part), other.join(part)).unwrap();
    }
    let without = footage::import(&folder.join("without"), &other, &settings, &silent).unwrap();
    for part in ["interview", "exemplars", "interview_masks", "exemplar_masks"] {
        std::fs::rename(other.join(part), shoot.join(part)).unwrap();
        std::os::unix::fs::symlink(shoot.join(part), other.join(part)).unwrap();
    }
    assert!(without.settings.shoot.without_balls);
    [with, without]
}

/// Relative error of the interview's light on the first pose.
fn light_error(project: &Project, found: &Calibration, right: &Calibration) -> f32 {
    let pose = Exemplar::load(project, &right.response, 0).unwrap();
    let [found, right] = [found, right].map(|calibration| pose.relit(&calibration.interview_light()));
    let (mut off, mut all) = (0.0, 0.0);
    for ((a, b), mask) in found.pixels.iter().zip(&right.pixels).zip(&pose.mask.pixels) {
        for c in 0..3 {
            off += mask * (a[c] - b[c]).powi(2);
            all += mask * b[c].powi(2);
        }
    }
    (off / all).sqrt()
}

/// Logarithms of the energies' ratios to their median, sorted by size.
fn energy_errors(found: &Rig, right: &Rig) -> Vec<f32> {
    let lamps = found.lamps.iter().zip(&right.lamps);
    let ratios: Vec<f32> = lamps.map(|(a, b)| (a.energy[1] / b.energy[1]).ln()).collect();
    let typical = median(ratios.clone());
    let mut errors: Vec<f32> = ratios.iter().map(|ratio| (ratio - typical).abs()).collect();
    errors.sort_by(f32::total_cmp);
    errors
}

#[test]
fn a_list_of_lamps_takes_the_place_of_mirror_balls() {
    let silent = Progress::silent();
    let mut measured = Vec::new();
    for (seed, like_frames) in [(3, vec![]), (4, vec![2])] {
        let folder = tempfile::tempdir().unwrap();
        let has_pose = !like_frames.is_empty();
        let stage =
            StageSettings { frames: 8, size: 96, lamps: 20, poses: 3, seed, like_frames, ..StageSettings::default() };
        let [mut with, mut without] = with_and_without_balls(folder.path(), &stage);
        let settings = CalibrateSettings::default();
        let right = calibrate(&mut with, &settings, &silent).unwrap();
        let trial = Trial { response: right.response, exposure: 1.0 };
        let known = CalibrateSettings { trial: Some(trial), ..settings };
        let known = calibrate(&mut without, &known, &silent).unwrap();
        let error = light_error(&with, &known, &right);
        assert!(error < if has_pose { 0.02 } else { 0.08 }, "seed {seed}: light {error}");
        let energies = energy_errors(&known.rig, &right.rig);
        assert!(energies[energies.len() / 2] < 0.1, "seed {seed}: energies {energies:?}");
        assert!(energies[energies.len() - 1] < 0.8, "seed {seed}: energies {energies:?}");
        for (lamp, direction) in known.rig.lamps.iter().zip(&without.settings.shoot.lamp_layout) {
            assert!(lamp.direction == *direction && lamp.is_usable());
        }

        let fitted = calibrate(&mut without, &settings, &silent).unwrap();
        let [gamma, _] = exponents(&fitted);
        let right = 0.5 * exponents(&right).iter().sum::<f32>();
        let deviation = fitted.gamma_deviation[0];
        assert!((gamma - right).abs() < 2.5 * deviation, "seed {seed}: {gamma} ± {deviation}, {right}");
        // A curve is sure only if a frame shows a pose.
        assert_eq!(deviation < 0.3, has_pose, "seed {seed}: {deviation}");
        assert_eq!(fitted.gamma_evidence.same_poses.len(), usize::from(has_pose));
        fitted.save(&without).unwrap();
        assert_eq!(Calibration::load(&without).unwrap(), fitted);
        measured.push(format!("light {:.1} %", 100.0 * error));
    }
    test_support::shown!(Light, "A shoot has a list of lamps and no mirror balls",
        bound: "light within 8 %, 2 % if a frame shows a pose", measured: measured.join(", "));
}
