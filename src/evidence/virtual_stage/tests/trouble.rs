//! Properties of shoots with trouble; a shoot without trouble is unchanged.

use super::*;
use crate::ball::BallLight;
use crate::ball_view::Surroundings;
use crate::interview_light::InterviewLight;
use crate::probe::Probe;
use crate::room::Room;
use crate::trouble::Trouble;
use crate::{Hair, LightKind};
use chacha20::ChaCha8Rng;
use imaging::{Encoded, Mask};
use rand::SeedableRng;

/// A small shoot with trouble.
fn troubled(trouble: TroubleSettings) -> tempfile::TempDir {
    write(&StageSettings { trouble, ..SMALL })
}

const NONE: TroubleSettings = TroubleSettings::NONE;

fn truth(folder: &tempfile::TempDir) -> serde_json::Value {
    json(&folder.path().join("truth.json"))
}

fn picture(folder: &tempfile::TempDir, name: &str) -> Encoded {
    read_encoded(&folder.path().join(name)).unwrap()
}

/// A picture as linear light, decoded by the shoot's own dual gamma.
fn linear(folder: &tempfile::TempDir, name: &str) -> Image {
    let truth = truth(folder);
    let number = |key: &str| truth[key].as_f64().unwrap() as f32;
    let response = imaging::DualGamma { gamma1: number("g1"), gamma2: number("g2") };
    response.decode(&picture(folder, name))
}

/// Mean level over pixels.
fn mean(image: &Image, is_counted: impl Fn(usize, usize) -> bool) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for y in 0..image.height {
        for x in 0..image.width {
            if is_counted(x, y) {
                sum += luminance(image.at(x, y));
                count += 1;
            }
        }
    }
    sum / count as f32
}

#[test]
fn the_plain_stage_is_what_it_was() {
    // Mean codes of the stage's pictures before trouble was added. One code rounded differently by another machine's
    // libm moves a mean by 1 / 3072.
    let folder = write(&SMALL);
    let mut checked = Vec::new();
    for name in [
        "exemplars/pose00/olat_00",
        "exemplars/pose03/olat_02",
        "exemplars/pose05/olat_04",
        "interview/frame_001",
        "probes/interview",
        "probes/olat_01",
    ] {
        let codes = picture(&folder, &format!("{name}.png"));
        let sum: f32 = codes.0.pixels.iter().flatten().map(|v| 255.0 * v).sum();
        checked.push(sum / 3072.0);
    }
    let before = [27.1172, 11.1989, 20.1999, 106.5973, 30.8880, 12.6416];
    for (now, before) in checked.iter().zip(before) {
        let off: f32 = now - before;
        assert!(off.abs() < 0.005, "{checked:?} instead of {before}");
    }
    assert!(truth(&folder).get("trouble").is_none());
}

#[test]
fn drawn_trouble_is_the_same_for_the_same_seed_and_a_setting_changes_only_itself() {
    let all = TroubleSettings { trouble: true, ..NONE };
    let (first, other) = (all.resolve(3), all.resolve(4));
    assert_eq!(first, all.resolve(3));
    assert_ne!(first, other);
    let set = TroubleSettings { exposure_change: Some(1.5), ..all };
    let mut expected = first;
    expected.exposure_change = 1.5;
    assert_eq!(set.resolve(3), expected);
    assert_eq!(NONE.resolve(3), Trouble::default());
    let shoots = [3, 3].map(|seed| write(&StageSettings { seed, trouble: all, ..SMALL }));
    assert!(contents(shoots[0].path()) == contents(shoots[1].path()));
    let said = &truth(&shoots[0])["trouble"];
    assert_eq!(said["interview_light"], serde_json::to_value(first.interview_light).unwrap());
    let response = serde_json::to_string(&first.response).unwrap();
    assert_eq!(said["response"], serde_json::from_str::<serde_json::Value>(&response).unwrap());
}

