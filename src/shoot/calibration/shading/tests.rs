use super::super::code_values::{ResponseTable, codes};
use super::super::footprint::Footprint;
use super::*;
use imaging::color::linear_from_srgb;
use imaging::{DualGamma, Encoded, file};
use proptest::prelude::*;
use std::path::Path;

const BALL: Ball = Ball { center_px: [40.5, 39.0], radius_px: 36.0, radius_m: 0.05, camera_distance_m: 1.5 };

/// A matt ball under one lamp by ray–sphere intersection, independent of the code under test. `shine` adds a
/// highlight.
fn photograph(ball: &Ball, lamp: Vec3, ambient: f32, shine: f32) -> Image {
    let (r, d) = (f64::from(ball.radius_m), f64::from(ball.camera_distance_m));
    let focal = f64::from(ball.radius_px) / (r / d).asin().tan();
    let mut noise = 12345u32;
    Image::from_fn(80, 80, |x, y| {
        let dx = x as f64 + 0.5 - f64::from(ball.center_px[0]);
        let dy = y as f64 + 0.5 - f64::from(ball.center_px[1]);
        let ray = DVec3::new(dx, -dy, -focal).normalize();
        let camera = DVec3::new(0.0, 0.0, d);
        let along = camera.dot(ray);
        let inside = along * along - d * d + r * r;
        if inside <= 0.0 {
            return [0.0; 3];
        }
        let normal = (camera + (-along - inside.sqrt()) * ray) / r;
        let mirrored = ray - 2.0 * ray.dot(normal) * normal;
        let facing = normal.as_vec3().dot(lamp).max(0.0);
        let highlight = shine * mirrored.as_vec3().dot(lamp).max(0.0).powi(80);
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.01 * ((noise >> 8) as f32 / 16_777_216.0 - 0.5);
        [0.6 * facing + ambient + highlight + noise; 3]
    })
}

proptest! {
    #[test]
    fn a_lamp_is_found_through_shadow_room_light_and_a_highlight(
        x in -1.0f32..1.0, y in -1.0f32..1.0, z in -0.3f32..1.0, ambient in 0.0f32..0.2, shine in 0.0f32..3.0,
    ) {
        let lamp = Vec3::new(x, y, z);
        prop_assume!(lamp.length() > 0.1 && z / lamp.length() > -0.3);
        let lamp = lamp.normalize();
        let found = lamp_from_shading(&BALL, &photograph(&BALL, lamp, ambient, shine)).unwrap();
        // Behind the ball's rim little of the lit part is visible, and the highlight is large there.
        let bound = if lamp.z > 0.1 { 1.0 } else { 3.0 };
        prop_assert!(found.direction.angle_between(lamp).to_degrees() < bound, "{:?} is not {}", found, lamp);
        if lamp.z > 0.1 {
            prop_assert!((found.strength - 0.6).abs() < 0.03 && (found.ambient - ambient).abs() < 0.03, "{:?}", found);
        }
    }
}

#[test]
fn an_encoded_photograph_leaves_more_than_a_linear_one() {
    let linear = photograph(&BALL, Vec3::new(0.5, 0.3, 0.8).normalize(), 0.02, 0.0);
    let encoded = linear.map(|p| p.map(|v| v.max(0.0).powf(1.0 / 2.2)));
    let left = |picture| lamp_from_shading(&BALL, picture).unwrap().residual;
    println!("residual of linear light {:.4}, of encoded {:.4}", left(&linear), left(&encoded));
    assert!(left(&encoded) > 3.0 * left(&linear));
}

#[test]
fn a_ball_without_light_is_refused() {
    let dark = Image::filled(80, 80, [0.0; 3]);
    assert!(lamp_from_shading(&BALL, &dark).is_err());
    assert!(lamp_from_shading(&BALL, &Image::filled(80, 80, [f32::NAN; 3])).is_err());
    assert!(lamp_from_shading(&BALL, &Image::filled(1, 1, [1.0; 3])).is_err());
    let impossible = Ball { radius_px: 0.0, ..BALL };
    assert!(lamp_from_shading(&impossible, &dark).is_err());
}

