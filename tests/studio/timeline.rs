//! The timeline: the visible part of a long clip, and its keys by keyboard and menus.

use super::{
    Window, clay, clay_window, click_on, double_click, drag, go, plain_drag, scroll_to, snapshot, type_into, until,
    until_shown,
};
use afterlight::scene::{LightSetting, Setting};
use afterlight::studio::{Phase, StudioApp};
use egui::accesskit::Role;
use egui::{
    Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, OutputCommand, PointerButton, Pos2, Shape, TouchPhase,
    Vec2, ViewportCommand, ViewportId, vec2,
};
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::Path;

fn frames(window: &Window, of: Setting) -> Vec<f64> {
    let keys = window.state().state().look.keys(of).keys();
    keys.iter().map(|key| key.frame).collect()
}

/// A window on a clip with this many frames and this look.
fn looking(folder: &Path, count: usize, look: &str) -> Window {
    let mut project = clay::project(folder, clay::environments(folder));
    let names: Vec<String> = (0..count).map(|i| format!("frame_{i:04}")).collect();
    project.settings.shoot.frames = names.into();
    std::fs::write(folder.join("look.json"), look).unwrap();
    let mut window = super::window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    window
}

/// Keys of a lane, as in a file.
fn lane(name: &str, frames: &[usize]) -> String {
    let key = |frame: &usize| format!("{{\"frame\": {frame}, \"value\": {}}}", frame % 7);
    let keys: Vec<String> = frames.iter().map(key).collect();
    format!("\"{name}\": {{\"keys\": [{}]}}", keys.join(", "))
}

fn key(window: &Window, name: &str, frame: usize) -> Pos2 {
    let name = format!("{name} key at frame {frame}");
    window.get_by_label(&name).rect().center()
}

/// First and last visible frame; None if all are visible.
fn sight(window: &Window) -> Option<(usize, usize)> {
    let mark = window.query_by_label_contains("are in sight")?;
    let said = mark.accesskit_node().label().unwrap();
    let mut numbers = said.split(' ').filter_map(|word| word.parse().ok());
    numbers.next().zip(numbers.next())
}

/// Turns the wheel over a place until the view has settled.
fn wheel(window: &mut Window, at: Pos2, points: Vec2, modifiers: Modifiers) {
    window.event(Event::PointerMoved(at));
    window.event(Event::ModifiersChanged(modifiers));
    window.event(Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: points,
        phase: TouchPhase::Move,
        source: MouseWheelSource::Wheel,
        modifiers,
    });
    window.run_steps(8);
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    window.run_steps(1);
}

/// Zooms about the key at frame 1000 until its neighbours are separate.
fn zoom(window: &mut Window) {
    for _ in 0..60 {
        let at = key(window, "Yaw", 1000);
        wheel(window, at, vec2(0.0, 60.0), Modifiers::COMMAND);
        if key(window, "Yaw", 1010).x - key(window, "Yaw", 1000).x > 140.0 {
            return;
        }
    }
    panic!("the timeline does not zoom");
}

const LONG: usize = 2400;

fn long(folder: &Path) -> Window {
    let yaw = lane("yaw", &[0, 1000, 1001, 1010, 2399]);
    looking(folder, LONG, &format!("{{\"keys\": {{{yaw}}}}}"))
}

