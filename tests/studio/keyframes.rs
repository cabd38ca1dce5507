//! Keys of settings: set, visited, moved, copied, shaped and removed; and other uses of the keyboard.

use super::{
    MIDDLE, Window, clay, clay_window, click_on, copied, go, picture, plain_drag, scroll_to, snapshot, until,
    until_shown,
};
use afterlight::light::keyframes::Interpolation;
use afterlight::scene::{LightSetting, Pass, Setting};
use afterlight::studio::StudioApp;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::Queryable;

fn frames(app: &StudioApp, of: Setting) -> Vec<f64> {
    let keys = app.state().look.keys(of).keys();
    keys.iter().map(|key| key.frame).collect()
}

#[test]
fn a_turn_between_two_keys_is_seen_and_can_be_moved_removed_and_undone() {
    let (_folder, mut window) = crate::shown_window();
    let last = clay::FRAMES - 1;
    window.key_press(Key::K);
    window.run_steps(2);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0]);
    go(&mut window, Key::End, last);
    let right = MIDDLE + vec2(200.0, 0.0);
    plain_drag(&mut window, MIDDLE, right);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, last as f64]);
    window.get_by_label_contains(&format!("Yaw is animated: changes set a key at frame {last}."));
    let yaw = window.state().state().look.yaw_deg;
    assert!(yaw > 60.0, "{yaw}");
    for frame in (3..last).rev() {
        go(&mut window, Key::ArrowLeft, frame);
    }
    until_shown(&mut window);
    let between = window.state().state().look.yaw_deg;
    assert!((0.2 * yaw..0.7 * yaw).contains(&between), "{between} of {yaw}");
    assert_eq!(window.state().relit().unwrap().scene.yaw_deg, between);

    // The last key is dragged to the current frame, so that the whole rotation ends there.
    let key = window.get_by_label(&format!("Yaw key at frame {last}")).rect().center();
    let first = window.get_by_label("Yaw key at frame 0").rect().center();
    let to = first + (key - first) * (3.0 / last as f32);
    plain_drag(&mut window, key, to);
    until_shown(&mut window);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0]);
    assert_eq!(window.state().state().look.yaw_deg, yaw);
    let turned = picture(&window);

    // A click goes to a key's frame and selects the key.
    window.get_by_label("Yaw key at frame 0").click();
    until_shown(&mut window);
    assert_eq!(window.state().state().frame, 0);
    assert_ne!(picture(&window), turned);
    window.key_press(Key::Delete);
    until_shown(&mut window);
    assert_eq!(frames(window.state(), Setting::Yaw), [3.0]);
    assert_eq!(window.state().state().look.yaw_deg, yaw, "one key holds everywhere");
    for expected in [vec![0.0, 3.0], vec![0.0, last as f64], vec![0.0], vec![]] {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
        assert_eq!(frames(window.state(), Setting::Yaw), expected);
    }
}

#[test]
fn intensity_is_keyed_by_its_diamond_and_by_key() {
    let (_folder, mut window) = crate::new_window();
    window.get_by_label("Intensity key at this frame").click();
    window.run_steps(2);
    assert_eq!(frames(window.state(), Setting::Intensity), [0.0]);
    go(&mut window, Key::ArrowRight, 1);
    window.key_press_modifiers(Modifiers::SHIFT, Key::K);
    window.run_steps(2);
    assert_eq!(frames(window.state(), Setting::Intensity), [0.0, 1.0]);
    assert!(frames(window.state(), Setting::Yaw).is_empty());
    window.get_by_label("Intensity key at this frame").click();
    window.run_steps(2);
    assert_eq!(frames(window.state(), Setting::Intensity), [0.0]);
}

/// Clicks the key button beside a setting.
fn toggle(window: &mut Window, setting: &str) {
    let diamond = format!("{setting} key at this frame");
    scroll_to(window, &diamond);
    window.get_by_label(&diamond).click();
    window.run_steps(2);
}

/// Position of a key in the window.
fn key(window: &Window, setting: &str, frame: usize) -> Pos2 {
    let name = format!("{setting} key at frame {frame}");
    window.get_by_label(&name).rect().center()
}

/// Types a value into a lane.
fn type_value(window: &mut Window, setting: &str, text: &str) {
    let lane = format!("{setting} lane");
    super::type_into(window, (Role::SpinButton, &lane), text);
}

