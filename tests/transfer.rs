//! Reflectance transfer on shoots of the virtual stage: against the truth, against the reference sketch, and in hard
//! cases.

use afterlight::calibration::Calibration;
use afterlight::compositor::{FineLight, Plate};
use afterlight::evaluation::{Truth, at_plate};
use afterlight::footage::{Exemplar, Frame, PictureSize};
use afterlight::imaging::color::luminance;
use afterlight::imaging::{Image, Mask};
use afterlight::light::Rig;
use afterlight::progress::Progress;
use afterlight::reflectance::{Device, ReflectanceField};
use afterlight::transfer::{Carried, ExemplarDetail, FineField, OlatPredictor, PlatePose, Transfer};
use afterlight::virtual_stage::{StageSettings, write_shoot};
use std::path::Path;
use std::sync::{Arc, LazyLock, OnceLock};
use test_shoot::TestShoot;
use test_support::shown;

const SHOOT: TestShoot = TestShoot { frames: 4, lamps: 20, size: 64, working_size: 64 };

/// A stage's exemplars and frames, read once for all tests.
struct Stage {
    calibration: Calibration,
    poses: Vec<PlatePose>,
    frames: Vec<Frame>,
    /// A frame with true OLATs, and those OLATs.
    known: usize,
    truth: Vec<Image>,
}

static STAGE: LazyLock<Stage> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = SHOOT.calibrate(folder.path(), "project");
    let response = &calibration.response;
    let light = calibration.interview_light();
    let pose =
        |exemplar: Exemplar| PlatePose { plate: exemplar.relit_by_all(&project, response, &light).unwrap(), exemplar };
    let poses = Exemplar::load_all(&project, response).unwrap();
    let frame = |index| Frame::load(&project, response, index).unwrap();
    let truth = Truth::open(&project, &folder.path().join("shoot")).unwrap();
    let known = truth.frames.iter().find(|&&frame| truth.has_olats(frame));
    let known = *known.unwrap();
    Stage {
        poses: poses.into_iter().map(pose).collect(),
        frames: (0..SHOOT.frames).map(frame).collect(),
        known,
        truth: truth.olats(known).unwrap(),
        calibration,
    }
});

fn transfer() -> Transfer {
    let calibration = &STAGE.calibration;
    Transfer::new(&STAGE.poses, &calibration.rig, calibration.learnt_light())
}

/// PSNR in decibels of encoded luminance inside the matte, with the truth's brightest twentieth at one half.
fn decibels(field: &ReflectanceField, truth: &[Image], mask: &Mask) -> f64 {
    let inside: Vec<usize> = (0..mask.pixels.len()).filter(|&p| mask.pixels[p] > 0.5).collect();
    let truths: Vec<Vec<f32>> =
        truth.iter().map(|olat| inside.iter().map(|&p| luminance(olat.pixels[p])).collect()).collect();
    let mut all: Vec<f32> = truths.concat();
    all.sort_unstable_by(f32::total_cmp);
    let gain = 0.5 / all[all.len() * 95 / 100];
    let code = |v: f32| f64::from((gain * v).clamp(0.0, 1.0).powf(1.0 / 2.2));
    // The truth has its own units.
    let bright = |lamp: usize| -> f32 {
        let olat = field.olat(lamp);
        inside.iter().map(|&p| luminance(olat.pixels[p])).sum()
    };
    let found: f32 = (0..field.lamps).map(bright).sum();
    let units = all.iter().sum::<f32>() / found;
    let mut sum = 0.0;
    for (lamp, truth) in truths.iter().enumerate() {
        let olat = field.olat(lamp);
        for (&p, &truth) in inside.iter().zip(truth) {
            sum += (code(units * luminance(olat.pixels[p])) - code(truth)).powi(2);
        }
    }
    -10.0 * (sum / (inside.len() * truths.len()) as f64).log10()
}

fn sum(field: &ReflectanceField, weights: &[[f32; 3]], p: usize) -> [f32; 3] {
    std::array::from_fn(|c| weights.iter().enumerate().map(|(lamp, w)| w[c] * field.plane(lamp, c)[p]).sum())
}

