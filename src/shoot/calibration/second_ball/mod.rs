//! Two mirror balls under the same lamps: one rig from both, and the distance of near lamps.
//!
//! Both balls show a far lamp in one direction. They show a near lamp in two directions, which intersect at the
//! lamp if the balls' positions are known.

use super::code_values::ResponseTable;
use super::highlight::NEAR_DEG;
use super::mirror_ball::MirrorBall;
use super::probe::{Probes, footprints, measure};
use super::silhouette;
use base::error::{Error, Result};
use base::median::median;
use base::progress::Progress;
use glam::{DMat3, DQuat, DVec3, Vec3};
use light::{Lamp, Rig};
use project::{Picture, Project, SecondBall};
use serde::{Deserialize, Serialize};

/// Joint result of two balls.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwoBalls {
    /// Number of lamps on both balls.
    pub lamps: usize,
    /// Median disagreement per lamp in degrees: the angle between its two directions, or, with known ball
    /// positions, half the angle by which the two lines of sight miss each other.
    pub median_deg: f32,
    /// Largest of these angles.
    pub worst_deg: f32,
    /// Lamps near enough for their distance to be measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub near: Vec<NearLamp>,
}

/// Position of a near lamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearLamp {
    /// Name of its OLAT.
    pub name: String,
    /// Position in metres from the subject: right, up, towards the camera.
    pub position_m: Vec3,
    /// Standard deviation of its distance in metres.
    pub deviation_m: f32,
}

impl TwoBalls {
    /// Summary sentence.
    pub fn sentence(&self) -> String {
        let near = match self.near.len() {
            0 => String::new(),
            near => format!(". The distance of {near} follows from parallax"),
        };
        format!(
            "Two mirror balls show {} of the lamps and agree within {:.1}° (median; {:.1}° at most){near}",
            self.lamps, self.median_deg, self.worst_deg
        )
    }
}

/// Smallest parallax of a measured distance, in standard deviations.
const TOLD: f64 = 3.0;

/// Lamps on the second ball of a project, under a response.
///
/// # Errors
/// As [`super::probe::Probes::load`].
fn lamps(project: &Project, second: &SecondBall, table: &ResponseTable, progress: &Progress) -> Result<Vec<Lamp>> {
    let shoot = &project.settings.shoot;
    let pictures = pictures(project, second);
    let first = pictures
        .first()
        .ok_or_else(|| Error::missing("the second mirror ball has no photographs", "Import the shoot again"))?;
    let size = footage::dimensions(first)?;
    let ball = MirrorBall::new(&second.ball, shoot.ball_dome_radius_m(), size)?;
    let scale = super::probe::scale(&pictures, &ball)?;
    // A disagreement of the two balls is reported separately.
    let (footprints, _) =
        footprints(&pictures, (first, size), (&ball, silhouette::Circle::from_ball(&second.ball)), scale, progress)?;
    let rig = measure(&footprints, (&ball, scale), shoot.all_lamps(), table).0;
    Ok(rig.lamps)
}

/// Lamps measured from all of a project's balls.
pub(super) struct MeasuredRig {
    pub rig: Rig,
    /// Share of the lamps' energy hidden by the first ball and filled in.
    pub filled_energy: f32,
    /// Agreement of two balls; `None` with one ball.
    pub two_balls: Option<TwoBalls>,
}

/// Measures the lamps from all of a project's balls under a response.
///
/// # Errors
/// As [`super::probe::Probes::load`], for the second ball.
pub(super) fn rig(
    project: &Project,
    probes: &Probes,
    table: &ResponseTable,
    progress: &Progress,
) -> Result<MeasuredRig> {
    let shoot = &project.settings.shoot;
    let (mut rig, filled_energy) = probes.rig(shoot.all_lamps(), table);
    let Some(second) = &shoot.second_ball else {
        return Ok(MeasuredRig { rig, filled_energy, two_balls: None });
    };
    let lamps = lamps(project, second, table, progress)?;
    let distance = shoot.ball.camera_distance_m;
    let two = join(&mut rig, &lamps, shoot.ball_positions_m(), distance);
    Ok(MeasuredRig { rig, filled_energy, two_balls: Some(two) })
}

