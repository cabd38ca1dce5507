use super::*;
use base::median::median;
use footage::{Exemplar, Frame};
use glam::Vec3;
use imaging::{DualGamma, Encoded, Image, Mask, Raster, Response, file};
use light::{Lamp, Rig};
use mirror_ball::MirrorBall;
use project::{Ball, Picture, Shoot};
use std::path::{Path, PathBuf};

mod kept;
mod listed;
mod real;
mod shared;
mod strange;

pub(super) use shared::shared_shoot;

/// Directions of a small dome and the brightness of each lamp during the interview.
fn dome() -> Vec<(Vec3, f32)> {
    (0..14)
        .map(|i| {
            let (y, turn) = (0.95 - 0.125 * i as f32, i as f32 * 2.399_963);
            let direction = Vec3::new((1.0 - y * y).sqrt() * turn.sin(), y, (1.0 - y * y).sqrt() * turn.cos());
            (direction, 0.1 + 0.05 * ((i * 5) % 7) as f32)
        })
        .collect()
}

/// Writes a shoot under [`dome`] of a white ball with coloured spots that rotates between poses.
pub(super) fn small_shoot(root: &Path, response: &DualGamma) -> Project {
    const SIZE: usize = 96;
    let ball = Ball { center_px: [48.0, 48.0], radius_px: 42.0, radius_m: 0.075, camera_distance_m: 4.0 };
    let names = |what: &str, n: usize| (0..n).map(|i| format!("{what}{i:02}")).collect::<Vec<_>>();
    let lamps = dome();
    let mut project = Project::without_shoot(root);
    project.settings.size = 32;
    project.settings.shoot = Shoot {
        folder: PathBuf::from("shoot"),
        poses: names("pose", 4),
        lamps: names("olat_", lamps.len()),
        frames: names("frame_", 4).into(),
        ball,
        ..project.settings.shoot
    };
    let pictures = std::cell::Cell::new(0u32);
    let write = |picture: Picture, light: &Image| {
        // Eight bits with sensor dither: noise of half a code, different in every picture.
        let Encoded(codes) = response.encode(light);
        pictures.set(pictures.get() + 1);
        let mut seed = pictures.get().wrapping_mul(2_654_435_761);
        let dithered = codes.map(|pixel| {
            pixel.map(|v| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (v + ((seed >> 8) as f32 / 16_777_216.0 - 0.5) / 255.0).clamp(0.0, 1.0)
            })
        });
        file::write_png(picture.file(), &Encoded(dithered)).unwrap();
    };
    let sum = |pictures: &[Image]| {
        let mut sum = Image::filled(SIZE, SIZE, [0.0; 3]);
        for (picture, (_, weight)) in pictures.iter().zip(&lamps) {
            for (s, p) in sum.pixels.iter_mut().zip(&picture.pixels) {
                *s = [0, 1, 2].map(|c| s[c] + weight * p[c]);
            }
        }
        sum
    };
    // Lamps on the mirror ball have a bright middle and a soft edge.
    let geometry = MirrorBall::new(&ball, None, (SIZE, SIZE)).unwrap();
    let probes: Vec<Image> = lamps
        .iter()
        .map(|(direction, _)| {
            let mut picture = Image::filled(SIZE, SIZE, [0.0002; 3]);
            for pixel in &geometry.pixels {
                let glow = 0.8 * ((pixel.direction.dot(*direction) - 1.0) / 0.01).exp();
                picture.pixels[pixel.index] = [glow + 0.0002, 0.9 * glow + 0.0002, 0.7 * glow + 0.0002];
            }
            picture
        })
        .collect();
    write(project.interview_probe_picture(), &sum(&probes));
    for (i, probe) in probes.iter().enumerate() {
        write(project.lamp_probe_picture(i), probe);
    }
    let subject = |turn: f32, direction: Vec3| {
        Image::from_fn(SIZE, SIZE, |x, y| {
            let (dx, dy) = ((x as f32 - 47.5) / 44.0, (47.5 - y as f32) / 44.0);
            let n = Vec3::new(dx, dy, (1.0 - dx * dx - dy * dy).max(0.0).sqrt());
            let spots = 0.5 + 0.5 * (9.0 * (n.x + turn)).sin() * (7.0 * n.y).cos();
            let light = 0.25 * n.dot(direction).max(0.0) + 0.004;
            [0.9, 0.6 + 0.2 * spots, 0.3 + 0.5 * spots].map(|albedo| albedo * (0.2 + 0.8 * spots) * light)
        })
    };
    let mask = Mask::from_fn(SIZE, SIZE, |x, y| f32::from((x as f32 - 47.5).hypot(y as f32 - 47.5) < 44.0));
    for pose in 0..4 {
        let olats: Vec<Image> = lamps.iter().map(|(d, _)| subject(0.7 * pose as f32, *d)).collect();
        for (i, olat) in olats.iter().enumerate() {
            write(project.olat_picture(pose, i), olat);
        }
        file::write_mask_png(project.exemplar_matte(pose).file(), &mask).unwrap();
        // The interview shows the poses, slightly rotated.
        let frame: Vec<Image> = lamps.iter().map(|(d, _)| subject(0.7 * pose as f32 + 0.05, *d)).collect();
        write(project.frame_picture(pose), &sum(&frame));
        file::write_mask_png(project.frame_matte(pose).file(), &mask).unwrap();
    }
    project
}