#[test]
fn seeds_draw_every_kind_of_trouble() {
    let all = TroubleSettings { trouble: true, ..NONE };
    let drawn: Vec<_> = (0..200).map(|seed| all.resolve(seed)).collect();
    let count = |is: &dyn Fn(&Trouble) -> bool| drawn.iter().filter(|t| is(t)).count();
    for light in [LightKind::Banks, LightKind::Lamps, LightKind::Window, LightKind::Softboxes] {
        assert!(count(&|t| t.interview_light == light) > 20, "{light:?}");
    }
    assert!((20..80).contains(&count(&|t| t.exposure_change != 1.0)));
    assert!((50..150).contains(&count(&|t| t.jpeg.is_some())));
    assert!(count(&|t| t.look.skin > Some(0.8)) > 20 && count(&|t| t.look.skin < Some(0.2)) > 20);
}

#[test]
fn other_light_is_no_sum_of_the_banks_and_a_tint_is() {
    let off_span = |trouble| truth(&troubled(trouble))["trouble"]["off_span"].as_f64().unwrap();
    let tinted = off_span(TroubleSettings { tint: Some([1.3, 1.0, 0.6]), ..NONE });
    assert!(tinted < 1e-3, "{tinted}");
    for light in [LightKind::Lamps, LightKind::Window, LightKind::Softboxes] {
        let other = off_span(TroubleSettings { interview_light: Some(light), ..NONE });
        assert!(other > 0.02, "{light:?}: {other}");
    }
    let ambient = off_span(TroubleSettings { ambient: Some(0.5), ..NONE });
    assert!(ambient > 20.0 * tinted.max(1e-5), "{ambient} and {tinted}");
}

#[test]
fn a_changed_exposure_shows_on_the_subject_and_not_on_the_ball() {
    let change = 1.6;
    let folder = troubled(TroubleSettings { exposure_change: Some(change), noise: Some(0.0), ..NONE });
    let truth = truth(&folder);
    let interview = linear(&folder, "probes/interview.png");
    let mut sum = vec![0.0; interview.pixels.len()];
    for bank in 0..6 {
        let weight = &truth["weights_linear_interview_per_olat"][bank][0];
        let olat = linear(&folder, &format!("probes/olat_{bank:02}.png"));
        for (sum, pixel) in sum.iter_mut().zip(&olat.pixels) {
            *sum += weight.as_f64().unwrap() as f32 * pixel[0];
        }
    }
    // Where the ball is bright, the subject's weights are too high by the exposure change.
    let (mut seen, mut weighted) = (0.0, 0.0);
    for (pixel, sum) in interview.pixels.iter().zip(&sum).filter(|(p, _)| p[0] > 0.05) {
        seen += pixel[0];
        weighted += sum;
    }
    assert!((weighted / seen / change - 1.0).abs() < 0.03, "{}", weighted / seen);
}

#[test]
fn the_camera_has_the_response_that_was_asked_for() {
    let folder = troubled(TroubleSettings { response: Some("1.4,2.9".parse().unwrap()), ..NONE });
    let number = |key: &str| truth(&folder)[key].as_f64().unwrap() as f32;
    assert_eq!((number("g1"), number("g2")), (1.4, 2.9));
    let log = troubled(TroubleSettings { response: Some("log,40".parse().unwrap()), ..NONE });
    let trouble = &truth(&log)["trouble"];
    assert_eq!(trouble["response"]["log"], 40.0);
    assert!(trouble["response_distance"].as_f64().unwrap() > 0.01);
    // Midtones are lifted.
    let codes = |folder: &tempfile::TempDir| {
        let codes = picture(folder, "interview/frame_001.png");
        codes.0.pixels.iter().flatten().sum::<f32>()
    };
    assert!(codes(&log) > 1.05 * codes(&write(&SMALL)));
}