#[test]
fn a_long_clip_is_zoomed_about_the_cursor_moved_and_shown_whole_again() {
    let folder = crate::temporary();
    let mut window = long(folder.path());
    let before = key(&window, "Yaw", 1000);
    assert!(key(&window, "Yaw", 1001).x - before.x < 1.0);
    assert_eq!(sight(&window), None);
    zoom(&mut window);
    assert!((key(&window, "Yaw", 1000).x - before.x).abs() < 2.0);
    let (first, last) = sight(&window).unwrap();
    assert!(first > 900 && last < 1100, "{first} to {last}");
    assert!(window.query_by_label("Yaw key at frame 0").is_none());

    // Neighbours can be hit one by one, and moved by single frames.
    click_on(&mut window, "Yaw key at frame 1001");
    assert_eq!(window.state().state().frame, 1001);
    let cell = key(&window, "Yaw", 1001).x - key(&window, "Yaw", 1000).x;
    let from = key(&window, "Yaw", 1001);
    plain_drag(&mut window, from, from + vec2(2.0 * cell, 0.0));
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 1000.0, 1003.0, 1010.0, 2399.0]);
    until_shown(&mut window);
    window.event(Event::PointerMoved(from));
    window.run_steps(2);
    snapshot(&mut window, "studio_lanes_zoomed");
    window.event(Event::PointerGone);
    window.run_steps(2);

    // The scrub bar and the handles cover the same frames.
    let bar = window.get_by_label("Scrub bar").rect();
    let to = key(&window, "Yaw", 1010).x;
    plain_drag(&mut window, Pos2::new(from.x, bar.center().y + 4.0), Pos2::new(to, bar.center().y + 4.0));
    assert_eq!(window.state().state().frame, 1010);
    assert!(window.query_by_label_contains("In point").is_none());

    // The wheel and the middle button pan it.
    let was = key(&window, "Yaw", 1000).x;
    wheel(&mut window, bar.center(), vec2(0.0, 40.0), Modifiers::NONE);
    let moved = key(&window, "Yaw", 1000).x - was;
    assert!((moved - 40.0).abs() < 1.0, "{moved}");
    wheel(&mut window, from, vec2(0.0, -25.0), Modifiers::SHIFT);
    assert!((key(&window, "Yaw", 1000).x - was - 15.0).abs() < 1.0);
    let at = from + vec2(0.0, 0.0);
    let middle = PointerButton::Middle;
    drag(&mut window, at, at - vec2(15.0, 0.0), middle, Modifiers::NONE);
    assert!((key(&window, "Yaw", 1000).x - was).abs() < 1.0);
    assert_eq!(window.state().state().frame, 1010, "panning does not scrub");
    assert_eq!(frames(&window, Setting::Yaw)[1], 1000.0);

    // The curve shows the same frames.
    click_on(&mut window, "Curve of Yaw");
    assert!((key(&window, "Yaw", 1000).x - was).abs() < 1.0);
    let at = key(&window, "Yaw", 1003);
    wheel(&mut window, at, vec2(0.0, -40.0), Modifiers::COMMAND);
    assert!((key(&window, "Yaw", 1003).x - at.x).abs() < 1.0);
    click_on(&mut window, "Curve of Yaw");

    // F over the timeline, and a button, show all frames. Elsewhere, F fits the picture.
    assert!(sight(&window).is_some());
    window.event(Event::PointerMoved(super::MIDDLE));
    window.run_steps(2);
    window.get_by_label("Yaw key at frame 1003");
    go(&mut window, Key::End, LONG - 1);
    let (first, last) = sight(&window).unwrap();
    assert!(first > 2000 && last == LONG - 1, "{first} to {last}");
    window.event(Event::PointerMoved(bar.center()));
    window.run_steps(2);
    window.key_press(Key::F);
    window.run_steps(2);
    assert_eq!(sight(&window), None);
    zoom(&mut window);
    window.get_by_label("Show all frames").click();
    window.run_steps(2);
    assert_eq!(sight(&window), None);
}

#[test]
fn a_project_that_is_opened_shows_all_its_frames() {
    let folder = crate::temporary();
    let mut window = long(folder.path());
    window.state().project().unwrap().save().unwrap();
    zoom(&mut window);
    assert!(sight(&window).is_some());
    super::drop_onto(&mut window, folder.path());
    until(&mut window, "the project without a network", |app| matches!(app.status().phase, Phase::Blocked(_)));
    window.run_steps(3);
    assert_eq!(window.state().state().playback.frames, LONG);
    assert_eq!(sight(&window), None);
}

