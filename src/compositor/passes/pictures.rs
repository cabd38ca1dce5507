//! One host for all passes from picture to picture: shaders over buffers of four values a pixel.

use crate::compositor::pyramid::Rgba;
use crate::error::{Error, Result};
use crate::gpu::ComputeDevice;
use crate::imaging::{Image, Mask};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Pixels of a workgroup along each axis, as in the shaders.
const WORKGROUP: u32 = 8;

/// Every shader of this host: its name, its text and its entry points.
pub(super) const SHADERS: [(&str, &str, &[&str]); 13] = [
    shader(
        "pyramid",
        include_str!("../../../shaders/pyramid.wgsl"),
        &["halve", "double"],
    ),
    shader(
        "despill",
        include_str!("../../../shaders/despill.wgsl"),
        &["despill"],
    ),
    shader(
        "background",
        include_str!("../../../shaders/background.wgsl"),
        &["background"],
    ),
    shader(
        "background_blur",
        include_str!("../../../shaders/background_blur.wgsl"),
        &["disc"],
    ),
    shader(
        "light_wrap",
        include_str!("../../../shaders/light_wrap.wgsl"),
        &["open", "wrap"],
    ),
    shader(
        "glare",
        include_str!("../../../shaders/glare.wgsl"),
        &["excess", "lay"],
    ),
    shader(
        "exposure",
        include_str!("../../../shaders/exposure.wgsl"),
        &["exposure"],
    ),
    shader(
        "view",
        include_str!("../../../shaders/view.wgsl"),
        &["view"],
    ),
    shader(
        "grain",
        include_str!("../../../shaders/grain.wgsl"),
        &["grain"],
    ),
    shader(
        "dither",
        include_str!("../../../shaders/dither.wgsl"),
        &["dither"],
    ),
    shader(
        "channels",
        include_str!("../../../shaders/channels.wgsl"),
        &["channels"],
    ),
    shader(
        "difference",
        include_str!("../../../shaders/difference.wgsl"),
        &["difference"],
    ),
    shader(
        "false_color",
        include_str!("../../../shaders/false_color.wgsl"),
        &["false_color"],
    ),
];

const fn shader(
    name: &'static str,
    text: &'static str,
    entries: &'static [&'static str],
) -> (&'static str, &'static str, &'static [&'static str]) {
    (name, text, entries)
}

/// The compiled passes, for one device. What each one does is in `super::effects`.
#[derive(Debug)]
pub struct PicturePasses {
    device: wgpu::Device,
    queue: wgpu::Queue,
    layout: wgpu::BindGroupLayout,
    /// By entry point: no two shaders share one.
    pipelines: Vec<(&'static str, wgpu::ComputePipeline)>,
}

/// A picture on the GPU: RGBA f32, row by row. The fourth value is coverage.
#[derive(Clone, Debug)]
pub struct GpuPicture {
    pub width: usize,
    pub height: usize,
    buffer: wgpu::Buffer,
}

impl GpuPicture {
    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// What a compute pass or a window binds.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

impl PicturePasses {
    /// Compiles the shaders.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
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
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("picture to picture"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let mut pipelines = Vec::new();
        for (name, text, entries) in SHADERS {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            for entry in entries {
                let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: Some(&pipeline_layout),
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                });
                pipelines.push((*entry, pipeline));
            }
        }
        Self {
            device: device.clone(),
            queue: queue.clone(),
            layout,
            pipelines,
        }
    }

    /// The passes on the GPU that the network computes on; none where it computes on a CPU.
    pub fn beside(network: &ComputeDevice) -> Option<Self> {
        let gpu = network.gpu.as_ref()?;
        Some(Self::new(&gpu.device, &gpu.queue))
    }

    /// A buffer that another pass of this device has left, `width · height` pixels of RGBA f32, as
    /// [`super::RelightPass::dispatch`] does.
    pub fn adopt(&self, width: usize, height: usize, buffer: wgpu::Buffer) -> GpuPicture {
        GpuPicture {
            width,
            height,
            buffer,
        }
    }

    /// Copies a picture and its coverage to the GPU. Both have one size.
    ///
    /// # Errors
    /// When the picture is empty or larger than what the GPU binds at once.
    pub fn upload(&self, image: &Image, alpha: &Mask) -> Result<GpuPicture> {
        self.fits(image.width, image.height)?;
        let pixels = image.pixels.iter().zip(&alpha.pixels);
        let pixels: Vec<[f32; 4]> = pixels.map(|(&[r, g, b], &a)| [r, g, b, a]).collect();
        let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some("picture"),
            contents: bytemuck::cast_slice(&pixels),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        });
        Ok(self.adopt(image.width, image.height, buffer))
    }

    fn fits(&self, width: usize, height: usize) -> Result<()> {
        let limits = self.device.limits();
        let side = limits.max_compute_workgroups_per_dimension as usize * WORKGROUP as usize;
        let pixels = (limits.max_storage_buffer_binding_size / 16) as usize;
        if (1..=side).contains(&width) && (1..=side).contains(&height) && width * height <= pixels {
            return Ok(());
        }
        Err(Error::unexpected(
            "a picture for the GPU",
            format!("1 to {pixels} pixels, at most {side} along each side"),
            format!("{width} × {height}"),
            "Make it on the CPU, or choose a smaller working size",
        ))
    }

    /// Submits one shader over every pixel of a new picture of `size`. `params` is laid out as the shader's
    /// `Params`. Where there is no `second`, the shader does not look at it.
    pub(super) fn run(
        &self,
        entry: &str,
        params: &[u8],
        first: &GpuPicture,
        second: Option<&GpuPicture>,
        size: (usize, usize),
    ) -> Result<GpuPicture> {
        self.fits(size.0, size.1)?;
        let found = self.pipelines.iter().find(|(name, _)| *name == entry);
        let Some((_, pipeline)) = found else {
            return Err(Error::unexpected(
                "the GPU's passes",
                "a shader of this host",
                entry,
                "Make the picture on the CPU",
            ));
        };
        let params = self.device.create_buffer_init(&BufferInitDescriptor {
            label: Some(entry),
            contents: params,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(entry),
            size: 16 * (size.0 * size.1) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let result = self.adopt(size.0, size.1, buffer);
        let bound = [
            first.binding(),
            second.unwrap_or(first).binding(),
            result.binding(),
            params.as_entire_binding(),
        ];
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(bound)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(entry),
            layout: &self.layout,
            entries: &entries,
        });
        let mut commands = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            let groups = |n: usize| (n as u32).div_ceil(WORKGROUP);
            pass.dispatch_workgroups(groups(size.0), groups(size.1), 1);
        }
        self.queue.submit([commands.finish()]);
        Ok(result)
    }

    /// Copies a picture to memory: its light, and in the fourth values its coverage.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read(&self, picture: &GpuPicture) -> Result<Rgba> {
        let pixels = super::read::read_back(&self.device, &self.queue, &picture.buffer)?;
        Ok(Rgba {
            width: picture.width,
            height: picture.height,
            pixels,
        })
    }
}
