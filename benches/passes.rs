//! Cost of each pass against the memory limit: `cargo bench --profile dev --bench passes`. Prints a table, or JSON for
//! the table in `docs/accuracy.md`, which `make accuracy` writes.
//!
//! `afterlight device` measures the same within its time budget; `benchmark::passes` describes how.

use afterlight::benchmark::Budget;
use afterlight::benchmark::passes::{PassTable, PassTimes, passes};
use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::memory::keep_freed;
use afterlight::tradeoff::Machine;
use clap::Parser;
use serde_json::json;
use std::error::Error;
use std::time::Duration;

/// Time every pass.
#[derive(Parser)]
struct Options {
    /// Widths and heights of the pictures.
    #[arg(long, value_delimiter = ',', default_values_t = [512, 1024])]
    size: Vec<usize>,
    #[arg(long, default_value_t = 41)]
    lamps: usize,
    /// Threads; 0 uses all of the processor's.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Pictures of each scene.
    #[arg(long, default_value_t = 15)]
    rounds: usize,
    /// Use a software GPU if there is no other.
    #[arg(long)]
    software: bool,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Flag that cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    keep_freed();
    let options = Options::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads);
    pool.build_global()?;
    let compute = ComputeDevice::choose(if options.software { DeviceChoice::Gpu } else { DeviceChoice::Auto });
    let threads = rayon::current_num_threads();
    if !options.json {
        println!("{threads} threads; {}; median milliseconds.\n", compute.description);
        println!("| size | pass | CPU, ms | limit, ms | times | GPU, ms | limit, ms | times |");
        println!("|---:|---|---:|---:|---:|---:|---:|---:|");
    }
    let budget = Budget { runs: (options.rounds, options.rounds), time: Duration::ZERO };
    let cpu = ComputeDevice::choose(DeviceChoice::Cpu);
    let mut sizes = Vec::new();
    for &size in &options.size {
        let here = passes(size, options.lamps, &cpu, budget, &mut |_, _| Ok(()))?;
        let there = (compute.gpu.is_some())
            .then(|| passes(size, options.lamps, &compute, budget, &mut |_, _| Ok(())))
            .and_then(|there| there.map_err(|why| eprintln!("{why}")).ok());
        if !options.json {
            print(size, &here, there.as_ref());
        }
        sizes.push(json!({"size": size, "cpu": here, "gpu": there}));
    }
    if options.json {
        let (machine, device) = (Machine::this(), &compute.description);
        println!("{}", json!({"machine": machine, "threads": threads, "device": device, "sizes": sizes}));
    }
    Ok(())
}

/// Prints the rows of one size.
fn print(size: usize, here: &PassTable, there: Option<&PassTable>) {
    let speed = |table: &PassTable| format!("{:.1}", table.copied_per_second / 1e9);
    println!("| {size} | copying, GB/s | {} | | | {} | | |", speed(here), there.map_or("–".into(), speed));
    for pass in &here.passes {
        let same = there.and_then(|there| there.passes.iter().find(|p| p.name == pass.name));
        println!("| {size} | {} | {} | {} |", pass.name, cells(Some(pass)), cells(same));
    }
    let on_gpu = there.map_or(&[][..], |there| &there.passes);
    for pass in on_gpu {
        if here.passes.iter().all(|known| known.name != pass.name) {
            println!("| {size} | {} | {} | {} |", pass.name, cells(None), cells(Some(pass)));
        }
    }
}

/// Time, limit and their ratio.
fn cells(pass: Option<&PassTimes>) -> String {
    let ms = pass.and_then(|pass| Some(pass.times?.median_ms));
    let limit = pass.and_then(|pass| pass.copy_ms);
    [ms, limit, ms.zip(limit).map(|(ms, limit)| ms / limit)]
        .map(|value| value.map_or("–".into(), |value| format!("{value:.2}")))
        .join(" | ")
}
