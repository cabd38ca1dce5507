//! Where the network runs: a GPU where there is a real one, else burn's CPU backend.

use burn::tensor::{Device, DeviceKind};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// What a person asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// A GPU where there is one, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The first adapter, even a software one.
    Gpu,
}

/// A device for the network, and a sentence that says which and why.
#[derive(Clone, Debug)]
pub struct ComputeDevice {
    pub device: Device,
    /// Such as `CPU (flex): no GPU was found`.
    pub description: String,
}

impl ComputeDevice {
    /// Picks a device. Software rasterisers do not count as GPUs: there the CPU backend is faster.
    pub fn choose(choice: DeviceChoice) -> Self {
        let cpu = |why: &str| Self {
            device: Device::flex(),
            description: format!("CPU (flex): {why}"),
        };
        match choice {
            DeviceChoice::Cpu => cpu("as asked"),
            DeviceChoice::Gpu => Self {
                device: Device::wgpu(DeviceKind::DefaultDevice),
                description: "GPU (wgpu): as asked".to_owned(),
            },
            DeviceChoice::Auto => match hardware_adapter() {
                Some(name) => Self {
                    device: Device::wgpu(DeviceKind::DefaultDevice),
                    description: format!("GPU (wgpu): {name}"),
                },
                None => cpu("no GPU was found"),
            },
        }
    }
}

/// The name of the first adapter that is hardware.
fn hardware_adapter() -> Option<String> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    adapters
        .iter()
        .map(wgpu::Adapter::get_info)
        .find_map(|info| {
            use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};
            matches!(info.device_type, DiscreteGpu | IntegratedGpu | VirtualGpu)
                .then_some(info.name)
        })
}
