//! View of a photographed mirror ball: its position in the picture and its distance.

use base::error::{Error, Result};
use glam::Vec3;
use light::mapping::{Disc, Kind, Profile, Projection};
use project::Ball;

/// A mirror ball in a photograph.
///
/// +Z points from the ball to the camera. This is the camera's optical axis if the ball is in the middle of the
/// uncropped frame; otherwise directions are rotated by the angle between the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallView {
    /// Centre in pixels from the top left corner of the photograph (0 is the left edge of column 0).
    pub centre_px: [f64; 2],
    /// Radius of the silhouette in pixels, more than 1.
    pub radius_px: f64,
    /// Distance of the camera.
    pub camera: BallCamera,
    /// Distance from the ball's centre to the reflected surroundings in radii of the ball, such as a dome's radius.
    /// Directions are then those from the ball's centre. `None` if the surroundings are far away.
    pub surroundings_radii: Option<f64>,
    /// Reflectance of the ball per channel, 0 < ρ ≤ 1.
    pub reflectivity: [f32; 3],
}

/// Distance of the camera in one of its forms. The half angle σ of the silhouette relates them: sin σ = radius /
/// distance = 1 / `ball_radii`, and tan σ = `radius_px` / focal length in pixels. The focal length is half the
/// frame over the tangent of half the field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BallCamera {
    /// Infinitely far: all rays are parallel.
    Far,
    /// Distance from the camera to the ball's centre in radii of the ball; more than 1.
    Distance { ball_radii: f64 },
    /// Focal length in pixels: millimetres divided by the sensor's width, times the uncropped photograph's width in
    /// pixels.
    FocalLength { px: f64 },
    /// Field of view in degrees across `frame_px` pixels of the uncropped photograph.
    FieldOfView { degrees: f64, frame_px: f64 },
}

impl BallCamera {
    /// Distance from the camera to the ball's centre in radii of the ball, for a silhouette of `radius_px`;
    /// infinite for a far camera.
    pub fn distance_radii(&self, radius_px: f64) -> f64 {
        match *self {
            Self::Far => f64::INFINITY,
            Self::Distance { ball_radii } => ball_radii,
            // 1/sin(atan(t)) = √(1 + 1/t²).
            Self::FocalLength { px } => (px / radius_px).hypot(1.0),
            Self::FieldOfView { degrees, frame_px } => {
                let px = 0.5 * frame_px / (0.5 * degrees.to_radians()).tan();
                Self::FocalLength { px }.distance_radii(radius_px)
            }
        }
    }

    /// Focal length in pixels; infinite for a far camera.
    pub fn focal_px(&self, radius_px: f64) -> f64 {
        let distance = self.distance_radii(radius_px);
        radius_px * ((distance - 1.0) * (distance + 1.0)).sqrt()
    }

    fn is_possible(&self, radius_px: f64) -> bool {
        let lens = match *self {
            Self::Far | Self::Distance { .. } => true,
            Self::FocalLength { px } => px > 0.0 && px.is_finite(),
            Self::FieldOfView { degrees, frame_px } => {
                degrees > 0.0 && degrees < 180.0 && frame_px > 0.0 && frame_px.is_finite()
            }
        };
        // At the surface nothing is visible; NaN is not more than 1.
        lens && self.distance_radii(radius_px) > 1.0
    }
}

impl BallView {
    /// The ball of a shoot as a perfect mirror. With the dome's radius in metres, directions are those to the dome.
    pub fn new(ball: &Ball, dome_radius_m: Option<f32>) -> Self {
        let radii = |metres: f32| f64::from(metres) / f64::from(ball.radius_m);
        Self {
            centre_px: ball.center_px.map(f64::from),
            radius_px: f64::from(ball.radius_px),
            camera: BallCamera::Distance { ball_radii: radii(ball.camera_distance_m) },
            surroundings_radii: dome_radius_m.map(radii),
            reflectivity: [1.0; 3],
        }
    }

    /// Half angle in degrees of the cone behind the ball that its silhouette hides.
    pub fn blind_half_angle_deg(&self) -> f64 {
        180.0 - self.profile().last_angle().to_degrees()
    }

    /// Place of a direction in a photograph of `size` pixels; `None` if the photograph does not show it.
    pub fn place(&self, direction: Vec3, size: (usize, usize)) -> Option<[f32; 2]> {
        let (x, y) = self.projection(size).ok()?.place(direction.as_dvec3())?;
        Some([x as f32, y as f32])
    }

    /// Angle from the axis as a function of the distance from the ball's middle.
    pub(super) fn profile(&self) -> Profile {
        Profile::Ball {
            camera: 1.0 / self.camera.distance_radii(self.radius_px),
            dome: self.surroundings_radii.map_or(0.0, f64::recip),
        }
    }

    /// Projection of a photograph of `width × height` pixels.
    ///
    /// # Errors
    /// When the ball's values are out of range.
    pub(super) fn projection(&self, (width, height): (usize, usize)) -> Result<Projection> {
        let possible = self.centre_px.iter().all(|c| c.is_finite())
            && self.radius_px > 1.0
            && self.radius_px.is_finite()
            && self.camera.is_possible(self.radius_px)
            && self.surroundings_radii.is_none_or(|radii| radii > 1.0)
            && self.reflectivity.iter().all(|r| *r > 0.0 && *r <= 1.0);
        if possible {
            return Ok(Projection {
                width,
                height,
                kind: Kind::Disc(Disc {
                    centre: self.centre_px,
                    radius: self.radius_px,
                    profile: self.profile(),
                    facing: 1.0,
                }),
            });
        }
        let [x, y] = self.centre_px;
        let [r, g, b] = self.reflectivity;
        Err(Error::invalid(
            format!(
                "the mirror ball is invalid (centre {x}, {y}, radius {} pixels, camera {} radii away, reflectivity \
                 {r}, {g}, {b}): its radius must be more than one pixel, camera and surroundings outside the ball, and \
                 its reflectivity above 0 and up to 1",
                self.radius_px,
                self.camera.distance_radii(self.radius_px)
            ),
            "Correct the ball's centre, radius, distance or reflectivity",
        ))
    }
}