#[test]
fn noise_and_jpeg_change_the_codes_and_not_the_light() {
    let plain = write(&SMALL);
    let name = "interview/frame_001.png";
    let before = mean(&linear(&plain, name), |_, _| true);
    for trouble in [TroubleSettings { noise: Some(4.0), ..NONE }, TroubleSettings { jpeg: Some(80), ..NONE }] {
        let folder = troubled(trouble);
        assert_ne!(picture(&plain, name), picture(&folder, name));
        let now = mean(&linear(&folder, name), |_, _| true);
        assert!((now / before - 1.0).abs() < 0.03, "{now} and {before}");
    }
}

#[test]
fn subjects_look_as_they_are_asked_to() {
    let dome = Dome::new(6);
    let weights = vec![[1.0; 3]; dome.lamps.len()];
    let taken = |look: Look, hand: f32| {
        let request = Request { sums: &[&weights], look, ..Request::default() };
        let pose = Pose { hand, ..Pose::default() };
        let taken = take(&dome, &pose, 64, &request, Effort::Needed);
        (taken.sums[0].clone(), taken.coverage)
    };
    let area = |mask: &Mask| mask.pixels.iter().sum::<f32>();
    let face = |x: usize, y: usize| (26..38).contains(&x) && (28..40).contains(&y);
    let usual = taken(Look::default(), 0.0);
    let tone = |skin: f32| {
        let look = Look { skin: Some(skin), ..Look::default() };
        mean(&taken(look, 0.0).0, face)
    };
    let (light, dark) = (tone(0.0), tone(1.0));
    assert!(light > mean(&usual.0, face) && dark < 0.45 * mean(&usual.0, face));
    let glasses = Look { glasses: true, ..Look::default() };
    let eyes = |x: usize, y: usize| (22..42).contains(&x) && (25..34).contains(&y);
    let chin = |x: usize, y: usize| (28..36).contains(&x) && (42..46).contains(&y);
    let spectacled = taken(glasses, 0.0).0;
    assert!(mean(&spectacled, eyes) < 0.97 * mean(&usual.0, eyes));
    assert!((mean(&spectacled, chin) / mean(&usual.0, chin) - 1.0).abs() < 0.01);
    let hair = |colour| Look { hair: Some(colour), ..Look::default() };
    let crown = |x: usize, y: usize| (26..38).contains(&x) && (12..16).contains(&y);
    let (black, blond) = (taken(hair(Hair::Black), 0.0).0, taken(hair(Hair::Blond), 0.0).0);
    assert!(mean(&blond, crown) > 4.0 * mean(&black, crown));
    let hands = Look { hands: true, ..Look::default() };
    let raised = taken(hands, 1.0);
    assert_eq!(taken(hands, 0.0).1, usual.1, "no hand is raised");
    let changed = (raised.0.pixels.iter().zip(&usual.0.pixels)).filter(|(a, b)| (a[1] - b[1]).abs() > 0.03).count();
    assert!((60..1200).contains(&changed), "{changed} pixels show the hand");
    assert!(area(&raised.1) >= area(&usual.1));
}

