//! Typed values: responses, lights, keyframes, circles, fronts, numbers.

use calibration::{Circle, Trial};
use fuzz::{Outcome, Target};
use imaging::{Image, Response};
use light::PlacedLight;
use light::conventions::Front;
use light::keyframes::{Interpolation, Keyframes};
use std::path::Path;
use test_support::shown;

fn response(text: &str) -> Result<(), String> {
    let response: Response = text.parse()?;
    for code in [0.0, 0.25, 1.0] {
        let light = response.decode_value(code);
        assert!((0.0..=1.0).contains(&light), "{response:?} at {code} is {light}");
    }
    Ok(())
}

fn trial(text: &str) -> Result<(), String> {
    let trial: Trial = text.parse()?;
    assert!(trial.exposure > 0.0 && trial.exposure.is_finite());
    response(text).or(Ok(()))
}

fn light(text: &str) -> Result<(), String> {
    let light: PlacedLight = text.parse()?;
    let mut sky = Image::filled(16, 8, [0.0; 3]);
    light.add_to(&mut sky);
    assert!(sky.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{light:?}");
    assert!(light.direction().is_normalized());
    Ok(())
}

fn keyframes(text: &str) -> Result<(), String> {
    let mut keys: Keyframes = text.parse()?;
    for frame in [-1e300, 0.0, 0.5, 3.0, 1e9, f64::NAN, f64::INFINITY] {
        assert!(keys.at(frame).is_none_or(f64::is_finite), "{keys:?} at {frame}");
    }
    let _ = keys.shift(0, 7.0, -1.0);
    keys.set_kind(0, Interpolation::Bezier);
    if keys.set_slopes(0, [None, Some(1e9)]).is_ok() {
        keys.insert(8.0, 1e9).map_err(|e| e.to_string())?;
        assert!(keys.at(7.5).is_some_and(f64::is_finite), "{keys:?}");
    }
    keys.remove(1);
    Ok(())
}

fn front(text: &str) -> Result<(), String> {
    let front: Front = text.parse()?;
    assert!(front.yaw_deg().is_finite(), "{front:?}");
    Ok(())
}

fn circle(text: &str) -> Result<(), String> {
    let circle: Circle = text.parse()?;
    assert!(circle.radius_px > 0.0 && circle.center_px.iter().all(|v| v.is_finite()));
    Ok(())
}

type Reader = fn(&str) -> Result<(), String>;

/// Parsers, each with a valid text.
const READERS: [(Reader, &str); 10] = [
    (response, "2.6,2.1"),
    (response, "log,30"),
    (trial, "srgb,1.25"),
    (trial, "2.5,1.75,1.25"),
    (light, "-90,45,30,3.14"),
    (light, "0,10,0,1,1,0.5,0"),
    (keyframes, "0:0,24:90,48:-720.5"),
    (front, "blender"),
    (front, "-90"),
    (circle, "320,240,200.5"),
];

#[test]
fn whatever_is_typed_is_understood_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let seeds = READERS.map(|(_, text)| text.as_bytes().to_vec()).to_vec();
    let target = Target::of_text("words", folder.path().join("typed"), seeds);
    let measured = fuzz::run!(target, |path: &Path| -> Outcome {
        let typed = std::fs::read(path).unwrap();
        let typed = String::from_utf8_lossy(&typed);
        let said = READERS.map(|(read, _)| read(&typed));
        if said.iter().any(Result::is_ok) {
            return Ok(());
        }
        // The message may be as long as the typed text.
        let said = format!("typed: {}", said[0].clone().unwrap_err());
        Err(said.chars().filter(|c| !c.is_control()).take(300).collect())
    });
    shown!(Strangers, "Typed responses, lights, keyframes, circles and fronts", bound: "finite light, angles and curves", measured: measured);
}
