//! Invalid photographs and figures give a result or an error message, never a panic.

use super::kept::small_project;
use super::*;

/// Result from the balls, or the reason for a refusal. A result has unit directions and confidences from 0 to 1.
fn outcome(project: &Project) -> std::result::Result<(), String> {
    let probes = Probes::load(project, &Progress::silent()).map_err(|refusal| refusal.to_string())?;
    let table = ResponseTable::from_response(&PROVISIONAL);
    let (rig, filled) = probes.rig(project.settings.shoot.all_lamps(), &table);
    assert!(filled.is_finite());
    for lamp in &rig.lamps {
        assert!(lamp.direction.is_normalized(), "{lamp:?}");
        assert!((0.0..=1.0).contains(&lamp.confidence), "{lamp:?}");
        assert!(lamp.energy.iter().all(|e| e.is_finite()) && lamp.spread_deg.is_finite());
    }
    assert!(probes.fit(&table).residual.is_finite());
    assert!(probes.weights(&table).iter().flatten().all(|w| w.is_finite()));
    Ok(())
}

fn ball(center_px: [f32; 2], radius_px: f32) -> Ball {
    Ball { center_px, radius_px, radius_m: 0.05, camera_distance_m: 2.0 }
}

#[test]
fn odd_sizes_and_balls_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    let shoot = &mut project.settings.shoot;
    (shoot.poses, shoot.frames) = (vec!["pose".into()], vec!["frame".into()].into());
    let mut refused = 0;
    for lamps in [1, 2, 6] {
        project.settings.shoot.lamps = (0..lamps).map(|i| format!("olat_{i:02}")).collect();
        for (width, height) in [(1, 1), (1, 40), (41, 17), (64, 64)] {
            for level in [0.0, 1.0, 0.3] {
                for (i, path) in project.probe_pictures().iter().enumerate() {
                    // A lamp, on all but the uniform pictures.
                    let picture = Raster::from_fn(width, height, |x, y| {
                        let lamp = x.abs_diff(5 * i) < 3 && y.abs_diff(20) < 3;
                        [if level == 0.3 && lamp { 0.9 } else { level }; 3]
                    });
                    file::write_png(path.file(), &Encoded(picture)).unwrap();
                }
                let middle = [0.5 * width as f32, 0.5 * height as f32];
                for ball in [
                    ball(middle, 0.5 * width as f32),
                    ball(middle, 2.0 * height as f32),
                    ball([0.0, 0.0], 30.0),
                    ball([-20.0, 20.0], 21.0),
                    ball([-200.0, 20.0], 30.0),
                    ball(middle, 1e10),
                    ball([f32::NAN, 1.0], 20.0),
                ] {
                    project.settings.shoot.ball = ball;
                    for dome in [None, Some(3.0), Some(f32::INFINITY)] {
                        project.settings.shoot.dome_radius_m = dome;
                        refused += usize::from(outcome(&project).is_err());
                    }
                }
            }
        }
    }
    assert!(refused > 0);
    test_support::shown!(Light, "Black, white and tiny photographs (1×1, 1×40, 41×17) of balls beyond the frame, of 10¹⁰ pixels, at NaN; 1, 2 and 6 lamps",
 bound: "unit directions, confidences from 0 to 1, all finite", measured: format!("holds; {refused} refused"));
}

#[test]
fn figures_that_no_ball_has_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    let shoot = &mut project.settings.shoot;
    (shoot.poses, shoot.frames) = (vec!["pose".into()], vec!["frame".into()].into());
    for path in project.probe_pictures() {
        let picture = Raster::from_fn(64, 64, |x, y| [f32::from(x + y < 40) * 0.5; 3]);
        file::write_png(path.file(), &Encoded(picture)).unwrap();
    }
    for (ball, dome) in
        [(ball([32.0; 2], 1e10), None), (ball([32.0; 2], 30.0), Some(1e39f64 as f32)), (ball([32.0; 2], 5.0), None)]
    {
        project.settings.shoot.ball = ball;
        project.settings.shoot.dome_radius_m = dome;
        let sentence = outcome(&project).unwrap_err();
        assert!(sentence.contains("radius"), "{sentence}");
    }
    project.settings.shoot.lamps.clear();
    let sentence = outcome(&project).unwrap_err();
    assert!(sentence.contains("lists no lamps"), "{sentence}");
}

