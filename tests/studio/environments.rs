//! Environments added by hand: their front direction, storage, removal, and missing files.

use super::{Window, clay, click_on, drop_onto, until, until_shown, window};
use afterlight::imaging::{Image, file::write_exr};
use afterlight::light::conventions::{Front, Tool};
use afterlight::project::Project;
use afterlight::studio::{Pane, Preferences, StudioApp};
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use std::path::{Path, PathBuf};

const QUESTION: &str = "Which way is front in this file?";

/// A window on the project in `folder`, read from disk.
fn open(folder: &Path) -> Window {
    let project = Project::open(folder).unwrap();
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "panoramas", |app| app.environments().iter().all(|e| !e.panorama.is_waiting()));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    window
}

/// A project in `folder`, and a panorama of a lamp in a yard beside it.
fn project_and_yard(folder: &Path) -> (PathBuf, PathBuf) {
    let home = folder.join("film");
    std::fs::create_dir(&home).unwrap();
    let project = clay::project(&home, clay::environments(&home));
    project.save().unwrap();
    let lamp = |x: usize, y: usize| (10..14).contains(&x) && (8..12).contains(&y);
    let yard = Image::from_fn(64, 32, |x, y| [if lamp(x, y) { 40.0 } else { 0.2 }; 3]);
    // The list shows the folder's name.
    let file = folder.join("hdri/yard.exr");
    std::fs::create_dir(folder.join("hdri")).unwrap();
    write_exr(&file, &yard).unwrap();
    (home, file)
}

#[test]
fn a_built_in_environment_yields_to_the_shoot_s_of_that_name() {
    let folder = crate::temporary();
    let mut environments = clay::environments(folder.path());
    let sky = &mut environments[1];
    std::fs::rename(folder.path().join(&sky.file), folder.path().join("nave.exr")).unwrap();
    (sky.name, sky.file) = ("nave".to_owned(), PathBuf::from("nave.exr"));
    let project = clay::project(folder.path(), environments);
    project.save().unwrap();
    let mut window = open(folder.path());
    window.get_by_label("nave").click();
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "nave");
    assert!(window.query_by_label("Nave").is_none());
    window.get_by_label("Courtyard");
    window.get_by_label("window");
    // The saved look contains only the name.
    drop(window);
    let look = std::fs::read_to_string(folder.path().join("look.json")).unwrap();
    assert!(look.contains("\"environment\": \"nave\""), "{look}");
    let kept = Project::open(folder.path()).unwrap();
    let names: Vec<_> = kept.environments().into_iter().map(|e| e.name).collect();
    assert_eq!(names, ["window", "nave"]);
    // A look of the built-in namesake shows the shoot's.
    let look = look.replace("\"environment\": \"nave\"", "\"environment\": \"Nave\"");
    std::fs::write(folder.path().join("look.json"), look).unwrap();
    let mut window = open(folder.path());
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "nave");
}

#[test]
fn an_added_file_gets_a_name_of_its_own() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let nave = yard.with_file_name("nave.exr");
    std::fs::rename(&yard, &nave).unwrap();
    Project::change(&home, |project| {
        project.add_environment(&nave, Some(Front::default()));
        Ok(())
    })
    .unwrap();
    let mut window = open(&home);
    for name in ["Nave", "nave 2"] {
        super::scroll_to(&mut window, name);
        window.get_by_label(name).click();
        until_shown(&mut window);
        assert_eq!(window.state().relit().unwrap().environment, name);
    }
}

fn drop_file(window: &mut Window, file: PathBuf) {
    drop_onto(window, file);
    until_shown(window);
}

#[test]
fn a_panorama_that_is_dropped_asks_which_way_is_front_and_the_answer_is_remembered() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let mut window = open(&home);
    assert!(window.query_by_label(QUESTION).is_none(), "the shoot's need no answer");
    drop_file(&mut window, yard.clone());
    assert_eq!(window.state().relit().unwrap().environment, "yard");
    window.get_by_label(QUESTION);
    super::snapshot(&mut window, "studio_front");
    let before = super::picture(&window);

    window.get_by_label_contains("three.js, Blender").click();
    until_shown(&mut window);
    assert!(window.query_by_label(QUESTION).is_none());
    let front = Front::from_tool(Tool::Blender);
    assert_eq!(window.state().relit().unwrap().scene.yaw_deg, front.yaw_deg());
    assert_eq!(window.state().state().look.yaw_deg, 0.0, "front is not a rotation");
    let answered = super::picture(&window);
    assert_ne!(answered, before);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(super::picture(&window), before);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    until_shown(&mut window);

    // Dropping the window waits for its writes.
    drop(window);
    let kept = Project::open(&home).unwrap().environment(&yard).unwrap();
    assert_eq!((kept.name.as_str(), kept.front, kept.added), ("yard", Some(front), true));
    let mut window = open(&home);
    super::scroll_to(&mut window, "yard");
    window.get_by_label("yard").click();
    until_shown(&mut window);
    assert_eq!(super::picture(&window), answered);
    assert!(window.query_by_label(QUESTION).is_none());
}

