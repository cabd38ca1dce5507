//! Store of the GPU kernels that burn found the fastest for each shape. burn times them when it first meets a shape,
//! which takes seconds to minutes for a whole network; later runs read the result.

use cubecl_runtime::config::cache::CacheConfig;
use cubecl_runtime::config::environment::EnvironmentConfig;
use cubecl_runtime::config::{CubeClRuntimeConfig, RuntimeConfig};
use std::path::PathBuf;

/// The variable that names another folder to store the results in, such as an empty one to time them all again.
pub const FOLDER: &str = "AFTERLIGHT_KERNELS";

/// In the person's cache folder, or that of temporary files if there is none; or as [`FOLDER`] says.
pub fn folder() -> PathBuf {
    if let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) {
        return folder.into();
    }
    let cache = dirs::cache_dir().unwrap_or_else(std::env::temp_dir);
    cache.join("afterlight").join("kernels")
}

/// Has burn store its results in [`folder`]. A configuration that is there, such as a file `cubecl.toml`, is left as it
/// is. Call it before anything computes on a GPU.
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
