//! Effect of the kinds of weights on the true OLATs of the shared head scan: on its truth frames, under a slow turn of
//! a sunny park, and under every available panorama.

use super::{Method, Truth, score};
use base::progress::Progress;
use calibration::{CalibrateSettings, Calibration, calibrate};
use compositor::reference::{lit_lamps, relight};
use footage::{Frame, ImportSettings, import};
use imaging::color::{luminance, srgb_from_linear};
use imaging::{Image, resample::resize_area};
use light::YawTable;
use light::weights::{Partition, Weighting};
use project::Project;
use reflectance::ReflectanceField;
use std::sync::OnceLock;
use test_support::shared;

/// The shoot, calibrated from its own photographs, at 256 × 256.
struct Shoot {
    project: Project,
    calibration: Calibration,
    truth: Truth,
    _folder: tempfile::TempDir,
}

/// The shoot; if it is missing, the result is None and the test returns.
fn shoot() -> Option<&'static Shoot> {
    static SHOOT: OnceLock<Shoot> = OnceLock::new();
    let stage = shared("data/stage")?;
    let shoot = SHOOT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let (settings, silent) = (ImportSettings { size: 256, seed: 0, layer: None }, Progress::silent());
        let mut project = import(folder.path(), &stage, &settings, &silent).unwrap();
        let settings = CalibrateSettings::default();
        Shoot {
            calibration: calibrate(&mut project, &settings, &silent).unwrap(),
            truth: Truth::open(&project, &stage).unwrap(),
            project,
            _folder: folder,
        }
    });
    Some(shoot)
}

const KINDS: [Weighting; 3] = [Weighting::Cells, Weighting::Smooth, Weighting::Fit];

#[test]
fn the_true_olats_reach_the_rigs_limit_and_the_default_loses_nothing_to_cells() {
    let Some(shoot) = shoot() else { return };
    let [cells, smooth, fit] = KINDS.map(|kind| {
        let scores = score(
            &shoot.project,
            &shoot.calibration,
            &shoot.truth,
            kind,
            (Method::TruthOlats, footage::PictureSize::Square),
            &mut |_, _| unreachable!("only networks predict"),
            &Progress::silent(),
        );
        let relit = scores.unwrap().relit_psnr_db;
        println!("{kind:?}: {relit:.2?} dB");
        ["grace", "pisa"].map(|name| relit[name])
    });
    assert_eq!(Weighting::default(), Weighting::Fit);
    for (fit, cells) in fit.into_iter().zip(cells) {
        assert!(fit > cells - 0.3, "{fit} dB, cells {cells}");
    }
    assert!(fit[0] >= 30.0 && fit[1] >= 37.0, "{fit:?}");
    // A small sun on three banks of lamps is the reason why `smooth` is not the default.
    assert!(smooth[0] < cells[0] - 0.3, "{smooth:?}");
}

/// Frame-to-frame differences of a clip in 8-bit codes, root-mean-square over the subject.
struct Flicker {
    /// Difference from one frame to the next: mean and maximum.
    change: [f64; 2],
    /// Difference between successive changes: zero for even motion.
    jerk: [f64; 2],
}

/// Flicker of OLATs over a whole turn in a minute at 24 frames a second, a quarter of a degree per frame.
fn flicker(field: &ReflectanceField, subject: &[bool], table: &YawTable, gain: f32) -> Flicker {
    let shown = |frame: usize| -> Vec<f64> {
        let weights = table.at(0.25 * frame as f32).per_lamp;
        let relit = relight(field, &weights, &lit_lamps(&weights));
        let inside = relit.pixels.iter().zip(subject).filter(|(_, inside)| **inside);
        inside.flat_map(|(p, _)| p.map(|v| 255.0 * f64::from(srgb_from_linear(gain * v).clamp(0.0, 1.0)))).collect()
    };
    let root = |values: &mut dyn Iterator<Item = f64>, count: usize| {
        (values.map(|v| v * v).sum::<f64>() / count as f64).sqrt()
    };
    let (mut changes, mut jerks) = (Vec::new(), Vec::new());
    let (mut before, mut last) = (shown(1438), shown(1439));
    for frame in 0..1440 {
        let now = shown(frame);
        let count = now.len();
        let change = last.iter().zip(&now).map(|(a, b)| b - a);
        changes.push(root(&mut { change }, count));
        let jerk = before.iter().zip(&last).zip(&now).map(|((a, b), c)| a - 2.0 * b + c);
        jerks.push(root(&mut { jerk }, count));
        (before, last) = (last, now);
    }
    let summary = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        [mean, values.iter().copied().fold(0.0, f64::max)]
    };
    Flicker { change: summary(&changes), jerk: summary(&jerks) }
}

