//! The footage: thumbnails, mattes, and the crop.

use super::dialogs::assert_is_unsaved;
use super::project::{calibrated, imported, needs};
use super::{Window, clay, drag, lines_with, plain_drag, snapshot, snapshot_without, until, until_shown, window};
use afterlight::footage::{BrushSide, Strokes};
use afterlight::gpu::DeviceChoice;
use afterlight::project::{Framing, Project};
use afterlight::studio::{Pane, Phase, StudioApp, Thumbnail};
use afterlight::worker::Need;
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;
use test_shoot::TestShoot;

fn footage(project: &Project) -> Window {
    let opened = project.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(opened), DeviceChoice::Cpu));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.get_by_label("Footage").click();
    until(&mut window, "picture", |app| app.footage().picture().is_some());
    window
}

fn until_drawn(window: &mut Window) {
    until(window, "thumbnails", |app| {
        let footage = app.footage();
        let wanted = footage.wanted(Pane::Footage);
        !wanted.is_empty() && wanted.iter().all(|&one| footage.thumbnail(one).is_some())
    });
}

fn corner(window: &mut Window, name: &str, by: egui::Vec2) {
    let at = window.get_by_label(name).rect().center();
    plain_drag(window, at, at + by);
}

fn framing(project: &Project) -> Framing {
    Project::open(&project.root).unwrap().settings.framing.for_size((32, 32))
}

#[test]
fn thumbnails_lead_to_their_frames_and_mattes_lie_over_them() {
    let folder = crate::temporary();
    let project = imported(folder.path());
    let mut window = footage(&project);
    until_drawn(&mut window);
    window.get_by_label("Thumbnail of frame 2").click();
    window.run_steps(2);
    assert_eq!(window.state().state().frame, 2);
    window.key_press(Key::I);
    window.run_steps(2);
    window.get_by_label("Frame 2");
    window.get_by_label("All").click();
    window.run_steps(2);
    window.get_by_label("Frames 0 to 2");
    let file = |end: &'static str| {
        move |app: &StudioApp| {
            let shown = app.footage().picture().and_then(|p| p.as_ref().ok());
            shown.is_some_and(|shown| shown.file().ends_with(end))
        }
    };
    until(&mut window, "its picture", file("interview/frame_002.png"));
    window.get_by_label("Matte").click();
    until(&mut window, "its matte", file("interview_masks/frame_002.png"));
    window.get_by_label("Poses").click();
    until(&mut window, "a pose's matte", file("exemplar_masks/pose00.png"));
    window.get_by_label("Matte overlay").click();
    until(&mut window, "a pose", file("exemplars/pose00/olat_00.png"));
    // What is removed is red: the corner, and not the person in the middle.
    window.run_steps(3);
    let shot = window.render().unwrap();
    let square = window.get_by_label("Framing square").rect();
    let redness = |at: egui::Pos2| {
        let [r, g, b, _] = shot.get_pixel(at.x as u32, at.y as u32).0.map(f32::from);
        r - 0.5 * (g + b)
    };
    let corner = square.left_top() + vec2(12.0, 12.0);
    let [corner, middle] = [corner, square.center()].map(redness);
    assert!(corner > 60.0 && middle < 40.0, "{corner} {middle}");
}

#[test]
fn mattes_that_a_shoot_lacks_are_listed_and_made_by_a_button() {
    let folder = crate::temporary();
    let shoot = super::project::shoot(folder.path());
    std::fs::remove_dir_all(shoot.join("interview_masks")).unwrap();
    let mut window = window(|ctx| StudioApp::new(ctx, None, DeviceChoice::Cpu));
    super::drop_onto(&mut window, &shoot);
    until(&mut window, "look at the shoot", |app| app.wizard().scan().is_some());
    window.get_by_label("Mattes: not needed");
    window.get_by_label_contains("Missing for interview: the studio makes them");
    window.get_by_label("Make project").click();
    until(&mut window, "opened project", needs(Some(Need::Mattes)));
    window.run_steps(3);
    window.get_by_label("No mattes yet");
    // The status line leads there from any workspace.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num2);
    window.run_steps(3);
    window.get_by_label("Action needed").click();
    window.run_steps(3);
    assert!(!window.state().state().covers.machine);
    window.get_by_label("Make the mattes").click();
    until(&mut window, "mattes", needs(Some(Need::Calibration)));
    let made = window.state().status().log.iter().any(|line| line.sentence.starts_with("3 interview mattes made."));
    assert!(made, "{:?}", window.state().status().log);
}

