//! The reflectance field and the network that predicts it.

mod field;

pub use field::ReflectanceField;
