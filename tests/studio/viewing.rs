//! Viewing settings of the picture, which are never exported, and the scopes, which count the visible picture.

use super::{
    MIDDLE, Window, brightness, clay, click_on, picture, plain_drag, snapshot, until, until_labelled, until_shown,
    window,
};
use afterlight::color_config::ColorConfig;
use afterlight::project::Project;
use afterlight::scene::{Channel, Inspection, ViewTransform};
use afterlight::studio::StudioApp;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::path::Path;

/// Presses a key several times, and waits for each result: the window takes one event per step.
fn press(window: &mut Window, key: Key, times: usize) {
    (0..times).for_each(|_| window.key_press(key));
    window.run_steps(2 * times + 2);
    until_shown(window);
}

/// Value of a number in the bar above the picture, after a drag by this many points to the right.
fn drag_number(window: &mut Window, name: &str, by: f32) {
    let at = window.get_by_role_and_label(Role::SpinButton, name).rect();
    let from = at.center();
    let to = from + vec2(by, 0.0);
    plain_drag(window, from, to);
    until_shown(window);
}

#[test]
fn a_viewing_exposure_brightens_both_pictures_and_is_no_part_of_the_look() {
    let (folder, mut window) = crate::new_window();
    window.key_press(Key::W);
    until_shown(&mut window);
    until(&mut window, "second picture", |app| app.relit().is_some_and(|relit| relit.second.is_some()));
    let plain = window.state().relit().unwrap().clone();
    let look = window.state().state().look.clone();
    let saved = folder.path().join("look.json");
    let before = std::fs::read_to_string(&saved).ok();
    press(&mut window, Key::E, 2);
    let seen = window.state().relit().unwrap().clone();
    assert_eq!(seen.scene.viewing.exposure_stops, 1.0);
    assert!(brightness(&seen.rgb) > brightness(&plain.rgb));
    let second = |relit: &afterlight::worker::PreviewPicture| brightness(&relit.second.as_ref().unwrap().1.rgb);
    assert!(second(&seen) > second(&plain), "the other picture, too");
    assert_eq!(seen.linear, plain.linear, "the light stays");
    // Shown over the picture and beside the readout.
    window.get_by_label("viewing +1.0 stops: not exported");
    window.event(Event::PointerMoved(MIDDLE));
    window.run_steps(3);
    window.get_by_label_contains("window   viewing +1.0 stops");
    snapshot(&mut window, "studio_viewing");
    assert_eq!(window.state().state().look, look);
    assert!(!window.state().state().can_undo());
    assert_eq!(std::fs::read_to_string(&saved).ok(), before);

    window.key_press_modifiers(Modifiers::SHIFT, Key::E);
    window.run_steps(4);
    assert_eq!(window.state().state().display.viewing.exposure_stops, 0.5);
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(picture(&window), plain.rgb);
    assert!(window.query_by_label_contains("not exported").is_none());
}

