//! Geometry of the mirror ball: direction and solid angle of each pixel of its photograph.
//!
//! The camera is on +Z at a known distance, and the optical axis passes through the ball's centre, at the subject's
//! place. Rays are perspective: the silhouette's half angle is asin(r/d).

use base::error::{Error, Result};
use glam::{DVec2, Vec3};
use project::Ball;

/// A mirror ball in a photograph.
#[derive(Clone, Debug)]
pub struct MirrorBall {
    /// Pixels fully on the ball, row by row.
    pub pixels: Vec<BallPixel>,
    /// Radius of the silhouette in pixels.
    pub radius_px: f32,
    /// Half angle in degrees of the cone behind the ball (about −Z) that no pixel shows.
    pub blind_half_angle_deg: f32,
    /// Share of the sphere that no pixel shows: the cone and the part cut off by the frame.
    pub blind_share: f32,
}

/// One pixel of the ball.
#[derive(Clone, Copy, Debug)]
pub struct BallPixel {
    /// Index in the photograph: row · width + column.
    pub index: usize,
    /// Unit direction from the subject that the pixel's centre reflects.
    pub direction: Vec3,
    /// Solid angle of the pixel in steradians.
    pub solid_angle: f32,
}

/// Largest radius of a ball, in longer sides of its photograph. A larger ball shows hardly any of the sphere.
pub(super) const LARGEST: f32 = 2.0;
/// Distance in radii that counts as infinite: rays are parallel within a millionth.
const FARTHEST: f64 = 1e6;

impl MirrorBall {
    /// The ball in a photograph of `width × height` pixels. With a known dome radius in metres, directions are
    /// those from the subject to the dome. Otherwise lamps are taken to be infinitely far; the error is at most the
    /// ball's radius over the lamps' distance.
    ///
    /// # Errors
    /// When the ball's figures are out of range or no pixel of the photograph shows it.
    pub fn new(ball: &Ball, dome_radius_m: Option<f32>, (width, height): (usize, usize)) -> Result<Self> {
        let is_beyond = |metres: f32| metres.is_finite() && metres > ball.radius_m;
        let possible = ball.center_px.iter().all(|at| at.is_finite())
            && ball.radius_px > 1.0
            && ball.radius_px <= LARGEST * width.max(height) as f32
            && ball.radius_m > 0.0
            && is_beyond(ball.camera_distance_m)
            && dome_radius_m.is_none_or(is_beyond);
        let [x, y] = ball.center_px;
        if !possible {
            let dome = dome_radius_m.map_or(String::new(), |metres| format!(", dome {metres} m"));
            return Err(Error::invalid(
                format!(
                    "the mirror ball in project.toml is invalid (centre {x}, {y}, radius {} pixels or {} m, camera {} m \
                     away{dome}): its radius must be more than one pixel and at most {LARGEST} times the longer side of \
                     the photograph of {width} × {height} pixels, and the ball smaller than the dome and the camera's \
                     distance",
                    ball.radius_px, ball.radius_m, ball.camera_distance_m
                ),
                "Correct the ball's centre, radius and camera distance, and the dome's radius",
            ));
        }
        let reach = f64::from(ball.radius_px);
        // A pixel with its centre this far inside has all corners inside.
        let inner = reach - std::f64::consts::FRAC_1_SQRT_2;
        let mut pixels = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let dx = x as f64 + 0.5 - f64::from(ball.center_px[0]);
                let dy = y as f64 + 0.5 - f64::from(ball.center_px[1]);
                let rho = dx.hypot(dy);
                if rho > inner {
                    continue;
                }
                let seen = reflected(ball, dome_radius_m, rho);
                let sideways = if rho > 0.0 { seen.x / rho } else { 0.0 };
                // dω = 2π·d(−cos ψ) over dA = π·d(ρ²): the mean over the ring one pixel wide.
                let (near, far) = ((rho - 0.5).max(0.0), (rho + 0.5).min(reach));
                let cosines = reflected(ball, dome_radius_m, near).y - reflected(ball, dome_radius_m, far).y;
                pixels.push(BallPixel {
                    index: y * width + x,
                    direction: Vec3::new((sideways * dx) as f32, (-sideways * dy) as f32, seen.y as f32),
                    solid_angle: (2.0 * cosines / (far * far - near * near)) as f32,
                });
            }
        }
        if pixels.is_empty() {
            return Err(Error::invalid(
                format!(
                    "the mirror ball in project.toml, centre {x}, {y} and radius {} pixels, is outside the photograph \
                     of {width} × {height} pixels",
                    ball.radius_px
                ),
                "Correct the ball's centre and radius",
            ));
        }
        let shown: f64 = pixels.iter().map(|p| f64::from(p.solid_angle)).sum();
        let edge = reflected(ball, dome_radius_m, inner);
        Ok(Self {
            pixels,
            radius_px: ball.radius_px,
            blind_half_angle_deg: edge.x.atan2(-edge.y).to_degrees() as f32,
            blind_share: (1.0 - shown / (4.0 * std::f64::consts::PI)).max(0.0) as f32,
        })
    }
}

