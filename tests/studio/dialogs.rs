//! Typed and dropped files beside a dialog, and the question before a file is lost. Tests that open a dialog run in a
//! process without a desktop, so that no dialog appears on screen.

use super::{
    Window, alone, clay_window, click_on, drop_onto, machine, project, retype, temporary, until, until_labelled,
};
use afterlight::gpu::DeviceChoice;
use afterlight::scene::Background;
use afterlight::studio::{Phase, StudioApp};
use afterlight::worker::Need;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Waits for the message that the system shows no dialog, which moves the buttons.
pub fn until_missing(window: &mut Window) {
    until(window, "message about the missing dialog", |app| {
        let entry = app.state().covers.path.as_ref();
        entry.is_some_and(|entry| entry.missing.is_some())
    });
}

/// Text in the path field.
fn typed(window: &Window) -> String {
    let field = window.get_by_role_and_label(Role::TextInput, "Path");
    field.accesskit_node().value().unwrap_or_default()
}

fn type_path(window: &mut Window, path: &Path) {
    window.get_by_role_and_label(Role::TextInput, "Path").click();
    window.run_steps(2);
    retype(window, &path.display().to_string());
}

#[test]
fn a_file_is_never_replaced_by_a_drop_and_a_typed_name_asks_first() {
    let test = "dialogs::a_file_is_never_replaced_by_a_drop_and_a_typed_name_asks_first";
    if !alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = temporary();
    let notes = folder.path().join("notes.md");
    std::fs::write(&notes, "mine").unwrap();
    let read = || std::fs::read_to_string(&notes).unwrap();
    let mut window = clay_window(folder.path());
    let Phase::Ready { device } = window.state().status().phase.clone() else {
        panic!("it is live");
    };
    click_on(&mut window, &device);
    window.state().show_machine(machine::report());
    until_labelled(&mut window, "In short");
    window.get_by_label("Save…").click();
    window.run_steps(2);
    until_missing(&mut window);

    drop_onto(&mut window, &notes);
    window.run_steps(2);
    assert_eq!(read(), "mine");
    assert_eq!(typed(&window), notes.display().to_string());
    for answer in ["Keep it", "Replace"] {
        window.get_by_label("Write here").click();
        until_labelled(&mut window, "Replace the file?");
        window.run_steps(2);
        assert_eq!(read(), "mine");
        window.get_by_label(answer).click();
        window.run_steps(2);
        assert!(window.query_by_label("Replace the file?").is_none());
    }
    until(&mut window, "written file", |_| read() != "mine");
    assert!(window.state().state().covers.path.is_none());

    // A new name is written at once.
    window.get_by_label("Save…").click();
    window.run_steps(2);
    until_missing(&mut window);
    let free = folder.path().join("free.md");
    type_path(&mut window, &free);
    window.key_press(Key::Enter);
    window.run_steps(2);
    until(&mut window, "written file", |_| free.is_file());
    let said = format!("Saved as {}", free.display());
    until_labelled(&mut window, &said);
}

#[test]
fn a_still_stands_behind_the_subject() {
    let test = "dialogs::a_still_stands_behind_the_subject";
    if !alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = temporary();
    let still = folder.path().join("street.png");
    image::RgbImage::from_pixel(8, 5, image::Rgb([40, 90, 200])).save(&still).unwrap();
    let mut window = clay_window(folder.path());
    let corner = |window: &Window| super::picture(window)[..3].to_vec();
    let before = corner(&window);
    let show = |window: &mut Window, file: &Path| {
        until_missing(window);
        type_path(window, file);
        window.key_press(Key::Enter);
        window.run_steps(2);
        super::until_shown(window);
    };
    super::choose(&mut window, "Background", "Still or movie…");
    show(&mut window, &still);
    let Background::File(placed) = window.state().state().look.background.clone() else {
        panic!("a file stands behind");
    };
    assert_eq!((&placed.file, placed.scale), (&still, 1.0));
    let near =
        |codes: &[u8], wanted: [u8; 3]| codes.iter().zip(wanted).all(|(code, wanted)| code.abs_diff(wanted) <= 1);
    assert!(near(&corner(&window), [40, 90, 200]), "{:?}", corner(&window));
    // Its own exposure changes the still alone.
    let exposure = (Role::SpinButton, "File exposure");
    super::type_into(&mut window, exposure, "-10");
    super::until_shown(&mut window);
    assert!(corner(&window).iter().all(|code| *code <= 2), "{:?}", corner(&window));
    // A missing still is named, and nothing stands behind the subject.
    std::fs::remove_file(&still).unwrap();
    super::type_into(&mut window, exposure, "0");
    super::until_shown(&mut window);
    super::until_said(&mut window, "there is no picture");
    assert_eq!(corner(&window), [0; 3]);
    for _ in 0..3 {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
    }
    super::until_shown(&mut window);
    assert_eq!(corner(&window), before);
}

