//! Numbers between commas, as people type them.

/// Reads the `N` numbers in `text`; `names` says what they are, such as `X,Y,RADIUS in pixels`.
///
/// # Errors
/// When a number cannot be read, or there are more or fewer; the sentence names `text` and `names`.
pub fn numbers<const N: usize>(text: &str, names: &str) -> std::result::Result<[f64; N], String> {
    let refuse = || format!("{text:?} is not {names}");
    let numbers = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect::<std::result::Result<Vec<f64>, _>>()
        .map_err(|_| refuse())?;
    numbers.try_into().map_err(|_| refuse())
}

#[cfg(test)]
mod tests {
    use super::numbers;

    #[test]
    fn there_are_as_many_as_asked_for() {
        assert_eq!(numbers("1, -2.5", "X,Y"), Ok([1.0, -2.5]));
        for text in ["", "1", "1,2,3", "1,b"] {
            let refused = numbers::<2>(text, "X,Y").unwrap_err();
            assert!(
                refused.contains("X,Y") && refused.contains(text),
                "{refused}"
            );
        }
    }
}
