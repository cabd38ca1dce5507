//! Two photographs of a ball from different sides.

use super::*;

/// Ground truth with a glaring camera around the +Z of a photograph's frame.
fn with_camera(turn: Quat) -> impl Fn(DVec3) -> [f32; 3] {
    let turn = turn.as_dquat();
    move |d| {
        if d.angle_between(DVec3::Z) < 10f64.to_radians() { [9.0, 0.0, 9.0] } else { sky(turn * d) }
    }
}

fn settings() -> TwoBallsSettings {
    TwoBallsSettings { size: (256, 128), ..Default::default() }
}

/// Photographs of the sky from the front and from `turn`, the second with `gain` times the exposure.
fn photographs(turn: Quat, gain: f32) -> [Photograph; 2] {
    let view = near_ball();
    let first = photographed(&view, (256, 256), with_camera(Quat::IDENTITY));
    let second = photographed(&view, (256, 256), with_camera(turn));
    [linear(first), linear(second.map(|p| p.map(|v| gain * v)))]
}

fn joined(photographs: &[Photograph; 2], turn: Quat, settings: &TwoBallsSettings) -> TwoBalls {
    let view = near_ball();
    let [first, second] = photographs;
    merge_balls([(first, &view), (second, &view)], turn, settings).unwrap()
}

#[test]
fn neither_camera_nor_rim_shows_in_two_balls_joined() {
    for degrees in [60.0f32, 90.0, 120.0] {
        let turn = Quat::from_rotation_y(degrees.to_radians());
        let photographs = photographs(turn, 1.7);
        let both = joined(&photographs, turn, &settings());
        let truth = truth((256, 128), sky);
        let whole = psnr(&both.panorama, &truth, |_| true);
        let camera = |d: DVec3| {
            let second = turn.as_dquat() * DVec3::Z;
            [DVec3::Z, -DVec3::Z, second, -second].iter().any(|axis| d.angle_between(*axis) < 0.25)
        };
        let cameras = psnr(&both.panorama, &truth, camera);
        let alone = light_probe(&photographs[0], &near_ball(), ClippedLight::Keep, (256, 128)).unwrap();
        let alone = psnr(&alone.panorama, &truth, camera);
        println!(
            "{degrees}°: {whole:.1} dB, near the cameras and blind cones {cameras:.1} dB (one ball {alone:.1}), ratio \
             {:.4}, disagreement {:.4} stops, refined by {:.2}°",
            both.exposure_ratio, both.disagreement_stops, both.refined_deg
        );
        assert!(whole > 45.0 && cameras > 42.0, "{whole:.1} and {cameras:.1} dB");
        assert!(alone < 25.0, "the cameras show in one ball: {alone:.1} dB");
        assert!((both.exposure_ratio / 1.7 - 1.0).abs() < 0.005, "{}", both.exposure_ratio);
        assert_eq!((both.blind_share, both.filled_share), (0.0, 0.0));
        assert!(both.disagreement_stops < 0.02 && both.refined_deg < 0.3);
        // A camera's magenta has no green, unlike anything in the sky.
        assert!(both.panorama.pixels.iter().all(|p| p[1] > 0.05));
    }
}

#[test]
fn an_inexact_rotation_is_refined() {
    let turn = Quat::from_rotation_y(90f32.to_radians());
    let photographs = photographs(turn, 0.8);
    let off = Quat::from_axis_angle(glam::Vec3::new(0.3, 0.9, -0.2).normalize(), 3f32.to_radians());
    let truth = truth((256, 128), sky);
    let refined = joined(&photographs, off * turn, &settings());
    let unrefined = joined(&photographs, off * turn, &TwoBallsSettings { refine: false, ..settings() });
    let left = refined.turn.angle_between(turn).to_degrees();
    let [a, b] = [&refined, &unrefined].map(|both| psnr(&both.panorama, &truth, |_| true));
    println!("3° off: {left:.2}° left, {a:.1} dB refined, {b:.1} dB unrefined");
    assert!(left < 0.3, "{left}° left");
    assert!(a > b + 6.0, "{a:.1} and {b:.1} dB");
    assert_eq!(unrefined.refined_deg, 0.0);
    assert!((refined.refined_deg - 3.0).abs() < 0.3);
}

#[test]
fn cameras_on_one_line_leave_something_to_fill() {
    for degrees in [0.0f32, 180.0] {
        let turn = Quat::from_rotation_y(degrees.to_radians());
        let both = joined(&photographs(turn, 1.0), turn, &settings());
        assert!(both.blind_share > 0.01 && both.filled_share > 0.0, "{degrees}°: {}", both.blind_share);
        assert!(both.panorama.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    }
}

#[test]
fn black_balls_are_joined_to_black() {
    let black = || linear(Image::filled(256, 256, [0.0; 3]));
    let both = joined(&[black(), black()], Quat::from_rotation_y(1.5), &settings());
    assert!(both.panorama.pixels.iter().all(|p| *p == [0.0; 3]));
    assert_eq!((both.exposure_ratio, both.filled_share), (1.0, 0.0));
}

#[test]
fn impossible_rotations_are_refused() {
    let photographs = photographs(Quat::IDENTITY, 1.0);
    let view = near_ball();
    let [first, second] = &photographs;
    for (turn, camera_half_angle_deg) in [
        (Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), 15.0),
        (Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), 15.0),
        (Quat::IDENTITY, f32::NAN),
        (Quat::IDENTITY, 200.0),
    ] {
        let settings = TwoBallsSettings { camera_half_angle_deg, ..settings() };
        assert!(merge_balls([(first, &view), (second, &view)], turn, &settings).is_err());
    }
}
