//! The plan of passes, and forced passes.

use super::live::open;
use super::{
    MIDDLE, Window, clay, drop_onto, picture, plain_drag, snapshot, snapshot_without, told_job, until, until_shown,
    window,
};
use afterlight::compositor::Pass;
use afterlight::studio::{Pane, Phase, StudioApp};
use afterlight::worker::Blocked;
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

/// Forces a pass with its switch.
fn force(window: &mut Window, pass: &str, means: &str) {
    let switch = format!("{pass} by hand");
    window.get_by_label(&switch).scroll_to_me();
    window.run_steps(4);
    window.get_by_label(&switch).click();
    window.run_steps(4);
    window.get_by_label(means).click();
    until_shown(window);
}

fn report(window: &Window, pass: Pass) -> (bool, String) {
    let relit = window.state().relit().unwrap();
    let report = &relit.passes[pass as usize];
    (report.ran, report.reason.clone())
}

const RUN: &str = "Always on";
const LEAVE_OUT: &str = "Always off";

#[test]
fn a_pass_is_forced_on_and_off_and_left_to_the_scene_again() {
    let (folder, mut window) = crate::new_window();
    open(&mut window, Pane::Effects);
    until_shown(&mut window);
    let before = picture(&window);
    for fixed in ["Prediction", "Relight", "Tone curve", "Difference"] {
        window.get_by_label(fixed);
        let switch = format!("{fixed} by hand");
        assert!(window.query_by_label(&switch).is_none());
    }

    force(&mut window, "Glare", RUN);
    let (ran, reason) = report(&window, Pass::Glare);
    assert!(ran && reason == "on by hand; not needed here", "{reason}");
    assert_eq!(picture(&window), before, "without a strength it changes nothing");
    window.get_by_label("1 pass set by hand");
    force(&mut window, "Background", LEAVE_OUT);
    assert_eq!(report(&window, Pass::Background), (false, "off by hand".to_owned()));
    assert_ne!(picture(&window), before);
    assert_eq!(picture(&window)[..3], [0; 3], "nothing is behind the subject");

    for _ in 0..2 {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
    }
    until_shown(&mut window);
    assert_eq!(picture(&window), before);
    for _ in 0..2 {
        window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
        window.run_steps(2);
    }
    until_shown(&mut window);
    // A forced pass is part of the saved look.
    let kept = folder.path().join("look.json");
    until(&mut window, "kept look", |_| {
        let text = std::fs::read_to_string(&kept).unwrap_or_default();
        text.contains("\"glare\": true") && text.contains("\"background\": false")
    });
    window.get_by_label("2 passes set by hand").scroll_to_me();
    window.run_steps(4);
    window.get_by_label("All automatic").click();
    until_shown(&mut window);
    assert_eq!(picture(&window), before);
    assert!(window.query_by_label("All automatic").is_none());
}

#[test]
fn groups_fold_say_what_was_changed_and_are_reset_in_one_step() {
    let (_folder, mut window) = crate::shown_window();
    for name in ["Environment", "Grade", "Lights", "Picture", "Effects"] {
        window.get_by_label(&format!("{name} group"));
        assert!(window.query_by_label(&format!("{name} changed")).is_none());
        assert!(window.query_by_label(&format!("Reset {name}")).is_none());
    }
    window.get_by_role_and_label(Role::SpinButton, "Temperature");
    window.get_by_label("Grade group").click();
    window.run_steps(2);
    assert!(window.query_by_role_and_label(Role::SpinButton, "Temperature").is_none());
    // The group stays folded while other panes are shown.
    window.get_by_label("Scopes").click();
    window.run_steps(2);
    window.get_by_label("Light").click();
    window.run_steps(2);
    assert!(window.query_by_role_and_label(Role::SpinButton, "Temperature").is_none());
    // The keyboard unfolds it.
    window.get_by_label("Grade group").focus();
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(2);
    window.get_by_role_and_label(Role::SpinButton, "Temperature");

    let before = window.state().state().look.clone();
    let roll = window.get_by_role_and_label(Role::SpinButton, "Roll").rect().center();
    let right = roll + vec2(60.0, 0.0);
    plain_drag(&mut window, MIDDLE, MIDDLE + vec2(80.0, 0.0));
    plain_drag(&mut window, roll, right);
    until_shown(&mut window);
    let changed = window.state().state().look.clone();
    assert!(changed.yaw_deg != before.yaw_deg);
    assert!(changed.lighting.roll_deg != before.lighting.roll_deg);
    window.get_by_label("Environment changed");
    assert!(window.query_by_label("Grade changed").is_none());
    window.get_by_label("Reset Environment").click();
    until_shown(&mut window);
    assert_eq!(window.state().state().look, before);
    assert!(window.query_by_label("Environment changed").is_none());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().state().look, changed, "one step of undo");
}

