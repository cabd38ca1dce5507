//! Pictures of the sphere as a disc: the distance from the middle gives the angle from the axis.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A disc in a picture, in pixels. The direction at the angle ψ from the axis is (sin ψ·right, sin ψ·up,
/// `facing`·cos ψ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Middle, from the picture's top left corner.
    pub centre: [f64; 2],
    /// Radius of the disc.
    pub radius: f64,
    /// Angle as a function of the distance.
    pub profile: Profile,
    /// Axis in the middle: 1 for +Z, −1 for −Z.
    pub facing: f64,
}

/// Angle ψ from the axis as a function of the distance from the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// ψ = π · distance / radius.
    Angular,
    /// A mirror ball of radius 1 with the camera 1/`camera` from its centre and the reflected surroundings at
    /// 1/`dome` (0: infinitely far). With the angle of incidence i, the law of sines in the triangles of centre,
    /// hit and camera, and of centre, hit and dome, gives ψ = 2i − asin(camera·sin i) − asin(dome·sin i). The ray
    /// leaves the camera at asin(camera·sin i).
    Ball { camera: f64, dome: f64 },
}

impl Profile {
    /// A ball far from the camera and from everything it reflects: distance / radius = sin(ψ/2).
    pub const FAR_BALL: Self = Self::Ball { camera: 0.0, dome: 0.0 };

    /// The angle at the distance `r` (in radii, at most 1; angular maps continue beyond), and dψ/dr, which is
    /// infinite at a ball's rim.
    pub fn angle(&self, r: f64) -> (f64, f64) {
        match *self {
            Self::Angular => (PI * r, PI),
            Self::Ball { camera: k, dome: q } => {
                let r = r.min(1.0);
                let sin = (r / (1.0 - k * k + k * k * r * r).sqrt()).min(1.0);
                let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
                let (ray, near) = (1.0 - k * k * sin * sin, 1.0 - q * q * sin * sin);
                let psi = 2.0 * sin.asin() - (k * sin).asin() - (q * sin).asin();
                let slope = 2.0 - k * cos / ray.sqrt() - q * cos / near.sqrt();
                // dr/di, from r = sin i · √((1 − k²)/(1 − k² sin² i)).
                let stretch = cos * (1.0 - k * k).sqrt() / (ray * ray.sqrt());
                (psi, slope / stretch)
            }
        }
    }

    /// The distance in radii of an angle; above 1 if the disc does not show it.
    pub fn distance(&self, psi: f64) -> f64 {
        match *self {
            Self::Angular => psi / PI,
            Self::Ball { camera: k, dome: q } => {
                if psi > self.last_angle() {
                    return f64::INFINITY;
                }
                // ψ(i) is convex (its slope grows from 2 − k − q to 2), so Newton steps from beyond the solution
                // approach it without crossing.
                let mut i = (psi / (2.0 - k - q)).min(FRAC_PI_2);
                for _ in 0..30 {
                    let (sin, cos) = i.sin_cos();
                    let slope =
                        2.0 - k * cos / (1.0 - k * k * sin * sin).sqrt() - q * cos / (1.0 - q * q * sin * sin).sqrt();
                    let step = (2.0 * i - (k * sin).asin() - (q * sin).asin() - psi) / slope;
                    i -= step;
                    if step.abs() < 1e-14 {
                        break;
                    }
                }
                let sin = i.max(0.0).sin();
                sin * ((1.0 - k * k) / (1.0 - k * k * sin * sin)).sqrt()
            }
        }
    }

    /// Angle at the rim.
    pub fn last_angle(&self) -> f64 {
        match *self {
            Self::Angular => PI,
            Self::Ball { camera, dome } => PI - camera.asin() - dome.asin(),
        }
    }
}

impl Disc {
    /// Direction at the place (x, y) in pixels, and steradians per square pixel there. With `beyond`, angular maps
    /// continue over the far pole outside their rim.
    pub fn look(&self, x: f64, y: f64, beyond: bool) -> Option<(DVec3, f64)> {
        let (dx, dy) = ((x - self.centre[0]) / self.radius, (y - self.centre[1]) / self.radius);
        let r = dx.hypot(dy);
        if r > 1.0 && !(beyond && self.profile == Profile::Angular) {
            return None;
        }
        // Close to the middle sin ψ / r is the slope.
        let close = r.max(1e-9);
        let (psi, slope) = self.profile.angle(close);
        let sideways = psi.sin() / close;
        let z = self.facing * self.profile.angle(r).0.cos();
        let density = (sideways * slope / (self.radius * self.radius)).abs();
        Some((DVec3::new(sideways * dx, -sideways * dy, z), density))
    }

