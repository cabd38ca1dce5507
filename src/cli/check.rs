//! `afterlight check`.

use super::OutputArgs;
use super::console::Console;
use ::check::Level;
use base::error::{Error, Result};
use clap::Args;
use export::Rebuild;
use serde::Serialize;
use std::path::{Path, PathBuf};
use worker::{Job, Outcome};

/// The last line, for those who want to know what was not looked at.
const HARD_CASES: &str = "Damaged files, extreme light and other hard cases: docs/stability.md says what is done about each";

/// Check how far a project can be trusted: lamps, camera response, interview light, frames, environments. Each check is
/// green, amber, red or not known, with a sentence and a remedy.
///
/// Or rebuild the picture of an exported EXR from its light layers and say how much is missing.
///
/// The exit code is 0 if the check could be made, whatever its result. With --strict it is 1 unless all is green.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight check interview --strict --environment courtyard\n         afterlight check shot.0007.exr"
)]
pub struct CheckArgs {
    /// The project's folder, or an EXR with light layers.
    project: PathBuf,
    /// Check under this environment: one of the project's, a built-in one or a panorama's file. Can be given several
    /// times [default: all of the project's].
    #[arg(long, value_name = "NAME")]
    environment: Vec<PathBuf>,
    /// Exit with 1 if anything is amber, red or not known, so that a pipeline stops.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    output: OutputArgs,
}

impl CheckArgs {
    /// Checks, and prints what was found.
    ///
    /// # Errors
    /// When the check cannot be made, and with `--strict` unless all is green.
    pub fn run(self) -> Result<()> {
        if is_exr(&self.project) {
            return self.check_layers();
        }
        let job = Job::Check {
            project: self.project,
            environments: self.environment,
        };
        let console = Console::new(self.output.json);
        let outcome = console.run(|progress| job.run(progress))?;
        console.finish(&outcome, || format!("{}\n{HARD_CASES}", outcome.sentence()))?;
        match outcome {
            Outcome::Checked(report) if self.strict && report.level != Level::Good => {
                Err(Error::invalid(
                    format!(
                        "{} of {} checks are not green",
                        report.checks.len() - report.count(Level::Good),
                        report.checks.len()
                    ),
                    "Do what they say, or check without --strict",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Rebuilds a picture from its light layers.
    fn check_layers(self) -> Result<()> {
        if !self.environment.is_empty() {
            return Err(Error::invalid(
                format!(
                    "{} is a picture, which is checked under no environment",
                    self.project.display()
                ),
                "Leave --environment out, or give the project's folder",
            ));
        }
        let found = Rebuild::of_file(&self.project)?;
        let figures = LayersReport {
            file: &self.project,
            found,
            level: if found.is_exact() {
                Level::Good
            } else {
                Level::Bad
            },
        };
        Console::new(self.output.json).finish(&figures, || found.file_sentence(&self.project))?;
        if self.strict && !found.is_exact() {
            return Err(Error::invalid(
                format!(
                    "the light layers of {} do not give back its picture",
                    self.project.display()
                ),
                "Export it again with its light layers, or check without --strict",
            ));
        }
        Ok(())
    }
}

/// What `--json` prints of an EXR.
#[derive(Serialize)]
struct LayersReport<'a> {
    file: &'a Path,
    #[serde(flatten)]
    found: Rebuild,
    level: Level,
}

/// A file that is named so; a project's folder may be, too.
fn is_exr(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
        && !path.is_dir()
}
