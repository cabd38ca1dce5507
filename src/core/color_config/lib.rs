//! The user's OpenColorIO configuration: its displays, views, looks and colour spaces, and transforms of our
//! light to them.
//!
//! The program works in linear Rec. 709. Without a configuration none of this is used.

mod choice;
mod config;
mod names;
#[cfg(test)]
mod tests;
mod transform;
mod vetted;
mod working;

pub use choice::ColorChoice;
pub use config::ColorConfig;
pub use names::{ConfigNames, DisplayNames, Role, SpaceName};
pub use transform::{Target, Transform};

/// Environment variable for the configuration shared by all programs of a studio.
pub const VARIABLE: &str = "OCIO";
