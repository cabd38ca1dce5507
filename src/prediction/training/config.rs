//! Settings of a training run, and presets.

use base::error::{Error, Result};
use clap::ValueEnum;
use gpu::DeviceChoice;
use reflectance::{Formulation, Normalization, Precision, Statistics};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Training preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// The best picture in ten minutes on two cores.
    Quick,
    /// The paper's network and schedule.
    Paper,
    /// A wider network than `quick` in the same time; slower on a CPU.
    FastGpu,
}

/// All settings of a training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TrainingConfig {
    /// Blocks of the encoder and of the decoder. None means as many as reduce the picture to one pixel.
    pub depth: Option<usize>,
    /// Channels of the network's first block.
    pub width: usize,
    /// Channels of its widest blocks.
    pub most_channels: usize,
    pub normalization: Normalization,
    /// Statistics that batch normalisation uses for prediction.
    pub statistics: Statistics,
    pub formulation: Formulation,
    /// Precision of convolutions on a CPU.
    pub precision: Precision,
    /// Weight of the reconstruction loss, λ1.
    pub reconstruction: f32,
    /// Weight of the rendering loss, λ2.
    pub rendering: f32,
    /// The same at the end of the run, if it changes: linear in time.
    #[serde(default)]
    pub rendering_end: Option<f32>,
    /// Weight of changes when an interview frame is shifted by up to two pixels, against flicker. Doubles
    /// the cost of steps over frames.
    #[serde(default)]
    pub steadiness: f32,
    /// Weight of features in both losses.
    pub perceptual: f32,
    /// Weight of the mean absolute difference between encoded pixels in both losses.
    pub pixel: f32,
    /// File of the network whose features both losses compare. None means the built-in features.
    pub features: Option<PathBuf>,
    /// Number of lamps whose OLATs a step compares, drawn for each step. None means all.
    pub lamps_per_step: Option<usize>,
    /// Interval in exemplar steps of the rendering loss. The other steps compute only the lamps that they
    /// compare.
    pub rendering_every: u64,
    /// Adam's learning rate after the warm-up.
    pub learning_rate: f64,
    /// Steps over which the rate grows linearly from zero.
    pub warm_up: u64,
    /// The rate falls along a half cosine to 2 % by the end of the run.
    pub decay: bool,
    /// Maximum of the common norm of all gradients.
    pub gradient_norm: f32,
    /// Decay of the weights' moving average, which is the network used for prediction; 0 switches it off.
    pub averaging: f32,
    /// Largest shift of exemplars, as a share of the picture's size.
    pub shift: f32,
    /// Exemplars are also used enlarged and reduced by this share.
    pub zoom: f32,
    /// Largest random change of the network's input in stops, per channel.
    pub gain: f32,
    /// Epochs over the exemplars before each round over the interview's frames.
    pub exemplar_epochs: u32,
    /// Epochs over the interview's frames in each round.
    pub video_epochs: u32,
    /// Frames in one epoch over the interview, drawn for each epoch. None means all.
    pub frames_per_epoch: Option<usize>,
    /// Epochs of the whole run.
    pub epochs: u32,
    /// Minutes of training, including earlier runs, after which the run ends even before its last epoch.
    pub minutes: Option<f64>,
    /// Seconds between checkpoints.
    pub checkpoint_seconds: f64,
    /// Recompute cheap activations in the backward pass instead of storing them: less memory, more time.
    pub recompute: bool,
}

/// Settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
pub struct TrainSettings {
    #[arg(skip = Preset::Quick.config())]
    pub config: TrainingConfig,
    /// Interview frames to exclude from training, such as 5,14,25,36.
    #[arg(long, value_delimiter = ',')]
    pub exclude_frames: Vec<usize>,
    /// Pose to hold out of training, counted from 0. It validates the network: the best one on it is used for prediction.
    #[arg(long, value_name = "POSE")]
    pub hold_out: Option<usize>,
    /// Start over instead of continuing from the checkpoint.
    #[arg(long)]
    pub fresh: bool,
    /// Device of the network.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 3] = [Self::Quick, Self::Paper, Self::FastGpu];

