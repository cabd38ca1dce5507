//! Training in the window: started, paused, stopped, resumed and rolled back.

use super::{TRAINED, Window, clay, snapshot, snapshot_without, told_job, until, until_shown, window};
use afterlight::gpu::DeviceChoice;
use afterlight::progress::{LossPoint, TrainingPhase, TrainingPictures, TrainingPoint};
use afterlight::project::Project;
use afterlight::reflectance::Device;
use afterlight::reflectance::checkpoint::{self, CheckpointInfo, HeldOut, TrainingState};
use afterlight::studio::StudioApp;
use afterlight::training::Preset;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Rect};
use egui_kittest::kittest::Queryable;
use std::path::Path;
use std::sync::Arc;
use test_shoot::TestShoot;

fn calibrated(folder: &Path) -> Project {
    TestShoot::default().calibrate(folder, "project").0
}

fn until_step(window: &mut Window, least: u64) {
    until(window, "step of training", |app| {
        let point = app.training().point.as_ref();
        point.is_some_and(|point| point.losses.step >= least)
    });
}

/// Waits for the end of the job, and until its results on disk are read.
fn until_over(window: &mut Window) {
    until(window, "end of the job", |app| app.status().job.is_none() && app.training().is_current());
}

fn step_on_disk(project: &Project) -> u64 {
    checkpoint::info(&project.checkpoint_path()).unwrap().step
}

#[test]
fn training_says_what_it_will_look_like_and_cost_before_it_runs() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let mut window = window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "frame behind the preview", |app| {
        let read = matches!(app.footage().picture(), Some(Ok(_)));
        read && app.training().records.is_some()
    });
    crate::until_shown(&mut window);
    crate::live::until_idle(&mut window, "state before training");
    for what in ["Data", "Time", "Steps", "Memory", "Disk", "You see"] {
        window.get_by_label(what);
    }
    window.get_by_label("Start");
    snapshot(&mut window, "studio_training_preview");
}

#[test]
fn training_is_started_paused_resumed_stopped_and_gone_back_in() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let opened = project.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(opened), DeviceChoice::Cpu));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some());
    window.get_by_label("Not trained yet");
    // Duration and outlook of the training, over the interview's frame.
    window.get_by_label("10 min. Stop or pause at any time");
    window.get_by_label("as many as fit. The rate is known after the first seconds");
    window.get_by_label_contains("every 30 s; older checkpoints thin out");
    window.get_by_label_contains("the relit picture, renewed every 30 s");
    until(&mut window, "frame behind the preview", |app| matches!(app.footage().picture(), Some(Ok(_))));
    window.get_by_role_and_label(Role::ComboBox, "Hold out").click();
    window.run_steps(4);
    window.get_by_label("pose01").click();
    window.run_steps(2);
    let choice = window.state().state().look.training.unwrap();
    assert_eq!((choice.preset, choice.hold_out), (Preset::Quick, Some(1)));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!(window.state().state().look.training, None);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.run_steps(2);

    window.get_by_label("Start").click();
    until_step(&mut window, 3);
    let pictures = window.state().training().pictures.clone().unwrap();
    assert_eq!((pictures.pose, pictures.held_out), (1, true));
    assert_eq!((pictures.lamps(), pictures.size), (6, [32, 32]));
    assert!(pictures.truth.iter().any(|&v| v > 40));

    window.get_by_label("Pause").click();
    until(&mut window, "pause", |app| {
        app.status().log.iter().any(|line| line.sentence.starts_with("Paused after step"))
    });
    let paused = window.state().training().point.clone().unwrap().losses.step;
    window.run_steps(40);
    let still = window.state().training().point.clone().unwrap().losses.step;
    assert_eq!(still, paused);
    window.get_by_label("Resume").click();
    until_step(&mut window, paused + 2);
    window.get_by_label("Stop").click();
    until_over(&mut window);
    let first = step_on_disk(&project);
    assert!(first >= paused + 2);
    let records = window.state().training().records.clone().unwrap();
    assert!(records.kept.iter().any(|kept| kept.present && kept.info.step == first));
    let judged = records.present.as_ref().unwrap().held_out.unwrap();
    assert_eq!(judged.pose, 1);

    window.get_by_label("Resume").click();
    until_step(&mut window, first + 2);
    window.get_by_label("Stop").click();
    until_over(&mut window);
    let second = step_on_disk(&project);
    assert!(second > first);
    let points = window.state().training().history.points().to_vec();
    assert!(points.windows(2).all(|pair| pair[0].step < pair[1].step));
    assert_eq!(points.last().unwrap().step, second);

    window.get_by_label(&format!("Go back to step {first}")).click();
    // The last job's message stays until the next one starts.
    until(&mut window, "way back", |_| step_on_disk(&project) == first);
    until_over(&mut window);
    let history = &window.state().training().history;
    assert_eq!(history.points().last().unwrap().step, first);
    window.get_by_label(&format!("Go back to step {second}"));

    window.get_by_label("Start over…").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    window.get_by_label("Start over…").click();
    window.run_steps(2);
    window.get_by_label("Start over").click();
    until(&mut window, "first steps", |app| {
        let point = app.training().point.as_ref();
        point.is_some_and(|point| point.losses.step < first)
    });
    window.get_by_label("Stop").click();
    until_over(&mut window);
    let records = window.state().training().records.clone().unwrap();
    for step in [first, second] {
        let aside = |kept: &&afterlight::training::checkpoints::SavedCheckpoint| kept.aside && kept.info.step == step;
        assert!(records.kept.iter().find(aside).is_some(), "step {step}");
    }
}

