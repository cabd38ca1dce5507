use super::super::Lamp;
use super::*;
use glam::Vec3;
use imaging::Image;
use proptest::prelude::*;
use test_support::shown;

pub(crate) fn rig(directions: &[Vec3]) -> Rig {
    let lamp = |(i, direction): (usize, &Vec3)| Lamp {
        energy: [0.02 + 0.001 * i as f32, 0.03, 0.01 + 0.002 * i as f32],
        ..Lamp::new(format!("olat_{i:02}"), direction.normalize())
    };
    Rig { lamps: directions.iter().enumerate().map(lamp).collect() }
}

pub(crate) fn lattice(n: usize) -> Vec<Vec3> {
    (0..n)
        .map(|i| {
            let (y, turn) = (1.0 - (2.0 * i as f32 + 1.0) / n as f32, i as f32 * 2.399_963);
            Vec3::new((1.0 - y * y).sqrt() * turn.cos(), y, (1.0 - y * y).sqrt() * turn.sin())
        })
        .collect()
}

/// Rigs that are hard for a hull, and two ordinary ones.
pub(crate) fn rigs() -> Vec<(&'static str, Rig)> {
    let ring = |n: usize, y: f32| {
        (0..n).map(move |i| {
            Vec3::from_array([
                (i as f32 * std::f32::consts::TAU / n as f32).cos(),
                y,
                (i as f32 * std::f32::consts::TAU / n as f32).sin(),
            ])
        })
    };
    let cube = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
    vec![
        ("one lamp", rig(&[Vec3::new(0.3, 0.5, 0.8)])),
        ("two lamps", rig(&[Vec3::X, Vec3::Y])),
        ("two opposite lamps", rig(&[Vec3::X, Vec3::NEG_X])),
        ("three lamps", rig(&[Vec3::X, Vec3::Y, Vec3::Z])),
        ("three lamps in a plane through the subject", rig(&[Vec3::X, Vec3::NEG_X, Vec3::Z])),
        ("five lamps in one direction", rig(&[Vec3::Z; 5])),
        ("a ring at the height of the subject", rig(&ring(12, 0.0).collect::<Vec<_>>())),
        ("rings and a lamp on the pole", rig(&ring(8, 0.0).chain(ring(6, 1.0)).chain([Vec3::Y]).collect::<Vec<_>>())),
        ("both poles and a ring", rig(&ring(4, 0.0).chain([Vec3::Y, Vec3::NEG_Y]).collect::<Vec<_>>())),
        ("the corners of a cube", rig(&cube.collect::<Vec<_>>())),
        ("the upper half", rig(&lattice(82)[..41])),
        ("a narrow cone", rig(&lattice(600)[..30])),
        ("pairs", rig(&lattice(20).iter().flat_map(|d| [*d, *d + 0.001]).collect::<Vec<_>>())),
        ("41 lamps", rig(&lattice(41))),
        ("146 lamps", rig(&lattice(146))),
    ]
}

pub(crate) fn speckled(seed: usize) -> Environment {
    let image = Image::from_fn(64, 32, |x, y| {
        [0, 1, 2].map(|c| if (x * 31 + y * 17 + c * 7 + seed * 13) % 41 < 3 { 20.0 * (c + 1) as f32 } else { 0.1 })
    });
    Environment::from_radiance("speckled", image)
}

pub(crate) fn sun(x: usize, y: usize, width: usize) -> Environment {
    let mut image = Image::filled(width, width / 2, [0.0; 3]);
    image.pixels[y * width + x] = [1e6, 8e5, 6e5];
    Environment::from_radiance("sun", image)
}

/// Σ w_i·e_i per channel: the energy of the weights.
pub(crate) fn energy(weights: &LightWeights, rig: &Rig) -> [f64; 3] {
    std::array::from_fn(|c| {
        weights.per_lamp.iter().zip(&rig.lamps).map(|(w, lamp)| f64::from(w[c]) * f64::from(lamp.energy[c])).sum()
    })
}

/// All kinds of partition.
pub(crate) fn kinds() -> [fn(&Rig, usize) -> Partition; 3] {
    [Partition::smooth, Partition::cells, Partition::fit]
}

pub(crate) fn assert_sound(name: &str, weights: &LightWeights, rig: &Rig, environment: &Environment) {
    assert!(weights.per_lamp.iter().flatten().all(|w| w.is_finite() && *w >= 0.0), "{name}: {weights:?}");
    assert!((0.0..=1.0).contains(&weights.uncovered), "{name}: {}", weights.uncovered);
    for (kept, is) in energy(weights, rig).into_iter().zip(environment.energy()) {
        assert!((kept - is).abs() <= 1e-5 * is, "{name}: {is} became {kept}");
    }
}

/// Weights of the default kind.
fn default_weights(environment: &Environment, rig: &Rig, yaw_deg: f32) -> LightWeights {
    Partition::new(Weighting::default(), rig).weights(environment, yaw_deg)
}

