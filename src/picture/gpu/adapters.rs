//! Compute adapters of the system, used or not.

use serde::{Deserialize, Serialize};

/// An adapter of the system: a GPU through one of its drivers, or a software rasteriser.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Adapter {
    pub name: String,
    /// Interface: `vulkan`, `metal`, `dx12` or `gl`.
    pub backend: String,
    /// Driver, with its version if it reports one.
    pub driver: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `software` or `unknown`.
    pub kind: String,
    /// Largest buffer in bytes. wgpu does not report the total memory.
    pub largest_buffer_bytes: u64,
    /// Largest buffer that a shader reads, in bytes: a frame's OLATs must fit.
    pub largest_binding_bytes: u64,
}

/// All adapters, the fastest kinds first. A GPU may appear once for each interface.
pub fn adapters() -> Vec<Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    found.sort_by_key(|adapter| super::slowness(adapter.get_info().device_type));
    found.iter().map(Adapter::from_adapter).collect()
}

impl Adapter {
    /// True for a GPU; false for a software rasteriser.
    pub fn is_hardware(&self) -> bool {
        self.kind.contains("GPU")
    }

    fn from_adapter(adapter: &wgpu::Adapter) -> Self {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        Self {
            backend: info.backend.to_string(),
            driver: [info.driver.trim(), info.driver_info.trim()].join(" ").trim().to_owned(),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete GPU",
                wgpu::DeviceType::IntegratedGpu => "integrated GPU",
                wgpu::DeviceType::VirtualGpu => "virtual GPU",
                wgpu::DeviceType::Cpu => "software",
                wgpu::DeviceType::Other => "unknown",
            }
            .to_owned(),
            name: info.name,
            largest_buffer_bytes: limits.max_buffer_size,
            largest_binding_bytes: limits.max_storage_buffer_binding_size,
        }
    }
}
