//! Troubles of a real shoot: departures from the plain stage, set or drawn from the seed.

use base::error::{Error, Result};
use base::numbers;
use chacha20::ChaCha8Rng;
use imaging::{DualGamma, Response};
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use std::ops::RangeInclusive;

/// Settings that make a shoot difficult. `None` means the plain stage, or a value drawn from the seed if
/// [`Self::trouble`] is set.
#[derive(Clone, Copy, Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "Trouble")]
pub struct TroubleSettings {
    /// Draw the settings below from the seed, except those given.
    #[arg(long)]
    pub trouble: bool,
    /// Lamps in each bank, from 1 (each lamp is a bank) to 23, the default.
    #[arg(long, value_name = "LAMPS")]
    pub bank_lamps: Option<usize>,
    /// Light of the interview.
    #[arg(long, value_enum)]
    pub interview_light: Option<LightKind>,
    /// Factors on the colour of the interview's lamps, such as 1.2,1,0.7 for warm light.
    #[arg(long, value_name = "R,G,B", value_parser = tint)]
    pub tint: Option<[f32; 3]>,
    /// Share of the room in the interview's light, from 0 to 0.9. It comes from everywhere, so it is not a sum of the
    /// banks.
    #[arg(long, value_name = "SHARE")]
    pub ambient: Option<f32>,
    /// Exposure of the interview relative to what the mirror balls show, from 0.25 to 4.
    #[arg(long, value_name = "FACTOR")]
    pub exposure_change: Option<f32>,
    /// The camera's response: γ1,γ2 or srgb, rec709, linear, or log,K for a curve ln(1 + K·light).
    #[arg(long)]
    pub response: Option<Response>,
    /// Factor on the sensor's noise, from 0 to 20.
    #[arg(long, value_name = "FACTOR")]
    pub noise: Option<f32>,
    /// Pass every photograph through a JPEG file of this quality, from 1 to 100.
    #[arg(long, value_name = "QUALITY")]
    pub jpeg: Option<u8>,
    /// Colour of the skin, from 0 (light) to 1 (dark).
    #[arg(long, value_name = "TONE")]
    pub skin: Option<f32>,
    /// Shine of the skin, from 0 (powdered) to 1 (oily).
    #[arg(long, value_name = "SHINE")]
    pub shine: Option<f32>,
    /// The subject wears glasses.
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub glasses: Option<bool>,
    /// Hair instead of the head wrap.
    #[arg(long, value_enum)]
    pub hair: Option<Hair>,
    /// Factors on the head's width, height and depth, such as 0.95,1.06,1, each from 0.85 to 1.15.
    #[arg(long, value_name = "W,H,D", value_parser = tint)]
    pub build: Option<[f32; 3]>,
    /// A hand is raised to the face in some poses and frames.
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub hands: Option<bool>,
    /// Change of the subject's seat from one pose to the next, in metres, from 0 to 0.04.
    #[arg(long, value_name = "METRES")]
    pub reseated: Option<f32>,
    /// Movement of the face while the lamps go round, in pixels of a 256-pixel picture, from 0 to 8.
    #[arg(long, value_name = "PIXELS")]
    pub sway: Option<f32>,
    /// Photograph the fully lit subject before every N-th lamp, and after the last one.
    #[arg(long, value_name = "LAMPS")]
    pub tracking: Option<usize>,
    /// Dust on the mirror ball: share of the light that it scatters, from 0 to 1.
    #[arg(long, value_name = "SHARE")]
    pub dust: Option<f32>,
    /// Room albedo: share of the lamps' light that the stage's room reflects, from 0 (black cloth) to 1.
    #[arg(long, value_name = "SHARE")]
    pub room: Option<f32>,
    /// The mirror ball reflects the photographer and the camera.
    #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub photographer: Option<bool>,
    /// Exposure of the mirror balls relative to the brightest that does not clip, from 0.1 to 100.
    #[arg(long, value_name = "FACTOR")]
    pub ball_exposure: Option<f32>,
}

/// Light of the interview.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum LightKind {
    /// Soft sum of the stage's own banks.
    #[default]
    Banks,
    /// A few bare lamps near the subject.
    Lamps,
    /// One window on one side.
    Window,
    /// A key and a fill, sometimes with a backlight.
    Softboxes,
}

/// The colour of hair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Hair {
    Black,
    Brown,
    Red,
    Blond,
    Grey,
}

