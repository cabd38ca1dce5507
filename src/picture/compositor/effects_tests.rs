use super::tests::{Set, largest_difference, scene};
use super::*;
use crate::smoothing::tests::after;
use crate::{Extra, Facts, Grain, rim};
use imaging::color::luminance;
use imaging::{Encoded, Image, Mask};
use scene::{Background, Channel, Effects, Forced, Inspection, Output, Pass, STRENGTHS, Strength, ViewTransform};

/// Effects that this set does not need, although the scene requests every effect with a measured need.
fn idle() -> Effects {
    Effects { smoothing: 0.8, despill: 1.0, light_wrap: 1.0, glare: 1.0, grain: 1.0, ..Effects::default() }
}

fn forced(scene: &Scene, ingredients: &Ingredients) -> Picture {
    let mut all = plan(scene, &Facts::default());
    all.iter_mut().for_each(|p| p.run = true);
    execute(scene, ingredients, &all).unwrap()
}

#[test]
fn an_effect_that_nothing_calls_for_may_be_left_out() {
    let mut set = Set::new(64);
    // A background no brighter than the rim: black. Nothing here is brighter than white.
    set.environment.radiance = Image::filled(8, 4, [0.0; 3]);
    set.weights.per_lamp = vec![[0.3; 3]; 3];
    let before = after(None, 4, &set.field, &set.mask, 0.8);
    let scene = Scene { frame: 5, effects: idle(), ..scene(Background::Environment, Output::Display, -3.0) };
    let extra = Extra { before: Some(&before), grain: Some(&Grain::default()), ..Extra::default() };
    let ingredients = Ingredients { extra, ..set.ingredients() };
    let planned = compose(&scene, &ingredients).unwrap();
    let ran = |name: &str| planned.passes.iter().any(|p| p.name == name && p.ran);
    for name in ["smoothing", "despill", "light_wrap", "glare", "grain"] {
        assert!(!ran(name), "{name}");
    }
    let all = forced(&scene, &ingredients);
    // Bounds on moved light: smoothing 0.1 %, wrapping 0.2 % of the rim, despill 0.5 %; here only rounding.
    assert!(largest_difference(planned.light(), all.light()) < 1e-6);
    let (a, b) = (planned.display.unwrap().0, all.display.unwrap().0);
    assert!(largest_difference(&a, &b) < 1e-5);
}

