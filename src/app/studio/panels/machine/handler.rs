//! Performance of this machine: measured by a job, shown during the measurement, saved as a file.

use crate::app::StudioApp;
use crate::command::MachineCommand;
use base::error::io_words;
use base::files::{shown, write_beside};
use benchmark::{DeviceSettings, MachineReport};
use std::io::Write;
use std::path::PathBuf;
use worker::Job;

impl StudioApp {
    /// Shows this report as if it had just been measured.
    pub fn show_machine(&self, report: MachineReport) {
        self.machine.known.put(report);
    }

    pub(crate) fn apply_to_machine(&mut self, command: MachineCommand) {
        match command {
            MachineCommand::Measure(minutes) => {
                let done = self.measure_machine(minutes);
                self.refuse_unless(done);
            }
            MachineCommand::Save(path) => self.save_machine(path),
        }
    }

    fn measure_machine(&self, minutes: f64) -> Result<(), String> {
        let program = std::env::current_exe();
        let program = program.map_err(|e| format!("Program not found: {}", io_words(&e)))?;
        self.session.run(|_| Job::Device {
            program,
            settings: DeviceSettings { minutes, ..DeviceSettings::default() },
            known: Some(self.machine.known.clone()),
        })
    }

    fn save_machine(&mut self, path: PathBuf) {
        let Some(report) = &self.machine.report else {
            return self.status.refuse("Nothing was measured yet".to_owned());
        };
        let text = report.markdown();
        self.errand(
            move || {
                write_beside(&path, |out| out.write_all(text.as_bytes()))?;
                Ok(path)
            },
            |app, written| match written {
                Ok(path) => app.status.say(format!("Saved as {}", shown(&path))),
                Err(e) => app.status.refuse(e.to_string()),
            },
        );
    }
}
