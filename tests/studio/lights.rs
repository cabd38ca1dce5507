//! Lights placed by hand: their settings, their groups, and their handles on panorama, sphere and picture.

use super::{
    Window, brightness, choose, clay_window, click_on, copied, leaving, lights, picture, plain_drag, retype, scroll_to,
    snapshot, told_job, type_into, undo, until, until_labelled, until_shown,
};
use afterlight::light::LightGroup;
use afterlight::scene::{LightSetting, Setting};
use afterlight::studio::Pane;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

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

/// Types a number into a field.
fn type_number(window: &mut Window, field: &str, text: &str) {
    type_into(window, (Role::SpinButton, field), text);
    until_shown(window);
}

#[test]
fn a_light_has_an_intensity_in_stops_and_a_temperature_and_is_muted() {
    let (_folder, mut window) = crate::shown_window();
    let without = picture(&window);
    add(&mut window);
    let lit = picture(&window);
    type_number_of_light(&mut window, "Intensity", "1");
    assert_eq!(lights(&window)[0].gain_stops(), 1.0);
    assert!(brightness(&picture(&window)) > brightness(&lit));
    type_number_of_light(&mut window, "Temperature", "3200");
    let warm = &lights(&window)[0];
    assert_eq!(warm.temperature_k, Some(3200.0));
    assert!(warm.color[0] > warm.color[2] + 0.5, "{warm:?}");
    click(&mut window, "Mute Light 1");
    assert!(!lights(&window)[0].enabled);
    assert_eq!(picture(&window), without);
    // Its settings fold, and its line stays.
    let intensities = |window: &Window| window.query_all_by_role_and_label(Role::SpinButton, "Intensity").count();
    let unfolded = intensities(&window);
    click(&mut window, "Settings of Light 1");
    assert_eq!(intensities(&window), unfolded - 1);
    window.get_by_label("Solo Light 1");
}

#[test]
fn a_group_mutes_solos_and_turns_up_its_lights_and_is_named() {
    let (folder, mut window) = crate::shown_window();
    let without = picture(&window);
    add(&mut window);
    choose(&mut window, "Group", "New group");
    add(&mut window);
    choose(&mut window, "Group", "Group 1");
    type_number(&mut window, "Azimuth", "120");
    let both = picture(&window);
    let group_names: Vec<&str> = lights(&window).iter().map(|light| &*light.group).collect();
    assert_eq!(group_names, ["Group 1", "Group 1"]);

    type_number(&mut window, "Intensity of Group 1", "1.5");
    assert_eq!(groups(&window)[0].gain_stops, 1.5);
    assert!(brightness(&picture(&window)) > brightness(&both));
    until_labelled(&mut window, "Light 2 on the picture");
    snapshot(&mut window, "studio_lights");
    click(&mut window, "Mute Group 1");
    assert_eq!(picture(&window), without);
    click(&mut window, "Mute Group 1");
    click(&mut window, "Solo Group 1");
    window.get_by_label("Solo: Light 1 and Light 2");
    assert_eq!(picture(&window)[..3], [0; 3], "the environment is off");
    click(&mut window, "Solo Group 1");

    let field = (Role::TextInput, "Name of Group 1");
    type_into(&mut window, field, "Left side");
    until_shown(&mut window);
    assert_eq!(groups(&window)[0].name, "Left side");
    assert!(lights(&window).iter().all(|light| light.group == "Left side"));
    // The group is saved, and removing a group keeps its lights.
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
    let (_folder, mut window) = crate::shown_window();
    for _ in 0..2 {
        add(&mut window);
        choose(&mut window, "Group", "New group");
    }
    let group_names = |window: &Window| -> Vec<String> {
        let lights = lights(window).iter();
        lights.map(|light| light.group.clone()).collect()
    };
    assert_eq!(group_names(&window), ["Group 1", "Group 2"]);
    click(&mut window, "Remove Group 1; its lights stay");
    let names: Vec<&str> = groups(&window).iter().map(|group| &*group.name).collect();
    assert_eq!(names, ["Group 2"]);
    assert_eq!(group_names(&window), ["", "Group 2"]);
}

