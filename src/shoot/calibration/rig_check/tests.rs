use super::*;
use glam::Quat;
use proptest::prelude::*;

/// Numbers from 0 to 1.
#[derive(Debug)]
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn direction(&mut self) -> Vec3 {
        let (y, turn) = (2.0 * self.unit() - 1.0, std::f32::consts::TAU * self.unit());
        let radius = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(radius * turn.cos(), y, radius * turn.sin()).normalize()
    }
}

const CONE_DEG: f32 = 10.0;

/// A realistic dome: lamps evenly spaced or random, at least half the even spacing apart and none behind the ball.
fn layout(n: usize, even: bool, random: &mut Random) -> Vec<Vec3> {
    let spacing = (0.5 * (1.0 - 2.0 / n as f32).acos()).to_degrees().min(40.0);
    let mut directions: Vec<Vec3> = Vec::new();
    let mut i = 0;
    while directions.len() < n {
        let direction = if even && i < 2 * n {
            let y = 1.0 - (2 * i + 1) as f32 / (2 * n) as f32;
            let (sin, cos) = (2.399_963 * i as f32).sin_cos();
            let radius = (1.0 - y * y).sqrt();
            Vec3::new(radius * cos, y, radius * sin).normalize()
        } else {
            random.direction()
        };
        i += 1;
        let clear = direction.angle_between(Vec3::NEG_Z).to_degrees() > CONE_DEG + 12.0;
        let apart = |d: &Vec3| d.angle_between(direction).to_degrees() > spacing;
        if clear && directions.iter().all(apart) {
            directions.push(direction);
        }
    }
    directions
}

/// A rig as measured with a ball: half a degree off, lamps of different strength, banks of different width.
fn measured(layout: &[Vec3], random: &mut Random) -> Rig {
    let lamp = |(i, direction): (usize, &Vec3)| {
        let brightness = 0.01 * (1.0 + 2.0 * random.unit());
        Lamp {
            name: format!("olat_{i:02}"),
            direction: (*direction + 0.009 * random.unit() * random.direction()).normalize(),
            energy: [0.9, 1.0, 0.8].map(|c| c * brightness),
            spread_deg: 2.0 + 4.0 * random.unit(),
            confidence: 1.0,
            clipped: 0.0,
        }
    };
    Rig { lamps: layout.iter().enumerate().map(lamp).collect() }
}

fn turned(layout: &[Vec3], turn: Quat) -> Vec<Vec3> {
    layout.iter().map(|d| (turn * *d).normalize()).collect()
}

fn faults(findings: &[Finding]) -> Vec<(Fault, Vec<usize>)> {
    findings.iter().map(|f| (f.fault, f.lamps.clone())).collect()
}

/// Any dome with its random numbers, and any rotation.
fn any_dome() -> impl Strategy<Value = (Vec<Vec3>, Random, Quat)> {
    (3usize..100, any::<bool>(), 1u64..100_000).prop_map(|(n, even, seed)| {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let layout = layout(n, even, &mut random);
        let turn = Quat::from_axis_angle(random.direction(), 3.0 * random.unit());
        (layout, random, turn)
    })
}

