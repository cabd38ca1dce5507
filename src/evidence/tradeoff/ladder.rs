//! The rungs and the order in which they are measured.

use base::error::{Error, Result};
use clap::ValueEnum;
use compositor::Storage;
use footage::PictureSize;
use gpu::DeviceChoice;
use light::weights::Weighting;
use reflectance::Precision;
use scene::{Effects, Pass, STRENGTHS};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;
use training::{Preset, TrainingConfig};

/// Settings of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, clap::Args)]
pub struct TradeoffSettings {
    /// Compare with the truth in this folder, which contains truth.json and truth/.
    #[arg(long, value_name = "DIR", conflicts_with = "hold_out")]
    pub truth: Option<PathBuf>,
    /// Compare with this pose, from 0, which is held out of all training [default: the middle one, if there is no
    /// truth].
    #[arg(long, value_name = "POSE")]
    pub hold_out: Option<usize>,
    /// Minutes of training for all networks together. Measuring takes a few seconds more per rung.
    #[arg(long, value_name = "MINUTES", default_value_t = 60.0, value_parser = minutes)]
    pub budget: f64,
    /// Minutes of training for the base, instead of a share of the budget.
    #[arg(long, value_name = "MINUTES", value_parser = base_minutes, conflicts_with = "budget")]
    #[serde(default)]
    pub base_minutes: Option<f64>,
    /// Start no new setting after this many minutes; run again to continue. The base is always measured.
    #[arg(long, value_name = "MINUTES", value_parser = minutes)]
    #[serde(skip)]
    pub within: Option<f64>,
    /// Vary only these settings [default: all].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "KNOB")]
    pub knobs: Vec<Knob>,
    /// Train and measure each rung with this many seeds, 1 to 20; the budget is shared among them. The base and its
    /// training times come first, with all seeds, then the other rungs with the first seed, then the rest.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=20))]
    pub seeds: u64,
    /// Part of the plate to compare, at the plate's resolution: the whole plate, or the square that the network sees
    /// (box).
    #[arg(long, value_enum, default_value_t)]
    pub at: PictureSize,
    /// Also train with features from the network in this file.
    #[arg(long, value_name = "FILE")]
    pub features: Option<PathBuf>,
    /// Also measure LPIPS, with the weights in this file: SqueezeNet 1.1 and lpips.lin0 to lpips.lin6.
    #[arg(long, value_name = "FILE")]
    pub lpips: Option<PathBuf>,
    /// Set earlier measurements aside and start again.
    #[arg(long)]
    #[serde(skip)]
    pub fresh: bool,
    /// Device of the network.
    #[arg(long, value_enum, default_value_t)]
    #[serde(skip)]
    pub device: DeviceChoice,
}

impl Default for TradeoffSettings {
    fn default() -> Self {
        Self {
            truth: None,
            hold_out: None,
            budget: 60.0,
            base_minutes: None,
            within: None,
            knobs: Vec::new(),
            seeds: 1,
            at: PictureSize::Plate,
            features: None,
            lpips: None,
            fresh: false,
            device: DeviceChoice::default(),
        }
    }
}

/// Parses a budget in minutes: 0.05 to 100,000.
fn minutes(text: &str) -> std::result::Result<f64, String> {
    base::numbers::within(0.05f64..=1e5)(text)
}

/// Parses the base's minutes: 0.001 to 10,000.
fn base_minutes(text: &str) -> std::result::Result<f64, String> {
    base::numbers::within(0.001f64..=1e4)(text)
}

/// Setting that a rung changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// Training time of the network; 0: carried-over exemplars alone.
    Minutes,
    /// Working size of the network; light is transferred from there to the plate's size.
    Size,
    /// Channels of the network.
    Width,
    /// Blocks of the network.
    Depth,
    /// Lamps compared in a training step.
    LampsPerStep,
    /// Features for comparing pictures in training.
    Features,
    /// Training weight of relit pictures, next to OLATs.
    Rendering,
    /// Training weight of steadiness: penalizes light that changes with small movements.
    Steadiness,
    /// Precision of the network's products.
    Precision,
    /// Lamps in the prediction.
    Lamps,
    /// Storage of predicted OLATs.
    Field,
    /// Weighting of the lamps for an environment.
    Weights,
    /// Size of the environment in texels.
    Environment,
    /// Each effect at half strength.
    Effects,
    /// All changes that paid off individually, combined.
    Together,
}