#[test]
fn a_handle_is_dragged_on_panorama_sphere_and_picture_alike() {
    let (_folder, mut window) = crate::shown_window();
    add(&mut window);
    let to = |window: &Window| lights(window)[0].direction();
    let pull = |window: &mut Window, handle: &str, by: egui::Vec2| {
        let from = window.get_by_label(handle).rect().center();
        let to = from + by;
        plain_drag(window, from, to);
        until_shown(window);
    };
    assert!(to(&window).x < -0.3, "the light starts at camera left");
    // The picture shows its highlight: on the left of the ball, above its centre.
    until_labelled(&mut window, "Light 1 on the picture");
    window.run_steps(3);
    let pane = window.get_by_label("Relit picture").rect();
    let falls = window.get_by_label("Light 1 on the picture").rect().center();
    assert!(falls.x < pane.center().x && falls.y < pane.center().y, "{falls}");
    pull(&mut window, "Light 1 on the panorama", vec2(180.0, 0.0));
    let turned = to(&window);
    assert!(turned.x > 0.2, "{turned}");

    click_on(&mut window, "Sphere");
    let on_sphere = window.get_by_label("Light 1 on the sphere").rect().center();
    let sphere = window.get_by_label("Environment map").rect().center();
    assert!(on_sphere.x > sphere.x, "light from the right is right");
    snapshot(&mut window, "studio_sphere");
    pull(&mut window, "Light 1 on the sphere", sphere + vec2(-60.0, 0.0) - on_sphere);
    let pulled = to(&window);
    assert!(pulled.x < -0.5 && pulled.y.abs() < 0.2, "{pulled}");

    until_labelled(&mut window, "Light 1 on the picture");
    until(&mut window, "rest", |app| !app.state().is_dragged());
    let before = lights(&window).len();
    pull(&mut window, "Light 1 on the picture", vec2(210.0, 0.0));
    until(&mut window, "light from the right", |app| app.state().look.lighting.placed[0].direction().x > 0.3);
    assert_eq!(lights(&window).len(), before, "the handle moves its own light");
    assert_eq!(window.state().state().look.yaw_deg, 0.0, "the environment stays");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(4);
    until_shown(&mut window);
    assert!(to(&window).distance(pulled) < 1e-4, "one step of undo");
    // Esc hides the handle.
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label("Light 1 on the picture").is_none());
}

fn keys_of(window: &Window, light: u32) -> Vec<f64> {
    let setting = Setting::Light(light, LightSetting::Yaw);
    let keys = window.state().state().look.keys(setting).keys();
    keys.iter().map(|key| key.value).collect()
}

fn ids(window: &Window) -> Vec<u32> {
    lights(window).iter().map(|light| light.id).collect()
}

#[test]
fn a_light_is_duplicated_copied_pasted_and_removed_with_its_keys() {
    let (_folder, mut window) = crate::shown_window();
    add(&mut window);
    click(&mut window, "Light 1 azimuth key at this frame");
    assert_eq!(keys_of(&window, 1), [-135.0]);
    let one = picture(&window);
    click(&mut window, "Duplicate light 1");
    assert_eq!(ids(&window), [1, 2]);
    assert_eq!(keys_of(&window, 2), [-135.0]);
    assert_eq!(window.state().state().chosen_light(), Some(1));
    assert!(brightness(&picture(&window)) > brightness(&one));
    undo(&mut window);
    assert_eq!((ids(&window), picture(&window)), (vec![1], one));
    assert!(keys_of(&window, 2).is_empty());

    // Keys go to the pane of the last click.
    assert_eq!(window.state().state().panes.active, Pane::Light);
    assert_eq!(copied(&mut window), None, "no light is chosen");
    click(&mut window, "Settings of Light 1");
    let text = copied(&mut window).unwrap();
    for _ in 0..2 {
        window.event(Event::Paste(text.clone()));
        window.run_steps(3);
    }
    until_shown(&mut window);
    assert_eq!(ids(&window), [1, 2, 3]);
    assert_eq!(keys_of(&window, 3), [-135.0]);
    undo(&mut window);
    assert_eq!(ids(&window), [1, 2], "each is one step");
    click(&mut window, "Settings of Light 2");
    window.key_press(Key::Delete);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(ids(&window), [1]);
    assert!(keys_of(&window, 2).is_empty(), "its keys go with it");
    window.key_press(Key::Delete);
    window.run_steps(3);
    assert_eq!(ids(&window), [1], "none is chosen any more");
    undo(&mut window);
    assert_eq!((ids(&window), keys_of(&window, 2)), (vec![1, 2], vec![-135.0]));
    window.event(Event::Paste("a text".to_owned()));
    window.run_steps(3);
    window.get_by_label_contains("The clipboard holds no light");

    // In the timeline, the same keys apply to its lanes.
    click(&mut window, "Settings of Light 1");
    click_on(&mut window, "Light 1 azimuth key at frame 0");
    assert_eq!(window.state().state().panes.active, Pane::Timeline);
    let key = copied(&mut window).unwrap();
    assert!(key.contains("lights.1.yaw") && !key.contains("pitch_deg"), "{key}");
    window.event(Event::Paste(text));
    window.run_steps(3);
    window.key_press(Key::Delete);
    window.run_steps(3);
    assert_eq!(ids(&window), [1, 2]);
    assert!(keys_of(&window, 1).is_empty(), "the key is removed");
    // In a text field, they apply to the text.
    click(&mut window, "Name of Light 1");
    window.key_press(Key::Delete);
    window.run_steps(3);
    assert_eq!(ids(&window), [1, 2]);
}

