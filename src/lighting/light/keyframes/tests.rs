use super::*;
use proptest::prelude::*;

fn keyframes(keys: &[(f64, f64)], interpolation: Interpolation) -> Keyframes {
    let mut keyframes = Keyframes { interpolation, ..Keyframes::default() };
    for &(frame, value) in keys {
        keyframes.insert(frame, value).unwrap();
    }
    keyframes
}

fn any_keys() -> impl Strategy<Value = Keyframes> {
    let keys = proptest::collection::vec((-500.0f64..500.0, -1000.0f64..1000.0), 1..12);
    (keys, any::<bool>()).prop_map(|(keys, smooth)| {
        let kind = if smooth { Interpolation::Smooth } else { Interpolation::Linear };
        keyframes(&keys, kind)
    })
}

proptest! {
    #[test]
    fn keys_are_passed_through(keys in any_keys()) {
        for key in keys.keys() {
            prop_assert!((keys.at(key.frame).unwrap() - key.value).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_overshoots(keys in any_keys(), t in 0.0f64..1.0) {
        for pair in keys.keys().windows(2) {
            let value = keys.at(pair[0].frame + t * (pair[1].frame - pair[0].frame)).unwrap();
            let (low, high) = (pair[0].value.min(pair[1].value), pair[0].value.max(pair[1].value));
            prop_assert!((low..=high).contains(&value), "{value} between {low} and {high}");
        }
    }

    #[test]
    fn between_two_keys_a_value_only_rises_or_only_falls(keys in any_keys()) {
        for pair in keys.keys().windows(2) {
            let sign = (pair[1].value - pair[0].value).signum();
            let at = |i: i32| {
                keys.at(pair[0].frame + f64::from(i) / 50.0 * (pair[1].frame - pair[0].frame)).unwrap()
            };
            for i in 0..50 {
                prop_assert!(sign * (at(i + 1) - at(i)) >= -1e-9);
            }
        }
    }

    #[test]
    fn before_the_first_and_after_the_last_nothing_moves(keys in any_keys(), by in 0.0f64..1e6) {
        let (first, last) = (keys.keys()[0], *keys.keys().last().unwrap());
        prop_assert_eq!(keys.at(first.frame - by), Some(first.value));
        prop_assert_eq!(keys.at(last.frame + by), Some(last.value));
    }

    #[test]
    fn every_frame_has_a_number(keys in any_keys(), frame in any::<f64>()) {
        prop_assert!(keys.at(frame).unwrap().is_finite());
    }

    #[test]
    fn keys_stay_in_order(keys in any_keys(), index in 0usize..12, frame in -500.0f64..500.0) {
        let mut moved = keys.clone();
        let index = index % keys.keys().len();
        let at = moved.shift(index, frame, 7.0).unwrap();
        prop_assert_eq!(moved.keys()[at], Key { frame, value: 7.0, ..Key::default() });
        prop_assert!(moved.keys().windows(2).all(|pair| pair[0].frame < pair[1].frame));
        prop_assert_eq!(moved.remove(at).unwrap().frame, frame);
        prop_assert_eq!(moved.keys().len(), keys.keys().len() - 1);
    }

    #[test]
    fn keyframes_survive_their_file(keys in any_keys(), mixed in mixed_keys()) {
        for keys in [keys, mixed] {
            let text = toml::to_string(&keys).unwrap();
            prop_assert_eq!(toml::from_str::<Keyframes>(&text).unwrap(), keys);
        }
    }

    #[test]
    fn keys_of_every_kind_are_passed_through_and_every_frame_has_a_number(
        keys in mixed_keys(), frame in any::<f64>()
    ) {
        for key in keys.keys() {
            prop_assert!((keys.at(key.frame).unwrap() - key.value).abs() < 1e-9);
        }
        prop_assert!(keys.at(frame).unwrap().is_finite());
    }

    #[test]
    fn a_curve_jumps_after_a_hold_alone(keys in mixed_keys()) {
        for (index, pair) in keys.keys().windows(2).enumerate() {
            let span = pair[1].frame - pair[0].frame;
            let steepest = pair.iter().flat_map(|key| [key.slope_in, key.slope_out]).flatten();
            let steepest = steepest.fold(2000.0 / span * 3.0, |most: f64, slope| most.max(slope.abs()));
            let before = keys.at(pair[1].frame - 1e-6 * span).unwrap();
            // A cubic is never steeper than 1.5 times its chord plus the sum of its end slopes.
            let near = (before - pair[1].value).abs() < 1e-6 * span * 4.0 * steepest + 1e-9;
            let holds = keys.kind(index) == Interpolation::Hold;
            prop_assert!(near || (holds && before == pair[0].value), "{keys:?} {index}: {before}");
        }
    }

    #[test]
    fn a_bezier_leaves_and_arrives_with_its_tangents(
        a in -50.0f64..50.0, b in -50.0f64..50.0, out in -9.0f64..9.0, into in -9.0f64..9.0
    ) {
        let mut keys = keyframes(&[(3.0, a), (11.0, b)], Interpolation::Bezier);
        keys.set_slopes(0, [None, Some(out)]).unwrap();
        keys.set_slopes(1, [Some(into), None]).unwrap();
        let at = |frame: f64| keys.at(frame).unwrap();
        prop_assert!(((at(3.0 + 1e-6) - a) / 1e-6 - out).abs() < 1e-3);
        prop_assert!(((b - at(11.0 - 1e-6)) / 1e-6 - into).abs() < 1e-3);
        // The control points of the Bézier curve are a third of the way along the tangents.
        let controls = [a, a + out * 8.0 / 3.0, b - into * 8.0 / 3.0, b];
        for i in 0..=16 {
            let t = f64::from(i) / 16.0;
            let mut points = controls;
            for left in (1..4).rev() {
                for j in 0..left {
                    points[j] += t * (points[j + 1] - points[j]);
                }
            }
            prop_assert!((at(3.0 + 8.0 * t) - points[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_bezier_with_automatic_tangents_is_the_smooth_curve(keys in any_keys(), frame in -500.0f64..500.0) {
        let [mut smooth, mut bezier] = [keys.clone(), keys];
        smooth.interpolation = Interpolation::Smooth;
        bezier.interpolation = Interpolation::Bezier;
        prop_assert!((smooth.at(frame).unwrap() - bezier.at(frame).unwrap()).abs() < 1e-9);
    }

    #[test]
    fn a_key_set_on_a_bezier_by_hand_keeps_its_shape(
        out in -9.0f64..9.0, into in -9.0f64..9.0, cut in 0.5f64..9.5, frame in 0.0f64..10.0
    ) {
        let mut keys = keyframes(&[(0.0, 4.0), (10.0, 7.0)], Interpolation::Bezier);
        keys.set_slopes(0, [None, Some(out)]).unwrap();
        keys.set_slopes(1, [Some(into), None]).unwrap();
        let before = keys.clone();
        keys.insert(cut, before.at(cut).unwrap()).unwrap();
        prop_assert!((keys.at(frame).unwrap() - before.at(frame).unwrap()).abs() < 1e-9);
    }
}

/// Keys of every kind, some with tangents set by hand.
fn mixed_keys() -> impl Strategy<Value = Keyframes> {
    let slope = || proptest::option::of(-80.0f64..80.0);
    let key = (-500.0f64..500.0, -1000.0f64..1000.0, 0usize..5, slope(), slope());
    proptest::collection::vec(key, 1..12).prop_map(|keys| {
        let mut keyframes = Keyframes::default();
        for (frame, value, kind, slope_in, slope_out) in keys {
            let key = Key {
                frame,
                value,
                interpolation: Interpolation::ALL.get(kind).map(|(kind, _)| *kind),
                slope_in,
                slope_out,
            };
            keyframes.put(key).unwrap();
        }
        keyframes
    })
}

#[test]
fn a_yaw_from_0_to_720_turns_twice() {
    for kind in [Interpolation::Linear, Interpolation::Smooth] {
        let keys = keyframes(&[(0.0, 0.0), (100.0, 720.0)], kind);
        assert_eq!(keys.at(50.0), Some(360.0));
    }
    let linear = keyframes(&[(0.0, 350.0), (10.0, 10.0)], Interpolation::Linear);
    assert_eq!(linear.at(5.0), Some(180.0));
}

#[test]
fn a_steady_turn_through_three_keys_stays_steady_in_the_middle() {
    let keys = keyframes(&[(0.0, 0.0), (10.0, 30.0), (20.0, 60.0)], Interpolation::Smooth);
    let slope = (keys.at(10.001).unwrap() - keys.at(9.999).unwrap()) / 0.002;
    assert!((slope - 3.0).abs() < 1e-3, "{slope}");
    // It starts and ends at rest.
    assert!(keys.at(0.1).unwrap() < 0.03);
}

#[test]
fn an_extreme_is_flat_and_equal_keys_hold() {
    let keys = keyframes(&[(0.0, 0.0), (5.0, 8.0), (9.0, 8.0), (12.0, 1.0)], Interpolation::Smooth);
    for frame in [5.0, 6.3, 8.9] {
        assert_eq!(keys.at(frame), Some(8.0));
    }
}

#[test]
fn without_keys_there_is_no_value_and_nan_is_refused() {
    let mut keys = Keyframes::default();
    assert_eq!(keys.at(3.0), None);
    assert!(keys.insert(f64::NAN, 0.0).is_err() && keys.insert(0.0, f64::INFINITY).is_err());
    keys.insert(4.0, 1.0).unwrap();
    keys.insert(4.0, 2.0).unwrap();
    assert_eq!(keys.keys(), [Key { frame: 4.0, value: 2.0, ..Key::default() }]);
    assert!(keys.shift(1, 0.0, 0.0).is_err() && keys.shift(0, f64::NAN, 0.0).is_err());
    assert_eq!((keys.at(f64::NAN), keys.at(-1e300)), (Some(2.0), Some(2.0)));
    assert!(toml::from_str::<Keyframes>("keys = [{ frame = nan, value = 1.0 }]").is_err());
}

#[test]
fn keys_are_read_or_refused() {
    let keys: Keyframes = "0:0, 24:-90.5".parse().unwrap();
    assert_eq!((keys.keys().len(), keys.at(24.0)), (2, Some(-90.5)));
    for text in ["", "3", "a:1", "1:nan", "1:2,"] {
        assert!(text.parse::<Keyframes>().is_err(), "{text}");
    }
}

#[test]
fn a_hold_stays_until_the_next_key() {
    let mut keys = keyframes(&[(0.0, 1.0), (10.0, 5.0), (20.0, 9.0)], Interpolation::Linear);
    keys.set_kind(0, Interpolation::Hold);
    let values = [0.0, 9.999, 10.0, 15.0, 20.0].map(|frame| keys.at(frame).unwrap());
    assert_eq!(values, [1.0, 1.0, 5.0, 7.0, 9.0]);
    // An inserted key continues the interpolation of the one before it.
    keys.insert(5.0, 2.0).unwrap();
    assert_eq!((keys.at(9.0), keys.kind(1)), (Some(2.0), Interpolation::Hold));
}

#[test]
fn a_key_that_is_given_another_value_or_frame_keeps_what_else_it_has() {
    let mut keys = keyframes(&[(0.0, 1.0), (10.0, 5.0)], Interpolation::Smooth);
    keys.set_kind(0, Interpolation::Bezier);
    keys.set_slopes(0, [Some(2.0), Some(-3.0)]).unwrap();
    keys.insert(0.0, 8.0).unwrap();
    let at = keys.shift(0, 4.0, 6.0).unwrap();
    assert_eq!(keys.slopes(at), Some([2.0, -3.0]));
    assert_eq!(keys.kind(at), Interpolation::Bezier);
    assert_eq!(keys.keys()[at].value, 6.0);
    for slope in [f64::NAN, f64::INFINITY, 2e9] {
        assert!(keys.set_slopes(at, [Some(slope), None]).is_err());
    }
    assert!(keys.set_slopes(7, [None, None]).is_err());
    assert_eq!(keys.slopes(at), Some([2.0, -3.0]), "a refused change leaves the keys alone");
}

#[test]
fn a_file_has_no_more_than_it_needs_and_is_refused_if_a_number_is_none() {
    let mut keys = keyframes(&[(0.0, 1.0), (8.0, 3.0)], Interpolation::Smooth);
    let plain =
        "interpolation = \"smooth\"\n\n[[keys]]\nframe = 0.0\nvalue = 1.0\n\n[[keys]]\nframe = 8.0\nvalue = 3.0\n";
    assert_eq!(toml::to_string(&keys).unwrap(), plain, "same text as before tangents existed");
    keys.set_kind(0, Interpolation::Bezier);
    keys.set_slopes(0, [None, Some(0.5)]).unwrap();
    let text = toml::to_string(&keys).unwrap();
    assert!(text.contains("interpolation = \"bezier\"") && text.contains("out = 0.5"), "{text}");
    for broken in ["in = nan", "out = inf", "interpolation = \"wavy\"", "frame = 1e300"] {
        let text = format!("[[keys]]\nvalue = 1.0\n{broken}\n");
        let text = if broken.starts_with("frame") { text } else { text + "frame = 3.0\n" };
        assert!(toml::from_str::<Keyframes>(&text).is_err(), "{text}");
    }
}

#[test]
fn keys_that_almost_coincide_have_a_number_between_them() {
    for kind in Interpolation::ALL.map(|(kind, _)| kind) {
        let mut keys = keyframes(&[(0.0, -1e9), (1e-320, 1e9), (3.0, 1e9)], kind);
        keys.set_slopes(1, [Some(1e9), Some(-1e9)]).unwrap();
        for frame in [0.0, 5e-321, 1e-320, 1e-300, 1.0, 3.0] {
            assert!(keys.at(frame).unwrap().is_finite(), "{kind:?} at {frame}");
        }
    }
}

#[test]
fn keys_are_raised_together() {
    let mut keys = keyframes(&[(0.0, 1.0), (8.0, 3.0)], Interpolation::Linear);
    keys.set_slopes(0, [None, Some(0.5)]).unwrap();
    let raised = keys.plus(10.0).unwrap();
    assert_eq!((raised.at(4.0), raised.slopes(0)), (Some(12.0), keys.slopes(0)));
    assert!(keys.plus(1e9).is_err());
}
