//! Afterlight relights filmed interviews after filming.
//!
//! A person was filmed in one flat light, and photographed in a few poses under each lamp of a light
//! stage, one lamp at a time. From these the library calibrates the lamps and the camera's response
//! ([`calibration`]), carries the photographs over to every frame of the interview ([`transfer`]), trains a
//! network that corrects them ([`training`], [`reflectance`]), sums those pictures under any environment ([`light`],
//! [`compositor`]) and writes the clip ([`export`]). `docs/architecture.md` is the map.

pub mod cli;

pub use base::{Error, Result, error, memory, progress, turn};
pub use worker::demo;
pub use {
    benchmark, calibration, check, color_config, compositor, confidence, evaluation, export, farm, footage, gpu,
    handover, imaging, light, matte, movies, person, project, reflectance, rivals, scene, studio, tradeoff, training,
    transfer, virtual_stage, worker,
};
