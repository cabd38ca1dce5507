//! Lights placed by hand: their settings, their groups, and their handles on panorama, sphere and picture.

use super::{
    Window, brightness, clay_window, picture, plain_drag, retype, snapshot, type_into, until,
    until_labelled, until_shown,
};
use afterlight::light::{LightGroup, PlacedLight};
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

fn lights(window: &Window) -> &[PlacedLight] {
    &window.state().state().look.lighting.placed
}

fn groups(window: &Window) -> &[LightGroup] {
    &window.state().state().look.lighting.groups
}

fn add(window: &mut Window) {
    super::scroll_to(window, "Add light");
    window.get_by_label("Add light").click();
    window.run_steps(4);
    until_shown(window);
}

fn click(window: &mut Window, name: &str) {
    window.get_by_label(name).scroll_to_me();
    window.run_steps(4);
    window.get_by_label(name).click();
    window.run_steps(4);
    until_shown(window);
}

/// Chooses an entry of a list.
fn choose(window: &mut Window, list: &str, entry: &str) {
    let list = |window: &Window, act: fn(&egui_kittest::Node)| {
        act(&window.get_by_role_and_label(Role::ComboBox, list));
    };
    list(window, |list| list.scroll_to_me());
    window.run_steps(4);
    list(window, |list| list.click());
    window.run_steps(4);
    window.get_by_label(entry).click();
    window.run_steps(4);
    until_shown(window);
}

/// Types a number into a field.
fn type_number(window: &mut Window, field: &str, text: &str) {
    type_into(window, (Role::SpinButton, field), text);
    until_shown(window);
}

#[test]
fn a_light_has_a_gain_in_stops_and_a_temperature_and_is_muted() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let without = picture(&window);
    add(&mut window);
    let lit = picture(&window);
    type_number(&mut window, "Gain", "1");
    assert_eq!(lights(&window)[0].gain_stops(), 1.0);
    assert!(brightness(&picture(&window)) > brightness(&lit));
    // The environment has a temperature of its own, further down.
    let fields = window.query_all_by_role_and_label(Role::SpinButton, "Temperature");
    let first = fields.min_by(|a, b| a.rect().top().total_cmp(&b.rect().top()));
    first.unwrap().click();
    window.run_steps(3);
    retype(&mut window, "3200");
    window.key_press(Key::Enter);
    window.run_steps(4);
    until_shown(&mut window);
    let warm = &lights(&window)[0];
    assert_eq!(warm.temperature_k, Some(3200.0));
    assert!(warm.color[0] > warm.color[2] + 0.5, "{warm:?}");
    click(&mut window, "Mute Light 1");
    assert!(!lights(&window)[0].enabled);
    assert_eq!(picture(&window), without);
    // Its settings are folded away, and its line stays.
    click(&mut window, "Settings of Light 1");
    assert!(
        window
            .query_by_role_and_label(Role::SpinButton, "Gain")
            .is_none()
    );
    window.get_by_label("Solo Light 1");
}

#[test]
fn a_group_mutes_solos_and_turns_up_its_lights_and_is_named() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let without = picture(&window);
    add(&mut window);
    choose(&mut window, "Group", "new group");
    add(&mut window);
    choose(&mut window, "Group", "Group 1");
    type_number(&mut window, "Azimuth", "120");
    let both = picture(&window);
    let of: Vec<&str> = lights(&window).iter().map(|light| &*light.group).collect();
    assert_eq!(of, ["Group 1", "Group 1"]);

    type_number(&mut window, "Gain of Group 1", "1.5");
    assert_eq!(groups(&window)[0].gain_stops, 1.5);
    assert!(brightness(&picture(&window)) > brightness(&both));
    until_labelled(&mut window, "Light 2 on the picture");
    snapshot(&mut window, "studio_lights");
    click(&mut window, "Mute Group 1");
    assert_eq!(picture(&window), without);
    click(&mut window, "Mute Group 1");
    click(&mut window, "Solo Group 1");
    window.get_by_label("Solo: only Light 1 and Light 2 light the subject");
    assert_eq!(picture(&window)[..3], [0; 3], "the environment is off");
    click(&mut window, "Solo Group 1");

    let field = (Role::TextInput, "Name of Group 1");
    type_into(&mut window, field, "Left side");
    until_shown(&mut window);
    assert_eq!(groups(&window)[0].name, "Left side");
    assert!(
        lights(&window)
            .iter()
            .all(|light| light.group == "Left side")
    );
    // It is kept, and a group that is removed leaves its lights.
    let kept = folder.path().join("look.json");
    until(&mut window, "saved group", |_| {
        let text = std::fs::read_to_string(&kept).unwrap_or_default();
        text.contains("Left side")
    });
    click(&mut window, "Remove Left side; its lights stay");
    assert!(groups(&window).is_empty());
    assert!(lights(&window).iter().all(|light| light.group.is_empty()));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(groups(&window)[0].name, "Left side");
}

