//! Exports with the mouse only and with keys only, with a network trained for seconds.

use super::{
    Window, click_on, go, plain_drag, retype, scroll_to, snapshot, told_job, type_into, until, until_drawn,
    until_labelled, until_said, until_shown, window,
};
use afterlight::Error;
use afterlight::color_config::ColorChoice;
use afterlight::compositor::Storage;
use afterlight::export::relight::{RelightSettings, relight};
use afterlight::export::{Files, provenance_of, rebuilt};
use afterlight::gpu::DeviceChoice;
use afterlight::imaging::file::{read_encoded, read_linear};
use afterlight::progress::{Control, Progress, Report};
use afterlight::project::Project;
use afterlight::scene::{Background, Look};
use afterlight::studio::{StudioApp, WindowParts};
use afterlight::training::{Preset, TrainSettings, TrainingConfig, train};
use afterlight::worker::{ExportStatus, Origin, WrittenExport};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::mpsc::{Sender, channel};
use tempfile::TempDir;
use test_shoot::TestShoot;

/// A network with a few seconds of training.
pub fn smallest_config() -> TrainingConfig {
    TrainingConfig { width: 8, most_channels: 16, epochs: 1, minutes: None, ..Preset::Quick.config() }
}

/// A project of four frames with such a network. It is made once; each test gets a copy.
pub fn trained() -> (TempDir, Project) {
    static MADE: OnceLock<(TempDir, Project)> = OnceLock::new();
    let (made, _) = MADE.get_or_init(|| {
        let (folder, silent) = (crate::temporary(), Progress::silent());
        let shoot = TestShoot { frames: 4, ..TestShoot::default() };
        let (project, found) = shoot.calibrate(folder.path(), "film");
        let settings = TrainSettings {
            config: smallest_config(),
            exclude_frames: Vec::new(),
            hold_out: None,
            fresh: false,
            device: DeviceChoice::Cpu,
        };
        train(&project, &found, &settings, &silent).unwrap();
        (folder, project)
    });
    let folder = crate::temporary();
    test_support::copy_folder(made.path(), folder.path());
    let project = Project::open(&folder.path().join("film")).unwrap();
    (folder, project)
}

pub fn opened() -> (Window, PathBuf, TempDir) {
    let (folder, project) = trained();
    open(folder, project)
}

/// The same with an OpenColorIO configuration.
pub fn opened_with_configuration() -> (Window, PathBuf, TempDir) {
    let (folder, project) = trained();
    let config = Some(Path::new("ocio://default"));
    Project::change(&project.root, |project| project.set_color_config(config)).unwrap();
    let project = Project::open(&project.root).unwrap();
    open(folder, project)
}

fn open(folder: TempDir, project: Project) -> (Window, PathBuf, TempDir) {
    let root = project.root.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu));
    until(&mut window, "first picture", |app| app.relit().is_some());
    until_shown(&mut window);
    (window, root, folder)
}

/// Waits until all exports have ended.
pub fn until_exported(window: &mut Window, count: usize) {
    window.run_steps(2);
    until(window, "end of the exports", |app| {
        let over = app.exports().iter().filter(|e| e.status.sentence().is_some());
        over.count() == count && app.exports().len() == count
    });
}

/// File names with this prefix, without their folder.
fn files(root: &Path, begin: &str) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(root.join("exports")) else { return Vec::new() };
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.filter(|name| name.trim_start_matches('.').starts_with(begin)).collect();
    names.sort();
    names
}

pub fn type_name(window: &mut Window, name: &str) {
    window.get_by_role_and_label(Role::TextInput, "Name").click();
    window.run_steps(2);
    retype(window, name);
    window.key_press(Key::Enter);
    window.run_steps(2);
}

/// Changes the colours of the files from `now`.
pub fn choose_colors(window: &mut Window, now: &str, other: &str) {
    let now = format!("Colours: {now}");
    window.get_by_role_and_label(Role::ComboBox, &now).click();
    window.run_steps(3);
    until_labelled(window, other);
    window.run_steps(4);
    click_on(window, other);
}

fn sentence(window: &Window, export: usize) -> String {
    let standing = &window.state().exports()[export].status;
    standing.sentence().unwrap_or_default().to_owned()
}

