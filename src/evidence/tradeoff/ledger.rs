//! Measured rungs on disk: `tradeoff/ladder.json` in the project's folder, with a table for other programs beside it.

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

/// 1 measured the network alone, without the exemplars.
const FORMAT: u32 = 3;
const NAME: &str = "ladder.json";

/// A project's folder of measured rungs: `ladder.json`, `ladder.csv`, `pictures/`, and the networks in `runs/`.
pub fn folder(project: &Project) -> PathBuf {
    project.root.join("tradeoff")
}

/// The rungs that were measured, and what the figures belong to.
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
    /// The project's size and lamps when the first rung was measured: a rung that is applied changes them.
    pub base: Base,
    /// Milliseconds of a step of the base's training when nothing slowed it down: networks are trained for as many steps as
    /// fit into their minutes then, so that other work on the machine costs none of them steps. None before the first
    /// training; ladders of older versions have none.
    #[serde(default)]
    pub base_step_ms: Option<f64>,
    /// CRC-32 of the project's settings and calibration: of another project the figures say nothing.
    pub basis: u32,
    /// In the order in which they were measured.
    pub rungs: Vec<Measured>,
    /// Rungs that could not be measured, and why.
    pub failures: Vec<Failure>,
    /// Number of planned rungs.
    pub planned: usize,
    /// The rung that the project uses now, if one was applied.
    pub applied: Option<String>,
}

/// A rung that could not be measured.
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
    fn of(project: &Project) -> Self {
        let shoot = &project.settings.shoot;
        Self {
            size: project.settings.size,
            lamps: shoot.lamps.clone(),
            other_lamps: shoot.other_lamps.clone(),
            lamp_layout: shoot.lamp_layout.clone(),
        }
    }

    /// The project as it was, with results of its own in the ladder's folder.
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
    /// An empty one for a project as it is.
    ///
    /// # Errors
    /// When the project's files cannot be read.
    pub(crate) fn new(
        project: &Project,
        settings: &TradeoffSettings,
        against: Against,
        device: &str,
    ) -> Result<Self> {
        Ok(Self {
            format: FORMAT,
            machine: Machine::this(),
            device: device.to_owned(),
            settings: settings.clone(),
            compared_with: against.words(project),
            against,
            base: Base::of(project),
            base_step_ms: None,
            basis: basis(project)?,
            rungs: Vec::new(),
            failures: Vec::new(),
            planned: 0,
            applied: None,
        })
    }

    /// The ledger of a project; None if nothing was measured.
    ///
    /// # Errors
    /// When the file cannot be read, or is of another version.
    pub fn load(project: &Project) -> Result<Option<Self>> {
        const REMEDY: (&str, &str) = ("Measure again", "afterlight tradeoff PROJECT --fresh");
        let path = folder(project).join(NAME);
        let text = match files::read_text(&path, files::MOST_TEXT) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Error::io("open", &path, e, REMEDY)),
        };
        let ledger: Self = serde_json::from_str(&text)
            .map_err(|e| Error::codec("read", &path, e.to_string(), REMEDY))?;
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

    /// Writes it, and the table.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(crate) fn save(&self, project: &Project) -> Result<()> {
        let folder = folder(project);
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::bug(format!("the ladder cannot be written: {e}")))?;
        let write =
            |path: &Path, text: &str| write_beside(path, |out| out.write_all(text.as_bytes()));
        write(&folder.join(NAME), &text)?;
        write(&folder.join("ladder.csv"), &csv(self))
    }

    /// Adds a rung, and brings all times to the moment when the machine was quietest: when the base was fastest.
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

    /// True if the measurements under `other` go on under this: all but machine, rungs and the applied rung is equal.
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
            // Another version of the program may train in another way.
            && (self.rungs.iter().find(|m| m.rung.name == BASE))
                .is_none_or(|base| base.rung.network.config == base_config())
    }

    /// Refuses a project whose pictures, lamps or calibration are others than those that were measured.
    ///
    /// # Errors
    /// Then.
    pub(crate) fn check_basis(&self, project: &Project) -> Result<()> {
        if self.basis == basis(project)? {
            return Ok(());
        }
        Err(Error::invalid(
            "the project has changed since its settings were measured: other pictures, another square or other lamps",
            ("Measure again", "afterlight tradeoff PROJECT --fresh"),
        ))
    }

    /// The rung that the project uses; None if none was applied.
    pub fn in_use(&self) -> Option<&Measured> {
        let name = self.applied.as_ref()?;
        self.rungs.iter().find(|measured| measured.rung.name == *name)
    }

    /// Rungs that are planned and not measured.
    pub fn left(&self) -> usize {
        let tried = self.rungs.len() + self.failures.len();
        self.planned.saturating_sub(tried)
    }

    /// A rung that was measured.
    pub fn measured(&self, name: &str, seed: u64) -> Option<&Measured> {
        let same = |measured: &&Measured| measured.rung.name == name && measured.seed == seed;
        self.rungs.iter().find(same)
    }

    /// Moves a project's measurements into a folder of their own, which is returned; nothing is lost.
    ///
    /// # Errors
    /// When the folder cannot be moved.
    pub(crate) fn set_aside(project: &Project) -> Result<PathBuf> {
        let from = folder(project);
        let free = (1..).map(|n| project.root.join(format!("tradeoff-aside-{n}")));
        // The names do not end.
        let to = free.into_iter().find(|to| !to.exists()).unwrap_or_default();
        std::fs::rename(&from, &to).map_err(|e| {
            Error::io("move", &from, e, "Check that the project's folder can be written")
        })?;
        Ok(to)
    }
}

/// Mark of all that the figures depend on besides the settings: the used pictures, the lamps and the camera's response.
fn basis(project: &Project) -> Result<u32> {
    let mut settings = project.settings.clone();
    // What an applied rung changes, and names, change nothing.
    settings.name.clear();
    settings.size = 0;
    settings.environments.clear();
    settings.color_config = None;
    let lamps = settings.shoot.all_lamps().len();
    (settings.shoot.lamps, settings.shoot.other_lamps) = (Vec::new(), Vec::new());
    settings.shoot.lamp_layout.clear();
    let text = serde_json::to_string(&settings)
        .map_err(|e| Error::bug(format!("the settings cannot be read: {e}")))?;
    Ok(crc32fast::hash(format!("{lamps} {text}").as_bytes()))
}