#[test]
fn gamma_exposure_and_curve_are_set_above_the_picture_and_reset() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    // Steps short enough for a double-click.
    let mut window = Harness::builder()
        .with_size(vec2(1280.0, 720.0))
        .with_step_dt(0.02)
        .build_eframe(|cc| StudioApp::over(&cc.egui_ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    until_shown(&mut window);
    let plain = picture(&window);
    drag_number(&mut window, "γ", 60.0);
    assert!(window.state().state().display.viewing.gamma > 1.2);
    assert!(brightness(&picture(&window)) > brightness(&plain));
    drag_number(&mut window, "Exp", -50.0);
    assert!(window.state().state().display.viewing.exposure_stops < -0.3);
    // A double-click resets a number.
    for name in ["γ", "Exp"] {
        let at = window.get_by_role_and_label(Role::SpinButton, name).rect();
        window.hover_at(at.center());
        for pressed in [true, false, true, false] {
            window.event(Event::PointerButton {
                pos: at.center(),
                button: PointerButton::Primary,
                pressed,
                modifiers: Modifiers::NONE,
            });
        }
        // Long enough for the next click to count as the first of two.
        window.run_steps(50);
    }
    until_shown(&mut window);
    let viewing = &window.state().state().display.viewing;
    assert!(viewing.is_neutral(), "{viewing:?}");
    assert_eq!(picture(&window), plain);

    window.get_by_role_and_label(Role::ComboBox, "View").click();
    window.run_steps(3);
    window.get_by_label("As exported (sRGB)");
    window.get_by_label("Filmic").click();
    until_shown(&mut window);
    let state = window.state().state();
    assert_eq!(state.scene().view(), ViewTransform::Filmic);
    assert_eq!(state.look.effects.view, ViewTransform::Srgb);
    assert!(!state.can_undo());
    assert_ne!(picture(&window), plain);
    window.get_by_label("viewing Filmic: not exported");
    press(&mut window, Key::R, 1);
    let red = Inspection::Channel(Channel::Red);
    assert_eq!(window.state().state().display.inspection, red);
    window.get_by_label("viewing red channel, Filmic: not exported");
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(picture(&window), plain);
}

/// A view of `ocio://default`.
const VIEW: &str = "ACES 2.0 - SDR 100 nits (Rec.709)";

/// Opens the viewing menu, and waits until it has this entry.
fn menu(window: &mut Window, entry: &str) {
    let bar = window.get_by_role_and_label(Role::ComboBox, "View");
    bar.click();
    window.run_steps(3);
    until_labelled(window, entry);
    window.run_steps(4);
}

/// Selects [`VIEW`] for viewing.
pub fn look_through_view(window: &mut Window) {
    menu(window, VIEW);
    window.get_by_label(VIEW).click();
    until(window, "table of the view", |app| app.state().display.viewing.through.is_some());
    until_shown(window);
}

#[test]
fn a_view_of_a_colour_configuration_is_looked_through_and_left_again() {
    let folder = crate::temporary();
    let mut project = clay::project(folder.path(), clay::environments(folder.path()));
    let config = Path::new("ocio://default");
    project.settings.color_config = Some(config.to_path_buf());
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    until_shown(&mut window);
    let relit = window.state().relit().unwrap().clone();
    let plain = relit.rgb.clone();
    menu(&mut window, VIEW);
    window.get_by_label("Rec.1886 Rec.709 - Display");
    snapshot(&mut window, "studio_color_views");
    window.get_by_label(VIEW).click();
    let is_through = |app: &StudioApp| app.state().display.viewing.through.is_some();
    until(&mut window, "table of the view", is_through);
    until_shown(&mut window);
    // The same light through the configuration itself, pixel by pixel.
    let view = ColorConfig::open(config).and_then(|config| config.to_view(None, Some(VIEW), None)).unwrap();
    let exact = view.encoded(relit.linear.as_ref().unwrap()).0;
    let exact = exact.pixels.iter().flatten().map(|code| code * 255.0);
    let seen = picture(&window);
    let off: Vec<f32> = exact.zip(&seen).map(|(a, b)| (a - f32::from(*b)).abs()).collect();
    let near = off.iter().filter(|off| **off < 1.5).count();
    // Half an 8-bit step, another for the dither, and the table's error.
    assert!(near * 100 >= off.len() * 99, "{near} of {}", off.len());
    assert_ne!(seen, plain);
    let said = format!("viewing {VIEW}: not exported");
    window.get_by_label(&said);
    snapshot(&mut window, "studio_color_view");
    assert!(!window.state().state().can_undo());

    // A tone curve replaces it; a reset restores the exported picture.
    menu(&mut window, "Filmic");
    window.get_by_label("Filmic").click();
    until_shown(&mut window);
    let state = window.state().state();
    assert_eq!((&state.display.color_view, &state.display.viewing.through), (&None, &None));
    window.get_by_label("viewing Filmic: not exported");
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(4);
    until_shown(&mut window);
    assert_eq!(picture(&window), plain);
}

#[test]
fn a_configuration_that_another_program_chooses_shows_up_when_the_window_is_back() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    project.save().unwrap();
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    until_shown(&mut window);
    let plain = picture(&window);
    menu(&mut window, "As exported (sRGB)");
    assert!(window.query_by_label(VIEW).is_none());
    window.key_press(Key::Escape);
    window.run_steps(3);

    // As after `afterlight ocio PROJECT --use CONFIG`, when the person returns to the window.
    let choose = |window: &mut Window, config: Option<&str>| {
        let config = config.map(Path::new);
        Project::change(folder.path(), |project| project.set_color_config(config)).unwrap();
        let config = config.map(Path::to_path_buf);
        let known = |app: &StudioApp| app.project().unwrap().color_config();
        window.event(Event::WindowFocused(false));
        window.run_steps(4);
        assert_ne!(known(window.state()), config, "the file is read on focus only");
        window.event(Event::WindowFocused(true));
        until(window, "the configuration", move |app| known(app) == config);
    };
    choose(&mut window, Some("ocio://default"));
    look_through_view(&mut window);
    assert_ne!(picture(&window), plain);

    choose(&mut window, None);
    until_shown(&mut window);
    let state = window.state().state();
    assert_eq!((&state.display.color_view, &state.display.viewing.through), (&None, &None));
    assert_eq!(picture(&window), plain);
}

#[test]
fn a_viewing_exposure_changes_no_exported_file() {
    let (mut window, root, _folder) = super::export::opened();
    let mut files = Vec::new();
    for (name, presses) in [("plain", 0), ("viewed", 3)] {
        press(&mut window, Key::E, presses);
        window.get_by_label("Workspace Export").click();
        window.run_steps(2);
        super::export::type_name(&mut window, &format!("exports/{name}"));
        window.get_by_label("Add to queue").click();
        super::export::until_exported(&mut window, files.len() + 1);
        let file = image::open(root.join(format!("exports/{name}.0000.png")));
        files.push(file.unwrap().into_rgba8());
        window.get_by_label("Workspace Relight").click();
        window.run_steps(2);
    }
    assert_eq!(window.state().state().display.viewing.exposure_stops, 1.5);
    assert_eq!(files[0], files[1]);
}

