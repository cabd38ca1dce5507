//! Movement of people: the seat from pose to pose, raised hands, and sway while the lamps go round.

use super::camera::FRAME_HEIGHT_M;
use super::grid::Grid;
use super::motion::{FRAME_RATE, Pose, Seat};
use super::subject::Subject;
use super::trouble::{Look, Trouble};
use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::f32::consts::TAU;

/// Distance of the face in front of the joint that the head turns about, in metres.
const FACE_M: f32 = 0.11;
/// Number of steps of the face's path during a pose, from first to last lamp.
const STEPS: usize = 128;

/// Changes poses and frames by the trouble of `seed`: another seat for each pose and for the interview, and hands.
pub fn reseat(poses: &mut [Pose], frames: &mut [Pose], trouble: &Trouble, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7365_6174);
    let mut draw = || random.random_range(-1.0..1.0f32);
    let mut seat = || {
        let far = trouble.reseated;
        let [x, y, z, yaw] = [(); 4].map(|()| draw());
        Seat {
            x: far * x,
            y: 0.5 * far * y,
            z: far * z,
            // Up to four centimetres and ten degrees.
            yaw: 10.0 * far / 0.04 * yaw,
        }
    };
    poses.iter_mut().for_each(|pose| pose.seat = seat());
    let filmed = seat();
    let phase = draw();
    frames.iter_mut().for_each(|frame| frame.seat = filmed);
    if trouble.look.hands {
        for pose in poses {
            pose.hand = (0.5 + draw()).clamp(0.0, 1.0);
        }
        for (i, frame) in frames.iter_mut().enumerate() {
            // Raised and lowered within three seconds, out of the picture for a third of them.
            let time = i as f32 / FRAME_RATE as f32;
            frame.hand = (0.4 + 0.8 * (TAU * (time / 3.0 + phase)).sin()).clamp(0.0, 1.0);
        }
    }
}

/// Sway in one pose.
pub struct Sway {
    /// Positions of the face at each of [`STEPS`] times, in metres to camera-right and up; the mean is 0.
    path: Vec<[f32; 2]>,
}

impl Sway {
    /// A smooth path whose farthest point is `pixels` pixels of a 256-pixel picture from the middle.
    pub fn draw(pixels: f32, seed: u64, pose: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7377_6179 ^ ((pose as u64) << 32));
        // A slow drift, and one to four periods of sway, weaker with frequency.
        let waves: [[[f32; 2]; 4]; 2] = [(); 2].map(|()| {
            [0, 1, 2, 3].map(|i| {
                let size = random.random_range(-1.0..1.0f32) / (1.0 + i as f32);
                [size, random.random_range(0.0..TAU)]
            })
        });
        let at = |i: usize, axis: usize| -> f32 {
            let time = i as f32 / (STEPS - 1) as f32;
            let [drift, rest @ ..] = waves[axis];
            let sways = rest.iter().enumerate();
            2.0 * drift[0] * time
                + sways.map(|(k, [size, phase])| size * (TAU * (k as f32 + 0.7) * time + phase).sin()).sum::<f32>()
        };
        let mut path: Vec<[f32; 2]> = (0..STEPS).map(|i| [at(i, 0), 0.6 * at(i, 1)]).collect();
        let mean = [0, 1].map(|axis: usize| path.iter().map(|p| p[axis]).sum::<f32>() / STEPS as f32);
        let mut farthest = 0.0f32;
        for place in &mut path {
            *place = [place[0] - mean[0], place[1] - mean[1]];
            farthest = farthest.max(place[0].hypot(place[1]));
        }
        let scale = pixels * FRAME_HEIGHT_M / 256.0 / farthest.max(1e-6);
        for place in path.iter_mut().flatten() {
            *place *= scale;
        }
        Self { path }
    }

    /// Offset of the face from its centre at `time`, from 0 (before the first lamp) to 1 (after the last), in metres.
    pub fn face_m(&self, time: f32) -> [f32; 2] {
        let at = time.clamp(0.0, 1.0) * (STEPS - 1) as f32;
        let i = (at as usize).min(STEPS - 2);
        let (part, [a, b]) = (at - i as f32, [self.path[i], self.path[i + 1]]);
        [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * part)
    }

    /// `pose` at `time`.
    pub fn pose(&self, pose: &Pose, time: f32) -> Pose {
        moved(pose, self.face_m(time))
    }

    /// The [`SwayingGrid`] for all moments of the sway; `still` is the grid of `pose` itself.
    pub fn grids(&self, pose: &Pose, look: &Look, still: Grid) -> SwayingGrid {
        let far = |axis: usize| self.path.iter().map(|p| p[axis].abs()).fold(1e-6, f32::max);
        let farthest_m = [far(0), far(1)];
        let bake = |face_m: [f32; 2]| Grid::bake(&Subject::new(&moved(pose, face_m), look));
        let [x, y] = farthest_m;
        SwayingGrid {
            moved: [[[x, 0.0], [-x, 0.0]], [[0.0, y], [0.0, -y]]].map(|axis| axis.map(bake)),
            farthest_m,
            still,
        }
    }
}

/// `pose` with the face moved: half of the offset moves the whole body, the rest turns the head on its neck.
fn moved(pose: &Pose, [x, y]: [f32; 2]) -> Pose {
    let mut moved = *pose;
    moved.seat.x += 0.5 * x;
    moved.seat.y += 0.5 * y;
    moved.yaw += (0.5 * x / FACE_M).atan().to_degrees();
    moved.pitch -= (0.5 * y / FACE_M).atan().to_degrees();
    moved
}

/// Distances of a swaying subject, baked five times instead of for every moment. The body's part of the sway moves the
/// whole grid and is exact. The head's turn, at most half of the face's path, is interpolated: linearly between the
/// still grid and those at the farthest turns, and added for both axes.
pub struct SwayingGrid {
    still: Grid,
    /// Farthest to camera-right and left, up and down.
    moved: [[Grid; 2]; 2],
    farthest_m: [f32; 2],
}

impl SwayingGrid {
    /// The grid with the face offset by `face_m`.
    pub fn at(&self, face_m: [f32; 2]) -> Grid {
        let part = |axis: usize| face_m[axis] / self.farthest_m[axis];
        let end = |axis: usize| &self.moved[axis][usize::from(face_m[axis] < 0.0)];
        let (x, y) = (part(0).abs(), part(1).abs());
        Grid::blend(&[(&self.still, 1.0 - x - y), (end(0), x), (end(1), y)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_face_goes_as_far_as_asked_and_no_step_is_a_jump() {
        for (pose, pixels) in [(0, 3.0), (4, 0.5)] {
            let sway = Sway::draw(pixels, 9, pose);
            let metres = pixels * FRAME_HEIGHT_M / 256.0;
            let far: Vec<f32> = (0..=200).map(|i| sway.face_m(i as f32 / 200.0)).map(|[x, y]| x.hypot(y)).collect();
            let farthest = far.iter().copied().fold(0.0, f32::max);
            assert!((farthest / metres - 1.0).abs() < 0.02, "{farthest}");
            assert!(far.windows(2).all(|w| (w[0] - w[1]).abs() < 0.15 * metres));
        }
        assert_ne!(Sway::draw(1.0, 9, 0).path, Sway::draw(1.0, 9, 1).path);
    }
}
