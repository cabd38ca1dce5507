//! Statements about whole shoots and about the light in them.

use super::dome::Dome;
use super::grid::Grid;
use super::motion::{Pose, exemplar_poses, interview};
use super::picture::{self, Pictures, Request};
use super::subject::Subject;
use super::transport::Effort;
use super::trouble::Look;
use super::{StageSettings, TroubleSettings, plate, write_shoot};
use base::progress::{Control, Progress};
use glam::Vec3;
use imaging::Image;
use imaging::color::luminance;
use imaging::file::{read_encoded, read_linear, read_mask};
use std::path::{Path, PathBuf};

mod shipped;
mod trouble;

const SMALL: StageSettings = StageSettings {
    shipped: false,
    poses: 6,
    like_frames: Vec::new(),
    plate: None,
    frames: 2,
    size: 32,
    seed: 7,
    lamps: 6,
    written_as: crate::WrittenAs::Files,
    trouble: TroubleSettings::NONE,
};

/// The pictures of a pose.
fn take(dome: &Dome, pose: &Pose, size: usize, request: &Request, effort: Effort) -> Pictures {
    let grid = Grid::bake(&Subject::new(pose, &request.look));
    picture::take(dome, pose, &grid, (size, size), request, effort)
}

/// Names and contents of all files in a folder.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let read = |file: PathBuf| (file.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&file).unwrap());
    test_support::files(folder).into_iter().map(read).collect()
}

fn write(settings: &StageSettings) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let report = write_shoot(folder.path(), settings, &Progress::silent()).unwrap();
    assert_eq!(report.files, contents(folder.path()).len());
    assert!(report.effects.iter().all(|e| (0.0..=1.0).contains(&e.share)));
    folder
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_files_and_another_one_others() {
    let (a, b) = (write(&SMALL), write(&SMALL));
    assert!(contents(a.path()) == contents(b.path()), "two runs of one seed differ");
    let other = write(&StageSettings { seed: 8, ..SMALL });
    assert!(contents(a.path()) != contents(other.path()));
}

#[test]
fn a_pose_like_a_frame_shows_what_the_frame_shows() {
    let folder = write(&StageSettings { poses: 1, like_frames: vec![1, 0], ..SMALL });
    let truth = json(&folder.path().join("truth.json"));
    let poses = truth["poses"].as_array().unwrap();
    assert_eq!(poses.len(), 3);
    assert_eq!(poses[0]["yaw"], 0.0);
    let frames = interview(SMALL.frames, SMALL.seed);
    for (pose, frame) in poses[1..].iter().zip([frames[1], frames[0]]) {
        assert_eq!(pose["yaw"].as_f64().unwrap() as f32, frame.yaw);
    }
    let mask = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(mask("exemplar_masks/pose01.png"), mask("interview_masks/frame_001.png"));
    let refused = StageSettings { like_frames: vec![2], ..SMALL };
    let sentence = refused.check().unwrap_err().to_string();
    assert!(sentence.contains("no frame 2"), "{sentence}");
}

#[test]
fn a_shoot_is_complete_and_its_manifest_tells_so() {
    let folder = write(&SMALL);
    let manifest = json(&folder.path().join("manifest.json"));
    assert_eq!(manifest["resolution"], serde_json::json!([32, 32]));
    let number = |key: &str| manifest[key].as_u64().unwrap() as usize;
    assert_eq!((number("frames"), number("exemplar_poses"), number("olat_conditions")), (2, 6, 6));
    assert_eq!(manifest["bank_directions"].as_array().unwrap().len(), 6);
    assert_eq!(manifest["lamp_bank"].as_array().unwrap().len(), number("lamps_total"));
    assert_eq!(manifest["probes"]["ball_center_px"], serde_json::json!([16.0, 16.0]));
    let picture = |name: &str| {
        let read = read_encoded(&folder.path().join(name)).unwrap();
        assert_eq!(read.0.size(), (32, 32), "{name}");
    };
    for bank in 0..6 {
        (0..6).for_each(|pose| picture(&format!("exemplars/pose{pose:02}/olat_{bank:02}.png")));
        picture(&format!("probes/olat_{bank:02}.png"));
    }
    picture("probes/interview.png");
    for frame in 0..2 {
        picture(&format!("interview/frame_{frame:03}.png"));
        let mask = read_mask(&folder.path().join(format!("interview_masks/frame_{frame:03}.png"))).unwrap();
        let covered = mask.pixels.iter().sum::<f32>() / 1024.0;
        assert!((0.2..0.8).contains(&covered), "the subject fills {covered} of the picture");
    }
    for hdri in manifest["hdris"].as_array().unwrap() {
        assert_eq!(read_linear(&folder.path().join(hdri["file"].as_str().unwrap())).unwrap().size(), (256, 128));
        let name = hdri["name"].as_str().unwrap();
        read_linear(&folder.path().join(format!("truth/pose00_relit_{name}.exr"))).unwrap();
    }
}

