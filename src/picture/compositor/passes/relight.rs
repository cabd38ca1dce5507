//! Pass `relight` on the GPU, for fields of every [`FieldFormat`]. Its twins on the CPU are
//! [`crate::reference::relight`], [`crate::reference::relight_half`] and
//! [`crate::reference::relight_compressed`].

use super::read::{image, read_back};
use super::shader::Shader;
use base::error::{Error, Result};
use imaging::Image;
use reflectance::compressed::shares;
use reflectance::{FieldBuffer, FieldFormat, HalfField, ReflectanceField};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

pub(crate) const RELIGHT: Shader = Shader::alone("relight", include_str!("../../../../shaders/relight.wgsl"));

/// Pixels of one workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// Workgroups that search the largest value of a field.
const SEARCHES: usize = 1024;

/// Compiled pass for one device.
#[derive(Debug)]
pub struct RelightPass {
    device: wgpu::Device,
    queue: wgpu::Queue,
    full: wgpu::ComputePipeline,
    half: wgpu::ComputePipeline,
    components: wgpu::ComputePipeline,
    largest: wgpu::ComputePipeline,
    halve: wgpu::ComputePipeline,
}

/// Parameters of the shader, without the lamps.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Shape {
    pixels: u32,
    /// Entries of the list of lamps.
    lamps: u32,
    all_lamps: u32,
    padding: u32,
}

