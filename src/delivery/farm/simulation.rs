//! Time of a job on so many workers: chunks handed out in turn, workers that are slow or get lost, and one disk that all
//! read and write.
//!
//! Between two events, an end of a chunk or a loss, every worker goes at a steady rate: its own, or its share of the disk if
//! that is less. So a whole run is a list of events, and nothing is drawn but which workers are slow and when one is lost, all
//! from one seed.

/// Job and workers of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Farm {
    pub frames: u64,
    /// Frames of a chunk.
    pub chunk: u64,
    pub workers: usize,
    /// Seconds that a worker takes for a frame, alone.
    pub frame_seconds: f64,
    /// Seconds until a chunk's first frame is begun: the program starts, reads the network, makes the first frame for its
    /// level.
    pub start_seconds: f64,
    /// Bytes that a frame reads and writes.
    pub frame_bytes: f64,
    /// Bytes a second of the disk that all share.
    pub disk_bytes: f64,
    /// Share of workers that are slow, 0 to 1.
    pub slow_share: f64,
    /// Factor by which slow workers take longer.
    pub slowness: f64,
    /// Losses of a worker in an hour of its work. Its chunk goes back, with the frames that it finished.
    pub losses_an_hour: f64,
    /// Seconds after which the scheduler notices a loss and another machine takes its place.
    pub replaced_after: f64,
    /// Frames a second of the last step, which one worker does.
    pub assemble_rate: f64,
    pub seed: u64,
}

/// Result of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Seconds from the first chunk's start to the movie.
    pub seconds: f64,
    /// Of them, the last step's.
    pub assemble_seconds: f64,
    /// Seconds of all workers together while they had a chunk, and the last step.
    pub worker_seconds: f64,
    /// Workers that were lost.
    pub losses: u64,
    /// Share of the time that workers had a chunk in which the disk held them back, 0 to 1.
    pub held_back: f64,
}

/// A worker at a chunk.
#[derive(Clone, Copy, Debug)]
struct Task {
    /// Seconds of starting that are left.
    start: f64,
    /// Frames that are left.
    frames: f64,
    /// Seconds until it is lost.
    lost_in: f64,
}

struct Worker {
    frame_seconds: f64,
    task: Option<Task>,
    /// Seconds until it is there again.
    away: f64,
}

/// SplitMix64 (Steele, Lea and Flood, 2014): the same draws on every machine.
struct Draws(u64);

impl Draws {
    /// A number in `(0, 1]`.
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
        match an_hour > 0.0 {
            true => -self.next().ln() * 3600.0 / an_hour,
            false => f64::INFINITY,
        }
    }
}

impl Farm {
    /// Runs it.
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
        // Chunks that are not whole: the last one, and what lost workers left.
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
            // Whoever is away may have nothing to come back for.
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
                let Some(task) = &mut worker.task else {
                    continue;
                };
                if frame_seconds > worker.frame_seconds && task.start <= 0.0 {
                    run.held_back += step;
                }
                task.lost_in -= step;
                if task.start > 0.0 {
                    task.start -= step;
                    // Rounding must not leave a start that takes no time.
                    if task.start < 1e-9 {
                        task.start = 0.0;
                    }
                } else {
                    task.frames -= step / frame_seconds;
                }
                if task.frames < 1e-6 {
                    worker.task = None;
                } else if task.lost_in <= 1e-9 {
                    // What it had begun of a frame is lost, what it had finished is kept.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn farm() -> Farm {
        Farm {
            frames: 10_000,
            chunk: 100,
            workers: 1,
            frame_seconds: 2.0,
            start_seconds: 10.0,
            frame_bytes: 1e7,
            disk_bytes: 1e9,
            slow_share: 0.0,
            slowness: 1.0,
            losses_an_hour: 0.0,
            replaced_after: 60.0,
            assemble_rate: 1e9,
            seed: 7,
        }
    }

    fn near(found: f64, wanted: f64, share: f64) {
        assert!((found / wanted - 1.0).abs() < share, "{found}, not {wanted}");
    }

    #[test]
    fn one_worker_takes_the_sum_of_all_and_two_take_half() {
        let alone = farm().run();
        near(alone.seconds, 100.0 * 10.0 + 10_000.0 * 2.0, 1e-6);
        near(alone.worker_seconds, alone.seconds, 1e-6);
        let two = Farm { workers: 2, ..farm() }.run();
        near(two.seconds, alone.seconds / 2.0, 1e-6);
    }

    #[test]
    fn more_workers_than_chunks_are_of_no_use() {
        let of = |workers| Farm { workers, ..farm() }.run().seconds;
        near(of(100), 210.0, 1e-6);
        near(of(1000), of(100), 1e-9);
    }

    #[test]
    fn the_disk_ends_what_workers_gain() {
        // Two hundred workers want 10 MB every two seconds each: as much as the disk gives.
        let of = |workers| {
            let farm = Farm { frames: 1_000_000, workers, start_seconds: 0.0, ..farm() };
            farm.run()
        };
        assert!(of(100).held_back == 0.0 && of(1000).held_back > 0.9);
        near(of(1000).seconds, 1e6 * 1e7 / 1e9, 0.02);
        near(of(100).seconds, 1e6 * 2.0 / 100.0, 0.02);
    }

    #[test]
    fn losses_cost_a_start_each_and_slow_workers_their_share() {
        let lossy = Farm { workers: 10, losses_an_hour: 1.0, ..farm() };
        let (lost, whole) = (lossy.run(), Farm { losses_an_hour: 0.0, ..lossy }.run());
        assert!(lost.losses > 0);
        // A start, and half a frame on average, for each.
        let more = lost.worker_seconds - whole.worker_seconds;
        assert!(more > 0.0 && more <= lost.losses as f64 * 12.0 + 1.0, "{more}");
        let slow = Farm { workers: 10, slow_share: 0.5, slowness: 2.0, ..farm() };
        // Five take 2 s a frame and five 4 s: together 3.75 frames a second, but for the start of chunks and the last ones.
        near(slow.run().seconds, 10_000.0 / 3.75 + 140.0, 0.1);
    }

    #[test]
    fn the_same_seed_is_the_same_run() {
        let farm = Farm { workers: 20, losses_an_hour: 2.0, ..farm() };
        assert_eq!(farm.run(), farm.run());
    }
}
