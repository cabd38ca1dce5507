//! Calibration workspaces, driven with the mouse only and with keys only.

use super::{SHOOT, Window, lines_with, plain_drag, scroll_to, snapshot, snapshot_without, until, window};
use afterlight::calibration::Calibration;
use afterlight::gpu::DeviceChoice;
use afterlight::imaging::Response;
use afterlight::project::Project;
use afterlight::studio::StudioApp;
use afterlight::worker::{GammaView, ProbeView};
use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use std::path::Path;
use std::sync::Arc;

fn imported(folder: &Path) -> Project {
    SHOOT.import(folder, "project")
}

fn calibrated(folder: &Path) -> Project {
    SHOOT.calibrate(folder, "project").0
}

fn opened(project: &Project) -> Window {
    let project = project.clone();
    window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu))
}

fn study(window: &Window) -> Arc<ProbeView> {
    window.state().analysis().probe.clone().unwrap().unwrap()
}

fn view(window: &Window) -> Arc<GammaView> {
    window.state().analysis().gamma.clone().unwrap().unwrap()
}

/// Waits for the analysis of the current circle.
fn until_studied(window: &mut Window) {
    window.run_steps(2);
    until(window, "mirror ball", |app| {
        let study = app.analysis().probe.as_ref().and_then(|s| s.as_ref().ok());
        study.is_some_and(|s| {
            let state = app.state();
            (state.look.circle.unwrap_or(s.kept), state.shoot.photograph) == (s.circle, s.photograph)
        })
    });
    window.run_steps(2);
}

/// Waits for the fit of the current trial response.
fn until_tried(window: &mut Window) {
    window.run_steps(2);
    until(window, "relit exemplar", |app| {
        let view = app.analysis().gamma.as_ref().and_then(|v| v.as_ref().ok());
        view.is_some_and(|v| {
            app.state().look.trial.unwrap_or(v.calibrated) == v.trial && app.state().shoot.pose == v.pose
        })
    });
    window.run_steps(2);
}

fn until_calibrated(window: &mut Window) {
    window.run_steps(2);
    until(window, "end of the calibration", |app| app.status().job.is_none() && app.status().message.is_some());
}

#[test]
fn the_ball_s_circle_is_dragged_found_and_kept() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let mut window = opened(&project);
    window.get_by_label("Workspace Calibrate").click();
    until_studied(&mut window);
    let kept = study(&window).kept;
    assert!(study(&window).lamps.iter().all(|l| l.on_ball.is_some()));

    // The rim in the fitted picture.
    let place = window.get_by_label("Mirror ball").rect();
    let scale = (place.size() - vec2(32.0, 32.0)).min_elem() / 64.0;
    let offset = vec2(kept.radius_px as f32, 0.0) * scale;
    let center = place.center() + vec2(kept.center_px[0] as f32 - 32.0, kept.center_px[1] as f32 - 32.0) * scale;
    let out = vec2(4.0 * scale, 0.0);
    plain_drag(&mut window, center + offset, center + offset + out);
    until_studied(&mut window);
    let wide = study(&window);
    assert!((wide.circle.radius_px - kept.radius_px - 4.0).abs() < 0.3, "{:?}", wide.circle);
    plain_drag(&mut window, center, center + out);
    until_studied(&mut window);
    let moved = study(&window).circle;
    assert!((moved.center_px[0] - kept.center_px[0] - 4.0).abs() < 0.3, "{moved:?}");
    // A circle off the ball gives other lamp directions, and no rim.
    let turned = |study: &ProbeView, other: &ProbeView| {
        let pairs = study.lamps.iter().zip(&other.lamps);
        pairs.map(|(a, b)| a.lamp.direction.angle_between(b.lamp.direction)).fold(0.0, f32::max)
    };
    assert!(turned(&study(&window), &wide) > 0.05);

    window.get_by_label("Find").click();
    until_studied(&mut window);
    let found = study(&window);
    assert!((found.circle.radius_px - kept.radius_px).abs() < 0.5, "{:?}", found.circle);
    assert!(found.rim.as_ref().unwrap().rim_share > 0.5);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_studied(&mut window);
    assert_eq!(study(&window).circle, moved);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    until_studied(&mut window);

    window.get_by_label("Calibrate").click();
    until_calibrated(&mut window);
    let kept = Project::open(&project.root).unwrap().settings.shoot.ball;
    assert!((f64::from(kept.radius_px) - found.circle.radius_px).abs() < 1e-4);
}

#[test]
fn keys_alone_set_the_circle_and_show_each_lamp() {
    let folder = crate::temporary();
    let mut window = opened(&calibrated(folder.path()));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    until_studied(&mut window);
    let kept = study(&window).kept;
    window.key_press(Key::ArrowRight);
    window.key_press(Key::ArrowDown);
    window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowDown);
    window.key_press(Key::Plus);
    until_studied(&mut window);
    let circle = study(&window).circle;
    let differences = [
        circle.center_px[0] - kept.center_px[0] - 1.0,
        circle.center_px[1] - kept.center_px[1] - 1.1,
        circle.radius_px - kept.radius_px - 1.0,
    ];
    assert!(differences.iter().all(|d| d.abs() < 1e-6), "{differences:?}");
    window.get_by_label("Three points").click();
    window.run_steps(2);
    window.get_by_label("Click point 1 of 3");
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.get_by_label("Three points");
    let interview = study(&window).picture.clone();
    window.key_press(Key::PageDown);
    window.run_steps(2);
    until(&mut window, "lamp's ball", |app| {
        let study = app.analysis().probe.as_ref().and_then(|s| s.as_ref().ok());
        study.is_some_and(|s| s.picture != interview)
    });
    assert_eq!(window.state().state().shoot.photograph, Some(0));
    window.key_press(Key::PageUp);
    window.run_steps(2);
    assert_eq!(window.state().state().shoot.photograph, None);
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    until_studied(&mut window);
    assert_eq!(study(&window).circle, kept);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    until_calibrated(&mut window);
}

