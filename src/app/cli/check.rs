//! `afterlight check`.

use super::OutputArgs;
use super::console::Console;
use ::check::Level;
use base::error::{Error, Result};
use base::has_extension;
use base::numbers::within;
use clap::Args;
use export::{Fault, Rebuild, Remark, Requirements, ShotReport, Verification, names_frames};
use serde::Serialize;
use std::path::{Path, PathBuf};
use worker::{Job, Outcome};

/// Last line of the output: documentation of what the check does not cover.
const HARD_CASES: &str = "Damaged files, extreme light and other hard cases: see docs/stability.md";

/// Check a project: lamps, camera response, interview light, frames, environments. Each check is green, amber,
/// red or not known, with a sentence and a remedy.
///
/// Or check the frames of an exported shot: that none is missing, damaged or unlike the others, that their light
/// layers add up to the pictures, and that time codes and colour tags are right. --mhl writes an ASC MHL: the hashes
/// of all files of the folder. Given an ASC MHL, compares the files with it.
///
/// Or rebuild the picture of one exported EXR from its light layers and print the difference.
///
/// The exit code is 0 if the project could be checked, whatever the result. With --strict it is 1 unless all is
/// green. It is 1 if a shot has a fault, and with --strict also if part of it could not be checked.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight check interview --strict --environment courtyard\n         afterlight check shot.0007.exr\n         afterlight check shot.%04d.exr --frames 1-240 --mhl\n         afterlight check ascmhl"
)]
pub struct CheckArgs {
    /// The project's folder; or the frames of a shot: EXR files, their folder, or a pattern such as shot.%04d.exr
    /// or shot.####.exr; or an ASC MHL: a .mhl file or its folder ascmhl.
    #[arg(required = true, value_name = "PROJECT|FRAMES|MHL")]
    named: Vec<PathBuf>,
    /// Check under this environment: one of the project's, a built-in one or a panorama file. Can be given
    /// several times [default: all of the project's].
    #[arg(long, value_name = "NAME")]
    environment: Vec<PathBuf>,
    /// Exit with 1 if anything is amber, red or not known, so that a pipeline stops.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    shot: ShotArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Delivery requirements of a shot.
#[derive(Debug, Args)]
struct ShotArgs {
    /// Compare all files of the shot's folder with its ASC MHL, and write the next generation to its subfolder
    /// ascmhl if the shot has no faults.
    #[arg(long)]
    mhl: bool,
    /// Frame range required of a shot [default: from the first to the last frame found].
    #[arg(long, value_name = "A-B", allow_hyphen_values = true, value_parser = range)]
    frames: Option<(i64, i64)>,
    /// Frame rate of a shot's time codes, in frames per second [default: from the file headers].
    #[arg(long, value_name = "FPS", value_parser = within(0.01..=1000.0))]
    rate: Option<f64>,
    /// Allow neighbouring frames of a shot with the same picture.
    #[arg(long)]
    allow_repeats: bool,
}

/// Parses the first and last frame, such as `1-240` or `-8-240`.
fn range(text: &str) -> std::result::Result<(i64, i64), String> {
    let number = |s: &str| s.trim().parse::<i64>().ok();
    // The first hyphen may be the sign of the first number.
    let hyphen = text.char_indices().skip(1).find(|(_, c)| *c == '-');
    let ends = hyphen.map_or((text, text), |(at, _)| (&text[..at], &text[at + 1..]));
    match (number(ends.0), number(ends.1)) {
        (Some(from), Some(to)) if from <= to => Ok((from, to)),
        _ => Err("give the first and the last frame, such as 1-240".to_owned()),
    }
}

impl ShotArgs {
    fn is_given(&self) -> bool {
        self.mhl || self.frames.is_some() || self.rate.is_some() || self.allow_repeats
    }
}

impl CheckArgs {
    /// Runs the check and prints the result.
    ///
    /// # Errors
    /// When the check cannot run, a shot has a fault, and with `--strict` unless all is green.
    pub fn run(self) -> Result<()> {
        match &self.named[..] {
            [file] if has_extension(file, "mhl") || file.ends_with("ascmhl") => {
                self.of_frames(file)?;
                self.verify(file)
            }
            [file] if file.is_file() && has_extension(file, "exr") && !self.shot.is_given() => {
                self.of_frames(file)?;
                self.check_layers(file)
            }
            [one] if !names_frames(one) => self.check_project(one),
            named => {
                self.of_frames(&named[0])?;
                self.check_shot()
            }
        }
    }

