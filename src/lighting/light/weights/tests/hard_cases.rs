//! Light and lamps that are numerically hard, through the code paths of the jobs.

use super::*;
use crate::{EnvironmentWeights, Lighting};
use glam::{DQuat, Quat};
use std::cell::Cell;
use test_support::shown;

/// Largest relative change of energy by rounding: shares and weights are rounded once, each to 2⁻²⁴ of itself, and
/// all terms have one sign. The sums are in f64.
const ROUNDED_TWICE: f64 = f32::EPSILON as f64 + 1e-12;

/// Relative energy difference between the weights and the environment. Asserts finite, non-negative weights.
fn energy_lost(weights: &LightWeights, rig: &Rig, environment: &Environment) -> f64 {
    let sound = |w: &f32| w.is_finite() && *w >= 0.0;
    assert!(weights.per_lamp.iter().flatten().all(sound), "{}: {weights:?}", environment.name);
    let pairs = energy(weights, rig).into_iter().zip(environment.energy());
    pairs.map(|(kept, is)| (kept - is).abs() / is.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
}

/// An environment of `around` with `pixels` of value `inside`.
fn spotted((width, height): (usize, usize), around: f32, pixels: &[(usize, usize)], inside: [f32; 3]) -> Environment {
    let mut image = Image::filled(width, height, [around; 3]);
    for (x, y) in pixels {
        image.pixels[y * width + x] = inside;
    }
    Environment::from_radiance("spotted", image)
}

/// Hard columns: both sides of the seam, the front, and in between.
fn columns_of(width: usize) -> [usize; 5] {
    [0, 1, width / 3, width / 2, width - 1]
}

#[test]
fn a_sun_of_one_texel_keeps_its_energy_in_every_row_and_under_every_turn() {
    let rigs = [rig(&lattice(41)), rig(&lattice(82)[..41])];
    let mut most = 0.0f64;
    let mut tilted = 0.0f64;
    for rig in &rigs {
        for kind in kinds() {
            let partition = kind(rig, 64);
            for (x, y) in (0..32).flat_map(|y| columns_of(64).map(|x| (x, y))) {
                let day = sun(x, y, 64);
                for yaw in [0.0, 3.3, 180.0] {
                    let weights = partition.weights(&day, yaw);
                    most = most.max(energy_lost(&weights, rig, &day));
                }
                let turn = rotation(10.0, 77.0, -33.0);
                let weights = partition.turned_weights(&day, turn);
                tilted = tilted.max(energy_lost(&weights, rig, &day));
            }
        }
    }
    assert!(most.max(tilted) <= ROUNDED_TWICE, "{most} {tilted}");
    shown!(Light, "A sun of 10⁶ in one texel: every row, both poles, both sides of the seam, rotated freely",
        bound: "energy within 1.2e-7, one rounding of shares and one of weights",
        measured: format!("{:.1e}", most.max(tilted)));
}

/// The path of the jobs: a panorama of any size is reduced and its yaws are tabulated.
#[test]
fn panoramas_of_any_shape_keep_a_sun_s_energy() {
    let rig = rig(&lattice(41));
    let mut weigh: Option<EnvironmentWeights> = None;
    let mut most = 0.0f64;
    for (w, h) in [(1, 1), (2, 1), (1, 7), (7, 1), (97, 53), (1024, 512), (300, 301)] {
        for (x, y) in [(0, 0), (w - 1, h - 1), (w / 2, h / 2)] {
            let day = spotted((w, h), 0.5, &[(x, y)], [1e6, 1e5, 1e4]);
            let mut weights = match weigh.take() {
                Some(weights) => weights.environment(&day),
                None => EnvironmentWeights::new(&day, &rig, Weighting::Fit),
            };
            for yaw in [0.0, 123.4] {
                let weights = weights.weights(&Lighting::default(), yaw, 1.0);
                most = most.max(energy_lost(&weights, &rig, &day));
            }
            weigh = Some(weights);
        }
    }
    // Values are rounded when columns and when rows are averaged, each time to 2⁻²⁴. Fourier transforms are in f64.
    assert!(most <= 2.0 * ROUNDED_TWICE, "{most}");
    shown!(Light, "Panoramas of 1×1, 2×1, 1×7, 97×53 and 300×301 texels with a sun of 10⁶",
        bound: "energy within 4 roundings, 2.4e-7", measured: format!("{most:.1e}"));
}

#[test]
fn texels_that_are_no_light_leave_weights_finite_and_the_rest_of_the_light_as_it_was() {
    let rig = rig(&lattice(41));
    let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -1e30];
    let mut most = 0.0f64;
    let mut changed = 0.0f64;
    for kind in kinds() {
        let partition = kind(&rig, 64);
        let even = spotted((64, 32), 1.0, &[], [0.0; 3]);
        for (value, (x, y)) in (values.iter()).flat_map(|v| [0, 1, 16, 30, 31].map(|y| (v, (5 * y % 64, y)))) {
            let broken = spotted((64, 32), 1.0, &[(x, y)], [*value, 1.0, *value]);
            assert_eq!(broken.repaired_texels, 1);
            let weights = partition.weights(&broken, 7.7);
            most = most.max(energy_lost(&weights, &rig, &broken));
            // A repaired texel lies between black and the brightest of the others.
            let [is, was] = [&broken, &even].map(Environment::energy);
            let texel = texel_solid_angle(y, 64, 32);
            for (c, allowed) in [(0, texel), (1, 0.0), (2, texel)] {
                let change = (is[c] - was[c]).abs();
                assert!(change <= allowed + 1e-12, "{value} at {x}, {y}: {change}");
                changed = changed.max(change / was[c]);
            }
        }
        let lost = spotted((64, 32), f32::INFINITY, &[], [0.0; 3]);
        most = most.max(energy_lost(&partition.weights(&lost, 0.0), &rig, &lost));
        let lost = spotted((64, 32), f32::NAN, &[], [0.0; 3]);
        let weights = partition.weights(&lost, 0.0);
        assert!(weights.per_lamp.iter().all(|w| *w == [0.0; 3]));
    }
    assert!(most <= ROUNDED_TWICE, "{most}");
    shown!(Light, "NaN, ±∞ and negative texels in every kind of weights",
        bound: "weights finite and ≥ 0; the energy changes by one texel's at most, and is kept to 1.2e-7",
        measured: format!("kept to {most:.1e}; changed by {:.2} %", 100.0 * changed));
}