#[test]
fn a_group_of_passes_says_that_one_is_forced_and_leaves_all_of_them_to_the_scene_again() {
    let (_folder, mut window) = crate::new_window();
    open(&mut window, Pane::Effects);
    until_shown(&mut window);
    force(&mut window, "Glare", RUN);
    force(&mut window, "Background", LEAVE_OUT);
    window.get_by_label("Lens changed");
    window.get_by_label("Subject and background changed");
    assert!(window.query_by_label("Finish changed").is_none());
    window.get_by_label("Reset Lens").scroll_to_me();
    window.run_steps(4);
    window.get_by_label("Reset Lens").click();
    until_shown(&mut window);
    assert!(window.query_by_label("Lens changed").is_none());
    window.get_by_label("1 pass set by hand");
    window.get_by_label("Subject and background changed");
    window.get_by_label("Lens group").click();
    window.run_steps(2);
    assert!(window.query_by_label("Vignette by hand").is_none());
}

#[test]
fn effects_and_log_look_as_they_did() {
    let (_folder, mut window) = crate::new_window();
    window.get_by_label("Log").click();
    window.run_steps(2);
    window.get_by_label("No messages yet");
    snapshot(&mut window, "studio_log_empty");

    // Room for the log.
    let border = egui::pos2(600.0, 577.0);
    plain_drag(&mut window, border, border - vec2(0.0, 120.0));
    open(&mut window, Pane::Effects);
    window.run_steps(2);
    force(&mut window, "Glare", RUN);
    assert!(!report(&window, Pass::Predict).0);
    let job = told_job(&mut window);
    job.send(|progress| progress.say("Paused after step 1204: its checkpoint is saved")).unwrap();
    drop(job);
    // After a job, the network may have changed.
    until(&mut window, "new prediction", |app| {
        let predicted = app.relit().is_some_and(|relit| relit.passes[0].ran);
        predicted && app.status().job.is_none()
    });
    window.get_by_label("Close").click();
    force(&mut window, "Dither", LEAVE_OUT);
    window.get_by_label("2 passes set by hand").scroll_to_me();
    drop_onto(&mut window, "notes.txt");
    let said = window.query_all_by_label_contains("notes.txt cannot be used");
    assert_eq!(said.count(), 2, "over the picture and in the log");
    window.key_press(Key::Escape);
    until_shown(&mut window);
    // Times of the passes and in the log differ from run to run.
    let times: Vec<egui::Rect> = (window.query_all_by_label_contains(" ms"))
        .filter(|time| time.rect().left() > 1000.0)
        .map(|time| egui::Rect::from_x_y_ranges(1110.0..=1190.0, time.rect().y_range()))
        .chain(window.query_all_by_label_contains("0:").map(|time| time.rect()))
        .collect();
    snapshot_without(&mut window, "studio_effects", &times);
}

#[test]
fn without_a_picture_the_panels_beside_it_say_so() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let source =
        || Err(Blocked { sentence: "The network cannot be read: checkpoint.toml is damaged".to_owned(), need: None });
    let mut window = window(|ctx| StudioApp::over(ctx, project, source));
    until(&mut window, "reason", |app| {
        matches!(app.status().phase, Phase::Blocked(_)) && app.environments().iter().all(|e| e.panorama.is_done())
    });
    open(&mut window, Pane::Effects);
    window.run_steps(2);
    window.get_by_label_contains("once a picture has been made");
    // Besides the button in place of the picture.
    assert_eq!(window.query_all_by_label("Try again").count(), 2);
    snapshot(&mut window, "studio_effects_empty");
    window.get_by_label("Scopes").click();
    window.run_steps(2);
    window.get_by_label("No picture yet");
    snapshot(&mut window, "studio_scopes_empty");
}
