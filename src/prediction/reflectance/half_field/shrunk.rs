//! Fields with fewer pixels, for quick previews.

use super::{HalfField, TILE, widen};
use half::f16;
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};
use imaging::Mask;
use rayon::prelude::*;

impl HalfField {
    /// The field and its matte (of the same size) with one pixel for each block of `factor` × `factor`
    /// pixels, or for a partial block at the right and at the bottom. Coverage is the mean. Light is the mean
    /// weighted by coverage, so that the subject times its coverage is the mean of the original. Pixels without
    /// coverage are black.
    pub fn shrunk(&self, mask: &Mask, factor: usize) -> (Self, Mask) {
        let [width, height] = [self.width, self.height].map(|n| n.div_ceil(factor));
        let block = |x: usize, y: usize| {
            let rows = (y * factor)..((y + 1) * factor).min(self.height);
            let columns = (x * factor)..((x + 1) * factor).min(self.width);
            rows.flat_map(move |y| columns.clone().map(move |x| y * self.width + x))
        };
        let coverage = Mask::from_fn(width, height, |x, y| {
            let pixels = block(x, y).map(|pixel| mask.pixels[pixel]);
            pixels.clone().sum::<f32>() / pixels.count() as f32
        });
        let planes = 3 * self.lamps;
        let pixels = width * height;
        let mut values = vec![0u16; pixels.div_ceil(TILE) * planes * TILE];
        let mean = |(tile, values): (usize, &mut [u16])| {
            let of_tile = (tile * TILE)..pixels.min((tile + 1) * TILE);
            // Sources of each pixel: a tile, a place in it and a share.
            let mut parts = Vec::with_capacity(TILE * factor * factor);
            let ends: Vec<usize> = of_tile
                .map(|pixel| {
                    let block = block(pixel % width, pixel / width);
                    let covered: f32 = block.clone().map(|pixel| mask.pixels[pixel]).sum();
                    let block = block.filter(|&pixel| mask.pixels[pixel] > 0.0);
                    parts.extend(
                        block.map(|pixel| (self.tile(pixel / TILE), pixel % TILE, mask.pixels[pixel] / covered)),
                    );
                    parts.len()
                })
                .collect();
            let mut means = [0f32; TILE];
            for (plane, values) in values.chunks_mut(TILE).enumerate() {
                let mut start = 0;
                for (mean, &end) in means.iter_mut().zip(&ends) {
                    let parts = parts[start..end].iter();
                    *mean = parts.map(|(tile, place, share)| share * widen(tile[plane][*place])).sum();
                    start = end;
                }
                values.reinterpret_cast_mut::<f16>().convert_from_f32_slice(&means);
            }
        };
        // A mean is no larger than the maximum, so the scale still fits.
        values.par_chunks_mut((planes * TILE).max(1)).enumerate().for_each(mean);
        let small = Self { width, height, lamps: self.lamps, scale: self.scale, values };
        (small, coverage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReflectanceField;
    use imaging::Image;
    use imaging::resample::resize_area;

    #[test]
    fn the_subject_times_its_coverage_is_the_mean_of_what_it_was() {
        let (width, height) = (96, 40);
        let mask =
            Mask::from_fn(width, height, |x, y| (20.0 - (x as f32 - 40.0).hypot(y as f32 - 18.0)).clamp(0.0, 1.0));
        let olat = |lamp: usize| {
            Image::from_fn(width, height, |x, y| {
                let at = (x * 7 + y * 3 + lamp * 5) as f32;
                // Pixels outside the matte are invisible.
                let light = if mask.at(x, y) > 0.0 { 1.0 } else { f32::NAN };
                [at.sin().abs(), at.cos().abs(), 0.1 + at / 2000.0].map(|v| v * light)
            })
        };
        let olats: Vec<Image> = (0..3).map(olat).collect();
        let field = HalfField::from(&ReflectanceField::from_olats(&olats));
        for factor in [2, 4] {
            let (small, coverage) = field.shrunk(&mask, factor);
            assert_eq!(coverage.size(), (width / factor, height / factor));
            let wanted = resize_area(&mask, coverage.width, coverage.height);
            let pairs = coverage.pixels.iter().zip(&wanted.pixels);
            assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-6));
            let light = small.widened();
            for (lamp, olat) in olats.iter().enumerate() {
                let mut lit = olat.clone();
                for (pixel, &alpha) in lit.pixels.iter_mut().zip(&mask.pixels) {
                    *pixel = pixel.map(|v| if alpha > 0.0 { v * alpha } else { 0.0 });
                }
                let wanted = resize_area(&lit, coverage.width, coverage.height);
                for (i, wanted) in wanted.pixels.iter().enumerate() {
                    for (c, wanted) in wanted.iter().enumerate() {
                        let found = light.plane(lamp, c)[i] * coverage.pixels[i];
                        // Two roundings to eleven bits, of light no brighter than 1.
                        assert!((found - wanted).abs() < 1e-3, "{found} {wanted}");
                    }
                }
            }
        }
        let (odd, coverage) = field.shrunk(&mask, 7);
        assert_eq!((odd.width, odd.height), (14, 6));
        assert_eq!(coverage.size(), (14, 6));
    }
}