impl Knob {
    /// Name on the command line and in files.
    pub fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Display name.
    pub fn label(self) -> &'static str {
        match self {
            Self::Minutes => "Training time",
            Self::Size => "Working size",
            Self::Width => "Network width",
            Self::Depth => "Network depth",
            Self::LampsPerStep => "Lamps per step",
            Self::Features => "Training features",
            Self::Rendering => "Rendering loss",
            Self::Steadiness => "Steadiness",
            Self::Precision => "Precision",
            Self::Lamps => "Lamps",
            Self::Field => "OLAT storage",
            Self::Weights => "Weights",
            Self::Environment => "Environment size",
            Self::Effects => "Effects",
            Self::Together => "Together",
        }
    }

    /// True if the setting needs a network of its own.
    pub fn trains(self) -> bool {
        !matches!(self, Self::Field | Self::Weights | Self::Environment | Self::Effects)
    }
}

/// A network to train.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Network {
    /// Name of its folder.
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    /// Number of predicted lamps.
    pub lamps: usize,
    pub config: TrainingConfig,
}

/// Storage and lighting of predictions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Show {
    pub storage: Storage,
    /// Number of principal components over the lamps, instead of `storage`.
    pub components: Option<usize>,
    pub weighting: Weighting,
    /// Columns of the environment after averaging down.
    pub environment_columns: Option<usize>,
    pub effects: Effects,
}

/// One combination of settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Name of its change, such as `size=64`; `base` changes nothing.
    pub name: String,
    /// None for the base.
    pub knob: Option<Knob>,
    pub network: Network,
    /// Minutes of training for its network.
    pub minutes: f64,
    pub show: Show,
}

/// Name of the reference rung.
pub const BASE: &str = "base";

/// Properties of a project that determine its rungs.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// The project's working size in pixels.
    pub size: usize,
    /// Height of the network's square in pixels of the plate or of the exemplars, whichever is smaller.
    pub source: usize,
    /// Lamps of the project.
    pub lamps: usize,
    /// Poses for training.
    pub poses: usize,
    /// True if kinds of weights can be compared, which needs a truth.
    pub has_truth: bool,
    /// Columns of the largest environment.
    pub environment_columns: usize,
    /// Precisions that differ from the base's on the device.
    pub precisions: Vec<Precision>,
}

/// Smallest useful working size.
const LEAST_SIZE: usize = 16;
/// Training times of further rungs, as shares of the base's: none, shorter runs of their own, and longer ones that
/// continue the base.
const SHORTER: [f64; 3] = [0.0, 0.25, 0.5];
const LONGER: [f64; 2] = [2.0, 4.0];
/// Number of networks that combine the changes that paid off.
const TOGETHER: usize = 2;

/// Rungs known in advance: first those without training, then the most informative ones.
pub fn rungs(facts: &Facts, settings: &TradeoffSettings) -> Vec<Rung> {
    // Minutes are divided once the number of networks is known.
    let mut all = with_minutes(facts, settings, 1.0);
    let units: f64 = {
        let mut trained: Vec<(&str, f64)> = Vec::new();
        for rung in &all {
            match trained.iter_mut().find(|(name, _)| *name == rung.network.name) {
                Some((_, minutes)) => *minutes = minutes.max(rung.minutes),
                None => trained.push((&rung.network.name, rung.minutes)),
            }
        }
        let together = if asks(settings, Knob::Together) { TOGETHER } else { 0 };
        trained.iter().map(|(_, minutes)| minutes).sum::<f64>() + together as f64
    };
    let shared = || settings.budget / (units * settings.seeds as f64);
    let unit = settings.base_minutes.unwrap_or_else(shared);
    all.iter_mut().for_each(|rung| rung.minutes *= unit);
    all
}

fn asks(settings: &TradeoffSettings, knob: Knob) -> bool {
    settings.knobs.is_empty() || settings.knobs.contains(&knob)
}

/// Training settings of the base, without its minutes.
pub(crate) fn base_config() -> TrainingConfig {
    TrainingConfig { minutes: None, ..Preset::Quick.config() }
}

