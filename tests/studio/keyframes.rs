//! Keys of yaw and intensity: set, gone through, moved and removed; and what else the keyboard moves.

use super::{MIDDLE, Window, clay, clay_window, drag, picture, scroll_to, until, until_shown};
use afterlight::studio::{Keyframed, StudioApp};
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;

fn frames(app: &StudioApp, of: Keyframed) -> Vec<f64> {
    let keys = app.state().look.keys(of).keys();
    keys.iter().map(|key| key.frame).collect()
}

fn go(window: &mut Window, key: Key, frame: usize) {
    window.key_press(key);
    until(window, "the frame", |app| app.state().frame == frame);
}

#[test]
fn a_turn_between_two_keys_is_seen_and_can_be_moved_removed_and_undone() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let last = clay::FRAMES - 1;
    window.key_press(Key::K);
    window.run_steps(2);
    assert_eq!(frames(window.state(), Keyframed::Yaw), [0.0]);
    go(&mut window, Key::End, last);
    let right = MIDDLE + vec2(200.0, 0.0);
    drag(
        &mut window,
        MIDDLE,
        right,
        PointerButton::Primary,
        Modifiers::NONE,
    );
    assert_eq!(frames(window.state(), Keyframed::Yaw), [0.0, last as f64]);
    window.get_by_label_contains(&format!(
        "Yaw is animated: changes set a key at frame {last}."
    ));
    let yaw = window.state().state().look.yaw_deg;
    assert!(yaw > 60.0, "{yaw}");
    for frame in (3..last).rev() {
        go(&mut window, Key::ArrowLeft, frame);
    }
    until_shown(&mut window);
    let between = window.state().state().look.yaw_deg;
    assert!(
        (0.2 * yaw..0.7 * yaw).contains(&between),
        "{between} of {yaw}"
    );
    assert_eq!(window.state().relit().unwrap().scene.yaw_deg, between);

    // The last key is dragged to the frame that is shown: all of the turn is over there.
    let key = window
        .get_by_label(&format!("Yaw key at frame {last}"))
        .rect()
        .center();
    let first = window.get_by_label("Yaw key at frame 0").rect().center();
    let to = first + (key - first) * (3.0 / last as f32);
    drag(
        &mut window,
        key,
        to,
        PointerButton::Primary,
        Modifiers::NONE,
    );
    until_shown(&mut window);
    assert_eq!(frames(window.state(), Keyframed::Yaw), [0.0, 3.0]);
    assert_eq!(window.state().state().look.yaw_deg, yaw);
    let turned = picture(&window);

    // A click goes to a key's frame and grabs it.
    window.get_by_label("Yaw key at frame 0").click();
    until_shown(&mut window);
    assert_eq!(window.state().state().frame, 0);
    assert_ne!(picture(&window), turned);
    window.key_press(Key::Delete);
    until_shown(&mut window);
    assert_eq!(frames(window.state(), Keyframed::Yaw), [3.0]);
    assert_eq!(
        window.state().state().look.yaw_deg,
        yaw,
        "one key holds everywhere"
    );
    for expected in [vec![0.0, 3.0], vec![0.0, last as f64], vec![0.0], vec![]] {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
        assert_eq!(frames(window.state(), Keyframed::Yaw), expected);
    }
}

#[test]
fn intensity_is_keyed_by_its_diamond_and_by_key() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    window.get_by_label("Intensity key at this frame").click();
    window.run_steps(2);
    assert_eq!(frames(window.state(), Keyframed::Intensity), [0.0]);
    go(&mut window, Key::ArrowRight, 1);
    window.key_press_modifiers(Modifiers::SHIFT, Key::K);
    window.run_steps(2);
    assert_eq!(frames(window.state(), Keyframed::Intensity), [0.0, 1.0]);
    assert!(frames(window.state(), Keyframed::Yaw).is_empty());
    window.get_by_label("Intensity key at this frame").click();
    window.run_steps(2);
    assert_eq!(frames(window.state(), Keyframed::Intensity), [0.0]);
}

#[test]
fn a_lights_dot_is_moved_by_the_arrow_keys_and_the_frame_stays() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
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
    assert_eq!(
        light(&window),
        (-135.0, 45.0),
        "a click alone moves nothing"
    );
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
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let area = |window: &Window| {
        window
            .get_by_label_contains("Brightest area 1")
            .rect()
            .center()
    };
    let before = area(&window);
    let roll = window
        .get_by_role_and_label(egui::accesskit::Role::SpinButton, "Roll")
        .rect()
        .center();
    let right = roll + vec2(80.0, 0.0);
    drag(
        &mut window,
        roll,
        right,
        PointerButton::Primary,
        Modifiers::NONE,
    );
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);
    assert!(area(&window).distance(before) > 5.0);
}