    fn check_project(&self, project: &Path) -> Result<()> {
        if self.shot.is_given() {
            return Err(Error::invalid(
                format!("{} is not a shot", project.display()),
                "Leave --mhl, --frames, --rate and --allow-repeats out, or name a shot's frames",
            ));
        }
        let job = Job::Check { project: project.to_path_buf(), environments: self.environment.clone() };
        let console = Console::new(self.output.json);
        let outcome = console.run(|progress| job.run(progress))?;
        console.finish(&outcome, || format!("{}\n{HARD_CASES}", outcome.sentence()))?;
        match outcome {
            Outcome::Checked(report) if self.strict && report.level != Level::Good => Err(Error::invalid(
                format!(
                    "{} of {} checks are not green",
                    report.checks.len() - report.count(Level::Good),
                    report.checks.len()
                ),
                "Do what they say, or check without --strict",
            )),
            _ => Ok(()),
        }
    }

    /// Checks that no environment was given: frames are checked without one.
    fn of_frames(&self, file: &Path) -> Result<()> {
        if self.environment.is_empty() {
            return Ok(());
        }
        Err(Error::invalid(
            format!("{} is not a project: an environment does not apply", file.display()),
            "Leave --environment out, or give the project's folder",
        ))
    }

    /// Checks all frames of a shot.
    fn check_shot(&self) -> Result<()> {
        let settings =
            Requirements { frames: self.shot.frames, rate: self.shot.rate, allow_repeats: self.shot.allow_repeats };
        let console = Console::new(self.output.json);
        let report = console.run(|progress| {
            let mut report = ShotReport::new(&self.named, &settings, progress)?;
            if self.shot.mhl {
                report.list_hashes(progress)?;
            }
            Ok(report)
        })?;
        let (faults, remarks) = (&report.faults, &report.remarks);
        console.finish(&report, || lines(&report.sentence, faults, remarks))?;
        self.conclude(&report.shot, faults, remarks)
    }

    /// Compares files with their hash list.
    fn verify(&self, file: &Path) -> Result<()> {
        if self.shot.is_given() {
            return Err(Error::invalid(
                format!("{} is a hash list", file.display()),
                "Leave --mhl, --frames, --rate and --allow-repeats out to compare the files with it",
            ));
        }
        let console = Console::new(self.output.json);
        let found = console.run(|progress| Verification::of_file(file, progress))?;
        let (faults, remarks) = (&found.faults, &found.remarks);
        console.finish(&found, || lines(&found.sentence, faults, remarks))?;
        self.conclude(&file.display().to_string(), faults, remarks)
    }

    /// Turns faults and remarks into the exit code of a shot.
    fn conclude(&self, shot: &str, faults: &[Fault], remarks: &[Remark]) -> Result<()> {
        let count = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
        // Remarks about optional features are printed, but do not fail a strict check.
        let open = |remark: &&Remark| !["layers", "data_window"].contains(&&*remark.kind);
        match (faults, remarks.iter().find(open)) {
            ([first, ..], _) => Err(Error::invalid(
                format!("{shot} has {}. The first: {}", count(faults.len(), "fault"), first.sentence),
                "Export the named frames again, and check the shot again",
            )),
            ([], Some(open)) if self.strict => Err(Error::invalid(
                format!("{shot} could not be fully checked. {}", open.sentence),
                "Check without --strict if that is intended",
            )),
            _ => Ok(()),
        }
    }

    /// Rebuilds a picture from its light layers.
    fn check_layers(&self, file: &Path) -> Result<()> {
        let found = Rebuild::of_file(file)?;
        let figures = LayersReport { file, found, level: if found.is_exact() { Level::Good } else { Level::Bad } };
        Console::new(self.output.json).finish(&figures, || found.file_sentence(file))?;
        if self.strict && !found.is_exact() {
            return Err(Error::invalid(
                format!("the light layers of {} do not add up to its picture", file.display()),
                "Export it again with its light layers, or check without --strict",
            ));
        }
        Ok(())
    }
}

/// Output of `--json` for an EXR.
#[derive(Serialize)]
struct LayersReport<'a> {
    file: &'a Path,
    #[serde(flatten)]
    found: Rebuild,
    level: Level,
}

/// A sentence, and a line for each fault and remark.
fn lines(sentence: &str, faults: &[Fault], remarks: &[Remark]) -> String {
    let faults = faults.iter().map(|fault| format!("fault: {}", fault.sentence));
    let remarks = remarks.iter().map(|remark| format!("note: {}", remark.sentence));
    let all: Vec<String> = [sentence.to_owned()].into_iter().chain(faults).chain(remarks).collect();
    all.join("\n")
}
