//! Worst-case balls and photographs.

use super::*;

#[test]
fn a_ball_that_the_frame_cuts_says_what_is_missing() {
    let view = BallView { centre_px: [0.0, 128.0], ..near_ball() };
    let probe = probe(photographed(&view, (256, 256), |_| [1.0; 3]), &view);
    assert!((0.45..0.55).contains(&probe.blind_share), "{}", probe.blind_share);
    assert!((probe.filled_share - probe.blind_share).abs() < 1e-3);
    for value in probe.panorama.pixels.iter().flatten() {
        assert!((value - 1.0).abs() < 0.01, "{value}");
    }
    test_support::shown!(Light, "A mirror ball cut in half by the frame",
 bound: "reported share between 45 and 55 %; a uniform sky stays uniform to 1 %", measured: format!("{:.1} %", 100.0 * probe.blind_share));
}

#[test]
fn a_ball_of_few_pixels_is_still_light() {
    let view = BallView { centre_px: [3.0, 3.0], radius_px: 2.5, ..near_ball() };
    let probe = probe(photographed(&view, (6, 6), |_| [1.0, 2.0, 3.0]), &view);
    assert!(probe.ball_pixels >= 4 && probe.resolution_deg > 20.0);
    for pixel in &probe.panorama.pixels {
        assert!((pixel[0] - 1.0).abs() < 1e-3 && (pixel[2] - 3.0).abs() < 3e-3);
    }
}

#[test]
fn a_panorama_may_have_one_pixel() {
    let view = near_ball();
    let photograph = linear(photographed(&view, (256, 256), |_| [2.0; 3]));
    let probe = light_probe(&photograph, &view, ClippedLight::Keep, (1, 1)).unwrap();
    assert!((probe.panorama.pixels[0][0] - 2.0).abs() < 0.01);
    assert!(light_probe(&photograph, &view, ClippedLight::Keep, (0, 1)).is_err());
}

#[test]
fn impossible_balls_are_refused_with_a_sentence() {
    let picture = linear(Image::filled(256, 256, [1.0; 3]));
    let good = near_ball();
    for view in [
        BallView { radius_px: 1.0, ..good },
        BallView { radius_px: f64::NAN, ..good },
        BallView { centre_px: [f64::INFINITY, 0.0], ..good },
        BallView { centre_px: [900.0, 900.0], ..good },
        BallView { camera: BallCamera::Distance { ball_radii: 1.0 }, ..good },
        BallView { camera: BallCamera::Distance { ball_radii: f64::NAN }, ..good },
        BallView { camera: BallCamera::FocalLength { px: -3.0 }, ..good },
        BallView { camera: BallCamera::FieldOfView { degrees: 180.0, frame_px: 100.0 }, ..good },
        BallView { surroundings_radii: Some(0.5), ..good },
        BallView { reflectivity: [0.0, 1.0, 1.0], ..good },
        BallView { reflectivity: [1.1, 1.0, 1.0], ..good },
        BallView { reflectivity: [f32::NAN; 3], ..good },
    ] {
        let sentence = light_probe(&picture, &view, ClippedLight::Keep, (8, 4)).unwrap_err().to_string();
        assert!(sentence.starts_with("the mirror ball"), "{sentence}");
    }
    let dot = linear(Image::filled(1, 1, [1.0; 3]));
    assert!(light_probe(&dot, &good, ClippedLight::Keep, (8, 4)).is_err());
    let small = BallView { centre_px: [0.5, 0.5], radius_px: 1.1, ..good };
    assert!(light_probe(&dot, &small, ClippedLight::Estimate, (8, 4)).is_ok());
    assert!(light_probe(&linear(Image::filled(0, 0, [0.0; 3])), &good, ClippedLight::Keep, (8, 4)).is_err());
}

#[test]
fn a_black_ball_is_a_black_panorama() {
    let probe = probe(Image::filled(256, 256, [0.0; 3]), &near_ball());
    assert!(probe.panorama.pixels.iter().all(|p| *p == [0.0; 3]));
    assert_eq!((probe.filled_share, probe.clipped_pixels, probe.estimated_energy_share), (0.0, 0, 0.0));
    test_support::shown!(Light, "A black mirror ball",
 bound: "exactly 0", measured: "0");
}

#[test]
fn a_wholly_clipped_ball_is_counted_and_left_as_it_is() {
    let photograph = Photograph::from_linear(Image::filled(256, 256, [1.0; 3]), Some(1.0));
    for clipped in [ClippedLight::Keep, ClippedLight::Estimate] {
        let probe = light_probe(&photograph, &near_ball(), clipped, (64, 32)).unwrap();
        assert_eq!(probe.clipped_pixels, probe.ball_pixels);
        assert_eq!(probe.estimated_energy_share, 0.0);
        let unestimated = if clipped == ClippedLight::Estimate { probe.ball_pixels } else { 0 };
        assert_eq!(probe.unestimated_pixels, unestimated);
    }
    test_support::shown!(Light, "A mirror ball that is clipped everywhere",
 bound: "every pixel counted, none changed", measured: "all");
}

#[test]
fn values_that_are_not_light_are_repaired_and_counted() {
    let view = near_ball();
    let mut picture = photographed(&view, (256, 256), sky);
    picture.pixels[128 * 256 + 100] = [f32::NAN; 3];
    picture.pixels[120 * 256 + 140] = [f32::INFINITY, -1.0, 0.5];
    let probe = probe(picture, &view);
    assert_eq!((probe.repaired_pixels, probe.clipped_pixels), (2, 1));
    assert!(probe.panorama.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    test_support::shown!(Light, "NaN, ∞ and negative pixels on a mirror ball", bound: "all radiance finite and ≥ 0", measured: "holds");
}
