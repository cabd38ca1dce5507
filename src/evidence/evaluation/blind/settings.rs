//! Settings of a blind comparison.

use super::super::Method;
use super::super::evaluate::MINUTES;
use base::numbers::within;
use footage::PictureSize;
use gpu::DeviceChoice;
use std::path::PathBuf;

/// Settings of the comparison.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct BlindSettings {
    /// Page to write [default: blind/STUDY.html in the project's folder].
    #[arg(long, value_name = "FILE.html")]
    pub page: Option<PathBuf>,
    /// Methods to compare, each with every other.
    #[arg(long = "with", value_enum, value_delimiter = ',', default_values = ["network", "texler", "sun"])]
    pub methods: Vec<Method>,
    /// Lamps that light the subject, by name [default: some that light it from the front, evenly spread].
    #[arg(long, value_name = "LAMP,...", value_delimiter = ',')]
    pub lamps: Option<Vec<String>>,
    /// Number of lamps to choose if none are named.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = within(1..=41usize))]
    pub conditions: usize,
    /// Number of consecutive frames of a clip, from the middle of the interview.
    #[arg(long, value_name = "N", default_value_t = 36, value_parser = within(1..=240usize))]
    pub frames: usize,
    /// Training minutes for texler and sun, which are trained now [default: as long as the project's network, else 10].
    #[arg(long, value_parser = within(MINUTES))]
    pub minutes: Option<f64>,
    /// Part of the plate and resolution of the pictures.
    #[arg(long, value_enum, default_value_t = PictureSize::Square)]
    pub at: PictureSize,
    /// Device of the networks.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}
