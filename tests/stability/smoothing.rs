//! Temporal smoothing over hours of footage.

use afterlight::compositor::Steady;
use test_support::shown;

/// Frames: an hour and ten minutes at 24 a second.
const FRAMES: usize = 100_000;

/// A texture of 257 samples.
fn texture(i: usize) -> f32 {
    0.2 + (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0
}

/// Gains of a clip whose subject has `level(frame)`, with noise of this standard deviation on each sample.
fn gains(level: impl Fn(usize) -> f32, share: f32, noise: f32) -> Vec<f32> {
    let mut state = 1u64;
    let mut before: Option<Steady> = None;
    let step = |frame: usize| {
        let even = (0..257).map(|i| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Uniform with mean 0 and standard deviation 1.
            let random = ((state >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 12f32.sqrt();
            [level(frame) * texture(i) * (1.0 + noise * random); 3]
        });
        let even: Vec<[f32; 3]> = even.collect();
        let next = Steady::after(before.as_ref(), frame, share, || Ok(even)).unwrap();
        before.insert(next).gain[1]
    };
    (0..FRAMES).map(step).collect()
}

/// Flicker between two levels that ends at its start.
#[test]
fn a_hundred_thousand_frames_of_smoothing_do_not_drift() {
    let level = |frame: usize| 1.0 + 0.03 * (frame % 3) as f32;
    let mut measured = Vec::new();
    for share in [0.5f32, 0.9, 0.99, 1.0] {
        let gains = gains(level, share, 0.0);
        // In f64, with x the logarithm of the level: y = (1 − s)·x + s·(previous y), and the gain is e^(y − x).
        let mut shown = 0.0f64;
        let mut worst = 0.0f64;
        for (frame, gain) in gains.iter().enumerate() {
            let x = f64::from(level(frame)).ln();
            shown = if frame == 0 { x } else { (1.0 - f64::from(share)) * x + f64::from(share) * shown };
            worst = worst.max((f64::from(*gain) / (shown - x).exp() - 1.0).abs());
        }
        // A median of ratios, the division by it and the power are each rounded to 2⁻²³ at most. A share of a frame's
        // error passes to the next; with a share of 1, all of it over all frames.
        let kept = (1.0 / (1.0 - f64::from(share))).min(FRAMES as f64);
        let bound = 6.0 * f64::from(f32::EPSILON) * kept.max(1.0);
        assert!(worst <= bound, "{share}: {worst:.1e}, bound {bound:.1e}");
        measured.push(format!("{worst:.1e} at {share}"));
    }
    shown!(Pictures, "Smoothing over 10⁵ frames of a subject that flickers by 6 %",
        bound: "against f64: six roundings, 7e-7, over (1 − share); at a share of 1 over all frames",
        measured: measured.join(", "));
}

/// With noise that the median does not cancel, and with light that slowly fades to a thousandth.
#[test]
fn noise_and_fading_light_do_not_run_away_with_the_gain() {
    let mut measured = Vec::new();
    for share in [0.9f32, 1.0] {
        let noisy = gains(|_| 1.0, share, 0.02);
        let off = noisy.iter().map(|g| (g - 1.0).abs()).fold(0.0, f32::max);
        let fading = gains(|frame| (-(frame as f32) * 1e-3).exp(), share, 0.0);
        for gain in noisy.iter().chain(&fading) {
            assert!(gain.is_finite() && (0.79..=1.26).contains(gain), "{share}: {gain}");
        }
        let fading = fading.iter().map(|g| (g - 1.0).abs()).fold(0.0, f32::max);
        measured.push(format!("at {share}: noise {:.2} %, fading {:.1} %", 100.0 * off, 100.0 * fading));
    }
    shown!(Pictures, "Smoothing over 10⁵ frames of 2 % noise, and of light that fades by a thousandth a frame",
        bound: "gains within a factor of 1.25 either way", measured: measured.join("; "));
}
