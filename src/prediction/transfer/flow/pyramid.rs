//! Pictures at several sizes, and beyond their borders.

use imaging::Raster;

/// Pixels by which pictures are continued beyond their borders, for patches there.
pub const BORDER: usize = super::vector::PATCH;

/// A picture and its halvings, whose values are scaled each time.
pub fn pyramid(picture: Raster<f32>, halvings: usize, scale: f32) -> Vec<Raster<f32>> {
    let halved = |picture: &Raster<f32>| {
        let (width, height) = (picture.width / 2, picture.height / 2);
        let mut pixels = Vec::with_capacity(width * height);
        for rows in picture.pixels.chunks_exact(2 * picture.width) {
            let (a, b) = rows.split_at(picture.width);
            let pairs = a.chunks_exact(2).zip(b.chunks_exact(2));
            pixels.extend(pairs.map(|(a, b)| 0.25 * scale * (a[0] + a[1] + b[0] + b[1])));
        }
        Raster { width, height, pixels }
    };
    std::iter::successors(Some(picture), |p| Some(halved(p))).take(halvings + 1).collect()
}

/// Offsets of a picture's halving at the picture's own size, linear between pixels.
pub fn doubled(plane: &Raster<f32>, (width, height): (usize, usize)) -> Raster<f32> {
    let beside = |i: usize, length: usize| {
        let near = (i / 2).min(length - 1);
        let far = if i.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(length - 1) };
        (near, far)
    };
    let columns: Vec<_> = (0..width).map(|x| beside(x, plane.width)).collect();
    let mut row = vec![0.0; plane.width];
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let (near, far) = beside(y, plane.height);
        let [near, far] = [near, far].map(|y| &plane.pixels[y * plane.width..][..plane.width]);
        for ((row, near), far) in row.iter_mut().zip(near).zip(far) {
            *row = 1.5 * near + 0.5 * far;
        }
        pixels.extend(columns.iter().map(|&(near, far)| 0.75 * row[near] + 0.25 * row[far]));
    }
    Raster { width, height, pixels }
}

/// A picture continued by its outermost pixels, [`BORDER`] of them on each side.
pub fn continued(picture: &Raster<f32>) -> Raster<f32> {
    let (width, height) = (picture.width + 2 * BORDER, picture.height + 2 * BORDER);
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let y = y.saturating_sub(BORDER).min(picture.height - 1);
        let row = &picture.pixels[y * picture.width..][..picture.width];
        pixels.extend(std::iter::repeat_n(row[0], BORDER));
        pixels.extend_from_slice(row);
        pixels.extend(std::iter::repeat_n(row[row.len() - 1], BORDER));
    }
    Raster { width, height, pixels }
}
