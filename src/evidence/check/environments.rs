//! Demands of an environment on the lamps: light from directions without a lamp, lights smaller than the lamps,
//! brightness beyond half floats.

use super::check::{Check, Known, Level, Subject};
use super::likeness::likeness_db;
use super::pictures::{Pictures, Pose, sum};
use base::median::median;
use calibration::Calibration;
use glam::Vec3;
use imaging::Image;
use imaging::color::luminance;
use light::EnvironmentWeights;
use light::brightest;
use light::{Environment, Lighting, Rig};
use std::f32::consts::SQRT_2;
use std::sync::Arc;

/// An environment with its turn and grade.
#[derive(Clone, Debug)]
pub struct LitEnvironment {
    pub name: String,
    pub environment: Arc<Environment>,
    pub lighting: Lighting,
    pub yaw_deg: f32,
}

impl PartialEq for LitEnvironment {
    /// True if it is the same light: panoramas are compared by identity, not by their pixels.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.environment, &other.environment)
            && (&self.name, &self.lighting, self.yaw_deg) == (&other.name, &other.lighting, other.yaw_deg)
    }
}

/// Limits for the share of the light from directions without a lamp.
const UNCOVERED: [f32; 2] = [0.05, 0.2];
/// Limits for the likeness of simple shapes, in dB; true pictures are about 8 dB better.
const LIKENESS_DB: [f32; 2] = [27.0, 20.0];
/// Number of brightest areas to check.
const AREAS: usize = 24;
/// Level of pictures: a subject of this albedo in light of the environment's mean radiance is middle grey.
const ALBEDO: f32 = 0.35;
const MIDDLE_GREY: f32 = 0.18;
/// The largest half float.
const HALF_MAX: f32 = 65504.0;
/// Required headroom in stops between the brightest value and the largest half float: frames may be brighter than
/// the poses. The second limit is none.
const HEADROOM: [f32; 2] = [3.0, 0.0];
/// Values below this share of the field's largest lose precision in memory, and are 0 on a GPU.
const SMALLEST: f32 = 1.0 / (1u32 << 29) as f32;
/// Limits for the lost share of a pixel's value: a tenth of the smallest visible difference, and that difference.
const LOST: [f32; 2] = [0.001, 0.01];

/// The checks of an environment.
pub(super) fn checks(
    lit: &LitEnvironment,
    calibration: &Calibration,
    pictures: Option<&Known<Pictures>>,
) -> Vec<Check> {
    let rig = &calibration.rig;
    if !rig.lamps.iter().any(light::Lamp::is_usable) {
        return [Subject::Coverage, Subject::Contrast, Subject::HalfFloats]
            .map(|subject| {
                Check::new(subject, Level::Unknown, "No lamp was seen").remedy("Photograph the mirror balls again")
            })
            .into();
    }
    let mut weights = EnvironmentWeights::new(&lit.environment, rig, lit.lighting.weighting);
    let even = weights.even();
    let unit = ALBEDO / MIDDLE_GREY * mean_radiance(&lit.environment);
    let shown = weights.weights(&lit.lighting, lit.yaw_deg, unit);
    let halves = match pictures {
        Some(Ok(pictures)) => half_floats(&pictures.poses, &shown.per_lamp, &even.per_lamp, lit),
        Some(Err(why)) => Check::unread(Subject::HalfFloats, why),
        None => Check::uncalibrated(Subject::HalfFloats),
    };
    vec![coverage(shown.uncovered), contrast(lit, &mut weights, rig), halves]
}

fn coverage(uncovered: f32) -> Check {
    let [doubtful, bad] = UNCOVERED;
    let level = Level::new(uncovered, doubtful, bad);
    let sentence = format!(
        "{:.1} % of the light comes from directions without a lamp; it goes to the nearest lamps",
        100.0 * uncovered
    );
    Check::new(Subject::Coverage, level, sentence)
        .remedy("Turn the environment's bright side towards the lamps, or choose another environment")
}

