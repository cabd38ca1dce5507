//! Stored looks: saved, applied, shared between projects and compared; and undo steps that outlive the window.

use super::{Window, clay, click_on, picture, retype, until, until_shown, window};
use afterlight::gpu::DeviceChoice;
use afterlight::project::{Lock, Project};
use afterlight::studio::{FourSlot, LookId, LookName, Preferences, Shelf, StudioApp};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, pos2};
use egui_kittest::kittest::Queryable;
use std::path::Path;
use test_support::files;

pub fn id(shelf: Shelf, name: &str) -> LookId {
    LookId { shelf, name: LookName::new(name).unwrap() }
}

/// Brings the pane of looks to the front.
pub fn open_looks(window: &mut Window) {
    // Preferences may have kept it in front.
    if window.query_by_label("Name of the look").is_none() {
        click_on(window, "Looks");
    }
}

/// Replaces the name in the field for the current look, and clicks the button.
pub fn store(window: &mut Window, name: &str, button: &str) {
    window.get_by_label("Name of the look").click();
    window.run_steps(2);
    retype(window, name);
    window.get_by_label(button).click();
    window.run_steps(2);
    until_drawn(window, &id(Shelf::Project, name));
}

/// Waits for the thumbnail of a look's newest version.
fn until_drawn(window: &mut Window, look: &LookId) {
    until(window, "look with its picture", |app| {
        let looks = app.looks();
        let newest = looks.version(look, None);
        !looks.is_busy() && newest.is_some_and(|newest| newest.picture.is_some())
    });
}

pub fn choose(window: &mut Window, look: &str, entry: &str) {
    click_on(window, &format!("More for {look}"));
    click_on(window, entry);
    until(window, "end of the action", |app| !app.looks().is_busy());
}

/// Makes the look half a stop brighter.
fn brighten(window: &mut Window) {
    super::type_into(window, (Role::SpinButton, "Exposure"), "+0.5");
}

/// Renames a look.
pub fn rename(window: &mut Window, look: &str, name: &str) {
    click_on(window, &format!("More for {look}"));
    click_on(window, "Rename…");
    retype(window, name);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

/// Names of the project's looks.
fn names(window: &Window) -> Vec<String> {
    let looks = window.state().looks().looks(Shelf::Project).iter();
    looks.map(|look| look.name.to_string()).collect()
}

/// Changes environment, yaw and exposure.
pub fn relight(window: &mut Window) {
    brighten(window);
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(2);
    super::plain_drag(window, super::MIDDLE, super::MIDDLE + egui::vec2(37.0, 0.0));
    until_shown(window);
}

#[test]
fn a_stored_look_gives_the_same_picture_bit_for_bit_in_one_step() {
    let (folder, mut window) = crate::new_window();
    relight(&mut window);
    let stored = (picture(&window), window.state().state().look.clone());
    open_looks(&mut window);
    window.get_by_label_contains("None yet");
    store(&mut window, "Warm key", "Store");
    relight(&mut window);
    let other = (picture(&window), window.state().state().look.clone());
    assert!(stored.0 != other.0);
    window.get_by_label("Warm key").click();
    until_shown(&mut window);
    assert!(picture(&window) == stored.0);
    assert_eq!(window.state().state().look, stored.1);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert!(picture(&window) == other.0);
    assert_eq!(window.state().state().look, other.1);
    drop(window);
    let text = std::fs::read_to_string(folder.path().join("looks/Warm key/0001.json")).unwrap();
    assert!(text.contains("\"exposure_stops\": 0.5"), "{text}");
    assert!(folder.path().join("looks/Warm key/0001.png").exists());

    // The next window shows the same.
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = super::window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    open_looks(&mut window);
    until(&mut window, "looks", |app| !app.looks().is_busy());
    window.get_by_label("Warm key").click();
    until_shown(&mut window);
    assert!(picture(&window) == stored.0);
}

#[test]
fn an_update_is_a_new_version_and_older_ones_come_back() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    store(&mut window, "Night", "Store");
    let first = picture(&window);
    click_on(&mut window, "Update");
    let versions = |window: &Window| window.state().looks().looks(Shelf::Project)[0].versions.len();
    assert!(!window.state().looks().is_busy() && versions(&window) == 1);
    relight(&mut window);
    window.get_by_label("Update").click();
    until(&mut window, "second version", |app| {
        let newest = app.looks().version(&id(Shelf::Project, "Night"), None);
        newest.is_some_and(|newest| newest.number == 2 && newest.picture.is_some())
    });
    let second = picture(&window);
    choose(&mut window, "Night", "Show versions");
    window.get_by_label("Night, version 1").click();
    until_shown(&mut window);
    assert!(picture(&window) == first);
    // The time of storing appears beside each thumbnail, below the name.
    let told = ["Night, version 1", "Night, version 2"].map(|row| {
        let row = window.get_by_label(row).rect();
        let from = pos2(row.left() + 1.4 * row.height(), row.center().y);
        egui::Rect::from_min_max(from, row.max)
    });
    super::snapshot_without(&mut window, "studio_looks", &told);
    window.get_by_label("Update").click();
    until(&mut window, "third version", |app| {
        let newest = app.looks().version(&id(Shelf::Project, "Night"), None);
        newest.is_some_and(|newest| newest.number == 3)
    });
    window.get_by_label("Night, version 2").click();
    until_shown(&mut window);
    assert!(picture(&window) == second);
}

