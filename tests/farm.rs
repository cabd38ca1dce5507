//! A farm's job from its writing to the movie, as engines run it: workers are killed, files are damaged, the project changes
//! meanwhile, and what comes out is what a single export writes.

#[path = "farm/bad_input.rs"]
mod bad_input;
#[path = "farm/engines.rs"]
mod engines;
#[path = "farm/job.rs"]
mod job;
mod program;
#[path = "farm/scaling.rs"]
mod scaling;
#[path = "farm/training.rs"]
mod training;