#[test]
fn lights_are_added_duplicated_and_removed_by_their_commands() {
    let (_folder, mut window) = crate::shown_window();
    let run = |window: &mut Window, words: &str| {
        window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
        window.run_steps(3);
        window.event(Event::Text(words.to_owned()));
        window.run_steps(2);
        window.key_press(Key::Enter);
        window.run_steps(4);
        until_shown(window);
    };
    run(&mut window, "duplicate light");
    window.get_by_label_contains("Choose a light first");
    window.key_press(Key::Escape);
    window.run_steps(2);
    run(&mut window, "add light");
    assert_eq!(ids(&window), [1]);
    window.key_press_modifiers(Modifiers::COMMAND, Key::D);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(ids(&window), [1, 2]);
    assert!(!window.state().state().viewport.doubts, "Ctrl+D is not D");
    run(&mut window, "remove light");
    assert_eq!(ids(&window), [1]);
    run(&mut window, "light by the face");
    assert!(window.state().state().viewport.aims);
}

#[test]
fn a_handle_on_picture_or_sphere_is_moved_by_the_arrow_keys_and_removed() {
    let (_folder, mut window) = crate::shown_window();
    add(&mut window);
    let to = |window: &Window| lights(window)[0].direction();
    let press = |window: &mut Window, key, modifiers| {
        window.key_press_modifiers(modifiers, key);
        window.run_steps(4);
        until_shown(window);
    };
    click_on(&mut window, "Sphere");
    for map in ["sphere", "picture"] {
        let name = format!("Light 1 on the {map}");
        until_labelled(&mut window, &name);
        let before = to(&window);
        click_on(&mut window, &name);
        assert_eq!(to(&window), before, "a click alone moves nothing");
        let at = window.get_by_label(&name).rect().center();
        press(&mut window, Key::ArrowRight, Modifiers::SHIFT);
        assert!(to(&window).x > before.x + 0.05, "{map}: {}", to(&window));
        until_labelled(&mut window, &name);
        assert!(window.get_by_label(&name).rect().center().x > at.x, "{map}");
        let before = to(&window);
        press(&mut window, Key::ArrowDown, Modifiers::NONE);
        assert!(to(&window).y < before.y, "{map}");
        assert_eq!(window.state().state().frame, 0);
        undo(&mut window);
        assert!(to(&window).distance(before) < 1e-5, "a press is one step");
    }
    assert_eq!(window.state().state().panes.active, Pane::Picture);
    click_on(&mut window, "Light 1 on the picture");
    press(&mut window, Key::Delete, Modifiers::NONE);
    assert!(lights(&window).is_empty());
    undo(&mut window);
    assert_eq!(ids(&window), [1]);
}

