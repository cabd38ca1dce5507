//! Circles: through three points, fitted to many points, or fitted robustly to the consistent ones.

use base::error::{Error, Result};
use base::numbers;
use glam::{DMat3, DVec2, DVec3};
use project::Ball;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A circle in a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// Centre in pixels from the top left corner of the photograph (0 is the left edge of column 0).
    pub center_px: [f64; 2],
    /// Radius in pixels.
    pub radius_px: f64,
}

/// Largest ratio of a circle's radius to the extent of three points that determine it. Beyond it a click error of 1 %
/// would change the radius by half.
const FLATTEST: f64 = 10.0;

impl Circle {
    /// Builds a circle from its centre and radius in pixels.
    ///
    /// # Errors
    /// When a value is not finite or the radius is not positive.
    pub fn new(center_px: [f64; 2], radius_px: f64) -> Result<Self> {
        if center_px.iter().all(|c| c.is_finite()) && radius_px.is_finite() && radius_px > 0.0 {
            return Ok(Self { center_px, radius_px });
        }
        Err(Error::invalid(
            format!("invalid mirror ball: centre {center_px:?}, radius {radius_px} pixels"),
            "Give the ball's centre, and its radius above 0, in the photograph",
        ))
    }

    /// The circle through three points, in pixels.
    ///
    /// # Errors
    /// When two of the points coincide, or the three are so nearly collinear that no circle is determined.
    pub fn through(points: [[f64; 2]; 3]) -> Result<Self> {
        let [a, b, c] = points.map(DVec2::from);
        let (ab, ac) = (b - a, c - a);
        let cross = 2.0 * ab.perp_dot(ac);
        // The circumcentre, relative to a.
        let to_center = DVec2::new(
            ac.y * ab.length_squared() - ab.y * ac.length_squared(),
            ab.x * ac.length_squared() - ac.x * ab.length_squared(),
        ) / cross;
        let radius = to_center.length();
        let longest = ab.length().max(ac.length()).max((c - b).length());
        // Infinite and NaN radii fail this comparison too.
        if radius < FLATTEST * longest {
            return Self::new((a + to_center).to_array(), radius);
        }
        Err(Error::invalid(
            format!("the three points {points:?} on the mirror ball's rim are nearly collinear"),
            "Choose points that lie far apart on the rim",
        ))
    }