/// γ1 and γ2 of a calibration with a dual gamma.
fn exponents(found: &Calibration) -> [f32; 2] {
    found.response.exponents().unwrap()
}

fn angles_deg(rig: &Rig, truth: &[Vec3]) -> Vec<f32> {
    rig.lamps.iter().zip(truth).map(|(lamp, t)| lamp.direction.angle_between(*t).to_degrees()).collect()
}

#[test]
fn a_shoot_of_known_making_is_recovered() {
    for (gamma1, gamma2) in [(2.5, 1.9), (2.0, 2.3)] {
        let folder = tempfile::tempdir().unwrap();
        let mut project = small_shoot(folder.path(), &DualGamma { gamma1, gamma2 });
        let found = calibrate(&mut project, &CalibrateSettings::default(), &Progress::silent()).unwrap();
        println!(
            "γ ({gamma1}, {gamma2}): {:?} ± {:?}, exposure {}",
            found.response, found.gamma_deviation, found.exposure
        );
        assert!((exponents(&found)[0] - gamma1).abs() < 0.15 && (exponents(&found)[1] - gamma2).abs() < 0.15);
        let truth: Vec<Vec3> = dome().iter().map(|(direction, _)| *direction).collect();
        assert_eq!([found.rig.lamps.len(), found.interview_weights.len()], [truth.len(); 2]);
        let angle = median(angles_deg(&found.rig, &truth));
        let weight =
            median(dome().iter().zip(&found.interview_weights).flat_map(|((_, t), w)| w.map(|w| (w / t - 1.0).abs())));
        println!("median angle {angle:.2}°, median weight error {:.1} %", 100.0 * weight);
        assert!(angle < 1.0 && weight < 0.03);
        found.save(&project).unwrap();
        assert_eq!(Calibration::load(&project).unwrap(), found);
    }
}

