//! Devices that make pictures and run the network. Passes and window share one GPU, whose results agree with the CPU's.
//! The network runs on burn's CPU backend, or on that GPU if the user chooses it: its output is then lit and
//! drawn there without a copy.

mod adapters;
mod autotune;
mod measured;
mod quiet;
mod self_test;

pub use adapters::{Adapter, adapters};
pub use autotune::FOLDER as KERNELS_FOLDER;

use base::error;
use burn::tensor::Device;
pub use burn::tensor::wgpu::WgpuSetup;
use clap::ValueEnum;
use compositor::passes::PicturePasses;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Device setting of the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// Pictures on a GPU if there is one, the network on the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// Pictures and network on the best adapter, even a software one.
    Gpu,
}

/// Device of the network, with the reason for the choice.
#[derive(Clone, Debug)]
pub struct ComputeDevice {
    pub device: Device,
    /// Text such as `CPU (flex): no GPU was found`.
    pub description: String,
    /// GPU that makes the pictures, possibly also `device`; None without one.
    pub gpu: Option<Gpu>,
}

/// GPU of this process: wgpu's device and queue, and burn's name for the same device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Passes of the compositor, compiled once for all pictures made there.
    pub passes: Arc<PicturePasses>,
    adapter: wgpu::AdapterInfo,
    setup: Box<WgpuSetup>,
    /// burn's name of this GPU, once a network runs there: each device known to burn keeps two threads awake.
    network: Arc<OnceLock<Result<Device, String>>>,
    /// Results of the self-tests for pictures and for the network, once they have run.
    verdicts: Arc<[OnceLock<Result<(), String>>; 2]>,
}

/// GPU of this process. burn keeps a device for the lifetime of the process, so there is only one.
static SHARED: Mutex<Shared> = Mutex::new(Shared::None);

#[derive(Debug)]
enum Shared {
    None,
    /// Device of the window.
    Offered(Box<WgpuSetup>),
    Open(Box<Gpu>),
}

impl Shared {
    fn open(&self) -> Option<&Gpu> {
        match self {
            Self::Open(gpu) => Some(gpu),
            Self::None | Self::Offered(_) => None,
        }
    }
}

impl ComputeDevice {
    /// Picks a device. Software rasterisers do not count as GPUs: the CPU backend is faster. A GPU
    /// whose results differ from the CPU's in a short test, run once per process, is not used.
    pub fn choose(choice: DeviceChoice) -> Self {
        match choice {
            DeviceChoice::Cpu => Self::trusted(Err("as requested".to_owned()), Gpu::check),
            DeviceChoice::Auto => Self::trusted(Gpu::shared(is_hardware), Gpu::check),
            // The test starts the last of burn's threads.
            DeviceChoice::Gpu => quiet::starting(|| {
                let pictures = Self::trusted(Gpu::shared(|_| true), Gpu::check);
                pictures.with_network(Gpu::check_network)
            }),
        }
    }

    /// The device without regard to its self-test, for measurements: its results may be wrong.
    ///
    /// # Errors
    /// When a GPU is required and there is none.
    pub fn untested(choice: DeviceChoice) -> Result<Self, String> {
        let suits = match choice {
            DeviceChoice::Cpu => return Ok(Self::choose(choice)),
            DeviceChoice::Auto => is_hardware,
            DeviceChoice::Gpu => |_: &wgpu::AdapterInfo| true,
        };
        let pictures = Self::trusted(Ok(Gpu::shared(suits)?), |_| Ok(()));
        Ok(pictures.with_network(|_| Ok(())))
    }

    /// The network on the CPU, and pictures on a GPU that passes `test`.
    fn trusted(gpu: Result<Gpu, String>, test: impl FnOnce(&Gpu) -> Result<(), String>) -> Self {
        match gpu.and_then(|gpu| test(&gpu).map(|()| gpu)) {
            Ok(gpu) => Self {
                device: Device::flex(),
                description: format!("CPU (flex); pictures: GPU {}", gpu.adapter.name),
                gpu: Some(gpu),
            },
            Err(why) => Self { device: Device::flex(), description: format!("CPU (flex): {why}"), gpu: None },
        }
    }

    /// The same with the network on the GPU too, if it passes `test`.
    fn with_network(self, test: impl FnOnce(&Gpu) -> Result<(), String>) -> Self {
        let Some(gpu) = &self.gpu else { return self };
        let name = &gpu.adapter.name;
        match gpu.network().and_then(|device| test(gpu).map(|()| device)) {
            Ok(device) => Self { device, description: format!("GPU (wgpu): {name}"), ..self },
            Err(why) => Self { description: format!("CPU (flex): {why}; pictures: GPU {name}"), ..self },
        }
    }

    /// The compositor's passes on the GPU; None if pictures are made in memory.
    pub fn passes(&self) -> Option<&Arc<PicturePasses>> {
        self.gpu.as_ref().map(|gpu| &gpu.passes)
    }

    /// True if its GPU is lost.
    pub fn is_lost(&self) -> bool {
        self.passes().is_some_and(|passes| passes.is_lost())
    }

    /// Runs `work` that needs this device; on a GPU through [`PicturePasses::guarded`].
    ///
    /// # Errors
    /// As [`PicturePasses::guarded`].
    pub fn guarded<T>(&self, work: impl FnOnce() -> error::Result<T>) -> error::Result<T> {
        match self.passes() {
            Some(passes) => passes.guarded(work),
            None => work(),
        }
    }
}

/// True if this process had a GPU and lost it.
pub fn is_lost() -> bool {
    let shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    shared.open().is_some_and(|gpu| gpu.passes.is_lost())
}

