//! The scopes count the visible picture, and name it.

use super::comparing::{click, compare_by, until_compared};
use super::{MIDDLE, Window, clay_window, click_on, picture, until, until_labelled, until_shown};
use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;

/// Readout of a picture's clipped white pixels.
fn white(rgb: &[u8]) -> String {
    let pixels = rgb.as_chunks::<3>().0;
    let [r, g, b] = [0, 1, 2].map(|c| pixels.iter().filter(|pixel| pixel[c] == 255).count());
    format!("Clipped white: R {r}, G {g}, B {b} pixels")
}

/// Codes of the second picture.
fn second(window: &Window) -> Vec<u8> {
    let relit = window.state().relit().unwrap();
    relit.second.as_ref().unwrap().1.rgb.clone()
}

/// The picture four stops brighter, with some clipped pixels, and the scopes beside it.
fn bright(folder: &std::path::Path) -> Window {
    let mut window = clay_window(folder);
    window.get_by_label("Scopes").click();
    (0..8).for_each(|_| window.key_press(Key::E));
    window.run_steps(20);
    until_shown(&mut window);
    window
}

#[test]
fn scopes_count_the_picture_that_is_seen_and_name_it() {
    let folder = crate::temporary();
    let mut window = bright(folder.path());
    let relit = white(&picture(&window));
    until_labelled(&mut window, &relit);
    assert!(window.query_by_label_contains("Counted: ").is_none());

    // The interview frame is grey, and clips four stops brighter.
    window.key_press(Key::Q);
    until_compared(&mut window);
    let plate = white(&second(&window));
    assert_ne!(plate, relit);
    window.get_by_label("Counted: B interview frame");
    window.get_by_label(&plate);
    assert!(window.query_by_label(&relit).is_none());
    window.key_press(Key::Q);
    window.run_steps(3);
    window.get_by_label("Counted: A relit");
    window.get_by_label(&relit);
    // While held, Shift shows the other picture.
    window.event(Event::ModifiersChanged(Modifiers::SHIFT));
    window.run_steps(3);
    window.get_by_label("Counted: B interview frame");
    window.get_by_label(&plate);
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    window.run_steps(3);
    window.get_by_label("Counted: A relit");

    // With both visible, either can be counted.
    window.key_press(Key::W);
    until_compared(&mut window);
    window.get_by_label(&relit);
    click_on(&mut window, "Count B interview frame");
    window.get_by_label(&plate);
    click_on(&mut window, "Count A relit");
    window.get_by_label(&relit);
    compare_by(&mut window, "Difference");
    window.get_by_label("Count difference × 4");
    let difference = picture(&window);
    window.get_by_label(&white(&difference));
    assert_ne!(white(&difference), relit);
}

#[test]
fn another_picture_in_the_place_of_the_relit_one_is_counted_and_has_no_lamps() {
    let folder = crate::temporary();
    let mut window = bright(folder.path());
    window.event(Event::PointerMoved(MIDDLE));
    until(&mut window, "the lamps of the pixel", |app| app.texel().is_some());
    window.get_by_label("Light from each lamp");
    window.key_press(Key::Q);
    until_compared(&mut window);
    let of_relit = "Light from each lamp, in the relit picture";
    window.get_by_label(of_relit);
    window.key_press(Key::Q);
    window.run_steps(3);
    window.get_by_label("Light from each lamp");
    let relit = white(&picture(&window));
    for name in ["First: relit", "Environment", "sky"] {
        click(&window, name, 208.0);
        window.run_steps(3);
    }
    until(&mut window, "other first picture", |app| app.relit().is_some_and(|relit| relit.first.is_some()));
    window.get_by_label("Counted: A sky");
    let shown = window.state().relit().unwrap().clone();
    let sky = white(&shown.first.as_ref().unwrap().1.rgb);
    assert_ne!(sky, relit);
    window.get_by_label(&sky);
    window.get_by_label(of_relit);
}

#[test]
fn each_channel_of_the_parade_reaches_from_its_darkest_code_to_its_brightest() {
    let need = test_support::Need::Gpu;
    let can_draw = super::vulkan_adapter();
    if !test_support::require(need, can_draw, "no Vulkan adapter to draw with") {
        return;
    }
    let (_folder, mut window) = crate::shown_window();
    click_on(&mut window, "Scopes");
    click_on(&mut window, "Parade");
    let rect = window.get_by_label("RGB parade").rect();
    // Its scale is to the left.
    let rect = rect.with_min_x(rect.left() + 30.0);
    let drawn = window.render().unwrap();
    let third = rect.width() / 3.0;
    let rgb = picture(&window);
    let mut tops = Vec::new();
    for channel in 0..3 {
        let left = rect.left() + channel as f32 * third;
        let columns = (left as u32 + 2)..((left + third) as u32 - 2);
        let has_color = |y: u32| {
            columns.clone().any(|x| {
                let code = drawn.get_pixel(x, y).0.map(i32::from);
                let others = (0..3).filter(|&other| other != channel);
                others.map(|other| code[channel] - code[other]).min() > Some(12)
            })
        };
        let rows = rect.top() as u32..rect.bottom() as u32;
        let top = rows.clone().find(|&y| has_color(y)).unwrap() as f32;
        let bottom = rows.rev().find(|&y| has_color(y)).unwrap() as f32;
        let codes = rgb.iter().skip(channel).step_by(3);
        let (dark, light) = (codes.clone().min().unwrap(), codes.max().unwrap());
        for (row, &code) in [(top, light), (bottom, dark)] {
            let wanted = rect.bottom() - f32::from(code) / 255.0 * rect.height();
            // One of 96 levels is a little more than a point.
            assert!((row - wanted).abs() < 2.5, "{channel}: {row}, {wanted}");
        }
        tops.push(top);
    }
    // Clay in warm light.
    assert!(tops[0] + 5.0 < tops[1] && tops[1] + 5.0 < tops[2], "{tops:?}");
}
