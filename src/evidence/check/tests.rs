//! Reports on sound, faulty and hostile projects.

use super::*;
use calibration::rig_check::Fault;
use footage::{PoseMotion, SeenIn};
use imaging::Image;
use light::{Environment, Lighting};
use std::path::Path;
use std::sync::Arc;
use test_shoot::TestShoot;

fn checked(report: &CheckReport, subject: Subject) -> &Check {
    let found = report.checks.iter().find(|check| check.subject == subject);
    found.expect("every subject is reported")
}

/// The report of a project without environments.
fn report(project: &Project) -> CheckReport {
    Evidence::read(project, &Progress::silent()).unwrap().report(&[])
}

/// The report of a calibration alone.
fn judged(calibration: &Calibration, lit: &[LitEnvironment]) -> CheckReport {
    let evidence = Evidence { calibration: Ok(Some(calibration.clone())), pictures: None, frames: None };
    evidence.report(lit)
}

fn lit(radiance: Image) -> LitEnvironment {
    LitEnvironment {
        name: "test".to_owned(),
        environment: Arc::new(Environment::from_radiance("test", radiance)),
        lighting: Lighting::default(),
        yaw_deg: 0.0,
    }
}

/// A calibration without doubts, on a project too small to measure all of it.
fn sound(folder: &Path) -> (Project, Calibration) {
    let (project, mut sound) = TestShoot::default().calibrate(folder, "project");
    sound.rig_findings.clear();
    sound.rig_faults.clear();
    sound.clipped_pixels = 0;
    sound.filled_energy = 0.0;
    (sound.exposure, sound.blind_share) = (1.0, 0.02);
    sound.probe_residual = 0.01;
    sound.uncovered_energy = 0.01;
    for lamp in &mut sound.rig.lamps {
        (lamp.confidence, lamp.clipped) = (0.95, 0.0);
    }
    let evidence = &mut sound.gamma_evidence;
    evidence.better_curve = None;
    evidence.cases.truncate(1);
    sound.motion = Some(footage::Motion {
        seen_in: SeenIn::Olats,
        lamps: vec![],
        poses: vec![PoseMotion {
            pose: "pose00".into(),
            largest_px: 0.1,
            deviation_px: 0.2,
            corrected: false,
            shifts: vec![],
        }],
    });
    let evidence = &mut sound.gamma_evidence;
    for interval in &mut evidence.intervals {
        (interval.gamma1, interval.gamma2) = ([2.4, 2.5], [1.9, 2.0]);
    }
    (project, sound)
}