#[test]
fn two_frames_are_exported_with_the_mouse_and_nothing_that_is_there_is_lost() {
    let (mut window, root, _folder) = opened();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    type_name(&mut window, "exports/mouse");
    window.get_by_role_and_label(Role::SpinButton, "Out").click();
    window.run_steps(2);
    retype(&mut window, "1");
    window.key_press(Key::Enter);
    window.run_steps(2);
    assert_eq!(window.state().state().look.range, Some((0, 1)));
    window.get_by_label_contains("2 frames: mouse.0000.png … mouse.0001.png");
    let button = window.get_by_label("Add to queue").rect();
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 1);
    let ExportStatus::Done(WrittenExport { folder, .. }) = &window.state().exports()[0].status else {
        panic!("{:?}", window.state().exports());
    };
    assert_eq!(*folder, root.join("exports"));
    let first = ["mouse.0000.png", "mouse.0001.png"];
    assert_eq!(files(&root, "mouse"), first);
    window.get_by_label("Open folder mouse.0000–0001.png");

    // The same export again gets a new name, unless it may replace the files.
    let bytes = |name: &str| std::fs::read(root.join("exports").join(name)).unwrap();
    let before = bytes(first[0]);
    until_said(&mut window, "2 frames: mouse_2.0000.png");
    // A different light.
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(4);
    until_shown(&mut window);
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 2);
    assert_eq!(window.state().exports()[1].name, "mouse_2.0000–0001.png");
    assert_eq!(files(&root, "mouse").len(), 4);
    assert_eq!(bytes(first[0]), before);
    assert_ne!(bytes("mouse_2.0000.png"), before);
    until_said(&mut window, "2 frames: mouse_3.0000.png");

    scroll_to(&mut window, "Existing files Replace");
    window.get_by_label("Existing files Replace").click();
    window.run_steps(2);
    until_said(&mut window, "Replaces 2 files: mouse.0000.png");
    assert_eq!(window.get_by_label("Add to queue").rect(), button, "nothing moves");
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 3);
    assert_eq!(files(&root, "mouse").len(), 4);
    assert_eq!(bytes(first[0]), bytes("mouse_2.0000.png"));
    // Consent to replace ends with the export.
    until_said(&mut window, "2 frames: mouse_3.0000.png");
    window.get_by_label("Clear finished").click();
    window.run_steps(4);
    assert!(window.state().exports().is_empty());
}

#[test]
fn plates_keep_their_numbers_unless_another_first_number_is_typed() {
    let (folder, project) = trained();
    for inside in ["interview", "interview_masks"] {
        for frame in 0..4 {
            let file = |name: String| folder.path().join("shoot").join(inside).join(name);
            let numbered = file(format!("plate.{}.png", 1001 + frame));
            std::fs::rename(file(format!("frame_{frame:03}.png")), numbered).unwrap();
        }
    }
    let rename = |project: &mut Project| {
        let names = (1001..1005).map(|number| format!("plate.{number}"));
        project.settings.shoot.frames = names.collect::<Vec<_>>().into();
        Ok(())
    };
    Project::change(&project.root, rename).unwrap();
    let project = Project::open(&project.root).unwrap();
    let (mut window, root, _folder) = open(folder, project);
    until_labelled(&mut window, "plate 1001");
    go(&mut window, Key::ArrowRight, 1);
    window.get_by_label("plate 1002");
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    type_name(&mut window, "exports/own");
    window.get_by_label_contains("4 frames: own.1001.png … own.1004.png");
    let first = (Role::SpinButton, "First number");
    scroll_to(&mut window, "First number");
    type_into(&mut window, first, "-1");
    window.get_by_label_contains("4 frames: own.-001.png … own.0002.png");
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 1);
    assert_eq!(window.state().exports()[0].name, "own.-001–0002.png");
    let names = ["own.-001.png", "own.0000.png", "own.0001.png", "own.0002.png"];
    assert_eq!(files(&root, "own"), names);
    until_said(&mut window, "4 frames: own_2.-001.png");
    window.get_by_role_and_label(Role::RadioButton, "First number Plate's").click();
    window.run_steps(4);
    window.get_by_label_contains("4 frames: own.1001.png … own.1004.png");
    until_drawn(&mut window, "free name", |window| {
        window.get_by_label("Existing files Keep").accesskit_node().is_disabled()
    });
    window.run_steps(2);
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 2);
    assert_eq!(window.state().exports()[1].name, "own.1001–1004.png");
    assert_eq!(files(&root, "own").len(), 8);
}

