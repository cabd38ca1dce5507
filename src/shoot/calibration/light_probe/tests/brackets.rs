//! Exposure brackets.

use super::*;
use imaging::{Encoded, Raster};
use proptest::prelude::*;

/// A scene with six orders of magnitude.
fn scene() -> Image {
    Image::from_fn(48, 32, |x, y| {
        let level = 10f32.powf(-3.0 + 6.0 * (x * 32 + y) as f32 / 1536.0);
        [level, 0.8 * level, 0.6 * level]
    })
}

/// Light recorded by a noisy 8-bit camera at an exposure.
fn shot(light: &Image, stops: f32, response: &Response, seed: u32) -> Photograph {
    let mut seed = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    let exposed = light.map(|p| p.map(|v| v * stops.exp2()));
    let Encoded(codes) = response.encode(&exposed);
    let rounded = codes.map(|p| {
        p.map(|v| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let dither = (seed >> 8) as f32 / 16_777_216.0 - 0.5;
            ((v * 255.0 + dither).round() / 255.0).clamp(0.0, 1.0)
        })
    });
    Photograph::from_encoded(&Encoded(rounded), response)
}

fn response() -> Response {
    DualGamma::new(2.4, 2.1).unwrap().into()
}

fn merged(photographs: &[Photograph], stops: &[f32]) -> base::error::Result<Bracket> {
    let exposures: Vec<Exposure> =
        (photographs.iter().zip(stops)).map(|(photograph, &stops)| Exposure { photograph, stops }).collect();
    merge(&exposures)
}

fn shots(stops: &[f32]) -> Vec<Photograph> {
    let seeds = 0..stops.len() as u32;
    (stops.iter().zip(seeds)).map(|(&s, seed)| shot(&scene(), s, &response(), seed)).collect()
}

#[test]
fn a_bracket_holds_more_than_any_of_its_photographs() {
    let stops = [0.0, -2.5, -5.0, -7.5, -10.0, 2.5, 5.0];
    let photographs = shots(&stops);
    let bracket = merged(&photographs, &stops).unwrap();
    // Worst single channel within the range of the exposures.
    let (mut worst, mut square, mut count) = (0.0f32, 0.0f32, 0.0f32);
    for (is, truth) in bracket.photograph.light.pixels.iter().zip(&scene().pixels) {
        for (is, truth) in is.iter().zip(truth).filter(|(_, t)| **t > 3e-3) {
            let error = (is / truth).log2().abs();
            worst = worst.max(error);
            square += error * error;
            count += 1.0;
        }
    }
    let rms = (square / count).sqrt();
    println!("worst {worst:.4} stops, root mean square {rms:.4}, clipped {}", bracket.clipped_pixels);
    assert!(worst < 0.1 && rms < 0.02, "worst {worst} stops, rms {rms}");
    assert!(bracket.disagreement_stops < 0.03, "{}", bracket.disagreement_stops);
    assert_eq!(bracket.gap_pixels, 0);
    for (measured, given) in bracket.measured_stops.iter().zip(stops) {
        assert!((measured.unwrap() - given).abs() < 0.05, "{measured:?} for {given}");
    }
    let clipped = scene().pixels.iter().filter(|p| p[0] * (-10f32).exp2() >= 0.997).count();
    assert!(bracket.clipped_pixels.abs_diff(clipped) <= 2, "{} of {clipped}", bracket.clipped_pixels);
}

#[test]
fn the_order_of_a_bracket_does_not_matter() {
    let photographs = shots(&[0.0, -3.0, -6.0]);
    let forward = merged(&photographs, &[0.0, -3.0, -6.0]).unwrap();
    let backward: Vec<Photograph> = photographs.into_iter().rev().collect();
    let backward = merged(&backward, &[-6.0, -3.0, 0.0]).unwrap();
    for (a, b) in (forward.photograph.light.pixels.iter()).zip(&backward.photograph.light.pixels) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= 1e-5 * a);
        }
    }
}

#[test]
fn what_all_exposures_clip_and_what_none_raises_is_counted() {
    let light = Image::from_fn(20, 10, |x, _| match x {
        0..5 => [100.0; 3],
        5..10 => [0.0; 3],
        _ => [0.2; 3],
    });
    let photographs = [0.0, -2.0].map(|s| shot(&light, s, &response(), 3));
    let bracket = merged(&photographs, &[0.0, -2.0]).unwrap();
    assert_eq!((bracket.clipped_pixels, bracket.dark_pixels, bracket.gap_pixels), (50, 50, 0));
    // Clipped in the shortest exposure: at least four times the limit of the longest.
    assert!((bracket.photograph.light.at(0, 0)[0] - 4.0).abs() < 0.02);
}

