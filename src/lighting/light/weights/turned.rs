//! Weights of a freely rotated environment, not only about the vertical axis.

use super::super::Environment;
use super::super::latlong::{texel_direction, texel_solid_angle, uv_from_direction};
use super::{LightWeights, Partition, add};
use glam::{DQuat, Quat};

/// Rotation of an environment by yaw, then pitch, then roll, in degrees, as the camera sees the background:
/// positive yaw moves it to the right, pitch up, roll counter-clockwise. Full turns change no bit.
pub fn rotation(yaw_deg: f32, pitch_deg: f32, roll_deg: f32) -> Quat {
    // In degrees full turns are removed exactly; in radians 10⁶ of them would leave an error of 14°.
    let [yaw, pitch, roll] = [yaw_deg, pitch_deg, roll_deg].map(|a| f64::from(a).rem_euclid(360.0).to_radians());
    let turn = DQuat::from_rotation_z(roll) * DQuat::from_rotation_x(pitch) * DQuat::from_rotation_y(-yaw);
    turn.as_quat()
}

impl Partition {
    /// Weights of an environment rotated by `rotation`, which maps a direction in the environment to one on the
    /// stage; see [`rotation`]. Energy is kept, and weights change continuously: a texel's light is shared by the
    /// four texels around its new position, and within half a texel of a pole by the pole's full row, so a path
    /// across the pole is continuous too.
    ///
    /// A rotation that is not finite or has length 0 counts as none. An environment that differs in size from the
    /// partition is resized first.
    pub fn turned_weights(&self, environment: &Environment, rotation: Quat) -> LightWeights {
        if environment.radiance.size() != (self.width, self.height) {
            return self.turned_weights(&environment.reduced(self.width), rotation);
        }
        let rotation =
            if rotation.is_finite() && rotation.length_squared() > 0.0 { rotation.normalize() } else { Quat::IDENTITY };
        let (width, height) = (self.width, self.height);
        let mut energies = vec![[0.0f64; 3]; width * height];
        // Energy for all of the first row, and for all of the last.
        let mut poles = [[0.0f64; 3]; 2];
        for (i, radiance) in environment.radiance.pixels.iter().enumerate() {
            if *radiance == [0.0; 3] {
                continue;
            }
            let solid_angle = texel_solid_angle(i / width, width, height);
            let energy = radiance.map(|v| solid_angle * f64::from(v));
            let direction = rotation * texel_direction(i % width, i / width, width, height);
            let (u, v) = uv_from_direction(direction);
            let x = (f64::from(u) * width as f64 - 0.5).rem_euclid(width as f64);
            let y = f64::from(v) * height as f64 - 0.5;
            let (left, fx) = (x as usize % width, x.fract());
            let right = (left + 1) % width;
            let last = (height - 1) as f64;
            // Within half a texel of a pole, light is shared between the row there and the pole.
            let pole = (-2.0 * y).max(2.0 * (y - last)).clamp(0.0, 1.0);
            add(&mut poles[usize::from(y > 0.0)], pole, &energy);
            let y = y.clamp(0.0, last);
            let (top, fy) = (y as usize, y.fract());
            for (row, share) in [(top, 1.0 - fy), ((top + 1).min(height - 1), fy)] {
                let share = share * (1.0 - pole);
                add(&mut energies[row * width + left], share * (1.0 - fx), &energy);
                add(&mut energies[row * width + right], share * fx, &energy);
            }
        }
        for (pole, row) in poles.iter().zip([0, height - 1]) {
            for energy in &mut energies[row * width..(row + 1) * width] {
                add(energy, 1.0 / width as f64, pole);
            }
        }
        self.division.weights(&self.gather(|y, row| {
            row.copy_from_slice(&energies[y * width..(y + 1) * width]);
        }))
    }
}
