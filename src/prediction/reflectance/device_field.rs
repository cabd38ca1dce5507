//! A reflectance field on the network's device, with or without a copy to memory.

use super::compressed::CompressedField;
use super::field::ReflectanceField;
use super::half_field::HalfField;
use super::render::{relight, tensor_from_image, tensor_from_mask, tensor_from_weights};
use base::error::{Error, Result};
use burn::tensor::{Device, Tensor, TensorData};
use burn_cubecl::cubecl::wgpu::{AutoCompiler, WgpuResource, WgpuServer};
use burn_cubecl::kernel::into_contiguous;
use burn_cubecl::{Cube, CubeBackend};
use cubecl_runtime::storage::ManagedResource;
use imaging::{Image, Mask};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Largest factor of [`DeviceField::summing_to`] on a pixel.
const MOST_SCALE: f32 = 8.0;

/// A predicted field on the network's device: `[lamps, 3, height, width]`.
pub struct DeviceField {
    olats: Tensor<4>,
}

/// A field in a buffer of the GPU that network and passes share.
#[derive(Debug)]
pub struct FieldBuffer {
    pub width: usize,
    pub height: usize,
    /// Number of lamps.
    pub lamps: usize,
    format: FieldFormat,
    buffer: Buffer,
}

/// Storage of a field in its buffer.
#[derive(Debug)]
pub enum FieldFormat {
    /// In f32, in the layout of [`ReflectanceField::values`].
    Full,
    /// In the layout of [`HalfField::values`], two per word.
    Half {
        /// Two words: the bits from which the GPU chose the scale, and [`HalfField::scale`].
        scale: wgpu::Buffer,
    },
    /// In the layout of [`CompressedField::planes`].
    Components {
        /// [`CompressedField::basis`].
        basis: Vec<Vec<f32>>,
    },
}

#[derive(Debug)]
enum Buffer {
    /// The network's own buffer, held so that it is not reused.
    Predicted(ManagedResource<WgpuResource>),
    Own(wgpu::Buffer),
}

impl DeviceField {
    /// A field from linear OLATs `[lamps, 3, h, w]` in f32, once the device has computed them.
    pub(super) fn finished(olats: Tensor<4>) -> Result<Self> {
        olats.device().sync().map_err(|e| device_failure(&e))?;
        Ok(Self { olats })
    }

    /// Copies a field to the network's device.
    ///
    /// # Errors
    /// When the device fails.
    pub fn upload(field: &ReflectanceField, device: &Device) -> Result<Self> {
        Self::finished(tensor(field, device))
    }

    /// Blend of this field, with the weight `share` from 0 to 1 per pixel, and another of its size, with the
    /// rest: the square of the mean of roots.
    ///
    /// # Errors
    /// When the device fails.
    pub fn mixed(self, other: &ReflectanceField, share: &Mask) -> Result<Self> {
        let device = self.olats.device();
        let share = tensor_from_mask(share, &device);
        let root = |olats: Tensor<4>| olats.clamp_min(0.0).sqrt();
        let (own, other) = (root(self.olats), root(tensor(other, &device)));
        Self::finished((other.clone() + (own - other) * share).square())
    }

    /// The field scaled per pixel such that its sum under `weights` is `plate`. The factors are at most 8.
    ///
    /// # Errors
    /// When the device fails.
    pub fn summing_to(self, plate: &Image, weights: &[[f32; 3]]) -> Result<Self> {
        let device = self.olats.device();
        let plate = tensor_from_image(plate, &device).clamp_min(0.0);
        let sum = relight(self.olats.clone(), &tensor_from_weights(weights, &device));
        let scale = (plate / sum.clamp_min(f32::MIN_POSITIVE)).clamp_max(MOST_SCALE);
        Self::finished(self.olats * scale)
    }

    /// Copies the field to memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read(self) -> Result<ReflectanceField> {
        let [lamps, _, height, width] = self.olats.dims();
        let data = self.olats.try_into_data().map_err(|e| device_failure(&e))?;
        Ok(ReflectanceField { width, height, lamps, values: data.try_into_vec().map_err(|e| device_failure(&e))? })
    }

    /// The field in a buffer of `gpu`. If that is the network's own device, this is the network's buffer without a copy;
    /// otherwise a copy through memory. Work submitted to the GPU from now on sees the field.
    ///
    /// # Errors
    /// When the device fails.
    pub fn into_buffer(self, gpu: &wgpu::Device) -> Result<FieldBuffer> {
        if self.olats.device() == Device::flex() {
            return Ok(FieldBuffer::upload(&self.read()?, gpu));
        }
        let [lamps, _, height, width] = self.olats.dims();
        let fused = self.olats.try_into_primitive::<Cube>().map_err(|e| device_failure(&e))?;
        let client = fused.client.clone();
        let tensor = into_contiguous(client.resolve_tensor_float::<CubeBackend>(fused));
        let resource = tensor
            .client
            .get_resource::<WgpuServer<AutoCompiler>>(tensor.handle.clone())
            .map_err(|e| device_failure(&e))?;
        tensor.client.flush().map_err(|e| device_failure(&e))?;
        Ok(FieldBuffer { width, height, lamps, format: FieldFormat::Full, buffer: Buffer::Predicted(resource) })
    }
}