/// Presses the tab key until the control of this name has the focus.
fn tab_to(window: &mut Window, role: Role, name: &str) {
    // Once around the whole window.
    for _ in 0..150 {
        window.key_press(Key::Tab);
        window.run_steps(3);
        let there = window.query_by_role_and_label(role, name);
        if there.is_some_and(|control| control.is_focused()) {
            return;
        }
    }
    panic!("the tab key does not reach {name}");
}

fn press(window: &mut Window, key: Key) {
    window.key_press(key);
    window.run_steps(3);
}

#[test]
fn keys_alone_lead_through_an_export() {
    let (mut window, root, _folder) = opened();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num5);
    window.run_steps(2);
    tab_to(&mut window, Role::SpinButton, "In");
    retype(&mut window, "1");
    tab_to(&mut window, Role::SpinButton, "Out");
    retype(&mut window, "2");
    tab_to(&mut window, Role::RadioButton, "Format EXR");
    press(&mut window, Key::Space);
    tab_to(&mut window, Role::SpinButton, "Size");
    retype(&mut window, "24");
    tab_to(&mut window, Role::RadioButton, "Background None");
    press(&mut window, Key::Space);
    tab_to(&mut window, Role::RadioButton, "Layers By lamp");
    press(&mut window, Key::Space);
    // New rows appear above it, and the focus stays.
    (0..2).for_each(|_| press(&mut window, Key::Tab));
    let nuke = window.get_by_role_and_label(Role::CheckBox, "Nuke");
    assert!(nuke.is_focused());
    press(&mut window, Key::Space);
    tab_to(&mut window, Role::TextInput, "Name");
    retype(&mut window, "exports/keys");
    let order = window.state().state().export_options.clone();
    let range = window.state().state().look.range;
    assert_eq!((range, order.size), (Some((1, 2)), Some(24)));
    assert_eq!(order.background, Some(Background::None));
    let state = window.state().state();
    assert!(state.panes.parts == WindowParts::All && !state.playback.playing);
    tab_to(&mut window, Role::Button, "Add to queue");
    press(&mut window, Key::Enter);
    until_exported(&mut window, 1);
    let written = ["keys.0001.exr", "keys.0002.exr", "keys.nk"];
    assert_eq!(files(&root, "keys"), written);
    let said = sentence(&window, 0);
    assert!(said.contains("2 frames") && said.contains("6 light layers"), "{said}");
    assert_eq!(rebuilt(&root.join("exports/keys.0001.exr")).unwrap().size(), (24, 24));

    // Ctrl+Enter adds an export from a text field as from a button; Esc leaves the controls.
    tab_to(&mut window, Role::TextInput, "Name");
    retype(&mut window, "exports/more");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    until_exported(&mut window, 2);
    assert_eq!(files(&root, "more").len(), 3);
    tab_to(&mut window, Role::Button, "Remove keys.0001–0002.exr");
    press(&mut window, Key::Space);
    assert_eq!(window.state().exports().len(), 1);
    press(&mut window, Key::Escape);
    press(&mut window, Key::ArrowRight);
    assert_eq!(window.state().state().frame, 1);
    press(&mut window, Key::I);
    press(&mut window, Key::ArrowRight);
    press(&mut window, Key::O);
    assert_eq!(window.state().state().look.range, Some((1, 2)));
    tab_to(&mut window, Role::SpinButton, "In");
}

#[test]
fn an_export_is_what_was_shown_when_it_was_added() {
    let (mut window, root, _folder) = opened();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    let add = |window: &mut Window, name: &str| {
        type_name(window, name);
        click_on(window, "Add to queue");
    };
    add(&mut window, "exports/plain");
    until_exported(&mut window, 1);
    let job = told_job(&mut window);
    add(&mut window, "exports/then");
    for key in [Key::E, Key::E, Key::R] {
        press(&mut window, key);
    }
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(2);
    add(&mut window, "exports/now");
    assert_eq!(window.state().exports()[1].status, ExportStatus::Waiting);
    drop(job);
    until_exported(&mut window, 3);
    let bytes = |name: &str| std::fs::read(root.join("exports").join(name)).unwrap();
    assert_eq!(bytes("plain.0003.png"), bytes("then.0003.png"));
    let now = image::open(root.join("exports/now.0003.png")).unwrap().into_rgb8();
    assert_ne!(bytes("now.0003.png"), bytes("then.0003.png"));
    let grey = now.pixels().all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]);
    assert!(!grey, "a viewed channel is not exported");
}

