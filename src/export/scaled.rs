//! A picture at another size, resized in linear light.

use compositor::Picture;
use imaging::Encoded;
use imaging::color::{linear_from_srgb, srgb_from_linear};
use imaging::resample::resize;

/// The picture with `size × size` pixels. Scene-linear light and coverage are averaged (or interpolated) as
/// they are, codes of a display as the light that it would show: so grain, dither and what is brighter than
/// white average as they would look from afar.
pub fn scaled(picture: &Picture, size: usize) -> Picture {
    let display = picture.display.as_ref().map(|codes| {
        let light = codes.0.map(|pixel| pixel.map(linear_from_srgb));
        Encoded(resize(&light, size, size).map(|pixel| pixel.map(srgb_from_linear)))
    });
    Picture {
        linear: (picture.linear.as_ref()).map(|linear| resize(linear, size, size)),
        alpha: resize(&picture.alpha, size, size),
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
        let small = scaled(&sharp, 4);
        assert_eq!(small.linear.as_ref().unwrap().pixels, [[0.5; 3]; 16]);
        let grey = srgb_from_linear(0.5);
        let codes = small.display.unwrap().0;
        assert!(
            codes
                .pixels
                .iter()
                .flatten()
                .all(|c| (c - grey).abs() < 1e-6)
        );
    }

    #[test]
    fn straight_colour_stays_where_coverage_is_resized() {
        // Red of one brightness under a coverage that falls from left to right.
        let shown = scaled(&picture(16, 16, [0.5, 0.0, 0.0], false), 6);
        assert_eq!(shown.alpha.size(), (6, 6));
        for (light, alpha) in shown.linear.unwrap().pixels.iter().zip(&shown.alpha.pixels) {
            assert!((light[0] - 0.5 * alpha).abs() < 1e-6);
        }
    }
}
