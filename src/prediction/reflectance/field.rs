//! A reflectance field: one frame under each single lamp.

use imaging::Image;

/// One frame under each lamp, linear, in the OLAT session's units. Stored planar in the network's
/// order: `values[((lamp · 3 + channel) · height + y) · width + x]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ReflectanceField {
    pub width: usize,
    pub height: usize,
    /// Number of lamps.
    pub lamps: usize,
    /// `lamps · 3 · height · width` values.
    pub values: Vec<f32>,
}

impl ReflectanceField {
    /// One channel of one lamp, row by row.
    pub fn plane(&self, lamp: usize, channel: usize) -> &[f32] {
        let plane = self.width * self.height;
        let start = (lamp * 3 + channel) * plane;
        &self.values[start..start + plane]
    }

    /// The picture under one lamp.
    pub fn olat(&self, lamp: usize) -> Image {
        let [r, g, b] = [0, 1, 2].map(|c| self.plane(lamp, c));
        let pixels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// A field from existing pictures, such as an exemplar's. All have the same size.
    pub fn from_olats(olats: &[Image]) -> Self {
        let (width, height) = olats.first().map_or((0, 0), Image::size);
        let mut values = Vec::with_capacity(olats.len() * 3 * width * height);
        for olat in olats {
            for channel in 0..3 {
                values.extend(olat.pixels.iter().map(|p| p[channel]));
            }
        }
        Self { width, height, lamps: olats.len(), values }
    }
}
