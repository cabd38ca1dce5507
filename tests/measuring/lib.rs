//! Helpers of the measuring programs: the measured program, figures and plots.

mod figures;
mod plot;
mod program;

pub use figures::{cell, decibels};
pub use plot::{Axis, Plot, Scale};
pub use program::{Program, file_name, finish, named_folder, printed};
