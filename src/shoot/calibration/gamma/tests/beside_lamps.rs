//! Responses where part of the interview's light comes from lamps that were not photographed.

use super::small_shoot::SmallShoot;
use super::*;

#[test]
fn no_answer_lies_at_a_bound() {
    // A curve beyond the range: light to the power of 1/6.
    let shoot = SmallShoot {
        response: Response::Power(6.0),
        unlisted: 3,
        grey: true,
        skin: [0.8; 3],
        ball: 0.9,
        ..SmallShoot::default()
    };
    let fit = fitted(&shoot, None);
    let (low, high) = bounds();
    println!("{:?} ± {:.3?}", fit.response, fit.deviation);
    for gamma in [fit.response.gamma1, fit.response.gamma2].map(f64::from) {
        assert!(gamma > low + 0.01 && gamma < high - 0.01, "{gamma}");
    }
}
