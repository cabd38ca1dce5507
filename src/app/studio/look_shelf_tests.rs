//! Looks on disk: stored, changed by other programs, damaged.

use super::*;
use crate::command::LookCommand;
use crate::state::State;
use scene::Setting;
use test_support::small_disk::names as files_of;

fn name(text: &str) -> LookName {
    LookName::new(text).unwrap()
}

fn look(stops: f32) -> StoredLook {
    let mut state = State::new(1, 24.0);
    state.change(LookCommand::Set(Setting::Exposure, stops));
    StoredLook::from_look(&state.look)
}

fn grey(code: u8) -> SrgbPicture {
    SrgbPicture { width: 400, height: 200, rgb: vec![code; 400 * 200 * 3] }
}

fn listed(shelf: &LookShelf) -> ShelfContents {
    shelf.list(&mut ReadPictures::default())
}

fn called(shelf: &LookShelf) -> Vec<String> {
    let looks = listed(shelf).looks;
    looks.iter().map(|look| look.name.to_string()).collect()
}

#[test]
fn versions_are_added_and_an_unchanged_look_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let shelf = LookShelf::within(folder.path());
    assert!(listed(&shelf).looks.is_empty());
    assert_eq!(files_of(folder.path()), [""; 0], "reading writes nothing");
    let warm = name("Warm");
    let store = |called: &str, stops| shelf.store(&name(called), &look(stops)).unwrap();
    assert_eq!(store("Warm", 1.0), (warm.clone(), 1));
    shelf.draw(&warm, 1, &grey(90)).unwrap();
    assert_eq!(store("Warm", 1.0), (warm.clone(), 1));
    // Some disks treat both as one name.
    assert_eq!(store("WARM", 2.0), (warm, 2));
    let found = listed(&shelf);
    assert_eq!(found.looks.len(), 1);
    let versions = &found.looks[0].versions;
    let numbers: Vec<u32> = versions.iter().map(|one| one.number).collect();
    assert_eq!(numbers, [2, 1]);
    assert!(versions[0].picture.is_none());
    let small = versions[1].picture.as_ref().unwrap();
    assert_eq!((small.width, small.height), (192, 96));
    assert!(small.rgb.iter().all(|&code| code == 90));
}

#[test]
fn what_is_removed_comes_back_and_nothing_is_lost_by_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let shelf = LookShelf::within(folder.path());
    for (text, stops) in [("A", 1.0), ("B", 2.0)] {
        shelf.store(&name(text), &look(stops)).unwrap();
    }
    let said = shelf.rename(&name("A"), &name("b")).unwrap_err();
    assert!(said.to_string().contains("named B already exists"), "{said}");
    shelf.rename(&name("A"), &name("C")).unwrap();
    assert_eq!(called(&shelf), ["B", "C"]);
    shelf.rename(&name("C"), &name("c")).unwrap();
    assert_eq!(called(&shelf), ["B", "c"]);
    assert!(shelf.rename(&name("A"), &name("D")).is_err());

    for stops in [3.0, 4.0] {
        shelf.remove(&name("B")).unwrap();
        shelf.store(&name("B"), &look(stops)).unwrap();
    }
    assert_eq!(listed(&shelf).removed, [name("B"), name("B 2")]);
    assert_eq!(shelf.bring_back(&name("B")).unwrap(), name("B 2"));
    assert_eq!(called(&shelf), ["B", "B 2", "c"]);
    let found = listed(&shelf).looks;
    for (place, stops) in [(0, 4.0), (1, 2.0)] {
        assert!(found[place].versions[0].look.is_same(&look(stops)));
    }
    shelf.bring_back(&name("B 2")).unwrap();
    let found = listed(&shelf).looks;
    assert!(found[2].versions[0].look.is_same(&look(3.0)));
    assert!(shelf.bring_back(&name("B")).is_err());
}

#[test]
fn a_look_is_copied_to_another_shelf_with_its_picture() {
    let [one, other] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let [mine, library] = [&one, &other].map(|folder| LookShelf::within(folder.path()));
    mine.store(&name("Night"), &look(-1.0)).unwrap();
    mine.draw(&name("Night"), 1, &grey(30)).unwrap();
    for _ in 0..2 {
        library.copy(&mine, &name("Night"), &name("Night")).unwrap();
    }
    let found = listed(&library);
    assert_eq!(found.looks[0].versions.len(), 1, "equal versions are stored once");
    assert!(found.looks[0].versions[0].picture.is_some());
    assert!(library.copy(&mine, &name("No"), &name("No")).is_err());
    // A name that some disks treat as the same names the same look.
    mine.store(&name("night"), &look(-2.0)).unwrap();
    mine.draw(&name("Night"), 2, &grey(10)).unwrap();
    library.copy(&mine, &name("Night"), &name("NIGHT")).unwrap();
    assert_eq!(called(&library), ["Night"]);
    assert!(listed(&library).looks[0].versions[0].picture.is_some());
}

