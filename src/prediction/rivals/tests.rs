//! Both methods on small shoots of the virtual stage.

use super::learner::draw;
use super::lights::{Lights, Shares};
use super::poses::{Pose, subject};
use super::*;
use base::progress::{Control, Progress};
use burn::tensor::Device;
use footage::Frame;
use imaging::Image;
use test_shoot::TestShoot;

/// The poses of a small shoot, up to a number.
fn poses(most: usize) -> Poses {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = TestShoot::default().calibrate(folder.path(), "project");
    let mut poses = Poses::load(&project, &calibration, None, &Progress::silent()).unwrap();
    poses.poses.truncate(most);
    poses
}

fn effort(steps: u64) -> Effort {
    Effort { minutes: 1e3, steps: Some(steps), seed: 7 }
}

fn frame(pose: &Pose) -> Frame {
    Frame { index: 0, plate: pose.plate.clone(), mask: pose.mask.clone() }
}

fn alone(lamps: usize, lit: usize) -> Vec<[f32; 3]> {
    let weight = |lamp| [f32::from(u8::from(lamp == lit)); 3];
    (0..lamps).map(weight).collect()
}

/// Root mean square error over the subject as a share of the truth's root mean square, on square roots of values.
fn error(picture: &Image, truth: &Image, pose: &Pose) -> f64 {
    let root = |v: f32| f64::from(v.max(0.0)).sqrt();
    let (mut off, mut all) = (0.0, 0.0);
    for i in subject(&pose.mask) {
        for c in 0..3 {
            let (p, t) = (root(picture.pixels[i][c]), root(truth.pixels[i][c]));
            off += (p - t).powi(2);
            all += t * t;
        }
    }
    (off / f64::max(all, 1e-12)).sqrt()
}

/// Baseline: the plate scaled to the truth's brightness and colour, so that no shadow moves.
fn unmoved(pose: &Pose, truth: &Image) -> Image {
    let sums =
        |image: &Image| -> [f32; 3] { std::array::from_fn(|c| subject(&pose.mask).map(|i| image.pixels[i][c]).sum()) };
    let (plate, truth) = (sums(&pose.plate), sums(truth));
    let pixels = pose.plate.pixels.iter();
    let scaled = |p: &[f32; 3]| std::array::from_fn(|c| p[c] * truth[c] / plate[c].max(1e-6));
    Image { pixels: pixels.map(scaled).collect(), ..pose.plate.clone() }
}

#[test]
fn patches_learn_each_look_of_one_pose() {
    let poses = poses(1);
    let pose = &poses.poses[0];
    let lights: Vec<_> = (0..3).map(|lamp| alone(poses.lamps(), lamp)).collect();
    let learnt = PatchStyle::learn(&poses, &lights, &effort(250), &Device::flex(), &Progress::silent()).unwrap();
    assert_eq!(learnt.spent.steps, 250);
    assert!(learnt.spent.seconds > 0.0);
    let pictures = learnt.relit(&frame(pose)).unwrap();
    assert_eq!(pictures.len(), 3);
    for (picture, light) in pictures.iter().zip(&lights) {
        let truth = pose.relit(light);
        let (found, trivial) = (error(picture, &truth, pose), error(&unmoved(pose, &truth), &truth, pose));
        println!("off by {found:.3}, the plate itself by {trivial:.3}");
        // So few steps prove learning, not final quality.
        assert!(found < 0.75 * trivial, "{found}, {trivial}");
    }
    let outside = (0..pose.mask.pixels.len()).filter(|&i| pose.mask.pixels[i] == 0.0);
    assert!(outside.into_iter().all(|i| pictures[0].pixels[i] == [0.0; 3]));
}

