//! Shoots from real photographs of two shiny balls and an object, without a metric manifest.

use super::super::highlight::apart_from_published;
use super::*;
use footage::{ImportSettings, import};
use imaging::file::{read_encoded, write_mask_png, write_png};

/// Writes a shoot of the shared photographs, with the given manifest and with one or both balls; None if they are
/// missing, and the test returns. All lamps light its interview equally.
fn write_shoot(folder: &Path, manifest: &str, balls: &[usize]) -> Option<()> {
    let photographs = test_support::shared("data/shiny_balls")?;
    let decoded = |path: &Path| {
        let Encoded(codes) = read_encoded(path).unwrap();
        codes.map(|pixel| pixel.map(|v| v.powf(2.2)))
    };
    let encoded = |light: &Image| Encoded(light.map(|p| p.map(|v| v.min(1.0).powf(1.0 / 2.2))));
    let mean = |pictures: &[Image]| {
        let mut sum = Image::filled(pictures[0].width, pictures[0].height, [0.0; 3]);
        for picture in pictures {
            for (s, p) in sum.pixels.iter_mut().zip(&picture.pixels) {
                *s = [0, 1, 2].map(|c| s[c] + p[c] / pictures.len() as f32);
            }
        }
        sum
    };
    for (number, name) in balls.iter().zip(["probes", "probes_2"]) {
        let inside = folder.join(name);
        std::fs::create_dir_all(&inside).unwrap();
        let pictures: Vec<Image> =
            (1..=12).map(|i| decoded(&photographs.join(format!("LightProbe-{number}/Image_{i:02}.JPG")))).collect();
        for (i, picture) in pictures.iter().enumerate() {
            write_png(&inside.join(format!("olat_{i:02}.png")), &encoded(picture)).unwrap();
        }
        write_png(&inside.join("interview.png"), &encoded(&mean(&pictures))).unwrap();
    }
    for inside in ["exemplars/pose00", "exemplar_masks", "interview", "interview_masks"] {
        std::fs::create_dir_all(folder.join(inside)).unwrap();
    }
    let object: Vec<Image> =
        (1..=12).map(|i| decoded(&photographs.join(format!("Objects/Image_{i:02}.png")))).collect();
    for (i, picture) in object.iter().enumerate() {
        let path = folder.join(format!("exemplars/pose00/olat_{i:02}.png"));
        write_png(&path, &encoded(picture)).unwrap();
    }
    let frame = mean(&object);
    let mask = Mask {
        width: frame.width,
        height: frame.height,
        pixels: frame.pixels.iter().map(|p| f32::from(p[1] > 0.01)).collect(),
    };
    write_mask_png(&folder.join("exemplar_masks/pose00.png"), &mask).unwrap();
    for i in 0..2 {
        write_png(&folder.join(format!("interview/frame_00{i}.png")), &encoded(&frame)).unwrap();
        write_mask_png(&folder.join(format!("interview_masks/frame_00{i}.png")), &mask).unwrap();
    }
    std::fs::write(folder.join("manifest.json"), manifest).unwrap();
    Some(())
}

#[test]
fn a_shoot_of_two_real_balls_without_sizes_is_imported_and_calibrated() {
    let home = tempfile::tempdir().unwrap();
    let shoot = home.path().join("shoot");
    if write_shoot(&shoot, "{}", &[1, 2]).is_none() {
        return;
    }
    let settings = ImportSettings { size: 64, seed: 1, layer: None };
    let ((project, found), notes) = Progress::heard(|progress| {
        let mut project = import(&home.path().join("film"), &shoot, &settings, progress).unwrap();
        assert!(project.settings.shoot.ball.is_far() && !project.settings.shoot.ball.has_circle());
        let found = calibrate(&mut project, &CalibrateSettings::default(), progress).unwrap();
        (project, found)
    });
    for says in ["count as far away", "1.1° at 50", "Calibrating finds it"] {
        assert!(notes.contains(says), "{says}: {notes}");
    }
    let two = found.two_balls.clone().unwrap();
    println!("{}", two.sentence());
    println!(
        "circles {:?} and {:?}",
        Circle::from_ball(&project.settings.shoot.ball),
        project.settings.shoot.second_ball.as_ref().map(|s| Circle::from_ball(&s.ball))
    );
    assert!(two.lamps == 12 && two.near.is_empty() && project.settings.shoot.ball.has_circle());
    let off = apart_from_published(&found.rig);
    println!("off the published directions: {off:.2?}");
    assert!(off.iter().all(|off| *off < 2.5));
    found.save(&project).unwrap();
    assert_eq!(Calibration::load(&project).unwrap(), found);
}
