//! Measured rungs on disk: `tradeoff/ladder.json` in the project's folder, with a CSV table beside it.

use super::csv::csv;
use super::judge::Against;
use super::ladder::{BASE, TradeoffSettings, base_config};
use super::measure::Measured;
use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::machine::Machine;
use gpu::DeviceChoice;
use project::Project;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Format 1 measured the network alone, without the exemplars.
const FORMAT: u32 = 3;
const NAME: &str = "ladder.json";

/// Folder of a project's measured rungs: `ladder.json`, `ladder.csv`, `pictures/`, and the networks in `runs/`.
pub fn folder(project: &Project) -> PathBuf {
    project.root.join("tradeoff")
}

/// Measured rungs and the conditions of their figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    pub format: u32,
    pub machine: Machine,
    /// Device of the networks, and the reason for it.
    pub device: String,
    pub settings: TradeoffSettings,
    pub against: Against,
    /// [`Self::against`] in words.
    pub compared_with: String,
    /// Size and lamps of the project at the first measurement; applying a rung changes them.
    pub base: Base,
    /// Milliseconds of a training step of the base on a quiet machine. Networks are trained for as many steps as fit
    /// into their minutes at this pace, so that other work on the machine costs them no steps. None before the first
    /// training and in ladders of older versions.
    #[serde(default)]
    pub base_step_ms: Option<f64>,
    /// CRC-32 of the project's settings and calibration: figures do not carry over to another project.
    pub basis: u32,
    /// In measuring order.
    pub rungs: Vec<Measured>,
    /// Rungs that failed, and the reasons.
    pub failures: Vec<Failure>,
    /// Number of planned rungs.
    pub planned: usize,
    /// The rung in use, if one was applied.
    pub applied: Option<String>,
}

/// A rung that failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    pub rung: String,
    pub seed: u64,
    pub sentence: String,
}

/// Parts of a project that a rung may change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Base {
    pub size: usize,
    pub lamps: Vec<String>,
    pub other_lamps: Vec<String>,
    pub lamp_layout: Vec<glam::Vec3>,
}

impl Base {
    fn from_project(project: &Project) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            size: project.settings.size,
            lamps: shoot.lamps.clone(),
            other_lamps: shoot.other_lamps.clone(),
            lamp_layout: shoot.lamp_layout.clone(),
        }
    }

    /// The unchanged project, with its results in the ladder's folder.
    pub(crate) fn project(&self, project: &Project) -> Project {
        let mut base = project.variant(folder(project));
        base.settings.size = self.size;
        let shoot = &mut base.settings.shoot;
        shoot.lamps.clone_from(&self.lamps);
        shoot.other_lamps.clone_from(&self.other_lamps);
        shoot.lamp_layout.clone_from(&self.lamp_layout);
        base
    }
}

impl Ledger {
    /// An empty ledger for a project.
    ///
    /// # Errors
    /// When the project's files cannot be read.
    pub(crate) fn new(project: &Project, settings: &TradeoffSettings, against: Against, device: &str) -> Result<Self> {
        Ok(Self {
            format: FORMAT,
            machine: Machine::this(),
            device: device.to_owned(),
            settings: settings.clone(),
            compared_with: against.words(project),
            against,
            base: Base::from_project(project),
            base_step_ms: None,
            basis: basis(project)?,
            rungs: Vec::new(),
            failures: Vec::new(),
            planned: 0,
            applied: None,
        })
    }

