//! Passes of one picture, recorded for the GPU, and their results.

use super::clock::Clock;
use super::lost::guarded;
use super::pictures::{GpuPicture, PicturePasses, WORKGROUP, extent};
use super::read::{image, read_back};
use super::shader::Shader;
use crate::pyramid::Rgba;
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use imaging::Image;
use scene::Pass;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Recorded passes, in order. The GPU starts when something is read ([`Self::read`], [`Self::pixel`] or
/// [`Self::finish`]) or shown ([`Self::show`]).
pub struct Recording<'a> {
    passes: &'a PicturePasses,
    commands: wgpu::CommandEncoder,
    clock: Option<Clock>,
    /// The shaders' count of repaired pixels.
    tally: wgpu::Buffer,
    pass: Pass,
}

/// Parameters of shaders that need the size and at most two more values.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct PlainParams {
    pub size: [u32; 2],
    pub values: [u32; 2],
}

/// Data read from a recording.
pub struct Readback {
    /// Requested pictures, without their fourth values.
    pub pictures: Vec<Image>,
    /// Number of subject pixels that were NaN or infinite.
    pub mended: usize,
    /// Milliseconds of every dispatch on the GPU's own clock, with its pass, in order; None without such a
    /// clock.
    pub times: Option<Vec<(Pass, f64)>>,
}

/// Data that a recording left on the GPU, to be read later or never.
#[derive(Debug)]
pub struct Unread {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pictures: Vec<GpuPicture>,
    tally: wgpu::Buffer,
    clock: Option<Clock>,
}

impl PicturePasses {
    /// Starts a picture.
    pub fn begin(&self) -> Recording<'_> {
        Recording::new(self)
    }
}

impl<'a> Recording<'a> {
    fn new(passes: &'a PicturePasses) -> Self {
        let (device, queue) = (&passes.device, &passes.queue);
        Self {
            passes,
            commands: device.create_command_encoder(&Default::default()),
            clock: Clock::new(device, queue),
            tally: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("tally"),
                size: 16,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            pass: Pass::Relight,
        }
    }

    pub(super) fn commands(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.commands
    }

