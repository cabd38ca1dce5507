//! Time and data per frame on farm workers.

use super::case::{Case, files, is_interview, text};
use base::{Error, Result};
use measuring::Program;
use std::io::ErrorKind;
use std::path::Path;
use std::time::Instant;

/// Number of measurements; the fastest counts, since other work only adds time.
const TIMES: usize = 2;
/// Frames of the relit interview, and of a shorter job: their difference has no start-up time.
const LONG: usize = 12;
const SHORT: usize = 3;
/// Chunks that differ by six frames. Neither has the first frame, which both predict for the level.
const CHUNKS: [&str; 2] = ["1-2", "3-10"];
const CHUNKS_APART: f64 = 6.0;

/// Time and data per frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Rate {
    /// Name of the case, for tables.
    pub what: String,
    /// Milliseconds per frame on all threads of the machine.
    pub frame_ms: f64,
    /// Seconds until a chunk's first frame starts.
    pub start_seconds: f64,
    /// Megabytes of a frame's plate and matte, and of the resulting file.
    pub read_mb: f64,
    pub written_mb: f64,
    /// Frames per second of the last step.
    pub assemble_rate: f64,
}

/// Runs jobs of `case` in `folder`, with its project and shoot.
pub fn measure(case: &Case, afterlight: Program, (project, shoot): (&Path, &Path), folder: &Path) -> Result<Rate> {
    let job = folder.join("job");
    let (mut chunks, mut ends) = ([f64::INFINITY; 2], [f64::INFINITY; 2]);
    let mut written = 0.0;
    let run = |command: &str, more: &[&str]| {
        let started = Instant::now();
        let said = afterlight.json(&[&[command, &text(&job)], more].concat())?;
        Ok::<_, Error>((started.elapsed().as_secs_f64(), said))
    };
    for _ in 0..TIMES {
        write_job(case, afterlight, project, folder, SHORT)?;
        run("farm-chunk", &["--frames", &format!("0+{SHORT}")])?;
        ends[0] = run("farm-assemble", &[])?.0.min(ends[0]);
        write_job(case, afterlight, project, folder, LONG)?;
        for (frames, fastest) in CHUNKS.into_iter().zip(&mut chunks) {
            *fastest = run("farm-chunk", &["--frames", frames])?.0.min(*fastest);
        }
        // The remaining frames, and the bytes of all.
        let (_, record) = run("farm-chunk", &["--frames", &format!("0+{LONG}")])?;
        written = record["bytes"].as_f64().unwrap_or_default() / LONG as f64;
        ends[1] = run("farm-assemble", &[])?.0.min(ends[1]);
    }
    let frame = (chunks[1] - chunks[0]) / CHUNKS_APART;
    Ok(Rate {
        what: case.words(),
        frame_ms: 1e3 * frame,
        start_seconds: chunks[0] - 2.0 * frame,
        read_mb: footage_bytes(shoot)? / 1e6,
        written_mb: written / 1e6,
        assemble_rate: (LONG - SHORT) as f64 / (ends[1] - ends[0]),
    })
}

/// Writes a job of the first frames, replacing the last one.
fn write_job(case: &Case, afterlight: Program, project: &Path, folder: &Path, frames: usize) -> Result<()> {
    let [job, made] = ["job", "made"].map(|name| folder.join(name));
    for old in [&job, &made] {
        match std::fs::remove_dir_all(old) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(Error::io("remove", old, e, "Remove it by hand"));
            }
            _ => (),
        }
    }
    let output = made.join(if case.stills { "%04d.exr" } else { "clip.mov" });
    let range = format!("0-{}", frames - 1);
    let [project, output, job] = [project, &output, &job].map(text);
    let words = [
        "farm",
        &project,
        "--environment",
        "nave",
        "--turntable",
        "--engine",
        "slurm",
        "--chunk",
        "1000",
        "--device",
        "cpu",
        "--frames",
        &range,
        "--output",
        &output,
        "--to",
        &job,
    ];
    afterlight.run(&words).map(drop)
}

/// Mean size of a frame's plate and matte, in bytes.
fn footage_bytes(shoot: &Path) -> Result<f64> {
    let plates = files(&shoot.join("interview"))?.len();
    let interview = files(shoot)?.into_iter().filter(|file| is_interview(shoot, file));
    let bytes: u64 = interview.filter_map(|file| file.metadata().ok()).map(|data| data.len()).sum();
    Ok(bytes as f64 / plates.max(1) as f64)
}