#[test]
fn energy_is_kept_by_every_rig() {
    for (name, rig) in rigs() {
        let partitions = kinds().map(|kind| kind(&rig, 64));
        for (environment, yaw) in
            [(speckled(1), 0.0), (speckled(2), 77.7), (sun(0, 0, 64), 181.0), (sun(63, 31, 64), -5.5)]
        {
            for partition in &partitions {
                assert_sound(name, &partition.weights(&environment, yaw), &rig, &environment);
            }
        }
    }
    shown!(Light, "Coplanar lamps, twins, a ring, a cone, both poles, opposite lamps: 15 rigs that are hard for a hull",
        bound: "energy within 1e-5, all weights finite and ≥ 0", measured: "holds");
}

proptest! {
    #[test]
    fn energy_is_kept_by_any_lamps(
        lamps in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 1..60),
        yaw in -720.0f32..720.0, seed in 0usize..100,
    ) {
        let directions: Vec<Vec3> = lamps.into_iter().map(|(x, y, z)| Vec3::new(x, y, z + 1.001)).collect();
        let rig = rig(&directions);
        let environment = speckled(seed);
        for kind in kinds() {
            assert_sound("any", &kind(&rig, 32).weights(&environment, yaw), &rig, &environment);
        }
    }

    #[test]
    fn a_whole_turn_changes_nothing(yaw in -400.0f32..400.0, seed in 0usize..20) {
        let partition = Partition::smooth(&rig(&lattice(41)), 64);
        let environment = speckled(seed);
        let (once, again) = (partition.weights(&environment, yaw), partition.weights(&environment, yaw + 360.0));
        for (a, b) in once.per_lamp.iter().flatten().zip(again.per_lamp.iter().flatten()) {
            // yaw + 360 is rounded to 6e-5 degrees.
            prop_assert!((a - b).abs() <= 1e-3 * (a + b).max(1.0));
        }
    }

    #[test]
    fn weights_are_linear_in_the_environment(a in 0.0f32..10.0, b in 0.0f32..10.0, yaw in 0.0f32..360.0) {
        let partition = Partition::smooth(&rig(&lattice(41)), 64);
        let (one, two) = (speckled(1), speckled(2));
        let mixed = Image {
            pixels: one.radiance.pixels.iter().zip(&two.radiance.pixels)
                .map(|(p, q)| [0, 1, 2].map(|c| a * p[c] + b * q[c])).collect(),
            ..one.radiance.clone()
        };
        let mixed = partition.weights(&Environment::from_radiance("mixed", mixed), yaw);
        let (one, two) = (partition.weights(&one, yaw), partition.weights(&two, yaw));
        let both = one.per_lamp.iter().flatten().zip(two.per_lamp.iter().flatten());
        for (mixed, (one, two)) in mixed.per_lamp.iter().flatten().zip(both) {
            let sum = a * one + b * two;
            prop_assert!((mixed - sum).abs() <= 1e-4 * sum.max(1.0));
        }
    }
}

#[test]
fn even_lamps_share_an_even_sky_evenly() {
    let rig =
        Rig { lamps: rig(&lattice(41)).lamps.into_iter().map(|lamp| Lamp { energy: [0.1; 3], ..lamp }).collect() };
    let sky = Environment::from_radiance("sky", Image::filled(512, 256, [1.0; 3]));
    let even = 4.0 * std::f32::consts::PI / 41.0 / 0.1;
    let mut most = 0.0f32;
    for kind in kinds() {
        let weights = kind(&rig, 256).weights(&sky, 33.0);
        assert_eq!(weights.uncovered, 0.0);
        for w in weights.per_lamp.iter().flatten() {
            assert!((w / even - 1.0).abs() < 0.25, "{w} is far from {even}");
            most = most.max((w / even - 1.0).abs());
        }
    }
    shown!(Light, "An even sky over 41 even lamps",
        bound: "every weight within 25 % of the mean, the spread of the lamps' cells",
        measured: format!("{:.1} %", 100.0 * most));
}

#[test]
fn a_sun_does_not_jump_as_it_turns_but_by_cells() {
    // Texel by texel: between them even a jump is spread out.
    const TEXEL_DEG: f32 = 360.0 / 256.0;
    for ((name, rig), kind) in
        (rigs().into_iter()).flat_map(|rig| ["smooth", "cells", "fit"].map(|kind| (rig.clone(), kind)))
    {
        let partition = match kind {
            "smooth" => Partition::smooth(&rig, 256),
            "cells" => Partition::cells(&rig, 256),
            _ => Partition::fit(&rig, 256),
        };
        let day = sun(100, 50, 256);
        let total = day.energy()[1];
        let given = |texel: usize| -> Vec<f64> {
            let weights = partition.weights(&day, texel as f32 * TEXEL_DEG).per_lamp;
            let lamps = weights.iter().zip(&rig.lamps);
            lamps.map(|(w, l)| f64::from(w[1]) * f64::from(l.energy[1]) / total).collect()
        };
        let mut before = given(0);
        let mut largest = 0.0f64;
        for texel in 1..=256 {
            let after = given(texel);
            let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
            largest = largest.max(change.sum::<f64>() / 2.0);
            before = after;
        }
        println!("{name}, {kind}: {largest:.3} of the light moved in a texel");
        if kind == "cells" {
            // All of it, unless one cell spans the full path.
            assert!(!(1e-6..0.99).contains(&largest), "{name}: {largest}");
        } else {
            // Proportional to the rotation, at the rate of lamps a few degrees apart.
            assert!(largest < 0.2, "{name}, {kind}: {largest}");
        }
    }
}