#[test]
fn the_current_frame_stays_in_sight_while_the_clip_plays() {
    let folder = crate::temporary();
    let mut window = long(folder.path());
    zoom(&mut window);
    let (_, last) = sight(&window).unwrap();
    type_into(&mut window, (Role::SpinButton, "Frame"), &(last - 1).to_string());
    assert_eq!(sight(&window).unwrap().1, last);
    window.key_press(Key::Space);
    until(&mut window, "a frame that was out of sight", |app| app.state().frame > last + 1);
    assert!(window.state().state().playback.playing);
    let frame = window.state().state().frame;
    let (first, last) = sight(&window).unwrap();
    assert!((first..=last).contains(&frame), "{frame}: {first} to {last}");
}

/// A window on eight frames, with keys in two lanes.
fn animated(folder: &Path) -> Window {
    let (yaw, tint) = (lane("yaw", &[0, 3, 7]), lane("tint", &[1, 5]));
    looking(folder, clay::FRAMES, &format!("{{\"keys\": {{{yaw}, {tint}}}}}"))
}

#[test]
fn keys_are_stepped_through_selected_and_nudged_by_the_keyboard() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    let frame = |window: &Window| window.state().state().frame;
    let step = |window: &mut Window, key: Key| {
        window.key_press_modifiers(Modifiers::COMMAND, key);
        window.run_steps(2);
        frame(window)
    };
    for expected in [1, 3, 5, 7, 7] {
        assert_eq!(step(&mut window, Key::ArrowRight), expected);
    }
    for expected in [5, 3, 1, 0, 0] {
        assert_eq!(step(&mut window, Key::ArrowLeft), expected);
    }
    // Only of the selected lane, until it is deselected.
    let lane = |window: &mut Window| {
        let tint = window.get_by_role_and_label(Role::Button, "Tint lane");
        tint.click();
        window.run_steps(3);
    };
    lane(&mut window);
    assert_eq!(step(&mut window, Key::ArrowRight), 1);
    assert_eq!(step(&mut window, Key::ArrowRight), 5);
    assert_eq!(step(&mut window, Key::ArrowRight), 5);
    lane(&mut window);
    assert_eq!(step(&mut window, Key::ArrowRight), 7);

    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    let nudge = |window: &mut Window, key: Key| {
        window.key_press_modifiers(Modifiers::SHIFT, key);
        window.run_steps(2);
    };
    nudge(&mut window, Key::ArrowLeft);
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 3.0, 7.0], "at the end");
    window.get_by_label("Tint key at frame 1").click();
    window.run_steps(2);
    nudge(&mut window, Key::ArrowRight);
    nudge(&mut window, Key::ArrowRight);
    assert_eq!(frames(&window, Setting::Tint), [3.0, 5.0]);
    nudge(&mut window, Key::ArrowLeft);
    assert_eq!(frames(&window, Setting::Tint), [2.0, 5.0]);
    assert_eq!(frame(&window), 1, "the frame stays");
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 3.0, 7.0]);
    for expected in [3.0, 2.0, 1.0] {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
        assert_eq!(frames(&window, Setting::Tint), [expected, 5.0]);
    }
    // All keys of a curve are those of its lane.
    click_on(&mut window, "Curve of Tint");
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    nudge(&mut window, Key::ArrowRight);
    assert_eq!(frames(&window, Setting::Tint), [2.0, 6.0]);
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 3.0, 7.0]);
    window.key_press(Key::Questionmark);
    window.run_steps(3);
    window.get_by_label("Move the selected keys a frame later");
    window.get_by_label("Next key");
}

/// Clicks a place with the secondary button.
fn menu_at(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    for pressed in [true, false] {
        window.event(Event::PointerButton {
            pos: at,
            button: PointerButton::Secondary,
            pressed,
            modifiers: Modifiers::NONE,
        });
    }
    window.run_steps(3);
}