#[test]
fn the_interview_is_the_weighted_sum_of_the_banks() {
    let folder = write(&SMALL);
    let truth = json(&folder.path().join("truth.json"));
    let frame = truth["truth_frames"][0].as_u64().unwrap();
    let number = |key: &str| truth[key].as_f64().unwrap() as f32;
    let weight = |b: usize| truth["weights_linear_interview_per_olat"][b][0].as_f64().unwrap() as f32;
    let at = |b: usize| folder.path().join(format!("truth/frame_{frame:03}_olat/olat_{b:02}.exr"));
    let banks: Vec<Image> = (0..6).map(|b| read_linear(&at(b)).unwrap()).collect();
    let response = imaging::DualGamma { gamma1: number("g1"), gamma2: number("g2") };
    let plate = response.decode(&read_encoded(&folder.path().join(format!("interview/frame_{frame:03}.png"))).unwrap());
    let mask = read_mask(&folder.path().join(format!("interview_masks/frame_{frame:03}.png"))).unwrap();
    let mut compared = 0;
    for (i, _) in mask.pixels.iter().enumerate().filter(|(_, c)| **c == 1.0) {
        for channel in 0..3 {
            let sum: f32 = (0..6).map(|b| weight(b) * number("exposure_olat") * banks[b].pixels[i][channel]).sum();
            let seen = plate.pixels[i][channel];
            // Five standard deviations of the sensor's noise, and half a code of eight bits.
            let bound = 0.015 * sum.sqrt() + 3e-4 + 0.6 / 255.0 * 2.6 * sum.powf(0.55);
            assert!(sum > 0.9 || (seen - sum).abs() < bound, "pixel {i}: {seen} instead of {sum}");
            compared += 1;
        }
    }
    assert!(compared > 600);
}

#[test]
fn what_is_left_out_would_not_have_changed_the_picture() {
    let dome = Dome::new(12);
    let weights = vec![[1.0; 3]; dome.lamps.len()];
    let request = Request { banks: true, sums: &[&weights], ..Request::default() };
    let pose = exemplar_poses()[3];
    let thrifty = take(&dome, &pose, 40, &request, Effort::Needed);
    let forced = take(&dome, &pose, 40, &request, Effort::Everything);
    assert!(thrifty.tally.shadow_rays < forced.tally.shadow_rays);
    assert!(thrifty.tally.subsurface < forced.tally.subsurface / 3);
    for (a, b) in thrifty.banks.iter().chain(&thrifty.sums).zip(forced.banks.iter().chain(&forced.sums)) {
        for (a, b) in a.pixels.iter().flatten().zip(b.pixels.iter().flatten()) {
            // Only rounding differs: the same terms, some of them exact zeros.
            assert!((a - b).abs() <= 1e-6 * (1.0 + b.abs()), "{a} and {b}");
        }
    }
    // The sum of all banks is the light of all lamps.
    for (i, all) in thrifty.sums[0].pixels.iter().enumerate() {
        let sum: f32 = thrifty.banks.iter().map(|bank| bank.pixels[i][1]).sum();
        assert!((sum - all[1]).abs() < 1e-5 * (1.0 + sum));
    }
}

#[test]
fn a_lamp_in_front_lights_the_face_and_one_behind_leaves_it_dark() {
    let dome = Dome::new(41);
    let pictures = take(&dome, &Pose::default(), 48, &Request { banks: true, ..Request::default() }, Effort::Needed);
    let bank = |towards: Vec3| {
        let cosine = |i: &usize| dome.banks[*i].dot(towards);
        (0..dome.banks.len()).max_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap()
    };
    // The cheeks, on both sides of the nose, slightly below the middle of the picture.
    let face = |bank: usize| luminance(pictures.banks[bank].at(21, 22)) + luminance(pictures.banks[bank].at(27, 22));
    let (front, behind) = (face(bank(Vec3::Z)), face(bank(Vec3::NEG_Z)));
    assert!(front > 0.005, "{front}");
    assert!(behind < 0.01 * front, "{behind} from behind, {front} from in front");
    let left = |bank: usize| luminance(pictures.banks[bank].at(20, 24)) / luminance(pictures.banks[bank].at(28, 24));
    assert!(left(bank(Vec3::NEG_X)) > 3.0 && left(bank(Vec3::X)) < 0.33, "sides are swapped");
}

