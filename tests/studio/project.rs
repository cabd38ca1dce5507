//! Projects: created from a shoot, reopened, missing, damaged, and open twice.

use super::{
    Window, clay, clay_window, click_on, drop_onto, lines_with, snapshot, snapshot_without, told_job, until,
    until_labelled, window,
};
use afterlight::calibration::CalibrateSettings;
use afterlight::footage::scan::Scan;
use afterlight::gpu::DeviceChoice;
use afterlight::imaging::file;
use afterlight::progress::Progress;
use afterlight::project::{Lock, Project};
use afterlight::studio::{Phase, Preferences, StudioApp, Workspace};
use afterlight::virtual_stage::{StageSettings, TroubleSettings, WrittenAs, write_shoot};
use afterlight::worker::{Job, Need};
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use std::path::{Path, PathBuf};
use test_shoot::{TestShoot, write_layers};
use test_support::wait_for;

/// A small shoot in `folder`.
pub fn shoot(folder: &Path) -> PathBuf {
    TestShoot::default().write(folder)
}

/// A project of a small shoot, both in `folder`.
pub fn imported(folder: &Path) -> Project {
    TestShoot::default().import(folder, "film")
}

/// The same with its calibration.
pub fn calibrated(folder: &Path) -> Project {
    TestShoot::default().calibrate(folder, "film").0
}

fn no_project() -> Window {
    window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu))
}

pub fn needs(need: Option<Need>) -> impl Fn(&StudioApp) -> bool {
    move |app| matches!(&app.status().phase, Phase::Blocked(blocked) if blocked.need == need)
}

/// A snapshot without paths that differ from run to run: those of the folder `made`.
fn snapshot_without_paths(window: &mut Window, name: &str, made: &Path) {
    let made = made.file_name().unwrap().to_string_lossy().into_owned();
    let mut places = lines_with(window, &made, 284.0, 830.0);
    // The refusal is as wide as the column.
    let refusals = places.iter_mut().filter(|place| place.top() < 40.0);
    refusals.for_each(|place| *place = egui::Rect::from_x_y_ranges(298.0..=968.0, place.y_range()));
    let fields = window.query_all_by_role(Role::TextInput);
    places.extend(fields.map(|field| field.rect()));
    snapshot_without(window, name, &places);
}

#[test]
fn a_shoot_that_is_dropped_becomes_a_project() {
    let folder = crate::temporary();
    let shoot = shoot(folder.path());
    let mut window = no_project();
    window.run();
    window.get_by_label("New project…");
    drop_onto(&mut window, &shoot);
    until(&mut window, "look at the shoot", |app| app.wizard().scan().is_some());
    for part in ["Manifest", "Interview", "Poses", "Mirror balls", "Mattes"] {
        window.get_by_label(&format!("{part}: complete"));
    }
    let scan = window.state().wizard().scan().unwrap().clone();
    assert_eq!((scan.frames, scan.lamps, scan.picture), (3, 6, Some((32, 32))));
    snapshot_without_paths(&mut window, "studio_project_filled", folder.path());

    let name = window.get_by_role_and_label(Role::TextInput, "Name");
    name.focus();
    name.type_text("Anna");
    window.run();
    window.get_by_label("All 6").click();
    window.run();
    window.get_by_role_and_label(Role::SpinButton, "Lamps");
    window.get_by_role_and_label(Role::ComboBox, "Working size").click();
    window.run_steps(4);
    window.get_by_label("64 pixels").click();
    window.run();
    window.get_by_label("Make project").click();
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    let made = Project::open(&folder.path().join("shoot-project")).unwrap();
    let settings = &made.settings;
    assert_eq!((settings.name.as_str(), settings.size), ("Anna", 64));
    assert_eq!((settings.shoot.lamps.len(), settings.shoot.other_lamps.len()), (3, 3));
    assert_eq!(window.state().project().unwrap().settings.name, "Anna");
    assert_eq!(format!("{:?}", window.state().state().panes.workspace), "Calibrate");
}