/// Troubles of a shoot: the settings, and the values drawn for those left open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Trouble {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bank_lamps: Option<usize>,
    pub interview_light: LightKind,
    pub tint: [f32; 3],
    pub ambient: f32,
    pub exposure_change: f32,
    /// `None`: a dual gamma drawn from the seed within the range of consumer cameras.
    #[serde(skip)]
    pub response: Option<Response>,
    pub noise: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jpeg: Option<u8>,
    #[serde(flatten)]
    pub look: Look,
    pub reseated: f32,
    pub sway: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracking: Option<usize>,
    pub dust: f32,
    pub room: f32,
    pub photographer: bool,
    pub ball_exposure: f32,
}

/// Look of the subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Look {
    /// From 0 (light) to 1 (dark); `None` is the stage's own subject, in between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<f32>,
    /// From 0 (powdered) to 1 (oily); `None` is in between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shine: Option<f32>,
    pub glasses: bool,
    /// `None`: a head wrap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hair: Option<Hair>,
    pub hands: bool,
    /// Factors on the head's width, height and depth; `None` is the stage's own subject.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub build: Option<[f32; 3]>,
}

impl Default for Trouble {
    /// The plain stage.
    fn default() -> Self {
        Self {
            bank_lamps: None,
            interview_light: LightKind::Banks,
            tint: [1.0; 3],
            ambient: 0.0,
            exposure_change: 1.0,
            response: None,
            noise: 1.0,
            jpeg: None,
            look: Look::default(),
            reseated: 0.0,
            sway: 0.0,
            tracking: None,
            dust: 0.0,
            room: 0.0,
            photographer: false,
            ball_exposure: 1.0,
        }
    }
}

impl TroubleSettings {
    /// The plain stage as a constant.
    pub const NONE: Self = Self {
        trouble: false,
        bank_lamps: None,
        interview_light: None,
        tint: None,
        ambient: None,
        exposure_change: None,
        response: None,
        noise: None,
        jpeg: None,
        skin: None,
        shine: None,
        glasses: None,
        hair: None,
        build: None,
        hands: None,
        reseated: None,
        sway: None,
        tracking: None,
        dust: None,
        room: None,
        photographer: None,
        ball_exposure: None,
    };

    /// Refuses settings that are out of range.
    pub(super) fn check(&self) -> Result<()> {
        let within = |what: &str, value: Option<f32>, range: RangeInclusive<f32>| match value {
            // NaN is in no range, so it is refused too.
            Some(value) if !range.contains(&value) => Err(Error::invalid(
                format!("{what} of the virtual stage can be from {} to {}, not {value}", range.start(), range.end()),
                "Choose a number in that range",
            )),
            _ => Ok(()),
        };
        within("--bank-lamps", self.bank_lamps.map(|n| n as f32), 1.0..=23.0)?;
        within("--ambient", self.ambient, 0.0..=0.9)?;
        within("--exposure-change", self.exposure_change, 0.25..=4.0)?;
        within("--noise", self.noise, 0.0..=20.0)?;
        within("--jpeg", self.jpeg.map(f32::from), 1.0..=100.0)?;
        within("--skin", self.skin, 0.0..=1.0)?;
        within("--shine", self.shine, 0.0..=1.0)?;
        within("--reseated", self.reseated, 0.0..=0.04)?;
        within("--sway", self.sway, 0.0..=8.0)?;
        within("--tracking", self.tracking.map(|n| n as f32), 1.0..=931.0)?;
        within("--dust", self.dust, 0.0..=1.0)?;
        within("--room", self.room, 0.0..=1.0)?;
        within("--ball-exposure", self.ball_exposure, 0.1..=100.0)?;
        (self.build.iter().flatten())
            .try_for_each(|factor| within("each factor of --build", Some(*factor), 0.85..=1.15))?;
        (self.tint.iter().flatten()).try_for_each(|factor| within("each factor of --tint", Some(*factor), 0.05..=20.0))
    }

    /// Troubles of the shoot: the plain stage, or values drawn from `seed`, overridden by the given settings.
    pub(super) fn resolve(&self, seed: u64) -> Trouble {
        let drawn = if self.trouble { Trouble::draw(seed) } else { Trouble::default() };
        Trouble {
            bank_lamps: self.bank_lamps.or(drawn.bank_lamps),
            interview_light: self.interview_light.unwrap_or(drawn.interview_light),
            tint: self.tint.unwrap_or(drawn.tint),
            ambient: self.ambient.unwrap_or(drawn.ambient),
            exposure_change: self.exposure_change.unwrap_or(drawn.exposure_change),
            response: self.response.or(drawn.response),
            noise: self.noise.unwrap_or(drawn.noise),
            jpeg: self.jpeg.or(drawn.jpeg),
            look: Look {
                skin: self.skin.or(drawn.look.skin),
                shine: self.shine,
                glasses: self.glasses.unwrap_or(drawn.look.glasses),
                hair: self.hair.or(drawn.look.hair),
                hands: self.hands.unwrap_or(drawn.look.hands),
                build: self.build,
            },
            reseated: self.reseated.unwrap_or(drawn.reseated),
            sway: self.sway.unwrap_or(drawn.sway),
            tracking: self.tracking,
            dust: self.dust.unwrap_or(drawn.dust),
            room: self.room.unwrap_or(drawn.room),
            photographer: self.photographer.unwrap_or(drawn.photographer),
            ball_exposure: self.ball_exposure.unwrap_or(drawn.ball_exposure),
        }
    }
}