/// Clicks an entry of the open menu. Returns the copied text, and whether the clipboard was requested.
fn choose(window: &mut Window, entry: &str) -> (Option<String>, bool) {
    window.get_by_label_contains(entry).click();
    let (mut text, mut asked) = (None, false);
    for _ in 0..4 {
        window.step();
        let output = window.output();
        for command in &output.platform_output.commands {
            if let OutputCommand::CopyText(copied) = command {
                text = Some(copied.clone());
            }
        }
        let root = output.viewport_output.get(&ViewportId::ROOT);
        let commands = root.map_or(&[][..], |root| &root.commands);
        asked |= commands.contains(&ViewportCommand::RequestPaste);
    }
    (text, asked)
}

#[test]
fn a_menu_cuts_and_pastes_and_a_double_click_sets_a_key() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    let at = key(&window, "Yaw", 3);
    menu_at(&mut window, at);
    let (cut, _) = choose(&mut window, "Cut key");
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 7.0]);
    let cut = cut.expect("a copy of the key");
    go(&mut window, Key::ArrowRight, 1);
    menu_at(&mut window, at);
    assert!(window.query_by_label_contains("Copy key").is_none());
    let (_, asked) = choose(&mut window, "Paste");
    assert!(asked, "the system says what the clipboard holds");
    window.event(Event::Paste(cut));
    window.run_steps(3);
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 1.0, 7.0]);

    // On an empty place of a lane, with the lane's value there.
    let before = window.state().state().look.keys(Setting::Tint).clone();
    let [one, five] = [1, 5].map(|frame| key(&window, "Tint", frame));
    double_click(&mut window, one + 0.5 * (five - one));
    let after = window.state().state().look.keys(Setting::Tint).clone();
    assert_eq!(frames(&window, Setting::Tint), [1.0, 3.0, 5.0]);
    assert_eq!(after.at(3.0), before.at(3.0));
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 1.0, 7.0]);
    window.key_press(Key::Delete);
    window.run_steps(2);
    assert_eq!(frames(&window, Setting::Tint), [1.0, 5.0], "the new key is selected");
    // There is none below the lanes.
    double_click(&mut window, one + vec2(30.0, 60.0));
    assert_eq!(frames(&window, Setting::Tint), [1.0, 5.0]);
    // In the curve.
    click_on(&mut window, "Curve of Tint");
    let [one, five] = [1, 5].map(|frame| key(&window, "Tint", frame));
    double_click(&mut window, Pos2::new(0.5 * (one.x + five.x), five.y.min(one.y) + 2.0));
    assert_eq!(frames(&window, Setting::Tint), [1.0, 3.0, 5.0]);
    let curve = window.state().state().look.keys(Setting::Tint).clone();
    assert_eq!(curve.at(3.0), before.at(3.0));
    // A click on the grey curve between its top and bottom chooses the yaw.
    let x = five.x + 0.3 * (five.x - one.x);
    let mut places = (five.y as usize..one.y as usize).step_by(3);
    let chosen = |window: &Window| window.query_by_label("Yaw key at frame 0").is_some();
    let found = places.any(|y| {
        super::click_at(&mut window, Pos2::new(x, y as f32), Modifiers::NONE);
        chosen(&window)
    });
    assert!(found && window.query_by_label("Tint key at frame 1").is_none());
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 1.0, 7.0]);
}

#[test]
fn all_keys_of_a_light_are_pasted_onto_another() {
    let folder = crate::temporary();
    let lanes = [lane("lights.1.yaw", &[0, 4]), lane("lights.1.radius", &[2])].join(", ");
    let lights = r#""placed": [{"id": 1}, {"id": 2, "name": "Rim"}]"#;
    let look = format!("{{\"keys\": {{{lanes}}}, \"lighting\": {{{lights}}}}}");
    let mut window = looking(folder.path(), clay::FRAMES, &look);
    let light_setting = |id, setting| Setting::Light(id, setting);
    let at = key(&window, "Light 1 azimuth", 4);
    menu_at(&mut window, at);
    choose(&mut window, "Select all keys");
    menu_at(&mut window, at);
    let (copied, _) = choose(&mut window, "Copy 3 keys");
    menu_at(&mut window, at);
    window.get_by_label("Paste onto").click();
    window.run_steps(4);
    // Its line in the panel has the same name.
    let rims = window.query_all_by_label("Rim");
    let rim = rims.max_by(|a, b| a.rect().top().total_cmp(&b.rect().top()));
    rim.unwrap().click();
    window.run_steps(3);
    window.event(Event::Paste(copied.unwrap()));
    window.run_steps(3);
    assert_eq!(frames(&window, light_setting(2, LightSetting::Yaw)), [0.0, 4.0]);
    assert_eq!(frames(&window, light_setting(2, LightSetting::Radius)), [2.0]);
    assert_eq!(frames(&window, light_setting(1, LightSetting::Yaw)), [0.0, 4.0]);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert!(frames(&window, light_setting(2, LightSetting::Yaw)).is_empty());
}