#[test]
fn a_typed_project_file_stands_for_its_folder() {
    let test = "dialogs::a_typed_project_file_stands_for_its_folder";
    if !alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = temporary();
    let film = project::imported(folder.path());
    let mut window = super::window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu));
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::O);
    window.run_steps(2);
    until_missing(&mut window);
    type_path(&mut window, &film.root.join("project.toml"));
    window.key_press(Key::Enter);
    let needs = project::needs(Some(Need::Calibration));
    until(&mut window, "opened project", needs);
    assert_eq!(window.state().project().unwrap().root, film.root);
}

#[test]
fn a_typed_path_stays_when_the_system_closes_its_dialog() {
    let test = "dialogs::a_typed_path_stays_when_the_system_closes_its_dialog";
    // A stand-in for a dialog: it stays open until the file `close` exists, then ends as if closed by hand.
    let folder = std::env::temp_dir().join(format!("afterlight-zenity-{}", std::process::id()));
    let variables = [("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nonexistent"), ("PATH", folder.to_str().unwrap())];
    if std::env::var_os("PATH").is_some_and(|path| !path.to_string_lossy().contains("zenity-")) {
        std::fs::create_dir_all(&folder).unwrap();
        let program = folder.join("zenity");
        let close = folder.join("close");
        let script = format!("#!/bin/sh\nwhile [ ! -e '{}' ]; do /bin/sleep 0.05; done\nexit 1\n", close.display());
        std::fs::write(&program, script).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    if !alone(test, &variables) {
        std::fs::remove_dir_all(&folder).unwrap();
        return;
    }
    let folder = std::env::var("PATH").unwrap();
    let close = Path::new(&folder).join("close");
    let mut window = super::window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu));
    window.run_steps(2);
    let open = |window: &mut Window| {
        window.key_press_modifiers(Modifiers::COMMAND, Key::O);
        window.run_steps(3);
        assert!(window.state().state().covers.path.is_some());
    };
    open(&mut window);
    window.event(Event::Text("/film".to_owned()));
    window.run_steps(2);
    // Longer than the limit below which a dialog counts as missing.
    std::thread::sleep(std::time::Duration::from_millis(600));
    std::fs::write(&close, "").unwrap();
    until_labelled(&mut window, "The system dialog was closed.");
    assert_eq!(typed(&window), "/film");

    // Without typed text, the field closes with its own dialog, and not with an earlier one.
    std::fs::remove_file(&close).unwrap();
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    open(&mut window);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    std::thread::sleep(std::time::Duration::from_millis(600));
    std::fs::write(&close, "").unwrap();
    std::thread::sleep(std::time::Duration::from_millis(200));
    std::fs::remove_file(&close).unwrap();
    open(&mut window);
    window.run_steps(8);
    assert!(window.state().state().covers.path.is_some());
    std::thread::sleep(std::time::Duration::from_millis(600));
    std::fs::write(&close, "").unwrap();
    until(&mut window, "closed field", |app| app.state().covers.path.is_none());
}

