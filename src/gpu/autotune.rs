//! Where burn keeps which of its GPU kernels were the fastest for each shape. It times them against each other when
//! it first meets a shape, which takes seconds to minutes for a whole network; from the disk, a later run
//! knows at once.

use cubecl_runtime::config::cache::CacheConfig;
use cubecl_runtime::config::environment::EnvironmentConfig;
use cubecl_runtime::config::{CubeClRuntimeConfig, RuntimeConfig};
use std::path::PathBuf;

/// The person's own cache folder, or that of temporary files where there is none.
pub fn folder() -> PathBuf {
    let cache = dirs::cache_dir().unwrap_or_else(std::env::temp_dir);
    cache.join("afterlight").join("kernels")
}

/// Has burn keep its findings in [`folder`]. What it was told before, such as by a file `cubecl.toml` for an
/// experiment, stays. Has to come before anything computes on a GPU.
pub fn keep() {
    let config = CubeClRuntimeConfig {
        environment: EnvironmentConfig {
            path: CacheConfig::Directory(folder()),
            ..EnvironmentConfig::default()
        },
        ..CubeClRuntimeConfig::default()
    };
    let _ = CubeClRuntimeConfig::try_set(config.override_from_env());
}
