use super::*;
use crate::facts::{Grain, Inputs, Screen, Spill};
use scene::{Background, Channel, Effects, Forced, Inspection, Output, STRENGTHS, ViewTransform};

const FACTS: Facts = Facts {
    plate: None,
    fine_light: false,
    field_cached: false,
    weights_cached: false,
    lamps: 41,
    lit_lamps: 38,
    open_share: 0.6,
    inputs: Inputs { frame: 1, light: 2, backdrop: 3, behind: 6, grain: 4, second: 5 },
    steady_gain: None,
    spill: None,
    wrap_need: 0.0,
    brightest: 0.0,
    own_grain: Grain { deviation: [[0.0; 3]; 8] },
    missing_grain: 0.0,
    second_picture: false,
};

fn scene() -> Scene {
    Scene { frame: 3, exposure_stops: 1.0, ..Scene::default() }
}

fn with(effects: Effects) -> Scene {
    Scene { effects, ..scene() }
}

/// A scene with everything, and facts that need all of it.
fn everything() -> (Scene, Facts) {
    let effects = Effects {
        smoothing: 0.5,
        despill: 1.0,
        background_blur: 0.02,
        light_wrap: 0.5,
        glare: 0.1,
        view: ViewTransform::Filmic,
        grain: 1.0,
        inspection: Inspection::FalseColor,
        ..Effects::all(0.3)
    };
    let facts = Facts {
        plate: Some((1080, 1920)),
        steady_gain: Some([1.05, 1.0, 1.0]),
        spill: Some(Spill { screen: Screen::Green, excess: 0.1 }),
        wrap_need: 0.5,
        brightest: 9.0,
        missing_grain: 0.01,
        ..FACTS
    };
    (with(effects), facts)
}

fn names(scene: &Scene, facts: &Facts) -> Vec<&'static str> {
    plan(scene, facts).iter().filter(|p| p.run).map(|p| p.pass.name()).collect()
}

#[test]
fn a_new_frame_for_a_window_runs_what_every_picture_needs() {
    let all = ["predict", "weights", "relight", "background", "exposure", "view", "dither"];
    assert_eq!(names(&scene(), &FACTS), all);
}

#[test]
fn a_turn_of_the_environment_never_asks_the_network() {
    let turned = Facts { field_cached: true, ..FACTS };
    assert!(!names(&scene(), &turned).contains(&"predict"));
    assert!(names(&scene(), &turned).contains(&"weights"));
}

#[test]
fn a_linear_cut_out_at_0_stops_needs_the_sum_alone() {
    let bare = Scene { exposure_stops: 0.0, background: Background::None, output: Output::Linear, ..scene() };
    let cached = Facts { field_cached: true, weights_cached: true, ..FACTS };
    assert_eq!(names(&bare, &cached), ["relight"]);
}

#[test]
fn what_cannot_be_seen_does_not_run() {
    let covered = Facts { open_share: 0.0, ..FACTS };
    assert!(!names(&scene(), &covered).contains(&"background"));
    assert!(!names(&scene(), &covered).contains(&"dither"));
    let dark = Facts { lit_lamps: 0, ..FACTS };
    assert!(!names(&scene(), &dark).contains(&"relight"));
}

#[test]
fn every_effect_runs_where_it_is_asked_for_and_called_for() {
    let (scene, facts) = everything();
    let ran = names(&scene, &facts);
    let inspections = ["channels", "difference"];
    let wanted: Vec<_> = Pass::ALL.iter().map(|p| p.name()).collect();
    let wanted: Vec<_> = wanted.into_iter().filter(|n| !inspections.contains(n)).collect();
    assert_eq!(ran, wanted);
    // The same need without a request.
    let plate = Facts { plate: facts.plate, ..FACTS };
    assert_eq!(names(&self::scene(), &facts), names(&self::scene(), &plate));
    // A request without a need.
    let idle = names(&scene, &FACTS);
    for name in ["smoothing", "despill", "light_wrap", "glare", "grain"] {
        assert!(!idle.contains(&name), "{name}");
    }
}

#[test]
fn what_a_display_alone_can_show_is_not_done_to_linear_light() {
    let (scene, facts) = everything();
    let linear = Scene { output: Output::Linear, ..scene };
    let ran = names(&linear, &facts);
    for name in ["view", "grain", "dither", "false_color"] {
        assert!(!ran.contains(&name), "{name}");
    }
    assert!(ran.contains(&"glare"));
}

#[test]
fn glare_goes_by_what_is_brighter_than_white_after_exposure() {
    let glaring = with(Effects { glare: 0.2, ..Effects::default() });
    let at = |brightest| Facts { brightest, ..FACTS };
    assert!(!names(&glaring, &at(0.5)).contains(&"glare"));
    assert!(names(&glaring, &at(0.51)).contains(&"glare"));
}

#[test]
fn a_difference_needs_a_second_picture() {
    let compared = with(Effects { inspection: Inspection::Difference { gain: 8.0 }, ..Effects::default() });
    let found = Facts { second_picture: true, ..FACTS };
    assert!(!names(&compared, &FACTS).contains(&"difference"));
    assert!(names(&compared, &found).contains(&"difference"));
}