#[test]
fn a_colour_is_picked_and_the_temperature_no_longer_applies() {
    let (_folder, mut window) = crate::shown_window();
    add(&mut window);
    type_number_of_light(&mut window, "Temperature", "3200");
    assert_eq!(lights(&window)[0].temperature_k, Some(3200.0));
    let warm = picture(&window);
    click(&mut window, "Colour of Light 1");
    for (channel, code) in [("R", "0"), ("G", "64"), ("B", "255")] {
        type_number(&mut window, channel, code);
    }
    let light = &lights(&window)[0];
    assert_eq!(light.temperature_k, None);
    let [r, g, b] = light.color;
    assert!(r < 0.01 && (0.01..0.1).contains(&g) && b > 0.99, "{light:?}");
    let blue = picture(&window);
    let sum = |picture: &[u8], channel: usize| -> u64 {
        let codes = picture.iter().skip(channel).step_by(3);
        codes.map(|&code| u64::from(code)).sum()
    };
    assert!(sum(&blue, 0) < sum(&warm, 0) && sum(&blue, 2) > sum(&warm, 2));
}

/// A light's field. The environment has fields of the same names, below.
pub fn number_of_light<'a>(window: &'a Window, field: &'a str) -> egui_kittest::Node<'a> {
    let fields = window.query_all_by_role_and_label(Role::SpinButton, field);
    fields.min_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).unwrap()
}

/// Types into the first field with this name: the light's, which is above the environment's.
pub fn type_number_of_light(window: &mut Window, field: &str, text: &str) {
    number_of_light(window, field).click();
    window.run_steps(3);
    retype(window, text);
    window.key_press(Key::Enter);
    window.run_steps(4);
    until_shown(window);
}

#[test]
fn a_group_folds_and_a_name_that_is_taken_is_refused_in_words() {
    let (_folder, mut window) = crate::shown_window();
    for _ in 0..2 {
        add(&mut window);
        choose(&mut window, "Group", "New group");
    }
    let name = (Role::TextInput, "Name of Group 2");
    type_into(&mut window, name, "Group 1");
    let names = |window: &Window| -> Vec<String> {
        let groups = groups(window).iter();
        groups.map(|group| group.name.clone()).collect()
    };
    assert_eq!(names(&window), ["Group 1", "Group 2"]);
    window.get_by_label_contains("A group named Group 1 already exists");
    window.key_press(Key::Escape);
    window.run_steps(2);

    type_number(&mut window, "Azimuth", "120");
    click(&mut window, "Group 2 group");
    assert!(window.query_by_label("Name of Light 2").is_none());
    assert!(window.query_by_role_and_label(Role::SpinButton, "Intensity of Group 2").is_none());
    window.get_by_label("Name of Light 1");
    // Its name and mute button stay, and it stays folded after a rename.
    click(&mut window, "Mute Group 2");
    assert!(groups(&window)[1].muted);
    type_into(&mut window, name, "Rim");
    until_shown(&mut window);
    assert_eq!(names(&window), ["Group 1", "Rim"]);
    assert_eq!(lights(&window)[1].group, "Rim");
    assert!(window.query_by_label("Name of Light 2").is_none());
    click(&mut window, "Rim group");
    window.get_by_label("Name of Light 2");
    // Selecting or adding a light in a folded group unfolds the group.
    click(&mut window, "Rim group");
    assert!(window.query_by_label("Name of Light 2").is_none());
    click(&mut window, "Settings of Light 1");
    click(&mut window, "Light 2 on the panorama");
    window.get_by_label("Name of Light 2");
    click(&mut window, "Rim group");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(4);
    // A new group is not folded like the removed one.
    click(&mut window, "Remove Group 2; its lights stay");
    choose(&mut window, "Group", "New group");
    window.get_by_label("Name of Light 2");
}

#[test]
fn keys_change_no_light_and_no_key_behind_a_question() {
    let (_folder, mut window) = crate::shown_window();
    add(&mut window);
    click(&mut window, "Light 1 azimuth key at this frame");
    let job = told_job(&mut window);
    let before = window.state().state().look.clone();
    let press = |window: &mut Window| {
        let copied = Event::Paste("no light".to_owned());
        for event in [Event::Copy, Event::Cut, copied] {
            window.event(event);
        }
        for key in [Key::Delete, Key::Backspace, Key::ArrowUp] {
            window.key_press(key);
        }
        window.run_steps(3);
    };
    let targets = ["Light 1 on the panorama", "Light 1 azimuth key at frame 0"];
    for target in targets {
        let at = window.get_by_label(target).rect().center();
        plain_drag(&mut window, at, at);
        assert!(leaving::close(&mut window));
        press(&mut window);
        let state = window.state();
        assert_eq!(state.state().look, before, "{target}");
        assert_eq!(state.status().refusal, None, "{target}");
        window.key_press(Key::Escape);
        window.run_steps(2);
    }
    // Without the question, they change the focused control.
    press(&mut window);
    assert_ne!(window.state().state().look, before);
    drop(job);
}