fn settings(to: String) -> RelightSettings {
    RelightSettings {
        environment: PathBuf::from("nave"),
        read: None,
        front: None,
        mapping: None,
        environment_layer: None,
        look: Look { yaw_deg: 30.0, exposure_stops: 1.0, ..Look::default() },
        turntable: false,
        solo: Vec::new(),
        frames: None,
        files: Files::to(to).unwrap(),
        hand_over: Vec::new(),
        profile: false,
        device: DeviceChoice::Cpu,
        storage: Storage::default(),
    }
}

/// Pixels of a file, and its metadata.
fn contents(file: &Path) -> (Vec<[f32; 3]>, Option<String>) {
    let pixels = if file.extension().unwrap() == "exr" {
        read_linear(file).unwrap().pixels
    } else {
        read_encoded(file).unwrap().0.pixels
    };
    (pixels, provenance_of(file))
}

#[test]
fn an_export_by_a_configuration_is_what_the_command_line_writes_whatever_is_looked_through() {
    const VIEW: &str = "ACES 2.0 - SDR 100 nits (Rec.709)";
    let (mut window, root, _folder) = opened_with_configuration();
    let file = |name: &str| root.join("exports").join(name);
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    let export = |window: &mut Window, name: &str, count: usize| {
        type_name(window, &format!("exports/{name}"));
        window.get_by_label("Add to queue").click();
        until_exported(window, count);
        let status = &window.state().exports()[count - 1].status;
        assert!(matches!(status, ExportStatus::Done(_)), "{status:?}");
    };
    export(&mut window, "plain", 1);
    super::viewing::look_through_view(&mut window);
    export(&mut window, "looked", 2);
    let plain = contents(&file("plain.0000.png"));
    assert!(plain == contents(&file("looked.0000.png")), "viewing settings must not be exported");

    choose_colors(&mut window, "sRGB", VIEW);
    window.get_by_label_contains(&format!("Writes the view {VIEW} for sRGB - Display"));
    assert!(window.query_by_role_and_label(Role::TextInput, "LUT").is_none());
    // The reverse: export colours do not change the view.
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(4);
    until_shown(&mut window);
    assert!(window.state().state().display.viewing.is_neutral());
    export(&mut window, "view", 3);
    assert!(plain.0 != contents(&file("view.0000.png")).0);

    // An EXR holds no view; its colours are a space.
    window.get_by_role_and_label(Role::RadioButton, "Format EXR").click();
    window.run_steps(4);
    choose_colors(&mut window, "Linear Rec. 709", "ACEScg (scene_linear)");
    window.get_by_label_contains("Writes linear light in ACEScg");
    export(&mut window, "space", 4);

    let project = Project::open(&root).unwrap();
    let look = &window.state().state().look;
    let environment = match &look.environments[look.environment].origin {
        Origin::File(file) => file.clone(),
        Origin::BuiltIn(own) => PathBuf::from(own.name),
    };
    let view = ColorChoice { view: Some(VIEW.to_owned()), ..ColorChoice::default() };
    let space = ColorChoice { space: Some("scene_linear".to_owned()), ..ColorChoice::default() };
    for (name, ending, ocio) in [("view", "png", view), ("space", "exr", space)] {
        let to = file(&format!("command-{name}.%04d.{ending}"));
        let mut asked = RelightSettings {
            environment: environment.clone(),
            look: Look {
                yaw_deg: look.yaw_deg,
                exposure_stops: look.exposure_stops,
                background: look.background.clone(),
                ..Look::default()
            },
            ..settings(to.display().to_string())
        };
        asked.files.ocio = ocio;
        relight(&project, &asked, &Progress::silent()).unwrap();
        for frame in 0..4 {
            let [window, command] = [name.to_owned(), format!("command-{name}")]
                .map(|stem| contents(&file(&format!("{stem}.{frame:04}.{ending}"))));
            assert!(window.0 == command.0, "pixels of {name} {frame}");
            assert_eq!(window.1, command.1, "{name} {frame}");
        }
    }
}

#[test]
fn grain_is_in_the_way_of_an_export_by_a_configuration_and_that_is_said() {
    let (mut window, _root, _folder) = opened_with_configuration();
    let grain = window.get_by_role_and_label(Role::SpinButton, "Grain");
    grain.scroll_to_me();
    window.run_steps(4);
    let grain = window.get_by_role_and_label(Role::SpinButton, "Grain");
    let from = grain.rect().center();
    let to = from + egui::vec2(60.0, 0.0);
    plain_drag(&mut window, from, to);
    assert!(window.state().state().look.effects.grain > 0.0);
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    choose_colors(&mut window, "sRGB", "Un-tone-mapped");
    window.get_by_label_contains("Grain cannot go through an OpenColorIO configuration");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    assert!(window.state().exports().is_empty());
    choose_colors(&mut window, "Un-tone-mapped", "sRGB");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    until_exported(&mut window, 1);
}