#[test]
fn a_little_of_what_calls_for_an_effect_stays_within_the_stated_bounds() {
    // A trace of flicker, spill, light behind and grain, each below its bound.
    let mut set = Set::new(96);
    let before = after(None, 0, &set.field, &set.mask, 1.0);
    let rim = rim(&set.mask);
    if let Field::Memory(field) = &mut set.field {
        let plane = 96 * 96;
        for (i, value) in field.values.iter_mut().enumerate() {
            let green = (i / plane) % 3 == 1;
            *value *= 1.0007 * if green { 1.0 + 0.055 * rim.pixels[i % plane] } else { 1.0 };
        }
    }
    set.weights.per_lamp = vec![[0.5; 3]; 3];
    set.environment.radiance = Image::filled(8, 4, [0.35; 3]);
    let plate = Grain { deviation: [[0.2 / 255.0; 3]; 8] };
    let scene = Scene {
        frame: 1,
        effects: Effects { smoothing: 1.0, light_wrap: 0.001, ..idle() },
        ..scene(Background::Environment, Output::Display, 0.0)
    };
    let extra = Extra { before: Some(&before), grain: Some(&plate), ..Extra::default() };
    let ingredients = Ingredients { extra, ..set.ingredients() };
    let planned = compose(&scene, &ingredients).unwrap();
    let ran = |name: &str| planned.passes.iter().any(|p| p.name == name && p.ran);
    for name in ["smoothing", "despill", "light_wrap", "grain"] {
        assert!(!ran(name), "{name}: {:?}", planned.passes);
    }
    let effects = |effects: Effects| {
        let scene = Scene { effects, ..scene.clone() };
        let left_out = compose(&scene, &ingredients).unwrap();
        (left_out, forced(&scene, &ingredients))
    };
    // Mean change over the rim, as a share of the rim's light.
    let rim_change = |(a, b): &(Picture, Picture)| {
        let pixels = a.light().pixels.iter().zip(&b.light().pixels);
        let pixels = pixels.zip(&rim.pixels);
        let (mut change, mut light) = (0.0, 0.0);
        for ((a, b), rim) in pixels {
            change += rim * (luminance(*a) - luminance(*b)).abs();
            light += rim * luminance(*a);
        }
        change / light
    };
    let despilled = effects(Effects { despill: 1.0, ..Effects::default() });
    let change = rim_change(&despilled);
    assert!(change > 0.0 && change <= 0.005, "{change}");
    let wrapped = effects(Effects { light_wrap: 0.001, ..Effects::default() });
    assert!(rim_change(&wrapped) <= 0.003, "{}", rim_change(&wrapped));
    let grainy = effects(Effects { grain: 1.0, ..Effects::default() });
    let (a, b) = (grainy.0.display.unwrap().0, grainy.1.display.unwrap().0);
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let square = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f32>() / (3.0 * 96.0 * 96.0);
    assert!(square.sqrt() <= 0.25 / 255.0, "{}", 255.0 * square.sqrt());
    let steady = effects(Effects { smoothing: 1.0, ..Effects::default() });
    for (a, b) in steady.0.light().pixels.iter().zip(&steady.1.light().pixels) {
        assert!((a[0] - b[0]).abs() <= 0.001 * a[0] + 1e-6);
    }
}

#[test]
fn every_effect_that_is_called_for_changes_the_picture() {
    let mut set = Set::new(64);
    set.environment.radiance = Image::from_fn(64, 32, |x, _| [(x % 7) as f32; 3]);
    if let Field::Memory(field) = &mut set.field {
        let rim = rim(&set.mask);
        for (i, value) in field.values.iter_mut().enumerate() {
            *value += if (i / 4096) % 3 == 1 { 0.3 * rim.pixels[i % 4096] } else { 0.0 };
        }
    }
    let plate = Grain { deviation: [[0.05; 3]; 8] };
    let second = Encoded(Image::filled(64, 64, [0.5; 3]));
    let extra = Extra { grain: Some(&plate), second: Some(&second), ..Extra::default() };
    let ingredients = Ingredients { extra, ..set.ingredients() };
    let shown = |effects| {
        let scene = Scene { effects, ..scene(Background::Environment, Output::Display, 0.5) };
        compose(&scene, &ingredients).unwrap()
    };
    let off = Effects::default();
    let plain = shown(off);
    let inspect = |inspection| Effects { inspection, ..off };
    let strong = Effects { despill: 1.0, background_blur: 0.05, light_wrap: 0.5, grain: 1.0, ..Effects::all(0.3) };
    let alone = |strength: &Strength| {
        let mut effects = off;
        *(strength.of)(&mut effects) = strong.strength(strength.pass);
        (strength.pass, effects)
    };
    // Smoothing needs the frame before.
    let strengths = STRENGTHS.iter().map(alone);
    let strengths = strengths.filter(|(pass, _)| *pass != Pass::Smoothing);
    let others = [
        (Pass::View, Effects { view: ViewTransform::Filmic, ..off }),
        (Pass::Channels, inspect(Inspection::Channel(Channel::Green))),
        (Pass::Difference, inspect(Inspection::Difference { gain: 2.0 })),
        (Pass::FalseColor, inspect(Inspection::FalseColor)),
    ];
    for (pass, effects) in strengths.chain(others) {
        let picture = shown(effects);
        let report = &picture.passes[pass as usize];
        assert!(report.ran && report.ms > Some(0.0), "{report:?}");
        assert_ne!(picture.display, plain.display, "{pass:?}");
        let linear = pass < Pass::View;
        assert_eq!(picture.linear != plain.linear, linear, "{pass:?}");
    }
    // Laying the subject over a blurred background of one colour equals drawing that colour.
    set.environment.radiance = Image::filled(8, 4, [0.5; 3]);
    let at = |background_blur| {
        let effects = Effects { background_blur, ..off };
        let scene = Scene { effects, ..scene(Background::Environment, Output::Linear, 0.0) };
        compose(&scene, &set.ingredients()).unwrap().light().clone()
    };
    assert!(largest_difference(&at(0.0), &at(0.03)) < 1e-5);
}