#[test]
fn the_brightest_values_a_file_can_hold_leave_weights_finite() {
    let rig = rig(&lattice(41));
    let mut weigh = EnvironmentWeights::new(&sun(0, 0, 64), &rig, Weighting::Fit);
    let bright =
        Lighting { intensity_stops: 10.0, placed: vec!["0,10,5,1e20".parse().unwrap()], ..Lighting::default() };
    let lightings =
        [Weighting::Cells, Weighting::Smooth, Weighting::Fit].map(|weighting| Lighting { weighting, ..bright.clone() });
    let tilted = Lighting { pitch_deg: 50.0, ..bright };
    for value in [1e6, 65_504.0, 1e30, f32::MAX] {
        for environment in
            [spotted((64, 32), value, &[], [0.0; 3]), spotted((64, 32), 0.1, &[(0, 0), (63, 31)], [value; 3])]
        {
            weigh = weigh.environment(&environment);
            for lighting in lightings.iter().chain([&tilted, &Lighting::default()]) {
                for unit in [1.0, 1e30] {
                    let weights = weigh.weights(lighting, 10.0, unit);
                    let sound = |w: &f32| (0.0..=MOST).contains(w);
                    assert!(weights.per_lamp.iter().flatten().all(sound), "{value}: {weights:?}");
                    assert!((0.0..=1.0).contains(&weights.uncovered), "{weights:?}");
                }
            }
        }
    }
    shown!(Light, "Radiance up to the largest of f32, 3.4·10³⁸, brightened by 10 stops beside a placed light",
        bound: "weights from 0 to 10²⁵", measured: "holds");
}

