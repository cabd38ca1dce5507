//! Refusals appear over the picture and stay until they are answered.

use super::{MIDDLE, Window, clay, click_on, drop_onto, plain_drag, snapshot_without, told_job, until, until_shown};
use afterlight::project::Lock;
use afterlight::studio::StudioApp;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

#[test]
fn a_refused_drop_is_said_until_it_is_put_away_or_answered() {
    let (folder, mut window) = crate::new_window();
    let refused = |window: &mut super::Window| {
        drop_onto(window, "notes.txt");
        window.get_by_label_contains("notes.txt cannot be used");
        // A new picture is not an answer.
        plain_drag(window, MIDDLE, MIDDLE + vec2(30.0, 0.0));
        until_shown(window);
        window.get_by_label_contains("notes.txt cannot be used");
    };
    let is_said = |window: &super::Window| {
        let said = window.query_by_label_contains("notes.txt cannot be used").is_some();
        assert_eq!(said, window.state().status().refusal.is_some());
        said
    };
    refused(&mut window);
    let note = window.get_by_label_contains("notes.txt cannot be used").rect();
    assert!(note.height() > 30.0 && note.width() < 640.0, "the message is wrapped: {note:?}");
    snapshot_without(&mut window, "studio_refusal", &[]);
    window.get_by_label("Dismiss message").click();
    window.run_steps(2);
    assert!(!is_said(&window));

    refused(&mut window);
    window.key_press(Key::Questionmark);
    window.run_steps(2);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(is_said(&window), "Esc closed the list of keys");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!is_said(&window));

    refused(&mut window);
    drop_onto(&mut window, folder.path().join("sky.exr"));
    assert!(!is_said(&window));
    assert_eq!(window.state().status().log.len(), 1, "once in the log");

    // A damaged project leaves the open one in place, and the reason is shown.
    let damaged = folder.path().join("film");
    std::fs::create_dir(&damaged).unwrap();
    std::fs::write(damaged.join("project.toml"), "size = x").unwrap();
    drop_onto(&mut window, &damaged);
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    window.key_press(Key::E);
    until_shown(&mut window);
    window.get_by_label_contains("Correct the line");
    assert!(window.state().project().is_some());
}

/// Presses a key with Ctrl.
fn press(window: &mut Window, key: Key) {
    window.key_press_modifiers(Modifiers::COMMAND, key);
    window.run_steps(3);
}

#[test]
fn a_job_that_is_begun_while_another_runs_is_refused_in_every_workspace() {
    let (_folder, mut window) = crate::new_window();
    let job = told_job(&mut window);
    // In workspaces without a picture: the mirror ball, and the network.
    for workspace in [Key::Num1, Key::Num2] {
        press(&mut window, workspace);
        if workspace == Key::Num2 {
            until(&mut window, "checkpoints", |app| app.training().records.is_some());
        }
        assert!(window.query_by_label_contains("Another job").is_none());
        press(&mut window, Key::Enter);
        window.get_by_label_contains("Another job is running. Wait until it ends, or stop it");
        click_on(&mut window, "Dismiss message");
    }
    assert!(window.query_by_label_contains("Another job").is_none());
    drop(job);
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    window.key_press(Key::P);
    window.run_steps(3);
    assert_eq!(window.state().status().refusal, None, "a stray key says nothing");
}

#[test]
fn a_job_that_may_not_write_is_refused_where_no_picture_is_seen() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    project.save().unwrap();
    let _lock = Lock::take(folder.path(), "another program").unwrap();
    let mut window = super::window(|ctx| StudioApp::over(ctx, project, clay::source));
    press(&mut window, Key::Num1);
    press(&mut window, Key::Enter);
    window.get_by_label_contains("Read-only. ");
    assert!(window.state().status().job.is_none());
}
