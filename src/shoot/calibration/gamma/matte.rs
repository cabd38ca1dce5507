//! Pixels of a matte that show only the subject.

use imaging::Mask;

/// Smallest coverage of a pixel that shows only the subject.
pub(super) const SOLID: f32 = 0.98;

/// Distance in pixels between a picture's samples and the matte's edge.
pub(super) fn margin(width: usize) -> usize {
    width.div_ceil(128)
}

/// Up to about `count` places, spread over the subject, with a neighbourhood fully inside it.
pub(super) fn inside(mask: &Mask, count: usize) -> Vec<usize> {
    let (width, height) = mask.size();
    let margin = margin(width);
    let solid = |x: usize, y: usize| mask.at(x, y) > SOLID;
    let places: Vec<usize> = (margin..height.saturating_sub(margin))
        .flat_map(|y| (margin..width.saturating_sub(margin)).map(move |x| (x, y)))
        .filter(|&(x, y)| {
            solid(x, y) && (y - margin..=y + margin).all(|row| (x - margin..=x + margin).all(|col| solid(col, row)))
        })
        .map(|(x, y)| y * width + x)
        .collect();
    // Two neighbours at a time: their difference separates noise from misfit.
    let step = places.len().div_ceil(count).max(1);
    places.into_iter().enumerate().filter(|(i, _)| (i / 2) % step == 0).map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pixels_deep_inside_the_subject_count() {
        let mask = Mask::from_fn(20, 20, |x, y| if (5..12).contains(&x) && (5..12).contains(&y) { 1.0 } else { 0.5 });
        let places = inside(&mask, 100);
        assert_eq!(places.len(), 25);
        assert!(places.iter().all(|p| (6..11).contains(&(p % 20)) && (6..11).contains(&(p / 20))));
        assert!(inside(&Mask::filled(1, 1, 1.0), 10).is_empty());
    }
}
