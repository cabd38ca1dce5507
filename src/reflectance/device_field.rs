//! A reflectance field where the network left it: on its device, with or without a copy to memory.

use super::field::ReflectanceField;
use crate::error::{Error, Result};
use burn::tensor::Tensor;
use burn_cubecl::cubecl::wgpu::{AutoCompiler, WgpuResource, WgpuServer};
use burn_cubecl::kernel::into_contiguous;
use burn_cubecl::{Cube, CubeBackend};
use cubecl_runtime::storage::ManagedResource;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// A predicted field on the network's device: `[lamps, 3, height, width]`.
pub struct DeviceField {
    olats: Tensor<4>,
}

/// A field in a buffer of the GPU that network and passes share, as f32 in the layout of
/// [`ReflectanceField::values`].
#[derive(Debug)]
pub struct FieldBuffer {
    pub width: usize,
    pub height: usize,
    /// Number of lamps.
    pub lamps: usize,
    place: Place,
}

#[derive(Debug)]
enum Place {
    /// The network's own buffer, kept from being used anew.
    Predicted(ManagedResource<WgpuResource>),
    Uploaded(wgpu::Buffer),
}

impl DeviceField {
    /// A field of linear OLATs `[lamps, 3, h, w]` in f32, once the device has computed them.
    pub(super) fn finished(olats: Tensor<4>) -> Result<Self> {
        olats.device().sync().map_err(|e| device_failure(&e))?;
        Ok(Self { olats })
    }

    /// Copies the field to memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn read(self) -> Result<ReflectanceField> {
        let [lamps, _, height, width] = self.olats.dims();
        let data = self.olats.try_into_data().map_err(|e| device_failure(&e))?;
        Ok(ReflectanceField {
            width,
            height,
            lamps,
            values: data.try_into_vec().map_err(|e| device_failure(&e))?,
        })
    }

    /// The field's own buffer, without a copy. What is submitted to the GPU from now on sees the field.
    ///
    /// # Errors
    /// When the network is not on a GPU, or that fails.
    pub fn into_buffer(self) -> Result<FieldBuffer> {
        let [lamps, _, height, width] = self.olats.dims();
        let fused = self
            .olats
            .try_into_primitive::<Cube>()
            .map_err(|e| device_failure(&e))?;
        let client = fused.client.clone();
        let tensor = into_contiguous(client.resolve_tensor_float::<CubeBackend>(fused));
        let resource = tensor
            .client
            .get_resource::<WgpuServer<AutoCompiler>>(tensor.handle.clone())
            .map_err(|e| device_failure(&e))?;
        tensor.client.flush().map_err(|e| device_failure(&e))?;
        Ok(FieldBuffer {
            width,
            height,
            lamps,
            place: Place::Predicted(resource),
        })
    }
}

impl FieldBuffer {
    /// Copies a field, which may not be empty, to a GPU.
    pub fn upload(field: &ReflectanceField, device: &wgpu::Device) -> Self {
        let buffer = device.create_buffer_init(&BufferInitDescriptor {
            label: Some("reflectance field"),
            contents: bytemuck::cast_slice(&field.values),
            usage: wgpu::BufferUsages::STORAGE,
        });
        Self {
            width: field.width,
            height: field.height,
            lamps: field.lamps,
            place: Place::Uploaded(buffer),
        }
    }

    /// What a compute pass binds.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.place {
            Place::Predicted(resource) => resource.resource().as_wgpu_bind_resource(),
            Place::Uploaded(buffer) => buffer.as_entire_binding(),
        }
    }
}

fn device_failure(cause: &dyn std::fmt::Debug) -> Error {
    Error::unexpected(
        "the prediction",
        "values from the device",
        format!("{cause:?}"),
        "Try again with --device cpu",
    )
}