    /// Ledger of a project; None if nothing was measured.
    ///
    /// # Errors
    /// When the file cannot be read, or has another format version.
    pub fn load(project: &Project) -> Result<Option<Self>> {
        const REMEDY: (&str, &str) = ("Measure again", "afterlight tradeoff PROJECT --fresh");
        let path = folder(project).join(NAME);
        let text = match files::read_text(&path, files::MOST_TEXT) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Error::io("open", &path, e, REMEDY)),
        };
        let ledger: Self =
            serde_json::from_str(&text).map_err(|e| Error::codec("read", &path, e.to_string(), REMEDY))?;
        if ledger.format != FORMAT {
            return Err(Error::invalid(
                format!(
                    "{} has format {}, but this version of Afterlight reads format {FORMAT}",
                    path.display(),
                    ledger.format
                ),
                REMEDY,
            ));
        }
        Ok(Some(ledger))
    }

    /// Writes the ledger and the table.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(crate) fn save(&self, project: &Project) -> Result<()> {
        let folder = folder(project);
        let text =
            serde_json::to_string_pretty(self).map_err(|e| Error::bug(format!("the ladder cannot be written: {e}")))?;
        let write = |path: &Path, text: &str| write_beside(path, |out| out.write_all(text.as_bytes()));
        write(&folder.join(NAME), &text)?;
        write(&folder.join("ladder.csv"), &csv(&self.rungs, &self.machine, &self.compared_with))
    }

    /// Adds a rung, and scales all times to the quietest moment of the machine: the base's fastest time.
    pub(crate) fn add(&mut self, measured: Measured) {
        self.rungs.push(measured);
        let bases = self.rungs.iter().map(|measured| measured.base_ms);
        let quiet = bases.filter(|&ms| ms > 0.0).fold(f64::INFINITY, f64::min);
        for measured in &mut self.rungs {
            let before = measured.frame.median;
            let factor = quiet / measured.base_ms;
            if !factor.is_finite() {
                continue;
            }
            measured.frame = measured.timed.times(factor);
            if before > 0.0 {
                measured.predict_ms *= measured.frame.median / before;
            }
            measured.cost.frame_ms = measured.frame.median;
        }
    }

    /// True if measurements under `other` continue this ledger: everything but machine, rungs and the applied rung is
    /// equal.
    pub(crate) fn continues(&self, other: &Self) -> bool {
        let asked = |settings: &TradeoffSettings| TradeoffSettings {
            fresh: false,
            within: None,
            device: DeviceChoice::default(),
            ..settings.clone()
        };
        self.format == other.format
            && asked(&self.settings) == asked(&other.settings)
            && self.device == other.device
            && self.against == other.against
            && self.basis == other.basis
            && self.machine == other.machine
            // Older versions trained by the clock.
            && (self.base_step_ms.is_some() || self.rungs.is_empty())
            // Another version of the program may train differently.
            && (self.rungs.iter().find(|m| m.rung.name == BASE))
                .is_none_or(|base| base.rung.network.config == base_config())
    }

    /// Refuses a project whose pictures, lamps or calibration changed since the measurement.
    ///
    /// # Errors
    /// When they have.
    pub(crate) fn check_basis(&self, project: &Project) -> Result<()> {
        if self.basis == basis(project)? {
            return Ok(());
        }
        Err(Error::invalid(
            "the project has changed since its settings were measured: pictures, crop square or lamps differ",
            ("Measure again", "afterlight tradeoff PROJECT --fresh"),
        ))
    }

    /// The rung in use; None if none was applied.
    pub fn in_use(&self) -> Option<&Measured> {
        let name = self.applied.as_ref()?;
        self.rungs.iter().find(|measured| measured.rung.name == *name)
    }

    /// Number of planned rungs that are not measured yet.
    pub fn left(&self) -> usize {
        let tried = self.rungs.len() + self.failures.len();
        self.planned.saturating_sub(tried)
    }

    /// A measured rung, by name and seed.
    pub fn measured(&self, name: &str, seed: u64) -> Option<&Measured> {
        let same = |measured: &&Measured| measured.rung.name == name && measured.seed == seed;
        self.rungs.iter().find(same)
    }

    /// Moves a project's measurements into a folder of their own and returns it; nothing is lost.
    ///
    /// # Errors
    /// When the folder cannot be moved.
    pub(crate) fn set_aside(project: &Project) -> Result<PathBuf> {
        let from = folder(project);
        let free = (1..).map(|n| project.root.join(format!("tradeoff-aside-{n}")));
        // The numbers never run out.
        let to = free.into_iter().find(|to| !to.exists()).unwrap_or_default();
        std::fs::rename(&from, &to)
            .map_err(|e| Error::io("move", &from, e, "Check that the project's folder can be written"))?;
        Ok(to)
    }
}

/// Fingerprint of everything that the figures depend on besides the settings: used pictures, lamps and camera response.
fn basis(project: &Project) -> Result<u32> {
    let mut settings = project.settings.clone();
    // Names, and the changes of an applied rung, do not count.
    settings.name.clear();
    settings.size = 0;
    settings.environments.clear();
    settings.color_config = None;
    let lamps = settings.shoot.all_lamps().len();
    (settings.shoot.lamps, settings.shoot.other_lamps) = (Vec::new(), Vec::new());
    settings.shoot.lamp_layout.clear();
    let text = serde_json::to_string(&settings).map_err(|e| Error::bug(format!("the settings cannot be read: {e}")))?;
    Ok(crc32fast::hash(format!("{lamps} {text}").as_bytes()))
}