#[test]
fn what_a_shoot_lacks_is_said_before_a_project_is_made() {
    let folder = crate::temporary();
    let shoot = shoot(folder.path());
    std::fs::remove_file(shoot.join("probes/olat_03.png")).unwrap();
    std::fs::remove_file(shoot.join("interview_masks/frame_001.png")).unwrap();
    let mut window = no_project();
    drop_onto(&mut window, folder.path().join("shoot/truth.json"));
    window.get_by_label_contains("cannot be used. Drop a panorama");
    drop_onto(&mut window, &shoot);
    until(&mut window, "look at the shoot", |app| app.wizard().scan().is_some());
    window.get_by_label("Mirror balls: missing");
    window.get_by_label_contains("probes/olat_03.png is missing. The lamps");
    window.get_by_label_contains("interview_masks/frame_001.png is missing");
    let make = window.get_by_label("Make project");
    assert!(make.accesskit_node().is_disabled());
    snapshot_without_paths(&mut window, "studio_project_error", folder.path());
    window.get_by_label("Cancel").click();
    window.run();
    window.get_by_label("No project is open");
}

#[test]
fn a_layer_of_the_interview_is_chosen_before_a_project_is_made() {
    let folder = crate::temporary();
    let shoot = shoot(folder.path());
    for frame in 0..3 {
        let png = shoot.join(format!("interview/frame_{frame:03}.png"));
        write_layers(&png.with_extension("exr"), &file::read_linear(&png).unwrap());
        std::fs::remove_file(&png).unwrap();
    }
    let mut window = no_project();
    drop_onto(&mut window, &shoot);
    until(&mut window, "look at the shoot", |app| app.wizard().scan().is_some());
    window.get_by_label_contains("2 layers with colours");
    assert!(window.get_by_label("Make project").accesskit_node().is_disabled());
    window.get_by_role_and_label(Role::ComboBox, "EXR layer").click();
    window.run_steps(4);
    window.get_by_label("comp").click();
    window.run();
    until(&mut window, "look again", |app| app.wizard().scan().is_some_and(Scan::is_complete));
    window.get_by_label("Make project").click();
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    let made = Project::open(&folder.path().join("shoot-project")).unwrap();
    assert_eq!(made.settings.shoot.layer.as_deref(), Some("comp"));
}

/// A small shoot of movies in a folder; the camera keeps rolling from lamp to lamp.
pub fn filmed(folder: &Path) -> PathBuf {
    let filmed = folder.join("filmed");
    let stage = StageSettings {
        frames: 3,
        size: 32,
        lamps: 6,
        written_as: WrittenAs::Movies,
        trouble: TroubleSettings { tracking: Some(3), ..TroubleSettings::default() },
        ..StageSettings::default()
    };
    write_shoot(&filmed, &stage, &Progress::silent()).unwrap();
    filmed
}

#[test]
fn a_shoot_is_gathered_from_dropped_movies() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = crate::temporary();
    let filmed = filmed(folder.path());
    let mut window = no_project();
    window.run();
    drop_onto(&mut window, filmed.join("exemplars/pose00.mov"));
    window.get_by_label("New project");
    let known = |count: usize| move |app: &StudioApp| app.wizard().gathered().len() == count;
    until(&mut window, "look at the pose", known(1));
    window.get_by_label_contains("6 frames each lit by one lamp");
    window.hover_at(egui::pos2(5.0, 5.0));
    window.run_steps(2);
    // The next position of the pointer decides the kind of part. A part that does not fit shows the reason.
    drop_onto(&mut window, filmed.join("interview.mov"));
    let row = window.get_by_label("Add files to: Mirror ball").rect().center();
    window.hover_at(row);
    window.run_steps(2);
    until(&mut window, "look at the interview", known(2));
    window.get_by_label_contains("Neither the highlight nor the brightness changes");
    // A judgement can be overruled.
    window.get_by_label("Use interview.mov anyway").click();
    window.run_steps(2);
    assert!(window.query_by_label_contains("Neither the highlight").is_none());
    window.get_by_label("Remove interview.mov").click();
    window.run_steps(2);
    drop_onto(&mut window, filmed.join("interview.mov"));
    window.hover_at(egui::pos2(5.0, 5.0));
    until(&mut window, "look at the interview again", known(2));
    window.get_by_role_and_label(Role::TextInput, "Name");
    assert!(window.query_by_label("All 0").is_none(), "no lamps to choose from yet");
    for name in ["probes.mov", "probes/interview.png", "exemplars"] {
        drop_onto(&mut window, filmed.join(name));
        window.hover_at(egui::pos2(5.0, 6.0));
        window.run_steps(2);
    }
    until(&mut window, "look at all files", known(9));
    window.run();
    assert!(window.query_by_label_contains("as in a lamp cycle").is_none());
    let make = window.get_by_label("Make project");
    assert!(!make.accesskit_node().is_disabled());
    make.scroll_to_me();
    window.run();
    window.get_by_label("Make project").click();
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    let made = Project::open(&folder.path().join("filmed-project")).unwrap();
    let shoot = &made.settings.shoot;
    assert_eq!((shoot.poses.len(), shoot.lamps.len(), shoot.frames.len()), (6, 6, 3));
    assert_eq!(made.settings.name, "filmed");
}

