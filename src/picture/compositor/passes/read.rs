//! From buffers of the GPU to memory.

use base::error::{Error, Result};
use imaging::Image;
use rayon::prelude::*;

/// Submits `commands`, waits for the GPU and passes the bytes of `sources` to `take`. All go through one
/// buffer that is mapped once.
pub(super) fn read_back<T>(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    mut commands: wgpu::CommandEncoder,
    sources: &[&wgpu::Buffer],
    take: impl FnOnce(&[&[u8]]) -> T,
) -> Result<T> {
    let fail = |cause: String| {
        Error::device(
            format!("the GPU did not return the relit picture: {cause}"),
            ("Relight on the CPU", "--device cpu"),
        )
    };
    let there = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("to read"),
        size: sources.iter().map(|source| source.size()).sum(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut end = 0;
    for source in sources {
        commands.copy_buffer_to_buffer(source, 0, &there, end, source.size());
        end += source.size();
    }
    queue.submit([commands.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    // The receiver outlives the poll below, so the message always arrives.
    there.slice(..).map_async(wgpu::MapMode::Read, move |mapped| drop(sender.send(mapped)));
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| fail(e.to_string()))?;
    receiver.recv().map_err(|e| fail(e.to_string()))?.map_err(|e| fail(e.to_string()))?;
    let view = there.slice(..).get_mapped_range().map_err(|e| fail(e.to_string()))?;
    let mut rest = &view[..];
    let parts: Vec<&[u8]> = sources
        .iter()
        .map(|source| {
            let (part, after) = rest.split_at(source.size() as usize);
            rest = after;
            part
        })
        .collect();
    Ok(take(&parts))
}

/// Light of RGBA f32.
pub(super) fn image((width, height): (usize, usize), rgba: &[u8]) -> Image {
    let pixels = rgba.as_chunks::<16>().0.par_iter().with_min_len(4096);
    let light = |pixel: &[u8; 16]| {
        let [r, g, b, _] = bytemuck::pod_read_unaligned::<[f32; 4]>(pixel);
        [r, g, b]
    };
    Image { width, height, pixels: pixels.map(light).collect() }
}
