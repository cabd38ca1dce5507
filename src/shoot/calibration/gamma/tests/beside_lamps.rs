//! Responses where part of the interview's light comes from lamps that were not photographed.

use super::small_shoot::{SmallShoot, dual};
use super::*;

/// A monochrome camera, and an interview lit by more lamps than were photographed.
fn monochrome(response: Response, unlisted: usize, turn: f32) -> SmallShoot {
    SmallShoot { response, unlisted, turn, grey: true, skin: [0.8; 3], ..SmallShoot::default() }
}

#[test]
fn a_curve_is_found_or_its_interval_holds_it() {
    let mut within = 0;
    let cases = [
        Response::Linear,
        Response::Power(1.05),
        Response::Power(1.15),
        dual(1.5, 1.8),
        Response::Power(2.2),
        Response::Power(3.0),
        Response::Srgb,
        Response::Rec709,
    ];
    for response in cases {
        for unlisted in [0, 3] {
            let fit = fitted(&monochrome(response, unlisted, 0.05), None);
            let (is, _) = response.nearest_dual_gamma();
            let off = off(&fit, [is.gamma1, is.gamma2]);
            if fit.better_curve.is_some_and(|curve| curve.response == response) {
                within += 2;
                continue;
            }
            for (off, deviation) in off.into_iter().zip(fit.deviation) {
                assert!(off.abs() < 5.0 * deviation, "{response}, {unlisted} lamps unlisted");
                within += usize::from(off.abs() <= 2.0 * deviation);
            }
        }
    }
    println!("{within} of 32 within two deviations");
    assert!(within >= 28, "{within} of 32");
}

#[test]
fn a_linear_camera_is_recognised_by_a_filmed_pose() {
    for unlisted in [0, 3] {
        let fit = fitted(&monochrome(Response::Linear, unlisted, 0.0), Some(Comparison::Pixels));
        assert_eq!(fit.same_poses.len(), 4);
        let curve = fit.better_curve.map(|curve| curve.response);
        println!("{curve:?} ± {:.3?}", fit.deviation);
        assert_eq!(curve, Some(Response::Linear));
    }
}

#[test]
fn no_answer_lies_at_a_bound() {
    // A curve beyond the range: light to the power of 1/6.
    let mut shoot = monochrome(Response::Power(6.0), 3, 0.05);
    shoot.ball = 0.9;
    let fit = fitted(&shoot, None);
    let (low, high) = bounds();
    println!("{:?} ± {:.3?}", fit.response, fit.deviation);
    for gamma in [fit.response.gamma1, fit.response.gamma2].map(f64::from) {
        assert!(gamma > low + 0.01 && gamma < high - 0.01, "{gamma}");
    }
}