/// A window with yaw keys at the frames 0, 3 and 7, and exposure keys at 0 and 7.
fn animated(folder: &std::path::Path) -> Window {
    let mut window = clay_window(folder);
    until_shown(&mut window);
    window.key_press(Key::K);
    toggle(&mut window, "Exposure");
    for (frame, by) in [(3, 100.0), (7, -60.0)] {
        while window.state().state().frame < frame {
            let next = window.state().state().frame + 1;
            go(&mut window, Key::ArrowRight, next);
        }
        plain_drag(&mut window, MIDDLE, MIDDLE + vec2(by, 0.0));
    }
    type_value(&mut window, "Exposure", "1");
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0, 7.0]);
    assert_eq!(frames(window.state(), Setting::Exposure), [0.0, 7.0]);
    window
}

#[test]
fn going_to_another_frame_writes_no_file() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    let written = || {
        ["look.json", "undo.json"].map(|name| {
            let path = folder.path().join(name);
            let changed = path.metadata().and_then(|data| data.modified()).ok();
            (std::fs::read_to_string(path).unwrap_or_default(), changed)
        })
    };
    // Dropping the window waits for its writes.
    drop(window);
    let before = written();
    assert!(before.iter().all(|(text, _)| text.contains("\"yaw\"")));
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    window = super::window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0, 7.0]);
    for frame in 1..4 {
        go(&mut window, Key::ArrowRight, frame);
    }
    assert_ne!(window.state().state().look.yaw_deg, 0.0);
    drop(window);
    assert_eq!(written(), before);
}

#[test]
fn every_row_has_a_diamond_and_what_is_animated_has_a_lane() {
    let (_folder, mut window) = crate::shown_window();
    scroll_to(&mut window, "Add light");
    window.get_by_label("Add light").click();
    window.run_steps(2);
    let light = |setting| Setting::Light(1, setting);
    for (name, setting) in [
        ("Pitch", Setting::Pitch),
        ("Roll", Setting::Roll),
        ("Background yaw", Setting::BackgroundYaw),
        ("Temperature", Setting::Temperature),
        ("Tint", Setting::Tint),
        ("Exposure", Setting::Exposure),
        ("Glare", Setting::Effect(Pass::Glare)),
        ("Grain", Setting::Effect(Pass::Grain)),
        ("Light 1 azimuth", light(LightSetting::Yaw)),
        ("Light 1 radius", light(LightSetting::Radius)),
    ] {
        toggle(&mut window, name);
        assert_eq!(frames(window.state(), setting), [0.0], "{name}");
        scroll_to(&mut window, &format!("Curve of {name}"));
    }
    // The channels of a colour get keys together, and a single undo removes them.
    toggle(&mut window, "Light 1 colour");
    let channels = [LightSetting::Red, LightSetting::Green, LightSetting::Blue].map(light);
    for channel in channels {
        assert_eq!(frames(window.state(), channel), [0.0]);
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    for channel in channels {
        assert!(frames(window.state(), channel).is_empty());
    }
    // Removing a light removes its keys.
    scroll_to(&mut window, "Remove light 1");
    window.get_by_label("Remove light 1").click();
    window.run_steps(2);
    assert_eq!(window.state().state().look.animation.lanes().count(), 8);
}

#[test]
fn keys_are_selected_moved_copied_and_removed_together() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    // A box around the keys at frame 7 selects the keys of both lanes.
    let (yaw, exposure) = (key(&window, "Yaw", 7), key(&window, "Exposure", 7));
    plain_drag(&mut window, yaw - vec2(20.0, 9.0), exposure + vec2(10.0, 9.0));
    let by = key(&window, "Yaw", 0) - key(&window, "Yaw", 3);
    plain_drag(&mut window, exposure, exposure + by / 3.0);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0, 6.0]);
    assert_eq!(frames(window.state(), Setting::Exposure), [0.0, 6.0]);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0, 7.0]);

    // Shift+click adds to the selection. Both keys are pasted two frames later.
    window.get_by_label("Yaw key at frame 0").click();
    window.run_steps(2);
    window.get_by_label("Yaw key at frame 3").click_modifiers(Modifiers::SHIFT);
    window.run_steps(2);
    let text = copied(&mut window).unwrap();
    go(&mut window, Key::ArrowRight, 1);
    go(&mut window, Key::ArrowRight, 2);
    window.event(Event::Paste(text.clone()));
    window.run_steps(3);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 2.0, 3.0, 5.0, 7.0]);
    window.key_press(Key::Delete);
    window.run_steps(3);
    assert_eq!(frames(window.state(), Setting::Yaw), [0.0, 3.0, 7.0], "pasted keys are selected");

    // Degrees can be pasted into another lane of degrees.
    toggle(&mut window, "Pitch");
    window.get_by_role_and_label(Role::Button, "Pitch lane").click();
    window.run_steps(2);
    window.event(Event::Paste(text));
    window.run_steps(3);
    assert_eq!(frames(window.state(), Setting::Pitch), [2.0, 5.0]);
    let look = &window.state().state().look;
    assert_eq!(look.keys(Setting::Pitch).at(5.0), look.keys(Setting::Yaw).at(3.0));
    window.event(Event::Paste("no keys".to_owned()));
    window.run_steps(3);
    window.get_by_label_contains("The clipboard holds no keys");
    assert_eq!(frames(window.state(), Setting::Pitch), [2.0, 5.0]);
}