#[test]
fn looks_are_renamed_duplicated_removed_and_brought_back() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    store(&mut window, "Day", "Store");
    rename(&mut window, "Day", "Noon");
    until(&mut window, "new name", |app| !app.looks().is_busy());
    choose(&mut window, "Noon", "Duplicate");
    assert_eq!(names(&window), ["Noon", "Noon 2"]);
    choose(&mut window, "Noon", "Remove");
    assert_eq!(names(&window), ["Noon 2"]);
    click_on(&mut window, "Removed looks");
    click_on(&mut window, "Restore Noon");
    until(&mut window, "the removed look", |app| !app.looks().is_busy());
    assert_eq!(names(&window), ["Noon", "Noon 2"]);
    // A name that is invalid for a folder is refused, and nothing is lost.
    rename(&mut window, "Noon", "a/b");
    window.get_by_label_contains("cannot have /");
    assert_eq!(names(&window), ["Noon", "Noon 2"]);
}

#[test]
fn a_name_that_another_look_has_is_refused_and_the_shown_look_stays_itself() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    store(&mut window, "Night", "Store");
    relight(&mut window);
    store(&mut window, "Day", "Store");
    rename(&mut window, "Day", "night");
    window.get_by_label_contains("A look named Night already exists");
    let current = window.state().looks().current.clone();
    assert_eq!(current, Some((id(Shelf::Project, "Day"), 1)));
    assert_eq!(names(&window), ["Day", "Night"]);
}

#[test]
fn a_name_in_other_capitals_is_that_of_the_stored_look() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    store(&mut window, "Warm", "Store");
    store(&mut window, "Cold", "Store");
    relight(&mut window);
    window.get_by_label("Name of the look").click();
    window.run_steps(2);
    retype(&mut window, "warm");
    window.get_by_label("Update").click();
    window.run_steps(2);
    until(&mut window, "second version", |app| app.looks().current == Some((id(Shelf::Project, "Warm"), 2)));
    until_drawn(&mut window, &id(Shelf::Project, "Warm"));
    assert_eq!(names(&window), ["Cold", "Warm"]);
}

#[test]
fn a_thumbnail_is_as_exported_whatever_is_looked_at() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    window.key_press(Key::E);
    until_shown(&mut window);
    window.get_by_label("Name of the look").click();
    window.run_steps(2);
    retype(&mut window, "Any");
    window.get_by_label("Store").click();
    let any = id(Shelf::Project, "Any");
    let newest = |app: &StudioApp| app.looks().version(&any, None).cloned();
    until(&mut window, "look", |app| newest(app).is_some());
    window.run_steps(4);
    until(&mut window, "rest", |app| !app.looks().is_busy());
    assert!(newest(window.state()).unwrap().picture.is_none());
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    until_drawn(&mut window, &any);
}