#[test]
fn the_square_is_dragged_and_what_was_made_under_the_old_one_is_put_aside_when_confirmed() {
    let folder = crate::temporary();
    let project = calibrated(folder.path());
    let mut window = footage(&project);
    until(&mut window, "picture without training", |app| matches!(app.status().phase, Phase::Ready { .. }));
    until_drawn(&mut window);
    assert!(window.query_by_label("Use this framing").is_none());
    corner(&mut window, "Framing, lower right corner", vec2(-90.0, -20.0));
    corner(&mut window, "Framing square", vec2(40.0, -120.0));
    window.get_by_label("Use this framing").click();
    window.run();
    window.get_by_label_contains("belong to the old framing");
    crate::until_shown(&mut window);
    crate::live::until_idle(&mut window, "a framing that waits");
    assert_eq!(framing(&project), Framing::largest((32, 32)), "nothing is changed yet");
    snapshot(&mut window, "studio_footage_filled");
    window.get_by_label("Change framing anyway").click();
    until(&mut window, "need of a calibration", needs(Some(Need::Calibration)));
    let chosen = framing(&project);
    assert!(chosen.side < 32 && chosen.x > 0 && chosen.y < 0, "{chosen:?}");
    assert_eq!(window.state().project().unwrap().settings.framing.for_size((32, 32)), chosen);
    assert!(project.root.join("aside-1/calibration.toml").exists());
    window.get_by_label("Footage");
    window.get_by_label("Whole").click();
    window.run();
    // Nothing would be lost now, so there is no question. While another program holds the lock, the window stays
    // responsive.
    let other = std::fs::File::open(&project.root).unwrap();
    other.lock().unwrap();
    window.get_by_label("Use this framing").click();
    window.run();
    assert_eq!(framing(&project), chosen);
    drop(other);
    until(&mut window, "whole picture", |_| framing(&project) == Framing::whole((32, 32)));
    test_support::shown!(
        Accidents,
        "A project is framed or opened while another program writes into it",
        done: "the window stays responsive; after ten seconds it names the program to close",
    );
}

#[test]
fn a_frame_that_is_gone_is_named_in_place_of_its_picture() {
    let folder = crate::temporary();
    let project = imported(folder.path());
    std::fs::remove_file(project.frame_picture(1)).unwrap();
    let mut window = footage(&project);
    window.key_press(Key::ArrowRight);
    until(&mut window, "reason", |app| app.footage().picture().is_some_and(Result::is_err));
    window.get_by_label("This picture cannot be read");
    window.get_by_label_contains("interview/frame_001.png");
    until(&mut window, "thumbnails", |app| {
        [0, 2].iter().all(|&frame| app.footage().thumbnail(Thumbnail::Frame(frame)).is_some())
    });
    let places = lines_with(&window, "interview/frame_001.png", 250.0, 790.0);
    snapshot_without(&mut window, "studio_footage_error", &places);
    window.key_press(Key::ArrowRight);
    until(&mut window, "next picture", |app| app.footage().picture().is_some_and(Result::is_ok));
}

#[test]
fn without_footage_the_pane_says_so() {
    let folder = crate::temporary();
    let mut project = clay::project(folder.path(), clay::environments(folder.path()));
    project.settings.shoot.poses.clear();
    let mut window = window(|ctx| StudioApp::over(ctx, project, clay::source));
    until(&mut window, "panoramas", |app| app.environments().iter().all(|e| e.panorama.is_done()));
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(2);
    window.get_by_label("Footage").click();
    window.run_steps(2);
    window.get_by_label("There is no footage");
    until_shown(&mut window);
    let places = lines_with(&window, "project.toml", 370.0, 910.0);
    snapshot_without(&mut window, "studio_footage_empty", &places);
}

/// A project from a shoot without mattes of its interview, with the brush active.
fn painting(folder: &std::path::Path) -> (Project, Window) {
    let shoot = TestShoot { size: 64, ..TestShoot::default() };
    let project = shoot.import(folder, "film");
    std::fs::remove_dir_all(folder.join("shoot/interview_masks")).unwrap();
    let mut window = footage(&project);
    window.key_press(Key::M);
    until(&mut window, "matte", |app| matches!(app.matte().live(0), Some(Ok(_))) && !app.matte().is_seeking());
    (project, window)
}