/// Changes the codes of the balls' photographs.
fn spoil(project: &Project, code: impl Fn(f32, f32) -> f32) {
    let mut seed = 1u64;
    for path in project.probe_pictures() {
        let picture = file::read_encoded(path.file()).unwrap().0;
        let spoilt = picture.map(|pixel| {
            pixel.map(|v| {
                seed = (seed.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
                // Uniformly distributed with mean 0 and deviation 1.
                let random = ((seed >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 12f32.sqrt();
                code(v, random).clamp(0.0, 1.0)
            })
        });
        file::write_png(path.file(), &Encoded(spoilt)).unwrap();
    }
}

/// Changes a ball's code, given a random draw.
type Spoil<'a> = &'a dyn Fn(f32, f32) -> f32;

#[test]
fn noisy_black_and_white_balls_are_refused_or_said_to_be_doubtful() {
    let curve = DualGamma { gamma1: 2.4, gamma2: 1.8 };
    let dome: Vec<Vec3> = dome().into_iter().map(|(direction, _)| direction).collect();
    let mut measured = Vec::new();
    let kinds: [(&str, Spoil); 6] = [
        ("noise of 2 % of white", &|v, random| v + 0.02 * random),
        ("of 10 %", &|v, random| v + 0.1 * random),
        ("of 40 %", &|v, random| v + 0.4 * random),
        ("noise alone", &|_, random| 0.5 + 0.5 * random),
        ("black", &|_, _| 0.0),
        ("white", &|_, _| 1.0),
    ];
    for (name, code) in kinds {
        let folder = tempfile::tempdir().unwrap();
        let mut project = small_shoot(folder.path(), &curve);
        spoil(&project, code);
        let settings = CalibrateSettings { keep_motion: true, ..CalibrateSettings::default() };
        let found = match calibrate(&mut project, &settings, &Progress::silent()) {
            Ok(found) => found,
            Err(refusal) => {
                println!("{name}: {refusal}");
                measured.push(format!("{name}: refused"));
                continue;
            }
        };
        let angles = angles_deg(&found.rig, &dome);
        let lamps = found.rig.lamps.iter().zip(&angles);
        let trusted: Vec<f32> = (lamps.filter(|(lamp, _)| lamp.confidence > 0.5)).map(|(_, angle)| *angle).collect();
        let wrong = trusted.iter().filter(|angle| **angle > 5.0).count();
        let (count, worst) = (trusted.len(), trusted.iter().copied().fold(0.0, f32::max));
        let off = [0, 1].map(|i| {
            let truth = [curve.gamma1, curve.gamma2][i];
            (exponents(&found)[i] - truth).abs() / found.gamma_deviation[i]
        });
        println!(
            "{name}: {count} trusted, {wrong} wrong, at most {worst:.2}°; γ off by {off:.2?} deviations {:?}; {:?}",
            found.gamma_deviation, found.rig_findings
        );
        assert!(found.rig.lamps.iter().all(|l| l.energy.iter().all(|e| e.is_finite() && *e >= 0.0)));
        assert!(found.interview_weights.iter().flatten().all(|w| w.is_finite() && *w >= 0.0));
        assert!(wrong == 0, "{name}: {angles:?}");
        assert!(off.iter().all(|off| *off < 3.0), "{name}: {off:?}");
        let balls_show_nothing = ["noise alone", "black", "white"].contains(&name);
        assert!(!balls_show_nothing || count == 0, "{name}: {count} trusted");
        measured.push(format!("{name}: {count} of 14 trusted, {worst:.1}° off at most"));
    }
    test_support::shown!(Light, "Mirror balls under noise, of noise alone, black, white",
        bound: "no lamp with confidence above 0.5 is off by 5°; none is trusted on empty balls; γ within three deviations",
        measured: measured.join("; "));
}
