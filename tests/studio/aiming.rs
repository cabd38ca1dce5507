//! Lights placed by the face, and lights that light the subject alone.

use super::{Window, drag, lights, live::until_idle, picture, plain_drag, undo, until, until_said, until_shown};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use tempfile::TempDir;

/// Position in the window of a pixel of the fitted picture, which has 64 by 64 pixels.
pub fn place(window: &Window, x: f32, y: f32) -> Pos2 {
    let pane = window.get_by_label("Relit picture").rect();
    let point = (pane.width().min(pane.height()) - 32.0) / 64.0;
    pane.center() + point * vec2(x - 32.0, y - 32.0)
}

fn click(window: &mut Window, at: Pos2) {
    window.hover_at(at);
    window.drag_at(at);
    window.drop_at(at);
    window.run_steps(3);
}

fn until_lights(window: &mut Window, count: usize) {
    until(window, "placed light", |app| app.state().look.lighting.placed.len() == count);
    until_shown(window);
}

/// A window in which a press on the picture places a light, and its folder.
fn aiming_window() -> (Window, TempDir) {
    let (folder, mut window) = crate::shown_window();
    window.key_press(Key::H);
    window.run_steps(2);
    (window, folder)
}

#[test]
fn a_click_on_the_left_cheek_places_a_light_from_camera_left() {
    let (_folder, mut window) = crate::shown_window();
    let before = picture(&window);
    window.key_press(Key::H);
    window.run_steps(2);
    window.get_by_label_contains("Click where a light should fall");
    // The ball's centre is in column 26, its radius 22 pixels.
    let cheek = place(&window, 12.0, 32.0);
    click(&mut window, cheek);
    until_lights(&mut window, 1);
    let to = lights(&window)[0].direction();
    assert!(to.x < -0.4 && to.z > 0.0 && to.y.abs() < 0.4, "{to}");
    assert_eq!(window.state().state().chosen_light(), Some(0));
    assert_eq!(window.state().state().look.yaw_deg, 0.0, "the light stays");
    assert_ne!(picture(&window), before);
    super::snapshot(&mut window, "studio_aim");
    let forehead = place(&window, 26.0, 18.0);
    click(&mut window, forehead);
    until_lights(&mut window, 2);
    let to = lights(&window)[1].direction();
    assert!(to.y > 0.4 && to.x.abs() < 0.4, "{to}");
    undo(&mut window);
    assert_eq!(lights(&window).len(), 1);
    undo(&mut window);
    assert_eq!(picture(&window), before);
}

#[test]
fn a_tap_of_a_pen_places_a_light() {
    let (mut window, _folder) = aiming_window();
    let cheek = place(&window, 12.0, 32.0);
    // All in one frame of the window.
    window.input_mut().events.extend([
        Event::PointerMoved(cheek),
        super::press(cheek, true),
        super::press(cheek, false),
        Event::PointerGone,
    ]);
    window.run_steps(4);
    until_lights(&mut window, 1);
    assert!(lights(&window)[0].direction().x < -0.4);
}

#[test]
fn escape_ends_light_by_the_face_before_a_message() {
    let (mut window, _folder) = aiming_window();
    super::drop_onto(&mut window, "notes.txt");
    let hint = window.get_by_label_contains("Click where a light should fall").rect();
    let note = window.get_by_label_contains("notes.txt cannot be used").rect();
    assert!(!note.intersects(hint), "{note:?} {hint:?}");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!window.state().state().viewport.aims);
    window.get_by_label_contains("notes.txt cannot be used");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(window.state().status().refusal, None);
}

#[test]
fn escape_ends_light_by_the_face_and_a_passing_message_alike() {
    let (mut window, _folder) = aiming_window();
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    window.get_by_label_contains("saved as you work");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!window.state().state().viewport.aims);
    assert!(window.query_by_label_contains("saved as you work").is_none());
}

#[test]
fn a_drag_over_the_face_moves_one_light_and_is_undone_at_once() {
    let (_folder, mut window) = crate::shown_window();
    window.get_by_label("Light by the face").click();
    window.run_steps(2);
    let (from, to) = (place(&window, 12.0, 32.0), place(&window, 40.0, 32.0));
    plain_drag(&mut window, from, to);
    until(&mut window, "light from camera right", |app| {
        let light = app.state().look.lighting.placed.first();
        light.is_some_and(|light| light.direction().x > 0.4)
    });
    until_shown(&mut window);
    assert_eq!(lights(&window).len(), 1);
    undo(&mut window);
    assert!(lights(&window).is_empty());
    assert!(!window.state().state().can_undo());
}

#[test]
fn a_click_beside_the_subject_places_nothing_and_says_so() {
    let (mut window, _folder) = aiming_window();
    let wall = place(&window, 60.0, 4.0);
    click(&mut window, wall);
    until_said(&mut window, "this is not the subject");
    assert!(lights(&window).is_empty() && !window.state().state().can_undo());
    // With Ctrl, a drag turns the environment. After Esc, so does a plain drag.
    let middle = super::MIDDLE;
    drag(&mut window, middle, middle + vec2(50.0, 0.0), PointerButton::Primary, Modifiers::COMMAND);
    let turned = window.state().state().look.yaw_deg;
    assert!(turned > 10.0 && lights(&window).is_empty(), "{turned}");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.query_by_label_contains("this is not the subject").is_none());
    plain_drag(&mut window, middle, middle + vec2(50.0, 0.0));
    assert!(window.state().state().look.yaw_deg > turned + 10.0);
    assert!(lights(&window).is_empty());
}

