//! Questions before work ends: on closing, and on opening another project.

use super::export::{told_export, until_share};
use super::{Window, clay_window, drop_onto, project, snapshot, told_job, until, until_labelled};
use afterlight::studio::{StudioApp, WindowParts};
use afterlight::worker::Need;
use egui::{Key, Modifiers, ViewportCommand, ViewportId};
use egui_kittest::kittest::Queryable;
use std::path::Path;
use std::sync::mpsc::Sender;

/// Requests a close; true if the window asks first.
pub fn close(window: &mut Window) -> bool {
    let root = window.input_mut().viewports.entry(ViewportId::ROOT);
    root.or_default().events.push(egui::ViewportEvent::Close);
    window.step();
    let root = window.input_mut().viewports.entry(ViewportId::ROOT);
    root.or_default().events.clear();
    let commands = &window.output().viewport_output[&ViewportId::ROOT].commands;
    let asked = commands.contains(&ViewportCommand::CancelClose);
    window.run_steps(2);
    asked
}

/// A window with an export of which two of eight frames are written.
fn exporting(name: &str, folder: &Path) -> (Window, Sender<()>) {
    let mut window = clay_window(folder);
    let tell = told_export(&window, name, folder);
    (0..2).for_each(|_| tell.send(()).unwrap());
    until_share(&mut window, 0.25);
    (window, tell)
}

#[test]
fn a_close_during_an_export_of_stills_says_that_they_stay() {
    let folder = crate::temporary();
    let (mut window, _tell) = exporting("clay.0000–0007.png", folder.path());
    assert!(close(&mut window));
    window.get_by_label(
        "clay.0000–0007.png is 25 % done. Finished stills stay. “Existing files: Resume” writes the others.",
    );
    assert!(window.query_by_label_contains("in the queue").is_none());
    window.get_by_label("Keep working").click();
    window.run_steps(2);
    assert!(window.query_by_label("Close anyway").is_none());
    assert!(window.state().exports()[0].status.sentence().is_none());
}

#[test]
fn a_close_during_an_export_of_a_movie_says_that_it_is_lost_and_counts_those_that_wait() {
    let folder = crate::temporary();
    let (mut window, _tell) = exporting("clay.mov", folder.path());
    let _next = told_export(&window, "next.mov", folder.path());
    until(&mut window, "the next export", |app| app.exports().len() == 2);
    assert!(close(&mut window));
    window.get_by_label("clay.mov is 25 % done. An unfinished movie is lost.");
    window.get_by_label("1 export in the queue is not written.");
    window.key_press(Key::Escape);
    window.run_steps(2);
    let _more = told_export(&window, "more.mov", folder.path());
    until(&mut window, "a third export", |app| app.exports().len() == 3);
    assert!(close(&mut window));
    window.get_by_label("2 exports in the queue are not written.");
}

#[test]
fn a_close_is_asked_about_before_another_project() {
    let (folder, elsewhere) = (crate::temporary(), crate::temporary());
    let film = project::imported(elsewhere.path());
    let (mut window, _tell) = exporting("clay.mov", folder.path());
    drop_onto(&mut window, &film.root);
    until_labelled(&mut window, "Stop and open");
    assert!(close(&mut window));
    window.get_by_label("Close while work is running?");
    assert!(window.query_by_label("Stop and open").is_none());
    window.get_by_label("Keep working").click();
    window.run_steps(2);
    window.get_by_label("Open another project while work is running?");
    window.get_by_label("Keep working").click();
    window.run_steps(2);
    assert!(window.query_by_label("Keep working").is_none());
    assert!(is_open(&window, folder.path()));
}

#[test]
fn the_project_itself_is_opened_again_by_another_path_once_that_is_agreed() {
    let folder = crate::temporary();
    let film = project::imported(folder.path());
    let link = folder.path().join("link");
    std::os::unix::fs::symlink(&film.root, &link).unwrap();
    let mut window = super::window(|ctx| StudioApp::over(ctx, film.clone(), super::clay::source));
    let _tell = told_export(&window, "film.mov", folder.path());
    until(&mut window, "the export", |app| !app.exports().is_empty());
    drop_onto(&mut window, &link);
    until_labelled(&mut window, "Stop and open");
    window.run_steps(2);
    window.get_by_label("Open the project again while work is running?");
    window.key_press(Key::Escape);
    window.run_steps(2);
    // A running job writes the files that would be read.
    drop(window);
    let mut window = super::window(|ctx| StudioApp::over(ctx, film.clone(), super::clay::source));
    let job = told_job(&mut window);
    drop_onto(&mut window, &link);
    until(&mut window, "the reason", |app| app.status().refusal.is_some());
    window.get_by_label_contains("A job is running: training the network");
    assert!(is_open(&window, &film.root));
    drop(job);
}