    /// Place in pixels of a unit direction, if the disc shows it.
    pub fn place(&self, direction: DVec3) -> Option<(f64, f64)> {
        let sideways = direction.x.hypot(direction.y);
        let psi = sideways.atan2(self.facing * direction.z);
        let r = self.profile.distance(psi);
        if r > 1.0 {
            return None;
        }
        // Along the axis every side is equivalent.
        let (right, up) = if sideways > 0.0 { (direction.x / sideways, direction.y / sideways) } else { (1.0, 0.0) };
        let reach = r * self.radius;
        Some((self.centre[0] + reach * right, self.centre[1] - reach * up))
    }

    /// Solid angle of each of `width × height` pixels.
    ///
    /// The solid angle within a closed curve is ∮ (1 − cos ψ) dφ, with φ the angle around the middle. Every edge
    /// between two pixels is integrated once, so one pixel gains exactly what the other loses. The sum over all
    /// pixels is that of the outermost edges: exact if they lie outside the disc.
    pub fn solid_angles(&self, width: usize, height: usize) -> Vec<f64> {
        let horizontal: Vec<f64> = (0..=height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let (x, y) = (x as f64 - self.centre[0], y as f64 - self.centre[1]);
                -self.along(x, x + 1.0, y)
            })
            .collect();
        let vertical: Vec<f64> = (0..height)
            .flat_map(|y| (0..=width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let (x, y) = (x as f64 - self.centre[0], y as f64 - self.centre[1]);
                self.along(y, y + 1.0, x)
            })
            .collect();
        (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                if self.nearest(x, y) >= self.radius {
                    return 0.0;
                }
                let (top, bottom) = (horizontal[i], horizontal[i + width]);
                let (left, right) = (vertical[y * (width + 1) + x], vertical[y * (width + 1) + x + 1]);
                (top + right - bottom - left).max(0.0)
            })
            .collect()
    }

    /// Distance in pixels from the middle to the nearest point of pixel (x, y).
    pub fn nearest(&self, x: usize, y: usize) -> f64 {
        let off = |i: usize, centre: f64| (i as f64 - centre).max(centre - (i + 1) as f64).max(0.0);
        off(x, self.centre[0]).hypot(off(y, self.centre[1]))
    }

    /// Distance in pixels from the middle to the farthest corner of pixel (x, y).
    pub fn farthest(&self, x: usize, y: usize) -> f64 {
        let off = |i: usize, centre: f64| (i as f64 + 0.5 - centre).abs() + 0.5;
        off(x, self.centre[0]).hypot(off(y, self.centre[1]))
    }

    /// ∫ (1 − cos ψ) · c/ρ² dt along a line at distance `c` from the middle, t from `from` to `to`: Gauss–Legendre
    /// quadrature inside the disc, and the arc tangent outside, where ψ is constant.
    fn along(&self, from: f64, to: f64, c: f64) -> f64 {
        if c == 0.0 {
            return 0.0;
        }
        let arc = |a: f64, b: f64| (c * (b - a)).atan2(c * c + a * b);
        let outside = 1.0 - self.profile.last_angle().cos();
        let half = (self.radius - c.abs()) * (self.radius + c.abs());
        if half <= 0.0 {
            return outside * arc(from, to);
        }
        let half = half.sqrt();
        let (low, high) = (from.clamp(-half, half), to.clamp(-half, half));
        let mut sum = outside * (arc(from, low) + arc(high, to));
        if high > low {
            // Nodes and weights of the five-point rule on [−1, 1].
            const RULE: [(f64, f64); 5] = [
                (0.0, 0.568_888_888_888_888_9),
                (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
                (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
                (0.906_179_845_938_664, 0.236_926_885_056_189_08),
                (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
            ];
            let (middle, reach) = (0.5 * (low + high), 0.5 * (high - low));
            for (node, weight) in RULE {
                let rho = (middle + reach * node).hypot(c);
                let sine = (0.5 * self.profile.angle(rho / self.radius).0).sin() / rho;
                sum += weight * reach * 2.0 * c * sine * sine;
            }
        }
        sum
    }
}