#[test]
fn a_stop_in_the_middle_keeps_the_stills_that_are_finished_and_no_movie() {
    let (_folder, project) = trained();
    for (name, ending, kept) in [("stopped", ".%04d.png", 2), ("stopped clip", ".mp4", 0)] {
        if kept == 0 && !test_support::ffmpeg() {
            return;
        }
        let to = project.root.join("exports").join(name).display().to_string() + ending;
        let control = Control::default();
        let stop = control.clone();
        let sink = move |report: Report| {
            if matches!(report, Report::Step { done: 1, .. }) {
                stop.stop();
            }
        };
        let stopped = relight(&project, &settings(to), &Progress::new(&sink, control));
        let error = stopped.unwrap_err();
        let Error::Cancelled { kept: said } = &error else {
            panic!("{error}");
        };
        let wanted = if kept > 0 { "2 frames are kept" } else { "no movie" };
        assert!(said.contains(wanted), "{said}");
        assert_eq!(files(&project.root, &format!("{name}.")).len(), kept);
    }
}

#[test]
fn light_layers_are_exported_behind_effects_and_a_background() {
    let (_folder, project) = trained();
    let to = project.root.join("exports/lit.%04d.exr").display().to_string();
    let mut settings = settings(to);
    settings.files.layers = true;
    settings.frames = Some((2, 2));
    settings.look.effects.glare = 0.5;
    let report = relight(&project, &settings, &Progress::silent()).unwrap();
    let check = report.layers.unwrap();
    assert_eq!(check.layers, 6);
    // Only the rounding of half floats is lost.
    assert!(check.brightest > 0.0 && check.residual <= check.brightest * 2f32.powi(-11), "{check:?}");
}

/// An export that writes a still per message, until the channel closes.
pub fn told_export(window: &Window, name: &str, folder: &Path) -> Sender<()> {
    let (tell, told) = channel::<()>();
    let folder = folder.to_path_buf();
    let worker = window.state().worker().unwrap();
    let name = name.to_owned();
    worker.export(name.clone(), "Files 0 to 7".to_owned(), move |progress| {
        let mut frames = 0;
        loop {
            progress.check(&format!("{frames} frames are kept: clay.%04d.png"))?;
            match told.recv_timeout(std::time::Duration::from_millis(1)) {
                Ok(()) => {
                    std::fs::write(folder.join(format!("clay.{frames:04}.png")), "a still").unwrap();
                    frames += 1;
                    progress.step("relighting", frames, 8, format!("frame {frames}"));
                }
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {}
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => break,
            }
        }
        Ok(WrittenExport {
            sentence: format!("{frames} frames at 12 ms each: exports/{name}"),
            name: name.clone(),
            folder: folder.clone(),
        })
    });
    tell
}

/// Waits until the running export has written this share.
pub fn until_share(window: &mut Window, share: f32) {
    until(window, "share of the export", |app| app.status().job.as_ref().is_some_and(|work| work.share == share));
}