const PACE: f64 = 0.1;

/// A project with the logs of `steps` steps, and checkpoints after a quarter, a half and all of them.
pub fn trained_project(folder: &Path, steps: u64) -> Project {
    let project = clay::project(folder, clay::environments(folder));
    std::fs::write(project.calibration_path(), "").unwrap();
    let shape = Preset::Quick.config().network(&project);
    let network = shape.init(0.2, &Device::flex());
    let keep = |folder: &Path, step: u64| {
        let info = CheckpointInfo {
            step,
            seconds: PACE * step as f64,
            scale: 1.0,
            training_frames: vec![0],
            network: shape.clone(),
            held_out: Some(HeldOut { pose: 0, step, decibels: decibels(step) }),
        };
        let state = TrainingState {
            average_weights: None,
            live_weights: checkpoint::weight_bytes(&network).unwrap(),
            optimizer: checkpoint::weight_bytes(&network).unwrap(),
        };
        checkpoint::save(folder, &info, &network, &state).unwrap();
    };
    keep(&project.checkpoint_path(), steps);
    for (number, step) in [(1, steps / 4), (2, steps / 2), (3, steps)] {
        let name = format!("checkpoints/{number:04}-step-{step:07}");
        keep(&folder.join(name), step);
    }
    let mut log = "step,seconds,loss_rec,loss_render,learning_rate,gradient_norm,taken\n".to_owned();
    let mut judged = "step,seconds,decibels\n".to_owned();
    for step in 1..=steps {
        let [olats, relit] = losses(step);
        let seconds = PACE * step as f64;
        log += &format!("{step},{seconds},{olats},{relit},1e-3,0.5,true\n");
        if step.is_multiple_of(100) {
            judged += &format!("{step},{seconds},{}\n", decibels(step));
        }
    }
    std::fs::write(folder.join("training.csv"), log).unwrap();
    std::fs::write(folder.join("held_out.csv"), judged).unwrap();
    project
}

/// A window on that project.
fn trained(folder: &Path, steps: u64) -> Window {
    let project = trained_project(folder, steps);
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some() && app.relit().is_some());
    until_shown(&mut window);
    window
}

/// Falling losses, with a ripple instead of noise.
fn losses(step: u64) -> [f32; 2] {
    let fall = 0.02 + 0.3 / (1.0 + step as f32 / 40.0);
    let ripple = |period: f32| 1.0 + 0.25 * (step as f32 * period).sin();
    [fall * ripple(1.7), 0.4 * fall * ripple(2.3)]
}

fn decibels(step: u64) -> f32 {
    34.0 - 12.0 / (1.0 + step as f32 / 300.0)
}

fn point(step: u64) -> TrainingPoint {
    let [olats, relit] = losses(step);
    TrainingPoint {
        losses: LossPoint {
            step,
            seconds: PACE * step as f64,
            reconstruction: Some(olats),
            rendering: Some(relit),
            held_out_db: None,
        },
        phase: TrainingPhase::Interview,
        learning_rate: 8.5e-4,
        gradient_norm: 0.482,
        steps_per_second: 1.0 / PACE,
        multiply_adds: 250_000_000,
        memory_bytes: Some(412_000_000),
        skipped_steps: 2,
        dead_lamps: vec![3, 17],
    }
}