#[test]
fn an_evenly_lit_ball_has_no_lamp_and_a_faint_lamp_is_found_before_it() {
    let even = Image::filled(80, 80, [0.5; 3]);
    let refused = lamp_from_shading(&BALL, &even).unwrap_err().to_string();
    assert!(refused.contains("lit pixels"), "{refused}");

    // A fortieth of the room's light.
    let lamp = Vec3::new(0.4, 0.5, 0.7).normalize();
    let faint = photograph(&BALL, lamp, 25.0, 0.0).map(|p| p.map(|v| 0.02 * v));
    let found = lamp_from_shading(&BALL, &faint).unwrap();
    let apart = found.direction.angle_between(lamp).to_degrees();
    assert!(apart < 1.0 && (found.strength - 0.012).abs() < 1e-3, "{found:?}");
    assert!((found.ambient - 0.5).abs() < 1e-3, "{found:?}");
}

/// The ball in a mask, from an effectively infinitely distant camera.
fn far_ball(photographs: &Path, what: &str) -> Ball {
    let mask = photographs.join(format!("{what}/{what}.mask.png"));
    let mask = file::read_encoded(&mask).unwrap();
    let (width, _) = mask.0.size();
    let on: Vec<usize> = (0..mask.0.pixels.len()).filter(|&i| mask.0.pixels[i][0] > 0.5).collect();
    let mean = |coordinate: &dyn Fn(usize) -> usize| {
        on.iter().map(|&i| coordinate(i) as f32 + 0.5).sum::<f32>() / on.len() as f32
    };
    Ball {
        center_px: [mean(&|i| i % width), mean(&|i| i / width)],
        radius_px: (on.len() as f32 / std::f32::consts::PI).sqrt(),
        radius_m: 0.05,
        camera_distance_m: 1e4,
    }
}

#[test]
fn a_chrome_ball_and_a_grey_one_agree_on_twelve_lamps() {
    let Some(photographs) = test_support::shared("data/mirror_ball/images") else { return };
    let [chrome, grey] = ["chrome", "gray"].map(|what| far_ball(&photographs, what));
    let read =
        |what: &str, lamp: usize| file::read_encoded(&photographs.join(format!("{what}/{what}.{lamp}.png"))).unwrap();
    let geometry = MirrorBall::new(&chrome, None, read("chrome", 0).0.size()).unwrap();
    let table = ResponseTable::new(&DualGamma { gamma1: 2.2, gamma2: 2.2 });
    let mirrored: Vec<Vec3> = (0..12)
        .map(|lamp| {
            let codes = codes(&read("chrome", lamp));
            let seen: Vec<_> = geometry.pixels.iter().map(|p| codes[p.index]).collect();
            Footprint::find(&seen, &table).lamp("lamp", &geometry, &table).direction
        })
        .collect();
    type Decoding = fn(f32) -> f32;
    let decodings: [(&str, Decoding); 4] = [
        ("linear", |v| v),
        ("decoded with 1.5", |v| v.powf(1.5)),
        ("decoded with sRGB", linear_from_srgb),
        ("decoded with 2.2", |v| v.powf(2.2)),
    ];
    let mut results = Vec::new();
    for (name, decode) in decodings {
        let shaded: Vec<Shading> = (0..12)
            .map(|lamp| {
                let Encoded(picture) = read("gray", lamp);
                lamp_from_shading(&grey, &picture.map(|p| p.map(decode))).unwrap()
            })
            .collect();
        let angles: Vec<f32> = (shaded.iter().zip(&mirrored))
            .map(|(shading, mirror)| shading.direction.angle_between(*mirror).to_degrees())
            .collect();
        let mean = |values: &mut dyn Iterator<Item = f32>| values.sum::<f32>() / 12.0;
        let residual = mean(&mut shaded.iter().map(|s| s.residual));
        let angle = mean(&mut angles.iter().copied());
        println!("{name}: mean residual {residual:.4}, mean angle {angle:.2}°");
        for (lamp, (s, angle)) in shaded.iter().zip(&angles).enumerate() {
            println!(
                "  lamp {lamp:2}: chrome {:6.3}, grey {:6.3}, apart {angle:4.2}°; ambient {:6.3}, residual {:.4}, {} pixels",
                mirrored[lamp],
                s.direction,
                s.ambient / s.strength,
                s.residual,
                s.pixels
            );
        }
        results.push((residual, angles));
    }
    // Linear light has the smallest residual, and it alone gives a non-negative room light.
    let (residual, mut angles) = results.swap_remove(0);
    assert!(residual < 0.04 && results.iter().all(|other| residual < other.0));
    // The balls stood side by side in front of near lamps, and one lamp seems to have moved between them: no
    // decoding makes its two directions agree.
    angles.sort_by(f32::total_cmp);
    println!("linear: median {:.2}°, worst {:.2}° and {:.2}°", angles[6], angles[11], angles[10]);
    assert!(angles[6] < 3.0 && angles[10] < 5.0);
}
