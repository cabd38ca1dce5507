//! Frames of the interview, and their playback.

/// The interview's frames, and their playback.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    /// Number of frames in the interview.
    pub frames: usize,
    /// Number of the interview's first frame in the names of its files; 0 without numbers, and until it is read.
    pub first_number: i64,
    /// Frames per second.
    pub frame_rate: f64,
    pub playing: bool,
    /// True if playback loops between the in and out points; false if it stops at the out point.
    pub loops: bool,
}

impl Playback {
    /// Playback, at rest, of this many frames.
    pub(super) fn new(frames: usize, frame_rate: f64) -> Self {
        Self { frames, first_number: 0, frame_rate, playing: false, loops: true }
    }
}
