//! A day's tasks done without reading the guide: with the pointer, on visible controls. Each click, drag, drop, typed text,
//! key and turn of the wheel counts. docs/guide.md lists the counts.

use super::{
    MIDDLE, Window, aiming, clay, clay_window, drop_onto, lights, picture, plain_drag, retype, review, until,
    until_shown, window,
};
use afterlight::gpu::DeviceChoice;
use afterlight::scene::Setting;
use afterlight::studio::StudioApp;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;
use std::path::Path;

/// Most actions for a task.
const MOST: usize = 12;

/// A pointer that counts its actions.
struct Hand {
    window: Window,
    acts: usize,
}

impl Hand {
    fn from_window(window: Window) -> Self {
        Self { window, acts: 0 }
    }

    /// Over the clay subject, once its picture is shown.
    fn over_clay() -> (tempfile::TempDir, Self) {
        let folder = crate::temporary();
        let mut hand = Self::from_window(clay_window(folder.path()));
        until_shown(&mut hand.window);
        (folder, hand)
    }

    /// Clicks the control with this name, which must be visible. Of several, takes the leftmost outside the environment
    /// list on the left, which has the same names as the menus.
    fn click(&mut self, name: &str) {
        let whole = Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 720.0));
        let found = self.window.query_all_by_label(name);
        let places: Vec<Rect> = found.map(|node| node.rect()).collect();
        let seen = places.iter().filter(|place| whole.contains_rect(**place));
        let place = seen.min_by(|a, b| {
            let key = |place: &Rect| (place.left() < 208.0, place.left());
            key(a).partial_cmp(&key(b)).unwrap()
        });
        let at = place.unwrap_or_else(|| panic!("{name} is not in sight: {places:?}")).center();
        self.click_at(at);
    }

    fn click_at(&mut self, pos: Pos2) {
        self.press_at(pos, PointerButton::Primary);
    }

    fn press_at(&mut self, pos: Pos2, button: PointerButton) {
        let press = |pressed| Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        for event in [Event::PointerMoved(pos), press(true), press(false), Event::PointerMoved(pos + vec2(1.0, 0.0))] {
            self.window.event(event);
        }
        self.window.run_steps(6);
        self.acts += 1;
    }

    fn drag(&mut self, from: Pos2, to: Pos2) {
        plain_drag(&mut self.window, from, to);
        self.acts += 1;
    }

    /// Types into the field that was clicked.
    fn type_text(&mut self, text: &str) {
        retype(&mut self.window, text);
        self.acts += 1;
    }

    fn key(&mut self, key: Key) {
        self.window.key_press(key);
        self.window.run_steps(4);
        self.acts += 1;
    }

    /// Turns the wheel until a control is in sight.
    fn scroll_to(&mut self, name: &str) {
        super::scroll_to(&mut self.window, name);
        self.acts += 1;
    }

    fn drop(&mut self, path: &Path) {
        drop_onto(&mut self.window, path);
        self.acts += 1;
    }

    /// Waits for a label.
    fn wait(&mut self, name: &str) {
        super::until_labelled(&mut self.window, name);
        self.window.run_steps(2);
    }

    /// Ends the task. Checks its count against the guide.
    fn done(&mut self, task: &str) {
        let acts = std::mem::take(&mut self.acts);
        assert!(acts <= MOST, "{task}: {acts}");
        let guide = include_str!("../../docs/guide.md");
        let row = format!("| {task} | {acts} |");
        assert!(guide.contains(&row), "docs/guide.md should say: {row}");
    }
}

#[test]
fn from_movies_to_a_relit_picture() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = crate::temporary();
    let filmed = super::project::filmed(folder.path());
    let mut hand = Hand::from_window(window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu)));
    hand.window.run();
    hand.drop(&filmed);
    until(&mut hand.window, "look at the shoot", |app| app.wizard().scan().is_some());
    hand.wait("Make project");
    let make = hand.window.get_by_label("Make project");
    let blocked = egui_kittest::kittest::NodeT::accesskit_node(&make).is_disabled();
    assert!(!blocked, "{:#?}", hand.window.state().wizard().scan());
    hand.click("Make project");
    hand.wait("Calibrate");
    hand.click("Calibrate");
    hand.click("Workspace Relight");
    until(&mut hand.window, "first relit picture", |app| app.relit().is_some());
    hand.done("First relit picture from movies");
}

#[test]
fn a_clip_is_exported_as_prores() {
    if !test_support::ffmpeg() {
        return;
    }
    let (window, root, _folder) = super::export::opened();
    let mut hand = Hand::from_window(window);
    hand.click("Workspace Export");
    hand.click("Format Movie");
    hand.click("Codec: H.264");
    hand.click("ProRes 422 HQ");
    hand.click("Add to queue");
    until(&mut hand.window, "the movie", |app| (app.exports().iter()).any(|export| export.status.sentence().is_some()));
    // With the interview's sound, if there is any.
    assert!(hand.window.state().state().export_options.sound);
    hand.done("Export ProRes with sound");
    let made = std::fs::read_dir(root.join("exports")).unwrap();
    let is_movie = |path: &Path| path.extension().is_some_and(|e| e == "mov");
    assert!(made.map(|entry| entry.unwrap().path()).any(|path| is_movie(&path)));
}

#[test]
fn a_key_light_from_the_left_is_two_acts_away() {
    let (_folder, mut hand) = Hand::over_clay();
    hand.click("Add light");
    let light = hand.window.get_by_label("Light 1 on the panorama").rect();
    let panorama = hand.window.get_by_label("Environment map").rect();
    // Beside the camera on its left, above the eyes.
    let to = panorama.min + vec2(0.15, 0.35) * panorama.size();
    hand.drag(light.center(), to);
    until_shown(&mut hand.window);
    let placed = hand.window.state().state().look.lighting.placed[0].clone();
    assert!((-150.0..-100.0).contains(&placed.yaw_deg) && placed.pitch_deg > 10.0, "{placed:?}");
    hand.done("Key light from the left");
}

