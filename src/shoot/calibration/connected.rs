//! Connected parts of a picture.

/// Pixels within the square of `reach` around a pixel of a picture with these columns and rows, that pixel
/// included.
pub(crate) fn around(
    place: usize,
    (width, height): (usize, usize),
    reach: usize,
) -> impl Iterator<Item = usize> {
    let (x, y) = (place % width, place / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    (y.saturating_sub(reach)..(y + reach + 1).min(height))
        .flat_map(move |row| columns.clone().map(move |column| row * width + column))
}

/// Connected parts of the pixels for which `inside` holds; diagonal neighbours are connected.
pub(crate) fn parts(size: (usize, usize), inside: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
    let mut todo: Vec<bool> = (0..size.0 * size.1).map(inside).collect();
    let mut parts = Vec::new();
    for start in 0..todo.len() {
        if !std::mem::take(&mut todo[start]) {
            continue;
        }
        let mut part = vec![start as u32];
        let mut next = 0;
        while next < part.len() {
            for place in around(part[next] as usize, size, 1) {
                if std::mem::take(&mut todo[place]) {
                    part.push(place as u32);
                }
            }
            next += 1;
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_touch_at_corners_and_not_across_the_border() {
        // Columns 0 and 3 of a picture four wide are neighbours only in memory.
        let set = [0, 5, 10, 7, 3];
        let found = parts((4, 3), |place| set.contains(&place));
        assert_eq!(found, [vec![0, 5, 10, 7, 3]]);
        let found = parts((4, 3), |place| [3, 4].contains(&place));
        assert_eq!(found, [vec![3], vec![4]]);
        assert!(parts((0, 0), |_| true).is_empty());
    }
}
