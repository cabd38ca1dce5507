//! The virtual stage: a simulated light stage and subject, so that everything runs without data.
//!
//! [`write_shoot`] writes an ordinary shoot folder (exemplars under every bank, an interview in front of a green
//! screen, mirror balls, a manifest), environments for relighting, and separately the truth. The rest of the program is
//! tested against it, so it uses none of calibration, weights or compositing: its geometry, light and camera are its
//! own.
//!
//! `subject` is a head and shoulders as signed distances (`head`, `attire`), painted by `material` and moved by
//! `motion`. `dome` holds the lamps. `picture` finds the points that the camera sees, and `transport` carries every
//! lamp's light there, with shadows marched through the baked `grid`. `probe` traces the mirror `ball`, `camera` turns
//! light into photographs, `shoot` writes everything to disk. `trouble` holds departures from the plain stage, set or
//! drawn from the seed: `interview_light` outside the span of the banks (`panel`, `room`), other skin and
//! `accessories`, a moving subject (`sway`), a ball that reflects more than lamps (`ball_view`), another response,
//! `jpeg`. Only the effects that a material or the geometry needs are traced; `effects` counts them.

mod accessories;
mod attire;
mod ball;
mod ball_view;
mod camera;
pub mod dome;
mod effects;
mod environments;
mod film;
mod grid;
mod head;
mod interview_light;
mod jpeg;
mod manifest;
mod material;
mod motion;
mod panel;
mod picture;
mod probe;
mod room;
mod session;
mod shape;
mod shipped;
mod shoot;
mod span;
mod subject;
mod sway;
#[cfg(test)]
mod tests;
mod transport;
mod trouble;
mod truth;

pub use effects::Effect;
pub use film::WrittenAs;
pub use shoot::write_shoot;
pub use trouble::{Hair, LightKind, TroubleSettings};

use base::error::{Error, Result};
use serde::Serialize;
use std::ops::RangeInclusive;

/// Settings of a shoot.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct StageSettings {
    /// Number of interview frames, at least 1.
    #[arg(long, default_value_t = StageSettings::default().frames)]
    pub frames: usize,
    /// Width and height of every picture in pixels, at least 16.
    #[arg(long, default_value_t = StageSettings::default().size)]
    pub size: usize,
    /// Width and height of the interview's frames, such as 540x960, if they differ. Their vertical framing stays the
    /// same.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = plate)]
    pub plate: Option<(usize, usize)>,
    /// Random seed of camera response, noise and movements: the same seed gives the same files.
    #[arg(long, default_value_t = StageSettings::default().seed)]
    pub seed: u64,
    /// Banks of lamps, and so OLATs per pose, from 4 to 931; with 931, each lamp is a bank of its own.
    #[arg(long, default_value_t = StageSettings::default().lamps)]
    pub lamps: usize,
    /// Number of photographed poses, from 1 to 6.
    #[arg(long, value_name = "COUNT", default_value_t = StageSettings::default().poses)]
    pub poses: usize,
    /// Photograph further poses as in these interview frames, counted from 0.
    #[arg(long, value_name = "FRAME", value_delimiter = ',')]
    pub like_frames: Vec<usize>,
    /// Form of the pictures: files or movies.
    #[arg(long = "as", value_enum, default_value_t)]
    pub written_as: WrittenAs,
    /// True to use the interview that comes with the program instead of tracing one.
    #[arg(skip)]
    pub shipped: bool,
    #[command(flatten)]
    pub trouble: TroubleSettings,
}

/// Parses columns and rows, such as `540x960`.
fn plate(text: &str) -> std::result::Result<(usize, usize), String> {
    let sides = text.split_once(['x', '×']);
    let number = |side: &str| side.trim().parse::<usize>().ok();
    sides
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text:?} is not a size: give width and height, such as 540x960"))
}

impl Default for StageSettings {
    fn default() -> Self {
        Self {
            frames: 40,
            size: 256,
            plate: None,
            seed: 1,
            lamps: 41,
            poses: 6,
            like_frames: Vec::new(),
            written_as: WrittenAs::Files,
            shipped: false,
            trouble: TroubleSettings::NONE,
        }
    }
}

impl StageSettings {
    /// The demo's shoot. Its interview, 540 × 960, comes with the program, since tracing takes minutes; its truth is
    /// traced at a third of that size.
    pub fn demo() -> Self {
        Self { frames: shipped::FRAMES.len(), size: 128, plate: Some((180, 320)), shipped: true, ..Self::default() }
    }

    /// Columns and rows of the interview's frames.
    pub fn frame_size(&self) -> (usize, usize) {
        self.plate.unwrap_or((self.size, self.size))
    }

    /// Refuses settings that cannot be produced or would fill the disk.
    ///
    /// # Errors
    /// When one is out of range; the message gives the range.
    pub fn check(&self) -> Result<()> {
        let within = |what: &str, value: usize, range: RangeInclusive<usize>| {
            if range.contains(&value) {
                return Ok(());
            }
            Err(Error::invalid(
                format!("the virtual stage can have from {} to {} {what}, not {value}", range.start(), range.end()),
                "Choose a number in that range",
            ))
        };
        within("pixels across (size)", self.size, 16..=1024)?;
        for side in self.plate.map_or([self.size; 2], |(width, height)| [width, height]) {
            within("pixels across a frame (plate)", side, 16..=4096)?;
        }
        within("interview frames", self.frames, 1..=999)?;
        within("lamps", self.lamps, 4..=dome::MAX_LAMPS)?;
        within("poses", self.poses, 1..=6)?;
        within("poses like frames", self.like_frames.len(), 0..=90)?;
        if let Some(frame) = self.like_frames.iter().find(|&&frame| frame >= self.frames) {
            return Err(Error::invalid(
                format!(
                    "there is no frame {frame} for a pose: the interview has {} frames, counted from 0",
                    self.frames
                ),
                "Choose another frame, or more of them with --frames",
            ));
        }
        self.trouble.check()
    }
}

/// Report on a written shoot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageReport {
    /// Number of files written.
    pub files: usize,
    /// Wall-clock time in seconds.
    pub seconds: f64,
    /// Active effects with their share of the samples, and the reason for skipping the rest.
    pub effects: Vec<Effect>,
}
