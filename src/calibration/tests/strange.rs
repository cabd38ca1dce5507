//! Strange photographs and figures end in a result or a sentence, never in a panic.

use super::kept::small_project;
use super::*;

/// What the balls show, or why not. A result is sound: unit directions, confidences from 0 to 1.
fn outcome(project: &Project) -> std::result::Result<(), String> {
    let probes =
        Probes::load(project, &Progress::silent()).map_err(|refusal| refusal.to_string())?;
    let table = ResponseTable::of(&PROVISIONAL);
    let (rig, filled) = probes.rig(project.settings.shoot.all_lamps(), &table);
    assert!(filled.is_finite());
    for lamp in &rig.lamps {
        assert!(lamp.direction.is_normalized(), "{lamp:?}");
        assert!((0.0..=1.0).contains(&lamp.confidence), "{lamp:?}");
        assert!(lamp.energy.iter().all(|e| e.is_finite()) && lamp.spread_deg.is_finite());
    }
    assert!(probes.fit(&table).residual.is_finite());
    assert!(
        probes
            .weights(&table)
            .iter()
            .flatten()
            .all(|w| w.is_finite())
    );
    Ok(())
}

fn ball(center_px: [f32; 2], radius_px: f32) -> Ball {
    Ball {
        center_px,
        radius_px,
        radius_m: 0.05,
        camera_distance_m: 2.0,
    }
}

#[test]
fn odd_sizes_and_balls_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    let shoot = &mut project.settings.shoot;
    (shoot.poses, shoot.frames) = (vec!["pose".into()], vec!["frame".into()]);
    let mut refused = 0;
    for lamps in [1, 2, 6] {
        project.settings.shoot.lamps = (0..lamps).map(|i| format!("olat_{i:02}")).collect();
        for (width, height) in [(1, 1), (1, 40), (41, 17), (64, 64)] {
            for level in [0.0, 1.0, 0.3] {
                for (i, path) in project.probe_paths().iter().enumerate() {
                    // A lamp, on all but the even pictures.
                    let picture = Raster::from_fn(width, height, |x, y| {
                        let lamp = x.abs_diff(5 * i) < 3 && y.abs_diff(20) < 3;
                        [if level == 0.3 && lamp { 0.9 } else { level }; 3]
                    });
                    file::write_png(path, &Encoded(picture)).unwrap();
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
}

#[test]
fn figures_that_no_ball_has_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = small_project(folder.path());
    let shoot = &mut project.settings.shoot;
    (shoot.poses, shoot.frames) = (vec!["pose".into()], vec!["frame".into()]);
    for path in project.probe_paths() {
        let picture = Raster::from_fn(64, 64, |x, y| [f32::from(x + y < 40) * 0.5; 3]);
        file::write_png(&path, &Encoded(picture)).unwrap();
    }
    for (ball, dome) in [
        (ball([32.0; 2], 1e10), None),
        (ball([32.0; 2], 30.0), Some(1e39f64 as f32)),
        (ball([32.0; 2], 5.0), None),
    ] {
        project.settings.shoot.ball = ball;
        project.settings.shoot.dome_radius_m = dome;
        let sentence = outcome(&project).unwrap_err();
        assert!(sentence.contains("radius"), "{sentence}");
    }
    project.settings.shoot.lamps.clear();
    let sentence = outcome(&project).unwrap_err();
    assert!(sentence.contains("names no lamps"), "{sentence}");
}
