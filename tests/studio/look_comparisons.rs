//! Stored looks and their versions, compared with each other.

use super::comparing::{click, compare_by, until_compared};
use super::looks::{choose, id, open_looks, relight, rename, store};
use super::{Window, clay, click_on, picture, until, until_labelled, until_shown};
use afterlight::imaging::{Image, file::write_exr};
use afterlight::studio::{FourSlot, Reference, Shelf, StudioApp};
use afterlight::worker::PreviewPicture;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;

/// Clicks menu entries over the picture: the panels on the left have the same names.
fn open(window: &mut Window, menus: &[&str]) {
    for &name in menus {
        click(window, name, 208.0);
        window.run_steps(3);
    }
}

/// Codes of the first and second compared picture.
fn sides(relit: &PreviewPicture) -> [Option<&[u8]>; 2] {
    [&relit.first, &relit.second].map(|side| side.as_ref().map(|(_, codes)| &*codes.rgb))
}

/// Waits until the compared pictures have these codes.
fn until_sides(window: &mut Window, what: &str, wanted: [Option<&[u8]>; 2]) {
    until_shown(window);
    until(window, what, |app| app.relit().is_some_and(|relit| sides(relit) == wanted));
}

/// Pictures of all frames in the current look, from the first.
fn all_frames(window: &mut Window) -> Vec<Vec<u8>> {
    super::go(window, Key::Home, 0);
    let mut pictures = vec![picture(window)];
    for frame in 1..clay::FRAMES {
        super::go(window, Key::ArrowRight, frame);
        pictures.push(picture(window));
    }
    super::go(window, Key::Home, 0);
    pictures
}

/// Plays the clip until `check` has accepted five different frames.
fn play(window: &mut Window, check: impl Fn(&PreviewPicture) -> bool) {
    window.key_press(Key::Space);
    until(window, "playing", |app| app.state().playback.playing);
    let seen = std::cell::RefCell::new(std::collections::BTreeSet::new());
    until(window, "five frames", |app: &StudioApp| {
        let relit = app.relit().unwrap();
        if check(relit) {
            seen.borrow_mut().insert(relit.scene.frame);
        }
        seen.borrow().len() >= 5
    });
    assert!(window.state().state().playback.playing);
    window.key_press(Key::Space);
    until(window, "rest", |app| !app.state().playback.playing);
}

#[test]
fn the_picture_is_wiped_against_a_stored_look_at_any_frame() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    relight(&mut window);
    store(&mut window, "Warm", "Store");
    let warm = all_frames(&mut window);
    relight(&mut window);
    let present = picture(&window);
    assert!(present != warm[0]);
    window.key_press(Key::W);
    until_compared(&mut window);
    open(&mut window, &["Against interview frame", "Look", "Warm"]);
    let of_warm = Reference::Look(id(Shelf::Project, "Warm"), None);
    assert_eq!(window.state().state().compare.reference, of_warm);
    window.get_by_label("Against Warm");
    until_sides(&mut window, "stored look", [None, Some(&warm[0])]);
    assert!(picture(&window) == present, "the picture stays");
    let last = clay::FRAMES - 1;
    super::go(&mut window, Key::End, last);
    until_sides(&mut window, "last frame", [None, Some(&warm[last])]);
    super::snapshot(&mut window, "studio_wiped_look");

    // During playback, both pictures show the same frame.
    play(&mut window, |relit| {
        let second = sides(relit)[1];
        assert!(second.is_none_or(|second| second == warm[relit.scene.frame]));
        second.is_some()
    });

    // The same look on the left as well: the difference is black.
    super::go(&mut window, Key::Home, 0);
    open(&mut window, &["First: relit", "Look", "Warm"]);
    until_sides(&mut window, "both", [Some(&warm[0]), Some(&warm[0])]);
    compare_by(&mut window, "Difference");
    let black = vec![0; warm[0].len()];
    until_sides(&mut window, "difference", [Some(&black), Some(&warm[0])]);
    window.key_press(Key::Q);
    until_sides(&mut window, "one alone", [Some(&warm[0]), Some(&warm[0])]);
    assert!(window.state().state().compare.second);
}

