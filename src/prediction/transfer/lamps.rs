//! Lamps that turn with the head: the lamps of a pose near each lamp of a frame.

use glam::{Mat3, Vec3};
use light::{Lamp, Rig};

/// Width in degrees of the blend between neighbouring lamps, and between the nearest lamps of poses.
const ANGLE: f32 = 8.0;
/// Weights below this, as a share of the nearest lamp's, are 0.
const NEGLIGIBLE: f32 = 1e-3;
/// Added to cosines, which bounds the ratio of two shadings to 1 : 11.
const SHADE: f32 = 0.1;

/// Values of a pixel are kept for a multiple of this many lamps: one vector of the processor.
pub const LANES: usize = 16;

/// The lamps of a rig as transfer sees them.
#[derive(Clone, Debug)]
pub struct Lamps {
    /// Unit directions; None of a lamp that no ball shows.
    pub directions: Vec<Option<Vec3>>,
    /// Energy per channel; 1 of a lamp that no ball shows.
    pub energies: Vec<[f32; 3]>,
    /// Values kept per pixel and channel: one for each lamp, and zeros up to a whole number of vectors.
    pub stride: usize,
}

/// The lamps of a frame as blends of those of a pose whose head is turned.
#[derive(Clone, Debug)]
pub struct TurnedLamps {
    /// Angle in degrees from each lamp of the frame to the nearest of the pose.
    pub nearest: Vec<f32>,
    /// Weight of each lamp of the pose in each of the frame: `weights[m · stride + l]`. Those of a lamp of the frame sum to 1.
    pub weights: Vec<f32>,
    /// For each vector of lamps of the frame: the pose's lamps with weight in any of them.
    near: Vec<Vec<usize>>,
    /// The frame's lamps in the pose's own frame, by axis; 0 for a lamp that no ball shows.
    toward: [Vec<f32>; 3],
    /// Ambient share of each lamp's shading.
    ambient: Vec<f32>,
}

impl TurnedLamps {
    /// Shading of a surface by each lamp of the frame, as [`shading`].
    #[inline(always)]
    pub fn shade(&self, normal: Vec3, out: &mut [f32]) {
        let [x, y, z] = &self.toward;
        let toward = x.iter().zip(y).zip(z).zip(&self.ambient);
        for (out, (((x, y), z), ambient)) in out.iter_mut().zip(toward) {
            *out = (normal.x * x + normal.y * y + normal.z * z).max(0.0) + ambient;
        }
    }

    /// Adds lamp `m` of the pose to vector `n` of the frame's lamps, in each channel.
    #[inline(always)]
    fn add(&self, m: usize, n: usize, values: &[f32], sums: &mut [[f32; LANES]; 3]) {
        let stride = self.ambient.len();
        let weights = &self.weights[m * stride..].as_chunks::<LANES>().0[n];
        for (c, sums) in sums.iter_mut().enumerate() {
            let value = values[c * stride + m];
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum += value * weight;
            }
        }
    }

    /// Values of the frame's lamps, blended from those of the pose's, channel by channel: `[3, stride]`.
    #[inline(always)]
    pub fn blend(&self, values: &[f32], out: &mut [f32]) {
        let stride = self.ambient.len();
        for (n, lamps) in self.near.iter().enumerate() {
            // Two sets of sums, since an addition waits for the one before.
            let (mut even, mut odd) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            let (pairs, rest) = lamps.as_chunks::<2>();
            for &[a, b] in pairs {
                self.add(a, n, values, &mut even);
                self.add(b, n, values, &mut odd);
            }
            for &m in rest {
                self.add(m, n, values, &mut even);
            }
            for c in 0..3 {
                let out = &mut out[c * stride..].as_chunks_mut::<LANES>().0[n];
                for ((out, a), b) in out.iter_mut().zip(even[c]).zip(odd[c]) {
                    *out = a + b;
                }
            }
        }
    }
}

impl Lamps {
    /// Directions and energies of a rig.
    pub fn new(rig: &Rig) -> Self {
        let energy = |lamp: &Lamp| {
            if lamp.is_usable() { lamp.energy } else { [1.0; 3] }
        };
        Self {
            directions: rig.lamps.iter().map(|lamp| lamp.is_usable().then_some(lamp.direction)).collect(),
            energies: rig.lamps.iter().map(energy).collect(),
            stride: rig.lamps.len().next_multiple_of(LANES),
        }
    }

    /// A value for each lamp, and zeros up to [`Self::stride`].
    pub fn padded(&self, values: impl Iterator<Item = f32>) -> Vec<f32> {
        let mut values: Vec<f32> = values.collect();
        values.resize(self.stride, 0.0);
        values
    }