#[test]
fn a_new_exposure_neither_relights_nor_draws_the_background_again() {
    let set = Set::new(48);
    for effects in
        [Effects::default(), Effects { despill: 1.0, background_blur: 0.03, light_wrap: 0.5, ..Effects::default() }]
    {
        let mut reuse = Reuse::default();
        let scene =
            |stops, yaw_deg| Scene { effects, yaw_deg, ..scene(Background::Environment, Output::Display, stops) };
        let mut make = |scene: &Scene| {
            let made = compose_reusing(scene, &set.ingredients(), &mut reuse).unwrap();
            let fresh = compose(scene, &set.ingredients()).unwrap();
            assert_eq!((&made.linear, &made.display), (&fresh.linear, &fresh.display));
            let ran = made.passes.into_iter().filter(|p| p.ran).map(|p| p.name);
            ran.collect::<Vec<_>>()
        };
        let first = make(&scene(1.0, 20.0));
        assert!(first.contains(&"relight".into()) && first.contains(&"background".into()));
        assert_eq!(make(&scene(2.0, 20.0)), ["exposure", "view", "dither"]);
        let turned = make(&scene(2.0, 30.0));
        // The lamps' weights are the same here: only the background turned.
        assert!(!turned.contains(&"relight".into()) && turned.contains(&"background".into()));
        let back = make(&scene(-1.0, 20.0));
        assert!(back.contains(&"background".into()));
    }
}

#[test]
fn another_frame_light_or_level_is_never_taken_for_the_same() {
    let mut set = Set::new(32);
    let mut reuse = Reuse::default();
    let scene = Scene {
        effects: Effects { glare: 0.5, ..Effects::default() },
        ..scene(Background::Environment, Output::Linear, 2.0)
    };
    let mut make = |set: &Set, frame, level| {
        let mut ingredients = set.ingredients();
        ingredients.extra.identity.frame = frame;
        ingredients.levels.subject = level;
        let made = compose_reusing(&scene, &ingredients, &mut reuse).unwrap();
        assert_eq!(made.linear, compose(&scene, &ingredients).unwrap().linear);
    };
    make(&set, 0, 1.0);
    make(&set, 0, 2.0);
    set.weights.per_lamp[0] = [2.0; 3];
    make(&set, 0, 2.0);
    if let Field::Memory(field) = &mut set.field {
        field.values.iter_mut().for_each(|v| *v *= 0.5);
    }
    make(&set, 1, 2.0);
    make(&set, 1, 2.0);
}

