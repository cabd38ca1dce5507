//! Last step of a job: checks every frame, and joins the movie.

use super::chunk::{FRAMES, frame_bytes};
use super::chunks::spans;
use super::job::Job;
use super::record::Record;
use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use base::shell::quoted;
use export::{Destination, Flaw, FlawedFrame, flawed_frames, handed_over, join_movie};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Most spans of frames in a message.
const NAMED: usize = 8;

/// Report on a job, stored in `report.json`.
#[derive(Clone, Debug, Serialize)]
pub struct AssembleReport {
    /// Number of frames.
    pub frames: usize,
    /// Destination of the result; None if frames have to be written again.
    pub output: Option<Destination>,
    /// Files written for other programs, in the requested order.
    pub hand_over: Vec<PathBuf>,
    /// Frames that have to be written again.
    pub flawed: Vec<FlawedFrame>,
    /// Commands that write them again.
    pub again: Vec<String>,
    /// Total seconds of all workers, from the chunks' records.
    pub worker_seconds: f64,
    /// Bytes of all frames, without light layers in separate files.
    pub frame_bytes: u64,
    pub chunks: Vec<Record>,
}

impl AssembleReport {
    /// Result of the job in one sentence.
    pub fn sentence(&self) -> String {
        let handed_over = handed_over(&self.hand_over);
        format!(
            "All {} frames are complete and match this job: {}. The workers took {:.1} s together{handed_over}",
            self.frames,
            self.output.clone().unwrap_or_default(),
            self.worker_seconds
        )
    }
}

/// Checks that each frame of the job in `folder` is complete and made from the snapshot. Then joins the movie as a single
/// export would, and writes the files for other programs. Stills stay in place. `report.json` holds the result.
///
/// # Errors
/// When frames have to be written again (the message has the commands), another program wrote the job, its snapshot or the
/// footage has changed, a file cannot be written, or the user stops.
pub fn assemble(folder: &Path, shoot: Option<&Path>, progress: &Progress) -> Result<AssembleReport> {
    let (work, project) = Job::open(folder)?.export(folder, shoot)?;
    let frames = folder.join(FRAMES);
    let flawed = flawed_frames(&project, &work.settings, &frames, progress)?;
    let again = spans(flawed.iter().map(|flawed| flawed.frame));
    let job = quoted(&folder.display().to_string());
    let chunks = Record::all(folder);
    let mut report = AssembleReport {
        frames: work.frames.1 - work.frames.0 + 1,
        output: None,
        hand_over: Vec::new(),
        again: (again.iter()).map(|span| format!("afterlight farm-chunk {job} --frames {span}")).collect(),
        flawed,
        worker_seconds: chunks.iter().map(|chunk| chunk.seconds).sum(),
        frame_bytes: frame_bytes(&work.settings.files, work.frames, folder),
        chunks,
    };
    if !report.flawed.is_empty() {
        save(&report, folder)?;
        return Err(refusal(&report, &job));
    }
    let output = join_movie(&project, &work.settings, &frames, progress)?;
    report.hand_over = handover::hand_over(&project, &work.settings, &output, progress)?;
    report.output = Some(output);
    save(&report, folder)?;
    Ok(report)
}

fn save(report: &AssembleReport, folder: &Path) -> Result<()> {
    let text =
        serde_json::to_string_pretty(report).map_err(|e| Error::bug(format!("cannot write the job's report: {e}")))?;
    write_beside(&folder.join("report.json"), |out| out.write_all(text.as_bytes()))
}

/// Error with the frames to write again, and the commands for it.
fn refusal(report: &AssembleReport, job: &str) -> Error {
    let phrase = |flaw: Flaw, one: &str, many: &str| {
        let frames = report.flawed.iter().filter(|frame| frame.flaw == flaw);
        let found = spans(frames.map(|frame| frame.frame));
        let count: usize = found.iter().map(|span| span.count).sum();
        let named: Vec<String> = found.iter().take(NAMED).map(ToString::to_string).collect();
        let more = if found.len() > NAMED { " …" } else { "" };
        let what = if count == 1 { one } else { many };
        (count > 0).then(|| format!("{}{more} {what}", named.join(", ")))
    };
    let kinds = [
        phrase(Flaw::Missing, "is missing", "are missing"),
        phrase(Flaw::Broken, "is damaged", "are damaged"),
        phrase(
            Flaw::MadeOfOther,
            "was made from another project, look, footage or version",
            "were made from another project, look, footage or version",
        ),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().collect();
    let commands: Vec<&str> = (report.again.iter().take(NAMED).map(String::as_str)).collect();
    let more = if report.again.len() > NAMED { " … (full list in report.json)" } else { "" };
    Error::invalid(
        format!("{} of {} frames have to be written again: {}", report.flawed.len(), report.frames, kinds.join("; ")),
        format!("Run {}{more}, then afterlight farm-assemble {job}", commands.join("; ")),
    )
}
