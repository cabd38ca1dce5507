use super::*;
use crate::latlong;
use glam::Vec3;
use proptest::prelude::*;
use std::f64::consts::PI;

mod pfstools;

/// A smooth sky of many colours, 0.2 to 1.8.
fn sky(d: DVec3) -> [f32; 3] {
    let wave = |a: DVec3, k: f64| 1.0 + 0.8 * (k * d.dot(a)).sin() * (0.7 * k * d.cross(a).x).cos();
    [
        wave(DVec3::new(0.3, 0.8, 0.5).normalize(), 3.0),
        wave(DVec3::new(-0.7, 0.2, 0.6).normalize(), 4.0),
        wave(DVec3::new(0.1, -0.4, 0.9).normalize(), 2.0),
    ]
    .map(|v| v as f32)
}

/// A sky in a mapping, by the mean of many rays in each pixel, the grid displaced by `shift` pixels.
fn drawn(mapping: Mapping, size: (usize, usize), shift: f64, sky: impl Fn(DVec3) -> [f32; 3]) -> Image {
    const RAYS: usize = 4;
    Image::from_fn(size.0, size.1, |x, y| {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for ray in 0..RAYS * RAYS {
            let at =
                |p: usize, r: usize, size: usize| (p as f64 + shift + (r as f64 + 0.5) / RAYS as f64) / size as f64;
            let place = (at(x, ray % RAYS, size.0), at(y, ray / RAYS, size.1));
            if let Some(d) = mapping.direction(place.0, place.1) {
                sum = [0, 1, 2].map(|c| sum[c] + sky(d)[c]);
                count += 1.0;
            }
        }
        sum.map(|v| if count > 0.0 { v / count } else { 0.0 })
    })
}

fn painted(mapping: Mapping, size: (usize, usize)) -> Image {
    drawn(mapping, size, 0.0, sky)
}

/// Peak signal-to-noise ratio in dB, weighted by solid angle, and the largest difference relative to the peak.
/// Counts pixels fully inside the picture whose centre's direction is selected.
fn compared(a: &Image, b: &Image, mapping: Mapping, of_interest: impl Fn(DVec3) -> bool) -> (f64, f64) {
    let projection = mapping.projection(a.size()).unwrap();
    let (angles, coverage) = (projection.solid_angles(), projection.coverage());
    let (mut error, mut sphere, mut peak, mut worst) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for i in (0..angles.len()).filter(|&i| coverage[i] == 1.0) {
        let (x, y) = projection.centre(i);
        if !projection.look(x, y).is_some_and(|(d, _)| of_interest(d)) {
            continue;
        }
        for (a, b) in a.pixels[i].iter().zip(&b.pixels[i]) {
            let difference = f64::from(a - b).abs();
            error += angles[i] * difference * difference;
            sphere += angles[i];
            peak = peak.max(f64::from(*b));
            worst = worst.max(difference);
        }
    }
    (10.0 * (peak * peak * sphere / error).log10(), worst / peak)
}

/// Directions that every pixel of a mapping's picture shows well. The outermost full pixels of a mirror ball span
/// many degrees, and detail between them was averaged away.
fn clear_of_the_rim(mapping: Mapping, height: usize) -> impl Fn(DVec3) -> bool {
    let reach = match mapping {
        Mapping::MirrorBall => (1.0 - 4.0 / height as f64).acos() * 2.0,
        _ => -1.0,
    };
    move |d| d.angle_between(DVec3::NEG_Z) > reach
}

fn assert_same_energy(a: [f64; 3], b: [f64; 3]) {
    for (a, b) in a.into_iter().zip(b) {
        assert!((a - b).abs() <= 1e-5 * a.max(1e-12), "{a} became {b}");
    }
}

fn any_mapping() -> impl Strategy<Value = Mapping> {
    (0..Mapping::ALL.len()).prop_map(|i| Mapping::ALL[i])
}

fn any_direction() -> impl Strategy<Value = DVec3> {
    (-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0)
        .prop_map(|(x, y, z)| DVec3::new(x, y, z))
        .prop_filter("a length", |d| d.length() > 0.1)
        .prop_map(|d| d.normalize())
}