#[test]
fn recent_projects_are_opened_and_those_that_are_gone_are_taken_out() {
    let folder = crate::temporary();
    let film = imported(folder.path());
    let file = folder.path().join("window.json");
    let mut preferences = Preferences::from_file(&file);
    preferences.opened(&film.root);
    preferences.opened(&folder.path().join("gone"));
    let mut window = window(|ctx| StudioApp::with_preferences(ctx, preferences, None, DeviceChoice::Cpu));
    for _ in 0..200 {
        std::thread::sleep(std::time::Duration::from_millis(5));
        window.step();
        if window.query_by_label("Open virtual stage").is_some() {
            break;
        }
    }
    window.get_by_label_contains("The folder is missing");
    until(&mut window, "first frames", |app| app.recents().are_drawn());
    assert!(window.state().recents().thumbnail(&film.root).is_some());
    window.get_by_label("First frame of virtual stage");
    window.get_by_label("First frame of gone");
    // A missing project shows that instead of the time.
    assert_eq!(window.query_all_by_label("Opened within the last hour").count(), 1);
    let made = folder.path().file_name().unwrap().to_string_lossy();
    let folders = window.query_all_by_label_contains(&made).map(|line| line.rect());
    let fields = window.query_all_by_role(Role::TextInput);
    let places: Vec<egui::Rect> = folders.chain(fields.map(|field| field.rect())).collect();
    snapshot_without(&mut window, "studio_project_recent", &places);
    window.get_by_label("Remove gone").click();
    window.run();
    assert!(window.query_by_label_contains("The folder is missing").is_none());
    window.get_by_label("Open virtual stage").click();
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    drop(window);
    let kept = Preferences::from_file(&file);
    assert_eq!(kept.recent(), [film.root]);
}

#[test]
fn a_recent_project_is_opened_by_its_first_frame() {
    let folder = crate::temporary();
    let film = imported(folder.path());
    let mut preferences = Preferences::from_file(&folder.path().join("window.json"));
    preferences.opened(&film.root);
    let mut window = window(|ctx| StudioApp::with_preferences(ctx, preferences, None, DeviceChoice::Cpu));
    until_labelled(&mut window, "First frame of virtual stage");
    window.get_by_label("First frame of virtual stage").click();
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    assert_eq!(window.state().project().unwrap().root, film.root);
    // The interview's frame is the backdrop of the question.
    until(&mut window, "frame behind the question", |app| matches!(app.footage().picture(), Some(Ok(_))));
    window.get_by_label("Calibrate");
}

#[test]
fn a_project_that_is_not_calibrated_says_so_over_its_frame_and_offers_it() {
    let folder = crate::temporary();
    let film = imported(folder.path());
    let mut window = window(|ctx| StudioApp::new(ctx, Some(film), DeviceChoice::Cpu));
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    let corner = |window: &mut Window| {
        let shot = window.render().unwrap();
        shot.get_pixel(300, 70).0
    };
    until(&mut window, "frame behind the question", |app| {
        let listed = app.environments().iter().all(|e| e.panorama.is_done());
        listed && matches!(app.footage().picture(), Some(Ok(_)))
    });
    window.run_steps(3);
    window.get_by_label("Not calibrated yet");
    assert!(window.query_by_label_contains("afterlight ").is_none());
    let surround = [118, 118, 118, 255];
    assert_ne!(corner(&mut window), surround, "the frame fills the pane");
    snapshot(&mut window, "studio_uncalibrated");
    // The status line leads here from any workspace.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    window.run_steps(3);
    click_on(&mut window, "Action needed");
    assert_eq!(window.state().state().panes.workspace, Workspace::Relight);
    window.get_by_label("Calibrate").click();
    until(&mut window, "calibration", |app| app.status().job.is_some());
}

