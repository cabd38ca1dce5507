//! Copies from the GPU to memory while something runs.

use afterlight::gpu::{ComputeDevice, DeviceChoice};
use std::sync::{Mutex, MutexGuard, PoisonError};
use test_support::Need;

/// Bytes of each buffer that was mapped since the last look, by anyone in this process: every way from a
/// buffer of wgpu to memory goes through `map_async`, which says so in the log. A copy by other means
/// than wgpu would not be seen; there is none while the device has no
/// `Features::MAPPABLE_PRIMARY_BUFFERS`. burn reads what it was asked for when its values are looked at:
/// an `into_data` that nobody looks into is no read, and is not seen either.
static MAPPED: Mutex<Vec<u64>> = Mutex::new(Vec::new());

struct MapLog;

impl log::Log for MapLog {
    fn enabled(&self, _: &log::Metadata) -> bool {
        true
    }

    fn log(&self, record: &log::Record) {
        if record.target().starts_with("wgpu_core") {
            let message = record.args().to_string();
            if message.starts_with("Buffer::map_async") {
                let size = message.split("size Some(").nth(1);
                let size = size.and_then(|rest| rest.split(')').next()?.parse().ok());
                mapped().push(size.unwrap_or(u64::MAX));
            }
        }
    }

    fn flush(&self) {}
}

fn mapped() -> MutexGuard<'static, Vec<u64>> {
    MAPPED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Result of `work`, and the bytes of each buffer mapped while it ran. Tests take turns, since they share the log.
pub fn mapped_during<T>(work: impl FnOnce() -> T) -> (T, Vec<u64>) {
    mapped().clear();
    let result = work();
    (result, mapped().clone())
}

static TURN: Mutex<()> = Mutex::new(());

/// The GPU of this machine, and the turn to use it; None if it has none, and the test returns.
pub fn gpu() -> Option<(ComputeDevice, MutexGuard<'static, ()>)> {
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    // It is set once, whichever test is first.
    let _ = log::set_logger(&MapLog).map(|()| log::set_max_level(log::LevelFilter::Trace));
    let compute = ComputeDevice::choose(DeviceChoice::Gpu);
    println!("on the {}", compute.description);
    let here = compute.gpu.is_some();
    test_support::require(Need::Gpu, here, &compute.description).then_some((compute, turn))
}
