//! Pass `relight` on the GPU. Its twins on the CPU are [`crate::compositor::reference::relight`] and
//! [`crate::compositor::reference::relight_half`].

use super::read::read_back;
use super::work::image;
use crate::compositor::reference::lit_lamps;
use crate::error::{Error, Result};
use crate::imaging::Image;
use crate::reflectance::{FieldBuffer, HalfField, ReflectanceField};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Pixels of one workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// The compiled pass, for one device.
#[derive(Debug)]
pub struct RelightPass {
    device: wgpu::Device,
    queue: wgpu::Queue,
    full: wgpu::ComputePipeline,
    half: wgpu::ComputePipeline,
}

/// How a field lies in its buffer.
#[derive(Clone, Copy, Debug)]
pub enum Layout {
    /// As [`ReflectanceField::values`].
    Full,
    /// As [`HalfField::values`], two of them to a word.
    Half {
        /// [`HalfField::scale`].
        scale: f32,
    },
}

/// What the shader is told besides the lamps.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Shape {
    pixels: u32,
    lamps: u32,
    all_lamps: u32,
    scale: f32,
}

/// One lamp's entry in the shader's list.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Share {
    weight: [f32; 3],
    lamp: u32,
}

impl RelightPass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("relight"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../../shaders/relight.wgsl").into()),
        });
        let pipeline = |entry_point| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("relight"),
                layout: None,
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        Self {
            device: device.clone(),
            queue: queue.clone(),
            full: pipeline("main"),
            half: pipeline("main_half"),
        }
    }

    /// Sums a field where the network left it, on this device, and reads the picture back.
    ///
    /// # Errors
    /// When the field does not fit the weights, or the device fails.
    pub fn sum(&self, field: &FieldBuffer, weights: &[[f32; 3]]) -> Result<Image> {
        self.check_binds(field, weights)?;
        let (width, height) = (field.width, field.height);
        let relit = self.dispatch(Layout::Full, field.binding(), width * height, weights)?;
        self.picture(&relit, width, height)
    }

    /// Uploads a field, sums it and reads the picture back.
    ///
    /// # Errors
    /// When the field is too large for the device, does not fit the weights, or the device fails.
    pub fn run(&self, field: &ReflectanceField, weights: &[[f32; 3]]) -> Result<Image> {
        check_lamps(field.lamps, weights)?;
        let bytes = bytemuck::cast_slice(&field.values);
        self.upload(bytes, Layout::Full, [field.width, field.height], weights)
    }

    /// [`Self::run`] for a field in f16.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_half(&self, field: &HalfField, weights: &[[f32; 3]]) -> Result<Image> {
        check_lamps(field.lamps, weights)?;
        let layout = Layout::Half {
            scale: field.scale(),
        };
        let bytes = bytemuck::cast_slice(field.values());
        self.upload(bytes, layout, [field.width, field.height], weights)
    }

    fn upload(
        &self,
        field: &[u8],
        layout: Layout,
        [width, height]: [usize; 2],
        weights: &[[f32; 3]],
    ) -> Result<Image> {
        if field.is_empty() || lit_lamps(weights).is_empty() {
            return Ok(Image::filled(width, height, [0.0; 3]));
        }
        self.check_bytes(field.len())?;
        let values = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some("reflectance field"),
            contents: field,
            usage: wgpu::BufferUsages::STORAGE,
        });
        let binding = values.as_entire_binding();
        let relit = self.dispatch(layout, binding, width * height, weights)?;
        self.picture(&relit, width, height)
    }

    /// Refuses a field that does not fit the weights or that the device cannot bind at once.
    pub(super) fn check_binds(&self, field: &FieldBuffer, weights: &[[f32; 3]]) -> Result<()> {
        check_lamps(field.lamps, weights)?;
        self.check_bytes(size_of::<f32>() * field.lamps * 3 * field.width * field.height)
    }

    fn check_bytes(&self, bytes: usize) -> Result<()> {
        let limit = self.device.limits().max_storage_buffer_binding_size;
        if bytes as u64 <= limit {
            return Ok(());
        }
        Err(Error::unexpected(
            "the reflectance field",
            format!("at most {limit} bytes, which is what this GPU binds at once"),
            bytes.to_string(),
            "Relight it on the CPU, or choose a smaller working size",
        ))
    }

    /// Sums a field that is on this device already and leaves `pixels` values of RGBA f32 in a buffer there.
    /// Submits one dispatch.
    fn dispatch(
        &self,
        layout: Layout,
        field: wgpu::BindingResource,
        pixels: usize,
        weights: &[[f32; 3]],
    ) -> Result<wgpu::Buffer> {
        let mut commands = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let relit = {
            let mut pass = commands.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            self.encode(&mut pass, layout, field, pixels, weights)?
        };
        self.queue.submit([commands.finish()]);
        Ok(relit)
    }

    /// Records the sum of a field that is on this device already, and the buffer that it goes to:
    /// `pixels` values of RGBA f32.
    ///
    /// # Errors
    /// When the device has no room for the workgroups.
    pub(super) fn encode(
        &self,
        pass: &mut wgpu::ComputePass,
        layout: Layout,
        field: wgpu::BindingResource,
        pixels: usize,
        weights: &[[f32; 3]],
    ) -> Result<wgpu::Buffer> {
        let (pipeline, each, scale) = match layout {
            Layout::Full => (&self.full, 1, 1.0),
            Layout::Half { scale } => (&self.half, 2, scale),
        };
        let groups = pixels.div_ceil(each * WORKGROUP as usize);
        let limit = self.device.limits().max_compute_workgroups_per_dimension as usize;
        if groups > limit {
            return Err(Error::unexpected(
                "the reflectance field",
                format!(
                    "at most {} pixels, which is what this GPU does at once",
                    limit * each * WORKGROUP as usize
                ),
                pixels.to_string(),
                "Relight it on the CPU, or choose a smaller working size",
            ));
        }
        let lamps = lit_lamps(weights);
        let shape = Shape {
            pixels: pixels as u32,
            lamps: lamps.len() as u32,
            all_lamps: weights.len() as u32,
            scale,
        };
        let mut shares: Vec<Share> = lamps
            .iter()
            .map(|&lamp| Share {
                weight: weights[lamp],
                lamp: lamp as u32,
            })
            .collect();
        // A binding may not be empty; the shader's count keeps it from reading this one.
        shares.resize(
            shares.len().max(1),
            Share {
                weight: [0.0; 3],
                lamp: 0,
            },
        );
        let upload = |label, contents: &[u8], usage| {
            self.device.create_buffer_init(&BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let shares = upload(
            "lamp shares",
            bytemuck::cast_slice(&shares),
            wgpu::BufferUsages::STORAGE,
        );
        let shape = upload(
            "relight shape",
            bytemuck::bytes_of(&shape),
            wgpu::BufferUsages::UNIFORM,
        );
        let relit = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("relit"),
            size: 16 * pixels as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let resources = [
            field,
            shares.as_entire_binding(),
            relit.as_entire_binding(),
            shape.as_entire_binding(),
        ];
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("relight"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(groups as u32, 1, 1);
        Ok(relit)
    }

    fn picture(&self, relit: &wgpu::Buffer, width: usize, height: usize) -> Result<Image> {
        let commands = self.device.create_command_encoder(&Default::default());
        let target = (&self.device, &self.queue);
        read_back(target, commands, &[relit], |parts| {
            image((width, height), parts[0])
        })
    }
}

fn check_lamps(lamps: usize, weights: &[[f32; 3]]) -> Result<()> {
    if weights.len() == lamps {
        return Ok(());
    }
    Err(Error::unexpected(
        "the reflectance field",
        format!("{} lamps as in the weights", weights.len()),
        format!("{lamps} lamps"),
        "Predict this frame again with the network of this project",
    ))
}

#[cfg(test)]
pub(in crate::compositor) mod tests {
    use super::*;
    use crate::compositor::relight::{relight, relight_half, tests::noise_field};
    use std::future::Future;
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};

    /// Waits for what wgpu finishes at once outside of browsers.
    fn wait<T>(future: impl Future<Output = T>) -> T {
        let mut future = pin!(future);
        loop {
            if let Poll::Ready(value) = future
                .as_mut()
                .poll(&mut Context::from_waker(Waker::noop()))
            {
                return value;
            }
            std::thread::yield_now();
        }
    }

    /// Any adapter's device, even a software one, without any optional feature.
    pub fn any_device() -> Option<(wgpu::Device, wgpu::Queue)> {
        device(false)
    }

    /// Any adapter's device; where `timed`, one with timestamps.
    pub fn device(timed: bool) -> Option<(wgpu::Device, wgpu::Queue)> {
        let clock = wgpu::Features::TIMESTAMP_QUERY;
        let wanted = wgpu::DeviceDescriptor {
            required_features: if timed {
                clock
            } else {
                wgpu::Features::empty()
            },
            ..Default::default()
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let made = wait(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|e| e.to_string())
            .and_then(|adapter| {
                println!("on {}", adapter.get_info().name);
                wait(adapter.request_device(&wanted)).map_err(|e| e.to_string())
            });
        made.inspect_err(|e| println!("skipped: no such adapter for compute shaders: {e}"))
            .ok()
    }

    fn pass() -> Option<RelightPass> {
        any_device().map(|(device, queue)| RelightPass::new(&device, &queue))
    }

    #[test]
    fn the_gpu_agrees_with_its_twin() {
        let Some(pass) = pass() else { return };
        for (width, height, lamps) in [(1, 1, 1), (67, 45, 41), (128, 128, 7)] {
            let field = noise_field(width, height, lamps);
            let mut weights: Vec<[f32; 3]> = (0..lamps)
                .map(|l| [0.1 * l as f32, 1.0, 3.0 / (1 + l) as f32])
                .collect();
            weights[lamps / 2] = [0.0; 3];
            weights[lamps - 1] = [1e6, 0.5, 2e5];
            let there = pass.run(&field, &weights).unwrap();
            let here = relight(&field, &weights, &lit_lamps(&weights));
            assert_eq!(there.size(), here.size());
            for (gpu, cpu) in there
                .pixels
                .iter()
                .flatten()
                .zip(here.pixels.iter().flatten())
            {
                // All terms are positive: the order of 41 additions and their fusing move less than this.
                assert!((gpu - cpu).abs() <= 1e-5 * cpu.abs(), "{gpu} is not {cpu}");
            }
        }
    }

    #[test]
    fn the_gpu_sums_halves_as_its_twin_does() {
        let Some(pass) = pass() else { return };
        for (width, height, lamps) in [(1, 1, 1), (67, 45, 41), (128, 128, 7)] {
            let field = noise_field(width, height, lamps);
            let half = HalfField::from(&field);
            let mut weights: Vec<[f32; 3]> = (0..lamps)
                .map(|l| [0.1 + 0.1 * l as f32, 1.0, 3.0 / (1 + l) as f32])
                .collect();
            weights[lamps - 1] = [1e6, 0.5, 2e5];
            let there = pass.run_half(&half, &weights).unwrap();
            let here = relight_half(&half, &weights, &lit_lamps(&weights));
            let full = pass.run(&field, &weights).unwrap();
            assert_eq!(there.size(), here.size());
            for ((gpu, cpu), full) in (there.pixels.iter().flatten())
                .zip(here.pixels.iter().flatten())
                .zip(full.pixels.iter().flatten())
            {
                // As above; and halves are off by 2⁻¹¹.
                assert!((gpu - cpu).abs() <= 1e-5 * cpu, "{gpu} is not {cpu}");
                assert!((gpu - full).abs() <= (1e-5 + 0.5f32.powi(11)) * full);
            }
        }
        assert!(
            pass.run_half(&HalfField::from(&noise_field(4, 4, 3)), &[[1.0; 3]; 2])
                .is_err()
        );
    }

    #[test]
    fn halves_of_dark_lamps_are_not_read_on_the_gpu() {
        let Some(pass) = pass() else { return };
        let mut field = noise_field(5, 5, 3);
        field.values[75..150].fill(f32::NAN);
        field.values[7] = f32::INFINITY;
        let half = HalfField::from(&field);
        let lit = pass
            .run_half(&half, &[[1.0; 3], [0.0; 3], [1.0; 3]])
            .unwrap();
        let bad = |i: &usize| lit.pixels[*i].iter().any(|v| !v.is_finite());
        assert_eq!((0..25).filter(bad).collect::<Vec<_>>(), [7]);
    }

    #[test]
    fn nothing_to_sum_is_black_and_what_does_not_fit_is_refused() {
        let Some(pass) = pass() else { return };
        let field = noise_field(4, 4, 3);
        assert!(
            pass.run(&field, &[[0.0; 3]; 3])
                .unwrap()
                .pixels
                .iter()
                .all(|&p| p == [0.0; 3])
        );
        assert!(pass.run(&field, &[[1.0; 3]; 2]).is_err());
        let mut dark = field.clone();
        dark.values[48..96].fill(f32::NAN);
        let lit = pass.run(&dark, &[[1.0; 3], [0.0; 3], [1.0; 3]]).unwrap();
        assert!(lit.pixels.iter().flatten().all(|v| v.is_finite()));
    }
}
