//! Review panels: their texts, their clicks, and their saved verdicts.

use super::{
    Window, clay, click_at, click_on, export, lines_with, plain_drag, snapshot, snapshot_without, until,
    until_labelled, until_shown, vulkan_adapter, window,
};
use afterlight::evaluation::review::{Case, Mark, Marks, Metric, Review};
use afterlight::project::Project;
use afterlight::studio::{CellPicture, Pane, StudioApp, Thumbnail};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const LAMPS: usize = 24;

/// A project measured on two frames and a pose, with figures that distinguish every cell.
fn measured(project: &Project) {
    let cases = [("frame", 2, "frame_002", false), ("frame", 5, "frame_005", false), ("pose", 0, "pose00", true)];
    let cases: Vec<serde_json::Value> = (cases.iter().enumerate())
        .map(|(row, &(kind, number, name, seen))| {
            let cell = |lamp: usize| {
                let flip = 0.02 + 0.012 * ((lamp * 7 + row * 11) % LAMPS) as f64;
                let flip = if seen { 0.3 * flip } else { flip };
                serde_json::json!({
                    "flip": flip, "psnr_db": 40.0 - 60.0 * flip, "ssim": 1.0 - flip
                })
            };
            let cells: Vec<_> = (0..LAMPS).map(cell).collect();
            serde_json::json!({
                "case": { kind: number }, "name": name, "seen": seen, "scale": 1.0, "cells": cells
            })
        })
        .collect();
    let review = serde_json::json!({
        "format": 1,
        "basis": { "network": "", "calibration": "", "shoot": "" },
        "truth": null,
        "training_steps": 1200,
        "training_seconds": 600.0,
        "lamps": project.settings.shoot.lamps,
        "cases": cases,
    });
    std::fs::write(project.measured_path(), review.to_string()).unwrap();
}

/// A shoot of clay.
fn clay_project(folder: &Path) -> Project {
    let project = clay::project(folder, clay::environments(folder));
    project.save().unwrap();
    project
}