/// A speckled picture with a lamp of a million in one visible pixel.
fn speckled(mapping: Mapping, size: (usize, usize), seed: usize) -> Image {
    let mut image = Image::from_fn(size.0, size.1, |x, y| {
        [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7 + seed * 13) % 97) as f32 / 50.0)
    });
    let angles = mapping.solid_angles(size).unwrap().pixels;
    let shown: Vec<usize> = (0..angles.len()).filter(|&i| angles[i] > 0.0).collect();
    image.pixels[shown[seed * 7919 % shown.len()]] = [1e6, 5e5, 2.0];
    image
}

proptest! {
    #[test]
    fn directions_have_a_place_that_shows_them(mapping in any_mapping(), d in any_direction()) {
        let (u, v) = mapping.position(d);
        let back = mapping.direction(u, v).unwrap();
        // A disc's rim shows one direction: an offset of 1e-16 there is an angle of 1e-8.
        prop_assert!(back.distance(d) < 1e-6, "{d} at ({u}, {v}) is {back}");
    }

    #[test]
    fn places_have_a_direction_that_leads_back(mapping in any_mapping(), u in 0.001f64..0.999, v in 0.001f64..0.999) {
        if let Some(direction) = mapping.direction(u, v) {
            let (u2, v2) = mapping.position(direction);
            prop_assert!((u - u2).abs() < 1e-7 && (v - v2).abs() < 1e-7, "({u}, {v}) is ({u2}, {v2})");
        }
    }

    #[test]
    fn every_picture_covers_the_sphere(mapping in any_mapping(), height in 1usize..40) {
        let angles = mapping.solid_angles(mapping.size(height)).unwrap();
        let sum: f64 = angles.pixels.iter().sum();
        prop_assert!((sum - 4.0 * PI).abs() < 1e-10, "{sum}");
    }

    #[test]
    fn a_conversion_keeps_the_energy(from in any_mapping(), to in any_mapping(), a in 1usize..30, b in 1usize..30, seed in 0usize..1000) {
        let image = speckled(from, from.size(a), seed);
        let other = convert(&image, from, to, to.size(b)).unwrap().image;
        assert_same_energy(from.energy(&image).unwrap(), to.energy(&other).unwrap());
    }

    #[test]
    fn a_turned_world_keeps_the_energy(mapping in any_mapping(), axis in any_direction(), angle in 0.0f32..6.3, seed in 0usize..1000) {
        let turn = Quat::from_axis_angle(axis.as_vec3().normalize(), angle);
        let image = speckled(mapping, mapping.size(12), seed);
        let other = convert_turned(&image, mapping, Mapping::LatLong, (32, 16), turn).unwrap().image;
        assert_same_energy(mapping.energy(&image).unwrap(), Mapping::LatLong.energy(&other).unwrap());
    }

    #[test]
    fn an_even_sky_stays_even(from in any_mapping(), to in any_mapping(), a in 1usize..30, b in 1usize..30) {
        let size = from.size(a);
        let other = convert(&Image::filled(size.0, size.1, [0.5, 2.0, 0.0]), from, to, to.size(b)).unwrap().image;
        let angles = to.solid_angles(to.size(b)).unwrap().pixels;
        for (pixel, angle) in other.pixels.iter().zip(angles) {
            let expected = if angle > 0.0 { [0.5, 2.0, 0.0] } else { [0.0; 3] };
            for (is, expected) in pixel.iter().zip(expected) {
                prop_assert!((is - expected).abs() <= 1e-5 * expected, "{pixel:?}");
            }
        }
    }
}

