//! Settings of a job.

use super::engine::Engine;
use base::numbers::within;
use std::path::PathBuf;

/// Folder of a job, and the engine that runs it.
#[derive(Clone, Debug, clap::Args)]
pub struct FarmSettings {
    /// Engine that runs the job.
    #[arg(long, value_enum)]
    pub engine: Engine,
    /// Job folder, created if missing. All workers must see it.
    #[arg(id = "job", long = "to", value_name = "DIR")]
    pub job: PathBuf,
    /// Memory per worker in GB.
    #[arg(long = "memory", value_name = "GB", default_value_t = 4.0, value_parser = within(0.1f64..=4096.0))]
    pub memory_gb: f64,
    /// Path of Afterlight on the workers [default: this program].
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
}

/// Division of an export into chunks.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ChunkSettings {
    /// Frames per chunk [default: as many as take --chunk-minutes].
    #[arg(long, value_name = "FRAMES", value_parser = within(1usize..=10_000_000))]
    pub chunk: Option<usize>,
    /// Target duration of a chunk in minutes, at the measured rate: short chunks lose little with a worker, long
    /// chunks start the program less often.
    #[arg(long, value_name = "MINUTES", default_value_t = 10.0, value_parser = within(0.05f64..=1e4))]
    pub chunk_minutes: f64,
}

impl Default for ChunkSettings {
    fn default() -> Self {
        Self { chunk: None, chunk_minutes: 10.0 }
    }
}

impl FarmSettings {
    /// Defaults of the command line.
    pub fn new(engine: Engine, job: PathBuf) -> Self {
        Self { engine, job, memory_gb: 4.0, program: None }
    }

    /// Memory of a worker in MiB.
    pub(crate) fn memory_mib(&self) -> u64 {
        (self.memory_gb * 1e9 / f64::from(1 << 20)).ceil() as u64
    }
}
