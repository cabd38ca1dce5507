//! Measures a machine within minutes.

use super::measure::{Measure, Request};
use super::plan::{Planned, plan};
use super::process::{Ended, Measuring};
use super::report::{DeviceReport, MachineReport};
use base::error::{Error, Result};
use base::files::write_beside;
use base::machine::Machine;
use base::memory;
use base::progress::Progress;
use gpu::{Adapter, DeviceChoice};
use std::collections::VecDeque;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the progress bar.
const STAGE: &str = "measuring this machine";
/// Most runs of one kind: more add no information.
const MOST_SECONDS: f64 = 8.0;
/// A measure is ended after this multiple of its share, as others take less than theirs.
const SHARES: f64 = 3.0;
/// Share of the free memory that a measure may take.
const MEMORY_SHARE: f64 = 0.9;

/// Settings of a machine's measurement.
#[derive(Clone, Debug, clap::Args)]
pub struct DeviceSettings {
    /// Minutes for the whole run. What does not fit is left out, with a prediction from smaller sizes where possible.
    #[arg(long, value_name = "MINUTES", default_value_t = 8.0)]
    pub minutes: f64,
    /// Report file in Markdown, rewritten after each measure.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Devices to measure: auto takes the CPU and a hardware GPU if there is one; gpu takes the CPU and any GPU, even a
    /// software one; cpu takes only the CPU.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

impl Default for DeviceSettings {
    fn default() -> Self {
        Self { minutes: 8.0, report: None, device: DeviceChoice::Auto }
    }
}

impl DeviceSettings {
    /// Checks the minutes.
    ///
    /// # Errors
    /// When they are out of range; the message gives the range.
    pub fn check(&self) -> Result<()> {
        if (0.01..=600.0).contains(&self.minutes) {
            return Ok(());
        }
        Err(Error::invalid(
            format!("--minutes must be from 0.01 to 600, not {}", self.minutes),
            "The default is 8 minutes",
        ))
    }
}

/// Measures this machine. `program` is started for each measure and passes what follows [`super::REQUEST`] to
/// [`super::answer`]. Each figure is reported as soon as it is known; `known` receives the whole report after each
/// measure. A stop ends the run and keeps what was measured.
///
/// # Errors
/// When `program` cannot be started, or the report cannot be written.
pub fn device(
    program: &Path,
    settings: &DeviceSettings,
    progress: &Progress,
    known: &dyn Fn(&MachineReport),
) -> Result<MachineReport> {
    settings.check()?;
    let began = Instant::now();
    progress.step(STAGE, 0, 1, "looking for GPUs");
    let adapters = gpu::adapters();
    let machine = Machine::this();
    let gpu = chosen(settings.device, &adapters).map(|gpu| DeviceReport::new("gpu", &gpu.name));
    let cpu = DeviceReport::new("cpu", &machine.processor);
    let devices: Vec<DeviceReport> = gpu.into_iter().chain([cpu]).collect();
    let mut planned: VecDeque<Planned> = plan(devices.len() > 1).into();
    let total = planned.len() as u64;
    let mut run = Run {
        program,
        settings,
        progress,
        known,
        began,
        kernels: tempfile::tempdir().map_err(|e| {
            let remedy = "Check that the disk has room";
            Error::io("make", std::env::temp_dir(), e, remedy)
        })?,
        report: MachineReport { machine, adapters, minutes: settings.minutes, seconds: 0.0, stopped: false, devices },
    };
    // An unwritable file is reported before the measuring starts.
    run.save()?;
    while let Some(next) = planned.pop_front() {
        let others = planned.iter().map(Planned::need).sum();
        let done = total - 1 - planned.len() as u64;
        run.measure(&next, others, (done, total))?;
        run.save()?;
    }
    progress.step(STAGE, total, total, "");
    Ok(run.report)
}

/// The fastest kind of adapter, from those that the device choice allows.
fn chosen(choice: DeviceChoice, adapters: &[Adapter]) -> Option<&Adapter> {
    adapters.iter().find(|adapter| match choice {
        DeviceChoice::Cpu => false,
        DeviceChoice::Auto => adapter.is_hardware(),
        DeviceChoice::Gpu => true,
    })
}

/// Measurement in progress.
struct Run<'a> {
    program: &'a Path,
    settings: &'a DeviceSettings,
    progress: &'a Progress<'a>,
    known: &'a dyn Fn(&MachineReport),
    began: Instant,
    /// Folder of newly tuned kernels.
    kernels: tempfile::TempDir,
    report: MachineReport,
}

