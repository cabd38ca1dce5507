//! The mirror ball's geometry in its photograph, and the light on it.

use super::camera;
use glam::Vec3;

/// Radius of the ball in metres.
pub const BALL_RADIUS_M: f32 = 0.075;
/// Width of the photograph as a multiple of the ball's radius.
const FRAME_PER_RADIUS: f32 = 2.2;

/// Radius of the ball's outline in a photograph of `size` pixels.
pub fn ball_radius_px(size: usize) -> f64 {
    size as f64 / f64::from(FRAME_PER_RADIUS)
}

/// Light on the ball in one photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct BallLight {
    /// Radiance per bank and channel.
    pub banks: Vec<[f32; 3]>,
    /// Factor on the interview's light from outside the banks; 0 for banks only.
    pub interview: f32,
}

impl BallLight {
    /// This light with everything multiplied by `factor`.
    pub fn times(mut self, factor: f32) -> Self {
        let levels = self.banks.iter_mut().flatten();
        levels.chain([&mut self.interview]).for_each(|v| *v *= factor);
        self
    }
}

/// Hit of the ray through a place of the photograph on the ball, and its reflected direction.
pub fn reflect(x: f32, y: f32, size: usize) -> Option<(Vec3, Vec3)> {
    // The outline of a ball at finite distance is slightly wider than the ball: the rays are tangents.
    let distance = camera::POSITION.z;
    let outline = BALL_RADIUS_M / (1.0 - (BALL_RADIUS_M / distance).powi(2)).sqrt();
    let ray = camera::ray(x, y, (size, size), FRAME_PER_RADIUS * outline);
    let along = camera::POSITION.dot(ray);
    let inside = along * along - camera::POSITION.length_squared() + BALL_RADIUS_M * BALL_RADIUS_M;
    if inside < 0.0 {
        return None;
    }
    let place = camera::POSITION - ray * (along + inside.sqrt());
    Some((place, ray.reflect(place / BALL_RADIUS_M)))
}