proptest! {
    #[test]
    fn a_proper_rig_gives_no_sentence((layout, mut random, turn) in any_dome()) {
        let rig = measured(&layout, &mut random);
        prop_assert_eq!(check(&rig, CONE_DEG, &[]), vec![]);
        prop_assert_eq!(check(&rig, CONE_DEG, &layout), vec![]);
        prop_assert_eq!(check(&rig, CONE_DEG, &turned(&layout, turn)), vec![]);
    }

    #[test]
    fn two_swapped_olats_stand_out((layout, mut random, turn) in any_dome(), a in 0usize..100, b in 0usize..100) {
        let n = layout.len();
        let (a, b) = ((a % n).min(b % n), (a % n).max(b % n));
        prop_assume!(n >= 8 && a != b);
        let mut rig = measured(&layout, &mut random);
        rig.lamps.swap(a, b);
        for (i, lamp) in rig.lamps.iter_mut().enumerate() {
            lamp.name = format!("olat_{i:02}");
        }
        let found = check(&rig, CONE_DEG, &turned(&layout, turn));
        prop_assert_eq!(faults(&found), vec![(Fault::Swapped, vec![a, b])]);
        let named = [a, b].iter().all(|&i| found[0].sentence.contains(&rig.lamps[i].name));
        prop_assert!(named, "{}", found[0].sentence);
    }

    #[test]
    fn names_that_are_one_off_after_a_missed_shot_are_found(
        (layout, mut random, turn) in any_dome(), missed in 0.6f32..0.9,
    ) {
        let n = layout.len();
        let missed = (missed * n as f32) as usize;
        prop_assume!(n >= 10 && n - missed >= 2);
        // The last name then has a lamp again: the missed lamp's slot is at the end.
        let mut order: Vec<usize> = (0..n).collect();
        order[missed..].rotate_left(1);
        let places: Vec<Vec3> = order.iter().map(|&i| layout[i]).collect();
        let found = check(&measured(&places, &mut random), CONE_DEG, &turned(&layout, turn));
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        prop_assert_eq!((found[0].fault, found[0].lamps.len()), (Fault::Swapped, n - missed));
    }

    #[test]
    fn a_mirrored_layout_is_called_so((layout, mut random, _turn) in any_dome()) {
        prop_assume!(layout.len() >= 16);
        let flipped: Vec<Vec3> = layout.iter().map(|d| d.with_x(-d.x)).collect();
        let found = check(&measured(&layout, &mut random), CONE_DEG, &flipped);
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        prop_assert!(found[0].fault == Fault::WrongLayout && found[0].sentence.contains("mirror"), "{:?}", found);
    }

    #[test]
    fn a_layout_of_another_dome_is_called_so((layout, mut random, turn) in any_dome(), seed in 1u64..1000) {
        prop_assume!(layout.len() >= 16);
        let other = self::layout(layout.len(), false, &mut Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1));
        let found = check(&measured(&layout, &mut random), CONE_DEG, &turned(&other, turn));
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        prop_assert_eq!(found[0].fault, Fault::WrongLayout);
    }

    #[test]
    fn lamps_in_any_other_order_are_called_so((layout, mut random, _turn) in any_dome()) {
        let n = layout.len();
        prop_assume!(n >= 16);
        let rig = measured(&layout, &mut random);
        let reversed: Vec<Vec3> = layout.iter().rev().copied().collect();
        let found = check(&rig, CONE_DEG, &reversed);
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        prop_assert_eq!(found[0].fault, Fault::Swapped);
        prop_assert!(found[0].lamps.len() >= n - 1);
    }

    #[test]
    fn any_numbers_are_survived(
        lamps in proptest::collection::vec((any::<[f32; 3]>(), any::<[f32; 3]>(), any::<f32>(), any::<f32>()), 0..12),
        layout in proptest::collection::vec(any::<[f32; 3]>(), 0..12), cone in any::<f32>(),
    ) {
        let lamps = lamps.into_iter().map(|(direction, energy, confidence, clipped)| Lamp {
            name: "any".into(), direction: Vec3::from(direction), energy, spread_deg: clipped, confidence, clipped,
        });
        let rig = Rig { lamps: lamps.collect() };
        for finding in check(&rig, cone, &layout.into_iter().map(Vec3::from).collect::<Vec<_>>()) {
            prop_assert!(finding.lamps.iter().all(|&i| i < rig.lamps.len()));
        }
    }
}

fn forty_one() -> (Vec<Vec3>, Rig) {
    let mut random = Random(77);
    let layout = layout(41, true, &mut random);
    let rig = measured(&layout, &mut random);
    (layout, rig)
}

#[test]
fn a_lamp_that_is_out_is_named() {
    let (layout, mut rig) = forty_one();
    rig.lamps[7].confidence = 0.0;
    rig.lamps[9].energy[2] = 0.0;
    for layout in [&layout[..], &[]] {
        let found = check(&rig, CONE_DEG, layout);
        assert_eq!(faults(&found), [(Fault::NotSeen, vec![7, 9])]);
        assert!(found[0].sentence.contains("olat_07, olat_09"), "{}", found[0].sentence);
    }
}

#[test]
fn a_lamp_behind_the_ball_is_told_from_one_that_is_out() {
    let (mut layout, mut rig) = forty_one();
    // One lamp fully hidden, known only from the layout, and one partly visible.
    layout[5] = Vec3::NEG_Z;
    rig.lamps[5].confidence = 0.0;
    let beside = Vec3::new(0.0, 14f32.to_radians().sin(), -14f32.to_radians().cos());
    (layout[6], rig.lamps[6].direction) = (beside, beside);
    assert_eq!(faults(&check(&rig, CONE_DEG, &layout)), [(Fault::BehindBall, vec![5, 6])]);
    assert_eq!(faults(&check(&rig, CONE_DEG, &[])), [(Fault::NotSeen, vec![5]), (Fault::BehindBall, vec![6])]);
}

