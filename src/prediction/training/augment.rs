//! Augmentations that keep the lighting correct: shifts, and changes of the camera's distance. A flip or a rotation
//! would move the lamps.

use burn::tensor::{Tensor, ops::PadMode};
use imaging::Raster;

/// A picture enlarged by `factor` about its middle, by bilinear interpolation; new pixels are `outside`.
pub fn zoom<T: Copy>(picture: &Raster<T>, factor: f32, outside: T, mix: impl Fn(T, T, f32) -> T) -> Raster<T> {
    let (w, h) = (picture.width as i64, picture.height as i64);
    let at = |x: i64, y: i64| {
        if (0..w).contains(&x) && (0..h).contains(&y) { picture.at(x as usize, y as usize) } else { outside }
    };
    // Pixel centres lie at halves.
    let source = |i: usize, length: i64| {
        let middle = length as f32 / 2.0;
        (i as f32 + 0.5 - middle) / factor + middle - 0.5
    };
    Raster::from_fn(picture.width, picture.height, |x, y| {
        let (sx, sy) = (source(x, w), source(y, h));
        let (x0, y0) = (sx.floor(), sy.floor());
        let (fx, fy) = (sx - x0, sy - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let row = |y| mix(at(x0, y), at(x0 + 1, y), fx);
        mix(row(y0), row(y0 + 1), fy)
    })
}

/// Moves pictures `[n, c, h, w]` by `dx` columns to the right and `dy` rows down; new pixels are 0.
pub fn shift(x: Tensor<4>, dx: i64, dy: i64) -> Tensor<4> {
    shift_axis(shift_axis(x, 3, dx), 2, dy)
}

fn shift_axis(x: Tensor<4>, axis: usize, by: i64) -> Tensor<4> {
    let length = x.dims()[axis];
    let distance = (by.unsigned_abs() as usize).min(length);
    if distance == 0 {
        return x;
    }
    let mut padding = [(0, 0); 4];
    padding[axis] = if by > 0 { (distance, 0) } else { (0, distance) };
    let padded = x.pad(padding, PadMode::Constant(0.0));
    padded.narrow(axis, if by > 0 { 0 } else { distance }, length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn a_shift_moves_pixels_and_lets_black_in() {
        let x = Tensor::<1>::from_floats([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &Device::flex()).reshape([1, 1, 2, 3]);
        let values = |x: Tensor<4>| x.into_data().try_to_vec::<f32>().unwrap();
        assert_eq!(values(shift(x.clone(), 1, 0)), [0.0, 1.0, 2.0, 0.0, 4.0, 5.0]);
        assert_eq!(values(shift(x.clone(), -1, 1)), [0.0, 0.0, 0.0, 2.0, 3.0, 0.0]);
        assert_eq!(values(shift(x, 9, 0)), [0.0; 6]);
    }
}
