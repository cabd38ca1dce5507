//! Invariants of every rig, environment and rotation.

use super::*;
use glam::Quat;
use std::cell::Cell;
use test_support::shown;

/// Any rig: over the full sphere, a half or a cone, with or without lamps that coincide or stand on the poles.
fn any_rig() -> impl Strategy<Value = Rig> {
    let direction = (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0);
    (proptest::collection::vec(direction, 1..50), 0usize..5).prop_map(|(lamps, kind)| {
        let mut lamps: Vec<Vec3> = (lamps.into_iter())
            .map(|(x, y, z)| match kind {
                0 => Vec3::new(x, y.abs(), z),
                1 => Vec3::new(0.2 * x, 0.2 * y, 1.0),
                _ => Vec3::new(x, y, z),
            })
            .map(|d| d.try_normalize().unwrap_or(Vec3::Z))
            .collect();
        if kind == 3 {
            lamps.extend([Vec3::Y, Vec3::NEG_Y, lamps[0]]);
        }
        rig(&lamps)
    })
}

/// Any environment: dim noise, with suns of up to a million.
fn any_environment() -> impl Strategy<Value = Environment> {
    let sun = (0usize..32, 0usize..16, 0.0f32..1e6);
    (0usize..1000, proptest::collection::vec(sun, 0..4)).prop_map(|(seed, suns)| {
        let mut image = Image::from_fn(32, 16, |x, y| {
            [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7 + seed * 13) % 97) as f32 / 50.0)
        });
        for (x, y, brightness) in suns {
            image.pixels[y * 32 + x] = [brightness, 0.8 * brightness, 0.6 * brightness];
        }
        Environment::from_radiance("any", image)
    })
}

#[test]
fn energy_is_kept_and_nothing_is_negative() {
    proptest!(|(
        rig in any_rig(), environment in any_environment(), yaw in -720.0f32..720.0,
        turn in (-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0),
    )| {
        let turn = Quat::from_scaled_axis(turn.into());
        for kind in kinds() {
            let partition = kind(&rig, 32);
            assert_sound("yaw", &partition.weights(&environment, yaw), &rig, &environment);
            assert_sound("turn", &partition.turned_weights(&environment, turn), &rig, &environment);
        }
    });
    shown!(Light, "256 random rigs, on the sphere, on half of it, in a cone, with coinciding lamps, each in random light",
        bound: "energy within 1e-5, all weights ≥ 0", measured: "holds");
}

#[test]
fn a_whole_turn_is_the_same_to_the_bit() {
    proptest!(|(rig in any_rig(), environment in any_environment(), quarters in -1440i32..1440)| {
        // Quarters of a degree and their sums with 360 are exact in f32.
        let yaw = quarters as f32 / 4.0;
        for kind in kinds() {
            let partition = kind(&rig, 32);
            let once = partition.weights(&environment, yaw);
            prop_assert_eq!(&partition.weights(&environment, yaw + 360.0), &once);
            prop_assert_eq!(&partition.weights(&environment, yaw - 720.0), &once);
        }
    });
    shown!(Light, "Yaws of 0° and 360°, and 256 others plus one turn and minus two turns",
        bound: "the same weights bit for bit", measured: "the same bits");
}

#[test]
fn weights_of_a_sum_are_the_sum_of_weights() {
    let largest = Cell::new(0.0f32);
    proptest!(|(
        rig in any_rig(), one in any_environment(), two in any_environment(),
        a in 0.0f32..10.0, b in 0.0f32..10.0, yaw in 0.0f32..360.0,
    )| {
        let pixels = one.radiance.pixels.iter().zip(&two.radiance.pixels);
        let mixed = Image {
            pixels: pixels.map(|(p, q)| [0, 1, 2].map(|c| a * p[c] + b * q[c])).collect(),
            ..one.radiance.clone()
        };
        let mixed = Environment::from_radiance("mixed", mixed);
        // A fit is not linear.
        for kind in [Partition::smooth, Partition::cells] {
            let partition = kind(&rig, 32);
            let [mixed, one, two] = [&mixed, &one, &two].map(|e| partition.weights(e, yaw).per_lamp);
            let both = one.iter().flatten().zip(two.iter().flatten());
            for (mixed, (one, two)) in mixed.iter().flatten().zip(both) {
                let sum = a * one + b * two;
                prop_assert!((mixed - sum).abs() <= 1e-5 * sum, "{} is not {}", mixed, sum);
                largest.set(largest.get().max((mixed - sum).abs() / sum.max(f32::MIN_POSITIVE)));
            }
        }
    });
    shown!(Light, "a·E₁ + b·E₂ for 256 pairs of environments, by `smooth` and `cells`",
        bound: "the sum of weights within 1e-5", measured: format!("{:.1e}", largest.get()));
}