#[test]
fn hard_inputs_give_finite_pictures_with_every_effect() {
    let plate = Grain { deviation: [[0.05; 3]; 8] };
    let effects = Effects { background_blur: 0.1, vignette: 0.9, view: ViewTransform::Aces, ..idle() };
    for size in [1, 2, 16] {
        for alpha in [0.0, 0.5, 1.0] {
            for light in [0.0, 1.0, 1e6] {
                let mut set = Set::new(size);
                set.mask = Mask::filled(size, size, alpha);
                set.weights.per_lamp = vec![[light; 3], [0.0; 3], [0.1; 3]];
                set.environment.radiance = Image::filled(4, 2, [light; 3]);
                if let Field::Memory(field) = &mut set.field {
                    field.values[0] = f32::NAN;
                }
                let before = after(None, 0, &set.field, &set.mask, 0.5);
                let extra = Extra { before: Some(&before), grain: Some(&plate), ..Extra::default() };
                let ingredients = Ingredients { extra, ..set.ingredients() };
                for background in [Background::Environment, Background::None] {
                    let scene = Scene { frame: 1, effects, ..scene(background, Output::Display, 2.0) };
                    for picture in [compose(&scene, &ingredients).unwrap(), forced(&scene, &ingredients)] {
                        let values = picture.light().pixels.iter().flatten();
                        assert!(values.clone().all(|v| v.is_finite()));
                        let codes = picture.display.unwrap().0;
                        let codes = codes.pixels.iter().flatten();
                        assert!(codes.clone().all(|c| (0.0..=1.0).contains(c)));
                    }
                }
            }
        }
    }
    test_support::shown!(Pictures, "The same with every effect, under light of 0, 1 and 10⁶",
 bound: "all light finite", measured: "holds");
}

#[test]
fn a_pass_that_is_forced_without_a_strength_changes_nothing_and_one_forced_off_is_not_done() {
    let set = Set::new(64);
    let before = after(None, 4, &set.field, &set.mask, 0.8);
    let extra = Extra { before: Some(&before), grain: Some(&Grain::default()), ..Extra::default() };
    // Lamps beyond white in the background make glare necessary.
    let mut lamps = Set::new(64);
    lamps.environment.radiance = Image::from_fn(64, 32, |x, _| [(x % 7) as f32; 3]);
    let made_of = |set: &Set, effects, background| {
        let scene = Scene { frame: 5, effects, ..scene(background, Output::Display, 0.0) };
        let ingredients = Ingredients { extra, ..set.ingredients() };
        compose(&scene, &ingredients).unwrap()
    };
    let made = |effects, background| made_of(&set, effects, background);
    let around = || Background::Environment;
    let forced = |effects: Effects, pass, run| Effects { forced: Forced::default().with(pass, Some(run)), ..effects };
    let off = Effects::default();
    let plain = made(off, around());
    let strengths = STRENGTHS.iter().map(|strength| strength.pass);
    for pass in strengths.chain([Pass::Exposure]) {
        let on = made(forced(off, pass, true), around());
        assert!(on.passes[pass as usize].ran, "{pass:?}");
        // Rounding of a background drawn before the subject is laid over it.
        let apart = largest_difference(plain.light(), on.light());
        assert!(apart < 1e-6, "{pass:?}: {apart}");
    }
    // Dither stays below one code, also without a background.
    let bare = made(off, Background::None).display.unwrap();
    let on = made(forced(off, Pass::Dither, true), Background::None);
    let apart = largest_difference(&bare.0, &on.display.unwrap().0);
    assert!(0.0 < apart && apart <= 0.5 / 255.0, "{apart}");

    let strong = Effects { background_blur: 0.05, light_wrap: 0.5, glare: 0.3, ..off };
    for (pass, without) in [
        (Pass::BackgroundBlur, Effects { background_blur: 0.0, ..strong }),
        (Pass::LightWrap, Effects { light_wrap: 0.0, ..strong }),
        (Pass::Glare, Effects { glare: 0.0, ..strong }),
    ] {
        let left_out = made_of(&lamps, forced(strong, pass, false), around());
        assert_eq!(left_out.display, made_of(&lamps, without, around()).display, "{pass:?}");
        assert_ne!(left_out.display, made_of(&lamps, strong, around()).display, "{pass:?}");
    }
    let dark = made(forced(off, Pass::Background, false), around());
    assert_eq!(dark.light().pixels[0], [0.0; 3]);
    let dark = made(forced(strong, Pass::Background, false), around());
    assert!(!dark.passes[Pass::BackgroundBlur as usize].ran);
}
