//! OLATs prepared for display.

use compositor::reference::{SOLID, extend_edges, view};
use imaging::{Encoded, Image, Mask, color::luminance};

/// Mean luminance of the subject over a displayed set of OLATs.
const DISPLAY_LEVEL: f32 = 0.12;

/// Gain that brings a set of OLATs to `DISPLAY_LEVEL`.
pub fn display_gain<'a>(olats: impl Iterator<Item = &'a Image>, mask: &Mask) -> f32 {
    let (mut sum, mut count) = (0f64, 0u64);
    for olat in olats {
        let pairs = olat.pixels.iter().zip(&mask.pixels);
        for (pixel, _) in pairs.filter(|&(pixel, &alpha)| alpha > SOLID && luminance(*pixel).is_finite()) {
            sum += f64::from(luminance(*pixel));
            count += 1;
        }
    }
    let level = (sum / count.max(1) as f64) as f32;
    DISPLAY_LEVEL / level.max(f32::MIN_POSITIVE)
}

/// An OLAT over black as sRGB codes.
pub fn display_picture(olat: &Image, mask: &Mask, gain: f32) -> Encoded {
    let mut tile = olat.clone();
    extend_edges(&mut tile, mask);
    for (pixel, &alpha) in tile.pixels.iter_mut().zip(&mask.pixels) {
        *pixel = pixel.map(|v| v * gain * alpha);
    }
    view(&tile)
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;
    use imaging::color::srgb_from_linear;

    #[test]
    fn a_set_has_one_exposure_and_its_edges_no_fringe() {
        // The picture is dark at the matte's edge, as a network leaves it.
        let mask: Mask = Raster::from_fn(4, 1, |x, _| [1.0, 1.0, 0.5, 0.0][x]);
        let olat = |level: f32| Raster::from_fn(4, 1, |x, _| [[level, level, 0.0, 9.0][x]; 3]);
        let olats = [olat(0.1), olat(0.3), olat(f32::NAN)];
        let gain = display_gain(olats.iter(), &mask);
        assert!((gain - DISPLAY_LEVEL / 0.2).abs() < 1e-5, "{gain}");
        let codes = display_picture(&olats[1], &mask, gain).0;
        let near = |x: usize, linear: f32| (codes.at(x, 0)[0] - srgb_from_linear(linear)).abs() < 1e-4;
        assert!(near(0, 0.18) && near(2, 0.09) && near(3, 0.0), "{codes:?}");
        assert_eq!(display_picture(&olat(0.0), &mask, display_gain([].iter(), &mask)).0.at(0, 0), [0.0; 3]);
    }
}
