use super::picture::photographed;
use super::*;
use glam::{DVec3, Quat};
use imaging::{DualGamma, Response};
use light::{Environment, latlong};
use project;
use std::f64::consts::PI;

mod brackets;
mod hard_cases;
mod lamps;
mod two;

/// A ball seen from 4 m, 116 pixels in radius.
fn near_ball() -> BallView {
    BallView {
        centre_px: [128.0, 128.0],
        radius_px: 116.0,
        camera: BallCamera::Distance { ball_radii: 4.0 / 0.075 },
        surroundings_radii: None,
        reflectivity: [1.0; 3],
    }
}

/// A smooth sky with a broad lamp above the camera's right.
fn sky(d: DVec3) -> [f32; 3] {
    let wave = |a: DVec3, k: f64| 0.3 + 0.2 * (k * d.dot(a.normalize())).sin();
    let lamp = 3.0 * ((d.dot(DVec3::new(0.6, 0.5, 0.4).normalize()) - 1.0) / 0.03).exp();
    [
        wave(DVec3::new(0.3, 0.8, 0.5), 3.0) + lamp,
        wave(DVec3::new(-0.7, 0.2, 0.6), 4.0) + 0.9 * lamp,
        wave(DVec3::new(0.1, -0.4, 0.9), 2.0) + 0.7 * lamp,
    ]
    .map(|v| v as f32)
}

fn truth(size: (usize, usize), sky: impl Fn(DVec3) -> [f32; 3]) -> Image {
    Image::from_fn(size.0, size.1, |x, y| sky(latlong::texel_direction(x, y, size.0, size.1).as_dvec3()))
}

