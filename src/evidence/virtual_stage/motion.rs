//! The subject's poses in the exemplars, and its movements in the interview.

use chacha20::ChaCha8Rng;
use glam::{Mat3, Vec3};
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use std::f32::consts::TAU;

/// Pictures per second of the interview.
pub const FRAME_RATE: f64 = 24.0;

/// Position of the head and expression of the face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Pose {
    /// Turn of the head in degrees; positive turns the face to camera-right.
    pub yaw: f32,
    /// Nod in degrees; positive lowers the face.
    pub pitch: f32,
    /// Tilt in degrees; positive tilts the crown to camera-left.
    pub roll: f32,
    /// Sway of the head in metres.
    pub tx: f32,
    pub ty: f32,
    pub tz: f32,
    /// Opening of the jaw, from 0 to 1.
    pub jaw: f32,
    /// Width of the mouth, from 0 to 1.
    pub smile: f32,
    /// Closing of the lids, from 0 to 1.
    pub blink: f32,
    /// Position of the whole subject.
    #[serde(skip_serializing_if = "Seat::is_usual")]
    pub seat: Seat,
    /// Height of a raised hand, from 0 (out of the picture) to 1 (beside the chin).
    #[serde(skip_serializing_if = "is_zero")]
    pub hand: f32,
}

/// Position of the whole subject: metres to camera-right, up and towards the camera, and a turn about the vertical in
/// degrees, positive to camera-right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seat {
    pub x: f32,
    pub y: f32,
    pub z: f32,
    pub yaw: f32,
}

impl Seat {
    /// True for the middle of the stage, as on the plain one.
    pub fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// A place of the stage in the subject's axes.
    pub fn subject_place(&self, p: Vec3) -> Vec3 {
        self.stage_from_subject().transpose() * (p - Vec3::new(self.x, self.y, self.z))
    }

    /// Rotation from the subject's axes to the stage's.
    pub fn stage_from_subject(&self) -> Mat3 {
        Mat3::from_rotation_y(self.yaw.to_radians())
    }
}

fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

impl Pose {
    /// Rotation from the head's own axes to the stage's.
    pub fn rotation(&self) -> Mat3 {
        Mat3::from_rotation_y(self.yaw.to_radians())
            * Mat3::from_rotation_x(self.pitch.to_radians())
            * Mat3::from_rotation_z(self.roll.to_radians())
    }

    /// Sway as a vector.
    pub fn shift(&self) -> Vec3 {
        Vec3::new(self.tx, self.ty, self.tz)
    }
}

/// The six poses photographed under every bank.
pub fn exemplar_poses() -> [Pose; 6] {
    let pose = |yaw, pitch, roll, jaw, smile| Pose { yaw, pitch, roll, jaw, smile, ..Pose::default() };
    [
        pose(0.0, 0.0, 0.0, 0.0, 0.0),
        pose(-24.0, -3.0, 2.0, 0.1, 0.2),
        pose(22.0, 4.0, -3.0, 0.0, 0.6),
        pose(4.0, -11.0, -2.0, 0.9, 0.0),
        pose(-6.0, 11.0, 4.0, 0.45, 0.3),
        pose(12.0, -5.0, 7.0, 0.2, 0.8),
    ]
}

/// Poses of the subject in every frame of an interview.
pub fn interview(frames: usize, seed: u64) -> Vec<Pose> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x6d6f_7469_6f6e);
    let phase: [f32; 8] = std::array::from_fn(|_| random.random());
    let first_blink: f32 = random.random_range(0.3..0.9);
    (0..frames).map(|frame| pose_at(frame as f32 / FRAME_RATE as f32, &phase, first_blink)).collect()
}

/// Pose at `time` seconds into the interview.
fn pose_at(time: f32, phase: &[f32; 8], first_blink: f32) -> Pose {
    let wave = |hertz: f32, i: usize| (TAU * (hertz * time + phase[i])).sin();
    // Speech: syllables about four times a second, in phrases of a second and a half.
    let phrase = 0.5 + 0.5 * wave(0.65, 5);
    let syllable = 0.5 + 0.5 * wave(3.9, 6);
    // The lids close and open within a quarter of a second, every 2.7 seconds.
    let since_blink = (time - first_blink).rem_euclid(2.7);
    let blink = (1.0 - (since_blink / 0.12 - 1.0).abs()).max(0.0);
    Pose {
        yaw: 15.0 * wave(0.55, 0) + 4.0 * wave(1.1, 1),
        pitch: 6.0 * wave(0.7, 2) - 1.0,
        roll: 4.0 * wave(0.45, 3),
        tx: 0.006 * wave(0.4, 4),
        ty: 0.003 * wave(0.6, 1),
        tz: 0.004 * wave(0.5, 7),
        jaw: phrase * (0.15 + 0.85 * syllable * syllable),
        smile: 0.5 + 0.5 * wave(0.35, 7),
        blink: (1.6 * blink).min(1.0),
        ..Pose::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_moves_smoothly_and_the_mouth_speaks() {
        let frames = interview(96, 3);
        for pair in frames.windows(2) {
            assert!((pair[0].yaw - pair[1].yaw).abs() < 4.0, "the head jumps");
        }
        let range = |f: fn(&Pose) -> f32| {
            frames.iter().map(f).fold(f32::MIN, f32::max) - frames.iter().map(f).fold(f32::MAX, f32::min)
        };
        assert!(range(|p| p.yaw) > 20.0);
        assert!(range(|p| p.jaw) > 0.5);
        assert_eq!(range(|p| p.blink), 1.0);
    }
}
