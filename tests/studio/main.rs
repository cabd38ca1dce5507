//! The real window, driven headless: user actions and their visible results.

mod aiming;
mod calibrating;
mod checking;
mod clay;
mod comparing;
mod dialogs;
mod effects;
mod environments;
mod export;
mod footage;
mod keyframes;
mod leaving;
mod lights;
mod live;
mod look_comparisons;
mod looks;
mod machine;
mod numbers;
mod on_gpu;
mod project;
mod refusals;
mod review;
mod room;
mod scopes;
mod tasks;
mod timeline;
mod training;
mod turning;
mod viewing;

use afterlight::Error;
use afterlight::compositor::Field;
use afterlight::gpu::DeviceChoice;
use afterlight::progress::Progress;
use afterlight::scene::{Background, ViewTransform};
use afterlight::studio::{Phase, StudioApp};
use afterlight::worker::{Blocked, Need};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, SnapshotOptions, image_snapshot_options};
use image::codecs::png;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use test_shoot::TestShoot;
use test_support::PATIENCE;

/// Largest difference of a snapshot pixel (YIQ distance), and number of pixels that may exceed it: drivers round the
/// edges of text differently.
const SNAPSHOT: (f32, usize) = (0.6, 40);

type Window = Harness<'static, StudioApp>;

/// A temporary folder. Its name has the same width in every run, since all digits are equally wide: lines that contain
/// it break at the same places.
fn temporary() -> tempfile::TempDir {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let name = format!("{:010}-{count:04}", std::process::id());
    let named = tempfile::Builder::new().prefix(&name).rand_bytes(0).tempdir();
    named.expect("no other process has this name")
}

fn window(make: impl FnOnce(&egui::Context) -> StudioApp) -> Window {
    Harness::builder()
        .with_size(vec2(1280.0, 720.0))
        .with_step_dt(0.25)
        // `run` ends when no frame is requested; the threads behind the window may still request a few.
        .with_max_steps(60)
        .build_eframe(|cc| make(&cc.egui_ctx))
}

fn clay_window(folder: &Path) -> Window {
    let project = clay::project(folder, clay::environments(folder));
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    window
}

/// A new project and its window, with a first picture.
fn new_window() -> (tempfile::TempDir, Window) {
    let folder = temporary();
    let window = clay_window(folder.path());
    (folder, window)
}

/// The same, with the picture of its state.
fn shown_window() -> (tempfile::TempDir, Window) {
    let (folder, mut window) = new_window();
    until_shown(&mut window);
    (folder, window)
}

/// A shoot with balls large enough for calibration.
const SHOOT: TestShoot = TestShoot { frames: 3, lamps: 12, size: 64, working_size: 64 };

/// Steps the window until `seen`, as a user would wait.
fn until(window: &mut Window, what: &str, seen: impl Fn(&StudioApp) -> bool) {
    let started = Instant::now();
    while !seen(window.state()) {
        assert!(started.elapsed() < PATIENCE, "no {what}: {:?}", window.state().status());
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
    window.run_steps(2);
}

/// Steps the window until something with that label is drawn.
fn until_labelled(window: &mut Window, label: &str) {
    until_drawn(window, label, |window| window.query_by_label(label).is_some());
}

/// Steps the window until something with that text in its label is drawn.
fn until_said(window: &mut Window, text: &str) {
    until_drawn(window, text, |window| window.query_by_label_contains(text).is_some());
}

fn until_drawn(window: &mut Window, label: &str, is_drawn: impl Fn(&Window) -> bool) {
    let started = Instant::now();
    while !is_drawn(window) {
        assert!(started.elapsed() < PATIENCE, "nothing is labelled {label}");
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
}

/// Text that Ctrl+C puts on the clipboard.
fn copied(window: &mut Window) -> Option<String> {
    window.event(Event::Copy);
    for _ in 0..4 {
        window.step();
        for command in &window.output().platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                return Some(text.clone());
            }
        }
    }
    None
}

fn undo(window: &mut Window) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(4);
    until_shown(window);
}

/// Lights placed by hand.
fn lights(window: &Window) -> &[afterlight::light::PlacedLight] {
    &window.state().state().look.lighting.placed
}

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// Drops a file or a folder onto the window.
fn drop_onto(window: &mut Window, path: impl Into<std::path::PathBuf>) {
    let dropped = std::sync::Arc::new(Dropped(path.into()));
    window.input_mut().dropped_files.push(dropped);
    window.run_steps(2);
}

