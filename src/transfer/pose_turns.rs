//! One turn of the head for a frame, agreed upon by all poses.

use crate::turn::{turn_vector, vector_turn};
use glam::{Mat3, Vec3};
use std::collections::BTreeMap;

/// How strongly turns by depth are taken as they are, in squared radians of turns between poses.
const AS_THEY_ARE: f32 = 0.05;
/// Bounds of how many times a turn by depth is taken.
const SCALE: [f32; 2] = [0.5, 3.0];
/// The turn in radians at which a pose's word counts half as much as that of a pose like the frame.
const NEAR: f32 = 0.07;
/// Rounds of how all poses stand, of the robust mean, and the distance from it in radians at which a word counts half.
const STAND_ROUNDS: usize = 3;
const ROUNDS: usize = 4;
const APART: f32 = 0.1;

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

/// The turns between all poses. Their normals show how much turns by depth fall short, and how the poses stand.
#[derive(Clone, Debug, Default)]
pub struct PoseTurns(pub Vec<PoseTurn>);

impl PoseTurns {
    /// The same without one pose.
    pub fn leave_out(&mut self, pose: usize) {
        self.0.retain(|turn| turn.from != pose && turn.to != pose);
    }

    /// Turns from poses to a frame, made to agree. `found`: each pose's number and its turn by depth; None where places did not
    /// decide it. If none did, nothing is turned.
    pub fn agreed(&self, found: &[(usize, Option<Mat3>)]) -> Vec<Mat3> {
        let poses: Vec<usize> = found.iter().map(|(pose, _)| *pose).collect();
        let stand = self.stands(&poses);
        // The frame's turn from the reference as each pose has it, with its weight.
        let said: Vec<(Mat3, f32)> = (found.iter())
            .filter_map(|&(pose, turn)| {
                let vector = self.scaled(&turn?);
                let weight = (vector.length_squared() + NEAR.powi(2)).recip();
                Some((vector_turn(vector) * stand[&pose], weight))
            })
            .collect();
        let Some(one) = robust_mean(&said) else {
            return vec![Mat3::IDENTITY; found.len()];
        };
        found
            .iter()
            .map(|(pose, _)| one * stand[pose].transpose())
            .collect()
    }

    /// A turn by depth as far as normals say, as a rotation vector.
    pub fn scaled(&self, by_depth: &Mat3) -> Vec3 {
        self.scale() * turn_vector(by_depth)
    }

    /// How many times a turn by depth has to be taken.
    fn scale(&self) -> f32 {
        let sum = |of: fn(&PoseTurn) -> f32| self.0.iter().map(of).sum::<f32>();
        let agreement = sum(|turn| turn.by_normals.dot(turn.by_depth));
        let all = sum(|turn| turn.by_depth.length_squared());
        ((AS_THEY_ARE + agreement) / (AS_THEY_ARE + all)).clamp(SCALE[0], SCALE[1])
    }

    /// How each of the poses stands, from the first of them: the mean of what all others say. Turns there and back that disagree
    /// count less.
    fn stands(&self, poses: &[usize]) -> BTreeMap<usize, Mat3> {
        let mut stands: BTreeMap<usize, Mat3> = (poses.iter())
            .map(|&pose| (pose, vector_turn(self.between(poses[0], pose).0)))
            .collect();
        for _ in 0..STAND_ROUNDS {
            for &pose in poses.iter().skip(1) {
                let said = (poses.iter().filter(|other| **other != pose)).map(|other| {
                    let (turn, weight) = self.between(*other, pose);
                    (vector_turn(turn) * stands[other], weight)
                });
                if let Some(mean) = robust_mean(&said.collect::<Vec<_>>()) {
                    stands.insert(pose, mean);
                }
            }
        }
        stands
    }

