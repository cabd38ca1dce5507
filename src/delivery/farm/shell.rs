//! Words of commands.

use gpu::DeviceChoice;

/// Value of `--device`.
pub(crate) fn word(device: DeviceChoice) -> &'static str {
    match device {
        DeviceChoice::Auto => "auto",
        DeviceChoice::Cpu => "cpu",
        DeviceChoice::Gpu => "gpu",
    }
}