#[test]
fn a_portrait_learns_one_pose_in_every_light_and_follows_the_light() {
    let poses = poses(1);
    let pose = &poses.poses[0];
    let learnt = Portrait::learn(&poses, &effort(400), &Device::flex(), &Progress::silent());
    let learnt = learnt.unwrap();
    let lights: Vec<_> = (0..poses.lamps()).map(|l| alone(poses.lamps(), l)).collect();
    let frame = frame(pose);
    let pictures = learnt.relit(&frame, &lights).unwrap();
    let (mut found, mut trivial, mut swapped) = (0.0, 0.0, 0.0);
    for (lamp, light) in lights.iter().enumerate() {
        let truth = pose.relit(light);
        found += error(&pictures[lamp], &truth, pose);
        trivial += error(&unmoved(pose, &truth), &truth, pose);
        swapped += error(&pictures[(lamp + 1) % lights.len()], &truth, pose);
    }
    let count = lights.len() as f64;
    let [found, trivial, swapped] = [found, trivial, swapped].map(|e| e / count);
    println!("off by {found:.3}, the plate itself by {trivial:.3}, the next lamp's by {swapped:.3}");
    assert!(found < 0.6 * trivial, "{found}, {trivial}");
    assert!(found < 0.5 * swapped, "{found}, {swapped}");

    // Twice the light is twice the picture, and the picture takes the light's colour.
    let tinted: Vec<_> = lights[0].iter().map(|w| [2.0 * w[0], 2.0 * w[1], 0.0]).collect();
    let tinted = learnt.relit(&frame, &[tinted]).unwrap();
    assert!(tinted[0].pixels.iter().all(|p| p[2] == 0.0));
    let sum = |image: &Image| image.pixels.iter().map(|p| p[1]).sum::<f32>();
    let ratio = sum(&tinted[0]) / sum(&pictures[0]);
    assert!((ratio - 2.0).abs() < 0.35, "{ratio}");

    // Light of the plate.
    let truth = Shares::new(&poses.interview, &poses.levels());
    let seen = learnt.source(&frame).unwrap();
    let off: f32 = (seen.iter().flatten().zip(&truth.roots)).map(|(share, root)| (share.sqrt() - root).abs()).sum();
    let mean = off / truth.roots.len() as f32;
    println!("the interview's light is off by {mean:.3}");
    assert!(mean < 0.1, "{mean}");

    let short = learnt.relit(&frame, &[alone(2, 0)]).unwrap_err().to_string();
    assert!(short.contains("2 lamps, but the network learnt 6"), "{short}");
}

#[test]
fn one_seed_gives_one_network_on_the_cpu() {
    let poses = poses(2);
    let (device, silent) = (Device::flex(), Progress::silent());
    let frame = frame(&poses.poses[1]);
    let lights = [alone(poses.lamps(), 2)];
    let patches = || PatchStyle::learn(&poses, &lights, &effort(3), &device, &silent).unwrap();
    let portrait = || Portrait::learn(&poses, &effort(3), &device, &silent).unwrap();
    assert_eq!(patches().relit(&frame).unwrap(), patches().relit(&frame).unwrap());
    assert_eq!(portrait().relit(&frame, &lights).unwrap(), portrait().relit(&frame, &lights).unwrap());
}

#[test]
fn time_ends_a_run_and_so_does_a_stop() {
    let poses = poses(1);
    let brief = Effort { minutes: 1e-9, steps: None, seed: 1 };
    let (device, lights) = (Device::flex(), [alone(poses.lamps(), 0)]);
    let learnt = PatchStyle::learn(&poses, &lights, &brief, &device, &Progress::silent());
    assert_eq!(learnt.unwrap().spent.steps, 1);
    let control = Control::default();
    control.stop();
    let sink = |_| {};
    let stopped = Progress::new(&sink, control);
    assert!(Portrait::learn(&poses, &effort(5), &device, &stopped).is_err());
    let none = PatchStyle::learn(&poses, &[], &brief, &device, &Progress::silent());
    let none = none.err().unwrap().to_string();
    assert!(none.contains("no light to learn a look from"), "{none}");
}

/// Dark lamps, lights without a channel, few lamps: weights and shares stay finite.
#[test]
fn lights_at_random_are_light() {
    let mut rig = poses(1).rig;
    rig.lamps[1].energy = [0.0; 3];
    let lights = Lights::new(&rig);
    let levels = vec![[0.5, 0.4, 0.0]; rig.lamps.len()];
    let mut single = 0;
    for step in 0..400 {
        let weights = lights.draw(&mut draw(3, step, 1));
        assert!(weights.iter().flatten().all(|w| w.is_finite() && *w >= 0.0));
        single += usize::from(weights.iter().filter(|w| **w != [0.0; 3]).count() == 1);
        let shares = Shares::new(&weights, &levels);
        assert!(shares.roots.iter().all(|r| (0.0..=1.0).contains(r)));
        let normal = shares.normal(&weights);
        let total: f32 = normal.iter().zip(&levels).map(|(w, l)| w[0] * l[0]).sum();
        assert!((total - 1.0).abs() < 1e-4, "{total}");
        assert!(normal.iter().all(|w| w[2] == 0.0));
    }
    assert!((150..=250).contains(&single), "{single}");
    let dark = Shares::new(&[[0.0; 3]; 2], &levels[..2]);
    assert!(dark.roots.iter().all(|r| *r == 0.0));
}
