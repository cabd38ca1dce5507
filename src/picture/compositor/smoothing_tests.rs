//! Tests of smoothing.

use super::*;
use crate::Field;
use imaging::Image;
use reflectance::ReflectanceField;

pub fn after(before: Option<&Steady>, index: usize, field: &Field, mask: &Mask, share: f32) -> Steady {
    let even = || {
        let even = field.relight(&even_light(field.lamps()))?;
        let every = even.pixels.into_iter().step_by(step(mask.pixels.len()));
        Ok(samples(every, mask))
    };
    Steady::after(before, index, share, even).unwrap()
}

/// A subject of some texture at a level; its right third moves with the frame.
fn frame(index: usize, level: f32) -> Field {
    let olat = Image::from_fn(48, 48, |x, y| {
        let moving = if x > 32 { (x * 7 + y + 13 * index) % 11 } else { (x + 3 * y) % 7 };
        [level * (0.2 + 0.05 * moving as f32); 3]
    });
    ReflectanceField::from_olats(&[olat.clone(), olat]).into()
}

fn gains(levels: &[f32], share: f32) -> Vec<f32> {
    let mask = Mask::filled(48, 48, 1.0);
    let mut before: Option<Steady> = None;
    let levels = levels.iter().enumerate();
    levels
        .map(|(i, &level)| {
            let next = after(before.as_ref(), i, &frame(i, level), &mask, share);
            before.insert(next).gain[0]
        })
        .collect()
}

#[test]
fn flicker_is_held_back_by_the_share_that_is_asked_for() {
    let levels: Vec<f32> = (0..40).map(|i| if i % 2 == 0 { 1.0 } else { 1.06 }).collect();
    let shown = |share| {
        let gains = gains(&levels, share);
        levels.iter().zip(gains).map(|(l, g)| l * g).collect::<Vec<_>>()
    };
    let jump = |shown: &[f32]| {
        let late = shown[20..].windows(2);
        late.map(|w| (w[1] / w[0] - 1.0).abs()).fold(0.0, f32::max)
    };
    assert!((jump(&shown(0.0)) - 0.06).abs() < 1e-3);
    // An alternation of ± d passes (1 − s) / (1 + s) of itself through an exponential mean.
    let wanted = 0.06 * 0.2 / 1.8;
    assert!((jump(&shown(0.8)) / wanted - 1.0).abs() < 0.1);
    assert!(jump(&shown(1.0)) < 1e-5);
}

#[test]
fn a_slow_change_is_followed_and_a_cut_is_not_held_back() {
    let slow: Vec<f32> = (0..100).map(|i| 1.0 + 0.002 * i as f32).collect();
    let last = gains(&slow, 0.8)[99];
    // It lags s / (1 − s) = 4 frames.
    assert!((last - 1.0).abs() < 0.01, "{last}");
    assert_eq!(gains(&[1.0, 1.0, 3.0], 0.9)[2], 1.0);
}

#[test]
fn what_is_not_the_frame_before_does_not_count() {
    let mask = Mask::filled(48, 48, 1.0);
    let first = after(None, 4, &frame(4, 1.0), &mask, 1.0);
    assert_eq!(first.gain, [1.0; 3]);
    assert_eq!(first.change(), 0.0);
    let after = |index| after(Some(&first), index, &frame(index, 1.1), &mask, 1.0);
    assert!(after(5).change() > 0.05);
    assert_eq!(after(6).change(), 0.0);
    assert_eq!(after(4), first);
}

#[test]
fn hard_fields_leave_the_light_alone() {
    for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
        for (size, alpha) in [(1, 1.0), (8, 0.0), (8, 1.0)] {
            let olat = Image::filled(size, size, [value; 3]);
            let field: Field = ReflectanceField::from_olats(&[olat]).into();
            let mask = Mask::filled(size, size, alpha);
            let first = after(None, 0, &field, &mask, 0.9);
            let next = after(Some(&first), 1, &field, &mask, 0.9);
            assert_eq!(next.gain, [1.0; 3]);
        }
    }
    test_support::shown!(Pictures, "Smoothing of frames that are NaN, infinite, black, of one pixel, or with an empty matte",
 bound: "gain exactly 1", measured: "1");
}
