//! Cache of burn's autotuning: the fastest GPU kernel for each shape. burn times the kernels when it first meets a shape,
//! which takes seconds to minutes for a network; later runs read the result.

use cubecl_runtime::config::cache::CacheConfig;
use cubecl_runtime::config::environment::EnvironmentConfig;
use cubecl_runtime::config::{CubeClRuntimeConfig, RuntimeConfig};
use std::path::PathBuf;

/// Environment variable with another folder for the results, such as an empty one to time all kernels again.
pub const FOLDER: &str = "AFTERLIGHT_KERNELS";

/// In the user's cache folder, or in the folder for temporary files if there is none; [`FOLDER`] overrides it.
pub fn folder() -> PathBuf {
    if let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) {
        return folder.into();
    }
    let cache = dirs::cache_dir().unwrap_or_else(std::env::temp_dir);
    cache.join("afterlight").join("kernels")
}

/// Makes burn store its results in [`folder`]. An existing configuration, such as a file `cubecl.toml`, stays unchanged.
/// Call it before any computation on a GPU.
pub fn keep() {
    let config = CubeClRuntimeConfig {
        environment: EnvironmentConfig { path: CacheConfig::Directory(folder()), ..EnvironmentConfig::default() },
        ..CubeClRuntimeConfig::default()
    };
    let _ = CubeClRuntimeConfig::try_set(config.override_from_env());
}