proptest! {
    #[test]
    fn brighter_light_makes_all_weights_brighter(
        rig in any_rig(), environment in any_environment(), stops in -20i32..20,
    ) {
        let factor = 2.0f32.powi(stops);
        let image = environment.radiance.map(|p| p.map(|v| factor * v));
        let brighter = Environment::from_radiance("brighter", image);
        for kind in kinds() {
            let partition = kind(&rig, 32);
            let [once, brighter] = [&environment, &brighter].map(|e| partition.weights(e, 5.0));
            let most = once.per_lamp.iter().flatten().copied().fold(0.0, f32::max);
            for (once, brighter) in once.per_lamp.iter().flatten().zip(brighter.per_lamp.iter().flatten()) {
                prop_assert!((brighter / factor - once).abs() <= 1e-5 * once + 1e-7 * most);
            }
        }
    }

    #[test]
    fn a_free_turn_about_the_vertical_is_a_yaw(
        rig in any_rig(), environment in any_environment(), yaw in -360.0f32..360.0,
    ) {
        let partition = Partition::smooth(&rig, 32);
        let turned = partition.turned_weights(&environment, rotation(yaw, 0.0, 0.0));
        let yawed = partition.weights(&environment, yaw);
        let most = yawed.per_lamp.iter().flatten().copied().fold(0.0, f32::max);
        for (a, b) in turned.per_lamp.iter().flatten().zip(yawed.per_lamp.iter().flatten()) {
            // f32 directions are off by up to 1e-5 texels.
            prop_assert!((a - b).abs() <= 1e-4 * most, "{} is not {}", a, b);
        }
    }
}

proptest! {
    // A rig costs more than weights: fewer rigs, each with more environments.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_fit_moves_little_light_in_a_little_turn(
        rig in any_rig(),
        turns in proptest::collection::vec((any_environment(), -360.0f32..360.0), 4),
    ) {
        // Columns narrower than the light's blur, as in use. With 32 columns a rotation would move light by 11° at
        // once, to places that were dark.
        let partition = Partition::fit(&rig, 128);
        for (environment, yaw) in turns {
            let coarse = environment.radiance;
            let fine = Image::from_fn(128, 64, |x, y| coarse.at(x / 4, y / 4));
            let environment = Environment::from_radiance("any", fine);
            let [here, there] = [yaw, yaw + 0.01].map(|yaw| partition.weights(&environment, yaw));
            for c in 0..3 {
                let pairs = here.per_lamp.iter().zip(&there.per_lamp).zip(&rig.lamps);
                let moved = pairs.map(|((a, b), lamp)| f64::from((a[c] - b[c]).abs() * lamp.energy[c]));
                let moved = moved.sum::<f64>() / 2.0 / environment.energy()[c];
                // The rotation alone moves four thousandths of each texel's light to the next column.
                prop_assert!(moved < 0.02, "{} of the light moved in 0.01°", moved);
            }
        }
    }
}

