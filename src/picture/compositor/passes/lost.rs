//! Work on a lost GPU, whose driver failed or which was unplugged. A lost GPU computes nothing, mostly
//! without an error, and some calls of wgpu and burn panic.

use super::PicturePasses;
use base::error::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// True if a device is lost. Takes microseconds and does not wait for the GPU.
pub fn is_lost(device: &wgpu::Device) -> bool {
    // wgpu reports a loss once, to the single callback that burn has set. A lost device makes no buffer.
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("sign of life"),
        size: 4,
        usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::MAP_WRITE,
        mapped_at_creation: true,
    });
    buffer.get_mapped_range_mut(..).is_err()
}

/// Runs `work` on a device, see [`PicturePasses::guarded`].
pub(super) fn guarded<T>(device: &wgpu::Device, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let done = catch_unwind(AssertUnwindSafe(work));
    if is_lost(device) {
        return Err(Error::GpuLost);
    }
    done.unwrap_or_else(|panic| resume_unwind(panic))
}

impl PicturePasses {
    /// True if their GPU is lost.
    pub fn is_lost(&self) -> bool {
        is_lost(&self.device)
    }

    /// Runs `work` that needs their GPU.
    ///
    /// # Errors
    /// When `work` fails; [`Error::GpuLost`] if the GPU is lost in the meantime, whatever the outcome of `work`: another
    /// error, a panic, or invalid values.
    pub fn guarded<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        guarded(&self.device, work)
    }
}

#[cfg(test)]
mod tests {
    use super::super::relight::tests::any_device;
    use super::*;

    #[test]
    fn whatever_comes_of_work_on_a_lost_gpu_is_the_loss() {
        let Some((device, queue)) = any_device() else { return };
        let passes = PicturePasses::new(&device, &queue);
        assert_eq!(passes.guarded(|| Ok(3)).unwrap(), 3);
        let own = || Error::invalid("a picture has no pixels", "Draw some");
        let said = passes.guarded(|| Err::<(), _>(own())).unwrap_err();
        assert_eq!(said.to_string(), own().to_string());
        let fault = || passes.guarded(|| -> Result<()> { panic!("on purpose") });
        assert!(catch_unwind(AssertUnwindSafe(fault)).is_err(), "our own bug is not a lost GPU");

        device.destroy();
        let lost = [passes.guarded(|| Ok(())), passes.guarded(|| Err(own())), passes.guarded(|| panic!("on purpose"))];
        assert!(lost.iter().all(|done| matches!(done, Err(Error::GpuLost))));
    }
}
