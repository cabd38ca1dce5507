//! Copies from the GPU to memory during some work.

use afterlight::gpu::{ComputeDevice, DeviceChoice};
use std::sync::{Mutex, MutexGuard, PoisonError};
use test_support::Need;

/// Size in bytes of each buffer mapped since the last reset, by any thread of this process: every transfer from a wgpu
/// buffer to memory goes through `map_async`, which writes to the log. A copy without wgpu would be missed; none exists
/// unless the device has `Features::MAPPABLE_PRIMARY_BUFFERS`. Burn reads data only when its values are accessed: an
/// unused `into_data` is not a read, and is not seen either.
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

/// The GPU of this machine, and the exclusive turn to use it; None without one, and the test returns.
pub fn gpu() -> Option<(ComputeDevice, MutexGuard<'static, ()>)> {
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    // Set once, by whichever test is first.
    let _ = log::set_logger(&MapLog).map(|()| log::set_max_level(log::LevelFilter::Trace));
    let compute = ComputeDevice::choose(DeviceChoice::Gpu);
    println!("on the {}", compute.description);
    let here = compute.gpu.is_some();
    test_support::require(Need::Gpu, here, &compute.description).then_some((compute, turn))
}