#[test]
fn keys_are_shaped_by_their_menu() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    window.get_by_label("Exposure key at frame 0").click_secondary();
    window.run_steps(3);
    click_on(&mut window, "Hold");
    let kind = |window: &Window| window.state().state().look.keys(Setting::Exposure).kind(0);
    assert_eq!(kind(&window), Interpolation::Hold);
    go(&mut window, Key::ArrowLeft, 6);
    assert_eq!(window.state().state().look.exposure_stops, 0.0);
    go(&mut window, Key::ArrowRight, 7);
    assert_eq!(window.state().state().look.exposure_stops, 1.0);
    window.get_by_label("Exposure key at frame 0").click_secondary();
    window.run_steps(3);
    window.get_by_label_contains("Remove key").click();
    window.run_steps(3);
    assert_eq!(frames(window.state(), Setting::Exposure), [7.0]);
}

#[test]
fn a_curve_s_keys_and_tangents_are_dragged_and_the_picture_follows() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    click_on(&mut window, "Curve of Exposure");
    until_shown(&mut window);
    let before = picture(&window);
    let exposure = |window: &Window| window.state().state().look.exposure_stops;
    assert_eq!(exposure(&window), 1.0);
    let at = key(&window, "Exposure", 7);
    plain_drag(&mut window, at, at + vec2(0.0, 40.0));
    until_shown(&mut window);
    let lower = exposure(&window);
    assert!((0.0..0.9).contains(&lower), "{lower}");
    assert_ne!(picture(&window), before);
    assert_eq!(frames(window.state(), Setting::Exposure), [0.0, 7.0], "straight down");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert_eq!(exposure(&window), 1.0, "a drag is one step of undo");

    // The out tangent of the first key is turned up: the curve rises at once.
    click_on(&mut window, "Exposure key at frame 0");
    go(&mut window, Key::ArrowRight, 1);
    let smooth = exposure(&window);
    let name = "Exposure tangent out at frame 0";
    let knob = window.get_by_label(name).rect().center();
    plain_drag(&mut window, knob, knob - vec2(0.0, 30.0));
    let keys = window.state().state().look.keys(Setting::Exposure).clone();
    assert_eq!(keys.kind(0), Interpolation::Bezier);
    assert!(keys.slopes(0).unwrap()[1] > 0.1, "{keys:?}");
    assert!(exposure(&window) > smooth + 0.05, "{} {smooth}", exposure(&window));
    assert!(window.query_by_label("Exposure tangent in at frame 0").is_none());
    let knob = window.get_by_label(name).rect().center();
    let at = key(&window, "Exposure", 0);
    assert!(knob.y < at.y && knob.x > at.x);
    // Back to automatic.
    window.get_by_label("Exposure key at frame 0").click_secondary();
    window.run_steps(3);
    click_on(&mut window, "Automatic tangents");
    assert!((exposure(&window) - smooth).abs() < 1e-6);
    click_on(&mut window, "Curve of Exposure");
    window.get_by_label("Yaw key at frame 3");
}