#[test]
fn nine_hundred_and_thirty_one_lamps_and_one_keep_the_energy() {
    let mut most = 0.0f64;
    for n in [1, 2, 931] {
        let rig = rig(&lattice(n));
        for kind in kinds() {
            let partition = kind(&rig, 64);
            for environment in [sun(0, 0, 64), sun(63, 16, 64), speckled(3)] {
                let weights = partition.weights(&environment, 5.0);
                most = most.max(energy_lost(&weights, &rig, &environment));
                assert!((0.0..=1.0).contains(&weights.uncovered));
            }
        }
    }
    assert!(most <= ROUNDED_TWICE, "{most}");
    shown!(Light, "1, 2 and 931 lamps under a sun at the pole, at the seam, and under speckled light",
        bound: "energy within 1.2e-7", measured: format!("{most:.1e}"));
}

#[test]
fn a_lamp_too_faint_to_divide_by_gets_nothing() {
    let mut faint = rig(&lattice(41));
    faint.lamps[3].energy = [1e-42; 3];
    faint.lamps[4].energy = [0.1, f32::MIN_POSITIVE, 0.1];
    faint.lamps[5].energy = [0.0, 0.1, 0.1];
    let mut most = 0.0f64;
    for kind in kinds() {
        let partition = kind(&faint, 64);
        for environment in [sun(20, 10, 64), speckled(1)] {
            let weights = partition.weights(&environment, 0.0);
            most = most.max(energy_lost(&weights, &faint, &environment));
            assert!(weights.per_lamp[3..6].iter().all(|w| *w == [0.0; 3]));
        }
    }
    assert!(most <= ROUNDED_TWICE, "{most}");
    shown!(Light, "Lamps of no energy, of a subnormal one, and without one channel",
        bound: "its weight 0, energy within 1.2e-7", measured: format!("{most:.1e}"));
}

#[test]
fn a_million_turns_are_no_turn() {
    let rig = rig(&lattice(41));
    let day = sun(17, 9, 64);
    for kind in [Weighting::Cells, Weighting::Smooth, Weighting::Fit] {
        let mut weights = EnvironmentWeights::new(&day, &rig, kind);
        for pitch_deg in [0.0, 20.0] {
            let lighting = Lighting { pitch_deg, ..Lighting::default() };
            // Each yaw is exact in f32, and so is its sum with full turns.
            for yaw in [0.0f32, 96.0, 256.0] {
                let once = weights.weights(&lighting, yaw, 1.0);
                for turns in [1.0f32, -1.0, 1e3, 1e6, -1e6] {
                    let turned = yaw + 360.0 * turns;
                    assert_eq!(f64::from(turned), f64::from(yaw) + 360.0 * f64::from(turns));
                    let again = weights.weights(&lighting, turned, 1.0);
                    assert_eq!(once, again, "{yaw}° and {turns} turns, pitch {pitch_deg}°");
                }
            }
        }
        for turns in [1.0f32, 1e3, 1e6] {
            let tilted = |angle: f32| Lighting { pitch_deg: 30.0 + angle, roll_deg: angle, ..Lighting::default() };
            let angle = 360.0 * turns;
            if 30.0 + f64::from(angle) == f64::from(30.0 + angle) {
                let once = weights.weights(&tilted(0.0), 5.0, 1.0);
                assert_eq!(once, weights.weights(&tilted(angle), 5.0, 1.0));
            }
        }
        for broken in [f32::NAN, f32::INFINITY] {
            let none = weights.weights(&Lighting::default(), 0.0, 1.0);
            assert_eq!(weights.weights(&Lighting::default(), broken, 1.0), none);
        }
    }
    shown!(Light, "A yaw of 10⁶ turns, either way, with and without pitch and roll",
        bound: "the same weights bit for bit as without the turns", measured: "the same bits");
}