/// Seconds allowed for a measure.
struct Time {
    /// Seconds after which the measure is ended.
    most: f64,
    /// Seconds of timed work.
    timing: f64,
}

impl Run<'_> {
    /// Publishes the current report, and writes its file if there is one.
    fn save(&mut self) -> Result<()> {
        self.report.seconds = self.began.elapsed().as_secs_f64();
        (self.known)(&self.report);
        let Some(path) = &self.settings.report else { return Ok(()) };
        let text = self.report.markdown();
        write_beside(path, |out| out.write_all(text.as_bytes()))
    }

    /// Time for a measure while others need so many seconds.
    fn time(&self, planned: &Planned, others: f64) -> Time {
        let all = Duration::from_secs_f64(60.0 * self.settings.minutes);
        let left = all.saturating_sub(self.began.elapsed()).as_secs_f64();
        let share = left * planned.need() / (planned.need() + others);
        // The most important measures come first and may take a large part of a short budget.
        let large = (left / 3.0).min(2.0 * planned.need());
        Time {
            most: (SHARES * share).max(large).min(left),
            // Starting a process and its first runs also take time.
            timing: (0.5 * share).min(MOST_SECONDS),
        }
    }

    /// Runs one measure and adds its rows. `done` counts the measures before it.
    fn measure(&mut self, planned: &Planned, others: f64, done: (u64, u64)) -> Result<()> {
        self.report.stopped |= self.progress.cancelled();
        let Planned { on_gpu, measure } = *planned;
        let time = self.time(planned, others);
        let kind = if on_gpu { "gpu" } else { "cpu" };
        let device = (self.report.devices.iter_mut()).find(|device| device.kind == kind);
        let device = device.ok_or_else(|| Error::bug("a device was planned that is not there"))?;
        let note = format!("{}: {}", kind.to_uppercase(), measure.words());
        self.progress.step(STAGE, done.0, done.1, note);
        let predicted = measure.predicted(&device.rows);
        let why_not = if self.report.stopped {
            Some(STOPPED.to_owned())
        } else {
            unfit(&measure, predicted.as_deref(), time.most)
        };
        if let Some(why) = why_not {
            device.leave_out(&measure, predicted.as_deref(), &why);
            return Ok(());
        }
        let request = Request { measure, gpu: on_gpu, seconds: time.timing };
        let kernels = planned.starts_fresh().then(|| self.kernels.path());
        let started = Measuring::start(self.program, &request, kernels)?;
        // A figure may still be replaced by one of more runs until the next one arrives.
        let mut last = None;
        let said = |device: &DeviceReport, row: Option<usize>| {
            if let Some(row) = row.and_then(|row| device.rows.get(row)) {
                self.progress.say(device.sentence(row));
            }
        };
        let ended = started.wait(Duration::from_secs_f64(time.most), self.progress, |figure| {
            let row = device.found(&measure, kernels.is_some(), figure);
            if last != Some(row) {
                said(device, last);
            }
            last = Some(row);
        });
        said(device, last);
        let why = match ended {
            Ended::Done => return Ok(()),
            Ended::Failed(why) => why,
            Ended::Late => format!("it did not finish within the {:.0} s allowed; give it more minutes", time.most),
            Ended::Stopped => {
                self.report.stopped = true;
                STOPPED.to_owned()
            }
        };
        device.leave_out(&measure, predicted.as_deref(), &why);
        if !self.report.stopped {
            self.progress.say(format!("{}: {}: {why}", kind.to_uppercase(), measure.words()));
        }
        Ok(())
    }
}

/// Reason for rows left out after a stop.
const STOPPED: &str = "measuring was stopped";

/// Reason not to start a measure.
fn unfit(measure: &Measure, predicted: Option<&[f64]>, allowed: f64) -> Option<String> {
    // The first run and one that counts.
    let least = predicted.map(|rows| 2e-3 * rows.iter().sum::<f64>());
    if let Some(least) = least.filter(|&least| least > allowed) {
        return Some(format!("it would take about {least:.0} s of the {allowed:.0} s allowed; give it more minutes"));
    }
    if allowed <= 0.0 {
        return Some("the time was up; give it more minutes".to_owned());
    }
    let free = memory::available()?;
    let needs = measure.bytes();
    (needs as f64 > MEMORY_SHARE * free as f64).then(|| {
        let [needs, free] = [needs, free].map(|bytes| bytes as f64 / 1e9);
        format!("it needs about {needs:.1} GB of memory, and {free:.1} GB are free")
    })
}