#[test]
fn a_subject_sways_while_the_lamps_go_round_and_tracking_frames_show_it() {
    let still = troubled(TroubleSettings { tracking: Some(3), ..NONE });
    let moved = troubled(TroubleSettings { sway: Some(6.0), tracking: Some(3), ..NONE });
    assert_eq!(json(&moved.path().join("manifest.json"))["tracking"]["before_lamp"], serde_json::json!([0, 3, 6]));
    let frames = |folder: &tempfile::TempDir, pose: usize| {
        [0, 1, 2].map(|k| picture(folder, &format!("tracking/pose{pose:02}/frame_{k:02}.png")))
    };
    for pose in 0..6 {
        let change = |folder| {
            let [a, b, _] = frames(folder, pose);
            let pairs = a.0.pixels.iter().flatten().zip(b.0.pixels.iter().flatten());
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f32>()
        };
        // Noise alone.
        assert!(change(&moved) > 4.0 * change(&still), "pose {pose}");
    }
    let sway = truth(&moved)["trouble"]["sway_px"].clone();
    assert_eq!(sway.as_array().unwrap().len(), 6);
    let far = |p: &serde_json::Value| {
        let at = |i: usize| p[i].as_f64().unwrap();
        at(0).hypot(at(1))
    };
    // Six pixels of 256 are 0.75 of 32; the path's farthest point need not coincide with a lamp.
    let farthest = sway.as_array().unwrap().iter().flat_map(|p| p.as_array().unwrap());
    let farthest = farthest.map(far).fold(0.0, f64::max);
    assert!((0.4..=0.76).contains(&farthest), "{farthest}");
    // Truth and matte show the still subject.
    let mask = "exemplar_masks/pose02.png";
    assert_eq!(read_mask(&moved.path().join(mask)).unwrap(), read_mask(&still.path().join(mask)).unwrap());
}

#[test]
fn a_grid_between_baked_moments_makes_the_picture_of_a_baked_one() {
    let dome = Dome::new(6);
    let look = Look { glasses: true, hair: Some(Hair::Brown), ..Look::default() };
    let request = Request { banks: true, look, ..Request::default() };
    let still = crate::motion::exemplar_poses()[1];
    let sway = crate::sway::Sway::draw(3.0, 5, 1);
    let bake = |pose: &Pose| Grid::bake(&Subject::new(pose, &look));
    let grids = sway.grids(&still, &look, bake(&still));
    let taken = |pose: &Pose, grid: &Grid| picture::take(&dome, pose, grid, (96, 96), &request, Effort::Needed).banks;
    let middle = taken(&still, &bake(&still));
    let difference = |a: &[Image], b: &[Image]| {
        let pixels =
            |images: &[Image]| -> Vec<[f32; 3]> { images.iter().flat_map(|image| image.pixels.clone()).collect() };
        let (a, b) = (pixels(a), pixels(b));
        let squares = a.iter().zip(&b).map(|(a, b)| (a[1] - b[1]).powi(2));
        (squares.sum::<f32>() / a.len() as f32).sqrt()
    };
    for time in [0.0, 0.3, 0.55, 1.0] {
        let pose = sway.pose(&still, time);
        let baked = taken(&pose, &bake(&pose));
        let between = taken(&pose, &grids.at(sway.face_m(time)));
        let (off, moved) = (difference(&baked, &between), difference(&baked, &middle));
        assert!(off < 0.05 * moved, "{time}: {off} of {moved}");
    }
}

#[test]
fn the_subject_sits_elsewhere_in_each_pose() {
    let dome = Dome::new(6);
    let weights = vec![[1.0; 3]; dome.lamps.len()];
    let request = Request { sums: &[&weights], ..Request::default() };
    let centre = |x: f32, y: f32| {
        let mut pose = Pose::default();
        (pose.seat.x, pose.seat.y) = (x, y);
        let covered = take(&dome, &pose, 64, &request, Effort::Needed).coverage;
        let top = (0..64).find(|&y| (0..64).any(|x| covered.at(x, y) > 0.5)).unwrap();
        let sum: f32 = (0..32 * 64).map(|i| covered.pixels[i] * (i % 64) as f32).sum();
        (sum / covered.pixels[..32 * 64].iter().sum::<f32>(), top)
    };
    let (usual, moved) = (centre(0.0, 0.0), centre(0.02, -0.02));
    // Two centimetres are 2.9 pixels of 64.
    assert!((moved.0 - usual.0 - 2.9).abs() < 0.5, "{moved:?} and {usual:?}");
    assert!((2..=4).contains(&(moved.1 - usual.1)), "{moved:?} and {usual:?}");
}

