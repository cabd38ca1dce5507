//! Connected parts of a picture.

/// Pixels within the square of `reach` around a pixel of a picture with these columns and rows, that pixel
/// included.
pub fn around(place: usize, (width, height): (usize, usize), reach: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (place % width, place / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    (y.saturating_sub(reach)..(y + reach + 1).min(height))
        .flat_map(move |row| columns.clone().map(move |column| row * width + column))
}

/// Connected parts of the pixels for which `inside` holds; diagonal neighbours are connected.
pub fn parts(size: (usize, usize), inside: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut todo: Vec<bool> = (0..size.0 * size.1).map(inside).collect();
    let mut parts = Vec::new();
    for start in 0..todo.len() {
        if !std::mem::take(&mut todo[start]) {
            continue;
        }
        let mut part = vec![start];
        let mut next = 0;
        while next < part.len() {
            for place in around(part[next], size, 1) {
                if std::mem::take(&mut todo[place]) {
                    part.push(place);
                }
            }
            next += 1;
        }
        parts.push(part);
    }
    parts
}

/// Largest size of a speck or small gap, relative to the subject's largest part.
const SPECK: f32 = 0.005;

/// Removes specks from `inside`, and closes gaps that are small or not background by `is_background`.
pub fn clean(inside: &mut [bool], size: (usize, usize), is_background: impl Fn(usize) -> bool) {
    let found = parts(size, |i| inside[i]);
    let largest = found.iter().map(Vec::len).max().unwrap_or(0);
    let is_speck = |part: &[usize]| (part.len() as f32) < SPECK * largest as f32;
    for place in found.iter().filter(|part| is_speck(part)).flatten() {
        inside[*place] = false;
    }
    let (width, height) = size;
    let at_border = |place: &usize| {
        let (x, y) = (place % width, place / width);
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    };
    for gap in parts(size, |i| !inside[i]) {
        let background = gap.iter().filter(|i| is_background(**i)).count();
        let open = gap.iter().any(at_border);
        if !open && (is_speck(&gap) || 2 * background < gap.len()) {
            for place in gap {
                inside[place] = true;
            }
        }
    }
}

/// Clears soft pixels that touch no part of the `kept` subject.
pub fn drop_loose(alpha: &mut [f32], size: (usize, usize), kept: &[bool]) {
    for part in parts(size, |i| alpha[i] > 0.0) {
        if !part.iter().any(|i| kept[*i]) {
            for place in part {
                alpha[place] = 0.0;
            }
        }
    }
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