#[test]
fn each_doubt_turns_its_own_check() {
    let folder = tempfile::tempdir().unwrap();
    let (_, sound) = sound(folder.path());
    let level = |subject, change: &dyn Fn(&mut Calibration)| {
        let mut changed = sound.clone();
        change(&mut changed);
        let report = judged(&changed, &[]);
        let check = checked(&report, subject);
        assert_eq!(check.level == Level::Good, check.remedy.is_none(), "{check:?}");
        assert!(!check.sentence.is_empty());
        check.level
    };
    let found = |fault, sentence: &str| {
        let sentence = sentence.to_owned();
        move |c: &mut Calibration| {
            c.rig_faults.push(fault);
            c.rig_findings.push(sentence.clone());
        }
    };
    for subject in [
        Subject::LampsSeen,
        Subject::LampsAgree,
        Subject::LampsClipped,
        Subject::LampsHidden,
        Subject::Response,
        Subject::InterviewLight,
        Subject::Motion,
    ] {
        assert_eq!(level(subject, &|_| ()), Level::Good, "{subject:?}");
    }
    use Level::{Bad, Doubtful, Unknown};
    use Subject::*;
    let moving =
        |change: fn(&mut PoseMotion)| move |c: &mut Calibration| change(&mut c.motion.as_mut().unwrap().poses[0]);
    assert_eq!(level(Motion, &moving(|p| p.corrected = true)), Doubtful);
    assert_eq!(level(Motion, &moving(|p| p.largest_px = f32::NAN)), Unknown);
    assert_eq!(level(Motion, &|c| c.motion = None), Unknown);
    assert_eq!(level(LampsSeen, &|c| c.rig.lamps[1].confidence = 0.0), Bad);
    let dark = found(Fault::Dark, "olat_01: dark. Check the lamp");
    assert_eq!(level(LampsSeen, &dark), Doubtful);
    assert_eq!(level(LampsAgree, &|c| c.rig.lamps[1].confidence = 0.4), Doubtful);
    let doubt_all = |c: &mut Calibration| c.rig.lamps.iter_mut().for_each(|l| l.confidence = 0.4);
    assert_eq!(level(LampsAgree, &doubt_all), Bad);
    let same = found(Fault::SameLamp, "olat_01, olat_02 show the same lamp. Check it");
    assert_eq!(level(LampsAgree, &same), Bad);
    // A file of an older version has findings of unknown kinds.
    assert_eq!(level(LampsAgree, &|c| c.rig_findings.push("odd. Check it".into())), Doubtful);
    assert_eq!(level(LampsClipped, &|c| c.clipped_pixels = 3), Doubtful);
    assert_eq!(level(LampsClipped, &|c| c.rig.lamps[0].clipped = 0.6), Bad);
    assert_eq!(level(LampsHidden, &|c| c.filled_energy = 0.05), Doubtful);
    assert_eq!(level(LampsHidden, &|c| c.filled_energy = 0.3), Bad);
    assert_eq!(level(InterviewLight, &|c| c.probe_residual = 0.08), Doubtful);
    assert_eq!(level(InterviewLight, &|c| c.uncovered_energy = 0.5), Bad);
    assert_eq!(level(InterviewLight, &|c| c.probe_residual = f32::NAN), Unknown);
    assert_eq!(level(Response, &|c| c.gamma_evidence.by_hand = true), Unknown);
    let wide = |width: f32| {
        move |c: &mut Calibration| {
            let intervals = c.gamma_evidence.intervals.iter_mut();
            intervals.for_each(|i| i.gamma1 = [2.4 - width, 2.4 + width]);
        }
    };
    assert_eq!(level(Response, &wide(0.3)), Doubtful);
    assert_eq!(level(Response, &wide(0.9)), Bad);
    assert_eq!(level(Response, &wide(f32::NAN)), Unknown);
    let unstated = |c: &mut Calibration| {
        c.gamma_evidence.intervals.clear();
        c.gamma_deviation = [0.0; 2];
    };
    assert_eq!(level(Response, &unstated), Unknown);
    let second = |probability: f32, apart: f32| {
        move |c: &mut Calibration| {
            let mut first = c.gamma_evidence.cases[0];
            first.probability = 1.0 - probability;
            let mut other = first;
            (other.probability, other.gamma1) = (probability, first.gamma1 + apart);
            c.gamma_evidence.cases = vec![first, other];
        }
    };
    assert_eq!(level(Response, &second(0.1, 1.0)), Doubtful);
    assert_eq!(level(Response, &second(0.4, 1.0)), Bad);
    assert_eq!(level(Response, &second(0.01, 1.0)), Level::Good);
    assert_eq!(level(Response, &|c| c.exposure = 1.4), Doubtful);
    assert_eq!(level(Response, &|c| c.probe_residual = 0.08), Doubtful);
    assert_eq!(level(Response, &|c| c.uncovered_energy = 0.5), Bad);
    assert_eq!(level(Response, &|c| c.probe_residual = f32::NAN), Unknown);
    let hidden = found(Fault::BehindBall, "olat_01: hidden. Check it");
    assert_eq!(level(LampsHidden, &hidden), Level::Good, "a small part is not a doubt");
}

#[test]
fn nothing_is_green_before_it_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let project = TestShoot::default().import(folder.path(), "project");
    let evidence = Evidence::read(&project, &Progress::silent()).unwrap();
    let report = evidence.report(&[lit(Image::filled(8, 4, [1.0; 3]))]);
    assert_eq!((report.level, report.checks.len()), (Level::Unknown, 13));
    for check in &report.checks {
        assert_eq!(check.level, Level::Unknown);
        assert!(check.remedy.as_ref().unwrap().contains("Calibrate the project"));
    }
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["level"], "unknown");
    assert_eq!(json["checks"][0]["subject"], "lamps-seen");
    assert_eq!(json["checks"][11]["environment"], "test");
}

