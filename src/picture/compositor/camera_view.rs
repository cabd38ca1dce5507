//! View of the camera into the environment.

use serde::{Deserialize, Serialize};

/// Camera's view of the environment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraView {
    /// Vertical field of view in degrees, above 0 and below 180. It need not match the interview's:
    /// that is shot from afar through a long lens (about 6°), which would show a few texels of a
    /// panorama, while a lens of about 40° shows a place.
    pub vertical_fov_deg: f32,
}

impl Default for CameraView {
    fn default() -> Self {
        Self { vertical_fov_deg: 40.0 }
    }
}