/// Clicks the element with this label.
fn click_on(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

/// Scrolls to the element with this label.
fn scroll_to(window: &mut Window, label: &str) {
    window.get_by_label(label).scroll_to_me();
    window.run_steps(4);
}

/// Waits until the picture matches the state.
fn until_shown(window: &mut Window) {
    window.run_steps(2);
    until(window, "picture of the state", |app| {
        let shown = app.relit().filter(|r| r.coarse == 1);
        let shown = shown.map(|r| (&r.scene, r.environment.as_str()));
        let environment = &app.environments()[app.state().look.environment];
        shown == Some((&app.state().scene(), environment.listed.name.as_str()))
    });
}

fn picture(window: &Window) -> Vec<u8> {
    window.state().relit().unwrap().rgb.clone()
}

/// Chooses an entry of a list.
fn choose(window: &mut Window, list: &str, entry: &str) {
    let list = |window: &Window, act: fn(&egui_kittest::Node)| {
        act(&window.get_by_role_and_label(Role::ComboBox, list));
    };
    list(window, |list| list.scroll_to_me());
    window.run_steps(4);
    list(window, |list| list.click());
    window.run_steps(4);
    window.get_by_label(entry).click();
    window.run_steps(4);
    until_shown(window);
}

/// Sum of a picture's codes.
fn brightness(rgb: &[u8]) -> u64 {
    rgb.iter().map(|&code| u64::from(code)).sum()
}

/// Presses a key that moves to a frame, and waits for its picture.
fn go(window: &mut Window, key: Key, frame: usize) {
    window.key_press(key);
    until(window, "the frame", |app| app.state().frame == frame);
    until_shown(window);
}

/// Replaces the text of the focused field.
fn retype(window: &mut Window, text: &str) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    window.event(Event::Text(text.to_owned()));
    window.run_steps(2);
}

/// Replaces the text of a field and presses Enter.
fn type_into(window: &mut Window, (role, field): (Role, &str), text: &str) {
    window.get_by_role_and_label(role, field).scroll_to_me();
    window.run_steps(4);
    window.get_by_role_and_label(role, field).click();
    window.run_steps(3);
    retype(window, text);
    window.key_press(Key::Enter);
    window.run_steps(4);
}

/// Moves the pointer to `x` points right of the middle of the picture, or presses or releases its button there.
fn pointer(window: &Window, x: f32, pressed: Option<bool>) {
    let pos = MIDDLE + vec2(x, 0.0);
    window.event(pressed.map_or(Event::PointerMoved(pos), |pressed| press(pos, pressed)));
}

/// A press or a release of the primary button.
fn press(pos: Pos2, pressed: bool) -> Event {
    Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
}

/// A press too short for a drag.
fn click_at(window: &mut Window, pos: Pos2, modifiers: Modifiers) {
    let press = |pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
    window.event(Event::ModifiersChanged(modifiers));
    window.event(Event::PointerMoved(pos));
    window.event(press(true));
    window.event(press(false));
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    window.event(Event::PointerGone);
    window.run_steps(4);
}

/// Drags with the primary button only.
fn plain_drag(window: &mut Window, from: Pos2, to: Pos2) {
    drag(window, from, to, PointerButton::Primary, Modifiers::NONE);
}

fn drag(window: &mut Window, from: Pos2, to: Pos2, button: PointerButton, modifiers: Modifiers) {
    let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers };
    window.event(Event::ModifiersChanged(modifiers));
    window.event(Event::PointerMoved(from));
    window.event(press(from, true));
    for i in 1..=8 {
        window.event(Event::PointerMoved(from.lerp(to, i as f32 / 8.0)));
    }
    window.event(press(to, false));
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    window.event(Event::PointerGone);
    window.run_steps(2);
}

/// Double-clicks as fast as a user does.
fn double_click(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    window.run_steps(2);
    for pressed in [true, false, true, false] {
        let now = window.ctx.input(|input| input.time);
        window.input_mut().time = Some(now + 0.02);
        window.event(press(at, pressed));
        window.step();
    }
    // The clock advances by itself.
    window.input_mut().time = None;
    window.event(Event::PointerGone);
    window.run_steps(3);
}