/// Peak signal-to-noise ratio in dB, weighted by solid angle, over the selected directions.
fn psnr(a: &Image, b: &Image, is_compared: impl Fn(DVec3) -> bool) -> f64 {
    let (width, height) = a.size();
    let (mut error, mut sphere, mut peak) = (0.0f64, 0.0f64, 0.0f64);
    for (i, (a, b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
        let d = latlong::texel_direction(i % width, i / width, width, height).as_dvec3();
        if !is_compared(d) {
            continue;
        }
        let angle = latlong::texel_solid_angle(i / width, width, height);
        for (a, b) in a.iter().zip(b) {
            error += angle * f64::from(a - b).powi(2);
            sphere += angle;
            peak = peak.max(f64::from(*b));
        }
    }
    10.0 * (peak * peak * sphere / error).log10()
}

fn linear(picture: Image) -> Photograph {
    Photograph::from_linear(picture, None)
}

fn probe(picture: Image, view: &BallView) -> LightProbe {
    light_probe(&linear(picture), view, ClippedLight::Keep, (256, 128)).unwrap()
}

fn outside_blind_cone(view: &BallView) -> impl Fn(DVec3) -> bool {
    // The outermost full pixels end a pixel and a half inside the rim.
    let reach = PI - view.profile().angle(1.0 - 1.5 / view.radius_px).0;
    move |d| d.angle_between(DVec3::NEG_Z) > reach
}

#[test]
fn a_photographed_ball_becomes_the_sky_around_it() {
    for camera in [BallCamera::Far, BallCamera::Distance { ball_radii: 53.0 }, BallCamera::Distance { ball_radii: 4.0 }]
    {
        for surroundings_radii in [None, Some(10.0)] {
            let view = BallView { camera, surroundings_radii, ..near_ball() };
            let probe = probe(photographed(&view, (256, 256), sky), &view);
            let psnr = psnr(&probe.panorama, &truth((256, 128), sky), outside_blind_cone(&view));
            println!(
                "{camera:?}, surroundings {surroundings_radii:?}: {psnr:.1} dB, blind {:.4}, filled {:.4}",
                probe.blind_share, probe.filled_share
            );
            assert!(psnr > 45.0, "{camera:?}: {psnr:.1} dB");
        }
    }
}

#[test]
fn the_wrong_distance_is_noticed() {
    // Check that the test above measures geometry: a ball treated as far away is worse.
    let near = BallView { camera: BallCamera::Distance { ball_radii: 4.0 }, ..near_ball() };
    let far = BallView { camera: BallCamera::Far, ..near };
    let picture = photographed(&near, (256, 256), sky);
    let [right, wrong] = [near, far]
        .map(|view| psnr(&probe(picture.clone(), &view).panorama, &truth((256, 128), sky), outside_blind_cone(&near)));
    assert!(wrong < right - 15.0, "{right:.1} and {wrong:.1} dB");
}

#[test]
fn the_geometry_is_that_of_the_calibration() {
    use crate::mirror_ball::MirrorBall;
    let ball = project::Ball { center_px: [60.0, 66.0], radius_px: 50.0, radius_m: 0.075, camera_distance_m: 0.9 };
    for dome in [None, Some(2.0)] {
        let theirs = MirrorBall::new(&ball, dome, (128, 128)).unwrap();
        let ours = BallView::new(&ball, dome).projection((128, 128)).unwrap();
        let angles = ours.solid_angles();
        for pixel in &theirs.pixels {
            let (x, y) = ((pixel.index % 128) as f64 + 0.5, (pixel.index / 128) as f64 + 0.5);
            let (direction, _) = ours.look(x, y).unwrap();
            assert!(direction.as_vec3().distance(pixel.direction) < 1e-5);
            let rho = (x - 60.0).hypot(y - 66.0);
            // The reference is the mean of a ring; towards the rim the solid angle bends within it.
            if rho < 45.0 {
                assert!((angles[pixel.index] / f64::from(pixel.solid_angle) - 1.0).abs() < 2e-3);
            }
        }
        let shown: f64 = theirs.pixels.iter().map(|p| angles[p.index]).sum();
        let blind = 1.0 - shown / (4.0 * PI);
        assert!((blind - f64::from(theirs.blind_share)).abs() < 1e-3);
    }
}

#[test]
fn a_balls_pixels_and_its_blind_cone_make_a_sphere() {
    let view =
        BallView { camera: BallCamera::Distance { ball_radii: 3.0 }, surroundings_radii: Some(8.0), ..near_ball() };
    let shown: f64 = view.projection((256, 256)).unwrap().solid_angles().iter().sum();
    let cone = 2.0 * PI * (1.0 - view.blind_half_angle_deg().to_radians().cos());
    assert!((shown + cone - 4.0 * PI).abs() < 1e-9);
    assert!((view.blind_half_angle_deg().to_radians() - (1.0f64 / 3.0).asin() - 0.125f64.asin()).abs() < 1e-12);
}

#[test]
fn focal_length_field_of_view_and_distance_are_one_figure() {
    let radius_px = 100.0;
    let distance = BallCamera::Distance { ball_radii: 20.0 };
    let px = distance.focal_px(radius_px);
    let focal = BallCamera::FocalLength { px };
    let degrees = 2.0 * (3000.0 / px).atan().to_degrees();
    let field = BallCamera::FieldOfView { degrees, frame_px: 6000.0 };
    for camera in [distance, focal, field] {
        assert!((camera.distance_radii(radius_px) - 20.0).abs() < 1e-9, "{camera:?}");
        assert!((camera.focal_px(radius_px) - px).abs() < 1e-6);
    }
    // Both definitions of the silhouette's half angle agree.
    assert!(((radius_px / px).atan() - (1.0f64 / 20.0).asin()).abs() < 1e-12);
    assert_eq!(BallCamera::Far.distance_radii(radius_px), f64::INFINITY);
}

#[test]
fn energy_is_that_of_the_balls_pixels_and_what_was_filled() {
    let view = near_ball();
    let picture = photographed(&view, (256, 256), sky);
    let ball = Ball::new(&linear(picture.clone()), &view, ClippedLight::Keep).unwrap();
    let angles = view.projection((256, 256)).unwrap().solid_angles();
    let on_ball: f64 = (0..angles.len())
        .filter(|&i| ball.usable[i] > 0.0)
        .map(|i| angles[i] * f64::from(luminance(picture.pixels[i])))
        .sum();
    let probe = probe(picture, &view);
    let energy = Mapping::LatLong.energy(&probe.panorama).unwrap();
    let all = f64::from(luminance(energy.map(|e| e as f32)));
    let kept = all * (1.0 - f64::from(probe.filled_share));
    assert!((kept / on_ball - 1.0).abs() < 1e-4, "{kept} of {on_ball}");
}

#[test]
fn the_blind_cone_is_filled_without_a_jump() {
    let view = BallView { camera: BallCamera::Distance { ball_radii: 3.0 }, ..near_ball() };
    let probe = probe(photographed(&view, (256, 256), sky), &view);
    let angles = view.projection((256, 256)).unwrap().solid_angles();
    let ball = Ball::new(&linear(Image::filled(256, 256, [1.0; 3])), &view, ClippedLight::Keep);
    let usable = ball.unwrap().usable;
    let shown: f64 = (0..angles.len()).filter(|&i| usable[i] > 0.0).map(|i| angles[i]).sum();
    let blind = 1.0 - shown / (4.0 * PI);
    // The cone alone is sin²(19.5°/2) = 2.9 % of the sphere; the rest is pixels cut by the rim.
    assert!(blind > 0.0287 && (f64::from(probe.blind_share) - blind).abs() < 1e-4);
    assert!(probe.filled_share > 0.0 && probe.filled_share < 2.0 * probe.blind_share);
    // Across the cone's border, 19.5° or 14 texels from the middle, as within the sky itself.
    let sky = truth((256, 128), sky);
    for (x, c) in (106..150).flat_map(|x| [(x, 0), (x, 1), (x, 2)]) {
        let step = |image: &Image| (image.at(x, 64)[c] - image.at(x + 1, 64)[c]).abs();
        assert!(step(&probe.panorama) < step(&sky) + 0.015, "{x}: {}", step(&probe.panorama));
    }
}

#[test]
fn the_balls_reflectivity_is_divided_out() {
    let view = BallView { reflectivity: [0.7, 0.65, 0.6], ..near_ball() };
    let probe = probe(photographed(&view, (256, 256), sky), &view);
    assert!(psnr(&probe.panorama, &truth((256, 128), sky), outside_blind_cone(&view)) > 45.0);
}

#[test]
fn the_shared_stages_ball_shows_a_lamp_where_it_is() {
    let Some(path) = test_support::shared("data/stage/probes/olat_05.png") else { return };
    let manifest = std::fs::read_to_string(path.parent().unwrap().join("../manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    let bank = &manifest["bank_directions"][5];
    let bank = DVec3::from_array([0, 1, 2].map(|i| bank[i].as_f64().unwrap())).normalize();
    let picture = imaging::file::read_encoded(&path).unwrap();
    let response = Response::Power(2.2);
    let view = BallView { surroundings_radii: Some(4.0 / 0.075), radius_px: 256.0 / 2.2, ..near_ball() };
    let photograph = Photograph::from_encoded(&picture, &response);
    let probe = light_probe(&photograph, &view, ClippedLight::Keep, (256, 128)).unwrap();
    let environment = Environment::from_radiance("", probe.panorama);
    let mut moment = DVec3::ZERO;
    for (i, pixel) in environment.radiance.pixels.iter().enumerate() {
        let angle = latlong::texel_solid_angle(i / 256, 256, 128);
        let d = latlong::texel_direction(i % 256, i / 256, 256, 128).as_dvec3();
        moment += angle * f64::from(luminance(*pixel)) * d;
    }
    let off = moment.angle_between(bank).to_degrees();
    println!("the lamp's centroid is {off:.2}° from the bank");
    assert!(off < 6.0, "{off:.2}°");
}
