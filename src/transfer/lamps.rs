//! Lamps that turn with the head: the lamps of a pose near each lamp of a frame.

use glam::{Mat3, Vec3};
use light::{Lamp, Rig};

/// Width in degrees of the blend between neighbouring lamps, and between the nearest lamps of poses.
const ANGLE: f32 = 8.0;
/// Share of the largest weight below which a lamp is left out.
const NEGLIGIBLE: f32 = 1e-3;
/// Added to cosines, which bounds the ratio of two shadings to 1 : 11.
const SHADE: f32 = 0.1;

/// The lamps of a rig as transfer sees them.
#[derive(Clone, Debug)]
pub struct Lamps {
    /// Unit directions; None of a lamp that no ball shows.
    pub directions: Vec<Option<Vec3>>,
    /// Energy per channel; 1 of a lamp that no ball shows.
    pub energies: Vec<[f32; 3]>,
}

/// A lamp of the frame as a blend of a pose's lamps.
#[derive(Clone, Debug)]
pub struct LampBlend {
    /// Direction in the pose's own frame; None of a lamp that no ball shows.
    pub direction: Option<Vec3>,
    /// Lamps of the pose and their weights, which sum to 1.
    pub weights: Vec<(usize, f32)>,
    /// Angle in degrees to the nearest of them.
    pub nearest: f32,
}

impl Lamps {
    /// Directions and energies of a rig.
    pub fn new(rig: &Rig) -> Self {
        let energy = |lamp: &Lamp| {
            if lamp.is_usable() {
                lamp.energy
            } else {
                [1.0; 3]
            }
        };
        Self {
            directions: rig
                .lamps
                .iter()
                .map(|lamp| lamp.is_usable().then_some(lamp.direction))
                .collect(),
            energies: rig.lamps.iter().map(energy).collect(),
        }
    }

    /// Number of lamps.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// A blend for each lamp of a frame whose head is turned by `turn` from the pose's. Weights fall with the angle beyond the
    /// nearest lamp's. A lamp that no ball shows stands for itself alone.
    pub fn blends(&self, turn: &Mat3) -> Vec<LampBlend> {
        let back = turn.transpose();
        let blend = |(lamp, direction): (usize, &Option<Vec3>)| {
            let direction = direction.map(|direction| back * direction);
            let Some(toward) = direction else {
                return LampBlend {
                    direction,
                    weights: vec![(lamp, 1.0)],
                    nearest: 0.0,
                };
            };
            let angles: Vec<(usize, f32)> = (self.directions.iter().enumerate())
                .filter_map(|(m, direction)| {
                    Some((
                        m,
                        (*direction)?
                            .dot(toward)
                            .clamp(-1.0, 1.0)
                            .acos()
                            .to_degrees(),
                    ))
                })
                .collect();
            let nearest = angles
                .iter()
                .map(|(_, angle)| *angle)
                .fold(f32::INFINITY, f32::min);
            let mut weights: Vec<(usize, f32)> = (angles.into_iter())
                .map(|(m, angle)| (m, falloff(angle, nearest)))
                .filter(|(_, weight)| *weight > NEGLIGIBLE)
                .collect();
            let sum: f32 = weights.iter().map(|(_, weight)| weight).sum();
            weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
            LampBlend {
                direction,
                weights,
                nearest,
            }
        };
        self.directions.iter().enumerate().map(blend).collect()
    }
}

/// Weight of an angle beyond the nearest, in degrees: 1 at the nearest.
pub fn falloff(angle: f32, nearest: f32) -> f32 {
    (-0.5 * (angle.powi(2) - nearest.powi(2)) / ANGLE.powi(2)).exp()
}

/// Lambertian shading of a surface, with a share of ambient light that keeps it above 0; 1 for a lamp without direction.
pub fn shading(normal: Vec3, direction: Option<Vec3>) -> f32 {
    direction.map_or(1.0, |direction| normal.dot(direction).max(0.0) + SHADE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lamps around the vertical, 30° apart.
    fn rig() -> Rig {
        let lamp = |i: usize| Lamp {
            name: format!("olat_{i:02}"),
            direction: Mat3::from_rotation_y((30.0 * i as f32).to_radians()) * Vec3::Z,
            energy: [1.0 + i as f32; 3],
            spread_deg: 5.0,
            confidence: 1.0,
            clipped: 0.0,
        };
        Rig {
            lamps: (0..12).map(lamp).collect(),
        }
    }

    #[test]
    fn lamps_stand_for_themselves_in_a_pose_like_the_frame() {
        for (l, blend) in Lamps::new(&rig())
            .blends(&Mat3::IDENTITY)
            .iter()
            .enumerate()
        {
            let (most, weight) = blend
                .weights
                .iter()
                .copied()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            assert!(
                most == l && weight > 0.99 && blend.nearest < 0.1,
                "{blend:?}"
            );
        }
    }

    #[test]
    fn lamps_turn_with_the_head() {
        let turn = Mat3::from_rotation_y(30f32.to_radians());
        for (l, blend) in Lamps::new(&rig()).blends(&turn).iter().enumerate() {
            let (most, weight) = blend
                .weights
                .iter()
                .copied()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            assert!(most == (l + 11) % 12 && weight > 0.99, "{l}: {blend:?}");
            let sum: f32 = blend.weights.iter().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_lamp_that_no_ball_shows_stands_for_itself_alone() {
        let mut rig = rig();
        rig.lamps[3].confidence = 0.0;
        for (l, blend) in Lamps::new(&rig)
            .blends(&Mat3::from_rotation_y(0.5))
            .iter()
            .enumerate()
        {
            if l == 3 {
                assert_eq!(blend.weights, [(3, 1.0)]);
            } else {
                assert!(blend.weights.iter().all(|(m, _)| *m != 3));
            }
        }
    }
}
