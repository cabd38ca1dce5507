//! Light of one pixel under every lamp.

use super::field::Field;
use reflectance::half_field::{TILE, widen};

impl Field {
    /// Light of the pixel in column `x` and row `y` under each lamp at full power; None outside the
    /// picture, or if a GPU fails. Waits for a field on a GPU: do not call it on the window's thread.
    pub fn texel(&self, x: usize, y: usize) -> Option<Vec<[f32; 3]>> {
        let (width, height) = self.size();
        if x >= width || y >= height {
            return None;
        }
        let pixel = y * width + x;
        let values = |light: &dyn Fn(usize, usize) -> f32| {
            let lamps = 0..self.lamps();
            let lamps = lamps.map(|lamp| std::array::from_fn(|channel| light(lamp, channel)));
            Some(lamps.collect())
        };
        match self {
            Self::Memory(field) => values(&|lamp, channel| field.plane(lamp, channel)[pixel]),
            Self::Half(field) => {
                let tile = field.tile(pixel / TILE);
                values(&|lamp, channel| widen(tile[channel * field.lamps + lamp][pixel % TILE]) * field.scale())
            }
            Self::Compressed(field) => {
                let mut light = vec![[0.0; 3]; field.lamps];
                for (component, basis) in field.basis.iter().enumerate() {
                    let value = field.plane(component)[pixel];
                    for (light, basis) in light.iter_mut().zip(basis.as_chunks::<3>().0) {
                        for channel in 0..3 {
                            light[channel] += basis[channel] * value;
                        }
                    }
                }
                Some(light)
            }
            Self::Gpu(field, passes) => passes.guarded(|| passes.begin().texel(field, pixel)).ok(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::PicturePasses;
    use crate::passes::relight::tests::any_device;
    use imaging::{Image, Raster};
    use reflectance::{CompressedField, FieldBuffer, HalfField, ReflectanceField};
    use std::sync::Arc;

    #[test]
    fn every_kind_of_field_has_the_same_texels() {
        let olats: Vec<Image> = (0..5)
            .map(|lamp| {
                Raster::from_fn(13, 11, |x, y| {
                    let at = (x * 7 + y * 3 + lamp * 5) as f32;
                    [at.sin().abs(), at.cos().abs(), 0.1 + at / 200.0]
                })
            })
            .collect();
        let field = ReflectanceField::from_olats(&olats);
        let mut fields = vec![
            Field::from(field.clone()),
            Field::from(field.clone()).halved(),
            Field::from(CompressedField::new(&field, 0.0)),
        ];
        if let Some((device, queue)) = any_device() {
            let passes = Arc::new(PicturePasses::new(&device, &queue));
            let compressed = CompressedField::new(&field, 0.0);
            let buffers = [
                FieldBuffer::upload(&field, &device),
                FieldBuffer::upload_half(&HalfField::from(&field), &device),
                FieldBuffer::upload_components(compressed, &device),
            ];
            fields.extend(buffers.map(|buffer| Field::Gpu(buffer, passes.clone())));
        }
        for (x, y) in [(0, 0), (12, 10), (5, 7)] {
            for field in &fields {
                let texel = field.texel(x, y).unwrap();
                for (lamp, light) in texel.iter().enumerate() {
                    for (light, wanted) in light.iter().zip(olats[lamp].pixels[y * 13 + x]) {
                        assert!((light - wanted).abs() < 1e-3, "{light} {wanted}");
                    }
                }
            }
        }
        for field in &fields {
            assert!(field.texel(13, 0).is_none() && field.texel(0, 11).is_none());
        }
    }
}