#[test]
fn a_group_s_gain_is_animated_and_its_lights_follow() {
    let folder = crate::temporary();
    // As written by older versions.
    let lights = r#""placed": [{"id": 1, "group": "Left"}], "groups": [{"name": "Left"}]"#;
    let look = format!("{{\"lighting\": {{{lights}}}}}");
    let mut window = looking(folder.path(), clay::FRAMES, &look);
    until_shown(&mut window);
    let gain = |window: &Window| window.state().state().look.lighting.groups[0].gain_stops;
    let diamond = "Left intensity key at this frame";
    scroll_to(&mut window, diamond);
    window.get_by_label(diamond).click();
    window.run_steps(2);
    go(&mut window, Key::End, 7);
    let even = super::picture(&window);
    type_into(&mut window, (Role::SpinButton, "Intensity of Left"), "2");
    until_shown(&mut window);
    assert_eq!(frames(&window, Setting::Group(1)), [0.0, 7.0]);
    assert!(super::brightness(&super::picture(&window)) > super::brightness(&even));
    key(&window, "Left intensity", 7);
    go(&mut window, Key::Home, 0);
    assert_eq!(gain(&window), 0.0);
    go(&mut window, Key::End, 7);
    assert_eq!(gain(&window), 2.0);
    // The key returns, and is removed with its group.
    drop(window);
    let look = std::fs::read_to_string(folder.path().join("look.json")).unwrap();
    assert!(look.contains("groups.1.gain"), "{look}");
    let mut window = looking(folder.path(), clay::FRAMES, &look);
    assert_eq!(frames(&window, Setting::Group(1)), [0.0, 7.0]);
    let remove = "Remove Left; its lights stay";
    scroll_to(&mut window, remove);
    click_on(&mut window, remove);
    assert!(window.state().state().look.animation.is_empty());
}

#[test]
fn in_and_out_are_undone_and_come_back_in_the_next_window() {
    let (folder, mut window) = crate::new_window();
    let range = |window: &Window| window.state().state().look.range;
    go(&mut window, Key::ArrowRight, 1);
    go(&mut window, Key::ArrowRight, 2);
    window.key_press(Key::I);
    window.run_steps(2);
    go(&mut window, Key::ArrowRight, 3);
    window.key_press(Key::O);
    window.run_steps(2);
    assert_eq!(range(&window), Some((2, 3)));
    for (modifiers, expected) in [
        (Modifiers::COMMAND, Some((2, 7))),
        (Modifiers::COMMAND, None),
        (Modifiers::COMMAND | Modifiers::SHIFT, Some((2, 7))),
        (Modifiers::COMMAND | Modifiers::SHIFT, Some((2, 3))),
    ] {
        window.key_press_modifiers(modifiers, Key::Z);
        window.run_steps(2);
        assert_eq!(range(&window), expected);
    }
    // A drag is a single step.
    let handle = window.get_by_label("Out point at frame 3").rect().center();
    let to = handle + vec2(200.0, 0.0);
    plain_drag(&mut window, handle, to);
    let (_, last) = window.state().state().range();
    assert!(last > 3);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!(range(&window), Some((2, 3)));
    drop(window);
    let mut window = clay_window(folder.path());
    assert_eq!(range(&window), Some((2, 3)));
    window.get_by_label("In point at frame 2");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!(range(&window), Some((2, 7)), "undo comes back too");
}