const MIDDLE: Pos2 = Pos2::new(500.0, 320.0);

#[test]
fn turning_the_light_changes_the_picture_and_is_undone_at_once() {
    let (_folder, mut window) = shown_window();
    let before = picture(&window);
    drag(&mut window, MIDDLE, MIDDLE + vec2(100.0, 0.0), PointerButton::Primary, Modifiers::NONE);
    until_shown(&mut window);
    let yaw = window.state().state().look.yaw_deg;
    assert!((30.0..=50.0).contains(&yaw), "100 points to the right turn the light by {yaw}°");
    assert_ne!(picture(&window), before);
    let predict = &window.state().relit().unwrap().passes[0];
    assert_eq!((predict.name.as_str(), predict.ran), ("predict", false), "a turn never asks the network");

    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);
    assert_eq!(picture(&window), before);
    for (button, turned) in [("Redo", yaw), ("Undo", 0.0)] {
        click_on(&mut window, button);
        assert_eq!(window.state().state().look.yaw_deg, turned, "{button} in the top bar");
    }
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, yaw);
}

#[test]
fn ctrl_drag_and_shift_right_drag_turn_and_a_middle_drag_moves() {
    let (_folder, mut window) = new_window();
    drag(&mut window, MIDDLE, MIDDLE - vec2(50.0, 0.0), PointerButton::Primary, Modifiers::COMMAND);
    let after_ctrl = window.state().state().look.yaw_deg;
    assert!(after_ctrl < -10.0, "{after_ctrl}");
    drag(&mut window, MIDDLE, MIDDLE - vec2(50.0, 0.0), PointerButton::Secondary, Modifiers::SHIFT);
    let after_shift = window.state().state().look.yaw_deg;
    assert!(after_shift < after_ctrl - 10.0, "{after_shift}");
    drag(&mut window, MIDDLE, MIDDLE + vec2(30.0, 20.0), PointerButton::Middle, Modifiers::NONE);
    assert_eq!(window.state().state().look.yaw_deg, after_shift);
    assert_ne!(window.state().state().viewport.view.pan, [0.0; 2]);
    window.key_press(Key::F);
    window.run();
    assert_eq!(window.state().state().viewport.view.pan, [0.0; 2]);
}

#[test]
fn play_goes_through_the_frames_and_around() {
    let (_folder, mut window) = new_window();
    window.get_by_label("Play").click();
    let mut shown = std::collections::BTreeSet::new();
    let started = Instant::now();
    while shown.len() < clay::FRAMES || window.state().state().frame > 1 {
        assert!(started.elapsed() < PATIENCE, "{shown:?}");
        std::thread::sleep(Duration::from_millis(2));
        window.step();
        shown.extend(window.state().relit().map(|r| r.scene.frame));
    }
    assert!(window.state().state().playback.playing);
    window.key_press(Key::Space);
    window.run();
    assert!(!window.state().state().playback.playing);
    for (key, frame) in [(Key::End, clay::FRAMES - 1), (Key::ArrowLeft, clay::FRAMES - 2)] {
        window.key_press(key);
        // The window handles one event per step, and a release may still be pending.
        until(&mut window, "the frame that the key asks for", |app| {
            app.state().frame == frame && app.relit().is_some_and(|r| r.scene.frame == frame)
        });
    }
}

#[test]
fn environments_are_chosen_by_click_and_by_key() {
    let (_folder, mut window) = shown_window();
    let before = picture(&window);
    window.get_by_label("sky").click();
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "sky");
    assert_ne!(picture(&window), before);
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowLeft);
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "window");
    assert_eq!(picture(&window), before);
    assert_eq!(window.state().state().frame, 0, "Alt+← is not ←");
    // Built-in environments come after the shoot's.
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowLeft);
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "Nave");
}

