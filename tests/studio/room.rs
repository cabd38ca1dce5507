//! Layout of the window, also of a small one: nothing moves, overlaps or leaves it.

use super::dialogs::until_missing;
use super::export::{
    choose_colors, opened, opened_with_configuration, told_export, type_name, until_exported, until_share,
};
use super::live::{enter, open};
use super::{
    Window, alone, clay, click_on, press, project, told_job, until, until_labelled, until_said, until_shown, window,
};
use afterlight::Error;
use afterlight::project::Lock;
use afterlight::studio::{Pane, Preferences, StudioApp, Workspace};
use afterlight::worker::Need;
use egui::accesskit::Role;
use egui::{Color32, Event, Key, Modifiers, Pos2, Rect, Shape, Stroke, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use std::time::{Duration, Instant};

fn places(window: &Window) -> Vec<Rect> {
    let names = ["Play", "Keys ?", "Panels", "Workspace Relight"];
    names.map(|name| window.get_by_label(name).rect()).into()
}

#[test]
fn nothing_moves_for_what_is_said_while_a_job_runs() {
    let (_folder, mut window) = crate::shown_window();
    let before = places(&window);
    let picture = |window: &Window| window.get_by_label("Relit picture").rect();
    let shown = picture(&window);
    let job = told_job(&mut window);
    window.run_steps(2);

    // A message.
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    window.get_by_label_contains("saved as you work, with undo");
    assert_eq!((places(&window), picture(&window)), (before.clone(), shown));
    window.get_by_label("Close").click();
    window.run_steps(2);
    assert!(window.query_by_label_contains("saved as you work").is_none());

    // A refusal in workspaces without a picture.
    enter(&mut window, 0);
    let calibrating = places(&window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    window.get_by_label_contains("Another job is running");
    assert_eq!(places(&window), calibrating);
    window.get_by_label("Dismiss message").click();
    window.run_steps(2);
    assert!(window.query_by_label_contains("Another job").is_none());
    enter(&mut window, 2);

    // The reason that the job waits.
    job.send(|progress| {
        let mut full = true;
        let _ = progress.retry(|| {
            if std::mem::take(&mut full) {
                let full = std::io::ErrorKind::StorageFull.into();
                Err(Error::io("write", "live.bpk", full, "Make room"))
            } else {
                Ok(())
            }
        });
    })
    .unwrap();
    until(&mut window, "the pause", |app| app.status().job.as_ref().is_some_and(|job| job.held.is_some()));
    window.get_by_label("cannot write live.bpk: the disk is full. Make room");
    assert_eq!((places(&window), picture(&window)), (before.clone(), shown));
    window.get_by_label("Resume").click();
    until(&mut window, "the resumed job", |app| app.status().job.as_ref().is_some_and(|job| job.held.is_none()));
    assert!(window.query_by_label_contains("cannot write").is_none());
}

#[test]
fn messages_go_after_six_seconds_unless_they_ask_for_something() {
    let (_folder, mut window) = crate::shown_window();
    let is_said = |window: &Window| window.query_by_label_contains("saved as you work").is_some();
    let wait = |window: &mut Window, seconds: u64| {
        let end = Instant::now() + Duration::from_secs(seconds);
        while Instant::now() < end {
            std::thread::sleep(Duration::from_millis(100));
            window.step();
        }
    };
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    // In the middle of the lower edge; it waits under the pointer.
    let place = window.get_by_label_contains("saved as you work").rect();
    let middle = window.ctx.content_rect().center_bottom();
    assert!((place.center().x - middle.x).abs() < 60.0, "{place:?}");
    assert!(middle.y - place.bottom() < 60.0, "{place:?}");
    window.event(Event::PointerMoved(place.center()));
    wait(&mut window, 7);
    assert!(is_said(&window));
    window.event(Event::PointerMoved(Pos2::ZERO));
    until(&mut window, "the message's end", |app| app.status().message.is_none());
    window.step();
    assert!(!is_said(&window));
    let log = &window.state().status().log;
    assert!(log.back().unwrap().sentence.contains("saved as you work"));

    super::drop_onto(&mut window, "notes.txt");
    wait(&mut window, 7);
    window.get_by_label_contains("notes.txt cannot be used");
}

#[test]
fn the_picture_has_the_room_that_nothing_else_needs() {
    let (_folder, mut window) = crate::shown_window();
    let height = |window: &Window| window.get_by_label("Relit picture").rect().height();
    let head = |window: &Window| window.get_by_label("Play").rect().top();
    let settled = |window: &mut Window| {
        window.run_steps(4);
        (height(window), head(window))
    };
    let (folded, low) = settled(&mut window);
    assert!(folded > 400.0, "{folded}");
    window.key_press(Key::K);
    let (lanes, high) = settled(&mut window);
    assert!(lanes < folded - 60.0 && high < low - 60.0, "{lanes} {folded}, {high} {low}");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    assert_eq!(settled(&mut window), (folded, low));
    open(&mut window, Pane::Log);
    window.run_steps(4);
    assert!(height(&window) < folded - 60.0, "the log has its lines");
    open(&mut window, Pane::Timeline);
    assert_eq!(settled(&mut window), (folded, low));

    // Buttons above the bar, where the timeline is narrow.
    window.set_size(vec2(900.0, 600.0));
    window.run_steps(4);
    let [play, bar, line] = ["Play", "Scrub bar", "Keys ?"].map(|name| window.get_by_label(name).rect());
    assert!(play.bottom() <= bar.top() && bar.bottom() < line.top() - 16.0, "{play:?} {bar:?}");
}

#[test]
fn the_picture_stands_alone_with_its_light() {
    let (_folder, mut window) = crate::shown_window();
    let before = window.get_by_label("Relit picture").rect();
    let alone = |window: &mut Window| {
        window.key_press_modifiers(Modifiers::SHIFT, Key::F);
        window.run_steps(4);
    };
    alone(&mut window);
    let picture = window.get_by_label("Relit picture").rect();
    assert!(picture.height() > before.height() + 60.0, "{picture:?} {before:?}");
    for hidden in ["Play", "Keys ?", "Workspace Relight", "Search"] {
        assert!(window.query_by_label(hidden).is_none(), "{hidden}");
    }
    let map = window.get_by_label("Environment map").rect();
    assert!(map.left() > picture.right());
    // The light is at hand as before.
    window.get_by_role_and_label(Role::SpinButton, "Temperature");
    alone(&mut window);
    assert_eq!(window.get_by_label("Relit picture").rect(), before);
}

#[test]
fn a_window_that_only_reads_has_its_panes_where_they_always_are() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    project.save().unwrap();
    let made = |project: afterlight::project::Project| {
        let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
        until(&mut window, "first picture", |app| app.relit().is_some());
        until_shown(&mut window);
        window
    };
    let first = made(project.clone());
    let before = places(&first);
    drop(first);
    let mut lock = None;
    for _ in 0..200 {
        lock = Lock::take(folder.path(), "another program").ok();
        if lock.is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(lock.is_some(), "the first window is closed");
    let mut second = made(project);
    second.get_by_label("Read-only");
    assert_eq!(places(&second), before);
    second.set_size(vec2(900.0, 600.0));
    second.run_steps(4);
    inside(&second, &in_a_row(&second, 17.0));
}

fn is_placed(node: &egui_kittest::Node) -> bool {
    node.accesskit_node().bounding_box().is_some()
}

/// Controls whose centre is this many points below the top.
fn in_a_row(window: &Window, y: f32) -> Vec<(String, Rect)> {
    let controls = window.root().children_recursive();
    let controls = controls.filter(|node| {
        let role = node.accesskit_node().role();
        is_placed(node) && egui::accessibility::is_input(role) && (node.rect().center().y - y).abs() < 6.0
    });
    let named = controls.map(|node| {
        let name = node.accesskit_node().label();
        (name.unwrap_or_default(), node.rect())
    });
    named.collect()
}

/// Checks that controls are inside the window and do not overlap.
fn inside(window: &Window, controls: &[(String, Rect)]) {
    let whole = window.ctx.content_rect();
    assert!(controls.len() > 2, "{controls:?}");
    for (i, (name, rect)) in controls.iter().enumerate() {
        assert!(whole.contains_rect(*rect), "{name}: {rect:?}");
        for (other, beside) in &controls[..i] {
            let shared = rect.intersect(*beside);
            let apart = shared.width() < 0.5 || shared.height() < 0.5;
            assert!(apart, "{name} {rect:?} lies on {other} {beside:?}");
        }
    }
}

#[test]
fn in_a_small_window_nothing_in_the_bars_overlaps_or_is_clipped() {
    let (_folder, mut window) = crate::shown_window();
    window.set_size(vec2(900.0, 600.0));
    window.run_steps(4);
    until_shown(&mut window);
    let check = |window: &Window| {
        inside(window, &in_a_row(window, 17.0));
        let picture = window.get_by_label("Relit picture").rect();
        let bar = window.root().children_recursive();
        let bar = bar.filter(is_placed).filter(|node| {
            let role = node.accesskit_node().role();
            let rect = node.rect();
            let above = rect.center().y > 60.0 && rect.center().y < 60.0 + 2.0 * 32.0;
            let over = rect.center().x > picture.left() && rect.center().x < picture.right();
            egui::accessibility::is_input(role) && above && over
        });
        let bar = bar.map(|node| {
            let name = node.accesskit_node().label();
            (name.unwrap_or_default(), node.rect())
        });
        let bar: Vec<_> = bar.collect();
        assert!(picture.width() > 390.0, "panels shrink before the picture: {picture:?}");
        for name in ["First: relit", "How to compare"] {
            assert!(bar.iter().any(|(known, _)| known == name), "{name}: {bar:?}");
        }
        // Inside the pane, not only inside the window.
        for (name, rect) in &bar {
            let fits = rect.left() >= picture.left() - 1.0 && rect.right() <= picture.right() + 1.0;
            assert!(fits, "{name} {rect:?} is cut off at {picture:?}");
        }
        inside(window, &bar);
    };
    check(&window);
    // A solo lamp and a difference add controls.
    click_on(&mut window, "Compare");
    click_on(&mut window, "Interview frame");
    check(&window);
    click_on(&mut window, "How to compare");
    click_on(&mut window, "Difference");
    window.key_press(Key::PageDown);
    window.run_steps(4);
    check(&window);
}

#[test]
fn a_row_shows_the_focus_of_the_keyboard() {
    let (_folder, mut window) = crate::shown_window();
    let is_marked = |window: &Window| {
        let row = window.get_by_label("sky").rect();
        let edge = Stroke::new(1.0, Color32::from_rgb(232, 170, 76));
        window
            .output()
            .shapes
            .iter()
            .any(|shape| matches!(&shape.shape, Shape::Rect(drawn) if drawn.rect == row && drawn.stroke == edge))
    };
    assert!(!is_marked(&window));
    window.get_by_label("sky").focus();
    window.run_steps(2);
    assert!(is_marked(&window));
}

/// Number of hints on the screen.
fn hints(window: &Window) -> usize {
    let layers = window.ctx.memory(|memory| memory.areas().visible_layer_ids());
    layers.iter().filter(|layer| layer.order == egui::Order::Tooltip).count()
}

#[test]
fn one_hint_at_a_time_is_shown_over_the_panorama() {
    let (_folder, mut window) = crate::shown_window();
    let panorama = window.get_by_label("Environment map").rect();
    let mut shown = 0;
    for x in [0.1, 0.3, 0.5, 0.7, 0.9] {
        for y in [0.2, 0.5, 0.8] {
            window.event(Event::PointerMoved(panorama.lerp_inside(vec2(x, y))));
            window.run_steps(8);
            let hints = hints(&window);
            assert!(hints <= 1, "{hints} hints at {x}, {y}");
            shown += hints;
        }
    }
    assert!(shown > 0, "there is a hint");
}

#[test]
fn a_drag_hides_the_hint() {
    let (_folder, mut window) = crate::shown_window();
    let map = window.get_by_label("Environment map").rect();
    let yaw = window.get_by_role_and_label(Role::SpinButton, "Yaw").rect();
    for place in [map, yaw] {
        let at = place.lerp_inside(vec2(0.3, 0.9));
        window.event(Event::PointerMoved(at));
        window.run_steps(8);
        assert_eq!(hints(&window), 1, "{place:?}");
        window.event(press(at, true));
        for step in 1..=4 {
            window.event(Event::PointerMoved(at + vec2(5.0 * step as f32, 0.0)));
            window.run_steps(2);
        }
        assert_eq!(hints(&window), 0, "{place:?}");
        window.event(press(at + vec2(20.0, 0.0), false));
        window.event(Event::PointerGone);
        window.run_steps(4);
    }
}

#[test]
fn four_lines_of_the_log_are_seen_in_every_workspace() {
    let (_folder, mut window) = crate::shown_window();
    let job = told_job(&mut window);
    for word in [
        (|p| p.say("line one")) as super::Word,
        |p| p.say("line two"),
        |p| p.say("line three"),
        |p| p.say("line four"),
        |p| p.say("line five"),
        |p| p.say("line six"),
    ] {
        job.send(word).unwrap();
    }
    until(&mut window, "lines", |app| app.status().log.len() >= 6);
    for place in 0..Workspace::ALL.len() {
        enter(&mut window, place);
        open(&mut window, Pane::Log);
        window.run_steps(4);
        let top = window.get_by_label("Copy all").rect().top() - 4.0;
        let bottom = window.get_by_label("Keys ?").rect().top() - 5.0;
        let lines = window.query_all_by_label_contains("line ");
        let seen = lines.filter(|line| line.rect().top() >= top && line.rect().bottom() <= bottom);
        let seen = seen.count();
        assert!(seen >= 4, "{seen} lines in {:?}", Workspace::ALL[place]);
    }
}

#[test]
fn the_newest_export_is_seen_whatever_is_chosen_above_it() {
    let (mut window, root, _folder) = opened_with_configuration();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    choose_colors(&mut window, "sRGB", "Un-tone-mapped");
    window.get_by_label("Format EXR").click();
    window.run_steps(2);
    window.get_by_label("Layers By lamp").click();
    window.run_steps(2);
    std::fs::create_dir_all(root.join("exports")).unwrap();
    std::fs::write(root.join("exports/there.0000.exr"), "").unwrap();
    type_name(&mut window, "exports/there");
    until_said(&mut window, "there_2.0000.exr");
    assert!(!window.get_by_label("Existing files Resume").accesskit_node().is_disabled());
    let _older = told_export(&window, "older.mov", &root);
    let tell = told_export(&window, "newest.0000–0007.png", &root);
    until(&mut window, "two exports", |app| app.exports().len() == 2);
    let seen = |window: &mut Window, button: &str| {
        for height in [720.0, 600.0] {
            window.set_size(vec2(1280.0, height));
            window.run_steps(6);
            let bottom = window.get_by_label("Keys ?").rect().top() - 5.0;
            let name = window.get_by_label("newest.0000–0007.png").rect();
            let button = window.get_by_label(button).rect();
            let add = window.get_by_label("Add to queue").rect();
            let queue = window.get_by_label("Queue").rect();
            assert!(name.top() > queue.bottom() && button.bottom() <= bottom, "{name:?} … {button:?} of {bottom}");
            assert!(add.bottom() <= queue.top() && add.top() > 60.0, "{add:?}");
        }
    };
    seen(&mut window, "Remove newest.0000–0007.png");
    drop(_older);
    tell.send(()).unwrap();
    until_share(&mut window, 0.125);
    seen(&mut window, "Cancel newest.0000–0007.png");
    drop(tell);
    until_exported(&mut window, 2);
    seen(&mut window, "Open folder newest.0000–0007.png");
}

#[test]
fn exports_that_wait_have_the_names_of_their_files() {
    let (mut window, root, _folder) = opened();
    window.get_by_label("Workspace Export").click();
    window.run_steps(2);
    let hold = told_export(&window, "hold.mov", &root);
    type_name(&mut window, "exports/quick");
    until_labelled(&mut window, "4 frames: quick.0000.png … quick.0003.png");
    for _ in 0..2 {
        window.get_by_label("Add to queue").click();
        window.run_steps(2);
    }
    let names = |window: &Window| -> Vec<String> {
        let queue = window.state().exports();
        queue.iter().skip(1).map(|e| e.name.clone()).collect()
    };
    let expected = ["quick.0000–0003.png", "quick_2.0000–0003.png"];
    assert_eq!(names(&window), expected);
    until_labelled(&mut window, "4 frames: quick_3.0000.png … quick_3.0003.png");
    // Its settings are at hand.
    let name = window.get_by_label("hold.mov").rect();
    window.event(Event::PointerMoved(name.center()));
    until_labelled(&mut window, "Files 0 to 7");
    drop(hold);
    until_exported(&mut window, 3);
    assert_eq!(names(&window), expected);
    for name in ["quick", "quick_2"] {
        assert!(root.join(format!("exports/{name}.0003.png")).exists());
    }
    until_labelled(&mut window, "4 frames: quick_3.0000.png … quick_3.0003.png");
}

#[test]
fn the_menu_at_the_project_s_name_leads_to_every_project() {
    let test = "room::the_menu_at_the_project_s_name_leads_to_every_project";
    if !alone(test, &super::NO_DIALOGS) {
        return;
    }
    let (folder, elsewhere) = (crate::temporary(), crate::temporary());
    let film = project::imported(elsewhere.path());
    let mut preferences = Preferences::from_file(&elsewhere.path().join("window.json"));
    preferences.opened(&film.root);
    let clay = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = window(|ctx| StudioApp::over_as(ctx, preferences, clay, clay::source));
    until(&mut window, "first picture", |app| app.relit().is_some());
    let menu = |window: &mut Window, entry: &str| {
        window.get_by_role_and_label(Role::Button, "Project").click();
        window.run_steps(3);
        until_labelled(window, entry);
        window.run_steps(2);
    };
    // Its first frame is beside its name.
    menu(&mut window, "virtual stage");
    window.get_by_label(&folder.path().display().to_string());
    until(&mut window, "first frame", |app| app.recents().thumbnail(&film.root).is_some());
    let entry = window.get_by_label("virtual stage").rect();
    assert!(entry.width() > 100.0 && entry.height() > 30.0, "{entry:?}");
    window.key_press(Key::Escape);
    window.run_steps(3);

    menu(&mut window, "Show in the file manager");
    window.get_by_label("Show in the file manager").click();
    until(&mut window, "why not", |app| app.status().refusal.is_some());
    window.get_by_label_contains("Could not open the folder. Path copied");
    window.key_press(Key::Escape);
    window.run_steps(3);

    menu(&mut window, "Open project…");
    click_on(&mut window, "Open project…");
    until_labelled(&mut window, "Open a project");
    until_missing(&mut window);
    click_on(&mut window, "Cancel");

    menu(&mut window, "virtual stage");
    window.get_by_label("virtual stage").click();
    let needs = project::needs(Some(Need::Calibration));
    until(&mut window, "the other project", needs);
    assert_eq!(window.state().project().unwrap().root, film.root);

    menu(&mut window, "New project…");
    window.get_by_label("New project…").click();
    until_labelled(&mut window, "New project");
}

/// Number of main buttons, by their colour.
fn main_buttons(window: &Window) -> usize {
    let main = Color32::from_rgb(50, 116, 180);
    let shapes = window.output().shapes.iter();
    shapes.filter(|it| matches!(&it.shape, Shape::Rect(drawn) if drawn.fill == main)).count()
}

#[test]
fn no_control_is_wider_than_its_window() {
    let (mut window, _root, _folder) = opened_with_configuration();
    for place in 0..Workspace::ALL.len() {
        enter(&mut window, place);
        let exports = Workspace::ALL[place] == Workspace::Export;
        if exports {
            choose_colors(&mut window, "sRGB", "Un-tone-mapped");
            click_on(&mut window, "Format EXR");
            click_on(&mut window, "Layers By lamp");
        }
        let main = main_buttons(&window);
        assert!(main <= 1, "{main} main buttons in {:?}", Workspace::ALL[place]);
        assert!(main == 1 || !exports, "Add to queue is a main button");
        for size in [vec2(1280.0, 720.0), vec2(1366.0, 768.0), vec2(1920.0, 1080.0)] {
            window.set_size(size);
            window.run_steps(6);
            let controls = window.root().children_recursive();
            let controls =
                controls.filter(|node| is_placed(node) && egui::accessibility::is_input(node.accesskit_node().role()));
            let mut count = 0;
            for control in controls {
                let (name, rect) = (control.accesskit_node().label(), control.rect());
                let fits = rect.left() >= 0.0 && rect.right() <= size.x;
                assert!(fits, "{:?} at {size}: {name:?} {rect}", Workspace::ALL[place]);
                count += 1;
            }
            assert!(count > 10, "{count} controls");
        }
    }
}