#[test]
fn a_positive_yaw_moves_light_to_larger_u() {
    // The sun is behind the subject, facing the camera; a quarter turn moves it to camera-right.
    let rig = rig(&[Vec3::NEG_Z, Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y]);
    let day = sun(128, 64, 256);
    for kind in kinds() {
        let weights = kind(&rig, 256).weights(&day, 90.0);
        let brightest = (0..6).max_by(|&i, &j| weights.per_lamp[i][1].total_cmp(&weights.per_lamp[j][1]));
        assert_eq!(brightest, Some(1), "{weights:?}");
    }
}

#[test]
fn light_from_below_is_uncovered_by_lamps_above() {
    let rig = rig(&lattice(82)[..41]);
    let half = |lower: bool| {
        let image =
            Image::from_fn(128, 64, |_, y| if (y >= 36) == lower && (y < 28) != lower { [1.0; 3] } else { [0.0; 3] });
        Environment::from_radiance("half", image)
    };
    let [below, above] = [true, false].map(|b| default_weights(&half(b), &rig, 10.0).uncovered);
    assert!(below > 0.95);
    assert!(above < 0.05);
    shown!(Light, "Lamps only on the upper half of the sphere",
        bound: "uncovered: over 95 % of light from below, under 5 % of light from above",
        measured: format!("{:.1} % and {:.1} %", 100.0 * below, 100.0 * above));
}

#[test]
fn one_lamp_takes_everything_and_covers_nothing() {
    let rig = rig(&[Vec3::Y]);
    let weights = default_weights(&speckled(4), &rig, 12.0);
    assert_sound("one", &weights, &rig, &speckled(4));
    assert_eq!(weights.uncovered, 1.0);
}

#[test]
fn lamps_in_one_direction_share_equally() {
    let rig =
        Rig { lamps: rig(&[Vec3::Z; 3]).lamps.into_iter().map(|lamp| Lamp { energy: [0.5; 3], ..lamp }).collect() };
    let weights = default_weights(&speckled(4), &rig, 0.0).per_lamp;
    assert!(weights.iter().all(|w| *w == weights[0]));
    shown!(Light, "Several lamps in one direction",
        bound: "equal weights, bit for bit", measured: "equal");
}

#[test]
fn a_lamp_that_was_not_seen_gets_nothing() {
    let mut rig = rig(&lattice(41));
    rig.lamps[7].energy = [0.0; 3];
    rig.lamps[8].confidence = 0.0;
    rig.lamps[9].direction = Vec3::NAN;
    let environment = speckled(5);
    let weights = default_weights(&environment, &rig, 45.0);
    assert_sound("unseen", &weights, &rig, &environment);
    assert!(weights.per_lamp[7..10].iter().all(|w| *w == [0.0; 3]));
}

#[test]
fn no_light_and_no_lamps_give_zeros() {
    let black = Environment::from_radiance("black", Image::filled(64, 32, [0.0; 3]));
    for (name, rig) in rigs() {
        let weights = default_weights(&black, &rig, 30.0);
        assert!(weights.per_lamp.iter().all(|w| *w == [0.0; 3]) && weights.uncovered == 0.0, "{name}");
    }
    let nothing = default_weights(&speckled(1), &Rig::default(), 30.0);
    assert_eq!(nothing, LightWeights { per_lamp: vec![], uncovered: 1.0 });
    shown!(Light, "A black environment; a rig without lamps",
        bound: "exactly 0", measured: "0");
}

/// Cost of a rotation besides solving: one multiply-add per channel for each share of a texel.
#[test]
fn a_live_turn_reads_few_numbers() {
    for n in [41, 146, 931] {
        let rig = rig(&lattice(n));
        let texels = Partition::WIDTH * Partition::WIDTH / 2;
        for (kind, name, most) in [
            (Partition::cells as fn(&Rig, usize) -> Partition, "cells", 1),
            (Partition::smooth, "smooth", 3),
            (Partition::fit, "fit", 28),
        ] {
            let partition = kind(&rig, Partition::WIDTH);
            let shares = partition.shares.len() as f64 / texels as f64;
            println!("{n} lamps, {name}: {shares:.1} shares a texel");
            assert!(shares <= f64::from(most) && shares >= 1.0, "{n} lamps, {name}: {shares}");
        }
    }
}

#[test]
fn soft_weights_of_older_versions_are_the_default() {
    use clap::ValueEnum;
    let lighting: crate::Lighting = toml::from_str("weighting = \"soft\"").unwrap();
    assert_eq!(lighting, crate::Lighting::default());
    assert_eq!(Weighting::from_str("soft", false), Ok(Weighting::default()));
}

mod hard_cases;
mod invariants;
