//! Parsers for options that are more than a word or a number.

use base::numbers;

pub fn parse_shares(text: &str) -> std::result::Result<[f32; 3], String> {
    let names = "R,G,B from 0.01 to 1, such as 0.6,0.6,0.6";
    let shares = numbers(text, names)?.map(|v: f64| v as f32);
    (shares.iter().all(|share| (0.01..=1.0).contains(share)))
        .then_some(shares)
        .ok_or_else(|| format!("{text:?} is not {names}"))
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
        _ => Err(format!("{text:?} is not a number of minutes above 0")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minutes_are_positive_and_end() {
        assert_eq!(parse_minutes("0.75"), Ok(0.75));
        for text in ["", "soon", "0", "-1", "nan", "inf"] {
            assert!(parse_minutes(text).is_err(), "{text}");
        }
    }
}