    /// The preset of this name.
    pub fn config(self) -> TrainingConfig {
        match self {
            Self::Quick => TrainingConfig {
                depth: None,
                width: 16,
                most_channels: 64,
                normalization: Normalization::Group,
                statistics: Statistics::Own,
                formulation: Formulation::Ratio,
                precision: Precision::Auto,
                reconstruction: 1.0,
                rendering: 0.5,
                rendering_end: None,
                steadiness: 0.0,
                perceptual: 1.0,
                pixel: 0.0,
                features: None,
                lamps_per_step: None,
                rendering_every: 1,
                learning_rate: 1e-3,
                warm_up: 50,
                decay: true,
                gradient_norm: 1.0,
                averaging: 0.99,
                shift: 0.05,
                zoom: 0.0,
                gain: 0.0,
                exemplar_epochs: 4,
                video_epochs: 1,
                frames_per_epoch: Some(8),
                epochs: 100_000,
                minutes: Some(10.0),
                checkpoint_seconds: 30.0,
                recompute: false,
            },
            Self::FastGpu => TrainingConfig { width: 32, most_channels: 256, averaging: 0.999, ..Self::Quick.config() },
            Self::Paper => TrainingConfig {
                depth: None,
                width: 32,
                most_channels: 512,
                normalization: Normalization::Batch,
                statistics: Statistics::Own,
                formulation: Formulation::Direct,
                precision: Precision::Auto,
                reconstruction: 1.0,
                rendering: 1.0,
                rendering_end: None,
                steadiness: 0.0,
                perceptual: 1.0,
                pixel: 0.0,
                features: None,
                lamps_per_step: None,
                rendering_every: 1,
                learning_rate: 1e-3,
                warm_up: 100,
                decay: false,
                gradient_norm: 1.0,
                averaging: 0.0,
                shift: 0.0,
                zoom: 0.0,
                gain: 0.0,
                exemplar_epochs: 100,
                video_epochs: 4,
                frames_per_epoch: None,
                epochs: 1040,
                minutes: None,
                checkpoint_seconds: 120.0,
                recompute: false,
            },
        }
    }
}

impl TrainingConfig {
    /// Changes one setting, given as `key=value`: the key is a field's name with hyphens, the value is
    /// written as in TOML, words without quotes, or `none`.
    ///
    /// # Errors
    /// When the setting does not exist, or cannot have this value.
    pub fn set(&mut self, setting: &str) -> Result<()> {
        let refuse = |problem: String| {
            Error::invalid(
                format!("the setting {setting:?} cannot be used: {problem}"),
                "Write it as key=value, such as width=32; docs/method.md lists the settings",
            )
        };
        let (key, value) = setting.split_once('=').ok_or_else(|| refuse("it has no =".to_owned()))?;
        let mut table = toml::Table::try_from(&*self).map_err(|e| refuse(e.to_string()))?;
        if value == "none" {
            table.remove(key);
        } else {
            let quoted = || toml::Value::String(value.to_owned());
            let parsed = toml::from_str::<toml::Table>(&format!("v = {value}"));
            let parsed = parsed.ok().and_then(|mut table| table.remove("v"));
            table.insert(key.to_owned(), parsed.unwrap_or_else(quoted));
        }
        let changed: Self = table.try_into().map_err(|e: toml::de::Error| refuse(e.message().trim().to_owned()))?;
        changed.check().map_err(refuse)?;
        *self = changed;
        Ok(())
    }