#[test]
fn two_panoramas_are_compared() {
    let (_folder, mut hand) = Hand::over_clay();
    hand.click("Compare");
    hand.click("Environment");
    hand.click("sky");
    until(&mut hand.window, "second picture", |app| app.relit().is_some_and(|relit| relit.second.is_some()));
    hand.done("Compare two HDRIs");
}

#[test]
fn the_worst_lamp_is_found() {
    let folder = crate::temporary();
    let (project, window) = review::measured_window(folder.path());
    let mut hand = Hand::from_window(window);
    let kept = afterlight::evaluation::review::Review::load(&project).unwrap().unwrap();
    // From the initial workspace of the window.
    hand.window.get_by_label("Workspace Relight").click();
    hand.window.run_steps(3);
    hand.click("Workspace Review");
    let (case, lamp) = kept.worst(afterlight::evaluation::review::Metric::default())[0];
    hand.click("Next worst");
    assert_eq!(hand.window.state().state().review.cell, Some((case, lamp)));
    hand.done("Find the worst lamp");
}

#[test]
fn light_falls_on_the_cheek_and_one_lamp_lights_it_alone() {
    let (_folder, mut hand) = Hand::over_clay();
    let cheek = aiming::place(&hand.window, 12.0, 32.0);
    hand.click("Light by the face");
    hand.click_at(cheek);
    until(&mut hand.window, "placed light", |app| app.state().look.lighting.placed.len() == 1);
    let to = lights(&hand.window)[0].direction();
    assert!(to.x < -0.4 && to.z > 0.0, "{to}");
    hand.done("Light on a cheek");

    hand.window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    until_shown(&mut hand.window);
    hand.window.event(Event::PointerMoved(cheek));
    super::until_said(&mut hand.window, "Right-click: solo lamp ");
    hand.press_at(cheek, PointerButton::Secondary);
    assert_eq!(hand.window.state().state().solo.len(), 1);
    until_shown(&mut hand.window);
    // The button before it counts too.
    hand.acts += 1;
    hand.done("One lamp alone");
}

#[test]
fn the_light_turns_through_the_clip() {
    let (_folder, mut hand) = Hand::over_clay();
    hand.scroll_to("Yaw key at this frame");
    hand.click("Yaw key at this frame");
    let bar = hand.window.get_by_label("Scrub bar").rect();
    let last = clay::FRAMES - 1;
    let cell = bar.width() / clay::FRAMES as f32;
    hand.click_at(bar.right_center() - vec2(0.5 * cell, 0.0));
    until(&mut hand.window, "last frame", |app| app.state().frame == last);
    hand.drag(MIDDLE, MIDDLE + vec2(150.0, 0.0));
    until_shown(&mut hand.window);
    let keys = hand.window.state().state().look.keys(Setting::Yaw).keys().len();
    assert_eq!(keys, 2);
    hand.done("Light that turns through the clip");
}

#[test]
fn a_look_is_stored_and_comes_back() {
    let (_folder, mut hand) = Hand::over_clay();
    hand.drag(MIDDLE, MIDDLE + vec2(60.0, 0.0));
    until_shown(&mut hand.window);
    let before = picture(&hand.window);
    hand.acts = 0;
    hand.click("Looks");
    hand.click("Name of the look");
    hand.type_text("Warm key");
    hand.click("Store");
    until(&mut hand.window, "stored look", |app| {
        let looks = app.looks();
        !looks.is_busy() && !looks.looks(afterlight::studio::Shelf::Project).is_empty()
    });
    // Other light in between.
    plain_drag(&mut hand.window, MIDDLE, MIDDLE - vec2(90.0, 0.0));
    until_shown(&mut hand.window);
    assert!(picture(&hand.window) != before);
    hand.click("Warm key");
    until_shown(&mut hand.window);
    assert!(picture(&hand.window) == before);
    hand.done("Store a look and return to it");
}

#[test]
fn a_still_is_put_behind_the_subject() {
    if !super::alone("tasks::a_still_is_put_behind_the_subject", &super::NO_DIALOGS) {
        return;
    }
    let (folder, mut hand) = Hand::over_clay();
    let still = folder.path().join("street.png");
    image::RgbImage::from_pixel(8, 8, image::Rgb([40, 90, 200])).save(&still).unwrap();
    hand.scroll_to("Background");
    hand.click("Background");
    hand.click("Still or movie…");
    super::dialogs::until_missing(&mut hand.window);
    hand.click("Path");
    hand.type_text(&still.display().to_string());
    hand.key(Key::Enter);
    until_shown(&mut hand.window);
    assert!(picture(&hand.window)[2].abs_diff(200) <= 1);
    hand.done("Still behind the subject");
}

#[test]
fn layers_of_lights_are_exported() {
    let (window, root, _folder) = super::export::opened();
    let mut hand = Hand::from_window(window);
    hand.click("Workspace Export");
    hand.click("Format EXR");
    hand.click("Layers By light");
    hand.click("Add to queue");
    super::export::until_exported(&mut hand.window, 1);
    hand.done("Export EXR layers by light");
    let made = std::fs::read_dir(root.join("exports")).unwrap();
    let is_exr = |path: &Path| path.extension().is_some_and(|e| e == "exr");
    assert!(made.map(|entry| entry.unwrap().path()).any(|path| is_exr(&path)));
}
