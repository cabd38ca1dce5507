//! Comparisons of two pictures, solo lamps, pixels, and the list of commands.

use super::training::trained_project;
use super::{clay, click_on, drag, picture, plain_drag, snapshot, until, until_shown, window};
use afterlight::studio::{CompareMode, Pane, Reference, StudioApp, Workspace};
use afterlight::worker::{Comparison, ComparisonSource};
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;

pub fn until_compared(window: &mut super::Window) {
    until_shown(window);
    until(window, "second picture", |app| app.relit().is_some_and(|relit| relit.second.is_some()));
}

/// Clicks the control with this name to the right of `x`.
pub fn click(window: &super::Window, name: &str, x: f32) {
    let mut found = window.query_all_by_label(name);
    let one = found.find(|one| one.rect().left() > x);
    one.unwrap_or_else(|| panic!("nothing is called {name}")).click();
}

#[test]
fn the_picture_is_wiped_against_the_plate_and_a_line_is_dragged() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::W);
    until_compared(&mut window);
    let line = window.get_by_label("Wipe").rect().center();
    plain_drag(&mut window, line, line - vec2(100.0, 0.0));
    let state = window.state().state();
    assert!(state.viewport.wipe < 0.4, "{}", state.viewport.wipe);
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    snapshot(&mut window, "studio_wipe");

    window.key_press(Key::Q);
    window.run_steps(2);
    let compare = window.state().state().compare.clone();
    assert_eq!((compare.mode, compare.second), (CompareMode::Toggle, true));
    window.key_press(Key::W);
    window.key_press(Key::W);
    until_shown(&mut window);
    assert!(!window.state().state().compare.on);
    until(&mut window, "picture alone", |app| app.relit().is_some_and(|relit| relit.second.is_none()));
}

#[test]
fn another_environment_and_a_photographed_pose_stand_beside_the_picture() {
    let (_folder, mut window) = crate::new_window();
    let open = |window: &mut super::Window, menus: &[&str]| {
        for &name in menus {
            // The environment list on the left has the same names.
            click(window, name, 208.0);
            window.run_steps(3);
        }
    };
    open(&mut window, &["Compare", "Photographed pose", "pose00"]);
    until_compared(&mut window);
    assert_eq!(window.state().state().compare.reference, Reference::Exemplar(0));
    let shown = window.state().relit().unwrap().clone();
    let (_, rival) = shown.second.as_ref().unwrap();
    assert!(rival.rgb != shown.rgb);
    let rival = rival.clone();
    open(&mut window, &["Against pose00, photographed", "Environment", "sky"]);
    let with = window.state().state().compare.reference.clone();
    assert!(matches!(with, Reference::Environment(_)));
    until(&mut window, "other light", |app| {
        let second = app.relit().and_then(|relit| relit.second.as_ref());
        second.is_some_and(|(_, codes)| *codes != rival)
    });
    assert!(window.state().relit().unwrap().rgb == shown.rgb);
}

#[test]
fn two_checkpoints_are_compared_and_with_what_was_filmed() {
    let folder = crate::temporary();
    let project = trained_project(folder.path(), 400);
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    let choose = |window: &mut super::Window, menus: &[&str]| {
        for &name in menus {
            click(window, name, 208.0);
            window.run_steps(3);
        }
    };
    choose(&mut window, &["Compare"]);
    // Nothing is read before it is requested.
    assert!(window.state().training().records.is_none());
    click(&window, "Checkpoint", 208.0);
    until(&mut window, "list of checkpoints", |app| app.training().records.is_some());
    window.get_by_label("step 400, 0:40, 28.86 dB, current");
    choose(&mut window, &["step 100, 0:10, 25.00 dB"]);
    until_compared(&mut window);
    let shown = window.state().relit().unwrap().clone();
    assert!(shown.first.is_none());
    choose(&mut window, &["First: relit", "Checkpoint", "step 200, 0:20, 26.80 dB"]);
    until(&mut window, "both networks", |app| {
        app.relit().is_some_and(|relit| relit.first.is_some() && relit.second.is_some())
    });
    let compare = window.state().state().compare.clone();
    for (with, name) in
        [(compare.first.as_ref().unwrap(), "0002-step-0000200"), (&compare.reference, "0001-step-0000100")]
    {
        let Reference::Checkpoint(folder) = with else {
            panic!("{with:?}");
        };
        assert!(folder.ends_with(name), "{folder:?}");
    }
    let relit = window.state().relit().unwrap().clone();
    assert!(relit.rgb == shown.rgb, "the relit picture stays");
    let brightness = |rgb: &[u8]| rgb.iter().map(|&v| u64::from(v)).sum::<u64>();
    let [first, second] = [&relit.first, &relit.second].map(|side| brightness(&side.as_ref().unwrap().1.rgb));
    assert!(first > second, "{first} {second}");
    window.get_by_label("First: step 200");
    window.get_by_label("Against step 100");
    snapshot(&mut window, "studio_checkpoints");

    choose(&mut window, &["Against step 100", "Checkpoint", "No network"]);
    until(&mut window, "the exemplars alone", |app| {
        let comparison = app.relit().unwrap().second.as_ref().map(|(of, _)| of);
        comparison == Some(&Comparison::Olats(ComparisonSource::Transfer))
    });
    window.get_by_label("Against no network");

    choose(&mut window, &["First: step 200", "Interview frame"]);
    until(&mut window, "the plate", |app| {
        let relit = app.relit().unwrap();
        let first = relit.first.as_ref().map(|(of, _)| of);
        first == Some(&Comparison::Plate) && relit.second.is_some()
    });
    choose(&mut window, &["First: interview frame", "Relit picture"]);
    until(&mut window, "the relit picture", |app| app.relit().is_some_and(|relit| relit.first.is_none()));
}

