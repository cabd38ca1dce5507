use super::*;
use clap::Parser;
use light::keyframes::Keyframes;
use scene::LightSetting;

#[derive(Parser)]
struct Options {
    #[command(flatten)]
    settings: RelightSettings,
}

fn settings(options: &str) -> RelightSettings {
    let begin = "relight --environment nave --to x.png";
    let words = begin.split(' ').chain(options.split_whitespace());
    Options::try_parse_from(words).unwrap().settings
}

fn scene(settings: &RelightSettings, frame: usize, share: f32) -> Scene {
    settings.scene(frame, share, Front::default(), Output::Display)
}

fn keys(text: &str) -> Keyframes {
    text.parse().unwrap()
}

#[test]
fn keys_take_the_place_of_values_and_a_turntable_turns_what_they_say() {
    let mut moving = settings("--yaw 30 --pitch 5 --exposure 2 --turntable");
    let before = scene(&moving, 4, 0.25);
    assert_eq!((before.yaw_deg, before.exposure_stops), (120.0, 2.0));
    moving.animation.set(Setting::Yaw, keys("0:10,8:20"));
    moving.animation.set(Setting::Exposure, keys("0:-1,8:1"));
    let after = scene(&moving, 4, 0.25);
    assert_eq!((after.yaw_deg, after.exposure_stops), (105.0, 0.0));
    assert_eq!(after.lighting, before.lighting);
}

#[test]
fn an_effect_that_any_frame_may_ask_for_counts_for_the_whole_clip() {
    let mut moving = settings("--vignette 0.2");
    assert!(!moving.largest_effects().asks(Pass::Smoothing));
    let smoothing = Setting::Effect(Pass::Smoothing);
    moving.animation.set(smoothing, keys("0:0,8:0.5"));
    assert!(moving.largest_effects().asks(Pass::Smoothing));
    assert_eq!(moving.largest_effects().vignette, 0.2);
    assert!(!scene(&moving, 0, 0.0).effects.asks(Pass::Smoothing));
    assert!(scene(&moving, 4, 0.0).effects.asks(Pass::Smoothing));
}

#[test]
fn keys_of_a_light_that_is_not_there_are_refused() {
    let mut moving = settings("--light 0,0,10,1 --light 90,0,10,1");
    moving.lighting.number_lights();
    let azimuth = |id| Setting::Light(id, LightSetting::Yaw);
    moving.animation.set(azimuth(2), keys("0:0,8:90"));
    moving.check_keys().unwrap();
    assert_eq!(scene(&moving, 4, 0.0).lighting.placed[1].yaw_deg, 45.0);
    moving.animation.set(azimuth(3), keys("0:0"));
    let said = moving.check_keys().unwrap_err().to_string();
    assert!(
        said.contains("lights.3.yaw") && said.contains("1, 2"),
        "{said}"
    );
    moving.lighting.placed.clear();
    let said = moving.check_keys().unwrap_err().to_string();
    assert!(said.contains("no light"), "{said}");
}