#[test]
fn lamps_that_the_network_does_not_learn_serve_the_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let response = DualGamma { gamma1: 2.5, gamma2: 1.9 };
    let mut project = small_shoot(folder.path(), &response);
    let layout: Vec<Vec3> = dome().iter().map(|(direction, _)| *direction).collect();
    project.settings.shoot.lamp_layout = layout.clone();
    let silent = Progress::silent();
    let all = calibrate(&mut project, &CalibrateSettings::default(), &silent).unwrap();
    let learnt = dome().len() / 2;
    let subset = keep_lamps(&mut project, learnt, &silent).unwrap();
    project.save().unwrap();
    assert_eq!(Project::open(folder.path()).unwrap(), project);
    let error = Calibration::load(&project).unwrap_err().for_terminal();
    assert!(error.contains("afterlight calibrate"), "{error}");
    let found = calibrate(&mut project, &CalibrateSettings::default(), &silent).unwrap();
    // The lamps are summed in another order, so the fits differ slightly.
    let near = |a: f32, b: f32| (a - b).abs() < 0.02;
    assert!(near(exponents(&found)[0], exponents(&all)[0]));
    assert!(near(exponents(&found)[1], exponents(&all)[1]));
    assert!(near(found.exposure, all.exposure));
    assert_eq!(found.rig.lamps.len(), learnt);
    assert_eq!(found.interview_weights.len(), dome().len());
    for (lamp, &before) in found.rig.lamps.iter().zip(&subset.indices) {
        assert_eq!(lamp.name, all.rig.lamps[before].name);
        assert!(lamp.direction.angle_between(layout[before]).to_degrees() < 1.0);
    }
    let turned = project.settings.shoot.lamp_layout[learnt];
    assert!(!subset.indices.iter().any(|&i| layout[i] == turned));
    // Half of the lamps give as much light as all, with a similar look.
    let stand_in = found.stand_in.as_ref().unwrap();
    assert!(stand_in.residual > 0.0 && stand_in.residual < 0.3, "{}", stand_in.residual);
    let exemplar = Exemplar::load(&project, &found.response, 0).unwrap();
    let light = found.interview_light();
    let look = exemplar.relit_by_all(&project, &found.response, &light).unwrap();
    let near = exemplar.relit(&found.learnt_light());
    let frame = Frame::load(&project, &found.response, 0).unwrap().plate;
    let [frame, look, near] = [&frame, &look, &near].map(|image| {
        let pixels = image.pixels.iter().zip(&exemplar.mask.pixels);
        let inside = pixels.filter(|(_, mask)| **mask > 0.99).map(|(pixel, _)| pixel[1]);
        inside.clone().sum::<f32>() / inside.count() as f32
    });
    assert!((look / frame - 1.0).abs() < 0.03, "{look} is not {frame}");
    assert!((near / look - 1.0).abs() < 0.1, "{near} is not {look}");
    found.save(&project).unwrap();
    assert_eq!(Calibration::load(&project).unwrap(), found);
    let cut = Calibration { stand_in: None, ..found };
    cut.save(&project).unwrap();
    assert!(Calibration::load(&project).is_err());
}

#[test]
fn lamps_are_kept_among_those_that_the_project_learns() {
    let folder = tempfile::tempdir().unwrap();
    let response = DualGamma { gamma1: 2.5, gamma2: 1.9 };
    let mut project = small_shoot(folder.path(), &response);
    let silent = Progress::silent();
    let all: Vec<String> = project.settings.shoot.all_lamps().cloned().collect();
    let layout: Vec<Vec3> = dome().iter().map(|(direction, _)| *direction).collect();
    // As a list of lamps names them.
    let named: Vec<usize> = (0..all.len()).filter(|lamp| lamp % 3 == 1).collect();
    for known in [Vec::new(), layout.clone()] {
        for count in [2, named.len()] {
            project.settings.shoot.lamps = all.clone();
            project.settings.shoot.other_lamps = vec![];
            project.settings.shoot.lamp_layout.clone_from(&known);
            project.settings.shoot.learn(&named);
            let kept = keep_lamps(&mut project, count, &silent).unwrap();
            let shoot = &project.settings.shoot;
            assert_eq!((shoot.lamps.len(), kept.indices.len()), (count, count));
            let place = |name: &String| all.iter().position(|other| other == name).unwrap();
            for (i, name) in shoot.all_lamps().enumerate() {
                assert!(i >= count || named.contains(&place(name)), "{name}");
                if !known.is_empty() {
                    assert_eq!(shoot.lamp_layout[i], layout[place(name)], "{name}");
                }
            }
        }
        let said = keep_lamps(&mut project, named.len() + 1, &silent).unwrap_err().to_string();
        assert!(said.contains(&format!("from {}", named.len())), "{said}");
    }
}