#[test]
fn the_light_is_graded_and_joined_by_lights_and_all_of_it_is_undone() {
    let (_folder, mut window) = shown_window();
    let before = picture(&window);
    let mean = |picture: &[u8], channel: usize| -> f64 {
        let values = picture.iter().skip(channel).step_by(3);
        values.map(|&v| f64::from(v)).sum::<f64>() / (picture.len() / 3) as f64
    };
    choose(&mut window, "Tone curve", "Filmic");
    assert_eq!(window.state().state().look.effects.view, ViewTransform::Filmic);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(picture(&window), before);

    scroll_to(&mut window, "Add light");
    window.get_by_label("Add light").click();
    until_shown(&mut window);
    let lit = picture(&window);
    assert!(mean(&lit, 1) > mean(&before, 1) + 1.0);
    window.get_by_label("Light 1 on the panorama").scroll_to_me();
    window.run_steps(4);
    // Drags its dot across the panorama, from camera-left to camera-right.
    let dot = window.get_by_label("Light 1 on the panorama").rect().center();
    drag(&mut window, dot, dot + vec2(180.0, 0.0), PointerButton::Primary, Modifiers::NONE);
    until_shown(&mut window);
    let light = window.state().state().look.lighting.placed[0].clone();
    assert!(light.yaw_deg > 0.0 && (light.pitch_deg - 45.0).abs() < 4.0, "{light:?}");
    assert_eq!(window.state().state().look.yaw_deg, 0.0, "the panorama stays");
    assert_ne!(picture(&window), lit);
    for _ in 0..2 {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
    }
    until_shown(&mut window);
    assert_eq!(picture(&window), before);
    assert!(!window.state().state().can_undo());
}

#[test]
fn exposure_background_and_the_reset_of_the_view() {
    let (_folder, mut window) = new_window();
    window.key_press(Key::E);
    window.key_press(Key::E);
    window.key_press_modifiers(Modifiers::SHIFT, Key::E);
    window.run();
    assert_eq!(window.state().state().display.viewing.exposure_stops, 0.5);
    assert_eq!(window.state().state().look.exposure_stops, 0.0);
    for (name, background, corner) in [
        // Light of 0.1, and half a stop more, in sRGB codes.
        ("Checker", Background::Checker, Some([105; 3])),
        ("Colour", Background::Color([118; 3]), None),
        ("Plate", Background::Plate, None),
        ("None", Background::None, Some([0; 3])),
    ] {
        let before = picture(&window);
        choose(&mut window, "Background", name);
        assert_eq!(window.state().state().look.background, background);
        assert_ne!(picture(&window), before, "{name}");
        if let Some(corner) = corner {
            assert_eq!(picture(&window)[..3], corner, "{name}");
        }
        let swatch = window.query_by_label("Colour of the background");
        assert_eq!(swatch.is_some(), name == "Colour");
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    until_shown(&mut window);
    assert!(window.state().state().display.viewing.is_neutral());
    assert_eq!(window.state().state().look.background, Background::None);
}

#[test]
fn tab_hides_the_panels_and_a_question_mark_lists_the_keys() {
    let (_folder, mut window) = new_window();
    window.key_press(Key::Tab);
    window.run();
    assert!(window.query_by_label("Play").is_none());
    window.key_press(Key::Tab);
    window.key_press(Key::Questionmark);
    window.run();
    assert!(window.query_by_label("Play").is_some());
    window.get_by_label("Next environment");
    window.key_press(Key::Escape);
    window.run();
    assert!(window.query_by_label("Next environment").is_none());
}

#[test]
fn a_window_that_nobody_touches_asks_for_no_frame() {
    let (_folder, mut window) = shown_window();
    window.run();
    let newest = window.state().relit().unwrap().clone();
    // A request for a later repaint would show up here.
    for _ in 0..5 {
        std::thread::sleep(Duration::from_millis(50));
        assert!(!window.ctx.has_requested_repaint());
        window.step();
        let wait = window.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
        assert!(wait > Duration::from_secs(3600), "the window wants to be drawn again in {wait:?}");
    }
    assert!(std::sync::Arc::ptr_eq(&newest, window.state().relit().unwrap()));
}

/// Instruction to a job for its next step.
type Word = fn(&Progress);

/// Starts a controlled job, and steps the window until it is shown. The job waits for instructions; it ends when the
/// sender is dropped or the job is stopped.
fn told_job(window: &mut Window) -> Sender<Word> {
    let (tell, told) = channel::<Word>();
    let worker = window.state().worker().unwrap();
    let begun = worker.work("training the network", move |progress| {
        loop {
            progress.check("the checkpoint")?;
            match told.recv_timeout(Duration::from_millis(1)) {
                Ok(word) => word(progress),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(TRAINED.to_owned()),
            }
        }
    });
    begun.unwrap();
    tell.send(|progress| progress.step("training", 370, 1000, STEP)).unwrap();
    until(window, "step of the job", |app| app.status().job.as_ref().is_some_and(|w| w.note == STEP));
    tell
}

const STEP: &str = "step 1204, OLATs 0.0213, relit 0.0108, held-out pose 31.42 dB";
const TRAINED: &str = "Trained for 10 min, 3250 steps. Error: OLATs 0.0187, relit 0.0092, by the built-in features";

#[test]
fn the_picture_is_live_while_a_job_runs() {
    let (_folder, mut window) = new_window();
    let job = told_job(&mut window);
    window.get_by_label(STEP);
    window.get_by_label("37 %");
    for _ in 0..2 {
        window.key_press(Key::ArrowRight);
        until_shown(&mut window);
    }
    let before = picture(&window);
    drag(&mut window, MIDDLE, MIDDLE + vec2(100.0, 0.0), PointerButton::Primary, Modifiers::NONE);
    until_shown(&mut window);
    assert_eq!(window.state().state().frame, 2);
    assert_ne!(picture(&window), before);
    assert!(window.state().status().job.is_some());

    drop(job);
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    assert!(window.query_by_label("37 %").is_none());
    window.get_by_label(TRAINED);
    let scrub_bar = window.get_by_label("Scrub bar").rect();
    let close = window.get_by_label("Close").rect();
    assert!(!close.intersects(scrub_bar), "{close:?} over {scrub_bar:?}");
    window.get_by_label("Close").click();
    window.run();
    assert!(window.query_by_label(TRAINED).is_none());
}

#[test]
fn a_network_that_is_saved_is_seen_while_the_job_runs() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut openings = 0;
    let source = move || {
        openings += 1;
        let mut source = clay::source()?;
        let mut predict = source.predict;
        source.predict = Box::new(move |index| {
            let mut made = predict(index)?;
            if let Field::Memory(field) = &mut made.field {
                field.values.iter_mut().for_each(|v| *v /= openings as f32);
            }
            Ok(made)
        });
        Ok(source)
    };
    let mut window = window(|ctx| StudioApp::over(ctx, project, source));
    until(&mut window, "first picture", |app| app.relit().is_some());
    until_shown(&mut window);
    let (before, scene) = (picture(&window), window.state().state().scene());
    let job = told_job(&mut window);
    job.send(|progress| progress.saved()).unwrap();
    until(&mut window, "picture of the newer network", |app| {
        app.relit().is_some_and(|r| r.scene == scene && r.rgb != before)
    });
    assert!(window.state().status().job.is_some());
}