#[test]
fn nothing_of_the_subject_reflects_more_than_it_receives() {
    let dome = Dome::new(41);
    let weights = vec![[1.0; 3]; dome.lamps.len()];
    let request = Request { banks: false, sums: &[&weights], ..Request::default() };
    let pictures = take(&dome, &Pose::default(), 48, &request, Effort::Needed);
    let brightest = pictures.sums[0].pixels.iter().flatten().copied().fold(0.0, f32::max);
    // Single lamps mirrored in eyes and gold stand out from the smooth sphere of light that they sample.
    assert!((0.3..2.0).contains(&brightest), "{brightest}");
}

#[test]
fn the_mouth_opens_and_the_lids_close() {
    let front = |pose: &Pose, x: f32, y: f32| {
        let subject = Subject::new(pose, &Look::default());
        let grid = Grid::bake(&subject);
        grid.approach(Vec3::new(x, y, 1.0), Vec3::NEG_Z, 0.0, 1e-4).map(|t| 1.0 - t)
    };
    let shut = Pose::default();
    let open = Pose { jaw: 1.0, ..shut };
    let lips = 0.024 - 0.0765;
    assert!(front(&open, 0.0, lips).unwrap() < front(&shut, 0.0, lips).unwrap() - 0.004);
    let part = |pose: &Pose| {
        let subject = Subject::new(pose, &Look::default());
        let mut z = 0.12;
        while subject.distance(Vec3::new(0.0315, 0.024, z)) > 2e-4 {
            z -= 1e-4;
        }
        subject.parts(Vec3::new(0.0315, 0.024, z)).0
    };
    assert_eq!(part(&shut), super::subject::Part::Eye);
    assert_eq!(part(&Pose { blink: 1.0, ..shut }), super::subject::Part::Skin);
}

#[test]
fn every_size_and_number_within_the_bounds_works() {
    for settings in [
        StageSettings { frames: 1, size: 16, seed: 0, lamps: 4, ..StageSettings::default() },
        StageSettings { frames: 3, size: 17, seed: u64::MAX, lamps: 12, ..StageSettings::default() },
    ] {
        let folder = write(&settings);
        assert_eq!(json(&folder.path().join("manifest.json"))["olat_conditions"], settings.lamps);
    }
}

#[test]
fn what_cannot_be_made_is_refused_with_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for (settings, word) in [
        (StageSettings { size: 15, ..SMALL }, "size"),
        (StageSettings { frames: 0, ..SMALL }, "frames"),
        (StageSettings { lamps: 3, ..SMALL }, "lamps"),
    ] {
        let error = write_shoot(folder.path(), &settings, &Progress::silent()).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("can have from"), "{error}");
    }
    assert!(contents(folder.path()).is_empty());
}

#[test]
fn a_stopped_shoot_has_no_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let cancel = Control::default();
    let stop = cancel.clone();
    let sink = move |_| stop.stop();
    let result = write_shoot(folder.path(), &SMALL, &Progress::new(&sink, cancel));
    assert!(matches!(result, Err(base::Error::Cancelled { .. })));
    assert!(!folder.path().join("manifest.json").exists());
}

#[test]
fn a_plate_is_what_the_camera_sees_with_other_edges() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, size: usize, plate| {
        let root = folder.path().join(name);
        let settings = StageSettings { frames: 1, size, lamps: 4, plate, ..StageSettings::default() };
        write_shoot(&root, &settings, &Progress::silent()).unwrap();
        root
    };
    let (square, tall) = (write("square", 40, None), write("tall", 16, Some((24, 40))));
    let mask = |root: &Path, file: &str| imaging::file::read_mask(&root.join(file)).unwrap();
    let [whole, part] = [&square, &tall].map(|root| mask(root, "interview_masks/frame_000.png"));
    assert_eq!((whole.size(), part.size()), ((40, 40), (24, 40)));
    let pairs = (0..40).flat_map(|y| (0..24).map(move |x| (x, y)));
    for (x, y) in pairs {
        assert!((part.at(x, y) - whole.at(x + 8, y)).abs() < 0.02, "{x}, {y}");
    }
    assert_eq!(mask(&tall, "exemplar_masks/pose00.png").size(), (16, 16));
    assert_eq!(mask(&tall, "interview/frame_000.png").size(), (24, 40));
    assert_eq!(plate("1080x1920"), Ok((1080, 1920)));
    assert!(plate("1080").is_err() && plate("axb").is_err());
    let large = StageSettings { plate: Some((8, 40)), ..StageSettings::default() };
    assert!(large.check().unwrap_err().to_string().contains("plate"));
}
