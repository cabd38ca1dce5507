//! Saving threads of a window that is killed, and of a window that shares its project with other programs.

use super::*;
use crate::environment_list::{ListedEnvironment, Owner};
use crate::history::History;
use crate::preferences::Preferences;
use crate::saved_history;
use crate::saver::Saver;
use project::NamedEnvironment;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use test_support::accident::{End, Moments, age, contents, left_over};
use worker::{EnvironmentListWriter, Origin};

/// Variable with the folder in which a child process keeps saving.
const FOLDER: &str = "AFTERLIGHT_SAVING_FOLDER";
/// Variable with the time in seconds for which processes share a project.
const SECONDS: &str = "AFTERLIGHT_SHARED_SECONDS";

/// The settings of a window after this number of changes.
fn settings(number: u64) -> LookSettings {
    let mut settings = LookSettings {
        // Longer than a disk block.
        environments: Arc::new(vec![ListedEnvironment {
            name: "x".repeat(10_000),
            origin: Origin::BuiltIn(light::built_in::all()[0]),
            front: None,
            owner: Owner::Program,
        }]),
        ..LookSettings::default()
    };
    settings.lighting.intensity_stops = number as f32;
    settings
}

fn look(number: u64) -> SavedLook {
    SavedLook::from_look(&settings(number))
}

/// Text of the undo steps after this number of changes.
fn undo(number: u64) -> String {
    let before = settings(number - 1);
    History::text([&[before], &[]], &settings(number)).unwrap()
}

/// The environment list after this number of changes.
fn environments(folder: &Path, number: u64) -> Vec<NamedEnvironment> {
    vec![NamedEnvironment {
        name: format!("e{}", number % 5),
        file: folder.join(format!("e{}.exr", number % 5)),
        front: None,
    }]
}

/// A project in `folder/film`, beside files that the program must not touch.
fn begin(folder: &Path) -> Project {
    let root = folder.join("film");
    std::fs::create_dir_all(&root).unwrap();
    let project = Project::without_shoot(&root);
    project.save().unwrap();
    std::fs::create_dir(folder.join("outside")).unwrap();
    std::fs::write(folder.join("outside/look.json"), "not the program's").unwrap();
    std::os::unix::fs::symlink("../outside", root.join("notes")).unwrap();
    std::os::unix::fs::symlink("../outside/look.json", SavedLook::path(&project)).unwrap();
    std::fs::write(folder.join("saved"), [0; 8]).unwrap();
    project
}

/// Number of the last saved look.
fn saved(folder: &Path) -> u64 {
    let bytes = std::fs::read(folder.join("saved")).unwrap();
    u64::from_le_bytes(bytes.try_into().unwrap())
}

/// A process that keeps saving look, preferences and environments, and notes the number of each save.
fn child(folder: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let test = "saved_look::crash_tests::a_window_that_is_killed_while_it_saves_loses_at_most_the_last_save";
    command.args(["--exact", test, "--nocapture"]);
    command.env(FOLDER, folder);
    command
}

/// Work of that process.
fn save_for_ever(folder: &Path) -> ! {
    let project = Project::open(&folder.join("film")).unwrap();
    let mut options = std::fs::File::options();
    let note = options.write(true).open(folder.join("saved")).unwrap();
    let window = folder.join("settings/window.json");
    let mut preferences = Preferences::from_file(&window);
    let list = project.settings.environments.clone();
    let list = list.into_iter().map(|mut one| {
        one.file = project.root.join(&one.file);
        one
    });
    let fail = || panic!("something could not be saved");
    let writer = EnvironmentListWriter::start(project.root.clone(), list.collect(), fail);
    let saver = Saver::start(fail);
    for number in saved(folder) + 1.. {
        saver.save(saved_history::path(&project), undo(number));
        saver.save(SavedLook::path(&project), look(number).text());
        preferences.opened(&folder.join(format!("p{number}")));
        preferences.save(&saver);
        writer.keep(environments(folder, number));
        for file in [&saved_history::path(&project), &SavedLook::path(&project), &window] {
            test_support::wait_for(|| saver.unwritten(file).is_none().then_some(()));
        }
        note.write_all_at(&number.to_le_bytes(), 0).unwrap();
        let failures: Vec<String> = saver.failures().chain(writer.failures()).collect();
        if !failures.is_empty() {
            eprintln!("{failures:?}");
            std::process::exit(1);
        }
    }
    unreachable!("the numbers are unbounded")
}