/// Photographs of the second ball.
fn pictures(project: &Project, second: &SecondBall) -> Vec<Picture> {
    let lamps = 0..project.settings.shoot.all_lamps().len();
    lamps.map(|lamp| project.second_probe_picture(second, lamp)).collect()
}

/// Merges the second ball's lamps into the first's, in place. Directions and confidences combine both; energies
/// stay the first ball's, except for lamps that it does not show. `positions_m` are the balls' positions and
/// `camera_distance_m` the distance from camera to subject.
fn join(rig: &mut Rig, second: &[Lamp], positions_m: Option<[Vec3; 2]>, camera_distance_m: f32) -> TwoBalls {
    let geometry = positions_m.map(|positions| Geometry::new(positions, camera_distance_m));
    let pairs: Vec<Option<Pair>> =
        (rig.lamps.iter().zip(second)).map(|(first, second)| Pair::new(first, second, geometry.as_ref())).collect();
    let mut apart: Vec<f32> = pairs.iter().flatten().map(|pair| pair.apart_deg).collect();
    apart.sort_by(f32::total_cmp);
    let brighter = [0, 1, 2].map(|c| {
        let both = pairs.iter().zip(rig.lamps.iter().zip(second));
        let both = both.filter(|(pair, _)| pair.is_some());
        median(both.map(|(_, (first, second))| first.energy[c] / second.energy[c]))
    });
    let median_deg = apart.get(apart.len() / 2).copied().unwrap_or(0.0);
    let mut near = Vec::new();
    for ((lamp, second), pair) in rig.lamps.iter_mut().zip(second).zip(&pairs) {
        let turned = |direction: Vec3, ball: usize| match &geometry {
            Some(geometry) => geometry.turned(direction, ball).as_vec3(),
            None => direction,
        };
        let Some(pair) = pair else {
            // Only one ball shows it, or neither.
            if second.confidence > lamp.confidence {
                lamp.direction = turned(second.direction, 1);
                lamp.confidence = second.confidence;
                lamp.spread_deg = second.spread_deg;
                lamp.clipped = second.clipped;
                lamp.energy = [0, 1, 2].map(|c| brighter[c] * second.energy[c]);
            } else {
                lamp.direction = turned(lamp.direction, 0);
            }
            continue;
        };
        let agreement = 1.0 / (1.0 + (pair.apart_deg / NEAR_DEG).powi(4));
        if pair.apart_deg < NEAR_DEG {
            lamp.direction = pair.direction.as_vec3();
            let wrong = (1.0 - lamp.confidence) * (1.0 - second.confidence);
            lamp.confidence = agreement * (1.0 - wrong);
        } else {
            let better = usize::from(second.confidence > lamp.confidence);
            let (direction, confidence) =
                [(lamp.direction, lamp.confidence), (second.direction, second.confidence)][better];
            lamp.direction = turned(direction, better);
            // Two good views disagree: one is wrong, and the data cannot tell which.
            lamp.confidence = agreement * confidence;
            continue;
        }
        if let Some((position, deviation)) = pair.position(median_deg) {
            lamp.direction = position.normalize().as_vec3();
            near.push(NearLamp {
                name: lamp.name.clone(),
                position_m: position.as_vec3(),
                deviation_m: deviation as f32,
            });
        }
    }
    TwoBalls { lamps: apart.len(), median_deg, worst_deg: apart.last().copied().unwrap_or(0.0), near }
}

/// Positions of the balls, and rotations of their cameras' axes.
struct Geometry {
    positions: [DVec3; 2],
    /// Rotations from each ball's own frame, whose +Z points to the camera, to the subject's.
    turns: [DQuat; 2],
}

impl Geometry {
    fn new(positions_m: [Vec3; 2], camera_distance_m: f32) -> Self {
        let positions = positions_m.map(Vec3::as_dvec3);
        let camera = f64::from(camera_distance_m) * DVec3::Z;
        Self {
            positions,
            turns: positions.map(|ball| DQuat::from_rotation_arc(DVec3::Z, (camera - ball).normalize_or(DVec3::Z))),
        }
    }

    fn turned(&self, direction: Vec3, ball: usize) -> DVec3 {
        self.turns[ball] * direction.as_dvec3()
    }
}

/// A lamp on both balls.
struct Pair {
    /// Mean direction.
    direction: DVec3,
    /// Disagreement of the balls in degrees.
    apart_deg: f32,
    /// Intersection of the two lines of sight, and the angle between them in radians; `None` if the balls'
    /// positions are unknown or the lines do not meet in front of the balls.
    meeting: Option<(DVec3, f64)>,
}

