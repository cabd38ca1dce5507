//! Uncertainty reported by a fit when the pictures are ambiguous.

use super::small_shoot::{SmallShoot, dual, without_bright, without_dark};
use super::*;
use imaging::Response;
use std::path::Path;

#[test]
fn without_bright_pixels_gamma2_is_said_to_be_an_assumption() {
    let fit = fitted(&without_bright(), None);
    off(&fit, [2.5, 1.9]);
    let warnings = warnings(&fit);
    assert!(warnings.iter().any(|w| w.contains("do not determine the camera's γ2")), "{warnings:?}");
    assert!(!warnings.iter().any(|w| w.contains("γ1")), "{warnings:?}");
}

#[test]
fn without_dark_pixels_gamma1_is_said_to_be_rough() {
    let fit = fitted(&without_dark(), None);
    let off = off(&fit, [2.5, 1.9]);
    assert!(off[0].abs() < 2.0 * fit.deviation[0]);
    let warnings = warnings(&fit);
    assert!(warnings.iter().any(|w| w.contains("γ1") && w.contains("shadows")), "{warnings:?}");
}

#[test]
fn a_much_changed_exposure_raises_doubt_even_on_small_balls() {
    // Balls of 84 pixels under fourteen lamps are hardly informative, so the fit may assume an untouched camera. An
    // error of 20 % passes unnoticed there, but not on balls of 230 pixels under 41 lamps (see the shared shoot).
    for exposure in [0.75, 1.4] {
        let fit = fitted(&SmallShoot { exposure, ..SmallShoot::default() }, None);
        off(&fit, [2.5, 1.9]);
        let warnings = warnings(&fit);
        assert!(
            warnings.iter().any(|w| w.contains("between the balls and the filming")),
            "{:.3}: {warnings:?}",
            fit.changed_exposure()
        );
        let changed = fit.cases.iter().find(|case| case.changed).unwrap();
        assert!((changed.exposure > 1.0) == (exposure > 1.0));
    }
}

#[test]
fn light_that_is_no_sum_of_lamps_is_not_taken_for_a_changed_exposure() {
    let fit = fitted(
        &SmallShoot {
            response: dual(2.9, 1.9),
            window: 1.0,
            skin: [0.45, 0.27, 0.22],
            subject: 0.15,
            seed: 21,
            ..SmallShoot::default()
        },
        None,
    );
    let off = off(&fit, [2.9, 1.9]);
    assert!(off[0].abs() < 0.15);
    assert!(fit.changed_exposure() < 0.5 && (fit.exposure - 1.0).abs() < 0.08);
    // So dark a subject says little about the bright tones, and the intervals show it.
    let [_, wide, widest] = &Interval::from_cases(&fit.cases)[..] else {
        panic!("three intervals");
    };
    for (truth, [low, high]) in [(2.9, wide.gamma1), (1.9, wide.gamma2)] {
        assert!((low..=high).contains(&truth), "{truth}: {low} to {high}");
    }
    assert!(widest.gamma1[0] < wide.gamma1[0] && wide.gamma1[1] < widest.gamma1[1]);
}

#[test]
fn no_case_is_ever_certain() {
    for exposure in [1.0, 0.5] {
        let fit = fitted(&SmallShoot { exposure, ..SmallShoot::default() }, None);
        let [first, second] = fit.cases;
        assert!(first.probability >= second.probability && second.probability > 0.005);
        assert!((first.probability + second.probability - 1.0).abs() < 1e-6);
        assert!(first.changed != second.changed);
    }
}

#[test]
fn a_camera_of_another_curve_is_noticed() {
    for response in [Response::Srgb, Response::Rec709] {
        let fit = fitted(&SmallShoot { response, ..SmallShoot::default() }, None);
        assert_eq!(fit.better_curve.map(|curve| curve.response), Some(response));
        assert!(warnings(&fit)[0].contains(response.name()));
        // The calibration uses it.
        let shoot = SmallShoot::default().project(Path::new("nowhere")).settings.shoot;
        let found = ChosenResponse::fitted(&fit, &shoot);
        assert_eq!((found.response, found.deviation), (response, [0.0; 2]));
        // Twice the deviation (0.03 to 0.04) of dual gammas in such small shoots.
        assert!((found.exposure - 1.0).abs() < 0.08, "{}", found.exposure);
    }
}
