use super::scene::{Scene, Surroundings, random};
use super::*;
use base::progress::Progress;
use glam::{DVec2, DVec3};
use imaging::Raster;
use imaging::{Encoded, file};
use proptest::prelude::*;
use std::path::PathBuf;

const BLACK_SKY: Scene = Scene {
    size: (256, 256),
    ball: None,
    around: Surroundings::Dark,
    pole: false,
    lamp: None,
    ambient: 0.02,
    exposure: 1.0,
    noise: 0.004,
    seed: 1,
};

fn circle(x: f64, y: f64, radius: f64) -> Circle {
    Circle::new([x, y], radius).unwrap()
}

fn photographs(scene: &Scene) -> Photographs {
    Photographs::one("ball.png", &scene.photograph()).unwrap()
}

fn plain(width: usize, height: usize, pixel: impl FnMut(usize, usize) -> f32) -> Photographs {
    let picture = Raster::from_fn(width, height, pixel).map(|v| [v; 3]);
    Photographs::one("plain.png", &Encoded(picture)).unwrap()
}

/// Larger of the centre's and the radius' error in pixels.
fn error_px(found: &Circle, truth: &Circle) -> f64 {
    let off = found.center().distance(truth.center());
    off.max((found.radius_px - truth.radius_px).abs())
}

fn assert_found(scene: &Scene, bound_px: f64) {
    let truth = scene.ball.unwrap();
    let found = find(&photographs(scene)).unwrap_or_else(|e| panic!("{scene:?}: {e}"));
    let error = error_px(&found.circle, &truth);
    assert!(error <= bound_px, "off by {error:.2}: {found:?} in {scene:?}");
}

/// A direction uniformly distributed over the sphere.
fn direction(seed: u64) -> DVec3 {
    let (z, turn) = (2.0 * random(seed, 1) - 1.0, std::f64::consts::TAU * random(seed, 2));
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}

