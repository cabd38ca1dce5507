use super::*;
use clap::Parser;
use light::keyframes::Keyframes;
use scene::{Animation, LightSetting, Pass};

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
    moving.look.animation.set(Setting::Yaw, keys("0:10,8:20"));
    moving.look.animation.set(Setting::Exposure, keys("0:-1,8:1"));
    let after = scene(&moving, 4, 0.25);
    assert_eq!((after.yaw_deg, after.exposure_stops), (105.0, 0.0));
    assert_eq!(after.lighting, before.lighting);
}

#[test]
fn an_effect_that_any_frame_may_ask_for_counts_for_the_whole_clip() {
    let mut moving = settings("--vignette 0.2");
    assert!(!moving.largest_effects().asks(Pass::Smoothing));
    let smoothing = Setting::Effect(Pass::Smoothing);
    moving.look.animation.set(smoothing, keys("0:0,8:0.5"));
    assert!(moving.largest_effects().asks(Pass::Smoothing));
    assert_eq!(moving.largest_effects().vignette, 0.2);
    assert!(!scene(&moving, 0, 0.0).effects.asks(Pass::Smoothing));
    assert!(scene(&moving, 4, 0.0).effects.asks(Pass::Smoothing));
}

#[test]
fn keys_of_a_light_that_is_not_there_are_refused() {
    let mut moving = settings("--light 0,0,10,1 --light 90,0,10,1");
    moving.look.lighting.number_lights();
    let azimuth = |id| Setting::Light(id, LightSetting::Yaw);
    moving.look.animation.set(azimuth(2), keys("0:0,8:90"));
    moving.check_keys().unwrap();
    assert_eq!(scene(&moving, 4, 0.0).lighting.placed[1].yaw_deg, 45.0);
    moving.look.animation.set(azimuth(3), keys("0:0"));
    let said = moving.check_keys().unwrap_err().to_string();
    assert!(said.contains("lights.3.yaw") && said.contains("1, 2"), "{said}");
    moving.look.lighting.placed.clear();
    let said = moving.check_keys().unwrap_err().to_string();
    assert!(said.contains("no light"), "{said}");
    moving.look.animation = Animation::default();
    moving.look.animation.set(Setting::Group(3), keys("0:1"));
    let said = moving.check_keys().unwrap_err().to_string();
    assert!(said.contains("groups.3.gain"), "{said}");
}

#[test]
fn all_settings_come_back_from_a_file_as_they_were() {
    let mut all = settings(
        "--front nuke --yaw 3.3 --turntable --solo a,b --weights smooth --pitch 1.1 --roll -2.2 --intensity 0.7 \
         --temperature 3210 --tint 12 --background-yaw 7 --light 0,20,30,2 --light 60,0,20,1,1,0.5,0.3 --vignette 0.3 \
         --grain 0.9 --view aces --frames 2-9 --exposure 0.1 --codec prores-4444 --movie-alpha premultiplied --space rec709 \
         --lut look.cube --no-sound --at square --size 640 --bits 16 --layers --hand-over nuke,edl --profile --device cpu \
         --field compressed --exr-samples float --background #102030",
    );
    all.look.lighting.number_lights();
    all.look.lighting.placed[1].group = "rim".to_owned();
    all.look.lighting.groups =
        vec![light::LightGroup { name: "rim".to_owned(), id: 1, gain_stops: -1.3, ..light::LightGroup::default() }];
    assert_eq!(all.look.background, Background::Color([16, 32, 48]));
    let mut lanes = vec![Setting::Yaw, Setting::Exposure, Setting::Tint];
    lanes.extend(STRENGTHS.iter().map(|strength| Setting::Effect(strength.pass)));
    lanes.extend(LightSetting::ALL.map(|setting| Setting::Light(2, setting)));
    lanes.push(Setting::Group(1));
    for (number, lane) in lanes.into_iter().enumerate() {
        all.look.animation.set(lane, keys(&format!("0:0.1,{}:0.7", number + 1)));
    }
    let text = serde_json::to_string(&all).unwrap();
    let read: RelightSettings = serde_json::from_str(&text).unwrap();
    assert_eq!(format!("{read:?}"), format!("{all:?}"));
}