/// A ball under 24 lamps, and the error of a network that is slightly too dark.
fn pictures() -> TrainingPictures {
    const SIDE: usize = 64;
    let mut truth = Vec::new();
    for i in 0..24 * SIDE * SIDE {
        let (x, y) = ((i % SIDE) as f32 - 31.5, (i / SIDE % SIDE) as f32 - 31.5);
        let turn = (i / SIDE / SIDE) as f32;
        let light = 0.6 + (x * turn.cos() + y * turn.sin()) / 60.0;
        let inside = x.hypot(y) < 26.0;
        let value = if inside { 220.0 * light.clamp(0.0, 1.0) } else { 0.0 };
        truth.extend([value as u8, (0.9 * value) as u8, (0.8 * value) as u8]);
    }
    TrainingPictures {
        step: 1200,
        pose: 0,
        held_out: true,
        size: [SIDE; 2],
        predicted: truth.iter().map(|&v| v - v / 12).collect(),
        truth: Arc::new(truth),
    }
}

#[test]
fn a_window_in_which_a_network_trains_looks_as_it_did() {
    let folder = crate::temporary();
    let mut window = trained(folder.path(), 1200);
    let job = told_job(&mut window);
    job.send(|progress| {
        (1201..1240).for_each(|step| progress.training(point(step)));
        progress.show(pictures());
    })
    .unwrap();
    until(&mut window, "point and pictures", |app| {
        let training = app.training();
        let last = training.history.points().last();
        training.pictures.is_some() && last.is_some_and(|point| point.step == 1239)
    });
    window.get_by_label_contains("Stuck at black or white: lamp 3, lamp 17.");
    window.get_by_label_contains("2 steps skipped: NaN or infinite values");
    window.key_press(Key::PageDown);
    window.run_steps(2);
    assert_eq!(window.state().state().shoot.trained_lamp, 1);
    window.get_by_label("Pause").click();
    window.run_steps(2);
    window.get_by_label_contains("paused, 37 % done");
    snapshot(&mut window, "studio_training_filled");
    window.key_press(Key::P);
    drop(job);
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    window.run_steps(2);
    window.get_by_label(TRAINED);
    window.get_by_label("Resume");
}

#[test]
fn a_training_that_nobody_touches_asks_for_no_frame() {
    let folder = crate::temporary();
    let mut window = trained(folder.path(), 400);
    until(&mut window, "panoramas", |app| app.environments().iter().all(|e| e.panorama.is_done()));
    window.run();
    for _ in 0..5 {
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(!window.ctx.has_requested_repaint());
        window.step();
        let wait = window.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
        assert!(wait > std::time::Duration::from_secs(3600), "{wait:?}");
    }
}

#[test]
fn an_empty_training_says_what_it_needs_and_offers_it() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some() && app.relit().is_some());
    window.get_by_label("Calibrate");
    // This shoot has no frames on disk, so the question has no backdrop.
    until(&mut window, "look at the interview", |app| app.footage().picture().is_some());
    until_shown(&mut window);
    snapshot(&mut window, "studio_training_empty");
}

#[test]
fn a_training_that_cannot_be_read_says_why() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    std::fs::write(project.calibration_path(), "").unwrap();
    let table = project.checkpoint_path().join("checkpoint.toml");
    std::fs::create_dir_all(project.checkpoint_path()).unwrap();
    std::fs::write(&table, "weights = 3\n").unwrap();
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some() && app.relit().is_some());
    window.get_by_label("The training cannot be read");
    let sentence = window.state().training().records.clone().unwrap();
    assert!(sentence.failure.as_ref().unwrap().contains("checkpoint.toml"));
    // The folder's name differs each time.
    let sentence = window.get_by_label_contains("checkpoint.toml").rect();
    let pane = Rect::from_x_y_ranges(12.0..=575.0, sentence.y_range());
    snapshot_without(&mut window, "studio_training_error", &[pane]);
}

#[test]
fn a_training_whose_time_is_up_is_given_more_or_refused() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let network = Preset::Quick.config().network(&project).init(0.2, &Device::flex());
    let info = CheckpointInfo {
        step: 6,
        seconds: 601.0,
        scale: 1.0,
        training_frames: vec![0, 1, 2],
        network: Preset::Quick.config().network(&project),
        held_out: None,
    };
    let weights = checkpoint::weight_bytes(&network).unwrap();
    let state = TrainingState { average_weights: None, live_weights: weights.clone(), optimizer: weights };
    checkpoint::save(&project.checkpoint_path(), &info, &network, &state).unwrap();
    let opened = project.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(opened), DeviceChoice::Cpu));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    until(&mut window, "what is on disk", |app| app.training().records.is_some());
    window.get_by_label("Time is up after 10 min.");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    assert!(window.state().status().job.is_none());
    window.get_by_label_contains("Trained for 10 min: time is up. Raise Minutes");
    window.get_by_label("Resume, +3 min").click();
    window.run_steps(3);
    let choice = window.state().state().look.training.unwrap();
    assert_eq!((choice.preset, choice.minutes), (Preset::Quick, Some(13.1)));
    until(&mut window, "job", |app| app.training().running || app.status().message.is_some());
}
