//! Render-farm jobs. A job is a folder with a snapshot of the project, which workers only read, and the files of the
//! engine that runs it.
//!
//! ```text
//! JOB/
//!   job.json            the work, the program that wrote the job, and its files (by hash)
//!   snapshot/           project.toml, calibration.toml, checkpoint/, mattes/, the environment, the look-up table, the background
//!   template.json       for Open Job Description, or
//!   submit.sh, chunk.sh, assemble.sh       for Slurm
//!   frames/             frames of a movie, until it is joined; stills go to their destination
//!   records/            cost of each chunk
//!   logs/               output of each chunk (Slurm)
//!   report.json         the result
//!   projects/           only in a training job: a project for each task, as above
//! ```

mod assemble;
mod chunk;
mod chunks;
mod engine;
mod environment;
mod job;
mod open_job_description;
mod program;
mod record;
mod settings;
mod shell;
mod slurm;
mod snapshot;
mod train;
mod write;

pub use assemble::{AssembleReport, assemble};
pub use chunk::{ChunkReport, run_chunk};
pub use chunks::FrameSpan;
pub use engine::Engine;
pub use job::{Job, PinnedFile, RelightWork, TrainTask, Work};
pub use program::Program;
pub use record::Record;
pub use settings::{ChunkSettings, FarmSettings};
pub use train::{Training, run_task, write_training};
pub use write::{JobReport, write_job};