#[test]
fn olats_of_an_unseen_frame_are_nearer_to_the_truth_than_those_of_any_pose() {
    let stage = &*STAGE;
    let frame = stage.frames[stage.known].clone();
    let truth = &stage.truth;
    let carried = transfer().carry(&frame);
    let found = decibels(&carried.field, truth, &frame.mask);
    for pose in &stage.poses {
        let as_it_is = ReflectanceField::from_olats(&pose.exemplar.olats);
        let pose_db = decibels(&as_it_is, truth, &frame.mask);
        assert!(found > pose_db + 1.0, "{found} dB, pose {} {pose_db} dB", pose.exemplar.pose);
    }
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite() && *v >= 0.0);
    assert!(finite(&carried.unlike.pixels) && finite(&carried.spread.pixels));
    assert!(finite(&carried.lamp_spreads) && carried.lamp_spreads.len() == 20);
    assert!(carried.pose.is_some());
}

#[test]
fn a_shoot_whose_poses_lack_olats_is_calibrated_and_relit_nearly_as_well() {
    let stage = &*STAGE;
    let folder = tempfile::tempdir().unwrap();
    let shoot = SHOOT.write(folder.path());
    for missing in ["pose00/olat_05", "pose02/olat_11", "pose02/olat_00"] {
        std::fs::remove_file(shoot.join(format!("exemplars/{missing}.png"))).unwrap();
    }
    let (project, calibration) = SHOOT.calibrate(folder.path(), "project");
    let [whole, lacking] = [&stage.calibration, &calibration].map(|c| c.interview_light());
    let all: f32 = whole.iter().flatten().sum();
    let off: f32 = whole.iter().zip(&lacking).map(|(a, b)| (a[1] - b[1]).abs()).sum();
    assert!(off < 0.05 * all, "the light is {off} off {all}");
    let frame = Frame::load(&project, &calibration.response, stage.known).unwrap();
    let transfer = Transfer::open(&project, &calibration).unwrap();
    let decibels = |field: &ReflectanceField| decibels(field, &stage.truth, &frame.mask);
    let without = decibels(&transfer.carry(&frame).field);
    let with = decibels(&self::transfer().carry(&stage.frames[stage.known]).field);
    assert!(without > with - 0.5, "{without} dB without three OLATs, {with} dB with them");
}

#[test]
fn the_frame_is_the_sum_of_its_olats_under_the_interview_s_light() {
    let stage = &*STAGE;
    let frame = stage.frames[1].clone();
    let transfer = transfer();
    let beside = [0, 2].map(|i| Arc::new(transfer.alone(&stage.frames[i])));
    let alone = transfer.carry(&frame).field;
    let steady = transfer.carry_beside(&transfer.alone(&frame), &beside).field;
    let brightest = frame.plate.pixels.iter().flatten().copied().fold(0.0, f32::max);
    let pixels = frame.plate.pixels.iter().enumerate();
    for (field, (p, plate)) in pixels.flat_map(|pixel| [(&alone, pixel), (&steady, pixel)]) {
        // At the matte's edge the plate shows the background.
        if frame.mask.pixels[p] > 0.0 && frame.mask.pixels[p] < 0.95 {
            continue;
        }
        let found = sum(field, &stage.calibration.learnt_light(), p);
        for c in 0..3 {
            let expected = if frame.mask.pixels[p] > 0.0 { plate[c] } else { 0.0 };
            // Where there is hardly any light, the quotient is skipped.
            let dark = if expected < 0.01 * brightest { 0.01 * brightest } else { 0.0 };
            assert!((found[c] - expected).abs() <= 1e-4 * brightest + dark, "{p}: {found:?}, plate {plate:?}");
        }
    }
}

#[test]
fn a_pose_among_the_exemplars_is_carried_over_as_it_is() {
    let stage = &*STAGE;
    let PlatePose { exemplar, plate } = &stage.poses[2];
    let frame = Frame { index: 0, plate: plate.clone(), mask: exemplar.mask.clone() };
    let found = decibels(&transfer().carry(&frame).field, &exemplar.olats, &exemplar.mask);
    let others = decibels(&transfer().without(exemplar.pose).carry(&frame).field, &exemplar.olats, &exemplar.mask);
    assert!(found > 32.0 && found > others + 3.0, "{found} dB, without the pose {others} dB");
}

