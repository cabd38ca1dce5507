//! Contents of a shoot's folder, and its mirror balls.

use super::{Corrections, DamagedFrames, Frames, NamedEnvironment, Takes};
use base::error::{Error, Result};
use base::files;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Contents of a shoot folder, found once at import.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shoot {
    /// The shoot's folder, relative to the project's.
    pub folder: PathBuf,
    /// Frames per second of the interview.
    pub frame_rate: f64,
    /// Names of the pose folders under `exemplars/`: `pose00` …
    pub poses: Vec<String>,
    /// Names of the OLATs that the network learns, without extension, the same in every pose and among the
    /// probes: `olat_00` …
    pub lamps: Vec<String>,
    /// Names of the other OLATs, if the network learns only some: they light the interview too, so the calibration
    /// needs them. Lamp numbers continue from `lamps`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_lamps: Vec<String>,
    /// The interview's frames.
    pub frames: Frames,
    /// Replacement for a frame that cannot be read.
    #[serde(default, skip_serializing_if = "DamagedFrames::is_stop")]
    pub damaged_frames: DamagedFrames,
    /// Poses and mirror balls that are frames of movies.
    #[serde(default, skip_serializing_if = "Takes::is_empty")]
    pub takes: Takes,
    /// Photography of the mirror balls.
    pub ball: Ball,
    /// A second mirror ball under the same lamps; `None` if there is one ball.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_ball: Option<SecondBall>,
    /// Radius in metres of the dome with the lamps; `None` if unknown.
    pub dome_radius_m: Option<f32>,
    /// Environments of the shoot; their files are relative to its folder.
    pub environments: Vec<NamedEnvironment>,
    /// The dome's plan: unit directions from the subject to the lamps in the order of [`Shoot::all_lamps`]; empty
    /// if the shoot has none. Used only to check the measured rig.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lamp_layout: Vec<Vec3>,
    /// True if the shoot has no mirror balls: the lamps' directions are those of [`Shoot::lamp_layout`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub without_balls: bool,
    /// Layer of the shoot's EXR files that have several; `None` for the finished picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<String>,
    /// Corrections of faults in the pictures.
    #[serde(default, skip_serializing_if = "Corrections::is_empty")]
    pub corrections: Corrections,
}

/// A mirror ball in the photographs under `probes/`, all taken by one fixed camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Centre in pixels from the top left corner of the photograph (0 is the left edge of column 0).
    pub center_px: [f32; 2],
    /// Radius of the silhouette in pixels; 0 if the ball's position is unknown.
    pub radius_px: f32,
    /// Radius of the ball in metres.
    pub radius_m: f32,
    /// Distance from the camera to the ball's centre in metres.
    pub camera_distance_m: f32,
}

/// A second mirror ball, photographed by the same camera under the same lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SecondBall {
    /// Folder of its photographs within the shoot, with the same names as the first ball's: `probes` if they show
    /// both balls.
    pub folder: PathBuf,
    /// Photography of the ball.
    pub ball: Ball,
    /// Positions of the first ball's centre and of this one's, in metres from the subject (right, up, towards the
    /// camera); `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub positions_m: Option<[Vec3; 2]>,
}

impl Ball {
    /// A ball of unknown size, photographed from so far away that all rays are parallel.
    pub fn far(center_px: [f32; 2], radius_px: f32) -> Self {
        Self { center_px, radius_px, radius_m: 1.0, camera_distance_m: 1e5 }
    }

    /// A ball with unknown size and unknown position in its photographs.
    pub fn unknown() -> Self {
        Self::far([0.0; 2], 0.0)
    }

    /// True if the ball's position in its photographs is known.
    pub fn has_circle(&self) -> bool {
        self.radius_px != 0.0
    }

    /// True if sizes and distances are unknown: see [`Self::far`].
    pub fn is_far(&self) -> bool {
        let far = Self::unknown();
        (self.radius_m, self.camera_distance_m) == (far.radius_m, far.camera_distance_m)
    }

    /// Rejects a ball that no camera can have photographed.
    ///
    /// # Errors
    /// When its numbers are impossible.
    pub fn check(&self) -> Result<()> {
        // A million pixels, and ten times the distance of a camera that counts as far away.
        const LARGEST: f32 = 1e6;
        let is_size = |v: f32| v > 0.0 && v <= LARGEST;
        let is_place = |v: &f32| v.abs() <= LARGEST;
        if is_size(self.radius_m)
            && is_size(self.camera_distance_m)
            && self.camera_distance_m > self.radius_m
            && (0.0..=LARGEST).contains(&self.radius_px)
            && self.center_px.iter().all(is_place)
        {
            return Ok(());
        }
        let [x, y] = self.center_px;
        Err(Error::invalid(
            format!(
                "an impossible mirror ball (centre {x}, {y}, radius {} pixels or {} m, camera {} m away): it must have a \
                 positive size and be nearer to the origin than the camera, and no number may exceed {LARGEST}",
                self.radius_px, self.radius_m, self.camera_distance_m
            ),
            "Correct the ball's and the camera's numbers",
        ))
    }
}