#[test]
fn a_uniform_environment_gives_each_lamp_the_solid_angle_of_its_cell() {
    const SAMPLES: usize = 200_000;
    for (name, rig) in rigs() {
        let nodes = Nodes::from_rig(&rig);
        // Lamps that share a direction depend only on the rig; the size of the cells is counted separately.
        let mut counts = vec![0usize; nodes.lamps.len()];
        for sample in lattice(SAMPLES) {
            let nearness = |i: &usize| nodes.directions[*i].as_vec3().dot(sample);
            let nearest = (0..counts.len()).max_by(|i, j| nearness(i).total_cmp(&nearness(j)));
            counts[nearest.unwrap()] += 1;
        }
        let sky = Environment::from_radiance("sky", Image::filled(256, 128, [1.0; 3]));
        let weights = Partition::cells(&rig, 256).weights(&sky, 123.4);
        let mut square = 0.0;
        for (lamps, count) in nodes.lamps.iter().zip(&counts) {
            let cell = 4.0 * std::f32::consts::PI * *count as f32 / SAMPLES as f32;
            for &lamp in lamps {
                let given = weights.per_lamp[lamp][1] * rig.lamps[lamp].energy[1] * lamps.len() as f32;
                // Half a texel of 1.4° along the full border of the cell, if it follows the texels.
                let border = 0.5 * std::f32::consts::TAU / 256.0 * 2.0 * (std::f32::consts::PI * cell).sqrt();
                assert!((given - cell).abs() < border, "{name}: {given} is not {cell}");
                square += (given / cell - 1.0).powi(2) / rig.lamps.len() as f32;
            }
        }
        println!("{name}: cells are right to {:.2} % (root-mean-square)", 100.0 * square.sqrt());
        if name.ends_with("6 lamps") || name.ends_with("1 lamps") {
            // Borders that cross texels at all angles average out.
            assert!(square.sqrt() < 0.015, "{name}");
        }
    }
}

/// Largest change of a lamp's share of a small light per radian of the light's motion, from the definition of
/// [`Partition::smooth`].
pub(super) fn steepness(rig: &Rig) -> f64 {
    let nodes = Nodes::from_rig(rig);
    // p_i = n_i·d / n·d, with n_i the rows of the inverse of the corners and n their sum, has the gradient (n_i −
    // p_i n) / n·d. It is linear in p_i, from 0 to 1, and n·d ≥ 1 because facets are inside the sphere. A lamp that
    // also gets the light of gap fillers has a part in up to three corners.
    let hull = Hull::from_points(&nodes.directions);
    let fillers = nodes.directions.len() > nodes.lamps.len();
    let steepest = hull.facets.iter().map(|facet| {
        let rows = facet.coordinates.transpose();
        let (rows, sum) = ([rows.x_axis, rows.y_axis, rows.z_axis], rows.x_axis + rows.y_axis + rows.z_axis);
        let slopes = rows.map(|row| row.length().max((row - sum).length()));
        if fillers { slopes.iter().sum() } else { slopes.into_iter().fold(0.0, f64::max) }
    });
    steepest.fold(0.0, f64::max)
}

#[test]
fn a_sun_that_crosses_a_border_changes_no_weight_by_more_than_its_step_allows() {
    const STEP_DEG: f32 = 0.01;
    for (name, rig) in rigs() {
        let partition = Partition::smooth(&rig, 256);
        let (x, y) = (60, 50);
        let day = sun(x, y, 256);
        let energy = f64::from(day.radiance.pixels[y * 256 + x][1]) * texel_solid_angle(y, 256, 128);
        // Between columns a weight is linear, with at most the slope between their centres.
        let allowed = steepness(&rig) * f64::from(STEP_DEG).to_radians();
        let shares = |weights: &LightWeights| -> Vec<f64> {
            let lamps = weights.per_lamp.iter().zip(&rig.lamps);
            lamps.map(|(w, lamp)| f64::from(w[1]) * f64::from(lamp.energy[1]) / energy).collect()
        };
        let table = crate::YawTable::new(&partition, &day);
        let mut before = shares(&table.at(0.0));
        let mut largest = 0.0f64;
        for step in 1..=36_000 {
            let after = shares(&table.at(step as f32 * STEP_DEG));
            let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs());
            largest = change.fold(largest, f64::max);
            before = after;
        }
        // Weights are rounded to 6e-8 of themselves, and yaws in degrees to 3e-5.
        assert!(largest <= allowed * 1.01 + 3e-7, "{name}: {largest:.2e} in a step that allows {allowed:.2e}");
        println!("{name}: {largest:.2e} of the light in 0.01°, allowed {allowed:.2e}");
    }
}

