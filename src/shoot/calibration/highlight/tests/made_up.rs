//! Confidence on random synthetic balls.

use super::scene::Scene;
use super::*;

/// Number of series. `SERIES=500 FIRST=7000 cargo test -p afterlight-calibration never_trusted -- --nocapture` runs
/// more, starting at another seed.
const SERIES: u64 = 24;

/// Results for the lamps of many series.
#[derive(Default)]
struct Tally {
    /// Confidences of the lamps within 2.5° of the truth, and of those beyond 5°.
    right: Vec<f32>,
    wrong: Vec<f32>,
    /// Errors in degrees of the lamps with a confidence above one half.
    trusted: Vec<f32>,
    /// Descriptions of the wrong ones among them.
    bad: Vec<String>,
}

impl Tally {
    /// Series on balls with a radius in pixels within a range.
    fn new(scene: fn(u64, (f64, f64)) -> Scene, radius_px: (f64, f64)) -> Self {
        let read = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
        let count: u64 = read("SERIES").unwrap_or(SERIES);
        let first: u64 = read("FIRST").unwrap_or(0);
        let mut tally = Self::default();
        for seed in first..first + count {
            tally.add(seed, &scene(seed, radius_px));
        }
        let trusted = sorted(std::mem::take(&mut tally.trusted).into_iter());
        println!(
            "{} lamps within 2.5°, {:.1} % of them trusted; {} beyond 5°, {} of them trusted; error of the trusted \
             {:.2}° in the median and {:.2}° at most",
            tally.right.len(),
            100.0 * share(&tally.right),
            tally.wrong.len(),
            tally.bad.len(),
            trusted[trusted.len() / 2],
            trusted[trusted.len() - 1],
        );
        assert!(tally.bad.is_empty(), "{} wrong with high confidence:\n{}", tally.bad.len(), tally.bad.join("\n"));
        tally
    }

    fn add(&mut self, seed: u64, scene: &Scene) {
        let found = lamps(&scene.ball, &scene.series);
        for (i, (lamp, truth)) in found.iter().zip(&scene.lamps).enumerate() {
            let off = truth.map_or(180.0, |truth| apart(lamp.direction, truth));
            if off > 5.0 {
                self.wrong.push(lamp.confidence);
            } else if off < 2.5 {
                self.right.push(lamp.confidence);
            }
            if lamp.confidence > 0.5 {
                self.trusted.push(off);
            }
            if off > 5.0 && lamp.confidence > 0.5 {
                self.bad.push(format!(
                    "seed {seed}, lamp {i}: {off:.1}° off, confidence {:.2}, truth {truth:?}, spread {:.1}, clipped {:.2}, R {:.0}, n {}",
                    lamp.confidence, lamp.spread_deg, lamp.clipped, scene.ball.radius_px, found.len()
                ));
            }
        }
    }
}

/// Share of confidences above one half.
fn share(confidences: &[f32]) -> f32 {
    let above = confidences.iter().filter(|c| **c > 0.5).count();
    above as f32 / confidences.len().max(1) as f32
}

#[test]
fn a_direction_that_is_wrong_is_never_trusted() {
    let Tally { right, wrong, .. } = Tally::new(Scene::sized, (40.0, 160.0));
    assert!(right.len() > wrong.len() && share(&right) > 0.6);
}

#[test]
fn a_direction_on_a_small_ball_that_is_wrong_is_never_trusted() {
    let Tally { right, wrong, .. } = Tally::new(Scene::sized, (12.0, 40.0));
    // A pixel spans three to nine degrees here.
    assert!(right.len() > wrong.len() && share(&right) > 0.1);
}

#[test]
fn banks_of_lamps_far_apart_are_seen_whole_or_not_trusted() {
    let Tally { right, wrong, .. } = Tally::new(Scene::with_wide_banks, (40.0, 160.0));
    assert!(right.len() > wrong.len() && share(&right) > 0.1);
}
