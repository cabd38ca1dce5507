//! Turns between poses, which say how far turns by depth fall short.

use crate::turn::{turn_vector, vector_turn};
use glam::{Mat3, Vec3};

/// Squared radians of turns between poses at which their word on turns by depth counts half.
const HALF: f32 = 0.05;
/// Bounds of the factor on turns by depth.
const FACTOR: [f32; 2] = [0.5, 3.0];

/// The turn of the head between two poses, as rotation vectors.
#[derive(Clone, Copy, Debug)]
pub struct PoseTurn {
    /// Numbers of the poses.
    pub from: usize,
    pub to: usize,
    /// By depth and matched places, as turns of frames are found.
    pub by_depth: Vec3,
    /// By the normals of both.
    pub by_normals: Vec3,
}

/// The turns between all poses.
#[derive(Clone, Debug, Default)]
pub struct PoseTurns(pub Vec<PoseTurn>);

impl PoseTurns {
    /// The same without one pose.
    pub fn leave_out(&mut self, pose: usize) {
        self.0.retain(|turn| turn.from != pose && turn.to != pose);
    }

    /// A turn by depth, as far as normals say.
    pub fn scaled(&self, by_depth: &Mat3) -> Mat3 {
        vector_turn(self.factor() * turn_vector(by_depth))
    }

    /// Least squares of turns by normals over turns by depth, drawn towards 1.
    fn factor(&self) -> f32 {
        let sum = |term: fn(&PoseTurn) -> f32| self.0.iter().map(term).sum::<f32>();
        let agreement = sum(|turn| turn.by_normals.dot(turn.by_depth));
        let all = sum(|turn| turn.by_depth.length_squared());
        ((HALF + agreement) / (HALF + all)).clamp(FACTOR[0], FACTOR[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three poses whose turns by depth are `depth` times those by normals.
    fn turns(depth: f32) -> PoseTurns {
        let stands = [Vec3::ZERO, Vec3::Y * 0.6, Vec3::new(-0.5, 0.2, 0.1)];
        let pairs = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];
        PoseTurns(
            pairs
                .map(|(from, to)| PoseTurn {
                    from,
                    to,
                    by_depth: depth * (stands[to] - stands[from]),
                    by_normals: stands[to] - stands[from],
                })
                .to_vec(),
        )
    }

    #[test]
    fn turns_that_fall_short_are_scaled_as_far_as_normals_say() {
        let turn = Mat3::from_rotation_y(0.1);
        for (depth, angle) in [(0.5, 0.2), (1.0, 0.1), (0.05, 0.3), (-2.0, 0.05)] {
            let found = turn_vector(&turns(depth).scaled(&turn)).y;
            assert!((found - angle).abs() < 0.015, "{depth}: {found}");
        }
    }

    #[test]
    fn poses_alone_leave_turns_as_they_are() {
        let turn = Mat3::from_rotation_y(0.2);
        let mut turns = turns(0.5);
        turns.leave_out(1);
        assert_eq!(turns.0.len(), 2);
        turns.leave_out(2);
        assert!(turns.scaled(&turn).abs_diff_eq(turn, 1e-6));
        assert!(turns.scaled(&Mat3::IDENTITY).abs_diff_eq(Mat3::IDENTITY, 1e-6));
    }
}