#[test]
fn scopes_have_a_scale_count_what_clips_and_fill_the_pane() {
    let (_folder, mut window) = crate::new_window();
    window.get_by_label("Scopes").click();
    until_shown(&mut window);
    let counts = |window: &Window, code: u8| {
        let rgb = picture(window);
        [0, 1, 2].map(|c| rgb.iter().skip(c).step_by(3).filter(|&&v| v == code).count())
    };
    let [r, g, b] = counts(&window, 255);
    window.get_by_label(&format!("Clipped white: R {r}, G {g}, B {b} pixels"));
    let [r, g, b] = counts(&window, 0);
    window.get_by_label(&format!("Clipped black: R {r}, G {g}, B {b} pixels"));

    // The scopes count the visible picture, and say so.
    press(&mut window, Key::E, 8);
    window.get_by_label("Counted as you see it: viewing +4.0 stops");
    let [r, g, b] = counts(&window, 255);
    assert!(r > 100, "{r}");
    window.get_by_label(&format!("Clipped white: R {r}, G {g}, B {b} pixels"));
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(4);
    until_shown(&mut window);

    click_on(&mut window, "0–255");
    let size = |window: &Window, name: &str| window.get_by_label(name).rect().size();
    let small = size(&window, "Waveform scope");
    click_on(&mut window, "Enlarge the scope");
    let large = size(&window, "Waveform scope");
    assert!(large.y > 3.0 * small.y, "{small} became {large}");
    assert!(window.query_by_label("Histogram").is_none());
    snapshot(&mut window, "studio_waveform");
    click_on(&mut window, "Vectors");
    let vectors = size(&window, "Vectorscope");
    assert!(vectors.x > 300.0, "{vectors}");
    snapshot(&mut window, "studio_vectors");
    click_on(&mut window, "Show all scopes");
    click_on(&mut window, "Enlarge the histogram");
    assert!(window.query_by_label("Vectorscope").is_none());
}

#[test]
fn a_clip_plays_around_its_range_or_stops_at_its_end() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "the first picture", |app| app.relit().is_some());
    for key in [Key::I, Key::ArrowRight, Key::ArrowRight, Key::O, Key::Home] {
        window.key_press(key);
        window.run_steps(3);
    }
    window.get_by_label("Loop").click();
    window.run_steps(2);
    assert!(!window.state().state().playback.loops);
    window.key_press(Key::Space);
    until(&mut window, "playing", |app| app.state().playback.playing);
    until(&mut window, "the end of the range", |app| !app.state().playback.playing);
    assert_eq!(window.state().state().frame, 2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::L);
    window.run_steps(4);
    window.key_press(Key::Space);
    for wanted in [1, 0, 2] {
        until(&mut window, "the range again and again", move |app| {
            app.state().playback.playing && app.state().frame == wanted
        });
    }
}

#[test]
fn the_matte_is_shown_whatever_the_background_is() {
    let (_folder, mut window) = crate::shown_window();
    let background = window.state().state().look.background.clone();
    assert_eq!(background, afterlight::scene::Background::Environment);
    press(&mut window, Key::A, 1);
    let shown = picture(&window);
    let [least, most] = [shown.iter().min(), shown.iter().max()].map(|code| *code.unwrap());
    assert!(least < 10 && most > 245, "the background is black, the subject white: {least} {most}");
    assert_eq!(window.state().state().look.background, background, "the look stays");
}

#[test]
fn the_zoom_is_in_pixels_of_the_screen_per_pixel_of_the_picture() {
    for pixels_per_point in [1.0, 2.0] {
        let folder = crate::temporary();
        let project = clay::project(folder.path(), clay::environments(folder.path()));
        let mut window = Harness::builder()
            .with_size(vec2(1280.0, 720.0))
            .with_pixels_per_point(pixels_per_point)
            .with_step_dt(0.25)
            .with_max_steps(60)
            .build_eframe(|cc| StudioApp::over(&cc.egui_ctx, project, clay::source));
        until(&mut window, "the first picture", |app| app.relit().is_some());
        window.run_steps(4);
        let pane = window.get_by_label("Relit picture").rect();
        // The picture has 64 by 64 pixels.
        let points = (pane.size() - vec2(32.0, 32.0)).min_elem() / 64.0;
        let fitted = format!("{:.0} %", 100.0 * points * pixels_per_point);
        window.get_by_label(&fitted);
        for (key, percent) in [(Key::Num1, "100 %"), (Key::F, &fitted)] {
            window.key_press(key);
            window.run_steps(3);
            window.get_by_label(percent);
        }
    }
}
