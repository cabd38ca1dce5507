//! The reflectance field and the network that predicts it. `docs/method.md` compares it with the
//! paper.

pub mod checkpoint;
pub mod compressed;
mod device_field;
mod eigen;
mod field;
pub mod half_field;
pub mod kernels;
pub mod predictor;
pub mod render;
mod resize;
mod unet;

pub use burn::tensor::Device;
pub use compressed::{CompressedField, LampBasis};
pub use device_field::{DeviceField, FieldBuffer, FieldFormat};
pub use field::ReflectanceField;
pub use half_field::HalfField;
pub use kernels::Precision;
pub use predictor::Predictor;
pub use unet::{Convolution, Cost, Formulation, Normalization, Statistics, UNet, UNetConfig};