#[test]
fn the_middles_and_sides_are_those_of_the_table() {
    let near = |mapping: Mapping, u: f64, v: f64, d: DVec3| {
        let found = mapping.direction(u, v).unwrap();
        assert!(found.distance(d) < 1e-9, "{mapping:?} ({u}, {v}): {found} is not {d}");
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (mapping, middle) in [(Mapping::Angular, -z), (Mapping::MirrorBall, z), (Mapping::LatLong, -z)] {
        near(mapping, 0.5, 0.5, middle);
    }
    near(Mapping::Angular, 0.75, 0.5, x);
    near(Mapping::Angular, 0.5, 0.25, y);
    let quarter = 0.5 + 0.5 * (PI / 4.0).sin();
    near(Mapping::MirrorBall, quarter, 0.5, x);
    near(Mapping::MirrorBall, 0.5, 1.0 - quarter, y);
    for (u, v, d) in [(1.5, 1.5, -z), (2.5, 1.5, x), (0.5, 1.5, -x), (3.5, 1.5, z), (1.5, 0.5, y), (1.5, 2.5, -y)] {
        near(Mapping::CubeCross, u / 4.0, v / 3.0, d);
    }
    for (i, d) in [x, -x, y, -y, z, -z].into_iter().enumerate() {
        near(Mapping::CubeStrip, (i as f64 + 0.5) / 6.0, 0.5, d);
    }
    assert_eq!(Mapping::CubeCross.direction(0.1, 0.1), None);
    assert_eq!(Mapping::Angular.direction(0.01, 0.01), None);
}

#[test]
fn a_lat_long_agrees_with_the_panorama_of_the_program() {
    for (u, v) in [(0.1f32, 0.2f32), (0.5, 0.5), (0.93, 0.8)] {
        let theirs = latlong::direction_from_uv(u, v);
        let ours = Mapping::LatLong.direction(u.into(), v.into()).unwrap();
        assert!(ours.as_vec3().distance(theirs) < 1e-6);
    }
}

#[test]
fn a_cube_is_unfolded_without_tears() {
    // Both sides of an edge between two touching faces of the cross look alike.
    let size = (64, 48);
    let image = painted(Mapping::CubeCross, size);
    for (a, b) in
        [((31, 20), (32, 20)), ((15, 20), (16, 20)), ((47, 20), (48, 20)), ((20, 15), (20, 16)), ((20, 31), (20, 32))]
    {
        let (a, b) = (image.at(a.0, a.1), image.at(b.0, b.1));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 0.25, "{a} beside {b}");
        }
    }
}

#[test]
fn mirror_ball_pixels_cover_the_same_solid_angle() {
    let angles = Mapping::MirrorBall.solid_angles((64, 64)).unwrap();
    // 4 · dA for a unit ball.
    let expected = 4.0 / (32.0f64 * 32.0);
    assert!((angles.at(40, 20) - expected).abs() < 1e-12);
    assert!(angles.pixels.iter().all(|a| *a <= expected + 1e-12));
}

#[test]
fn angular_pixels_cover_what_many_small_ones_do() {
    // dω/dA = π²·sin(πr)/(πr) per unit of the disc's radius squared, by the midpoint rule.
    let angles = Mapping::Angular.solid_angles((32, 32)).unwrap();
    for (x, y) in [(16, 16), (20, 9), (27, 16), (3, 17)] {
        let mut sum = 0.0;
        const N: usize = 64;
        for i in 0..N * N {
            let at = |p: usize, i: usize| (p as f64 + (i as f64 + 0.5) / N as f64) / 16.0 - 1.0;
            let r = at(x, i % N).hypot(at(y, i / N));
            sum += PI * PI * (PI * r).sin() / (PI * r) / (16.0 * N as f64).powi(2);
        }
        assert!((angles.at(x, y) / sum - 1.0).abs() < 1e-5, "({x}, {y})");
    }
}

#[test]
fn a_smooth_sky_looks_the_same_in_every_mapping() {
    for from in Mapping::ALL {
        for to in Mapping::ALL {
            let image = painted(from, from.size(128));
            let other = convert(&image, from, to, to.size(96)).unwrap().image;
            let clear = clear_of_the_rim(from, 128);
            let (psnr, worst) = compared(&other, &painted(to, to.size(96)), to, clear);
            println!("{from:?} → {to:?}: {psnr:.1} dB, worst {worst:.4}");
            assert!(psnr > 50.0, "{from:?} → {to:?}: {psnr:.1} dB");
        }
    }
}

