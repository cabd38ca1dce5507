//! A farm job from its files to the movie, as engines run it: workers are killed, files are damaged, the project
//! changes meanwhile, and the result equals that of a single export.

#[path = "farm/bad_input.rs"]
mod bad_input;
#[path = "farm/engines.rs"]
mod engines;
#[path = "farm/job.rs"]
mod job;
mod program;
#[path = "farm/scaling.rs"]
mod scaling;
#[path = "rates/simulation.rs"]
mod simulation;
#[path = "farm/training.rs"]
mod training;