#[test]
fn a_look_that_is_dropped_where_no_project_is_open_says_what_to_do() {
    let folder = crate::temporary();
    let mut window = window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu));
    super::drop_onto(&mut window, folder.path().join("Moon.look.json"));
    let said = window.state().status().refusal.clone().unwrap();
    assert!(said.starts_with("Open a project first"), "{said}");
}

/// A saved project in a folder of its own, with two environments.
fn saved_project(folder: &Path, name: &str) -> Project {
    let home = folder.join(name);
    std::fs::create_dir(&home).unwrap();
    let project = clay::project(&home, clay::environments(&home));
    project.save().unwrap();
    project
}

fn window_of_a_person(settings: &Path, project: Project) -> Window {
    let preferences = Preferences::from_file(settings);
    let mut window = window(|ctx| StudioApp::over_as(ctx, preferences, project, clay::source));
    until(&mut window, "the first picture", |app| {
        let read = app.environments().iter().all(|e| !e.panorama.is_waiting());
        app.relit().is_some() && read && !app.looks().is_busy()
    });
    window
}

#[test]
fn a_look_that_is_kept_for_all_projects_brings_its_environment_or_says_that_it_is_missing() {
    let folder = crate::temporary();
    let settings = folder.path().join("settings/window.json");
    let [one, other] = ["one", "other"].map(|name| saved_project(folder.path(), name));
    let yard = folder.path().join("yard.exr");
    let picture_of = afterlight::imaging::Image::from_fn(64, 32, |x, _| [x as f32 / 32.0; 3]);
    afterlight::imaging::file::write_exr(&yard, &picture_of).unwrap();
    let mut window = window_of_a_person(&settings, one);
    super::drop_onto(&mut window, yard.clone());
    until_shown(&mut window);
    brighten(&mut window);
    until_shown(&mut window);
    let stored = picture(&window);
    open_looks(&mut window);
    store(&mut window, "Yard", "Store");
    choose(&mut window, "Yard", "Keep for all projects");
    until(&mut window, "look for all projects", |app| !app.looks().looks(Shelf::Person).is_empty());
    drop(window);

    let mut window = window_of_a_person(&settings, other.clone());
    open_looks(&mut window);
    window.get_by_label("Yard, all projects").click();
    until(&mut window, "environment of the look", |app| {
        let list = app.environments();
        list.iter().any(|e| e.listed.name == "yard" && e.panorama.is_done())
    });
    until_shown(&mut window);
    assert!(picture(&window) == stored);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert!(window.query_by_label("yard").is_none());
    drop(window);

    std::fs::remove_file(&yard).unwrap();
    let mut window = window_of_a_person(&settings, other);
    open_looks(&mut window);
    window.get_by_label("Yard, all projects").click();
    until(&mut window, "what is missing", |app| app.status().refusal.is_some());
    let said = window.state().status().refusal.clone().unwrap();
    assert!(said.contains("yard") && said.contains("yard.exr"), "{said}");
    let look = &window.state().state().look;
    assert_eq!(look.exposure_stops, 0.5, "the rest of the look is applied");
    assert_eq!(look.environments[look.environment].name, "window");
}

