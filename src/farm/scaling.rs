//! Writes the tables of `docs/farm.md`: what twenty hours take, from rates that were measured, and how a job scales.
//! `make farm` runs it.

use afterlight_farm::simulation::{Farm, Run};
use std::fmt::Write;
use std::process::ExitCode;

/// What a frame takes and moves, measured by `afterlight farm`, `farm-chunk` and `farm-assemble` on two threads of one machine.
struct Rate {
    /// Size of the plate, of the network, and the number of lamps.
    what: &'static str,
    /// Milliseconds from one frame to the next on those two threads.
    frame_ms: f64,
    /// Seconds until a chunk's first frame is begun.
    start_seconds: f64,
    /// Megabytes that a frame reads, and that it writes.
    read_mb: f64,
    written_mb: f64,
    /// Frames a second of the last step.
    assemble_rate: f64,
}

/// The first is what the other tables are of.
const RATES: [Rate; 6] = [
    Rate {
        what: "1080 × 1920, network of 128 pixels, 41 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
    Rate {
        what: "540 × 960, network of 128 pixels, 41 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
    Rate {
        what: "2160 × 3840, network of 128 pixels, 41 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
    Rate {
        what: "1080 × 1920, network of 64 pixels, 41 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
    Rate {
        what: "1080 × 1920, network of 256 pixels, 41 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
    Rate {
        what: "1080 × 1920, network of 128 pixels, 12 lamps",
        frame_ms: 1.0,
        start_seconds: 1.0,
        read_mb: 1.0,
        written_mb: 1.0,
        assemble_rate: 1.0,
    },
];

/// Twenty hours at 60 frames a second.
const FRAMES: f64 = 20.0 * 3600.0 * 60.0;
/// Threads that the rates were measured on.
const THREADS: f64 = 2.0;
/// Stated, not measured: what an hour of a core costs, in dollars.
const CORE_HOUR: f64 = 0.04;
/// A shared disk of 10 Gbit/s.
const DISK: f64 = 1.25e9;
const WORKERS: [usize; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const CHUNK_MINUTES: f64 = 10.0;

const BEGIN: &str = "<!-- written by `make farm` -->";
const END: &str = "<!-- to here -->";

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("Name the page whose tables are written: docs/farm.md");
        return ExitCode::from(2);
    };
    let written = std::fs::read_to_string(&path)
        .map_err(|e| e.to_string())
        .and_then(|page| with_tables(&page))
        .and_then(|page| std::fs::write(&path, page).map_err(|e| e.to_string()));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("cannot write the tables of {path}: {e}");
            ExitCode::FAILURE
        }
    }
}

fn with_tables(page: &str) -> Result<String, String> {
    let missing = || format!("it lacks the lines {BEGIN} and {END}");
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}\n\n{}{END}{after}", tables()))
}

fn tables() -> String {
    let mut text = String::new();
    costs(&mut text);
    let base = &RATES[0];
    scaling(
        &mut text,
        base,
        &format!("On a shared disk of 10 Gbit/s ({:.2} GB/s):", DISK / 1e9),
        DISK,
    );
    scaling(
        &mut text,
        base,
        "On a parallel file system of ten times that:",
        10.0 * DISK,
    );
    text
}

/// Twenty hours of each size, and what they cost.
fn costs(text: &mut String) {
    *text += "| plate, network, lamps | ms a frame | core-hours | read | written | at $0.04 a core-hour |\n\
              |---|---:|---:|---:|---:|---:|\n";
    for rate in &RATES {
        let core_hours = FRAMES * rate.frame_ms / 3.6e6 * THREADS;
        let _ = writeln!(
            text,
            "| {} | {:.0} | {} | {} | {} | ${} |",
            rate.what,
            rate.frame_ms,
            thousands(core_hours),
            terabytes(FRAMES * rate.read_mb),
            terabytes(FRAMES * rate.written_mb),
            thousands(core_hours * CORE_HOUR),
        );
    }
    text.push('\n');
}

fn scaling(text: &mut String, rate: &Rate, title: &str, disk: f64) {
    let _ = writeln!(
        text,
        "{title}\n\n| workers | hours | times as fast | worker-hours | lost | held back by the disk | last step, hours |\n\
         |---:|---:|---:|---:|---:|---:|---:|"
    );
    let of = |workers| farm(rate, workers, disk).run();
    let alone = of(1).seconds;
    for workers in WORKERS {
        let Run {
            seconds,
            assemble_seconds,
            worker_seconds,
            losses,
            held_back,
        } = of(workers);
        let _ = writeln!(
            text,
            "| {workers} | {:.1} | {:.1} | {} | {losses} | {:.0} % | {:.1} |",
            seconds / 3600.0,
            alone / seconds,
            thousands(worker_seconds / 3600.0),
            100.0 * held_back,
            assemble_seconds / 3600.0
        );
    }
    text.push('\n');
}

/// Twenty hours on so many workers, of which one in twenty takes twice as long and each is lost once in two days.
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

fn terabytes(megabytes: f64) -> String {
    format!("{:.1} TB", megabytes / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_stands_between_the_marks_is_written() {
        let page = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        let written = with_tables(&page).unwrap();
        assert!(written.starts_with("before\n") && written.ends_with("\nafter\n"));
        assert!(!written.contains("old") && written.contains("| 1000 |"));
        assert_eq!(with_tables(&written).unwrap(), written);
        assert!(with_tables("no marks").is_err());
        assert_eq!(thousands(1_234_567.0), "1,234,567");
    }
}
