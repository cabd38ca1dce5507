//! Tables: measured rates, the resulting time of twenty hours of footage, and the simulated scaling of a job.

use super::measure::Rate;
use super::simulation::{Farm, Run};
use base::machine::Machine;
use std::fmt::Write;

/// Twenty hours at 60 frames a second.
const FRAMES: f64 = 20.0 * 3600.0 * 60.0;
/// Assumed price of an hour of a thread, in dollars.
const THREAD_HOUR: f64 = 0.04;
/// A shared disk of 10 Gbit/s and a parallel file system of ten times that, in bytes per second.
const DISKS: [(&str, f64); 2] =
    [("a shared disk of 10 Gbit/s (1.25 GB/s)", 1.25e9), ("a parallel file system of 100 Gbit/s", 12.5e9)];
const WORKERS: [usize; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const CHUNK_MINUTES: f64 = 10.0;

/// All tables. The first rate is the basis of the simulated ones.
pub fn tables(rates: &[Rate], machine: &Machine) -> String {
    let mut text = format!("Measured on {}:\n\n", machine.words());
    measured(&mut text, rates);
    let _ =
        writeln!(text, "\nTwenty hours, {} frames, on machines of {} threads:\n", thousands(FRAMES), machine.threads);
    costs(&mut text, rates, machine.threads as f64);
    if let Some(rate) = rates.first() {
        scaling(&mut text, rate);
    }
    text.trim_end().to_owned()
}

fn measured(text: &mut String, rates: &[Rate]) {
    *text += "| plate, network, lamps, files | ms a frame | × | start of a chunk, s | footage of a frame, MB | file of a frame, MB \
              | last step, frames a second |\n|---|---:|---:|---:|---:|---:|---:|\n";
    let base = rates.first().map_or(1.0, |rate| rate.frame_ms);
    for rate in rates {
        let _ = writeln!(
            text,
            "| {} | {:.0} | {:.2} | {:.1} | {:.1} | {:.1} | {:.1} |",
            rate.what,
            rate.frame_ms,
            rate.frame_ms / base,
            rate.start_seconds,
            rate.read_mb,
            rate.written_mb,
            rate.assemble_rate
        );
    }
}

fn costs(text: &mut String, rates: &[Rate], threads: f64) {
    let _ = writeln!(
        text,
        "| plate, network, lamps, files | hours of a machine | thread-hours | read, TB | written, TB | last step, hours \
         | at ${THREAD_HOUR} a thread-hour |\n|---|---:|---:|---:|---:|---:|---:|"
    );
    for rate in rates {
        let hours = FRAMES * rate.frame_ms / 3.6e6;
        // The last step reads the files again.
        let read = FRAMES * (rate.read_mb + rate.written_mb);
        let last = FRAMES / rate.assemble_rate / 3600.0;
        let thread_hours = threads * (hours + last);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.1} | {:.1} | {} | ${} |",
            rate.what,
            thousands(hours),
            thousands(thread_hours),
            read / 1e6,
            FRAMES * rate.written_mb / 1e6,
            thousands(last),
            thousands(thread_hours * THREAD_HOUR),
        );
    }
    text.push('\n');
}

/// Simulated chunks on each disk.
fn scaling(text: &mut String, rate: &Rate) {
    let moved = (rate.read_mb + rate.written_mb) * 1e6;
    let [(shared, disk), (parallel, _)] = DISKS;
    let _ = writeln!(
        text,
        "Simulated: {}. One worker in twenty, rounded, takes twice as long, each is lost once in two days. Left: {shared}, which \
         carries {:.0} frames a second: {} such machines. Right: {parallel}.\n\n\
         | workers | hours of chunks | × | worker-hours | lost | held back, % | hours | × | worker-hours | lost | held back, % |\n\
         |---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        rate.what,
        disk / moved,
        thousands(disk / moved * rate.frame_ms / 1e3)
    );
    let chunks = |workers, bytes| {
        let run = farm(rate, workers, bytes).run();
        (run.seconds - run.assemble_seconds, run)
    };
    let alone = DISKS.map(|(_, bytes)| chunks(1, bytes).0);
    for workers in WORKERS {
        let _ = write!(text, "| {} |", thousands(workers as f64));
        for ((_, bytes), alone) in DISKS.into_iter().zip(alone) {
            let (seconds, run) = chunks(workers, bytes);
            let Run { assemble_seconds, worker_seconds, losses, held_back, .. } = run;
            let _ = write!(
                text,
                " {:.1} | {:.1} | {} | {losses} | {:.0} |",
                seconds / 3600.0,
                alone / seconds,
                thousands((worker_seconds - assemble_seconds) / 3600.0),
                100.0 * held_back,
            );
        }
        text.push('\n');
    }
}

/// Twenty hours of footage on each number of workers.
fn farm(rate: &Rate, workers: usize, disk_bytes: f64) -> Farm {
    let frame_seconds = rate.frame_ms / 1e3;
    Farm {
        frames: FRAMES as u64,
        chunk: (CHUNK_MINUTES * 60.0 / frame_seconds) as u64,
        workers,
        frame_seconds,
        start_seconds: rate.start_seconds,
        frame_bytes: (rate.read_mb + rate.written_mb) * 1e6,
        disk_bytes,
        slow_share: 0.05,
        slowness: 2.0,
        losses_an_hour: 1.0 / 48.0,
        replaced_after: 120.0,
        assemble_rate: rate.assemble_rate,
        seed: 1,
    }
}

fn thousands(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_twenty_hours_follows_from_the_rates() {
        let rate = |what: &str, frame_ms| Rate {
            what: what.to_owned(),
            frame_ms,
            start_seconds: 1.0,
            read_mb: 2.0,
            written_mb: 8.0,
            assemble_rate: 12.0,
        };
        let machine = Machine { threads: 2, ..Machine::default() };
        let text = tables(&[rate("one", 500.0), rate("another", 750.0)], &machine);
        // 4.32 million frames: 600 hours, plus 100 for the last step: 1,400 thread-hours.
        let line = "| one | 600 | 1,400 | 43.2 | 34.6 | 100 | $56 |";
        assert!(text.contains(line), "{text}");
        assert!(text.contains("| another | 750 | 1.50 | "), "{text}");
        assert!(text.contains("carries 125 frames a second: 62 such machines") || text.contains("63 such"), "{text}");
        assert!(text.contains("\n| 1,000 | "), "{text}");
        assert_eq!(thousands(1_234_567.0), "1,234,567");
    }
}
