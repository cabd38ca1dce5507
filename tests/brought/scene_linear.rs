//! A shoot of scene-linear EXR, with light above white from reading to the relit plate.

use afterlight::calibration::{CalibrateSettings, calibrate};
use afterlight::check::{Evidence, Level, Subject};
use afterlight::compositor::{Field, Plate};
use afterlight::evaluation::at_plate;
use afterlight::footage::{Frame, ImportSettings, import};
use afterlight::imaging::{DualGamma, Image, Mask, Response, file};
use afterlight::progress::Progress;
use afterlight::transfer::Transfer;
use serde_json::Value;
use std::path::Path;
use test_shoot::TestShoot;

/// Times the stage's light, which its 8 bits cut at 1.
const BRIGHTER: f32 = 8.0;

/// Turns the camera's PNGs in a folder and those below into EXR with their true light, `factor` times as bright.
fn to_light(folder: &Path, response: &Response, factor: f32) {
    for path in test_support::files(folder) {
        if path.extension().is_some_and(|ending| ending == "png") {
            let light = response.decode(&file::read_encoded(&path).unwrap());
            let light: Image = light.map(|pixel| pixel.map(|v| factor * v));
            file::write_exr(&path.with_extension("exr"), &light).unwrap();
            std::fs::remove_file(path).unwrap();
        }
    }
}

#[test]
fn light_above_white_goes_from_the_file_to_the_relit_plate() {
    let folder = tempfile::tempdir().unwrap();
    let stage = TestShoot { frames: 3, lamps: 12, size: 64, working_size: 32 };
    let shoot = stage.write(folder.path());
    let truth = std::fs::read_to_string(shoot.join("truth.json")).unwrap();
    let truth: Value = serde_json::from_str(&truth).unwrap();
    let exponent = |name: &str| truth[name].as_f64().unwrap() as f32;
    let response = DualGamma::new(exponent("g1"), exponent("g2")).unwrap().into();
    let silent = Progress::silent();
    let settings = ImportSettings { size: stage.working_size, seed: 5, layer: None };
    let mut coded = import(&folder.path().join("coded"), &shoot, &settings, &silent).unwrap();
    let by_codes = calibrate(&mut coded, &CalibrateSettings::default(), &silent).unwrap();

    for part in ["interview", "exemplars", "probes"] {
        to_light(&shoot.join(part), &response, BRIGHTER);
    }
    let root = folder.path().join("light");
    let mut project = import(&root, &shoot, &settings, &silent).unwrap();
    let found = calibrate(&mut project, &CalibrateSettings::default(), &silent).unwrap();
    found.save(&project).unwrap();
    assert!(found.gamma_evidence.by_files);
    assert!((found.exposure.ln()).abs() < 0.05, "exposure {}", found.exposure);
    let report = Evidence::read(&project, &silent).unwrap().report(&[]);
    let line = report.checks.iter().find(|check| check.subject == Subject::Response).unwrap();
    assert_eq!(line.level, Level::Good, "{}", line.sentence);
    assert!(line.sentence.contains("Scene-linear"), "{}", line.sentence);

    // The same lamps, eight times as bright, as from the codes. A pixel of the ball is 4°.
    let mut brighter = Vec::new();
    for (light, coded) in found.rig.lamps.iter().zip(&by_codes.rig.lamps) {
        let apart = light.direction.angle_between(coded.direction).to_degrees();
        assert!(apart < 4.0, "{} is {apart}° off", light.name);
        brighter.push(light.energy[1] / coded.energy[1] / BRIGHTER);
    }
    let brighter = median(brighter);
    assert!((0.8..1.25).contains(&brighter), "lamps are {brighter} of their energy");

    let weights = found.learnt_light();
    let transfer = Transfer::open(&project, &found).unwrap();
    let (frame, filmed) = Frame::load_filmed(&project, &found.response, 1).unwrap();
    let (plate, mask) = (filmed.plate.clone(), filmed.mask.clone());
    let brightest = plate.pixels.iter().flatten().copied().fold(0.0, f32::max);
    assert!(brightest > 2.0, "the plate has {brightest} at most");
    let plate_pass = Plate::from_filmed(filmed, &frame).unwrap();
    let field = Field::from(transfer.carry(&frame).field);
    let sum = field.relight(&weights).unwrap();
    let worst = misses(&sum, &frame.plate, &frame.mask).into_iter().fold(0.0, f32::max);
    assert!(worst < 0.005, "a pixel of the working size is {:.2} % off", 100.0 * worst);
    let relit = at_plate(sum, (Some(&plate_pass), &frame.mask), &weights);
    let all = misses(&relit, &plate, &mask);
    let worst = all.iter().copied().fold(0.0, f32::max);
    println!("brightest {brightest}, plate off by {} in the median, {worst} at worst", median(all));
    assert!(worst < 0.005, "a pixel of the plate is {:.2} % off", 100.0 * worst);
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

/// Relative misses of the solid subject's channels that are not dark.
fn misses(relit: &Image, plate: &Image, mask: &Mask) -> Vec<f32> {
    let pixels = relit.pixels.iter().zip(&plate.pixels).zip(&mask.pixels);
    let solid = pixels.filter(|(_, alpha)| **alpha > 0.98);
    let channels = solid.flat_map(|((relit, plate), _)| relit.iter().zip(plate));
    let lit = channels.filter(|(_, plate)| **plate > 0.01);
    lit.map(|(relit, plate)| (relit / plate - 1.0).abs()).collect()
}