/// Rungs with `unit` minutes of training for the base.
fn with_minutes(facts: &Facts, settings: &TradeoffSettings, unit: f64) -> Vec<Rung> {
    let config = base_config();
    let base = Rung {
        name: BASE.to_owned(),
        knob: None,
        network: Network { name: BASE.to_owned(), size: facts.size, lamps: facts.lamps, config },
        minutes: unit,
        show: Show::default(),
    };
    let mut all = vec![base.clone()];
    let mut turn = |knob: Knob, value: String, change: &dyn Fn(&mut Rung)| {
        if !asks(settings, knob) {
            return;
        }
        let mut rung = base.clone();
        change(&mut rung);
        rung.name = format!("{}={value}", knob.name());
        rung.knob = Some(knob);
        let is_another = rung.network != base.network || SHORTER.contains(&(rung.minutes / unit));
        if is_another {
            rung.network.name.clone_from(&rung.name);
        }
        // A knob that already has this value gives no rung.
        if is_another || rung.show != base.show || rung.minutes != base.minutes {
            all.push(rung);
        }
    };
    for storage in [Storage::F32, Storage::F16] {
        let value = storage.to_possible_value().map(|v| v.get_name().to_owned());
        turn(Knob::Field, value.unwrap_or_default(), &|rung| {
            rung.show.storage = storage;
        });
    }
    for components in [4, 8, 16, 32].into_iter().filter(|&k| k < 3 * facts.lamps) {
        turn(Knob::Field, format!("{components}-components"), &|rung| {
            rung.show.components = Some(components);
        });
    }
    if facts.has_truth {
        for &weighting in Weighting::value_variants() {
            let value = weighting.to_possible_value().map(|v| v.get_name().to_owned());
            turn(Knob::Weights, value.unwrap_or_default(), &|rung| {
                rung.show.weighting = weighting;
            });
        }
    }
    let columns = [512, 128, 32].into_iter();
    for columns in columns.filter(|&columns| columns < facts.environment_columns) {
        turn(Knob::Environment, columns.to_string(), &|rung| {
            rung.show.environment_columns = Some(columns);
        });
    }
    for strength in STRENGTHS.iter().filter(|s| s.pass != Pass::Smoothing) {
        turn(Knob::Effects, strength.pass.name().replace('_', "-"), &|rung| {
            *(strength.of)(&mut rung.show.effects) = 0.5 * strength.most;
        });
    }
    for share in SHORTER {
        turn(Knob::Minutes, format!("{share}x"), &|rung| rung.minutes *= share);
    }
    let most = facts.source.max(facts.size);
    let mut sizes = vec![64, 128, 256, 512, facts.size / 2, 2 * facts.size];
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes.into_iter().filter(|&size| (LEAST_SIZE..=most).contains(&size)) {
        turn(Knob::Size, size.to_string(), &|rung| rung.network.size = size);
    }
    for (width, most) in [(8, 32), (24, 96), (32, 256)] {
        turn(Knob::Width, width.to_string(), &|rung| {
            rung.network.config.width = width;
            rung.network.config.most_channels = most;
        });
    }
    for lamps in [24, 12, 6].into_iter().filter(|&lamps| lamps < facts.lamps) {
        turn(Knob::Lamps, lamps.to_string(), &|rung| rung.network.lamps = lamps);
    }
    turn(Knob::Features, "none".to_owned(), &|rung| {
        rung.network.config.perceptual = 0.0;
        rung.network.config.pixel = 1.0;
    });
    if let Some(file) = &settings.features {
        turn(Knob::Features, "file".to_owned(), &|rung| {
            rung.network.config.features = Some(file.clone());
            rung.network.config.lamps_per_step = Some(8.min(facts.lamps));
        });
    }
    for &precision in &facts.precisions {
        let value = precision.to_possible_value().map(|v| v.get_name().to_owned());
        turn(Knob::Precision, value.unwrap_or_default(), &|rung| {
            rung.network.config.precision = precision;
        });
    }
    let blocks = facts.size.ilog2() as usize + 1;
    for depth in [4, 6].into_iter().filter(|&depth| depth < blocks) {
        turn(Knob::Depth, depth.to_string(), &|rung| {
            rung.network.config.depth = Some(depth);
        });
    }
    for (value, first, last) in [("0", 0.0, None), ("0.5-to-0", 0.5, Some(0.0)), ("0-to-0.5", 0.0, Some(0.5))] {
        turn(Knob::Rendering, value.to_owned(), &|rung| {
            rung.network.config.rendering = first;
            rung.network.config.rendering_end = last;
        });
    }
    for lamps in [8].into_iter().filter(|&lamps| lamps < facts.lamps) {
        turn(Knob::LampsPerStep, lamps.to_string(), &|rung| {
            rung.network.config.lamps_per_step = Some(lamps);
        });
    }
    turn(Knob::Steadiness, "1".to_owned(), &|rung| {
        rung.network.config.steadiness = 1.0;
    });
    for share in LONGER {
        turn(Knob::Minutes, format!("{share}x"), &|rung| rung.minutes *= share);
    }
    all
}