impl Pair {
    /// `None` if either ball does not show the lamp.
    fn new(first: &Lamp, second: &Lamp, geometry: Option<&Geometry>) -> Option<Self> {
        if !(first.is_usable() && second.is_usable()) {
            return None;
        }
        // Probability 1 − e^(−12.5/σ²) of an error below five degrees: 1/σ² up to a factor.
        let weight = |lamp: &Lamp| -f64::from(1.0 - lamp.confidence.clamp(0.01, 0.999)).ln();
        let weights = [weight(first), weight(second)];
        let directions = [(first, 0), (second, 1)].map(|(lamp, ball)| match geometry {
            Some(geometry) => geometry.turned(lamp.direction, ball),
            None => lamp.direction.as_dvec3(),
        });
        let mean = weights[0] * directions[0] + weights[1] * directions[1];
        let plain = Self {
            direction: mean.try_normalize()?,
            apart_deg: directions[0].angle_between(directions[1]).to_degrees() as f32,
            meeting: None,
        };
        let Some(geometry) = geometry else { return Some(plain) };
        let Some(position) = meeting(geometry.positions, directions) else { return Some(plain) };
        let to = geometry.positions.map(|ball| (position - ball).normalize());
        let missed = (to[0].angle_between(directions[0])).max(to[1].angle_between(directions[1]));
        Some(Self {
            apart_deg: missed.to_degrees() as f32,
            meeting: Some((position, to[0].angle_between(to[1]))),
            ..plain
        })
    }

    /// The lamp's position and the standard deviation of its distance in metres, if the parallax is large enough.
    /// `typical_deg` is the median disagreement of the balls, the accuracy of their directions.
    fn position(&self, typical_deg: f32) -> Option<(DVec3, f64)> {
        /// Best assumed accuracy of two directions: a quarter of a degree.
        const FINEST_DEG: f32 = 0.25;
        let (position, parallax) = self.meeting?;
        let deviation = f64::from(typical_deg.max(self.apart_deg).max(FINEST_DEG)).to_radians();
        // Both directions have errors.
        let relative = std::f64::consts::SQRT_2 * deviation / parallax.max(1e-9);
        (relative < 1.0 / TOLD).then(|| (position, relative * position.length()))
    }
}

/// Point nearest to two lines of sight; `None` if they are parallel or it lies behind a ball.
fn meeting(from: [DVec3; 2], along: [DVec3; 2]) -> Option<DVec3> {
    let (mut square, mut target) = (DMat3::ZERO, DVec3::ZERO);
    for (from, along) in from.into_iter().zip(along) {
        let across = DMat3::IDENTITY - DMat3::from_cols(along * along.x, along * along.y, along * along.z);
        square += across;
        target += across * from;
    }
    if square.determinant() < 1e-9 {
        return None;
    }
    let point = square.inverse() * target;
    let before = |i: usize| (point - from[i]).dot(along[i]) > 0.0;
    (before(0) && before(1)).then_some(point)
}

/// Detects the second ball's circle in its photographs if unknown.
///
/// # Errors
/// When they show no ball, or show both balls and the manifest does not say which is the second.
pub(super) fn find_circle(project: &mut Project, again: bool, progress: &Progress) -> Result<()> {
    let Some(second) = project.settings.shoot.second_ball.clone() else { return Ok(()) };
    let shared = second.folder.as_path() == std::path::Path::new("probes");
    if second.ball.has_circle() && (!again || shared) {
        return Ok(());
    }
    if shared {
        return Err(Error::invalid(
            "the photographs show two mirror balls; the position of the second is unknown",
            "Give `ball_center_px` and `ball_radius_px` of `second_probes` in the manifest and import again",
        ));
    }
    let photographs = silhouette::Photographs::read(&pictures(project, &second), progress)?;
    let found = silhouette::find(&photographs)?;
    progress.say(format!(
        "Second mirror ball found: centre {:.1}, {:.1}, radius {:.1} pixels",
        found.circle.center_px[0], found.circle.center_px[1], found.circle.radius_px
    ));
    if let Some(second) = &mut project.settings.shoot.second_ball {
        found.circle.apply_to(&mut second.ball);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