#[test]
fn an_empty_window_offers_the_ways_to_a_project() {
    let mut window = no_project();
    window.run();
    for offer in ["New project…", "Open project…", "Make the demo"] {
        window.get_by_label(offer);
    }
    window.get_by_label("No recent projects");
    window.get_by_label("A frame of the demo under four lights");
    snapshot(&mut window, "studio_project_empty");
    window.get_by_label("New project…").click();
    window.run();
    window.get_by_label_contains("Choose the shoot's folder, or bring its parts");
}

#[test]
fn the_demo_shows_its_pictures_while_they_are_traced() {
    let folder = crate::temporary();
    let mut window = no_project();
    window.run();
    window.get_by_role_and_label(Role::TextInput, "Folder").click();
    window.run_steps(2);
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
    window.event(egui::Event::Text(folder.path().join("demo").display().to_string()));
    window.run_steps(2);
    window.get_by_label("Make the demo").click();
    until(&mut window, "job", |app| app.status().job.is_some());
    wait_for(|| {
        window.step();
        window.query_by_label_contains("shoot/exemplars/pose00/").map(drop)
    });
    window.get_by_label("Stop").click();
    until(&mut window, "end of the job", |app| app.status().job.is_none());
}

#[test]
fn a_second_studio_reads_only_and_writes_once_the_first_is_closed() {
    let folder = crate::temporary();
    let project = clay::project(folder.path(), clay::environments(folder.path()));
    project.save().unwrap();
    let open = || {
        let project = project.clone();
        let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
        until(&mut window, "the first picture", |app| app.relit().is_some());
        window
    };
    let first = open();
    let mut second = open();
    second.get_by_label("Read-only");
    second.get_by_label(&format!("Open in another window (process {}).", std::process::id()));
    let job = Job::Calibrate { project: project.root.clone(), settings: CalibrateSettings::default() };
    let refused = second.state().worker().unwrap().run(job).unwrap_err();
    let refused = refused.to_string();
    assert!(refused.contains("Read-only"), "{refused}");
    assert!(refused.contains("the studio, process"), "{refused}");
    // Neither the look nor the environment list is saved.
    let files = || {
        let names = std::fs::read_dir(folder.path()).unwrap().flatten();
        let mut names: Vec<_> = names.map(|entry| entry.file_name()).collect();
        names.sort();
        (names, std::fs::read(folder.path().join("project.toml")).unwrap())
    };
    let before = files();
    let yard = folder.path().join("sky.exr");
    let elsewhere = crate::temporary();
    std::fs::copy(yard, elsewhere.path().join("yard.exr")).unwrap();
    drop_onto(&mut second, elsewhere.path().join("yard.exr"));
    until(&mut second, "added environment", |app| app.environments().iter().all(|e| e.panorama.is_done()));
    assert!(second.state().state().can_undo());
    assert_eq!(files(), before);

    drop(first);
    second.get_by_label("Try again").click();
    until(&mut second, "right to write", |app| app.worker().is_some_and(|worker| worker.writable().is_ok()));
    second.run();
    assert!(second.query_by_label("Read-only").is_none());
    let refused = Lock::take(folder.path(), "another").unwrap_err().to_string();
    assert!(refused.contains("the studio"), "{refused}");
}