#[test]
fn strokes_change_the_shown_matte_are_kept_undone_and_used_for_all_mattes() {
    let folder = crate::temporary();
    let (project, mut window) = painting(folder.path());
    let kept = || Strokes::load(&project).unwrap().strokes;
    let red = |window: &Window| window.query_by_label_contains("Red is removed").is_some();
    window.run_steps(2);
    assert!(red(&window));
    let middle = window.get_by_label("Matte brush").rect().center();
    plain_drag(&mut window, middle, middle + vec2(60.0, 20.0));
    until(&mut window, "saved stroke", |app| app.matte().is_saved());
    let first = kept();
    assert_eq!(first.len(), 1);
    assert_eq!((first[0].frame, first[0].side), (0, BrushSide::Keep));
    assert!(first[0].points.len() > 3, "{first:?}");
    until(&mut window, "new matte", |app| !app.matte().is_seeking());
    // The right button paints the opposite side; an undo step is a single stroke.
    drag(
        &mut window,
        middle + vec2(-90.0, -60.0),
        middle + vec2(-90.0, 30.0),
        PointerButton::Secondary,
        Modifiers::NONE,
    );
    until(&mut window, "saved stroke", |app| app.matte().is_saved());
    assert_eq!(kept()[1].side, BrushSide::Remove);
    window.get_by_label_contains("Strokes on frame 0.");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    until(&mut window, "undone stroke", |app| app.matte().is_saved());
    assert_eq!(kept(), first);
    // Shortcuts of the brush.
    let radius = |window: &Window| window.state().matte().radius((64, 64));
    let before = radius(&window);
    window.key_press(Key::CloseBracket);
    window.key_press(Key::X);
    window.run_steps(2);
    assert!(radius(&window) > before);
    assert_eq!(window.state().matte().side, BrushSide::Remove);
    until(&mut window, "matte of the first stroke", |app| !app.matte().is_seeking());
    snapshot(&mut window, "studio_footage_matte");
    window.get_by_label("Make all mattes").click();
    until(&mut window, "mattes", |_| (0..3).all(|frame| project.frame_matte_path(frame).is_file()));
    until(&mut window, "end of the job", |app| app.status().job.is_none());
    window.get_by_label("Clear this frame").click();
    window.run_steps(2);
    until(&mut window, "no strokes", |app| app.matte().is_saved());
    assert!(kept().is_empty() && !Strokes::path(&project).exists());

    // A folder takes the place of the strokes file: the save key must not report success.
    std::fs::create_dir_all(Strokes::path(&project).join("in the way")).unwrap();
    plain_drag(&mut window, middle, middle + vec2(60.0, 20.0));
    until(&mut window, "refusal", |app| app.status().refusal.is_some());
    assert_is_unsaved(&mut window);
}

#[test]
fn a_matte_that_cannot_be_painted_says_why() {
    let folder = crate::temporary();
    let project = imported(folder.path());
    let mut window = footage(&project);
    window.get_by_label("Paint matte").click();
    window.run_steps(2);
    window.get_by_label_contains("The shoot has its own matte for this frame");
    assert!(window.query_by_label("Matte brush").is_none());
    window.get_by_label("Poses").click();
    window.run_steps(2);
    window.get_by_label("Show the interview").click();
    window.run_steps(2);
    assert!(!window.state().state().footage.exemplars);
    window.get_by_label("Framing").click();
    window.run_steps(2);
    window.get_by_label("Framing square");

    // Without a green screen, the message says what to paint.
    let folder = crate::temporary();
    let project = TestShoot::default().import(folder.path(), "film");
    std::fs::remove_dir_all(folder.path().join("shoot/interview_masks")).unwrap();
    let grey = image::RgbImage::from_pixel(32, 32, image::Rgb([120; 3]));
    grey.save(project.frame_picture(0).file()).unwrap();
    let mut window = footage(&project);
    window.key_press(Key::M);
    until(&mut window, "reason", |app| matches!(app.matte().live(0), Some(Err(_))));
    window.get_by_label_contains("paint what to keep");
    window.get_by_label("Matte brush");
}