/// The review of a project, once its frame is drawn under every lamp.
fn opened(project: &Project) -> Window {
    let project = project.clone();
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    until_shown(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    window.run_steps(2);
    until(&mut window, "review", |app| app.review().saved.is_some() && app.review().sheet.is_some());
    window
}

pub fn measured_window(folder: &Path) -> (Project, Window) {
    let project = clay_project(folder);
    measured(&project);
    let window = opened(&project);
    (project, window)
}

/// Position of a lamp in a row of the error map.
fn in_map(window: &Window, row: usize, lamp: usize) -> Pos2 {
    let map = window.get_by_label("FLIP by lamp and frame").rect();
    let column = (map.width() - 86.0) / LAMPS as f32;
    map.min + vec2(86.0 + (lamp as f32 + 0.5) * column, 40.0 + (row as f32 + 0.5) * 18.0)
}

#[test]
fn a_click_on_a_lamp_shows_it_alone_and_with_ctrl_beside_others() {
    let folder = crate::temporary();
    let (_, mut window) = measured_window(folder.path());
    let lamp = |window: &Window, name: &str| {
        let found = window.get_by_role_and_label(Role::Button, name);
        found.rect().center()
    };
    let places = ["lamp 7", "lamp 3"].map(|name| lamp(&window, name));
    click_at(&mut window, places[0], Modifiers::NONE);
    assert_eq!(window.state().state().solo, [7]);
    click_at(&mut window, places[1], Modifiers::COMMAND);
    assert_eq!(window.state().state().solo, [3, 7]);
    click_at(&mut window, places[1], Modifiers::NONE);
    assert_eq!(window.state().state().solo, [3]);
    click_at(&mut window, places[1], Modifiers::NONE);
    assert!(window.state().state().solo.is_empty(), "the second click ends it");
    click_at(&mut window, places[0], Modifiers::NONE);
    window.get_by_label("All lamps").click();
    window.run_steps(2);
    assert!(window.state().state().solo.is_empty());
    assert_eq!(window.state().review().sheet.as_ref().unwrap().as_ref().unwrap().lamps.len(), LAMPS);
}

#[test]
fn a_cell_is_found_looked_at_and_marked() {
    let folder = crate::temporary();
    let (project, mut window) = measured_window(folder.path());
    let at = in_map(&window, 1, 10);
    click_at(&mut window, at, Modifiers::NONE);
    let state = window.state().state();
    assert_eq!((state.frame, &state.solo[..]), (5, &[10][..]));
    window.get_by_label("frame_005, lamp 10");

    window.get_by_label("Bad").click();
    window.run_steps(2);
    window.get_by_label("Note").focus();
    window.run_steps(2);
    window.event(Event::Text("the chin's shadow".to_owned()));
    window.run_steps(3);
    let marks_of = |project: &Project| Marks::load(project).unwrap();
    let started = Instant::now();
    while marks_of(&project).get("frame_005", "olat_10").is_none_or(|m| m.note.is_empty()) {
        assert!(started.elapsed() < test_support::PATIENCE);
        window.step();
    }
    let kept = marks_of(&project);
    let marked = kept.get("frame_005", "olat_10").unwrap();
    assert_eq!((marked.mark, marked.note.as_str()), (Some(Mark::Bad), "the chin's shadow"));

    // The other metric puts other cells first.
    window.get_by_label("PSNR").click();
    window.run_steps(2);
    window.get_by_label("PSNR by lamp and frame");
    let worst = window.state().review().saved.as_ref().unwrap().as_ref().unwrap().review.clone().unwrap();
    let (case, lamp) = worst.worst(Metric::Psnr)[0];
    let name = format!("{}, lamp {lamp}:", worst.cases[case].name);
    // It is below the visible part of the pane.
    window.get_by_label_contains(&name).click_accesskit();
    window.run_steps(3);
    assert_eq!(window.state().state().solo, [lamp]);
}

/// The last measurement.
fn measurement(window: &Window) -> Arc<Review> {
    window.state().review().measured().unwrap().clone()
}

/// Label of a case in the strip.
fn in_strip(review: &Review, (case, mean): (usize, f64)) -> String {
    let figure = Metric::Flip.text(mean);
    format!("{}: mean FLIP {figure}", review.cases[case].name)
}

/// Waits until a cell's verdict is on disk.
fn until_marked(window: &mut Window, project: &Project, (case, lamp): (&str, &str), mark: Mark) {
    let started = Instant::now();
    let on_disk = || {
        let marks = Marks::load(project).unwrap();
        marks.get(case, lamp).and_then(|marked| marked.mark)
    };
    while on_disk() != Some(mark) {
        assert!(started.elapsed() < test_support::PATIENCE, "no {mark:?}");
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
}

#[test]
fn keys_mark_the_chosen_cell_and_lead_to_the_next_worst() {
    let folder = crate::temporary();
    let (project, mut window) = measured_window(folder.path());
    let cell = (1, 10);
    let choose = |window: &mut Window| {
        let at = in_map(window, cell.0, cell.1);
        click_at(window, at, Modifiers::NONE);
        assert_eq!(window.state().state().review.chosen, Some(cell));
    };
    choose(&mut window);
    assert_eq!(window.state().state().panes.active, Pane::Review);
    for (key, mark) in [(Key::Num1, Mark::Good), (Key::Num2, Mark::Doubtful), (Key::Num3, Mark::Bad)] {
        window.key_press(key);
        until_marked(&mut window, &project, ("frame_005", "olat_10"), mark);
        let state = window.state().state();
        assert_eq!(state.review.chosen, Some(cell), "the selection stays");
        assert_eq!(state.viewport.view.zoom, 1.0, "1 does not zoom here");
    }
    // Digits in a note are not verdicts.
    window.get_by_label("Note").focus();
    window.run_steps(2);
    window.key_press(Key::Num1);
    window.run_steps(2);
    let verdict = |window: &Window, (case, lamp): (usize, usize)| {
        let review = measurement(window);
        let marks = &window.state().review().marks;
        let marked = marks.get(&review.cases[case].name, &review.lamps[lamp]);
        marked.and_then(|marked| marked.mark)
    };
    assert_eq!(verdict(&window, cell), Some(Mark::Bad));

    let order = measurement(&window).worst(Metric::Flip);
    let place = order.iter().position(|&one| one == cell).unwrap();
    let goes = |window: &mut Window, to: usize| {
        window.run_steps(3);
        assert_eq!(window.state().state().review.chosen, Some(order[place + to]));
    };
    choose(&mut window);
    window.key_press(Key::N);
    goes(&mut window, 1);
    window.key_press(Key::Num2);
    goes(&mut window, 1);
    assert_eq!(verdict(&window, order[place + 1]), Some(Mark::Doubtful));
    window.get_by_label("Next worst").click_accesskit();
    goes(&mut window, 2);
    // Cells with a verdict are skipped.
    choose(&mut window);
    window.key_press(Key::N);
    goes(&mut window, 2);
}

#[test]
fn the_strip_has_the_worst_first_and_leads_to_its_worst_lamp() {
    let folder = crate::temporary();
    let (_, mut window) = measured_window(folder.path());
    let review = measurement(&window);
    let order = review.worst_cases(Metric::Flip);
    let lefts = order.iter().map(|&case| {
        let name = in_strip(&review, case);
        window.get_by_label(&name).rect().left()
    });
    let lefts: Vec<f32> = lefts.collect();
    assert!(lefts.windows(2).all(|pair| pair[0] < pair[1]), "{lefts:?}");
    let pictures = order.iter().map(|&(case, _)| match review.cases[case].case {
        Case::Frame(frame) => Thumbnail::Frame(frame),
        Case::Pose(pose) => {
            let lamp = review.worst_lamp(Metric::Flip, case).unwrap();
            Thumbnail::Olat { pose, lamp }
        }
    });
    let pictures: Vec<Thumbnail> = pictures.collect();
    assert_eq!(window.state().footage().wanted(Pane::Review), pictures);
    for &(case, mean) in &order {
        let name = in_strip(&review, (case, mean));
        window.get_by_label(&name).click_accesskit();
        window.run_steps(3);
        let lamp = review.worst_lamp(Metric::Flip, case).unwrap();
        let state = window.state().state();
        assert_eq!(state.review.chosen, Some((case, lamp)));
        assert_eq!(state.solo, [lamp]);
        if let Case::Frame(frame) = review.cases[case].case {
            assert_eq!(state.frame, frame);
        }
    }
}

/// A window on a project with a network measured in it, and the folders.
fn window_that_measured() -> (Window, PathBuf, TempDir) {
    let (mut window, root, folder) = export::opened();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    until_labelled(&mut window, "Measure");
    window.get_by_label("Measure").click();
    until(&mut window, "figures", |app| app.review().measured().is_some() && app.status().job.is_none());
    (window, root, folder)
}

#[test]
fn one_of_a_cell_s_pictures_is_shown_large_and_flipped() {
    let (mut window, _root, _folder) = window_that_measured();
    let review = measurement(&window);
    let worst = in_strip(&review, review.worst_cases(Metric::Flip)[0]);
    window.get_by_label(&worst).click_accesskit();
    until(&mut window, "the cell's pictures", |app| app.review().cell.as_ref().is_some_and(Result::is_ok));
    let shown = window.state().review().cell.clone().unwrap().unwrap();
    let truth = match shown.cell.case {
        Case::Pose(_) => "photograph",
        Case::Frame(_) => "truth",
    };
    let all = ["prediction", truth, "difference (FLIP × 4)"];
    let drawn = |window: &Window| {
        let image = |name: &&str| window.query_by_role_and_label(Role::Image, name).is_some();
        all.into_iter().filter(image).collect::<Vec<_>>()
    };
    let click = |window: &mut Window, name: &str| {
        window.get_by_role_and_label(Role::Image, name).click();
        window.run_steps(3);
    };
    assert_eq!(drawn(&window), all);
    click(&mut window, "prediction");
    assert_eq!(drawn(&window), all[..1]);
    for place in [1, 0, 1] {
        window.key_press(Key::Q);
        window.run_steps(2);
        assert_eq!(drawn(&window), all[place..=place]);
    }
    assert!(!window.state().state().compare.on, "the picture is not compared");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(drawn(&window), all);
    click(&mut window, all[2]);
    assert_eq!(window.state().state().review.enlarged, Some(CellPicture::Difference));
    click(&mut window, all[2]);
    assert_eq!(drawn(&window), all);
    // The gain is shared with the viewer.
    let list = |window: &Window| {
        window.get_by_role_and_label(Role::ComboBox, "Difference gain").click();
    };
    list(&window);
    window.run_steps(3);
    click_on(&mut window, "× 16");
    window.get_by_role_and_label(Role::Image, "difference (FLIP × 16)");
    assert_eq!(window.state().state().display.gain, 16.0);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().state().review.cell.is_none());
}

#[test]
fn what_changed_since_the_measurement_is_said_and_a_measurement_that_fails_too() {
    let folder = crate::temporary();
    let project = clay_project(folder.path());
    measured(&project);
    std::fs::create_dir(project.checkpoint_path()).unwrap();
    std::fs::write(project.checkpoint_path().join("checkpoint.toml"), "").unwrap();
    std::fs::write(project.calibration_path(), "").unwrap();
    let mut window = opened(&project);
    window.get_by_label_contains("before the project changed");
    window.get_by_label("Report…");
    window.get_by_label("Measure").click();
    window.run_steps(2);
    until(&mut window, "end of the measurement", |app| app.status().message.is_some());
    let said = window.state().status().message.clone().unwrap();
    assert!(said.contains("calibration.toml"), "{said}");
}

#[test]
fn the_review_looks_as_it_did() {
    let folder = crate::temporary();
    let (_, mut window) = measured_window(folder.path());
    let at = in_map(&window, 1, 21);
    click_at(&mut window, at, Modifiers::NONE);
    until_shown(&mut window);
    until(&mut window, "sheet of the frame", |app| app.review().sheet.as_ref().unwrap().as_ref().unwrap().frame == 5);
    window.get_by_label("Doubtful").click();
    window.run_steps(2);
    snapshot(&mut window, "studio_review");
}

#[test]
fn what_keeps_the_review_empty_is_said_there() {
    let folder = crate::temporary();
    let mut window = opened(&clay_project(folder.path()));
    window.get_by_label_contains("Not measured yet");
    window.get_by_label_contains("in the pose.");
    window.get_by_label("Measure");
    assert!(window.query_by_label("Report…").is_none());
    snapshot(&mut window, "studio_review_empty");
}

#[test]
fn figures_that_cannot_be_read_are_named_and_can_be_measured_again() {
    let folder = crate::temporary();
    let project = clay_project(folder.path());
    std::fs::write(project.measured_path(), "no figures").unwrap();
    let mut window = opened(&project);
    window.get_by_label("Measure");
    // The folder's name differs each time.
    let places = lines_with(&window, "measured.json", 850.0, 1270.0);
    snapshot_without(&mut window, "studio_review_error", &places);
}

#[test]
fn frames_that_are_unlike_every_pose_are_listed_and_another_calibrations_are_called_so() {
    let folder = crate::temporary();
    let project = clay_project(folder.path());
    let frame = |frame: usize, distance: f32| {
        serde_json::json!({
            "frame": frame, "distance": distance, "pose": 0, "cells": [], "errors": [], "lamps": [],
            "expected": {"psnr_db": 21.4, "at_least_db": 19.8},
        })
    };
    let report = serde_json::json!({
        "format": 4, "uncovered": 0.0, "calibration": "another", "pose_distances": [0.4, 0.5], "far": 1.0,
        "frames": [frame(0, 0.9), frame(2, 1.5), frame(3, 1.2)],
        "every": 1, "missing": [2], "relation": null, "lamps": null,
    });
    let path = afterlight::confidence::ConfidenceReport::path(&project);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, report.to_string()).unwrap();
    let window = opened(&project);
    window.get_by_label_contains("Calibration or pictures have changed");
    window.get_by_label_contains("2 of 3 frames unlike every pose");
    window.get_by_label("Frame 2: 3.0 × as far, 21.4 dB or less");
    window.get_by_label("Frame 3: 2.4 × as far, 21.4 dB or less");
    window.get_by_label("Frame 2");
    window.get_by_label("Estimate errors");
}