/// In a process without a desktop: no test may open a dialog on screen.
#[test]
fn a_look_is_written_into_a_file_and_loaded_by_dropping_it() {
    let test = "looks::a_look_is_written_into_a_file_and_loaded_by_dropping_it";
    if !super::alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = crate::temporary();
    let [one, other] = ["one", "other"].map(|name| saved_project(folder.path(), name));
    let file = folder.path().join("Moon.look.json");
    let mut window = window(|ctx| StudioApp::over(ctx, one, clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    relight(&mut window);
    let stored = window.state().state().look.exposure_stops;
    open_looks(&mut window);
    store(&mut window, "Any", "Store");
    choose(&mut window, "Any", "Save look…");
    until(&mut window, "field for a path", |app| app.state().covers.path.is_some());
    let typed = file.display().to_string();
    window.event(egui::Event::Text(typed));
    window.run_steps(2);
    window.key_press(Key::Enter);
    until(&mut window, "file with the look", |_| file.exists());
    drop(window);

    let mut window = super::window(|ctx| StudioApp::over(ctx, other, clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    super::drop_onto(&mut window, file.clone());
    until_drawn(&mut window, &id(Shelf::Project, "Moon"));
    assert_eq!(window.state().state().look.exposure_stops, stored);
    // Loading the same file twice makes one version; a file that is not a look is reported.
    brighten(&mut window);
    assert_ne!(window.state().state().look.exposure_stops, stored);
    super::drop_onto(&mut window, file.clone());
    until(&mut window, "end of loading", |app| app.state().look.exposure_stops == stored && !app.looks().is_busy());
    let versions = |window: &Window| window.state().looks().looks(Shelf::Project)[0].versions.len();
    assert_eq!(versions(&window), 1);
    std::fs::write(&file, "{\"look\": 3}").unwrap();
    super::drop_onto(&mut window, file);
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    window.get_by_label_contains("Moon.look.json");
}

#[test]
fn four_looks_stand_side_by_side_at_any_frame_and_one_is_picked() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    let mut pictures = Vec::new();
    for name in ["Cold", "Dusk", "Warm"] {
        relight(&mut window);
        store(&mut window, name, "Store");
        pictures.push(picture(&window));
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    let present = picture(&window);
    window.key_press(Key::Num4);
    window.run_steps(2);
    let all_four = |window: &mut Window, frame: usize| {
        until(window, "four pictures", |app| {
            app.relit().is_some_and(|relit| relit.scene.frame == frame && relit.looks.iter().all(Option::is_some))
        });
        let relit = window.state().relit().unwrap().clone();
        relit.looks.clone().map(|look| look.unwrap().1.rgb.clone())
    };
    let [a, b, c, d] = all_four(&mut window, 0);
    assert!(a == present);
    for (found, stored) in [&b, &c, &d].into_iter().zip(&pictures) {
        assert!(found == stored, "bit-identical to the stored picture");
    }
    super::snapshot(&mut window, "studio_four");
    // The same pixel is read in all four, at any position of the pointer.
    let middle = window.get_by_label_contains("A: ").rect().center();
    window.hover_at(middle);
    window.run_steps(2);
    window.get_by_label_contains("32, 32");
    let at = 3 * (32 * 64 + 32);
    for (letter, codes) in "ABCD".chars().zip([&a, &b, &c, &d]) {
        let [red, green, blue] = [codes[at], codes[at + 1], codes[at + 2]];
        window.get_by_label_contains(&format!("{letter} {red} {green} {blue}"));
    }
    window.key_press(Key::End);
    window.run_steps(2);
    let last = all_four(&mut window, clay::FRAMES - 1);
    assert!(last[3] != pictures[2], "the frame differs");

    // Another look in a slot.
    click_on(&mut window, "Place B, Cold");
    click_on(&mut window, "Current look");
    let four = &window.state().state().four;
    assert_eq!(four.slots[1], FourSlot::Present);
    let undo = window.state().state().look.clone();
    click_on(&mut window, "D: Warm");
    assert!(!window.state().state().four.on);
    window.key_press(Key::Home);
    until_shown(&mut window);
    assert!(picture(&window) == pictures[2]);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    let found = &window.state().state().look;
    assert_eq!(found.exposure_stops, undo.exposure_stops);
}

#[test]
fn zoom_and_pan_are_those_of_all_four() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::Num4);
    until(&mut window, "the present look", |app| app.relit().is_some_and(|relit| relit.looks[0].is_some()));
    let place = window.get_by_label("A: current look").rect();
    super::plain_drag(&mut window, place.center(), place.center() + egui::vec2(20.0, 8.0));
    let state = window.state().state();
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    assert!(state.viewport.view.pan[0] > 5.0, "{:?}", state.viewport.view.pan);
    assert!(state.four.on, "a drag applies no look");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!window.state().state().four.on);
}

#[test]
fn what_is_set_while_the_clip_plays_is_saved_and_can_be_undone_after_the_window_was_closed() {
    let folder = crate::temporary();
    let project = saved_project(folder.path(), "film");
    let open = || {
        let project = project.clone();
        let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
        until(&mut window, "the first picture", |app| {
            app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
        });
        until_shown(&mut window);
        window
    };
    let mut window = open();
    let before = window.state().state().look.clone();
    window.key_press(Key::Space);
    window.run_steps(2);
    brighten(&mut window);
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    window.run_steps(2);
    super::plain_drag(&mut window, super::MIDDLE, super::MIDDLE + egui::vec2(37.0, 0.0));
    window.run_steps(2);
    assert!(window.state().state().playback.playing);
    let set = window.state().state().look.clone();
    assert_ne!(set, before);
    window.run_steps(3);
    drop(window);

    let mut window = open();
    assert_eq!(window.state().state().look, set);
    for _ in 0..3 {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
    }
    assert_eq!(window.state().state().look, before);
}

#[test]
fn undo_and_redo_survive_a_window_that_is_closed_and_opened() {
    let folder = crate::temporary();
    let project = saved_project(folder.path(), "film");
    let open = |project: Project| {
        let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
        until(&mut window, "the first picture", |app| {
            app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
        });
        until_shown(&mut window);
        window
    };
    let mut window = open(project.clone());
    let mut looks = vec![window.state().state().look.clone()];
    for _ in 0..2 {
        relight(&mut window);
        looks.push(window.state().state().look.clone());
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    let undone = window.state().state().look.clone();
    drop(window);
    assert!(project.root.join("undo.json").exists());

    let mut window = open(project.clone());
    assert_eq!(window.state().state().look, undone);
    let step = |window: &mut Window, modifiers: Modifiers| {
        window.key_press_modifiers(modifiers, Key::Z);
        window.run_steps(2);
        window.state().state().look.clone()
    };
    let redo = Modifiers::COMMAND | Modifiers::SHIFT;
    assert_eq!(step(&mut window, redo), looks[2]);
    // Each has one change of exposure, one of the environment and one rotation.
    for _ in 0..3 {
        step(&mut window, Modifiers::COMMAND);
    }
    assert_eq!(window.state().state().look, looks[1]);
    for _ in 0..3 {
        step(&mut window, Modifiers::COMMAND);
    }
    assert_eq!(window.state().state().look, looks[0]);
    assert!(!window.state().state().can_undo());
    drop(window);

    // A damaged undo file is reported, and the look is unchanged.
    std::fs::write(project.root.join("undo.json"), "{\"half a f").unwrap();
    let window = open(project);
    assert_eq!(window.state().state().look, looks[0]);
    assert!(!window.state().state().can_undo() && !window.state().state().can_redo());
    window.get_by_label_contains("undo.json");
}

#[test]
fn a_window_that_only_reads_stores_nothing() {
    let folder = crate::temporary();
    let project = saved_project(folder.path(), "film");
    let _lock = Lock::take(&project.root, "another program").unwrap();
    let before = files(&project.root);
    let mut window = window(|ctx| StudioApp::over(ctx, project.clone(), clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    relight(&mut window);
    open_looks(&mut window);
    window.get_by_label("Name of the look").click();
    window.run_steps(2);
    window.event(Event::Text("Mine".to_owned()));
    window.key_press(Key::Enter);
    window.run_steps(3);
    click_on(&mut window, "Store");
    drop(window);
    assert_eq!(files(&project.root), before);
}

#[test]
fn a_look_stored_later_appears_among_the_four() {
    let (_folder, mut window) = crate::new_window();
    for _ in 0..2 {
        window.key_press(Key::Num4);
        window.run_steps(2);
    }
    assert_eq!(window.state().state().four.slots[1], FourSlot::Empty);
    open_looks(&mut window);
    store(&mut window, "Dusk", "Store");
    window.key_press(Key::Num4);
    window.run_steps(2);
    let dusk = FourSlot::Stored(id(Shelf::Project, "Dusk"), None);
    assert_eq!(window.state().state().four.slots[1], dusk);
}
