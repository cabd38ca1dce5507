//! The exact interval of a share (Clopper and Pearson 1934).

/// Probability outside the interval, on both sides together.
const OUTSIDE: f64 = 0.05;

/// Interval that holds the true share in at least 95 of 100 such studies, where `chosen` out of `answers`
/// independent answers chose: all shares under which neither so many nor so few would be rarer than 2.5 %.
/// `[0, 1]` without answers.
pub fn exact_interval(chosen: u64, answers: u64) -> [f64; 2] {
    let chosen = chosen.min(answers);
    if answers == 0 {
        return [0.0, 1.0];
    }
    let low = match chosen {
        0 => 0.0,
        // P(X ≥ chosen) grows with the share.
        _ => bisected(|share| at_most(answers - chosen, answers, 1.0 - share) < OUTSIDE / 2.0),
    };
    let high = match chosen {
        _ if chosen == answers => 1.0,
        // P(X ≤ chosen) falls.
        _ => bisected(|share| at_most(chosen, answers, share) >= OUTSIDE / 2.0),
    };
    [low, high]
}

/// Largest share at which a condition holds that holds for all smaller ones.
fn bisected(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of at most `most` successes out of `answers`, each with probability `share`.
fn at_most(most: u64, answers: u64, share: f64) -> f64 {
    if share <= 0.0 || most >= answers {
        return 1.0;
    }
    if share >= 1.0 {
        return 0.0;
    }
    let (yes, no) = (share.ln(), (-share).ln_1p());
    // In logarithms, since C(n, k) overflows a float.
    let mut term = answers as f64 * no;
    let mut sum = term.exp();
    for i in 1..=most {
        term += ((answers - i + 1) as f64 / i as f64).ln() + yes - no;
        sum += term.exp();
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bounds by bisection in exact rational arithmetic, in another language.
    #[test]
    fn the_interval_is_the_exact_one() {
        let known = [
            (0, 10, 0.0000000000, 0.3084971078),
            (5, 10, 0.1870860284, 0.8129139716),
            (10, 10, 0.6915028922, 1.0000000000),
            (1, 1, 0.0250000000, 1.0000000000),
            (52, 61, 0.7383119120, 0.9302477020),
            (9, 61, 0.0697522980, 0.2616880880),
            (0, 61, 0.0000000000, 0.0586812239),
            (3, 200, 0.0031041076, 0.0432082819),
        ];
        for (chosen, answers, low, high) in known {
            let [a, b] = exact_interval(chosen, answers);
            assert!(
                (a - low).abs() < 1e-9 && (b - high).abs() < 1e-9,
                "{chosen} of {answers}: {a} to {b}, not {low} to {high}"
            );
        }
    }

    #[test]
    fn it_is_symmetric_and_holds_the_share_and_no_answers_say_nothing() {
        for answers in [1, 7, 30, 411] {
            for chosen in 0..=answers {
                let ([a, b], [c, d]) = (exact_interval(chosen, answers), exact_interval(answers - chosen, answers));
                assert!((a + d - 1.0).abs() < 1e-12 && (b + c - 1.0).abs() < 1e-12);
                let share = chosen as f64 / answers as f64;
                assert!(a <= share && share <= b && (a < b));
            }
        }
        assert_eq!(exact_interval(0, 0), [0.0, 1.0]);
        let [low, high] = exact_interval(50_000, 100_000);
        assert!((high - low - 2.0 * 1.96 * (0.25e-5f64).sqrt()).abs() < 3e-5);
    }

    /// At a true share, fraction of many studies whose interval contains it.
    #[test]
    fn at_least_95_of_100_studies_hold_the_truth() {
        for (answers, truth) in [(12u64, 0.5), (40, 0.85), (61, 0.02)] {
            let mut held = 0.0;
            for chosen in 0..=answers {
                let [low, high] = exact_interval(chosen, answers);
                if (low..=high).contains(&truth) {
                    let below = chosen.checked_sub(1).map_or(0.0, |k| at_most(k, answers, truth));
                    held += at_most(chosen, answers, truth) - below;
                }
            }
            println!("{answers} answers, truth {truth}: held by {held:.4}");
            assert!((0.95..=1.0).contains(&held), "{held}");
        }
    }
}