    /// Passes of the recording's GPU.
    pub fn passes(&self) -> &'a PicturePasses {
        self.passes
    }

    /// Starts a pass: later dispatches belong to it.
    pub fn begin(&mut self, pass: Pass) {
        self.pass = pass;
    }

    /// Records one dispatch.
    pub(super) fn record<T>(&mut self, label: &str, encode: impl FnOnce(&mut wgpu::ComputePass) -> T) -> T {
        let timestamp_writes = self.clock.as_mut().and_then(|clock| clock.span(self.pass));
        let mut pass =
            self.commands.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes });
        encode(&mut pass)
    }

    /// A picture of `size` whose values are all 0.
    ///
    /// # Errors
    /// When the GPU cannot hold it.
    pub fn blank(&self, size: (usize, usize)) -> Result<GpuPicture> {
        self.passes.fits(size.0, size.1)?;
        // A new buffer holds zeros until something is written.
        let buffer = self.passes.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: 16 * (size.0 * size.1) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Ok(self.passes.adopt(size.0, size.1, buffer))
    }

    /// Records one shader over every pixel of a new picture of `size`. `params` has the layout of the shader's
    /// `Params`. Without a `second` picture the shader must not read it.
    pub(crate) fn run(
        &mut self,
        (shader, entry): (&Shader, &'static str),
        params: &[u8],
        first: &GpuPicture,
        second: Option<&GpuPicture>,
        size: (usize, usize),
    ) -> Result<GpuPicture> {
        let result = self.blank(size)?;
        let groups = [size.0, size.1].map(|n| (n as u32).div_ceil(WORKGROUP));
        let bound = [first, second.unwrap_or(first), &result].map(GpuPicture::binding);
        self.dispatch((shader, entry), params, bound, groups);
        Ok(result)
    }

    /// Records a shader that needs the size and at most two more values, over every pixel of the first picture. A
    /// second has the size of the first.
    pub(crate) fn plain(
        &mut self,
        shader: (&Shader, &'static str),
        values: [u32; 2],
        first: &GpuPicture,
        second: Option<&GpuPicture>,
    ) -> Result<GpuPicture> {
        let size = extent(first.size());
        let params = PlainParams { size, values };
        self.run(shader, bytes_of(&params), first, second, first.size())
    }

    /// Records one shader over so many workgroups; `bound` are its first input, its second input and its result.
    pub(super) fn dispatch(
        &mut self,
        (shader, entry): (&Shader, &'static str),
        params: &[u8],
        bound: [wgpu::BindingResource; 3],
        groups: [u32; 2],
    ) {
        let passes = self.passes;
        let pipeline = passes.pipeline(shader, entry);
        let params = passes.device.create_buffer_init(&BufferInitDescriptor {
            label: Some(entry),
            contents: params,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let own = [params.as_entire_binding(), self.tally.as_entire_binding()];
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(bound.into_iter().chain(own))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = passes.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(entry),
            layout: &passes.layout,
            entries: &entries,
        });
        self.record(entry, |pass| {
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        });
    }

    /// Runs the recording so far on the GPU, and reads pictures of it: small ones, on which decisions during the picture
    /// depend.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read<const N: usize>(&mut self, pictures: [&GpuPicture; N]) -> Result<[Rgba; N]> {
        let device = &self.passes.device;
        let next = device.create_command_encoder(&Default::default());
        let commands = std::mem::replace(&mut self.commands, next);
        let buffers = pictures.map(|picture| &picture.buffer);
        let target = (device, &self.passes.queue);
        read_back(target, commands, &buffers, |parts| {
            std::array::from_fn(|i| Rgba {
                width: pictures[i].width,
                height: pictures[i].height,
                pixels: bytemuck::pod_collect_to_vec(parts[i]),
            })
        })
    }

    /// Runs the recording so far on the GPU, and reads the values of one pixel of each picture, counted row by
    /// row.
    ///
    /// # Errors
    /// When the device fails.
    pub fn pixel(&mut self, pictures: &[GpuPicture], pixel: usize) -> Result<Vec<[f32; 4]>> {
        let device = &self.passes.device;
        let values = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pixel"),
            size: 16 * pictures.len() as u64,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let next = device.create_command_encoder(&Default::default());
        let mut commands = std::mem::replace(&mut self.commands, next);
        for (i, picture) in (0u64..).zip(pictures) {
            let from = 16 * pixel as u64;
            commands.copy_buffer_to_buffer(&picture.buffer, from, &values, 16 * i, 16);
        }
        let target = (device, &self.passes.queue);
        read_back(target, commands, &[&values], |parts| bytemuck::pod_collect_to_vec(parts[0]))
    }

    /// Runs the whole recording on the GPU, and reads `pictures`, counts and times,
    /// in one copy.
    ///
    /// # Errors
    /// When the device fails.
    pub fn finish(self, pictures: &[&GpuPicture]) -> Result<Readback> {
        let (commands, unread) = self.end(pictures);
        unread.read_after(commands)
    }

    /// All commands, and the data that they leave on the GPU.
    pub(super) fn end(mut self, pictures: &[&GpuPicture]) -> (wgpu::CommandEncoder, Unread) {
        if let Some(clock) = &self.clock {
            clock.resolve(&mut self.commands);
        }
        let unread = Unread {
            device: self.passes.device.clone(),
            queue: self.passes.queue.clone(),
            pictures: pictures.iter().map(|&picture| picture.clone()).collect(),
            tally: self.tally,
            clock: self.clock,
        };
        (self.commands, unread)
    }
}

impl Unread {
    /// Reads the pictures, counts and times in one copy.
    ///
    /// # Errors
    /// When the device fails; [`base::error::Error::GpuLost`] if it is lost.
    pub fn read(&self) -> Result<Readback> {
        guarded(&self.device, || self.read_after(self.device.create_command_encoder(&Default::default())))
    }

    fn read_after(&self, commands: wgpu::CommandEncoder) -> Result<Readback> {
        let mut sources: Vec<&wgpu::Buffer> = self.pictures.iter().map(|p| &p.buffer).collect();
        sources.push(&self.tally);
        sources.extend(self.clock.as_ref().map(Clock::resolved));
        read_back((&self.device, &self.queue), commands, &sources, |parts| {
            let (images, rest) = parts.split_at(self.pictures.len());
            Readback {
                pictures: self.pictures.iter().zip(images).map(|(p, bytes)| image(p.size(), bytes)).collect(),
                mended: bytemuck::pod_read_unaligned::<u32>(&rest[0][..4]) as usize,
                times: self.clock.as_ref().and_then(|clock| clock.times(rest[1])),
            }
        })
    }
}
