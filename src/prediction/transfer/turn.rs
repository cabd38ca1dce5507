//! The turn of the head between two poses.

use glam::{DMat3, DMat4, DVec3, DVec4, Mat3, Quat, Vec3};

/// Rounds of the robust fit to places.
const ROUNDS: usize = 8;
/// Rounds of the robust fit to normals, and the distance of two unit normals at which a pair counts half.
const NORMAL_ROUNDS: usize = 20;
const NORMAL_WIDTH: f32 = 0.2;
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
/// fitted by least squares with weights of a Cauchy distribution of twice the median distance. None if the points do not decide
/// it.
pub fn head_turn(points: &[SeenPoint]) -> Option<Mat3> {
    if points.len() < LEAST_POINTS {
        return None;
    }
    let mut weights = vec![1.0f32; points.len()];
    let mut camera = [DVec4::ZERO; 2];
    for _ in 0..ROUNDS {
        camera = fit(points, &weights)?;
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
        a += DMat4::from_cols(weighted * at.x, weighted * at.y, weighted * at.z, weighted * at.w);
        for (b, seen) in b.iter_mut().zip(point.seen) {
            *b += weighted * f64::from(seen);
        }
    }
    let spread = (a.x_axis.x * a.y_axis.y * a.z_axis.z * a.w_axis.w).abs();
    let inverse = (a.determinant().abs() > 1e-9 * spread).then(|| a.inverse())?;
    inverse.is_finite().then(|| b.map(|b| inverse * b))
}

/// The rotation whose first two rows are nearest to a scaled camera's; None if the rows are parallel or not finite.
fn rotation([x, y]: [Vec3; 2]) -> Option<Mat3> {
    // Polar decomposition: (A·Aᵀ)^(-1/2)·A, by the square root of a 2 × 2 matrix.
    let (a, b, c) = (x.dot(x), x.dot(y), y.dot(y));
    let root_of_determinant = (a * c - b * b).max(0.0).sqrt();
    let trace = (a + c + 2.0 * root_of_determinant).sqrt();
    if !(root_of_determinant > 1e-6 && trace.is_finite()) {
        return None;
    }
    // The inverse of the root (M + d·I) / t is its adjoint over its determinant d.
    let scale = (trace * root_of_determinant).recip();
    let (a, c) = (a + root_of_determinant, c + root_of_determinant);
    let (x, y) = ((x * c - y * b) * scale, (y * a - x * b) * scale);
    Some(Mat3::from_cols(x, y, x.cross(y)).transpose())
}

/// The rotation that takes unit normals before a turn to those after it, by Gauss-Newton steps from `start` with weights of a
/// Cauchy distribution. `start` if the pairs do not decide it. Pairs: `[before, after]`.
pub fn turn_of_normals(pairs: &[[Vec3; 2]], start: Mat3) -> Mat3 {
    if pairs.len() < LEAST_POINTS {
        return start;
    }
    let mut turn = start;
    for _ in 0..NORMAL_ROUNDS {
        let (mut a, mut b) = (DMat3::ZERO, DVec3::ZERO);
        for &[before, after] in pairs {
            let moved = turn * before;
            let weight = (1.0 + (after - moved).length_squared() / NORMAL_WIDTH.powi(2)).recip() as f64;
            let m = moved.as_dvec3();
            let outer = DMat3::from_cols(m * m.x, m * m.y, m * m.z);
            a += (DMat3::from_diagonal(DVec3::splat(m.length_squared())) - outer) * weight;
            b += m.cross(after.as_dvec3()) * weight;
        }
        let step = (a.inverse() * b).as_vec3();
        if !step.is_finite() {
            return start;
        }
        turn = vector_turn(step) * turn;
    }
    turn
}

/// Rotation vector of a turn: its axis times its angle in radians, the shorter way round.
pub fn turn_vector(turn: &Mat3) -> Vec3 {
    let turn = Quat::from_mat3(turn);
    (if turn.w < 0.0 { -turn } else { turn }).to_scaled_axis()
}