#[test]
fn a_click_in_a_menu_leaves_the_keys_to_the_pane_that_has_them() {
    let (_folder, mut window) = crate::new_window();
    assert_eq!(window.state().state().panes.active, Pane::Picture);
    click_on(&mut window, "Panels");
    let entry = window.get_by_label("Reset layout").rect().center();
    let light = window.get_by_label("Environment map").rect();
    assert!(entry.x > light.left(), "the menu lies over the light");
    click_on(&mut window, "Reset layout");
    assert!(window.query_by_label("Reset layout").is_none());
    assert_eq!(window.state().state().panes.active, Pane::Picture);
    // With the menu closed, the same place belongs to the pane.
    window.hover_at(entry);
    window.drag_at(entry);
    window.drop_at(entry);
    window.run_steps(2);
    assert_eq!(window.state().state().panes.active, Pane::Light);
}

#[test]
fn a_channel_is_chosen_above_the_picture() {
    let (_folder, mut window) = crate::new_window();
    click_on(&mut window, "Channels");
    click(&window, "Green", 208.0);
    until_shown(&mut window);
    let green = picture(&window);
    assert!(green.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2]));
    click_on(&mut window, "Channels");
    click(&window, "Luminance", 208.0);
    until_shown(&mut window);
    assert!(picture(&window) != green);
}

#[test]
fn lamps_are_gone_through_by_key_and_a_pixel_tells_what_lights_it() {
    let (_folder, mut window) = crate::shown_window();
    let before = picture(&window);
    window.key_press(Key::PageDown);
    window.run_steps(2);
    until(&mut window, "lamp alone", |app| app.relit().is_some_and(|relit| relit.solo == [0]));
    assert!(picture(&window) != before);
    window.get_by_label("Solo: lamp 0 ×").click();
    window.run_steps(2);
    until(&mut window, "environment", |app| app.relit().is_some_and(|relit| relit.solo.is_empty()));
    assert!(picture(&window) == before);

    window.get_by_label("Scopes").click();
    window.event(egui::Event::PointerMoved(super::MIDDLE));
    window.run_steps(3);
    let [x, y] = window.state().state().viewport.probed.unwrap();
    assert!((8..56).contains(&x) && (8..56).contains(&y), "{x}, {y}");
    until(&mut window, "the lamps of the pixel", |app| app.texel().is_some());
    snapshot(&mut window, "studio_scopes");
    // A click selects a lamp for solo: one of the two in the middle of 24.
    click_on(&mut window, "Light by lamp");
    let solo = window.state().state().solo.clone();
    assert!(solo == [11] || solo == [12], "{solo:?}");
}

