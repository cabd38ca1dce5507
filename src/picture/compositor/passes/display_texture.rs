//! A finished picture as a texture, which a window on the same GPU draws without a copy through memory.

use super::pictures::{GpuPicture, PicturePasses, WORKGROUP, extent};
use super::recording::{PlainParams, Recording, Unread};
use super::shader::Shader;
use base::error::{Error, Result};
use bytemuck::bytes_of;

pub(super) const DISPLAY_TEXTURE: Shader =
    Shader::alone("display_texture", include_str!("../../../../shaders/display_texture.wgsl"));

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Codes of a picture on a GPU: `Rgba8Unorm`, opaque, in the size of the picture.
#[derive(Clone, Debug)]
pub struct DisplayTexture {
    texture: wgpu::Texture,
    device: wgpu::Device,
}

impl DisplayTexture {
    /// True if this device can draw it.
    pub fn is_on(&self, device: &wgpu::Device) -> bool {
        self.device == *device
    }

    /// Texture view that the window binds.
    pub fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&Default::default())
    }
}

impl PicturePasses {
    /// True if this GPU has textures of `size`.
    pub(crate) fn has_texture(&self, (width, height): (usize, usize)) -> bool {
        width.max(height) <= self.device.limits().max_texture_dimension_2d as usize
    }
}

impl Recording<'_> {
    /// Runs the whole recording on the GPU, makes a texture of `codes`, and waits. Nothing is read: `pictures`
    /// can be read later.
    ///
    /// # Errors
    /// When the device fails, or has no texture of that size.
    pub fn show(mut self, codes: &GpuPicture, pictures: &[&GpuPicture]) -> Result<(DisplayTexture, Unread)> {
        let texture = self.display_texture(codes)?;
        let passes = self.passes();
        let (commands, unread) = self.end(pictures);
        let submission = passes.queue.submit([commands.finish()]);
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        passes.device.poll(wait).map_err(|e| {
            Error::device(
                format!("the GPU did not finish the relit picture: {e}"),
                ("Relight on the CPU", "--device cpu"),
            )
        })?;
        Ok((texture, unread))
    }

    /// Records a texture of display codes.
    fn display_texture(&mut self, codes: &GpuPicture) -> Result<DisplayTexture> {
        let passes = self.passes();
        if !passes.has_texture(codes.size()) {
            let (width, height) = codes.size();
            return Err(Error::device(
                format!("this GPU has no texture of {width} × {height} pixels"),
                "Make the picture on the CPU, or choose a smaller working size",
            ));
        }
        let [width, height] = extent(codes.size());
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = passes.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display texture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let params = PlainParams { size: [width, height], values: [row / 4, 0] };
        let bound = [codes.binding(), codes.binding(), bytes.as_entire_binding()];
        let groups = [width, height].map(|n| n.div_ceil(WORKGROUP));
        let shader = (&DISPLAY_TEXTURE, "display_texture");
        self.dispatch(shader, bytes_of(&params), bound, groups);
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let texture = passes.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("relit picture"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        self.commands().copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo { buffer: &bytes, layout },
            texture.as_image_copy(),
            size,
        );
        Ok(DisplayTexture { texture, device: passes.device.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::read::read_back;
    use super::super::relight::tests::any_device;
    use super::*;
    use imaging::Image;
    use imaging::color::byte_from_unit;

    /// Bytes of the texture, four per pixel.
    fn bytes_of_texture(passes: &PicturePasses, shown: &DisplayTexture) -> Vec<u8> {
        let size = shown.texture.size();
        let row = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = passes.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut commands = passes.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        commands.copy_texture_to_buffer(shown.texture.as_image_copy(), target, size);
        let target = (&passes.device, &passes.queue);
        read_back(target, commands, &[&buffer], |parts| {
            let rows = parts[0].chunks_exact(row as usize);
            rows.flat_map(|row| &row[..4 * size.width as usize]).copied().collect()
        })
        .unwrap()
    }

    #[test]
    fn a_texture_has_the_bytes_that_the_codes_have_in_memory() {
        let Some((device, queue)) = any_device() else { return };
        let passes = PicturePasses::new(&device, &queue);
        // Neither side is a multiple of a workgroup or of a row of the copy.
        let codes = Image::from_fn(67, 5, |x, y| {
            let at = (67 * y + x) as f32 / 255.0;
            [at - 0.1, (at + 0.3 / 255.0) % 1.0, 1.2 - at]
        });
        let there = passes.upload_opaque(&codes).unwrap();
        let (shown, unread) = passes.begin().show(&there, &[&there]).unwrap();
        assert!(shown.is_on(&device));
        let read = unread.read().unwrap();
        assert_eq!(read.pictures[0], codes);
        let wanted: Vec<u8> = (codes.pixels.iter()).flat_map(|p| [p[0], p[1], p[2], 1.0].map(byte_from_unit)).collect();
        let distinct: std::collections::HashSet<_> = wanted.iter().collect();
        assert!(distinct.len() > 200);
        assert_eq!(bytes_of_texture(&passes, &shown), wanted);
    }

    #[test]
    fn a_picture_larger_than_any_texture_is_refused() {
        let Some((device, queue)) = any_device() else { return };
        let passes = PicturePasses::new(&device, &queue);
        let most = device.limits().max_texture_dimension_2d as usize;
        assert!(passes.has_texture((most, 1)) && !passes.has_texture((1, most + 1)));
        let long =
            GpuPicture { width: most + 1, height: 1, ..passes.upload_opaque(&Image::filled(1, 1, [0.0; 3])).unwrap() };
        let said = passes.begin().show(&long, &[]).unwrap_err();
        assert!(said.to_string().contains("no texture of"), "{said}");
    }
}