impl FieldBuffer {
    /// Copies a field, which must not be empty, to a GPU.
    pub fn upload(field: &ReflectanceField, device: &wgpu::Device) -> Self {
        Self {
            width: field.width,
            height: field.height,
            lamps: field.lamps,
            format: FieldFormat::Full,
            buffer: Buffer::Own(stored(bytemuck::cast_slice(&field.values), device)),
        }
    }

    /// [`Self::upload`] for a field in f16.
    pub fn upload_half(field: &HalfField, device: &wgpu::Device) -> Self {
        let scale = [0, field.scale().to_bits()];
        Self {
            width: field.width,
            height: field.height,
            lamps: field.lamps,
            format: FieldFormat::Half { scale: stored(bytemuck::cast_slice(&scale), device) },
            buffer: Buffer::Own(stored(bytemuck::cast_slice(field.values()), device)),
        }
    }

    /// [`Self::upload`] for principal components; there may be none.
    pub fn upload_components(field: CompressedField, device: &wgpu::Device) -> Self {
        // No buffer may be empty.
        let planes = if field.planes.is_empty() { &[0.0] } else { &field.planes[..] };
        Self {
            width: field.width,
            height: field.height,
            lamps: field.lamps,
            buffer: Buffer::Own(stored(bytemuck::cast_slice(planes), device)),
            format: FieldFormat::Components { basis: field.basis },
        }
    }

    /// The same field in f16, in buffers that a pass writes.
    pub fn halved(&self, values: wgpu::Buffer, scale: wgpu::Buffer) -> Self {
        Self {
            width: self.width,
            height: self.height,
            lamps: self.lamps,
            format: FieldFormat::Half { scale },
            buffer: Buffer::Own(values),
        }
    }

    /// Layout of the field in its buffer.
    pub fn format(&self) -> &FieldFormat {
        &self.format
    }

    /// Bytes of the OLATs in the GPU's memory.
    pub fn bytes(&self) -> usize {
        let pixels = self.width * self.height;
        match &self.format {
            FieldFormat::Full => size_of::<f32>() * 3 * self.lamps * pixels,
            FieldFormat::Half { .. } => HalfField::bytes(pixels, self.lamps),
            FieldFormat::Components { basis } => size_of::<f32>() * basis.len() * pixels,
        }
    }

    /// Binding for a compute pass.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.buffer {
            Buffer::Predicted(resource) => resource.resource().as_wgpu_bind_resource(),
            Buffer::Own(buffer) => buffer.as_entire_binding(),
        }
    }
}

fn tensor(field: &ReflectanceField, device: &Device) -> Tensor<4> {
    let shape = [field.lamps, 3, field.height, field.width];
    Tensor::from_data(TensorData::new(field.values.clone(), shape), device)
}

fn stored(contents: &[u8], device: &wgpu::Device) -> wgpu::Buffer {
    device.create_buffer_init(&BufferInitDescriptor {
        label: Some("reflectance field"),
        contents,
        usage: wgpu::BufferUsages::STORAGE,
    })
}

fn device_failure(cause: &dyn std::fmt::Debug) -> Error {
    Error::device(
        format!("the device did not return the prediction: {cause:?}"),
        ("Try again on the CPU", "--device cpu"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_mixed_by_roots_and_each_pixel_s_share() {
        let field = |lit: [f32; 3]| ReflectanceField { width: 3, height: 1, lamps: 1, values: [lit; 3].concat() };
        let share = Mask { width: 3, height: 1, pixels: vec![0.0, 1.0, 0.25] };
        let own = DeviceField::upload(&field([9.0, -1.0, 1.0]), &Device::flex()).unwrap();
        let mixed = own.mixed(&field([4.0, 4.0, 9.0]), &share).unwrap();
        // The last: (0.25·√1 + 0.75·√9)².
        let expected = [[4.0, 0.0, 6.25]; 3].concat();
        for (found, expected) in mixed.read().unwrap().values.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
    }

    #[test]
    fn fields_are_scaled_to_the_plate_by_at_most_eight() {
        // Two lamps and three pixels: sums of 3 and of a hundredth of it, and no light.
        let planes = [[1.0, 0.01, 0.0], [2.0, 0.02, 0.0]].map(|plane: [f32; 3]| [plane; 3].concat());
        let field = ReflectanceField { width: 3, height: 1, lamps: 2, values: planes.concat() };
        let own = DeviceField::upload(&field, &Device::flex()).unwrap();
        let plate = Image::filled(3, 1, [6.0, 3.0, -1.0]);
        let scaled = own.summing_to(&plate, &[[1.0; 3]; 2]).unwrap().read().unwrap();
        let sum = |c: usize| [0, 1, 2].map(|p| scaled.plane(0, c)[p] + scaled.plane(1, c)[p]);
        for (c, expected) in [[6.0, 0.24, 0.0], [3.0, 0.24, 0.0], [0.0; 3]].into_iter().enumerate() {
            for (found, expected) in sum(c).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-5, "{c}: {found} is not {expected}");
            }
        }
    }
}