#[test]
fn the_first_of_two_groups_is_removed_and_the_other_stays() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    for _ in 0..2 {
        add(&mut window);
        choose(&mut window, "Group", "new group");
    }
    let of = |window: &Window| -> Vec<String> {
        let lights = lights(window).iter();
        lights.map(|light| light.group.clone()).collect()
    };
    assert_eq!(of(&window), ["Group 1", "Group 2"]);
    click(&mut window, "Remove Group 1; its lights stay");
    let names: Vec<&str> = groups(&window).iter().map(|group| &*group.name).collect();
    assert_eq!(names, ["Group 2"]);
    assert_eq!(of(&window), ["", "Group 2"]);
}

#[test]
fn a_handle_is_dragged_on_panorama_sphere_and_picture_alike() {
    let folder = crate::temporary();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    add(&mut window);
    let to = |window: &Window| lights(window)[0].direction();
    let pull = |window: &mut Window, handle: &str, by: egui::Vec2| {
        let from = window.get_by_label(handle).rect().center();
        let to = from + by;
        plain_drag(window, from, to);
        until_shown(window);
    };
    assert!(to(&window).x < -0.3, "it begins at the camera's left");
    // The picture shows where it falls: on the left of the ball, above its middle.
    until_labelled(&mut window, "Light 1 on the picture");
    window.run_steps(3);
    let pane = window.get_by_label("Relit picture").rect();
    let falls = window
        .get_by_label("Light 1 on the picture")
        .rect()
        .center();
    assert!(
        falls.x < pane.center().x && falls.y < pane.center().y,
        "{falls}"
    );
    pull(&mut window, "Light 1 on the panorama", vec2(180.0, 0.0));
    let turned = to(&window);
    assert!(turned.x > 0.2, "{turned}");

    window.get_by_label("Sphere").click();
    window.run_steps(3);
    let on_sphere = window.get_by_label("Light 1 on the sphere").rect().center();
    let sphere = window.get_by_label("Environment").rect().center();
    assert!(on_sphere.x > sphere.x, "light from the right is right");
    snapshot(&mut window, "studio_sphere");
    pull(
        &mut window,
        "Light 1 on the sphere",
        sphere + vec2(-60.0, 0.0) - on_sphere,
    );
    let pulled = to(&window);
    assert!(pulled.x < -0.5 && pulled.y.abs() < 0.2, "{pulled}");

    until_labelled(&mut window, "Light 1 on the picture");
    until(&mut window, "rest", |app| !app.state().is_dragged());
    let before = lights(&window).len();
    pull(&mut window, "Light 1 on the picture", vec2(210.0, 0.0));
    until(&mut window, "light from the right", |app| {
        app.state().look.lighting.placed[0].direction().x > 0.3
    });
    assert_eq!(lights(&window).len(), before, "it moves its own light");
    assert_eq!(
        window.state().state().look.yaw_deg,
        0.0,
        "the environment stays"
    );
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(4);
    until_shown(&mut window);
    assert!(to(&window).distance(pulled) < 1e-4, "one step of undo");
    // Esc puts the handle away.
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label("Light 1 on the picture").is_none());
}
