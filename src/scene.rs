//! A scene: everything one picture asks for, as plain data.

use serde::{Deserialize, Serialize};

/// What one relit picture asks for, apart from the pixels themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Interview frame, from 0.
    pub frame: usize,
    /// Yaw of the environment in degrees; positive moves its content to camera-right in front.
    pub yaw_deg: f32,
    /// Exposure of the picture in stops.
    pub exposure_stops: f32,
    /// What is behind the subject.
    pub background: Background,
    /// What becomes of the picture.
    pub output: Output,
}

/// What is behind the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Background {
    /// The environment, as the interview's camera would see it.
    Environment,
    /// Nothing: black, and zero alpha where the output has alpha.
    None,
}

/// What becomes of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Output {
    /// 8 bits, sRGB-encoded: a window, a PNG, a movie.
    Display,
    /// Scene-linear light: an EXR.
    Linear,
}