    /// The turn between two poses, the mean of there and back, and its weight.
    fn between(&self, from: usize, to: usize) -> (Vec3, f32) {
        let of = |from, to| {
            let found = (self.0.iter()).find(|turn| (turn.from, turn.to) == (from, to));
            found.map(|turn| turn.by_normals)
        };
        let (there, back) = (of(from, to), of(to, from));
        let apart = (there.unwrap_or_default() + back.unwrap_or_default()).length_squared();
        let turn = 0.5 * (there.unwrap_or_default() - back.unwrap_or_default());
        let weight = (apart + APART.powi(2)).recip();
        (
            turn,
            if there.is_some() && back.is_some() {
                weight
            } else {
                0.1
            },
        )
    }
}

/// The mean of turns with weights: from the one that most say, those far off count less. None of no turns.
fn robust_mean(said: &[(Mat3, f32)]) -> Option<Mat3> {
    let share = |off: Vec3, weight: f32| weight / (1.0 + off.length_squared() / APART.powi(2));
    let backed = |turn: &Mat3| -> f32 {
        let others = said.iter();
        let share = |(other, weight): &(Mat3, f32)| {
            share(turn_vector(&(*other * turn.transpose())), *weight)
        };
        others.map(share).sum()
    };
    let turns = said.iter().map(|(turn, _)| *turn);
    let mut mean = turns.max_by(|a, b| backed(a).total_cmp(&backed(b)))?;
    for _ in 0..ROUNDS {
        let (mut sum, mut below) = (Vec3::ZERO, 0.0);
        for (turn, weight) in said {
            let off = turn_vector(&(*turn * mean.transpose()));
            let weight = share(off, *weight);
            sum += weight * off;
            below += weight;
        }
        mean = vector_turn(sum / below) * mean;
    }
    Some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::turn::turn_degrees;

    /// How the head stands in three poses and a frame.
    const STANDS: [Vec3; 4] = [
        Vec3::ZERO,
        Vec3::new(0.0, 0.3, 0.0),
        Vec3::new(-0.2, 0.1, 0.05),
        Vec3::new(0.1, -0.15, 0.0),
    ];

    fn between(from: usize, to: usize) -> Mat3 {
        vector_turn(STANDS[to]) * vector_turn(STANDS[from]).transpose()
    }

    /// Turns by depth that reach 0.6 of the way.
    fn short(from: usize, to: usize) -> Vec3 {
        0.6 * turn_vector(&between(from, to))
    }

    fn turns() -> PoseTurns {
        let turn = |(from, to)| PoseTurn {
            from,
            to,
            by_depth: short(from, to),
            by_normals: turn_vector(&between(from, to)),
        };
        PoseTurns(
            [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)]
                .map(turn)
                .to_vec(),
        )
    }

    fn off(agreed: &[Mat3]) -> f32 {
        let off = agreed
            .iter()
            .enumerate()
            .map(|(pose, turn)| *turn * between(pose, 3).transpose());
        off.map(|off| turn_degrees(&off)).fold(0.0, f32::max)
    }

    #[test]
    fn turns_that_fall_short_agree_upon_the_true_one() {
        let mut found: Vec<_> = (0..3)
            .map(|pose| (pose, Some(vector_turn(short(pose, 3)))))
            .collect();
        let right = off(&turns().agreed(&found));
        assert!(right < 2.5, "{right}°");
        found[1].1 = Some(vector_turn(Vec3::new(0.9, 0.9, 0.0)));
        let one_wrong = off(&turns().agreed(&found));
        assert!(one_wrong < 3.5, "{one_wrong}°");
        found[1].1 = None;
        let one_lost = off(&turns().agreed(&found));
        assert!(one_lost < 3.5, "{one_lost}°");
    }

    #[test]
    fn poses_alone_are_taken_at_their_word() {
        let turn = Mat3::from_rotation_y(0.2);
        let mut turns = turns();
        turns.leave_out(1);
        assert_eq!(turns.0.len(), 2);
        turns.leave_out(2);
        for (agreed, asked) in turns.agreed(&[(0, Some(turn))]).iter().zip([turn]) {
            assert!(agreed.abs_diff_eq(asked, 1e-5));
        }
        assert_eq!(turns.agreed(&[(0, None), (2, None)]), [Mat3::IDENTITY; 2]);
        assert!(turns.agreed(&[]).is_empty());
    }
}