fn contrast(lit: &LitEnvironment, weights: &mut EnvironmentWeights, rig: &Rig) -> Check {
    // Grades change both alike, and placed lights are not part of the environment.
    let plain = Lighting {
        weighting: lit.lighting.weighting,
        pitch_deg: lit.lighting.pitch_deg,
        roll_deg: lit.lighting.roll_deg,
        ..Lighting::default()
    };
    let plain_weights = weights.weights(&plain, lit.yaw_deg, 1.0);
    let turn = plain.turn(lit.yaw_deg);
    let likeness = likeness_db(&lit.environment, turn, rig, &plain_weights);
    let [doubtful, bad] = LIKENESS_DB;
    let level = Level::new(-likeness, -doubtful, -bad);
    if level == Level::Unknown {
        return Check::new(Subject::Contrast, level, "The environment is black").remedy("Choose another environment");
    }
    let size = lamp_radius_deg(rig);
    let areas = brightest::areas(&lit.environment, AREAS);
    let small = areas.iter().filter(|area| area.radius_deg() < size);
    let hardest = small.max_by(|a, b| a.share.total_cmp(&b.share));
    let hardest = hardest.map_or(String::new(), |area| {
        format!(
            ". Its strongest small light ({:.0} % of all) is {:.1}° across; the lamps resolve {:.0}°: \
             shadows and highlights will be softer",
            100.0 * area.share,
            2.0 * area.radius_deg(),
            2.0 * size
        )
    });
    let sentence = format!(
        "Simple shapes under the lamps match this light to {likeness:.0} dB{}",
        if level == Level::Good { "" } else { &hardest }
    );
    Check::new(Subject::Contrast, level, sentence)
        .remedy("Accept soft shadows, choose softer light, or photograph the poses under more and smaller lamps")
}

/// Radius in degrees of the smallest light that the lamps can show: a lamp's own, or half the distance to the
/// next one.
fn lamp_radius_deg(rig: &Rig) -> f32 {
    let usable: Vec<&light::Lamp> = rig.lamps.iter().filter(|lamp| lamp.is_usable()).collect();
    let own = median(usable.iter().map(|lamp| SQRT_2 * lamp.spread_deg));
    let spacing = median(usable.iter().enumerate().map(|(i, lamp)| {
        let others = usable.iter().enumerate().filter(|(j, _)| *j != i);
        let angle = |other: Vec3| lamp.direction.angle_between(other).to_degrees();
        others.map(|(_, other)| angle(other.direction)).fold(180.0, f32::min)
    }));
    own.max(0.5 * spacing)
}

pub(super) fn half_floats(poses: &[Pose], weights: &[[f32; 3]], even: &[[f32; 3]], lit: &LitEnvironment) -> Check {
    let mean = mean_radiance(&lit.environment);
    let (mut headroom, mut lost) = (f32::INFINITY, 0.0f32);
    for pose in poses {
        let (mut plain, mut covered) = (0.0, 0.0);
        for (pixel, mask) in sum(&pose.olats, even).pixels.iter().zip(&pose.mask.pixels) {
            plain += mask * luminance(*pixel);
            covered += mask;
        }
        let level = MIDDLE_GREY * covered / (plain * mean);
        let brightest = largest(&sum(&pose.peaks, weights)) * level;
        headroom = headroom.min((HALF_MAX / brightest).log2());
        lost = lost.max(lost_share(pose, weights));
    }
    let [low, none] = HEADROOM;
    let [doubtful, bad] = LOST;
    let level = Level::new(-headroom, -low, -none).worst(Level::new(lost, doubtful, bad));
    if poses.is_empty() || !headroom.is_finite() || lost.is_nan() {
        let sentence = "The poses are black in this light";
        return Check::new(Subject::HalfFloats, Level::Unknown, sentence).remedy("Check the poses and the environment");
    }
    let sentence = format!(
        "The brightest pixel of the poses is {headroom:.1} stops below the largest half float, and \
         predictions in f16 lose at most {:.2} % of a pixel's light",
        100.0 * lost
    );
    Check::new(Subject::HalfFloats, level, sentence)
        .remedy("Keep predictions in f32, and lower the picture's exposure before writing EXR files")
}

/// The largest share of a pixel's light that predictions in f16 lose, because it is too dark beside the brightest
/// lamp.
fn lost_share(pose: &Pose, weights: &[[f32; 3]]) -> f32 {
    let smallest = SMALLEST * pose.peaks.iter().map(largest).fold(0.0, f32::max);
    let dark: Vec<Image> =
        (pose.olats.iter()).map(|olat| olat.map(|pixel| pixel.map(|v| if v < smallest { v } else { 0.0 }))).collect();
    let (lost, all) = (sum(&dark, weights), sum(&pose.olats, weights));
    let pixels = lost.pixels.iter().zip(&all.pixels).zip(&pose.mask.pixels);
    let shares = pixels.filter(|(_, covered)| **covered > 0.5);
    let shares = shares.map(|((lost, all), _)| luminance(*lost) / luminance(*all).max(f32::MIN_POSITIVE));
    shares.fold(0.0, f32::max)
}

fn largest(picture: &Image) -> f32 {
    picture.pixels.iter().flatten().copied().fold(0.0, f32::max)
}

fn mean_radiance(environment: &Environment) -> f32 {
    let energy = environment.energy().map(|e| e as f32 / (4.0 * std::f32::consts::PI));
    luminance(energy)
}