#[test]
fn a_click_on_the_panorama_says_where_front_is() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let mut window = open(&home);
    drop_file(&mut window, yard);
    let panorama = window.get_by_label("Environment map").rect();
    let lamp = panorama.min + egui::vec2(12.0 / 64.0, 10.0 / 32.0) * panorama.size();
    window.hover_at(lamp);
    window.drag_at(lamp);
    window.drop_at(lamp);
    window.run_steps(2);
    until_shown(&mut window);
    let look = &window.state().state().look;
    let front = look.front().yaw_deg();
    assert!((front - 360.0 * (0.5 - 12.0 / 64.0)).abs() < 2.0, "{front}");
}

#[test]
fn an_added_environment_is_removed_and_brought_back_and_the_project_follows() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let mut window = open(&home);
    assert!(window.query_by_label_contains("Remove").is_none(), "the shoot's stay");
    drop_file(&mut window, yard.clone());
    let listed = window.state().environments().len();
    window.get_by_label("Remove yard").click();
    until_shown(&mut window);
    assert_eq!(window.state().environments().len(), listed - 1);
    assert_ne!(window.state().relit().unwrap().environment, "yard");
    assert!(window.query_by_label("yard").is_none());
    drop(window);
    assert!(Project::open(&home).unwrap().environment(&yard).is_none());

    let mut window = open(&home);
    drop_file(&mut window, yard.clone());
    window.get_by_label("Remove yard").click();
    until_shown(&mut window);
    // Additions from the command line in the meantime stay.
    let other = folder.path().join("other.exr");
    std::fs::copy(&yard, &other).unwrap();
    Project::change(&home, |project| {
        project.add_environment(&other, None);
        Ok(())
    })
    .unwrap();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "yard");
    drop(window);
    let project = Project::open(&home).unwrap();
    assert!([&yard, &other].iter().all(|file| project.environment(file).is_some()));
    assert!(yard.exists());
}

#[test]
fn a_file_that_is_gone_is_named_and_stays_in_the_list() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    Project::change(&home, |project| {
        project.add_environment(&yard, Some(Front::default()));
        Ok(())
    })
    .unwrap();
    std::fs::remove_file(&yard).unwrap();
    let mut window = open(&home);
    window.get_by_label_contains("yard.exr. It stays in the list");
    super::scroll_to(&mut window, "yard");
    click_on(&mut window, "yard");
    // A click reads it again.
    until(&mut window, "the failed read", |app| {
        let mut environments = app.environments().iter();
        environments.any(|one| one.panorama.is_failed())
    });
    window.run_steps(2);
    let named = window.query_all_by_label_contains("yard.exr");
    assert_eq!(named.count(), 2, "in the line at the bottom and over the picture");
    let mut places = super::lines_with(&window, "yard.exr", 216.0, 900.0);
    places.sort_by_key(|place| place.bottom() as i32);
    // The message line is as wide as the window.
    places[1].set_left(12.0);
    places[1].set_right(1160.0);
    super::snapshot_without(&mut window, "studio_environments_error", &places);
    drop(window);
    assert!(Project::open(&home).unwrap().environment(&yard).is_some());
}

#[test]
fn a_file_that_cannot_be_read_is_said_and_not_added() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let mut window = open(&home);
    let damaged = folder.path().join("damaged.hdr");
    std::fs::write(&damaged, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 9 +X").unwrap();
    drop_file(&mut window, yard);
    let before = window.state().state().look.clone();
    drop_onto(&mut window, damaged);
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    let state = window.state().state();
    assert_eq!(state.look, before);
    window.get_by_label_contains("damaged.hdr");
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "yard");
    // Undo applies to the step before.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    let names = |window: &Window| -> Vec<String> {
        let list = window.state().environments().iter();
        list.map(|entry| entry.listed.name.clone()).collect()
    };
    assert!(!names(&window).contains(&"yard".to_owned()));
    drop(window);
    let kept = Project::open(&home).unwrap().environments();
    assert!(kept.iter().all(|known| known.name != "damaged"));
}

