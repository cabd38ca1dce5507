//! Hard cases of pictures, the network and its training, through the jobs' interface, in memory and on a GPU, a
//! software one if there is no other. Hard cases of light and lamps are in `light` and `calibration`.

mod network;
mod pictures;
mod smoothing;
mod sums;
mod training;

use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::reflectance::ReflectanceField;
use std::sync::{Mutex, MutexGuard, PoisonError};
use test_support::Need;

/// The GPU of this machine, and the exclusive turn to use it; None without one, and the test returns.
fn gpu() -> Option<(ComputeDevice, MutexGuard<'static, ()>)> {
    static TURN: Mutex<()> = Mutex::new(());
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let compute = ComputeDevice::choose(DeviceChoice::Gpu);
    let here = compute.gpu.is_some();
    test_support::require(Need::Gpu, here, &compute.description).then_some((compute, turn))
}

/// A field of `lamps` lamps with patternless values in [0, 1).
fn noise((width, height): (usize, usize), lamps: usize) -> ReflectanceField {
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
    ReflectanceField { width, height, lamps, values: (0..lamps * 3 * width * height).map(value).collect() }
}