#[test]
fn a_job_is_paused_and_stopped_by_button_and_by_key() {
    let (_folder, mut window) = new_window();
    let job = told_job(&mut window);
    let paused = |app: &StudioApp| app.status().job.as_ref().unwrap().is_paused();
    window.get_by_label("Pause").click();
    window.run();
    assert!(paused(window.state()));
    window.get_by_label("paused");
    window.key_press(Key::P);
    window.run();
    assert!(!paused(window.state()));
    window.key_press(Key::P);
    window.run();
    window.get_by_label("Resume").click();
    window.run();
    job.send(|progress| progress.step("training", 500, 1000, "going on")).unwrap();
    until(&mut window, "step after the pause", |app| app.status().job.as_ref().is_some_and(|w| w.note == "going on"));
    window.get_by_label("Stop").click();
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    let kept = Error::Cancelled { kept: "the checkpoint".to_owned() };
    window.get_by_label(&kept.to_string());
}

/// The window of a project without a calibration, and its folder.
fn uncalibrated_window() -> (tempfile::TempDir, Window) {
    let folder = temporary();
    let project = clay::project(folder.path(), Vec::new());
    let source = || {
        Err(Blocked {
            sentence: "Not calibrated yet: afterlight calibrate PROJECT".to_owned(),
            need: Some(Need::Calibration),
        })
    };
    (folder, window(|ctx| StudioApp::over(ctx, project, source)))
}

#[test]
fn a_project_without_a_calibration_says_what_to_do_and_offers_it() {
    let (_folder, mut window) = uncalibrated_window();
    until(&mut window, "reason", |app| matches!(app.status().phase, Phase::Blocked(_)));
    window.run();
    window.get_by_label("Not calibrated yet");
    assert!(window.query_by_label_contains("afterlight calibrate").is_none());
    window.get_by_label("Calibrate");
}

