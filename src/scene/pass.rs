//! The passes by name, in the order in which they run.

use serde::{Deserialize, Serialize};

/// One effect of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pass {
    /// The network predicts the frame's reflectance field.
    Predict,
    /// The field's brightness is held steady from frame to frame.
    Smoothing,
    /// The environment's energy is given to the lamps.
    Weights,
    /// The lamps' pictures are summed, and the subject is cut out.
    Relight,
    /// A screen's colour is taken out of the subject's rim.
    Despill,
    /// The environment is drawn behind the subject.
    Background,
    /// The background is put out of focus.
    BackgroundBlur,
    /// Light from behind reaches around the rim, and the subject is laid over what is behind it.
    LightWrap,
    /// The lens scatters light that is brighter than white.
    Glare,
    /// Everything is made brighter or darker.
    Exposure,
    /// Linear light is encoded for a display.
    View,
    /// The picture gets the plate's grain.
    Grain,
    /// A pattern below one code keeps smooth gradients from showing steps.
    Dither,
    /// One channel is shown in grey.
    Channels,
    /// The difference to a second picture is shown.
    Difference,
    /// Zones of exposure are shown in flat colours.
    FalseColor,
}

impl Pass {
    /// Every pass, in order.
    pub const ALL: [Self; 16] = [
        Self::Predict,
        Self::Smoothing,
        Self::Weights,
        Self::Relight,
        Self::Despill,
        Self::Background,
        Self::BackgroundBlur,
        Self::LightWrap,
        Self::Glare,
        Self::Exposure,
        Self::View,
        Self::Grain,
        Self::Dither,
        Self::Channels,
        Self::Difference,
        Self::FalseColor,
    ];

    /// The name that finds this pass everywhere: in reports, files and shaders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Predict => "predict",
            Self::Smoothing => "smoothing",
            Self::Weights => "weights",
            Self::Relight => "relight",
            Self::Despill => "despill",
            Self::Background => "background",
            Self::BackgroundBlur => "background_blur",
            Self::LightWrap => "light_wrap",
            Self::Glare => "glare",
            Self::Exposure => "exposure",
            Self::View => "view",
            Self::Grain => "grain",
            Self::Dither => "dither",
            Self::Channels => "channels",
            Self::Difference => "difference",
            Self::FalseColor => "false_color",
        }
    }
}