/// A random ball: from 12 pixels to nearly the frame; two in five are cut by the frame, at most to a half.
fn anything(seed: u64) -> Scene {
    let r = |k: u64| random(seed, k);
    let sizes = [(256, 256), (320, 200), (200, 300), (640, 427), (512, 512)];
    let size = sizes[(r(1) * sizes.len() as f64) as usize];
    let most = 0.48 * size.0.min(size.1) as f64;
    let radius = 12.0 * (most / 12.0).powf(r(2));
    let inside = radius * if r(3) < 0.4 { 1.0 - r(4) } else { 1.02 };
    let place = |n: usize, u: f64| inside + u * (n as f64 - 2.0 * inside).max(0.0);
    let around = [Surroundings::Dark, Surroundings::Room, Surroundings::Clutter][(r(5) * 3.0) as usize];
    Scene {
        size,
        ball: Some(circle(place(size.0, r(8)), place(size.1, r(9)), radius)),
        around,
        pole: r(10) < 0.5,
        lamp: (r(11) < 0.5).then(|| direction(seed)),
        ambient: if around == Surroundings::Dark { 0.005 + 0.05 * r(12) } else { 0.0 },
        exposure: 0.3 + 1.5 * r(13),
        noise: 0.01 * r(14) * r(14),
        seed,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn a_ball_before_black_is_found_to_a_third_of_a_pixel(
        seed in 0u64..1_000_000, width in 100usize..500, height in 100usize..500, size in 0.0f64..1.0,
        x in 0.0f64..1.0, y in 0.0f64..1.0, lamp in any::<bool>(), pole in any::<bool>(), noise in 0.0f64..0.008,
    ) {
        let radius = 12.0 + size * (0.48 * width.min(height) as f64 - 12.0);
        let place = |n: usize, u: f64| 1.02 * radius + u * (n as f64 - 2.04 * radius);
        let ball = circle(place(width, x), place(height, y), radius);
        let lamp = lamp.then(|| direction(seed));
        // The lamp is just white: a brighter one at the rim covers up to half a pixel beyond it. One behind the
        // ball lights a part of the rim thinner than a pixel, and its middle is found.
        let bound_px = if lamp.is_some_and(|lamp: DVec3| lamp.z < -0.9) { 0.5 } else { 0.34 };
        let light = Scene { exposure: 0.025, ambient: 0.8, ..BLACK_SKY };
        assert_found(&Scene { size: (width, height), ball: Some(ball), lamp, pole, noise, seed, ..light }, bound_px);
    }

    #[test]
    fn any_picture_and_circle_are_answered(
        width in 16usize..90, height in prop_oneof![16usize..90, Just(1500)], codes in 1u32..300, seed in 0u64..1000,
        x in -50.0f64..150.0, y in -50.0f64..150.0, radius in 0.1f64..500.0,
    ) {
        let code = |i: u64| (random(seed, i) * f64::from(codes)) as u32;
        let value = |code: u32| if code == 299 { f32::NAN } else { code as f32 / 255.0 };
        let picture = plain(width, height, |x, y| value(code((x / 3 + 100 * (y / 3)) as u64)));
        let hand = circle(x, y, radius);
        for answer in [find(&picture), refine(&picture, &hand), measure(&picture, &hand)] {
            match answer {
                Ok(found) => {
                    let shares = [found.rim_share, found.framed_share, found.contrast];
                    prop_assert!(shares.iter().all(|s| (0.0..=1.0 + 1e-9).contains(s)), "{found:?}");
                    prop_assert!(found.residual_px.is_finite() && found.circle.radius_px >= MIN_RADIUS_PX);
                }
                Err(error) => prop_assert!(error.to_string().contains("plain.png")),
            }
        }
    }

    #[test]
    fn a_ball_cut_by_the_frame_is_found(
        seed in 0u64..1_000_000, radius in 30.0f64..110.0, inside in 0.2f64..0.9, along in 0.45f64..0.55, side in 0usize..4,
    ) {
        // At least three fifths of the ball are in the picture.
        let (near, other) = (inside * radius, 256.0 * along);
        let (x, y) = [(near, other), (256.0 - near, other), (other, near), (other, 256.0 - near)][side];
        assert_found(&Scene { ball: Some(circle(x, y, radius)), seed, ..BLACK_SKY }, 0.5);
    }
}

#[test]
fn nearly_all_balls_in_rooms_and_clutter_are_found() {
    // Single photographs whose rims are often as bright as the background. Of several hundred, one in twenty-five
    // was refused, and in one case a disc of the clutter was mistaken for the ball.
    let (mut errors, mut refused, mut mistaken) = (vec![], 0, 0);
    for seed in 30_000..30_060 {
        let scene = anything(seed);
        match find(&photographs(&scene)).map(|f| error_px(&f.circle, &scene.ball.unwrap())) {
            Ok(error) if error < 2.0 => errors.push(error),
            Ok(_) => mistaken += 1,
            Err(_) => refused += 1,
        }
    }
    errors.sort_by(f64::total_cmp);
    let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 9 / 10]);
    println!("of 60: refused {refused}, mistaken {mistaken}; median {median:.3} px, nine in ten below {most:.3} px");
    assert!(refused <= 6 && mistaken <= 2 && median < 0.15 && most < 0.35);
}

#[test]
fn a_large_photograph_is_measured_at_its_full_size() {
    let ball = circle(1043.3, 788.7, 611.4);
    let scene = Scene { size: (2000, 1500), ball: Some(ball), around: Surroundings::Room, pole: true, ..BLACK_SKY };
    assert_found(&scene, 0.3);
}

#[test]
fn photographs_under_one_lamp_each_add_up_to_a_rim() {
    // The ball itself is four 8-bit codes above black, the noise one code. The lamps are once as bright as white
    // and once forty times as bright, where they cover half a pixel too much, also at the rim.
    let ball = circle(121.4, 133.8, 87.3);
    for (exposure, bound_px) in [(0.025, 0.3), (1.0, 0.5)] {
        let olat = |seed: u64| Scene {
            ball: Some(ball),
            lamp: Some(direction(seed)),
            ambient: 2e-4 / exposure,
            exposure,
            seed,
            ..BLACK_SKY
        };
        let mut all = photographs(&olat(0));
        for i in 1..41 {
            all.add(format!("olat_{i}.png"), &olat(i).photograph()).unwrap();
        }
        let found = find(&all).unwrap();
        let error = error_px(&found.circle, &ball);
        assert!(error < bound_px, "off by {error:.2}: {found:?}");
    }
}