#[test]
fn a_frame_that_cannot_be_read_is_named_over_the_picture() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let source = || {
        let mut source = clay::source()?;
        let mut predict = source.predict;
        source.predict = Box::new(move |index| match index {
            3 => Err(afterlight::Error::io(
                "open",
                "frame_003.png",
                std::io::ErrorKind::NotFound.into(),
                "Bring it back",
            )),
            _ => predict(index),
        });
        Ok(source)
    };
    let mut window = window(|ctx| StudioApp::over(ctx, project, source));
    until(&mut window, "first picture", |app| app.relit().is_some());
    for _ in 0..3 {
        window.key_press(Key::ArrowRight);
    }
    until(&mut window, "failure", |app| app.status().failure.is_some());
    window.get_by_label_contains("frame_003.png");
    window.key_press(Key::ArrowRight);
    until_shown(&mut window);
    assert!(window.state().status().failure.is_none());
}

#[test]
fn a_shoot_is_calibrated_trained_and_relit_in_the_window() {
    let folder = crate::temporary();
    let project = TestShoot::default().import(folder.path(), "project");

    let mut window = window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu));
    let needs = |need| move |app: &StudioApp| matches!(&app.status().phase, Phase::Blocked(b) if b.need == Some(need));
    until(&mut window, "need of a calibration", needs(Need::Calibration));
    window.get_by_label("Calibrate").click();
    until(&mut window, "picture without training", |app| app.relit().is_some());
    until_shown(&mut window);
    let carried_by = window.state().relit().unwrap().predicted.generation;
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some());
    window.get_by_label("Start").click();
    until(&mut window, "step of training", |app| {
        let work = app.status().job.as_ref();
        work.is_some_and(|w| w.note.contains("OLATs 0."))
    });
    window.get_by_label("Stop").click();
    until(&mut window, "picture with the network", |app| {
        let relit = app.relit();
        app.status().job.is_none() && relit.is_some_and(|r| r.predicted.generation > carried_by)
    });
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    until_shown(&mut window);
    let before = picture(&window);
    assert_eq!(before.len(), 32 * 32 * 3);
    drag(&mut window, MIDDLE, MIDDLE + vec2(200.0, 0.0), PointerButton::Primary, Modifiers::NONE);
    window.key_press(Key::End);
    until_shown(&mut window);
    assert_ne!(picture(&window), before);
}

#[test]
fn the_window_looks_as_it_did() {
    let (_folder, mut window) = shown_window();
    drag(&mut window, MIDDLE, MIDDLE + vec2(75.0, 0.0), PointerButton::Primary, Modifiers::NONE);
    until_shown(&mut window);
    snapshot(&mut window, "studio");
}

#[test]
fn a_window_in_which_a_job_runs_looks_as_it_did() {
    let (_folder, mut window) = new_window();
    let job = told_job(&mut window);
    window.key_press(Key::P);
    until_shown(&mut window);
    window.get_by_label("paused");
    snapshot(&mut window, "studio_job");
    window.key_press(Key::P);
    drop(job);
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    until_shown(&mut window);
    snapshot(&mut window, "studio_job_over");
}

#[test]
fn a_window_without_a_picture_shows_the_job_in_its_place() {
    let (_folder, mut window) = uncalibrated_window();
    let job = told_job(&mut window);
    assert!(window.query_by_label("Not calibrated yet").is_none());
    window.key_press(Key::P);
    window.run();
    until(&mut window, "panoramas", |app| app.environments().iter().all(|e| e.panorama.is_done()));
    snapshot(&mut window, "studio_job_alone");
    window.key_press(Key::P);
    drop(job);
    until(&mut window, "reason", |app| matches!(app.status().phase, Phase::Blocked(_)) && app.status().job.is_none());
    window.get_by_label("Not calibrated yet");
}

/// Compares the window with its snapshot, without the times, which differ from run to run.
fn snapshot(window: &mut Window, name: &str) {
    snapshot_without(window, name, &[]);
}

/// Areas from `left` to `right` of every label with `word`, for content that differs from run to run, such as a
/// folder's name.
fn lines_with(window: &Window, word: &str, left: f32, right: f32) -> Vec<egui::Rect> {
    let found = window.query_all_by_label_contains(word);
    let lines = found.map(|line| egui::Rect::from_x_y_ranges(left..=right, line.rect().y_range()));
    lines.collect()
}

