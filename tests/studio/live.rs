//! A responsive window: during drags, playback and rest, after a lost GPU, with a full disk.

use super::leaving::close;
use super::on_gpu::own_gpu;
use super::{MIDDLE, Window, clay, click_on, export, pointer, press, snapshot, told_job, until, until_shown, window};
use afterlight::Error;
use afterlight::evaluation::review::ReviewSettings;
use afterlight::gpu::DeviceChoice;
use afterlight::studio::{Pane, ProjectHandover, StudioApp, Workspace};
use afterlight::training::{TrainSettings, TrainingConfig};
use afterlight::worker::{Job, Latest};
use eframe::egui_wgpu::WgpuSetup;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, ViewportCommand, ViewportId, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use test_support::PATIENCE;

/// Waits until the relighter has made the requested picture, as it would between two frames of a window.
fn between_frames(window: &Window) {
    let started = Instant::now();
    while !window.state().worker().unwrap().has_picture() {
        assert!(started.elapsed() < PATIENCE, "no picture");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Independent of the time that a picture takes, which is measured elsewhere.
#[test]
fn a_drag_shows_each_move_with_no_older_picture_between_and_predicts_nothing() {
    let (_folder, mut window) = crate::shown_window();
    pointer(&window, 0.0, None);
    window.step();
    pointer(&window, 0.0, Some(true));
    window.run_steps(2);
    let mut before = window.state().state().look.yaw_deg;
    for step in 1..=60 {
        pointer(&window, step as f32, None);
        window.step();
        let asked = window.state().state().look.yaw_deg;
        assert_ne!(asked, before, "each move turns the light");
        let shown = |window: &Window| window.state().relit().unwrap().scene.yaw_deg;
        let mut pictures = 0;
        while shown(&window) != asked {
            assert_eq!(shown(&window), before, "an older move at {step}");
            between_frames(&window);
            window.step();
            pictures += 1;
        }
        // The previous move may have been shown at reduced size, and is then made again.
        assert!(pictures <= 2, "{pictures} pictures at {step}");
        let passes = &window.state().relit().unwrap().passes;
        assert!(passes.iter().all(|pass| pass.name != "predict" || !pass.ran));
        before = asked;
    }
    assert!((before - 60.0 * 0.4).abs() < 0.01, "{before}");
}

#[test]
fn what_is_predicted_is_played_at_the_rate_it_was_filmed_at() {
    let (_folder, mut window) = crate::new_window();
    for frame in 1..clay::FRAMES {
        window.key_press(Key::ArrowRight);
        until(&mut window, "the next frame", |app| app.relit().is_some_and(|relit| relit.scene.frame == frame));
    }
    window.key_press(Key::Home);
    until_shown(&mut window);
    let at_hand = &window.state().relit().unwrap().frames_at_hand;
    assert_eq!(at_hand.len(), clay::FRAMES);
    window.key_press(Key::Space);
    // A step of this window is a quarter of a second, the frame time of the clay.
    let mut shown = Vec::new();
    while shown.len() < 2 * clay::FRAMES {
        window.step();
        let app = window.state();
        let frame = app.state().frame;
        if app.relit().unwrap().scene.frame != frame {
            between_frames(&window);
        }
        if app.state().playback.playing {
            shown.push(frame);
        }
    }
    // The key press may draw frames before the first one is due.
    let begun = shown.iter().position(|&frame| frame == 1).unwrap();
    let shown = shown.split_off(begun);
    let steady = (0..shown.len()).map(|step| (1 + step) % clay::FRAMES);
    assert_eq!(shown, steady.collect::<Vec<_>>());
    window.get_by_label_contains("4 of 4 fps");
    // A slow machine shows fewer frames.
    for _ in 0..8 {
        let now = window.ctx.input(|input| input.time);
        window.input_mut().time = Some(now + 0.9);
        window.step();
        until(&mut window, "the played frame", |app| {
            app.relit().is_some_and(|relit| relit.scene.frame == app.state().frame)
        });
    }
    window.input_mut().time = None;
    assert!(window.query_by_label_contains("4 of 4 fps").is_none());
    window.get_by_label_contains(" of 4 fps");
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(window.query_by_label_contains(" of 4 fps").is_none());
    window.get_by_label_contains(", 4 fps");
}

/// Waits until no frame is requested.
pub fn until_idle(window: &mut Window, what: &str) {
    let started = Instant::now();
    let mut quiet = 0;
    while quiet < 4 {
        assert!(started.elapsed() < PATIENCE, "{what} asks for frames");
        std::thread::sleep(Duration::from_millis(40));
        let asked = window.ctx.has_requested_repaint();
        window.step();
        let wait = window.output().viewport_output[&ViewportId::ROOT].repaint_delay;
        let idle = !asked && wait > Duration::from_secs(3600);
        quiet = if idle { quiet + 1 } else { 0 };
    }
}

/// Switches to a workspace by shortcut.
pub fn enter(window: &mut Window, place: usize) {
    const KEYS: [Key; 5] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5];
    window.key_press_modifiers(Modifiers::COMMAND, KEYS[place]);
    window.run_steps(3);
    assert_eq!(window.state().state().panes.workspace, Workspace::ALL[place]);
}

/// Opens a pane from the palette.
pub fn open(window: &mut Window, pane: Pane) {
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    window.run_steps(3);
    window.event(Event::Text(format!("panel {}", pane.name())));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert!(!window.state().state().covers.palette);
    assert_eq!(window.state().state().panes.active, pane);
}

#[test]
fn nothing_that_is_shown_asks_for_frames_while_nothing_happens() {
    let (mut window, _root, _folder) = export::opened();
    for (place, workspace) in Workspace::ALL.into_iter().enumerate() {
        enter(&mut window, place);
        until_idle(&mut window, workspace.name());
    }
    enter(&mut window, 2);
    for pane in Pane::ALL {
        open(&mut window, pane);
        until_idle(&mut window, pane.name());
    }
}

/// Number of visible controls. Checks that each has a name.
fn named_controls(window: &Window) -> usize {
    window.check_accessibility();
    let controls = window.root().children_recursive();
    let inputs = controls.filter(|node| egui::accessibility::is_input(node.accesskit_node().role()));
    inputs.count()
}

#[test]
fn every_control_of_every_workspace_pane_menu_and_dialog_has_a_name() {
    let (mut window, _root, _folder) = export::opened();
    for place in 0..Workspace::ALL.len() {
        enter(&mut window, place);
        until_idle(&mut window, "the workspace");
        let plain = named_controls(&window);
        assert!(plain > 10, "{plain} controls");
        click_on(&mut window, "Panels");
        window.get_by_label("Reset layout");
        named_controls(&window);
        window.key_press(Key::Escape);
        window.run_steps(3);
        assert!(window.query_by_label("Reset layout").is_none());
        for role in [Role::ComboBox, Role::DisclosureTriangle] {
            for list in 0..window.query_all_by_role(role).count() {
                if let Some(list) = window.query_all_by_role(role).nth(list) {
                    list.click_accesskit();
                }
                window.run_steps(3);
                named_controls(&window);
                window.key_press(Key::Escape);
                window.run_steps(3);
            }
        }
        for pane in Pane::ALL {
            open(&mut window, pane);
            named_controls(&window);
        }
    }
    window.key_press(Key::Questionmark);
    window.run_steps(3);
    named_controls(&window);
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    window.run_steps(3);
    named_controls(&window);
    window.key_press(Key::Escape);
    window.run_steps(2);
    open(&mut window, Pane::Project);
    click_on(&mut window, "New project…");
    window.get_by_label_contains("Choose the shoot's folder, or bring its parts");
    named_controls(&window);
}

#[test]
fn a_job_that_waits_for_room_says_what_to_do_and_is_let_go_on() {
    let (_folder, mut window) = crate::shown_window();
    let job = told_job(&mut window);
    job.send(|progress| {
        let mut full = true;
        let written = progress.retry(|| {
            let remedy = "Check that the folder can be written and the disk has room";
            let failure = Error::io("write", "checkpoint/live.bpk", std::io::ErrorKind::StorageFull.into(), remedy);
            if std::mem::take(&mut full) { Err(failure) } else { Ok(()) }
        });
        progress.step("training", 500, 1000, format!("{written:?}"));
    })
    .unwrap();
    until(&mut window, "the pause", |app| app.status().job.as_ref().is_some_and(|work| work.held.is_some()));
    assert!(window.state().status().job.as_ref().unwrap().is_paused());
    window.get_by_label_contains("cannot write checkpoint/live.bpk");
    window.get_by_label("Resume").click();
    until(&mut window, "the step after it", |app| app.status().job.as_ref().is_some_and(|work| work.note == "Ok(())"));
    window.run_steps(2);
    assert!(window.query_by_label_contains("cannot write").is_none());
    drop(job);
}

#[test]
fn a_window_whose_gpu_is_lost_draws_nothing_closes_and_leaves_its_project() {
    let Some(gpu) = own_gpu() else { return };
    let (device, setup) = (gpu.device.clone(), WgpuSetup::Existing(gpu));
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let left = ProjectHandover::new(Latest::new(|| {}));
    let next = left.clone();
    let mut window = Harness::builder().with_size(vec2(1280.0, 720.0)).wgpu_setup(setup).build_eframe(|cc| {
        StudioApp::over(&cc.egui_ctx, project, clay::source).replaced_by(next, Some("opened again"))
    });
    until(&mut window, "first picture", |app| app.relit().is_some());
    until_shown(&mut window);
    window.get_by_label("opened again");
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(3);
    let chosen = window.state().state().look.environment;
    assert_ne!(chosen, 0);
    assert!(left.take().is_none() && !window.output().shapes.is_empty());

    device.destroy();
    window.step();
    let output = window.output();
    assert!(output.shapes.is_empty());
    let commands = &output.viewport_output[&ViewportId::ROOT].commands;
    assert!(commands.contains(&ViewportCommand::Close));
    let project = left.take().unwrap().unwrap();
    assert_eq!(project.settings.name, "clay");
    drop(window);
    let again = self::window(|ctx| StudioApp::over(ctx, project, clay::source));
    assert_eq!(again.state().state().look.environment, chosen, "the look was kept");
}

#[test]
fn at_twice_the_pixels_the_window_is_as_sharp_as_its_display() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = Harness::builder()
        .with_size(vec2(1280.0, 720.0))
        .with_pixels_per_point(2.0)
        .build_eframe(|cc| StudioApp::over(&cc.egui_ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    // The timeline marks predicted frames.
    for _ in 0..3 {
        window.key_press(Key::ArrowRight);
        until_shown(&mut window);
    }
    snapshot(&mut window, "studio_twice");
}

#[test]
fn a_larger_window_gives_its_room_to_the_picture() {
    let (_folder, mut window) = crate::shown_window();
    let picture = |window: &Window| window.get_by_label("Relit picture").rect().size();
    let small = picture(&window);
    window.set_size(vec2(1920.0, 1080.0));
    window.run_steps(4);
    until_shown(&mut window);
    let large = picture(&window);
    let more = vec2(1920.0 - 1280.0, 1080.0 - 720.0);
    assert!(large.x - small.x > 0.6 * more.x && large.y - small.y > 0.6 * more.y, "{small} became {large}");
    snapshot(&mut window, "studio_1080");
}

#[test]
fn a_drag_turns_by_what_comes_between_press_and_release() {
    let (_folder, mut window) = crate::shown_window();
    let right = |points: f32| MIDDLE + vec2(points, 0.0);
    for place in ["picture", "panorama"] {
        let (at, per_point) = match place {
            "picture" => (MIDDLE, 0.4),
            _ => {
                let panorama = window.get_by_label("Environment map").rect();
                (panorama.center() - vec2(40.0, 0.0), 360.0 / panorama.width())
            }
        };
        let to = |points: f32| at + right(points).to_vec2() - MIDDLE.to_vec2();
        window.event(Event::PointerMoved(at - vec2(60.0, 0.0)));
        window.run_steps(2);
        // One slow frame of the window receives all events at once.
        let events = [Event::PointerMoved(at), press(at, true), Event::PointerMoved(to(20.0))];
        window.input_mut().events.extend(events);
        window.run_steps(3);
        let events = [Event::PointerMoved(to(50.0)), press(to(50.0), false), Event::PointerMoved(to(75.0))];
        window.input_mut().events.extend(events);
        window.run_steps(4);
        let yaw = window.state().state().look.yaw_deg;
        assert!((yaw - 50.0 * per_point).abs() < 0.01, "{place}: {yaw}");
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
        assert_eq!(window.state().state().look.yaw_deg, 0.0, "{place}");
    }
}

/// Draws frames until the window requests none, like a system without events.
fn as_asked(window: &mut Window) {
    let started = Instant::now();
    let mut quiet = 0;
    while quiet < 10 {
        assert!(started.elapsed() < PATIENCE, "the window asks for frames");
        std::thread::sleep(Duration::from_millis(40));
        let wait = window.output().viewport_output[&ViewportId::ROOT].repaint_delay;
        if window.ctx.has_requested_repaint() || wait < Duration::from_secs(1) {
            window.step();
            quiet = 0;
        } else {
            quiet += 1;
        }
    }
}

#[test]
fn where_a_drag_ends_is_shown_without_another_event() {
    let (_folder, mut window) = crate::shown_window();
    for place in ["picture", "panorama"] {
        let panorama = window.get_by_label("Environment map").rect();
        let at = match place {
            "picture" => MIDDLE,
            _ => panorama.center() - vec2(40.0, 0.0),
        };
        let to = at + vec2(30.0, 0.0);
        for event in [Event::PointerMoved(at), press(at, true), Event::PointerMoved(to), press(to, false)] {
            window.event(event);
            window.step();
        }
        // Only frames requested by the window remain.
        as_asked(&mut window);
        let drawn = window.render().unwrap();
        window.run_steps(6);
        let [x, y, width, height] =
            [panorama.left(), panorama.top(), panorama.width(), panorama.height()].map(|points| points as u32);
        let crop = |of: &image::RgbaImage| image::imageops::crop_imm(of, x, y, width, height).to_image();
        let later = window.render().unwrap();
        assert_eq!(crop(&drawn), crop(&later), "{place}");
    }
}

#[test]
fn a_close_that_would_end_work_is_asked_about_once() {
    let (_folder, mut window) = crate::shown_window();
    assert!(!close(&mut window), "nothing would be lost");
    let job = told_job(&mut window);
    assert!(close(&mut window));
    window.run_steps(2);
    window.get_by_label_contains("Training the network: training at 37 %. It stops");
    snapshot(&mut window, "studio_closing");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.query_by_label("Close anyway").is_none());
    assert!(close(&mut window));
    window.run_steps(2);
    window.get_by_label("Keep working").click();
    window.run_steps(2);
    assert!(window.query_by_label("Close anyway").is_none());
    assert!(close(&mut window));
    assert!(!close(&mut window), "the second time it closes");
    window.run_steps(2);
    window.get_by_label("Close anyway").click();
    let commands = |window: &Window| {
        let commands = &window.output().viewport_output[&ViewportId::ROOT].commands;
        commands.contains(&ViewportCommand::Close)
    };
    let closed = (0..4).any(|_| {
        window.step();
        commands(&window)
    });
    assert!(closed);
    drop(job);
}

#[test]
fn nothing_moves_as_jobs_come_and_go() {
    let (_folder, mut window) = crate::shown_window();
    let places =
        |window: &Window| ["Play", "Relit picture", "Keys ?", "Panels"].map(|name| window.get_by_label(name).rect());
    let before = places(&window);
    let job = told_job(&mut window);
    window.run_steps(2);
    assert_eq!(places(&window), before);
    window.get_by_label("Stop");
    drop(job);
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    window.run_steps(2);
    assert_eq!(places(&window), before);
    window.get_by_label_contains("Trained for 10 min, 3250 steps");
    window.get_by_label("Close").click();
    window.run_steps(2);
    assert!(window.query_by_label_contains("3250 steps").is_none());
}

/// Name and processor time in seconds of a process or thread, from its folder in `/proc`; None once it has ended.
#[cfg(target_os = "linux")]
fn processor_time(folder: &Path) -> Option<(String, f64)> {
    let stat = std::fs::read_to_string(folder.join("stat")).ok()?;
    let (_, named) = stat.split_once(" (").unwrap();
    let (name, after_name) = named.rsplit_once(')').unwrap();
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    let ticks = fields[11..13].iter().map(|t| t.parse::<f64>().unwrap());
    // Linux counts processor time in hundredths of a second.
    Some((name.to_owned(), ticks.sum::<f64>() / 100.0))
}

/// Processor time of this process within `time`, in seconds, and the threads that used it.
#[cfg(target_os = "linux")]
fn spent_within(time: Duration) -> (f64, String) {
    let own = || processor_time(Path::new("/proc/self")).unwrap().1;
    let threads = || -> BTreeMap<PathBuf, (String, f64)> {
        let folders = std::fs::read_dir("/proc/self/task").unwrap();
        let folders = folders.map(|folder| folder.unwrap().path());
        folders.filter_map(|f| processor_time(&f).map(|time| (f, time))).collect()
    };
    let (before, before_by_thread) = (own(), threads());
    std::thread::sleep(time);
    let (after, after_by_thread) = (own(), threads());
    let busy = after_by_thread.into_iter().filter_map(|(f, (name, now))| {
        let spent = now - before_by_thread.get(&f).map_or(0.0, |(_, before)| *before);
        (spent > 0.0).then(|| format!("{name} {spent:.2} s"))
    });
    (after - before, busy.collect::<Vec<_>>().join(", "))
}

#[cfg(target_os = "linux")]
#[test]
fn a_window_at_rest_leaves_the_processor_alone() {
    if !super::alone("live::a_window_at_rest_leaves_the_processor_alone", &[]) {
        return;
    }
    // As in the program, the network may use the window's GPU.
    let Some(gpu) = own_gpu() else { return };
    afterlight::gpu::Gpu::share(afterlight::gpu::WgpuSetup {
        instance: gpu.instance.clone(),
        backend: gpu.adapter.get_info().backend,
        adapter: gpu.adapter.clone(),
        device: gpu.device.clone(),
        queue: gpu.queue.clone(),
    });
    let (_folder, project) = export::trained();
    let mut window =
        Harness::builder().with_size(vec2(1280.0, 720.0)).wgpu_setup(WgpuSetup::Existing(gpu)).build_eframe(|cc| {
            // A software adapter works too: burn's threads are the same.
            let app = StudioApp::new(&cc.egui_ctx, Some(project), DeviceChoice::Gpu);
            app.drawn_with(cc.wgpu_render_state.clone().unwrap())
        });
    until(&mut window, "first picture", |app| app.relit().is_some());
    until_shown(&mut window);
    // Reads by other threads come first, and a slow disk delays them. The first ten quiet seconds count.
    let rests = |window: &mut Window, what: &str| {
        let started = Instant::now();
        loop {
            until_idle(window, what);
            let (mut spent, mut threads) = spent_within(Duration::from_millis(500));
            if spent < 0.02 {
                (spent, threads) = spent_within(Duration::from_secs(10));
                println!("{what}: {spent:.2} s of the processor in ten idle seconds: {threads}");
                if spent < 0.1 {
                    break;
                }
            }
            assert!(started.elapsed() < PATIENCE, "{what} never rests: {threads}");
        }
    };
    for (place, workspace) in Workspace::ALL.into_iter().enumerate() {
        enter(&mut window, place);
        rests(&mut window, workspace.name());
    }
    let root = window.state().project().unwrap().root.clone();
    let training = |fresh| Job::Train {
        project: root.clone(),
        settings: TrainSettings {
            config: TrainingConfig { epochs: if fresh { 1 } else { 2 }, ..export::smallest_config() },
            exclude_frames: Vec::new(),
            hold_out: None,
            fresh,
            device: DeviceChoice::Gpu,
        },
    };
    let review = Job::Review {
        project: root.clone(),
        settings: ReviewSettings { truth: None, fresh: true, report: None, device: DeviceChoice::Gpu },
    };
    for (what, job) in
        [("after training", training(true)), ("after resuming it", training(false)), ("after measuring", review)]
    {
        window.state().worker().unwrap().run(job).unwrap();
        until(&mut window, what, |app| app.status().message.is_some() && app.status().job.is_none());
        rests(&mut window, what);
        if let Some(close) = window.query_by_label("Close") {
            close.click();
        }
        window.run_steps(2);
    }
}