fn is_open(window: &Window, root: &Path) -> bool {
    window.state().project().unwrap().root == root
}

#[test]
fn another_project_asks_before_it_ends_exports() {
    let (folder, elsewhere) = (crate::temporary(), crate::temporary());
    let film = project::imported(elsewhere.path());
    let (mut window, _tell) = exporting("clay.mov", folder.path());
    let _next = told_export(&window, "next.mov", folder.path());
    until(&mut window, "the next export", |app| app.exports().len() == 2);

    drop_onto(&mut window, film.root.join("project.toml"));
    until_labelled(&mut window, "Stop and open");
    window.run_steps(2);
    window.get_by_label("clay.mov is 25 % done. An unfinished movie is lost.");
    window.get_by_label("1 export in the queue is not written.");
    snapshot(&mut window, "studio_leaving");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(is_open(&window, folder.path()));
    window.get_by_label_contains("Not opened: ");
    assert!(window.state().exports()[0].status.sentence().is_none());

    drop_onto(&mut window, &film.root);
    until_labelled(&mut window, "Stop and open");
    window.run_steps(2);
    window.get_by_label("Stop and open").click();
    let needs = project::needs(Some(Need::Calibration));
    until(&mut window, "the other project", needs);
    assert!(is_open(&window, &film.root));
    assert!(window.state().exports().is_empty());
    assert!(window.query_by_label("Stop and open").is_none());
    assert_eq!(window.state().status().refusal, None, "the question was answered");
}

#[test]
fn a_training_is_stopped_for_another_project_once_that_is_agreed() {
    let (folder, elsewhere) = (crate::temporary(), crate::temporary());
    let film = project::imported(elsewhere.path());
    let mut window = clay_window(folder.path());
    let job = told_job(&mut window);
    drop_onto(&mut window, &film.root);
    until_labelled(&mut window, "Stop and open");
    window.run_steps(2);
    window.get_by_label_contains("Training the network: training at 37 %. It stops");
    window.get_by_label("Stop and open").click();
    let needs = project::needs(Some(Need::Calibration));
    until(&mut window, "the other project", needs);
    assert!(is_open(&window, &film.root));
    until(&mut window, "end of the job", |_| job.send(|_| {}).is_err());
}

#[test]
fn a_project_that_cannot_be_read_ends_nothing_and_asks_nothing() {
    let folder = crate::temporary();
    let (mut window, _tell) = exporting("clay.mov", folder.path());
    let damaged = folder.path().join("film");
    std::fs::create_dir(&damaged).unwrap();
    std::fs::write(damaged.join("project.toml"), "size = x").unwrap();
    drop_onto(&mut window, &damaged);
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    assert!(window.query_by_label("Stop and open").is_none());
}

#[test]
fn keys_do_nothing_behind_a_question_but_close_it() {
    let (_folder, mut window) = crate::new_window();
    let job = told_job(&mut window);
    assert!(close(&mut window));
    let before = window.state().state().clone();
    for (modifiers, key) in [
        (Modifiers::NONE, Key::Tab),
        (Modifiers::NONE, Key::Space),
        (Modifiers::NONE, Key::P),
        (Modifiers::NONE, Key::ArrowRight),
        (Modifiers::NONE, Key::Questionmark),
        (Modifiers::COMMAND, Key::Num1),
        (Modifiers::COMMAND, Key::N),
        (Modifiers::COMMAND | Modifiers::SHIFT, Key::P),
    ] {
        // Without focus: Space would press a focused button.
        window.ctx.memory_mut(|memory| {
            if let Some(focused) = memory.focused() {
                memory.surrender_focus(focused);
            }
        });
        window.key_press_modifiers(modifiers, key);
        window.run_steps(2);
        assert_eq!(*window.state().state(), before, "{key:?}");
    }
    let paused = |app: &StudioApp| app.status().job.as_ref().unwrap().is_paused();
    assert!(!paused(window.state()));
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.query_by_label("Close anyway").is_none());
    window.key_press(Key::P);
    window.run_steps(2);
    assert!(paused(window.state()));
    drop(job);
}

#[test]
fn the_keys_that_open_the_lists_close_them_and_no_other_passes() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::Questionmark);
    window.run_steps(2);
    assert!(window.state().state().covers.keys);
    window.key_press(Key::Space);
    window.key_press(Key::ArrowRight);
    window.run_steps(2);
    let state = window.state().state();
    assert!(!state.playback.playing && state.frame == 0 && state.panes.parts == WindowParts::All);
    window.key_press(Key::Questionmark);
    window.run_steps(2);
    assert!(!window.state().state().covers.keys);
}