#[test]
fn an_export_is_paused_and_cancelled_in_its_place_and_keeps_what_is_finished() {
    let (folder, mut window) = crate::new_window();
    window.get_by_label("Workspace Export").click();
    let tell = told_export(&window, "clay.0000–0007.png", folder.path());
    let last = told_export(&window, "last.mov", folder.path());
    let next = told_export(&window, "next.mov", folder.path());
    for _ in 0..2 {
        tell.send(()).unwrap();
    }
    until_share(&mut window, 0.25);
    window.run_steps(2);
    click_on(&mut window, "Write next: next.mov");
    let names = |window: &Window| -> Vec<String> {
        window.state().exports().iter().map(|export| export.name.clone()).collect()
    };
    assert_eq!(names(&window), ["clay.0000–0007.png", "next.mov", "last.mov"]);
    assert!(window.query_by_label("Stop").is_none(), "only one line of the job");
    scroll_to(&mut window, "Pause clay.0000–0007.png");
    click_on(&mut window, "Pause clay.0000–0007.png");
    window.get_by_label("paused");
    click_on(&mut window, "Resume clay.0000–0007.png");
    until_labelled(&mut window, "Cancel clay.0000–0007.png");
    window.get_by_label("Cancel clay.0000–0007.png").click();
    until(&mut window, "end of the export", |app| matches!(app.exports()[0].status, ExportStatus::Cancelled(_)));
    window.get_by_label("Cancelled: 2 frames are kept: clay.%04d.png");
    for frame in 0..2 {
        assert!(folder.path().join(format!("clay.{frame:04}.png")).exists());
    }
    until(&mut window, "the next export", |app| app.exports()[1].status == ExportStatus::Running);
    drop(next);
    drop(last);
    until_exported(&mut window, 3);
    window.run_steps(2);
    scroll_to(&mut window, "Retry clay.0000–0007.png");
    click_on(&mut window, "Retry clay.0000–0007.png");
    until(&mut window, "another try", |app| app.exports()[2].status == ExportStatus::Running);
    drop(tell);
    until(&mut window, "end of the other try", |app| matches!(app.exports()[2].status, ExportStatus::Done(_)));
    let log: Vec<_> = window.state().status().log.iter().map(ToString::to_string).collect();
    assert!(log.iter().any(|line| line.contains("2 frames are kept")), "{log:?}");
}

#[test]
fn what_is_in_the_way_of_an_export_is_said_beside_the_button() {
    let (_folder, mut window) = crate::new_window();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    type_name(&mut window, "exports/");
    window.get_by_label("Give the export a name");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(2);
    assert!(window.state().exports().is_empty());
    // A project without a network: the message line shows the reason.
    type_name(&mut window, "exports/clay");
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 1);
    let ExportStatus::Failed(said) = &window.state().exports()[0].status else {
        panic!("{:?}", window.state().exports());
    };
    assert!(said.contains("Not calibrated yet"), "{said}");
}

#[test]
fn the_export_s_panel_looks_as_it_did() {
    let (folder, mut window) = crate::new_window();
    window.get_by_label("Workspace Export").click();
    until_shown(&mut window);
    snapshot(&mut window, "studio_export_empty");

    let done = told_export(&window, "clay.mov", folder.path());
    (0..8).for_each(|_| done.send(()).unwrap());
    drop(done);
    let tell = told_export(&window, "clay.0000–0007.png", folder.path());
    let _next = told_export(&window, "clay.0000–0007.exr", folder.path());
    // The first export passes this share too.
    until(&mut window, "the second export", |app| {
        let second = app.exports().get(1);
        second.is_some_and(|export| export.status == ExportStatus::Running)
    });
    (0..3).for_each(|_| tell.send(()).unwrap());
    until_share(&mut window, 0.375);
    window.key_press(Key::P);
    window.run_steps(3);
    window.get_by_label("paused");
    snapshot(&mut window, "studio_export_filled");
    until_labelled(&mut window, "Cancel clay.0000–0007.png");
    window.get_by_label("Cancel clay.0000–0007.png").click();
    until(&mut window, "end of the export", |app| matches!(app.exports()[1].status, ExportStatus::Cancelled(_)));
}

#[test]
fn an_export_that_failed_looks_as_it_did() {
    let (folder, mut window) = crate::new_window();
    window.get_by_label("Workspace Export").click();
    until_shown(&mut window);
    let exports = folder.path().join("exports");
    std::fs::create_dir(&exports).unwrap();
    for name in ["clay.0000.png", "clay.0001.png"] {
        std::fs::write(exports.join(name), "").unwrap();
    }
    let worker = window.state().worker().unwrap();
    worker.export("clay.0000–0007.png".to_owned(), "Files 0 to 7".to_owned(), |_| {
        Err(Error::io(
            "write",
            "exports/clay.0002.png",
            std::io::Error::from_raw_os_error(28),
            "Check that the folder can be written and the disk has room; 2 frames are kept: exports/clay.%04d.png",
        ))
    });
    until_exported(&mut window, 1);
    until_said(&mut window, "8 frames: clay_2.0000.png");
    snapshot(&mut window, "studio_export_error");
    click_on(&mut window, "Remove clay.0000–0007.png");
    until(&mut window, "empty line", |app| app.exports().is_empty());
}

