//! Pass `difference`: how far the codes are from those of a second picture.

use base::error::{Error, Result};
use imaging::{Encoded, color::unit};
use rayon::prelude::*;

/// Replaces codes by the magnitude of their difference to `second`, times `gain`, up to 1. A gain that
/// is no number shows black.
///
/// # Errors
/// When the pictures differ in size.
pub fn difference(codes: &mut Encoded, second: &Encoded, gain: f32) -> Result<()> {
    check_size(codes.0.size(), second)?;
    let pairs = codes.0.pixels.par_iter_mut().zip(&second.0.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, other)| {
        *pixel = std::array::from_fn(|c| unit(gain * (pixel[c] - other[c]).abs()));
    });
    Ok(())
}

/// Refuses a second picture of another size than the first.
pub(super) fn check_size((width, height): (usize, usize), second: &Encoded) -> Result<()> {
    let found = second.0.size();
    if (width, height) == found {
        return Ok(());
    }
    Err(Error::invalid(
        format!(
            "the second picture has {} × {} pixels, but the first has {width} × {height}",
            found.0, found.1
        ),
        "Compare pictures of one size",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    #[test]
    fn equal_pictures_are_black_and_either_sign_is_bright() {
        let shown = |a: f32, b: f32, gain: f32| {
            let mut codes = Encoded(Image::filled(3, 2, [a; 3]));
            let second = Encoded(Image::filled(3, 2, [b; 3]));
            difference(&mut codes, &second, gain).unwrap();
            codes.0.pixels[5][2]
        };
        assert_eq!(shown(0.3, 0.3, 100.0), 0.0);
        assert_eq!(shown(0.5, 0.25, 2.0), 0.5);
        assert_eq!(shown(0.25, 0.5, 2.0), 0.5);
        assert_eq!(shown(0.0, 1.0, 1e6), 1.0);
        assert_eq!(shown(0.0, 1.0, f32::NAN), 0.0);
        assert_eq!(shown(f32::NAN, 1.0, 1.0), 0.0);
    }

    #[test]
    fn pictures_of_two_sizes_are_refused() {
        let mut codes = Encoded(Image::filled(3, 2, [0.0; 3]));
        let second = Encoded(Image::filled(2, 3, [0.0; 3]));
        let error = difference(&mut codes, &second, 1.0).unwrap_err();
        assert!(error.to_string().contains("3 × 2"), "{error}");
    }
}