#[test]
fn where_errors_are_expected_lies_over_the_picture_and_the_worst_lamp_comes_first() {
    let folder = crate::temporary();
    let project = clay_project(folder.path());
    // Expected errors grow to the right.
    let side = afterlight::confidence::SIDE;
    let errors: Vec<f64> = (0..side * side).map(|cell| 0.01 * (cell % side + 1) as f64).collect();
    let lamps = project.settings.shoot.lamps.len();
    let frame = |frame: usize| {
        let decibels = |lamp: usize| 30.0 - 0.1 * lamp as f64 - frame as f64;
        serde_json::json!({
            "frame": frame, "distance": 0.5, "pose": 0, "cells": errors, "errors": errors,
            "lamps": (0..lamps).map(decibels).collect::<Vec<_>>(),
            "expected": {"psnr_db": 21.4, "at_least_db": 19.8},
        })
    };
    let frames = project.settings.shoot.frames.len();
    let report = serde_json::json!({
        "format": 4, "uncovered": 0.0, "calibration": afterlight::confidence::mark(&project).unwrap(), "pose_distances": [0.4, 0.5], "far": 1.0,
        "frames": (0..frames).map(frame).collect::<Vec<_>>(),
        "every": 1, "missing": [], "relation": null, "lamps": null,
    });
    let path = afterlight::confidence::ConfidenceReport::path(&project);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, report.to_string()).unwrap();
    let mut window = opened(&project);
    let worst = frames - 1;
    let name = project.settings.shoot.lamps.last().unwrap();
    let decibels = 30.0 - 0.1 * (lamps - 1) as f64 - worst as f64;
    assert_eq!(name, &format!("olat_{:02}", lamps - 1));
    let name = format!("lamp {}", lamps - 1);
    window.get_by_label(&format!("Frame {worst}, {name}: {decibels:.1} dB")).click();
    until_shown(&mut window);
    assert_eq!(window.state().state().frame, worst);
    assert_eq!(window.state().state().solo, [lamps - 1]);
    window.get_by_label(&format!("Solo: {name} ×"));
    click_on(&mut window, "Show expected errors over the picture");
    assert!(window.state().state().viewport.doubts);
    window.get_by_label("Errors ×");
    snapshot(&mut window, "studio_expected_errors");
}