#[test]
fn work_that_ends_while_the_window_is_in_the_background_asks_for_a_look() {
    let (mut window, ..) = opened();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    for (exports, focused) in [(1, true), (2, false)] {
        window.input_mut().focused = focused;
        window.run_steps(2);
        window.get_by_label("Add to queue").click();
        let mut asked = false;
        let mut step = |window: &mut Window| {
            window.step();
            let commands = window.output().viewport_output.values();
            asked |= commands
                .flat_map(|viewport| &viewport.commands)
                .any(|c| matches!(c, egui::ViewportCommand::RequestUserAttention(_)));
        };
        let over = |e: &afterlight::worker::Export| e.status.sentence().is_some();
        let started = std::time::Instant::now();
        while window.state().exports().iter().filter(|e| over(e)).count() < exports {
            assert!(started.elapsed() < super::PATIENCE, "the export does not end");
            std::thread::sleep(std::time::Duration::from_millis(5));
            step(&mut window);
        }
        // The message follows shortly after the end.
        for _ in 0..20 {
            std::thread::sleep(std::time::Duration::from_millis(5));
            step(&mut window);
        }
        assert_eq!(asked, !focused);
    }
}

#[test]
fn the_picture_is_shown_through_a_look_up_table_and_without_it_again() {
    let (mut window, root, _folder) = opened();
    std::fs::write(root.join("night.cube"), "LUT_1D_SIZE 2\n0 0 0\n0.3 0.4 0.6\n").unwrap();
    let codes = |window: &Window| window.state().relit().unwrap().rgb.clone();
    let plain = codes(&window);
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, "LUT").click();
    window.run_steps(2);
    retype(&mut window, "night.cube");
    window.get_by_label("Show it").click();
    window.run_steps(2);
    until(&mut window, "picture through the table", |app| app.relit().is_some_and(|relit| relit.rgb != plain));
    let brightest = |rgb: &[u8]| *rgb.iter().max().unwrap();
    assert!(brightest(&codes(&window)) <= 153, "0.6 of white");
    // The table stays in other workspaces, and can be removed there.
    window.get_by_label("Workspace Relight").click();
    window.run_steps(2);
    window.get_by_label("LUT night.cube ×").click();
    window.run_steps(2);
    until(&mut window, "picture without the table", |app| app.relit().is_some_and(|relit| relit.rgb == plain));
    assert!(window.query_by_label("LUT night.cube ×").is_none());
}

#[test]
fn a_lamp_alone_is_exported_as_it_is_shown() {
    let (mut window, root, _folder) = opened();
    window.key_press(Key::PageDown);
    window.run_steps(2);
    until(&mut window, "lamp alone", |app| app.relit().is_some_and(|relit| relit.solo == [0] && relit.coarse == 1));
    let shown = window.state().relit().unwrap().clone();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    type_name(&mut window, "exports/alone");
    window.get_by_label("Add solo to queue").click();
    until_exported(&mut window, 1);
    let file = image::open(root.join("exports/alone.0000.png")).unwrap();
    let file = file.into_rgba8();
    assert_eq!((file.width() as usize, file.height() as usize), (shown.width, shown.height));
    let mut solid = 0;
    for (x, y, pixel) in file.enumerate_pixels() {
        let [r, g, b, alpha] = pixel.0;
        let codes = shown.codes([x as usize, y as usize]).unwrap();
        if alpha == 255 {
            solid += 1;
            let off = [r, g, b].into_iter().zip(codes).map(|(a, b)| a.abs_diff(b));
            assert!(off.max().unwrap() <= 1, "{x}, {y}: {pixel:?} {codes:?}");
        }
    }
    assert!(solid > 100, "{solid} pixels of the subject");

    let project = Project::open(&root).unwrap();
    let unknown = RelightSettings {
        solo: vec!["no such".to_owned()],
        ..settings(root.join("unknown.%04d.png").display().to_string())
    };
    let refused = relight(&project, &unknown, &Progress::silent()).unwrap_err();
    assert!(refused.to_string().contains("unknown lamp \"no such\": the lamps are olat_00"), "{refused}");
}

