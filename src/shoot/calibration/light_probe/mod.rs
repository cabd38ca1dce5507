//! Light probes from photographs of a mirror ball: lat-long panoramas of radiance.
//!
//! [`Photograph`] is a picture as linear light, [`merge`] merges an exposure bracket, [`light_probe`] unwraps the
//! ball, and [`merge_balls`] joins two balls so that neither camera shows. Every result reports light that was not
//! measured: filled in behind the ball, estimated where the picture was clipped, or repaired. All panoramas are in
//! the frame of [`light::latlong`], with the (first) camera on +Z.

mod bracket;
mod clipped;
mod fill;
mod photograph;
#[cfg(test)]
mod picture;
#[cfg(test)]
mod tests;
mod two_balls;
mod view;

pub use bracket::{Bracket, Exposure, measured_stops, merge};
pub use photograph::Photograph;
pub use two_balls::{TwoBalls, TwoBallsSettings, merge_balls};
pub use view::{BallCamera, BallView};

use base::error::{Error, Result};
use glam::DQuat;
use imaging::color::luminance;
use imaging::{Image, Raster};
use light::Mapping;
use light::mapping::{Kind, resample};

/// Treatment of light clipped in the photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClippedLight {
    /// Use the clipped values and count the pixels.
    #[default]
    Keep,
    /// Estimate clipped lamps from their unclipped flanks; see [`LightProbe::estimated_energy_share`].
    Estimate,
}

/// A light probe from one photograph of a mirror ball, with quality figures.
#[derive(Clone, Debug)]
pub struct LightProbe {
    /// Radiance from every direction as a lat-long panorama, divided by the ball's reflectivity. Finite and not
    /// negative. The middle is the camera's view behind the ball.
    pub panorama: Image,
    /// Number of pixels fully on the ball and within the frame.
    pub ball_pixels: usize,
    /// Mean angle in degrees between neighbouring pixels' directions: the square root of a pixel's mean solid
    /// angle.
    pub resolution_deg: f32,
    /// Half angle in degrees of the cone behind the ball that its silhouette hides.
    pub blind_half_angle_deg: f32,
    /// Share of the sphere that no pixel shows: the cone, the cut pixels of the rim, and the part cut off by the
    /// frame.
    pub blind_share: f32,
    /// Share of the panorama's luminous energy filled in there.
    pub filled_share: f32,
    /// Number of ball pixels with a clipped channel: their light is at least as strong as shown.
    pub clipped_pixels: usize,
    /// Number of these pixels left unchanged because they could not be estimated; 0 without an estimate.
    pub unestimated_pixels: usize,
    /// Estimated share of the ball's luminous energy, assuming that a clipped lamp's image is one elliptic Gaussian
    /// lobe over a uniform background. A flatter lamp is overestimated.
    pub estimated_energy_share: f32,
    /// Number of repaired pixels of the photograph: NaN, infinite or negative.
    pub repaired_pixels: usize,
}

/// Unwraps a mirror ball's photograph into a lat-long panorama of `size` pixels.
///
/// # Errors
/// When the ball's values are out of range, no pixel lies fully on the ball, or the size is empty.
pub fn light_probe(
    photograph: &Photograph,
    view: &BallView,
    clipped: ClippedLight,
    size: (usize, usize),
) -> Result<LightProbe> {
    let ball = Ball::new(photograph, view, clipped)?;
    let (panorama, shown) = ball.unwrapped(size, DQuat::IDENTITY)?;
    let angles = Mapping::LatLong.solid_angles(size)?;
    let FilledPanorama { panorama, filled_share, blind_share } = filled(panorama, &shown, &angles);
    Ok(LightProbe {
        panorama,
        ball_pixels: ball.pixels,
        resolution_deg: ((1.0 - blind_share) as f64 * 4.0 * std::f64::consts::PI / ball.pixels as f64)
            .sqrt()
            .to_degrees() as f32,
        blind_half_angle_deg: view.blind_half_angle_deg() as f32,
        blind_share,
        filled_share,
        clipped_pixels: ball.clipped,
        unestimated_pixels: ball.estimate.unestimated_pixels,
        estimated_energy_share: ball.estimate.energy_share,
        repaired_pixels: photograph.repaired_pixels,
    })
}