/// A jump keeps its size however short the step; continuous motion shrinks with the step.
#[test]
fn a_fit_never_moves_light_at_once() {
    for (name, rig) in rigs() {
        // One channel, because channels are solved separately.
        let day = sun(60, 50, 256).radiance.map(|[_, g, _]| [0.0, g, 0.0]);
        let day = Environment::from_radiance("sun", day);
        let total = day.energy()[1];
        let table = crate::YawTable::new(&Partition::fit(&rig, 256), &day);
        let given = |yaw: f32| -> Vec<f64> {
            let weights = table.at(yaw).per_lamp;
            let lamps = weights.iter().zip(&rig.lamps);
            lamps.map(|(w, lamp)| f64::from(w[1]) * f64::from(lamp.energy[1]) / total).collect()
        };
        let apart = |from: &[f64], to: &[f64]| -> f64 {
            let change = from.iter().zip(to).map(|(a, b)| (a - b).abs());
            change.sum::<f64>() / 2.0
        };
        let moved = |from: f32, to: f32| apart(&given(from), &given(to));
        let turn: Vec<Vec<f64>> = (0..=1440usize).into_par_iter().map(|step| given(0.25 * step as f32)).collect();
        let steps = turn.windows(2).map(|pair| apart(&pair[0], &pair[1]));
        let (step, whole) = (steps.enumerate()).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let mut from = 0.25 * step as f32;
        let mut step = 0.25;
        for _ in 0..6 {
            step /= 2.0;
            if moved(from + step, from + 2.0 * step) > moved(from, from + step) {
                from += step;
            }
        }
        let left = moved(from, from + step);
        println!("{name}: {whole:.2e} of the light in 0.25°, {left:.2e} in {step:.4}°");
        // A 64th of the step; the bound lies between the light's fastest and its mean motion within it. Yaws are
        // rounded to 3e-5°.
        assert!(left <= whole / 16.0 + 1e-6, "{name}: {left} of {whole}");
    }
}

#[test]
fn a_sun_that_crosses_the_pole_in_a_free_turn_does_not_jump() {
    let poles = rig(&lattice(40).into_iter().chain([Vec3::Y]).collect::<Vec<_>>());
    let day = sun(128, 10, 256);
    for kind in [Partition::smooth, Partition::fit] {
        let partition = kind(&poles, 256);
        let mut before: Option<LightWeights> = None;
        let mut largest = 0.0f64;
        let total = day.energy()[1];
        for step in 0..400 {
            // The sun is 15° from the pole; a pitch moves it across and down the other side.
            let weights = partition.turned_weights(&day, rotation(0.0, 0.075 * step as f32, 0.0));
            if let Some(before) = before {
                let pairs = weights.per_lamp.iter().zip(&before.per_lamp).zip(&poles.lamps);
                let moved = pairs.map(|((a, b), lamp)| f64::from((a[1] - b[1]).abs() * lamp.energy[1]));
                largest = largest.max(moved.sum::<f64>() / total / 2.0);
            }
            before = Some(weights);
        }
        // At lamps 30° apart light moves completely within a few degrees: 0.075° are a few hundredths.
        assert!(largest < 0.04, "{largest} of the light moved in 0.075°");
    }
}

#[test]
fn a_pitch_moves_light_up_and_a_roll_counter_clockwise() {
    let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-6, "{a} is not {b}");
    near(rotation(90.0, 0.0, 0.0) * Vec3::NEG_Z, Vec3::X);
    near(rotation(0.0, 90.0, 0.0) * Vec3::NEG_Z, Vec3::Y);
    near(rotation(0.0, 0.0, 90.0) * Vec3::X, Vec3::Y);
    near(rotation(90.0, 0.0, 90.0) * Vec3::NEG_Z, Vec3::Y);
    let rig = rig(&[Vec3::NEG_Z, Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y]);
    let weights = Partition::cells(&rig, 64).turned_weights(&sun(32, 16, 64), rotation(0.0, 80.0, 0.0));
    assert!(weights.per_lamp[4][1] > 0.0 && weights.per_lamp[0][1] == 0.0);
}

