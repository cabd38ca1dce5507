//! Footage: exemplars and interview frames as linear pictures at the working size, and the import
//! that finds them.

mod exemplar;
mod frame;
mod import;

pub use exemplar::Exemplar;
pub use frame::Frame;
pub use import::{ImportSettings, import};
