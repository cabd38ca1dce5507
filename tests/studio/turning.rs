//! Rotation of the environment: its number and the compass show it, and a drag or a click changes it.

use super::{
    Window, clay, click_at, click_on, go, plain_drag, scroll_to, type_into, until, until_labelled, until_shown, window,
};
use afterlight::studio::StudioApp;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use std::sync::mpsc::channel;

fn yaw(window: &Window) -> f32 {
    window.state().state().look.yaw_deg
}

/// Text of a number field.
fn reads(window: &Window, field: &str) -> String {
    let field = window.get_by_role_and_label(Role::SpinButton, field);
    field.value().unwrap_or_default()
}

fn compass(window: &Window) -> f64 {
    let compass = window.get_by_label("Compass");
    compass.accesskit_node().numeric_value().unwrap()
}

fn type_number(window: &mut Window, field: &str, text: &str) {
    type_into(window, (Role::SpinButton, field), text);
    until_shown(window);
}

#[test]
fn an_angle_beyond_a_turn_reads_as_an_angle_and_turns_and_can_be_typed() {
    let (_folder, mut window) = crate::shown_window();
    type_number(&mut window, "Yaw", "442");
    assert_eq!((yaw(&window), reads(&window, "Yaw")), (82.0, "82.0°".into()));
    // With keys, it makes one turn and more.
    window.key_press(Key::K);
    window.run_steps(2);
    go(&mut window, Key::End, clay::FRAMES - 1);
    type_number(&mut window, "Yaw", "442");
    assert_eq!(yaw(&window), 442.0);
    assert_eq!(reads(&window, "Yaw"), "82.0° + 1 turn");
    assert_eq!(compass(&window), 82.0);
    type_number(&mut window, "Yaw", "+1 turn");
    assert_eq!((yaw(&window), compass(&window)), (802.0, 82.0));
    // Its text can be typed without a change.
    let said = reads(&window, "Yaw");
    assert_eq!(said, "82.0° + 2 turns");
    type_number(&mut window, "Yaw", &said);
    assert_eq!(yaw(&window), 802.0);
    type_number(&mut window, "Yaw", "-90");
    assert_eq!((yaw(&window), reads(&window, "Yaw")), (-90.0, "-90.0°".into()));
    // Without keys, there are no extra turns.
    type_number(&mut window, "Yaw", "442");
    go(&mut window, Key::Home, 0);
    window.key_press(Key::K);
    go(&mut window, Key::End, clay::FRAMES - 1);
    assert_eq!(yaw(&window), 442.0);
    window.key_press(Key::K);
    until_shown(&mut window);
    assert_eq!(yaw(&window), 82.0);
}

#[test]
fn a_placed_light_that_goes_on_turning_never_reads_190_degrees() {
    let (_folder, mut window) = crate::shown_window();
    scroll_to(&mut window, "Add light");
    window.get_by_label("Add light").click();
    until_shown(&mut window);
    type_number(&mut window, "Azimuth", "190");
    let azimuth = |window: &Window| window.state().state().look.lighting.placed[0].yaw_deg;
    assert_eq!(azimuth(&window), -170.0, "a typed angle comes within a turn");
    type_number(&mut window, "Azimuth", "170");
    click_on(&mut window, "Light 1 azimuth key at this frame");
    go(&mut window, Key::End, clay::FRAMES - 1);
    type_number(&mut window, "Azimuth", "-170");
    assert_eq!(azimuth(&window), 190.0, "the shorter way around");
    assert_eq!(reads(&window, "Azimuth"), "-170.0° + 1 turn");
}

/// A place on the compass, in points from its centre.
fn on_compass(window: &Window, x: f32, y: f32) -> Pos2 {
    window.get_by_label("Compass").rect().center() + vec2(x, y)
}

#[test]
fn a_drag_on_the_compass_turns_from_where_it_was_pressed_and_a_click_turns_it_there() {
    let (_folder, mut window) = crate::shown_window();
    assert_eq!(compass(&window), 0.0);
    // The dot is at the top, and the drag starts at the bottom.
    let from = on_compass(&window, 0.0, 30.0);
    let to = on_compass(&window, -10.0, 28.0);
    plain_drag(&mut window, from, to);
    until_shown(&mut window);
    let turned = yaw(&window);
    assert!((15.0..25.0).contains(&turned), "{turned}");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(yaw(&window), 0.0, "a drag is one step");
    // Across the seam opposite the camera.
    let right = on_compass(&window, 30.0, 0.0);
    click_at(&mut window, right, Modifiers::NONE);
    until_shown(&mut window);
    assert!((yaw(&window) - 90.0).abs() < 0.5, "{}", yaw(&window));
    // A yaw with keys keeps its turns.
    window.key_press(Key::K);
    window.run_steps(2);
    type_number(&mut window, "Yaw", "450");
    let bottom = on_compass(&window, 0.0, 30.0);
    click_at(&mut window, bottom, Modifiers::NONE);
    until_shown(&mut window);
    assert!((yaw(&window) - 540.0).abs() < 0.5, "{}", yaw(&window));
}

#[test]
fn a_drag_moves_the_wipe_and_not_the_light_before_the_second_picture_is_there() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let (go_on, waits) = channel::<()>();
    let mut waits = Some(waits);
    let source = move || {
        let mut source = clay::source()?;
        let (mut compared, waits) = (source.comparison, waits.take());
        source.comparison = Box::new(move |rival, index| {
            // Until the test releases it or ends.
            waits.iter().for_each(|waits| _ = waits.recv());
            compared(rival, index)
        });
        Ok(source)
    };
    let mut window = window(|ctx| StudioApp::over(ctx, project, source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    until_shown(&mut window);
    for menu in ["Compare", "Photographed pose", "pose00"] {
        super::comparing::click(&window, menu, 208.0);
        window.run_steps(3);
    }
    let state = window.state().state();
    assert!(state.compare.on && window.state().relit().unwrap().second.is_none());
    let from = super::MIDDLE;
    plain_drag(&mut window, from, from + vec2(90.0, 0.0));
    assert!(window.state().relit().unwrap().second.is_none());
    let state = window.state().state();
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    assert!(state.viewport.wipe != 0.5, "the line follows");
    drop(go_on);
    until_labelled(&mut window, "Wipe");
}
