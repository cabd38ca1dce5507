//! Two photographs of the ball from different sides, joined so that neither camera shows.
//!
//! Every direction mixes the two by their quality there. A ball has weight 0 near its own camera, which is
//! reflected in its middle, and near its blind cone, and less towards the rim, where pixels are stretched. With
//! cameras about a right angle apart, each ball shows well the part that the other misses.

use super::super::minimizer::{Search, minimise};
use super::{Ball, BallView, ClippedLight, FilledPanorama, Photograph, filled};
use base::error::{Error, Result};
use glam::{DQuat, DVec3, Quat, Vec3};
use imaging::Image;
use imaging::color::luminance;
use light::latlong::{texel_direction, texel_solid_angle};
use light::{Environment, Mapping};

/// Settings for joining two balls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoBallsSettings {
    /// Size of the panorama.
    pub size: (usize, usize),
    /// Half angle in degrees of the excluded cone around each camera: the camera, its stand and its operator.
    pub camera_half_angle_deg: f32,
    /// Width in degrees of the soft edge around excluded parts.
    pub feather_deg: f32,
    /// True to refine the given rotation until the two pictures agree.
    pub refine: bool,
    /// Treatment of clipped light.
    pub clipped: ClippedLight,
}

impl Default for TwoBallsSettings {
    fn default() -> Self {
        Self {
            size: (1024, 512),
            camera_half_angle_deg: 15.0,
            feather_deg: 15.0,
            refine: true,
            clipped: ClippedLight::Keep,
        }
    }
}

/// Two joined balls, with quality figures.
#[derive(Clone, Debug)]
pub struct TwoBalls {
    /// Radiance as a lat-long panorama in the first camera's frame and exposure.
    pub panorama: Image,
    /// Brightness ratio of the second photograph to the first, measured where both show the same light.
    pub exposure_ratio: f32,
    /// Median difference in stops between the two after that, where both show a direction. More than noise means
    /// moved lights, a wrong rotation or near objects.
    pub disagreement_stops: f32,
    /// Rotation used, from the second camera's frame to the first's.
    pub turn: Quat,
    /// Angle in degrees between the used and the given rotation; 0 without refinement.
    pub refined_deg: f32,
    /// Share of the sphere that neither photograph shows away from its camera and rim.
    pub blind_share: f32,
    /// Share of the panorama's luminous energy filled in there.
    pub filled_share: f32,
    /// Number of ball pixels with a clipped channel in each photograph.
    pub clipped_pixels: [usize; 2],
    /// [`super::LightProbe::unestimated_pixels`] of each photograph.
    pub unestimated_pixels: [usize; 2],
    /// [`super::LightProbe::estimated_energy_share`] of each photograph.
    pub estimated_energy_share: [f32; 2],
    /// Number of repaired pixels of each photograph: NaN, infinite or negative.
    pub repaired_pixels: [usize; 2],
}

/// Width of the compared panoramas.
const COMPARED: usize = 128;
/// Largest refinement in degrees. More would be another rotation, not a correction.
const FARTHEST_DEG: f32 = 10.0;

/// Joins two photographs of a ball. `turn` maps directions of the second camera's frame to the first's:
/// `Quat::from_rotation_y(ψ)` for a second camera at the same height, ψ to the right of the first as seen from the
/// first (towards +X).
///
/// # Errors
/// As [`super::light_probe`], for either photograph, and when the rotation or an angle is NaN or infinite.
pub fn merge_balls(
    photographs: [(&Photograph, &BallView); 2],
    turn: Quat,
    settings: &TwoBallsSettings,
) -> Result<TwoBalls> {
    let angles = [settings.camera_half_angle_deg, settings.feather_deg];
    let sensible = angles.iter().all(|a| (0.0..=90.0).contains(a));
    if !(sensible && turn.is_finite() && turn.length_squared() > 0.5) {
        return Err(Error::invalid(
            format!("invalid rotation {turn:?} or angles {angles:?} between two mirror balls"),
            "Give the angle between the two cameras in degrees, and angles from 0 to 90",
        ));
    }
    let given = turn.normalize();
    let [(first, first_view), (second, second_view)] = photographs;
    let first = Side::new(first, first_view, settings)?;
    let second = Side::new(second, second_view, settings)?;
    let coarse = (COMPARED, COMPARED / 2);
    let overlap = Overlap {
        panoramas: [
            Environment::from_radiance("", first.ball.unwrapped(coarse, DQuat::IDENTITY)?.0),
            Environment::from_radiance("", second.ball.unwrapped(coarse, DQuat::IDENTITY)?.0),
        ],
        sides: [&first, &second],
    };
    let turn = if settings.refine { overlap.refined(given) } else { given };
    let (ratio, disagreement) = overlap.ratio(turn).unwrap_or((0.0, 0.0));
    let size = settings.size;
    let (ours, ours_shown) = first.ball.unwrapped(size, DQuat::IDENTITY)?;
    let (theirs, theirs_shown) = second.ball.unwrapped(size, turn.as_dquat())?;
    let back = turn.inverse();
    let gain = (-ratio).exp2();
    let mut panorama = Image::filled(size.0, size.1, [0.0; 3]);
    let mut shown = vec![0.0f32; panorama.pixels.len()];
    for (i, pixel) in panorama.pixels.iter_mut().enumerate() {
        let direction = texel_direction(i % size.0, i / size.0, size.0, size.1);
        let a = first.weight(direction) * ours_shown[i];
        let b = second.weight(back * direction) * theirs_shown[i];
        if a + b > 0.0 {
            let (a, b) = (a / (a + b), gain * b / (a + b));
            *pixel = [0, 1, 2].map(|c| a * ours.pixels[i][c] + b * theirs.pixels[i][c]);
            shown[i] = 1.0;
        }
    }
    let FilledPanorama { panorama, filled_share, blind_share } =
        filled(panorama, &shown, &Mapping::LatLong.solid_angles(size)?);
    let balls = [&first.ball, &second.ball];
    Ok(TwoBalls {
        panorama,
        exposure_ratio: ratio.exp2(),
        disagreement_stops: disagreement,
        turn,
        refined_deg: given.angle_between(turn).to_degrees(),
        blind_share,
        filled_share,
        clipped_pixels: balls.map(|ball| ball.clipped),
        unestimated_pixels: balls.map(|ball| ball.estimate.unestimated_pixels),
        estimated_energy_share: balls.map(|ball| ball.estimate.energy_share),
        repaired_pixels: photographs.map(|(photograph, _)| photograph.repaired_pixels),
    })
}

