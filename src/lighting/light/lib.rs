//! Light from all directions: lat-long panoramas, environments, the lamp rig, and the weights that distribute an
//! environment's energy over the lamps.

pub mod aim;
pub mod brightest;
pub mod built_in;
pub mod conventions;
pub mod environment;
mod environment_weights;
mod group;
pub mod highlight;
pub mod keyframes;
pub mod latlong;
pub mod lighting;
pub mod mapping;
pub mod panorama;
mod patch;
pub mod placed;
pub mod rig;
pub mod subset;
pub mod weights;
pub mod white;
pub mod yaw_table;

pub use environment::Environment;
pub use environment_weights::EnvironmentWeights;
pub use group::LightGroup;
pub use lighting::Lighting;
pub use mapping::Mapping;
pub use placed::PlacedLight;
pub use rig::{Lamp, Rig};
pub use weights::LightWeights;
pub use yaw_table::YawTable;
