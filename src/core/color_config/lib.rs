//! A person's OpenColorIO configuration: which displays, views, looks and colour spaces it has, and what they make of our light.
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

/// The variable that names a configuration for all programs of a studio.
pub const VARIABLE: &str = "OCIO";