/// Order of rungs and seeds: the base, its training times, all others with the first seed; second, what can wait. A run
/// that is stopped early knows the spread between seeds before it knows all rungs.
pub fn order(rungs: &[Rung], seeds: Range<u64>) -> [Vec<(Rung, u64)>; 2] {
    let with = |wanted: &dyn Fn(&Rung) -> bool, seeds: Range<u64>| -> Vec<(Rung, u64)> {
        let seed_rungs = move |seed| {
            let wanted = rungs.iter().filter(move |rung| wanted(rung));
            wanted.map(move |rung| (rung.clone(), seed))
        };
        seeds.flat_map(seed_rungs).collect()
    };
    let is_length = |rung: &Rung| rung.knob == Some(Knob::Minutes);
    let is_other = |rung: &Rung| rung.knob.is_some() && !is_length(rung);
    let (first, others) = (seeds.start..seeds.start + 1, seeds.start + 1..seeds.end);
    let mut sooner = with(&|rung| rung.knob.is_none(), seeds.clone());
    sooner.extend(with(&is_length, seeds));
    sooner.extend(with(&is_other, first));
    [sooner, with(&is_other, others)]
}

impl Rung {
    /// True if a training step does the same work as one of `other`.
    pub(crate) fn steps_as(&self, other: &Self) -> bool {
        let work = |rung: &Self| {
            let network = rung.network.clone();
            let config = TrainingConfig { rendering: 1.0, rendering_end: None, ..network.config };
            (network.size, network.lamps, config)
        };
        work(self) == work(other)
    }

    /// Combines this rung with the change from `base` to `other`, which must be another knob.
    #[must_use]
    pub(crate) fn and(mut self, other: &Self, base: &Self) -> Self {
        let (mine, theirs, plain) = (&mut self.network.config, &other.network.config, &base.network.config);
        if theirs.width != plain.width {
            (mine.width, mine.most_channels) = (theirs.width, theirs.most_channels);
        }
        if theirs.depth != plain.depth {
            mine.depth = theirs.depth;
        }
        if theirs.features != plain.features || theirs.pixel != plain.pixel {
            mine.features.clone_from(&theirs.features);
            (mine.pixel, mine.perceptual) = (theirs.pixel, theirs.perceptual);
        }
        if theirs.lamps_per_step != plain.lamps_per_step {
            mine.lamps_per_step = theirs.lamps_per_step;
        }
        if theirs.precision != plain.precision {
            mine.precision = theirs.precision;
        }
        if other.network.size != base.network.size {
            self.network.size = other.network.size;
            // The number of blocks chosen for a larger picture may be too high.
            let most = self.network.size.ilog2() as usize + 1;
            self.network.config.depth = self.network.config.depth.map(|depth| depth.min(most));
        }
        if other.network.lamps != base.network.lamps {
            self.network.lamps = other.network.lamps;
        }
        if other.show.storage != base.show.storage || other.show.components != base.show.components {
            self.show.storage = other.show.storage;
            self.show.components = other.show.components;
        }
        if other.show.weighting != base.show.weighting {
            self.show.weighting = other.show.weighting;
        }
        if other.show.environment_columns != base.show.environment_columns {
            self.show.environment_columns = other.show.environment_columns;
        }
        self
    }
}

impl TradeoffSettings {
    /// Refuses settings that cannot be compared.
    ///
    /// # Errors
    /// When pictures would be compared at the working size, which differs between rungs.
    pub fn check(&self) -> Result<()> {
        if self.at == PictureSize::Square {
            return Err(Error::invalid(
                "pictures at the working size cannot be compared, because some settings have another working size",
                "Choose --at plate or --at box",
            ));
        }
        Ok(())
    }
}