impl Shoot {
    /// Valid frame rates of an interview, in frames per second.
    pub const FRAME_RATES: RangeInclusive<f64> = 0.001..=100_000.0;

    /// Rejects numbers that no shoot has, and names that are not bare file names.
    ///
    /// # Errors
    /// When a number or name is invalid.
    pub fn check(&self) -> Result<()> {
        const CORRECT: &str = "Correct it, or import the shoot again";
        if !Self::FRAME_RATES.contains(&self.frame_rate) {
            let problem = format!(
                "a frame rate of {} is not from {} to {} frames per second",
                self.frame_rate,
                Self::FRAME_RATES.start(),
                Self::FRAME_RATES.end()
            );
            return Err(Error::invalid(problem, CORRECT));
        }
        let frames = match &self.frames {
            Frames::Named(names) => &names[..],
            Frames::Clip(clip) => {
                clip.check()?;
                &[]
            }
        };
        let mut names = (self.poses.iter()).chain(self.all_lamps()).chain(frames).chain(self.corrections.names());
        // File systems have no longer names.
        if let Some(name) = names.find(|name| !files::is_bare(name) || name.len() > 255) {
            let problem = format!("{name:.300?} is not the name of a pose, lamp or frame");
            return Err(Error::invalid(problem, CORRECT));
        }
        self.takes.check(self.all_lamps())?;
        self.ball.check()?;
        if let Some(second) = &self.second_ball {
            second.ball.check()?;
        }
        let positions = self.second_ball.as_ref().and_then(|b| b.positions_m);
        let is_direction = |v: &Vec3| v.is_finite() && v.length_squared() > 0.0;
        let lamps = self.all_lamps().len();
        let problem = if (self.dome_radius_m).is_some_and(|r| !(r > 0.0 && r <= 1e6)) {
            "`dome_radius_m` is not a positive length in metres"
        } else if positions.is_some_and(|both| !both.iter().all(|at| at.is_finite())) {
            "`positions_m` of the second ball are not finite"
        } else if !self.lamp_layout.is_empty()
            && (self.lamp_layout.len() != lamps || !self.lamp_layout.iter().all(is_direction))
        {
            "`lamp_layout` is not a direction for each lamp"
        } else {
            return Ok(());
        };
        Err(Error::invalid(problem, CORRECT))
    }

    /// Positions of the centres of two mirror balls, in metres from the subject; `None` if there is one ball, or
    /// positions or sizes are unknown.
    pub fn ball_positions_m(&self) -> Option<[Vec3; 2]> {
        let second = self.second_ball.as_ref()?;
        let sized = !self.ball.is_far() && !second.ball.is_far();
        second.positions_m.filter(|_| sized)
    }

    /// Radius in metres of the dome on which the directions from one ball end; `None` if it is unknown, or if the
    /// positions of two balls are known: then each ball has its own directions, and both are joined.
    pub fn ball_dome_radius_m(&self) -> Option<f32> {
        (self.dome_radius_m).filter(|_| self.ball_positions_m().is_none())
    }

    /// Lets the network learn these lamps alone, counted over all lamps, in this order; the others follow in theirs.
    ///
    /// # Panics
    /// When a lamp does not exist.
    pub fn learn(&mut self, lamps: &[usize]) {
        let others = (0..self.all_lamps().len()).filter(|lamp| !lamps.contains(lamp));
        let order: Vec<usize> = lamps.iter().copied().chain(others).collect();
        let mut names: Vec<String> = order.iter().map(|&lamp| self.lamp(lamp).clone()).collect();
        self.other_lamps = names.split_off(lamps.len());
        self.lamps = names;
        if !self.lamp_layout.is_empty() {
            self.lamp_layout = order.iter().map(|&lamp| self.lamp_layout[lamp]).collect();
        }
    }

    /// The names of all lamps: those that the network learns, then the others.
    pub fn all_lamps(&self) -> impl ExactSizeIterator<Item = &String> + Clone {
        let count = self.lamps.len() + self.other_lamps.len();
        (0..count).map(|lamp| self.lamp(lamp))
    }

    /// The name of lamp `lamp`, counted over all lamps.
    ///
    /// # Panics
    /// When the lamp does not exist.
    pub fn lamp(&self, lamp: usize) -> &String {
        (self.lamps.get(lamp)).unwrap_or_else(|| &self.other_lamps[lamp - self.lamps.len()])
    }
}