#[test]
fn every_frame_of_an_animation_is_exported_as_it_is_shown() {
    let (mut window, root, _folder) = opened();
    window.key_press(Key::K);
    for setting in ["Pitch", "Temperature", "Vignette", "Exposure"] {
        let diamond = format!("{setting} key at this frame");
        scroll_to(&mut window, &diamond);
        window.get_by_label(&diamond).click();
        window.run_steps(2);
    }
    go(&mut window, Key::End, 3);
    for setting in ["Yaw", "Pitch", "Temperature", "Exposure", "Vignette"] {
        let lane = format!("{setting} lane");
        let value = window.get_by_role_and_label(Role::SpinButton, &lane);
        value.scroll_to_me();
        window.run_steps(4);
        let value = window.get_by_role_and_label(Role::SpinButton, &lane);
        let from = value.rect().center();
        let to = from + egui::vec2(60.0, 0.0);
        plain_drag(&mut window, from, to);
    }
    let look = &window.state().state().look;
    let keys: Vec<usize> = (look.animation.lanes()).map(|(_, keys)| keys.keys().len()).collect();
    assert_eq!(keys, [2; 5], "{:?}", look.animation);
    let mut shown = Vec::new();
    for (key, frame) in [(Key::Home, 0), (Key::ArrowRight, 1), (Key::ArrowRight, 2), (Key::End, 3)] {
        go(&mut window, key, frame);
        shown.push(window.state().relit().unwrap().clone());
    }
    assert!(shown.windows(2).all(|pair| pair[0].scene.yaw_deg < pair[1].scene.yaw_deg));
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    type_name(&mut window, "exports/moving");
    window.get_by_label("Add to queue").click();
    until_exported(&mut window, 1);
    for (frame, shown) in shown.iter().enumerate() {
        let file = root.join(format!("exports/moving.{frame:04}.png"));
        let file = image::open(file).unwrap().into_rgb8();
        let off = file.as_raw().iter().zip(&shown.rgb);
        let off = off.map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(off <= 1, "frame {frame} differs by {off} codes");
    }
}

#[test]
fn a_measured_cell_is_shown_beside_its_truth() {
    let (mut window, _root, _folder) = opened();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    until_labelled(&mut window, "Measure");
    window.get_by_label("Measure").click();
    until_said(&mut window, "Largest errors");
    let poses = ["pose00, lamp ", "pose01, lamp ", "pose02, lamp "];
    let cell = (poses.into_iter())
        .find_map(|pose| window.query_all_by_label_contains(pose).next())
        .expect("the list has poses");
    cell.click_accesskit();
    until(&mut window, "the cell's pictures", |app| app.review().cell.as_ref().is_some_and(Result::is_ok));
    let shown = window.state().review().cell.clone().unwrap().unwrap();
    assert_eq!(Some(shown.cell.lamp), window.state().state().solo.first().copied());
    for name in ["prediction", "photograph", "difference (FLIP × 4)"] {
        window.get_by_role_and_label(Role::Image, name);
    }
    assert_ne!(shown.truth, shown.predicted);
    // One zoom for all three; Esc returns to the picture.
    let photograph = window.get_by_role_and_label(Role::Image, "photograph").rect();
    window.event(Event::PointerMoved(photograph.center()));
    window.event(Event::Zoom(2.0));
    window.run_steps(3);
    assert!(window.state().state().viewport.view.zoom > 1.5);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().state().review.cell.is_none());
    window.get_by_label("Relit picture");
}

/// In a process without a desktop: no test may open a dialog on screen.
#[test]
fn an_export_is_sent_to_a_farm_into_a_folder_that_is_typed() {
    let test = "export::an_export_is_sent_to_a_farm_into_a_folder_that_is_typed";
    if !super::alone(test, &super::NO_DIALOGS) {
        return;
    }
    let (mut window, root, folder) = opened_with_configuration();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    choose_colors(&mut window, "sRGB", "Un-tone-mapped");
    type_name(&mut window, "exports/farmed");
    for number in ["farmed-job", "farmed-job-2"] {
        window.get_by_label("Send to farm…").click();
        window.run_steps(2);
        window.get_by_label("Slurm…").click();
        window.run_steps(2);
        until(&mut window, "message about the missing dialog", |app| {
            let entry = app.state().covers.path.as_ref();
            entry.is_some_and(|entry| entry.missing.is_some())
        });
        window.event(Event::Text(folder.path().display().to_string()));
        window.run_steps(2);
        window.key_press(Key::Enter);
        window.run_steps(2);
        let job = folder.path().join(number);
        until(&mut window, "the job", |_| job.join("job.json").is_file());
        until_said(&mut window, &format!("{number}/submit.sh"));
        let text = std::fs::read_to_string(job.join("job.json")).unwrap();
        assert!(text.contains(&format!("{}/exports/farmed.%04d.png", root.display())));
        assert!(text.contains("Un-tone-mapped") && text.contains("ocio://default"));
        assert!(std::fs::read_to_string(job.join("chunk.sh")).unwrap().contains("farm-chunk"));
    }
}