    /// Least-squares circle of three or more `points` (pixels). Starts from Kåsa's algebraic fit and ends with the
    /// geometric Gauss–Newton one.
    ///
    /// # Errors
    /// When there are fewer than three points, or they are nearly collinear.
    pub fn fit(points: &[[f64; 2]]) -> Result<Self> {
        if let [a, b, c] = *points {
            return Self::through([a, b, c]);
        }
        let points: Vec<DVec2> = points.iter().map(|&p| DVec2::from(p)).collect();
        let longest = points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max);
        algebraic(&points)
            .and_then(|start| (0..20).try_fold(start, |circle, _| circle.improved(&points, |_| 1.0)))
            .filter(|circle| circle.radius_px < FLATTEST * longest)
            .ok_or_else(|| {
                Error::invalid(
                    format!("{} points on the mirror ball's rim fit no circle", points.len()),
                    "Choose three or more points that lie far apart on the rim",
                )
            })
    }

    /// Centre as a vector.
    pub(crate) fn center(&self) -> DVec2 {
        DVec2::from(self.center_px)
    }

    /// Signed distance of a point from the circle, positive outside.
    pub(super) fn distance(&self, point: DVec2) -> f64 {
        point.distance(self.center()) - self.radius_px
    }

    /// The circle in a picture `factor` times as large.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self { center_px: self.center_px.map(|c| factor * c), radius_px: factor * self.radius_px }
    }

    /// One Gauss–Newton step towards the weighted least squares; `None` if the points do not determine a step or a
    /// circle.
    fn improved(&self, points: &[DVec2], weight: impl Fn(f64) -> f64) -> Option<Self> {
        let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for &point in points {
            let residual = self.distance(point);
            let towards = (point - self.center()).normalize_or_zero();
            let row = towards.extend(1.0);
            let w = weight(residual);
            normal += DMat3::from_cols(row * row.x, row * row.y, row) * w;
            right += row * (w * residual);
        }
        // Unit rows: with points all around, the determinant is about (weight sum)³ / 4.
        let scale = normal.z_axis.z;
        if !(scale > 0.0 && normal.determinant() > 1e-9 * scale.powi(3)) {
            return None;
        }
        let step = normal.inverse() * right;
        let improved =
            Self { center_px: (self.center() + step.truncate()).to_array(), radius_px: self.radius_px + step.z };
        (improved.radius_px > 0.0 && improved.radius_px.is_finite()).then_some(improved)
    }

    /// Nearby circle that most of `points` agree on: Tukey's biweight within `reach` pixels, then within ever less
    /// as the points converge. Also returns their standard deviation in pixels, without outliers.
    pub(super) fn agreed(&self, points: &[DVec2], reach: f64) -> Option<(Self, f64)> {
        // 4.685 deviations keep 95 % of a normal distribution's efficiency (Holland and Welsch 1977). Starting with
        // fewer finds the main cluster from farther away.
        const CROWD: f64 = 2.5;
        const EFFICIENT: f64 = 4.685;
        let (mut circle, mut cut) = (*self, reach);
        let mut deviation = reach;
        for round in 0..16 {
            circle = circle.improved(points, |residual| {
                let u = residual / cut;
                if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
            })?;
            let mut distances: Vec<f64> =
                points.iter().map(|&p| circle.distance(p).abs()).filter(|&d| d < cut).collect();
            if distances.len() < 3 {
                return None;
            }
            let middle = distances.len() / 2;
            let median = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
            // 1.4826 converts the median deviation to a normal distribution's standard deviation. A rim cannot be
            // measured to better than a twentieth of a pixel.
            deviation = (1.4826 * median).max(0.05);
            cut = if round < 12 { cut.min(CROWD * deviation) } else { reach.min(EFFICIENT * deviation) };
        }
        Some((circle, deviation))
    }
}

impl Circle {
    /// Silhouette of `ball`.
    pub fn from_ball(ball: &Ball) -> Self {
        Self { center_px: ball.center_px.map(f64::from), radius_px: f64::from(ball.radius_px) }
    }

    /// Sets the silhouette of `ball` to this circle.
    pub fn apply_to(&self, ball: &mut Ball) {
        ball.center_px = self.center_px.map(|c| c as f32);
        ball.radius_px = self.radius_px as f32;
    }
}

/// Kåsa's fit: x² + y² = 2ax + 2by + c is linear in a, b and c. Uses coordinates about the mean, scaled to one, for
/// a well-conditioned system.
fn algebraic(points: &[DVec2]) -> Option<Circle> {
    let count = points.len() as f64;
    let mean = points.iter().sum::<DVec2>() / count;
    let scale = (points.iter().map(|p| p.distance_squared(mean)).sum::<f64>() / count).sqrt();
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for point in points {
        let p = (point - mean) / scale;
        let row = DVec3::new(2.0 * p.x, 2.0 * p.y, 1.0);
        normal += DMat3::from_cols(row * row.x, row * row.y, row);
        right += row * p.length_squared();
    }
    // NaN (no points, one place) fails this comparison too.
    let is_determined = normal.determinant().abs() > 1e-9 * count.powi(3);
    if !is_determined {
        return None;
    }
    let found = normal.inverse() * right;
    let center = found.truncate();
    Circle::new((mean + scale * center).to_array(), scale * (found.z + center.length_squared()).sqrt()).ok()
}

impl FromStr for Circle {
    type Err = String;

    /// Parses centre and radius in pixels, such as `320,240,200.5`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let [x, y, radius] = numbers(text, "X,Y,RADIUS in pixels")?;
        Self::new([x, y], radius).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn on_circle(center: [f64; 2], radius: f64, angle: f64) -> [f64; 2] {
        [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()]
    }

    fn assert_near(found: Circle, center: [f64; 2], radius: f64, bound: f64) {
        let off = DVec2::from(found.center_px).distance(DVec2::from(center));
        assert!(off < bound && (found.radius_px - radius).abs() < bound, "{found:?} is not {center:?}, {radius}");
    }