/// Decibels of each pose's OLATs from these others, in the mean.
fn from_others(others: impl Fn(usize) -> Vec<PlatePose>) -> f64 {
    let poses = &STAGE.poses;
    let (rig, light) = (&STAGE.calibration.rig, STAGE.calibration.learnt_light());
    let one = |PlatePose { exemplar, plate }: &PlatePose| {
        let frame = Frame { index: 0, plate: plate.clone(), mask: exemplar.mask.clone() };
        let transfer = Transfer::new(&others(exemplar.pose), rig, light.clone());
        decibels(&transfer.carry(&frame).field, &exemplar.olats, &exemplar.mask)
    };
    poses.iter().map(one).sum::<f64>() / poses.len() as f64
}

#[test]
fn fewer_exemplars_cost_accuracy_step_by_step() {
    let poses = &STAGE.poses;
    let found = [5, 4, 3, 2, 1].map(|count| {
        from_others(|pose| {
            let next = (1..=count).map(|k| poses[(pose + k) % poses.len()].clone());
            next.collect()
        })
    });
    println!("{found:?}");
    for pair in found.windows(2) {
        assert!((-0.3..3.0).contains(&(pair[0] - pair[1])), "{found:?}");
    }
    assert!(found[0] > found[4] + 1.0, "{found:?}");
}

/// OLATs of a pose times the quotient of a frame and the pose under the interview's light.
fn ratio_image(PlatePose { exemplar, plate }: &PlatePose, frame: &Frame) -> ReflectanceField {
    let ratio = |olat: &Image| {
        Image::from_fn(64, 64, |x, y| {
            let [olat, plate, filmed] = [olat, plate, &frame.plate].map(|picture| picture.at(x, y));
            std::array::from_fn(|c| olat[c] * filmed[c] / plate[c].max(1e-3))
        })
    };
    ReflectanceField::from_olats(&exemplar.olats.iter().map(ratio).collect::<Vec<_>>())
}

/// Mean distance from the nearest exemplar.
fn mean_unlike(carried: &Carried, mask: &Mask) -> f64 {
    let inside = carried.unlike.pixels.iter().zip(&mask.pixels).filter(|(_, mask)| **mask > 0.5);
    let (sum, count) = inside.fold((0.0, 0), |(sum, n), (v, _)| (sum + f64::from(*v), n + 1));
    sum / f64::from(count.max(1))
}

