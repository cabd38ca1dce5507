//! The blind cone behind the ball, and the true direction of a lamp partly hidden in it.

use glam::DVec3;
use std::f64::consts::TAU;

/// Angle of the visible part's centroid and the visible share, for a lamp whose footprint is a uniform disc of
/// `radius` with its centre at `angle` from the cone's axis. `cone` is the cone's half angle. All angles in
/// radians. `None` if nothing is visible.
fn visible_part(angle: f64, radius: f64, cone: f64) -> Option<(f64, f64)> {
    const RINGS: usize = 16;
    let axis = DVec3::Z;
    let centre = DVec3::new(angle.sin(), 0.0, angle.cos());
    let (right, up) = (DVec3::new(angle.cos(), 0.0, -angle.sin()), DVec3::Y);
    let (mut moment, mut visible, mut all) = (DVec3::ZERO, 0.0, 0.0);
    for ring in 0..RINGS {
        let (sin, cos) = (radius * (ring as f64 + 0.5) / RINGS as f64).sin_cos();
        for spoke in 0..4 * RINGS {
            let (s, c) = (TAU * spoke as f64 / (4 * RINGS) as f64).sin_cos();
            let direction = cos * centre + sin * (c * right + s * up);
            all += sin;
            // The cone's border is softened over one disc sample, so that the result is continuous.
            let beyond = (direction.angle_between(axis) - cone) / (radius / RINGS as f64).max(1e-6);
            let part = sin * (0.5 + beyond).clamp(0.0, 1.0);
            visible += part;
            moment += part * direction;
        }
    }
    (visible > 0.0).then(|| (moment.x.atan2(moment.z), visible / all))
}

/// True angle of a lamp from the cone's axis and its visible share, from the angle `seen` of the visible part's
/// centroid and the footprint's `radius`. The visible share is at least a tenth; from less, the full lamp cannot be
/// estimated.
pub(super) fn uncover(seen: f64, radius: f64, cone: f64) -> (f64, f64) {
    // The visible centroid lies farther out than the centre and grows with it.
    let (mut low, mut high) = (0.0, seen);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        // Where the disc vanishes in the cone, the last visible part is at the cone's border.
        if visible_part(middle, radius, cone).is_some_and(|(centroid, _)| centroid >= seen) {
            high = middle;
        } else {
            low = middle;
        }
    }
    let visible = visible_part(high, radius, cone).map_or(0.0, |(_, share)| share);
    (high, visible.max(0.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_partly_hidden_disc_is_placed(angle in 0.0f64..1.0, radius in 0.1f64..0.5, cone in 0.05f64..0.3) {
            let Some((seen, share)) = visible_part(angle, radius, cone) else { return Ok(()) };
            prop_assume!(share > 0.15);
            let (found, visible) = uncover(seen, radius, cone);
            // Near the axis the centroid hardly constrains the angle; all directions are close there.
            prop_assert!((found - angle).abs() < 0.03, "{found} is not {angle}");
            prop_assert!((visible - share).abs() < 0.05, "{visible} is not {share}");
        }
    }

    #[test]
    fn a_disc_clear_of_the_cone_is_left_alone() {
        let (angle, visible) = uncover(0.8, 0.3, 0.2);
        assert!((angle - 0.8).abs() < 0.01 && visible > 0.999);
    }
}
