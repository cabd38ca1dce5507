//! Values of options that are more than a word or a number.

use calibration::{Circle, Trial};
use footage::Square;
use imaging::{DualGamma, Response};
use light::PlacedLight;
use light::conventions::{Front, Tool};
use light::keyframes::Keyframes;

/// Numbers between commas, as many as `names` has.
fn parse_numbers<const N: usize>(text: &str, names: &str) -> std::result::Result<[f64; N], String> {
    let refuse = || format!("{text:?} is not {names}");
    let numbers = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect::<std::result::Result<Vec<f64>, _>>()
        .map_err(|_| refuse())?;
    numbers.try_into().map_err(|_| refuse())
}

pub fn parse_circle(text: &str) -> std::result::Result<Circle, String> {
    let [x, y, radius] = parse_numbers(text, "X,Y,RADIUS in pixels")?;
    Circle::new([x, y], radius).map_err(|e| e.to_string())
}

/// Left edge, upper edge and side in whole pixels.
pub fn parse_square(text: &str) -> std::result::Result<Square, String> {
    let numbers = parse_numbers(text, "X,Y,SIDE in pixels")?;
    let whole = |v: f64| v.fract() == 0.0 && v.abs() <= f64::from(i32::MAX);
    let [x, y, side] = numbers;
    if numbers.into_iter().all(whole) && side >= 1.0 {
        Ok((x as i32, y as i32, side as usize))
    } else {
        Err(format!(
            "{text:?} is not a square: give whole pixels and a side of at least 1"
        ))
    }
}

/// The standard curve of this name.
fn standard(text: &str) -> Option<Response> {
    [Response::Srgb, Response::Rec709, Response::Linear]
        .into_iter()
        .find(|curve| {
            curve
                .name()
                .replace([' ', '.'], "")
                .eq_ignore_ascii_case(text.trim())
        })
}

pub fn parse_response(text: &str) -> std::result::Result<Response, String> {
    if let Some(curve) = standard(text) {
        return Ok(curve);
    }
    let names = "srgb, rec709, linear, or two exponents such as 2.6,2.1";
    let [gamma1, gamma2] = parse_numbers(text, names)?;
    let curve = DualGamma::new(gamma1 as f32, gamma2 as f32).map_err(|e| e.to_string())?;
    Ok(curve.into())
}

/// A response and, after another comma, an exposure.
pub fn parse_trial(text: &str) -> std::result::Result<Trial, String> {
    let numbers_of_response = match text.split(',').next().and_then(standard) {
        Some(_) => 1,
        None => 2,
    };
    let (response, exposure) = match text.match_indices(',').nth(numbers_of_response - 1) {
        Some((comma, _)) => (&text[..comma], &text[comma + 1..]),
        None => (text, "1"),
    };
    let [exposure] = parse_numbers(exposure, "an exposure such as 1.1")?;
    Trial::new(parse_response(response)?, exposure as f32).map_err(|e| e.to_string())
}

/// Values at frames, such as `0:0,24:90`.
pub fn parse_keys(text: &str) -> std::result::Result<Keyframes, String> {
    let mut keys = Keyframes::default();
    for key in text.split(',') {
        let refuse = || format!("{key:?} is not FRAME:VALUE");
        let (frame, value) = key.split_once(':').ok_or_else(refuse)?;
        let number = |text: &str| text.trim().parse().map_err(|_| refuse());
        keys.insert(number(frame)?, number(value)?)
            .map_err(|e| e.to_string())?;
    }
    Ok(keys)
}

/// Which way is front: a tool's name, or degrees of yaw.
pub fn parse_front(text: &str) -> std::result::Result<Front, String> {
    let name: String = text
        .chars()
        .filter(|c| c.is_ascii_alphanumeric())
        .collect::<String>()
        .to_ascii_lowercase();
    let tool = match name.as_str() {
        "afterlight" => return Ok(Front::default()),
        "openexr" | "exr" | "usd" => Tool::OpenExr,
        "nuke" => Tool::Nuke,
        "mitsuba" => Tool::Mitsuba,
        "threejs" => Tool::ThreeJs,
        "blender" => Tool::Blender,
        _ => {
            let [yaw_deg] = parse_numbers(
                text,
                "afterlight, openexr, usd, nuke, mitsuba, threejs, blender or degrees of yaw",
            )?;
            return match yaw_deg.is_finite() {
                true => Ok(Front::new(yaw_deg as f32)),
                false => Err(format!("{text:?} is not an angle")),
            };
        }
    };
    Ok(Front::of(tool))
}