impl Gpu {
    /// Offers the window's device, made by [`device_descriptor`], as the GPU of this process, unless
    /// there is one.
    pub fn share(setup: WgpuSetup) {
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*shared, Shared::None) {
            *shared = Shared::Offered(Box::new(setup));
        }
    }

    /// True if this is the device of this process's GPU.
    pub fn is_shared(device: &wgpu::Device) -> bool {
        let shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        match &*shared {
            Shared::None => false,
            Shared::Offered(setup) => setup.device == *device,
            Shared::Open(gpu) => gpu.device == *device,
        }
    }

    /// Ok if it can make pictures; otherwise the reason.
    fn check(&self) -> Result<(), String> {
        if self.passes.is_lost() {
            let name = &self.adapter.name;
            return Err(format!("the GPU {name} stopped working; start Afterlight again to use it"));
        }
        let [pictures, _] = &*self.verdicts;
        pictures.get_or_init(|| self_test::pictures(&self.adapter.name, &self.passes)).clone()
    }

    /// Ok if a network can run on it; otherwise the reason.
    fn check_network(&self) -> Result<(), String> {
        let (name, device) = (&self.adapter.name, self.network()?);
        let [_, network] = &*self.verdicts;
        network.get_or_init(|| self_test::network(name, &device)).clone()
    }

    /// burn's name of this GPU.
    fn network(&self) -> Result<Device, String> {
        let register = || {
            autotune::keep();
            let setup = WgpuSetup::clone(&self.setup);
            let network = Device::wgpu_options().setup(setup).init();
            network.map_err(|e| e.to_string())
        };
        self.network.get_or_init(register).clone()
    }

    /// The GPU of this process if it `suits`; opened if there is none yet.
    fn shared(suits: fn(&wgpu::AdapterInfo) -> bool) -> Result<Self, String> {
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Shared::Offered(setup) = &*shared
            && suits(&setup.adapter.get_info())
        {
            *shared = Shared::Open(Box::new(Self::new(WgpuSetup::clone(setup))));
        }
        if let Some(gpu) = shared.open().filter(|gpu| suits(&gpu.adapter)) {
            return Ok(gpu.clone());
        }
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        adapters.retain(|adapter| suits(&adapter.get_info()));
        adapters.sort_by_key(|adapter| slowness(adapter.get_info().device_type));
        let mut why = "no GPU was found".to_owned();
        for adapter in adapters {
            match Self::open(&instance, adapter) {
                Ok(gpu) => {
                    *shared = Shared::Open(Box::new(gpu.clone()));
                    return Ok(gpu);
                }
                Err(reason) => why = reason,
            }
        }
        Err(why)
    }

    fn open(instance: &wgpu::Instance, adapter: wgpu::Adapter) -> Result<Self, String> {
        let (device, queue) =
            pollster::block_on(adapter.request_device(&device_descriptor(&adapter))).map_err(|e| e.to_string())?;
        Ok(Self::new(WgpuSetup {
            instance: instance.clone(),
            backend: adapter.get_info().backend,
            adapter,
            device,
            queue,
        }))
    }

    fn new(setup: WgpuSetup) -> Self {
        Self {
            passes: Arc::new(PicturePasses::new(&setup.device, &setup.queue)),
            adapter: setup.adapter.get_info(),
            device: setup.device.clone(),
            queue: setup.queue.clone(),
            setup: Box::new(setup),
            network: Arc::default(),
            verdicts: Arc::default(),
        }
    }
}

/// Description of a device for the network: burn uses the features and limits of the adapter, so the device
/// must have all of them.
pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    // Mappable device buffers are slow on discrete GPUs.
    let unwanted = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS | wgpu::Features::all_experimental_mask();
    wgpu::DeviceDescriptor {
        label: Some("afterlight"),
        required_features: adapter.features().difference(unwanted),
        required_limits: adapter.limits(),
        ..Default::default()
    }
}

fn is_hardware(adapter: &wgpu::AdapterInfo) -> bool {
    use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};
    matches!(adapter.device_type, DiscreteGpu | IntegratedGpu | VirtualGpu)
}

/// Orders kinds of adapters, the fastest first.
fn slowness(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base::error::Error;
    use burn::tensor::Tensor;

    /// On a separate GPU device, because the process has only one shared device.
    #[test]
    fn a_network_on_a_gpu_that_is_lost_says_so_and_the_next_device_is_the_cpu() {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let adapter = adapters.into_iter().next().ok_or("no adapter");
        let Some(adapter) = test_support::found(test_support::Need::Gpu, adapter) else { return };
        let gpu = Gpu::open(&instance, adapter).unwrap();
        let compute = |gpu: Gpu| ComputeDevice::trusted(Ok(gpu), Gpu::check).with_network(Gpu::check_network);
        for verdict in &*gpu.verdicts {
            verdict.set(Ok(())).unwrap();
        }
        let there = compute(gpu.clone());
        let twice = || {
            there.guarded(|| {
                let ones = Tensor::<1>::ones([8], &there.device);
                let data = (ones.clone() + ones).try_into_data();
                let data = data.map_err(|e| Error::device(format!("{e:?}"), ""))?;
                Ok(data.try_into_vec::<f32>().unwrap_or_default())
            })
        };
        assert_eq!(twice().unwrap(), [2.0; 8]);
        assert!(!there.is_lost());

        gpu.device.destroy();
        for _ in 0..2 {
            assert!(matches!(twice(), Err(Error::GpuLost)));
        }
        assert!(there.is_lost());
        let next = compute(gpu);
        assert!(next.gpu.is_none() && next.device == Device::flex());
        let said = next.description;
        assert!(said.contains("stopped working; start Afterlight again"), "{said}");
    }
}
