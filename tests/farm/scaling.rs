//! The simulation against two real workers.

use crate::job::{FRAMES, Ground};
use afterlight::farm::simulation::Farm;
use serde_json::Value;
use std::sync::Mutex;
use std::time::Instant;

#[test]
fn the_simulation_says_what_two_workers_take() {
    let ground = Ground::new();
    ground.write_job("job", "out.%02d.png", &["--engine", "slurm", "--chunk", "2"]);
    // Two workers take chunks from one queue, as an engine hands them out.
    let queue = Mutex::new((0..FRAMES).step_by(2));
    let records: Mutex<Vec<Value>> = Mutex::default();
    let started = Instant::now();
    std::thread::scope(|threads| {
        for _ in 0..2 {
            threads.spawn(|| {
                loop {
                    let next = queue.lock().unwrap().next();
                    let Some(first) = next else { break };
                    let record = ground.chunk("job", &format!("{first}+2"));
                    records.lock().unwrap().push(record);
                }
            });
        }
    });
    let took = started.elapsed().as_secs_f64();
    let records = records.into_inner().unwrap();
    let mean = |key: &str| {
        let values = records.iter().map(|record| record[key].as_f64().unwrap());
        values.sum::<f64>() / records.len() as f64
    };
    let (seconds, start) = (mean("seconds"), mean("start_seconds"));
    let farm = Farm {
        frames: FRAMES as u64,
        chunk: 2,
        workers: 2,
        frame_seconds: (seconds - start) / 2.0,
        start_seconds: start,
        frame_bytes: 0.0,
        disk_bytes: 1.0,
        slow_share: 0.0,
        slowness: 1.0,
        losses_an_hour: 0.0,
        replaced_after: 0.0,
        assemble_rate: f64::INFINITY,
        seed: 1,
    };
    let run = farm.run();
    // The records do not include process starts, and the last chunk may run alone.
    let off = took / run.seconds;
    eprintln!("two workers took {took:.2} s, simulated {:.2} s", run.seconds);
    assert!((0.8..1.5).contains(&off), "{took} s, simulated {} s", run.seconds);
}