#[test]
fn poses_stand_in_the_strip_as_they_were_photographed_under_their_worst_lamps() {
    let (mut window, _root, _folder) = window_that_measured();
    let review = measurement(&window);
    let order = review.worst_cases(Metric::Flip);
    let poses = order.iter().filter_map(|&(case, mean)| {
        let Case::Pose(pose) = review.cases[case].case else { return None };
        let lamp = review.worst_lamp(Metric::Flip, case)?;
        Some((Thumbnail::Olat { pose, lamp }, in_strip(&review, (case, mean))))
    });
    let poses: Vec<(Thumbnail, String)> = poses.collect();
    assert!(!poses.is_empty());
    // The strip requests the pictures in sight.
    window.set_size(vec2(1280.0, 1100.0));
    window.run_steps(4);
    until(&mut window, "photographs", |app| {
        let footage = app.footage();
        footage.thumbnail(poses[0].0).is_some()
    });
    let need = test_support::Need::Gpu;
    if !test_support::require(need, vulkan_adapter(), "no Vulkan adapter to draw with") {
        return;
    }
    let place = window.get_by_label(&poses[0].1).rect();
    let drawn = window.render().unwrap();
    let colors = (0..56).flat_map(|y| (0..84).map(move |x| [x, y]));
    let colors = colors.map(|[x, y]| drawn.get_pixel(place.left() as u32 + x, place.top() as u32 + y));
    let colors: std::collections::BTreeSet<_> = colors.map(|color| color.0).collect();
    assert!(colors.len() > 20, "a photograph, not {} colours", colors.len());
}

