use super::*;
use crate::Environment;
use crate::brightest;
use crate::latlong::texel_solid_angle;
use glam::Vec3;
use imaging::color::luminance;

#[test]
fn every_environment_is_light_with_a_name_and_a_sentence() {
    for environment in all() {
        let image = (environment.make)(128);
        assert_eq!(image.size(), (128, 64), "{}", environment.name);
        let light = image.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0);
        assert!(light && image.pixels.iter().any(|&p| luminance(p) > 0.0), "{}", environment.name);
        assert!(environment.describe.ends_with('.') && !environment.title.is_empty());
        assert_eq!(named(environment.name).unwrap().title, environment.title);
        assert_eq!(all().iter().filter(|other| other.name == environment.name).count(), 1);
    }
    assert!(named("nowhere").is_none());
}

#[test]
fn the_energy_does_not_depend_on_the_resolution() {
    for environment in all() {
        let energy = |width| Environment::from_radiance("", (environment.make)(width)).energy();
        let bound = if environment.name == "nave" { 0.03 } else { 0.01 };
        let fine = energy(768);
        for width in [256, 384, 512] {
            for (a, b) in energy(width).into_iter().zip(fine) {
                assert!((a / b - 1.0).abs() < bound, "{} at {width}: {a} for {b}", environment.name);
            }
        }
    }
}

#[test]
fn the_brightest_light_is_where_the_sentence_says() {
    // Azimuth and elevation in degrees.
    for (name, azimuth, elevation) in [
        ("clear-sky", -130.0f32, 40.0f32),
        ("low-sun", 48.0, 8.0),
        ("courtyard", 127.7, 38.3),
        ("three-point", -135.0, 36.0),
        ("clamshell", 180.0, 42.0),
        ("side-light", -98.0, 18.0),
    ] {
        let panorama = Environment::from_radiance(name, (named(name).unwrap().make)(512));
        let light = &brightest::areas(&panorama, 1)[0];
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let wanted = Vec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos());
        let off = light.direction.angle_between(wanted).to_degrees();
        assert!(off < 2.0 && light.share > 0.3, "{name}: {light:?} is {off}° off");
    }
}

#[test]
fn studios_light_white_that_faces_the_key_with_radiance_1() {
    for (name, share) in [("three-point", 1.0), ("clamshell", 1.0), ("side-light", 1.0)] {
        let image = (named(name).unwrap().make)(256);
        // Only the boxes are this much brighter than the rest of the room.
        let energy: f64 = image
            .pixels
            .iter()
            .enumerate()
            .filter(|(_, p)| luminance(**p) > 1.5)
            .map(|(i, &p)| f64::from(luminance(p)) * texel_solid_angle(i / 256, 256, 128))
            .sum();
        let white = energy / std::f64::consts::PI;
        assert!((0.9 * share..2.1 * share).contains(&white), "{name}: {white}");
    }
}

#[test]
fn the_smallest_panoramas_are_made() {
    for environment in all() {
        assert_eq!((environment.make)(0).size(), (2, 1));
    }
}