impl Trouble {
    /// Troubles of one seed. Everything is drawn in a fixed order, so that giving one setting leaves the others
    /// unchanged.
    fn draw(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x74_726f_7562_6c65);
        let mut unit = || random.random::<f32>();
        let mut within = |low: f32, high: f32| low + (high - low) * unit();
        let interview_light = match within(0.0, 1.0) {
            x if x < 0.35 => LightKind::Banks,
            x if x < 0.55 => LightKind::Lamps,
            x if x < 0.75 => LightKind::Window,
            _ => LightKind::Softboxes,
        };
        // From candle-like to bluish, with a little green or magenta.
        let (warm, green) = (within(-0.45, 0.45), within(-0.08, 0.08));
        let white = within(0.0, 1.0) < 0.3;
        let tint = if white { [1.0; 3] } else { [warm.exp(), green.exp(), (-warm).exp()] };
        let (some, share) = (within(0.0, 1.0) < 0.6, within(0.02, 0.5));
        let ambient = if some { share } else { 0.0 };
        let (some, stops) = (within(0.0, 1.0) < 0.2, within(-1.0, 1.0));
        let exposure_change = if some { stops.exp2() } else { 1.0 };
        let kind = within(0.0, 1.0);
        let log = Response::Log(within(10.0f32.ln(), 60.0f32.ln()).exp());
        let dual = dual_gamma(&mut within);
        let response = Some(match kind {
            x if x < 0.75 => dual,
            x if x < 0.90 => Response::Srgb,
            _ => log,
        });
        let noise = within(0.5f32.ln(), 4.0f32.ln()).exp();
        let (some, quality) = (within(0.0, 1.0) < 0.5, within(75.0, 98.0));
        let jpeg = some.then_some(quality as u8);
        let skin = Some(within(0.0, 1.0));
        let glasses = within(0.0, 1.0) < 0.4;
        let (some, colour) = (within(0.0, 1.0) < 0.7, within(0.0, 5.0));
        let colours = [Hair::Black, Hair::Brown, Hair::Red, Hair::Blond, Hair::Grey];
        let hair = some.then(|| colours[(colour as usize).min(4)]);
        let hands = within(0.0, 1.0) < 0.3;
        let (some, far) = (within(0.0, 1.0) < 0.5, within(0.005, 0.03));
        let reseated = if some { far } else { 0.0 };
        let (some, pixels) = (within(0.0, 1.0) < 0.4, within(0.3, 3.0));
        let sway = if some { pixels } else { 0.0 };
        let (some, share) = (within(0.0, 1.0) < 0.5, within(0.01, 0.2));
        let dust = if some { share } else { 0.0 };
        let (some, share) = (within(0.0, 1.0) < 0.5, within(0.02, 0.25));
        let room = if some { share } else { 0.0 };
        let photographer = within(0.0, 1.0) < 0.4;
        let (some, stops) = (within(0.0, 1.0) < 0.15, within(0.3, 2.5));
        let ball_exposure = if some { stops.exp2() } else { 1.0 };
        let bank_lamps = match within(0.0, 1.0) {
            x if x < 0.4 => Some(1),
            x if x < 0.6 => Some(4),
            _ => None,
        };
        Self {
            bank_lamps,
            interview_light,
            tint,
            ambient,
            exposure_change,
            response,
            noise,
            jpeg,
            look: Look { skin, shine: None, glasses, hair, hands, build: None },
            reseated,
            sway,
            tracking: None,
            dust,
            room,
            photographer,
            ball_exposure,
        }
    }
}

/// A monotonic dual gamma, exponents from 1.2 to 3.2.
fn dual_gamma(within: &mut impl FnMut(f32, f32) -> f32) -> Response {
    loop {
        if let Ok(curve) = DualGamma::new(within(1.2, 3.2), within(1.2, 3.2)) {
            return curve.into();
        }
    }
}

/// Parses three comma-separated factors.
fn tint(text: &str) -> std::result::Result<[f32; 3], String> {
    let factors: [f64; 3] = numbers(text, "three factors such as 1.2,1,0.7")?;
    Ok(factors.map(|f| f as f32))
}