#[test]
fn the_lamp_that_falls_under_the_pointer_is_proposed_and_shown_alone() {
    let (mut window, _folder) = aiming_window();
    let cheek = place(&window, 12.0, 32.0);
    window.hover_at(cheek);
    until_said(&mut window, "Right-click: solo lamp ");
    let rig = window.state().relit().unwrap().rig.clone();
    let lamp = (0..rig.lamps.len())
        .find(|lamp| window.query_by_label_contains(&format!("solo lamp {lamp},")).is_some())
        .unwrap();
    let to = rig.lamps[lamp].direction;
    assert!(to.x < -0.4 && to.y.abs() < 0.6, "{to}");
    pointer_button(&mut window, cheek, PointerButton::Secondary);
    assert_eq!(window.state().state().solo, [lamp]);
    assert!(lights(&window).is_empty(), "no light is placed");
    // Esc leaves the solo lamp first, then the mode.
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().state().solo.is_empty() && window.state().state().viewport.aims);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!window.state().state().viewport.aims);
    // Without a picture, a click has no target.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.key_press(Key::H);
    window.run_steps(2);
    window.get_by_label_contains("needs the picture");
    assert!(!window.state().state().viewport.aims);
}

fn pointer_button(window: &mut Window, at: Pos2, button: PointerButton) {
    for pressed in [true, false] {
        window.event(Event::PointerButton { pos: at, button, pressed, modifiers: Modifiers::NONE });
        window.run_steps(2);
    }
}

#[test]
fn a_press_where_a_light_falls_takes_that_light() {
    let (mut window, _folder) = aiming_window();
    let cheek = place(&window, 12.0, 32.0);
    click(&mut window, cheek);
    until_lights(&mut window, 1);
    until_idle(&mut window, "where it falls");
    let first = lights(&window)[0].direction();
    // Near the handle, but not on it.
    let near = cheek + vec2(16.0, -8.0);
    window.hover_at(near);
    until_said(&mut window, "Light 1 falls here");
    let forehead = place(&window, 26.0, 18.0);
    plain_drag(&mut window, near, forehead);
    until(&mut window, "the light at the forehead", |app| app.state().look.lighting.placed[0].direction().y > 0.4);
    until_shown(&mut window);
    assert_eq!(lights(&window).len(), 1);
    undo(&mut window);
    assert_eq!(lights(&window)[0].direction(), first);
}

#[test]
fn lights_alone_are_a_mode_that_escape_and_another_environment_end() {
    let (_folder, mut window) = crate::shown_window();
    let before = picture(&window);
    window.get_by_label("Add light").click();
    until_lights(&mut window, 1);
    let all = picture(&window);
    let solo = |window: &mut Window| {
        window.get_by_label("Solo Light 1").click();
        until_shown(window);
        window.get_by_label("Solo: Light 1 ×");
        assert_ne!(picture(window), all);
    };
    solo(&mut window);
    window.key_press(Key::Escape);
    until_shown(&mut window);
    assert!(window.query_by_label("Solo: Light 1 ×").is_none());
    assert_eq!(picture(&window), all);
    solo(&mut window);
    window.get_by_label("Solo: Light 1 ×").click();
    until_shown(&mut window);
    assert_eq!(picture(&window), all);
    // A row of another environment.
    solo(&mut window);
    window.key_press_modifiers(Modifiers::ALT, Key::ArrowRight);
    until_shown(&mut window);
    assert!(!window.state().state().look.lighting.is_solo());
    window.get_by_label_contains("Solo ended");
    undo(&mut window);
    assert!(window.state().state().look.lighting.is_solo(), "one undo restores both");
    // The row of the current environment.
    let state = window.state().state();
    let row = window.state().environments()[state.look.environment].listed.name.clone();
    window.get_by_label(&row).click();
    until_shown(&mut window);
    assert!(!window.state().state().look.lighting.is_solo());
    // A rotation by a drag is invisible under a solo lamp.
    (0..9).for_each(|_| undo(&mut window));
    assert_eq!(picture(&window), before);
    window.key_press(Key::PageDown);
    until_shown(&mut window);
    assert_eq!(window.state().state().solo, [0]);
    let middle = super::MIDDLE;
    plain_drag(&mut window, middle, middle + vec2(60.0, 0.0));
    until_shown(&mut window);
    assert!(window.state().state().solo.is_empty());
    window.get_by_label_contains("Solo ended");
}

#[test]
fn a_solo_light_lights_the_subject_alone_and_lights_have_names() {
    let (_folder, mut window) = crate::new_window();
    window.get_by_label("Add light").click();
    until_lights(&mut window, 1);
    let all = picture(&window);
    window.get_by_label("Solo Light 1").click();
    until_shown(&mut window);
    window.get_by_label("Solo: Light 1");
    let alone = picture(&window);
    assert_ne!(alone, all);
    assert_eq!(alone[..3], [0; 3], "the environment is off");
    // The environment is off: its rotation changes nothing.
    let middle = super::MIDDLE;
    plain_drag(&mut window, middle, middle + vec2(60.0, 0.0));
    until_shown(&mut window);
    assert!(window.state().state().look.yaw_deg > 10.0);
    assert_eq!(picture(&window), alone);

    window.get_by_role_and_label(Role::TextInput, "Name of Light 1").click();
    window.run_steps(3);
    window.event(Event::Text("Key".to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(lights(&window)[0].name, "Key");
    window.get_by_label("Solo: Key");
    window.get_by_label("Key on the panorama");
    undo(&mut window);
    assert!(lights(&window)[0].name.is_empty() && lights(&window)[0].solo);
    window.get_by_label("Solo Light 1").click();
    until_shown(&mut window);
    assert_ne!(picture(&window), alone);
}