/// Left and right ends of the line of cached frames, from left to right.
fn cached(window: &Window) -> Vec<[f32; 2]> {
    let color = egui::Color32::from_rgb(108, 147, 192);
    let shapes = window.output().shapes.iter();
    let mut lines: Vec<[f32; 2]> = shapes
        .filter_map(|clipped| match &clipped.shape {
            Shape::Rect(rect) if rect.fill == color && rect.rect.height() < 4.0 => {
                Some([rect.rect.left(), rect.rect.right()])
            }
            _ => None,
        })
        .collect();
    lines.sort_by(|a, b| a[0].total_cmp(&b[0]));
    lines
}

#[test]
fn the_line_below_the_scrub_bar_covers_the_frames_that_are_cached() {
    let folder = crate::temporary();
    let all: Vec<usize> = (0..clay::FRAMES).collect();
    let look = format!("{{\"keys\": {{{}}}}}", lane("yaw", &all));
    let mut window = looking(folder.path(), clay::FRAMES, &look);
    let middle = |window: &Window, frame| key(window, "Yaw", frame).x;
    let at_hand = |app: &StudioApp, frames: &[usize]| {
        let relit = app.relit().unwrap();
        let mut found: Vec<usize> = relit.frames_at_hand.iter().copied().collect();
        found.sort_unstable();
        found == frames
    };
    let check = |window: &mut Window, expected: &[usize]| {
        window.run_steps(2);
        let lines = cached(window);
        for frame in 0..clay::FRAMES {
            let x = middle(window, frame);
            let covered = lines.iter().any(|[left, right]| (*left..*right).contains(&x));
            assert_eq!(covered, expected.contains(&frame), "frame {frame}: {lines:?}");
        }
    };
    until(&mut window, "the first frame", |app| at_hand(app, &[0]));
    check(&mut window, &[0]);
    go(&mut window, Key::End, 7);
    until(&mut window, "the last frame", |app| at_hand(app, &[0, 7]));
    check(&mut window, &[0, 7]);
    go(&mut window, Key::ArrowLeft, 6);
    until(&mut window, "its neighbour", |app| at_hand(app, &[0, 6, 7]));
    check(&mut window, &[0, 6, 7]);
    assert_eq!(cached(&window).len(), 2, "neighbours make one line");
}

#[test]
fn shift_in_the_curve_keeps_the_frame_and_drags_one_key_alone() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    click_on(&mut window, "Curve of Yaw");
    click_on(&mut window, "Yaw key at frame 7");
    let value = |window: &Window, frame: f64| {
        let keys = window.state().state().look.keys(Setting::Yaw);
        keys.at(frame).unwrap()
    };
    let before = [0.0, 3.0, 7.0].map(|frame| value(&window, frame));
    let at = key(&window, "Yaw", 3);
    let to = at + vec2(30.0, 24.0);
    drag(&mut window, at, to, PointerButton::Primary, Modifiers::SHIFT);
    assert_eq!(frames(&window, Setting::Yaw), [0.0, 3.0, 7.0]);
    assert!(value(&window, 3.0) < before[1]);
    assert_eq!([0.0, 7.0].map(|frame| value(&window, frame)), [before[0], before[2]]);
}

#[test]
fn a_taller_pane_has_a_taller_curve() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    click_on(&mut window, "Curve of Yaw");
    let height = |window: &Window| (key(window, "Yaw", 0).y - key(window, "Yaw", 3).y).abs();
    let before = height(&window);
    // The border above the tabs of the timeline.
    let bar = window.get_by_label("Scrub bar").rect();
    let border = bar.center_top() - vec2(0.0, 29.0);
    plain_drag(&mut window, border, border - vec2(0.0, 150.0));
    window.run_steps(4);
    assert!(height(&window) > 2.0 * before, "{before}, {}", height(&window));
}
