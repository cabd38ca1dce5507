//! From a buffer of the GPU to memory.

use crate::error::{Error, Result};

/// Copies a buffer of RGBA f32 and waits for it.
pub(super) fn read_back(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &wgpu::Buffer,
) -> Result<Vec<[f32; 4]>> {
    let fail = |cause: String| {
        Error::unexpected(
            "the GPU",
            "the relit picture",
            cause,
            "Relight on the CPU with --device cpu",
        )
    };
    let there = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture, to read"),
        size: picture.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    commands.copy_buffer_to_buffer(picture, 0, &there, 0, picture.size());
    queue.submit([commands.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    // The receiver outlives the poll below, so the message always arrives.
    there
        .slice(..)
        .map_async(wgpu::MapMode::Read, move |mapped| drop(sender.send(mapped)));
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| fail(e.to_string()))?;
    receiver
        .recv()
        .map_err(|e| fail(e.to_string()))?
        .map_err(|e| fail(e.to_string()))?;
    let view = there
        .slice(..)
        .get_mapped_range()
        .map_err(|e| fail(e.to_string()))?;
    let values: &[[f32; 4]] = bytemuck::try_cast_slice(&view).map_err(|e| fail(e.to_string()))?;
    Ok(values.to_vec())
}
