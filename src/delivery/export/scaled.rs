//! A picture at another size, resized in linear light.

use compositor::Picture;
use imaging::Encoded;
use imaging::color::{linear_from_srgb, srgb_from_linear};
use imaging::resample::resize;

/// Columns and rows of a picture of `size` whose longer side is resized to `longest` pixels.
pub fn fitted((width, height): (usize, usize), longest: usize) -> (usize, usize) {
    let along = |side: usize| {
        let scaled = side as f64 * longest as f64 / width.max(height).max(1) as f64;
        (scaled.round() as usize).max(1)
    };
    (along(width), along(height))
}

/// Picture resized to these columns and rows. Scene-linear light and coverage are averaged (or interpolated)
/// directly, display codes as the light that they show: grain, dither and highlights above
/// white average as seen from a distance.
pub fn scaled(picture: &Picture, (width, height): (usize, usize)) -> Picture {
    let display = picture.display.as_ref().map(|codes| {
        let light = codes.0.map(|pixel| pixel.map(linear_from_srgb));
        Encoded(resize(&light, width, height).map(|pixel| pixel.map(srgb_from_linear)))
    });
    Picture {
        linear: (picture.linear.as_ref()).map(|linear| resize(linear, width, height)),
        alpha: resize(&picture.alpha, width, height),
        display,
        ..picture.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::still::tests::picture;
    use super::*;
    use imaging::Raster;

    #[test]
    fn light_is_averaged_and_not_codes() {
        let checks = |x: usize, y: usize| [((x + y) % 2) as f32; 3];
        let sharp = Picture {
            linear: Some(Raster::from_fn(8, 8, checks)),
            display: Some(Encoded(Raster::from_fn(8, 8, checks))),
            ..picture(8, 8, [0.0; 3], true)
        };
        let small = scaled(&sharp, (4, 4));
        assert_eq!(small.linear.as_ref().unwrap().pixels, [[0.5; 3]; 16]);
        let grey = srgb_from_linear(0.5);
        let codes = small.display.unwrap().0;
        assert!(codes.pixels.iter().flatten().all(|c| (c - grey).abs() < 1e-6));
    }

    #[test]
    fn the_longer_side_is_what_is_asked_for() {
        assert_eq!(fitted((1080, 1920), 960), (540, 960));
        assert_eq!(fitted((128, 128), 64), (64, 64));
        assert_eq!(fitted((8000, 2), 16), (16, 1));
    }

    #[test]
    fn straight_colour_stays_where_coverage_is_resized() {
        // Red at constant brightness under a coverage that falls from left to right.
        let shown = scaled(&picture(16, 16, [0.5, 0.0, 0.0], false), (6, 6));
        assert_eq!(shown.alpha.size(), (6, 6));
        for (light, alpha) in shown.linear.unwrap().pixels.iter().zip(&shown.alpha.pixels) {
            assert!((light[0] - 0.5 * alpha).abs() < 1e-6);
        }
    }
}