/// Steps of a tenth of a degree. Around the largest step also half of that, where smooth motion is half as far.
#[test]
fn a_turn_in_tenths_of_a_degree_does_not_flicker_by_fit() {
    let rig = rig(&lattice(41));
    // One channel, because channels are solved separately.
    let day = spotted((256, 128), 0.0, &[(60, 50)], [0.0, 1e6, 0.0]);
    let day = Environment::from_radiance("day", day.radiance.map(|[_, g, _]| [0.0, g + 0.2, 0.0]));
    let whole = day.energy()[1];
    let table = crate::YawTable::new(&Partition::fit(&rig, 256), &day);
    let given = |yaw_deg: f64| -> Vec<f64> {
        let weights = table.at(yaw_deg as f32).per_lamp;
        let shares = weights.iter().zip(&rig.lamps);
        shares.map(|(w, lamp)| f64::from(w[1]) * f64::from(lamp.energy[1]) / whole).collect()
    };
    // Largest jump of a weight, and the index of its step.
    let largest = |steps: std::ops::RangeInclusive<usize>, step_deg: f64| -> (f64, usize) {
        let first = *steps.start();
        let turn: Vec<Vec<f64>> = (steps.into_par_iter()).map(|step| given(step as f64 * step_deg)).collect();
        let jump = |pair: &[Vec<f64>]| {
            let pairs = pair[0].iter().zip(&pair[1]);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let jumps = turn.windows(2).map(jump).zip(first..);
        jumps.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let (tenth, at) = largest(0..=3600, 0.1);
    let around = (2 * at).saturating_sub(20)..=2 * at + 22;
    let (half, _) = largest(around, 0.05);
    println!("largest jump of a weight in 0.1° {tenth:.2e}, in 0.05° {half:.2e} of the light");
    // A jump would be as large in either step. A straight line gives a half, plus a hundredth for f32's yaws, 3e-5°
    // apart.
    assert!(half <= 0.505 * tenth, "{half} of {tenth}");
    // A sun passes between lamps 30° apart within a few degrees at the least.
    assert!(tenth <= 0.1 / 5.0, "{tenth}");
    shown!(Light, "A full turn of a sun of 10⁶ in steps of 0.1°, weights by `fit`",
        bound: "no weight jumps by more than 2 % of the light; half a step makes at most 0.505 of the jump",
        measured: format!("{:.2} %; {:.3}", 100.0 * tenth, half / tenth));
}

/// Lamps without gaps, because gap fillers stand on their own grid.
#[test]
fn an_environment_and_a_rig_that_turn_together_have_the_same_weights() {
    let largest = [Cell::new(0.0f64), Cell::new(0.0)];
    let slope = invariants::steepness(&rig(&lattice(41)));
    let bound = slope * 1.1e-6 + 2.0 * ROUNDED_TWICE;
    let config = ProptestConfig::with_cases(48);
    proptest!(config, |(shift in 1usize..64, seed in 0usize..50, at in (0usize..64, 0usize..32))| {
        let directions = lattice(41);
        let angle = 360.0 * shift as f32 / 64.0;
        // A yaw moves light to larger u, opposite to a right-handed rotation about +Y.
        let turn = DQuat::from_rotation_y(-f64::from(angle).to_radians());
        let turned: Vec<Vec3> = directions.iter().map(|d| (turn * d.as_dvec3()).as_vec3()).collect();
        let [here, there] = [rig(&directions), rig(&turned)];
        let mut image = speckled(seed).radiance;
        image.pixels[at.1 * 64 + at.0] = [1e4; 3];
        let day = Environment::from_radiance("day", image);
        let whole = day.energy();
        for kind in [Partition::smooth, Partition::cells] {
            let still = kind(&here, 64).weights(&day, 0.0);
            let together = kind(&there, 64).weights(&day, angle);
            let freely = kind(&here, 64).turned_weights(&day, Quat::IDENTITY);
            // In f32 two texels are off by up to 4e-7 each (both angles by 2e-7, then products), and the three
            // lamps around them by 1e-7 each. Shares change by the slope times that, of up to all of the light, and
            // are rounded twice. A free rotation looks texels up by angles in f32, off by 1e-5 of a texel.
            for ((other, bound), largest) in [(together, bound), (freely, 2e-5)].iter().zip(&largest) {
                for ((a, b), lamp) in still.per_lamp.iter().zip(&other.per_lamp).zip(&here.lamps) {
                    for c in 0..3 {
                        let moved = f64::from((a[c] - b[c]).abs() * lamp.energy[c]) / whole[c];
                        prop_assert!(moved <= *bound, "{} of the light", moved);
                        largest.set(largest.get().max(moved));
                    }
                }
            }
        }
    });
    let [together, freely] = largest.map(|largest| largest.get());
    shown!(Light, "A rig and an environment rotated together, by a yaw and freely",
        bound: format!("the same weights to {:.1e} of the light; free rotations to 2e-5", bound),
        measured: format!("{together:.1e}; {freely:.1e}"));
}
