//! One host for all passes from picture to picture: shaders over buffers of four values a pixel.

use super::relight::RelightPass;
use base::error::{Error, Result};
use imaging::{Image, Mask};
use std::sync::OnceLock;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Pixels of a workgroup along each axis, as in the shaders.
pub(super) const WORKGROUP: u32 = 8;

/// A shader's name, its text and its entry points.
pub(super) type Shader = (&'static str, &'static str, &'static [&'static str]);

/// Every shader of this host: no two entry points have one name.
pub(super) const SHADERS: [Shader; 15] = [
    shader(
        "pyramid",
        include_str!("../../../shaders/pyramid.wgsl"),
        &["halve", "double"],
    ),
    shader(
        "edges",
        include_str!("../../../shaders/edges.wgsl"),
        &["mend", "extend", "cut"],
    ),
    shader(
        "measure",
        include_str!("../../../shaders/measure.wgsl"),
        &["total", "largest", "shrink", "pick"],
    ),
    shader(
        "despill",
        include_str!("../../../shaders/despill.wgsl"),
        &["despill", "rim", "inside", "guide", "spill"],
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
        &["open", "wrap", "over"],
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
        &["grain", "survey"],
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
) -> Shader {
    (name, text, entries)
}

/// All passes for one device. Each is compiled when it is first used.
#[derive(Debug)]
pub struct PicturePasses {
    pub(crate) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) layout: wgpu::BindGroupLayout,
    pipelines: Vec<(&'static str, OnceLock<wgpu::ComputePipeline>)>,
    /// The sum of lamps.
    pub relight: RelightPass,
}

/// A picture on the GPU: RGBA f32, row by row. The fourth value is coverage.
#[derive(Clone, Debug)]
pub struct GpuPicture {
    pub width: usize,
    pub height: usize,
    pub(super) buffer: wgpu::Buffer,
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
    /// The passes of a device.
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
                buffer(4, storage(false)),
            ],
        });
        let entries = SHADERS.iter().flat_map(|(_, _, entries)| *entries);
        Self {
            device: device.clone(),
            queue: queue.clone(),
            layout,
            pipelines: entries.map(|entry| (*entry, OnceLock::new())).collect(),
            relight: RelightPass::new(device, queue),
        }
    }

    /// The compiled shader of this entry point.
    pub(super) fn pipeline(&self, entry: &'static str) -> Result<&wgpu::ComputePipeline> {
        let shader = SHADERS.iter().find(|(_, _, all)| all.contains(&entry));
        let slot = self.pipelines.iter().find(|(name, _)| *name == entry);
        let (Some((name, text, _)), Some((_, slot))) = (shader, slot) else {
            return Err(Error::bug(format!(
                "the GPU's passes have no shader {entry}"
            )));
        };
        Ok(slot.get_or_init(|| {
            let device = &self.device;
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl((*text).into()),
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
        }))
    }

    /// `width · height` pixels of RGBA f32 that this device has.
    pub(super) fn adopt(&self, width: usize, height: usize, buffer: wgpu::Buffer) -> GpuPicture {
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
        self.upload_with(image, |i| alpha.pixels[i])
    }

    /// Copies a picture that covers everything, as [`Self::upload`].
    ///
    /// # Errors
    /// As [`Self::upload`].
    pub fn upload_opaque(&self, image: &Image) -> Result<GpuPicture> {
        self.upload_with(image, |_| 1.0)
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

    /// Refuses a picture that is empty or that the GPU cannot bind at once.
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