    /// Number of lamps.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// The lamps of a frame whose head is turned by `turn` from the pose's. Weights fall with the angle beyond the nearest
    /// lamp's. A lamp that no ball shows stands for itself alone, one that the pose lacks (`missing`) for none.
    pub fn turned(&self, turn: &Mat3, missing: &[usize]) -> TurnedLamps {
        let (count, stride, back) = (self.len(), self.stride, turn.transpose());
        let toward = |lamp: usize| self.directions[lamp].map(|direction| back * direction);
        let axis = |axis: usize| {
            let axis = |l| toward(l).map_or(0.0, |direction| direction[axis]);
            self.padded((0..count).map(axis))
        };
        let mut turned = TurnedLamps {
            nearest: vec![0.0; count],
            weights: vec![0.0; count * stride],
            near: Vec::new(),
            toward: [0, 1, 2].map(axis),
            ambient: self.padded((0..count).map(|l| toward(l).map_or(1.0, |_| SHADE))),
        };
        for l in 0..count {
            let Some(toward) = toward(l) else {
                turned.weights[l * stride + l] = 1.0;
                continue;
            };
            let angle = |direction: &Option<Vec3>| {
                direction.map_or(f32::INFINITY, |d| d.dot(toward).clamp(-1.0, 1.0).acos().to_degrees())
            };
            let mut angles: Vec<f32> = self.directions.iter().map(angle).collect();
            missing.iter().for_each(|&m| angles[m] = f32::INFINITY);
            let nearest = angles.iter().copied().fold(f32::INFINITY, f32::min);
            let weight = |angle: &f32| Some(falloff(*angle, nearest)).filter(|w| *w > NEGLIGIBLE);
            let sum: f32 = angles.iter().filter_map(weight).sum();
            for (m, angle) in angles.iter().enumerate() {
                turned.weights[m * stride + l] = weight(angle).map_or(0.0, |weight| weight / sum);
            }
            turned.nearest[l] = nearest;
        }
        let chunk = |m: usize, n: usize| &turned.weights[m * stride + n * LANES..][..LANES];
        let near = |n: usize| (0..count).filter(move |&m| chunk(m, n).iter().any(|weight| *weight > 0.0)).collect();
        turned.near = (0..stride / LANES).map(near).collect();
        turned
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
        let lamp = |i: usize| {
            let direction = Mat3::from_rotation_y((30.0 * i as f32).to_radians()) * Vec3::Z;
            let energy = [1.0 + i as f32; 3];
            Lamp { energy, ..Lamp::new(format!("olat_{i:02}"), direction) }
        };
        Rig { lamps: (0..12).map(lamp).collect() }
    }

    /// The pose's lamp that has most of a frame's lamp, with its weight.
    fn most(turned: &TurnedLamps, l: usize) -> (usize, f32) {
        let (count, stride) = (turned.nearest.len(), turned.ambient.len());
        let weights = (0..count).map(|m| (m, turned.weights[m * stride + l]));
        let sum: f32 = weights.clone().map(|(_, weight)| weight).sum();
        assert!((sum - 1.0).abs() < 1e-5);
        weights.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    }

    #[test]
    fn lamps_stand_for_themselves_in_a_pose_like_the_frame() {
        let turned = Lamps::new(&rig()).turned(&Mat3::IDENTITY, &[]);
        for l in 0..12 {
            let (m, weight) = most(&turned, l);
            assert!(m == l && weight > 0.99 && turned.nearest[l] < 0.1);
        }
    }

    #[test]
    fn lamps_turn_with_the_head() {
        let turn = Mat3::from_rotation_y(30f32.to_radians());
        let turned = Lamps::new(&rig()).turned(&turn, &[]);
        for l in 0..12 {
            let (m, weight) = most(&turned, l);
            assert!(m == (l + 11) % 12 && weight > 0.99, "{l}: {m} {weight}");
        }
    }

    #[test]
    fn neighbours_stand_for_a_lamp_that_the_pose_lacks() {
        let turned = Lamps::new(&rig()).turned(&Mat3::IDENTITY, &[3]);
        let weights: Vec<f32> = (2..5).map(|m| turned.weights[m * 16 + 3]).collect();
        assert!((weights[0] - 0.5).abs() < 1e-3 && (weights[2] - 0.5).abs() < 1e-3);
        assert_eq!(weights[1], 0.0);
        assert!((turned.nearest[3] - 30.0).abs() < 0.01 && turned.nearest[4] < 0.1);
    }

    #[test]
    fn blends_are_sums_over_all_lamps_of_the_pose() {
        let mut rig = rig();
        rig.lamps = (0..41)
            .map(|i: usize| {
                let at = Mat3::from_rotation_y(0.3 * i as f32) * Mat3::from_rotation_x(0.05 * i as f32);
                Lamp { direction: at * Vec3::Z, ..rig.lamps[i % 12].clone() }
            })
            .collect();
        let lamps = Lamps::new(&rig);
        let stride = lamps.stride;
        let values: Vec<f32> = (0..3 * stride).map(|i| (i * 37 % 101) as f32).collect();
        let mut parities = [false; 2];
        for turn in 0..6 {
            let turned = lamps.turned(&Mat3::from_rotation_x(0.1 * turn as f32), &[7]);
            turned.near.iter().for_each(|near| parities[near.len() % 2] = true);
            let mut out = vec![f32::NAN; 3 * stride];
            turned.blend(&values, &mut out);
            for (i, found) in out.into_iter().enumerate() {
                let (c, l) = (i / stride, i % stride);
                let term = |m: usize| turned.weights[m * stride + l] * values[c * stride + m];
                let expected: f32 = (0..41).map(term).sum();
                assert!((found - expected).abs() < 1e-3, "{c} {l}: {found} is not {expected}");
            }
        }
        assert_eq!(parities, [true; 2], "lists of even and of odd length");
    }

    #[test]
    fn a_lamp_that_no_ball_shows_stands_for_itself_alone() {
        let mut rig = rig();
        rig.lamps[3].confidence = 0.0;
        let turned = Lamps::new(&rig).turned(&Mat3::from_rotation_y(0.5), &[]);
        assert_eq!(most(&turned, 3), (3, 1.0));
        for l in (0..12).filter(|&l| l != 3) {
            assert_eq!(turned.weights[3 * 16 + l], 0.0);
        }
        let mut shades = [0.0; 16];
        turned.shade(-Vec3::Z, &mut shades);
        assert_eq!(shades[3], 1.0);
    }
}
