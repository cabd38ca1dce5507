//! Figures as cells of tables.

/// A figure with this number of digits after the point, or a dash for none.
pub fn cell(figure: Option<f64>, digits: usize) -> String {
    let known = figure.filter(|figure| figure.is_finite());
    known.map_or("–".to_owned(), |figure| format!("{figure:.digits$}"))
}

/// A PSNR with one digit, `exact` from `most` decibels on, or a dash for none.
pub fn decibels(figure: Option<f64>, most: f64) -> String {
    if figure.is_some_and(|figure| figure >= most) { "exact".to_owned() } else { cell(figure, 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_show_digits_exact_values_and_gaps() {
        assert_eq!(cell(Some(1.25), 1), "1.2");
        assert_eq!([None, Some(f64::NAN)].map(|figure| cell(figure, 1)), ["–", "–"]);
        let text = |figure| decibels(figure, 100.0);
        assert_eq!([Some(100.0), Some(30.04), None].map(text), ["exact", "30.0", "–"]);
    }
}
