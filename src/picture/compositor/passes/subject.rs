//! Subject on the GPU: the sum of lamps, repaired, edge-extended and cut out by its matte.

use super::pictures::{GpuPicture, PicturePasses, extent};
use super::recording::Recording;
use super::shader::Shader;
use crate::edges::{SOLID, rings};
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use imaging::{Image, Mask};
use reflectance::FieldBuffer;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

pub(crate) const EDGES: Shader = Shader::new("edges", include_str!("../../../../shaders/edges.wgsl"));

/// A frame's matte on the GPU.
#[derive(Clone, Debug)]
pub struct GpuMatte {
    /// Black, with the matte as its fourth value.
    pub picture: GpuPicture,
    /// Order in which its partly covered pixels take the colour of solid ones, in the layout of the shader
    /// `edges`.
    rings: wgpu::Buffer,
    ring_count: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct EdgeParams {
    size: [u32; 2],
    rings: u32,
    solid: f32,
}

impl PicturePasses {
    /// Copies a matte to the GPU, with the order of its edge extension.
    ///
    /// # Errors
    /// When the matte is empty or exceeds the GPU's binding size.
    pub fn upload_matte(&self, mask: &Mask) -> Result<GpuMatte> {
        let black = Image::filled(mask.width, mask.height, [0.0; 3]);
        let picture = self.upload(&black, mask)?;
        let solid = mask.pixels.iter().map(|&a| a >= SOLID).collect();
        let rings = rings(solid, mask);
        let mut words = vec![u32::MAX; mask.pixels.len()];
        let solid = words.iter_mut().zip(&mask.pixels);
        solid.filter(|(_, a)| **a >= SOLID).for_each(|(word, _)| *word = 0);
        for (ring, pixels) in (1..).zip(&rings) {
            pixels.iter().for_each(|&pixel| words[pixel] = ring);
        }
        let mut end = 0;
        words.extend(rings.iter().map(|ring| {
            end += ring.len() as u32;
            end
        }));
        words.extend(rings.iter().flatten().map(|&pixel| pixel as u32));
        Ok(GpuMatte {
            picture,
            rings: self.device.create_buffer_init(&BufferInitDescriptor {
                label: Some("rings"),
                contents: bytemuck::cast_slice(&words),
                usage: wgpu::BufferUsages::STORAGE,
            }),
            ring_count: rings.len() as u32,
        })
    }
}

impl Recording<'_> {
    /// Light of one pixel, counted row by row, under each lamp at full power. Nothing else is read.
    ///
    /// # Errors
    /// As [`Self::sum`], or when the device fails.
    pub fn texel(&mut self, field: &FieldBuffer, pixel: usize) -> Result<Vec<[f32; 3]>> {
        let alone = |lamp: usize| {
            let mut weights = vec![[0.0; 3]; field.lamps];
            weights[lamp] = [1.0; 3];
            weights
        };
        // A sum of one lamp is the content of the field, in any format.
        let lamps = (0..field.lamps).map(|lamp| self.sum(field, &alone(lamp)));
        let lamps: Vec<GpuPicture> = lamps.collect::<Result<_>>()?;
        let values = self.pixel(&lamps, pixel)?;
        Ok(values.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
    }

    /// The raw sum of a field's lamps: NaN and infinite values stay.
    ///
    /// # Errors
    /// When field and weights do not match, the field exceeds the device's binding size, or memory runs out.
    pub fn sum(&mut self, field: &FieldBuffer, weights: &[[f32; 3]]) -> Result<GpuPicture> {
        let passes = self.passes();
        passes.relight.check_binds(field, weights)?;
        let relit = self.record("relight", |pass| passes.relight.encode(pass, field, weights))?;
        Ok(passes.adopt(field.width, field.height, relit))
    }

    /// Pass `relight`: the subject of a frame under its lamps, premultiplied, with its matte as the fourth
    /// value. Repaired pixels are counted.
    ///
    /// # Errors
    /// As [`Self::sum`].
    pub fn relight(&mut self, field: &FieldBuffer, weights: &[[f32; 3]], matte: &GpuMatte) -> Result<GpuPicture> {
        let sum = self.sum(field, weights)?;
        self.cut_out(&sum, matte)
    }

    /// Repairs a sum of lamps, extends the colour of the solid subject over its edge and cuts it out, like
    /// [`crate::reference::extend_edges`]. In a hole of NaN or infinite pixels wider than one pixel, each pixel takes
    /// the mean of the nearest finite ones, instead of ring by ring.
    ///
    /// # Errors
    /// When memory on the device runs out.
    pub fn cut_out(&mut self, sum: &GpuPicture, matte: &GpuMatte) -> Result<GpuPicture> {
        let params = EdgeParams { size: extent(sum.size()), rings: matte.ring_count, solid: SOLID };
        let (params, second) = (bytes_of(&params), &matte.picture);
        let mended = self.run((&EDGES, "mend"), params, sum, Some(second), sum.size())?;
        if matte.ring_count > 0 {
            let rings = matte.rings.as_entire_binding();
            let bound = [rings, second.binding(), mended.binding()];
            self.dispatch((&EDGES, "extend"), params, bound, [1, 1]);
        }
        self.run((&EDGES, "cut"), params, &mended, Some(second), sum.size())
    }
}
