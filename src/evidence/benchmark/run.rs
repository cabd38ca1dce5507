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

/// Measuring is called this.
const STAGE: &str = "measuring this machine";
/// More runs tell no more.
const MOST_SECONDS: f64 = 8.0;
/// A measure may take so many times its share before it is ended: others take less.
const SHARES: f64 = 3.0;
/// Of what is free, how much a measure may take.
const MEMORY_SHARE: f64 = 0.9;

/// Settings of a machine's measurement.
#[derive(Clone, Debug, clap::Args)]
pub struct DeviceSettings {
    /// Minutes that all may take. What does not fit is left out, with a prediction where smaller sizes allow one.
    #[arg(long, value_name = "MINUTES", default_value_t = 8.0)]
    pub minutes: f64,
    /// The file to write the report to, as Markdown; it is written again after each measure.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Devices that are measured: auto takes a hardware GPU if there is one and the CPU; gpu any GPU, even a software one,
    /// and the CPU; cpu the CPU alone.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

impl Default for DeviceSettings {
    fn default() -> Self {
        Self { minutes: 8.0, report: None, device: DeviceChoice::Auto }
    }
}

impl DeviceSettings {
    /// Refuses minutes that cannot be.
    ///
    /// # Errors
    /// Then: what they can be.
    pub fn check(&self) -> Result<()> {
        if (0.01..=600.0).contains(&self.minutes) {
            return Ok(());
        }
        Err(Error::invalid(
            format!("--minutes is {}, and can be from 0.01 to 600", self.minutes),
            "Without it 8 minutes are taken",
        ))
    }
}

/// Measures this machine. `program` is what is started for each measure: it hands what follows [`super::REQUEST`] to
/// [`super::answer`]. Each figure is said as soon as it is known, and `known` is told all after each measure. A stop ends it
/// with what was measured so far.
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
        report: MachineReport {
            machine,
            adapters,
            minutes: settings.minutes,
            seconds: 0.0,
            stopped: false,
            devices,
        },
    };
    // A file that cannot be written is known before anything is measured.
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

/// The adapter that `untested` devices take: the fastest kind.
fn chosen(choice: DeviceChoice, adapters: &[Adapter]) -> Option<&Adapter> {
    adapters.iter().find(|adapter| match choice {
        DeviceChoice::Cpu => false,
        DeviceChoice::Auto => adapter.is_hardware(),
        DeviceChoice::Gpu => true,
    })
}

/// A machine that is being measured.
struct Run<'a> {
    program: &'a Path,
    settings: &'a DeviceSettings,
    progress: &'a Progress<'a>,
    known: &'a dyn Fn(&MachineReport),
    began: Instant,
    /// Folder of the kernels that are timed for the first time.
    kernels: tempfile::TempDir,
    report: MachineReport,
}

/// The seconds that a measure may take.
struct Time {
    /// Then it is ended.
    most: f64,
    /// It times things for so long.
    timing: f64,
}

impl Run<'_> {
    /// Tells of the report as it is now, and writes it if it has a file.
    fn save(&mut self) -> Result<()> {
        self.report.seconds = self.began.elapsed().as_secs_f64();
        (self.known)(&self.report);
        let Some(path) = &self.settings.report else {
            return Ok(());
        };
        let text = self.report.markdown();
        write_beside(path, |out| out.write_all(text.as_bytes()))
    }

    /// The time for a measure while others need so many seconds.
    fn time(&self, planned: &Planned, others: f64) -> Time {
        let all = Duration::from_secs_f64(60.0 * self.settings.minutes);
        let left = all.saturating_sub(self.began.elapsed()).as_secs_f64();
        let share = left * planned.need() / (planned.need() + others);
        // What comes first is the most important: of little time it may take a large part.
        let large = (left / 3.0).min(2.0 * planned.need());
        Time {
            most: (SHARES * share).max(large).min(left),
            // Starting a process and its first runs take time too.
            timing: (0.5 * share).min(MOST_SECONDS),
        }
    }

    /// Does one measure and adds its rows; `done` of all measures came before.
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
        let why_not = match self.report.stopped {
            true => Some(STOPPED.to_owned()),
            false => unfit(&measure, predicted.as_deref(), time.most),
        };
        if let Some(why) = why_not {
            device.leave_out(&measure, predicted.as_deref(), &why);
            return Ok(());
        }
        let request = Request { measure, gpu: on_gpu, seconds: time.timing };
        let kernels = planned.starts_anew().then(|| self.kernels.path());
        let started = Measuring::start(self.program, &request, kernels)?;
        // A figure may be replaced by one of more runs until the next follows.
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
            Ended::Late => format!(
                "it had not ended after the {:.0} s that there were for it; give it more minutes",
                time.most
            ),
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

/// Reason for leaving out all that follows a stop.
const STOPPED: &str = "measuring was stopped";

/// Reason not to begin a measure.
fn unfit(measure: &Measure, predicted: Option<&[f64]>, allowed: f64) -> Option<String> {
    // The first run and one that counts.
    let least = predicted.map(|rows| 2e-3 * rows.iter().sum::<f64>());
    if let Some(least) = least.filter(|&least| least > allowed) {
        return Some(format!(
            "it would take about {least:.0} s, and there were {allowed:.0} s for it; give it more minutes"
        ));
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