#[test]
fn a_gap_between_two_exposures_is_counted() {
    let light = Image::filled(8, 8, [2.0; 3]);
    let photographs = [0.0, -14.0].map(|s| shot(&light, s, &response(), 3));
    let bracket = merged(&photographs, &[0.0, -14.0]).unwrap();
    assert_eq!((bracket.gap_pixels, bracket.clipped_pixels), (64, 0));
    assert_eq!(bracket.measured_stops, [Some(0.0), None]);
}

#[test]
fn wrong_figures_are_reported_or_refused() {
    let photographs = shots(&[0.0, -3.0]);
    let bracket = merged(&photographs, &[0.0, -2.0]).unwrap();
    assert!((bracket.disagreement_stops - 1.0).abs() < 0.05, "{}", bracket.disagreement_stops);
    let refused = |photographs: &[Photograph], stops: &[f32], word: &str| {
        let sentence = merged(photographs, stops).unwrap_err().to_string();
        assert!(sentence.contains(word), "{sentence}");
    };
    refused(&photographs, &[-3.0, 0.0], "darker");
    refused(&photographs, &[1.0, 1.0], "same");
    refused(&photographs, &[0.0, f32::NAN], "stops");
    refused(&[], &[], "no photograph");
    let small = Photograph::from_linear(Image::filled(2, 2, [0.5; 3]), None);
    refused(&[photographs[0].clone(), small], &[0.0, -1.0], "2 × 2");
}

#[test]
fn exposures_are_measured_without_any_figures() {
    let photographs = shots(&[-3.0, 0.0, -6.0]);
    let measured = measured_stops(&photographs.iter().collect::<Vec<_>>());
    for (measured, truth) in measured.iter().zip([0.0, 3.0, -3.0]) {
        assert!((measured.unwrap() - truth).abs() < 0.05, "{measured:?} for {truth}");
    }
}

#[test]
fn black_and_single_pixel_brackets_are_merged() {
    for level in [0.0, 0.5, 1.0] {
        let picture = Encoded(Raster::filled(1, 1, [level; 3]));
        let photograph = Photograph::from_encoded(&picture, &response());
        let bracket = merged(&[photograph.clone(), photograph], &[0.0, -1.0]).unwrap();
        let light = bracket.photograph.light.pixels[0];
        assert!(light.iter().all(|v| v.is_finite() && *v >= 0.0), "{light:?}");
        assert_eq!(bracket.dark_pixels, usize::from(level == 0.0));
        assert_eq!(bracket.clipped_pixels, usize::from(level == 1.0));
    }
}

#[test]
fn linear_photographs_clip_at_their_white() {
    let light = scene();
    let shot = |stops: f32| {
        let exposed = light.map(|p| p.map(|v| (v * stops.exp2()).min(1.0)));
        Photograph::from_linear(exposed, Some(1.0))
    };
    let bracket = merged(&[shot(0.0), shot(-6.0), shot(-11.0)], &[0.0, -6.0, -11.0]).unwrap();
    assert_eq!(bracket.clipped_pixels, 0);
    for (is, truth) in bracket.photograph.light.pixels.iter().zip(&light.pixels) {
        assert!((is[0] / truth[0] - 1.0).abs() < 1e-4, "{} is not {}", is[0], truth[0]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn a_merged_pixel_lies_within_what_its_photographs_say(level in 1e-4f32..50.0, step in 1.0f32..4.0) {
        let light = Image::filled(4, 4, [level; 3]);
        let stops = [0.0, -step, -2.0 * step];
        let photographs = stops.map(|s| shot(&light, s, &response(), 9));
        let bracket = merged(&photographs, &stops).unwrap();
        let values = photographs.iter().zip(stops).map(|(p, s)| p.light.pixels[5][1] / s.exp2());
        let (low, high) = values.fold((f32::MAX, 0.0f32), |(l, h), v| (l.min(v), h.max(v)));
        let value = bracket.photograph.light.pixels[5][1];
        prop_assert!(value >= low * 0.9999 && value <= high * 1.0001, "{value} in {low} to {high}");
    }
}