    proptest! {
        #[test]
        fn three_points_of_a_circle_give_it_back(
            x in -500.0f64..5000.0, y in -500.0f64..5000.0, radius in 5.0f64..3000.0,
            start in 0.0f64..6.3, first in 0.5f64..2.0, second in 0.5f64..2.0,
        ) {
            let at = |angle| on_circle([x, y], radius, angle);
            let found = Circle::through([at(start), at(start + first), at(start + first + second)]).unwrap();
            assert_near(found, [x, y], radius, 1e-6 * radius);
        }

        #[test]
        fn many_points_of_an_arc_give_the_circle_back(
            x in -500.0f64..5000.0, y in -500.0f64..5000.0, radius in 5.0f64..3000.0,
            start in 0.0f64..6.3, arc in 0.8f64..6.2, count in 4usize..60,
        ) {
            let points: Vec<_> = (0..count)
                .map(|i| on_circle([x, y], radius, start + arc * i as f64 / (count - 1) as f64))
                .collect();
            assert_near(Circle::fit(&points).unwrap(), [x, y], radius, 1e-5 * radius);
        }

        #[test]
        fn points_of_a_line_are_refused(
            x in -100.0f64..100.0, y in -100.0f64..100.0, dx in -9.0f64..9.0, dy in -9.0f64..9.0, count in 3usize..12,
        ) {
            let points: Vec<_> = (0..count).map(|i| [x + dx * i as f64, y + dy * i as f64]).collect();
            prop_assert!(Circle::fit(&points).is_err());
        }
    }

    #[test]
    fn too_few_or_equal_or_impossible_points_are_refused() {
        let p = [3.0, 4.0];
        for points in [
            vec![],
            vec![p],
            vec![p, [5.0, 6.0]],
            vec![p; 3],
            vec![p; 9],
            vec![p, p, [5.0, 6.0]],
            vec![p, [f64::NAN, 1.0], [7.0, 1.0]],
            vec![p, [f64::INFINITY, 1.0], [7.0, 1.0], [9.0, 9.0]],
        ] {
            let error = Circle::fit(&points).unwrap_err().to_string();
            assert!(error.contains("rim"), "{points:?}: {error}");
        }
        assert!(Circle::new([0.0, f64::NAN], 3.0).is_err());
        assert!(Circle::new([0.0, 0.0], 0.0).is_err());
    }

    #[test]
    fn a_least_squares_circle_is_no_better_elsewhere() {
        // Clicks with errors: the sum of squared distances rises in every direction from the fit.
        let points: Vec<_> = (0..17)
            .map(|i| {
                let angle = 0.3 * f64::from(i);
                on_circle([80.0, 60.0], 40.0 + (2.3 * f64::from(i)).sin(), angle)
            })
            .collect();
        let found = Circle::fit(&points).unwrap();
        let cost = |c: Circle| points.iter().map(|&p| c.distance(p.into()).powi(2)).sum::<f64>();
        for (dx, dy, dr) in [(0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01)] {
            for sign in [-1.0, 1.0] {
                let moved = Circle {
                    center_px: [found.center_px[0] + sign * dx, found.center_px[1] + sign * dy],
                    radius_px: found.radius_px + sign * dr,
                };
                assert!(cost(moved) > cost(found));
            }
        }
    }

    #[test]
    fn stray_points_do_not_move_the_agreed_circle() {
        let truth = Circle::new([100.0, 90.0], 50.0).unwrap();
        let points: Vec<DVec2> = (0..200)
            .map(|i| {
                let stray = if i % 3 == 0 { -4.0 } else { 0.0 };
                DVec2::from(on_circle(truth.center_px, 50.0 + stray, 0.1 * f64::from(i)))
            })
            .collect();
        let rough = Circle::new([101.0, 89.5], 49.5).unwrap();
        let (found, deviation) = rough.agreed(&points, 6.0).unwrap();
        assert_near(found, truth.center_px, truth.radius_px, 1e-3);
        assert!(deviation < 0.1);
    }
}
