//! The camera: rays through pixels, and the sensor.

use super::jpeg::through_jpeg;
use super::trouble::Trouble;
use base::Result;
use chacha20::ChaCha8Rng;
use glam::Vec3;
use imaging::{DualGamma, Encoded, Image, Raster, Response};
use rand::{RngExt, SeedableRng};

/// Position of the camera.
pub const POSITION: Vec3 = Vec3::new(0.0, 0.0, 4.0);
/// Height of the camera's view at the subject, in metres.
pub const FRAME_HEIGHT_M: f32 = 0.44;

/// Unit direction from the camera through (`x`, `y`), in pixels from the top left corner of a picture with these
/// columns and rows, which shows `height_m` metres from top to bottom at the subject.
pub fn ray(x: f32, y: f32, (width, height): (usize, usize), height_m: f32) -> Vec3 {
    let (width, height) = (width as f32, height as f32);
    let across = (x / height - 0.5 * (width / height)) * height_m;
    let up = (0.5 - y / height) * height_m;
    (Vec3::new(across, up, 0.0) - POSITION).normalize()
}

/// Vertical field of view in degrees.
pub fn field_of_view_deg() -> f64 {
    2.0 * (0.5 * f64::from(FRAME_HEIGHT_M) / f64::from(POSITION.z)).atan().to_degrees()
}

/// A camera's sensor: noise, response and eight bits.
pub struct Sensor {
    pub response: Response,
    /// Smallest linear value of every code except 0.
    thresholds: Vec<f32>,
    seed: u64,
    /// Factor on the standard noise.
    noise: f32,
    jpeg: Option<u8>,
}

impl Sensor {
    /// A sensor with the given response, or one drawn from the seed within the range of consumer cameras.
    pub fn new(seed: u64, trouble: &Trouble) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7365_6e73_6f72);
        let response = trouble.response.unwrap_or_else(|| {
            let usual = DualGamma { gamma1: random.random_range(2.3..2.8), gamma2: random.random_range(1.9..2.3) };
            usual.into()
        });
        let thresholds = (1..=255).map(|code| response.decode_value((code as f32 - 0.5) / 255.0)).collect();
        Self { response, thresholds, seed, noise: trouble.noise, jpeg: trouble.jpeg }
    }

    /// The 8-bit photograph of linear light. The noise (by default σ = 0.003·√L + 5·10⁻⁵) depends only on the seed and
    /// on `name`, so the order of the pictures does not matter.
    ///
    /// # Errors
    /// When JPEG encoding fails, which never happens on the stage.
    pub fn photograph(&self, light: &Image, name: &str) -> Result<Encoded> {
        let picture = self.expose(light, name);
        match self.jpeg {
            Some(quality) => through_jpeg(&picture, quality),
            None => Ok(picture),
        }
    }

    fn expose(&self, light: &Image, name: &str) -> Encoded {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ base::Fnv::from_bytes(name.as_bytes()).0);
        let mut spare = None;
        Encoded(light.map(|pixel| {
            pixel.map(|level| {
                let level = level.max(0.0);
                let deviation = (0.003 * level.sqrt() + 5e-5) * self.noise;
                let noisy = level + deviation * gaussian(&mut random, &mut spare);
                self.thresholds.partition_point(|&least| least <= noisy) as f32 / 255.0
            })
        }))
    }
}

/// The green cloth behind the interview, evenly lit, slightly darker towards the corners.
pub fn green_screen((width, height): (usize, usize)) -> Image {
    let middle = [width, height].map(|side| side as f32 * 0.5);
    Raster::from_fn(width, height, |x, y| {
        let [x, y] = [x as f32 + 0.5 - middle[0], y as f32 + 0.5 - middle[1]];
        let off = (x.hypot(y) / middle[1]).powi(2);
        [0.035, 0.250, 0.060].map(|c: f32| c * (1.0 - 0.07 * off))
    })
}

/// A normal variate (Box and Muller 1958), which come in pairs.
fn gaussian(random: &mut ChaCha8Rng, spare: &mut Option<f32>) -> f32 {
    if let Some(value) = spare.take() {
        return value;
    }
    let (a, b): (f32, f32) = (random.random(), random.random());
    let radius = (-2.0 * (1.0 - a).max(f32::MIN_POSITIVE).ln()).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * b).sin_cos();
    *spare = Some(radius * sin);
    radius * cos
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photograph_is_the_encoded_light_to_rounding_and_noise() {
        let sensor = Sensor::new(5, &Trouble::default());
        let light = Raster::filled(64, 64, [0.3, 0.02, 0.0]);
        let taken = sensor.photograph(&light, "a").unwrap();
        let decoded = sensor.response.nearest_dual_gamma().0.decode(&taken);
        for channel in 0..3 {
            let mean = decoded.pixels.iter().map(|p| p[channel]).sum::<f32>() / 4096.0;
            assert!((mean - light.pixels[0][channel]).abs() < 5e-4, "channel {channel}: {mean}");
        }
        assert_eq!(taken, sensor.photograph(&light, "a").unwrap());
        assert_ne!(taken, sensor.photograph(&light, "b").unwrap());
    }

    #[test]
    fn rounding_is_that_of_the_exact_encoding() {
        let sensor = Sensor::new(1, &Trouble::default());
        let response = sensor.response.nearest_dual_gamma().0;
        for i in 0..2000 {
            let level = (i as f32 / 2000.0).powi(3);
            let code = sensor.thresholds.partition_point(|&least| least <= level) as f32;
            assert!((code - 255.0 * response.encode_value(level)).abs() < 0.501, "{level}");
        }
    }
}