#[test]
fn hostile_projects_are_named_and_not_green() {
    let folder = tempfile::tempdir().unwrap();
    let (project, sound) = sound(folder.path());
    sound.save(&project).unwrap();
    assert_ne!(checked(&report(&project), Subject::Frames).sentence, "");

    let frame = project.frame_picture(1);
    let kept = std::fs::read(&frame).unwrap();
    std::fs::write(&frame, b"not a picture").unwrap();
    let broken = report(&project);
    let check = checked(&broken, Subject::Frames);
    assert_eq!(check.level, Level::Unknown);
    assert!(check.sentence.contains("frame_001.png"), "{}", check.sentence);
    assert_eq!(checked(&broken, Subject::LampsSeen).level, Level::Good, "the rest is checked");
    std::fs::write(&frame, kept).unwrap();

    let mut without = project.clone();
    without.settings.shoot.frames = vec![].into();
    assert_eq!(checked(&report(&without), Subject::Frames).level, Level::Unknown);
    let mut moved = project.clone();
    moved.settings.shoot.folder = "elsewhere".into();
    assert_eq!(checked(&report(&moved), Subject::Frames).level, Level::Unknown);

    let path = project.calibration_path();
    let text = std::fs::read_to_string(&path).unwrap();
    // Without the checksum, like a file of an older version.
    let text = text.split_once('\n').unwrap().1;
    let spoilt = text.replace("probe_residual = 0.01", "probe_residual = nan");
    assert_ne!(text, spoilt);
    std::fs::write(&path, spoilt).unwrap();
    assert_eq!(checked(&report(&project), Subject::InterviewLight).level, Level::Unknown);
    std::fs::write(&path, "gamma1 = \"none\"").unwrap();
    let damaged = report(&project);
    assert!(damaged.checks.iter().all(|check| check.level == Level::Unknown));
    assert!(damaged.checks[0].sentence.contains("calibration.toml"));

    let mut unlit = sound.clone();
    unlit.rig.lamps.iter_mut().for_each(|lamp| lamp.confidence = 0.0);
    let report = judged(&unlit, &[lit(Image::filled(8, 4, [1.0; 3]))]);
    assert_eq!(checked(&report, Subject::Coverage).level, Level::Unknown);
    assert_eq!(report.level, Level::Bad);
}

#[test]
fn a_stop_ends_the_look() {
    let folder = tempfile::tempdir().unwrap();
    let (project, sound) = sound(folder.path());
    sound.save(&project).unwrap();
    let control = base::progress::Control::default();
    control.stop();
    let stopped = Evidence::read(&project, &Progress::new(&|_| {}, control));
    assert!(matches!(stopped, Err(Error::Cancelled { .. })));
}

#[test]
fn a_frame_of_something_else_is_unlike_every_pose() {
    let folder = tempfile::tempdir().unwrap();
    let (project, sound) = sound(folder.path());
    sound.save(&project).unwrap();
    let frame = project.frame_picture(2);
    let picture = image::open(&frame).unwrap();
    // Upside down, the subject covers area that is empty in the poses.
    picture.flipv().save(&frame).unwrap();
    let mask = project.frame_matte(2);
    image::open(&mask).unwrap().flipv().save(&mask).unwrap();
    let report = report(&project);
    let check = checked(&report, Subject::Frames);
    assert!(matches!(check.level, Level::Doubtful | Level::Bad), "{check:?}");
    assert!(check.sentence.contains(&*project.settings.shoot.frames.name(2)), "{check:?}");
    // The estimate of confidence says the same.
    let silent = Progress::silent();
    let said = confidence::confidence(&project, &Default::default(), &silent).unwrap();
    let unlike: Vec<usize> = said.unlike().iter().map(|frame| frame.frame).collect();
    assert_eq!(unlike, [2], "{}", said.sentence());
    assert_eq!(checked(&self::report(&project), Subject::Frames), check);
}

#[test]
fn frames_or_poses_without_a_subject_are_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let (project, sound) = sound(folder.path());
    sound.save(&project).unwrap();
    let shoot = &project.settings.shoot;
    let empty = |mattes: Vec<std::path::PathBuf>| {
        let kept: Vec<_> = mattes.iter().map(|matte| std::fs::read(matte).unwrap()).collect();
        for matte in &mattes {
            let (width, height) = image::image_dimensions(matte).unwrap();
            image::GrayImage::new(width, height).save(matte).unwrap();
        }
        let check = checked(&report(&project), Subject::Frames).clone();
        mattes.iter().zip(kept).for_each(|(matte, kept)| std::fs::write(matte, kept).unwrap());
        (check.level, check.sentence)
    };
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_matte(frame).file().to_owned());
    let (level, sentence) = empty(frames.collect());
    assert!(level == Level::Unknown && sentence.starts_with("No frame shows"), "{sentence}");
    let poses = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose).file().to_owned());
    let (level, sentence) = empty(poses.collect());
    assert!(level == Level::Unknown && sentence.starts_with("No pose shows"), "{sentence}");
}

#[test]
fn a_matte_of_one_value_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (project, sound) = sound(folder.path());
    sound.save(&project).unwrap();
    assert_eq!(checked(&report(&project), Subject::Mattes).level, Level::Good);
    let [frame, pose] = [project.frame_matte(1), project.exemplar_matte(0)];
    for (matte, value, says) in [(&frame, 0, "nothing"), (&pose, 255, "the whole picture")] {
        let kept = std::fs::read(matte.file()).unwrap();
        let mut picture = image::open(matte.file()).unwrap().to_luma8();
        picture.pixels_mut().for_each(|pixel| pixel.0 = [value]);
        picture.save(matte.file()).unwrap();
        let report = report(&project);
        let check = checked(&report, Subject::Mattes);
        assert_eq!(check.level, Level::Doubtful, "{check:?}");
        let name = matte.file().file_name().unwrap().to_str().unwrap();
        assert!(check.sentence.contains(name) && check.sentence.contains(says), "{check:?}");
        assert!(check.remedy.is_some());
        std::fs::write(matte.file(), kept).unwrap();
    }
}

