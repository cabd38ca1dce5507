use super::*;
use crate::lamps::Rest;
use crate::media::tests::media;
use crate::shot::tests::shot;
use export::LayerFiles;
use glam::Vec3;

/// Shot of two lamps; one of them changes.
fn lit(to: &str) -> Shot {
    let lamp = |index: usize, direction: Vec3, weights: Vec<[f32; 3]>| LampLayer {
        layer: format!("light_{index:02}"),
        lamp: format!("olat \"{index}\" [x] {{"),
        direction,
        spread_deg: 5.0,
        group: if direction.z < 0.0 { Group::Rim } else { Group::Key },
        weights,
        files: None,
    };
    let mut shot = shot(to);
    shot.layers = Some(Layers {
        lamps: vec![
            lamp(0, Vec3::Z, vec![[0.5; 3]; 5]),
            lamp(1, Vec3::NEG_Z, (0..5).map(|i| [0.25 * i as f32, 0.0, 1.0]).collect()),
        ],
        rest: Some(Rest { files: None }),
        place: LayerFiles::Channels,
        alpha: ExrAlpha::Straight,
        size: (64, 48),
    });
    shot
}

#[test]
fn a_lamps_weight_is_a_number_or_a_curve() {
    let text = script(&lit("shot.%04d.exr"));
    assert!(text.contains(" written {0.5 0.5 0.5}\n"), "{text}");
    let curve = " written {{curve x10 0 x11 0.25 x12 0.5 x13 0.75 x14 1} 0 1}\n";
    assert!(text.contains(curve), "{text}");
    assert!(text.contains(" first 10\n last 14\n"), "{text}");
    assert!(text.contains("Premult {"), "straight alpha is premultiplied after the sum");
}

#[test]
fn names_cannot_break_the_script() {
    let text = script(&lit("a b/it's [exit] $HOME {\"x\"} é.%04d.exr"));
    let file = r#" file "it's \\\[exit\\\] \\\$HOME \{\"x\"\} é.%04d.exr""#;
    assert!(text.contains(file), "{text}");
    let mut depth = 0i64;
    let mut escaped = false;
    for c in text.chars() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => (),
        }
        assert!(depth >= 0);
    }
    assert_eq!(depth, 0, "braces do not match: {text}");
}

#[test]
fn signs_that_nuke_takes_for_numbers_are_refused() {
    for to in ["shot#1.%04d.exr", "100%%.%04d.exr"] {
        let error = check(&media(to)).unwrap_err().to_string();
        assert!(error.contains("frame's number"), "{error}");
    }
    check(&media("my shot.%04d.exr")).unwrap();
}