/// Up to 46° between the poses.
#[test]
fn one_pose_carried_to_a_far_one_beats_its_ratio_image_and_says_how_far() {
    let stage = &*STAGE;
    let mut found = Vec::new();
    for from in &stage.poses {
        let light = stage.calibration.learnt_light();
        let transfer = Transfer::new(std::slice::from_ref(from), &stage.calibration.rig, light);
        for PlatePose { exemplar, plate } in &stage.poses {
            if exemplar.pose == from.exemplar.pose {
                continue;
            }
            let frame = Frame { index: 0, plate: plate.clone(), mask: exemplar.mask.clone() };
            let carried = transfer.carry(&frame);
            let far = mean_unlike(&carried, &frame.mask);
            let [carried, ratio] = [carried.field, ratio_image(from, &frame)]
                .map(|field| decibels(&field, &exemplar.olats, &exemplar.mask));
            found.push((far, carried, carried - ratio));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!("{found:.2?}");
    let mean = |of: &[(f64, f64, f64)], value: fn(&(f64, f64, f64)) -> f64| {
        of.iter().map(value).sum::<f64>() / of.len() as f64
    };
    let least = found.iter().map(|pair| pair.2).fold(f64::INFINITY, f64::min);
    assert!(least > 0.5 && mean(&found, |pair| pair.2) > 3.0, "{found:.2?}");
    let (near, far) = found.split_at(found.len() / 2);
    assert!(mean(near, |pair| pair.1) > mean(far, |pair| pair.1) + 2.0, "{found:.2?}");
}

#[test]
fn another_person_is_unlike_every_exemplar() {
    let stage = &*STAGE;
    let folder = tempfile::tempdir().unwrap();
    let mut other = StageSettings { frames: 2, lamps: 20, size: 64, seed: 11, ..StageSettings::default() };
    other.trouble.skin = Some(0.9);
    other.trouble.glasses = Some(true);
    write_shoot(&folder.path().join("shoot"), &other, &Progress::silent()).unwrap();
    let (project, calibration) = SHOOT.calibrate(folder.path(), "project");
    let transfer = transfer();
    let unlike = |frame: &Frame| mean_unlike(&transfer.carry(frame), &frame.mask);
    let own = stage.frames.iter().map(unlike).fold(0.0, f64::max);
    let others = (0..2)
        .map(|index| unlike(&Frame::load(&project, &calibration.response, index).unwrap()))
        .fold(f64::INFINITY, f64::min);
    println!("{own:.3} at most of the same person, {others:.3} at least of another");
    assert!(others > 1.5 * own, "{own} at most of the same person, {others} at least of another");
}

/// Every second lamp in some poses and the others in the rest, and the same half in all.
#[test]
fn poses_with_different_lamps_are_pooled() {
    let lacking = |pose: usize, parity: usize| {
        let mut pose = STAGE.poses[pose].clone();
        let exemplar = &mut pose.exemplar;
        exemplar.missing = (0..exemplar.olats.len()).filter(|lamp| lamp % 2 != parity).collect();
        for &lamp in &exemplar.missing {
            exemplar.olats[lamp] = exemplar.olats[lamp].map(|_| [0.0; 3]);
        }
        pose
    };
    let others = |pose| (0..STAGE.poses.len()).filter(move |&other| other != pose);
    let [same, pooled] =
        [0, 1].map(|step| from_others(|pose| others(pose).map(|other| lacking(other, step * other % 2)).collect()));
    let whole = from_others(|pose| others(pose).map(|other| STAGE.poses[other].clone()).collect());
    println!("{whole:.2} dB, {pooled:.2} dB from both halves of the lamps, {same:.2} dB from one");
    assert!(whole > pooled && pooled > same + 0.5, "{whole} dB, {pooled} dB, {same} dB");
}

#[test]
fn pixels_that_no_exemplar_shows_are_lit_as_the_whole_subject_is() {
    let stage = &*STAGE;
    let frame = &stage.frames[stage.known];
    let (width, height) = frame.plate.size();
    let cut = 3 * height / 4 * width;
    let black = |picture: &mut Image| picture.pixels[cut..].fill([0.0; 3]);
    let mut poses = stage.poses.clone();
    for PlatePose { exemplar, plate } in &mut poses {
        exemplar.olats.iter_mut().for_each(black);
        exemplar.mask.pixels[cut..].fill(0.0);
        black(plate);
    }
    let light = stage.calibration.learnt_light();
    let field = Transfer::new(&poses, &stage.calibration.rig, light.clone()).carry(frame).field;
    let unseen = (cut + width..width * height).filter(|&p| frame.mask.pixels[p] > 0.99);
    let (mut pixels, mut coloured) = (0, 0);
    for p in unseen {
        let (sum, plate) = (sum(&field, &light, p), frame.plate.pixels[p]);
        assert!((0..3).all(|c| (sum[c] - plate[c]).abs() < 0.01 * plate[c].max(0.01)), "{sum:?} is not {plate:?}");
        for (lamp, weight) in light.iter().enumerate() {
            let ratio: [f32; 3] = std::array::from_fn(|c| weight[c] * field.plane(lamp, c)[p] / plate[c]);
            let (least, most) = (ratio.into_iter().fold(1.0, f32::min), ratio.into_iter().fold(0.0, f32::max));
            pixels += 1;
            coloured += usize::from(most > 2.0 * least + 0.02);
        }
    }
    assert!(pixels > 2000 && coloured * 100 < pixels, "{coloured} of {pixels}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let stage = &*STAGE;
    let (transfer, frame) = (transfer(), stage.frames[2].clone());
    let carried = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let beside = [1, 3].map(|i| Arc::new(transfer.alone(&stage.frames[i])));
            let steady = transfer.carry_beside(&transfer.alone(&frame), &beside).field;
            [transfer.carry(&frame).field, steady]
        })
    };
    assert!(carried(1) == carried(3));
}

