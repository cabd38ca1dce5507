//! Which settings can have keyframes.

/// A setting that can change over the clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Keyframed {
    Yaw,
    Intensity,
}

impl Keyframed {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Yaw, Self::Intensity];

    /// Its name in the window.
    pub fn name(self) -> &'static str {
        match self {
            Self::Yaw => "Yaw",
            Self::Intensity => "Intensity",
        }
    }
}