/// The turn of a rotation vector.
pub fn vector_turn(vector: Vec3) -> Mat3 {
    Mat3::from_quat(Quat::from_scaled_axis(vector))
}

/// Angle of a rotation in degrees.
pub fn turn_degrees(rotation: &Mat3) -> f32 {
    let trace = rotation.x_axis.x + rotation.y_axis.y + rotation.z_axis.z;
    (0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::EulerRot;

    fn points(turn: Mat3, scale: f32, wrong: usize) -> Vec<SeenPoint> {
        (0..400usize)
            .map(|i| {
                let (x, y) = ((i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5);
                let place = Vec3::new(x, y, 12.0 - 0.05 * (x * x + y * y) + (i * 7 % 5) as f32);
                let at = turn * place * scale + Vec3::new(3.0, -2.0, 0.0);
                let off = if i % 11 < wrong { 25.0 } else { 0.0 };
                SeenPoint { place, seen: [at.x + off, at.y] }
            })
            .collect()
    }

    #[test]
    fn a_turn_is_found_among_wrong_points() {
        for (yaw, pitch, roll) in [(0.0, 0.0, 0.0), (0.4, -0.1, 0.05), (-0.3, 0.3, -0.2)] {
            let turn = Mat3::from_quat(Quat::from_euler(EulerRot::YXZ, yaw, pitch, roll));
            let found = head_turn(&points(turn, 1.1, 2)).unwrap();
            let off = turn_degrees(&(found * turn.transpose()));
            assert!(off < 0.5, "{off}°");
            assert!((found.determinant() - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn points_that_decide_nothing_give_no_turn() {
        let flat: Vec<_> =
            points(Mat3::IDENTITY, 1.0, 0).into_iter().map(|p| SeenPoint { place: p.place.with_z(0.0), ..p }).collect();
        let lost: Vec<_> = flat.iter().map(|p| SeenPoint { seen: [f32::NAN; 2], ..*p }).collect();
        for points in [&[], &flat[..], &lost[..]] {
            assert_eq!(head_turn(points), None);
        }
    }

    /// Normals of half a sphere before and after a turn; the first `wrong` of each eleven stay as they are.
    fn normals(turn: Mat3, wrong: usize) -> Vec<[Vec3; 2]> {
        (0..400usize)
            .map(|i| {
                let (x, y) = ((i % 20) as f32 / 14.0 - 0.68, (i / 20) as f32 / 14.0 - 0.68);
                let before = Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()).normalize();
                let after = if i % 11 < wrong { before } else { turn * before };
                [before, after]
            })
            .collect()
    }

    #[test]
    fn normals_give_the_turn_among_wrong_ones() {
        for vector in [Vec3::ZERO, Vec3::new(0.1, 0.5, 0.0), Vec3::new(-0.4, 0.1, 0.2)] {
            let found = turn_of_normals(&normals(vector_turn(vector), 2), Mat3::IDENTITY);
            let off = (turn_vector(&found) - vector).length().to_degrees();
            assert!(off < 1.5, "{off}°");
        }
    }

    #[test]
    fn normals_that_decide_nothing_leave_the_start() {
        let start = Mat3::from_rotation_y(0.3);
        let lost = vec![[Vec3::NAN; 2]; 100];
        let black = vec![[Vec3::ZERO; 2]; 100];
        for pairs in [&[], &lost[..], &black[..]] {
            assert_eq!(turn_of_normals(pairs, start), start);
        }
    }

    #[test]
    fn a_turn_is_its_vector() {
        for vector in [Vec3::ZERO, Vec3::new(0.2, -3.0, 0.1), Vec3::Z * 1e-4] {
            assert!(turn_vector(&vector_turn(vector)).abs_diff_eq(vector, 1e-5));
        }
        let round = vector_turn(Vec3::X * 3.5);
        assert!((turn_vector(&round).length() - (std::f32::consts::TAU - 3.5)).abs() < 1e-5);
    }
}