#[test]
fn all_panoramas_of_a_folder_are_listed() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    std::fs::copy(&yard, yard.with_file_name("park.exr")).unwrap();
    std::fs::write(yard.with_file_name("licence.txt"), "CC0").unwrap();
    let mut window = open(&home);
    drop_onto(&mut window, yard.parent().unwrap());
    until(&mut window, "panoramas of the folder", |app| {
        let names = app.environments().iter().map(|entry| entry.listed.name.as_str());
        names.filter(|name| ["park", "yard"].contains(name)).count() == 2
    });
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "park");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    drop_onto(&mut window, &empty);
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    window.get_by_label_contains("empty: no panorama");
}

/// In a process without a desktop: no test may open a dialog on screen.
#[test]
fn where_the_system_has_no_dialogs_a_path_is_typed_completed_or_dropped() {
    let test = "environments::where_the_system_has_no_dialogs_a_path_is_typed_completed_or_dropped";
    if !super::alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let mut window = open(&home);
    window.get_by_label("Add…").click();
    window.run_steps(2);
    until(&mut window, "message about the missing dialog", |app| {
        let entry = app.state().covers.path.as_ref();
        entry.is_some_and(|entry| entry.missing.is_some())
    });
    window.get_by_label_contains("No file dialog");
    super::snapshot(&mut window, "studio_path");
    let typed = format!("{}/hdri/ya", folder.path().display());
    window.event(egui::Event::Text(typed));
    window.run_steps(2);
    super::until_labelled(&mut window, "yard.exr");
    window.key_press(Key::Tab);
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(2);
    until_shown(&mut window);
    assert!(window.state().state().covers.path.is_none());
    assert_eq!(window.state().relit().unwrap().environment, "yard");

    window.get_by_label("Add…").click();
    window.run_steps(2);
    // A folder by its path.
    let park = folder.path().join("park");
    std::fs::create_dir(&park).unwrap();
    std::fs::copy(&yard, park.join("lawn.exr")).unwrap();
    window.event(egui::Event::Text(park.display().to_string()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    until(&mut window, "panorama of the folder", |app| app.relit().is_some_and(|relit| relit.environment == "lawn"));

    window.get_by_label("Add…").click();
    window.run_steps(2);
    let copy = yard.with_file_name("drop.exr");
    std::fs::copy(&yard, &copy).unwrap();
    drop_file(&mut window, copy);
    assert!(window.state().state().covers.path.is_none());
    assert_eq!(window.state().relit().unwrap().environment, "drop");
    window.get_by_label("Add…").click();
    window.run_steps(2);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().state().covers.path.is_none());
}

/// A window of a person on the project in `folder`.
fn open_as(settings: &Path, folder: &Path) -> Window {
    let (preferences, project) = (Preferences::from_file(settings), Project::open(folder).unwrap());
    let mut window = window(|ctx| StudioApp::over_as(ctx, preferences, project, clay::source));
    until(&mut window, "the first picture", |app| {
        let read = app.environments().iter().all(|e| !e.panorama.is_waiting());
        app.relit().is_some() && read
    });
    window
}

fn top(window: &Window, name: &str) -> f32 {
    window.get_by_label(name).rect().top()
}

#[test]
fn a_favourite_is_first_in_every_project_of_a_person() {
    let folder = crate::temporary();
    let settings = folder.path().join("settings/window.json");
    let (one, _) = project_and_yard(folder.path());
    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    clay::project(&other, clay::environments(&other)).save().unwrap();
    let mut window = open_as(&settings, &one);
    assert!(window.query_by_label("Environments: Favourites").is_none());
    assert!(top(&window, "Three-point") > top(&window, "sky"));
    window.get_by_label("Three-point").click();
    until_shown(&mut window);
    click_on(&mut window, "Star Three-point");
    assert!(top(&window, "Three-point") < top(&window, "sky"));
    // The shortcut, while the pane is active, marks the current environment.
    window.get_by_label("sky").click();
    until_shown(&mut window);
    assert_eq!(window.state().state().panes.active, Pane::Environments);
    window.key_press(Key::S);
    window.run_steps(3);
    super::snapshot(&mut window, "studio_favourites");
    drop(window);

    let mut window = open_as(&settings, &other);
    assert!(top(&window, "Three-point") < top(&window, "window"));
    assert!(top(&window, "sky") > top(&window, "window"), "not a favourite");
    click_on(&mut window, "Unstar Three-point");
    assert!(window.query_by_label("Environments: Favourites").is_none());
}

#[test]
fn two_hundred_panoramas_are_grouped_by_folder_searched_and_gone_through_by_key() {
    let folder = crate::temporary();
    let (home, yard) = project_and_yard(folder.path());
    let place = |i: usize| {
        let kind = ["day", "dusk", "night", "studio"][i / 50];
        folder.path().join(format!("hdri/{kind}/{kind}_{:02}.exr", i % 50))
    };
    for i in 0..200 {
        std::fs::create_dir_all(place(i).parent().unwrap()).unwrap();
        std::fs::hard_link(&yard, place(i)).unwrap();
    }
    Project::change(&home, |project| {
        for i in 0..200 {
            project.add_environment(&place(i), Some(Front::default()));
        }
        Ok(())
    })
    .unwrap();
    let mut window = open(&home);
    assert_eq!(window.state().environments().len(), 210);
    for (group, some) in [("Shoot", "sky"), ("Built in", "Nave"), ("dusk", "dusk_07")] {
        assert!(top(&window, &format!("Environments: {group}")) < top(&window, some));
    }
    window.get_by_label("Environments: day").scroll_to_me();
    window.run_steps(4);
    click_on(&mut window, "Environments: day");
    assert!(window.query_by_label("day_03").is_none(), "the folder is folded");

    window.get_by_label("Search environments").click();
    window.run_steps(2);
    window.event(egui::Event::Text("night 07".to_owned()));
    window.run_steps(3);
    window.get_by_label("night_07");
    assert!(window.query_by_label("night_08").is_none() && window.query_by_label("sky").is_none());
    window.key_press(Key::Enter);
    until_shown(&mut window);
    let shown = |window: &Window| {
        let look = &window.state().state().look;
        look.environments[look.environment].name.clone()
    };
    assert_eq!(shown(&window), "night_07");
    // Within the search results.
    window.get_by_label("Search environments").click();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.event(egui::Event::Text("_07".to_owned()));
    window.run_steps(3);
    window.key_press(Key::ArrowDown);
    window.run_steps(3);
    assert_eq!(shown(&window), "studio_07");
    window.key_press(Key::ArrowDown);
    window.run_steps(3);
    assert_eq!(shown(&window), "day_07", "around the end");
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label("night_08").is_some());

    // The arrow keys follow the visible list and scroll to the new row.
    window.get_by_label("sky").scroll_to_me();
    window.run_steps(4);
    click_on(&mut window, "sky");
    window.key_press(Key::ArrowUp);
    window.run_steps(3);
    window.key_press(Key::ArrowUp);
    window.run_steps(6);
    assert_eq!(shown(&window), "studio_49");
    let row = window.get_by_label("studio_49").rect();
    // Lower edge of the pane.
    assert!(row.bottom() < 690.0, "{row:?}");
    until_shown(&mut window);
    super::snapshot(&mut window, "studio_environments_many");
}

