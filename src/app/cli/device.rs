//! `afterlight device`.

use super::OutputArgs;
use super::console::{self, Console};
use base::error::{Error, Result};
use benchmark::DeviceSettings;
use clap::Args;
use worker::{Job, Outcome};

/// Measure this machine, in less than eight minutes and without a project: training steps, predictions, relit
/// frames, the light turned by hand and every pass, on the GPU and on the CPU. Before you buy a card, run it on a
/// machine with that card.
///
/// Lists all adapters, tests the GPU against the CPU, and prints a table. Measurements that do not fit into the
/// time are replaced by a prediction. Ctrl-C ends the command and keeps the measurements so far.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight device --report machine.md\n         afterlight device --minutes 2 --device cpu --json"
)]
pub struct MachineArgs {
    #[command(flatten)]
    settings: DeviceSettings,
    /// Make one measurement and print it; used by the program itself.
    #[arg(long, hide = true, value_name = "REQUEST")]
    measure: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

impl MachineArgs {
    /// Rejects impossible requests.
    ///
    /// # Errors
    /// When the request is impossible.
    pub fn check(&self) -> Result<()> {
        self.settings.check()
    }

    /// Measures the machine and prints the result.
    ///
    /// # Errors
    /// As [`benchmark::device`].
    pub fn run(self) -> Result<()> {
        if let Some(request) = &self.measure {
            return benchmark::answer(request, console::print);
        }
        let program = std::env::current_exe().map_err(|e| {
            let remedy = "Each measurement starts this program: check that its file still exists";
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