#[test]
fn pictures_without_a_ball_are_refused() {
    let noise = |seed: u64, x: usize, y: usize| random(seed, (1000 * y + x) as u64) as f32;
    let mut pictures = vec![
        plain(200, 150, |_, _| 0.5),
        plain(200, 150, |x, y| (x + y) as f32 / 350.0),
        plain(200, 150, |x, _| if x < 90 { 0.1 } else { 0.8 }),
    ];
    pictures.extend((0..6).map(|seed| plain(256, 200, |x, y| noise(seed, x, y))));
    pictures.extend((0..20).map(|seed| {
        // Rectangles, some of them squares.
        let r = |k: u64| random(seed, k);
        plain(256, 200, |x, y| {
            let hit = (0..12).find(|&i| {
                let (w, h) = (10.0 + 80.0 * r(4 * i), 10.0 + 80.0 * r(if i % 3 == 0 { 4 * i } else { 4 * i + 1 }));
                let (dx, dy) = (x as f64 - 256.0 * r(4 * i + 2), y as f64 - 200.0 * r(4 * i + 3));
                dx.abs() < 0.5 * w && dy.abs() < 0.5 * h
            });
            hit.map_or(0.2, |i| r(100 + i) as f32) + 0.02 * noise(seed, x, y)
        })
    }));
    pictures.extend((0..20).map(|seed| {
        let room = Scene { around: Surroundings::Room, seed, ..BLACK_SKY };
        photographs(&Scene { size: [(256, 256), (480, 320)][seed as usize % 2], ..room })
    }));
    for (i, picture) in pictures.iter().enumerate() {
        let error = find(picture).map_or_else(|e| e.to_string(), |found| panic!("picture {i}: {found:?}"));
        assert!(error.contains(".png: no mirror ball") && error.contains("by hand"), "{error}");
    }
}

#[test]
fn black_white_and_tiny_say_what_to_do() {
    for (picture, words) in [
        (plain(64, 64, |_, _| 0.0), "more light"),
        (plain(64, 64, |x, y| ((x + y) % 2) as f32 / 255.0), "more light"),
        (plain(64, 64, |_, _| 1.0), "denser filter"),
        (plain(64, 64, |_, _| f32::NAN), "more light"),
    ] {
        let error = find(&picture).unwrap_err().to_string();
        assert!(error.starts_with("plain.png") && error.contains(words), "{error}");
    }
    let tiny = Scene { size: (160, 120), ball: Some(circle(70.2, 61.7, 5.0)), ambient: 0.2, ..BLACK_SKY };
    let error = find(&photographs(&tiny)).unwrap_err().to_string();
    assert!(error.contains("radius of 10 pixels") && error.contains("full size"), "{error}");
    let speck = Encoded(Raster::filled(3, 900, [0.5; 3]));
    assert!(Photographs::one("speck.png", &speck).unwrap_err().to_string().contains("speck.png"));
    assert!(Photographs::read(&[], &Progress::silent()).is_err());
}

#[test]
fn a_photograph_of_another_size_is_named() {
    let mut photographs = plain(64, 48, |_, _| 0.5);
    let error = photographs.add("odd.png", &Encoded(Raster::filled(48, 64, [0.5; 3])));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("odd.png") && error.contains("64 × 48") && error.contains("48 × 64"), "{error}");
}

#[test]
fn a_rough_circle_snaps_to_the_rim() {
    let ball = circle(140.3, 120.8, 80.6);
    let scene = Scene { ball: Some(ball), around: Surroundings::Clutter, pole: true, ..BLACK_SKY };
    let photographs = photographs(&scene);
    for (dx, dy, dr) in [(8.0, -6.0, 0.0), (0.0, 9.0, 7.0), (-5.0, 5.0, -8.0)] {
        let rough = circle(140.3 + dx, 120.8 + dy, 80.6 + dr);
        let found = refine(&photographs, &rough).unwrap();
        assert!(error_px(&found.circle, &ball) < 0.3, "{rough:?}: {found:?}");
    }
    let error = refine(&photographs, &circle(30.0, 30.0, 20.0)).unwrap_err().to_string();
    assert!(error.contains("closer to the ball's outline"), "{error}");
}

#[test]
fn what_should_be_looked_at_is_said() {
    let seen = |framed_share: f64, rim_share: f64| Silhouette {
        circle: circle(50.0, 50.0, 30.0),
        residual_px: 0.1,
        rim_share,
        framed_share,
        contrast: 0.2,
    };
    assert_eq!(seen(1.0, 0.9).warning(), None);
    assert!(seen(1.0, 0.45).warning().unwrap().contains("45 %"));
    assert!(seen(0.7, 0.68).warning().unwrap().contains("cuts off 30 %"));
}

