//! Common host of the passes from picture to picture: shaders over buffers of four values per pixel.

use super::relight::RelightPass;
use super::shader::Shader;
use base::error::{Error, Result};
use imaging::{DisplayTable, Image, Mask};
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Pixels of a workgroup along each axis, as in the shaders.
pub(super) const WORKGROUP: u32 = 8;

/// All passes of one device. Each is compiled at its first use.
#[derive(Debug)]
pub struct PicturePasses {
    pub(crate) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) layout: wgpu::BindGroupLayout,
    /// Compiled passes by shader and entry point.
    pipelines: Mutex<HashMap<[&'static str; 2], wgpu::ComputePipeline>>,
    /// Last table used, by its identity.
    table: Mutex<Option<(u64, GpuPicture)>>,
    /// Sum of lamps.
    pub relight: RelightPass,
}

/// A picture on the GPU: RGBA f32, row by row. The fourth value is coverage.
#[derive(Clone, Debug)]
pub struct GpuPicture {
    pub width: usize,
    pub height: usize,
    pub(super) buffer: wgpu::Buffer,
}

/// Columns and rows in the shaders' type.
pub(crate) fn extent((width, height): (usize, usize)) -> [u32; 2] {
    [width as u32, height as u32]
}

impl GpuPicture {
    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Resource that a compute pass binds.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

impl PicturePasses {
    /// Passes of a device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("picture to picture"),
            entries: &[
                buffer(0, storage(true)),
                buffer(1, storage(true)),
                buffer(2, storage(false)),
                buffer(3, wgpu::BufferBindingType::Uniform),
                buffer(4, storage(false)),
            ],
        });
        Self {
            device: device.clone(),
            queue: queue.clone(),
            layout,
            pipelines: Mutex::default(),
            table: Mutex::default(),
            relight: RelightPass::new(device, queue),
        }
    }

    /// The compiled entry point of a shader.
    pub(super) fn pipeline(&self, shader: &Shader, entry: &'static str) -> wgpu::ComputePipeline {
        // The map is consistent at any time, even if a lost GPU made a thread panic here.
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let compile = || {
            let device = &self.device;
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader.name),
                source: wgpu::ShaderSource::Wgsl(shader.source().into()),
            });
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("picture to picture"),
                bind_group_layouts: &[Some(&self.layout)],
                immediate_size: 0,
            });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        let slot = pipelines.entry([shader.name, entry]);
        slot.or_insert_with(compile).clone()
    }

    /// Buffer of `width · height` pixels of RGBA f32 on this device.
    pub(super) fn adopt(&self, width: usize, height: usize, buffer: wgpu::Buffer) -> GpuPicture {
        GpuPicture { width, height, buffer }
    }

    /// Copies a picture and its coverage to the GPU. Both have the same size.
    ///
    /// # Errors
    /// When the picture is empty or exceeds the GPU's binding size.
    pub fn upload(&self, image: &Image, alpha: &Mask) -> Result<GpuPicture> {
        self.upload_with(image, |i| alpha.pixels[i])
    }

    /// Copies an opaque picture, like [`Self::upload`].
    ///
    /// # Errors
    /// As [`Self::upload`].
    pub fn upload_opaque(&self, image: &Image) -> Result<GpuPicture> {
        self.upload_with(image, |_| 1.0)
    }

    /// A table on the GPU, copied unless it is the last one used.
    ///
    /// # Errors
    /// When the GPU cannot hold it.
    pub(crate) fn display_table(&self, table: &DisplayTable) -> Result<GpuPicture> {
        let mut last = self.table.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, there)) = last.as_ref().filter(|(id, _)| *id == table.identity()) {
            return Ok(there.clone());
        }
        let there = self.upload_opaque(&table.entries())?;
        *last = Some((table.identity(), there.clone()));
        Ok(there)
    }

    fn upload_with(&self, image: &Image, alpha: impl Fn(usize) -> f32) -> Result<GpuPicture> {
        self.fits(image.width, image.height)?;
        let pixels = image.pixels.iter().enumerate();
        let pixels: Vec<[f32; 4]> = pixels.map(|(i, &[r, g, b])| [r, g, b, alpha(i)]).collect();
        let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some("picture"),
            contents: bytemuck::cast_slice(&pixels),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        });
        Ok(self.adopt(image.width, image.height, buffer))
    }

    /// Refuses a picture that is empty or exceeds the GPU's binding size.
    pub(crate) fn fits(&self, width: usize, height: usize) -> Result<()> {
        let limits = self.device.limits();
        let side = limits.max_compute_workgroups_per_dimension as usize * WORKGROUP as usize;
        let pixels = (limits.max_storage_buffer_binding_size / 16) as usize;
        if (1..=side).contains(&width) && (1..=side).contains(&height) && width * height <= pixels {
            return Ok(());
        }
        Err(Error::device(
            format!(
                "this GPU cannot hold a picture of {width} × {height} pixels, only 1 to {pixels} pixels with at most \
                 {side} along each side"
            ),
            "Make it on the CPU, or choose a smaller working size",
        ))
    }
}
