//! `afterlight device`.

use super::OutputArgs;
use super::console::{self, Console};
use base::error::{Error, Result};
use benchmark::DeviceSettings;
use clap::Args;
use worker::{Job, Outcome};

/// Measure what this machine can do, in less than eight minutes and without a project: training steps, predictions, relit
/// frames, the light turned by hand and every pass, on the GPU and on the CPU. Run it before you buy a card, on a machine
/// that has one.
///
/// It lists all adapters, tests the GPU against the CPU, and prints a table. What does not fit into the time is left out,
/// with a prediction. Ctrl-C ends it with what was measured so far.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight device --report machine.md\n         afterlight device --minutes 2 --device cpu --json"
)]
pub struct MachineArgs {
    #[command(flatten)]
    settings: DeviceSettings,
    /// Make one measurement and print it; the program runs itself so.
    #[arg(long, hide = true, value_name = "REQUEST")]
    measure: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

impl MachineArgs {
    /// Refuses what cannot be measured.
    ///
    /// # Errors
    /// Then.
    pub fn check(&self) -> Result<()> {
        self.settings.check()
    }

    /// Measures, and prints what was found.
    ///
    /// # Errors
    /// As [`benchmark::device`].
    pub fn run(self) -> Result<()> {
        if let Some(request) = &self.measure {
            return benchmark::answer(request, console::print);
        }
        let program = std::env::current_exe().map_err(|e| {
            let remedy = "Each measure is a process of this program: check that it is still there";
            Error::io("find", "this program", e, remedy)
        })?;
        let console = Console::new(self.output.json);
        let job = Job::Device { program, settings: self.settings, known: None };
        let outcome = console.run(|progress| job.run(progress))?;
        console.finish(&outcome, || match &outcome {
            Outcome::Machine(report) => report.markdown(),
            other => other.sentence(),
        })
    }
}