#[test]
fn two_windows_that_store_at_once_both_keep_theirs() {
    let folder = tempfile::tempdir().unwrap();
    let shelf = LookShelf::within(folder.path());
    let threads: Vec<_> = (0..4)
        .map(|i| {
            let shelf = shelf.clone();
            std::thread::spawn(move || {
                for j in 0..5 {
                    let stops = (i * 5 + j) as f32 * 0.1;
                    shelf.store(&name("Both"), &look(stops)).unwrap();
                }
            })
        })
        .collect();
    threads.into_iter().for_each(|one| one.join().unwrap());
    assert_eq!(listed(&shelf).looks[0].versions.len(), 20);
}

#[test]
fn a_strangers_folder_is_read_without_harm() {
    let folder = tempfile::tempdir().unwrap();
    let shelf = LookShelf::within(folder.path());
    shelf.store(&name("Good"), &look(1.0)).unwrap();
    let at = |file: &str| folder.path().join("looks").join(file);
    std::fs::write(at("Good/0002.json"), "half a l").unwrap();
    // As after a kill.
    std::fs::write(at("Good/0009.json"), "").unwrap();
    std::fs::write(at("Good/0001.png"), b"\x89PNG\r\n\x1a\nno picture").unwrap();
    for other in ["2.json", "-0003.json", "0000.json", "99999999999.json", "notes.txt"] {
        std::fs::write(at(&format!("Good/{other}")), "{}").unwrap();
    }
    std::fs::write(at("a file"), "").unwrap();
    std::fs::create_dir(at("empty")).unwrap();
    std::fs::create_dir_all(at("end.")).unwrap();
    // A picture whose header claims to be enormous.
    let mut huge = png_bytes(&Encoded(Image::filled(1, 1, [0.5; 3]))).unwrap();
    huge[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    std::fs::create_dir(at("Huge")).unwrap();
    std::fs::write(at("Huge/0001.json"), look(0.0).text()).unwrap();
    std::fs::write(at("Huge/0001.png"), huge).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        let outside = folder.path().join("outside");
        std::fs::create_dir(&outside).unwrap();
        std::fs::write(outside.join("0001.json"), look(9.0).text()).unwrap();
        symlink(&outside, at("Linked")).unwrap();
        symlink(outside.join("0001.json"), at("Good/0004.json")).unwrap();
        symlink("/dev/zero", at("Good/0005.json")).unwrap();
        symlink(&outside, at(REMOVED)).unwrap();
        assert!(shelf.store(&name("Linked"), &look(2.0)).is_err());
        assert!(shelf.remove(&name("Good")).is_err());
        assert_eq!(files_of(&outside), ["0001.json"]);
    }
    let found = listed(&shelf);
    let names: Vec<&str> = found.looks.iter().map(|look| look.name.text()).collect();
    assert_eq!(names, ["Good", "Huge"]);
    let good = &found.looks[0].versions;
    assert_eq!((good.len(), good[0].number), (1, 1));
    assert!(found.looks.iter().all(|look| look.versions[0].picture.is_none()));
    assert!(found.removed.is_empty());
    let complaints = found.complaints.join("\n");
    assert!(complaints.contains("0002.json"), "{complaints}");
    assert!(!complaints.contains("0009.json"), "{complaints}");
    let stored = shelf.store(&name("Good"), &look(5.0)).unwrap();
    assert_eq!(stored, (name("Good"), 10));
    test_support::shown!(
        Strangers,
        "A project's `looks` hold links, devices, broken files and pictures that claim a million pixels",
        done: "links are not followed, sizes are bounded; other files are left alone and reported",
    );
}

#[cfg(unix)]
#[test]
fn a_shelf_that_leads_elsewhere_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(elsewhere.path(), folder.path().join("looks")).unwrap();
    let shelf = LookShelf::within(folder.path());
    assert!(shelf.store(&name("A"), &look(1.0)).is_err());
    assert_eq!(listed(&shelf).complaints.len(), 1);
    assert_eq!(files_of(elsewhere.path()), [""; 0]);
}