#[test]
fn a_command_is_found_by_its_words() {
    let (_folder, mut window) = crate::new_window();
    let command = Modifiers::COMMAND | Modifiers::SHIFT;
    window.key_press_modifiers(command, Key::P);
    window.run_steps(3);
    window.event(egui::Event::Text("calibrate workspace".to_owned()));
    window.run_steps(2);
    snapshot(&mut window, "studio_palette");
    window.key_press(Key::Enter);
    window.run_steps(3);
    let state = window.state().state();
    assert_eq!((state.panes.workspace, state.covers.palette), (Workspace::Calibrate, false));

    window.key_press_modifiers(Modifiers::COMMAND, Key::Num3);
    window.run_steps(2);
    click_on(&mut window, "Panels");
    // Its tab has the same name; the menu is on the right.
    click(&window, "Environments", 640.0);
    window.run_steps(3);
    assert!(window.query_by_label("Add…").is_none(), "the pane was closed");
}

#[test]
fn the_compass_hides_in_a_small_picture() {
    let (_folder, mut window) = crate::shown_window();
    window.get_by_label("Compass");
    let size = window.ctx.content_rect().size();
    window.set_size(vec2(size.x, 0.6 * size.y));
    window.run_steps(4);
    assert!(window.query_by_label("Compass").is_none());
    window.set_size(size);
    window.run_steps(4);
    window.get_by_label("Compass");
}

#[test]
fn keys_show_channels_and_the_compass_turns_the_light() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::R);
    until_shown(&mut window);
    let red = picture(&window);
    assert!(red.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2]));
    window.key_press(Key::R);
    until_shown(&mut window);
    assert!(picture(&window) != red);
    let compass = window.get_by_label("Compass").rect().center();
    plain_drag(&mut window, compass - vec2(0.0, 25.0), compass + vec2(25.0, 0.0));
    let yaw = window.state().state().look.yaw_deg;
    assert!((yaw - 90.0).abs() < 1.0, "{yaw}");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut window);
    assert_eq!(window.state().state().look.yaw_deg, 0.0);

    window.key_press(Key::Num1);
    window.run_steps(3);
    let zoom = window.state().state().viewport.view.zoom;
    // 64 pixels on 64 points.
    assert!(zoom < 0.2, "{zoom}");
}

#[test]
fn a_drag_across_a_wipe_moves_the_line_and_never_the_light() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::W);
    until_compared(&mut window);
    let picture = window.get_by_label("Wipe").rect();
    let to = super::MIDDLE + vec2(70.0, 0.0);
    plain_drag(&mut window, super::MIDDLE - vec2(90.0, 40.0), to);
    let state = window.state().state();
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    let line = window.get_by_label("Wipe").rect();
    assert!((line.center().x - to.x).abs() < 1.0, "{line:?} {picture:?}");
    drag(&mut window, super::MIDDLE, to, PointerButton::Secondary, Modifiers::SHIFT);
    assert!(window.state().state().look.yaw_deg > 20.0, "this drag turns the light");
}

/// The line below the picture, after the pointer rests at `at`.
pub fn read_at(window: &mut super::Window, at: egui::Pos2) -> String {
    window.event(egui::Event::PointerMoved(at));
    window.run_steps(3);
    let line = window.get_by_label_contains("frame 0   ");
    let line = egui_kittest::kittest::NodeT::accesskit_node(&line);
    line.label().or_else(|| line.value()).unwrap_or_default()
}

#[test]
fn the_pixel_under_the_cursor_is_read_in_both_pictures_whatever_is_shown_of_it() {
    let (_folder, mut window) = crate::shown_window();
    let plain = read_at(&mut window, super::MIDDLE);
    let [x, y] = window.state().state().viewport.probed.unwrap();
    let [r, g, b] = window.state().relit().unwrap().codes([x, y]).unwrap();
    assert!(plain.contains(&format!("{r:3} {g:3} {b:3}")), "{plain}");
    assert!(plain.contains("linear"), "{plain}");

    click_on(&mut window, "Channels");
    click(&window, "False colour", 208.0);
    until_shown(&mut window);
    let map = window.state().relit().unwrap().codes([x, y]).unwrap();
    assert_ne!(map, [r, g, b], "false colours differ from the picture");
    let sign = "   viewing false colour";
    let read = read_at(&mut window, super::MIDDLE);
    assert!(read.contains(sign), "{read}");
    assert_eq!(read.replace(sign, ""), plain);
    snapshot(&mut window, "studio_false_colour");
    window.key_press(Key::C);
    until_shown(&mut window);

    window.key_press(Key::Q);
    until_compared(&mut window);
    let both = read_at(&mut window, super::MIDDLE);
    let shown = window.state().relit().unwrap().clone();
    let (_, plate) = shown.second.as_ref().unwrap();
    let at = 3 * (y * plate.width + x);
    let [r2, g2, b2] = [plate.rgb[at], plate.rgb[at + 1], plate.rgb[at + 2]];
    for text in [format!("A relit  {r:3} {g:3} {b:3}"), format!("B interview frame  {r2:3} {g2:3} {b2:3}")] {
        assert!(both.contains(&text), "{both} lacks {text}");
    }

    // Side by side, the same point of either picture is the same pixel.
    window.get_by_role_and_label(egui::accesskit::Role::ComboBox, "How to compare").click();
    window.run_steps(3);
    window.get_by_label("Side by side").click();
    until_compared(&mut window);
    let half = 0.5 * window.get_by_label("Relit picture").rect().width();
    let left = super::MIDDLE - vec2(0.5 * half, 0.0);
    read_at(&mut window, left);
    let pixel = window.state().state().viewport.probed.unwrap();
    read_at(&mut window, super::MIDDLE);
    read_at(&mut window, left + vec2(half, 0.0));
    assert_eq!(window.state().state().viewport.probed.unwrap(), pixel);
}