/// Checks that the saved look is complete, and is the last one or the one after.
fn check(folder: &Path, project: &Project) {
    let number = saved(folder);
    let found = SavedLook::load(project, false).unwrap().unwrap();
    let near = [look(number), look(number + 1)];
    assert!(near.contains(&found), "{:?} after {number}", found.look.lighting);
    // The steps belong to the look, whichever file was written last.
    let mut shown = settings(0);
    found.apply(&mut shown);
    let at = shown.lighting.intensity_stops;
    let history = History::load(project, None, &shown).unwrap();
    let steps = history.undo.iter().chain(&history.redo);
    let steps: Vec<f32> = steps.map(|step| step.lighting.intensity_stops).collect();
    assert!(steps == [at - 1.0] || steps == [at + 1.0], "{steps:?} at {at}");
    let window = folder.join("settings/window.json");
    let preferences = Preferences::from_file(&window);
    let recent = &preferences.recent()[0];
    let near = [number, number + 1].map(|number| folder.join(format!("p{number}")));
    assert!(near.contains(recent), "{recent:?} after {number}");
    assert!(!window.with_extension("json.old").exists());
    let project = Project::open(&project.root).unwrap();
    assert!(project.environments().len() <= 1);
}

#[test]
fn a_window_that_is_killed_while_it_saves_loses_at_most_the_last_save() {
    if let Some(folder) = std::env::var_os(FOLDER) {
        save_for_ever(Path::new(&folder));
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let project = begin(folder);
    let outside = contents(&folder.join("outside"));
    // Before the first save, there is only the linked file.
    let first = child(folder).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let mut first = first.unwrap();
    let started = Instant::now();
    test_support::wait_for(|| (saved(folder) > 2).then_some(()));
    let whole = 2 * started.elapsed();
    first.kill().unwrap();
    first.wait().unwrap();
    let mut moments = Moments::from_name("studio");
    let settings = folder.join("settings");
    let folders = [&*project.root, &settings];
    let mut unfinished = 0;
    for _ in 0..moments.count {
        let end = moments.next(whole, &folders).kill(&mut child(folder));
        assert!(matches!(end, End::Killed), "{end:?}");
        check(folder, &project);
        let left = left_over(folder);
        unfinished += u32::from(!left.is_empty());
        age(&left);
        // As the next window does on start.
        Preferences::from_file(&folder.join("settings/window.json"));
        drop(project::Lock::take(&project.root, "a test").unwrap());
        assert!(left_over(folder).is_empty());
    }
    assert_eq!(contents(&folder.join("outside")), outside);
    let measured = format!("{} kills, {unfinished} of them with something unfinished", moments.count);
    eprintln!("{measured}");
    test_support::shown!(
        Accidents,
        "The studio is killed while it saves",
        bound: "the look is the last saved one or the one after; no file outside the project changed",
        measured: measured
    );
}

#[test]
fn a_window_and_another_program_lose_none_of_each_others_changes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let project = begin(folder);
    let seconds = std::env::var(SECONDS).ok().and_then(|text| text.parse().ok());
    let deadline = Instant::now() + Duration::from_secs(seconds.unwrap_or(3));
    let mut window = child(folder).stdout(Stdio::null()).spawn().unwrap();
    let mut changes = 0;
    while Instant::now() < deadline || saved(folder) < 3 {
        assert!(window.try_wait().unwrap().is_none(), "the window failed");
        Project::change(&project.root, |project| {
            project.settings.seed += 1;
            Ok(())
        })
        .unwrap();
        changes += 1;
    }
    window.kill().unwrap();
    window.wait().unwrap();
    check(folder, &project);
    let now = Project::open(&project.root).unwrap().settings.seed;
    assert_eq!(now - project.settings.seed, changes);
    let measured = format!("{changes} changes beside {} saves; none lost", saved(folder));
    eprintln!("{measured}");
    test_support::shown!(
        Accidents,
        "The studio and another program change one project at a time",
        bound: "every change is kept",
        measured: measured
    );
}