#[test]
fn the_keys_of_every_program_are_known() {
    let (_folder, mut window) = crate::new_window();
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    window.get_by_label_contains("saved as you work, with undo");
    window.get_by_label("Close").click();
    window.run_steps(2);
    window.key_press(Key::Questionmark);
    window.run_steps(3);
    for listed in ["New project…", "Open project…", "Save state"] {
        window.get_by_label(listed);
    }
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::N);
    window.run_steps(3);
    window.get_by_label_contains("Choose the shoot's folder, or bring its parts");
    // Text typed there stays when the shortcut is pressed again.
    super::type_into(&mut window, (Role::TextInput, "Shoot"), "/film/day two");
    window.key_press_modifiers(Modifiers::COMMAND, Key::N);
    window.run_steps(3);
    let plan = window.state().wizard().plan().unwrap();
    assert_eq!(plan.shoot, "/film/day two");
}

/// Checks that the save key reports unsaved changes.
pub fn assert_is_unsaved(window: &mut Window) {
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    let refusal = window.state().status().refusal.clone().unwrap();
    assert!(refusal.starts_with("Not saved: "), "{refusal}");
}

#[test]
fn what_cannot_be_saved_is_said_in_the_status_line_and_by_key() {
    let (folder, mut window) = crate::new_window();
    until_labelled(&mut window, "Saved");
    // A folder takes the place of the look file.
    std::fs::create_dir(folder.path().join("look.json")).unwrap();
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    until_labelled(&mut window, "Not saved");
    assert!(window.query_by_label("Saved").is_none());
    assert_is_unsaved(&mut window);
    std::fs::remove_dir(folder.path().join("look.json")).unwrap();
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    until_labelled(&mut window, "Saved");
}

#[test]
fn the_first_hit_of_the_palette_is_marked_and_enter_runs_it() {
    let (_folder, mut window) = crate::new_window();
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    window.run_steps(3);
    for (typed, first) in [("panel", "Show or hide the panels"), (" probe", "Panel: Probe")] {
        window.event(Event::Text(typed.to_owned()));
        window.run_steps(2);
        let marked = window.get_by_label(first).accesskit_node().toggled();
        assert_eq!(marked, Some(egui::accesskit::Toggled::True), "{first}");
    }
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(window.state().state().panes.active, afterlight::studio::Pane::Probe);
}

#[test]
fn the_palette_opens_empty_however_it_was_closed() {
    let (_folder, mut window) = crate::new_window();
    let command = Modifiers::COMMAND | Modifiers::SHIFT;
    let beside = egui::pos2(30.0, 600.0);
    for closes_by_key in [true, false, true] {
        window.key_press_modifiers(command, Key::P);
        window.run_steps(3);
        let field = window.get_by_role_and_label(Role::TextInput, "Find a command");
        assert_eq!(field.accesskit_node().value().unwrap_or_default(), "");
        window.event(Event::Text("probe".to_owned()));
        window.run_steps(2);
        if closes_by_key {
            window.key_press(Key::Escape)
        } else {
            crate::click_at(&mut window, beside, Modifiers::NONE)
        }
        window.run_steps(3);
        assert!(!window.state().state().covers.palette, "{closes_by_key}");
    }
}

/// All readable text in a window.
pub fn texts(window: &Window) -> Vec<String> {
    let nodes = window.root().children_recursive();
    let said = nodes.filter_map(|node| {
        let node = node.accesskit_node();
        node.label().or(node.value())
    });
    said.collect()
}

#[test]
fn no_path_is_shown_with_a_way_back_in_it() {
    let folder = temporary();
    let project = project::imported(folder.path());
    assert!(project.settings.shoot.folder.starts_with(".."));
    std::fs::remove_dir_all(folder.path().join("shoot/probes")).unwrap();
    std::fs::remove_file(folder.path().join("shoot/interview/frame_000.png")).unwrap();
    let mut window = super::window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu));
    let needs = project::needs(Some(Need::Calibration));
    until(&mut window, "opened project", needs);
    let mut seen = 0;
    for pane in afterlight::studio::Pane::ALL {
        super::live::open(&mut window, pane);
        window.run_steps(20);
        for text in texts(&window) {
            assert!(!text.contains("/../"), "{text}");
            seen += usize::from(text.contains(&folder.path().display().to_string()));
        }
    }
    assert!(seen > 0, "paths are shown");
}
