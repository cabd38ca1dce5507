//! Parts of several panels.

pub mod ago;
pub mod diamond;
pub mod fit;
pub mod frame;
pub mod group;
pub mod lamp_title;
pub mod missing;
pub mod names;
pub mod notice;
pub mod numbers;
pub mod rows;
pub mod sphere;
pub mod still_plot;
