//! The turn of the head between two poses.

use glam::{DMat4, DVec4, Mat3, Vec3};

/// Rounds of the robust fit.
const ROUNDS: usize = 8;
/// Points below which a head has no turn.
const LEAST_POINTS: usize = 50;

/// A point of the head: its place in one pose, depth included, and where it is seen in the other. Pixels from the picture's
/// middle, +x to the right, +y up, +z towards the camera.
#[derive(Clone, Copy, Debug)]
pub struct SeenPoint {
    pub place: Vec3,
    pub seen: [f32; 2],
}

/// The rotation that takes the head from the first pose to the second: a scaled orthographic camera (Tomasi and Kanade 1992),
/// fitted by least squares with weights of a Cauchy distribution of twice the median distance. The identity if the points do
/// not decide it.
pub fn head_turn(points: &[SeenPoint]) -> Mat3 {
    if points.len() < LEAST_POINTS {
        return Mat3::IDENTITY;
    }
    let mut weights = vec![1.0f32; points.len()];
    let mut camera = [DVec4::ZERO; 2];
    for _ in 0..ROUNDS {
        let Some(fitted) = fit(points, &weights) else {
            return Mat3::IDENTITY;
        };
        camera = fitted;
        let rows = camera.map(|row| row.as_vec4());
        let misses: Vec<f32> = points
            .iter()
            .map(|point| {
                let at = point.place.extend(1.0);
                (point.seen[0] - rows[0].dot(at)).hypot(point.seen[1] - rows[1].dot(at))
            })
            .collect();
        let mut sorted = misses.clone();
        let (_, median, _) = sorted.select_nth_unstable_by(misses.len() / 2, f32::total_cmp);
        let width = 2.0 * *median + 1e-6;
        for (weight, miss) in weights.iter_mut().zip(&misses) {
            *weight = (1.0 + (miss / width).powi(2)).recip();
        }
    }
    rotation(camera.map(|row| row.truncate().as_vec3()))
}

/// The two rows of the camera by weighted least squares; None if the points lie in a plane or are not finite.
fn fit(points: &[SeenPoint], weights: &[f32]) -> Option<[DVec4; 2]> {
    let mut a = DMat4::ZERO;
    let mut b = [DVec4::ZERO; 2];
    for (point, &weight) in points.iter().zip(weights) {
        let at = point.place.extend(1.0).as_dvec4();
        let weighted = at * f64::from(weight).powi(2);
        a += DMat4::from_cols(
            weighted * at.x,
            weighted * at.y,
            weighted * at.z,
            weighted * at.w,
        );
        for (b, seen) in b.iter_mut().zip(point.seen) {
            *b += weighted * f64::from(seen);
        }
    }
    let spread = (a.x_axis.x * a.y_axis.y * a.z_axis.z * a.w_axis.w).abs();
    let inverse = (a.determinant().abs() > 1e-9 * spread).then(|| a.inverse())?;
    inverse.is_finite().then(|| b.map(|b| inverse * b))
}

/// The rotation whose first two rows are nearest to a scaled camera's.
fn rotation([x, y]: [Vec3; 2]) -> Mat3 {
    // Polar decomposition: (A·Aᵀ)^(-1/2)·A, by the square root of a 2 × 2 matrix.
    let (a, b, c) = (x.dot(x), x.dot(y), y.dot(y));
    let root_of_determinant = (a * c - b * b).max(0.0).sqrt();
    let trace = (a + c + 2.0 * root_of_determinant).sqrt();
    if !(root_of_determinant > 1e-6 && trace.is_finite()) {
        return Mat3::IDENTITY;
    }
    // The inverse of the root (M + d·I) / t is its adjoint over its determinant d.
    let scale = (trace * root_of_determinant).recip();
    let (a, c) = (a + root_of_determinant, c + root_of_determinant);
    let (x, y) = ((x * c - y * b) * scale, (y * a - x * b) * scale);
    Mat3::from_cols(x, y, x.cross(y)).transpose()
}

/// Angle of a rotation in degrees.
pub fn turn_degrees(rotation: &Mat3) -> f32 {
    let trace = rotation.x_axis.x + rotation.y_axis.y + rotation.z_axis.z;
    (0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{EulerRot, Quat};

    fn points(turn: Mat3, scale: f32, wrong: usize) -> Vec<SeenPoint> {
        (0..400usize)
            .map(|i| {
                let (x, y) = ((i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5);
                let place = Vec3::new(x, y, 12.0 - 0.05 * (x * x + y * y) + (i * 7 % 5) as f32);
                let at = turn * place * scale + Vec3::new(3.0, -2.0, 0.0);
                let off = if i % 11 < wrong { 25.0 } else { 0.0 };
                SeenPoint {
                    place,
                    seen: [at.x + off, at.y],
                }
            })
            .collect()
    }

    #[test]
    fn a_turn_is_found_among_wrong_points() {
        for (yaw, pitch, roll) in [(0.0, 0.0, 0.0), (0.4, -0.1, 0.05), (-0.3, 0.3, -0.2)] {
            let turn = Mat3::from_quat(Quat::from_euler(EulerRot::YXZ, yaw, pitch, roll));
            let found = head_turn(&points(turn, 1.1, 2));
            let off = turn_degrees(&(found * turn.transpose()));
            assert!(off < 0.5, "{off}°");
            assert!((found.determinant() - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn points_that_decide_nothing_leave_the_head_as_it_is() {
        let flat: Vec<_> = points(Mat3::IDENTITY, 1.0, 0)
            .into_iter()
            .map(|p| SeenPoint {
                place: p.place.with_z(0.0),
                ..p
            })
            .collect();
        let lost: Vec<_> = flat
            .iter()
            .map(|p| SeenPoint {
                seen: [f32::NAN; 2],
                ..*p
            })
            .collect();
        for points in [&[], &flat[..], &lost[..]] {
            assert_eq!(head_turn(points), Mat3::IDENTITY);
        }
    }
}