#[test]
fn a_calibration_that_fails_leaves_the_project_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let response = DualGamma::new(2.2, 2.2).unwrap();
    let mut project = small_shoot(folder.path(), &response);
    let before = project.clone();
    let black = Encoded(Raster::filled(96, 96, [0.0; 3]));
    for path in project.probe_pictures() {
        file::write_png(path.file(), &black).unwrap();
    }
    let settings = CalibrateSettings { find_circle: true, ..CalibrateSettings::default() };
    let error = calibrate(&mut project, &settings, &Progress::silent()).unwrap_err();
    assert!(error.to_string().contains("interview.png"), "{error}");
    // A good circle, then an unreadable ball.
    std::fs::write(project.lamp_probe_picture(2), b"no picture").unwrap();
    let settings =
        CalibrateSettings { circle: Some(Circle::new([40.0, 41.0], 30.0).unwrap()), ..CalibrateSettings::default() };
    let error = calibrate(&mut project, &settings, &Progress::silent()).unwrap_err();
    assert!(error.to_string().contains("olat_02.png"), "{error}");
    assert_eq!(project, before);
}

#[test]
fn one_picture_under_two_names_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let response = DualGamma::new(2.2, 2.2).unwrap();
    let mut project = small_shoot(folder.path(), &response);
    for pose in [1, 2] {
        std::fs::copy(project.olat_picture(pose, 3), project.olat_picture(pose, 8)).unwrap();
    }
    let settings = CalibrateSettings::default();
    let found = calibrate(&mut project, &settings, &Progress::silent()).unwrap();
    let named =
        found.rig_findings.iter().filter(|sentence| sentence.contains("olat_03, olat_08 of pose01, pose02 are copies"));
    assert_eq!(named.count(), 1, "{:?}", found.rig_findings);
}

#[test]
fn lamps_of_a_wrong_circle_are_not_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let shoot = folder.path().join("shoot");
    let settings = virtual_stage::StageSettings {
        frames: 1,
        size: 128,
        lamps: 20,
        poses: 1,
        seed: 31,
        ..virtual_stage::StageSettings::default()
    };
    virtual_stage::write_shoot(&shoot, &settings, &Progress::silent()).unwrap();
    let import = footage::ImportSettings { size: 128, seed: 1, layer: None };
    let to = folder.path().join("project");
    let mut project = footage::import(&to, &shoot, &import, &Progress::silent()).unwrap();
    let found =
        silhouette::find(&Photographs::read(&project.probe_pictures(), &Progress::silent()).unwrap()).unwrap().circle;
    // Lamps measured with a circle that is off by shares of its radius, to the right and in size.
    let mut measured = |aside: f64, wider: f64| {
        let [x, y] = found.center_px;
        let radius = found.radius_px;
        Circle::new([x + aside * radius, y], (1.0 + wider) * radius)
            .unwrap()
            .apply_to(&mut project.settings.shoot.ball);
        let probes = Probes::load(&project, &Progress::silent()).unwrap();
        let names = project.settings.shoot.lamps.iter();
        let lamps = probes.lamps(names, &PROVISIONAL);
        (lamps, probes.wrong_circle().map(str::to_owned))
    };
    let (right, named) = measured(0.0, 0.0);
    assert_eq!(named, None);
    let mean = |lamps: &[Lamp]| lamps.iter().map(|lamp| lamp.confidence).sum::<f32>() / lamps.len() as f32;
    assert!(mean(&right) > 0.6, "{}", mean(&right));
    for (aside, wider) in
        [(0.05, 0.0), (0.0, -0.1), (0.15, 0.1), (0.3, 0.0), (-0.5, 0.0), (0.7, 0.2), (0.0, 0.5), (0.1, -0.4)]
    {
        let (lamps, named) = measured(aside, wider);
        let sentence = named.unwrap_or_else(|| panic!("{aside} {wider}: not named"));
        assert!(sentence.contains("Find the circle again"), "{sentence}");
        let near = (lamps.iter().zip(&right))
            .filter(|(lamp, right)| {
                lamp.is_usable() && lamp.direction.angle_between(right.direction).to_degrees() < 5.0
            })
            .count() as f32
            / right.len() as f32;
        assert!(
            mean(&lamps) < near + 0.15,
            "{aside} {wider}: {near} are right, {} are reported as right",
            mean(&lamps)
        );
    }
}
