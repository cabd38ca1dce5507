//! The measuring process.

use super::measure::{Figure, Measure, Request, Tell};
use super::names::SELF_TEST;
use super::network::network;
use super::passes::passes;
use super::pictures::pictures;
use super::{Budget, LAMPS};
use base::error::{Error, Result};
use base::memory;
use gpu::{ComputeDevice, DeviceChoice};
use std::io::Read;
use std::time::Instant;
use training::Preset;

/// The option that asks the program for one measure; a request as JSON follows.
pub const REQUEST: &str = "--measure";

/// Runs one measure in this process and prints each figure as a line of JSON as soon as it is known. The process ends
/// when its input closes: the parent is gone.
///
/// # Errors
/// When the request cannot be read, the device fails, or a line cannot be written.
pub fn answer(request: &str, mut say: impl FnMut(&str) -> Result<()>) -> Result<()> {
    let request: Request = serde_json::from_str(request).map_err(|e| {
        Error::invalid(
            format!("{REQUEST} cannot be read: {e}"),
            "It is for the program itself; use afterlight device without it",
        )
    })?;
    std::thread::spawn(|| {
        // Nothing is ever written to this input.
        let _ = std::io::stdin().read(&mut [0]);
        std::process::exit(1);
    });
    let compute = ComputeDevice::untested(if request.gpu { DeviceChoice::Gpu } else { DeviceChoice::Cpu })
        .map_err(|why| Error::device(why, "Figures of the CPU are beside this"))?;
    measure(&request, &compute, &mut |figure| {
        let figure = Figure {
            peak_bytes: memory::peak(),
            gpu_bytes: compute.gpu.as_ref().and_then(gpu::Gpu::taken_bytes),
            ..figure
        };
        let line = serde_json::to_string(&figure).map_err(|e| Error::bug(format!("a figure is not JSON: {e}")))?;
        say(&line)
    })
}

fn measure(request: &Request, compute: &ComputeDevice, tell: Tell) -> Result<()> {
    let seconds = request.seconds;
    match request.measure {
        Measure::SelfTest => tell(self_test(compute)),
        Measure::Network { preset, size } => network(preset, size, seconds, compute, tell),
        Measure::FirstUse { size } => network(Preset::Quick, size, 0.0, compute, tell),
        Measure::Passes { size } => {
            // Four scenes. A GPU adds the sum in f16; a CPU adds copying and three sums.
            let budget = Budget::seconds(seconds / 8.0, 30);
            passes(size, LAMPS, compute, budget, &mut |pass, copied| {
                tell(Figure {
                    what: pass.name.clone(),
                    times: pass.times,
                    copy_ms: pass.copy_ms,
                    bytes_per_second: Some(copied),
                    ..Figure::default()
                })
            })
            .map(drop)
        }
        Measure::Picture { preset, working, size } => pictures(preset, (working, size), seconds, compute, tell),
    }
}

fn self_test(compute: &ComputeDevice) -> Figure {
    let started = Instant::now();
    let verdict = compute.gpu.as_ref().map(gpu::Gpu::self_test);
    Figure {
        what: SELF_TEST.to_owned(),
        first_ms: Some(started.elapsed().as_secs_f64() * 1e3),
        note: Some(match verdict {
            Some(Ok(())) => "passed".to_owned(),
            Some(Err(why)) => format!("failed: {why}"),
            None => "the CPU is the reference".to_owned(),
        }),
        ..Figure::default()
    }
}