/// A frame with its own grain.
fn grainy(frame: &Frame, seed: u32) -> Frame {
    let mut state = seed;
    let mut grain = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.99 + 0.02 * (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut frame = frame.clone();
    for pixel in &mut frame.plate.pixels {
        *pixel = pixel.map(|v| v * grain());
    }
    frame
}

/// Root mean square change of the light between two fields, as a ratio to the plate under each lamp.
fn change(fields: [&ReflectanceField; 2], plates: [&Image; 2], mask: &Mask) -> f64 {
    let (mut sum, mut squares) = (0.0, 0.0);
    for lamp in 0..fields[0].lamps {
        for p in (0..mask.pixels.len()).filter(|&p| mask.pixels[p] > 0.9) {
            let [a, b] = [0, 1].map(|i| f64::from(fields[i].plane(lamp, 1)[p] / plates[i].pixels[p][1].max(1e-3)));
            sum += a * a;
            squares += (a - b).powi(2);
        }
    }
    (squares / sum).sqrt()
}

#[test]
fn frames_beside_a_frame_steady_its_light() {
    let frame = &STAGE.frames[1];
    let transfer = transfer();
    let frames = [1, 2, 3, 4].map(|seed| Arc::new(transfer.alone(&grainy(frame, seed))));
    let plates = [2, 3].map(|seed| grainy(frame, seed).plate);
    let changed = |fields: [ReflectanceField; 2]| change(fields.each_ref(), plates.each_ref(), &frame.mask);
    let alone = changed([2, 3].map(|seed| transfer.carry(&grainy(frame, seed)).field));
    let among = |t: usize| {
        let beside = [frames[t - 1].clone(), frames[t + 1].clone()];
        transfer.carry_beside(&frames[t], &beside).field
    };
    let steady = changed([1, 2].map(among));
    shown!(Pictures, "The same head in four frames with different grain",
        bound: "0.7 of the change without",
        measured: format!("light changes by {:.1} %, {:.1} % without", 100.0 * steady, 100.0 * alone));
    assert!(steady < 0.7 * alone, "{steady} with, {alone} without");

    // A cut, a jumping pose and a frame of another size give no information.
    let black = Frame { plate: Image::filled(64, 64, [0.0; 3]), ..frame.clone() };
    let jump = &STAGE.poses[5];
    let jump = Frame { index: 0, plate: jump.plate.clone(), mask: jump.exemplar.mask.clone() };
    let small = Frame { index: 0, plate: Image::filled(32, 32, [0.2; 3]), mask: Mask::filled(32, 32, 1.0) };
    let lone = transfer.carry(frame).field;
    let own = transfer.alone(frame);
    for other in [black, jump, small] {
        let beside = [Arc::new(transfer.alone(&other))];
        let field = transfer.carry_beside(&own, &beside).field;
        let moved = change([&field, &lone], [&frame.plate; 2], &frame.mask);
        assert!(moved < 0.02, "{moved}");
    }
}

#[test]
fn a_frame_is_the_same_alone_and_in_a_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = SHOOT.calibrate(folder.path(), "project");
    let open = || {
        let opened = OlatPredictor::open(&project, &calibration, &Device::flex()).unwrap();
        opened.steady(&project, &calibration)
    };
    let frame = |index| Frame::load(&project, &calibration.response, index).unwrap();
    let sequence = open();
    let fields: Vec<_> = (0..SHOOT.frames).map(|index| sequence.predict(&frame(index)).unwrap()).collect();
    for index in [2, 0, 3] {
        assert!(open().predict(&frame(index)).unwrap() == fields[index]);
    }
    // A frame without neighbours, or with a changed picture, is still carried over.
    let mut other = frame(2);
    other.plate = other.plate.map(|pixel| pixel.map(|v| 0.5 * v));
    assert!(sequence.predict(&other).unwrap() != fields[2]);
    let far = Frame { index: usize::MAX, ..frame(2) };
    let (found, lone) = (open().predict(&far).unwrap(), transfer().carry(&far).field);
    let off = change([&found, &lone], [&far.plate; 2], &far.mask);
    assert!(off < 1e-3, "half floats keep {off}");
}