/// Left, top, right and bottom in pixels of the panes that these snapshots show; others show the window.
const PARTS: [([u32; 4], &str); 15] = [
    ([0, 34, 210, 690], "favourites environments_many looks"),
    (
        [920, 34, 1280, 690],
        "lights sphere many_lights scopes scopes_empty waveform vectors effects effects_empty front",
    ),
    ([904, 34, 1280, 690], "export_empty export_filled export_error"),
    ([210, 540, 920, 690], "lanes curve"),
    ([210, 594, 920, 690], "lanes_zoomed log_empty"),
    (
        [210, 34, 920, 594],
        "aim wipe checkpoints false_colour region solo wiped_look color_view viewing four \
         four_viewed refusal job_alone uncalibrated checks",
    ),
    ([600, 34, 1100, 594], "color_views"),
    ([840, 34, 1280, 720], "review review_empty review_error expected_errors"),
    ([0, 594, 1280, 720], "job job_over"),
    ([0, 230, 1280, 720], "project_recent project_empty"),
    ([390, 270, 900, 450], "closing leaving"),
    ([380, 150, 900, 570], "palette"),
    ([360, 190, 930, 530], "path"),
    ([420, 700, 1840, 1440], "twice"),
    ([1400, 0, 1920, 1080], "1080"),
];

/// Compares a part of the window with its snapshot, see [`PARTS`], without the contents of `places`.
fn snapshot_without(window: &mut Window, name: &str, places: &[egui::Rect]) {
    let need = test_support::Need::Gpu;
    if !test_support::require(need, vulkan_adapter(), "no Vulkan adapter to draw with") {
        return;
    }
    if window.state().project().is_some() {
        until(window, "checks", |app| !app.check().is_waiting());
    }
    window.run();
    places.iter().for_each(|&place| window.mask(place));
    for timing in ["predicted in", "relit in"] {
        let Some(label) = window.query_by_label_contains(timing).map(|l| l.rect()) else { continue };
        window.mask(egui::Rect::from_min_size(label.min, vec2(190.0, label.height())));
    }
    let (threshold, pixels) = SNAPSHOT;
    let options = SnapshotOptions::new().threshold(threshold).max_failed_pixels(pixels);
    let mut picture = window.render().unwrap();
    let is_of = |names: &str| names.split(' ').any(|one| name.strip_prefix("studio_") == Some(one));
    if let Some(&([left, top, right, bottom], _)) = PARTS.iter().find(|(_, names)| is_of(names)) {
        let size = (right - left, bottom - top);
        picture = image::imageops::crop_imm(&picture, left, top, size.0, size.1).to_image();
    }
    image_snapshot_options(&picture, name, &options);
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        pack(name);
    }
}

/// Packs a snapshot that was renewed without loss; one without alpha was packed before.
fn pack(name: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/snapshots/{name}.png"));
    let picture = image::open(&file).unwrap();
    if !picture.color().has_alpha() {
        return;
    }
    let picture = picture.into_rgb8();
    let (mut bytes, best) = (Vec::new(), png::CompressionType::Best);
    let encoder = png::PngEncoder::new_with_quality(&mut bytes, best, png::FilterType::Adaptive);
    picture.write_with_encoder(encoder).unwrap();
    std::fs::write(&file, bytes).unwrap();
}

fn vulkan_adapter() -> bool {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = instance.enumerate_adapters(wgpu::Backends::VULKAN);
    !pollster::block_on(adapters).is_empty()
}

/// Environment in which no file dialog can open.
const NO_DIALOGS: [(&str, &str); 2] =
    [("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nonexistent"), ("PATH", "/nonexistent")];

/// Runs the named test of this program again, alone in its own process. True in that process, where the test continues.
fn alone(test: &str, variables: &[(&str, &str)]) -> bool {
    const ALONE: &str = "AFTERLIGHT_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return true;
    }
    let own = std::env::current_exe().unwrap();
    let mut command = std::process::Command::new(own);
    command.args(["--exact", test, "--nocapture"]).env(ALONE, "1");
    let done = command.envs(variables.iter().copied()).status().unwrap();
    assert!(done.success(), "{test}: {done}");
    false
}
