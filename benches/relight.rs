//! The sum of lamps against the memory limit, and against NumPy and PyTorch on the same numbers: `cargo bench --profile
//! dev --bench relight`. `tests/peers/README.md` has details.
//!
//! All take turns, so that other work on the machine affects all alike. The limit is the time in which the same threads
//! add up the bytes of a basis of the same size, in the same run.

use afterlight::compositor::reference::{lit_lamps, relight, relight_half};
use afterlight::reflectance::{HalfField, ReflectanceField};
use afterlight::tradeoff::Machine;
use clap::Parser;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};
use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const PYTHON: &str = "AFTERLIGHT_PYTHON";
/// Methods of `tests/peers/relight.py`.
const PEERS: [&str; 4] = ["numpy", "numpy-lamps", "torch", "torch-lamps"];

/// Runs of a turn. The first is discarded: it wakes threads while those of the previous peer still spin.
const TURN: usize = 3;

/// Time the sum of lamps.
#[derive(Parser)]
struct Options {
    /// Widths and heights of the pictures.
    #[arg(long, value_delimiter = ',', default_values_t = [512, 1024])]
    size: Vec<usize>,
    #[arg(long, default_value_t = 41)]
    lamps: usize,
    /// Threads of every peer; 0 uses all of the processor's.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Turns of each method.
    #[arg(long, default_value_t = 21)]
    rounds: usize,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Flag that cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads);
    pool.build_global()?;
    let threads = rayon::current_num_threads();
    if !options.json {
        println!("{threads} threads; median milliseconds.\n");
        println!("| size | what | ms | GB/s | times the limit |");
        println!("|---|---|---|---|---|");
    }
    let mut rows = Vec::new();
    for &size in &options.size {
        rows.extend(race(size, &options)?);
    }
    if options.json {
        let machine = Machine::this();
        println!("{}", json!({"machine": machine, "threads": threads, "rows": rows}));
    }
    Ok(())
}

/// Timing of one method at one size.
#[derive(Serialize)]
struct Row {
    size: usize,
    what: &'static str,
    /// The median.
    ms: f64,
    /// Bytes of the field read per second.
    gigabytes_per_second: f64,
    times_the_limit: f64,
}

/// Times one size, and prints its rows unless JSON is requested.
fn race(size: usize, options: &Options) -> Result<Vec<Row>> {
    let lamps = options.lamps;
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
    let full = ReflectanceField {
        width: size,
        height: size,
        lamps,
        values: (0..lamps * 3 * size * size).into_par_iter().map(value).collect(),
    };
    let half = HalfField::from(&full);
    let weights: Vec<[f32; 3]> = (0..lamps).map(|l| [0.01 * l as f32 + 0.1, 0.3, 1.0 / (1 + l) as f32]).collect();
    let lit = lit_lamps(&weights);
    let mut python = match std::env::var(PYTHON) {
        Ok(python) if !python.is_empty() => Some(Peer::start(&python, size, options)?),
        _ => None,
    };
    if let Some(peer) = &mut python {
        let relit = relight(&full, &weights, &lit);
        let ours: f64 = relit.pixels.iter().flatten().map(|&v| f64::from(v)).sum();
        let theirs = peer.ask("check")?;
        for theirs in theirs["sums"].as_array().ok_or("a peer has no sums")? {
            let theirs = theirs.as_f64().ok_or("a peer's sum is not a number")?;
            if (theirs / ours - 1.0).abs() > 1e-5 {
                return Err(format!("a peer sums to {theirs}, this crate to {ours}").into());
            }
        }
    }
    let halves = half.values();
    let words: &[u32] = bytemuck::cast_slice(&full.values);
    let half_words: &[u32] = bytemuck::cast_slice(&halves[..halves.len() & !1]);
    let mut samples: Vec<Vec<f64>> = vec![Vec::new(); 4 + PEERS.len()];
    // The first round warms up.
    for round in 0..=options.rounds {
        let mut turns = vec![
            turn(|| read(words)),
            turn(|| relight(&full, &weights, &lit)),
            turn(|| read(half_words)),
            turn(|| relight_half(&half, &weights, &lit)),
        ];
        if let Some(peer) = &mut python {
            for what in PEERS {
                let reply = peer.ask(&format!("{what} {TURN}"))?;
                let seconds = reply["seconds"].as_array().into_iter().flatten();
                turns.push(seconds.filter_map(Value::as_f64).collect());
            }
        }
        if round > 0 {
            let turns = samples.iter_mut().zip(turns);
            turns.for_each(|(samples, turn)| samples.extend(turn.into_iter().skip(1)));
        }
    }
    let bytes = [size_of_val(words), size_of_val(half_words)];
    let limits = [median(&mut samples[0]), median(&mut samples[2])];
    let names = ["limit f32", "f32", "limit f16", "f16"];
    let mut rows = Vec::new();
    for (i, what) in names.into_iter().chain(PEERS).enumerate() {
        if samples[i].is_empty() {
            eprintln!("{what} is left out: {PYTHON} is not set.");
            continue;
        }
        let seconds = median(&mut samples[i]);
        let kind = usize::from(i == 2 || i == 3);
        let row = Row {
            size,
            what,
            ms: seconds * 1e3,
            gigabytes_per_second: bytes[kind] as f64 / seconds / 1e9,
            times_the_limit: seconds / limits[kind],
        };
        if !options.json {
            println!(
                "| {size} | {what} | {:.2} | {:.1} | {:.2} |",
                row.ms, row.gigabytes_per_second, row.times_the_limit
            );
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Adds up memory on all threads, in enough sums to fill the registers.
fn read(words: &[u32]) -> u32 {
    let add = |words: &[u32]| {
        let mut sums = [0u32; 32];
        for words in words.as_chunks::<32>().0 {
            for (sum, word) in sums.iter_mut().zip(words) {
                *sum = sum.wrapping_add(*word);
            }
        }
        sums.into_iter().fold(0, u32::wrapping_add)
    };
    words.par_chunks(1 << 16).map(add).reduce(|| 0, u32::wrapping_add)
}

/// Seconds of each run in a turn.
fn turn<T>(work: impl Fn() -> T) -> Vec<f64> {
    let run = |_| {
        let start = Instant::now();
        let result = work();
        let seconds = start.elapsed().as_secs_f64();
        black_box(result);
        seconds
    };
    (0..TURN).map(run).collect()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// A process that answers the commands of `tests/peers/relight.py`.
struct Peer {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    to: ChildStdin,
}

impl Peer {
    fn start(python: &str, size: usize, options: &Options) -> Result<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/relight.py");
        let threads = rayon::current_num_threads().to_string();
        let mut child = Command::new(python)
            .arg(script)
            .args(["--size", &size.to_string()])
            .args(["--lamps", &options.lamps.to_string()])
            .args(["--threads", &threads])
            .env("OMP_NUM_THREADS", &threads)
            .env("OPENBLAS_NUM_THREADS", &threads)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let to = child.stdin.take().expect("it is piped");
        let lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        Ok(Self { child, lines, to })
    }

    fn ask(&mut self, line: &str) -> Result<Value> {
        writeln!(self.to, "{line}")?;
        let reply = self.lines.next().ok_or("a peer ended early")??;
        Ok(serde_json::from_str(&reply)?)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // A peer that has already ended needs no command.
        let _ = writeln!(self.to, "quit");
        let _ = self.child.wait();
    }
}
