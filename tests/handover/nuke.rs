use crate::nuke_script::Script;
use crate::{HARD_NAME, handed_over, picture};
use std::path::{Path, PathBuf};

/// Rounding error of half floats in layers and picture together, as a multiple of the value.
const ROUNDING: f32 = 1.0 / 1024.0;

const LOOK: &str = "--environment nave --yaw 20 --yaw-keys 0:0,3:90 --exposure 0.5 --layers --hand-over nuke";

fn script(folder: &Path) -> (PathBuf, String) {
    let path = folder.join(HARD_NAME.replace(".%04d.exr", ".nk"));
    let text = std::fs::read_to_string(&path).unwrap();
    (path, text)
}

/// Largest difference between a node's picture and the file's, as a multiple of its values.
fn residual(script: &Script, node: &str, folder: &Path, frame: usize) -> f32 {
    let made = script.picture(script.named(node), frame);
    made.residual(&picture(folder, frame))
}

#[test]
fn the_script_rebuilds_the_picture_from_its_layers() {
    let (figures, folder) = handed_over("nuke shot", HARD_NAME, LOOK);
    let (path, text) = script(&folder);
    assert!(figures["hand_over"][0].as_str().unwrap().ends_with(".nk"));
    let parsed = Script::parse(&path, &text);
    for frame in 0..4 {
        assert!(residual(&parsed, "Rebuilt", &folder, frame) <= ROUNDING);
        let wanted = picture(&folder, frame);
        let difference = parsed.picture(parsed.named("Difference"), frame);
        for channel in ["rgba.red", "rgba.green", "rgba.blue"] {
            let mut pairs = difference.get(channel).into_iter().zip(wanted.get(channel));
            assert!(pairs.all(|(d, v)| d <= ROUNDING * (v + 1e-3)));
        }
        assert!(wanted.brightest() > 0.1);
        // The turn and the keys, at every frame.
        let light = &parsed.nodes[parsed.named("Light")];
        let yaw = light.number("yaw", 0, frame);
        assert!((yaw + light.number("rotate_y", 0, frame) - 180.0).abs() < 1e-3);
    }
    let light = &parsed.nodes[parsed.named("Light")];
    assert_eq!(light.number("yaw", 0, 0), 20.0);
    assert_eq!(light.number("yaw", 0, 3), 110.0);
    // A gain changes the picture, and the difference shows it.
    for (gain, twice) in [(" gain 1\n", " gain 2\n"), (" value 1\n", " value 2\n")] {
        let brighter = Script::parse(&path, &text.replace(gain, twice));
        assert!(residual(&brighter, "Rebuilt", &folder, 1) > 0.5, "{gain}");
        let difference = brighter.picture(brighter.named("Difference"), 1);
        assert!(difference.brightest() > 0.1, "{gain}");
    }
    // Weights change as the light turns, and match those in the files.
    let listing = afterlight::export::LayerListing::from_path(&folder.join(HARD_NAME.replace("%04d", "0002")));
    for lamp in listing.unwrap().lamps {
        let node = &parsed.nodes[parsed.named(&format!("Lamp_{}", lamp.layer))];
        let written = [0, 1, 2].map(|c| node.number("written", c, 2));
        assert_eq!(written, lamp.weight, "{}", lamp.layer);
    }
}

#[test]
fn groups_add_up_to_the_subject() {
    let options = format!("{LOOK} --no-background --frames 1-1");
    let (_, folder) = handed_over("groups", HARD_NAME, &options);
    let (path, text) = script(&folder);
    let parsed = Script::parse(&path, &text);
    let mut sum = vec![0.0; 32 * 32];
    let mut groups = 0;
    for name in ["Key", "Fill", "Rim"] {
        if text.contains(&format!(" name {name}\n")) {
            groups += 1;
            let group = parsed.picture(parsed.named(name), 1).get("rgba.green");
            sum.iter_mut().zip(group).for_each(|(sum, v)| *sum += v);
        }
    }
    assert!(groups >= 2, "six lamps all around are on more than one side");
    let wanted = picture(&folder, 1);
    for (sum, wanted_value) in sum.iter().zip(wanted.get("rgba.green")) {
        assert!((sum - wanted_value).abs() <= ROUNDING * (wanted_value + 1e-3));
    }
    assert!(!text.contains("rest"), "there is no background");
}

#[test]
fn layers_are_found_wherever_they_are() {
    for (folder, more) in [
        ("parts", "--layer-files parts --exr-compression piz"),
        ("files", "--layer-files files --exr-alpha straight"),
        ("cropped", "--exr-crop --no-background --exr-samples float"),
        ("acescg", "--space acescg"),
    ] {
        let options = format!("{LOOK} --frames 2-2 {more}");
        let (_, folder) = handed_over(folder, HARD_NAME, &options);
        let (path, text) = script(&folder);
        let parsed = Script::parse(&path, &text);
        let left = residual(&parsed, "Rebuilt", &folder, 2);
        assert!(left <= ROUNDING, "{more}: {left}");
        let straight = more.contains("straight");
        assert_eq!(text.contains("Premult {"), straight, "{more}");
    }
}