/// One photograph and the range in which it counts.
struct Side {
    ball: Ball,
    /// Excluded half angles in radians around the camera and around the blind cone.
    camera: f32,
    blind: f32,
    feather: f32,
}

impl Side {
    fn new(photograph: &Photograph, view: &BallView, settings: &TwoBallsSettings) -> Result<Self> {
        let ball = Ball::new(photograph, view, settings.clipped)?;
        // Rim pixels are cut: the outermost full ones are up to one and a half pixels inside.
        let rim = ball.angle_at(1.0 - 1.5 / view.radius_px);
        Ok(Self {
            ball,
            camera: settings.camera_half_angle_deg.to_radians(),
            blind: (std::f64::consts::PI - rim) as f32,
            feather: settings.feather_deg.to_radians().max(1e-3),
        })
    }

    /// Weight of this side for a direction in its own frame.
    fn weight(&self, direction: Vec3) -> f32 {
        let angle = direction.angle_between(Vec3::Z);
        let behind = std::f32::consts::PI - angle;
        let edge = |beyond: f32| {
            let t = (beyond / self.feather).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        // Towards the rim a pixel spans 1/cos(angle/2) times as far as in the middle.
        let sharpness = (0.5 * angle).cos().powi(2);
        edge(angle - self.camera) * edge(behind - self.blind) * sharpness
    }
}

/// Both photographs at a size that is quick to compare.
struct Overlap<'a> {
    /// Each in its own camera's frame.
    panoramas: [Environment; 2],
    sides: [&'a Side; 2],
}

impl Overlap<'_> {
    /// log2 of second over first in each direction shown by both, with weights.
    fn differences(&self, turn: Quat) -> Vec<(f32, f32)> {
        let back = turn.inverse();
        let (width, height) = self.panoramas[0].radiance.size();
        (0..width * height)
            .filter_map(|i| {
                let (x, y) = (i % width, i / width);
                let direction = texel_direction(x, y, width, height);
                let theirs = back * direction;
                let weight = self.sides[0].weight(direction) * self.sides[1].weight(theirs);
                let (a, b) =
                    (luminance(self.panoramas[0].radiance(direction)), luminance(self.panoramas[1].radiance(theirs)));
                (weight > 0.0 && a > 0.0 && b > 0.0).then(|| {
                    let angle = texel_solid_angle(y, width, height) as f32;
                    ((b / a).log2(), weight * angle)
                })
            })
            .collect()
    }

    /// Median of log2 (second over first), and the median distance from it; `None` without overlap.
    fn ratio(&self, turn: Quat) -> Option<(f32, f32)> {
        let mut differences = self.differences(turn);
        let ratio = weighted_median(&mut differences)?;
        for (difference, _) in &mut differences {
            *difference = (*difference - ratio).abs();
        }
        Some((ratio, weighted_median(&mut differences)?))
    }

    /// Rotation near the given one with the best agreement.
    fn refined(&self, given: Quat) -> Quat {
        let turned = |[x, y, z]: [f64; 3]| DQuat::from_scaled_axis(DVec3::new(x, y, z)).as_quat() * given;
        // Above every real value: the search needs finite numbers.
        const BEYOND: f64 = 2.0;
        let cost = |offset: [f64; 3]| {
            if DVec3::from_array(offset).length() > f64::from(FARTHEST_DEG).to_radians() {
                return BEYOND;
            }
            let mut differences = self.differences(turned(offset));
            let Some(ratio) = weighted_median(&mut differences) else { return BEYOND };
            // Differences of more than a stop have other causes than an inexact rotation.
            let (mut sum, mut weights) = (0.0f64, 0.0f64);
            for (difference, weight) in differences {
                sum += f64::from(weight * (difference - ratio).abs().min(1.0));
                weights += f64::from(weight);
            }
            sum / weights
        };
        let start = cost([0.0; 3]);
        let step = 2.0f64.to_radians();
        let farthest = f64::from(FARTHEST_DEG).to_radians();
        let search = Search {
            start: [0.0; 3],
            low: [-farthest; 3],
            high: [farthest; 3],
            first_step: step,
            last_step: 1e-3 * step,
            evaluations: 150,
        };
        match minimise(cost, &search) {
            // Noise alone always leaves a small improvement.
            Ok((offset, best)) if best < 0.98 * start => turned(offset),
            _ => given,
        }
    }
}

/// Weighted median; `None` without values. Sorts the values.
fn weighted_median(values: &mut [(f32, f32)]) -> Option<f32> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f32>();
    let mut sum = 0.0;
    let found = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    found.map(|(value, _)| *value)
}