#[test]
fn a_turn_that_is_no_turn_changes_nothing() {
    let partition = Partition::smooth(&rig(&lattice(12)), 32);
    let still = partition.turned_weights(&speckled(1), Quat::IDENTITY);
    for broken in [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)] {
        assert_eq!(partition.turned_weights(&speckled(1), broken), still);
    }
    let weights = partition.weights(&speckled(1).reduced(32), 0.0);
    for (a, b) in still.per_lamp.iter().flatten().zip(weights.per_lamp.iter().flatten()) {
        assert!((a / b - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_fit_gives_the_footprint_of_a_lamp_to_that_lamp() {
    let rig = rig(&lattice(41));
    let lamp = rig.lamps[17].direction;
    // A light with the lamp's own shape in its place: a Gaussian of 5° mean square radius.
    let spot = Image::from_fn(256, 128, |x, y| {
        let angle = texel_direction(x, y, 256, 128).angle_between(lamp).to_degrees();
        [(-angle * angle / 25.0).exp(); 3]
    });
    let spot = Environment::from_radiance("spot", spot);
    let weights = Partition::fit(&rig, 256).weights(&spot, 0.0);
    let own = f64::from(weights.per_lamp[17][1] * rig.lamps[17].energy[1]);
    let share = own / spot.energy()[1];
    println!("a fit gives {share:.4} of a lamp's footprint to that lamp");
    assert!(share > 0.99);
}

#[test]
fn a_fit_of_lamps_gives_the_lamps_back() {
    let rig = rig(&lattice(30));
    let wanted: Vec<f32> = (0..30).map(|i| ((i * 7) % 5) as f32).collect();
    let mixed = Image::from_fn(256, 128, |x, y| {
        let direction = texel_direction(x, y, 256, 128);
        let light = rig.lamps.iter().zip(&wanted).map(|(lamp, wanted)| {
            let angle = direction.angle_between(lamp.direction).to_degrees();
            wanted * (-angle * angle / 25.0).exp()
        });
        [light.sum::<f32>(); 3]
    });
    let mixed = Environment::from_radiance("mixed", mixed);
    let weights = Partition::fit(&rig, 256).weights(&mixed, 0.0);
    let given: Vec<f32> = weights.per_lamp.iter().zip(&rig.lamps).map(|(w, l)| w[1] * l.energy[1]).collect();
    let scale = given.iter().sum::<f32>() / wanted.iter().sum::<f32>();
    for (given, wanted) in given.iter().zip(&wanted) {
        assert!((given / scale - wanted).abs() < 0.05, "{} is not {wanted}", given / scale);
    }
}

/// Light on a backlit face: a thousandth of the light, from in front.
#[test]
fn a_fit_keeps_dim_light_beside_a_bright_one() {
    let rig = rig(&lattice(41));
    for (x, y) in [(128, 60), (100, 40), (140, 90)] {
        let mut image = Image::filled(256, 128, [1.0; 3]);
        let sun = 1e3 * 4.0 * std::f64::consts::PI / texel_solid_angle(y, 256, 128);
        image.pixels[y * 256 + x] = [sun as f32; 3];
        let backlit = Environment::from_radiance("backlit", image);
        let weights = Partition::fit(&rig, 256).weights(&backlit, 0.0).per_lamp;
        let (mut given, mut true_share) = (0.0, 0.0);
        for (weight, lamp) in weights.iter().zip(&rig.lamps) {
            if lamp.direction.z > 0.4 {
                given += weight[1] * lamp.energy[1];
                true_share += 4.0 * std::f32::consts::PI / 41.0;
            }
        }
        let ratio = given / true_share;
        println!("a sun at {x}, {y}: lamps in front get {ratio:.2} of the light from there");
        assert!(ratio > 0.4, "{ratio}");
    }
}

#[test]
fn a_slow_turn_of_a_sunny_park_is_smooth() {
    let Some(path) = test_support::shared("data/hdri/polyhaven_sunny_vondelpark_1k.hdr") else { return };
    let park = crate::panorama::load(&path).unwrap().reduced(256);
    let rig = rig(&lattice(41));
    let total = luminance(park.energy());
    let names = ["smooth", "cells", "fit"];
    let mut most = Vec::new();
    for (name, kind) in names.into_iter().zip(kinds()) {
        let table = crate::YawTable::new(&kind(&rig, 256), &park);
        // One turn per minute at 24 frames a second: a quarter of a degree per frame.
        let frames: Vec<Vec<f64>> = (0..1440)
            .map(|frame| {
                let weights = table.at(0.25 * frame as f32);
                let lamps = weights.per_lamp.iter().zip(&rig.lamps);
                lamps
                    .map(|(w, lamp)| luminance([0, 1, 2].map(|c| f64::from(w[c]) * f64::from(lamp.energy[c]))) / total)
                    .collect()
            })
            .collect();
        // Share of the light that moves between lamps in a frame, and its difference from the previous frame.
        let moved = |i: usize| -> f64 {
            let (a, b) = (&frames[i], &frames[(i + 1) % 1440]);
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / 2.0
        };
        let jerk = |i: usize| -> f64 {
            let (a, b, c) = (&frames[i], &frames[(i + 1) % 1440], &frames[(i + 2) % 1440]);
            a.iter().zip(b).zip(c).map(|((a, b), c)| (a - 2.0 * b + c).abs()).sum::<f64>() / 2.0
        };
        let all = |f: &dyn Fn(usize) -> f64| -> (f64, f64) {
            let values: Vec<f64> = (0..1440).map(f).collect();
            (values.iter().sum::<f64>() / 1440.0, values.into_iter().fold(0.0, f64::max))
        };
        let ((mean, max), (mean_jerk, max_jerk)) = (all(&moved), all(&jerk));
        println!(
            "{name}: moved in a frame {:.3} % on average, {:.3} % at most; change of that {:.3} %, {:.3} %",
            100.0 * mean,
            100.0 * max,
            100.0 * mean_jerk,
            100.0 * max_jerk
        );
        most.push(max);
    }
    assert!(most[0] < most[1] && most[2] < most[1]);
}

#[test]
fn a_fit_relights_a_ball_better_than_cells_do() {
    let Some(folder) = test_support::shared("data/hdri") else { return };
    let rig =
        Rig { lamps: (rig(&lattice(41)).lamps.into_iter()).map(|lamp| Lamp { energy: [1.0; 3], ..lamp }).collect() };
    let partitions = kinds().map(|kind| kind(&rig, 64));
    // A matt ball by Lambert's law, and a satin one with a broad lobe about the normal.
    for power in [1, 8] {
        let mut decibels = [0.0f32; 3];
        let panoramas = ["probulator_uffizi.hdr", "probulator_wells.hdr", "sunset.exr", "studio.exr"];
        for panorama in panoramas {
            let environment = crate::panorama::load(&folder.join(panorama)).unwrap().reduced(64);
            let truth_and_sums: Vec<(f32, [f32; 3])> = {
                let weights = partitions.each_ref().map(|p| p.weights(&environment, 0.0).per_lamp);
                let shade = |normal: Vec3, light: Vec3| normal.dot(light).max(0.0).powi(power);
                let lit = |normal: Vec3| {
                    let texels = environment.radiance.pixels.iter().enumerate().map(|(i, radiance)| {
                        let light = texel_direction(i % 64, i / 64, 64, 32);
                        texel_solid_angle(i / 64, 64, 32) as f32 * radiance[1] * shade(normal, light)
                    });
                    let sums = weights.each_ref().map(|weights| {
                        let lamps = weights.iter().zip(&rig.lamps);
                        lamps.map(|(w, lamp)| w[1] * shade(normal, lamp.direction)).sum()
                    });
                    (texels.sum(), sums)
                };
                lattice(300).into_iter().map(lit).collect()
            };
            let power: f32 = truth_and_sums.iter().map(|(truth, _)| truth * truth).sum();
            for (kind, decibels) in decibels.iter_mut().enumerate() {
                let error = truth_and_sums.iter().map(|(truth, sums)| (sums[kind] - truth).powi(2));
                *decibels -= 10.0 * (error.sum::<f32>() / power).log10() / panoramas.len() as f32;
            }
        }
        let [smooth, cells, fit] = decibels;
        println!("lobe {power}: smooth {smooth:.1} dB, cells {cells:.1} dB, fit {fit:.1} dB");
        assert!(fit > cells + 1.0);
    }
}
