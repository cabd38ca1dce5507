//! Footage: exemplars and interview frames as linear pictures at the working size, and the import
//! that finds them.

mod exemplar;
mod frame;
mod framed;
mod framing;
mod import;
pub mod scan;
mod shoot;

pub use exemplar::Exemplar;
pub use frame::Frame;
pub use framed::{read_encoded, read_linear, read_mask};
pub use framing::{FrameReport, FrameSettings, Square};
pub use import::{ImportSettings, import};
