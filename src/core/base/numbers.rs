//! Numbers as users type them.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Range of typed angles in degrees: many turns, and still exact to a hundredth of a degree.
pub const ANGLES: RangeInclusive<f32> = -100_000.0..=100_000.0;

/// Parses the `N` numbers in `text`; `names` describes them, such as `X,Y,RADIUS in pixels`.
///
/// # Errors
/// When a number cannot be parsed or is not finite, or the count differs; the sentence contains `text` and
/// `names`.
pub fn numbers<const N: usize>(text: &str, names: &str) -> std::result::Result<[f64; N], String> {
    let refuse = || format!("{text:?} is not {names}");
    let numbers = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect::<std::result::Result<Vec<f64>, _>>()
        .map_err(|_| refuse())?;
    let numbers: [f64; N] = numbers.try_into().map_err(|_| refuse())?;
    (numbers.iter().all(|number| number.is_finite())).then_some(numbers).ok_or_else(refuse)
}

/// Parser of numbers in a range, for clap. NaN is in no range.
pub fn within<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Display + Clone,
{
    move |text| {
        let number = text.trim().parse().ok();
        (number.filter(|number| range.contains(number)))
            .ok_or_else(|| format!("expected a number from {} to {}", range.start(), range.end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_as_many_as_asked_for() {
        assert_eq!(numbers("1, -2.5", "X,Y"), Ok([1.0, -2.5]));
        for text in ["", "1", "1,2,3", "1,b", "1,nan", "inf,2"] {
            let refused = numbers::<2>(text, "X,Y").unwrap_err();
            assert!(refused.contains("X,Y") && refused.contains(text), "{refused}");
        }
    }

    #[test]
    fn a_number_outside_its_range_is_refused_with_the_range() {
        let read = within(-2.5f32..=4.0);
        assert_eq!(read(" -2.5 "), Ok(-2.5));
        for text in ["nan", "inf", "-inf", "1e99", "-2.6", "4.1", "", "two"] {
            assert_eq!(read(text), Err("expected a number from -2.5 to 4".into()), "{text}");
        }
        assert_eq!(within(1..=8usize)("8"), Ok(8));
        assert!(within(1..=8usize)("-1").is_err() && within(1..=8usize)("9").is_err());
    }
}