#[test]
fn versions_of_a_look_are_compared_until_it_is_removed_and_that_is_said() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    store(&mut window, "Night", "Store");
    let first = picture(&window);
    relight(&mut window);
    window.get_by_label("Update").click();
    until(&mut window, "second version", |app| {
        let newest = app.looks().version(&id(Shelf::Project, "Night"), None);
        newest.is_some_and(|newest| newest.number == 2)
    });
    let second = picture(&window);
    relight(&mut window);
    window.key_press(Key::W);
    until_compared(&mut window);
    let against = ["Against interview frame", "Look", "Night, version 1"];
    open(&mut window, &against);
    open(&mut window, &["First: relit", "Look", "Night"]);
    until_sides(&mut window, "versions", [Some(&second), Some(&first)]);

    rename(&mut window, "Night", "Eve");
    until(&mut window, "new name", |app| !app.looks().is_busy());
    until_labelled(&mut window, "Against Eve, version 1");
    window.get_by_label("First: Eve");
    until_sides(&mut window, "the same", [Some(&second), Some(&first)]);

    // No stale picture remains.
    choose(&mut window, "Eve", "Remove");
    until_labelled(&mut window, "Eve was removed");
    until_sides(&mut window, "relit picture", [None, None]);
    click_on(&mut window, "Removed looks");
    click_on(&mut window, "Restore Eve");
    until_sides(&mut window, "versions", [Some(&second), Some(&first)]);
    assert!(window.query_by_label("Eve was removed").is_none());
}

#[test]
fn a_compared_look_whose_environment_is_missing_says_so() {
    let (folder, mut window) = crate::new_window();
    let yard = folder.path().join("yard.exr");
    write_exr(&yard, &Image::from_fn(64, 32, |x, _| [x as f32 / 32.0; 3])).unwrap();
    super::drop_onto(&mut window, yard);
    until(&mut window, "the yard's light", |app| app.relit().is_some_and(|relit| relit.environment == "yard"));
    until_shown(&mut window);
    let lit = picture(&window);
    open_looks(&mut window);
    store(&mut window, "Yard", "Store");
    window.get_by_label("Environments").click();
    window.run_steps(2);
    window.get_by_label("sky").click();
    until_shown(&mut window);
    window.key_press(Key::W);
    until_compared(&mut window);
    open(&mut window, &["Against interview frame", "Look", "Yard"]);
    until_sides(&mut window, "look", [None, Some(&lit)]);
    // Undo removes the environment from the list.
    for _ in 0..2 {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        window.run_steps(2);
    }
    until_sides(&mut window, "no look", [None, None]);
    window.get_by_label_contains("\u{201c}yard\u{201d} is not in the list");
}

#[test]
fn one_of_four_places_has_an_older_version_also_while_the_clip_plays() {
    let (_folder, mut window) = crate::new_window();
    open_looks(&mut window);
    relight(&mut window);
    store(&mut window, "Night", "Store");
    let old = all_frames(&mut window);
    relight(&mut window);
    window.get_by_label("Update").click();
    until(&mut window, "second version", |app| {
        let newest = app.looks().version(&id(Shelf::Project, "Night"), None);
        newest.is_some_and(|newest| newest.number == 2)
    });
    let new = all_frames(&mut window);
    window.key_press(Key::Num4);
    window.run_steps(2);
    open(&mut window, &["Place C, nothing", "Night, version 1"]);
    let night = id(Shelf::Project, "Night");
    let slots = &window.state().state().four.slots;
    assert_eq!(slots[1], FourSlot::Stored(night.clone(), None));
    assert_eq!(slots[2], FourSlot::Stored(night, Some(1)));
    window.get_by_label("Place C, Night, version 1");
    let are = |relit: &PreviewPicture| {
        let codes = |place: usize| relit.looks[place].as_ref().map(|(_, codes)| &codes.rgb);
        let frame = relit.scene.frame;
        codes(1) == Some(&new[frame]) && codes(2) == Some(&old[frame])
    };
    until(&mut window, "both versions", |app| app.relit().is_some_and(|relit| are(relit)));
    play(&mut window, |relit| {
        assert!(are(relit), "frame {}", relit.scene.frame);
        true
    });

    super::go(&mut window, Key::Home, 0);

    // The label of the viewing settings appears here too.
    assert!(window.query_by_label_contains("not exported").is_none());
    window.key_press(Key::L);
    window.key_press(Key::E);
    window.run_steps(4);
    until_shown(&mut window);
    let sign = window.get_by_label("viewing luminance, +0.5 stops: not exported");
    let [a, d] = ["A: current look", "D: nothing"].map(|name| window.get_by_label(name).rect());
    assert!(a.union(d).contains_rect(sign.rect()));
    // Its time of storing appears below its name.
    let row = window.get_by_label("Night").rect();
    let told = row.with_min_x(row.left() + 1.4 * row.height());
    super::snapshot_without(&mut window, "studio_four_viewed", &[told]);
}