#[test]
fn a_sun_is_harder_than_the_lamps_and_an_even_sky_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let (_, mut sound) = sound(folder.path());
    // A stage of 41 equal lamps, evenly spaced on a spiral.
    let lamp = sound.rig.lamps[0].clone();
    let spiral = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f32 / 41.0;
        let (sin, cos) = (2.399_963 * i as f32).sin_cos();
        let across = (1.0 - y * y).sqrt();
        glam::Vec3::new(across * cos, y, across * sin)
    };
    let lamps =
        (0..41).map(|i| light::Lamp { direction: spiral(i), energy: [1.0; 3], spread_deg: 6.0, ..lamp.clone() });
    sound.rig.lamps = lamps.collect();
    let sky = Image::filled(256, 128, [1.0; 3]);
    let mut sun = sky.clone();
    (60..62).for_each(|x| sun.pixels[40 * 256 + x] = [2e5; 3]);
    let level = |radiance: &Image| {
        let report = judged(&sound, &[lit(radiance.clone())]);
        checked(&report, Subject::Contrast).level
    };
    assert_eq!((level(&sky), level(&sun)), (Level::Good, Level::Bad));
}

#[test]
fn light_where_no_lamp_is_is_uncovered() {
    let folder = tempfile::tempdir().unwrap();
    let (_, mut above) = sound(folder.path());
    // Lamps in a ring above the subject.
    for (i, lamp) in above.rig.lamps.iter_mut().enumerate() {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / 6.0).sin_cos();
        lamp.direction = glam::Vec3::new(0.5 * cos, 0.866, 0.5 * sin).normalize();
        lamp.energy = [1.0; 3];
    }
    let half = |upper: bool| {
        lit(Image::from_fn(64, 32, |_, y| {
            let zenith = y < 4;
            [f32::from(u8::from(zenith == upper)); 3]
        }))
    };
    let level = |upper| checked(&judged(&above, &[half(upper)]), Subject::Coverage).level;
    assert_eq!((level(true), level(false)), (Level::Good, Level::Bad));
}

#[test]
fn brightness_beyond_half_floats_and_dark_that_is_lost_are_named() {
    let side = 4;
    let even = |value: f32| Image::filled(side, side, [value; 3]);
    let judge = |olats: [Image; 2], peak: f32, weights: [f32; 2]| {
        let mut peaks = olats.to_vec();
        peaks[1].pixels[5] = [peak; 3];
        let pose = pictures::Pose {
            mask: imaging::Mask::filled(side, side, 1.0),
            matte: "pose00.png".to_owned(),
            name: "pose00".to_owned(),
            shading: Default::default(),
            olats: olats.to_vec(),
            peaks,
        };
        let lit = lit(Image::filled(8, 4, [1.0; 3]));
        let weights = weights.map(|w| [w; 3]);
        environments::half_floats(&[pose], &weights, &[[1.0; 3]; 2], &lit)
    };
    let usual = judge([even(0.1), even(0.2)], 0.4, [1.0, 1.0]);
    assert_eq!(usual.level, Level::Good, "{usual:?}");
    let bright = judge([even(0.1), even(0.2)], 1e6, [1.0, 1.0]);
    assert_eq!(bright.level, Level::Bad, "{bright:?}");
    let near = judge([even(0.1), even(0.2)], 3e4, [1.0, 1.0]);
    assert_eq!(near.level, Level::Doubtful, "{near:?}");
    // The picture is lit only by a lamp too weak to store beside the others.
    let lost = judge([even(1e-10), even(0.2)], 0.4, [1e9, 0.0]);
    assert_eq!(lost.level, Level::Bad, "{lost:?}");
    let black = judge([even(0.0), even(0.0)], 0.0, [1.0, 1.0]);
    assert_eq!(black.level, Level::Unknown);
}

#[test]
fn the_plain_stage_is_green() {
    let folder = tempfile::tempdir().unwrap();
    // The balls of smaller pictures are too small for all lamps to be certain.
    let shoot = TestShoot { frames: 4, lamps: 41, size: 128, working_size: 64 };
    let (project, _) = shoot.calibrate(folder.path(), "project");
    let report = report(&project);
    assert_eq!(report.level, Level::Good, "{}", report.sentence());
    assert_eq!(report.checks.len(), 10);
}