#[test]
fn lights_their_groups_and_copies_are_there_when_the_window_opens_again() {
    let (folder, mut window) = crate::shown_window();
    add(&mut window);
    choose(&mut window, "Group", "New group");
    type_number(&mut window, "Intensity of Group 1", "1.5");
    type_into(&mut window, (Role::TextInput, "Name of Light 1"), "Key");
    click(&mut window, "Key azimuth key at this frame");
    click(&mut window, "Duplicate light 1");
    type_number(&mut window, "Azimuth", "120");
    let (before, shown) = (window.state().state().look.clone(), picture(&window));
    let names: Vec<&str> = before.lighting.placed.iter().map(|l| &*l.name).collect();
    assert_eq!(names, ["Key", "Key 2"]);
    // Dropping the window waits for its writes.
    drop(window);
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    let after = &window.state().state().look;
    assert_eq!(after.lighting, before.lighting);
    assert_eq!(after.animation, before.animation);
    assert_eq!((keys_of(&window, 1), keys_of(&window, 2)), (vec![-135.0], vec![-240.0]));
    assert_eq!(picture(&window), shown);
    undo(&mut window);
    assert_eq!(keys_of(&window, 2), [-135.0], "undo steps are restored too");
}

#[test]
fn every_line_of_many_lights_is_reached_and_nothing_of_it_is_cut() {
    let folder = crate::temporary();
    let light = |i: usize| {
        let group = ["", "Left", "Right", "Practicals behind the subject, far away"][i % 4];
        serde_json::json!({ "group": group, "yaw_deg": 15.0 * i as f32 - 90.0 })
    };
    let placed: Vec<_> = (0..12).map(light).collect();
    let group = |name: &str| serde_json::json!({ "name": name });
    let groups = ["Left", "Right", "Practicals behind the subject, far away"].map(group);
    let look = serde_json::json!({ "lighting": { "placed": placed, "groups": groups } });
    std::fs::write(folder.path().join("look.json"), look.to_string()).unwrap();
    let mut window = clay_window(folder.path());
    until_shown(&mut window);
    assert_eq!(lights(&window).len(), 12);
    let panorama = window.get_by_label("Environment map").rect();
    let pane = egui::Rect::from_x_y_ranges(panorama.x_range().expand(10.0), 60.0..=690.0);
    for i in 1..=12 {
        scroll_to(&mut window, &format!("Name of Light {i}"));
        let parts = [
            format!("Settings of Light {i}"),
            format!("Mute Light {i}"),
            format!("Solo Light {i}"),
            format!("Name of Light {i}"),
            format!("Colour of Light {i}"),
            format!("Duplicate light {i}"),
            format!("Remove light {i}"),
        ];
        let rects = parts.map(|part| window.get_by_label(&part).rect());
        assert!(rects.iter().all(|rect| pane.contains_rect(*rect)), "{i}: {rects:?}");
        let apart = rects.windows(2).all(|pair| pair[0].right() < pair[1].left());
        assert!(apart && rects[3].width() > 60.0, "{i}: {rects:?}");
    }
    // The last settings of the last light in the longest group.
    click(&mut window, "Settings of Light 12");
    for field in ["Intensity", "Azimuth", "Elevation", "Radius"] {
        let area = |window: &Window| number_of_light(window, field).rect();
        number_of_light(&window, field).scroll_to_me();
        window.run_steps(4);
        assert!(pane.contains_rect(area(&window)), "{field}: {}", area(&window));
    }
    click(&mut window, "Mute Light 12");
    assert!(!lights(&window)[11].enabled, "nothing covers it");
    scroll_to(&mut window, "Mute Light 7");
    snapshot(&mut window, "studio_many_lights");
}