/// Chooses how two pictures are compared.
pub fn compare_by(window: &mut super::Window, how: &str) {
    window.get_by_role_and_label(egui::accesskit::Role::ComboBox, "How to compare").click();
    window.run_steps(3);
    window.get_by_label(how).click();
    until_compared(window);
}

#[test]
fn a_difference_is_drawn_by_the_chosen_gain() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::W);
    until_compared(&mut window);
    let role = egui::accesskit::Role::ComboBox;
    let has_gain = |window: &super::Window| window.query_by_role_and_label(role, "Difference gain").is_some();
    assert!(!has_gain(&window), "no difference is shown");
    compare_by(&mut window, "Difference");
    assert!(has_gain(&window));
    let before = picture(&window);
    let mut last = 0;
    for gain in [1, 2, 4, 8, 16] {
        window.get_by_role_and_label(role, "Difference gain").click();
        window.run_steps(3);
        window.get_by_label(&format!("× {gain}")).click();
        until_compared(&mut window);
        window.get_by_label_contains(&format!("difference × {gain}"));
        let drawn = picture(&window);
        let brightness = drawn.iter().map(|&code| u64::from(code)).sum::<u64>();
        assert!(brightness > last, "{gain}: {brightness} after {last}");
        assert_eq!(drawn == before, gain == 4, "× 4 is the default");
        last = brightness;
    }
    assert!(!window.state().state().can_undo(), "the gain is not a look setting");
}

#[test]
fn the_two_pictures_are_switched_while_the_clip_plays() {
    let (_folder, mut window) = crate::new_window();
    window.key_press(Key::Q);
    until_compared(&mut window);
    window.key_press(Key::Space);
    until(&mut window, "playing", |app| app.state().playback.playing);
    for second in [false, true, false] {
        let frame = window.state().state().frame;
        window.key_press(Key::Q);
        until(&mut window, "the other picture", move |app| {
            let (state, relit) = (app.state(), app.relit().unwrap());
            state.playback.playing && state.compare.second == second && state.frame != frame && relit.second.is_some()
        });
    }
    assert_eq!(window.state().state().compare.mode, CompareMode::Toggle);
}