#[test]
fn a_verdict_is_taken_back_by_its_key_and_undone_while_the_light_stays() {
    let folder = crate::temporary();
    let (project, mut window) = measured_window(folder.path());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num3);
    window.run_steps(2);
    plain_drag(&mut window, super::MIDDLE, super::MIDDLE + vec2(50.0, 0.0));
    let look = window.state().state().look.clone();
    assert!(look.yaw_deg != 0.0);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    window.run_steps(2);
    let at = in_map(&window, 1, 10);
    click_at(&mut window, at, Modifiers::NONE);
    let until_is = |window: &mut Window, mark: Option<Mark>, note: &str| {
        let started = Instant::now();
        let on_disk = || {
            let marks = Marks::load(&project).unwrap();
            let marked = marks.get("frame_005", "olat_10").cloned();
            marked.map_or((None, String::new()), |marked| (marked.mark, marked.note))
        };
        while on_disk() != (mark, note.to_owned()) {
            assert!(started.elapsed() < test_support::PATIENCE, "{:?}", on_disk());
            std::thread::sleep(Duration::from_millis(5));
            window.step();
        }
        assert_eq!(window.state().state().look, look, "the light stays");
    };
    let bad = Some(Mark::Bad);
    let (undo, redo) = (Modifiers::COMMAND, Modifiers::COMMAND | Modifiers::SHIFT);
    window.key_press(Key::Num3);
    until_is(&mut window, bad, "");
    window.key_press(Key::Num3);
    until_is(&mut window, None, "");
    window.key_press_modifiers(undo, Key::Z);
    until_is(&mut window, bad, "");
    window.get_by_label_contains("Undone: mark of frame_005, lamp 10");
    window.key_press_modifiers(redo, Key::Z);
    until_is(&mut window, None, "");
    window.key_press(Key::Num1);
    until_is(&mut window, Some(Mark::Good), "");

    // A note is a single step, and its field follows.
    window.get_by_label("Note").focus();
    window.run_steps(2);
    for typed in ["the ", "chin's ", "shadow"] {
        window.event(Event::Text(typed.to_owned()));
        window.run_steps(2);
    }
    until_is(&mut window, Some(Mark::Good), "the chin's shadow");
    click_at(&mut window, at, Modifiers::NONE);
    window.key_press_modifiers(undo, Key::Z);
    until_is(&mut window, Some(Mark::Good), "");
    let field = window.get_by_label("Note");
    assert_eq!(field.value().unwrap_or_default(), "");
    for _ in 0..5 {
        window.key_press_modifiers(undo, Key::Z);
        window.run_steps(3);
    }
    until_is(&mut window, None, "");
    window.get_by_label_contains("No mark left to undo");
    for _ in 0..4 {
        window.key_press_modifiers(redo, Key::Z);
        window.run_steps(3);
    }
    until_is(&mut window, Some(Mark::Good), "the chin's shadow");

    // In other panes, undo applies to the light.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num3);
    window.run_steps(2);
    window.key_press_modifiers(undo, Key::Z);
    window.run_steps(3);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);
}

