//! Simulated duration of a job on a number of workers: chunks handed out in turn, slow and lost workers, and one shared
//! disk.
//!
//! Between two events (end of a chunk, or a loss) every worker has a steady rate: its own, or its share of the disk if
//! that is less. A run is therefore a list of events. Only the choice of slow workers and the times of losses are random,
//! from one seed.

/// Job and workers of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Farm {
    pub frames: u64,
    /// Frames per chunk.
    pub chunk: u64,
    pub workers: usize,
    /// Seconds per frame of an undisturbed worker.
    pub frame_seconds: f64,
    /// Seconds before a chunk's first frame: the program starts, reads the network, and makes the export's first frame for its
    /// level.
    pub start_seconds: f64,
    /// Bytes read and written per frame.
    pub frame_bytes: f64,
    /// Bytes per second of the shared disk.
    pub disk_bytes: f64,
    /// Share of slow workers, 0 to 1.
    pub slow_share: f64,
    /// Factor on the time of slow workers.
    pub slowness: f64,
    /// Losses per worker and hour of work. The chunk returns to the queue with its finished frames.
    pub losses_an_hour: f64,
    /// Seconds until the scheduler notices a loss and a new machine replaces the worker.
    pub replaced_after: f64,
    /// Frames per second of the last step, which runs on one worker.
    pub assemble_rate: f64,
    pub seed: u64,
}

/// Result of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Seconds from the first chunk's start to the movie.
    pub seconds: f64,
    /// Of these, seconds of the last step.
    pub assemble_seconds: f64,
    /// Total seconds of all workers with a chunk, and of the last step.
    pub worker_seconds: f64,
    /// Number of lost workers.
    pub losses: u64,
    /// Share of the working time limited by the disk, 0 to 1.
    pub held_back: f64,
}

/// Worker with a chunk.
#[derive(Clone, Copy, Debug)]
struct Task {
    /// Remaining seconds of the start.
    start: f64,
    /// Remaining frames.
    frames: f64,
    /// Seconds until the worker is lost.
    lost_in: f64,
}

struct Worker {
    frame_seconds: f64,
    task: Option<Task>,
    /// Seconds until the worker returns.
    away: f64,
}

/// SplitMix64 (Steele, Lea and Flood, 2014): the same draws on every machine.
struct Draws(u64);

impl Draws {
    /// Random number in `(0, 1]`.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// Seconds until the next loss, exponential.
    fn loss(&mut self, an_hour: f64) -> f64 {
        if an_hour > 0.0 { -self.next().ln() * 3600.0 / an_hour } else { f64::INFINITY }
    }
}

impl Farm {
    /// Runs the simulation.
    pub fn run(&self) -> Run {
        let mut draws = Draws(self.seed);
        let slow = (self.slow_share * self.workers as f64).round() as usize;
        let mut workers: Vec<Worker> = (0..self.workers.max(1))
            .map(|number| Worker {
                frame_seconds: self.frame_seconds * if number < slow { self.slowness } else { 1.0 },
                task: None,
                away: 0.0,
            })
            .collect();
        let chunk = self.chunk.max(1);
        let mut whole = self.frames / chunk;
        // Partial chunks: the last one, and leftovers of lost workers.
        let mut others: Vec<f64> = Vec::new();
        if !self.frames.is_multiple_of(chunk) {
            others.push((self.frames % chunk) as f64);
        }
        let mut run = Run {
            seconds: 0.0,
            assemble_seconds: self.frames as f64 / self.assemble_rate,
            worker_seconds: 0.0,
            losses: 0,
            held_back: 0.0,
        };
        loop {
            for worker in &mut workers {
                if worker.task.is_some() || worker.away > 0.0 {
                    continue;
                }
                let frames = others.pop().or_else(|| {
                    (whole > 0).then(|| {
                        whole -= 1;
                        chunk as f64
                    })
                });
                worker.task = frames.map(|frames| Task {
                    start: self.start_seconds,
                    frames,
                    lost_in: draws.loss(self.losses_an_hour),
                });
            }
            let at_frames = |task: &Task| task.start <= 0.0;
            let busy = workers.iter().filter_map(|w| w.task.as_ref()).count();
            // No work may be left for workers that return.
            if busy == 0 && whole == 0 && others.is_empty() {
                break;
            }
            let reading = (workers.iter()).filter(|w| w.task.as_ref().is_some_and(at_frames));
            let by_disk = self.frame_bytes * reading.count() as f64 / self.disk_bytes;
            let frame = |worker: &Worker| worker.frame_seconds.max(by_disk);
            let next = workers.iter().map(|worker| match &worker.task {
                Some(task) if task.start > 0.0 => task.start.min(task.lost_in),
                Some(task) => (task.frames * frame(worker)).min(task.lost_in),
                None if worker.away > 0.0 => worker.away,
                None => f64::INFINITY,
            });
            let step = next.fold(f64::INFINITY, f64::min);
            run.seconds += step;
            run.worker_seconds += step * busy as f64;
            for worker in &mut workers {
                let frame_seconds = frame(worker);
                worker.away = (worker.away - step).max(0.0);
                let Some(task) = &mut worker.task else { continue };
                if frame_seconds > worker.frame_seconds && task.start <= 0.0 {
                    run.held_back += step;
                }
                task.lost_in -= step;
                if task.start > 0.0 {
                    task.start -= step;
                    // Rounding must not leave a start without duration.
                    if task.start < 1e-9 {
                        task.start = 0.0;
                    }
                } else {
                    task.frames -= step / frame_seconds;
                }
                if task.frames < 1e-6 {
                    worker.task = None;
                } else if task.lost_in <= 1e-9 {
                    // The frame in progress is lost; finished frames are kept.
                    others.push(task.frames.ceil());
                    worker.task = None;
                    worker.away = self.replaced_after.max(1e-6);
                    run.losses += 1;
                }
            }
        }
        run.held_back /= run.worker_seconds.max(f64::MIN_POSITIVE);
        run.seconds += run.assemble_seconds;
        run.worker_seconds += run.assemble_seconds;
        run
    }
}