/// Entry of one lamp in the shader's list.
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
            label: Some(RELIGHT.name),
            source: wgpu::ShaderSource::Wgsl(RELIGHT.source().into()),
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
            components: pipeline("main_components"),
            largest: pipeline("largest"),
            halve: pipeline("halve"),
        }
    }

    /// Sums a field on this device and reads the picture back.
    ///
    /// # Errors
    /// When field and weights do not match, or the device fails.
    pub fn sum(&self, field: &FieldBuffer, weights: &[[f32; 3]]) -> Result<Image> {
        self.check_binds(field, weights)?;
        let mut commands = self.device.create_command_encoder(&Default::default());
        let relit = {
            let mut pass = commands.begin_compute_pass(&Default::default());
            self.encode(&mut pass, field, weights)?
        };
        let target = (&self.device, &self.queue);
        read_back(target, commands, &[&relit], |parts| image((field.width, field.height), parts[0]))
    }

    /// Uploads a field, sums it and reads the picture back.
    ///
    /// # Errors
    /// When the field is too large for the device, does not match the weights, or the device fails.
    pub fn run(&self, field: &ReflectanceField, weights: &[[f32; 3]]) -> Result<Image> {
        check_lamps(field.lamps, weights)?;
        if field.values.is_empty() {
            return Ok(Image::filled(field.width, field.height, [0.0; 3]));
        }
        self.check_bytes(size_of_val(&field.values[..]))?;
        self.sum(&FieldBuffer::upload(field, &self.device), weights)
    }

    /// [`Self::run`] for a field in f16.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_half(&self, field: &HalfField, weights: &[[f32; 3]]) -> Result<Image> {
        check_lamps(field.lamps, weights)?;
        if field.values().is_empty() {
            return Ok(Image::filled(field.width, field.height, [0.0; 3]));
        }
        self.check_bytes(size_of_val(field.values()))?;
        self.sum(&FieldBuffer::upload_half(field, &self.device), weights)
    }

    /// Converts a field in f32 on this device to f16, like [`HalfField`], except that values below 2⁻²⁹ of the
    /// largest may become 0. Nothing is read back or waited for.
    ///
    /// # Errors
    /// When the field exceeds the device's binding size.
    pub fn halve(&self, field: &FieldBuffer) -> Result<FieldBuffer> {
        self.check_bytes(field.bytes())?;
        let pixels = field.width * field.height;
        let buffer = |label, size| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let bytes = HalfField::bytes(pixels, field.lamps) as u64;
        let values = buffer("reflectance field in f16", bytes);
        // A new buffer holds zeros: the search starts at 0.
        let stored = buffer("scale of halves", 8);
        let shape = self.upload(
            bytemuck::bytes_of(&Shape {
                pixels: pixels as u32,
                lamps: field.lamps as u32,
                all_lamps: field.lamps as u32,
                padding: 0,
            }),
            wgpu::BufferUsages::UNIFORM,
        );
        let shape = (3, shape.as_entire_binding());
        let stored_binding = (4, stored.as_entire_binding());
        let mut commands = self.device.create_command_encoder(&Default::default());
        let search = [(0, field.binding()), shape.clone(), stored_binding.clone()];
        let groups = pixels.div_ceil(2 * WORKGROUP as usize);
        self.check_groups(groups, 2)?;
        let halves = (2, values.as_entire_binding());
        let halve = [(0, field.binding()), halves, shape, stored_binding];
        for (pipeline, bound, groups) in
            [(&self.largest, &search[..], SEARCHES.min(groups)), (&self.halve, &halve[..], groups)]
        {
            // Two passes: the second sees all that the first wrote.
            let mut pass = commands.begin_compute_pass(&Default::default());
            self.dispatch(&mut pass, pipeline, bound, groups);
        }
        self.queue.submit([commands.finish()]);
        Ok(field.halved(values, stored))
    }

    /// Refuses a field that does not match the weights or exceeds the device's binding size.
    pub(super) fn check_binds(&self, field: &FieldBuffer, weights: &[[f32; 3]]) -> Result<()> {
        check_lamps(field.lamps, weights)?;
        self.check_bytes(field.bytes())
    }

    fn check_bytes(&self, bytes: usize) -> Result<()> {
        let limit = self.device.limits().max_storage_buffer_binding_size;
        if bytes as u64 <= limit {
            return Ok(());
        }
        Err(Error::device(
            format!("the reflectance field has {bytes} bytes; this GPU binds at most {limit} at once"),
            "Relight it on the CPU, or choose a smaller working size",
        ))
    }

    fn check_groups(&self, groups: usize, each: usize) -> Result<()> {
        let limit = self.device.limits().max_compute_workgroups_per_dimension as usize;
        if groups <= limit {
            return Ok(());
        }
        let pixels = |groups| groups * each * WORKGROUP as usize;
        Err(Error::device(
            format!(
                "the reflectance field has about {} pixels; this GPU computes at most {} at once",
                pixels(groups),
                pixels(limit)
            ),
            "Relight it on the CPU, or choose a smaller working size",
        ))
    }

    /// Records the sum of a field on this device, and returns the buffer of the result: values of
    /// RGBA f32.
    ///
    /// # Errors
    /// When the device has too little memory for the workgroups.
    pub(super) fn encode(
        &self,
        pass: &mut wgpu::ComputePass,
        field: &FieldBuffer,
        weights: &[[f32; 3]],
    ) -> Result<wgpu::Buffer> {
        let (pipeline, each) = match field.format() {
            FieldFormat::Full => (&self.full, 1),
            FieldFormat::Half { .. } => (&self.half, 2),
            FieldFormat::Components { .. } => (&self.components, 1),
        };
        let pixels = field.width * field.height;
        let groups = pixels.div_ceil(each * WORKGROUP as usize);
        self.check_groups(groups, each)?;
        let weights: Vec<[f32; 3]> = match field.format() {
            FieldFormat::Components { basis } => shares(basis, weights),
            FieldFormat::Full | FieldFormat::Half { .. } => weights.to_vec(),
        };
        let mut shares: Vec<Share> = (0..)
            .zip(weights)
            .filter(|(_, weight)| *weight != [0.0; 3])
            .map(|(lamp, weight)| Share { weight, lamp })
            .collect();
        let shape =
            Shape { pixels: pixels as u32, lamps: shares.len() as u32, all_lamps: field.lamps as u32, padding: 0 };
        // A binding may not be empty; the shader's count keeps it from reading this one.
        if shares.is_empty() {
            shares.push(Share { weight: [0.0; 3], lamp: 0 });
        }
        let storage = wgpu::BufferUsages::STORAGE;
        let shares = self.upload(bytemuck::cast_slice(&shares), storage);
        let shape = self.upload(bytemuck::bytes_of(&shape), wgpu::BufferUsages::UNIFORM);
        let relit = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("relit"),
            size: 16 * pixels as u64,
            usage: storage | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut bound = vec![
            (0, field.binding()),
            (1, shares.as_entire_binding()),
            (2, relit.as_entire_binding()),
            (3, shape.as_entire_binding()),
        ];
        if let FieldFormat::Half { scale } = field.format() {
            bound.push((4, scale.as_entire_binding()));
        }
        self.dispatch(pass, pipeline, &bound, groups);
        Ok(relit)
    }

    fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass,
        pipeline: &wgpu::ComputePipeline,
        bound: &[(u32, wgpu::BindingResource)],
        groups: usize,
    ) {
        let bound = bound.iter().cloned();
        let entries: Vec<wgpu::BindGroupEntry> =
            bound.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("relight"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(groups as u32, 1, 1);
    }

    fn upload(&self, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer_init(&BufferInitDescriptor { label: Some("relight"), contents, usage })
    }
}

fn check_lamps(lamps: usize, weights: &[[f32; 3]]) -> Result<()> {
    if weights.len() == lamps {
        return Ok(());
    }
    Err(Error::invalid(
        format!("the reflectance field has {lamps} lamps, but there are weights for {}", weights.len()),
        "Predict this frame again with the network of this project",
    ))
}

#[cfg(test)]
#[path = "relight_tests.rs"]
pub(crate) mod tests;
