//! Confidence on made-up balls at random.

use super::scene::Scene;
use super::*;

/// How many series are made. `SERIES=500 cargo test -p afterlight-calibration made_up -- --nocapture` makes more.
const SERIES: u64 = 24;

#[test]
fn a_direction_that_is_wrong_is_never_trusted() {
    let read = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let count: u64 = read("SERIES").unwrap_or(SERIES);
    let first: u64 = read("FIRST").unwrap_or(0);
    // Of the lamps that are right, and of those that are wrong: how far they are trusted.
    let (mut right, mut wrong, mut trusted) = (Vec::new(), Vec::new(), Vec::new());
    let mut bad = Vec::new();
    for seed in first..first + count {
        let scene = Scene::new(seed);
        let found = lamps(&scene.ball, &scene.series);
        for (i, (lamp, truth)) in found.iter().zip(&scene.lamps).enumerate() {
            let off = truth.map_or(180.0, |truth| apart(lamp.direction, truth));
            if off > 5.0 {
                wrong.push(lamp.confidence);
            } else if off < 2.5 {
                right.push(lamp.confidence);
            }
            if lamp.confidence > 0.5 {
                trusted.push(off);
            }
            if off > 5.0 && lamp.confidence > 0.5 {
                bad.push(format!(
                    "seed {seed}, lamp {i}: {off:.1}° off, confidence {:.2}, truth {truth:?}, spread {:.1}, clipped {:.2}, R {:.0}, n {}",
                    lamp.confidence, lamp.spread_deg, lamp.clipped, scene.ball.radius_px, found.len()
                ));
            }
        }
    }
    let share = |values: &[f32]| {
        let above = values.iter().filter(|c| **c > 0.5).count();
        above as f32 / values.len().max(1) as f32
    };
    let trusted = sorted(trusted.into_iter());
    println!(
        "{} lamps within 2.5°, {:.1} % of them trusted; {} beyond 5°; the trusted are off by {:.2}° in the median and {:.2}° at most",
        right.len(),
        100.0 * share(&right),
        wrong.len(),
        trusted[trusted.len() / 2],
        trusted[trusted.len() - 1],
    );
    assert!(
        bad.is_empty(),
        "{} wrong and sure:\n{}",
        bad.len(),
        bad.join("\n")
    );
    assert!(right.len() > wrong.len() && share(&right) > 0.6);
}
