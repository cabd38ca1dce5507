//! Values of options that are more than a word or a number.

use crate::calibration::{Circle, Trial};
use crate::imaging::DualGamma;

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

pub fn parse_gamma(text: &str) -> std::result::Result<DualGamma, String> {
    let [gamma1, gamma2] = parse_numbers(text, "two exponents such as 2.6,2.1")?;
    DualGamma::new(gamma1 as f32, gamma2 as f32).map_err(|e| e.to_string())
}

pub fn parse_trial(text: &str) -> std::result::Result<Trial, String> {
    let full = if text.matches(',').count() == 1 {
        format!("{text},1")
    } else {
        text.to_owned()
    };
    let [gamma1, gamma2, exposure] = parse_numbers(&full, "G1,G2 or G1,G2,EXPOSURE")?;
    Trial::new(gamma1 as f32, gamma2 as f32, exposure as f32).map_err(|e| e.to_string())
}

pub fn parse_rgb(text: &str) -> std::result::Result<[f32; 3], String> {
    let rgb: [f64; 3] = parse_numbers(text, "R,G,B such as 0.6,0.6,0.6")?;
    Ok(rgb.map(|v| v as f32))
}

pub fn parse_count(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one lamp has to count".to_owned()),
        parsed => parsed.map_err(|e| format!("{text:?} is no count: {e}")),
    }
}

pub fn parse_range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| {
        s.trim()
            .parse::<usize>()
            .map_err(|e| format!("{s:?} is no frame number: {e}"))
    };
    let (from, to) = (number(from)?, number(to)?);
    if from <= to {
        Ok((from, to))
    } else {
        Err(format!("{from} comes after {to}"))
    }
}
