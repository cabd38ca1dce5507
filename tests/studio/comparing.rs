//! Two pictures side by side, lamps alone, pixels, and the list of commands.

use super::{clay_window, drag, picture, snapshot, until, until_shown};
use afterlight::studio::{How, With, Workspace};
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;

fn until_compared(window: &mut super::Window) {
    until_shown(window);
    until(window, "second picture", |app| {
        app.relit().is_some_and(|relit| relit.second.is_some())
    });
}

/// Clicks what is called so to the right of `x`.
fn click(window: &super::Window, name: &str, x: f32) {
    let mut found = window.query_all_by_label(name);
    let one = found.find(|one| one.rect().left() > x);
    one.unwrap_or_else(|| panic!("nothing is called {name}"))
        .click();
}

#[test]
fn the_picture_is_wiped_against_the_plate_and_a_line_is_dragged() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = clay_window(folder.path());
    window.key_press(Key::W);
    until_compared(&mut window);
    let line = window.get_by_label("Wipe").rect().center();
    drag(
        &mut window,
        line,
        line - vec2(100.0, 0.0),
        PointerButton::Primary,
        Modifiers::NONE,
    );
    let state = window.state().state();
    assert!(state.wipe < 0.4, "{}", state.wipe);
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    snapshot(&mut window, "studio_wipe");

    window.key_press(Key::Q);
    window.run_steps(2);
    let compare = window.state().state().compare.clone();
    assert_eq!((compare.how, compare.second), (How::Toggle, true));
    window.key_press(Key::W);
    window.key_press(Key::W);
    until_shown(&mut window);
    assert!(!window.state().state().compare.on);
    until(&mut window, "picture alone", |app| {
        app.relit().is_some_and(|relit| relit.second.is_none())
    });
}

#[test]
fn another_environment_and_a_photographed_pose_stand_beside_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = clay_window(folder.path());
    let open = |window: &mut super::Window, menus: &[&str]| {
        for &name in menus {
            // The list of environments on the left has the same names.
            click(window, name, 208.0);
            window.run_steps(3);
        }
    };
    open(&mut window, &["Compare", "Photographed pose", "pose00"]);
    until_compared(&mut window);
    assert_eq!(window.state().state().compare.with, With::Exemplar(0));
    let shown = window.state().relit().unwrap().clone();
    let (_, rival) = shown.second.as_ref().unwrap();
    assert!(rival.rgb != shown.rgb);
    let rival = rival.clone();
    open(
        &mut window,
        &["Against pose00, photographed", "Environment", "sky"],
    );
    let with = window.state().state().compare.with.clone();
    assert!(matches!(with, With::Environment(_)));
    until(&mut window, "other light", |app| {
        let second = app.relit().and_then(|relit| relit.second.as_ref());
        second.is_some_and(|(_, codes)| *codes != rival)
    });
    assert!(window.state().relit().unwrap().rgb == shown.rgb);
}

#[test]
fn lamps_are_gone_through_by_key_and_a_pixel_tells_what_lights_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let before = picture(&window);
    window.key_press(Key::PageDown);
    window.run_steps(2);
    until(&mut window, "lamp alone", |app| {
        app.relit().is_some_and(|relit| relit.solo == [0])
    });
    assert!(picture(&window) != before);
    window.get_by_label_contains("olat_00 alone").click();
    window.run_steps(2);
    until(&mut window, "environment", |app| {
        app.relit().is_some_and(|relit| relit.solo.is_empty())
    });
    assert!(picture(&window) == before);

    window.get_by_label("Scopes").click();
    window.event(egui::Event::PointerMoved(super::MIDDLE));
    window.run_steps(3);
    let [x, y] = window.state().state().probed.unwrap();
    assert!((8..56).contains(&x) && (8..56).contains(&y), "{x}, {y}");
    until(&mut window, "the lamps of the pixel", |app| {
        app.texel().is_some()
    });
    snapshot(&mut window, "studio_scopes");
    // The lamp under a click is shown alone: one of the two in the middle of 24.
    window.get_by_label("Light by lamp").click();
    window.run_steps(3);
    let solo = window.state().state().solo.clone();
    assert!(solo == [11] || solo == [12], "{solo:?}");
}

#[test]
fn a_command_is_found_by_its_words() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = clay_window(folder.path());
    let command = Modifiers::COMMAND | Modifiers::SHIFT;
    window.key_press_modifiers(command, Key::P);
    window.run_steps(3);
    window.event(egui::Event::Text("calibrate workspace".to_owned()));
    window.run_steps(2);
    snapshot(&mut window, "studio_palette");
    window.key_press(Key::Enter);
    window.run_steps(3);
    let state = window.state().state();
    assert_eq!(
        (state.workspace, state.palette),
        (Workspace::Calibrate, false)
    );

    window.key_press_modifiers(Modifiers::COMMAND, Key::Num3);
    window.run_steps(2);
    window.get_by_label("Panels").click();
    window.run_steps(3);
    // Its tab has the same name; the menu is on the right.
    click(&window, "Environments", 640.0);
    window.run_steps(3);
    assert!(
        window.query_by_label("Add…").is_none(),
        "the pane was closed"
    );
}

#[test]
fn keys_show_channels_and_the_compass_turns_the_light() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = clay_window(folder.path());
    window.key_press(Key::R);
    until_shown(&mut window);
    let red = picture(&window);
    assert!(red.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2]));
    window.key_press(Key::R);
    until_shown(&mut window);
    assert!(picture(&window) != red);
    let compass = window.get_by_label("Compass").rect().center();
    drag(
        &mut window,
        compass - vec2(0.0, 25.0),
        compass + vec2(25.0, 0.0),
        PointerButton::Primary,
        Modifiers::NONE,
    );
    let yaw = window.state().state().look.yaw_deg;
    assert!((yaw - 90.0).abs() < 1.0, "{yaw}");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);

    window.key_press(Key::Num1);
    window.run_steps(3);
    let zoom = window.state().state().view.zoom;
    // 64 pixels on 64 points.
    assert!(zoom < 0.2, "{zoom}");
}
