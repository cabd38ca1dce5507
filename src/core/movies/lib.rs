//! Movies and sequences of pictures, read frame by frame through the system's ffmpeg.
//!
//! ffmpeg runs as a separate process: nothing is linked, and a damaged file can only crash the decoder. Frame 12
//! is the thirteenth frame in presentation order, however it is reached: an index holds the time of each frame,
//! and each decoded frame is identified by its time.

mod cache;
mod index;
mod info;
mod movie;
mod process;
mod raw;
mod reader;
mod sequence;
mod series;
mod source;
#[cfg(test)]
mod tests;

pub use info::Info;
pub use movie::Movie;
pub use process::{Tools, kill_group};
pub use sequence::{Sequence, pictures};
pub use series::{Series, listed};
pub use source::{Source, is_movie, open};

use imaging::{Encoded, Mask, Raster};

/// A decoded frame: `width × height` pixels of three or four 16-bit codes, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Columns and rows.
    pub size: (usize, usize),
    /// True if each pixel has an alpha after red, green and blue.
    pub has_alpha: bool,
    /// The codes, from 0 to 65535.
    pub codes: Vec<u16>,
}

impl Pixels {
    fn channels(&self) -> usize {
        3 + usize::from(self.has_alpha)
    }

    /// Red, green and blue as encoded values in `[0, 1]`.
    pub fn encoded(&self) -> Encoded {
        let (width, height) = self.size;
        let pixels = self.codes.chunks_exact(self.channels());
        let pixels = pixels.map(|p| [p[0], p[1], p[2]].map(unit)).collect();
        Encoded(Raster { width, height, pixels })
    }

    /// Alpha as linear coverage in `[0, 1]`; `None` if there is none.
    pub fn alpha(&self) -> Option<Mask> {
        let (width, height) = self.size;
        let pixels = self.codes.chunks_exact(4).map(|p| unit(p[3]));
        self.has_alpha.then(|| Raster { width, height, pixels: pixels.collect() })
    }
}

fn unit(code: u16) -> f32 {
    f32::from(code) / 65535.0
}
