//! The simulation of many workers (`make farm`): its laws, and its time against two real workers.

use super::simulation::Farm;
use crate::job::{FRAMES, Ground};
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
    let seconds = |workers| Farm { workers, ..farm() }.run().seconds;
    near(seconds(100), 210.0, 1e-6);
    near(seconds(1000), seconds(100), 1e-9);
}

#[test]
fn the_disk_ends_what_workers_gain() {
    // Two hundred workers need 10 MB every two seconds each: exactly the disk's rate.
    let outcome = |workers| {
        let farm = Farm { frames: 1_000_000, workers, start_seconds: 0.0, ..farm() };
        farm.run()
    };
    assert!(outcome(100).held_back == 0.0 && outcome(1000).held_back > 0.9);
    near(outcome(1000).seconds, 1e6 * 1e7 / 1e9, 0.02);
    near(outcome(100).seconds, 1e6 * 2.0 / 100.0, 0.02);
}

#[test]
fn losses_cost_a_start_each_and_slow_workers_their_share() {
    let lossy = Farm { workers: 10, losses_an_hour: 1.0, ..farm() };
    let (lost, whole) = (lossy.run(), Farm { losses_an_hour: 0.0, ..lossy }.run());
    assert!(lost.losses > 0);
    // A start, and half a frame on average, for each loss.
    let more = lost.worker_seconds - whole.worker_seconds;
    assert!(more > 0.0 && more <= lost.losses as f64 * 12.0 + 1.0, "{more}");
    let slow = Farm { workers: 10, slow_share: 0.5, slowness: 2.0, ..farm() };
    // Five take 2 s a frame and five 4 s: 3.75 frames a second together, minus the starts of chunks and the last ones.
    near(slow.run().seconds, 10_000.0 / 3.75 + 140.0, 0.1);
}

#[test]
fn the_same_seed_is_the_same_run() {
    let farm = Farm { workers: 20, losses_an_hour: 2.0, ..farm() };
    assert_eq!(farm.run(), farm.run());
}