#[test]
fn a_circle_by_hand_is_measured_as_it_is() {
    let ball = circle(130.5, 125.5, 90.0);
    let photographs = photographs(&Scene { ball: Some(ball), ..BLACK_SKY });
    let exact = measure(&photographs, &ball).unwrap();
    assert!(exact.circle == ball && exact.residual_px < 0.3 && exact.rim_share > 0.9, "{exact:?}");
    assert_eq!(exact.framed_share, 1.0);
    // A pixel too large everywhere equals a pixel off everywhere.
    let larger = measure(&photographs, &circle(130.5, 125.5, 91.0)).unwrap();
    assert!((larger.residual_px - 1.0).abs() < 0.2 && larger.rim_share > 0.9, "{larger:?}");
    let beside = measure(&photographs, &circle(110.5, 125.5, 90.0)).unwrap();
    assert!(beside.rim_share < 0.3, "{beside:?}");
    for impossible in [
        Circle { center_px: [f64::NAN, 0.0], radius_px: 50.0 },
        Circle { center_px: [9e9, 0.0], radius_px: 50.0 },
        Circle { center_px: [128.0, 128.0], radius_px: 1e12 },
        Circle { center_px: [128.0, 128.0], radius_px: 2.0 },
    ] {
        assert!(measure(&photographs, &impossible).is_err() && refine(&photographs, &impossible).is_err());
    }
}

fn read(paths: &[PathBuf]) -> Photographs {
    Photographs::read(&paths.iter().cloned().map(Into::into).collect::<Vec<_>>(), &Progress::silent()).unwrap()
}

#[test]
fn the_shared_shoots_balls_are_found() {
    let Some(folder) = test_support::shared("data/stage") else { return };
    let manifest = std::fs::read_to_string(folder.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    let probes = &manifest["probes"];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let center = &probes["ball_center_px"];
    let truth = circle(number(&center[0]), number(&center[1]), number(&probes["ball_radius_px"]));
    for probes in ["probes", "probes_hot"] {
        let olats = (0..41).map(|i| folder.join(probes).join(format!("olat_{i:02}.png")));
        let interview = folder.join(probes).join("interview.png");
        let mut sets: Vec<Vec<PathBuf>> = olats.clone().step_by(8).map(|olat| vec![olat]).collect();
        sets.push(vec![interview.clone()]);
        sets.push(std::iter::once(interview).chain(olats).collect());
        for paths in sets {
            let photographs = read(&paths);
            let start = std::time::Instant::now();
            let found = find(&photographs).unwrap();
            let error = error_px(&found.circle, &truth);
            println!(
                "{probes}, {} photographs: off by {error:.3} px, {found:.3?}, {:.2?}",
                paths.len(),
                start.elapsed()
            );
            assert!(error <= 0.3);
        }
    }
}

#[test]
fn real_balls_are_found_and_other_things_are_not() {
    let Some(folder) = test_support::shared("data/mirror_ball/images") else { return };
    for (what, is_ball) in [("chrome", true), ("gray", true), ("buddha", false), ("cat", false)] {
        let folder = folder.join(what);
        let one = |i: usize| folder.join(format!("{what}.{i}.png"));
        let result = find(&read(&(0..12).map(one).collect::<Vec<_>>()));
        if !is_ball {
            assert!(result.is_err(), "{what}: {result:?}");
            continue;
        }
        // The mask was drawn by hand, as a circle to a pixel or two: its area and centroid.
        let mask = file::read_mask(&folder.join(format!("{what}.mask.png"))).unwrap();
        let (mut area, mut sum) = (0.0, DVec2::ZERO);
        for (i, _) in mask.pixels.iter().enumerate().filter(|(_, m)| **m > 0.5) {
            area += 1.0;
            sum += DVec2::new((i % mask.width) as f64 + 0.5, (i / mask.width) as f64 + 0.5);
        }
        let center = sum / area;
        let drawn = circle(center.x, center.y, (area / std::f64::consts::PI).sqrt());
        let found = result.unwrap();
        println!("{what}: {found:.3?}; the mask is {drawn:.3?}");
        assert!(error_px(&found.circle, &drawn) < 2.0 && found.residual_px < 0.5);
    }
}

#[test]
fn a_small_ball_lit_from_right_behind_is_found() {
    let lamp = Some(DVec3::new(-0.118875, -0.0037395, -0.992902));
    let ball = Some(circle(332.312239, 266.441102, 12.0));
    let light = Scene { exposure: 0.025, ambient: 0.8, noise: 0.0, ..BLACK_SKY };
    assert_found(&Scene { size: (372, 359), ball, lamp, seed: 590_851, ..light }, 0.34);
}