/// A light placed by hand.
pub fn parse_light(text: &str) -> std::result::Result<PlacedLight, String> {
    const NAMES: &str = "AZIMUTH,ELEVATION,SIZE,INTENSITY or the same with R,G,B";
    let full = if text.matches(',').count() == 3 {
        format!("{text},1,1,1")
    } else {
        text.to_owned()
    };
    let [yaw, pitch, size, intensity, r, g, b] =
        parse_numbers(&full, NAMES)?.map(|v: f64| v as f32);
    let numbers = [yaw, pitch, size, intensity, r, g, b];
    let lights = size >= 0.0 && intensity >= 0.0 && [r, g, b].iter().all(|v| *v >= 0.0);
    if !lights || !numbers.iter().all(|v| v.is_finite()) || pitch.abs() > 90.0 {
        return Err(format!(
            "{text:?} is not a light: {NAMES}, elevation within 90°, the rest not negative"
        ));
    }
    Ok(PlacedLight {
        yaw_deg: yaw,
        pitch_deg: pitch,
        radius_deg: size / 2.0,
        color: [r, g, b],
        intensity,
        ..PlacedLight::default()
    })
}

pub fn parse_rgb(text: &str) -> std::result::Result<[f32; 3], String> {
    let rgb: [f64; 3] = parse_numbers(text, "R,G,B such as 0.6,0.6,0.6")?;
    Ok(rgb.map(|v| v as f32))
}

pub fn parse_count(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one lamp is needed".to_owned()),
        parsed => parsed.map_err(|e| format!("{text:?} is not a number of lamps: {e}")),
    }
}

pub fn parse_minutes(text: &str) -> std::result::Result<f64, String> {
    match text.trim().parse() {
        Ok(minutes) if minutes > 0.0 && f64::is_finite(minutes) => Ok(minutes),
        _ => Err(format!("{text:?} is no number of minutes above 0")),
    }
}

pub fn parse_range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| {
        s.trim()
            .parse::<usize>()
            .map_err(|e| format!("{s:?} is not a frame number: {e}"))
    };
    let (from, to) = (number(from)?, number(to)?);
    if from <= to {
        Ok((from, to))
    } else {
        Err(format!("{from} comes after {to}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_lights_are_read_or_refused() {
        let keys = parse_keys("0:0, 24:-90.5").unwrap();
        assert_eq!((keys.keys().len(), keys.at(24.0)), (2, Some(-90.5)));
        for text in ["", "3", "a:1", "1:nan", "1:2,"] {
            assert!(parse_keys(text).is_err(), "{text}");
        }
        let light = parse_light("-135,45,25,3.14,1,0.5,0.25").unwrap();
        assert_eq!((light.radius_deg, light.color), (12.5, [1.0, 0.5, 0.25]));
        assert_eq!(parse_light("0,0,1,1").unwrap().color, [1.0; 3]);
        for text in [
            "",
            "0,0,1",
            "0,91,1,1",
            "0,0,-1,1",
            "0,0,1,nan",
            "0,0,1,1,1",
        ] {
            assert!(parse_light(text).is_err(), "{text}");
        }
    }

    #[test]
    fn minutes_are_positive_and_end() {
        assert_eq!(parse_minutes("0.75"), Ok(0.75));
        for text in ["", "soon", "0", "-1", "nan", "inf"] {
            assert!(parse_minutes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn front_is_a_tools_or_an_angle() {
        assert_eq!(parse_front("three.js"), Ok(Front::at_column(0.25)));
        assert_eq!(parse_front("USD"), Ok(Front::at_column(0.0)));
        assert_eq!(parse_front("Afterlight"), Ok(Front::default()));
        assert_eq!(parse_front("-450"), Ok(Front::new(-90.0)));
        for text in ["", "maya", "nan", "1,2"] {
            assert!(parse_front(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_response_is_a_name_or_exponents_and_an_exposure_may_follow() {
        let dual = Response::Dual(DualGamma {
            gamma1: 2.5,
            gamma2: 1.75,
        });
        for (text, response, exposure) in [
            ("2.5,1.75", dual, 1.0),
            ("2.5, 1.75, 1.25", dual, 1.25),
            ("srgb", Response::Srgb, 1.0),
            ("Rec709,0.5", Response::Rec709, 0.5),
            ("linear", Response::Linear, 1.0),
        ] {
            assert_eq!(
                parse_trial(text),
                Ok(Trial { response, exposure }),
                "{text}"
            );
        }
        for text in [
            "",
            "2.5",
            "log",
            "srgb,",
            "srgb,9",
            "9,9",
            "2.5,1.75,1,1",
            "nan,2",
        ] {
            assert!(parse_trial(text).is_err(), "{text}");
        }
    }
}