/// Unit direction reflected by the ball at `rho` pixels from its centre, as (away from the axis, along +Z). The
/// problem is the same in every plane through the axis.
fn reflected(ball: &Ball, dome_radius_m: Option<f32>, rho: f64) -> DVec2 {
    let r = f64::from(ball.radius_m);
    let d = f64::from(ball.camera_distance_m).min(FARTHEST * r);
    let focal_px = f64::from(ball.radius_px) / (r / d).asin().tan();
    let ray = DVec2::new(rho, -focal_px).normalize();
    let camera = DVec2::new(0.0, d);
    // The ray passes the centre at distance `miss`, which is the radius at the silhouette.
    let miss = d * ray.x;
    let hit = camera - (camera.dot(ray) + ((r - miss) * (r + miss)).max(0.0).sqrt()) * ray;
    let normal = hit / r;
    let mirrored = ray - 2.0 * ray.dot(normal) * normal;
    match dome_radius_m {
        None => mirrored,
        Some(dome) => {
            let along = hit.dot(mirrored);
            let t = (along * along + f64::from(dome).powi(2) - hit.length_squared()).max(0.0).sqrt() - along;
            (hit + t * mirrored).normalize()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Ball = Ball { center_px: [128.0, 128.0], radius_px: 116.0, radius_m: 0.075, camera_distance_m: 4.0 };

    fn pixel(ball: &MirrorBall, x: usize, y: usize) -> BallPixel {
        *ball.pixels.iter().find(|p| p.index == y * 256 + x).expect("the pixel is on the ball")
    }

    #[test]
    fn the_middle_shows_the_camera_and_the_rim_what_is_behind() {
        let ball = MirrorBall::new(&BALL, Some(4.0), (256, 256)).unwrap();
        assert!(pixel(&ball, 128, 128).direction.distance(Vec3::Z) < 0.02);
        assert!(pixel(&ball, 242, 128).direction.z < -0.9);
        assert!((5.0..20.0).contains(&ball.blind_half_angle_deg), "{}", ball.blind_half_angle_deg);
    }

    #[test]
    fn up_is_up_and_right_is_right() {
        let ball = MirrorBall::new(&BALL, None, (256, 256)).unwrap();
        assert!(pixel(&ball, 128, 64).direction.y > 0.5);
        assert!(pixel(&ball, 192, 128).direction.x > 0.5);
    }

    #[test]
    fn a_far_camera_sees_the_textbooks_ball() {
        // Orthographic: n = (x, y, √(1−r²)), R = 2(n·v)n − v, and 4·dA steradians a pixel.
        let far = Ball { camera_distance_m: 1e5, ..BALL };
        let ball = MirrorBall::new(&far, None, (256, 256)).unwrap();
        for p in &ball.pixels {
            let (x, y) = ((p.index % 256) as f32 + 0.5 - 128.0, 127.5 - (p.index / 256) as f32);
            let n = Vec3::new(x, y, 0.0) / 116.0;
            let n = n.with_z((1.0 - n.length_squared()).sqrt());
            assert!((2.0 * n.z * n - Vec3::Z).distance(p.direction) < 1e-3);
            assert!((p.solid_angle * 116.0 * 116.0 / 4.0 - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn pixels_and_the_blind_cone_make_a_sphere() {
        for (size, dome) in [(256, Some(4.0)), (256, None), (64, Some(2.0))] {
            let scale = size as f32 / 256.0;
            let scaled = Ball { center_px: [128.0 * scale; 2], radius_px: 116.0 * scale, ..BALL };
            let ball = MirrorBall::new(&scaled, dome, (size, size)).unwrap();
            let cone = (1.0 - ball.blind_half_angle_deg.to_radians().cos()) / 2.0;
            // The outermost pixels only approximate a circle and miss part of one ring.
            let ring = 2.0 / (116.0 * scale);
            assert!((ball.blind_share - cone).abs() < ring, "{} and {cone}", ball.blind_share);
            assert!(ball.pixels.iter().all(|p| p.solid_angle > 0.0 && (p.direction.length() - 1.0).abs() < 1e-5));
        }
    }

    #[test]
    fn a_ball_that_the_frame_cuts_says_what_is_missing() {
        let cut = Ball { center_px: [0.0, 128.0], ..BALL };
        let ball = MirrorBall::new(&cut, None, (256, 256)).unwrap();
        assert!((0.45..0.55).contains(&ball.blind_share));
    }

    #[test]
    fn an_impossible_ball_is_refused() {
        for ball in [
            Ball { radius_px: 0.0, ..BALL },
            Ball { radius_m: 5.0, ..BALL },
            Ball { camera_distance_m: f32::NAN, ..BALL },
            Ball { center_px: [900.0, 900.0], ..BALL },
            Ball { radius_px: 513.0, ..BALL },
            Ball { radius_px: 1e10, ..BALL },
            Ball { radius_px: f32::INFINITY, ..BALL },
            Ball { center_px: [f32::NAN, 128.0], ..BALL },
            Ball { radius_m: -0.075, ..BALL },
            Ball { camera_distance_m: f32::INFINITY, ..BALL },
        ] {
            assert!(MirrorBall::new(&ball, None, (256, 256)).is_err(), "{ball:?}");
        }
        for dome in [0.01, -4.0, f32::NAN, 1e39f64 as f32] {
            assert!(MirrorBall::new(&BALL, Some(dome), (256, 256)).is_err(), "{dome}");
        }
    }

    #[test]
    fn lengths_of_any_size_give_directions() {
        for (radius_m, camera_distance_m, dome) in
            [(1e-30, 1e30, None), (1e-30, 1e30, Some(1e30)), (1e30, 2e30, Some(1.1e30)), (1e-40, 2e-40, Some(f32::MAX))]
        {
            let ball = Ball { radius_m, camera_distance_m, ..BALL };
            let ball = MirrorBall::new(&ball, dome, (256, 256)).unwrap();
            let sound = |p: &BallPixel| p.solid_angle > 0.0 && (p.direction.length() - 1.0).abs() < 1e-5;
            assert!(ball.pixels.iter().all(sound), "{radius_m}, {dome:?}");
        }
    }
}