#[test]
fn another_project_is_not_opened_while_a_job_runs_and_is_once_it_was_stopped() {
    let (folder, elsewhere) = (crate::temporary(), crate::temporary());
    let film = imported(folder.path());
    let mut window = clay_window(elsewhere.path());
    let job = told_job(&mut window);
    drop_onto(&mut window, &film.root);
    until_labelled(&mut window, "Stop and open");
    window.get_by_label("Training the network: training at 37 %. It stops; what is saved stays.");
    window.get_by_label("Keep working").click();
    window.run_steps(2);
    assert_eq!(window.state().project().unwrap().root, elsewhere.path());
    // The job continues.
    job.send(|progress| progress.step("training", 500, 1000, "going on")).unwrap();
    until(&mut window, "next step of the job", |app| {
        let job = app.status().job.as_ref();
        job.is_some_and(|job| job.note == "going on" && !job.stopping)
    });
    window.get_by_label("Stop").click();
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    assert_eq!(window.state().project().unwrap().root, elsewhere.path());
    drop_onto(&mut window, &film.root);
    until(&mut window, "opened project", needs(Some(Need::Calibration)));
    assert_eq!(window.state().project().unwrap().root, film.root);
    assert_eq!(window.state().status().refusal, None);
}

#[test]
fn a_shoot_that_was_moved_is_asked_for_and_found() {
    let test = "project::a_shoot_that_was_moved_is_asked_for_and_found";
    if !super::alone(test, &super::NO_DIALOGS) {
        return;
    }
    let folder = crate::temporary();
    let project = imported(folder.path());
    let moved = folder.path().join("elsewhere");
    std::fs::rename(folder.path().join("shoot"), &moved).unwrap();
    let opened = project.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(opened), DeviceChoice::Cpu));
    until(&mut window, "question", needs(Some(Need::Shoot)));
    window.get_by_label("Locate…");
    click_on(&mut window, "Action needed");
    super::dialogs::until_missing(&mut window);
    click_on(&mut window, "Cancel");
    // In the smallest window the wheel reaches it.
    window.set_size(egui::vec2(640.0, 400.0));
    window.run_steps(3);
    window.get_by_label("Locate…").scroll_to_me();
    window.run_steps(6);
    let button = window.get_by_label("Locate…").rect();
    assert!(button.bottom() < window.get_by_label("Play").rect().top(), "{button:?}");
    let read = folder.path().join("shoot").display().to_string();
    assert!(window.query_all_by_label_contains(&read).count() > 0);
    for text in super::dialogs::texts(&window) {
        assert!(!text.contains("/../"), "{text}");
    }
    drop_onto(&mut window, &moved);
    until(&mut window, "found shoot", needs(Some(Need::Calibration)));
    let kept = Project::open(&project.root).unwrap();
    assert_eq!(kept.settings.shoot.folder, Path::new("../elsewhere"));
}

#[test]
fn each_damage_has_its_sentence_and_loses_nothing() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let root = project.root.clone();
    let path = |name: &str| root.join(name);
    let opened = || {
        let project = project.clone();
        window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu))
    };

    std::fs::create_dir_all(path("checkpoint")).unwrap();
    std::fs::write(path("checkpoint/checkpoint.toml"), "weights = 7").unwrap();
    let mut window = opened();
    until(&mut window, "damaged network", needs(None));
    window.get_by_label_contains("checkpoint.toml");
    window.get_by_label_contains("Train again");
    assert!(window.query_by_label_contains("--fresh").is_none());
    window.get_by_label("Try again");
    drop(window);
    let damaged = std::fs::read(path("checkpoint/checkpoint.toml")).unwrap();
    assert_eq!(damaged, b"weights = 7");

    std::fs::write(path("calibration.toml"), "lamps = [").unwrap();
    let mut window = opened();
    until(&mut window, "damaged calibration", needs(Some(Need::Calibration)));
    window.get_by_label_contains("calibration.toml");
    window.get_by_label("Calibrate");
    drop(window);

    for (text, says) in [(Some("name = \"film\"\nsize = x"), "Correct the line"), (None, "no panorama")] {
        let mut window = opened();
        until(&mut window, "opened project", needs(Some(Need::Calibration)));
        match text {
            Some(text) => std::fs::write(path("project.toml"), text).unwrap(),
            None => std::fs::remove_file(path("project.toml")).unwrap(),
        }
        drop_onto(&mut window, &root);
        until(&mut window, says, |app| app.status().log.iter().any(|line| line.sentence.contains(says)));
        assert!(window.state().project().is_some(), "what was open stays");
    }
}