#[test]
fn a_dark_lamp_and_a_clipped_one_are_named() {
    let (layout, mut rig) = forty_one();
    rig.lamps[3].energy = rig.lamps[3].energy.map(|e| 0.005 * e);
    rig.lamps[4].clipped = 0.4;
    assert_eq!(faults(&check(&rig, CONE_DEG, &layout)), [(Fault::Dark, vec![3]), (Fault::Clipped, vec![4])]);
}

#[test]
fn a_ball_that_is_clipped_everywhere_says_so_in_one_sentence() {
    let (layout, mut rig) = forty_one();
    rig.lamps.iter_mut().for_each(|lamp| lamp.clipped = 0.9);
    let found = check(&rig, CONE_DEG, &layout);
    assert_eq!(faults(&found), [(Fault::Clipped, (0..41).collect())]);
    assert!(found[0].sentence.contains("olat_07 and 33 more"), "{}", found[0].sentence);
}

#[test]
fn a_lamp_that_was_taken_twice_is_named() {
    let (layout, mut rig) = forty_one();
    rig.lamps[12] = Lamp { name: rig.lamps[12].name.clone(), ..rig.lamps[30].clone() };
    rig.lamps[12].energy[0] *= 1.02;
    for layout in [&layout[..], &[]] {
        assert_eq!(faults(&check(&rig, CONE_DEG, layout)), [(Fault::SameLamp, vec![12, 30])]);
    }
}

#[test]
fn a_warm_and_a_cool_lamp_in_one_housing_are_two() {
    let (_, mut rig) = forty_one();
    rig.lamps[12].direction = rig.lamps[30].direction;
    rig.lamps[12].energy = [0.02, 0.015, 0.006];
    rig.lamps[30].energy = [0.012, 0.015, 0.02];
    assert_eq!(check(&rig, CONE_DEG, &[]), []);
}

#[test]
fn a_lamp_that_was_moved_is_named() {
    let (layout, mut rig) = forty_one();
    // Moved halfway to the next place, where there is no other lamp.
    let next = (0..41).filter(|&i| i != 20).min_by(|&i, &j| {
        let to = |k: usize| layout[k].angle_between(layout[20]);
        to(i).total_cmp(&to(j))
    });
    rig.lamps[20].direction = (layout[20] + layout[next.unwrap()]).normalize();
    assert_eq!(faults(&check(&rig, CONE_DEG, &layout)), [(Fault::Misplaced, vec![20])]);
}

#[test]
fn a_layout_of_another_number_of_lamps_is_refused() {
    let (layout, rig) = forty_one();
    assert_eq!(check(&rig, CONE_DEG, &layout[..40])[0].fault, Fault::WrongLayout);
    assert_eq!(check(&Rig::default(), CONE_DEG, &[]), []);
}

#[test]
fn pictures_under_two_names_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let pictures: Vec<Picture> = ["a", "bb", "a", "c", "bb", "a"]
        .iter()
        .enumerate()
        .map(|(i, content)| {
            let path = folder.path().join(format!("{i}.png"));
            std::fs::write(&path, content).unwrap();
            Picture::File(path)
        })
        .collect();
    assert_eq!(same_pictures(&pictures).unwrap(), [vec![0, 2, 5], vec![1, 4]]);
    assert!(same_pictures(&[folder.path().join("none.png").into()]).is_err());
}

#[test]
fn the_shared_shoot_has_a_proper_rig() {
    use super::super::{code_values::ResponseTable, probe::Probes, tests::shared_shoot};
    use base::progress::Progress;
    use imaging::DualGamma;
    let Some((project, _home, truth, layout)) = shared_shoot("probes") else { return };
    let probes = Probes::load(&project, &Progress::silent()).unwrap();
    let gamma = |name: &str| truth[name].as_f64().unwrap() as f32;
    let table = ResponseTable::new(&DualGamma { gamma1: gamma("g1"), gamma2: gamma("g2") });
    let (mut rig, _) = probes.rig(project.settings.shoot.all_lamps(), &table);
    let cone = probes.ball().blind_half_angle_deg;
    let found = check(&rig, cone, &layout);
    println!("{found:#?}");
    // The dome is a full sphere: some bank is always behind the ball.
    let others = |found: &[Finding]| -> Vec<(Fault, Vec<usize>)> {
        faults(found).into_iter().filter(|(fault, _)| *fault != Fault::BehindBall).collect()
    };
    assert_eq!(others(&found), []);
    rig.lamps.swap(4, 31);
    assert_eq!(others(&check(&rig, cone, &layout)), [(Fault::Swapped, vec![4, 31])]);
}