#[test]
fn a_value_in_a_lane_sets_a_key_and_in_and_out_are_dragged() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    go(&mut window, Key::ArrowLeft, 6);
    let value = window.get_by_role_and_label(Role::SpinButton, "Exposure lane");
    let at = value.rect().center();
    plain_drag(&mut window, at, at - vec2(40.0, 0.0));
    assert_eq!(frames(window.state(), Setting::Exposure), [0.0, 6.0, 7.0]);
    assert!(window.state().state().look.exposure_stops < 0.5);

    let handle = |window: &Window, name: &str| window.get_by_label(name).rect();
    let out = handle(&window, "Out point at frame 7");
    assert!(out.width() >= 10.0 && out.height() >= 16.0, "{out:?}");
    let to = key(&window, "Yaw", 3).x - key(&window, "Yaw", 7).x;
    plain_drag(&mut window, out.center(), out.center() + vec2(to, 0.0));
    let range = |window: &Window| window.state().state().look.range;
    assert_eq!(range(&window), Some((0, 3)));
    let into = handle(&window, "In point at frame 0");
    let to = key(&window, "Yaw", 3).x - key(&window, "Yaw", 0).x;
    plain_drag(&mut window, into.center(), into.center() + vec2(2.0 * to, 0.0));
    assert_eq!(range(&window), Some((3, 3)), "in and out do not cross");
    let into = handle(&window, "In point at frame 3").center();
    plain_drag(&mut window, into, into - vec2(2.0 * to, 0.0));
    let out = handle(&window, "Out point at frame 3").center();
    plain_drag(&mut window, out, out + vec2(3.0 * to, 0.0));
    assert_eq!(range(&window), None, "all frames");
}

#[test]
fn the_timeline_looks_as_it_did() {
    let folder = crate::temporary();
    let mut window = animated(folder.path());
    toggle(&mut window, "Temperature");
    go(&mut window, Key::ArrowLeft, 6);
    window.key_press(Key::O);
    click_on(&mut window, "Yaw key at frame 3");
    until_shown(&mut window);
    snapshot(&mut window, "studio_lanes");
    click_on(&mut window, "Curve of Yaw");
    let knob = window.get_by_label("Yaw tangent out at frame 3");
    let knob = knob.rect().center();
    plain_drag(&mut window, knob, knob - vec2(0.0, 16.0));
    until_shown(&mut window);
    snapshot(&mut window, "studio_curve");
}

#[test]
fn a_lights_dot_is_moved_by_the_arrow_keys_and_the_frame_stays() {
    let (_folder, mut window) = crate::new_window();
    scroll_to(&mut window, "Add light");
    window.get_by_label("Add light").click();
    until_shown(&mut window);
    let light = |window: &Window| {
        let light = &window.state().state().look.lighting.placed[0];
        (light.yaw_deg.round(), light.pitch_deg.round())
    };
    assert_eq!(light(&window), (-135.0, 45.0));
    scroll_to(&mut window, "Light 1 on the panorama");
    window.get_by_label("Light 1 on the panorama").click();
    window.run_steps(2);
    assert_eq!(light(&window), (-135.0, 45.0), "a click alone moves nothing");
    for (key, modifiers, expected) in [
        (Key::ArrowRight, Modifiers::NONE, (-134.0, 45.0)),
        (Key::ArrowUp, Modifiers::SHIFT, (-134.0, 55.0)),
        (Key::ArrowDown, Modifiers::NONE, (-134.0, 54.0)),
        (Key::ArrowLeft, Modifiers::SHIFT, (-144.0, 54.0)),
    ] {
        window.key_press_modifiers(modifiers, key);
        window.run_steps(3);
        assert_eq!(light(&window), expected);
    }
    until_shown(&mut window);
    assert_eq!(window.state().state().frame, 0);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!(light(&window), (-134.0, 54.0));
}

#[test]
fn the_brightest_areas_follow_pitch_and_roll() {
    let (_folder, mut window) = crate::shown_window();
    let area = |window: &Window| window.get_by_label_contains("Brightest area 1").rect().center();
    let before = area(&window);
    let roll = window.get_by_role_and_label(egui::accesskit::Role::SpinButton, "Roll").rect().center();
    let right = roll + vec2(80.0, 0.0);
    plain_drag(&mut window, roll, right);
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);
    assert!(area(&window).distance(before) > 5.0);
}