/// A ball's radiance, prepared for unwrapping.
struct Ball {
    radiance: Image,
    /// 1 for pixels fully on the ball, else 0.
    usable: Vec<f32>,
    view: BallView,
    pixels: usize,
    clipped: usize,
    estimate: clipped::Estimate,
}

impl Ball {
    fn new(photograph: &Photograph, view: &BallView, clipped: ClippedLight) -> Result<Self> {
        let projection = view.projection(photograph.size())?;
        let width = projection.width;
        let on_ball = |i: usize| match &projection.kind {
            Kind::Disc(disc) => disc.farthest(i % width, i / width) <= disc.radius,
            _ => false,
        };
        let usable: Vec<f32> = (0..photograph.light.pixels.len()).map(|i| f32::from(u8::from(on_ball(i)))).collect();
        let pixels = usable.iter().filter(|u| **u > 0.0).count();
        if pixels == 0 {
            let (width, height) = photograph.size();
            let [x, y] = view.centre_px;
            return Err(Error::invalid(
                format!(
                    "the mirror ball at {x}, {y} with radius {} covers no full pixel of the {width} × {height} photograph",
                    view.radius_px
                ),
                "Correct the ball's centre and radius, or photograph the ball from closer",
            ));
        }
        let channels = photograph.clipped.pixels.iter().zip(&usable);
        let count = channels.filter(|(clipped, usable)| **usable > 0.0 && clipped.contains(&true)).count();
        let mut light = photograph.light.clone();
        let mut estimate = clipped::Estimate::default();
        if clipped == ClippedLight::Estimate && count > 0 {
            let angles = projection.solid_angles();
            estimate = clipped::estimate(&mut light, &photograph.clipped, &usable, &angles);
        }
        let radiance = light.map(|pixel| [0, 1, 2].map(|c| pixel[c] / view.reflectivity[c]));
        Ok(Self { radiance, usable, view: *view, pixels, clipped: count, estimate })
    }

    /// Angle from the camera in radians at a distance from the ball's middle in radii.
    fn angle_at(&self, r: f64) -> f64 {
        self.view.profile().angle(r.max(0.0)).0
    }

    /// The ball unwrapped to a panorama with the world rotated, and the visible share of each texel.
    fn unwrapped(&self, size: (usize, usize), turn: DQuat) -> Result<(Image, Vec<f32>)> {
        let target = Mapping::LatLong.projection(size)?;
        let source = self.view.projection(self.radiance.size())?;
        let resampled = resample(&self.radiance, &source, &self.usable, &target, turn);
        Ok((resampled.image, resampled.shown))
    }
}

/// A panorama whose unseen texels are filled in.
struct FilledPanorama {
    panorama: Image,
    /// Filled-in share of its luminous energy.
    filled_share: f32,
    /// Filled-in share of the sphere.
    blind_share: f32,
}

/// Fills unseen texels.
fn filled(mut panorama: Image, shown: &[f32], angles: &Raster<f64>) -> FilledPanorama {
    let seen: Vec<bool> = shown.iter().map(|s| *s > 0.0).collect();
    fill::fill(&mut panorama, &seen);
    let (mut all, mut filled, mut sphere, mut blind) = (0.0, 0.0, 0.0, 0.0);
    for ((pixel, shown), angle) in panorama.pixels.iter().zip(shown).zip(&angles.pixels) {
        let energy = angle * f64::from(luminance(*pixel));
        let hidden = f64::from(1.0 - shown);
        all += energy;
        filled += hidden * energy;
        sphere += angle;
        blind += hidden * angle;
    }
    let share = |part: f64, all: f64| if all > 0.0 { (part / all) as f32 } else { 0.0 };
    FilledPanorama { panorama, filled_share: share(filled, all), blind_share: share(blind, sphere) }
}
