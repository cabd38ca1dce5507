//! Typed, computed and reset numbers.

use super::lights::{number_of_light, type_number_of_light};
use super::{Window, click_on, double_click, scroll_to, type_into, until_shown};
use egui::Pos2;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

const fn field(name: &str) -> (Role, &str) {
    (Role::SpinButton, name)
}

fn place(window: &mut Window, name: &str) -> Pos2 {
    let (role, name) = field(name);
    window.get_by_role_and_label(role, name).scroll_to_me();
    window.run_steps(4);
    window.get_by_role_and_label(role, name).rect().center()
}

#[test]
fn a_bar_computes_and_a_double_click_resets_it() {
    let (_folder, mut window) = crate::new_window();
    let pitch = |window: &Window| window.state().state().look.lighting.pitch_deg;
    for (typed, expected) in [("20", 20.0), ("+10", 30.0), ("/2", 15.0), ("-5", -5.0)] {
        type_into(&mut window, field("Pitch"), typed);
        assert_eq!(pitch(&window), expected, "{typed}");
    }
    let at = place(&mut window, "Pitch");
    double_click(&mut window, at);
    assert_eq!(pitch(&window), 0.0);
    until_shown(&mut window);
    assert!(!window.ctx.text_edit_focused(), "shortcuts work again");
}

#[test]
fn shares_are_typed_in_percent() {
    let (_folder, mut window) = crate::new_window();
    let glare = |window: &Window| window.state().state().look.effects.glare;
    for (typed, expected) in [
        ("30", 0.3),
        ("+10", 0.4),
        ("/2", 0.2),
        ("12.5 %", 0.125),
        ("43", 0.43),
        ("+10", 0.53),
        ("+10", 0.63),
        ("500", 1.0),
    ] {
        type_into(&mut window, field("Glare"), typed);
        assert_eq!(glare(&window), expected, "{typed}");
    }
    let at = place(&mut window, "Glare");
    double_click(&mut window, at);
    assert_eq!(glare(&window), 0.0);
}

#[test]
fn a_light_s_intensity_computes_and_is_reset() {
    let (_folder, mut window) = crate::new_window();
    scroll_to(&mut window, "Add light");
    window.get_by_label("Add light").click();
    window.run_steps(4);
    let stops = |window: &Window| window.state().state().look.lighting.placed[0].gain_stops();
    for (typed, expected) in [("3", 3.0), ("+1", 4.0), ("/2", 2.0)] {
        type_number_of_light(&mut window, "Intensity", typed);
        assert!((stops(&window) - expected).abs() < 1e-5, "{typed}");
    }
    let at = number_of_light(&window, "Intensity").rect().center();
    double_click(&mut window, at);
    assert!(stops(&window).abs() < 1e-5);
}

#[test]
fn whole_numbers_compute_too() {
    let (_folder, mut window) = crate::new_window();
    for (typed, expected) in [("3", 3), ("+3", 6), ("/4", 2), ("+99", 7), ("-1", 0)] {
        type_into(&mut window, field("Frame"), typed);
        assert_eq!(window.state().state().frame, expected, "{typed}");
    }
    click_on(&mut window, "Workspace Export");
    let range = |window: &Window| window.state().state().look.range;
    type_into(&mut window, field("Out"), "/2");
    // 3.5 is rounded once.
    assert_eq!(range(&window), Some((0, 4)));
    type_into(&mut window, field("Out"), "+2");
    assert_eq!(range(&window), Some((0, 6)));
    type_into(&mut window, field("In"), "+5");
    assert_eq!(range(&window), Some((5, 6)));
    let at = place(&mut window, "In");
    double_click(&mut window, at);
    assert_eq!(range(&window), Some((0, 6)));
    type_into(&mut window, field("Size"), "*2");
    let size = |window: &Window| window.state().state().export_options.size;
    assert_eq!(size(&window), Some(128));
    let at = place(&mut window, "Size");
    double_click(&mut window, at);
    assert_eq!(size(&window), None);
}
