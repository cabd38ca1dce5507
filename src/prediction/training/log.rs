//! Training logs in the project's folder.

use super::report::StepReport;
use base::error::{Error, Result};
use base::files;
use project::Project;
use reflectance::checkpoint::CheckpointInfo;
use std::fs::OpenOptions;
use std::io::{BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Losses of every step.
pub(super) const STEPS: &str = "training.csv";
/// Scores on the held-out pose.
pub(super) const HELD_OUT: &str = "held_out.csv";
/// Column names of both.
pub(super) const STEPS_HEADER: &str = "step,seconds,loss_rec,loss_render,learning_rate,gradient_norm,taken";
pub(super) const HELD_OUT_HEADER: &str = "step,seconds,decibels";

/// A table that grows line by line.
pub(super) struct Log {
    path: PathBuf,
    out: BufWriter<std::fs::File>,
}

impl Log {
    /// Opens the log of steps; a fresh one is empty.
    pub fn steps(project: &Project, fresh: bool) -> Result<Self> {
        Self::open(project.result_path(STEPS), STEPS_HEADER, fresh)
    }

    /// Opens the log of the held-out pose; a fresh one is empty.
    pub fn held_out(project: &Project, fresh: bool) -> Result<Self> {
        Self::open(project.result_path(HELD_OUT), HELD_OUT_HEADER, fresh)
    }

    fn open(path: PathBuf, header: &str, fresh: bool) -> Result<Self> {
        let fail = |e: std::io::Error| Error::io("write", &path, e, "Check that the folder can be written");
        if !fresh {
            remove_torn_line(&path).map_err(fail)?;
        }
        let mut options = OpenOptions::new();
        options.create(true).write(true).append(!fresh).truncate(fresh);
        let file = files::open_own(&path, &options).map_err(fail)?;
        let empty = file.metadata().map_err(fail)?.len() == 0;
        let mut log = Self { out: BufWriter::new(file), path };
        if empty {
            log.line(header)?;
        }
        Ok(log)
    }

    /// A step's figures.
    pub fn step(&mut self, info: &CheckpointInfo, report: &StepReport) -> Result<()> {
        let show = |loss: Option<f32>| loss.map_or(String::new(), |l| l.to_string());
        self.line(&format!(
            "{},{:.3},{},{},{:e},{},{}",
            info.step,
            info.seconds,
            show(report.reconstruction),
            show(report.rendering),
            report.learning_rate,
            report.gradient_norm,
            report.taken
        ))
    }

    /// Score on the held-out pose.
    pub fn held_out_score(&mut self, info: &CheckpointInfo, decibels: f32) -> Result<()> {
        self.line(&format!("{},{:.3},{decibels}", info.step, info.seconds))
    }

    fn line(&mut self, line: &str) -> Result<()> {
        // A whole line at once: after a full disk it can be written again.
        let line = format!("{line}\n");
        (self.out.write_all(line.as_bytes())).map_err(|e| self.failure(e))
    }

    pub fn flush(&mut self) -> Result<()> {
        self.out.flush().map_err(|e| self.failure(e))
    }

    fn failure(&self, cause: std::io::Error) -> Error {
        Error::io("write", &self.path, cause, "Check that the disk has room")
    }
}

/// Removes an incomplete last line, left by a killed run.
fn remove_torn_line(path: &Path) -> std::io::Result<()> {
    /// Our lines are far shorter.
    const LONGEST: u64 = 1 << 16;
    let mut file = match files::open_own(path, OpenOptions::new().read(true)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        file => file?,
    };
    let length = file.metadata()?.len();
    let start = length.saturating_sub(LONGEST);
    let mut end = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(LONGEST).read_to_end(&mut end)?;
    let whole = match end.iter().rposition(|&b| b == b'\n') {
        Some(at) => start + at as u64 + 1,
        None if start == 0 => 0,
        None => {
            let problem = "its last line is far too long: this is not a log of Afterlight";
            return Err(std::io::Error::new(ErrorKind::InvalidData, problem));
        }
    };
    if whole < length {
        let file = files::open_own(path, OpenOptions::new().write(true))?;
        file.set_len(whole)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_is_removed_and_the_log_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let after = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let mut log = Log::open(path.clone(), "a,b", false).unwrap();
            log.line("3,4").unwrap();
            log.flush().unwrap();
            std::fs::read_to_string(&path).unwrap()
        };
        for text in ["a,b\n1,2\n", "a,b\n1,2\n3,"] {
            assert_eq!(after(text), "a,b\n1,2\n3,4\n");
        }
        for text in ["", "a,"] {
            assert_eq!(after(text), "a,b\n3,4\n");
        }
        let long = "0,1\n".repeat(50_000);
        assert_eq!(after(&(long.clone() + "2,")), long + "3,4\n");
        // Other files stay.
        let other = "x".repeat(100_000);
        std::fs::write(&path, &other).unwrap();
        assert!(Log::open(path.clone(), "a,b", false).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
    }

    #[cfg(unix)]
    #[test]
    fn what_a_link_leads_to_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let (diary, path) = (folder.path().join("diary"), folder.path().join("log.csv"));
        std::fs::write(&diary, "dear diary").unwrap();
        std::os::unix::fs::symlink(&diary, &path).unwrap();
        for fresh in [true, false] {
            let refused = Log::open(path.clone(), "a,b", fresh).err().unwrap().to_string();
            assert!(refused.contains("log.csv") && refused.contains("a link"), "{refused}");
        }
        assert_eq!(std::fs::read_to_string(&diary).unwrap(), "dear diary");
        test_support::shown!(
            Strangers,
            "`training.csv` is a link",
            done: "a link is refused",
        );
    }
}
