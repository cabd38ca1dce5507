//! A farm job from its files to the movie, as engines run it: workers are killed, files are damaged, the project
//! changes meanwhile, and the result equals that of a single export.

mod bad_input;
mod engines;
mod job;
#[path = "../program/mod.rs"]
mod program;
mod scaling;
#[path = "../rates/simulation.rs"]
mod simulation;
mod training;