    /// Refuses numbers outside their ranges; limits that depend on the project are checked when the run starts.
    ///
    /// # Errors
    /// When a number is refused; the message names the setting and its range.
    fn check(&self) -> std::result::Result<(), String> {
        let optional = |number: Option<f64>| number.unwrap_or(1.0);
        let count = |number: Option<usize>| optional(number.map(|n| n as f64));
        let ranges: [(&str, f64, RangeInclusive<f64>); _] = [
            ("depth", count(self.depth), 1.0..=16.0),
            ("width", self.width as f64, 8.0..=1024.0),
            ("most-channels", self.most_channels as f64, 8.0..=1024.0),
            ("reconstruction", self.reconstruction.into(), 0.0..=1e6),
            ("rendering", self.rendering.into(), 0.0..=1e6),
            ("rendering-end", optional(self.rendering_end.map(f64::from)), 0.0..=1e6),
            ("steadiness", self.steadiness.into(), 0.0..=1e6),
            ("perceptual", self.perceptual.into(), 0.0..=1e6),
            ("pixel", self.pixel.into(), 0.0..=1e6),
            ("lamps-per-step", count(self.lamps_per_step), 1.0..=1e6),
            ("rendering-every", self.rendering_every as f64, 1.0..=1e9),
            ("learning-rate", self.learning_rate, 0.0..=1.0),
            ("warm-up", self.warm_up as f64, 0.0..=1e9),
            ("gradient-norm", self.gradient_norm.into(), 1e-6..=1e6),
            // With 1 the average never learns.
            ("averaging", self.averaging.into(), 0.0..=0.99999),
            ("shift", self.shift.into(), 0.0..=0.5),
            ("zoom", self.zoom.into(), 0.0..=0.5),
            ("gain", self.gain.into(), 0.0..=4.0),
            ("exemplar-epochs", self.exemplar_epochs.into(), 0.0..=1e6),
            ("video-epochs", self.video_epochs.into(), 0.0..=1e6),
            ("frames-per-epoch", count(self.frames_per_epoch), 1.0..=1e6),
            ("minutes", optional(self.minutes), 1e-3..=1e6),
            ("checkpoint-seconds", self.checkpoint_seconds, 0.0..=1e6),
        ];
        // NaN is in no range.
        match ranges.into_iter().find(|(_, number, range)| !range.contains(number)) {
            Some((name, _, range)) => Err(format!("{name} must be from {} to {}", range.start(), range.end())),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_changed_by_its_name() {
        let mut config = Preset::Quick.config();
        for setting in ["width=32", "normalization=batch", "learning-rate=2e-3", "features=vgg.pth", "minutes=none"] {
            config.set(setting).unwrap();
        }
        let expected = TrainingConfig {
            width: 32,
            normalization: Normalization::Batch,
            learning_rate: 2e-3,
            features: Some("vgg.pth".into()),
            minutes: None,
            ..Preset::Quick.config()
        };
        assert_eq!(config, expected);
    }

    #[test]
    fn a_setting_that_is_not_there_or_cannot_be_is_refused_and_changes_nothing() {
        let mut config = Preset::Paper.config();
        let beside = |setting: &str| setting.split('=').next().unwrap().to_owned();
        let ranged = [
            "shift=-1",
            "shift=nan",
            "learning-rate=nan",
            "learning-rate=inf",
            "gain=-inf",
            "rendering-end=-1",
            "steadiness=-1",
            "rendering-every=0",
            "lamps-per-step=0",
            "frames-per-epoch=0",
            "checkpoint-seconds=-1",
            "minutes=0",
            "averaging=1",
            "depth=0",
        ];
        for setting in ranged {
            let refused = config.set(setting).unwrap_err().to_string();
            let range = format!("{} must be from ", beside(setting));
            assert!(refused.contains(&range), "{refused}");
        }
        for setting in ["widht=32", "width", "width=wide", "width=-1", "width=none", "normalization=layer"] {
            let refused = config.set(setting).unwrap_err().to_string();
            assert!(refused.contains(setting), "{refused}");
        }
        assert_eq!(config, Preset::Paper.config());
    }
}