#[test]
fn a_round_trip_through_the_angular_map_brings_the_panorama_back() {
    let image = painted(Mapping::LatLong, (256, 128));
    let angular = convert(&image, Mapping::LatLong, Mapping::Angular, (256, 256)).unwrap().image;
    let back = convert(&angular, Mapping::Angular, Mapping::LatLong, (256, 128)).unwrap().image;
    let (psnr, worst) = compared(&back, &image, Mapping::LatLong, |_| true);
    println!("lat-long → angular → lat-long: {psnr:.1} dB, worst {worst:.4}");
    assert!(psnr > 55.0 && worst < 0.02, "{psnr:.1} dB, worst {worst:.4}");
}

#[test]
fn nothing_jumps_at_the_seam_or_the_poles() {
    // A rotation about an oblique axis moves every seam and pole of the source through the target's middle.
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 0.4, 0.2).normalize(), 1.4);
    for from in Mapping::ALL {
        let image = painted(from, from.size(128));
        let turned = convert_turned(&image, from, Mapping::LatLong, (128, 64), turn).unwrap().image;
        let back = turn.inverse().as_dquat();
        let truth = Image::from_fn(128, 64, |x, y| sky(back * latlong::texel_direction(x, y, 128, 64).as_dvec3()));
        let clear = clear_of_the_rim(from, 128);
        let (psnr, worst) = compared(&turned, &truth, Mapping::LatLong, |d| clear(back * d));
        println!("{from:?} turned: {psnr:.1} dB, worst {worst:.4}");
        assert!(worst < 0.02, "{from:?}: {psnr:.1} dB, worst {worst:.4}");
    }
}

#[test]
fn a_yaw_moves_the_picture_to_the_right() {
    let image = painted(Mapping::LatLong, (64, 32));
    let yaw = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let turned = convert_turned(&image, Mapping::LatLong, Mapping::LatLong, (64, 32), yaw).unwrap().image;
    let moved = Image::from_fn(64, 32, |x, y| image.at((x + 64 - 16) % 64, y));
    assert!(compared(&turned, &moved, Mapping::LatLong, |_| true).0 > 50.0);
}

#[test]
fn what_is_outside_a_disc_does_not_matter() {
    let clean = painted(Mapping::Angular, (32, 32));
    let mut dirty = clean.clone();
    dirty.pixels[0] = [f32::NAN; 3];
    dirty.pixels[31] = [1e9; 3];
    let [a, b] = [&clean, &dirty].map(|image| convert(image, Mapping::Angular, Mapping::LatLong, (32, 16)).unwrap());
    assert_eq!((a.image, a.repaired_pixels), (b.image, b.repaired_pixels));
}

#[test]
fn values_that_are_not_light_are_repaired_and_counted() {
    let mut image = painted(Mapping::MirrorBall, (32, 32));
    image.pixels[16 * 32 + 16] = [f32::NAN, f32::INFINITY, -1.0];
    let converted = convert(&image, Mapping::MirrorBall, Mapping::LatLong, (32, 16)).unwrap();
    assert_eq!(converted.repaired_pixels, 1);
    assert!(converted.image.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    let nothing = Image::filled(8, 8, [f32::NAN; 3]);
    let black = convert(&nothing, Mapping::Angular, Mapping::LatLong, (8, 4)).unwrap();
    assert!(black.image.pixels.iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn sizes_that_do_not_suit_are_refused() {
    for (mapping, size) in [
        (Mapping::LatLong, (0, 4)),
        (Mapping::Angular, (8, 9)),
        (Mapping::MirrorBall, (0, 0)),
        (Mapping::CubeCross, (9, 6)),
        (Mapping::CubeCross, (12, 12)),
        (Mapping::CubeStrip, (6, 2)),
    ] {
        let sentence = mapping.solid_angles(size).unwrap_err().to_string();
        assert!(sentence.contains("mapping"), "{sentence}");
        let one = Image::filled(1, 1, [1.0; 3]);
        assert!(convert(&one, Mapping::LatLong, mapping, size).is_err());
    }
}