#[test]
fn the_mean_of_a_region_is_that_of_its_pixels_until_it_is_left() {
    let (_folder, mut window) = crate::shown_window();
    click_on(&mut window, "Scopes");
    let both = Modifiers::COMMAND | Modifiers::SHIFT;
    let from = super::MIDDLE - vec2(90.0, 60.0);
    let draw = |window: &mut super::Window, by: egui::Vec2| {
        drag(window, from, from + by, PointerButton::Primary, both);
        window.run_steps(2);
    };
    draw(&mut window, vec2(150.0, 100.0));
    let state = window.state().state();
    assert_eq!(state.look.yaw_deg, 0.0, "the light stays");
    let region = state.viewport.region.unwrap();
    let [columns, rows] = region.size();
    assert!((5..60).contains(&columns) && (5..60).contains(&rows));

    let relit = window.state().relit().unwrap().clone();
    let pixels =
        (region.top..region.bottom).flat_map(|y| (region.left..region.right).map(move |x| [x, y])).map(|[x, y]| {
            let codes = relit.codes([x, y]).unwrap();
            (codes, relit.linear.as_ref().unwrap().at(x, y))
        });
    /// Codes and linear light.
    type Read = ([u8; 3], [f32; 3]);
    let pixels: Vec<Read> = pixels.collect();
    assert_eq!(pixels.len(), columns * rows);
    let mean = |of: &dyn Fn(&Read) -> f64| (pixels.iter().map(of).sum::<f64>() / pixels.len() as f64) as f32;
    let codes = [0, 1, 2].map(|c| format!("{:5.1}", mean(&|(codes, _)| f64::from(codes[c]))));
    let light = [0, 1, 2].map(|c| format!("{:.4}", mean(&|(_, light)| f64::from(light[c]))));
    let (codes, light) = (codes.join(" "), light.join(" "));
    window.get_by_label_contains(&format!("mean of {columns} × {rows}   {codes}   linear {light}"));
    let (left, top) = (region.left, region.top);
    window.get_by_label(&format!("Mean of {columns} × {rows} pixels at {left}, {top}"));
    window.get_by_label(&codes);
    window.get_by_label(&light);
    // The scopes count only its pixels.
    let count = |c: usize| pixels.iter().filter(|(codes, _)| codes[c] == 255).count();
    let [r, g, b] = [0, 1, 2].map(count);
    window.get_by_label(&format!("Clipped white: R {r}, G {g}, B {b} pixels"));
    snapshot(&mut window, "studio_region");

    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(window.state().state().viewport.region, None);
    draw(&mut window, vec2(60.0, 40.0));
    assert!(window.state().state().viewport.region.is_some());
    draw(&mut window, vec2(0.0, 0.0));
    assert_eq!(window.state().state().viewport.region, None, "a click ends it");
    assert_eq!(window.state().state().look.yaw_deg, 0.0);
}

#[test]
fn a_lamp_alone_ends_by_escape_and_by_another_environment() {
    let (_folder, mut window) = crate::shown_window();
    let solo = |window: &mut super::Window| {
        window.key_press(Key::PageDown);
        until(window, "lamp alone", |app| app.relit().is_some_and(|relit| relit.solo == [0]));
    };
    let ended = |window: &mut super::Window| {
        until(window, "all lamps", |app| app.relit().is_some_and(|relit| relit.solo.is_empty()));
    };
    solo(&mut window);
    window.get_by_label_contains("Solo: lamp 0 ×");
    snapshot(&mut window, "studio_solo");
    window.key_press(Key::Escape);
    ended(&mut window);

    solo(&mut window);
    window.get_by_label("sky").click();
    ended(&mut window);
    window.get_by_label_contains("Solo ended");
    assert_eq!(window.state().relit().unwrap().environment, "sky");
    // A click on the current environment ends it too.
    solo(&mut window);
    window.get_by_label("sky").click();
    ended(&mut window);
}

#[test]
fn arrow_keys_choose_in_the_list_of_commands_and_it_does_not_jump() {
    let (_folder, mut window) = crate::new_window();
    let command = Modifiers::COMMAND | Modifiers::SHIFT;
    window.key_press_modifiers(command, Key::P);
    window.run_steps(3);
    let field = |window: &super::Window| {
        let role = egui::accesskit::Role::TextInput;
        window.get_by_role_and_label(role, "Find a command").rect()
    };
    let before = field(&window);
    window.event(egui::Event::Text("workspace".to_owned()));
    window.run_steps(3);
    assert_eq!(field(&window), before);
    window.key_press(Key::ArrowDown);
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(window.state().state().panes.workspace, Workspace::Train);
}

#[test]
fn what_is_read_of_two_pictures_runs_into_no_button_where_the_window_is_narrow() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = egui_kittest::Harness::builder()
        .with_size(vec2(900.0, 640.0))
        .with_step_dt(0.25)
        .with_max_steps(60)
        .build_eframe(|cc| StudioApp::over(&cc.egui_ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    window.key_press(Key::W);
    until_compared(&mut window);
    let at = window.get_by_label("Relit picture").rect().center();
    let said = read_at(&mut window, at);
    assert!(said.contains("B interview frame"), "{said}");
    let strip = window.get_by_label_contains("frame 0   ").rect();
    // The second line begins this far below the first.
    let first = strip.top() + 20.0;
    for button in ["1:1", "Fit", "Loop"] {
        let role = egui::accesskit::Role::Button;
        let rect = window.get_by_role_and_label(role, button).rect();
        assert!(strip.contains_rect(rect), "{button} is in the strip");
        assert!(rect.bottom() <= first, "{button}: {rect:?} in {strip:?}");
    }
    snapshot(&mut window, "studio_narrow_readout");
}