#[test]
fn hard_frames_and_exemplars_give_finite_olats() {
    let stage = &*STAGE;
    let frame = stage.frames[0].clone();
    let finite = |transfer: &Transfer, frame: &Frame| {
        let carried = transfer.carry(frame);
        let values = &carried.field.values;
        assert_eq!(values.len(), stage.calibration.rig.lamps.len() * 3 * frame.mask.pixels.len());
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0));
        let bright = frame.plate.pixels.iter().flatten().copied().fold(0.0, f32::max);
        let most = values.iter().copied().fold(0.0, f32::max);
        assert!(most <= 1e3 * bright.max(1e-3), "{most}");
    };
    let all = transfer();
    let like = |f: fn([f32; 3]) -> [f32; 3]| Frame { plate: frame.plate.map(f), ..frame.clone() };
    finite(&all, &like(|_| [0.0; 3]));
    finite(&all, &like(|_| [1.0; 3]));
    finite(&all, &like(|p| p.map(|v| v * 1e-6)));
    finite(&all, &like(|p| p.map(|v| v * 1e4)));
    finite(&all, &like(|p| if p[0] > 0.2 { [f32::NAN; 3] } else { p }));
    for coverage in [0.0, 1.0] {
        finite(&all, &Frame { mask: frame.mask.map(|_| coverage), ..frame.clone() });
    }
    // Half of the head is missing in the matte, or the frame is upside down.
    let half = Mask::from_fn(64, 64, |x, y| if x < 32 { frame.mask.at(x, y) } else { 0.0 });
    finite(&all, &Frame { mask: half, ..frame.clone() });
    let turned = Image::from_fn(64, 64, |x, y| frame.plate.at(63 - x, 63 - y));
    finite(&all, &Frame { plate: turned, ..frame.clone() });
    let light = || stage.calibration.learnt_light();
    let one = Transfer::new(&stage.poses[..1], &stage.calibration.rig, light());
    finite(&one, &frame);
    finite(&Transfer::new(&[], &stage.calibration.rig, light()), &frame);
    // Lamps missing from every ball, and poses without light.
    let mut unseen: Rig = stage.calibration.rig.clone();
    unseen.lamps.iter_mut().for_each(|lamp| lamp.confidence = 0.0);
    finite(&Transfer::new(&stage.poses, &unseen, light()), &frame);
    let black: Vec<PlatePose> = (stage.poses.iter().cloned())
        .map(|mut pose| {
            pose.plate = pose.plate.map(|_| [0.0; 3]);
            pose.exemplar.olats.iter_mut().for_each(|olat| *olat = olat.map(|_| [0.0; 3]));
            pose
        })
        .collect();
    finite(&Transfer::new(&black, &stage.calibration.rig, light()), &frame);
    shown!(Pictures, "Frames black, white, NaN, upside down or half cut; exemplars one, none, black, or under lamps that no ball shows",
        done: "weights and sums have floors; no exemplar means black OLATs");
}