#[test]
fn every_decision_has_a_reason() {
    let (scene, facts) = everything();
    for scene in [scene, self::scene()] {
        for facts in [facts, FACTS] {
            assert!(plan(&scene, &facts).iter().all(|p| !p.reason.is_empty()));
        }
    }
    let relight = &plan(&self::scene(), &FACTS)[3];
    assert_eq!(relight.reason, "38 of 41 lamps are lit; the rest are skipped");
}

#[test]
fn every_pass_stands_in_its_place_and_one_with_a_strength_can_be_skipped() {
    for (pass, descriptor) in Pass::ALL.into_iter().zip(PASSES) {
        assert_eq!(descriptor.pass, pass);
    }
    let (_, facts) = everything();
    for strength in STRENGTHS {
        let at = |value: f32| {
            let mut scene = scene();
            *(strength.of)(&mut scene.effects) = value;
            plan(&scene, &facts).swap_remove(strength.pass as usize)
        };
        let (none, all) = (at(0.0), at(strength.most));
        assert!(all.run, "{all:?}");
        assert_eq!((none.run, &*none.reason), (false, "off"));
        assert_eq!(at(f32::NAN), none);
    }
}

/// Names of the passes with a changed key.
fn changed(before: (&Scene, &Facts), after: (&Scene, &Facts)) -> Vec<&'static str> {
    let (a, b) = (plan(before.0, before.1), plan(after.0, after.1));
    let pairs = a.iter().zip(&b);
    pairs.filter(|(a, b)| a.key != b.key).map(|(a, _)| a.pass.name()).collect()
}

#[test]
fn a_setting_changes_the_keys_of_its_pass_and_of_those_after_it() {
    let before = scene();
    let from = |edit: &dyn Fn(&mut Scene)| {
        let mut after = before.clone();
        edit(&mut after);
        changed((&before, &FACTS), (&after, &FACTS))
    };
    let exposed = from(&|s| s.exposure_stops = 2.0);
    assert_eq!(exposed[0], "exposure");
    assert!(from(&|s| s.yaw_deg = 5.0).contains(&"background"));
    assert!(!from(&|s| s.yaw_deg = 5.0).contains(&"relight"));
    let frame = from(&|s| s.frame = 4);
    assert!(frame.contains(&"relight") && !frame.contains(&"background"));
    let channel = Inspection::Channel(Channel::Red);
    let looked = from(&|s| s.effects.inspection = channel);
    assert_eq!(looked, ["channels", "difference", "false_color"]);
    // A skipped effect changes no key, at any strength.
    assert!(from(&|s| s.effects.glare = 0.7).is_empty());
    assert!(from(&|s| s.effects.despill = 0.7).is_empty());
}

#[test]
fn whether_something_was_at_hand_does_not_change_the_picture_s_key() {
    let cached = Facts { field_cached: true, weights_cached: true, ..FACTS };
    let last = |facts: &Facts| plan(&scene(), facts)[3..].iter().map(|p| p.key).collect::<Vec<_>>();
    assert_eq!(last(&FACTS), last(&cached));
}

#[test]
fn a_forced_pass_runs_or_not_whatever_calls_for_it_and_says_so() {
    let (all, needed) = everything();
    for (plain, facts) in [(scene(), FACTS), (all, needed)] {
        let before = plan(&plain, &facts);
        for pass in Pass::ALL {
            for run in [true, false] {
                let mut forced = plain.clone();
                forced.effects.forced = Forced::default().with(pass, Some(run));
                let (before, after) = (&before[pass as usize], &plan(&forced, &facts)[pass as usize]);
                let changed = changed((&plain, &facts), (&forced, &facts));
                if before.fixed.is_some() {
                    assert_eq!(before, after);
                    assert!(changed.is_empty());
                    continue;
                }
                assert_eq!(after.run, run, "{pass:?}");
                let says = if run { "on by hand; " } else { "off by hand" };
                assert!(after.reason.starts_with(says), "{}", after.reason);
                assert_eq!(changed.contains(&pass.name()), before.run != run, "{pass:?}");
            }
        }
    }
}

#[test]
fn what_lacks_its_input_cannot_be_forced_and_says_why() {
    let bare = Scene { background: Background::None, output: Output::Linear, ..scene() };
    let fixed = |scene: &Scene| {
        let planned = plan(scene, &FACTS);
        let fixed = planned.iter().filter(|p| p.fixed.is_some());
        fixed.map(|p| p.pass.name()).collect::<Vec<_>>()
    };
    let always = ["predict", "weights", "relight", "plate", "view", "channels", "difference", "false_color"];
    assert_eq!(fixed(&scene()), always);
    let cut_out = with(Effects { forced: Forced::default().with(Pass::Background, Some(false)), ..Effects::default() });
    assert_eq!(fixed(&cut_out)[4..6], ["background_blur", "light_wrap"]);
    for name in ["background", "background_blur", "light_wrap", "grain", "dither"] {
        assert!(fixed(&bare).contains(&name), "{name}");
    }
}
