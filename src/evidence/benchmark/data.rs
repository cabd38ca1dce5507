//! Made-up data: a rig, a subject before a plate, a field of noise.

use super::LAMPS;
use footage::Frame;
use glam::Vec3;
use imaging::{Image, Mask};
use light::{Lamp, Rig};
use rayon::prelude::*;
use reflectance::ReflectanceField;

/// Repeatable pseudo-random number between 0 and 1 for index `i`.
fn noise(i: usize) -> f32 {
    (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0
}

/// A field of noise.
pub fn field(size: usize, lamps: usize) -> ReflectanceField {
    ReflectanceField {
        width: size,
        height: size,
        lamps,
        values: (0..lamps * 3 * size * size).into_par_iter().map(noise).collect(),
    }
}

/// A round subject with a soft edge.
pub fn matte(size: usize) -> Mask {
    Mask::from_fn(size, size, |x, y| (40.0 * (0.7 - from_centre(size, x, y))).clamp(0.0, 1.0))
}

/// Distance of a pixel from the picture's centre, in half widths.
pub fn from_centre(size: usize, x: usize, y: usize) -> f32 {
    let centre = size as f32 / 2.0;
    let [x, y] = [x, y].map(|v| v as f32 + 0.5 - centre);
    x.hypot(y) / centre
}

/// A subject in flat light, with texture.
pub fn plate(size: usize) -> Image {
    Image::from_fn(size, size, |x, y| [0.45, 0.32, 0.25].map(|v| v * (0.8 + 0.4 * noise(y * size + x))))
}

/// The same as a frame.
pub fn frame(size: usize) -> Frame {
    Frame { index: 0, plate: plate(size), mask: matte(size) }
}

/// Lamps spread evenly over the sphere: a Fibonacci spiral (González 2010).
pub fn rig() -> Rig {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let lamp = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f32 / LAMPS as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let around = (1.0 - y * y).sqrt();
        Lamp::new(format!("olat_{i:02}"), Vec3::new(around * cos, y, around * sin))
    };
    Rig { lamps: (0..LAMPS).map(lamp).collect() }
}