#[test]
fn the_ball_shows_dust_the_room_and_the_photographer() {
    let folder = |trouble| troubled(TroubleSettings { noise: Some(0.0), ..trouble });
    let ball = |folder: &tempfile::TempDir, name: &str| {
        let image = linear(folder, name);
        let density = truth(folder)["probe_neutral_density"].as_f64().unwrap() as f32;
        image.map(|p| p.map(|v| v / density))
    };
    let lamp = "probes/olat_03.png";
    // On the ball, which fills the middle; the median pixel is between the lamps.
    let dark = |image: &Image| {
        let inside = |i: &usize| {
            let (x, y) = (i % 32, i / 32);
            (x as f32 - 15.5).hypot(y as f32 - 15.5) < 13.0
        };
        let mut levels: Vec<f32> = (0..1024).filter(inside).map(|i| luminance(image.pixels[i])).collect();
        levels.sort_by(f32::total_cmp);
        levels[levels.len() / 2]
    };
    let plain = dark(&ball(&folder(NONE), lamp));
    for (what, trouble) in
        [("dust", TroubleSettings { dust: Some(0.3), ..NONE }), ("room", TroubleSettings { room: Some(0.3), ..NONE })]
    {
        let level = dark(&ball(&folder(trouble), lamp));
        assert!(level > 2.0 * plain, "{what}: {level} and {plain}");
    }
}

#[test]
fn the_photographer_hides_the_room_about_the_balls_middle() {
    let dome = Dome::new(6);
    let seen = |photographer| {
        let trouble = Trouble { ambient: 0.6, photographer, ..Trouble::default() };
        let room = Room::draw(&mut ChaCha8Rng::seed_from_u64(5));
        let light = InterviewLight::draw(&dome, &trouble, &room, None, 5);
        let surroundings = Surroundings { dome: &dome, light: &light, room: &room, trouble: &trouble };
        let by_room = BallLight { banks: vec![[0.0; 3]; 6], interview: 1.0 };
        Probe::trace(&dome, 128, Some(&surroundings)).image(&by_room, 0.0)
    };
    let (alone, hidden) = (seen(false), seen(true));
    // The trunk, left of the camera and below it, and the room on the right.
    let trunk = |x: usize, y: usize| (61..63).contains(&x) && (65..71).contains(&y);
    let right = |x: usize, y: usize| (70..90).contains(&x) && (50..60).contains(&y);
    let (with, without) = (mean(&hidden, trunk), mean(&alone, trunk));
    assert!(with < 0.2 * without, "{with} and {without}");
    assert_eq!(mean(&hidden, right), mean(&alone, right));
}

#[test]
fn bright_balls_clip() {
    let folder = troubled(TroubleSettings { ball_exposure: Some(4.0), ..NONE });
    let clipped = |folder: &tempfile::TempDir| {
        let codes = picture(folder, "probes/olat_02.png");
        codes.0.pixels.iter().flatten().filter(|v| **v == 1.0).count()
    };
    assert!(clipped(&folder) > 0 && clipped(&write(&SMALL)) == 0);
}

#[test]
fn impossible_trouble_is_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for (trouble, word) in [
        (TroubleSettings { ambient: Some(1.0), ..NONE }, "--ambient"),
        (TroubleSettings { exposure_change: Some(f32::NAN), ..NONE }, "--exposure-change"),
        (TroubleSettings { jpeg: Some(0), ..NONE }, "--jpeg"),
        (TroubleSettings { tint: Some([1.0, 0.0, 1.0]), ..NONE }, "--tint"),
        (TroubleSettings { tracking: Some(0), ..NONE }, "--tracking"),
        (TroubleSettings { sway: Some(-1.0), ..NONE }, "--sway"),
    ] {
        let settings = StageSettings { trouble, ..SMALL };
        let error = write_shoot(folder.path(), &settings, &Progress::silent()).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("can be from"), "{error}");
    }
    assert!(contents(folder.path()).is_empty());
}