#[test]
fn a_response_is_tried_wiped_and_kept() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let mut window = opened(&project);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.get_by_label("Gamma").click();
    until_tried(&mut window);
    let first = view(&window);
    assert!(first.interview_histogram.iter().all(|h| h.iter().sum::<u32>() > 100));
    window.key_press(Key::ArrowRight);
    window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowUp);
    until_tried(&mut window);
    let tried = view(&window);
    let gamma1 = tried.trial.response.exponents().unwrap()[0] - first.calibrated.response.exponents().unwrap()[0];
    let gamma2 = tried.trial.response.exponents().unwrap()[1] - first.calibrated.response.exponents().unwrap()[1];
    assert!((gamma1 - 0.02).abs() < 1e-4 && (gamma2 - 0.001).abs() < 1e-4, "{gamma1}, {gamma2}");

    // A drag to a point of the surface far from the optimum: the picture changes, and fits worse.
    let surface = window.get_by_label("Loss surface").rect();
    let far = surface.lerp_inside(vec2(0.9, 0.1));
    plain_drag(&mut window, surface.center(), far);
    until_tried(&mut window);
    let worse = view(&window);
    assert!(worse.trial.response.exponents().unwrap()[0] > 3.0, "{:?}", worse.trial);
    assert_ne!(worse.relit, first.relit);
    assert!(worse.subject_distance.hypot(worse.ball_distance) > first.subject_distance.hypot(first.ball_distance));

    let picture = window.get_by_label("Interview and relit pose").rect();
    plain_drag(&mut window, picture.center(), Pos2::new(0.0, picture.center().y));
    assert_eq!(window.state().state().viewport.wipe, 0.0);
    window.key_press(Key::W);
    window.run_steps(2);
    assert_eq!(window.state().state().viewport.wipe, 0.5);

    scroll_to(&mut window, "Reset");
    window.get_by_label("Reset").click();
    until_tried(&mut window);
    assert_eq!(view(&window).trial, first.calibrated);

    let choose = |window: &mut Window, list: &str, entry: &str| {
        window.get_by_role_and_label(Role::ComboBox, list).click();
        window.run_steps(4);
        window.get_by_label_contains(entry).click();
        until_tried(window);
    };
    choose(&mut window, "Pose", "pose01");
    assert_eq!(view(&window).pose, 1);
    assert_ne!(view(&window).relit.rgb, first.relit.rgb);
    choose(&mut window, "Curve", "sRGB:");
    assert_eq!(view(&window).trial.response, Response::Srgb);
    assert!(view(&window).ball_distance > first.ball_distance);
    window.get_by_label("Reset").click();
    until_tried(&mut window);

    window.key_press(Key::ArrowLeft);
    until_tried(&mut window);
    let wanted = view(&window).trial;
    window.get_by_label("Use this").click();
    until_calibrated(&mut window);
    let kept = Calibration::load(&project).unwrap();
    assert_eq!((kept.response, kept.exposure), (wanted.response, wanted.exposure));
}

#[test]
fn the_calibration_s_workspaces_look_as_they_did() {
    let folder = crate::temporary();
    let mut window = opened(&calibrated(folder.path()));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    until_studied(&mut window);
    window.key_press(Key::PageDown);
    window.run_steps(2);
    until_studied(&mut window);
    snapshot(&mut window, "studio_probe");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.get_by_label("Gamma").click();
    until_tried(&mut window);
    snapshot(&mut window, "studio_gamma");
}

#[test]
fn what_keeps_a_workspace_empty_is_said_there() {
    let folder = crate::temporary();
    let project = imported(folder.path());
    std::fs::write(project.interview_probe_picture(), b"no picture").unwrap();
    let mut window = opened(&project);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.get_by_label("Gamma").click();
    window.run_steps(2);
    until(&mut window, "reason", |app| matches!(app.analysis().gamma.as_ref(), Some(Err(_))));
    window.run_steps(2);
    window.get_by_label_contains("Not calibrated yet");
    assert!(window.query_by_label_contains("afterlight ").is_none());
    let places = lines_with(&window, "Not calibrated yet", 370.0, 910.0);
    snapshot_without(&mut window, "studio_gamma_error", &places);
    window.get_by_label("Probe").click();
    window.run_steps(2);
    until(&mut window, "reason", |app| matches!(app.analysis().probe.as_ref(), Some(Err(_))));
    window.run_steps(2);
    window.get_by_label_contains("interview.png");
    let places = lines_with(&window, "interview.png", 370.0, 910.0);
    snapshot_without(&mut window, "studio_probe_error", &places);
}