#[test]
fn a_cell_stays_in_the_review_and_ends_under_another_environment() {
    let (mut window, _root, _folder) = export::opened();
    let show = |window: &mut Window, workspace: Key| {
        window.key_press_modifiers(Modifiers::COMMAND, workspace);
        window.run_steps(4);
    };
    show(&mut window, Key::Num4);
    until_labelled(&mut window, "Measure");
    window.get_by_label("Measure").click();
    until(&mut window, "figures", |app| app.review().measured().is_some() && app.status().job.is_none());
    let review = measurement(&window);
    let worst = in_strip(&review, review.worst_cases(Metric::Flip)[0]);
    let is_drawn = |window: &Window| {
        let image = window.query_by_role_and_label(Role::Image, "prediction");
        image.is_some()
    };
    let cell = |window: &mut Window| {
        show(window, Key::Num4);
        window.get_by_label(&worst).click_accesskit();
        until(window, "the cell's pictures", |app| {
            let pictures = app.review().cell.as_ref();
            app.state().review.cell.is_some() && pictures.is_some_and(Result::is_ok)
        });
        window.run_steps(4);
        assert!(is_drawn(window));
        window.key_press(Key::Q);
        window.run_steps(3);
        let state = window.state().state();
        assert!(state.review.cell.is_some() && state.review.enlarged.is_some());
    };
    for workspace in [Key::Num3, Key::Num5] {
        cell(&mut window);
        show(&mut window, workspace);
        let state = window.state().state();
        assert_eq!((state.review.cell, state.review.enlarged), (None, None));
        assert!(!is_drawn(&window));
        window.get_by_label("Relit picture");
    }
    cell(&mut window);
    show(&mut window, Key::Num4);
    assert!(window.state().state().review.cell.is_some(), "the workspace was open already");
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(4);
    let state = window.state().state();
    assert_eq!((state.review.cell, state.review.enlarged), (None, None));
}