#[test]
fn a_slow_turn_of_a_sunny_park_flickers_less_by_smooth_and_by_fit_than_by_cells() {
    const SIZE: usize = 64;
    let park = shared("data/hdri/polyhaven_sunny_vondelpark_1k.hdr");
    let (Some(shoot), Some(park)) = (shoot(), park) else { return };
    let park = light::panorama::load(&park).unwrap();
    let index = shoot.truth.frames[0];
    let olats = shoot.truth.olats(index).unwrap();
    let olats: Vec<Image> = olats.iter().map(|o| resize_area(o, SIZE, SIZE)).collect();
    let field = ReflectanceField::from_olats(&olats);
    let frame = Frame::load(&shoot.project, &shoot.calibration.response, index).unwrap();
    let subject: Vec<bool> = (0..SIZE * SIZE)
        .map(|i| {
            let step = frame.mask.width / SIZE;
            frame.mask.at(i % SIZE * step + step / 2, i / SIZE * step + step / 2) > 0.98
        })
        .collect();
    // One exposure for all: the subject's mean at middle grey, lit from the front.
    let partitions = KINDS.map(|kind| Partition::new(kind, &shoot.calibration.rig));
    let weights = partitions[2].weights(&park, 0.0).per_lamp;
    let front = relight(&field, &weights, &lit_lamps(&weights));
    let inside = front.pixels.iter().zip(&subject).filter(|(_, inside)| **inside);
    let sum: f32 = inside.map(|(p, _)| luminance(*p)).sum();
    let count = subject.iter().filter(|inside| **inside).count();
    let gain = 0.18 * count as f32 / sum;
    let park = park.reduced(Partition::WIDTH);
    let [cells, smooth, fit] = [0, 1, 2].map(|kind| {
        let flicker = flicker(&field, &subject, &YawTable::new(&partitions[kind], &park), gain);
        println!(
            "{:?}: frame-to-frame difference {:.3} codes on average, {:.2} at most; between changes \
             {:.4} and {:.2}",
            KINDS[kind], flicker.change[0], flicker.change[1], flicker.jerk[0], flicker.jerk[1]
        );
        flicker
    });
    for steady in [&smooth, &fit] {
        assert!(steady.change[1] < 0.5 * cells.change[1]);
        assert!(steady.jerk[0] < 0.5 * cells.jerk[0] && steady.jerk[1] < 0.5 * cells.jerk[1]);
    }
}

#[test]
fn the_true_olats_are_relit_under_every_panorama_with_all_of_its_energy() {
    let (Some(shoot), Some(folder)) = (shoot(), shared("data/hdri")) else { return };
    let rig = &shoot.calibration.rig;
    let partition = Partition::new(Weighting::default(), rig);
    let olats = shoot.truth.olats(shoot.truth.frames[0]).unwrap();
    let field = ReflectanceField::from_olats(&olats);
    let mut panoramas = 0;
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        if !["hdr", "exr"].iter().any(|e| path.extension().is_some_and(|x| x == *e)) {
            continue;
        }
        let environment = light::panorama::load(&path).unwrap();
        let weights = partition.weights(&environment, 0.0);
        let energy = environment.energy();
        for c in 0..3 {
            let lamps = weights.per_lamp.iter().zip(&rig.lamps);
            let given: f64 = lamps.map(|(w, lamp)| f64::from(w[c]) * f64::from(lamp.energy[c])).sum();
            let off = (given / energy[c] - 1.0).abs();
            assert!(off < 1e-4, "{}: {given} of {}", path.display(), energy[c]);
        }
        let relit = relight(&field, &weights.per_lamp, &lit_lamps(&weights.per_lamp));
        let is_light = |v: &f32| v.is_finite() && *v >= 0.0;
        assert!(relit.pixels.iter().flatten().all(is_light), "{}", path.display());
        // At most what all the light could give from the lamp that lights the pixel most.
        let most = (0..relit.pixels.len()).all(|i| {
            let lamps = olats.iter().zip(&rig.lamps);
            let best = lamps.map(|(olat, lamp)| olat.pixels[i][1] / lamp.energy[1]);
            f64::from(relit.pixels[i][1]) <= 1.001 * energy[1] * f64::from(best.fold(0.0, f32::max))
        });
        assert!(most, "{}", path.display());
        panoramas += 1;
    }
    println!("{panoramas} panoramas");
    assert!(panoramas > 10);
}