#[test]
fn what_is_folded_stays_folded_in_the_next_window() {
    let folder = crate::temporary();
    let settings = folder.path().join("settings/window.json");
    let (home, _) = project_and_yard(folder.path());
    let mut window = open_as(&settings, &home);
    for heading in ["Grade group", "Environments: Built in"] {
        super::scroll_to(&mut window, heading);
        click_on(&mut window, heading);
    }
    let is_folded = |window: &Window| {
        let tint = window.query_by_role_and_label(Role::SpinButton, "Tint");
        [tint.is_none(), window.query_by_label("Nave").is_none()]
    };
    assert_eq!(is_folded(&window), [true; 2]);
    window.get_by_role_and_label(Role::SpinButton, "Pitch");
    // Dropping the window waits for its writes.
    drop(window);
    let mut window = open_as(&settings, &home);
    assert_eq!(is_folded(&window), [true; 2]);
    window.get_by_role_and_label(Role::SpinButton, "Pitch");
    for heading in ["Grade group", "Environments: Built in"] {
        click_on(&mut window, heading);
    }
    assert_eq!(is_folded(&window), [false; 2]);
    drop(window);
    assert_eq!(is_folded(&open_as(&settings, &home)), [false; 2]);
}

#[test]
fn a_watched_folder_is_listed_in_every_project_and_used_files_are_the_project_s() {
    let folder = crate::temporary();
    let settings = folder.path().join("settings/window.json");
    let (home, yard) = project_and_yard(folder.path());
    let hdris = yard.parent().unwrap().to_owned();
    std::fs::create_dir(hdris.join("night")).unwrap();
    for i in 0..40 {
        std::fs::copy(&yard, hdris.join(format!("night/street_{i:02}.exr"))).unwrap();
    }
    std::fs::write(hdris.join("preview.jpg"), "not listed").unwrap();
    std::fs::write(hdris.join("broken.hdr"), "#?RADIANCE\n").unwrap();
    let count = |app: &StudioApp| app.environments().len();
    let saved = |file: &Path| Project::open(&home).unwrap().environment(file).is_some();

    let mut window = open_as(&settings, &home);
    let own = count(window.state());
    drop_onto(&mut window, &hdris);
    until(&mut window, "watched files", |app| count(app) > 40);
    // The first in order of paths is tried as light, and cannot be read.
    until(&mut window, "reason", |app| app.status().refusal.is_some());
    window.run_steps(2);
    assert_eq!(count(window.state()), own + 42);
    super::scroll_to(&mut window, "yard");
    window.run_steps(3);
    until(&mut window, "the rows in sight", |app| app.environments().iter().all(|one| !one.panorama.is_waiting()));
    let read = |app: &StudioApp| app.environments().iter().filter(|e| e.panorama.is_done()).count();
    assert!(read(window.state()) < own + 42, "files out of sight are not read");
    let thumbnail =
        |app: &StudioApp| app.environments().iter().any(|e| e.listed.name == "yard" && e.panorama.is_done());
    assert!(thumbnail(window.state()), "a file in sight has its thumbnail before its use");

    // Use adds the file to the project, and its row stays where it is.
    let before = window.get_by_label("yard").rect();
    click_on(&mut window, "yard");
    until_shown(&mut window);
    assert_eq!(window.state().relit().unwrap().environment, "yard");
    assert_eq!(window.get_by_label("yard").rect(), before);
    assert_eq!(count(window.state()), own + 42);
    // Of files tried one after the other the project keeps the last, and those tried before another act.
    for view in [Key::L, Key::C] {
        window.key_press(view);
        window.run_steps(2);
    }
    let listed = |window: &Window| {
        let look = &window.state().state().look;
        (look.environments.len() - own, look.environments[look.environment].name.clone())
    };
    for street in ["street_00", "street_01"] {
        click_on(&mut window, street);
        until_shown(&mut window);
        assert_eq!(listed(&window), (2, street.to_owned()));
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(listed(&window), (2, "street_00".to_owned()));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(listed(&window), (1, "yard".to_owned()));
    // New files are listed when the window comes to the front, and those that went are not.
    std::fs::rename(hdris.join("broken.hdr"), folder.path().join("broken.hdr")).unwrap();
    std::fs::copy(&yard, hdris.join("park.exr")).unwrap();
    window.event(egui::Event::WindowFocused(true));
    until(&mut window, "the new file", |app| {
        let mut names = app.environments().iter().map(|one| one.listed.name.as_str());
        names.clone().any(|name| name == "park") && !names.any(|name| name == "broken")
    });
    drop(window);
    assert!(saved(&yard) && !saved(&hdris.join("park.exr")) && !saved(&hdris.join("broken.hdr")));

    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    clay::project(&other, clay::environments(&other)).save().unwrap();
    // A folder on a disk that is not connected.
    let away = folder.path().join("away");
    std::fs::rename(&hdris, &away).unwrap();
    let mut window = open_as(&settings, &other);
    let closed = "cannot be opened; connect its disk, or allow reading it";
    super::until_labelled(&mut window, &format!("{}: {closed}", hdris.display()));
    std::fs::rename(&away, &hdris).unwrap();
    window.event(egui::Event::WindowFocused(true));
    until(&mut window, "watched files", |app| count(app) > 40);
    super::scroll_to(&mut window, "yard");
    click_on(&mut window, "yard");
    until_shown(&mut window);
    let stop = format!("Stop watching {}", hdris.display());
    super::scroll_to(&mut window, &stop);
    click_on(&mut window, &stop);
    until(&mut window, "files that are not watched to go", |app| count(app) < 40);
    assert_eq!(count(window.state()), own + 1, "the used file stays");
    assert_eq!(window.state().relit().unwrap().environment, "yard");
    assert!(hdris.join("park.exr").exists());
}