#[test]
fn the_sketch_is_reached() {
    let Some(sketch) = test_support::shared("transfer/transfer.py") else { return };
    let Some(python) = test_support::python(&["numpy", "scipy", "cv2"]) else { return };
    let stage = &*STAGE;
    let grey = |image: &Image| image.map(|p| [luminance(p); 3]);
    let mut frame = stage.frames[stage.known].clone();
    frame.plate = grey(&frame.plate);
    let light = stage.calibration.learnt_light();
    let weights: Vec<[f32; 3]> = light.iter().map(|w| [luminance(*w); 3]).collect();
    // One energy for all lamps, as in the sketch.
    let mut rig = stage.calibration.rig.clone();
    rig.lamps.iter_mut().for_each(|lamp| lamp.energy = [1.0; 3]);
    let poses: Vec<PlatePose> = (stage.poses.iter())
        .map(|pose| PlatePose {
            plate: grey(&pose.plate),
            exemplar: Exemplar { olats: pose.exemplar.olats.iter().map(grey).collect(), ..pose.exemplar.clone() },
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, values: &[f32]| {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    };
    let plane = |image: &Image| -> Vec<f32> { image.pixels.iter().map(|p| p[0]).collect() };
    write("frame", &plane(&frame.plate));
    write("frame_mask", &frame.mask.pixels);
    for (n, pose) in poses.iter().enumerate() {
        write(&format!("lit_{n}"), &plane(&pose.plate));
        write(&format!("mask_{n}"), &pose.exemplar.mask.pixels);
        write(&format!("olats_{n}"), &pose.exemplar.olats.iter().flat_map(plane).collect::<Vec<_>>());
    }
    let about = serde_json::json!({
        "width": frame.plate.width, "height": frame.plate.height, "poses": poses.len(),
        "directions": rig.lamps.iter().map(|lamp| lamp.direction.to_array()).collect::<Vec<_>>(),
        "weights": weights.iter().map(|w| w[0]).collect::<Vec<_>>(),
    });
    std::fs::write(folder.path().join("about.json"), about.to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/transfer.py");
    let ran = std::process::Command::new(python).arg(script).arg(sketch).arg(folder.path()).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let bytes = std::fs::read(folder.path().join("olats")).unwrap();
    let values: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let pixels = frame.mask.pixels.len();
    let sketched: Vec<Image> = (values.chunks_exact(pixels))
        .map(|plane| Image { width: 64, height: 64, pixels: plane.iter().map(|&v| [v; 3]).collect() })
        .collect();
    let truth: Vec<Image> = stage.truth.iter().map(grey).collect();
    let found = decibels(&Transfer::new(&poses, &rig, weights).carry(&frame).field, &truth, &frame.mask);
    let expected = decibels(&ReflectanceField::from_olats(&sketched), &truth, &frame.mask);
    assert!(found > expected - 0.05, "{found:.2} dB, the sketch {expected:.2} dB");
    println!("{found:.2} dB, the sketch {expected:.2} dB");
}

/// Exemplars at three times the working size add detail within its pixels.
#[test]
fn light_finer_than_the_working_size_is_carried_over() {
    let shoot = TestShoot { frames: 4, lamps: 12, size: 96, working_size: 32 };
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = shoot.calibrate(folder.path(), "project");
    let truth = Truth::open(&project, &folder.path().join("shoot")).unwrap();
    let known = *truth.frames.iter().find(|&&frame| truth.has_olats(frame)).unwrap();
    let (frame, filmed) = Frame::load_filmed(&project, &calibration.response, known).unwrap();
    let plain = Plate::from_filmed(filmed, &frame).unwrap();
    let carried = Transfer::open(&project, &calibration).unwrap().carry(&frame);
    let detail = ExemplarDetail::read(&project, &calibration).unwrap();
    let bytes = detail.as_ref().unwrap().bytes();
    assert!((1 << 16..96 * 96 * 3 * 12 * 8).contains(&bytes), "{bytes} bytes");
    let fine_field = FineField {
        exemplars: Arc::new(OnceLock::from(detail)),
        places: carried.places.clone(),
        working: frame.mask.width,
    };
    let fine = FineField::on(Some(fine_field.clone()), plain.clone());
    assert!(fine.has_fine_light() && !plain.has_fine_light());

    let alone = |lamp: usize, value: f32| -> Vec<[f32; 3]> {
        (0..12).map(|other| [if other == lamp { value } else { 0.0 }; 3]).collect()
    };
    let shown = |plate: &Plate| {
        let olats: Vec<Image> = (0..12)
            .map(|lamp| {
                let olat = carried.field.olat(lamp);
                at_plate(olat, (Some(plate), &frame.mask), &alone(lamp, 1.0))
            })
            .collect();
        ReflectanceField::from_olats(&olats)
    };
    let truths = truth.olats_at(known, PictureSize::Plate).unwrap();
    let [with, without] = [&fine, &plain].map(|plate| decibels(&shown(plate), &truths, &plate.matte));
    assert!(with > without + 0.5, "{with:.2} dB with fine light, {without:.2} dB without");

    // Linear in the light, and close to zero under the interview's own.
    let ratio = |weights: &[[f32; 3]]| fine_field.clone().fine_light(&plain).ratio(weights).unwrap();
    let size = |image: &Image| image.pixels.iter().flatten().map(|v| v.abs()).sum::<f32>();
    let both: Vec<[f32; 3]> =
        alone(2, 0.7).iter().zip(alone(5, -1.3)).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect();
    let apart = ratio(&alone(2, 0.7)).pixels.into_iter().zip(ratio(&alone(5, -1.3)).pixels);
    for ((one, other), both) in apart.zip(ratio(&both).pixels) {
        for c in 0..3 {
            assert!((one[c] + other[c] - both[c]).abs() < 1e-4);
        }
    }
    let light = calibration.learnt_light();
    let single: f32 = (0..12)
        .map(|lamp| {
            let weights: Vec<_> =
                alone(lamp, 1.0).iter().zip(&light).map(|(on, light)| light.map(|v| v * on[0])).collect();
            size(&ratio(&weights))
        })
        .sum();
    let own = size(&ratio(&light));
    assert!(own < 0.12 * single, "{own} under the interview's light, {single} under its lamps");
}

#[test]
fn exemplars_of_the_working_size_have_no_finer_light() {
    let folder = tempfile::tempdir().unwrap();
    let (project, calibration) = TestShoot::default().calibrate(folder.path(), "project");
    assert!(ExemplarDetail::read(&project, &calibration).unwrap().is_none());
}
