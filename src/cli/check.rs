//! `afterlight check`.

use super::OutputArgs;
use super::console::Console;
use ::check::Level;
use base::error::{Error, Result};
use clap::Args;
use std::path::PathBuf;
use worker::{Job, Outcome};

/// The last line, for those who want to know what was not looked at.
const HARD_CASES: &str = "Damaged files, extreme light and other hard cases: docs/stability.md says what is done about each";

/// Say how far a project can be trusted: lamps, camera response, interview light, frames, environments. Each check is
/// green, amber, red or not known, with a sentence and a remedy.
///
/// The exit code is 0 if the check could be made, whatever it says. With --strict it is 1 unless all is green.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight check interview --strict --environment courtyard")]
pub struct CheckArgs {
    /// The project's folder.
    project: PathBuf,
    /// Check under this environment: one of the project's, a built-in one or a panorama's file. Can be given several
    /// times [default: all of the project's].
    #[arg(long, value_name = "NAME")]
    environment: Vec<PathBuf>,
    /// Exit with 1 if anything is amber, red or not known, as a pipeline wants that must not go on then.
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
}
